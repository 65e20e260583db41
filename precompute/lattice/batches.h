// batches.h: triangles in groups that need few lattice particles each, for shaders (LSM 4, end).
//
// Graphics hardware lets a shaded vertex index a bounded number of positions in constant memory, so
// every batch of triangles uses at most PLIANT_BATCH_LIMIT particles: those at the corners of the
// cells that hold its vertices.
#pragma once

#include "pliant/sections.h"

typedef struct pliant_batches {
    int32_t batch_count;
    int32_t *face_offset;   // shape [batch_count + 1] into faces
    int32_t *faces;         // shape [face_count]: every face once, ascending in each batch
    int32_t *point_offset;  // shape [batch_count + 1] into points
    int32_t *points;        // shape [point_offset[batch_count]]: particles, ascending in each batch
} pliant_batches;

// Greedily: a batch begins with the least face that has none yet, and grows by the face beside it
// that needs the fewest new particles, of several the one that has been beside it for longest; when
// no neighbour fits any more, it is full, and when there are no neighbours it goes on with the
// least face of another component. Most batches are full to a few particles; on closed surfaces all
// of them together name each particle twice. (Beginning beside the last batch made no fewer.)
//   vertex_cell  [vertex_count]       the cell that holds a vertex
//   corners      [cell_count][8]      its particles, of 0 .. particle_count - 1
// The faces are those of a closed surface (as pliant_halfedge_match accepts them).
typedef struct pliant_batches_input {
    int32_t vertex_count, face_count, particle_count;
    const int32_t *faces, *vertex_cell, *corners;
} pliant_batches_input;

PLIANT_UNUSED_RESULT pliant_status pliant_batches_create(const pliant_batches_input *input,
                                                         pliant_batches **batches,
                                                         pliant_error *err);
void pliant_batches_destroy(pliant_batches *batches);  // NULL is fine
