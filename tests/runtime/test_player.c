// test_player.c: the player executes scripts: state, names, probes, expectations, refusals.
#include "check.h"

#include "pliant/error.h"
#include "script_lines.h"
#include "synthetic_model.h"
#include "timings.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// ---- Allocations are counted where the sanitizers do not do it themselves ----

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define COUNTS_ALLOCATIONS
static long allocation_count;
extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
void *malloc(size_t size)
{
    allocation_count++;
    return __libc_malloc(size);
}
void *calloc(size_t count, size_t size)
{
    allocation_count++;
    return __libc_calloc(count, size);
}
void *realloc(void *block, size_t size)
{
    allocation_count++;
    return __libc_realloc(block, size);
}
#endif

// ---- Models, made once ----

static char folder[64];
static pliant_model *whole;   // 162 vertices, all levels and blocks, nothing thresholded
static pliant_model *loose;   // 642 vertices, all levels, free block only, eps 0.05
static pliant_model *fine;    // 162 vertices, columns of level 2 alone, free block only
static pliant_model *coarse;  // 162 vertices, columns of levels 0 and 1, free block only

static pliant_model *make(int32_t levels, uint32_t level_mask, double eps, check_blocks blocks)
{
    char path[128];
    pliant_error err;
    pliant_model *model;
    snprintf(path, sizeof path, "%s/model.h5", folder);
    check_synthetic *s =
        check_synthetic_create(&(check_synthetic_def){.levels = levels,
                                                      .eps = eps,
                                                      .wavelet = pliant_wavelet_default(),
                                                      .blocks = blocks,
                                                      .level_mask = level_mask});
    check_synthetic_write(s, path);
    check_synthetic_destroy(s);
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    return model;
}

static int set_up(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/pliant-player-XXXXXX");
    if (!mkdtemp(folder)) return -1;
    whole = make(2, 7, 0, CHECK_ALL_BLOCKS);
    loose = make(3, 15, 0.05, CHECK_FREE_BLOCK);
    fine = make(2, 4, 0, CHECK_FREE_BLOCK);
    coarse = make(2, 3, 0, CHECK_FREE_BLOCK);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    pliant_model_close(whole);
    pliant_model_close(loose);
    pliant_model_close(fine);
    pliant_model_close(coarse);
    return rmdir(folder);
}

static pliant_player *create_at(const pliant_model *model, int32_t level)
{
    pliant_error err;
    pliant_player *player;
    pliant_player_def def = pliant_player_default(model);
    def.script_name = "t.script";
    if (level >= 0) def.level = level;
    check_ok(pliant_player_create(model, &def, &player, &err), &err);
    return player;
}

static pliant_player *create(const pliant_model *model)
{
    return create_at(model, -1);
}

static pliant_vec3 at(const pliant_player *player, int32_t vertex)
{
    return pliant_player_surface(player)[vertex];
}

// A free vertex, and a fixed one.
static int32_t free_vertex(const pliant_model *model, int32_t skip)
{
    const int32_t n = pliant_model_describe(model).vertex_count;
    for (int32_t v = 0; v < n; v++)
        if (pliant_model_is_free(model, v) == 1 && skip-- == 0) return v;
    fail_msg("no such free vertex");
    return -1;
}

static int32_t fixed_vertex(const pliant_model *model)
{
    int32_t v = 0;
    while (pliant_model_is_free(model, v) == 1) v++;
    return v;
}

// ---- Cases ----

static void every_statement_runs(void **state)
{
    (void)state;
    pliant_player *player = create(whole);
    const int32_t a = free_vertex(whole, 10), b = free_vertex(whole, 50), f = fixed_vertex(whole);
    check_play_ok(player,
                  "pliant-script 1\n# a comment\n\n"
                  "probe nose vertex %d\nprobe tip near 0.1 0.2 1.3\n"
                  "displace %d 0 0 -0.02\ntraction %d 0 1 0\nforce near 1 0 0 0 0 1\n"
                  "support %d 0 0 0.01\ngravity 0 0 -9.81\nstep\n"
                  "expect nose 0 0 -0.02 1e-7\n"
                  "dt 0.5\nrelease %d\nstep 3\nrelease all\nstep\nexpect nose 0 0 0 1e-6\n",
                  (int)a, (int)a, (int)b, (int)f, (int)a);
    const pliant_step *last = pliant_player_last(player);
    assert_int_equal(last->number, 5);
    // One step of 0.001 and four of 0.5.
    check_near(last->time, 2.001, 1e-12);
    int32_t count;
    const pliant_probe *probes = pliant_player_probes(player, &count);
    assert_int_equal(count, 2);
    assert_int_equal(probes[0].vertex, a);
    const double tip[3] = {0.1, 0.2, 1.3};
    assert_int_equal(probes[1].vertex, pliant_model_nearest(whole, tip));
    pliant_player_conditions(player, &count);
    assert_int_equal(count, 0);
    pliant_player_destroy(player);
}

static void state_persists_and_release_undoes_it(void **state)
{
    (void)state;
    pliant_player *player = create(whole);
    const int32_t a = free_vertex(whole, 5), b = free_vertex(whole, 60);
    check_play_ok(player, "displace %d 0.01 0 0\nstep\n", (int)a);
    const pliant_vec3 alone = at(player, b);
    check_play_ok(player, "traction %d 0 0 3\nstep\nrelease %d\nstep\n", (int)b, (int)b);
    // Coherent sums leave rounding of the traction's response behind, some 1e-7 of it.
    check_near(at(player, b).x, alone.x, 1e-6);
    check_near(at(player, b).z, alone.z, 1e-6);
    check_play_ok(player, "displace %d 0.02 0 0\nstep\n",
                  (int)a);  // a new value, the same constraint
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 1);
    check_near(at(player, b).x, 2 * alone.x, 1e-6);
    pliant_player_destroy(player);
}

static void releasing_one_condition_keeps_the_others(void **state)
{
    (void)state;
    pliant_player *player = create(whole);
    const int32_t a = free_vertex(whole, 1), b = free_vertex(whole, 2), c = free_vertex(whole, 3);
    int32_t count;
    check_play_ok(player, "displace %d 1 0 0\ndisplace %d 2 0 0\ndisplace %d 3 0 0\nrelease %d\n",
                  (int)a, (int)b, (int)c, (int)a);
    check_play_ok(player, "displace %d 4 0 0\n", (int)c);  // known already: no third
    const pliant_condition *conditions = pliant_player_conditions(player, &count);
    assert_int_equal(count, 2);
    for (int i = 0; i < 2; i++) {
        const int is_b = conditions[i].node.vertex == b;
        assert_int_equal(conditions[i].node.vertex, is_b ? b : c);
        check_near(conditions[i].value.x, is_b ? 2 : 4, 0);
    }
    check_play_ok(player, "release %d\nrelease %d\n", (int)c, (int)c);
    conditions = pliant_player_conditions(player, &count);
    assert_int_equal(count, 1);
    assert_int_equal(conditions[0].node.vertex, b);
    pliant_player_destroy(player);
}

static void all_names_of_a_vertex_are_the_same_vertex(void **state)
{
    (void)state;
    const int32_t n = pliant_model_describe(whole).vertex_count, v = free_vertex(whole, 33);
    const double *x = pliant_model_positions(whole) + 3 * (size_t)v;
    int32_t source = 0;
    while (source < n && pliant_model_from_source(whole, source) != v) source++;
    char names[4][128];
    snprintf(names[0], sizeof names[0], "%d", (int)v);
    snprintf(names[1], sizeof names[1], "2:%d", (int)v);
    snprintf(names[2], sizeof names[2], "near %.17g %.17g %.17g", x[0], x[1], x[2]);
    snprintf(names[3], sizeof names[3], "source %d", (int)source);
    // Not every vertex need have come from the input.
    for (int i = 0; i < (source < n ? 4 : 3); i++) {
        pliant_player *player = create(whole);
        check_play_ok(player, "displace %s 0 0.01 0\nprobe p vertex %s\nstep\n", names[i],
                      names[i]);
        int32_t count;
        const pliant_condition *conditions = pliant_player_conditions(player, &count);
        assert_int_equal(count, 1);
        assert_int_equal(conditions[0].node.vertex, v);
        assert_int_equal(conditions[0].node.level, 2);
        assert_int_equal(pliant_player_probes(player, &count)[0].vertex, v);
        check_near(at(player, v).y, 0.01f, 0);
        pliant_player_destroy(player);
    }
}

static void force_is_traction_times_vertex_area(void **state)
{
    (void)state;
    const int32_t v = free_vertex(whole, 20);
    pliant_player *force = create(whole), *traction = create(whole);
    check_play_ok(force, "force %d 0 0 -3\nstep\n", (int)v);
    check_play_ok(traction, "traction %d 0 0 %.17g\nstep\n", (int)v,
                  -3 / pliant_model_area(whole, v));
    for (int32_t i = 0; i < pliant_player_surface_count(force); i++)
        check_near(at(force, i).z, at(traction, i).z, 0);
    pliant_player_destroy(force);
    pliant_player_destroy(traction);
}

// The hat of a node at all vertices, by the definition (GF-53): one at its vertex, the mean of the
// parents at vertices of finer levels, which the traction of a free node shows: the load of the hat
// is the sum of the loads at its vertices (GF-60).
static void a_load_on_a_level_is_the_sum_of_loads_over_its_hat(void **state)
{
    (void)state;
    const int32_t k = free_vertex(whole, 3), n = pliant_model_describe(whole).vertex_count;
    assert_in_range(k, 0, 11);
    for (int32_t level = 0; level < 3; level++) {
        pliant_player *hat = create(whole), *sum = create(whole);
        check_play_ok(hat, "traction %d:%d 1 2 3\nstep\n", (int)level, (int)k);
        double values[162] = {0}, area = 0;
        assert_int_equal(n, 162);
        values[k] = 1;
        for (int32_t l = level; l < 2; l++) {
            const int32_t *face = pliant_model_faces(whole, l),
                          *child = pliant_model_faces(whole, l + 1);
            for (int32_t f = 0; f < pliant_model_level_face_count(whole, l); f++)
                for (int c = 0; c < 3; c++) {
                    const int32_t a = face[3 * f + c], b = face[3 * f + (c + 1) % 3];
                    const int32_t m = child[12 * f + (const int[]){1, 4, 2}[c]];
                    if (pliant_model_is_free(whole, m)) values[m] = (values[a] + values[b]) / 2;
                }
        }
        for (int32_t v = 0; v < n; v++) {
            area += values[v] * pliant_model_area(whole, v);
            if (values[v] != 0)
                check_play_ok(sum, "traction %d %.17g %.17g %.17g\n", (int)v, values[v],
                              2 * values[v], 3 * values[v]);
        }
        check_play_ok(sum, "step\n");
        // A sum of up to 61 columns of floats against one of their sum.
        double largest = 0;
        for (int32_t v = 0; v < n; v++) largest = fmax(largest, fabs((double)at(sum, v).z));
        for (int32_t v = 0; v < n; v++) check_near(at(hat, v).z, at(sum, v).z, 1e-5 * largest);
        // And force is traction times the hat's area.
        pliant_player *force = create(whole);
        check_play_ok(force, "force %d:%d %.17g %.17g %.17g\nstep\n", (int)level, (int)k, area,
                      2 * area, 3 * area);
        for (int32_t v = 0; v < n; v++) check_near(at(force, v).z, at(hat, v).z, 1e-6 * largest);
        pliant_player_destroy(hat);
        pliant_player_destroy(sum);
        pliant_player_destroy(force);
    }
}

static void levels_are_those_of_the_solver(void **state)
{
    (void)state;
    pliant_error err;
    const int32_t a = free_vertex(whole, 2), b = free_vertex(whole, 6), c = free_vertex(whole, 90);
    const int32_t f = fixed_vertex(whole);
    pliant_player *player = create(whole);
    check_play_ok(
        player,
        "displace 0:%d 0.1 0 0\ndisplace 1:%d 0 0.1 0\ndisplace %d 0 0 0.1\nsupport 1:%d 0 0 "
        "-0.1\nstep\n",
        (int)a, (int)b, (int)c, (int)f);
    pliant_solver *solver;
    check_ok(pliant_solver_create(whole, NULL, &solver, &err), &err);
    check_ok(pliant_solver_displace(solver, (pliant_node){0, a}, (pliant_vec3){0.1f, 0, 0}), NULL);
    check_ok(pliant_solver_displace(solver, (pliant_node){1, b}, (pliant_vec3){0, 0.1f, 0}), NULL);
    check_ok(pliant_solver_displace(solver, (pliant_node){2, c}, (pliant_vec3){0, 0, 0.1f}), NULL);
    check_ok(pliant_solver_support(solver, (pliant_node){1, f}, (pliant_vec3){0, 0, -0.1f}), NULL);
    assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
    pliant_vec3 u[162];
    check_ok(pliant_solver_surface(solver, 2, u), NULL);
    assert_memory_equal(u, pliant_player_surface(player), sizeof u);
    check_near(at(player, a).x, 0.1f, 0);
    check_near(at(player, b).y, 0.1f, 0);
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 3);
    assert_int_equal(pliant_player_last(player)->report.level, 2);
    check_play_ok(player, "release %d\nstep\n", (int)c);
    assert_int_equal(pliant_player_last(player)->report.level, 1);
    pliant_solver_destroy(solver);
    pliant_player_destroy(player);
}

static void the_last_statement_about_a_vertex_holds_on_whatever_level(void **state)
{
    (void)state;
    const int32_t v = free_vertex(whole, 1);
    int32_t count;
    pliant_player *player = create(whole), *other = create(whole);
    check_play_ok(
        player,
        "displace 0:%d 0.1 0 0\nstep\ntraction 2:%d 0 0 5\nstep\ndisplace 1:%d 0 0.2 0\nstep\n",
        (int)v, (int)v, (int)v);
    const pliant_condition *conditions = pliant_player_conditions(player, &count);
    assert_int_equal(count, 1);
    assert_int_equal(conditions[0].node.level, 1);
    assert_int_equal(conditions[0].kind, PLIANT_CONDITION_DISPLACED);
    check_play_ok(other, "displace 1:%d 0 0.2 0\nstep\n", (int)v);
    // Coherent sums leave rounding of the traction's response behind, some 1e-7 of it.
    for (int32_t i = 0; i < 162; i++) check_near(at(player, i).y, at(other, i).y, 1e-6);
    check_play_ok(player, "release 2:%d\nstep\n", (int)v);
    pliant_player_conditions(player, &count);
    assert_int_equal(count, 0);
    for (int32_t i = 0; i < 162; i++) check_near(at(player, i).y, 0, 1e-6);
    pliant_player_destroy(player);
    pliant_player_destroy(other);
}

static double square_distance(const pliant_model *model, int32_t v, const double *x)
{
    const double *p = pliant_model_positions(model) + 3 * (size_t)v;
    double sum = 0;
    for (int c = 0; c < 3; c++) sum += (p[c] - x[c]) * (p[c] - x[c]);
    return sum;
}

static void near_means_a_vertex_of_the_level(void **state)
{
    (void)state;
    // For every level the nearest free vertex by trying all.
    const double x[3] = {0.35, -0.2, 0.85};
    int32_t nearest[3];
    for (int32_t l = 0; l < 3; l++) {
        nearest[l] = -1;
        for (int32_t v = 0; v < pliant_model_level_vertex_count(whole, l); v++)
            if (pliant_model_is_free(whole, v) == 1 &&
                (nearest[l] < 0 ||
                 square_distance(whole, v, x) < square_distance(whole, nearest[l], x)))
                nearest[l] = v;
    }
    assert_true(nearest[0] != nearest[1] && nearest[1] != nearest[2]);
    const struct {
        const pliant_model *model;
        const char *prefix;
        pliant_node node;
    } cases[] = {
        {whole, "", {2, nearest[2]}},   {whole, "2:", {2, nearest[2]}},
        {whole, "1:", {1, nearest[1]}}, {whole, "0:", {0, nearest[0]}},
        {coarse, "", {1, nearest[1]}},  {coarse, "0:", {0, nearest[0]}},
        {fine, "", {2, nearest[2]}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        int32_t count;
        pliant_player *player = create(cases[i].model);
        check_play_ok(player,
                      "displace %snear 0.35 -0.2 0.85 0 0 0.1\nprobe p near 0.35 -0.2 0.85\n",
                      cases[i].prefix);
        const pliant_condition *conditions = pliant_player_conditions(player, &count);
        assert_int_equal(count, 1);
        assert_int_equal(conditions[0].node.level, cases[i].node.level);
        assert_int_equal(conditions[0].node.vertex, cases[i].node.vertex);
        // A probe looks at any vertex, whatever the file has columns of.
        assert_int_equal(pliant_player_probes(player, &count)[0].vertex, nearest[2]);
        check_play_ok(player, "probe q vertex 0:near 0.35 -0.2 0.85\nprobe r vertex 161\n");
        assert_int_equal(pliant_player_probes(player, &count)[1].vertex, nearest[0]);
        check_play_ok(player, "release %snear 0.35 -0.2 0.85\nstep\n", cases[i].prefix);
        pliant_player_conditions(player, &count);
        assert_int_equal(count, 0);
        pliant_player_destroy(player);
    }
}

static pliant_player *create_with_deadline(const pliant_model *model, int64_t deadline_ns)
{
    pliant_error err;
    pliant_player *player;
    pliant_player_def def = pliant_player_default(model);
    def.script_name = "t.script";
    def.deadline_ns = deadline_ns;
    check_ok(pliant_player_create(model, &def, &player, &err), &err);
    return player;
}

static void a_step_that_would_be_late_is_solved_coarser_and_says_so(void **state)
{
    (void)state;
    pliant_player *hurried = create_with_deadline(whole, 0);
    pliant_player *patient = create_with_deadline(whole, INT64_C(3600000000000));
    pliant_player *const players[] = {hurried, patient};
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 40; k++)
            check_play_ok(players[i], "displace %d 0 0 -0.1\n", (int)free_vertex(whole, k));
        check_play_ok(players[i], "step\n");
    }
    const pliant_step *late = pliant_player_last(hurried), *done = pliant_player_last(patient);
    assert_int_equal(late->status, PLIANT_LATE);
    assert_int_equal(late->report.is_late, 1);
    assert_int_equal(late->report.level, 0);
    assert_int_equal(late->report.asked_count, 40);
    check_at_least((double)late->report.lateness_ns, 1);
    assert_int_equal(done->status, PLIANT_OK);
    assert_int_equal(done->report.level, 2);
    assert_int_equal(done->report.is_late, 0);
    assert_int_equal(done->report.lateness_ns, 0);
    // The state is what was stated: it is still all there.
    int32_t count;
    pliant_player_conditions(hurried, &count);
    assert_int_equal(count, 40);
    pliant_timings *timings = calloc(1, sizeof *timings), *all = calloc(1, sizeof *all);
    pliant_timings_add(timings, late);
    pliant_timings_add(timings, done);
    pliant_timings_merge(all, timings);
    pliant_timings_merge(all, timings);
    assert_int_equal(all->punctuality.step_count, 4);
    assert_int_equal(all->punctuality.missed_count, 2);
    assert_int_equal(all->punctuality.coarser_count, 2);
    assert_int_equal(all->punctuality.overrun_count, 2);
    assert_int_equal(all->punctuality.level_counts[0], 2);
    assert_int_equal(all->punctuality.level_counts[2], 2);
    assert_int_equal(all->punctuality.worst_lateness_ns, late->report.lateness_ns);
    free(timings);
    free(all);
    pliant_player_destroy(hurried);
    pliant_player_destroy(patient);
}

static void compliance_is_the_definitions(void **state)
{
    (void)state;
    const pliant_compliance kinds[] = {PLIANT_COMPLIANCE_STORED, PLIANT_COMPLIANCE_PASSIVE};
    pliant_vec3 forces[2];
    for (int i = 0; i < 2; i++) {
        pliant_error err;
        pliant_player *player;
        pliant_player_def def = pliant_player_default(loose);
        def.compliance = kinds[i];
        check_ok(pliant_player_create(loose, &def, &player, &err), &err);
        pliant_solver *solver;
        pliant_solver_def solver_def = pliant_solver_default(loose);
        solver_def.compliance = kinds[i];
        check_ok(pliant_solver_create(loose, &solver_def, &solver, &err), &err);
        // More than the first solver has room for: the larger one is of the same kind.
        for (int k = 0; k < 70; k++) {
            const int32_t v = free_vertex(loose, 3 * k);
            check_play_ok(player, "displace %d 0 0 -0.1\n", (int)v);
            if (k == 0) {
                check_ok(
                    pliant_solver_displace(solver, (pliant_node){3, v}, (pliant_vec3){0, 0, -0.1f}),
                    NULL);
                assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
                check_play_ok(player, "step\n");
                const pliant_vec3 f = pliant_solver_contact_force(solver);
                assert_memory_equal(&pliant_player_last(player)->force, &f, sizeof f);
            }
        }
        check_play_ok(player, "step\n");
        forces[i] = pliant_player_last(player)->force;
        pliant_solver_destroy(solver);
        pliant_player_destroy(player);
    }
    // Compression has made the two differ.
    assert_true(forces[0].x != forces[1].x || forces[0].z != forces[1].z);
}

static void mistakes_are_told_with_line_and_column(void **state)
{
    (void)state;
    const int32_t v = free_vertex(whole, 0), f = fixed_vertex(whole);
    char text[256], expected[256];
    const struct {
        const pliant_model *model;
        const char *text, *message;
    } mistakes[] = {
        {whole, "displace 99999 0 0 1", "t.script:1:10: vertex 99999 of 162"},
        {whole, "displace 162 0 0 1", "t.script:1:10: vertex 162 of 162"},
        {whole, "\n\n  force   2:162 0 0 1", "t.script:3:11: vertex 162 of 162 on level 2"},
        {whole, "traction 1:42 0 0 1", "t.script:1:10: vertex 42 of 42 on level 1"},
        {whole, "displace 3:1 0 0 1", "t.script:1:10: level 3: expected 0 to 2"},
        {whole, "release source 99999", "t.script:1:9: source vertex 99999 is not in the model"},
        {whole, "support 3:near 0 0 0 0 0 1", "t.script:1:9: level 3: expected 0 to 2"},
        {whole, "release 0:12", "t.script:1:9: vertex 12 of 12 on level 0"},
        {whole, "displace 1:source 0 0 0 1",  // the input had the reverse order
         "t.script:1:10: source vertex 0 is vertex 161 of 42 on level 1"},
        {fine, "displace 1:0 0 0 1", "t.script:1:10: level 1 is not in the file: it has level 2"},
        {fine, "force 0:near 0 0 1 0 0 1",
         "t.script:1:7: level 0 is not in the file: it has level 2"},
        {coarse, "traction 2:100 0 0 1",
         "t.script:1:10: level 2 is not in the file: it has levels 0 to 1"},
        {coarse, "displace 42 0 0 1",
         "t.script:1:10: vertex 42 of 42 on level 1, the finest in the file"},
        {coarse, "release source 0",
         "t.script:1:9: source vertex 0 is vertex 161 of 42 on level 1, the finest in the file"},
        {whole, "probe p vertex 162", "t.script:1:7: vertex 162 of 162"},
        {whole, "probe p vertex 1\nprobe p vertex 2",
         "t.script:2:7: probe p is already there: expected another name"},
        {whole, "step\nexpect q 0 0 0 1", "t.script:2:8: no probe q: expected one declared before"},
        {whole, "probe p vertex 1\nexpect p 0 0 0 1",
         "t.script:2:8: probe p has no displacement yet: expected a step before"},
    };
    for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++) {
        pliant_error err;
        pliant_player *player = create(mistakes[i].model);
        assert_true(check_play(player, NULL, &err, mistakes[i].text) < 0);
        assert_string_equal(err.text, mistakes[i].message);
        pliant_player_destroy(player);
    }
    // With the vertices of this model in them.
    const struct {
        const pliant_model *model;
        const char *format, *message;
        int32_t vertex;
    } kinds[] = {
        {whole, "displace %d 0 0 1",
         "t.script:1:10: vertex %d is fixed: displace needs a free one "
         "(support moves it)",
         f},
        {whole, "support %d 0 0 1",
         "t.script:1:9: vertex %d is free: support needs a fixed one "
         "(displace moves it)",
         v},
        {loose, "support %d 0 0 1",
         "t.script:1:9: support at the fixed vertex %d needs a model "
         "precomputed with --blocks all",
         fixed_vertex(loose)},
        {loose, "traction %d 0 0 1",
         "t.script:1:10: traction at the fixed vertex %d needs a model "
         "precomputed with --blocks all",
         fixed_vertex(loose)},
    };
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        pliant_error err;
        pliant_player *player = create(kinds[i].model);
        snprintf(text, sizeof text, kinds[i].format, (int)kinds[i].vertex);
        snprintf(expected, sizeof expected, kinds[i].message, (int)kinds[i].vertex);
        assert_true(check_play(player, NULL, &err, text) < 0);
        assert_string_equal(err.text, expected);
        pliant_player_destroy(player);
    }
}

static void numbers_beyond_single_precision_are_refused(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player = create(whole);
    // A finite force over a small area.
    assert_int_equal(check_play(player, NULL, &err, "force 20 3e38 0 0"), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "t.script:1:7: "));
    assert_non_null(strstr(err.text, "beyond single precision"));
    pliant_player_destroy(player);
}

static void a_refused_statement_changes_nothing(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player = create(whole);
    const int32_t a = free_vertex(whole, 7);
    check_play_ok(player, "probe p vertex %d\ndisplace %d 0.01 0 0\nstep\n", (int)a, (int)a);
    const pliant_step before = *pliant_player_last(player);
    const char *const refused[] = {"displace 999 1 1 1", "support 999 1 1 1",
                                   "probe p vertex 1",   "expect p 9 9 9 1",
                                   "expect q 0 0 0 1",   "displace 0:12 1 1 1"};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++)
        assert_true(check_play(player, NULL, &err, refused[i]) < 0);
    int32_t count;
    pliant_player_conditions(player, &count);
    assert_int_equal(count, 1);
    pliant_player_probes(player, &count);
    assert_int_equal(count, 1);
    check_play_ok(player, "step\nexpect p 0.01 0 0 1e-8\n");
    assert_int_equal(pliant_player_last(player)->number, 2);
    check_near(pliant_player_last(player)->force.x, before.force.x, 0);
    pliant_player_destroy(player);
}

typedef struct heard {
    int steps, met, missed;
    double distance;
} heard;

static pliant_status hear_step(void *context, pliant_player *player, const pliant_step *step,
                               pliant_error *err)
{
    (void)err;
    heard *h = context;
    assert_int_equal(step->number, ++h->steps);
    assert_ptr_equal(step, pliant_player_last(player));
    return PLIANT_OK;
}

static pliant_status hear_expectation(void *context, const pliant_expectation *e, pliant_error *err)
{
    (void)err;
    heard *h = context;
    *(e->met ? &h->met : &h->missed) += 1;
    h->distance = e->distance;
    return PLIANT_OK;
}

static void expectations_are_met_within_their_tolerance_only(void **state)
{
    (void)state;
    pliant_error err;
    heard h = {0};
    const pliant_observer observer = {
        .context = &h, .stepped = hear_step, .expected = hear_expectation};
    const int32_t a = free_vertex(whole, 7);
    pliant_player *player = create(whole);
    char text[256];
    snprintf(text, sizeof text, "probe p vertex %d\ndisplace %d 0.25 0 -0.5\nstep 4\n", (int)a,
             (int)a);
    check_ok(check_play(player, &observer, &err, text), &err);
    assert_int_equal(h.steps, 4);
    // 3-4-5: the distance is 0.5, up to its last bit; 0.25 and 0.5 are exact in a float.
    check_ok(check_play(player, &observer, &err, "expect p 0.55 0.4 -0.5 0.5000001"), &err);
    check_near(h.distance, 0.5, 1e-15);
    assert_int_equal(h.met, 1);
    assert_int_equal(check_play(player, &observer, &err, "expect p 0.55 0.4 -0.5 0.4999"),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(h.missed, 1);
    assert_string_equal(err.text, "t.script:1:8: expect p: found 0.25 0 -0.5, expected 0.55 0.4 "
                                  "-0.5: distance 0.5, tolerance 0.4999");
    check_ok(check_play(player, &observer, &err, "expect p 0.25 0 -0.5 0"), &err);
    pliant_player_destroy(player);
}

static pliant_status stop_at_third(void *context, pliant_player *player, const pliant_step *step,
                                   pliant_error *err)
{
    (void)context, (void)player;
    if (step->number < 3) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_IO, "enough");
}

static void an_observer_can_end_the_play(void **state)
{
    (void)state;
    pliant_error err;
    const pliant_observer observer = {.stepped = stop_at_third};
    pliant_player *player = create(whole);
    assert_int_equal(check_play(player, &observer, &err, "step 1000"), PLIANT_ERR_IO);
    assert_string_equal(err.text, "enough");
    assert_int_equal(pliant_player_last(player)->number, 3);
    pliant_player_destroy(player);
}

static void more_conditions_than_the_solver_began_with_are_played(void **state)
{
    (void)state;
    // The default solver has room for 64 constraints and 256 loads.
    const int32_t constraints = 90, loads = 300;
    const int32_t m = pliant_model_describe(loose).free_count;
    assert_true(constraints + loads < m);
    pliant_player *player = create(loose);
    for (int32_t i = 0; i < constraints + loads; i++) {
        const int32_t v = free_vertex(loose, i);
        if (i < loads) check_play_ok(player, "traction %d 0 0 5\n", (int)v);
        else check_play_ok(player, "displace %d 0 0 %.17g\n", (int)v, 1e-3 * i);
        if (i % 100 == 50) check_play_ok(player, "gravity 0 0.01 0\nstep\n");
    }
    check_play_ok(player, "step\n");
    assert_int_equal(pliant_player_last(player)->report.constraint_count, constraints);

    // The same from a solver that had the room from the start.
    pliant_error err;
    pliant_solver *solver;
    pliant_solver_def def = pliant_solver_default(loose);
    def.constraint_capacity = constraints;
    def.load_capacity = loads;
    check_ok(pliant_solver_create(loose, &def, &solver, &err), &err);
    check_ok(pliant_solver_gravity(solver, (pliant_vec3){0, 0.01f, 0}), NULL);
    for (int32_t i = 0; i < constraints + loads; i++) {
        const pliant_node node = {3, free_vertex(loose, i)};
        if (i < loads) check_ok(pliant_solver_press(solver, node, (pliant_vec3){0, 0, 5}), NULL);
        else
            check_ok(pliant_solver_displace(solver, node, (pliant_vec3){0, 0, (float)(1e-3 * i)}),
                     NULL);
    }
    assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
    const int32_t n = pliant_player_surface_count(player);
    pliant_vec3 *u = calloc((size_t)n, sizeof *u);
    check_ok(pliant_solver_surface(solver, 3, u), NULL);
    double largest = 0;
    for (int32_t v = 0; v < n; v++) largest = fmax(largest, fabs((double)u[v].z));
    // Other orders of summation: 390 columns rounded at 2^-24 each, times the conditioning of C.
    for (int32_t v = 0; v < n; v++) check_near(at(player, v).z, u[v].z, 1e-4 * largest);
    free(u);
    pliant_solver_destroy(solver);
    pliant_player_destroy(player);
}

static void probes_are_exact_whatever_the_level_of_the_surface(void **state)
{
    (void)state;
    pliant_player *all = create(loose), *some = create_at(loose, 1);
    assert_int_equal(pliant_player_surface_count(some), 42);
    const int32_t near = free_vertex(loose, 3), far = free_vertex(loose, 300);
    pliant_player *const players[] = {all, some};
    for (int i = 0; i < 2; i++)
        check_play_ok(players[i],
                      "probe near vertex %d\nprobe far vertex %d\nprobe held vertex %d\n"
                      "displace near 0 0 1 0 0 -0.1\ntraction near 1 0 0 0 0 1\nstep\n",
                      (int)near, (int)far, (int)fixed_vertex(loose));
    int32_t count;
    const pliant_probe *exact = pliant_player_probes(all, &count);
    const pliant_probe *found = pliant_player_probes(some, &count);
    assert_int_equal(count, 3);
    for (int32_t i = 0; i < count; i++) {
        // The same sums in another order, of numbers below 1.
        check_near(found[i].u.x, exact[i].u.x, 1e-6);
        check_near(found[i].u.z, exact[i].u.z, 1e-6);
    }
    check_near(found[2].u.z, 0, 0);
    pliant_player_destroy(all);
    pliant_player_destroy(some);
}

static void late_probes_follow_the_rule(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player = create(whole);
    const int32_t a = free_vertex(whole, 7);
    check_play_ok(player, "displace %d 0.25 0 0\nstep\nprobe p vertex %d\nexpect p 0.25 0 0 0\n",
                  (int)a, (int)a);
    pliant_player_destroy(player);

    pliant_player_def def = pliant_player_default(whole);
    def.script_name = "t.script";
    def.probe_rule = PLIANT_PROBES_FIRST;
    check_ok(pliant_player_create(whole, &def, &player, &err), &err);
    check_play_ok(player, "probe p vertex 1\nstep\n");
    assert_int_equal(check_play(player, NULL, &err, "probe q vertex 1"), PLIANT_ERR_ARGUMENT);
    assert_string_equal(err.text, "t.script:1:7: probe q after a step: with rows written per step "
                                  "(-o, --json), probes must come before the first");
    pliant_player_destroy(player);
}

static void too_many_probes_are_refused(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player = create(whole);
    for (int i = 0; i < PLIANT_PROBE_LIMIT; i++) check_play_ok(player, "probe p%d vertex 1\n", i);
    assert_int_equal(check_play(player, NULL, &err, "probe more vertex 1"), PLIANT_ERR_CAPACITY);
    assert_string_equal(err.text, "t.script:1:7: more than 1024 probes");
    pliant_player_destroy(player);
}

static void a_level_that_is_not_there_is_refused(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player = NULL;
    pliant_player_def def = pliant_player_default(whole);
    def.level = 3;
    assert_int_equal(pliant_player_create(whole, &def, &player, &err), PLIANT_ERR_ARGUMENT);
    assert_string_equal(err.text, "level: expected 0 to 2, found 3");
    assert_null(player);
}

static void steps_do_not_allocate(void **state)
{
    (void)state;
#ifndef COUNTS_ALLOCATIONS
    skip();
#else
    pliant_player *player = create_at(loose, 2);
    check_play_ok(player, "probe p near 0 0 1\nprobe q near 1 0 0\n");
    enum { LINES = 8 };
    pliant_statement statements[LINES];
    pliant_error err;
    const char *const lines[LINES] = {"displace near 0 0 1 0 0 -0.01",
                                      "displace near 0.1 0 1 0 0 -0.02",
                                      "traction near 1 0 0 0 1 0",
                                      "displace 0:near 0 0 1 0 0 -0.01",
                                      "step 10",
                                      "release near 0.1 0 1",
                                      "displace 1:near 0 1 0 0 0 0",
                                      "force 2:near 1 0 0 0 1 0"};
    for (int i = 0; i < LINES; i++)
        check_ok(pliant_statement_parse(lines[i], strlen(lines[i]), "t.script", 1, 0,
                                        &statements[i], &err),
                 &err);
    const long before = allocation_count;
    int refused = 0;
    for (int round = 0; round < 50; round++)
        for (int i = 0; i < LINES; i++)
            refused += pliant_player_execute(player, &statements[i], NULL, NULL) < 0;
    const long after = allocation_count;
    assert_int_equal(refused, 0);
    assert_int_equal(after - before, 0);
    assert_int_equal(pliant_player_last(player)->number, 500);
    pliant_player_destroy(player);
#endif
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_statement_runs),
        cmocka_unit_test(state_persists_and_release_undoes_it),
        cmocka_unit_test(releasing_one_condition_keeps_the_others),
        cmocka_unit_test(all_names_of_a_vertex_are_the_same_vertex),
        cmocka_unit_test(force_is_traction_times_vertex_area),
        cmocka_unit_test(a_load_on_a_level_is_the_sum_of_loads_over_its_hat),
        cmocka_unit_test(levels_are_those_of_the_solver),
        cmocka_unit_test(the_last_statement_about_a_vertex_holds_on_whatever_level),
        cmocka_unit_test(near_means_a_vertex_of_the_level),
        cmocka_unit_test(a_step_that_would_be_late_is_solved_coarser_and_says_so),
        cmocka_unit_test(compliance_is_the_definitions),
        cmocka_unit_test(mistakes_are_told_with_line_and_column),
        cmocka_unit_test(numbers_beyond_single_precision_are_refused),
        cmocka_unit_test(a_refused_statement_changes_nothing),
        cmocka_unit_test(expectations_are_met_within_their_tolerance_only),
        cmocka_unit_test(an_observer_can_end_the_play),
        cmocka_unit_test(more_conditions_than_the_solver_began_with_are_played),
        cmocka_unit_test(probes_are_exact_whatever_the_level_of_the_surface),
        cmocka_unit_test(late_probes_follow_the_rule),
        cmocka_unit_test(too_many_probes_are_refused),
        cmocka_unit_test(a_level_that_is_not_there_is_refused),
        cmocka_unit_test(steps_do_not_allocate),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
