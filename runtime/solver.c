// solver.c: one boundary value problem on a model: its life and the capacitance matrix algorithm.
//
// The steps are those of GF-42..47. vbar outside S is summed into `base`, which stays
// from solve to solve: only what changed is added (GF-11, 12).
#include "solver.h"

#include "dense.h"
#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// Rounding of one float operation.
static const double unit_roundoff = 0x1p-24;
// `base` is summed afresh once its drift may exceed this part of the present loads' magnitude. A
// fresh sum of 256 loads has the same bound, so coherence never costs more than a digit of it; and
// drift grows by 2 u a change, so this comes every 128th change or when a much larger load goes.
static const double drift_limit = 256 * 0x1p-24;

// Selective queries against the whole transform, at 2143 nodes, butterfly (bench_solver): the
// transform takes 2.5 us and lifted 4.5; a planned query 0.05 us for one node and 2.2 for 64
// scattered ones, a 32nd of them, lifted 4; making the plan 2 us for one node and 2.8 for two, a
// 1024th of them.
enum { query_part = 32, query_floor = 16, query_at_once_part = 1024, query_at_once_floor = 2 };
// The update is undone from the touched rows alone while they are under a quarter of all (butterfly
// lifted, 2143 nodes: 2.1 us for all, about 2 ns a row). Neighbouring columns share most of theirs.
enum { sparse_part = 4 };
// Types kept at most: beyond, a search of the cache would cost what it saves.
enum { cache_limit = 4096 };

int64_t pliant_solver_clock(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * INT64_C(1000000000) + time.tv_nsec;
}

// ---- Life ----

static int32_t is_compact(const pliant_solver *solver, int32_t row_domain)
{
    return solver->add_compact &&
           solver->model->domains[row_domain].count <= PLIANT_COMPACT_ROW_LIMIT;
}

static void lay_out(pliant_arena *arena, pliant_solver *solver)
{
    const pliant_model *model = solver->model;
    const int32_t capacity = solver->constraint_capacity;
    int32_t rows = 0;
    for (int32_t d = 0; d < solver->domain_count; d++) {
        pliant_field *field = &solver->fields[d];
        const int32_t count = model->domains[d].count;
        if (count > rows) rows = count;
        PLIANT_TAKE(arena, field->base, 4 * ((size_t)count + 1));
        PLIANT_TAKE(arena, field->g, 4 * ((size_t)count + 1));
        PLIANT_TAKE(arena, field->support, ((size_t)count + 63) / 64);
        PLIANT_TAKE(arena, field->query_positions, solver->query_capacity);
        PLIANT_TAKE(arena, field->query_slots, solver->query_capacity);
        pliant_reconstruction_lay_out(arena, model->domains[d].wavelet, &field->plan);
    }
    for (int32_t d = 0; d < solver->domain_count; d++)
        for (int32_t c = 0; c < solver->domain_count; c++)
            if (is_compact(solver, d))
                pliant_compact_lay_out(arena, &model->greens[d][c], &solver->compact[d][c]);
    PLIANT_TAKE(arena, solver->constraints, capacity);
    PLIANT_TAKE(arena, solver->solved, capacity);
    PLIANT_TAKE(arena, solver->reference, capacity);
    PLIANT_TAKE(arena, solver->key, capacity);
    PLIANT_TAKE(arena, solver->terms, capacity);
    PLIANT_TAKE(arena, solver->contact_values, 3 * (size_t)capacity);
    PLIANT_TAKE(arena, solver->contact_solution, pliant_dense_stride(3 * (size_t)capacity));
    PLIANT_TAKE(arena, solver->loads, 2 * (size_t)solver->load_capacity);
    PLIANT_TAKE(arena, solver->load_of, model->vertex_count);
    PLIANT_TAKE(arena, solver->fixed_displacement, 4 * (size_t)model->domains[1].count);
    PLIANT_TAKE(arena, solver->all_rows, rows);
    PLIANT_TAKE(arena, solver->query_scratch, solver->query_capacity);
    pliant_capacitance_scratch_lay_out(arena, model, capacity, &solver->scratch);
    PLIANT_TAKE(arena, solver->types, solver->cache_count);
    for (int32_t i = 0; i < solver->cache_count; i++) {
        pliant_capacitance measured = {0};  // while measuring there is no types[i] yet
        pliant_capacitance_lay_out(arena, model, capacity,
                                   solver->types ? &solver->types[i] : &measured);
    }
}

pliant_solver_def pliant_solver_default(const pliant_model *model)
{
    (void)model;  // nothing depends on it yet
    return (pliant_solver_def){.constraint_capacity = 64,
                               .load_capacity = 256,
                               .cache_count = 4,
                               .storage = PLIANT_STORAGE_FLOAT};
}

static float largest(const float *values, size_t count)
{
    float most = 0;
    for (size_t i = 0; i < count; i++) most = fmaxf(most, fabsf(values[i]));
    return most;
}

pliant_status pliant_solver_create(const pliant_model *model, const pliant_solver_def *def,
                                   pliant_solver **result, pliant_error *err)
{
    if (!model || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_solver_create: expected a model and a place, found NULL");
    const pliant_solver_def used = def ? *def : pliant_solver_default(model);
    const struct {
        const char *name;
        int32_t value, least, most;
    } fields[] = {{"constraint_capacity", used.constraint_capacity, 1, INT32_MAX},
                  {"load_capacity", used.load_capacity, 0, INT32_MAX},
                  {"cache_count", used.cache_count, 1, cache_limit},
                  {"storage", (int32_t)used.storage, PLIANT_STORAGE_FLOAT, PLIANT_STORAGE_HALF}};
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
        if (fields[i].value < fields[i].least || fields[i].value > fields[i].most)
            return pliant_error_set(
                err, PLIANT_ERR_ARGUMENT, "pliant_solver_def: %s: expected %d to %d, found %d",
                fields[i].name, fields[i].least, fields[i].most, fields[i].value);

    pliant_solver *solver = calloc(1, sizeof *solver);
    if (!solver) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a solver");
    const int32_t n = model->vertex_count;
    solver->model = model;
    solver->domain_count = pliant_capacitance_domain_count(model);
    solver->add_column = pliant_columns_kernel_best();
    if (used.storage == PLIANT_STORAGE_HALF) solver->add_compact = pliant_compact_kernel_best();
    // More than one statement a vertex there cannot be.
    solver->constraint_capacity = used.constraint_capacity < n ? used.constraint_capacity : n;
    solver->load_capacity = used.load_capacity < n ? used.load_capacity : n;
    solver->cache_count = used.cache_count;
    solver->query_capacity = n / query_part > query_floor ? n / query_part : query_floor;
    solver->query_at_once =
        n / query_at_once_part > query_at_once_floor ? n / query_at_once_part : query_at_once_floor;

    lay_out(&solver->arena, solver);
    pliant_status status = pliant_arena_reserve(&solver->arena, err);
    if (status < 0) {
        pliant_solver_destroy(solver);
        return status;
    }
    lay_out(&solver->arena, solver);
    for (int32_t d = 0; d < solver->domain_count; d++) {
        pliant_field *field = &solver->fields[d];
        const pliant_model_domain *domain = &model->domains[d];
        field->is_summed = 1;
        field->query_count = -1;
        field->gravity_weight =
            domain->gravity ? largest(domain->gravity, 9 * (size_t)domain->count) : 0;
        for (int32_t p = 0; p < domain->count; p++) solver->all_rows[p] = p;
        for (int32_t c = 0; c < solver->domain_count; c++)
            if (is_compact(solver, d))
                pliant_compact_fill(&model->greens[d][c], &solver->compact[d][c]);
    }
    memset(solver->load_of, 0xff, (size_t)n * sizeof *solver->load_of);
    pliant_capacitance_scratch_begin(model, &solver->scratch);
    for (int32_t i = 0; i < solver->cache_count; i++) solver->types[i].count = -1;
    *result = solver;
    return PLIANT_OK;
}

void pliant_solver_destroy(pliant_solver *solver)
{
    if (!solver) return;
    pliant_arena_release(&solver->arena);
    free(solver);
}

// ---- Step (3): what is specified outside S ----

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
static void add_column(const pliant_solver *solver, int32_t row_domain, int32_t vertex,
                       const float *value, float *rows)
{
    const pliant_model *model = solver->model;
    const pliant_columns *columns = &model->greens[row_domain][model->domain[vertex]];
    const uint64_t begin = columns->offset[model->position[vertex]];
    const uint64_t end = columns->offset[model->position[vertex] + 1];
    solver->add_column(columns->row + begin, columns->block + 9 * begin, (size_t)(end - begin),
                       value, rows);
}

static void add_load(pliant_solver *solver, pliant_load *load, pliant_vec3 value)
{
    const float numbers[3] = {value.x, value.y, value.z};
    for (int32_t d = 0; d < solver->domain_count; d++)
        add_column(solver, d, load->vertex, numbers, solver->fields[d].base);
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
        load->weight[d] = pliant_columns_weight(&model->greens[d][model->domain[load->vertex]],
                                                model->position[load->vertex]);
}

// Bounds, for every row domain: |base| <= magnitude = sum of |value| weight (times 3 for the three
// columns of a block, left out on both sides). Adding `delta` rounds the product, at most 4 u
// |delta| weight, and the sum, u times magnitude before or after.
static void add_changes(pliant_solver *solver)
{
    double moved[PLIANT_DOMAIN_COUNT] = {0};
    int32_t changes = 0;
    for (int32_t i = 0; i < solver->load_count; i++) {
        pliant_load *load = &solver->loads[i];
        const pliant_vec3 delta = difference(load->value, load->summed);
        if (is_zero(delta)) continue;
        if (load->weight[0] < 0) weigh_load(solver, load);
        // Subtracting floats rounds too; with u |value| it is in the bound of the sum.
        add_load(solver, load, delta);
        for (int32_t d = 0; d < solver->domain_count; d++)
            moved[d] += norm(delta) * (double)load->weight[d];
        load->summed = load->value;
        changes++;
        solver->report.summed_columns++;
    }
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
        for (int32_t i = 0; i < solver->load_count; i++)
            magnitude += norm(solver->loads[i].value) * (double)solver->loads[i].weight[d];
        field->drift += unit_roundoff * (changes * (magnitude + field->magnitude) + 5 * moved[d]);
        field->magnitude = magnitude;
        field->is_loaded = 1;
    }
}

// Sum everything again: the drift is then that of a fresh sum, which is what it is measured
// against.
static void rebuild_base(pliant_solver *solver)
{
    int32_t is_loaded = 0;
    for (int32_t d = 0; d < solver->domain_count; d++)
        memset(solver->fields[d].base, 0,
               4 * ((size_t)solver->model->domains[d].count + 1) * sizeof(float));
    for (int32_t i = 0; i < solver->load_count; i++) {
        if (is_zero(solver->loads[i].summed)) continue;
        add_load(solver, &solver->loads[i], solver->loads[i].summed);
        solver->report.summed_columns++;
        is_loaded = 1;
    }
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
        solver->load_of[solver->loads[i].vertex] = -1;
        solver->loads[i] = solver->loads[--solver->load_count];
        if (i < solver->load_count) solver->load_of[solver->loads[i].vertex] = i;
    }
}

static void update_base(pliant_solver *solver)
{
    if (!solver->loads_changed) return;
    solver->loads_changed = 0;
    for (int32_t i = 0; i < solver->load_count; i++) {
        const pliant_load *load = &solver->loads[i];
        if (solver->model->domain[load->vertex] != PLIANT_DOMAIN_FIXED) continue;
        float *to = solver->fixed_displacement + 4 * (size_t)solver->model->position[load->vertex];
        to[0] = load->value.x, to[1] = load->value.y, to[2] = load->value.z;
    }
    add_changes(solver);
    drop_released(solver);
    int32_t drifted = 0;
    for (int32_t d = 0; d < solver->domain_count; d++)
        drifted |= solver->fields[d].drift > drift_limit * solver->fields[d].magnitude;
    if (drifted) rebuild_base(solver);
}

// ---- Steps (2), (4), (5): the contact ----

// The type of the present S: from the cache, or built in the place of the least recently used.
static pliant_capacitance *find_type(pliant_solver *solver)
{
    const int32_t count = solver->constraint_count;
    for (int32_t i = 0; i < count; i++) solver->key[i] = solver->constraints[i].vertex;
    pliant_capacitance *oldest = solver->types;
    for (int32_t i = 0; i < solver->cache_count; i++) {
        pliant_capacitance *type = &solver->types[i];
        if (type->count == count &&
            memcmp(type->vertices, solver->key, (size_t)count * sizeof *solver->key) == 0) {
            type->last_used = solver->solve_count;
            return type;
        }
        if (type->count < 0 ? oldest->count >= 0
                            : oldest->count >= 0 && type->last_used < oldest->last_used)
            oldest = type;
    }
    pliant_capacitance_build(solver->model, solver->key, count, &solver->scratch, oldest);
    oldest->last_used = solver->solve_count;
    solver->report.factored = 1;
    return oldest;
}

// (4) q = E^T W^-1 g - E^T vbar     (5) g_S = C^-1 q
static void solve_contact(pliant_solver *solver, const pliant_capacitance *type)
{
    const int32_t count = solver->constraint_count;
    float *q = solver->contact_values;
    for (int32_t i = 0; i < count; i++) {
        q[3 * i] = -solver->constraints[i].value.x;
        q[3 * i + 1] = -solver->constraints[i].value.y;
        q[3 * i + 2] = -solver->constraints[i].value.z;
    }
    for (int32_t d = 0; d < solver->domain_count; d++) {
        if (!solver->fields[d].is_loaded || type->plan[d].slot_count == 0) continue;
        float *work = solver->scratch.blocks;
        pliant_reconstruction_run(&type->plan[d], solver->fields[d].base, work);
        for (int32_t i = 0; i < count; i++) {
            if (solver->model->domain[type->vertices[i]] != d) continue;
            for (int c = 0; c < 3; c++) q[3 * i + c] += work[4 * (size_t)type->slot[i] + c];
        }
    }
    const float *x = solver->contact_solution;
    pliant_dense_multiply(3 * (size_t)count, type->stride, type->inverse, q,
                          solver->contact_solution);
    for (int32_t i = 0; i < count; i++) {
        solver->solved[i] = solver->constraints[i];
        solver->reference[i] = (pliant_vec3){x[3 * i], x[3 * i + 1], x[3 * i + 2]};
    }
    solver->solved_count = count;
}

// ---- Step (6) ----

// Look up all columns of S before any is summed: the sums' loops then end on numbers that are at
// hand, instead of guessing wrong and waiting for a look-up through the caches (31 ns a column of
// 18 blocks against 27, in half precision 27 against 21), and the columns' first lines are on their
// way.
static void look_up(pliant_solver *solver, int32_t d)
{
    const pliant_model *model = solver->model;
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const int32_t vertex = solver->solved[i].vertex, column = model->position[vertex];
        const pliant_columns *columns = &model->greens[d][model->domain[vertex]];
        const pliant_compact_columns *compact = &solver->compact[d][model->domain[vertex]];
        const float scale = compact->offset ? compact->scale[column] : 1;
        const uint64_t *offset = (compact->offset ? compact->offset : columns->offset) + column;
        pliant_term *term = &solver->terms[i];
        *term =
            (pliant_term){.count = (size_t)(offset[1] - offset[0]),
                          .value = {scale * solver->reference[i].x, scale * solver->reference[i].y,
                                    scale * solver->reference[i].z}};
        const char *begin;
        if (compact->offset) {
            term->group = compact->group + offset[0];
            begin = (const char *)term->group;
        } else {
            term->row = columns->row + offset[0];
            term->block = columns->block + 9 * offset[0];
            begin = (const char *)term->block;
            __builtin_prefetch(term->row);
        }
        for (int line = 0; line < 3; line++) __builtin_prefetch(begin + 64 * line);
    }
}

// Mark the rows that the columns of S touch, when they are few enough for the inverse transform to
// make use of it.
static void mark_support(pliant_solver *solver, int32_t d)
{
    const pliant_model *model = solver->model;
    pliant_field *field = &solver->fields[d];
    const int32_t count = model->domains[d].count;
    uint64_t touched = 0;
    field->is_sparse = 0;
    if (field->is_loaded) return;
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const int32_t vertex = solver->solved[i].vertex;
        const uint64_t *offset = model->greens[d][model->domain[vertex]].offset + model->position[vertex];
        touched += offset[1] - offset[0];
    }
    if (touched > (uint64_t)count) return;
    memset(field->support, 0, ((size_t)count + 63) / 64 * sizeof *field->support);
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const int32_t vertex = solver->solved[i].vertex;
        const pliant_columns *columns = &model->greens[d][model->domain[vertex]];
        const uint64_t *offset = columns->offset + model->position[vertex];
        for (uint64_t q = offset[0]; q < offset[1]; q++) {
            const uint32_t row = (uint32_t)columns->row[q];
            field->support[row / 64] |= UINT64_C(1) << row % 64;
        }
    }
    int32_t distinct = 0;
    for (int32_t word = 0; 64 * word < count; word++) distinct += __builtin_popcountll(field->support[word]);
    field->is_sparse = distinct <= count / sparse_part;
}

// In half precision or not, the columns of S do not enter q, and so no force.
void pliant_solver_sum(pliant_solver *solver, int32_t d)
{
    pliant_field *field = &solver->fields[d];
    if (field->is_summed && field->reconstructed == 0) return;
    const size_t bytes = 4 * ((size_t)solver->model->domains[d].count + 1) * sizeof(float);
    if (field->is_loaded) memcpy(field->g, field->base, bytes);
    else memset(field->g, 0, bytes);
    look_up(solver, d);
    for (const pliant_term *term = solver->terms; term < solver->terms + solver->solved_count;
         term++)
        if (term->group) solver->add_compact(term->group, term->count, term->value, field->g);
        else solver->add_column(term->row, term->block, term->count, term->value, field->g);
    mark_support(solver, d);
    field->is_summed = 1;
    field->reconstructed = 0;
}

pliant_status pliant_solver_solve(pliant_solver *solver)
{
    const int64_t begin = pliant_solver_clock();
    solver->solve_count++;
    solver->report = (pliant_solver_report){.constraint_count = solver->constraint_count,
                                            .level = solver->model->finest_level,
                                            .surface_ns = solver->report.surface_ns};
    update_base(solver);
    const int64_t summed = pliant_solver_clock();
    pliant_status status = PLIANT_OK;
    int64_t typed = summed, solved = summed;
    if (solver->constraint_count > 0) {
        const pliant_capacitance *type = find_type(solver);
        status = type->status;
        typed = pliant_solver_clock();
        solve_contact(solver, type);
        solved = pliant_solver_clock();
    } else {
        solver->solved_count = 0;
    }
    // The fixed rows are summed when somebody asks for them.
    for (int32_t d = 0; d < solver->domain_count; d++) solver->fields[d].is_summed = 0;
    pliant_solver_sum(solver, PLIANT_DOMAIN_FREE);
    const int64_t end = pliant_solver_clock();
    solver->report.capacitance_ns = typed - summed;
    solver->report.contact_ns = solved - typed;
    solver->report.summation_ns = (summed - begin) + (end - solved);
    return status;
}

pliant_solver_report pliant_solver_last(const pliant_solver *solver)
{
    return solver->report;
}
