// halfedge.h: which triangle lies across an edge of a closed triangle mesh.
//
// Half-edge h = 3 f + k is side k of face f: it runs from faces[h] to the face's next corner. Its
// twin is the same edge seen from the triangle across, running the other way.
#pragma once

#include "pliant/base.h"

// Most faces whose half-edges int32_t numbers.
#define PLIANT_HALFEDGE_FACE_LIMIT (INT32_MAX / 3)

// The next and previous side of the same face.
static inline int32_t pliant_halfedge_next(int32_t h)
{
    return h % 3 == 2 ? h - 2 : h + 1;
}

static inline int32_t pliant_halfedge_previous(int32_t h)
{
    return h % 3 == 0 ? h + 2 : h - 1;
}

// Fill twin[3 face_count]. Refuses with PLIANT_ERR_FORMAT, naming face and vertices, what does not
// bound a solid: corners out of range or repeated, open edges, edges of more than two triangles or
// of two that disagree in orientation, vertices that no face uses, that fewer than three faces
// surround, or where two fans touch. Linear time and memory, whatever the valences.
PLIANT_UNUSED_RESULT pliant_status pliant_halfedge_match(int32_t vertex_count, int32_t face_count,
                                                         const int32_t *faces, int32_t *twin,
                                                         pliant_error *err);
