// test_soak.c: many played steps with conditions arriving and leaving at random: nothing drifts,
// nothing is allocated, and no missed deadline goes untold.
//
// PLIANT_SOAK_STEPS says how many steps, 20000 by default (two seconds; ten million take a quarter
// of an hour). Every step changes a few conditions of a sphere of 162 vertices, all blocks, all
// levels stored, nothing thresholded: displacements, tractions, supports, freed vertices and
// gravity appear, change their value or level, and go. Steps have random deadlines, which many
// miss.
#include "check.h"

#include "compare.h"
#include "player.h"
#include "synthetic_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// ---- Allocations are counted where the sanitizers do not do it themselves ----

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
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
#else
static const long allocation_count;
#endif

enum {
    VERTICES = 162,
    LEVELS = 3,
    COMPARE_EVERY = 1000,
    MOST_CHANGED = 40,  // nodes in S; the first solver has room for 64
    MOST_LOADS = 40,    // the first solver has room for 256
    PARTS = 10,         // of the run, each with a comparison of its own
};

// What the script has stated about a vertex.
typedef enum said {
    NOTHING,
    CHANGED,
    LOADED,
} said;

typedef struct soak {
    pliant_model *model;
    pliant_player *player;
    check_random random;
    said said[VERTICES];
    int32_t counts[3];
    double residual;
    int64_t allocated;                       // inside the player
    int64_t coarser, overrun, given, rough;  // steps: resolved coarser, too late, with a deadline
} soak;

static int64_t step_count(void)
{
    const char *text = getenv("PLIANT_SOAK_STEPS");
    const int64_t count = text ? atoll(text) : 20000;
    assert_in_range(count, 1, INT64_MAX / 2);
    return count;
}

static void execute(soak *s, const pliant_statement *statement)
{
    pliant_error err = {""};
    const long before = allocation_count;
    const pliant_status status = pliant_player_execute(s->player, statement, NULL, &err);
    s->allocated += allocation_count - before;
    if (status < 0) fail_msg("%s", err.text);
}

static float any(soak *s)
{
    return (float)(check_random_next(&s->random) - 0.5);
}

static void become(soak *s, int32_t vertex, said now)
{
    s->counts[s->said[vertex]]--;
    s->counts[now]++;
    s->said[vertex] = now;
}

// One statement about a vertex, on a random level that it belongs to.
static void change_something(soak *s)
{
    int32_t level = check_random_index(&s->random, LEVELS);
    const int32_t count = pliant_model_level_vertex_count(s->model, level);
    const int32_t vertex = check_random_index(&s->random, count);
    const int is_free = pliant_model_is_free(s->model, vertex) == 1;
    pliant_statement statement = {
        .vertex = {.kind = PLIANT_VERTEX_MODEL, .has_level = 1, .level = level, .number = vertex},
        .value = {(double)any(s), (double)any(s), (double)any(s)},
    };
    const double kind = check_random_next(&s->random);
    const int full = s->said[vertex] == NOTHING &&
                     (s->counts[CHANGED] >= MOST_CHANGED || s->counts[LOADED] >= MOST_LOADS);
    if (kind < 0.35 || full) {
        statement.kind = PLIANT_STATEMENT_RELEASE;
        become(s, vertex, NOTHING);
    } else if (kind < 0.7) {
        // The type changes: a free vertex is displaced, a fixed one freed.
        if (s->counts[CHANGED] >= MOST_CHANGED && s->said[vertex] != CHANGED) return;
        statement.kind = is_free ? PLIANT_STATEMENT_DISPLACE : PLIANT_STATEMENT_TRACTION;
        become(s, vertex, CHANGED);
    } else {
        statement.kind = is_free ? kind < 0.85 ? PLIANT_STATEMENT_TRACTION : PLIANT_STATEMENT_FORCE
                                 : PLIANT_STATEMENT_SUPPORT;
        // Forces on areas of some 0.05 make tractions of the size of the others. Rarely a load is
        // enormous: when it goes its rounding would stay if sums were not made afresh.
        const double size = (statement.kind == PLIANT_STATEMENT_FORCE ? 0.05 : 1) *
                            (check_random_next(&s->random) < 0.01 ? 1000 : 1);
        for (int c = 0; c < 3; c++) statement.value[c] *= size;
        become(s, vertex, LOADED);
    }
    execute(s, &statement);
}

static void change_gravity(soak *s)
{
    execute(s, &(pliant_statement){.kind = PLIANT_STATEMENT_GRAVITY,
                                   .value = {(double)any(s), (double)any(s), (double)any(s)}});
}

static void release_all(soak *s)
{
    execute(s, &(pliant_statement){.kind = PLIANT_STATEMENT_RELEASE,
                                   .vertex = {.kind = PLIANT_VERTEX_ALL}});
    for (int32_t v = 0; v < VERTICES; v++) become(s, v, NOTHING);
}

// One step with `given` nanoseconds. Whatever the machine does in between, the solve began after
// the player's start and ended before its end, and its phases lie between: so what the report says
// of the deadline can be held against two clocks.
static void step(soak *s, int64_t given)
{
    pliant_player_set_deadline(s->player, given);
    execute(s, &(pliant_statement){.kind = PLIANT_STATEMENT_STEP, .count = 1});
    const pliant_step *done = pliant_player_last(s->player);
    const pliant_solver_report *r = &done->report;
    const int64_t phases = r->capacitance_ns + r->contact_ns + r->summation_ns;
    if (r->asked_count != s->counts[CHANGED])
        fail_msg("step %lld: %d nodes asked for, found %d", (long long)done->number,
                 (int)s->counts[CHANGED], (int)r->asked_count);
    if (given == PLIANT_NEVER) {
        assert_int_equal(r->lateness_ns, 0);
        assert_int_equal(r->is_late, 0);
    } else {
        s->given++;
        const int64_t least = phases - given, most = done->total_ns - given;
        if (r->lateness_ns < least || r->lateness_ns > (most > 0 ? most : 0))
            fail_msg("step %lld: %lld ns given, phases %lld, step %lld: lateness %lld",
                     (long long)done->number, (long long)given, (long long)phases,
                     (long long)done->total_ns, (long long)r->lateness_ns);
    }
    // The status says late when either is so; rough may stand before it.
    const int is_missed = r->is_late || r->lateness_ns > 0;
    if (done->status != PLIANT_ROUGH)
        assert_int_equal(done->status, is_missed ? PLIANT_LATE : PLIANT_OK);
    s->rough += done->status == PLIANT_ROUGH;
    // What was resolved coarser has no more nodes than asked for, and all of them otherwise.
    if (r->is_late) assert_in_range(r->constraint_count, 0, r->asked_count);
    else assert_int_equal(r->constraint_count, r->asked_count);
    s->coarser += r->is_late;
    s->overrun += r->lateness_ns > 0;
    s->residual = fmax(s->residual, r->residual);
}

static void steps_at_random_neither_drift_nor_allocate_nor_hide_a_missed_deadline(void **state)
{
    (void)state;
    char folder[] = "/tmp/pliant-soak-XXXXXX", path[64], dense_path[64];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/model.h5", folder);
    snprintf(dense_path, sizeof dense_path, "%s/dense.h5", folder);
    check_write_synthetic_levels(path, dense_path, LEVELS - 1, 0, pliant_wavelet_default(),
                                 CHECK_ALL_BLOCKS);
    pliant_error err = {""};
    soak s = {.random = check_random_seed(2003), .counts = {[NOTHING] = VERTICES}};
    check_ok(pliant_model_open(path, &s.model, &err), &err);
    assert_int_equal(pliant_model_describe(s.model).vertex_count, VERTICES);
    const pliant_player_def def = pliant_player_default(s.model);
    check_ok(pliant_player_create(s.model, &def, &s.player, &err), &err);

    const int64_t count = step_count();
    double first = 0, worst = 0, last = 0;
    int64_t done = 0, compared = 0;
    for (int part = 0; part < PARTS; part++) {
        pliant_compare *compare = NULL;
        check_ok(pliant_compare_open(dense_path, s.model, &compare, &err), &err);
        const int64_t end = (part + 1) * count / PARTS;
        for (; done < end; done++) {
            // Mostly a few; now and then as many as when a contact begins elsewhere.
            const int changes =
                check_random_index(&s.random, check_random_next(&s.random) < 0.05 ? 40 : 4);
            for (int i = 0; i < changes; i++) change_something(&s);
            const double event = check_random_next(&s.random);
            if (event < 0.01) change_gravity(&s);
            else if (event > 0.9995) release_all(&s);
            const int is_compared = done % COMPARE_EVERY == COMPARE_EVERY - 1 || done + 1 == end;
            // Half of the steps have no deadline; the others 0.5 us to 0.5 ms.
            const double hurry = check_random_next(&s.random);
            step(&s, is_compared || hurry < 0.5 ? PLIANT_NEVER
                                                : (int64_t)(500 * pow(1000, 2 * (hurry - 0.5))));
            if (!is_compared) continue;
            check_ok(pliant_compare_add(compare, s.player, &err), &err);
            compared++;
        }
        const pliant_compare_summary summary = pliant_compare_result(compare);
        pliant_compare_close(compare);
        last = summary.max_worst;
        if (part == 0) first = last;
        worst = fmax(worst, last);
    }
    print_message(
        "%lld steps, %lld with a deadline: %lld resolved coarser, %lld too late; %lld rough; "
        "worst residual of an inverse %.2g\n",
        (long long)done, (long long)s.given, (long long)s.coarser, (long long)s.overrun,
        (long long)s.rough, s.residual);
    print_message(
        "%lld compared: worst vertex off by %.2g of the largest displacement, in the first "
        "tenth %.2g, in the last %.2g\n",
        (long long)compared, worst, first, last);
    // Loads are kept to 256 roundings of 2^-24, which is 1.5e-5 of what they move (solver.c), and
    // the inverse, in floats, multiplies what is left at S by some of its condition.
    check_at_most(worst, 5e-5);
    assert_int_equal(s.allocated, 0);
    // The run was what it claims.
    check_at_least((double)s.coarser, 0.02 * (double)s.given);
    check_at_most((double)s.coarser, 0.98 * (double)s.given);

    pliant_player_destroy(s.player);
    pliant_model_close(s.model);
    unlink(path);
    unlink(dense_path);
    assert_int_equal(rmdir(folder), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_at_random_neither_drift_nor_allocate_nor_hide_a_missed_deadline),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
