// contact_levels.h: on which level the nodes are, place by place.
//
// A hat is the sum of its children's on the next level, itself and half of each odd neighbour
// (GF-53), so a node may be replaced by these wherever more detail is wanted. Every vertex has a
// level for its node; a node of level l exists when it is of the coarsest level or the child of
// one that was replaced, and is in force while it is not replaced itself. So no two nodes share a
// vertex, what coarser ones can express stays expressible, and all hats in force are independent.
//
// This follows: E. Grinspun, P. Krysl, P. Schroeder, CHARMS: a simple framework for adaptive
// simulation, SIGGRAPH 2002.
#pragma once

#include "model.h"

typedef struct pliant_contact_levels {
    const pliant_model *model;  // borrowed
    int32_t coarsest, finest;   // of nodes
    uint8_t *first;             // shape [n]: the level on which a vertex appears
    uint8_t *level;             // shape [n]: of its node
    int32_t *child_begin;       // shape [n + 1]: odd vertices on edges that end at a vertex,
    int32_t *children;          // ascending and so coarse to fine
    int32_t refined_count;
    int32_t *refined;     // shape [m]: vertices whose node was replaced, in no order
    int32_t *refined_at;  // shape [n]: where in that list, or -1
} pliant_contact_levels;

// The nodes of a level whose hats are not zero at a vertex, and their values there.
typedef struct pliant_hat_values {
    int32_t count;
    int32_t vertex[3];
    double value[3];
} pliant_hat_values;

void pliant_contact_levels_lay_out(pliant_arena *arena, const pliant_model *model,
                                   pliant_contact_levels *levels);
// After the carving pass: all nodes on the coarsest level.
void pliant_contact_levels_begin(pliant_contact_levels *levels, int32_t coarsest, int32_t finest);

// At a free vertex, of hats on `level`.
pliant_hat_values pliant_contact_levels_hats(const pliant_contact_levels *levels, int32_t level,
                                             int32_t vertex);
// The same from those on the next finer level, or from the vertex itself on its first.
pliant_hat_values pliant_contact_levels_coarser(const pliant_contact_levels *levels, int32_t level,
                                                const pliant_hat_values *finer);
// Does a free vertex have a node in force?
int32_t pliant_contact_levels_exists(const pliant_contact_levels *levels, int32_t vertex);
// Replace the coarsest nodes in force whose hats are not zero at the vertex by their children.
// Returns how many, 0 when the vertex has its own or there is no finer level. `replaced` takes
// their vertices.
int32_t pliant_contact_levels_refine(pliant_contact_levels *levels, int32_t vertex,
                                     int32_t replaced[3]);
// Replace this one, when it has children.
int32_t pliant_contact_levels_replace(pliant_contact_levels *levels, int32_t vertex);
// May a vertex's node go back to the level it was replaced on? Not while a child is replaced.
int32_t pliant_contact_levels_may_coarsen(const pliant_contact_levels *levels, int32_t vertex);
void pliant_contact_levels_coarsen(pliant_contact_levels *levels, int32_t vertex);

// The children of a vertex on a level above its first: range in `children`.
typedef struct pliant_child_range {
    int32_t begin, end;
} pliant_child_range;
pliant_child_range pliant_contact_levels_children(const pliant_contact_levels *levels,
                                                  int32_t vertex, int32_t level);
