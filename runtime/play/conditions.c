// conditions.c: the boundary conditions that a script has set, and the solver that holds them.
#include "conditions.h"

#include "pliant/error.h"

#include <stdlib.h>

struct pliant_conditions {
    const pliant_model *model;
    pliant_solver_def solver_def;
    pliant_solver *solver;
    pliant_condition *list;  // [n]: a vertex has one at most
    int32_t count;
    pliant_vec3 gravity;
    int32_t *slot;  // [n] 1 + the place in list of a vertex; 0 in the reference condition
    int32_t vertex_count;
    int32_t spare_constraints, spare_loads;  // what others have asked for
    pliant_conditions_follower follower;     // may be NULL
    void *follower_context;
};

typedef enum growth {
    GROW_CONSTRAINTS = 1,
    GROW_LOADS = 2,
    GROW_BOTH = 3,
} growth;

pliant_status pliant_conditions_create(const pliant_model *model, pliant_compliance compliance,
                                       pliant_conditions **conditions, pliant_error *err)
{
    pliant_conditions *c = calloc(1, sizeof *c);
    if (!c) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a script's state");
    c->model = model;
    c->vertex_count = pliant_model_describe(model).vertex_count;
    c->slot = calloc((size_t)c->vertex_count, sizeof *c->slot);
    c->list = calloc((size_t)c->vertex_count, sizeof *c->list);
    c->solver_def = pliant_solver_default(model);
    c->solver_def.compliance = compliance;
    pliant_status status = PLIANT_OK;
    if (!c->slot || !c->list)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the state of %d vertices",
                                  (int)c->vertex_count);
    if (status == PLIANT_OK) status = pliant_solver_create(model, &c->solver_def, &c->solver, err);
    if (status < 0) {
        pliant_conditions_destroy(c);
        return status;
    }
    *conditions = c;
    return PLIANT_OK;
}

void pliant_conditions_destroy(pliant_conditions *conditions)
{
    if (!conditions) return;
    pliant_solver_destroy(conditions->solver);
    free(conditions->list);
    free(conditions->slot);
    free(conditions);
}

// ---- The solver's room ----

static pliant_status apply(pliant_solver *solver, const pliant_condition *condition)
{
    switch (condition->kind) {
    case PLIANT_CONDITION_DISPLACED:
        return pliant_solver_displace(solver, condition->node, condition->value);
    case PLIANT_CONDITION_PRESSED:
        return pliant_solver_press(solver, condition->node, condition->value);
    case PLIANT_CONDITION_SUPPORTED:
        return pliant_solver_support(solver, condition->node, condition->value);
    }
    return PLIANT_ERR_ARGUMENT;
}

// Replace the solver by one of this definition with the same state; on failure the old one stays.
static pliant_status replace(pliant_conditions *conditions, const pliant_solver_def *def,
                             pliant_error *err)
{
    pliant_solver *solver = NULL;
    pliant_status status = pliant_solver_create(conditions->model, def, &solver, err);
    if (status < 0) return status;
    const pliant_vec3 g = conditions->gravity;
    if (g.x != 0 || g.y != 0 || g.z != 0) status = pliant_solver_gravity(solver, g);
    for (int32_t i = 0; status >= 0 && i < conditions->count; i++)
        status = apply(solver, &conditions->list[i]);
    if (status >= 0 && conditions->follower)
        status = conditions->follower(conditions->follower_context, solver);
    if (status < 0) {
        pliant_solver_destroy(solver);
        return pliant_error_set(err, status, "the state of a script on a larger solver: %s",
                                pliant_status_name(status));
    }
    pliant_solver_destroy(conditions->solver);
    conditions->solver = solver;
    conditions->solver_def = *def;
    return PLIANT_OK;
}

// Twice a capacity, at most one place per vertex. Returns 0 when it was that already.
static int enlarge(int32_t *capacity, int32_t limit)
{
    if (*capacity >= limit) return 0;
    *capacity = *capacity > limit / 2 ? limit : 2 * *capacity;
    return 1;
}

static pliant_status grow(pliant_conditions *conditions, growth what)
{
    pliant_solver_def def = conditions->solver_def;
    int grown = 0;
    if (what & GROW_CONSTRAINTS)
        grown |= enlarge(&def.constraint_capacity, conditions->vertex_count);
    if (what & GROW_LOADS) grown |= enlarge(&def.load_capacity, conditions->vertex_count);
    return grown ? replace(conditions, &def, NULL) : PLIANT_ERR_CAPACITY;
}

// Capacities by doubling until there is room for so many conditions and what others asked for.
static pliant_status reserve(pliant_conditions *conditions, int32_t count,
                             pliant_compliance compliance, pliant_error *err)
{
    pliant_solver_def def = conditions->solver_def;
    const int32_t n = conditions->vertex_count;
    int grown = compliance != def.compliance;
    def.compliance = compliance;
    while (def.constraint_capacity < n &&
           def.constraint_capacity - count < conditions->spare_constraints)
        grown |= enlarge(&def.constraint_capacity, n);
    while (def.load_capacity < n && def.load_capacity - count < conditions->spare_loads)
        grown |= enlarge(&def.load_capacity, n);
    return grown ? replace(conditions, &def, err) : PLIANT_OK;
}

static growth growth_for(const pliant_conditions *conditions, const pliant_condition *condition)
{
    if (condition->kind == PLIANT_CONDITION_DISPLACED) return GROW_CONSTRAINTS;
    // A pressed fixed vertex is both: its type changes, and it carries a load.
    const int is_free = pliant_model_is_free(conditions->model, condition->node.vertex) == 1;
    return condition->kind == PLIANT_CONDITION_PRESSED && !is_free ? GROW_BOTH : GROW_LOADS;
}

// ---- Changes ----

pliant_status pliant_conditions_set(pliant_conditions *conditions,
                                    const pliant_condition *condition)
{
    int32_t *slot = &conditions->slot[condition->node.vertex];
    pliant_status status = PLIANT_OK;
    // A condition is a constraint, a load or both: there is room for either.
    if (*slot == 0 && conditions->spare_constraints + conditions->spare_loads > 0)
        status =
            reserve(conditions, conditions->count + 1, conditions->solver_def.compliance, NULL);
    if (status >= 0) status = apply(conditions->solver, condition);
    while (status == PLIANT_ERR_CAPACITY) {
        status = grow(conditions, growth_for(conditions, condition));
        if (status < 0) return status;
        status = apply(conditions->solver, condition);
    }
    if (status < 0) return status;
    if (*slot == 0) *slot = ++conditions->count;
    conditions->list[*slot - 1] = *condition;
    return PLIANT_OK;
}

pliant_status pliant_conditions_set_gravity(pliant_conditions *conditions, pliant_vec3 acceleration)
{
    const pliant_status status = pliant_solver_gravity(conditions->solver, acceleration);
    if (status >= 0) conditions->gravity = acceleration;
    return status;
}

pliant_status pliant_conditions_drop(pliant_conditions *conditions, int32_t vertex)
{
    // Releasing what is in its reference condition changes nothing, whatever the file holds.
    int32_t *slot = &conditions->slot[vertex];
    if (*slot == 0) return PLIANT_OK;
    const pliant_status status =
        pliant_solver_release(conditions->solver, conditions->list[*slot - 1].node);
    if (status < 0) return status;
    // The last condition takes the place of the dropped one.
    const pliant_condition moved = conditions->list[--conditions->count];
    conditions->list[*slot - 1] = moved;
    conditions->slot[moved.node.vertex] = *slot;
    *slot = 0;
    return PLIANT_OK;
}

void pliant_conditions_drop_all(pliant_conditions *conditions)
{
    pliant_solver_release_all(conditions->solver);
    for (int32_t i = 0; i < conditions->count; i++)
        conditions->slot[conditions->list[i].node.vertex] = 0;
    conditions->count = 0;
    conditions->gravity = (pliant_vec3){0, 0, 0};
}

// ---- Others ----

pliant_status pliant_conditions_require(pliant_conditions *conditions, pliant_compliance compliance,
                                        int32_t constraints, int32_t loads, pliant_error *err)
{
    const int32_t had_constraints = conditions->spare_constraints;
    const int32_t had_loads = conditions->spare_loads;
    // Passive stays passive.
    if (conditions->solver_def.compliance == PLIANT_COMPLIANCE_PASSIVE)
        compliance = PLIANT_COMPLIANCE_PASSIVE;
    if (constraints > had_constraints) conditions->spare_constraints = constraints;
    if (loads > had_loads) conditions->spare_loads = loads;
    const pliant_status status = reserve(conditions, conditions->count, compliance, err);
    if (status < 0) {
        conditions->spare_constraints = had_constraints;
        conditions->spare_loads = had_loads;
    }
    return status;
}

void pliant_conditions_follow(pliant_conditions *conditions, pliant_conditions_follower follower,
                              void *context)
{
    conditions->follower = follower;
    conditions->follower_context = context;
}

// ---- What can be read ----

int pliant_conditions_has(const pliant_conditions *conditions, int32_t vertex)
{
    return conditions->slot[vertex] > 0;
}

const pliant_condition *pliant_conditions_list(const pliant_conditions *conditions, int32_t *count)
{
    *count = conditions->count;
    return conditions->list;
}

pliant_vec3 pliant_conditions_gravity(const pliant_conditions *conditions)
{
    return conditions->gravity;
}

pliant_solver *pliant_conditions_solver(const pliant_conditions *conditions)
{
    return conditions->solver;
}
