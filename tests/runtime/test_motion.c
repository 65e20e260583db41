// test_motion.c: no vertex goes further than the coefficients' bound, and that is not far off.
#include "check.h"

#include "motion.h"
#include "synthetic_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static double size_of(pliant_vec3 v)
{
    return sqrt((double)v.x * (double)v.x + (double)v.y * (double)v.y + (double)v.z * (double)v.z);
}

static void no_vertex_is_further_from_where_it_was(void **state)
{
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        const pliant_wavelet_def wavelet = {kind % 2 ? PLIANT_LINEAR : PLIANT_BUTTERFLY,
                                            kind / 2 ? PLIANT_UNLIFTED : PLIANT_LIFTED,
                                            PLIANT_ZERO};
        char path[64];
        snprintf(path, sizeof path, "/tmp/pliant_test_motion_%d.h5", (int)getpid());
        check_write_synthetic_levels(path, NULL, 2, 0.1, wavelet, CHECK_ALL_BLOCKS);
        pliant_error err = {""};
        pliant_model *model = NULL;
        pliant_solver *solver = NULL;
        check_ok(pliant_model_open(path, &model, &err), &err);
        unlink(path);
        check_ok(pliant_solver_create(model, NULL, &solver, &err), &err);
        pliant_arena arena = {0};
        pliant_motion motion = {0};
        pliant_motion_lay_out(&arena, solver, &motion);
        check_ok(pliant_arena_reserve(&arena, &err), &err);
        pliant_motion_lay_out(&arena, solver, &motion);
        pliant_motion_fill(model, &motion);

        const int32_t n = model->vertex_count;
        pliant_vec3 *now = calloc((size_t)n, sizeof *now), *then = calloc((size_t)n, sizeof *then);
        assert_true(now && then);
        check_random random = check_random_seed(1);
        double bound = 0, actual = 0;
        int32_t changes = 0, crude = 0;
        for (int step = 0; step < 300; step++) {
            // For a while fixed vertices are in it, too.
            const int is_mixed = step >= 150;
            const int32_t level = check_random_index(&random, 3);
            const pliant_node node = {
                level, check_random_index(&random, pliant_model_level_vertex_count(model, level))};
            const pliant_vec3 value = {(float)check_random_next(&random), 0.3f,
                                       -(float)check_random_next(&random)};
            const int32_t is_free = pliant_model_is_free(model, node.vertex);
            if (step % 50 == 49) pliant_solver_release_all(solver);
            else if (!is_free && !is_mixed) assert_true(pliant_solver_gravity(solver, value) >= 0);
            else if (step % 3 == 0) assert_true(pliant_solver_press(solver, node, value) >= 0);
            else if (is_free && step % 10 == 1)
                assert_true(pliant_solver_displace(solver, node, value) >= 0);
            else if (is_free && pliant_solver_last(solver).constraint_count > 0)
                assert_true(pliant_solver_displace(solver, solver->constraints[0].node, value) !=
                            PLIANT_ERR_CAPACITY);
            else if (!is_free) assert_true(pliant_solver_support(solver, node, value) >= 0);
            assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
            pliant_motion_update(&motion, solver);
            assert_int_equal(pliant_solver_surface(solver, 2, now), PLIANT_OK);
            double furthest = 0;
            for (int32_t v = 0; v < n; v++) {
                const pliant_vec3 way = {now[v].x - then[v].x, now[v].y - then[v].y,
                                         now[v].z - then[v].z};
                furthest = fmax(furthest, size_of(way));
            }
            memcpy(then, now, (size_t)n * sizeof *then);
            changes += !motion.is_same_set;
            crude += motion.fixed_size > 0;
            // Those that came into S or left it jump by what compression does.
            if (!motion.is_same_set) continue;
            check_at_most(furthest, motion.moved * (1 + 1e-5) + 1e-5);
            if (motion.fixed_size > 0) continue;
            bound += motion.moved;
            actual += furthest;
        }
        printf("wavelet %d: kappa %.2f %.2f %.2f; bounds are %.2f times the motion\n", kind,
               motion.kappa[0], motion.kappa[1], motion.kappa[2], bound / actual);
        check_at_least(changes, 20);
        check_at_least(crude, 20);
        check_at_least(actual, 1);
        check_at_most(bound, 5 * actual);
        free(now);
        free(then);
        pliant_arena_release(&arena);
        pliant_solver_destroy(solver);
        pliant_model_close(model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_vertex_is_further_from_where_it_was),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
