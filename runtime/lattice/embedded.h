// embedded.h: the surface that a lattice carries: where its vertices are, and which way they face.
//
// A vertex lies in a cell and goes with the cell's eight corners by trilinear weights (LSM-15). Its
// normal is that of the two tangents carried by the deformation gradient F (LSM-16, 17):
//
//     u = F U, v = F V, n = u x v = cof(F) (U x V) = cof(F) N
//
// so that N alone is kept. Everything is sorted by cell, what a cell's vertices share is computed
// once, and nothing but the results is out of order. Const once made; bodies and threads share it.
#pragma once

#include "pliant/arena.h"
#include "pliant/model_view.h"
#include "pliant/pliant.h"

typedef struct pliant_embedded {
    int32_t vertex_count;   // n
    int32_t cell_count;     // cells that hold vertices
    float rest_share;       // of N, that is added to cof(F) N
    int32_t *corner_slot;   // shape [cell_count][8]: of corner (k & 1, k >> 1 & 1, k >> 2)
    int32_t *first_vertex;  // shape [cell_count + 1], in sorted order
    int32_t *vertex;        // shape [n]: of the model, at each place of the sorted order
    float *offset[3];       // shape [n + 7] each: x, y, z in the cell, 0 .. 1
    float *normal[3];       // shape [n + 7] each: N / (cell size)^2
    pliant_arena arena;
} pliant_embedded;

// What it is made of; everything is only read during the call.
typedef struct pliant_embedded_def {
    int32_t vertex_count, cell_count;
    const int32_t *cell;          // shape [vertex_count]
    const float *offset;          // shape [vertex_count][3]
    const float *tangents;        // shape [vertex_count][2][3]
    const int32_t *corner_slots;  // shape [cell_count][8]: x in a block array, y 8 further, z 16
    float cell_size;              // m
} pliant_embedded_def;

PLIANT_UNUSED_RESULT pliant_status pliant_embedded_create(const pliant_embedded_def *def,
                                                          pliant_embedded **embedded,
                                                          pliant_error *err);
void pliant_embedded_destroy(pliant_embedded *embedded);  // NULL is fine

// The vertices at the places first .. last - 1 of the sorted order, from positions x in blocks. The
// results, shape [n] each, go to the vertices' own numbers; either may be NULL. Threads may share
// the work by ranges; the results are the same bits. Normals are unit vectors; where a cell has
// lost its extent so that there is none, the one at rest.
void pliant_embedded_evaluate(const pliant_embedded *embedded, const float *x, int32_t first,
                              int32_t last, pliant_vec3 *positions, pliant_vec3 *normals);
