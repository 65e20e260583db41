// test_bordering.c: bordered inverses against inverses made from scratch.
#include "check.h"

#include "bordering.h"
#include "dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { capacity = 40, size = 3 * capacity };

typedef struct growing {
    size_t n, leading;
    double *matrix, *inverse, *work, *scratch;
    int32_t *pivots;
} growing;

static void *aligned(size_t count)
{
    double *memory = aligned_alloc(64, (count * sizeof *memory + 63) / 64 * 64);
    assert_non_null(memory);
    memset(memory, 0, count * sizeof *memory);
    return memory;
}

static growing begin(void)
{
    growing g = {.leading = pliant_dense_leading(size)};
    g.matrix = aligned(size * g.leading);
    g.inverse = aligned(size * g.leading);
    g.scratch = aligned(size * g.leading);
    g.work = aligned(12 * g.leading + pliant_dense_work_count(size));
    g.pivots = calloc(size, sizeof *g.pivots);
    assert_non_null(g.pivots);
    return g;
}

static void end(growing *g)
{
    free(g->matrix), free(g->inverse), free(g->scratch), free(g->work), free(g->pivots);
}

// Three rows and columns of a matrix whose symmetric part is definite: diagonally dominant, of size
// one, with a skew part.
static void grow_matrix(growing *g, check_random *random)
{
    for (size_t c = g->n; c < g->n + 3; c++)
        for (size_t i = 0; i < g->n + 3; i++) {
            const double x = (check_random_next(random) - 0.5) / size;
            const double skew = 0.2 * (check_random_next(random) - 0.5) / size;
            g->matrix[i + c * g->leading] = i == c ? 1 : x + skew;
            if (i != c) g->matrix[c + i * g->leading] = x - skew;
        }
}

static int32_t append(growing *g, double least)
{
    double *rows = g->work + 12 * g->leading, corner[9];
    memset(rows, 0, 3 * g->leading * sizeof *rows);
    for (size_t r = 0; r < 3; r++) {
        for (size_t j = 0; j < g->n; j++)
            rows[j + r * g->leading] = g->matrix[g->n + r + j * g->leading];
        for (size_t c = 0; c < 3; c++)
            corner[3 * r + c] = g->matrix[g->n + r + (g->n + c) * g->leading];
    }
    return pliant_bordering_append(g->n, g->leading, g->inverse, g->matrix + g->n * g->leading,
                                   rows, corner, least, g->work);
}

// Largest difference to the inverse from scratch.
static double miss(growing *g)
{
    memcpy(g->scratch, g->matrix, g->n * g->leading * sizeof *g->scratch);
    assert_true(pliant_dense_invert(g->n, g->leading, g->scratch, g->pivots, g->work) > 0);
    double worst = 0;
    for (size_t j = 0; j < g->n; j++) {
        for (size_t i = 0; i < g->n; i++)
            worst = fmax(worst, fabs(g->scratch[i + j * g->leading] -
                                     g->inverse[i + j * g->leading]));
        // What kernels read behind the last row stays zero.
        for (size_t i = g->n; i < pliant_dense_stride(g->n); i++)
            assert_true(g->inverse[i + j * g->leading] == 0);
    }
    return worst;
}

static void ten_thousand_changes_leave_the_inverse_to_round_off(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    growing g = begin();
    double worst = 0;
    for (int step = 0; step < 10000; step++) {
        if (g.n == 0 || (g.n < size && check_random_next(&random) < 0.5)) {
            grow_matrix(&g, &random);
            assert_true(append(&g, 0));
            g.n += 3;
        } else {
            const size_t at = 3 * (size_t)(check_random_next(&random) * (double)(g.n / 3));
            assert_true(pliant_bordering_remove(g.n, g.leading, g.inverse, at, g.work));
            pliant_bordering_move_last(g.n, g.leading, g.matrix, at);
            g.n -= 3;
        }
        if (step % 50 == 0) worst = fmax(worst, miss(&g));
    }
    // Well conditioned matrices, 120 rows at most: each change rounds by some n u, and removing
    // forgets as much as appending adds.
    check_at_most(worst, 1e-12);
    end(&g);
}

static void a_border_that_costs_definiteness_is_refused_without_effect(void **state)
{
    (void)state;
    check_random random = check_random_seed(6);
    growing g = begin();
    for (int k = 0; k < 5; k++) {
        grow_matrix(&g, &random);
        assert_true(append(&g, 0.5));
        g.n += 3;
    }
    grow_matrix(&g, &random);
    // The new node equals an old one but for a sign.
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < g.n; i++) {
            g.matrix[i + (g.n + c) * g.leading] = g.matrix[i + (3 + c) * g.leading];
            g.matrix[g.n + c + i * g.leading] = g.matrix[3 + c + i * g.leading];
        }
    for (size_t c = 0; c < 3; c++) g.matrix[g.n + c + (g.n + c) * g.leading] = 0.9;
    memcpy(g.scratch, g.inverse, size * g.leading * sizeof *g.scratch);
    assert_int_equal(append(&g, 0), 0);
    assert_memory_equal(g.scratch, g.inverse, size * g.leading * sizeof *g.scratch);
    end(&g);
}

static void a_singular_block_cannot_be_removed(void **state)
{
    (void)state;
    growing g = begin();
    g.n = 6;
    // The inverse of [0 I; I 0] is itself: without its first rows and columns nothing is left.
    for (size_t k = 0; k < 3; k++)
        g.inverse[k + (k + 3) * g.leading] = g.inverse[k + 3 + k * g.leading] = 1;
    memcpy(g.scratch, g.inverse, size * g.leading * sizeof *g.scratch);
    assert_int_equal(pliant_bordering_remove(6, g.leading, g.inverse, 0, g.work), 0);
    assert_memory_equal(g.scratch, g.inverse, size * g.leading * sizeof *g.scratch);
    end(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_thousand_changes_leave_the_inverse_to_round_off),
        cmocka_unit_test(a_border_that_costs_definiteness_is_refused_without_effect),
        cmocka_unit_test(a_singular_block_cannot_be_removed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
