// test_exchange_threads.c: a thread that solves and one that looks, on one exchange.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <unistd.h>

enum { step_count = 20000, vertex_limit = 162 };

typedef struct shared {
    const pliant_model *model;
    pliant_exchange *exchange;
    pliant_solver *solver, *viewer;
    int32_t vertex;
    pliant_vec3 unit[vertex_limit];  // the surface when `vertex` is displaced by 1 along x
    atomic_int failed, is_done, received;
} shared;

// Solution k has k as its displacement, along with loads that come and go in pairs and sum to
// nothing. No CMocka in threads.
static void *haptics(void *argument)
{
    shared *s = argument;
    const pliant_node node = {2, s->vertex}, other = {2, s->vertex + 1};
    for (int k = 1; k <= step_count; k++) {
        int bad = pliant_solver_displace(s->solver, node, (pliant_vec3){(float)k, 0, 0}) < 0;
        if (k % 3 == 0) bad |= pliant_solver_press(s->solver, other, (pliant_vec3){0, 0, 0}) < 0;
        if (k % 3 == 1) bad |= pliant_solver_release(s->solver, other) < 0;
        bad |= pliant_solver_solve(s->solver, PLIANT_NEVER) < 0;
        bad |= pliant_solver_publish(s->solver, s->exchange) < 0;
        if (bad) atomic_store(&s->failed, 1);
    }
    atomic_store(&s->is_done, 1);
    return NULL;
}

// Whatever comes is one whole solution, later than the last.
static void *graphics(void *argument)
{
    shared *s = argument;
    float last = 0;
    for (int is_last = 0; !is_last;) {
        is_last = atomic_load(&s->is_done);
        const int32_t status = pliant_solver_receive(s->viewer, s->exchange);
        if (status < 0) atomic_store(&s->failed, 2);
        if (status != 1) continue;
        pliant_vec3 u[vertex_limit];
        if (pliant_solver_surface(s->viewer, 2, u) < 0) atomic_store(&s->failed, 3);
        const float k = u[s->vertex].x;
        if (!(k > last)) atomic_store(&s->failed, 4);
        last = k;
        for (int32_t v = 0; v < vertex_limit; v++) {
            const float *found = &u[v].x, *unit = &s->unit[v].x;
            for (int c = 0; c < 3; c++)
                if (!(fabsf(found[c] - k * unit[c]) <= 2e-5f * k)) atomic_store(&s->failed, 5);
        }
        atomic_fetch_add(&s->received, 1);
    }
    if (last != (float)step_count) atomic_store(&s->failed, 6);
    return NULL;
}

static void two_threads_hand_whole_solutions_over_in_order_and_the_last_one_arrives(void **state)
{
    (void)state;
    static shared s;
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_exchange_threads_%d.h5", (int)getpid());
    check_write_synthetic_model(path, NULL, 2, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS);
    pliant_error err = {""};
    pliant_model *model = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    s.model = model;
    const pliant_solver_def def = {.constraint_capacity = 8, .load_capacity = 8, .cache_count = 2};
    check_ok(pliant_solver_create(model, &def, &s.solver, &err), &err);
    check_ok(pliant_solver_create(model, &def, &s.viewer, &err), &err);
    check_ok(pliant_exchange_create(model, &def, &s.exchange, &err), &err);
    s.vertex = pliant_model_nearest(model, (const double[3]){1, 0, 0});
    assert_int_equal(pliant_model_is_free(model, s.vertex + 1), 1);
    assert_int_equal(
        pliant_solver_displace(s.solver, (pliant_node){2, s.vertex}, (pliant_vec3){1, 0, 0}),
        PLIANT_OK);
    assert_int_equal(pliant_solver_solve(s.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_surface(s.solver, 2, s.unit), PLIANT_OK);

    pthread_t threads[2];
    assert_int_equal(pthread_create(&threads[0], NULL, graphics, &s), 0);
    assert_int_equal(pthread_create(&threads[1], NULL, haptics, &s), 0);
    for (int k = 0; k < 2; k++) assert_int_equal(pthread_join(threads[k], NULL), 0);
    assert_int_equal(atomic_load(&s.failed), 0);
    printf("%d of %d solutions received\n", atomic_load(&s.received), step_count);
    check_at_least(atomic_load(&s.received), 2);
    pliant_exchange_destroy(s.exchange);
    pliant_solver_destroy(s.viewer);
    pliant_solver_destroy(s.solver);
    pliant_model_close(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_threads_hand_whole_solutions_over_in_order_and_the_last_one_arrives),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
