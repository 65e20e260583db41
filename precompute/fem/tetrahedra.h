// tetrahedra.h: a solid cut into tetrahedra whose boundary is the model's surface, linear or
// quadratic.
//
// Nodes: the surface's vertices with their own numbers, then inner corners, then (quadratic) the
// midpoints of edges. Edges are straight. A quadratic tetrahedron lists its corners 0 1 2 3, then
// the midpoints of 01 02 03 12 13 23; a quadratic face its corners 0 1 2, then those of 01 12 20.
#pragma once

#include "pliant/mesh.h"

typedef struct pliant_tetrahedra {
    int32_t order;          // 1 or 2
    int32_t surface_count;  // n
    int32_t corner_count, node_count;
    int32_t tet_count, tet_nodes;    // 4 or 10
    int32_t face_count, face_nodes;  // 3 or 6
    double *nodes;                   // shape [node_count][3]
    int32_t *tets;                   // shape [tet_count][tet_nodes], positive volumes
    int32_t *regions;                // shape [tet_count]: 0 .. , whose material
    int32_t *faces;  // shape [face_count][face_nodes]: the model's faces in their order
    int32_t *ends;   // shape [node_count - corner_count][2]: an edge's corners
} pliant_tetrahedra;

// Corners and tetrahedra as a mesher or a file has them; borrowed during the call. The first n
// nodes are the surface's vertices. `name` is for messages.
typedef struct pliant_tetrahedra_def {
    const char *name;
    int32_t node_count, tet_count;
    const double *nodes;     // shape [node_count][3]
    const int32_t *tets;     // shape [tet_count][4], either orientation
    const int32_t *regions;  // shape [tet_count]; NULL: all 0
} pliant_tetrahedra_def;

// Linear tetrahedra. Nodes of no tetrahedron are left out. Refuses flat tetrahedra, surface
// vertices that no tetrahedron uses, and a boundary that is not the surface, face by face.
PLIANT_UNUSED_RESULT pliant_status pliant_tetrahedra_create(const pliant_mesh *surface,
                                                            const pliant_tetrahedra_def *def,
                                                            pliant_tetrahedra **tetrahedra,
                                                            pliant_error *err);
// From linear to quadratic, in place.
PLIANT_UNUSED_RESULT pliant_status pliant_tetrahedra_raise(pliant_tetrahedra *tetrahedra,
                                                           pliant_error *err);
// Room for counts that are filled in, for a copy.
PLIANT_UNUSED_RESULT pliant_status pliant_tetrahedra_allocate(pliant_tetrahedra *tetrahedra,
                                                              pliant_error *err);
void pliant_tetrahedra_destroy(pliant_tetrahedra *tetrahedra);  // NULL is fine

// The vertices that a node of an edge follows when they are held, and how far; a vertex follows
// itself.
typedef struct pliant_following {
    int count;
    int32_t vertex[2];
    double weight;
} pliant_following;
pliant_following pliant_tetrahedra_follow(const pliant_tetrahedra *tetrahedra, int32_t node);

double pliant_tetrahedra_face_area(const pliant_tetrahedra *tetrahedra, int32_t face);

// The smallest quality of all, 12 (3 V)^(2/3) / (sum of squared edges): 1 regular, 0 flat.
double pliant_tetrahedra_quality(const pliant_tetrahedra *tetrahedra);
