// patch_choose.c: which vertices of a patch are nodes, and which no longer.
#include "patch.h"

#include "pliant/hierarchy.h"

#include <math.h>
#include <string.h>

// Calls in a row for which a node must have been dispensable before it is given up, so that one
// that a moving contact needs every other frame stays. It doubles whenever a node comes back for
// the target it was given up with: nodes that take turns, each dispensable because of the other,
// come to rest.
enum { first_patience = 4, patience_limit = 1 << 30 };
// Nodes given up at once are further apart than this many square roots of a vertex's area, since
// each was found dispensable with the others in place.
static const double going_distance = 6;
// Of the vertices that are off, those with the largest errors become nodes, none nearer to another
// one than this, in the same unit, nor than this part of its distance to the nodes that there are:
// the surface between nodes is smooth on that scale. Smaller parts take fewer solves and more
// nodes: with 0.2, 0.5, 0.7, a patch of 300 vertices pressed flat is met to 5% in 4, 5, 6 solves by
// 164, 121, 104 nodes, in 43, 20, 12 ms (bench_patch, blob_L4).
static const double coming_distance = 1.2, coming_part = 0.7;

static double square_distance(const pliant_model *model, int32_t a, int32_t b)
{
    const double *x = model->view.vertices + 3 * (size_t)a;
    const double *y = model->view.vertices + 3 * (size_t)b;
    double sum = 0;
    for (int c = 0; c < 3; c++) sum += (x[c] - y[c]) * (x[c] - y[c]);
    return sum;
}

int32_t pliant_patch_stored_level(const pliant_model *model, int32_t vertex, int32_t level)
{
    for (int32_t l = level; l <= model->finest_stored; l++)
        if (model->stored_levels >> l & 1) return l;
    const int32_t finest = model->finest_stored;
    return vertex < model->hierarchy->vertex_count[finest] ? finest : -1;
}

// ---- Anchors ----

// The hat of the finest stored level that is highest in the patch: its vertex, or -1.
static int32_t highest_hat(const pliant_model *model, const pliant_patch_vertex *vertices,
                           int32_t count)
{
    int32_t best = -1;
    float most = 0;
    for (int32_t i = 0; i < count; i++) {
        int32_t hats[3];
        float weights[3];
        const int32_t found =
            pliant_model_hats_at(model, model->finest_stored, vertices[i].vertex, hats, weights);
        for (int32_t k = 0; k < found; k++)
            if (weights[k] > most) best = hats[k], most = weights[k];
    }
    return best;
}

// The patch's mean target, weighted by a hat of the finest stored level.
static pliant_vec3 mean_target(const pliant_model *model, const pliant_patch_vertex *vertices,
                               int32_t count, int32_t hat)
{
    double sum[3] = {0}, weight = 0;
    for (int32_t i = 0; i < count; i++) {
        int32_t hats[3];
        float weights[3];
        const int32_t found =
            pliant_model_hats_at(model, model->finest_stored, vertices[i].vertex, hats, weights);
        for (int32_t k = 0; k < found; k++) {
            if (hats[k] != hat) continue;
            sum[0] += (double)weights[k] * (double)vertices[i].target.x;
            sum[1] += (double)weights[k] * (double)vertices[i].target.y;
            sum[2] += (double)weights[k] * (double)vertices[i].target.z;
            weight += (double)weights[k];
        }
    }
    return (pliant_vec3){(float)(sum[0] / weight), (float)(sum[1] / weight),
                         (float)(sum[2] / weight)};
}

int32_t pliant_patch_add_anchor(const pliant_patch *patch, pliant_patch_vertex *vertices,
                                int32_t count)
{
    const pliant_model *model = patch->solver->model;
    const int32_t stored = model->hierarchy->vertex_count[model->finest_stored];
    if (count == 0 || vertices[0].vertex < stored) return count;
    const int32_t anchor = highest_hat(model, vertices, count);
    if (anchor < 0) return count;
    const pliant_vec3 target = mean_target(model, vertices, count, anchor);
    // Of a coarser level, its number is lower than any of the patch.
    memmove(vertices + 1, vertices, (size_t)count * sizeof *vertices);
    vertices[0] = (pliant_patch_vertex){.vertex = anchor, .is_anchor = 1, .target = target};
    return count + 1;
}

// ---- Coming ----

// The vertex of the patch that can become a node on behalf of one: itself, or, where the file has
// no level for it, the nearest of its ancestors. -1: none.
static int32_t deputy(const pliant_patch *patch, int32_t index)
{
    const pliant_model *model = patch->solver->model;
    const int32_t base = model->hierarchy->vertex_count[0];
    enum { front_limit = 8 };  // that many reach whatever is near
    int32_t front[front_limit] = {index}, count = 1, best = -1;
    double least = INFINITY;
    // Upwards by parents, breadth first.
    for (int32_t k = 0; k < count; k++) {
        const pliant_patch_vertex *v = &patch->vertices[front[k]];
        if (v->fit >= 0) {
            const double distance = square_distance(model, v->vertex, patch->numbers[index]);
            if (v->level < 0 && !patch->is_held[front[k]] && distance < least)
                best = front[k], least = distance;
            continue;
        }
        for (int side = 0; side < 2 && v->vertex >= base && count < front_limit; side++) {
            const int32_t parent = model->hierarchy->stencils[v->vertex - base].parents[side];
            if (patch->index_of[parent] >= 0) front[count++] = patch->index_of[parent];
        }
    }
    return best;
}

static int32_t is_off(const pliant_patch *patch, int32_t index)
{
    const pliant_patch_vertex *v = &patch->vertices[index];
    return v->level < 0 && !patch->is_held[index] && v->error > patch->def.tolerance;
}

// Hold back what is near a vertex that has been taken.
static void hold_around(pliant_patch *patch, int32_t index)
{
    const pliant_model *model = patch->solver->model;
    const int32_t vertex = patch->numbers[index];
    double nearest = 0;  // no nodes: nothing is known of scales
    for (int32_t i = 0; i < patch->count; i++) {
        if (patch->vertices[i].level < 0) continue;
        const double square = square_distance(model, vertex, patch->numbers[i]);
        if (nearest == 0 || square < nearest) nearest = square;
    }
    const double apart = fmax(coming_distance * coming_distance * model->areas[vertex],
                              coming_part * coming_part * nearest);
    for (int32_t i = 0; i < patch->count; i++)
        if (is_off(patch, i) && square_distance(model, vertex, patch->numbers[i]) < apart)
            patch->is_held[i] = 1;
}

int32_t pliant_patch_choose_coming(pliant_patch *patch)
{
    int32_t coming = 0;
    memset(patch->is_held, 0, (size_t)patch->count);
    for (;;) {
        int32_t worst = -1;
        for (int32_t i = 0; i < patch->count; i++)
            if (is_off(patch, i) &&
                (worst < 0 || patch->vertices[i].error > patch->vertices[worst].error))
                worst = i;
        if (worst < 0) return coming;
        const int32_t chosen = deputy(patch, worst);
        patch->is_held[worst] = 1;
        if (chosen < 0) continue;
        patch->is_held[chosen] = 1;
        patch->coming[coming++] = chosen;
        // Without a tolerance all are to be nodes.
        if (patch->def.tolerance > 0) hold_around(patch, worst);
    }
}

// ---- Going ----

static int32_t patience_of(const pliant_patch_vertex *v)
{
    return v->patience > 0 ? v->patience : first_patience;
}

static int32_t is_near_going(const pliant_patch *patch, int32_t vertex, int32_t going)
{
    const pliant_model *model = patch->solver->model;
    const double apart = going_distance * going_distance * model->areas[vertex];
    for (int32_t k = 0; k < going; k++)
        if (square_distance(model, vertex, patch->numbers[patch->coming[k]]) < apart) return 1;
    return 0;
}

int32_t pliant_patch_choose_going(pliant_patch *patch)
{
    int32_t node_count = 0, going = 0;
    for (int32_t i = 0; i < patch->count; i++) node_count += patch->vertices[i].level >= 0;
    while (node_count - going > 1) {
        int32_t least = -1;
        for (int32_t i = 0; i < patch->count; i++) {
            const pliant_patch_vertex *v = &patch->vertices[i];
            if (v->level < 0 || v->idle < patience_of(v)) continue;
            if (least >= 0 && v->slack >= patch->vertices[least].slack) continue;
            if (!is_near_going(patch, v->vertex, going)) least = i;
        }
        if (least < 0) return going;
        patch->vertices[least].patience = patience_of(&patch->vertices[least]);
        patch->coming[going++] = least;
    }
    return going;
}

static void note_return(const pliant_patch *patch, pliant_patch_vertex *v)
{
    if (!v->is_coming || v->level < 0 || v->patience == 0) return;
    if (pliant_patch_distance(v->target, v->came_for) > patch->def.tolerance)
        v->patience = first_patience;
    else if (v->patience < patience_limit) v->patience *= 2;
    v->came_for = v->target;
}

void pliant_patch_note_slack(pliant_patch *patch)
{
    const pliant_solver *solver = patch->solver;
    for (int32_t i = 0; i < patch->count; i++) {
        pliant_patch_vertex *v = &patch->vertices[i];
        note_return(patch, v);
        v->slack = INFINITY;
        if (v->level >= 0 && v->weight <= 0) {
            const int32_t member =
                pliant_constraint_find(solver->solved, solver->solved_count, v->vertex);
            pliant_vec3 u;
            if (member >= 0 && solver->solved[member].node.level == v->level &&
                pliant_solver_slack(solver, member, &u))
                v->slack = pliant_patch_distance(u, v->target);
        }
        v->idle = v->slack * patch->def.hysteresis < patch->def.tolerance ? v->idle + 1 : 0;
    }
}
