// test_lanczos.c: extreme eigenvalues of operators whose eigenvalues are known.
#include "check.h"

#include "pliant/lanczos.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A diagonal behind a reflection (Householder), which mixes all coordinates and keeps eigenvalues.
typedef struct spectrum {
    int32_t n;
    const double *values;
    double *mirror;  // unit vector
    int32_t applied;
} spectrum;

static void reflect(const spectrum *s, double *x)
{
    double dot = 0;
    for (int32_t i = 0; i < s->n; i++) dot += s->mirror[i] * x[i];
    for (int32_t i = 0; i < s->n; i++) x[i] -= 2 * dot * s->mirror[i];
}

static void apply_spectrum(void *context, double *x, double *y)
{
    spectrum *s = context;
    s->applied++;
    memcpy(y, x, (size_t)s->n * sizeof *y);
    memset(x, 0x7f, (size_t)s->n * sizeof *x);  // allowed
    reflect(s, y);
    for (int32_t i = 0; i < s->n; i++) y[i] *= s->values[i];
    reflect(s, y);
}

static pliant_lanczos_result solve(const double *values, int32_t n, double tolerance, int32_t steps)
{
    spectrum s = {.n = n, .values = values, .mirror = malloc((size_t)n * sizeof *s.mirror)};
    double square = 0;
    check_random random = check_random_seed(7);
    for (int32_t i = 0; i < n; i++) {
        s.mirror[i] = check_random_next(&random) - 0.5;
        square += s.mirror[i] * s.mirror[i];
    }
    for (int32_t i = 0; i < n; i++) s.mirror[i] /= sqrt(square);
    const pliant_lanczos_def def = {n, apply_spectrum, &s, tolerance, steps};
    pliant_lanczos_result result;
    pliant_error err;
    check_ok(pliant_lanczos_extremes(&def, &result, &err), &err);
    assert_int_equal(s.applied, result.steps);
    free(s.mirror);
    return result;
}

static void check_found(const pliant_lanczos_result *r, double smallest, double largest, double tolerance)
{
    check_near(r->smallest, smallest, tolerance);
    check_near(r->largest, largest, tolerance);
    check_at_most(r->smallest_residual, tolerance);
    check_at_most(r->largest_residual, tolerance);
}

// Of a tiny spectrum the polynomials of Lanczos see all there is.
static void few_distinct_eigenvalues_are_found_in_as_many_steps(void **state)
{
    (void)state;
    const double one[1] = {-3.5};
    pliant_lanczos_result r = solve(one, 1, 1e-10, 50);
    check_found(&r, -3.5, -3.5, 1e-14);
    assert_int_equal(r.steps, 1);
    double same[40], two[40], three[40];
    for (int i = 0; i < 40; i++) same[i] = 2, two[i] = i % 2 ? 5 : -1, three[i] = i % 3 - 1;
    r = solve(same, 40, 1e-10, 50);
    check_found(&r, 2, 2, 1e-12);
    r = solve(two, 40, 1e-10, 50);
    check_found(&r, -1, 5, 1e-12);
    r = solve(three, 40, 1e-10, 50);
    check_found(&r, -1, 1, 1e-12);
    assert_in_range(r.steps, 3, 16);
}

// As the contact compliance of a solid: few large ones, a dense crowd at the low end.
static void smallest_of_a_crowd_beside_large_ones_is_found(void **state)
{
    (void)state;
    enum { n = 3000 };
    static double values[n];
    for (int32_t i = 0; i < n; i++) values[i] = 0.05 + 500 * pow(1 + i, -1.2);
    pliant_lanczos_result r = solve(values, n, 1e-4, 6000);
    // The crowd's end is found to the residual asked for and not below.
    check_found(&r, values[n - 1], values[0], 1e-4);
    assert_true(r.smallest >= values[n - 1] - 1e-9);
    assert_true(r.steps < 6000);
    // One negative direction, far from the crowd, comes quickly.
    values[n - 1] = -0.7;
    r = solve(values, n, 1e-4, 4000);
    check_found(&r, -0.7, values[0], 1e-4);
    assert_true(r.steps < 300);
}

// 2 - 2 cos(i pi / (n + 1)) of the second difference: the extreme ones lie close together.
static void apply_difference(void *context, double *x, double *y)
{
    const int32_t n = *(const int32_t *)context;
    for (int32_t i = 0; i < n; i++) y[i] = 2 * x[i] - (i > 0 ? x[i - 1] : 0) - (i + 1 < n ? x[i + 1] : 0);
}

static void the_second_differences_spectrum_is_bounded_to_rounding(void **state)
{
    (void)state;
    int32_t n = 200;
    const pliant_lanczos_def def = {n, apply_difference, &n, 1e-8, 5000};
    pliant_lanczos_result r;
    pliant_error err;
    check_ok(pliant_lanczos_extremes(&def, &r, &err), &err);
    const double angle = acos(-1.0) / (n + 1);
    // More steps than rows: lost orthogonality makes copies, and no wrong ends. An eigenvalue is off by
    // the residual's square over the gap to the next, 7e-4 here.
    check_found(&r, 2 - 2 * cos(angle), 2 + 2 * cos(angle), 1e-8);
    check_near(r.smallest, 2 - 2 * cos(angle), 1e-12);
    assert_true(r.steps > n);
}

static void a_bound_on_steps_returns_what_there_is_with_its_residual(void **state)
{
    (void)state;
    static double values[500];
    for (int32_t i = 0; i < 500; i++) values[i] = 1 + i * i / 500.0;
    const pliant_lanczos_result r = solve(values, 500, 1e-12, 20);
    assert_int_equal(r.steps, 20);
    // Inside the spectrum, and an eigenvalue within the residual.
    assert_true(r.smallest >= 1 && r.largest <= values[499] + 1e-9);
    double nearest = INFINITY;
    for (int32_t i = 0; i < 500; i++) nearest = fmin(nearest, fabs(values[i] - r.smallest));
    check_at_most(nearest, r.smallest_residual + 1e-9);
    assert_true(r.smallest_residual > 1e-12);
}

static void runs_agree_to_the_bit(void **state)
{
    (void)state;
    static double values[300];
    for (int32_t i = 0; i < 300; i++) values[i] = sin(i);
    const pliant_lanczos_result a = solve(values, 300, 1e-6, 400), b = solve(values, 300, 1e-6, 400);
    assert_memory_equal(&a.smallest, &b.smallest, sizeof a.smallest);
    assert_memory_equal(&a.largest, &b.largest, sizeof a.largest);
    assert_int_equal(a.steps, b.steps);
}

static void apply_nan(void *context, double *x, double *y)
{
    (void)context;
    y[0] = NAN + x[0];
    y[1] = 0;
}

static void operators_without_rows_or_finite_numbers_are_refused(void **state)
{
    (void)state;
    pliant_lanczos_def def = {0, apply_nan, NULL, 1e-6, 10};
    pliant_lanczos_result r;
    pliant_error err;
    assert_int_equal(pliant_lanczos_extremes(&def, &r, &err), PLIANT_ERR_ARGUMENT);
    def.n = 2;
    assert_int_equal(pliant_lanczos_extremes(&def, &r, &err), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "finite"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(few_distinct_eigenvalues_are_found_in_as_many_steps),
        cmocka_unit_test(smallest_of_a_crowd_beside_large_ones_is_found),
        cmocka_unit_test(the_second_differences_spectrum_is_bounded_to_rounding),
        cmocka_unit_test(a_bound_on_steps_returns_what_there_is_with_its_residual),
        cmocka_unit_test(runs_agree_to_the_bit),
        cmocka_unit_test(operators_without_rows_or_finite_numbers_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
