// test_dense.c: small dense matrices against LAPACK and the definitions.
#include "check.h"

#include "dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

extern void dsyev_(const char *jobz, const char *uplo, const int *n, double *a, const int *lda,
                   double *w, double *work, const int *lwork, int *info);

// Around the panel width, tile heights and lane counts.
static const int sizes[] = {1, 2, 3, 7, 8, 9, 16, 24, 30, 47, 48, 49, 95, 97, 131, 192};
enum { size_count = sizeof sizes / sizeof *sizes, limit = 192 };

typedef struct storage {
    double matrix[limit * limit], copy[limit * limit], work[4 * 48 * limit];
    float floats[limit * limit], x[limit], y[limit];
    int32_t pivots[limit];
} storage;

static storage *take_storage(void)
{
    storage *s = aligned_alloc(64, (sizeof(storage) + 63) / 64 * 64);
    assert_non_null(s);
    assert_true(2 * PLIANT_DENSE_PANEL * pliant_dense_stride(limit) <= 4 * 48 * limit);
    memset(s, 0, sizeof *s);
    return s;
}

static void fill(check_random *random, double *matrix, size_t n, size_t stride)
{
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < stride; i++)
            matrix[i + j * stride] = i < n ? 2 * check_random_next(random) - 1 : 0;
}

static void the_inverse_times_the_matrix_is_one(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    storage *s = take_storage();
    for (int k = 0; k < size_count; k++) {
        const size_t n = (size_t)sizes[k], stride = pliant_dense_stride(n);
        fill(&random, s->matrix, n, stride);
        s->matrix[0] = 0;  // so that the first pivot must be searched for
        if (n == 1) s->matrix[0] = -0.25;
        memcpy(s->copy, s->matrix, n * stride * sizeof(double));
        assert_true(pliant_dense_invert(n, stride, s->matrix, s->pivots, s->work) > 0);
        double largest = 0, size = 0;
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                double sum = i == j ? -1 : 0;
                for (size_t l = 0; l < n; l++)
                    sum += s->copy[i + l * stride] * s->matrix[l + j * stride];
                largest = fmax(largest, fabs(sum));
                size = fmax(size, fabs(s->matrix[i + j * stride]));
            }
        for (size_t j = 0; j < n; j++)
            for (size_t i = n; i < stride; i++) assert_true(s->matrix[i + j * stride] == 0);
        // |A X - I| <= c n u |A| |X| with |A| <= n and |X| <= n max; pivoting keeps c small, 10.
        check_at_most(largest, 10 * (double)n * 0x1p-53 * (double)n * (1 + size));
    }
    free(s);
}

static void a_singular_matrix_has_pivot_ratio_zero_or_round_off(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    storage *s = take_storage();
    for (int k = 1; k < size_count; k++) {
        const size_t n = (size_t)sizes[k], stride = pliant_dense_stride(n);
        fill(&random, s->matrix, n, stride);
        for (size_t i = 0; i < n; i++)
            s->matrix[i + (n - 1) * stride] = s->matrix[i];  // column twice
        check_at_most(pliant_dense_invert(n, stride, s->matrix, s->pivots, s->work),
                      (double)n * 0x1p-52);
        memset(s->matrix, 0, n * stride * sizeof(double));
        check_near(pliant_dense_invert(n, stride, s->matrix, s->pivots, s->work), 0, 0);
        fill(&random, s->matrix, n, stride);
        s->matrix[n / 2] = NAN;
        (void)pliant_dense_invert(n, stride, s->matrix, s->pivots, s->work);  // ends, that is all
    }
    free(s);
}

static void definiteness_is_the_sign_of_the_smallest_eigenvalue(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    storage *s = take_storage();
    double *half = malloc(limit * limit * sizeof *half);
    for (int k = 0; k < size_count; k++) {
        const int n = sizes[k];
        const size_t stride = pliant_dense_stride((size_t)n);
        fill(&random, half, (size_t)n, stride);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                s->copy[i + (size_t)j * n] =
                    (half[i + (size_t)j * stride] + half[j + (size_t)i * stride]) / 2;
        double *packed = malloc((size_t)n * n * sizeof *packed), values[limit], work[3 * limit];
        int info = 0;
        memcpy(packed, s->copy, (size_t)n * n * sizeof *packed);
        dsyev_("N", "L", &n, packed, &n, values, work, &(int){3 * limit}, &info);
        free(packed);
        assert_int_equal(info, 0);
        // Shift the smallest eigenvalue to just above and just below zero, by far more than n u
        // |A|.
        for (int sign = -1; sign <= 1; sign += 2) {
            memset(s->matrix, 0, (size_t)n * stride * sizeof(double));
            for (int j = 0; j < n; j++)
                for (int i = j; i < n; i++)
                    s->matrix[i + (size_t)j * stride] =
                        s->copy[i + (size_t)j * n] + (i == j ? sign * 1e-9 - values[0] : 0);
            assert_int_equal(pliant_dense_definite((size_t)n, stride, s->matrix, s->work),
                             sign > 0);
        }
        memset(s->matrix, 0, (size_t)n * stride * sizeof(double));
        for (int j = 0; j < n; j++) s->matrix[j + (size_t)j * stride] = j == n / 2 ? NAN : 1;
        assert_int_equal(pliant_dense_definite((size_t)n, stride, s->matrix, s->work), 0);
    }
    free(half);
    free(s);
}

static void a_sweep_in_slices_equals_the_inverse_and_refuses_what_is_not_definite(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    storage *s = take_storage();
    for (int k = 0; k < size_count; k++)
        for (int definite = 0; definite < 2; definite++) {
            const size_t n = (size_t)sizes[k], stride = pliant_dense_stride(n);
            fill(&random, s->matrix, n, stride);
            // A diagonal of one, elements of 1 / n: definite; then one pivot of -1/2.
            for (size_t j = 0; j < n; j++)
                for (size_t i = 0; i < n; i++)
                    s->matrix[i + j * stride] =
                        i == j ? 1 : s->matrix[i + j * stride] / (2 * (double)n);
            if (!definite) s->matrix[n / 2 + n / 2 * stride] = -0.5;
            memcpy(s->copy, s->matrix, n * stride * sizeof(double));
            pliant_dense_sweep sweep = {0};
            pliant_dense_progress progress = PLIANT_DENSE_MORE;
            size_t slices = 0;
            while (progress == PLIANT_DENSE_MORE) {
                progress =
                    pliant_dense_sweep_step(n, stride, s->matrix, 0.25, s->work, &sweep);
                memset(s->work, 0x7f, sizeof s->work);  // others use it between slices
                slices++;
            }
            if (!definite) {
                assert_int_equal(progress, PLIANT_DENSE_REFUSED);
                continue;
            }
            assert_int_equal(progress, PLIANT_DENSE_DONE);
            const size_t panels = (n + PLIANT_DENSE_PANEL - 1) / PLIANT_DENSE_PANEL;
            assert_int_equal(slices, panels * (panels + 1));
            assert_true(pliant_dense_invert(n, stride, s->copy, s->pivots, s->work) > 0);
            for (size_t i = 0; i < n * stride; i++)
                check_near(s->matrix[i], s->copy[i], 1e-14);  // elements of about one
        }
    free(s);
}

static void the_product_equals_the_sum(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    storage *s = take_storage();
    float *y = aligned_alloc(64, limit * sizeof *y);
    for (int k = 0; k < size_count; k++) {
        const size_t n = (size_t)sizes[k], stride = pliant_dense_stride(n);
        fill(&random, s->matrix, n, stride);
        float *matrix = aligned_alloc(64, n * stride * sizeof *matrix);
        for (size_t i = 0; i < n * stride; i++) matrix[i] = (float)s->matrix[i];
        for (size_t i = 0; i < n; i++) s->x[i] = (float)(2 * check_random_next(&random) - 1);
        pliant_dense_multiply(n, stride, matrix, s->x, y);
        for (size_t i = 0; i < n; i++) {
            double sum = 0;
            for (size_t j = 0; j < n; j++) sum += (double)matrix[i + j * stride] * (double)s->x[j];
            check_near(y[i], sum, (double)n * 2 * 0x1p-24 * sqrt((double)n));
        }
        free(matrix);
    }
    free(y);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_inverse_times_the_matrix_is_one),
        cmocka_unit_test(a_singular_matrix_has_pivot_ratio_zero_or_round_off),
        cmocka_unit_test(definiteness_is_the_sign_of_the_smallest_eigenvalue),
        cmocka_unit_test(a_sweep_in_slices_equals_the_inverse_and_refuses_what_is_not_definite),
        cmocka_unit_test(the_product_equals_the_sum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
