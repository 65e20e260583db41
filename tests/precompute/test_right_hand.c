// test_right_hand.c: columns solved for directly against the finest ones refined by hats (GF-60..62).
#include "check.h"

#include "bem/bem.h"
#include "dense_system.h"
#include "right_hand.h"

#include <math.h>
#include <petscsys.h>
#include <stdlib.h>
#include <string.h>

enum { batch = 64 };

static pliant_problem *pose(int32_t level)
{
    pliant_options options;
    pliant_options_action action;
    pliant_error err;
    char levels[8];
    snprintf(levels, sizeof levels, "%d", level);
    const char *argv[] = {"test", "scripts/sample/whale.obj", "--subdivide", "2", "--fixed", "z<0.03", "--young", "50000",
                          "-o", "none.h5", "--constraint-levels", levels};
    check_ok(pliant_options_parse((int)(sizeof argv / sizeof *argv), (char **)(uintptr_t)argv, &options, &action, &err), &err);
    pliant_progress silent = pliant_progress_create(NULL);
    pliant_problem *p = NULL;
    assert_int_equal(pliant_problem_create(PETSC_COMM_SELF, &options, &silent, &p, &err), 0);
    assert_int_equal(p->levels.first, level);
    assert_int_equal(p->levels.last, level);
    return p;
}

// The columns of the problem's level, all blocks: [3 columns][3n].
static double *solve(const pliant_problem *p, int32_t *columns)
{
    *columns = pliant_right_hand_count(p, PLIANT_BLOCKS_ALL);
    const int32_t n = p->vertex_count;
    const size_t rows = 3 * (size_t)n;
    pliant_dense_system *system = NULL;
    assert_int_equal(pliant_dense_system_create(PETSC_COMM_SELF, n, *columns, batch, &system), 0);
    const pliant_dense_rows to = pliant_dense_system_rows(system);
    assert_int_equal(to.row_end, n);
    double *B = calloc(rows * rows, sizeof *B);
    pliant_bem *bem = NULL;
    const pliant_material material = {50000, 0.3, 1};
    pliant_error err;
    check_ok(pliant_bem_create(p->multires->mesh, &material, &bem, &err), &err);
    check_ok(pliant_bem_assemble(bem, 0, n, p->held, to.A, to.ld_a, B, rows, to.gravity, to.ld_g, &err), &err);
    pliant_right_hand_contract(p, PLIANT_BLOCKS_ALL, (int32_t)rows, B, rows, to.right, to.ld_right);
    pliant_bem_destroy(bem);
    free(B);

    int singular;
    assert_int_equal(pliant_dense_system_factor(system, &singular), 0);
    assert_false(singular);
    double *x = calloc(3 * (size_t)*columns * rows, sizeof *x);
    for (int32_t first = 0; first < *columns; first += batch) {
        pliant_column_share share;
        const int32_t count = *columns - first < batch ? *columns - first : batch;
        assert_int_equal(pliant_dense_system_solve(system, first, count, &share), 0);
        assert_int_equal(share.end - share.begin, count);
        for (size_t j = 0; j < 3 * (size_t)count; j++)
            memcpy(x + (3 * (size_t)first + j) * rows, share.columns + j * share.ld, rows * sizeof *x);
    }
    assert_int_equal(pliant_dense_system_destroy(&system), 0);
    return x;
}

// Largest difference of direct columns from sums of fine ones, relative to each column's largest.
static double compare(const pliant_hats *hats, int32_t level, size_t rows, const double *fine,
                      const double *direct)
{
    double worst = 0, *sum = calloc(rows, sizeof *sum);
    for (int32_t k = 0; k < hats->level_offset[level + 1]; k++)
        for (int c = 0; c < 3; c++) {
            memset(sum, 0, rows * sizeof *sum);
            for (int32_t e = hats->offset[level][k]; e < hats->offset[level][k + 1]; e++) {
                const double *column = fine + (3 * (size_t)hats->position[level][e] + (size_t)c) * rows;
                for (size_t i = 0; i < rows; i++) sum[i] += hats->weight[level][e] * column[i];
            }
            const double *found = direct + (3 * (size_t)k + (size_t)c) * rows;
            double peak = 0, off = 0;
            for (size_t i = 0; i < rows; i++) peak = fmax(peak, fabs(sum[i])), off = fmax(off, fabs(sum[i] - found[i]));
            worst = fmax(worst, off / peak);
        }
    free(sum);
    return worst;
}

static void direct_columns_are_the_finest_ones_refined(void **state)
{
    (void)state;
    pliant_problem *finest = pose(2);
    const size_t rows = 3 * (size_t)finest->vertex_count;
    int32_t all;
    double *fine = solve(finest, &all);
    assert_int_equal(all, finest->vertex_count);
    for (int32_t level = 0; level < 2; level++) {
        pliant_problem *p = pose(level);
        int32_t columns;
        double *direct = solve(p, &columns);
        const int32_t free_columns = p->free_hats->level_offset[level + 1];
        assert_int_equal(columns, free_columns + p->fixed_hats->level_offset[level + 1]);
        assert_true(columns < all / 3);
        // The system's condition is under 1e5 here: solves are good to 1e-11.
        check_at_most(compare(p->free_hats, level, rows, fine, direct), 1e-10);
        check_at_most(compare(p->fixed_hats, level, rows, fine + 3 * (size_t)finest->free_count * rows,
                              direct + 3 * (size_t)free_columns * rows), 1e-10);
        free(direct);
        assert_int_equal(pliant_problem_destroy(&p), 0);
    }
    free(fine);
    assert_int_equal(pliant_problem_destroy(&finest), 0);
}

// Any split of the rows gives the same bits; on the finest level they are B's own.
static void rows_are_contracted_one_by_one(void **state)
{
    (void)state;
    for (int32_t level = 0; level < 3; level++) {
        pliant_problem *p = pose(level);
        const size_t n3 = 3 * (size_t)p->vertex_count;
        const int32_t columns = pliant_right_hand_count(p, PLIANT_BLOCKS_ALL);
        double *B = malloc(7 * n3 * sizeof *B);
        double *whole = calloc(21 * (size_t)columns, sizeof *whole), *parts = calloc(24 * (size_t)columns, sizeof *parts);
        check_random random = check_random_seed(3);
        for (size_t i = 0; i < 7 * n3; i++) B[i] = check_random_next(&random) - 0.5;
        pliant_right_hand_contract(p, PLIANT_BLOCKS_ALL, 7, B, 7, whole, 7);
        pliant_right_hand_contract(p, PLIANT_BLOCKS_ALL, 3, B, 7, parts, 8);
        pliant_right_hand_contract(p, PLIANT_BLOCKS_ALL, 4, B + 3, 7, parts + 3, 8);
        for (size_t j = 0; j < 3 * (size_t)columns; j++) {
            assert_memory_equal(whole + 7 * j, parts + 8 * j, 7 * sizeof *whole);
            check_near(parts[8 * j + 7], 0, 0);
        }
        for (int32_t j = 0; level == 2 && j < columns; j++) {
            const int32_t v = j < p->free_count ? p->free_nodes[j] : p->fixed_nodes[j - p->free_count];
            assert_memory_equal(whole + 21 * (size_t)j, B + 21 * (size_t)v, 21 * sizeof *whole);
        }
        // The free block alone has the free columns alone.
        assert_int_equal(pliant_right_hand_count(p, PLIANT_BLOCKS_FREE), p->free_hats->level_offset[level + 1]);
        free(parts), free(whole), free(B);
        assert_int_equal(pliant_problem_destroy(&p), 0);
    }
}

int main(void)
{
    if (PetscInitialize(NULL, NULL, NULL, NULL)) return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(direct_columns_are_the_finest_ones_refined),
        cmocka_unit_test(rows_are_contracted_one_by_one),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    PetscFinalize();
    return failed;
}
