// test_bem_integrals.c: the element integrals, fast against slow.
#include "check.h"

#include "bem/far_field.h"
#include "bem/near_integral.h"
#include "bem/singular_integral.h"
#include "bem/triangle_rule.h"
#include "bem_reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static pliant_kelvin_constants constants_of(const pliant_material *material)
{
    return (pliant_kelvin_constants){.diagonal = 3 - 4 * material->poisson,
                                     .shear = 1 - 2 * material->poisson};
}

// Largest difference of the blocks of U and of T, relative to the largest entry of each.
static double difference(const pliant_material *material, const pliant_element_integrals *found,
                         const reference_blocks *expected)
{
    const double nu = material->poisson, mu = material->young / (2 * (1 + nu));
    const double u = 1 / (16 * pi * mu * (1 - nu)), t = -1 / (8 * pi * (1 - nu));
    double U_size = 0, T_size = 0, U_off = 0, T_off = 0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const double *f = found->of_hat[k], *w = f + PLIANT_INTEGRAL_W;
                const double turn = i == j ? 0 : w[3 - i - j] * ((j - i + 3) % 3 == 1 ? 1 : -1);
                const double S = f[PLIANT_INTEGRAL_S + pliant_integral_place[i][j]];
                const double U = u * f[PLIANT_INTEGRAL_U + pliant_integral_place[i][j]];
                const double T = t * (S - turn);
                U_size = fmax(U_size, fabs(expected->U[k][i][j]));
                T_size = fmax(T_size, fabs(expected->T[k][i][j]));
                U_off = fmax(U_off, fabs(U - expected->U[k][i][j]));
                T_off = fmax(T_off, fabs(T - expected->T[k][i][j]));
            }
    return fmax(U_off / U_size, T_off / T_size);
}

// Regular, ordinary, 4 degree needles and flat ones with the sharp or the blunt corner anywhere.
static const double shapes[][3][3] = {
    {{0, 0, 0}, {1, 0, 0}, {0.5, 0.866, 0}},
    {{0.1, -0.3, 0.2}, {0.9, 0.4, -0.1}, {-0.2, 0.5, 0.6}},
    {{0, 0, 0}, {1, 0, 0.1}, {1, 0.07, 0.1}},
    {{0, 0, 0}, {1, 0, 0}, {0.45, 0.035, 0.01}},
    {{0, 0, 0}, {0.035, 0, 0}, {0.9, 0.07, 0.3}},
};
enum { SHAPES = sizeof shapes / sizeof shapes[0] };

static pliant_element element_of(const double corners[3][3])
{
    pliant_element element;
    pliant_element_set(&element, (const int32_t[3]){0, 1, 2}, corners[0], corners[1], corners[2]);
    return element;
}

// The closed form loses (opposite edge's far end / distance of its line)^2 = 15^2 round-offs at
// worst; the reference is converged to less.
static void singular_integrals_equal_duffy_quadrature(void **state)
{
    (void)state;
    static const pliant_material materials[] = {{1, 0.3, 1}, {2, 0.49, 1}, {5, -0.9, 1}};
    for (int s = 0; s < SHAPES; s++)
        for (int own = 0; own < 3; own++) {
            const pliant_material *material = &materials[(s + own) % 3];
            const pliant_kelvin_constants constants = constants_of(material);
            const pliant_element element = element_of(shapes[s]);
            double relative[3][3];
            for (int k = 0; k < 3; k++)
                for (int i = 0; i < 3; i++) relative[k][i] = shapes[s][k][i] - shapes[s][own][i];
            const reference_blocks expected = reference_integrals(material, relative, own);
            pliant_element_integrals found;
            pliant_singular_integral_set(&constants, &element, own, &found);
            check_at_most(difference(material, &found, &expected), 1e-12);
        }
}

// Points above, beside and close to every shape. A leaf is 1.5 edges away from x at least: its
// integrand's Taylor series converges at least as fast as (0.577 / 2.08)^k, and 16 points are exact
// to degree 8 with the hat: 0.277^8 = 3e-5 times the 1e-2 of the remainder that the rule misses.
static void near_integrals_equal_fine_quadrature(void **state)
{
    (void)state;
    const pliant_material material = {1, 0.3, 1};
    const pliant_kelvin_constants constants = constants_of(&material);
    check_random random = check_random_seed(21);
    double worst = 0;
    for (int trial = 0; trial < 60; trial++) {
        const double(*corners)[3] = shapes[trial % SHAPES];
        const pliant_element element = element_of(corners);
        // From a random point of the triangle, a random way off: 0.003 to 3.
        double hats[3] = {check_random_next(&random), check_random_next(&random), 0};
        if (hats[0] + hats[1] > 1) {
            hats[0] = 1 - hats[0];
            hats[1] = 1 - hats[1];
        }
        hats[2] = 1 - hats[0] - hats[1];
        const double height = pow(10, 3 * check_random_next(&random) - 2.5) * (trial % 2 ? 1 : -1);
        double x[3], relative[3][3];
        for (int i = 0; i < 3; i++)
            x[i] = hats[0] * corners[0][i] + hats[1] * corners[1][i] + hats[2] * corners[2][i] +
                   height * (element.normal[i] + 0.5 * (check_random_next(&random) - 0.5));
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) relative[k][i] = corners[k][i] - x[i];
        const reference_blocks expected = reference_integrals(&material, relative, -1);
        pliant_element_integrals found;
        pliant_near_integral_set(&constants, &element, x, &found);
        const double off = difference(&material, &found, &expected);
        worst = fmax(worst, off);
        check_at_most(off, 3e-7);
    }
    print_message("worst near integral: %.1e of its largest entry\n", worst);
}

// A vertex that lies on the element has no finite integral; the answer is bounded work and finite.
static void a_vertex_on_the_element_ends_and_is_finite(void **state)
{
    (void)state;
    const pliant_kelvin_constants constants = {.diagonal = 1.8, .shear = 0.4};
    const pliant_element element = element_of(shapes[1]);
    pliant_element_integrals found;
    pliant_near_integral_set(&constants, &element, element.centre, &found);
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < PLIANT_INTEGRAL_COUNT; m++) assert_true(isfinite(found.of_hat[k][m]));
    pliant_near_integral_set(&constants, &element, shapes[1][2], &found);
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < PLIANT_INTEGRAL_COUNT; m++) assert_true(isfinite(found.of_hat[k][m]));
}

// The vector sum against seven scalar points an element: round-off of a sum of 7 x 60 terms. Near
// lanes add nothing and are named.
static void the_far_field_equals_a_scalar_sum(void **state)
{
    (void)state;
    enum { ELEMENTS = 60 };
    const pliant_material material = {1, 0.3, 1};
    const pliant_kelvin_constants constants = constants_of(&material);
    check_random random = check_random_seed(22);
    pliant_element elements[ELEMENTS];
    double corners[ELEMENTS][3][3], points[PLIANT_LANES][3];
    pliant_lanes x[3], body[3][3];
    for (int e = 0; e < ELEMENTS; e++) {
        for (int i = 0; i < 3; i++) {
            const double centre = 2 * check_random_next(&random) - 1;
            for (int k = 0; k < 3; k++)
                corners[e][k][i] = centre + 0.2 * (check_random_next(&random) - 0.5);
        }
        // Three hats shared by all elements: the sums must not be overwritten.
        elements[e] = element_of((const double(*)[3])corners[e]);
    }
    for (int lane = 0; lane < PLIANT_LANES; lane++)
        for (int i = 0; i < 3; i++)
            x[i][lane] = points[lane][i] = 2 * check_random_next(&random) - 1;
    pliant_row_sum sums[3];
    uint8_t near[ELEMENTS];
    memset(sums, 0, sizeof sums);
    memset(body, 0, sizeof body);
    pliant_far_field_add(&constants, elements, ELEMENTS, x, sums, body, near);

    const pliant_triangle_rule *rule = pliant_triangle_rule_of_degree(5);
    int near_count = 0;
    for (int lane = 0; lane < PLIANT_LANES; lane++) {
        reference_blocks expected;
        memset(&expected, 0, sizeof expected);
        double loads[3][3] = {{0}};
        for (int e = 0; e < ELEMENTS; e++) {
            double relative[3][3], centre[3], radius = 0, edge = 0, distance = 0;
            for (int i = 0; i < 3; i++)
                centre[i] = (corners[e][0][i] + corners[e][1][i] + corners[e][2][i]) / 3;
            for (int k = 0; k < 3; k++) {
                double side = 0, spoke = 0;
                for (int i = 0; i < 3; i++) {
                    relative[k][i] = corners[e][k][i] - points[lane][i];
                    side += pow(corners[e][k][i] - corners[e][(k + 1) % 3][i], 2);
                    spoke += pow(corners[e][k][i] - centre[i], 2);
                }
                edge = fmax(edge, sqrt(side));
                radius = fmax(radius, sqrt(spoke));
                distance = hypot(distance, centre[k] - points[lane][k]);
            }
            const int is_near = distance < radius + PLIANT_FAR_FIELD_RATIO * edge;
            assert_int_equal(near[e] >> lane & 1, is_near);
            near_count += is_near;
            if (is_near) continue;
            reference_blocks one;
            memset(&one, 0, sizeof one);
            for (int q = 0; q < rule->point_count; q++)
                reference_add_point(&material, relative, elements[e].normal, rule->points[q],
                                    rule->weights[q] * elements[e].area, &one);
            for (int k = 0; k < 3; k++)
                for (int i = 0; i < 3; i++)
                    for (int j = 0; j < 3; j++) {
                        expected.U[k][i][j] += one.U[k][i][j];
                        expected.T[k][i][j] += one.T[k][i][j];
                        loads[i][j] -= one.U[k][i][j] * corners[e][k][j] * elements[e].normal[j];
                    }
        }
        pliant_element_integrals found;
        for (int k = 0; k < 3; k++)
            for (int m = 0; m < PLIANT_INTEGRAL_COUNT; m++) found.of_hat[k][m] = sums[k][m][lane];
        check_at_most(difference(&material, &found, &expected), 1e-13);
        const double u = 1 / (16 * pi * (material.young / 2.6) * 0.7);
        for (int i = 0; i < 9; i++)
            check_near(u * body[i / 3][i % 3][lane], loads[i / 3][i % 3], 1e-14);
    }
    assert_in_range(near_count, 1, PLIANT_LANES * ELEMENTS - 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(singular_integrals_equal_duffy_quadrature),
        cmocka_unit_test(near_integrals_equal_fine_quadrature),
        cmocka_unit_test(a_vertex_on_the_element_ends_and_is_finite),
        cmocka_unit_test(the_far_field_equals_a_scalar_sum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
