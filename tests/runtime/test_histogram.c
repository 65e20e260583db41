// test_histogram.c: percentiles of durations from fixed memory.
#include "check.h"

#include "histogram.h"

#include <math.h>
#include <stdlib.h>

static int ascending(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static pliant_histogram *create(void)
{
    pliant_histogram *h = calloc(1, sizeof *h);
    assert_non_null(h);
    return h;
}

static void an_empty_histogram_says_zero(void **state)
{
    (void)state;
    pliant_histogram *h = create();
    check_near(pliant_histogram_percentile(h, 0.5), 0, 0);
    check_near(pliant_histogram_percentile(h, 1), 0, 0);
    free(h);
}

static void percentiles_are_those_of_sorting_within_half_a_bucket(void **state)
{
    (void)state;
    // Log-uniform over 1 ns .. 100 s, so that every power of two takes part.
    enum { COUNT = 20001 };
    static int64_t values[COUNT];
    check_random random = check_random_seed(11);
    pliant_histogram *h = create();
    for (int i = 0; i < COUNT; i++) {
        values[i] = (int64_t)exp(check_random_next(&random) * log(1e11));
        pliant_histogram_add(h, values[i]);
    }
    qsort(values, COUNT, sizeof *values, ascending);
    const double ranks[] = {1e-4, 0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999};
    for (size_t r = 0; r < sizeof ranks / sizeof *ranks; r++) {
        const double exact = (double)values[(int)ceil(ranks[r] * COUNT) - 1];
        // Half a bucket of 128 to the power of two: at most 1/256 of the value.
        check_near(pliant_histogram_percentile(h, ranks[r]), exact, exact / 256);
    }
    check_near(pliant_histogram_percentile(h, 1), (double)values[COUNT - 1], 0);
    free(h);
}

static void small_and_extreme_durations_are_kept(void **state)
{
    (void)state;
    const int64_t values[] = {0, 1, 127, 128, 129, 255, 256, INT64_MAX};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        pliant_histogram *h = create();
        pliant_histogram_add(h, values[i]);
        pliant_histogram_add(h, INT64_MAX);
        const double exact = (double)values[i];
        check_near(pliant_histogram_percentile(h, 0.5), exact, exact < 256 ? 0 : exact / 256);
        free(h);
    }
    pliant_histogram *h = create();
    pliant_histogram_add(h, -5);
    check_near(pliant_histogram_percentile(h, 0.5), 0, 0);
    free(h);
}

static void merging_is_adding_all(void **state)
{
    (void)state;
    pliant_histogram *a = create(), *b = create(), *all = create();
    check_random random = check_random_seed(12);
    for (int i = 0; i < 1000; i++) {
        const int64_t value = (int64_t)(1e6 * check_random_next(&random));
        pliant_histogram_add(i % 3 ? a : b, value);
        pliant_histogram_add(all, value);
    }
    pliant_histogram_add(b, 2000000);  // the worst of both
    pliant_histogram_add(all, 2000000);
    pliant_histogram_merge(a, b);
    assert_int_equal(a->count, all->count);
    assert_int_equal(a->worst, all->worst);
    check_near(a->sum, all->sum, 1e-15 * 1000 * all->sum);
    assert_memory_equal(a->buckets, all->buckets, sizeof a->buckets);
    free(a);
    free(b);
    free(all);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_histogram_says_zero),
        cmocka_unit_test(percentiles_are_those_of_sorting_within_half_a_bucket),
        cmocka_unit_test(small_and_extreme_durations_are_kept),
        cmocka_unit_test(merging_is_adding_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
