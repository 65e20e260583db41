// hierarchy.h: the levels of a triangle mesh with subdivision connectivity (GF 4.2).
//
// Level 0 is the base mesh; level l+1 splits every triangle of level l into four at its edges'
// midpoints. Vertices are numbered coarse to fine: level l holds vertices 0 .. vertex_count[l]-1,
// which is K(l); those numbered from vertex_count[l] to vertex_count[l+1]-1 are the odd vertices
// M(l). Faces are numbered so that the children of face f = (a, b, c) of level l are the faces
//
//     4f   (a, ab, ca)      4f+1 (b, bc, ab)      4f+2 (c, ca, bc)      4f+3 (ab, bc, ca)
//
// of level l+1, with ab the odd vertex on the edge from a to b. The faces of every level therefore
// follow from those of the finest.
#pragma once

#include "pliant/base.h"

// Deepest hierarchy that a file may hold: 4^15 faces per base face is more than int32_t numbers.
#define PLIANT_LEVEL_LIMIT 15

// The neighbourhood of an odd vertex m of M(l) among the triangles of level l: the ends of its
// parents' edge, the corners opposite to that edge in its two triangles, and the outer corners of
// the four triangles that border those two (the butterfly's wings). Order:
//
//     parents     ascending: parents[0] < parents[1]
//     opposite    [0] in the triangle that runs from parents[0] to parents[1], [1] in the other
//     wings       [0] across the edge of parents[0] and opposite[0]
//                 [1] across the edge of parents[1] and opposite[0]
//                 [2] across the edge of parents[0] and opposite[1]
//                 [3] across the edge of parents[1] and opposite[1]
//
// On coarse meshes vertices may repeat, wings among themselves and with opposite.
typedef struct pliant_stencil {
    int32_t parents[2];
    int32_t opposite[2];
    int32_t wings[4];
} pliant_stencil;

typedef struct pliant_hierarchy {
    int32_t level_count;                           // L + 1
    int32_t vertex_count[PLIANT_LEVEL_LIMIT + 1];  // |K(l)|
    int32_t face_count[PLIANT_LEVEL_LIMIT + 1];
    const int32_t *faces[PLIANT_LEVEL_LIMIT + 1];  // faces[l] has shape [face_count[l]][3]; owned
    // Of every odd vertex v at v - vertex_count[0]: shape [n - vertex_count[0]]; owned.
    const pliant_stencil *stencils;
} pliant_hierarchy;

// Derive all levels from the finest faces and check every claim made (the arrays may come from an
// untrusted file): counts, index ranges, child order, parents, and that every level is closed,
// manifold at edges and vertices, consistently oriented and uses all its vertices. `vertex_count`
// has shape [level_count], `faces` [face_count][3], `parents` [n - vertex_count[0]][2] (in either
// order; may be NULL when level_count is 1); the caller has checked that they are that large. All
// inputs are copied. Memory and time are linear in face_count. PLIANT_ERR_FORMAT names the level,
// the face or vertex, what was expected and what was found.
PLIANT_UNUSED_RESULT pliant_status pliant_hierarchy_create(
    int32_t level_count, const int32_t *vertex_count, int32_t face_count, const int32_t *faces,
    const int32_t *parents, pliant_hierarchy **hierarchy, pliant_error *err);
void pliant_hierarchy_destroy(pliant_hierarchy *hierarchy);  // NULL is fine

// The level on which a vertex first appears.
int32_t pliant_hierarchy_level_of(const pliant_hierarchy *hierarchy, int32_t vertex);
