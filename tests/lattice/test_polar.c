// test_polar.c: rotations of the polar decomposition, against LAPACK's singular values.
#include "check.h"

#include "lattice/polar.h"

#include <float.h>
#include <math.h>
#include <string.h>

void dgesvd_(const char *jobu, const char *jobvt, const int *m, const int *n, double *a,
             const int *lda, double *s, double *u, const int *ldu, double *vt, const int *ldvt,
             double *work, const int *lwork, int *info);

// Residual and loss of orthonormality that polar.h promises; the first a little wider, because the
// float matrix is rounded after it was tested.
#define RESIDUAL    1.3e-6
#define ORTHONORMAL 1e-6

enum { BLOCKS = 25 };  // not a multiple of the group's size

typedef struct lane {
    double a[9], start[4], q[4], r[9];
    float bits[13];  // q and R as they came
} lane;

// ---- Matrices ----

static double uniform(check_random *random)
{
    return 2 * check_random_next(random) - 1;
}

static void multiply(const double a[9], const double b[9], double c[9])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

static void transpose(const double a[9], double t[9])
{
    for (int i = 0; i < 9; i++) t[i] = a[i % 3 * 3 + i / 3];
}

static double norm(const double *a, int count)
{
    double sum = 0;
    for (int i = 0; i < count; i++) sum += a[i] * a[i];
    return sqrt(sum);
}

// A turn by that angle about a random axis.
static void random_turn(check_random *random, double angle, double q[4])
{
    double length = 0;
    while (length < 0.1 || length > 1) {
        for (int i = 0; i < 3; i++) q[i] = uniform(random);
        length = norm(q, 3);
    }
    for (int i = 0; i < 3; i++) q[i] *= sin(angle / 2) / length;
    q[3] = cos(angle / 2);
}

static void compose(const double p[4], const double q[4], double pq[4])
{
    const double product[4] = {p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1],
                               p[3] * q[1] + p[1] * q[3] + p[2] * q[0] - p[0] * q[2],
                               p[3] * q[2] + p[2] * q[3] + p[0] * q[1] - p[1] * q[0],
                               p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2]};
    memcpy(pq, product, sizeof product);
}

static void matrix_of(const double q[4], double r[9])
{
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(r, m, sizeof m);
}

// A = R V diag(s) V^T with R of q: where s2 + s3 > 0, |s3| least, R is the nearest rotation.
static void stretch(check_random *random, const double q[4], const double s[3], double a[9])
{
    double axes[4], v[9], vt[9], r[9], u[9];
    random_turn(random, M_PI * uniform(random), axes);
    matrix_of(axes, v);
    transpose(v, vt);
    for (int i = 0; i < 9; i++) vt[i] *= s[i / 3];
    multiply(v, vt, u);
    matrix_of(q, r);
    multiply(r, u, a);
}

// Signed singular values, s[2] < 0 where det A < 0, and the nearest rotation.
static void reference(const double a[9], double s[3], double r[9])
{
    double at[9], u[9], vt[9], work[64];
    const int n = 3, work_size = 64;
    int info;
    transpose(a, at);  // LAPACK goes by columns
    dgesvd_("A", "A", &n, &n, at, &n, s, u, &n, vt, &n, work, &work_size, &info);
    assert_int_equal(info, 0);
    double ut[9], v[9];
    transpose(u, ut);
    transpose(vt, v);
    const double *m = ut, *w = v;
    double product[9];
    for (int sign = 1; sign >= -1; sign -= 2) {
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                product[3 * i + j] =
                    m[3 * i] * w[j] + m[3 * i + 1] * w[3 + j] + sign * m[3 * i + 2] * w[6 + j];
        const double determinant =
            product[0] * (product[4] * product[8] - product[5] * product[7]) -
            product[1] * (product[3] * product[8] - product[5] * product[6]) +
            product[2] * (product[3] * product[7] - product[4] * product[6]);
        if (determinant < 0) continue;
        s[2] *= sign;
        memcpy(r, product, sizeof product);
        return;
    }
}

// ---- Blocks ----

// Fills q, r and bits; the block holds what `a` and `start` are in float.
static void solve(lane *lanes, int count)
{
    static float a[BLOCKS * 72], q[BLOCKS * 32], r[BLOCKS * 72];
    const int blocks = (count + 7) / 8;
    assert_true(blocks <= BLOCKS);
    for (int l = 0; l < 8 * blocks; l++) {
        const lane *from = &lanes[l < count ? l : 0];
        for (int i = 0; i < 9; i++) a[72 * (l / 8) + 8 * i + l % 8] = (float)from->a[i];
        for (int i = 0; i < 4; i++) q[32 * (l / 8) + 8 * i + l % 8] = (float)from->start[i];
    }
    pliant_polar_blocks(blocks, a, q, r);
    for (int l = 0; l < count; l++) {
        for (int i = 0; i < 9; i++) lanes[l].a[i] = a[72 * (l / 8) + 8 * i + l % 8];
        for (int i = 0; i < 4; i++)
            lanes[l].q[i] = lanes[l].bits[i] = q[32 * (l / 8) + 8 * i + l % 8];
        for (int i = 0; i < 9; i++)
            lanes[l].r[i] = lanes[l].bits[4 + i] = r[72 * (l / 8) + 8 * i + l % 8];
    }
}

// A rotation, and q's.
static void check_rotation(const lane *l)
{
    double rt[9], product[9], of_q[9];
    check_near(norm(l->q, 4), 1, 4e-7);
    transpose(l->r, rt);
    multiply(rt, l->r, product);
    matrix_of(l->q, of_q);
    for (int i = 0; i < 9; i++) {
        check_near(product[i], i % 4 == 0, ORTHONORMAL);
        check_near(l->r[i], of_q[i], 2e-6);
    }
}

// |axial(R^T A)| / |A|.
static double residual(const lane *l)
{
    double rt[9], b[9];
    transpose(l->r, rt);
    multiply(rt, l->a, b);
    const double z[3] = {b[7] - b[5], b[2] - b[6], b[3] - b[1]};
    return norm(z, 3) / norm(l->a, 9);
}

// All that holds of the nearest rotation whether or not it is unique, and LAPACK's where it is.
static void check_nearest(const lane *l)
{
    double s[3], r[9], trace = 0, distance = 0;
    check_rotation(l);
    check_at_most(residual(l), RESIDUAL);
    reference(l->a, s, r);
    const double size = norm(l->a, 9);
    for (int i = 0; i < 9; i++) {
        trace += l->r[i] * l->a[i];
        distance += (l->r[i] - r[i]) * (l->r[i] - r[i]);
    }
    // The trace falls short of the greatest, s1 + s2 + s3, by its rounding.
    check_at_least(trace / size, (s[0] + s[1] + s[2]) / size - 2e-6);
    // A residual z leaves an angle up to |z| / (s2 + s3), and |R - R'| is sqrt(2) times that.
    const double gap = (s[1] + s[2]) / size;
    if (gap > 1e-5) check_at_most(sqrt(distance), 1.5 * RESIDUAL / gap + 1e-6);
    double along = 0;
    for (int i = 0; i < 4; i++) along += l->q[i] * l->start[i];
    check_at_least(along, -1e-6);
}

static void check_all(lane *lanes, int count)
{
    solve(lanes, count);
    for (int l = 0; l < count; l++) check_nearest(&lanes[l]);
}

// ---- Cases ----

static void nearest_rotations_are_those_of_lapack(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    static lane lanes[8 * BLOCKS];
    for (int round = 0; round < 40; round++) {
        for (int l = 0; l < 8 * BLOCKS; l++) {
            for (int i = 0; i < 9; i++) lanes[l].a[i] = uniform(&random);
            random_turn(&random, M_PI * uniform(&random), lanes[l].start);
        }
        check_all(lanes, 8 * BLOCKS);
    }
}

// Starts off by every angle, up to half a turn, from matrices strained by 30%, nearly flat ones,
// flat ones, inverted ones, and such that are hardly more than a line.
static void any_start_leads_to_the_nearest_rotation(void **state)
{
    (void)state;
    static const double angles[] = {0, 1e-4, 0.01, 0.1, 0.3, 1, 2, 3, 3.14159, M_PI};
    static const double strains[][3] = {{1, 1, 1},       {1, 1, 1e-3},    {1, 1, 1e-6},
                                        {1, 1, 0},       {1, 1, -0.3},    {1, 0.7, -0.65},
                                        {1, 0.1, -0.02}, {1, 1e-2, 1e-3}, {1, 1e-3, -1e-4},
                                        {1, 1e-4, 1e-4}, {1, 1e-5, 1e-5}, {1, 3e-6, -1e-6}};
    check_random random = check_random_seed(2);
    static lane lanes[8 * BLOCKS];
    for (size_t kind = 0; kind < sizeof strains / sizeof *strains; kind++)
        for (size_t angle = 0; angle < sizeof angles / sizeof *angles; angle++) {
            for (int l = 0; l < 8 * BLOCKS; l++) {
                double q[4], off[4], s[3];
                random_turn(&random, M_PI * uniform(&random), q);
                random_turn(&random, angles[angle], off);
                for (int i = 0; i < 3; i++) s[i] = strains[kind][i];
                if (kind < 4)
                    for (int i = 0; i < 3; i++) s[i] *= 1 + 0.3 * uniform(&random);
                stretch(&random, q, s, lanes[l].a);
                compose(q, off, lanes[l].start);
            }
            check_all(lanes, 8 * BLOCKS);
        }
}

// Half a turn about an axis of the stretch: R^T A is symmetric there, though nowhere near.
static void stationary_starts_are_left(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    lane lanes[24];
    for (int l = 0; l < 24; l++) {
        const double s[3] = {1.3, 1, l < 12 ? 0.6 : -0.6};
        double q[4] = {0, 0, 0, 1}, half[4] = {0};
        half[l % 3] = 1;
        if (l % 2) random_turn(&random, 2, q);
        double r[9], u[9] = {0};
        for (int i = 0; i < 3; i++) u[4 * i] = s[i];
        matrix_of(q, r);
        multiply(r, u, lanes[l].a);
        compose(q, half, lanes[l].start);
    }
    check_all(lanes, 24);
}

static void a_rotation_that_fits_is_a_fixed_point(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    lane lanes[80];
    for (int l = 0; l < 80; l++) {
        const double s[3] = {1 + 0.5 * uniform(&random), 2, 1 + 0.5 * uniform(&random)};
        random_turn(&random, M_PI * uniform(&random), lanes[l].start);
        stretch(&random, lanes[l].start, s, lanes[l].a);
    }
    check_all(lanes, 80);
    for (int l = 0; l < 80; l++)
        for (int i = 0; i < 4; i++) check_near(lanes[l].q[i], lanes[l].start[i], 5e-7);
}

// A = u v^T: any R with R v = u will do, and the nearest to R0 turns R0 v the short way.
static void rank_one_takes_the_shortest_turn(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    static lane lanes[8 * BLOCKS];
    for (int l = 0; l < 8 * BLOCKS; l++) {
        double q[4], r[9];
        random_turn(&random, M_PI * uniform(&random), q);
        matrix_of(q, r);
        for (int i = 0; i < 9; i++) lanes[l].a[i] = r[i / 3 * 3] * r[i % 3 * 3 + 1];
        random_turn(&random, M_PI * uniform(&random), lanes[l].start);
    }
    check_all(lanes, 8 * BLOCKS);
    for (int l = 0; l < 8 * BLOCKS; l++) {
        double r0[9], rt[9], product[9], along = 0;
        matrix_of(lanes[l].start, r0);
        transpose(r0, rt);
        multiply(rt, lanes[l].a, product);
        // cos of the angle between R0 v and u is tr(R0^T u v^T) / (|u| |v|).
        const double cosine = (product[0] + product[4] + product[8]) / norm(lanes[l].a, 9);
        for (int i = 0; i < 4; i++) along += lanes[l].q[i] * lanes[l].start[i];
        check_near(along, sqrt(fmax(0, (1 + cosine) / 2)), 1e-4);
    }
}

// All of s1 = s2 = -s3: every half turn is as good as any, so what is one stays.
static void symmetric_inversions_keep_a_nearest_rotation(void **state)
{
    (void)state;
    check_random random = check_random_seed(6);
    lane lanes[80];
    for (int l = 0; l < 80; l++) {
        const double s[3] = {-1, -1, -1};
        double q[4];
        random_turn(&random, M_PI * uniform(&random), q);
        stretch(&random, q, s, lanes[l].a);
        random_turn(&random, M_PI * uniform(&random), lanes[l].start);
    }
    check_all(lanes, 80);
    for (int l = 0; l < 80; l++) memcpy(lanes[l].start, lanes[l].q, sizeof lanes[l].q);
    check_all(lanes, 80);
    for (int l = 0; l < 80; l++)
        for (int i = 0; i < 4; i++) check_near(lanes[l].q[i], lanes[l].start[i], 2e-6);
}

static void nothing_to_go_by_keeps_the_rotation(void **state)
{
    (void)state;
    static const double values[] = {0, -0.0, 1e-40, -1e-44, NAN, INFINITY, -INFINITY, 3e38};
    check_random random = check_random_seed(7);
    lane lanes[80];
    for (int l = 0; l < 80; l++) {
        const double value = values[l % 8];
        random_turn(&random, M_PI * uniform(&random), lanes[l].start);
        for (int i = 0; i < 9; i++) lanes[l].a[i] = l % 8 < 4 ? value : uniform(&random);
        if (l % 8 >= 4) lanes[l].a[l % 9] = value;
    }
    solve(lanes, 80);
    for (int l = 0; l < 80; l++) {
        check_rotation(&lanes[l]);
        for (int i = 0; i < 4; i++) check_near(lanes[l].q[i], lanes[l].start[i], 3e-7);
    }
}

static void starts_that_are_no_rotation_are_replaced(void **state)
{
    (void)state;
    static const double values[] = {0, NAN, INFINITY, 1, 1e30, 1e-30, -INFINITY, 0.1};
    lane lanes[16];
    for (int l = 0; l < 16; l++) {
        for (int i = 0; i < 4; i++) lanes[l].start[i] = values[l % 8];
        for (int i = 0; i < 9; i++) lanes[l].a[i] = l < 8 ? 0 : i % 4 == 0;
    }
    solve(lanes, 16);
    for (int l = 0; l < 16; l++) {
        check_rotation(&lanes[l]);
        for (int i = 0; i < 4; i++) check_near(lanes[l].q[i], i == 3, 1e-7);
    }
}

// Powers of two are exact, so that magnitude changes no bit.
static void magnitude_does_not_matter(void **state)
{
    (void)state;
    check_random random = check_random_seed(8);
    lane lanes[80], scaled[80];
    for (int l = 0; l < 80; l++) {
        for (int i = 0; i < 9; i++) lanes[l].a[i] = uniform(&random);
        random_turn(&random, (l % 4) * 0.3, lanes[l].start);
        scaled[l] = lanes[l];
        const int power = -100 + 220 * l / 80;
        for (int i = 0; i < 9; i++) scaled[l].a[i] = ldexp((float)lanes[l].a[i], power);
    }
    check_all(lanes, 80);
    check_all(scaled, 80);
    for (int l = 0; l < 80; l++)
        assert_memory_equal(lanes[l].bits, scaled[l].bits, sizeof lanes[l].bits);
}

// Each lane by itself, eight times over, gives the bits that it has among others of every kind.
static void neighbours_change_no_bit(void **state)
{
    (void)state;
    check_random random = check_random_seed(9);
    lane lanes[8 * BLOCKS];
    for (int l = 0; l < 8 * BLOCKS; l++) {
        double q[4], off[4];
        const double third[] = {1, 0, -0.5, 1e-7, 0.8, -1, 0.9, 1};
        const double angle[] = {0.1, 0.6, 2, 3.1, 0, 1, 0.2, M_PI};
        const int kind = (int)(check_random_next(&random) * 8);
        const double s[3] = {1, 1, third[kind]};
        random_turn(&random, M_PI * uniform(&random), q);
        random_turn(&random, angle[(int)(check_random_next(&random) * 8)], off);
        stretch(&random, q, s, lanes[l].a);
        compose(q, off, lanes[l].start);
        if (l % 17 == 3) lanes[l].a[4] = NAN;
        if (l % 19 == 4) memset(lanes[l].a, 0, sizeof lanes[l].a);
        if (l % 23 == 5)
            for (int i = 0; i < 9; i++) lanes[l].a[i] = s[0] * 1e-20 * (i % 3 == 1);
    }
    solve(lanes, 8 * BLOCKS);
    for (int l = 0; l < 8 * BLOCKS; l++) {
        lane alone[8];
        for (int k = 0; k < 8; k++) alone[k] = lanes[l];
        solve(alone, 8);
        for (int k = 0; k < 8; k++)
            assert_memory_equal(alone[k].bits, lanes[l].bits, sizeof lanes[l].bits);
    }
}

// A body that spins while it is strained: 0.2 rad a step, thousands of steps.
static void a_spin_is_followed(void **state)
{
    (void)state;
    check_random random = check_random_seed(10);
    lane lanes[8];
    double turn[8][4], spin[8][4];
    for (int k = 0; k < 8; k++) {
        random_turn(&random, 1, turn[k]);
        random_turn(&random, 0.2, spin[k]);
        memcpy(lanes[k].start, turn[k], sizeof turn[k]);
    }
    for (int step = 0; step < 2000; step++) {
        for (int k = 0; k < 8; k++) {
            const double s[3] = {1 + 0.3 * uniform(&random), 1, 1 + 0.3 * uniform(&random)};
            compose(spin[k], turn[k], turn[k]);
            const double length = norm(turn[k], 4);
            for (int i = 0; i < 4; i++) turn[k][i] /= length;
            stretch(&random, turn[k], s, lanes[k].a);
        }
        check_all(lanes, 8);
        for (int k = 0; k < 8; k++) {
            for (int i = 0; i < 4; i++) check_near(lanes[k].q[i], turn[k][i], 3e-6);
            memcpy(lanes[k].start, lanes[k].q, sizeof lanes[k].q);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nearest_rotations_are_those_of_lapack),
        cmocka_unit_test(any_start_leads_to_the_nearest_rotation),
        cmocka_unit_test(stationary_starts_are_left),
        cmocka_unit_test(a_rotation_that_fits_is_a_fixed_point),
        cmocka_unit_test(rank_one_takes_the_shortest_turn),
        cmocka_unit_test(symmetric_inversions_keep_a_nearest_rotation),
        cmocka_unit_test(nothing_to_go_by_keeps_the_rotation),
        cmocka_unit_test(starts_that_are_no_rotation_are_replaced),
        cmocka_unit_test(magnitude_does_not_matter),
        cmocka_unit_test(neighbours_change_no_bit),
        cmocka_unit_test(a_spin_is_followed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
