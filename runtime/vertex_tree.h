// vertex_tree.h: which vertices may be near a tool: a tree of balls over their rest positions.
//
// A distance changes by no more than one moves, so a ball of radius r about c holds nothing within
// `reach` of a tool whose distance from c is above reach + r. Shapes need not be known.
#pragma once

#include "pliant/arena.h"
#include "tool.h"

typedef struct pliant_vertex_tree {
    int32_t count;       // vertices
    int32_t leaf_count;  // a power of two; the tree's nodes are 1 .. 2 leaf_count - 1, heap order
    int32_t *vertices;   // shape [count], by leaves
    int32_t *begin;      // shape [leaf_count + 1]: a leaf's vertices
    double *ball;        // shape [2 leaf_count][4]: centre and radius; below 0: empty
} pliant_vertex_tree;

void pliant_vertex_tree_lay_out(pliant_arena *arena, int32_t count, pliant_vertex_tree *tree);
// After the carving pass, over `vertices`, shape [count], at `positions`, shape [n][3]. Both are
// read during the call only.
void pliant_vertex_tree_build(pliant_vertex_tree *tree, const int32_t *vertices,
                              const double *positions);
// List the vertices of all leaves that come within `reach` of the tool; `found` has shape [count].
// Returns how many.
int32_t pliant_vertex_tree_near(const pliant_vertex_tree *tree, const pliant_tool_shape *shape,
                                double reach, int32_t *found);
