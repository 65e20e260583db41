// statements.c: what the caller says about the boundary: displace, press, support, gravity,
// release.
//
// Every vertex is in one of three conditions: reference (nothing said), load (a specified value of
// the reference type other than zero's default) or constraint (in S, type changed). A statement
// moves it between them; a load that was summed stays listed until the next solve has taken it out.
#include "solver.h"

#include <math.h>
#include <string.h>

// ---- Checks ----

static pliant_status check_node(const pliant_solver *solver, pliant_node node)
{
    const pliant_model *model = solver->model;
    if (node.level < 0 || node.level > model->finest_level || node.vertex < 0 ||
        node.vertex >= model->hierarchy->vertex_count[node.level])
        return PLIANT_ERR_ARGUMENT;
    return node.level == model->finest_level ? PLIANT_OK : PLIANT_ERR_MISSING;
}

static pliant_status check(const pliant_solver *solver, pliant_node node, pliant_vec3 value)
{
    if (!isfinite(value.x) || !isfinite(value.y) || !isfinite(value.z)) return PLIANT_ERR_ARGUMENT;
    return check_node(solver, node);
}

// ---- Constraints ----

int32_t pliant_constraint_find(const pliant_constraint *constraints, int32_t count, int32_t vertex)
{
    int32_t begin = 0, end = count;
    while (begin < end) {
        const int32_t middle = begin + (end - begin) / 2;
        if (constraints[middle].vertex == vertex) return middle;
        if (constraints[middle].vertex < vertex) begin = middle + 1;
        else end = middle;
    }
    return -1 - begin;
}

static void drop_constraint(pliant_solver *solver, int32_t vertex)
{
    const int32_t i = pliant_constraint_find(solver->constraints, solver->constraint_count, vertex);
    if (i < 0) return;
    solver->constraint_count--;
    memmove(solver->constraints + i, solver->constraints + i + 1,
            (size_t)(solver->constraint_count - i) * sizeof *solver->constraints);
}

// ---- Loads ----

static void drop_load(pliant_solver *solver, int32_t vertex)
{
    const int32_t i = solver->load_of[vertex];
    if (i < 0 || !solver->loads[i].is_specified) return;
    solver->loads[i].is_specified = 0;
    solver->loads[i].value = (pliant_vec3){0, 0, 0};
    solver->specified_count--;
    solver->loads_changed = 1;
    const pliant_vec3 summed = solver->loads[i].summed;
    if (summed.x != 0 || summed.y != 0 || summed.z != 0) return;
    // Not in any sum, so it may go at once: then summed and specified loads never exceed twice the
    // capacity together.
    solver->load_of[vertex] = -1;
    solver->loads[i] = solver->loads[--solver->load_count];
    if (i < solver->load_count) solver->load_of[solver->loads[i].vertex] = i;
}

static pliant_status set_load(pliant_solver *solver, int32_t vertex, pliant_vec3 value)
{
    int32_t i = solver->load_of[vertex];
    if (i < 0 || !solver->loads[i].is_specified) {
        if (solver->specified_count == solver->load_capacity) return PLIANT_ERR_CAPACITY;
        solver->specified_count++;
    }
    if (i < 0) {
        i = solver->load_of[vertex] = solver->load_count++;
        solver->loads[i] = (pliant_load){.vertex = vertex, .weight = {-1, -1}};
    }
    solver->loads[i].is_specified = 1;
    solver->loads[i].value = value;
    solver->loads_changed = 1;
    drop_constraint(solver, vertex);
    return PLIANT_OK;
}

static pliant_status set_constraint(pliant_solver *solver, int32_t vertex, pliant_vec3 value)
{
    int32_t i = pliant_constraint_find(solver->constraints, solver->constraint_count, vertex);
    if (i < 0) {
        if (solver->constraint_count == solver->constraint_capacity) return PLIANT_ERR_CAPACITY;
        i = -1 - i;
        memmove(solver->constraints + i + 1, solver->constraints + i,
                (size_t)(solver->constraint_count - i) * sizeof *solver->constraints);
        solver->constraint_count++;
        solver->constraints[i].vertex = vertex;
        drop_load(solver, vertex);
    }
    solver->constraints[i].value = value;
    return PLIANT_OK;
}

// ---- Statements ----

pliant_status pliant_solver_displace(pliant_solver *solver, pliant_node node, pliant_vec3 u)
{
    const pliant_status status = check(solver, node, u);
    if (status < 0) return status;
    if (solver->model->domain[node.vertex] != PLIANT_DOMAIN_FREE) return PLIANT_ERR_ARGUMENT;
    return set_constraint(solver, node.vertex, u);
}

pliant_status pliant_solver_press(pliant_solver *solver, pliant_node node, pliant_vec3 p)
{
    const pliant_status status = check(solver, node, p);
    if (status < 0) return status;
    if (solver->model->domain[node.vertex] == PLIANT_DOMAIN_FREE)
        return set_load(solver, node.vertex, p);
    if (solver->domain_count < 2) return PLIANT_ERR_MISSING;
    return set_constraint(solver, node.vertex, p);
}

pliant_status pliant_solver_support(pliant_solver *solver, pliant_node node, pliant_vec3 u)
{
    const pliant_status status = check(solver, node, u);
    if (status < 0) return status;
    if (solver->model->domain[node.vertex] != PLIANT_DOMAIN_FIXED) return PLIANT_ERR_ARGUMENT;
    if (solver->domain_count < 2) return PLIANT_ERR_MISSING;
    return set_load(solver, node.vertex, u);
}

pliant_status pliant_solver_gravity(pliant_solver *solver, pliant_vec3 acceleration)
{
    if (!isfinite(acceleration.x) || !isfinite(acceleration.y) || !isfinite(acceleration.z))
        return PLIANT_ERR_ARGUMENT;
    solver->gravity = acceleration;
    solver->loads_changed = 1;
    return PLIANT_OK;
}

pliant_status pliant_solver_release(pliant_solver *solver, pliant_node node)
{
    const pliant_status status = check_node(solver, node);
    if (status < 0) return status;
    drop_constraint(solver, node.vertex);
    drop_load(solver, node.vertex);
    return PLIANT_OK;
}

void pliant_solver_release_all(pliant_solver *solver)
{
    solver->constraint_count = 0;
    for (int32_t i = solver->load_count; i-- > 0;) drop_load(solver, solver->loads[i].vertex);
    solver->gravity = (pliant_vec3){0, 0, 0};
    solver->loads_changed = 1;
}

int32_t pliant_solver_constraint_count(const pliant_solver *solver)
{
    return solver->constraint_count;
}
