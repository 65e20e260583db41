// test_bem_triangle_rule.c: quadrature rules on the triangle.
#include "check.h"

#include "bem/triangle_rule.h"

#include <math.h>

static double factorial(int n)
{
    return n < 2 ? 1 : n * factorial(n - 1);
}

// Largest error over the monomials b0^i b1^j of exactly that degree: the mean over the triangle is
// 2 i! j! / (i + j + 2)!.
static double worst_error(const pliant_triangle_rule *rule, int degree)
{
    double worst = 0;
    for (int i = 0; i <= degree; i++) {
        double sum = 0;
        for (int q = 0; q < rule->point_count; q++)
            sum +=
                rule->weights[q] * pow(rule->points[q][0], i) * pow(rule->points[q][1], degree - i);
        const double mean = 2 * factorial(i) * factorial(degree - i) / factorial(degree + 2);
        worst = fmax(worst, fabs(sum - mean));
    }
    return worst;
}

// The tables of degree 8 have 15 digits; sums of up to 16 terms at most 1.
static void rules_are_exact_to_their_degree_and_no_further(void **state)
{
    (void)state;
    static const int degrees[] = {3, 5, 8};
    for (int d = 0; d < 3; d++) {
        const pliant_triangle_rule *rule = pliant_triangle_rule_of_degree(degrees[d]);
        assert_non_null(rule);
        assert_int_equal(rule->degree, degrees[d]);
        for (int degree = 0; degree <= rule->degree; degree++)
            check_at_most(worst_error(rule, degree), 4e-15);
        check_at_least(worst_error(rule, rule->degree + 1), 1e-8);
    }
}

static void points_are_barycentric_inside_and_turn_into_each_other(void **state)
{
    (void)state;
    static const int degrees[] = {3, 5, 8};
    for (int d = 0; d < 3; d++) {
        const pliant_triangle_rule *rule = pliant_triangle_rule_of_degree(degrees[d]);
        for (int q = 0; q < rule->point_count; q++) {
            const double *b = rule->points[q];
            check_near(b[0] + b[1] + b[2], 1, 3e-15);
            for (int k = 0; k < 3; k++) check_at_least(b[k], 0);
        }
        // far_field.c takes an orbit's point k as the one of corner k.
        for (int k = 0; k < 3; k++) {
            assert_true(rule->points[1 + k][k] == rule->points[1][0]);
            assert_true(rule->points[1 + k][(k + 1) % 3] == rule->points[1][1]);
            assert_true(rule->weights[1 + k] == rule->weights[1]);
        }
    }
}

static void other_degrees_have_no_rule(void **state)
{
    (void)state;
    assert_null(pliant_triangle_rule_of_degree(-1));
    assert_null(pliant_triangle_rule_of_degree(7));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rules_are_exact_to_their_degree_and_no_further),
        cmocka_unit_test(points_are_barycentric_inside_and_turn_into_each_other),
        cmocka_unit_test(other_degrees_have_no_rule),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
