// conditions.h: the boundary conditions that a script has set, and the solver that holds them.
//
// A pliant_solver has fixed capacities; a script has none. This keeps every vertex that is not in
// its reference condition, on the level that the last statement about it named, so that when the
// solver runs out of room a larger one is created and handed the state. Others may act on the
// solver beside the conditions: they ask for room, and follow when it is replaced. Nothing else
// allocates after create.
#pragma once

#include "pliant/pliant.h"

typedef enum pliant_condition_kind {
    PLIANT_CONDITION_DISPLACED,  // free vertex, prescribed displacement, m
    PLIANT_CONDITION_PRESSED,    // prescribed traction, N/m^2
    PLIANT_CONDITION_SUPPORTED,  // fixed vertex, prescribed displacement, m
} pliant_condition_kind;

// A node that is not in its reference condition.
typedef struct pliant_condition {
    pliant_node node;
    pliant_condition_kind kind;
    pliant_vec3 value;
} pliant_condition;

typedef struct pliant_conditions pliant_conditions;

PLIANT_UNUSED_RESULT pliant_status pliant_conditions_create(const pliant_model *model,
                                                            pliant_compliance compliance,
                                                            pliant_conditions **conditions,
                                                            pliant_error *err);
void pliant_conditions_destroy(pliant_conditions *conditions);  // NULL is fine

// Nodes must be in the model's range. A refusal is the solver's, and has no effect.
PLIANT_UNUSED_RESULT pliant_status pliant_conditions_set(pliant_conditions *conditions,
                                                         const pliant_condition *condition);
PLIANT_UNUSED_RESULT pliant_status pliant_conditions_set_gravity(pliant_conditions *conditions,
                                                                 pliant_vec3 acceleration);
// A vertex of the model back to its reference condition, whatever level that was stated on.
PLIANT_UNUSED_RESULT pliant_status pliant_conditions_drop(pliant_conditions *conditions,
                                                          int32_t vertex);
void pliant_conditions_drop_all(pliant_conditions *conditions);  // gravity too

// In no particular order; borrowed until the next change.
const pliant_condition *pliant_conditions_list(const pliant_conditions *conditions, int32_t *count);
pliant_vec3 pliant_conditions_gravity(const pliant_conditions *conditions);
int pliant_conditions_has(const pliant_conditions *conditions, int32_t vertex);  // 1: has one
// Has room for all conditions. Borrowed until the next change; change conditions through this file
// only.
pliant_solver *pliant_conditions_solver(const pliant_conditions *conditions);

// Room in the solver beyond the conditions, for others that act on it, from now on; and passive
// compliance, if that is asked for, for good. May replace the solver.
PLIANT_UNUSED_RESULT pliant_status pliant_conditions_require(pliant_conditions *conditions,
                                                             pliant_compliance compliance,
                                                             int32_t constraints, int32_t loads,
                                                             pliant_error *err);
// Who else acts on the solver: called with the one that takes over, which holds the conditions,
// while the old one is there still. A refusal keeps the old one. NULL: nobody.
typedef pliant_status (*pliant_conditions_follower)(void *context, pliant_solver *solver);
void pliant_conditions_follow(pliant_conditions *conditions, pliant_conditions_follower follower,
                              void *context);
