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

static pliant_status check(const pliant_solver *solver, pliant_node node, pliant_vec3 value)
{
    if (!isfinite(value.x) || !isfinite(value.y) || !isfinite(value.z)) return PLIANT_ERR_ARGUMENT;
    return pliant_model_check_node(solver->model, node);
}

// ---- Constraints ----

int32_t pliant_constraint_find(const pliant_constraint *constraints, int32_t count, int32_t vertex)
{
    int32_t begin = 0, end = count;
    while (begin < end) {
        const int32_t middle = begin + (end - begin) / 2;
        if (constraints[middle].node.vertex == vertex) return middle;
        if (constraints[middle].node.vertex < vertex) begin = middle + 1;
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

void pliant_loads_forget(pliant_solver *solver, int32_t i)
{
    // A vertex whose load has changed levels has two until the next solve.
    int32_t *load_of = solver->load_of;
    if (load_of[solver->loads[i].node.vertex] == i) load_of[solver->loads[i].node.vertex] = -1;
    const int32_t last = --solver->load_count;
    if (i == last) return;
    solver->loads[i] = solver->loads[last];
    if (load_of[solver->loads[i].node.vertex] == last) load_of[solver->loads[i].node.vertex] = i;
}

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
    pliant_loads_forget(solver, i);
}

static int32_t search_loads(const pliant_solver *solver, pliant_node node)
{
    for (int32_t i = 0; i < solver->load_count; i++)
        if (solver->loads[i].node.vertex == node.vertex &&
            solver->loads[i].node.level == node.level)
            return i;
    return -1;
}

int32_t pliant_loads_find(const pliant_solver *solver, pliant_node node)
{
    const int32_t now = solver->load_of[node.vertex];
    if (now < 0 || solver->loads[now].node.level == node.level) return now;
    return search_loads(solver, node);
}

void pliant_loads_set(pliant_solver *solver, pliant_node node, pliant_vec3 value)
{
    int32_t i = solver->load_of[node.vertex];
    if (i >= 0 && solver->loads[i].node.level != node.level) {
        // What the vertex had on another level leaves the sum with the next solve; what it had on
        // this one may not have left yet.
        drop_load(solver, node.vertex);
        i = search_loads(solver, node);
        solver->load_of[node.vertex] = i;
    }
    if (i < 0) {
        i = solver->load_of[node.vertex] = solver->load_count++;
        solver->loads[i] = (pliant_load){.node = node, .weight = {-1, -1}};
    }
    solver->specified_count += !solver->loads[i].is_specified;
    solver->loads[i].is_specified = 1;
    solver->loads[i].value = value;
    solver->loads_changed = 1;
    drop_constraint(solver, node.vertex);
}

static pliant_status set_load(pliant_solver *solver, pliant_node node, pliant_vec3 value)
{
    const int32_t i = solver->load_of[node.vertex];
    if ((i < 0 || !solver->loads[i].is_specified) &&
        solver->specified_count == solver->load_capacity)
        return PLIANT_ERR_CAPACITY;
    pliant_loads_set(solver, node, value);
    return PLIANT_OK;
}

static pliant_status set_constraint(pliant_solver *solver, pliant_node node, pliant_vec3 value)
{
    int32_t i =
        pliant_constraint_find(solver->constraints, solver->constraint_count, node.vertex);
    if (i < 0) {
        if (solver->constraint_count == solver->constraint_capacity) return PLIANT_ERR_CAPACITY;
        i = -1 - i;
        memmove(solver->constraints + i + 1, solver->constraints + i,
                (size_t)(solver->constraint_count - i) * sizeof *solver->constraints);
        solver->constraint_count++;
        drop_load(solver, node.vertex);
    }
    solver->constraints[i] = (pliant_constraint){node, value};
    return PLIANT_OK;
}

// ---- Statements ----

pliant_status pliant_solver_displace(pliant_solver *solver, pliant_node node, pliant_vec3 u)
{
    const pliant_status status = check(solver, node, u);
    if (status < 0) return status;
    if (solver->model->domain[node.vertex] != PLIANT_DOMAIN_FREE) return PLIANT_ERR_ARGUMENT;
    return set_constraint(solver, node, u);
}

pliant_status pliant_solver_press(pliant_solver *solver, pliant_node node, pliant_vec3 p)
{
    const pliant_status status = check(solver, node, p);
    if (status < 0) return status;
    if (solver->model->domain[node.vertex] == PLIANT_DOMAIN_FREE)
        return set_load(solver, node, p);
    if (solver->domain_count < 2) return PLIANT_ERR_MISSING;
    return set_constraint(solver, node, p);
}

pliant_status pliant_solver_support(pliant_solver *solver, pliant_node node, pliant_vec3 u)
{
    const pliant_status status = check(solver, node, u);
    if (status < 0) return status;
    if (solver->model->domain[node.vertex] != PLIANT_DOMAIN_FIXED) return PLIANT_ERR_ARGUMENT;
    if (solver->domain_count < 2) return PLIANT_ERR_MISSING;
    return set_load(solver, node, u);
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
    const pliant_status status = pliant_model_check_node(solver->model, node);
    if (status < 0) return status;
    drop_constraint(solver, node.vertex);
    drop_load(solver, node.vertex);
    return PLIANT_OK;
}

void pliant_solver_release_all(pliant_solver *solver)
{
    solver->constraint_count = 0;
    solver->scratch.held_shift = 0;
    for (int32_t i = solver->load_count; i-- > 0;)
        if (solver->loads[i].is_specified) drop_load(solver, solver->loads[i].node.vertex);
    for (pliant_load_list *list = solver->lists; list; list = list->next)
        pliant_load_list_clear(solver, list);
    solver->gravity = (pliant_vec3){0, 0, 0};
    solver->loads_changed = 1;
}

int32_t pliant_solver_constraint_count(const pliant_solver *solver)
{
    return solver->constraint_count;
}
