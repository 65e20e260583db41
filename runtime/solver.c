// solver.c: one boundary value problem on a model: its life and the capacitance matrix algorithm.
//
// The steps are those of GF-42..47: (3) is in base.c, (2) in types.c, (7) and (8) in surface.c.
#include "solver.h"

#include "dense.h"
#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

// ---- Life ----

static int32_t is_compact(const pliant_solver *solver, int32_t row_domain, int32_t level)
{
    return solver->add_compact && solver->model->stored_levels >> level & 1 &&
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
            for (int32_t l = 0; l < model->level_count; l++)
                if (is_compact(solver, d, l))
                    pliant_compact_lay_out(arena, &model->greens[d][c][l],
                                           &solver->compact[d][c][l]);
    PLIANT_TAKE(arena, solver->constraints, capacity);
    PLIANT_TAKE(arena, solver->solved, capacity);
    PLIANT_TAKE(arena, solver->candidate, capacity);
    PLIANT_TAKE(arena, solver->reference, capacity);
    PLIANT_TAKE(arena, solver->key, capacity);
    PLIANT_TAKE(arena, solver->terms, capacity);
    PLIANT_TAKE(arena, solver->contact_values, 3 * (size_t)capacity);
    PLIANT_TAKE(arena, solver->contact_solution, pliant_dense_stride(3 * (size_t)capacity));
    PLIANT_TAKE(arena, solver->loads, 2 * (size_t)solver->load_capacity);
    PLIANT_TAKE(arena, solver->received.loads, 2 * pliant_exchange_room(solver->load_capacity));
    PLIANT_TAKE(arena, solver->load_of, model->vertex_count);
    PLIANT_TAKE(arena, solver->fixed_displacement, 4 * (size_t)model->domains[1].count);
    PLIANT_TAKE(arena, solver->all_rows, rows);
    PLIANT_TAKE(arena, solver->query_scratch, solver->query_capacity);
    // Twice as many nodes for S beside as many again in pliant_solver_compliance.
    pliant_capacitance_scratch_lay_out(arena, model, 2 * capacity, &solver->scratch);
    pliant_capacitance_lay_out(arena, model, 2 * capacity, &solver->extended);
    pliant_pending_lay_out(arena, model, capacity, &solver->pending);
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
                               .storage = PLIANT_STORAGE_FLOAT,
                               .compliance = PLIANT_COMPLIANCE_STORED};
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
    pliant_status status = pliant_model_check_greens(model, err);
    if (status < 0) return status;
    const pliant_solver_def used = def ? *def : pliant_solver_default(model);
    const struct {
        const char *name;
        int32_t value, least, most;
    } fields[] = {{"constraint_capacity", used.constraint_capacity, 1, INT32_MAX},
                  {"load_capacity", used.load_capacity, 0, INT32_MAX},
                  {"cache_count", used.cache_count, 1, cache_limit},
                  {"storage", (int32_t)used.storage, PLIANT_STORAGE_FLOAT, PLIANT_STORAGE_HALF},
                  {"compliance", (int32_t)used.compliance, PLIANT_COMPLIANCE_STORED,
                   PLIANT_COMPLIANCE_PASSIVE}};
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
    status = pliant_arena_reserve(&solver->arena, err);
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
            for (int32_t l = 0; l < model->level_count; l++)
                if (is_compact(solver, d, l))
                    pliant_compact_fill(&model->greens[d][c][l], &solver->compact[d][c][l]);
    }
    memset(solver->load_of, 0xff, (size_t)n * sizeof *solver->load_of);
    pliant_capacitance_scratch_begin(model, used.compliance, &solver->scratch);
    pliant_cost_calibrate(&solver->cost, model, solver->constraint_capacity, solver->add_column,
                          solver->fields[PLIANT_DOMAIN_FREE].g, &solver->scratch, solver->types);
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

// ---- Steps (4), (5): the contact ----

// (4) q = E^T W^-1 g - E^T vbar     (5) g_S = C^-1 q
static void solve_contact(pliant_solver *solver, const pliant_capacitance *type)
{
    const int32_t count = solver->solved_count;
    float *q = solver->contact_values;
    for (int32_t i = 0; i < count; i++) {
        float *to = q + 3 * (size_t)type->order[i];
        to[0] = -solver->solved[i].value.x;
        to[1] = -solver->solved[i].value.y;
        to[2] = -solver->solved[i].value.z;
    }
    for (int32_t d = 0; d < solver->domain_count; d++) {
        if (!solver->fields[d].is_loaded || type->plan[d].slot_count == 0) continue;
        float *work = solver->scratch.blocks;
        pliant_reconstruction_run(&type->plan[d], solver->fields[d].base, work);
        for (int32_t i = 0; i < count; i++) {
            if (solver->model->domain[type->nodes[i].vertex] != d) continue;
            for (int c = 0; c < 3; c++) q[3 * i + c] += work[4 * (size_t)type->slot[i] + c];
        }
    }
    pliant_dense_multiply(3 * (size_t)count, type->stride, type->product, q,
                          solver->contact_solution);
    for (int32_t i = 0; i < count; i++) {
        const float *x = solver->contact_solution + 3 * (size_t)type->order[i];
        solver->reference[i] = (pliant_vec3){x[0], x[1], x[2]};
    }
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
        const pliant_node node = solver->solved[i].node;
        const int32_t column = model->position[node.vertex];
        const pliant_columns *columns = pliant_model_columns(model, d, node);
        const pliant_compact_columns *compact =
            &solver->compact[d][model->domain[node.vertex]][node.level];
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
        const pliant_node node = solver->solved[i].node;
        const uint64_t *offset =
            pliant_model_columns(model, d, node)->offset + model->position[node.vertex];
        touched += offset[1] - offset[0];
    }
    if (touched > (uint64_t)count) return;
    memset(field->support, 0, ((size_t)count + 63) / 64 * sizeof *field->support);
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const pliant_node node = solver->solved[i].node;
        const pliant_columns *columns = pliant_model_columns(model, d, node);
        const uint64_t *offset = columns->offset + model->position[node.vertex];
        for (uint64_t q = offset[0]; q < offset[1]; q++) {
            const uint32_t row = (uint32_t)columns->row[q];
            field->support[row / 64] |= UINT64_C(1) << row % 64;
        }
    }
    int32_t distinct = 0;
    for (int32_t word = 0; 64 * word < count; word++)
        distinct += __builtin_popcountll(field->support[word]);
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

// Which levels have loads or members of S, in each domain.
static void note_levels(pliant_solver *solver)
{
    const uint8_t *domain = solver->model->domain;
    memset(solver->used_levels, 0, sizeof solver->used_levels);
    for (int32_t i = 0; i < solver->load_count; i++) {
        const pliant_node node = solver->loads[i].node;
        solver->used_levels[domain[node.vertex]] |= 1u << node.level;
    }
    for (const pliant_load_list *list = solver->lists; list; list = list->next)
        for (int32_t i = 0; i < list->count; i++) {
            const pliant_node node = list->loads[i].node;
            solver->used_levels[domain[node.vertex]] |= 1u << node.level;
        }
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const pliant_node node = solver->solved[i].node;
        solver->used_levels[domain[node.vertex]] |= 1u << node.level;
    }
}

// The contact is solved: what follows from it.
static void finish(pliant_solver *solver)
{
    note_levels(solver);
    // The fixed rows are summed when somebody asks for them.
    for (int32_t d = 0; d < solver->domain_count; d++) solver->fields[d].is_summed = 0;
    pliant_solver_sum(solver, PLIANT_DOMAIN_FREE);
}

void pliant_solver_adopt(pliant_solver *solver, const pliant_constraint *solved,
                         const pliant_vec3 *reference, int32_t count)
{
    pliant_solver_update_base(solver);
    memcpy(solver->solved, solved, (size_t)count * sizeof *solved);
    memcpy(solver->reference, reference, (size_t)count * sizeof *reference);
    solver->solved_count = count;
    solver->solved_type = NULL;
    finish(solver);
}

pliant_status pliant_solver_solve(pliant_solver *solver, int64_t deadline)
{
    const int64_t begin = pliant_clock_ns();
    solver->solve_count++;
    solver->report = (pliant_solver_report){.asked_count = solver->constraint_count,
                                            .level = solver->model->finest_stored,
                                            .surface_ns = solver->report.surface_ns};
    pliant_solver_update_base(solver);
    const int64_t summed = pliant_clock_ns();
    const pliant_capacitance *type = pliant_solver_resolve(solver, deadline);
    solver->solved_type = type;
    const int64_t typed = pliant_clock_ns();
    if (type) solve_contact(solver, type);
    const int64_t solved = pliant_clock_ns();
    finish(solver);
    const int64_t done = pliant_clock_ns();
    if (solver->report.is_late) pliant_solver_prepare(solver, deadline);
    const int64_t end = pliant_clock_ns();
    solver->report.constraint_count = solver->solved_count;
    solver->report.lateness_ns = end > deadline ? end - deadline : 0;
    solver->report.capacitance_ns = (typed - summed) + (end - done);
    solver->report.contact_ns = solved - typed;
    solver->report.summation_ns = (summed - begin) + (done - solved);
    if (type && type->status == PLIANT_ROUGH) return PLIANT_ROUGH;
    return solver->report.is_late || solver->report.lateness_ns > 0 ? PLIANT_LATE : PLIANT_OK;
}

void pliant_solver_repeat(pliant_solver *solver)
{
    const int64_t begin = pliant_clock_ns();
    pliant_solver_update_base(solver);
    const int64_t summed = pliant_clock_ns();
    if (solver->solved_type) solve_contact(solver, solver->solved_type);
    const int64_t solved = pliant_clock_ns();
    finish(solver);
    solver->report.contact_ns += solved - summed;
    solver->report.summation_ns += (summed - begin) + (pliant_clock_ns() - solved);
}

pliant_solver_report pliant_solver_last(const pliant_solver *solver)
{
    return solver->report;
}
