// test_team.c: every task is done once, whoever does it, and a run ends after all of them.
#include "allocations.h"

#include "lattice/float_mode.h"
#include "lattice/team.h"

#include <string.h>
#include <unistd.h>

enum { most_tasks = 1000 };

typedef struct tally {
    atomic_int done[most_tasks];
    atomic_int workers[PLIANT_TEAM_LIMIT];
    atomic_int mode_errors;
    pliant_float_mode mode;
    int pause_us;
} tally;

static void count_task(void *context, int32_t task, int32_t worker)
{
    tally *t = context;
    if (t->pause_us) usleep((useconds_t)t->pause_us);
    if (pliant_float_mode_get() != t->mode) atomic_fetch_add(&t->mode_errors, 1);
    atomic_fetch_add_explicit(&t->workers[worker], 1, memory_order_relaxed);
    atomic_fetch_add_explicit(&t->done[task], 1, memory_order_relaxed);
}

static pliant_team *team_of(int32_t thread_count)
{
    pliant_team *team = NULL;
    pliant_error err = {""};
    check_ok(pliant_team_create(thread_count, &team, &err), &err);
    assert_int_equal(pliant_team_thread_count(team), thread_count);
    return team;
}

static void every_task_is_done_once_by_a_worker_of_the_team(void **state)
{
    (void)state;
    static tally t;
    for (int32_t threads = 1; threads <= 5; threads++) {
        pliant_team *team = team_of(threads);
        for (int run = 0; run < 300; run++) {
            memset(&t, 0, sizeof t);
            t.mode = pliant_float_mode_get();
            const int32_t tasks = run % 7 == 0 ? run % 3 : 1 + (run * 37) % most_tasks;
            pliant_team_run(team, tasks, count_task, &t);
            for (int32_t i = 0; i < most_tasks; i++) assert_int_equal(t.done[i], i < tasks);
            int32_t sum = 0;
            for (int32_t w = 0; w < PLIANT_TEAM_LIMIT; w++) {
                if (w >= threads) assert_int_equal(t.workers[w], 0);
                sum += t.workers[w];
            }
            assert_int_equal(sum, tasks);
            assert_int_equal(t.mode_errors, 0);
            if (run % 100 == 99) usleep(20000);  // long enough to fall asleep
        }
        pliant_team_destroy(team);
    }
}

static void long_tasks_are_shared(void **state)
{
    (void)state;
    static tally t;
    pliant_team *team = team_of(3);
    memset(&t, 0, sizeof t);
    t.mode = pliant_float_mode_get();
    t.pause_us = 2000;
    pliant_team_run(team, 60, count_task, &t);
    for (int32_t w = 0; w < 3; w++) check_at_least(t.workers[w], 5);
    pliant_team_destroy(team);
}

static void tasks_run_in_the_callers_float_mode(void **state)
{
    (void)state;
    static tally t;
    pliant_team *team = team_of(2);
    for (int is_flushing = 0; is_flushing < 2; is_flushing++) {
        const pliant_float_mode before =
            is_flushing ? pliant_float_mode_flush() : pliant_float_mode_get();
        memset(&t, 0, sizeof t);
        t.mode = pliant_float_mode_get();
        t.pause_us = 500;
        pliant_team_run(team, 20, count_task, &t);
        pliant_float_mode_set(before);
        assert_int_equal(t.mode_errors, 0);
        check_at_least(t.workers[1], 1);
    }
    pliant_team_destroy(team);
}

// What a run writes is there for the caller and for the next run, without atomics in the tasks.
static void add_one(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    int64_t *values = context;
    values[task] += 1 + task;
}

static void runs_follow_one_another(void **state)
{
    (void)state;
    static int64_t values[16];
    pliant_team *team = team_of(4);
    for (int run = 0; run < 20000; run++) pliant_team_run(team, 16, add_one, values);
    for (int i = 0; i < 16; i++) assert_int_equal(values[i], (int64_t)20000 * (1 + i));
    pliant_team_destroy(team);
}

static void no_team_is_the_caller_alone(void **state)
{
    (void)state;
    static tally t;
    memset(&t, 0, sizeof t);
    t.mode = pliant_float_mode_get();
    pliant_team_run(NULL, 5, count_task, &t);
    assert_int_equal(t.workers[0], 5);
    assert_int_equal(pliant_team_thread_count(NULL), 1);
    pliant_team_destroy(NULL);
}

static void thread_counts_out_of_range_are_refused(void **state)
{
    (void)state;
    const int32_t wrong[] = {0, -1, PLIANT_TEAM_LIMIT + 1, INT32_MAX};
    for (int i = 0; i < 4; i++) {
        pliant_team *team = (pliant_team *)&team;
        pliant_error err = {""};
        assert_int_equal(pliant_team_create(wrong[i], &team, &err), PLIANT_ERR_ARGUMENT);
        assert_null(team);
        assert_non_null(strstr(err.text, "threads: expected 1 to 64"));
    }
}

static void runs_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    static int64_t values[16];
    pliant_team *team = team_of(3);
    pliant_team_run(team, 16, add_one, values);
    const long before = atomic_load(&calls);
    for (int run = 0; run < 200; run++) {
        pliant_team_run(team, 16, add_one, values);
        if (run % 50 == 0) usleep(5000);
    }
    assert_int_equal(atomic_load(&calls) - before, 0);
    pliant_team_destroy(team);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(every_task_is_done_once_by_a_worker_of_the_team),
        cmocka_unit_test(long_tasks_are_shared),
        cmocka_unit_test(tasks_run_in_the_callers_float_mode),
        cmocka_unit_test(runs_follow_one_another),
        cmocka_unit_test(no_team_is_the_caller_alone),
        cmocka_unit_test(thread_counts_out_of_range_are_refused),
        cmocka_unit_test(runs_allocate_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
