// player.c: executes the statements of a contact script against one solver, or on one scene.
#include "player.h"

#include "address.h"
#include "condition_statement.h"
#include "prop_statement.h"

#include "pliant/error.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct pliant_player {
    const pliant_model *model;
    pliant_model_info info;
    pliant_player_def def;
    int32_t finest;  // L

    pliant_scene *scene;            // NULL: Green's functions,
    pliant_conditions *conditions;  // which have these two; else NULL
    pliant_props *props;
    int is_decided;  // 1: a statement or step has settled which

    pliant_vec3 *surface;  // [surface_count]
    int32_t surface_count;

    pliant_probes probes;

    int64_t deadline_ns;  // of a solve, from its start
    double dt;            // s
    double time_start;    // time when dt last changed, s
    int64_t dt_steps;     // steps since
    pliant_step last;
};

static const double default_dt = 0.001;  // s: haptic rate

// ---- Messages ----

__attribute__((format(printf, 5, 6))) static pliant_status
refuse(const pliant_player *player, const pliant_statement *statement, pliant_error *err,
       pliant_status status, const char *format, ...)
{
    char reason[320];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(reason, sizeof reason, format, arguments);
    va_end(arguments);
    return pliant_error_set(err, status, "%.300s:%lld:%d: %s", player->def.script_name,
                            (long long)statement->line, (int)statement->column, reason);
}

// ---- Life ----

pliant_player_def pliant_player_default(const pliant_model *model)
{
    return (pliant_player_def){
        .script_name = "script",
        .level = pliant_model_describe(model).level_count - 1,
        .probe_rule = PLIANT_PROBES_ANYTIME,
        .prop_rule = PLIANT_PROPS_ALLOWED,
        .deadline_ns = PLIANT_NEVER,
        .compliance = PLIANT_COMPLIANCE_STORED,
        .kind_rule = PLIANT_KIND_BY_SCRIPT,
        .thread_count = 1,
    };
}

static pliant_status play_greens(pliant_player *player, pliant_error *err)
{
    player->surface_count = pliant_model_level_vertex_count(player->model, player->def.level);
    player->surface = calloc((size_t)player->surface_count + 1, sizeof *player->surface);
    if (!player->surface)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a player of %d vertices",
                                (int)player->info.vertex_count);
    const pliant_status status =
        pliant_conditions_create(player->model, player->def.compliance, &player->conditions, err);
    if (status < 0) return status;
    return pliant_props_create(player->model, player->conditions, &player->props, err);
}

static pliant_status play_lattice(pliant_player *player, pliant_error *err)
{
    if (player->def.greens_option)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s is about Green's functions: expected a play of those, found "
                                "one of a lattice",
                                player->def.greens_option);
    const pliant_status status =
        pliant_scene_create(player->model, player->def.thread_count, &player->scene, err);
    if (status >= 0) player->is_decided = 1;
    return status;
}

static void leave_greens(pliant_player *player)
{
    pliant_props_destroy(player->props);
    pliant_conditions_destroy(player->conditions);
    free(player->surface);
    player->props = NULL;
    player->conditions = NULL;
    player->surface = NULL;
}

pliant_status pliant_player_create(const pliant_model *model, const pliant_player_def *def,
                                   pliant_player **player, pliant_error *err)
{
    const pliant_model_info info = pliant_model_describe(model);
    if (def->level < 0 || def->level >= info.level_count)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "level: expected 0 to %d, found %d",
                                (int)info.level_count - 1, (int)def->level);
    pliant_player *p = calloc(1, sizeof *p);
    if (!p) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a player");
    p->model = model;
    p->info = info;
    p->def = *def;
    p->finest = info.level_count - 1;
    p->dt = default_dt;
    p->deadline_ns = def->deadline_ns;
    // Without Green's functions no vertex is free or fixed.
    const int has_greens = info.free_count + info.fixed_count > 0;
    const pliant_status status = def->kind_rule == PLIANT_KIND_LATTICE || !has_greens
                                     ? play_lattice(p, err)
                                     : play_greens(p, err);
    if (status < 0) {
        pliant_player_destroy(p);
        return status;
    }
    *player = p;
    return PLIANT_OK;
}

void pliant_player_destroy(pliant_player *player)
{
    if (!player) return;
    leave_greens(player);
    pliant_scene_destroy(player->scene);
    pliant_probes_clear(&player->probes);
    free(player);
}

// ---- Nodes and values ----

// 1: the surface has every vertex that a probe may look at, as it is.
static int is_whole(const pliant_player *player)
{
    return player->scene || player->def.level == player->finest;
}

// The vertex of the surface that a probe's words mean.
static pliant_status find_vertex(const pliant_player *player, const pliant_statement *statement,
                                 int32_t *vertex, pliant_error *err)
{
    pliant_error reason = {""};
    pliant_status status = PLIANT_OK;
    pliant_node node = {0, 0};
    if (player->scene)
        status = pliant_scene_find_vertex(player->scene, statement, &node.vertex, &reason);
    else if (statement->instance > 0)
        status = pliant_error_set(&reason, PLIANT_ERR_ARGUMENT,
                                  "instance %lld of 1: instances come before, and are a lattice's",
                                  (long long)statement->instance);
    else
        status = pliant_address_resolve(player->model, &statement->vertex, PLIANT_ADDRESS_VERTEX,
                                        &node, &reason);
    if (status < 0) return refuse(player, statement, err, status, "%s", reason.text);
    *vertex = node.vertex;
    return PLIANT_OK;
}

// ---- Statements ----

static pliant_status execute_condition(pliant_player *player, const pliant_statement *statement,
                                       pliant_error *err)
{
    pliant_error reason = {""};
    const pliant_status status = pliant_condition_statement_execute(
        player->conditions, player->props, player->model, statement, &reason);
    return status < 0 ? refuse(player, statement, err, status, "%s", reason.text) : PLIANT_OK;
}

static pliant_status execute_prop(pliant_player *player, const pliant_statement *statement,
                                  pliant_error *err)
{
    if (player->def.prop_rule == PLIANT_PROPS_REFUSED)
        return refuse(player, statement, err, PLIANT_ERR_ARGUMENT,
                      "--compare knows conditions and gravity only: expected no patches, tools or "
                      "proxies");
    pliant_error reason = {""};
    const pliant_status status =
        pliant_prop_statement_execute(player->props, player->model, statement, &reason);
    return status < 0 ? refuse(player, statement, err, status, "%s", reason.text) : PLIANT_OK;
}

static pliant_status execute_probe(pliant_player *player, const pliant_statement *statement,
                                   pliant_error *err)
{
    if (player->def.probe_rule == PLIANT_PROBES_FIRST && player->last.number > 0)
        return refuse(player, statement, err, PLIANT_ERR_ARGUMENT,
                      "probe %s after a step: with rows written per step (-o, --json), probes must "
                      "come before the first",
                      statement->name);
    if (pliant_probes_find(&player->probes, statement->name))
        return refuse(player, statement, err, PLIANT_ERR_ARGUMENT,
                      "probe %s is already there: expected another name", statement->name);
    int32_t vertex = 0;
    pliant_status status = find_vertex(player, statement, &vertex, err);
    if (status < 0) return status;
    pliant_probe probe = {.vertex = vertex % player->info.vertex_count,
                          .instance = (int32_t)statement->instance,
                          .place = vertex};
    snprintf(probe.name, sizeof probe.name, "%s", statement->name);
    if (player->last.number > 0 && is_whole(player)) {
        // The last step's surface holds the new probe too.
        probe.step = player->last.number;
        probe.u = pliant_player_surface(player)[vertex];
    }
    status = pliant_probes_add(&player->probes, &probe);
    if (status == PLIANT_ERR_CAPACITY)
        return refuse(player, statement, err, status, "more than %d probes", PLIANT_PROBE_LIMIT);
    return status < 0 ? refuse(player, statement, err, status, "no memory for another probe")
                      : PLIANT_OK;
}

static pliant_status execute_expect(pliant_player *player, const pliant_statement *statement,
                                    const pliant_observer *observer, pliant_error *err)
{
    const pliant_probe *probe = pliant_probes_find(&player->probes, statement->name);
    if (!probe)
        return refuse(player, statement, err, PLIANT_ERR_ARGUMENT,
                      "no probe %s: expected one declared before", statement->name);
    if (probe->step == 0 || probe->step != player->last.number)
        return refuse(player, statement, err, PLIANT_ERR_ARGUMENT,
                      "probe %s has no displacement yet: expected a step before", statement->name);
    const double found[3] = {probe->u.x, probe->u.y, probe->u.z};
    pliant_expectation expectation = {
        .probe = probe, .line = statement->line, .tolerance = statement->scalar};
    double square = 0;
    for (int c = 0; c < 3; c++) {
        expectation.expected[c] = statement->value[c];
        square += (found[c] - statement->value[c]) * (found[c] - statement->value[c]);
    }
    expectation.distance = sqrt(square);
    expectation.met = expectation.distance <= expectation.tolerance;  // NaN is not
    if (observer && observer->expected) {
        const pliant_status status = observer->expected(observer->context, &expectation, err);
        if (status < 0) return status;
    }
    if (expectation.met) return PLIANT_OK;
    return refuse(player, statement, err, PLIANT_ERR_ARGUMENT,
                  "expect %s: found %.6g %.6g %.6g, expected %.6g %.6g %.6g: distance %.6g, "
                  "tolerance %.6g",
                  probe->name, found[0], found[1], found[2], statement->value[0],
                  statement->value[1], statement->value[2], expectation.distance,
                  expectation.tolerance);
}

static pliant_status execute_dt(pliant_player *player, const pliant_statement *statement,
                                pliant_error *err)
{
    if (!(statement->scalar > 0))
        return refuse(player, statement, err, PLIANT_ERR_ARGUMENT,
                      "dt: expected more than 0 seconds, found %g", statement->scalar);
    player->time_start += (double)player->dt_steps * player->dt;
    player->dt_steps = 0;
    player->dt = statement->scalar;
    return PLIANT_OK;
}

// ---- Steps ----

// A surface reconstructed to a coarser level holds that level's smoothed values (lifting moves
// them), so probes are then evaluated selectively: what they say does not depend on the level.
static pliant_status read_probes(pliant_player *player)
{
    const int whole = is_whole(player);
    const pliant_vec3 *surface = pliant_player_surface(player);
    pliant_probes *probes = &player->probes;
    if (!whole && probes->count > 0) {
        const pliant_status status =
            pliant_solver_displacements(pliant_conditions_solver(player->conditions),
                                        probes->places, probes->count, probes->scratch);
        if (status < 0) return status;
    }
    for (int32_t i = 0; i < probes->count; i++) {
        pliant_probe *probe = &probes->list[i];
        probe->step = player->last.number;
        probe->u = whole ? surface[probe->place] : probes->scratch[i];
    }
    return PLIANT_OK;
}

// The finest level that anything was solved on: of constraints and of the nodes that tools push.
// The solver's own is the finest there is when it has no constraints.
static int32_t level_of(const pliant_solver_report *solver, const pliant_props_report *props)
{
    if (props->finest_level < 0) return solver->level;
    if (solver->constraint_count == 0 || props->finest_level > solver->level)
        return props->finest_level;
    return solver->level;
}

static pliant_status step_scene(pliant_player *player, const pliant_statement *statement,
                                pliant_error *err)
{
    pliant_error reason = {""};
    pliant_scene_step_report report;
    const pliant_status status = pliant_scene_step(player->scene, player->dt, &report, &reason);
    if (status < 0)
        return refuse(player, statement, err, status, "step %lld: %s",
                      (long long)player->last.number + 1, reason.text);
    player->dt_steps++;
    player->last = (pliant_step){
        .number = player->last.number + 1,
        .time = player->time_start + (double)player->dt_steps * player->dt,
        .deadline_ns = PLIANT_NEVER,
        .total_ns = report.phase_ns[PLIANT_SCENE_PHASE_TOTAL],
        .kind = PLIANT_PLAY_LATTICE,
        .report = {.constraint_count = report.held_count, .level = player->finest},
        .force = report.force,
    };
    memcpy(player->last.phase_ns, report.phase_ns, sizeof report.phase_ns);
    return PLIANT_OK;
}

static pliant_status step_greens(pliant_player *player, const pliant_statement *statement,
                                 pliant_error *err)
{
    const int64_t start = pliant_clock_ns(), given = player->deadline_ns;
    const int64_t deadline = given < PLIANT_NEVER - start ? start + given : PLIANT_NEVER;
    pliant_props_report props;
    const pliant_status solved = pliant_props_solve(player->props, deadline, &props);
    const int64_t solved_at = pliant_clock_ns();
    pliant_solver *solver = pliant_conditions_solver(player->conditions);
    pliant_status status = solved;
    if (solved >= 0) status = pliant_solver_surface(solver, player->def.level, player->surface);
    const int64_t end = pliant_clock_ns();
    if (status < 0)
        return refuse(player, statement, err, status, "step %lld with %d constraints: %s",
                      (long long)player->last.number + 1,
                      (int)pliant_solver_constraint_count(solver),
                      status == PLIANT_ERR_SINGULAR ? "they contradict each other (singular)"
                                                    : pliant_status_name(status));
    pliant_solver_report report = pliant_solver_last(solver);
    report.level = level_of(&report, &props);
    report.is_late |= props.is_late;
    // Several solves may be in time one by one, and what is between them not.
    if (solved_at - deadline > report.lateness_ns && !pliant_props_is_empty(player->props))
        report.lateness_ns = solved_at - deadline;
    const pliant_vec3 force = pliant_solver_contact_force(solver);
    player->dt_steps++;
    player->last = (pliant_step){
        .number = player->last.number + 1,
        .time = player->time_start + (double)player->dt_steps * player->dt,
        .deadline_ns = given,
        .status = solved,
        .total_ns = end - start,
        .kind = PLIANT_PLAY_GREENS,
        .phase_ns = {[PLIANT_PHASE_CAPACITANCE] = report.capacitance_ns,
                     [PLIANT_PHASE_CONTACT] = report.contact_ns,
                     [PLIANT_PHASE_SUMMATION] = report.summation_ns,
                     [PLIANT_PHASE_SURFACE] = report.surface_ns,
                     [PLIANT_PHASE_TOTAL] = end - start},
        .report = report,
        .force = {force.x + props.force.x, force.y + props.force.y, force.z + props.force.z},
    };
    return PLIANT_OK;
}

static pliant_status step_once(pliant_player *player, const pliant_statement *statement,
                               pliant_error *err)
{
    pliant_status status =
        player->scene ? step_scene(player, statement, err) : step_greens(player, statement, err);
    if (status < 0) return status;
    status = read_probes(player);
    if (status < 0)
        return refuse(player, statement, err, status, "probes of step %lld: %s",
                      (long long)player->last.number, pliant_status_name(status));
    return PLIANT_OK;
}

static pliant_status execute_step(pliant_player *player, const pliant_statement *statement,
                                  const pliant_observer *observer, pliant_error *err)
{
    for (int64_t i = 0; i < statement->count; i++) {
        pliant_status status = step_once(player, statement, err);
        if (status < 0) return status;
        if (!observer || !observer->stepped) continue;
        status = observer->stepped(observer->context, player, &player->last, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

void pliant_player_set_deadline(pliant_player *player, int64_t deadline_ns)
{
    player->deadline_ns = deadline_ns;
}

// Go over from Green's functions to the model's lattice with what has been said so far.
static pliant_status change_to_lattice(pliant_player *player, const pliant_statement *statement,
                                       pliant_error *err)
{
    const char *word = pliant_statement_keyword(statement->kind, statement->shape);
    if (player->is_decided)
        return refuse(player, statement, err, PLIANT_ERR_ARGUMENT,
                      "%s is about a lattice: this play is of Green's functions already", word);
    const pliant_vec3 g = pliant_conditions_gravity(player->conditions);
    const pliant_statement gravity = {.kind = PLIANT_STATEMENT_GRAVITY,
                                      .value = {(double)g.x, (double)g.y, (double)g.z}};
    pliant_error reason = {""};
    pliant_status status = play_lattice(player, &reason);
    if (status >= 0) status = pliant_scene_execute(player->scene, &gravity, &reason);
    if (status < 0) {
        pliant_scene_destroy(player->scene);
        player->scene = NULL;
        player->is_decided = 0;
        return refuse(player, statement, err, status, "%s is about a lattice: %s", word,
                      reason.text);
    }
    leave_greens(player);
    return PLIANT_OK;
}

static pliant_status execute_scene(pliant_player *player, const pliant_statement *statement,
                                   pliant_error *err)
{
    pliant_error reason = {""};
    const pliant_status status = pliant_scene_execute(player->scene, statement, &reason);
    return status < 0 ? refuse(player, statement, err, status, "%s", reason.text) : PLIANT_OK;
}

static pliant_status execute_common(pliant_player *player, const pliant_statement *statement,
                                    const pliant_observer *observer, pliant_error *err)
{
    switch (statement->kind) {
    case PLIANT_STATEMENT_PROBE:
        return execute_probe(player, statement, err);
    case PLIANT_STATEMENT_DT:
        return execute_dt(player, statement, err);
    case PLIANT_STATEMENT_STEP:
        return execute_step(player, statement, observer, err);
    case PLIANT_STATEMENT_EXPECT:
        return execute_expect(player, statement, observer, err);
    default:
        return PLIANT_OK;  // of the versions the parser accepts what it knows
    }
}

pliant_status pliant_player_execute(pliant_player *player, const pliant_statement *statement,
                                    const pliant_observer *observer, pliant_error *err)
{
    const pliant_statement_family family = pliant_statement_family_of(statement->kind);
    if (family == PLIANT_FAMILY_LATTICE && !player->scene) {
        const pliant_status status = change_to_lattice(player, statement, err);
        if (status < 0) return status;
    }
    if (family == PLIANT_FAMILY_GREENS || statement->kind == PLIANT_STATEMENT_STEP)
        player->is_decided = 1;
    switch (statement->kind) {
    case PLIANT_STATEMENT_NONE:
    case PLIANT_STATEMENT_VERSION:
    case PLIANT_STATEMENT_PROBE:
    case PLIANT_STATEMENT_DT:
    case PLIANT_STATEMENT_STEP:
    case PLIANT_STATEMENT_EXPECT:
        return execute_common(player, statement, observer, err);
    default:
        break;
    }
    if (player->scene) return execute_scene(player, statement, err);
    switch (statement->kind) {
    case PLIANT_STATEMENT_DISPLACE:
    case PLIANT_STATEMENT_TRACTION:
    case PLIANT_STATEMENT_FORCE:
    case PLIANT_STATEMENT_SUPPORT:
    case PLIANT_STATEMENT_GRAVITY:
    case PLIANT_STATEMENT_RELEASE:
        return execute_condition(player, statement, err);
    case PLIANT_STATEMENT_DEADLINE:
        pliant_player_set_deadline(player,
                                   statement->count < 0 ? PLIANT_NEVER : 1000 * statement->count);
        return PLIANT_OK;
    default:
        return execute_prop(player, statement, err);
    }
}

// A refusal that the next line may survive: the script's or the model's, not the machine's.
static int is_refusal(pliant_status status)
{
    return status < 0 && status != PLIANT_ERR_IO && status != PLIANT_ERR_MEMORY;
}

pliant_status pliant_player_play(pliant_player *player, pliant_script *script,
                                 const pliant_observer *observer, pliant_error *err)
{
    for (;;) {
        pliant_statement statement;
        int more = 0;
        pliant_error reason;
        pliant_status status = pliant_script_next(script, &statement, &more, &reason);
        if (status >= 0 && !more) return PLIANT_OK;
        if (status >= 0) status = pliant_player_execute(player, &statement, observer, &reason);
        if (status >= 0) continue;
        if (is_refusal(status) && observer && observer->refused &&
            observer->refused(observer->context, &reason))
            continue;
        if (err) *err = reason;
        return status;
    }
}

// ---- What can be read ----

const pliant_step *pliant_player_last(const pliant_player *player)
{
    return &player->last;
}

const pliant_vec3 *pliant_player_surface(const pliant_player *player)
{
    if (player->scene) return pliant_instances_displacements(pliant_scene_instances(player->scene));
    return player->surface;
}

int32_t pliant_player_surface_count(const pliant_player *player)
{
    if (player->scene) return pliant_instances_surface_count(pliant_scene_instances(player->scene));
    return player->surface_count;
}

int32_t pliant_player_level(const pliant_player *player)
{
    return player->def.level;
}

const pliant_probe *pliant_player_probes(const pliant_player *player, int32_t *count)
{
    *count = player->probes.count;
    return player->probes.list;
}

const pliant_condition *pliant_player_conditions(const pliant_player *player, int32_t *count)
{
    *count = 0;
    return player->conditions ? pliant_conditions_list(player->conditions, count) : NULL;
}

pliant_status pliant_player_prepare(pliant_player *player, pliant_error *err)
{
    return player->scene ? pliant_scene_prepare(player->scene, err) : PLIANT_OK;
}

pliant_play_kind pliant_player_kind(const pliant_player *player)
{
    return player->scene ? PLIANT_PLAY_LATTICE : PLIANT_PLAY_GREENS;
}

const pliant_scene *pliant_player_scene(const pliant_player *player)
{
    return player->scene;
}

pliant_vec3 pliant_player_gravity(const pliant_player *player)
{
    return pliant_conditions_gravity(player->conditions);
}

const pliant_props *pliant_player_props(const pliant_player *player)
{
    return player->props;
}

pliant_solver *pliant_player_solver(pliant_player *player)
{
    return pliant_conditions_solver(player->conditions);
}
