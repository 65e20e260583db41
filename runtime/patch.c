// patch.c: a patch's life, what the caller says of it and what is read. patch_solve.c does the
// work.
#include "patch.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Life ----

static void lay_out(pliant_arena *arena, pliant_patch *patch)
{
    const pliant_model *model = patch->solver->model;
    const int32_t capacity = patch->def.vertex_capacity + 1;
    PLIANT_TAKE(arena, patch->next, capacity);
    PLIANT_TAKE(arena, patch->vertices, capacity);
    PLIANT_TAKE(arena, patch->numbers, capacity);
    PLIANT_TAKE(arena, patch->levels, capacity);
    PLIANT_TAKE(arena, patch->u, capacity);
    PLIANT_TAKE(arena, patch->fades, patch->fade_capacity);
    PLIANT_TAKE(arena, patch->fading.loads, patch->fade_capacity);
    PLIANT_TAKE(arena, patch->coming, capacity);
    PLIANT_TAKE(arena, patch->nodes, capacity);
    PLIANT_TAKE(arena, patch->is_held, capacity);
    PLIANT_TAKE(arena, patch->source, model->vertex_count);
    PLIANT_TAKE(arena, patch->index_of, model->vertex_count);
    PLIANT_TAKE(arena, patch->named, ((size_t)model->vertex_count + 63) / 64);
    pliant_footprint_lay_out(arena, model, &patch->footprint);
}

pliant_patch_def pliant_patch_default(const pliant_model *model)
{
    double low[3], high[3], square = 0;
    for (int c = 0; c < 3; c++) low[c] = high[c] = model->view.vertices[c];
    for (int32_t v = 0; v < model->vertex_count; v++)
        for (int c = 0; c < 3; c++) {
            low[c] = fmin(low[c], model->view.vertices[3 * (size_t)v + c]);
            high[c] = fmax(high[c], model->view.vertices[3 * (size_t)v + c]);
        }
    for (int c = 0; c < 3; c++) square += (high[c] - low[c]) * (high[c] - low[c]);
    return (pliant_patch_def){.vertex_capacity = 512,
                              .tolerance = sqrt(square) / 1000,
                              .hysteresis = 2,
                              .blend_steps = 16};
}

static pliant_status check_def(const pliant_patch_def *def, pliant_error *err)
{
    if (def->vertex_capacity < 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_patch_def: vertex_capacity: expected 1 or more, found %d",
                                def->vertex_capacity);
    if (!(def->tolerance >= 0) || !isfinite(def->tolerance))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_patch_def: tolerance: expected 0 or more, found %g",
                                def->tolerance);
    if (!(def->hysteresis >= 1))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_patch_def: hysteresis: expected 1 or more, found %g",
                                def->hysteresis);
    if (def->blend_steps < 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_patch_def: blend_steps: expected 0 or more, found %d",
                                def->blend_steps);
    return PLIANT_OK;
}

pliant_status pliant_patch_create(pliant_solver *solver, const pliant_patch_def *def,
                                  pliant_patch **result, pliant_error *err)
{
    if (!solver || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_patch_create: expected a solver and a place, found NULL");
    const pliant_model *model = solver->model;
    pliant_patch_def used = def ? *def : pliant_patch_default(model);
    pliant_status status = check_def(&used, err);
    if (status < 0) return status;
    if (used.vertex_capacity > model->vertex_count) used.vertex_capacity = model->vertex_count;

    pliant_patch *patch = calloc(1, sizeof *patch);
    if (!patch) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a patch");
    patch->solver = solver;
    patch->def = used;
    patch->fade_capacity = used.blend_steps > 0 ? 2 * used.vertex_capacity : 0;
    lay_out(&patch->arena, patch);
    status = pliant_arena_reserve(&patch->arena, err);
    if (status < 0) {
        free(patch);
        return status;
    }
    lay_out(&patch->arena, patch);
    memset(patch->index_of, 0xff, (size_t)model->vertex_count * sizeof *patch->index_of);
    pliant_footprint_begin(model, &patch->footprint);
    pliant_load_list_enter(solver, &patch->fading);
    *result = patch;
    return PLIANT_OK;
}

void pliant_patch_destroy(pliant_patch *patch)
{
    if (!patch) return;
    for (int32_t i = 0; i < patch->count; i++) {
        const pliant_patch_vertex *v = &patch->vertices[i];
        if (pliant_patch_owns(patch, v))
            (void)!pliant_solver_release(patch->solver, (pliant_node){v->level, v->vertex});
    }
    pliant_load_list_leave(patch->solver, &patch->fading);
    pliant_arena_release(&patch->arena);
    free(patch);
}

// ---- Whose statement ----

static int32_t is_same(pliant_vec3 a, pliant_vec3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

int32_t pliant_patch_owns(const pliant_patch *patch, const pliant_patch_vertex *v)
{
    const pliant_solver *solver = patch->solver;
    if (v->level < 0) return 0;
    const int32_t i =
        pliant_constraint_find(solver->constraints, solver->constraint_count, v->vertex);
    return i >= 0 && solver->constraints[i].node.level == v->level &&
           is_same(solver->constraints[i].value, v->stated);
}

// ---- What the caller says ----

// Mark the vertices in `named`; 0 when one may not be there or is there twice.
static int32_t name_all(pliant_patch *patch, const int32_t *vertices, const pliant_vec3 *u,
                        int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        const int32_t v = vertices[i];
        if (pliant_model_is_free(patch->solver->model, v) != 1) return 0;
        if (!isfinite(u[i].x) || !isfinite(u[i].y) || !isfinite(u[i].z)) return 0;
        if (patch->named[v / 64] >> v % 64 & 1) return 0;
        patch->named[v / 64] |= UINT64_C(1) << v % 64;
        patch->source[v] = i;
    }
    return 1;
}

pliant_status pliant_patch_set(pliant_patch *patch, const int32_t *vertices, const pliant_vec3 *u,
                               int32_t count)
{
    if (count < 0 || (count > 0 && (!vertices || !u))) return PLIANT_ERR_ARGUMENT;
    if (count > patch->def.vertex_capacity) return PLIANT_ERR_CAPACITY;
    const int32_t is_sound = name_all(patch, vertices, u, count);
    // A bit for every vertex puts them in order without a sort.
    const int32_t words = (patch->solver->model->vertex_count + 63) / 64;
    int32_t listed = 0;
    for (int32_t word = 0; word < words; word++) {
        uint64_t bits = patch->named[word];
        patch->named[word] = 0;
        for (; bits && is_sound; bits &= bits - 1) {
            const int32_t vertex = 64 * word + __builtin_ctzll(bits);
            patch->next[listed++] =
                (pliant_patch_vertex){.vertex = vertex, .target = u[patch->source[vertex]]};
        }
    }
    if (!is_sound) return PLIANT_ERR_ARGUMENT;
    patch->next_count = listed;
    patch->is_set = 1;
    return PLIANT_OK;
}

pliant_status pliant_patch_tolerate(pliant_patch *patch, double tolerance)
{
    if (!(tolerance >= 0) || !isfinite(tolerance)) return PLIANT_ERR_ARGUMENT;
    patch->def.tolerance = tolerance;
    return PLIANT_OK;
}

// ---- What is read ----

static void add_force(const pliant_model *model, pliant_node node, pliant_vec3 traction,
                      double force[3])
{
    const double area = model->node_areas[node.level][node.vertex];
    force[0] += area * (double)traction.x;
    force[1] += area * (double)traction.y;
    force[2] += area * (double)traction.z;
}

pliant_vec3 pliant_patch_force(const pliant_patch *patch)
{
    const pliant_solver *solver = patch->solver;
    double force[3] = {0};
    for (int32_t i = 0; i < patch->count; i++) {
        if (patch->vertices[i].level < 0) continue;
        // On a coarser level when the solve was late.
        const int32_t member =
            pliant_constraint_find(solver->solved, solver->solved_count, patch->vertices[i].vertex);
        if (member >= 0)
            add_force(solver->model, solver->solved[member].node, solver->reference[member], force);
    }
    for (int32_t i = 0; i < patch->fading.count; i++)
        add_force(solver->model, patch->fading.loads[i].node, patch->fading.loads[i].summed, force);
    return (pliant_vec3){(float)force[0], (float)force[1], (float)force[2]};
}

int32_t pliant_patch_nodes(const pliant_patch *patch, pliant_node *nodes, int32_t capacity)
{
    int32_t count = 0;
    for (int32_t i = 0; i < patch->count; i++) {
        const pliant_patch_vertex *v = &patch->vertices[i];
        if (v->level < 0) continue;
        if (count < capacity) nodes[count] = (pliant_node){v->level, v->vertex};
        count++;
    }
    return count;
}

pliant_patch_report pliant_patch_last(const pliant_patch *patch)
{
    return patch->report;
}
