// multires.h: a mesh in coarse-to-fine order with its levels, as the model file stores it.
#pragma once

#include "pliant/hierarchy.h"
#include "pliant/mesh.h"

typedef struct pliant_multires {
    pliant_mesh *mesh;  // finest level; vertices coarse to fine, faces in hierarchy.h's child order
    int32_t level_count;                           // L + 1
    int32_t vertex_count[PLIANT_LEVEL_LIMIT + 1];  // |K(l)|
    int32_t *parents;       // shape [n - vertex_count[0]][2], ascending in each row
    int32_t *source_index;  // shape [n]: vertex of the input mesh, or -1 where subdivision made it
    pliant_error note;      // one line that the user should see, or an empty text
} pliant_multires;

// Room for the levels of a closed mesh of `vertex_count` vertices and `face_count` faces on level
// 0: counts filled in, the rest unset. Refuses, with figures, counts that int32_t does not hold.
PLIANT_UNUSED_RESULT pliant_status pliant_multires_create(int32_t vertex_count, int32_t face_count,
                                                          int32_t level_count,
                                                          pliant_multires **multires,
                                                          pliant_error *err);
void pliant_multires_destroy(pliant_multires *multires);  // NULL is fine

typedef enum pliant_subdivision_scheme {
    PLIANT_SUBDIVIDE_LOOP,       // smooths base vertices too (plain steps, not limit positions)
    PLIANT_SUBDIVIDE_BUTTERFLY,  // interpolates: the modified butterfly
    PLIANT_SUBDIVIDE_MIDPOINT,   // keeps the surface: splits faces flat
} pliant_subdivision_scheme;

// Subdivide a closed manifold mesh `levels` times (0: only the order of the arrays). Base vertices
// keep their numbers, whatever their positions become (Loop smooths them), and base faces theirs.
// The odd vertices of a level are numbered as they first appear on the sides of its faces in order.
PLIANT_UNUSED_RESULT pliant_status pliant_multires_subdivide(const pliant_mesh *base,
                                                             int32_t levels,
                                                             pliant_subdivision_scheme scheme,
                                                             pliant_multires **multires,
                                                             pliant_error *err);

// Find the subdivision connectivity of a closed manifold mesh, whatever its vertex and face order:
// as many levels as all its components have. Vertices that appear on one level keep the input's
// order among themselves, base faces are ordered by the first of the input's faces in them, and
// what pliant_multires_subdivide made comes back as it was. The note says when some components
// could be coarser than others. PLIANT_ERR_MISSING, with where and what to do instead, when there
// is not even one level.
PLIANT_UNUSED_RESULT pliant_status pliant_multires_detect(const pliant_mesh *mesh,
                                                          pliant_multires **multires,
                                                          pliant_error *err);
