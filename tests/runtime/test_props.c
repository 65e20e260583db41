// test_props.c: patches, tools and proxies of scripts: what is solved, reported, moved over,
// refused.
#include "allocations.h"
#include "check.h"

#include "pliant/error.h"
#include "script_lines.h"
#include "synthetic_model.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[64];
static pliant_model *model;  // the unit sphere on 642 vertices, all levels, nothing thresholded

static int set_up(void **state)
{
    (void)state;
    char path[128];
    pliant_error err;
    strcpy(folder, "/tmp/pliant-props-XXXXXX");
    if (!mkdtemp(folder)) return -1;
    snprintf(path, sizeof path, "%s/model.h5", folder);
    check_synthetic *s =
        check_synthetic_create(&(check_synthetic_def){.levels = 3,
                                                      .wavelet = pliant_wavelet_default(),
                                                      .blocks = CHECK_FREE_BLOCK,
                                                      .level_mask = 15});
    check_synthetic_write(s, path);
    check_synthetic_destroy(s);
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    pliant_model_close(model);
    return rmdir(folder);
}

static pliant_player *create(void)
{
    pliant_error err;
    pliant_player *player;
    pliant_player_def def = pliant_player_default(model);
    def.script_name = "t.script";
    check_ok(pliant_player_create(model, &def, &player, &err), &err);
    return player;
}

static const pliant_prop *find(const pliant_player *player, const char *name)
{
    int32_t count;
    const pliant_prop *list = pliant_props_list(pliant_player_props(player), &count);
    for (int32_t i = 0; i < count; i++)
        if (strcmp(list[i].name, name) == 0) return &list[i];
    fail_msg("no prop %s", name);
    return NULL;
}

static void check_vec3(pliant_vec3 found, pliant_vec3 expected, double tolerance)
{
    check_near(found.x, expected.x, tolerance);
    check_near(found.y, expected.y, tolerance);
    check_near(found.z, expected.z, tolerance);
}

static void check_whole(const pliant_player *player, const pliant_vec3 *expected, double tolerance)
{
    double worst = 0;
    for (int32_t v = 0; v < pliant_player_surface_count(player); v++) {
        const pliant_vec3 u = pliant_player_surface(player)[v];
        worst = fmax(worst, fabs((double)(u.x - expected[v].x)));
        worst = fmax(worst, fabs((double)(u.y - expected[v].y)));
        worst = fmax(worst, fabs((double)(u.z - expected[v].z)));
    }
    check_at_most(worst, tolerance);
}

// Vertices within `reach` of the top; all are free.
static int32_t cap(double reach, int32_t *vertices)
{
    const pliant_model_info info = pliant_model_describe(model);
    const double *x = pliant_model_positions(model);
    int32_t count = 0;
    for (int32_t v = 0; v < info.vertex_count; v++)
        if (hypot(hypot(x[3 * v], x[3 * v + 1]), x[3 * v + 2] - 1) < reach) vertices[count++] = v;
    return count;
}

static void state_cap(pliant_player *player, const char *name, double reach, double depth)
{
    int32_t vertices[642];
    const int32_t count = cap(reach, vertices);
    for (int32_t i = 0; i < count; i++)
        check_play_ok(player, "patch %s %d 0 0 %.9g\n", name, (int)vertices[i], -depth);
}

static pliant_solver *passive_solver(void)
{
    pliant_error err;
    pliant_solver *solver = NULL;
    pliant_solver_def def = pliant_solver_default(model);
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    def.constraint_capacity = 128;
    def.load_capacity = 512;
    check_ok(pliant_solver_create(model, &def, &solver, &err), &err);
    return solver;
}

// ---- What is solved ----

static void a_patch_is_solved_as_the_library_solves_it(void **state)
{
    (void)state;
    static pliant_vec3 expected[642];
    int32_t vertices[642];
    pliant_vec3 u[642];
    const int32_t count = cap(0.8, vertices);
    for (int32_t i = 0; i < count; i++) u[i] = (pliant_vec3){0, 0, -0.05f};
    pliant_error err;
    pliant_solver *solver = NULL;
    pliant_patch *patch = NULL;
    pliant_patch_def def = pliant_patch_default(model);
    def.tolerance = 4e-3;
    pliant_solver_def roomy = pliant_solver_default(model);
    roomy.constraint_capacity = 128;
    check_ok(pliant_solver_create(model, &roomy, &solver, &err), &err);
    check_ok(pliant_patch_create(solver, &def, &patch, &err), &err);
    check_ok(pliant_patch_set(patch, vertices, u, count), NULL);
    check_ok(pliant_patch_solve(patch, PLIANT_NEVER), NULL);
    check_ok(pliant_solver_surface(solver, 3, expected), NULL);

    pliant_player *player = create();
    check_play_ok(player, "patch thumb tolerance 4e-3\n");
    state_cap(player, "thumb", 0.8, 0.05);
    check_play_ok(player, "step\n");
    const pliant_prop *thumb = find(player, "thumb");
    // The same operations in the same order.
    check_whole(player, expected, 1e-7);
    assert_int_equal(thumb->node_count, pliant_patch_last(patch).node_count);
    check_at_most(thumb->node_count, count - 1);  // fewer nodes than vertices: levels are mixed
    check_near(thumb->error, pliant_patch_last(patch).error, 1e-9);
    check_at_most(thumb->error, 4e-3);
    check_vec3(thumb->force, pliant_patch_force(patch), 1e-6);
    check_vec3(pliant_player_last(player)->force, thumb->force, 1e-5);
    check_at_most(thumb->force.z, -1e-2);

    // Another tolerance holds from the next step on; 0: every vertex is a node.
    check_play_ok(player, "patch thumb tolerance 0\nstep\n");
    assert_int_equal(find(player, "thumb")->node_count, count);
    assert_int_equal(pliant_player_last(player)->report.constraint_count, count);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
    pliant_player_destroy(player);
}

static void a_tool_is_solved_as_the_library_solves_it(void **state)
{
    (void)state;
    static pliant_vec3 expected[642];
    const pliant_tool ball = {
        .kind = PLIANT_TOOL_SPHERE, .a = {0.125f, 0, 1.25f}, .radius = 0.3125f, .friction = 0.5f};
    pliant_error err;
    pliant_solver *solver = passive_solver();
    pliant_contact *contact = NULL;
    pliant_contact_def def = pliant_contact_default(solver);
    def.tolerance = 2e-3;
    check_ok(pliant_contact_create(solver, &def, &contact, &err), &err);
    check_ok(pliant_contact_set_tool(contact, 0, &ball), NULL);
    check_ok(pliant_contact_solve(contact, PLIANT_NEVER), NULL);
    check_ok(pliant_solver_surface(solver, 3, expected), NULL);

    pliant_player *player = create();
    check_play_ok(player,
                  "contact tolerance 2e-3\ntool ball sphere 0.125 0 1.25 0.3125 friction 0.5\n"
                  "step\n");
    const pliant_prop *prop = find(player, "ball");
    const pliant_tool_result result = pliant_contact_tool(contact, 0);
    check_whole(player, expected, 1e-7);
    assert_int_equal(prop->node_count, result.node_count);
    check_at_least(prop->node_count, 1);
    check_vec3(prop->force, result.force, 1e-6);
    check_vec3(pliant_player_last(player)->force, prop->force, 1e-6);
    check_at_most(prop->force.z, -1e-2);  // it pushes
    // The level is that of the nodes that are pushed, though nothing is constrained.
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 0);
    assert_int_equal(pliant_player_last(player)->report.level,
                     pliant_contact_last(contact).finest_level);
    // Away, it does nothing.
    check_play_ok(player, "move ball 0 0 2\nstep\n");
    assert_int_equal(find(player, "ball")->node_count, 0);
    check_vec3(pliant_player_last(player)->force, (pliant_vec3){0, 0, 0}, 0);
    pliant_contact_destroy(contact);
    pliant_solver_destroy(solver);
    pliant_player_destroy(player);
}

static void a_proxy_is_solved_as_the_library_solves_it(void **state)
{
    (void)state;
    static pliant_vec3 expected[642];
    pliant_error err;
    pliant_solver *solver = passive_solver();
    pliant_proxy *proxy = NULL;
    pliant_proxy_def def = pliant_proxy_default(model);
    def.stiffness = 3;
    def.friction = 0.25;
    check_ok(pliant_proxy_create(solver, &def, &proxy, &err), &err);
    pliant_proxy_result result;
    const double above[3] = {0, 0, 1.25}, inside[3] = {0.0625, 0, 0.875};
    check_ok(pliant_proxy_step(proxy, above, PLIANT_NEVER, &result), NULL);
    check_ok(pliant_proxy_step(proxy, inside, PLIANT_NEVER, &result), NULL);
    check_ok(pliant_solver_surface(solver, 3, expected), NULL);

    pliant_player *player = create();
    check_play_ok(player, "proxy pen 0 0 1.25 stiffness 3 friction 0.25\nstep\n");
    assert_int_equal(find(player, "pen")->node_count, 0);
    check_play_ok(player, "move pen 0.0625 0 0.875\nstep\n");
    const pliant_prop *pen = find(player, "pen");
    assert_int_equal(pen->node_count, 1);
    check_whole(player, expected, 1e-7);
    check_vec3(pen->force, result.force, 1e-6);
    check_near(pen->error, result.depth, 1e-7);
    check_vec3(pliant_player_last(player)->force, result.force, 1e-6);
    check_at_most(result.force.z, -1e-2);
    pliant_proxy_destroy(proxy);
    pliant_solver_destroy(solver);
    pliant_player_destroy(player);
}

static const char *const mixture = "patch side tolerance 1e-3\n"
                                   "patch side near 1 0 0 -0.02 0 0\n"
                                   "patch side near 0.98 0.2 0 -0.02 0 0\n"
                                   "displace near -1 0 0 0.03 0 0\n"
                                   "tool ball sphere 0 0 1.25 0.3 friction 0.5\n"
                                   "tool floor plane 0 2 0 -1.9\n"
                                   "proxy pen 0 -0.9 0\n";

static void all_kinds_add_up_to_the_contact_force(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "%sstep 5\n", mixture);
    const pliant_vec3 patch = find(player, "side")->force, ball = find(player, "ball")->force;
    const pliant_vec3 floor = find(player, "floor")->force, pen = find(player, "pen")->force;
    check_at_most(patch.x, -1e-3);
    check_at_most(ball.z, -1e-3);
    // The floor, below y = -0.95, and the pen beside it both push up.
    check_at_least(floor.y, 1e-3);
    check_at_least(pen.y, 1e-4);
    int32_t count;
    const pliant_condition *condition = pliant_player_conditions(player, &count);
    assert_int_equal(count, 1);
    const pliant_vec3 held =
        pliant_solver_node_force(pliant_player_solver(player), condition->node);
    check_at_least(held.x, 1e-3);
    const pliant_vec3 sum = {patch.x + ball.x + floor.x + pen.x + held.x,
                             patch.y + ball.y + floor.y + pen.y + held.y,
                             patch.z + ball.z + floor.z + pen.z + held.z};
    check_vec3(pliant_player_last(player)->force, sum, 1e-5);
    // What is prescribed holds beside all the others.
    const double left[3] = {-1, 0, 0};
    check_near(pliant_player_surface(player)[pliant_model_nearest(model, left)].x, 0.03, 1e-6);
    check_at_most(find(player, "side")->error, 1e-3);
    pliant_player_destroy(player);
}

// A patch whose nodes fade out still pushes, which the solver does not count as contact.
static void what_fades_after_a_patch_counts(void **state)
{
    (void)state;
    int32_t vertices[642];
    const int32_t count = cap(0.4, vertices);
    pliant_player *player = create();
    check_play_ok(player, "patch thumb tolerance 1e-3\n");
    state_cap(player, "thumb", 0.4, 0.05);
    check_play_ok(player, "step\npatch thumb tolerance 0.05\n");
    for (int32_t i = 1; i < count; i++)
        check_play_ok(player, "patch thumb %d 0 0 %.9g\n", (int)vertices[i],
                      -0.05 + 0.001 * i / count);
    int fading = 0;
    for (int step = 0; step < 40; step++) {
        check_play_ok(player, "step\n");
        const pliant_vec3 force = find(player, "thumb")->force;
        check_vec3(pliant_player_last(player)->force, force, 1e-5);
        const pliant_vec3 counted = pliant_solver_contact_force(pliant_player_solver(player));
        fading += fabs((double)(counted.z - force.z)) > 1e-4;
    }
    check_at_least(fading, 5);  // or the case proves nothing
    pliant_player_destroy(player);
}

// ---- Coming and going ----

static void dropped_things_leave_nothing_behind(void **state)
{
    (void)state;
    static const pliant_vec3 rest[642];
    static const char *const endings[] = {
        "drop side\ndrop ball\ndrop floor\ndrop pen\nrelease near -1 0 0\n", "release all\n"};
    for (int k = 0; k < 2; k++) {
        pliant_player *player = create();
        check_play_ok(player, "%sstep 3\n%sstep\n", mixture, endings[k]);
        // Sums that were added up and taken away again: rounding of displacements of 0.05.
        check_whole(player, rest, 1e-7);
        check_vec3(pliant_player_last(player)->force, (pliant_vec3){0, 0, 0}, 0);
        assert_int_equal(pliant_player_last(player)->report.constraint_count, 0);
        assert_true(pliant_props_is_empty(pliant_player_props(player)));
        // All names can come back.
        check_play_ok(player, "%sstep\n", mixture);
        check_at_least(find(player, "ball")->node_count, 1);
        check_at_most(find(player, "side")->force.x, -1e-3);
        pliant_player_destroy(player);
    }
}

static void vertices_leave_a_patch_one_by_one_or_all(void **state)
{
    (void)state;
    int32_t vertices[642];
    const int32_t count = cap(0.3, vertices);
    pliant_player *player = create();
    check_play_ok(player, "patch thumb tolerance 0\n");
    state_cap(player, "thumb", 0.3, 0.05);
    check_play_ok(player, "step\n");
    assert_int_equal(find(player, "thumb")->node_count, count);
    check_play_ok(player, "patch thumb release %d\npatch thumb release %d\nstep\n",
                  (int)vertices[1], (int)vertices[1]);
    assert_int_equal(find(player, "thumb")->node_count, count - 1);
    // The freed vertex may have a condition now; the others may not.
    pliant_error err;
    char text[64];
    check_play_ok(player, "displace %d 0 0 0.01\nstep\n", (int)vertices[1]);
    check_near(pliant_player_surface(player)[vertices[1]].z, 0.01, 1e-6);
    snprintf(text, sizeof text, "force %d 0 0 1", (int)vertices[0]);
    assert_int_equal(check_play(player, NULL, &err, text), PLIANT_ERR_ARGUMENT);
    snprintf(text, sizeof text, "patch thumb %d 0 0 1", (int)vertices[1]);
    assert_int_equal(check_play(player, NULL, &err, text), PLIANT_ERR_ARGUMENT);
    check_play_ok(player, "patch thumb release all\nstep\n");
    assert_int_equal(find(player, "thumb")->node_count, 0);
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 1);
    pliant_player_destroy(player);
}

// Moved there or declared there, the same solve from the same state.
static void moving_a_tool_is_declaring_it_elsewhere(void **state)
{
    (void)state;
    static const struct {
        const char *first, *move, *again;
    } tools[] = {
        {"tool t sphere 0 0 1.25 0.3125\n", "move t 0.0625 0.125 1.1875\n",
         "tool t sphere 0.0625 0.125 1.1875 0.3125\n"},
        {"tool t capsule -0.5 0 1.125 0.5 0 1.25 0.25\n", "move t -0.375 0.125 1.125\n",
         "tool t capsule -0.375 0.125 1.125 0.625 0.125 1.25 0.25\n"},
        {"tool t plane 0 0 -2 -1.96875\n", "move t 0.25 0.5 0.9375\n",
         "tool t plane 0 0 -2 -1.875\n"},
    };
    for (size_t k = 0; k < sizeof tools / sizeof *tools; k++) {
        pliant_player *moved = create(), *declared = create();
        check_play_ok(moved, "%sstep\n%sstep\n", tools[k].first, tools[k].move);
        check_play_ok(declared, "%sstep\n%sstep\n", tools[k].first, tools[k].again);
        check_whole(moved, pliant_player_surface(declared), 1e-6);
        check_vec3(find(moved, "t")->force, find(declared, "t")->force, 1e-5);
        check_at_most(find(moved, "t")->force.z, -1e-2);
        pliant_player_destroy(moved);
        pliant_player_destroy(declared);
    }
}

static void everything_moves_over_to_a_larger_solver(void **state)
{
    (void)state;
    pliant_player *player = create(), *roomy = create();
    // The other one has the room from the start: the same conditions come first.
    check_play_ok(player, "%sstep 40\n", mixture);
    const pliant_solver *before = pliant_player_solver(player);
    for (int k = 0; k < 2; k++) {
        pliant_player *p = k ? roomy : player;
        int32_t placed = 0;
        for (int32_t v = 0; placed < 300 && v < 642; v++) {
            const double *x = pliant_model_positions(model) + 3 * v;
            // Away from all contacts.
            if (pliant_model_is_free(model, v) != 1 || x[2] > 0.8 || fabs(x[0]) > 0.9 ||
                x[1] < -0.9)
                continue;
            check_play_ok(p, "traction %d 0 0.0009765625 0\n", (int)v);
            placed++;
        }
        assert_int_equal(placed, 300);
    }
    check_play_ok(player, "step 40\n");
    check_play_ok(roomy, "%sstep 40\n", mixture);
    assert_true(pliant_player_solver(player) != before);
    // Settled, both are in the same state to the tolerances of patch and tools; a contact that
    // was lost would be off by the whole displacement, some 0.05.
    check_whole(player, pliant_player_surface(roomy), 4e-3);
    const char *const names[] = {"side", "ball", "floor", "pen"};
    for (int i = 0; i < 4; i++) {
        const pliant_vec3 f = find(player, names[i])->force, g = find(roomy, names[i])->force;
        const double size = hypot(hypot((double)g.x, (double)g.y), (double)g.z);
        check_at_least(size, 1e-4);
        check_vec3(f, g, 0.1 * size);
    }
    pliant_player_destroy(player);
    pliant_player_destroy(roomy);
}

static void patches_find_room_for_all_their_vertices(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "tool ball sphere 0 -1.2 0 0.25\npatch large tolerance 0\n");
    int32_t vertices[642];
    const int32_t count = cap(0.9, vertices);
    check_at_least(count, 120);  // beyond 64, the solver's at first
    state_cap(player, "large", 0.9, 0.01);
    check_play_ok(player, "step\n");
    assert_int_equal(find(player, "large")->node_count, count);
    check_at_most(find(player, "large")->error, 1e-6);
    check_at_least(find(player, "ball")->force.y, 1e-3);
    pliant_player_destroy(player);
}

// ---- What a step tells, and costs ----

static void deadlines_hold_for_all_kinds(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "deadline 0\n%sstep 3\n", mixture);
    const pliant_step *last = pliant_player_last(player);
    assert_int_equal(last->report.is_late, 1);
    check_at_least(last->report.lateness_ns, 1000);  // no step of four objects takes a microsecond
    assert_int_equal(last->deadline_ns, 0);
    for (int32_t v = 0; v < pliant_player_surface_count(player); v++) {
        const pliant_vec3 u = pliant_player_surface(player)[v];
        assert_true(isfinite(u.x) && isfinite(u.y) && isfinite(u.z));
    }
    // Time again: everything as if nothing had been.
    check_play_ok(player, "deadline none\nstep 20\n");
    assert_int_equal(pliant_player_last(player)->report.is_late, 0);
    assert_int_equal(pliant_player_last(player)->report.lateness_ns, 0);
    check_at_most(find(player, "side")->error, 1e-3);
    pliant_player_destroy(player);
}

// Nothing is constrained, so that it is the contact alone that runs out of time.
static void tools_that_run_out_of_time_are_late(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player,
                  "deadline 0\ncontact tolerance 1e-5\ntool ball sphere 0 0 1.25 0.3\nstep\n");
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 0);
    assert_int_equal(pliant_player_last(player)->report.is_late, 1);
    check_play_ok(player, "deadline none\nstep 3\n");
    assert_int_equal(pliant_player_last(player)->report.is_late, 0);
    pliant_player_destroy(player);
}

// The level is that of the nodes that are pushed, though nothing is constrained; with constraints,
// the finer of the two.
static void levels_are_those_of_tools_too(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "contact tolerance 0.04\ntool ball sphere 0 0 1.4 0.5\nstep\n");
    check_at_least(find(player, "ball")->node_count, 1);
    const int32_t coarse = pliant_player_last(player)->report.level;
    check_at_most(coarse, 2);
    check_play_ok(player, "displace 0:near 1 0 0 -0.01 0 0\nstep\n");
    check_at_least(pliant_player_last(player)->report.level, coarse);
    check_play_ok(player, "displace 3:near 0 1 0 0 0 0\nstep\n");
    assert_int_equal(pliant_player_last(player)->report.level, 3);
    pliant_player_destroy(player);
    player = create();
    check_play_ok(player, "contact tolerance 1e-4\ntool ball sphere 0 0 1.25 0.3\n"
                          "displace 0:near 1 0 0 -0.01 0 0\nstep\n");
    check_at_least(pliant_player_last(player)->report.level, 2);
    pliant_player_destroy(player);
}

static int32_t contact_is_passive(pliant_player *player)
{
    pliant_error err;
    pliant_contact *contact = NULL;
    const pliant_status status =
        pliant_contact_create(pliant_player_solver(player), NULL, &contact, &err);
    pliant_contact_destroy(contact);
    return status >= 0;
}

static void the_first_tool_or_proxy_makes_contact_passive(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "patch p tolerance 1e-3\n");
    assert_false(contact_is_passive(player));  // patches do not
    check_play_ok(player, "proxy pen 0 0 2\n");
    assert_true(contact_is_passive(player));
    // For good.
    check_play_ok(player, "drop pen\nrelease all\npatch p tolerance 1e-3\n");
    assert_true(contact_is_passive(player));
    pliant_player_destroy(player);
    player = create();
    check_play_ok(player, "tool floor plane 0 0 1 -9\ndrop floor\n");
    assert_true(contact_is_passive(player));
    pliant_player_destroy(player);
}

static void marks_are_where_things_act(void **state)
{
    (void)state;
    pliant_player *player = create();
    pliant_prop_mark marks[16];
    const pliant_props *props = pliant_player_props(player);
    assert_int_equal(pliant_props_marks(props, NULL, 0), 0);
    check_play_ok(player, "patch side tolerance 1e-3\npatch side near 1 0 0 -0.02 0 0\n"
                          "tool ball sphere 0 0 1.25 0.275\nproxy pen 0 -0.9 0\nstep\n");
    const int32_t count = pliant_props_marks(props, marks, 16);
    assert_int_equal(count, 2 + find(player, "ball")->node_count);
    check_at_most(count, 16);
    const double *x = pliant_model_positions(model);
    // All push inwards.
    for (int32_t i = 0; i < count; i++) {
        const double *at = x + 3 * marks[i].vertex;
        const pliant_vec3 d = marks[i].direction;
        check_at_most(at[0] * (double)d.x + at[1] * (double)d.y + at[2] * (double)d.z, -1e-4);
    }
    check_near(x[3 * marks[0].vertex], 1, 0.1);
    check_near(x[3 * marks[1].vertex + 1], -1, 0.1);
    check_near(x[3 * marks[2].vertex + 2], 1, 0.1);
    pliant_player_destroy(player);
}

static void steps_with_all_kinds_do_not_allocate(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    pliant_player *player = create();
    check_play_ok(player, "%sstep\n", mixture);
    static const char *const lines[] = {"move ball 0.05 0 1.22",
                                        "move pen 0.1 -0.9 0",
                                        "patch side near 1 0 0 -0.03 0 0",
                                        "step 5",
                                        "move ball -0.05 0 1.25",
                                        "patch side near 1 0 0 0.01 0 0",
                                        "step 5"};
    enum { LINES = sizeof lines / sizeof *lines };
    pliant_statement statements[LINES];
    pliant_error err;
    for (int i = 0; i < LINES; i++)
        check_ok(pliant_statement_parse(lines[i], strlen(lines[i]), "t.script", 1, 0,
                                        &statements[i], &err),
                 &err);
    const long before = atomic_load(&calls);
    int refused = 0;
    for (int round = 0; round < 5; round++)
        for (int i = 0; i < LINES; i++)
            refused += pliant_player_execute(player, &statements[i], NULL, NULL) < 0;
    const long after = atomic_load(&calls);
    assert_int_equal(refused, 0);
    assert_int_equal(after - before, 0);
    pliant_player_destroy(player);
}

// ---- Refusals ----

static void check_refused(pliant_player *player, const char *text, const char *message)
{
    pliant_error err = {""};
    assert_true(check_play(player, NULL, &err, text) < 0);
    assert_string_equal(err.text, message);
}

static void mistakes_are_told_with_line_and_column_and_change_nothing(void **state)
{
    (void)state;
    static pliant_vec3 before[642];
    pliant_player *player = create(), *twin = create();
    char text[128], message[256];
    int32_t fixed = 0, side = pliant_model_nearest(model, (const double[3]){1, 0, 0});
    while (pliant_model_is_free(model, fixed) == 1) fixed++;
    check_play_ok(player, "%sstep\n", mixture);
    check_play_ok(twin, "%sstep\n", mixture);
    check_refused(player, "\npatch other near 1 0 0 0 0 0",
                  "t.script:2:7: no patch other: expected \"patch other tolerance T\" before");
    check_refused(player, "patch ball tolerance 1",
                  "t.script:1:7: ball is a tool: expected another name");
    check_refused(player, "tool side sphere 0 0 0 1",
                  "t.script:1:6: side is a patch: expected another name");
    check_refused(player, "proxy pen 0 0 0",
                  "t.script:1:7: proxy pen is already there: expected move or drop");
    check_refused(player, "move nobody 0 0 0",
                  "t.script:1:6: no patch, tool or proxy nobody: expected one declared before");
    check_refused(player, "drop nobody",
                  "t.script:1:6: no patch, tool or proxy nobody: expected one declared before");
    check_refused(player, "move side 0 0 0",
                  "t.script:1:6: side is a patch: expected a tool or a proxy");
    check_refused(player, "contact tolerance 1",
                  "t.script:1:9: contact tolerance: expected before the first tool");
    check_refused(player, "tool ball sphere 0 0 1 1 friction 3",
                  "t.script:1:6: friction 3: expected 0 to 2 for a tool");
    check_refused(player, "tool floor plane 0 0 1e-30 1e30",
                  "t.script:1:6: 1e+60 is beyond single precision");
    check_refused(player, "patch side 642 0 0 0", "t.script:1:7: vertex 642 of 642");
    check_refused(player, "patch side near -1 0 0 0 0 0",
                  (snprintf(message, sizeof message,
                            "t.script:1:7: vertex %d has a condition of its own: release it first",
                            (int)pliant_model_nearest(model, (const double[3]){-1, 0, 0})),
                   message));
    snprintf(text, sizeof text, "patch side %d 0 0 0", (int)fixed);
    snprintf(message, sizeof message, "t.script:1:7: vertex %d is fixed: a patch needs free ones",
             (int)fixed);
    check_refused(player, text, message);
    snprintf(text, sizeof text, "displace %d 0 0 0", (int)side);
    snprintf(message, sizeof message,
             "t.script:1:10: vertex %d belongs to patch side: \"patch side release %d\" first",
             (int)side, (int)side);
    check_refused(player, text, message);
    // As if nothing had been said.
    check_play_ok(player, "step\n");
    check_play_ok(twin, "step\n");
    memcpy(before, pliant_player_surface(twin), sizeof before);
    check_whole(player, before, 0);
    // More than there may be.
    check_play_ok(player, "patch second tolerance 1\n");
    snprintf(text, sizeof text, "patch second %d 0 0 0", (int)side);
    snprintf(message, sizeof message, "t.script:1:7: vertex %d belongs to patch side", (int)side);
    check_refused(player, text, message);
    for (int i = 2; i < PLIANT_TOOL_LIMIT; i++)
        check_play_ok(player, "tool t%d plane 0 0 1 -9\n", i);
    check_refused(player, "tool more plane 0 0 1 -9", "t.script:1:6: more than 8 tools at once");
    pliant_player_destroy(player);
    pliant_player_destroy(twin);
}

static void a_player_that_must_compare_refuses_them(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player;
    pliant_player_def def = pliant_player_default(model);
    def.script_name = "t.script";
    def.prop_rule = PLIANT_PROPS_REFUSED;
    check_ok(pliant_player_create(model, &def, &player, &err), &err);
    check_refused(player, "\n\nproxy pen 0 0 0",
                  "t.script:3:7: --compare knows conditions and gravity only: expected no patches, "
                  "tools or proxies");
    pliant_player_destroy(player);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(a_patch_is_solved_as_the_library_solves_it),
        cmocka_unit_test(a_tool_is_solved_as_the_library_solves_it),
        cmocka_unit_test(a_proxy_is_solved_as_the_library_solves_it),
        cmocka_unit_test(all_kinds_add_up_to_the_contact_force),
        cmocka_unit_test(what_fades_after_a_patch_counts),
        cmocka_unit_test(dropped_things_leave_nothing_behind),
        cmocka_unit_test(vertices_leave_a_patch_one_by_one_or_all),
        cmocka_unit_test(moving_a_tool_is_declaring_it_elsewhere),
        cmocka_unit_test(everything_moves_over_to_a_larger_solver),
        cmocka_unit_test(patches_find_room_for_all_their_vertices),
        cmocka_unit_test(deadlines_hold_for_all_kinds),
        cmocka_unit_test(tools_that_run_out_of_time_are_late),
        cmocka_unit_test(levels_are_those_of_tools_too),
        cmocka_unit_test(the_first_tool_or_proxy_makes_contact_passive),
        cmocka_unit_test(marks_are_where_things_act),
        cmocka_unit_test(steps_with_all_kinds_do_not_allocate),
        cmocka_unit_test(mistakes_are_told_with_line_and_column_and_change_nothing),
        cmocka_unit_test(a_player_that_must_compare_refuses_them),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
