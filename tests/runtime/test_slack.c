// test_slack.c: where a node would go if it were let go, against letting it go.
#include "check.h"

#include "solver.h"
#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <unistd.h>

static void slack_is_where_a_node_goes_when_it_is_released(void **state)
{
    (void)state;
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_slack_%d.h5", (int)getpid());
    check_write_synthetic_levels(path, NULL, 2, 0.02, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    check_ok(pliant_solver_create(model, NULL, &solver, &err), &err);
    check_random random = check_random_seed(1);
    const int32_t n = pliant_model_describe(model).vertex_count;
    double largest = 0;
    for (int trial = 0; trial < 100; trial++) {
        pliant_solver_release_all(solver);
        // A load beside the constraints, which the slack has to know of.
        assert_int_equal(pliant_solver_gravity(solver, (pliant_vec3){0, 0, -0.1f}), PLIANT_OK);
        for (int i = 0; i < 12; i++) {
            const int32_t v = check_random_index(&random, n);
            if (pliant_model_is_free(model, v) != 1) continue;
            const int32_t level = v < 12 ? check_random_index(&random, 3) : v < 42 ? 1 + v % 2 : 2;
            const pliant_vec3 u = {0.1f * (float)check_random_next(&random), 0,
                                   -0.1f * (float)check_random_next(&random)};
            assert_int_equal(pliant_solver_displace(solver, (pliant_node){level, v}, u), PLIANT_OK);
        }
        assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
        if (solver->solved_count == 0) continue;
        const int32_t member = check_random_index(&random, solver->solved_count);
        const pliant_node node = solver->solved[member].node;
        pliant_vec3 predicted, found;
        assert_int_equal(pliant_solver_slack(solver, member, &predicted), 1);
        assert_int_equal(pliant_solver_release(solver, node), PLIANT_OK);
        assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
        assert_int_equal(pliant_solver_displacements(solver, &node.vertex, 1, &found), PLIANT_OK);
        // C^-1 is kept in floats: some condition numbers (up to 100) times 2^-24 of 0.1.
        check_near(predicted.x, found.x, 1e-5);
        check_near(predicted.y, found.y, 1e-5);
        check_near(predicted.z, found.z, 1e-5);
        largest = fmax(largest, fabs((double)found.z));
    }
    check_at_least(largest, 0.02);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slack_is_where_a_node_goes_when_it_is_released),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
