// footprint.h: which hats end within a set of vertices.
//
// A hat of a coarse level that reaches beyond a contact presses where nobody touches. So a node
// gets the coarsest hat that is zero at every vertex outside the set. All hats of a set together,
// one a vertex, span what its vertices' own hats do: each is its vertex's plus some of odd vertices
// on finer levels, which are in the set. For the same reason a hat whose odd children on the next
// level are all nodes may give way to that level's: the span stays.
#pragma once

#include "model.h"

typedef struct pliant_footprint {
    const pliant_model *model;  // borrowed
    // Odd children of a vertex on level l + 1 that are in the free domain: shape [|K(l)|] each.
    int32_t *child_count[PLIANT_LEVEL_LIMIT];
    int32_t *found;  // shape [n], zero between calls
} pliant_footprint;

void pliant_footprint_lay_out(pliant_arena *arena, const pliant_model *model,
                              pliant_footprint *footprint);
// After the carving pass, once.
void pliant_footprint_begin(const pliant_model *model, pliant_footprint *footprint);

// Of a set of free vertices, shape [count], ascending: levels[i] becomes the coarsest level on
// which the hat of vertices[i] ends within the set. The finest always does. index_of, shape [n]:
// below 0 outside the set.
void pliant_footprint_fit(pliant_footprint *footprint, const int32_t *vertices, int32_t count,
                          const int32_t *index_of, int32_t *levels);

// Of nodes, vertices ascending, with hats on these levels: move each to the finest level that
// leaves the span of all as it is.
void pliant_footprint_refine(pliant_footprint *footprint, const int32_t *vertices, int32_t count,
                             int32_t *levels);
