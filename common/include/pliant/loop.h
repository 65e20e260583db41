// loop.h: Loop subdivision: the weights of a step, and the limit surface as sparse rows.
//
// This follows: C. Loop, Smooth subdivision surfaces based on triangles, master's thesis,
// University of Utah, 1987; the limit and its tangents come from the eigenvectors of the step
// around a vertex, as in H. Hoppe et al., Piecewise smooth surface reconstruction, SIGGRAPH 1994.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

// A step's odd vertex: these weights of the ends of its edge and of the two corners opposite it.
#define PLIANT_LOOP_END    (3.0 / 8)
#define PLIANT_LOOP_CORNER (1.0 / 8)

// A step's even vertex of valence n:
//   x' = (1 - n beta) x + beta sum of neighbours,  beta = (5/8 - (3/8 + cos(2 pi / n) / 4)^2) / n
double pliant_loop_beta(int32_t valence);
// Where the vertex goes in the end:
//   x_oo = (1 - n chi) x + chi sum of neighbours,  chi = 1 / (n + 3 / (8 beta))
double pliant_loop_chi(int32_t valence);

// What vertex `vertex` of the control mesh contributes to a point of the limit surface and to two
// tangents there, which are not unit vectors and not orthogonal.
typedef struct pliant_loop_entry {
    double position, along, across;
    int32_t vertex;
} pliant_loop_entry;

// The limit of every vertex of the mesh that some Loop steps made of a control mesh. Of a vertex
// with neighbours p_0 .. p_(n-1) on that mesh, counterclockwise, p_0 at the end of the first side,
// in the order of its faces, that leaves the vertex:
//   along  = sum of cos(2 pi i / n) p_i
//   across = sum of sin(2 pi i / n) p_i
// so that along x across looks outwards. Positions sum up to 1, tangents to 0.
typedef struct pliant_loop_limit {
    int32_t vertex_count;        // of the finest level
    size_t *offset;              // shape [vertex_count + 1]: entries of each row
    pliant_loop_entry *entries;  // shape [offset[vertex_count]]; a dozen a row
} pliant_loop_limit;

// `faces[l]`, shape [face_count 4^l][3], are the triangles of levels 0 (the control mesh) to
// step_count, ordered as in hierarchy.h, the vertices of a level before those that the next one
// adds; all are checked or made by refine.h. Read during the call only. PLIANT_ERR_MEMORY also for
// meshes whose rows would be long: valences of hundreds, which cost their square.
PLIANT_UNUSED_RESULT pliant_status
pliant_loop_limit_create(int32_t step_count, int32_t vertex_count, int32_t face_count,
                         const int32_t *const *faces, pliant_loop_limit **limit, pliant_error *err);
void pliant_loop_limit_destroy(pliant_loop_limit *limit);  // NULL is fine

// Position and tangents of row `row`: point[0..2], [3..5] along, [6..8] across. `vertices` has
// shape [control vertices][3].
void pliant_loop_limit_evaluate(const pliant_loop_limit *limit, int32_t row, const double *vertices,
                                double point[9]);

// The orthonormal frame of two tangents: frame[0..2] in the direction of `along`, [6..8] the
// normal, [3..5] = normal x along. Returns the sine of the angle between the tangents, which says
// how well the normal is determined: where it is not above 0 there is none.
double pliant_loop_frame(const double *along, const double *across, double frame[9]);

// Frames with a smaller sine are refused in a mesh at rest: in floats, the normal would be off by
// more than 1e-4.
#define PLIANT_LOOP_LEAST_SINE 1e-3
