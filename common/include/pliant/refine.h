// refine.h: the topology of one subdivision step: every triangle of a closed mesh becomes four.
//
// Children are ordered as hierarchy.h says. The odd vertices get the numbers that follow the
// mesh's, in the order in which they first appear on the sides of the faces: who knows a level's
// faces knows those of all finer ones. Half-edges and twins are those of halfedge.h; the mesh has
// been checked by pliant_halfedge_match, or is one that these functions made.
#pragma once

#include "pliant/base.h"

// odd[3 face_count] = the odd vertex on each half-edge; 3/2 face_count of them are new. `parents`,
// shape [3/2 face_count][2] or NULL, takes the ends of the edge that each divides, ascending.
void pliant_refine_number(int32_t vertex_count, int32_t face_count, const int32_t *faces,
                          const int32_t *twin, int32_t *odd, int32_t *parents);
// Replace the faces by their children, in place: `faces` has room for [4 face_count][3].
void pliant_refine_faces(int32_t face_count, const int32_t *odd, int32_t *faces);
// Replace the twins by the children's, in place: `twin` has room for [4 face_count][3]. Depends on
// the order of the children alone, not on vertex numbers.
void pliant_refine_twins(int32_t face_count, int32_t *twin);
