// test_capacitance.c: extraction of C against the dense blocks, and types that compression spoilt.
#include "check.h"

#include "capacitance.h"
#include "synthetic_model.h"

#include "pliant/hierarchy.h"
#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static pliant_model *open_written(const check_synthetic *s)
{
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_capacitance_%d.h5", (int)getpid());
    check_synthetic_write(s, path);
    pliant_model *model = NULL;
    pliant_error err = {""};
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    return model;
}

static void extracted_elements_equal_the_reconstructed_matrices(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    for (int kind = 0; kind < 8; kind++) {
        const pliant_wavelet_def wavelet = {(pliant_wavelet_scheme)(kind & 1),
                                            (pliant_wavelet_lifting)(kind >> 1 & 1),
                                            (pliant_wavelet_boundary)(kind >> 2)};
        check_synthetic *s =
            check_synthetic_create(&(check_synthetic_def){2, 0.05, wavelet, CHECK_ALL_BLOCKS, 0});
        pliant_model *model = open_written(s);
        check_synthetic_round(s);
        enum { capacity = 30 };
        pliant_arena arena = {0};
        pliant_capacitance capacitance = {0};
        pliant_capacitance_scratch scratch = {0};
        pliant_error err = {""};
        for (int pass = 0; pass < 2; pass++) {
            if (pass) check_ok(pliant_arena_reserve(&arena, &err), &err);
            pliant_capacitance_lay_out(&arena, model, capacity, &capacitance);
            pliant_capacitance_scratch_lay_out(&arena, model, capacity, &scratch);
        }
        pliant_capacitance_scratch_begin(model, PLIANT_COMPLIANCE_STORED, &scratch);
        for (int32_t count = 1; count <= capacity; count += 7) {
            int32_t vertices[capacity];
            pliant_node nodes[capacity];
            for (int32_t i = 0; i < count; i++) {
                vertices[i] = (i * 160) / count + check_random_index(&random, 160 / count);
                nodes[i] = (pliant_node){2, vertices[i]};
            }
            pliant_capacitance_plan(model, nodes, count, &scratch, &capacitance);
            pliant_capacitance_extract(model, &capacitance, &scratch, capacitance.matrix);
            double largest[4] = {0}, worst[4] = {0};
            for (int32_t i = 0; i < count; i++)
                for (int32_t j = 0; j < count; j++) {
                    const int32_t rd = model->domain[vertices[i]], cd = model->domain[vertices[j]];
                    const size_t width = 3 * (size_t)s->counts[cd];
                    for (size_t r = 0; r < 3; r++)
                        for (size_t c = 0; c < 3; c++) {
                            const double expected =
                                s->xi[2 * rd + cd]
                                     [(3 * (size_t)model->position[vertices[i]] + r) * width +
                                      3 * (size_t)model->position[vertices[j]] + c];
                            const double found =
                                capacitance.matrix[3 * (size_t)i + r +
                                                   (3 * (size_t)j + c) * capacitance.leading];
                            largest[2 * rd + cd] = fmax(largest[2 * rd + cd], fabs(expected));
                            worst[2 * rd + cd] = fmax(worst[2 * rd + cd], fabs(found - expected));
                        }
                }
            // Float sums of some hundred coefficients: 30 u of the largest element of a block.
            for (int b = 0; b < 4; b++) check_at_most(worst[b], 30 * 0x1p-24 * largest[b]);
        }
        pliant_arena_release(&arena);
        pliant_model_close(model);
        check_synthetic_destroy(s);
    }
}

// Change one column's stored blocks by a factor, put a patch around it, and look.
static void check_spoilt(float factor, pliant_status expected)
{
    check_synthetic *s = check_synthetic_create(
        &(check_synthetic_def){2, 0.02, pliant_wavelet_default(), CHECK_FREE_BLOCK, 0});
    check_compressed *columns = &s->compressed[PLIANT_FREE_FREE];
    const int32_t spoilt = 70;
    for (uint64_t e = 9 * columns->column_offset[spoilt];
         e < 9 * columns->column_offset[spoilt + 1]; e++)
        columns->block[e] *= factor;
    pliant_model *model = open_written(s);
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    check_ok(pliant_solver_create(model, NULL, &solver, &err), &err);
    const pliant_vec3 down = {0, 0.02f, -0.1f};
    for (int32_t k = 0; k < 5; k++)
        assert_int_equal(
            pliant_solver_displace(solver, (pliant_node){2, s->nodes[0][spoilt - 2 + k]}, down),
            PLIANT_OK);
    for (int round = 0; round < 2; round++) {  // built, and from the cache
        pliant_vec3 u[162], p[162];
        int32_t count = s->counts[0];
        assert_int_equal(pliant_solver_solve(solver, PLIANT_NEVER), expected);
        assert_int_equal(pliant_solver_last(solver).factored, round == 0);
        assert_int_equal(pliant_solver_surface(solver, 2, u), PLIANT_OK);
        assert_int_equal(pliant_solver_tractions(solver, s->nodes[0], count, p), PLIANT_OK);
        for (int32_t v = 0; v < 162; v++)
            assert_true(isfinite(u[v].x) && isfinite(u[v].y) && isfinite(u[v].z));
        for (int32_t i = 0; i < count; i++)
            assert_true(isfinite(p[i].x) && isfinite(p[i].y) && isfinite(p[i].z));
        for (int32_t k = 0; k < 5; k++)
            assert_memory_equal(&u[s->nodes[0][spoilt - 2 + k]], &down, sizeof down);
        // A sound patch takes 0.33 to be pushed down; one singular column of five leaves that size.
        const double force = -(double)pliant_solver_contact_force(solver).z;
        assert_true(isfinite(force));
        if (factor == 0 || factor == 1) {
            check_at_least(force, 0.1);
            check_at_most(force, 3);
        }
    }
    // A patch without the spoilt column is sound.
    assert_int_equal(pliant_solver_release(solver, (pliant_node){2, s->nodes[0][spoilt]}),
                     PLIANT_OK);
    assert_int_equal(pliant_solver_solve(solver, PLIANT_NEVER), PLIANT_OK);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
    check_synthetic_destroy(s);
}

static void a_sound_patch_is_not_rough(void **state)
{
    (void)state;
    check_spoilt(1, PLIANT_OK);
}

static void an_indefinite_patch_is_rough_and_finite(void **state)
{
    (void)state;
    check_spoilt(-1, PLIANT_ROUGH);
    check_spoilt(-1e-3f, PLIANT_ROUGH);
}

static void a_singular_patch_is_rough_and_finite(void **state)
{
    (void)state;
    check_spoilt(0, PLIANT_ROUGH);
    check_spoilt(1e-30f, PLIANT_ROUGH);
}

static void a_patch_with_one_absurdly_large_column_is_rough_and_finite(void **state)
{
    (void)state;
    check_spoilt(1e15f, PLIANT_ROUGH);
}

// Every vertex with its own level's hat, at random within some distance of each other: as far from
// reciprocal as elements between levels get. Nothing is compressed, so nothing is spoilt.
static void mixed_sets_of_an_exact_matrix_are_not_rough(void **state)
{
    (void)state;
    enum { n = 642 };
    const uint32_t all_levels = 15;
    check_synthetic *s = check_synthetic_create(
        &(check_synthetic_def){3, 0, pliant_wavelet_default(), CHECK_FREE_BLOCK, all_levels});
    pliant_model *model = open_written(s);
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    const pliant_solver_def def = {
        .constraint_capacity = 150, .load_capacity = 1, .cache_count = 1};
    check_ok(pliant_solver_create(model, &def, &solver, &err), &err);
    const double *x = pliant_model_positions(model);
    check_random random = check_random_seed(3);
    int32_t mixed = 0;
    for (int trial = 0; trial < 60; trial++) {
        const int32_t centre = check_random_index(&random, n);
        const double radius = 0.3 + 0.5 * check_random_next(&random);
        const double part = check_random_next(&random);
        int32_t used[4] = {0};
        pliant_solver_release_all(solver);
        for (int32_t v = 0; v < n; v++) {
            double square = 0;
            for (int c = 0; c < 3; c++) {
                const double d = x[3 * (size_t)v + (size_t)c] - x[3 * (size_t)centre + (size_t)c];
                square += d * d;
            }
            if (square > radius * radius || check_random_next(&random) > part ||
                pliant_model_is_free(model, v) != 1)
                continue;
            const int32_t level = pliant_hierarchy_level_of(s->hierarchy, v);
            const pliant_vec3 down = {0, 0, -0.1f};
            if (pliant_solver_displace(solver, (pliant_node){level, v}, down) >= 0) used[level]++;
        }
        assert_int_equal(pliant_solver_solve(solver, PLIANT_NEVER), PLIANT_OK);
        mixed += (used[0] > 0) + (used[1] > 0) + (used[2] > 0) + (used[3] > 0) >= 3;
    }
    check_at_least(mixed, 30);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
    check_synthetic_destroy(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(extracted_elements_equal_the_reconstructed_matrices),
        cmocka_unit_test(a_sound_patch_is_not_rough),
        cmocka_unit_test(an_indefinite_patch_is_rough_and_finite),
        cmocka_unit_test(a_singular_patch_is_rough_and_finite),
        cmocka_unit_test(a_patch_with_one_absurdly_large_column_is_rough_and_finite),
        cmocka_unit_test(mixed_sets_of_an_exact_matrix_are_not_rough),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
