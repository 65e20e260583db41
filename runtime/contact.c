// contact.c: rigid tools on a solver: life, tools, the solve that goes round, results.
#include "contact.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// The default tolerance is this part of the longest side of the model's box.
static const double tolerance_part = 1.0 / 500;
// Gaps at nodes are closed to this part of the tolerance.
static const double residual_part = 0.01;
// And forces are along normals to this, rad: a loop of a ball on one level then takes or gives 0.2%
// of the energy on the way, 2% with 2e-3 (test_contact.c).
static const double turn_limit = 5e-4;
// A pass that leaves more of the residual than this is not worth another: what is left is the
// difference between the passive compliance and the stored one.
static const double worth_part = 0.7;
// Passes for one set of nodes: normals turn with the surface, and each pass gains some two digits.
enum { passes_at_once = 6 };
// Passes for a solve; levels times those would be enough, if there were nothing to come back to.
enum { pass_limit = 40 };
// A round tool moves by up to half of its radius at a time, so that the surface stays on its side;
// in so many times at most.
static const double step_part = 0.5;
enum { step_limit = 8 };
// Limits of the definition.
enum { tool_limit = 64, fade_limit = 10000 };

// ---- Life ----

static void lay_out(pliant_arena *arena, pliant_contact *contact)
{
    const pliant_model *model = contact->model;
    const size_t n = (size_t)model->vertex_count;
    const size_t nodes = (size_t)contact->def.node_capacity;
    const size_t tools = (size_t)contact->def.tool_capacity;
    const size_t free_count = (size_t)model->domains[PLIANT_DOMAIN_FREE].count;
    const size_t queries = (size_t)contact->candidate_capacity + (size_t)contact->sample_capacity;
    pliant_vertex_tree_lay_out(arena, (int32_t)free_count, &contact->tree);
    pliant_contact_levels_lay_out(arena, model, &contact->levels);
    pliant_contact_law_lay_out(arena, contact->def.node_capacity, &contact->law);
    PLIANT_TAKE(arena, contact->asked, tools);
    PLIANT_TAKE(arena, contact->reached, tools);
    PLIANT_TAKE(arena, contact->results, tools);
    PLIANT_TAKE(arena, contact->candidates, contact->candidate_capacity);
    PLIANT_TAKE(arena, contact->query, queries);
    PLIANT_TAKE(arena, contact->displacement, queries);
    PLIANT_TAKE(arena, contact->found, free_count);
    PLIANT_TAKE(arena, contact->candidate_of, tools * n);
    PLIANT_TAKE(arena, contact->pairs, nodes);
    PLIANT_TAKE(arena, contact->next_pairs, nodes);
    PLIANT_TAKE(arena, contact->pair_of, tools * n);
    PLIANT_TAKE(arena, contact->keys, nodes);
    PLIANT_TAKE(arena, contact->chosen, nodes);
    PLIANT_TAKE(arena, contact->nodes, nodes);
    PLIANT_TAKE(arena, contact->node_of, n);
    PLIANT_TAKE(arena, contact->compliance, 9 * nodes * nodes);
    PLIANT_TAKE(arena, contact->held, contact->solver->constraint_capacity);
    PLIANT_TAKE(arena, contact->node_force, 3 * nodes);
    PLIANT_TAKE(arena, contact->node_shift, 3 * nodes);
    PLIANT_TAKE(arena, contact->traction, nodes);
    PLIANT_TAKE(arena, contact->matrix, 9 * nodes * nodes);
    PLIANT_TAKE(arena, contact->row, 3 * nodes);
    PLIANT_TAKE(arena, contact->b, 3 * nodes);
    PLIANT_TAKE(arena, contact->force, 3 * nodes);
    PLIANT_TAKE(arena, contact->friction, nodes);
    PLIANT_TAKE(arena, contact->frames, 9 * nodes);
    PLIANT_TAKE(arena, contact->loads, nodes);
    PLIANT_TAKE(arena, contact->coarsened, free_count);
    PLIANT_TAKE(arena, contact->losses, (size_t)PLIANT_CONTACT_LOSS_PART * nodes);
    PLIANT_TAKE(arena, contact->touched, nodes);
    PLIANT_TAKE(arena, contact->calm, n);
    PLIANT_TAKE(arena, contact->patience, n);
}

static double longest_side(const pliant_model *model)
{
    double most = 0;
    for (int c = 0; c < 3; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int32_t v = 0; v < model->vertex_count; v++) {
            low = fmin(low, model->view.vertices[3 * (size_t)v + (size_t)c]);
            high = fmax(high, model->view.vertices[3 * (size_t)v + (size_t)c]);
        }
        most = fmax(most, high - low);
    }
    return most;
}

static int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

pliant_contact_def pliant_contact_default(const pliant_solver *solver)
{
    const pliant_model_info info = pliant_model_describe(solver->model);
    return (pliant_contact_def){
        .node_capacity = least(64, least(solver->constraint_capacity, solver->load_capacity)),
        .tool_capacity = 4,
        .tolerance = tolerance_part * longest_side(solver->model),
        .fade_count = 16,
        .coarsest_level = info.coarsest_constraint_level,
        .finest_level = info.finest_constraint_level};
}

static pliant_status check_def(const pliant_solver *solver, const pliant_contact_def *def,
                               pliant_error *err)
{
    const pliant_model_info info = pliant_model_describe(solver->model);
    const struct {
        const char *name;
        int32_t value, least, most;
    } fields[] = {
        {"node_capacity", def->node_capacity, 1,
         least(solver->constraint_capacity, solver->load_capacity)},
        {"tool_capacity", def->tool_capacity, 1, tool_limit},
        {"fade_count", def->fade_count, 0, fade_limit},
        {"coarsest_level", def->coarsest_level, info.coarsest_constraint_level,
         info.finest_constraint_level},
        {"finest_level", def->finest_level, def->coarsest_level, info.finest_constraint_level}};
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
        if (fields[i].value < fields[i].least || fields[i].value > fields[i].most)
            return pliant_error_set(
                err, PLIANT_ERR_ARGUMENT, "pliant_contact_def: %s: expected %d to %d, found %d",
                fields[i].name, fields[i].least, fields[i].most, fields[i].value);
    if (!(def->tolerance > 0) || !isfinite(def->tolerance))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_contact_def: tolerance: expected a length above 0, "
                                "found %g",
                                def->tolerance);
    if (solver->scratch.compliance != PLIANT_COMPLIANCE_PASSIVE)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_contact_create: expected a solver with passive "
                                "compliance, found one with the stored");
    return PLIANT_OK;
}

pliant_status pliant_contact_create(pliant_solver *solver, const pliant_contact_def *def,
                                    pliant_contact **result, pliant_error *err)
{
    if (!solver || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_contact_create: expected a solver and a place, found NULL");
    const pliant_contact_def used = def ? *def : pliant_contact_default(solver);
    pliant_status status = check_def(solver, &used, err);
    if (status < 0) return status;
    pliant_contact *contact = calloc(1, sizeof *contact);
    if (!contact) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a contact");
    const pliant_model *model = solver->model;
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    contact->solver = solver;
    contact->model = model;
    contact->def = used;
    // Every vertex near every tool; that is no bound of a frame's, only of memory.
    const int64_t candidates = (int64_t)domain->count * used.tool_capacity;
    contact->candidate_capacity = (int32_t)(candidates < INT32_MAX ? candidates : INT32_MAX);
    contact->sample_capacity = pliant_contact_sample_capacity(solver);

    lay_out(&contact->arena, contact);
    status = pliant_arena_reserve(&contact->arena, err);
    if (status < 0) {
        pliant_contact_destroy(contact);
        return status;
    }
    lay_out(&contact->arena, contact);
    pliant_vertex_tree_build(&contact->tree, domain->nodes, model->view.vertices);
    pliant_contact_levels_begin(&contact->levels, used.coarsest_level, used.finest_level);
    pliant_contact_begin_patience(contact);
    const size_t n = (size_t)model->vertex_count, tools = (size_t)used.tool_capacity;
    memset(contact->candidate_of, 0xff, tools * n * sizeof *contact->candidate_of);
    memset(contact->pair_of, 0xff, tools * n * sizeof *contact->pair_of);
    memset(contact->node_of, 0xff, n * sizeof *contact->node_of);
    contact->report.coarsest_level = contact->report.finest_level = -1;
    contact->report.is_met = 1;
    *result = contact;
    return PLIANT_OK;
}

void pliant_contact_destroy(pliant_contact *contact)
{
    if (!contact) return;
    if (contact->arena.base) {
        pliant_contact_check_loads(contact);
        for (int32_t i = 0; i < contact->load_count; i++)
            if (pliant_solver_release(contact->solver, contact->loads[i].node) < 0) break;
    }
    pliant_arena_release(&contact->arena);
    free(contact);
}

// ---- Tools ----

pliant_status pliant_contact_set_tool(pliant_contact *contact, int32_t index,
                                      const pliant_tool *tool)
{
    if (index < 0 || index >= contact->def.tool_capacity || !tool) return PLIANT_ERR_ARGUMENT;
    return pliant_tool_shape_begin(tool, &contact->asked[index]);
}

// The part of the way to where a tool is asked to be that it may go at once.
static double get_step(const pliant_contact *contact, int32_t tool)
{
    const pliant_tool_shape *from = &contact->reached[tool], *to = &contact->asked[tool];
    if (from->kind != to->kind || from->kind == PLIANT_TOOL_PLANE ||
        contact->results[tool].node_count == 0)
        return 1;
    double square = 0;
    for (int k = 0; k < 2; k++) {
        const double *p = k ? from->b : from->a, *q = k ? to->b : to->a;
        const double way = (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) +
                           (p[2] - q[2]) * (p[2] - q[2]);
        if (k == 0 || from->kind == PLIANT_TOOL_CAPSULE) square = fmax(square, way);
    }
    const double step = step_part * to->radius;
    return square > step * step ? step / sqrt(square) : 1;
}

// Move a tool a part of its way and what sticks to it along.
static void move_tool(pliant_contact *contact, int32_t tool, double part)
{
    const pliant_tool_shape before = contact->reached[tool];
    contact->reached[tool] = pliant_tool_shape_between(&before, &contact->asked[tool], part);
    const pliant_tool_motion motion = pliant_tool_motion_between(&before, &contact->reached[tool]);
    for (int32_t i = 0; i < contact->pair_count; i++) {
        pliant_contact_pair *pair = &contact->pairs[i];
        double moved[3];
        if (pair->tool != tool || !pliant_contact_is_pushed(pair)) continue;
        pliant_tool_motion_apply(&motion, pair->anchor, moved);
        memcpy(pair->anchor, moved, sizeof moved);
    }
}

// Returns 1 when all tools are where they were asked to be. They go together.
static int32_t move_tools(pliant_contact *contact, int32_t step)
{
    double part = 1;
    for (int32_t t = 0; t < contact->def.tool_capacity && step < step_limit; t++)
        part = fmin(part, get_step(contact, t));
    for (int32_t t = 0; t < contact->def.tool_capacity; t++) move_tool(contact, t, part);
    return part >= 1;
}

// ---- Solve ----

// What the caller has stated something about is no node of ours any more.
static void drop_taken(pliant_contact *contact)
{
    int32_t is_any = 0;
    for (int32_t i = 0; i < contact->pair_count; i++)
        is_any |= pliant_contact_is_taken(contact, contact->pairs[i].node.vertex);
    if (is_any || contact->room < contact->pair_count) pliant_contact_choose_pairs(contact);
}

// After carrying over: start with offsets that make the forces that there are the solution.
static void settle(pliant_contact *contact, int64_t deadline)
{
    pliant_contact_press(contact, deadline);
    pliant_contact_evaluate(contact);
    pliant_contact_set_offsets(contact);
}

// Where the surface is with the forces there were, under what the caller has stated since.
static void begin_solve(pliant_contact *contact, int64_t deadline)
{
    pliant_contact_check_loads(contact);
    drop_taken(contact);
    pliant_contact_fade(contact);
    pliant_contact_press(contact, deadline);
    pliant_contact_evaluate(contact);
    if (contact->coarsened_count > 0) pliant_contact_go_back(contact, deadline);
    for (int32_t i = 0; i < contact->pair_count; i++)
        if (!pliant_contact_is_pushed(&contact->pairs[i]))
            memcpy(contact->pairs[i].anchor, contact->pairs[i].x, sizeof contact->pairs[i].x);
}

static int32_t is_touched(const pliant_contact *contact)
{
    if (contact->load_count > 0) return 1;
    for (int32_t i = 0; i < contact->pair_count; i++)
        if (contact->pairs[i].gap + contact->pairs[i].offset < 0) return 1;
    return 0;
}

// Forces for the present set of nodes, and where the surface is with them.
static void run_pass(pliant_contact *contact, int64_t deadline)
{
    if (is_touched(contact)) {
        pliant_contact_apply_law(contact);
        pliant_contact_press(contact, deadline);
    }
    pliant_contact_evaluate(contact);
    pliant_contact_choose_pairs(contact);
    contact->report.iterations++;
}

// Go round until the tolerance is kept or the time is up. Returns 1 in the latter case.
static int32_t go_round(pliant_contact *contact, int64_t deadline)
{
    int64_t begin = pliant_clock_ns(), longest = 0;
    int32_t is_there = move_tools(contact, 0), steps = 1, passes = 0;
    pliant_contact_list_candidates(contact);
    pliant_contact_choose_pairs(contact);
    double before = INFINITY;
    for (;;) {
        run_pass(contact, deadline);
        passes++;
        const double residual = pliant_contact_residual(contact);
        const int32_t is_solved = (residual <= residual_part * contact->def.tolerance &&
                                   pliant_contact_turn(contact) <= turn_limit) ||
                                  passes >= passes_at_once ||
                                  (passes > 2 && residual > worth_part * before);
        before = residual;
        const int64_t now = pliant_clock_ns();
        longest = now - begin > longest ? now - begin : longest;
        begin = now;
        const int32_t is_over = deadline != PLIANT_NEVER && now > deadline - longest;
        if (!is_there) {
            if (is_over) return 1;
            is_there = move_tools(contact, steps++);
            pliant_contact_list_candidates(contact);
            pliant_contact_choose_pairs(contact);
            passes = 0;
            continue;
        }
        if (contact->report.iterations >= pass_limit) return 0;
        if (is_solved && pliant_contact_is_fine(contact)) return 0;
        if (is_over) return 1;
        if (is_solved) {
            if (pliant_contact_refine(contact) == 0) return 0;
            settle(contact, deadline);
            passes = 0;
            before = INFINITY;
        }
    }
}

static void sum_up(pliant_contact *contact)
{
    pliant_contact_report *report = &contact->report;
    report->coarsest_level = report->finest_level = -1;
    report->node_count = 0;
    report->watched_count = contact->pair_count;
    report->candidate_count = contact->candidate_count;
    for (int32_t t = 0; t < contact->def.tool_capacity; t++)
        contact->results[t] = (pliant_tool_result){0};
    for (int32_t i = 0; i < contact->pair_count; i++) {
        const pliant_contact_pair *pair = &contact->pairs[i];
        if (!pliant_contact_is_pushed(pair)) continue;
        const int32_t level = pair->node.level;
        if (report->node_count == 0 || level < report->coarsest_level)
            report->coarsest_level = level;
        if (level > report->finest_level) report->finest_level = level;
        contact->chosen[report->node_count++] = i;
        double force[3], arm[3];
        for (int c = 0; c < 3; c++) {
            force[c] = pair->area * pair->pressure[c];
            arm[c] = pair->x[c] - contact->reached[pair->tool].a[c];
        }
        pliant_tool_result *result = &contact->results[pair->tool];
        result->node_count++;
        result->force.x += (float)force[0];
        result->force.y += (float)force[1];
        result->force.z += (float)force[2];
        result->torque.x += (float)(arm[1] * force[2] - arm[2] * force[1]);
        result->torque.y += (float)(arm[2] * force[0] - arm[0] * force[2]);
        result->torque.z += (float)(arm[0] * force[1] - arm[1] * force[0]);
    }
}

// What slides or is not pushed has its place where it is.
static void drop_anchors(pliant_contact *contact)
{
    for (int32_t i = 0; i < contact->pair_count; i++) {
        pliant_contact_pair *pair = &contact->pairs[i];
        if (pair->is_sliding || !pliant_contact_is_pushed(pair))
            memcpy(pair->anchor, pair->x, sizeof pair->x);
    }
}

pliant_status pliant_contact_solve(pliant_contact *contact, int64_t deadline)
{
    const int64_t begin = pliant_clock_ns();
    contact->report = (pliant_contact_report){0};
    begin_solve(contact, deadline);
    contact->report.is_late = go_round(contact, deadline);
    contact->report.is_late |= contact->solver_status == PLIANT_LATE;
    drop_anchors(contact);
    sum_up(contact);
    pliant_contact_judge(contact);
    if (!contact->report.is_late) pliant_contact_coarsen(contact);
    const int64_t end = pliant_clock_ns();
    contact->report.total_ns = end - begin;
    contact->report.lateness_ns = deadline != PLIANT_NEVER && end > deadline ? end - deadline : 0;
    return contact->report.is_late ? PLIANT_LATE : contact->solver_status;
}

// ---- Results ----

pliant_tool_result pliant_contact_tool(const pliant_contact *contact, int32_t index)
{
    if (index < 0 || index >= contact->def.tool_capacity) return (pliant_tool_result){0};
    return contact->results[index];
}

pliant_contact_node pliant_contact_get(const pliant_contact *contact, int32_t i)
{
    if (i < 0 || i >= contact->report.node_count)
        return (pliant_contact_node){.node = {-1, -1}, .tool = -1};
    const pliant_contact_pair *pair = &contact->pairs[contact->chosen[i]];
    const double *p = pair->pressure, *n = pair->pushed_along;
    return (pliant_contact_node){.node = pair->node,
                                 .tool = pair->tool,
                                 .force = {(float)(pair->area * p[0]), (float)(pair->area * p[1]),
                                           (float)(pair->area * p[2])},
                                 .normal = {(float)n[0], (float)n[1], (float)n[2]},
                                 .gap = (float)pair->gap,
                                 .is_sliding = pair->is_sliding};
}

pliant_contact_report pliant_contact_last(const pliant_contact *contact)
{
    return contact->report;
}
