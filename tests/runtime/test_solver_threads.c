// test_solver_threads.c: solvers on one model in different threads do not see each other.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { step_count = 300, vertex_limit = 162 };

typedef struct walk {
    const pliant_model *model;
    uint64_t seed;
    int32_t failed;
    pliant_vec3 sum[vertex_limit];  // of the surfaces of all steps
} walk;

// No CMocka in here: it is not meant for threads.
static void *run_walk(void *argument)
{
    walk *w = argument;
    check_random random = {w->seed};
    pliant_solver *solver = NULL;
    const pliant_solver_def def = {.constraint_capacity = 8, .load_capacity = 8, .cache_count = 2};
    w->failed = pliant_solver_create(w->model, &def, &solver, NULL) < 0;
    for (int step = 0; step < step_count && !w->failed; step++) {
        const int32_t v = (int32_t)(check_random_next(&random) * vertex_limit);
        const pliant_vec3 value = {0.1f, (float)check_random_next(&random), -0.1f};
        const pliant_node node = {2, v};
        if (step % 16 == 0) pliant_solver_release_all(solver);
        const pliant_status status =
            check_random_next(&random) < 0.6    ? pliant_solver_press(solver, node, value)
            : pliant_model_is_free(w->model, v) ? pliant_solver_displace(solver, node, value)
                                                : pliant_solver_support(solver, node, value);
        pliant_vec3 u[vertex_limit], p[vertex_limit];
        w->failed |= status < 0 && status != PLIANT_ERR_CAPACITY;
        w->failed |= pliant_solver_solve(solver, PLIANT_NEVER) < 0;
        w->failed |= pliant_solver_displacements(solver, &v, 1, u) < 0;
        w->failed |= pliant_solver_surface(solver, 2, u) < 0;
        w->failed |= pliant_solver_tractions(solver, NULL, vertex_limit, p) < 0;
        for (int32_t i = 0; i < vertex_limit; i++)
            w->sum[i].x += u[i].x + p[i].x, w->sum[i].y += u[i].y + p[i].y,
                w->sum[i].z += u[i].z + p[i].z;
    }
    pliant_solver_destroy(solver);
    return NULL;
}

static void two_threads_repeat_to_the_bit_what_each_does_alone(void **state)
{
    (void)state;
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_threads_%d.h5", (int)getpid());
    check_write_synthetic_model(path, NULL, 2, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS);
    pliant_error err = {""};
    pliant_model *model = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    static walk alone[2], together[2];
    pthread_t threads[2];
    for (int k = 0; k < 2; k++) {
        alone[k] = together[k] = (walk){.model = model, .seed = 11 + (uint64_t)k};
        run_walk(&alone[k]);
    }
    for (int k = 0; k < 2; k++)
        assert_int_equal(pthread_create(&threads[k], NULL, run_walk, &together[k]), 0);
    for (int k = 0; k < 2; k++) assert_int_equal(pthread_join(threads[k], NULL), 0);
    for (int k = 0; k < 2; k++) {
        assert_int_equal(alone[k].failed, 0);
        assert_int_equal(together[k].failed, 0);
        assert_memory_equal(alone[k].sum, together[k].sum, sizeof alone[k].sum);
    }
    assert_memory_not_equal(alone[0].sum, alone[1].sum, sizeof alone[0].sum);
    pliant_model_close(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_threads_repeat_to_the_bit_what_each_does_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
