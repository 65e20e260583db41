// bench_polar.c: rotations of 57,600 regions: ours against the paper's and others', time and error.
//
// The others live here alone. All but LAPACK's and the paper's work on eight lanes by the same
// vector extension as ours. Error is |R - R'| over the nearest rotation R' by LAPACK in double, of
// the float matrix; times are of one thread's own clock, the median of some runs.
//
// These follow: Rivers & James 2007, section 4 (Jacobi on A^T A, its eigenvectors kept); Mueller,
// Bender, Chentanez & Macklin, A robust method to extract the rotational part of deformations,
// 2016; Higham, Computing the polar decomposition, with applications, 1986; Markley, Attitude
// determination using vector observations: a fast optimal matrix algorithm, 1993.
#include "bench.h"

#include "lattice/polar.h"
#include "pliant/vector_clones.h"

#include "lattice/polar_block.h"

#include <float.h>
#include <math.h>
#include <string.h>
#include <time.h>

void dgesvd_(const char *jobu, const char *jobvt, const int *m, const int *n, double *a,
             const int *lda, double *s, double *u, const int *ldu, double *vt, const int *ldvt,
             double *work, const int *lwork, int *info);

enum { BLOCKS = 7200, RUNS = 15, LAPACK_BLOCKS = 250 };

typedef pliant_polar_lanes lanes;
#define LOAD(p)     (*(const pliant_polar_memory *)(p))
#define STORE(p, v) (*(pliant_polar_memory *)(p) = (v))

// What the methods share: matrices, where they start, what they find. axes: the paper's state.
typedef struct regions {
    float *a, *q, *axes, *r;  // shapes [BLOCKS][9][8], [4][8], [9][8], [9][8]
} regions;

// ---- Ours, by the number of solutions ----

static PLIANT_VECTOR_CLONES void solve_once(regions *set)
{
    for (int b = 0; b < BLOCKS; b++) {
        pliant_polar_lanes m[9], q[4], r[9], turn[4], twice, length, inverse;
        const pliant_polar_lanes none = {0};
        pliant_polar_masks kept;
        pliant_polar_frame f;
        pliant_polar_scale(set->a + 72 * b, m, &kept);
        for (int i = 0; i < 4; i++) q[i] = LOAD(set->q + 32 * b + 8 * i);
        twice = none + 2;
        pliant_polar_matrix(q, &twice, r);
        pliant_polar_look(r, m, &f);
        pliant_polar_solve(&f, &none, turn);
        pliant_polar_apply(turn, q);
        pliant_polar_square(q, &length);
        pliant_polar_inverse_root(&length, &inverse);
        twice = 2 / length;
        pliant_polar_matrix(q, &twice, r);
        for (int i = 0; i < 4; i++) STORE(set->q + 32 * b + 8 * i, inverse * q[i]);
        for (int i = 0; i < 9; i++) STORE(set->r + 72 * b + 8 * i, r[i]);
    }
}

static void solve_twice(regions *set)
{
    pliant_polar_blocks(BLOCKS, set->a, set->q, set->r);
}

static void solve_four_times(regions *set)
{
    pliant_polar_blocks(BLOCKS, set->a, set->q, set->r);
    pliant_polar_blocks(BLOCKS, set->a, set->q, set->r);
}

// ---- Mueller 2016 ----

// omega = sum r_i cross a_i / |sum r_i . a_i|, q = exp(omega) q: five times. The exponential is
// (omega / 2, 1) made a unit, which is cheaper, and no worse where it converges.
static PLIANT_VECTOR_CLONES void mueller(regions *set)
{
    for (int b = 0; b < BLOCKS; b++) {
        lanes m[9], q[4], r[9], length, inverse, twice = {0};
        twice += 2;
        for (int i = 0; i < 9; i++) m[i] = LOAD(set->a + 72 * b + 8 * i);
        for (int i = 0; i < 4; i++) q[i] = LOAD(set->q + 32 * b + 8 * i);
        for (int step = 0; step < 5; step++) {
            pliant_polar_frame f;
            lanes turn[4];
            pliant_polar_matrix(q, &twice, r);
            pliant_polar_look(r, m, &f);  // in R's own frame, which turns q from the right
            const lanes trace = 0.25f * (f.diagonal[0] + f.diagonal[1] + f.diagonal[2]);
            const lanes size = (lanes)((pliant_polar_masks)trace & 0x7fffffff) + 1e-9f;
            for (int i = 0; i < 3; i++) turn[i] = f.z[i];
            turn[3] = 2 * size;
            pliant_polar_apply(turn, q);
            pliant_polar_square(q, &length);
            pliant_polar_inverse_root(&length, &inverse);
            for (int i = 0; i < 4; i++) q[i] *= inverse;
        }
        pliant_polar_matrix(q, &twice, r);
        for (int i = 0; i < 4; i++) STORE(set->q + 32 * b + 8 * i, q[i]);
        for (int i = 0; i < 9; i++) STORE(set->r + 72 * b + 8 * i, r[i]);
    }
}

// ---- Higham's Newton iteration ----

PLIANT_POLAR_INLINE void cofactors(const lanes m[9], lanes c[9])
{
    c[0] = m[4] * m[8] - m[5] * m[7], c[1] = m[5] * m[6] - m[3] * m[8];
    c[2] = m[3] * m[7] - m[4] * m[6], c[3] = m[7] * m[2] - m[8] * m[1];
    c[4] = m[8] * m[0] - m[6] * m[2], c[5] = m[6] * m[1] - m[7] * m[0];
    c[6] = m[1] * m[5] - m[2] * m[4], c[7] = m[2] * m[3] - m[0] * m[5];
    c[8] = m[0] * m[4] - m[1] * m[3];
}

// X = (g X + X^-T / g) / 2 with g = sqrt(|X^-1| / |X|): so many times. Inverted stays inverted.
PLIANT_POLAR_INLINE void higham(regions *set, int steps)
{
    for (int b = 0; b < BLOCKS; b++) {
        lanes m[9], c[9];
        for (int i = 0; i < 9; i++) m[i] = LOAD(set->a + 72 * b + 8 * i);
        for (int step = 0; step < steps; step++) {
            lanes size = {0}, other = {0}, g, h;
            cofactors(m, c);
            const lanes determinant = m[0] * c[0] + m[1] * c[1] + m[2] * c[2];
            for (int i = 0; i < 9; i++) {
                size += m[i] * m[i];
                other += c[i] * c[i];
            }
            // g^4 = |C|^2 / (det^2 |X|^2)
            const lanes fourth = other / (determinant * determinant * size);
            pliant_polar_inverse_root(&fourth, &h);
            pliant_polar_inverse_root(&h, &g);  // fourth^(1/4)
            const lanes own = 0.5f * g, inverse = 0.5f / (g * determinant);
            for (int i = 0; i < 9; i++) m[i] = own * m[i] + inverse * c[i];
        }
        for (int i = 0; i < 9; i++) STORE(set->r + 72 * b + 8 * i, m[i]);
    }
}

static PLIANT_VECTOR_CLONES void higham_three(regions *set)
{
    higham(set, 3);
}

static PLIANT_VECTOR_CLONES void higham_six(regions *set)
{
    higham(set, 6);
}

// ---- FOAM ----

// R = ((k + |A|^2) A + lambda adj(A)^T - A A^T A) / z, k = (lambda^2 - |A|^2) / 2,
// z = k lambda - det A; lambda by four Newton steps from sqrt(3) |A|. No start.
static PLIANT_VECTOR_CLONES void foam(regions *set)
{
    for (int b = 0; b < BLOCKS; b++) {
        lanes m[9], c[9], s[9], n = {0}, square = {0}, inverse;
        for (int i = 0; i < 9; i++) m[i] = LOAD(set->a + 72 * b + 8 * i);
        cofactors(m, c);
        const lanes determinant = m[0] * c[0] + m[1] * c[1] + m[2] * c[2];
        for (int i = 0; i < 9; i++) {
            n += m[i] * m[i];
            square += c[i] * c[i];
        }
        const lanes most = 3 * n;
        pliant_polar_inverse_root(&most, &inverse);
        lanes lambda = most * inverse;
        for (int step = 0; step < 4; step++) {
            const lanes excess = lambda * lambda - n;
            const lanes value = excess * excess - 8 * lambda * determinant - 4 * square;
            lambda -= value / (4 * (lambda * excess - 2 * determinant));
        }
        const lanes k = 0.5f * (lambda * lambda - n), z = 1 / (k * lambda - determinant);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                s[3 * i + j] =
                    m[3 * i] * m[3 * j] + m[3 * i + 1] * m[3 * j + 1] + m[3 * i + 2] * m[3 * j + 2];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const lanes cubed =
                    s[3 * i] * m[j] + s[3 * i + 1] * m[3 + j] + s[3 * i + 2] * m[6 + j];
                STORE(set->r + 72 * b + 8 * (3 * i + j),
                      z * ((k + n) * m[3 * i + j] + lambda * c[3 * i + j] - cubed));
            }
    }
}

// ---- The paper's ----

// Jacobi on V^T A^T A V from the last V until it is diagonal to 1e-6, R = A V diag(1 / s) V^T.
static void jacobi(regions *set)
{
    for (int l = 0; l < 8 * BLOCKS; l++) {
        const float *a = set->a + l / 8 * 72 + l % 8;
        float *axes = set->axes + l / 8 * 72 + l % 8, *r = set->r + l / 8 * 72 + l % 8;
        float v[3][3], m[3][3], w[3][3], s[3][3];
        for (int i = 0; i < 9; i++) v[i / 3][i % 3] = axes[8 * i];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                m[i][j] = a[24 * i] * v[0][j] + a[24 * i + 8] * v[1][j] + a[24 * i + 16] * v[2][j];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                s[i][j] = m[0][i] * m[0][j] + m[1][i] * m[1][j] + m[2][i] * m[2][j];
        for (int sweep = 0; sweep < 6; sweep++) {
            const float off = fabsf(s[0][1]) + fabsf(s[0][2]) + fabsf(s[1][2]);
            if (off <= 1e-6f * (s[0][0] + s[1][1] + s[2][2])) break;
            for (int i = 0; i < 2; i++)
                for (int j = i + 1; j < 3; j++) {
                    if (s[i][j] == 0) continue;
                    const float theta = 0.5f * (s[j][j] - s[i][i]) / s[i][j];
                    const float t =
                        (theta < 0 ? -1 : 1) / (fabsf(theta) + sqrtf(theta * theta + 1));
                    const float cosine = 1 / sqrtf(t * t + 1), sine = t * cosine;
                    for (int k = 0; k < 3; k++) {
                        const float x = s[k][i], y = s[k][j];
                        s[k][i] = cosine * x - sine * y, s[k][j] = sine * x + cosine * y;
                    }
                    for (int k = 0; k < 3; k++) {
                        const float x = s[i][k], y = s[j][k], p = v[k][i], q = v[k][j];
                        s[i][k] = cosine * x - sine * y, s[j][k] = sine * x + cosine * y;
                        v[k][i] = cosine * p - sine * q, v[k][j] = sine * p + cosine * q;
                    }
                }
        }
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                w[i][j] = 0;
                for (int k = 0; k < 3; k++)
                    w[i][j] += v[i][k] * v[j][k] / sqrtf(fmaxf(s[k][k], FLT_MIN));
            }
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                r[8 * (3 * i + j)] =
                    a[24 * i] * w[0][j] + a[24 * i + 8] * w[1][j] + a[24 * i + 16] * w[2][j];
        for (int i = 0; i < 9; i++) axes[8 * i] = v[i / 3][i % 3];
    }
}

// ---- LAPACK, and the reference ----

static void nearest(const double a[9], double r[9])
{
    double at[9], s[3], u[9], vt[9], work[64];
    const int n = 3, work_size = 64;
    int info;
    for (int i = 0; i < 9; i++) at[i] = a[i % 3 * 3 + i / 3];
    dgesvd_("A", "A", &n, &n, at, &n, s, u, &n, vt, &n, work, &work_size, &info);
    // By columns: U_ij = u[3 j + i], (V^T)_ij = vt[3 j + i].
    for (int sign = 1; sign >= -1; sign -= 2) {
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                r[3 * i + j] =
                    u[i] * vt[3 * j] + u[3 + i] * vt[3 * j + 1] + sign * u[6 + i] * vt[3 * j + 2];
        if (r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                r[2] * (r[3] * r[7] - r[4] * r[6]) >
            0)
            return;
    }
}

static void lapack(regions *set)
{
    for (int l = 0; l < 8 * LAPACK_BLOCKS; l++) {
        double a[9], r[9];
        for (int i = 0; i < 9; i++) a[i] = set->a[l / 8 * 72 + 8 * i + l % 8];
        nearest(a, r);
        for (int i = 0; i < 9; i++) set->r[l / 8 * 72 + 8 * i + l % 8] = (float)r[i];
    }
}

// ---- Floors ----

// As many bytes as any method that starts from q must move: A and q in, q and R out.
static PLIANT_VECTOR_CLONES void only_move(regions *set)
{
    for (int b = 0; b < BLOCKS; b++) {
        const lanes one = LOAD(set->q + 32 * b);
        for (int i = 0; i < 4; i++)
            STORE(set->q + 32 * b + 8 * i, LOAD(set->q + 32 * b + 8 * i) + 0);
        for (int i = 0; i < 9; i++)
            STORE(set->r + 72 * b + 8 * i, LOAD(set->a + 72 * b + 8 * i) + one);
    }
}

// 1e6 times twelve independent multiply-adds of eight lanes.
static PLIANT_VECTOR_CLONES void multiply_add(float *values)
{
    lanes x[12];
    for (int i = 0; i < 12; i++) x[i] = LOAD(values + 8 * i);
    for (int n = 0; n < 1000000; n++)
        for (int i = 0; i < 12; i++) x[i] = x[i] * 0.99f + 0.5f;
    for (int i = 0; i < 12; i++) STORE(values + 8 * i, x[i]);
}

// ---- Sets of matrices ----

static uint64_t random_state = 12345;

static double uniform(void)  // in (-1, 1)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return 2 * ((double)(random_state >> 11) / 9007199254740992.0) - 1;
}

static void random_turn(double angle, double q[4])
{
    double length = 0;
    while (length < 0.1 || length > 1) {
        for (int i = 0; i < 3; i++) q[i] = uniform();
        length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    }
    for (int i = 0; i < 3; i++) q[i] *= sin(angle / 2) / length;
    q[3] = cos(angle / 2);
}

static void matrix_of(const double q[4], double r[9])
{
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(r, m, sizeof m);
}

typedef struct kind {
    const char *name;
    double third;  // scales the third stretch
    double angle;  // between the start and the result; < 0: the start is no rotation at all
} kind;

// A = R V diag(1 + 0.3 u) V^T; the last step's matrix was off by `angle`, V by as much.
static void make(const kind *how, regions *set, float *q, float *axes)
{
    for (int l = 0; l < 8 * BLOCKS; l++) {
        double turn[4], off[4], own[4], r[9], v[9], o[9];
        random_turn(M_PI * uniform(), turn);
        random_turn(M_PI * uniform(), own);
        random_turn(fmax(how->angle, 0), off);
        matrix_of(turn, r);
        matrix_of(own, v);
        matrix_of(off, o);
        const double s[3] = {1 + 0.3 * uniform(), 1 + 0.3 * uniform(),
                             how->third * (1 + 0.3 * uniform())};
        double u[9] = {0};
        for (int i = 0; i < 27; i++)
            u[i / 9 * 3 + i / 3 % 3] += v[i / 9 * 3 + i % 3] * s[i % 3] * v[i / 3 % 3 * 3 + i % 3];
        for (int i = 0; i < 9; i++) {
            double a = 0, axis = 0;
            for (int k = 0; k < 3; k++) {
                a += r[i / 3 * 3 + k] * u[3 * k + i % 3];
                axis += o[i / 3 * 3 + k] * v[3 * k + i % 3];
            }
            set->a[l / 8 * 72 + 8 * i + l % 8] = (float)a;
            axes[l / 8 * 72 + 8 * i + l % 8] = how->angle < 0 ? i % 4 == 0 : (float)axis;
        }
        const double start[4] = {
            turn[3] * off[0] + turn[0] * off[3] + turn[1] * off[2] - turn[2] * off[1],
            turn[3] * off[1] + turn[1] * off[3] + turn[2] * off[0] - turn[0] * off[2],
            turn[3] * off[2] + turn[2] * off[3] + turn[0] * off[1] - turn[1] * off[0],
            turn[3] * off[3] - turn[0] * off[0] - turn[1] * off[1] - turn[2] * off[2]};
        for (int i = 0; i < 4; i++)
            q[l / 8 * 32 + 8 * i + l % 8] = how->angle < 0 ? i == 3 : (float)start[i];
    }
}

static double cpu_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

int main(void)
{
    static const struct {
        const char *name;
        void (*run)(regions *set);
        int blocks;
    } methods[] = {
        {"Newton, one solution, unchecked", solve_once, BLOCKS},
        {"Newton, two: the library's", solve_twice, BLOCKS},
        {"Newton, four: the library's twice", solve_four_times, BLOCKS},
        {"Jacobi on A^T A (the paper's), scalar", jacobi, BLOCKS},
        {"Mueller 2016, five steps", mueller, BLOCKS},
        {"Higham, three steps", higham_three, BLOCKS},
        {"Higham, six steps", higham_six, BLOCKS},
        {"FOAM, four root steps", foam, BLOCKS},
        {"LAPACK dgesvd, one by one, scalar", lapack, LAPACK_BLOCKS},
        {"(A and q read, q and R written)", only_move, BLOCKS},
    };
    static const kind kinds[] = {
        {"30% strain, 0.02 rad a step", 1, 0.02},
        {"30% strain, 0.1 rad a step", 1, 0.1},
        {"30% strain, cold", 1, -1},
        {"s3 = 0.001, 0.02 rad", 1e-3, 0.02},
        {"s3 = 0.001, cold", 1e-3, -1},
        {"inverted, s3 = -0.4, 0.02 rad", -0.4, 0.02},
    };
    const size_t big = (size_t)BLOCKS * 72, small = (size_t)BLOCKS * 32;
    float *memory = aligned_alloc(64, (4 * big + 2 * small) * sizeof *memory);
    double *expected = malloc(big * sizeof *expected);
    if (!memory || !expected) return 1;
    regions set = {memory, memory + big, memory + big + small, memory + 2 * big + small};
    float *q = memory + 3 * big + small, *axes = q + small;

    float values[96] = {0};
    double runs[RUNS];
    for (int run = 0; run < RUNS; run++) {
        const double start = cpu_ns();
        multiply_add(values);
        runs[run] = cpu_ns() - start;
    }
    const double rate = 12e6 * 8 / median(runs, RUNS);
    printf("%d regions; multiply-adds: %.1f a ns, which is %.1f ns for the 214 of a region\n",
           8 * BLOCKS, rate, 214 / rate);
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        make(&kinds[k], &set, q, axes);
        for (int l = 0; l < 8 * BLOCKS; l++) {
            double a[9];
            for (int i = 0; i < 9; i++) a[i] = set.a[l / 8 * 72 + 8 * i + l % 8];
            nearest(a, expected + 9 * l);
        }
        printf("\n%-40s %10s %12s %12s\n", kinds[k].name, "ns/region", "error, rms", "worst");
        for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
            for (int run = 0; run < RUNS; run++) {
                memcpy(set.q, q, small * sizeof *q);
                memcpy(set.axes, axes, big * sizeof *axes);
                const double start = cpu_ns();
                methods[m].run(&set);
                runs[run] = (cpu_ns() - start) / (8 * methods[m].blocks);
            }
            double sum = 0, worst = 0;
            for (int l = 0; l < 8 * methods[m].blocks; l++) {
                double square = 0;
                for (int i = 0; i < 9; i++) {
                    const double d = set.r[l / 8 * 72 + 8 * i + l % 8] - expected[9 * l + i];
                    square += d * d;
                }
                sum += square;
                if (!(square <= worst)) worst = square;
            }
            printf("%-40s %10.1f", methods[m].name, median(runs, RUNS));
            if (methods[m].run == only_move) printf("\n");
            else printf(" %12.1e %12.1e\n", sqrt(sum / (8 * methods[m].blocks)), sqrt(worst));
        }
    }
    free(expected);
    free(memory);
    return 0;
}
