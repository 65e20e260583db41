// test_bem_kelvin.c: Kelvin's fundamental solutions and their vector form.
#include "check.h"

#include "bem/kelvin.h"
#include "bem/kelvin_lanes.h"

#include <math.h>

static const pliant_material materials[] = {{1, 0.3, 1}, {2e9, 0.49, 1}, {3, -0.9, 1}, {0.1, 0, 1}};
enum { MATERIALS = sizeof materials / sizeof materials[0] };

static void random_unit(check_random *random, double n[3])
{
    double length;
    do {
        for (int i = 0; i < 3; i++) n[i] = 2 * check_random_next(random) - 1;
        length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    } while (length < 0.1 || length > 1);
    for (int i = 0; i < 3; i++) n[i] /= length;
}

// T is Hooke's law applied to central differences of U: error h^2 |U'''| / 6 relative to |U'| at
// |r| about 1, with a constant of some tens; round-off eps / h below it.
static void the_traction_is_the_stress_of_the_displacement(void **state)
{
    (void)state;
    check_random random = check_random_seed(11);
    const double h = 1e-4;
    for (int trial = 0; trial < 40; trial++) {
        const pliant_material *material = &materials[trial % MATERIALS];
        const double nu = material->poisson, mu = material->young / (2 * (1 + nu));
        const double lambda = 2 * mu * nu / (1 - 2 * nu);
        double r[3], n[3], slope[3][3][3], T[3][3];
        random_unit(&random, r);
        random_unit(&random, n);
        for (int d = 0; d < 3; d++) {
            double above[3][3], below[3][3], shifted[3] = {r[0], r[1], r[2]};
            shifted[d] = r[d] + h;
            pliant_kelvin_displacement(material, shifted, above);
            shifted[d] = r[d] - h;
            pliant_kelvin_displacement(material, shifted, below);
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) slope[i][j][d] = (above[i][j] - below[i][j]) / (2 * h);
        }
        pliant_kelvin_traction(material, r, n, T);
        for (int i = 0; i < 3; i++) {
            const double divergence = slope[i][0][0] + slope[i][1][1] + slope[i][2][2];
            for (int j = 0; j < 3; j++) {
                double p = lambda * divergence * n[j];
                for (int d = 0; d < 3; d++) p += mu * (slope[i][j][d] + slope[i][d][j]) * n[d];
                // lambda / mu = 49 at nu = 0.49 multiplies the differences' error.
                check_near(T[i][j], p, 1e-6 * (1 + lambda / mu));
            }
        }
    }
}

// The integral of T_ij over a sphere round the force is -d_ij (equilibrium), whatever the centre.
// Trapezoids in longitude and midpoints in cos(latitude), second order: 1 / 200^2 times a constant.
static void tractions_round_the_force_balance_it(void **state)
{
    (void)state;
    enum { BANDS = 200 };
    const double force_at[3] = {0.2, -0.1, 0.3}, pi = 3.14159265358979323846;
    for (int m = 0; m < MATERIALS; m++) {
        double total[3][3] = {{0}};
        for (int a = 0; a < BANDS; a++)
            for (int b = 0; b < BANDS; b++) {
                const double z = -1 + (2 * a + 1.0) / BANDS, angle = 2 * pi * b / BANDS;
                const double n[3] = {sqrt(1 - z * z) * cos(angle), sqrt(1 - z * z) * sin(angle), z};
                const double r[3] = {n[0] - force_at[0], n[1] - force_at[1], n[2] - force_at[2]};
                double T[3][3];
                pliant_kelvin_traction(&materials[m], r, n, T);
                for (int i = 0; i < 9; i++)
                    total[i / 3][i % 3] += T[i / 3][i % 3] * 4 * pi / (BANDS * BANDS);
            }
        for (int i = 0; i < 9; i++) check_near(total[i / 3][i % 3], i % 4 == 0 ? -1 : 0, 1e-4);
    }
}

// Eight lanes of brackets against the scalar formulas: a dozen operations, some units in the last
// place each, over nine decades of |r|.
PLIANT_VECTOR_CLONES
static void lanes_of(const pliant_kelvin_constants *constants, const double n[3],
                     const pliant_lanes r[3], const pliant_lanes *scale,
                     pliant_lanes kernels[PLIANT_INTEGRAL_COUNT])
{
    const double shear_normal[3] = {constants->shear * n[0], constants->shear * n[1],
                                    constants->shear * n[2]};
    const pliant_lanes d = r[0] * n[0] + r[1] * n[1] + r[2] * n[2];
    evaluate_kernels(constants, shear_normal, r, &d, scale, kernels);
}

static void the_vector_form_equals_the_scalar_one(void **state)
{
    (void)state;
    check_random random = check_random_seed(12);
    const double pi = 3.14159265358979323846;
    for (int trial = 0; trial < 400; trial++) {
        const pliant_material *material = &materials[trial % MATERIALS];
        const double nu = material->poisson, mu = material->young / (2 * (1 + nu));
        const pliant_kelvin_constants constants = {.diagonal = 3 - 4 * nu, .shear = 1 - 2 * nu};
        double n[3], points[PLIANT_LANES][3];
        pliant_lanes r[3], kernels[PLIANT_INTEGRAL_COUNT];
        random_unit(&random, n);
        for (int lane = 0; lane < PLIANT_LANES; lane++) {
            random_unit(&random, points[lane]);
            const double size = pow(10, 9 * check_random_next(&random) - 7);
            for (int i = 0; i < 3; i++) r[i][lane] = points[lane][i] *= size;
        }
        const pliant_lanes one = 1 - (pliant_lanes){0};
        lanes_of(&constants, n, r, &one, kernels);
        for (int lane = 0; lane < PLIANT_LANES; lane++) {
            double U[3][3], T[3][3], r2 = 0;
            for (int i = 0; i < 3; i++) r2 += points[lane][i] * points[lane][i];
            pliant_kelvin_displacement(material, points[lane], U);
            pliant_kelvin_traction(material, points[lane], n, T);
            const double u = 1 / (16 * pi * mu * (1 - nu)), t = -1 / (8 * pi * (1 - nu));
            const double w[3] = {kernels[PLIANT_INTEGRAL_W][lane],
                                 kernels[PLIANT_INTEGRAL_W + 1][lane],
                                 kernels[PLIANT_INTEGRAL_W + 2][lane]};
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) {
                    const int at = pliant_integral_place[i][j];
                    const double turn = i == j ? 0 : w[3 - i - j] * ((j - i + 3) % 3 == 1 ? 1 : -1);
                    check_near(u * kernels[PLIANT_INTEGRAL_U + at][lane], U[i][j],
                               2e-14 * fabs(u) * 8 / sqrt(r2));
                    check_near(t * (kernels[PLIANT_INTEGRAL_S + at][lane] - turn), T[i][j],
                               2e-14 * fabs(t) * 8 / r2);
                }
        }
    }
}

// far_field.c masks near lanes by scale 0, wherever the vertex is: at the point itself too.
static void a_lane_of_scale_zero_adds_exactly_nothing(void **state)
{
    (void)state;
    const pliant_kelvin_constants constants = {.diagonal = 1.8, .shear = 0.4};
    const double n[3] = {0.6, 0, 0.8};
    pliant_lanes r[3], scale, kernels[PLIANT_INTEGRAL_COUNT];
    for (int lane = 0; lane < PLIANT_LANES; lane++) {
        for (int i = 0; i < 3; i++) r[i][lane] = lane < 4 ? 0 : 1e-3 * (lane + i);
        scale[lane] = lane % 2;
    }
    lanes_of(&constants, n, r, &scale, kernels);
    for (int lane = 0; lane < PLIANT_LANES; lane++)
        for (int m = 0; m < PLIANT_INTEGRAL_COUNT; m++) {
            assert_true(isfinite(kernels[m][lane]));
            if (lane % 2 == 0) assert_true(kernels[m][lane] == 0);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_traction_is_the_stress_of_the_displacement),
        cmocka_unit_test(tractions_round_the_force_balance_it),
        cmocka_unit_test(the_vector_form_equals_the_scalar_one),
        cmocka_unit_test(a_lane_of_scale_zero_adds_exactly_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
