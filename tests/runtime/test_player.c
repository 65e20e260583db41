// test_player.c: the player executes scripts: state, names, probes, expectations, refusals.
#include "check.h"

#include "pliant/error.h"
#include "player.h"
#include "synthetic_model.h"

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
static pliant_model *whole;  // 162 vertices, all blocks, nothing thresholded
static pliant_model *loose;  // 642 vertices, free block only, eps 0.05

static pliant_model *make(const char *name, int32_t levels, double eps, check_blocks blocks)
{
    char path[128];
    pliant_error err;
    pliant_model *model;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    check_write_synthetic_model(path, NULL, levels, eps, pliant_wavelet_default(), blocks);
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    return model;
}

static int set_up(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/pliant-player-XXXXXX");
    if (!mkdtemp(folder)) return -1;
    whole = make("whole.h5", 2, 0, CHECK_ALL_BLOCKS);
    loose = make("loose.h5", 3, 0.05, CHECK_FREE_BLOCK);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    pliant_model_close(whole);
    pliant_model_close(loose);
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

// Play text, line by line, up to the first refusal.
static pliant_status play(pliant_player *player, const pliant_observer *observer, pliant_error *err,
                          const char *text)
{
    static const char version[] = "pliant-script 1";
    pliant_statement statement;
    for (int64_t line = 1; *text; line++) {
        const size_t length = strcspn(text, "\n");
        pliant_status status = pliant_statement_parse(
            text, length, "t.script", line,
            line == 1 && strncmp(text, version, sizeof version - 1) == 0, &statement, err);
        if (status >= 0) status = pliant_player_execute(player, &statement, observer, err);
        if (status < 0) return status;
        text += length + (text[length] == '\n');
    }
    return PLIANT_OK;
}

__attribute__((format(printf, 2, 3))) static void play_ok(pliant_player *player, const char *format,
                                                          ...)
{
    char text[4096];
    pliant_error err;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    check_ok(play(player, NULL, &err, text), &err);
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
    play_ok(player,
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
    play_ok(player, "displace %d 0.01 0 0\nstep\n", (int)a);
    const pliant_vec3 alone = at(player, b);
    play_ok(player, "traction %d 0 0 3\nstep\nrelease %d\nstep\n", (int)b, (int)b);
    // Coherent sums leave rounding of the traction's response behind, some 1e-7 of it.
    check_near(at(player, b).x, alone.x, 1e-6);
    check_near(at(player, b).z, alone.z, 1e-6);
    play_ok(player, "displace %d 0.02 0 0\nstep\n", (int)a);  // a new value, the same constraint
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
    play_ok(player, "displace %d 1 0 0\ndisplace %d 2 0 0\ndisplace %d 3 0 0\nrelease %d\n", (int)a,
            (int)b, (int)c, (int)a);
    play_ok(player, "displace %d 4 0 0\n", (int)c);  // known already: no third
    const pliant_condition *conditions = pliant_player_conditions(player, &count);
    assert_int_equal(count, 2);
    for (int i = 0; i < 2; i++) {
        const int is_b = conditions[i].node.vertex == b;
        assert_int_equal(conditions[i].node.vertex, is_b ? b : c);
        check_near(conditions[i].value.x, is_b ? 2 : 4, 0);
    }
    play_ok(player, "release %d\nrelease %d\n", (int)c, (int)c);
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
        play_ok(player, "displace %s 0 0.01 0\nprobe p vertex %s\nstep\n", names[i], names[i]);
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
    play_ok(force, "force %d 0 0 -3\nstep\n", (int)v);
    play_ok(traction, "traction %d 0 0 %.17g\nstep\n", (int)v, -3 / pliant_model_area(whole, v));
    for (int32_t i = 0; i < pliant_player_surface_count(force); i++)
        check_near(at(force, i).z, at(traction, i).z, 0);
    pliant_player_destroy(force);
    pliant_player_destroy(traction);
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
        assert_true(play(player, NULL, &err, mistakes[i].text) < 0);
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
        {whole, "displace 1:%d 0 0 1",
         "t.script:1:10: level 1 is not in the file: expected "
         "constraints on level 2",
         v},
    };
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        pliant_error err;
        pliant_player *player = create(kinds[i].model);
        snprintf(text, sizeof text, kinds[i].format, (int)kinds[i].vertex);
        snprintf(expected, sizeof expected, kinds[i].message, (int)kinds[i].vertex);
        assert_true(play(player, NULL, &err, text) < 0);
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
    assert_int_equal(play(player, NULL, &err, "force 20 3e38 0 0"), PLIANT_ERR_ARGUMENT);
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
    play_ok(player, "probe p vertex %d\ndisplace %d 0.01 0 0\nstep\n", (int)a, (int)a);
    const pliant_step before = *pliant_player_last(player);
    const char *const refused[] = {"displace 999 1 1 1", "support 999 1 1 1", "probe p vertex 1",
                                   "expect p 9 9 9 1",   "expect q 0 0 0 1",  "displace 0:1 1 1 1"};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++)
        assert_true(play(player, NULL, &err, refused[i]) < 0);
    int32_t count;
    pliant_player_conditions(player, &count);
    assert_int_equal(count, 1);
    pliant_player_probes(player, &count);
    assert_int_equal(count, 1);
    play_ok(player, "step\nexpect p 0.01 0 0 1e-8\n");
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
    check_ok(play(player, &observer, &err, text), &err);
    assert_int_equal(h.steps, 4);
    // 3-4-5: the distance is 0.5, up to its last bit; 0.25 and 0.5 are exact in a float.
    check_ok(play(player, &observer, &err, "expect p 0.55 0.4 -0.5 0.5000001"), &err);
    check_near(h.distance, 0.5, 1e-15);
    assert_int_equal(h.met, 1);
    assert_int_equal(play(player, &observer, &err, "expect p 0.55 0.4 -0.5 0.4999"),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(h.missed, 1);
    assert_string_equal(err.text, "t.script:1:8: expect p: found 0.25 0 -0.5, expected 0.55 0.4 "
                                  "-0.5: distance 0.5, tolerance 0.4999");
    check_ok(play(player, &observer, &err, "expect p 0.25 0 -0.5 0"), &err);
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
    assert_int_equal(play(player, &observer, &err, "step 1000"), PLIANT_ERR_IO);
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
        if (i < loads) play_ok(player, "traction %d 0 0 5\n", (int)v);
        else play_ok(player, "displace %d 0 0 %.17g\n", (int)v, 1e-3 * i);
        if (i % 100 == 50) play_ok(player, "gravity 0 0.01 0\nstep\n");
    }
    play_ok(player, "step\n");
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
    pliant_player *fine = create(loose), *coarse = create_at(loose, 1);
    assert_int_equal(pliant_player_surface_count(coarse), 42);
    const int32_t near = free_vertex(loose, 3), far = free_vertex(loose, 300);
    pliant_player *const players[] = {fine, coarse};
    for (int i = 0; i < 2; i++)
        play_ok(players[i],
                "probe near vertex %d\nprobe far vertex %d\nprobe held vertex %d\n"
                "displace near 0 0 1 0 0 -0.1\ntraction near 1 0 0 0 0 1\nstep\n",
                (int)near, (int)far, (int)fixed_vertex(loose));
    int32_t count;
    const pliant_probe *exact = pliant_player_probes(fine, &count);
    const pliant_probe *found = pliant_player_probes(coarse, &count);
    assert_int_equal(count, 3);
    for (int32_t i = 0; i < count; i++) {
        // The same sums in another order, of numbers below 1.
        check_near(found[i].u.x, exact[i].u.x, 1e-6);
        check_near(found[i].u.z, exact[i].u.z, 1e-6);
    }
    check_near(found[2].u.z, 0, 0);
    pliant_player_destroy(fine);
    pliant_player_destroy(coarse);
}

static void late_probes_follow_the_rule(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player = create(whole);
    const int32_t a = free_vertex(whole, 7);
    play_ok(player, "displace %d 0.25 0 0\nstep\nprobe p vertex %d\nexpect p 0.25 0 0 0\n", (int)a,
            (int)a);
    pliant_player_destroy(player);

    pliant_player_def def = pliant_player_default(whole);
    def.script_name = "t.script";
    def.probe_rule = PLIANT_PROBES_FIRST;
    check_ok(pliant_player_create(whole, &def, &player, &err), &err);
    play_ok(player, "probe p vertex 1\nstep\n");
    assert_int_equal(play(player, NULL, &err, "probe q vertex 1"), PLIANT_ERR_ARGUMENT);
    assert_string_equal(err.text, "t.script:1:7: probe q after a step: with rows written per step "
                                  "(-o, --json), probes must come before the first");
    pliant_player_destroy(player);
}

static void too_many_probes_are_refused(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player = create(whole);
    for (int i = 0; i < PLIANT_PROBE_LIMIT; i++) play_ok(player, "probe p%d vertex 1\n", i);
    assert_int_equal(play(player, NULL, &err, "probe more vertex 1"), PLIANT_ERR_CAPACITY);
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
    play_ok(player, "probe p near 0 0 1\nprobe q near 1 0 0\n");
    pliant_statement statements[5];
    pliant_error err;
    const char *const lines[] = {"displace near 0 0 1 0 0 -0.01", "displace near 0.1 0 1 0 0 -0.02",
                                 "traction near 1 0 0 0 1 0", "step 10", "release near 0.1 0 1"};
    for (int i = 0; i < 5; i++)
        check_ok(pliant_statement_parse(lines[i], strlen(lines[i]), "t.script", 1, 0,
                                        &statements[i], &err),
                 &err);
    const long before = allocation_count;
    int refused = 0;
    for (int round = 0; round < 50; round++)
        for (int i = 0; i < 5; i++)
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
