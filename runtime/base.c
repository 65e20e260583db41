// base.c: step (3) of the algorithm: what is specified outside S, summed and kept up to date.
//
// `base` stays from solve to solve: only what changed is added (GF-11, 12). The rounding error of
// that is bounded as it grows.
#include "solver.h"

#include <math.h>
#include <string.h>

// Rounding of one float operation.
static const double unit_roundoff = 0x1p-24;
// `base` is summed afresh once its drift may exceed this part of the present loads' magnitude. A
// fresh sum of 256 loads has the same bound, so coherence never costs more than a digit of it; and
// drift grows by 2 u a change, so this comes every 128th change or when a much larger load goes.
static const double drift_limit = 256 * 0x1p-24;

static double norm(pliant_vec3 v)
{
    return fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
}

static pliant_vec3 difference(pliant_vec3 a, pliant_vec3 b)
{
    return (pliant_vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static int32_t is_zero(pliant_vec3 v)
{
    return v.x == 0 && v.y == 0 && v.z == 0;
}

// rows += Xi~_j value, on one row domain.
static void add_column(const pliant_solver *solver, int32_t row_domain, pliant_node node,
                       const float *value, float *rows)
{
    const pliant_model *model = solver->model;
    const pliant_columns *columns = pliant_model_columns(model, row_domain, node);
    const uint64_t begin = columns->offset[model->position[node.vertex]];
    const uint64_t end = columns->offset[model->position[node.vertex] + 1];
    solver->add_column(columns->row + begin, columns->block + 9 * begin, (size_t)(end - begin),
                       value, rows);
}

static void add_load(pliant_solver *solver, const pliant_load *load, pliant_vec3 value)
{
    const float numbers[3] = {value.x, value.y, value.z};
    for (int32_t d = 0; d < solver->domain_count; d++)
        add_column(solver, d, load->node, numbers, solver->fields[d].base);
}

static void add_gravity(pliant_solver *solver, pliant_vec3 acceleration)
{
    const float numbers[3] = {acceleration.x, acceleration.y, acceleration.z};
    for (int32_t d = 0; d < solver->domain_count; d++) {
        const pliant_model_domain *domain = &solver->model->domains[d];
        if (domain->gravity)
            solver->add_column(solver->all_rows, domain->gravity, (size_t)domain->count, numbers,
                               solver->fields[d].base);
    }
}

static void weigh_load(const pliant_solver *solver, pliant_load *load)
{
    const pliant_model *model = solver->model;
    for (int32_t d = 0; d < solver->domain_count; d++)
        load->weight[d] = pliant_columns_weight(pliant_model_columns(model, d, load->node),
                                                model->position[load->node.vertex]);
}

// Add what changed in some loads; `moved` and the result bound and count it.
static int32_t add_deltas(pliant_solver *solver, pliant_load *loads, int32_t count,
                          double moved[PLIANT_DOMAIN_COUNT])
{
    int32_t changes = 0;
    for (int32_t i = 0; i < count; i++) {
        pliant_load *load = &loads[i];
        const pliant_vec3 delta = difference(load->value, load->summed);
        if (is_zero(delta)) continue;
        if (load->weight[0] < 0) weigh_load(solver, load);
        // Subtracting floats rounds too; with u |value| it is in the bound of the sum.
        add_load(solver, load, delta);
        for (int32_t d = 0; d < solver->domain_count; d++)
            moved[d] += norm(delta) * (double)load->weight[d];
        load->summed = load->value;
        changes++;
    }
    solver->report.summed_columns += changes;
    return changes;
}

static double magnitude_of(const pliant_load *loads, int32_t count, int32_t d)
{
    double magnitude = 0;
    for (int32_t i = 0; i < count; i++)
        magnitude += norm(loads[i].value) * (double)loads[i].weight[d];
    return magnitude;
}

// Bounds, for every row domain: |base| <= magnitude = sum of |value| weight (times 3 for the three
// columns of a block, left out on both sides). Adding `delta` rounds the product, at most 4 u
// |delta| weight, and the sum, u times magnitude before or after.
static void add_changes(pliant_solver *solver)
{
    double moved[PLIANT_DOMAIN_COUNT] = {0};
    int32_t changes = add_deltas(solver, solver->loads, solver->load_count, moved);
    for (pliant_load_list *list = solver->lists; list; list = list->next)
        changes += add_deltas(solver, list->loads, list->count, moved);
    const pliant_vec3 delta = difference(solver->gravity, solver->summed_gravity);
    if (!is_zero(delta)) {
        add_gravity(solver, delta);
        for (int32_t d = 0; d < solver->domain_count; d++)
            moved[d] += norm(delta) * (double)solver->fields[d].gravity_weight;
        solver->summed_gravity = solver->gravity;
        changes++;
        solver->report.summed_columns += 3;
    }
    if (changes == 0) return;

    for (int32_t d = 0; d < solver->domain_count; d++) {
        pliant_field *field = &solver->fields[d];
        double magnitude = norm(solver->gravity) * (double)field->gravity_weight;
        magnitude += magnitude_of(solver->loads, solver->load_count, d);
        for (const pliant_load_list *list = solver->lists; list; list = list->next)
            magnitude += magnitude_of(list->loads, list->count, d);
        field->drift += unit_roundoff * (changes * (magnitude + field->magnitude) + 5 * moved[d]);
        field->magnitude = magnitude;
        field->is_loaded = 1;
    }
}

// Sum some loads from scratch; returns how many there are.
static int32_t add_summed(pliant_solver *solver, pliant_load *loads, int32_t count)
{
    int32_t added = 0;
    for (int32_t i = 0; i < count; i++) {
        if (is_zero(loads[i].summed)) continue;
        add_load(solver, &loads[i], loads[i].summed);
        added++;
    }
    solver->report.summed_columns += added;
    return added;
}

// Sum everything again: the drift is then that of a fresh sum, which is what it is measured
// against.
static void rebuild_base(pliant_solver *solver)
{
    for (int32_t d = 0; d < solver->domain_count; d++)
        memset(solver->fields[d].base, 0,
               4 * ((size_t)solver->model->domains[d].count + 1) * sizeof(float));
    int32_t is_loaded = add_summed(solver, solver->loads, solver->load_count) > 0;
    for (pliant_load_list *list = solver->lists; list; list = list->next)
        is_loaded |= add_summed(solver, list->loads, list->count) > 0;
    if (!is_zero(solver->summed_gravity)) {
        add_gravity(solver, solver->summed_gravity);
        solver->report.summed_columns += 3;
        is_loaded = 1;
    }
    for (int32_t d = 0; d < solver->domain_count; d++) {
        solver->fields[d].drift = 0;
        solver->fields[d].is_loaded = is_loaded;
    }
}

// Loads released or taken into S are out of the sum now: forget them.
static void drop_released(pliant_solver *solver)
{
    for (int32_t i = solver->load_count; i-- > 0;) {
        if (solver->loads[i].is_specified) continue;
        pliant_loads_forget(solver, i);
    }
}

void pliant_solver_update_base(pliant_solver *solver)
{
    if (!solver->loads_changed) return;
    solver->loads_changed = 0;
    for (int32_t i = 0; i < solver->load_count; i++) {
        const pliant_load *load = &solver->loads[i];
        if (solver->model->domain[load->node.vertex] != PLIANT_DOMAIN_FIXED ||
            load->node.level != solver->model->finest_level)
            continue;
        float *to =
            solver->fixed_displacement + 4 * (size_t)solver->model->position[load->node.vertex];
        to[0] = load->value.x, to[1] = load->value.y, to[2] = load->value.z;
    }
    add_changes(solver);
    drop_released(solver);
    int32_t drifted = 0;
    for (int32_t d = 0; d < solver->domain_count; d++)
        drifted |= solver->fields[d].drift > drift_limit * solver->fields[d].magnitude;
    if (drifted) rebuild_base(solver);
}

// ---- Boundary values ----

static pliant_vec3 add_scaled(pliant_vec3 a, float factor, pliant_vec3 b)
{
    return (pliant_vec3){a.x + factor * b.x, a.y + factor * b.y, a.z + factor * b.z};
}

pliant_vec3 pliant_solver_boundary_value(const pliant_solver *solver, int32_t vertex)
{
    const pliant_model *model = solver->model;
    pliant_vec3 sum = {0, 0, 0};
    uint32_t levels = solver->used_levels[model->domain[vertex]];
    for (int32_t level = 0; levels >> level != 0; level++) {
        if (!(levels >> level & 1)) continue;
        int32_t vertices[3];
        float weights[3];
        const int32_t count = pliant_model_hats_at(model, level, vertex, vertices, weights);
        for (int32_t k = 0; k < count; k++) {
            const pliant_node node = {level, vertices[k]};
            const int32_t load = pliant_loads_find(solver, node);
            const int32_t i =
                pliant_constraint_find(solver->solved, solver->solved_count, node.vertex);
            // Both only between a statement and the solve that heeds it: then one is zero.
            if (load >= 0) sum = add_scaled(sum, weights[k], solver->loads[load].summed);
            sum = add_scaled(sum, weights[k], pliant_load_lists_summed(solver, node));
            if (i >= 0 && solver->solved[i].node.level == level)
                sum = add_scaled(sum, weights[k], solver->reference[i]);
        }
    }
    return sum;
}
