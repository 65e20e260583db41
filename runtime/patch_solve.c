// patch_solve.c: state a patch's nodes, solve, and refine until the tolerance is met.
#include "patch.h"

#include <math.h>
#include <string.h>

// An offset is stated so far inside the tolerance that rounding does not take it out.
static const double inside = 0.999;
// More than the solver's own margin (types.c), so that it does not think otherwise a moment later.
static const double margin = 1.5;

// ---- Statements ----

static void release_node(pliant_patch *patch, pliant_patch_vertex *v)
{
    if (pliant_patch_owns(patch, v))
        (void)!pliant_solver_release(patch->solver, (pliant_node){v->level, v->vertex});
    v->level = -1;
    v->weight = 0;
}

// State a node; 0: the solver has no room for it.
static int32_t state_node(pliant_patch *patch, pliant_patch_vertex *v, int32_t level)
{
    const pliant_vec3 value = {v->target.x + v->weight * v->offset.x,
                               v->target.y + v->weight * v->offset.y,
                               v->target.z + v->weight * v->offset.z};
    if (pliant_solver_displace(patch->solver, (pliant_node){level, v->vertex}, value) < 0) {
        release_node(patch, v);
        patch->report.is_full = 1;
        return 0;
    }
    v->level = level;
    v->stated = value;
    return 1;
}

// State all nodes, on the finest levels that span the same: a coarse hat with nodes all over it is
// of no more use than its vertex's own, and brings in the compression of one more level.
static void state_nodes(pliant_patch *patch)
{
    int32_t count = 0;
    for (int32_t i = 0; i < patch->count; i++) {
        if (patch->vertices[i].level < 0) continue;
        patch->nodes[count] = patch->vertices[i].vertex;
        patch->levels[count++] = patch->vertices[i].fit;
    }
    pliant_footprint_refine(&patch->footprint, patch->nodes, count, patch->levels);
    for (int32_t i = 0; i < count; i++) {
        const int32_t vertex = patch->nodes[i];
        const int32_t level =
            pliant_patch_stored_level(patch->solver->model, vertex, patch->levels[i]);
        (void)state_node(patch, &patch->vertices[patch->index_of[vertex]], level);
    }
}

// ---- What nodes leave behind ----

// What the last solve, whose ever it was, came to at the nodes.
static void note_tractions(pliant_patch *patch)
{
    const pliant_solver *solver = patch->solver;
    for (int32_t i = 0; i < patch->count; i++) {
        pliant_patch_vertex *v = &patch->vertices[i];
        v->last_level = v->level;
        v->solved_level = -1;
        if (v->level < 0) continue;
        const int32_t member =
            pliant_constraint_find(solver->solved, solver->solved_count, v->vertex);
        if (member < 0 || pliant_patch_distance(solver->solved[member].value, v->stated) > 0)
            continue;
        v->solved_level = solver->solved[member].node.level;
        v->traction = solver->reference[member];
    }
}

// Keep the traction that a node had, for as many calls as it takes to fade.
static void leave_behind(pliant_patch *patch, const pliant_patch_vertex *v)
{
    if (v->solved_level < 0 || patch->fading.count == patch->fade_capacity) return;
    patch->fades[patch->fading.count] = (pliant_patch_fade){.traction = v->traction, .weight = 1};
    patch->fading.loads[patch->fading.count++] = (pliant_load){.node = {v->solved_level, v->vertex},
                                                               .is_specified = 1,
                                                               .value = v->traction,
                                                               .weight = {-1, -1}};
    patch->solver->loads_changed = 1;
}

// Before a solve: nodes that are on other levels than in the last one, or gone. What came in this
// call has been shown to nobody.
static void leave_traces(pliant_patch *patch)
{
    for (int32_t i = 0; i < patch->count; i++) {
        const pliant_patch_vertex *v = &patch->vertices[i];
        if (v->last_level >= 0 && v->last_level != v->level && !v->is_coming)
            leave_behind(patch, v);
    }
}

// ---- A new patch ----

// Take over what set() listed: nodes at vertices that stay are kept, the others released. Those on
// the finest level go at once, as they do where all vertices are nodes; coarser hats, which only
// files without the finest level have at a patch's edge, fade.
static void adopt(pliant_patch *patch)
{
    if (!patch->is_set) return;
    const pliant_model *model = patch->solver->model;
    pliant_patch_vertex *old = patch->vertices, *now = patch->next;
    const int32_t old_count = patch->count;
    const int32_t count = pliant_patch_add_anchor(patch, now, patch->next_count);
    for (int32_t i = 0; i < count; i++) {
        const int32_t was = patch->index_of[now[i].vertex], is_anchor = now[i].is_anchor;
        const pliant_vec3 target = now[i].target;
        if (was >= 0) now[i] = old[was];
        else
            now[i] = (pliant_patch_vertex){.vertex = now[i].vertex,
                                           .is_new = 1,
                                           .level = -1,
                                           .last_level = -1,
                                           .solved_level = -1,
                                           .slack = INFINITY};
        now[i].target = target;
        now[i].is_anchor = is_anchor;
    }
    for (int32_t i = 0; i < old_count; i++) patch->index_of[old[i].vertex] = -1;
    for (int32_t i = 0; i < count; i++) {
        patch->index_of[now[i].vertex] = i;
        patch->numbers[i] = now[i].vertex;
    }
    for (int32_t i = 0; i < old_count; i++) {
        if (patch->index_of[old[i].vertex] >= 0 || old[i].level < 0) continue;
        if (old[i].level < model->finest_level) leave_behind(patch, &old[i]);
        release_node(patch, &old[i]);
    }
    if (count == 0)
        for (int32_t i = 0; i < patch->fading.count; i++) patch->fades[i].weight = 0;
    patch->vertices = now;
    patch->next = old;
    patch->count = count;
    patch->is_set = 0;
    pliant_footprint_fit(&patch->footprint, patch->numbers, count, patch->index_of, patch->levels);
    for (int32_t i = 0; i < count; i++)
        now[i].fit = pliant_patch_stored_level(model, now[i].vertex, patch->levels[i]);
}

// ---- Coming and going ----

// One step of every node on its way, none of them outside the tolerance, and of what fades.
static void advance(pliant_patch *patch)
{
    for (int32_t i = 0; i < patch->count; i++) {
        pliant_patch_vertex *v = &patch->vertices[i];
        if (v->weight <= 0) continue;
        v->weight = v->weight < 1.5f * v->step ? 0 : v->weight - v->step;
        const double way =
            (double)v->weight * pliant_patch_distance(v->offset, (pliant_vec3){0, 0, 0});
        const double most = inside * patch->def.tolerance;
        if (way > most) v->weight *= (float)(most / way);
    }
    const float step = patch->def.blend_steps > 0 ? 1 / (float)patch->def.blend_steps : 1;
    for (int32_t i = patch->fading.count; i-- > 0;) {
        pliant_patch_fade *fade = &patch->fades[i];
        pliant_load *load = &patch->fading.loads[i];
        const pliant_vec3 traction = fade->traction;
        const float w = fade->weight = fade->weight < 1.5f * step ? 0 : fade->weight - step;
        load->value = (pliant_vec3){w * traction.x, w * traction.y, w * traction.z};
        patch->solver->loads_changed = 1;
        if (w > 0 || pliant_patch_distance(load->summed, (pliant_vec3){0, 0, 0}) > 0) continue;
        const int32_t last = --patch->fading.count;
        *fade = patch->fades[last];
        *load = patch->fading.loads[last];
    }
}

static void thin_out(pliant_patch *patch)
{
    const int32_t going = pliant_patch_choose_going(patch);
    for (int32_t k = 0; k < going; k++) {
        pliant_patch_vertex *v = &patch->vertices[patch->coming[k]];
        release_node(patch, v);
        v->idle = 0;
    }
}

// A node that comes starts from where the surface is, but within the tolerance of its target; at
// vertices that are new to the patch it starts from its target.
static int32_t begin_node(pliant_patch *patch, int32_t index)
{
    pliant_patch_vertex *v = &patch->vertices[index];
    v->is_coming = 1;
    v->idle = 0;
    v->weight = 0;
    if (!v->is_new && patch->def.blend_steps > 0 && patch->def.tolerance > 0 && v->error > 0) {
        v->offset = (pliant_vec3){patch->u[index].x - v->target.x, patch->u[index].y - v->target.y,
                                  patch->u[index].z - v->target.z};
        v->weight = (float)fmin(1, inside * patch->def.tolerance / v->error);
        v->step = v->weight / (float)patch->def.blend_steps;
    }
    return state_node(patch, v, v->fit);
}

// The nodes of a patch that has none: those with the coarsest hats.
static void start(pliant_patch *patch)
{
    int32_t coarsest = INT32_MAX;
    for (int32_t i = 0; i < patch->count; i++) {
        const pliant_patch_vertex *v = &patch->vertices[i];
        if (v->level >= 0) return;
        if (v->fit >= 0 && v->fit < coarsest) coarsest = v->fit;
    }
    for (int32_t i = 0; i < patch->count; i++) {
        patch->vertices[i].error = 0;  // not measured yet
        if (patch->vertices[i].fit == coarsest) (void)begin_node(patch, i);
    }
}

static int32_t begin_nodes(pliant_patch *patch, int32_t coming)
{
    int32_t begun = 0;
    while (begun < coming && begin_node(patch, patch->coming[begun])) begun++;
    state_nodes(patch);
    return begun;
}

static void withdraw_nodes(pliant_patch *patch, int32_t from, int32_t to)
{
    for (int32_t k = from; k < to; k++) {
        pliant_patch_vertex *v = &patch->vertices[patch->coming[k]];
        release_node(patch, v);
        v->is_coming = 0;
    }
    state_nodes(patch);
}

// State the nodes that come, as many as can be solved for in time; returns how many. Where that is
// none, what time is left goes into the inverse that all of them need, until a call finds it made.
static int32_t refine(pliant_patch *patch, int64_t deadline, int64_t measure_ns)
{
    const int32_t coming = begin_nodes(patch, pliant_patch_choose_coming(patch));
    if (deadline == PLIANT_NEVER || coming == 0) return coming;
    const double left = (double)(deadline - pliant_clock_ns() - measure_ns);
    int32_t begun = coming;
    while (begun > 0 && margin * pliant_solver_predict(patch->solver) > left) {
        patch->report.is_late = 1;
        withdraw_nodes(patch, begun / 2, begun);
        begun /= 2;
    }
    if (begun == 0) {
        (void)begin_nodes(patch, coming);
        pliant_solver_prepare(patch->solver, deadline);
        withdraw_nodes(patch, 0, coming);
    }
    return begun;
}

// ---- The call ----

static void measure(pliant_patch *patch)
{
    // Refused for vertices that do not exist only.
    (void)!pliant_solver_displacements(patch->solver, patch->numbers, patch->count, patch->u);
    patch->report.error = 0;
    for (int32_t i = 0; i < patch->count; i++) {
        pliant_patch_vertex *v = &patch->vertices[i];
        v->error = v->is_anchor ? 0 : pliant_patch_distance(patch->u[i], v->target);
        patch->report.error = fmax(patch->report.error, v->error);
    }
}

static void report_nodes(pliant_patch *patch)
{
    pliant_patch_report *report = &patch->report;
    report->vertex_count = patch->count;
    for (int32_t i = 0; i < patch->fading.count; i++)
        report->blending += patch->fades[i].weight > 0;
    for (int32_t i = 0; i < patch->count; i++) {
        const pliant_patch_vertex *v = &patch->vertices[i];
        report->vertex_count -= v->is_anchor;
        if (v->level < 0) continue;
        report->node_count++;
        report->level_count[v->level]++;
        report->blending += v->weight > 0;
    }
}

pliant_status pliant_patch_solve(pliant_patch *patch, int64_t deadline)
{
    pliant_patch_report *report = &patch->report;
    *report = (pliant_patch_report){0};
    note_tractions(patch);
    adopt(patch);
    advance(patch);
    thin_out(patch);
    start(patch);
    state_nodes(patch);

    pliant_status status;
    for (;;) {
        leave_traces(patch);
        status = pliant_solver_solve(patch->solver, deadline);
        report->solve_count++;
        const int64_t solved = deadline == PLIANT_NEVER ? 0 : pliant_clock_ns();
        note_tractions(patch);
        measure(patch);
        if (report->error <= patch->def.tolerance) break;
        if (pliant_solver_last(patch->solver).is_late) {
            report->is_late = 1;
            break;
        }
        const int64_t measured = deadline == PLIANT_NEVER ? 0 : pliant_clock_ns();
        if (refine(patch, deadline, measured - solved) == 0) break;
    }
    pliant_patch_note_slack(patch);
    for (int32_t i = 0; i < patch->count; i++)
        patch->vertices[i].is_new = patch->vertices[i].is_coming = 0;
    report_nodes(patch);
    if (report->error <= patch->def.tolerance) {
        report->is_full = 0;
        report->is_late = status == PLIANT_LATE;
        return status;
    }
    report->is_full |= !report->is_late;
    return status == PLIANT_OK ? PLIANT_LATE : status;
}
