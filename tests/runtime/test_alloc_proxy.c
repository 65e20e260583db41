// test_alloc_proxy.c: haptic steps, publishing and receiving allocate nothing.
#include "allocations.h"
#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <unistd.h>

static void steps_of_all_kinds_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_alloc_proxy_%d.h5", (int)getpid());
    check_write_synthetic_levels(path, NULL, 3, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS);
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_solver *solver = NULL, *viewer = NULL;
    pliant_proxy *proxy = NULL;
    pliant_exchange *exchange = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    pliant_solver_def def = pliant_solver_default(model);
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    check_ok(pliant_solver_create(model, &def, &solver, &err), &err);
    check_ok(pliant_solver_create(model, &def, &viewer, &err), &err);
    check_ok(pliant_proxy_create(solver, NULL, &proxy, &err), &err);
    check_ok(pliant_exchange_create(model, &def, &exchange, &err), &err);
    const int32_t n = pliant_model_describe(model).vertex_count;
    static pliant_vec3 u[1000];
    assert_in_range(n, 1, 1000);
    check_random random = check_random_seed(1);
    int32_t touching = 0, free_steps = 0, received = 0;
    const long before = atomic_load(&calls);
    for (int step = 0; step < 2000; step++) {
        if (step % 10 == 0) {
            const pliant_node node = {3, check_random_index(&random, n)};
            const pliant_vec3 small = {0.02f, 0, 0.01f};
            if (pliant_model_is_free(model, node.vertex))
                assert_true(pliant_solver_displace(solver, node, small) != PLIANT_ERR_ARGUMENT);
        }
        if (step % 250 == 0) pliant_solver_release_all(solver);
        const double t = 0.01 * step, radius = 0.95 + 0.2 * sin(3 * t);
        const double device[3] = {radius * cos(t), radius * sin(t), 0.2};
        pliant_proxy_result r;
        const int64_t deadline = step % 3 ? PLIANT_NEVER : pliant_clock_ns() + 20000;
        assert_true(pliant_proxy_step(proxy, device, deadline, &r) >= 0);
        touching += r.face >= 0;
        free_steps += r.face < 0;
        if (step % 500 == 499) assert_int_equal(pliant_proxy_place(proxy, device), PLIANT_OK);
        assert_int_equal(pliant_solver_publish(solver, exchange), PLIANT_OK);
        if (step % 16) continue;
        received += pliant_solver_receive(viewer, exchange);
        assert_int_equal(pliant_solver_surface(viewer, 3, u), PLIANT_OK);
    }
    assert_int_equal(atomic_load(&calls) - before, 0);
    check_at_least(touching, 500);
    check_at_least(free_steps, 500);
    assert_int_equal(received, 125);
    pliant_exchange_destroy(exchange);
    pliant_proxy_destroy(proxy);
    pliant_solver_destroy(viewer);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(steps_of_all_kinds_allocate_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
