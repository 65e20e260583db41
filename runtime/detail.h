// detail.h: what a detail holds: sparse rows of the limit surface, and the shape at rest.
#pragma once

#include "pliant/arena.h"
#include "pliant/pliant.h"

#include <stddef.h>

// Const after create and shared by all threads. N vertices.
struct pliant_detail {
    pliant_arena arena;
    pliant_detail_info info;
    const int32_t *source_index;  // shape [N]; borrowed from the model
    // Row v of the limit surface: entries offset[v] .. offset[v + 1]. Weights are those of
    // position, along, across; the tangents' divided by their lengths at rest, so that their
    // squares are near 1 whatever the unit. One float more may be read.
    size_t *offset;   // shape [N + 1]
    int32_t *column;  // control vertex of each entry
    float *weight;    // shape [entries][3] and one more
    // At rest, by component c: rest[v][c] = position, along, across of the limit surface, and
    // offset along axis c of the frame; shape [N][3][4].
    float *rest;
    int32_t *faces;        // shape [face_count][3]
    int32_t *ring_offset;  // shape [N + 1]
    int32_t *ring;         // neighbours of each vertex, counterclockwise
    float inverse_length;  // 1 / a typical edge: normals are summed in these units
};
