// polar.c: rotations of lanes whose last rotation is of little use, and the whole of it.
//
// Three routes, each for the lanes that the one before left:
//   1. pliant_polar_try (polar_block.h) from the start: the common case.
//   2. From far: Davenport's largest eigenvalue by Newton's method on its quartic, from above,
//   where
//      it cannot lead to another; a step with it, then 1 again. Three times at most.
//   3. One by one, in double: all eigenvectors by Jacobi's method. Left to it are maxima that are
//      hardly unique, and starts that are exactly stationary.
//
// This follows: Shuster & Oh, Three-axis attitude determination from vector observations, 1981
// (QUEST: the quartic); Markley, Attitude determination using vector observations: a fast optimal
// matrix algorithm, 1993 (FOAM: its coefficients by |A|, det A, |adj A|); Golub & Van Loan, Matrix
// Computations, 8.5 (cyclic Jacobi).
#include "lattice/polar.h"

#include "pliant/vector_clones.h"

#include "lattice/polar_block.h"

#include <math.h>

// Newton steps on the quartic: 30% strain takes two to round-off; near-double roots take as many as
// one likes, and the step that follows needs the root only roughly.
#define ROOT_STEPS 4
#define FAR_TRIES  3
// Eigenvalues this close, relative to |A|, are one: a hundredth of a float's rounding would tell
// them apart no better. A mixture of their eigenvectors leaves half of it as residual.
#define DOUBLE_ROOT 1e-6
// Sweeps of Jacobi's method on a 4 x 4 matrix: double precision is reached in five.
#define SWEEP_LIMIT 12

static PLIANT_VECTOR_CLONES int32_t try_group(const float *a, float *q, float *rotation,
                                              int32_t *missed)
{
    return pliant_polar_try(PLIANT_POLAR_GROUP, a, q, rotation, missed);
}

static PLIANT_VECTOR_CLONES int32_t try_block(const float *a, float *q, float *rotation,
                                              int32_t *missed)
{
    return pliant_polar_try(1, a, q, rotation, missed);
}

// What is no unit quaternion becomes no rotation.
static void replace_unsound(float *q)
{
    for (int k = 0; k < 8; k++) {
        float length = 0;
        for (int i = 0; i < 4; i++) length += q[8 * i + k] * q[8 * i + k];
        if (fabsf(length - 1) < PLIANT_POLAR_UNIT) continue;
        for (int i = 0; i < 4; i++) q[8 * i + k] = i == 3;
    }
}

// q, shape [4][8], moves towards the maximum, however far that is.
static PLIANT_VECTOR_CLONES void come_near(const float *a, float *q)
{
    pliant_polar_lanes m[9], r[9], to[4], turn[4], inverse, n = {0}, square = {0};
    const pliant_polar_lanes two = n + 2;
    pliant_polar_masks kept;
    pliant_polar_frame f;
    pliant_polar_scale(a, m, &kept);
    for (int i = 0; i < 4; i++) to[i] = *(const pliant_polar_memory *)(q + 8 * i);
    pliant_polar_matrix(to, &two, r);
    pliant_polar_look(r, m, &f);

    // (lambda^2 - |A|^2)^2 - 8 lambda det A - 4 |adj A|^2 = 0; sqrt(3) |A| >= lambda.
    const pliant_polar_lanes adjoint[9] = {
        m[4] * m[8] - m[5] * m[7], m[5] * m[6] - m[3] * m[8], m[3] * m[7] - m[4] * m[6],
        m[7] * m[2] - m[8] * m[1], m[8] * m[0] - m[6] * m[2], m[6] * m[1] - m[7] * m[0],
        m[1] * m[5] - m[2] * m[4], m[2] * m[3] - m[0] * m[5], m[0] * m[4] - m[1] * m[3]};
    const pliant_polar_lanes determinant =
        m[0] * adjoint[0] + m[1] * adjoint[1] + m[2] * adjoint[2];
    for (int i = 0; i < 9; i++) {
        n += m[i] * m[i];
        square += adjoint[i] * adjoint[i];
    }
    const pliant_polar_lanes most = 3 * n;
    pliant_polar_inverse_root(&most, &inverse);
    pliant_polar_lanes lambda = most * inverse;
    for (int step = 0; step < ROOT_STEPS; step++) {
        const pliant_polar_lanes excess = lambda * lambda - n;
        const pliant_polar_lanes value = excess * excess - 8 * lambda * determinant - 4 * square;
        const pliant_polar_lanes slope = 4 * (lambda * excess - 2 * determinant);
        const pliant_polar_lanes next = lambda - value / slope;
        // Round-off near a double root may lead up, or nowhere at all.
        const pliant_polar_masks falls = (next < lambda) & (next > 0.0f);
        pliant_polar_put(&falls, &next, &lambda);
    }
    const pliant_polar_lanes trace = 0.25f * (f.diagonal[0] + f.diagonal[1] + f.diagonal[2]);
    const pliant_polar_lanes shift = lambda - trace;
    pliant_polar_solve(&f, &shift, turn);
    pliant_polar_apply(turn, to);
    pliant_polar_square(to, &n);
    pliant_polar_inverse_root(&n, &inverse);
    for (int i = 0; i < 4; i++) *(pliant_polar_memory *)(q + 8 * i) = inverse * to[i];
}

// ---- One by one ----

// Eigenvectors (columns of v) of the symmetric k, whose diagonal becomes the eigenvalues.
static void diagonalise(double k[4][4], double v[4][4])
{
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) v[i][j] = i == j;
    for (int sweep = 0; sweep < SWEEP_LIMIT; sweep++) {
        double off = 0;
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < i; j++) off += fabs(k[i][j]);
        if (off < 1e-18) return;
        for (int i = 0; i < 3; i++)
            for (int j = i + 1; j < 4; j++) {
                if (k[i][j] == 0) continue;
                const double theta = 0.5 * (k[j][j] - k[i][i]) / k[i][j];
                const double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
                const double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int l = 0; l < 4; l++) {
                    const double x = k[l][i], y = k[l][j];
                    k[l][i] = c * x - s * y;
                    k[l][j] = s * x + c * y;
                }
                for (int l = 0; l < 4; l++) {
                    const double x = k[i][l], y = k[j][l];
                    k[i][l] = c * x - s * y;
                    k[j][l] = s * x + c * y;
                    const double p = v[l][i], q = v[l][j];
                    v[l][i] = c * p - s * q;
                    v[l][j] = s * p + c * q;
                }
            }
    }
}

// The unit quaternion of the largest eigenvalue of a's Davenport matrix, nearest to the unit q.
static void solve_lane(const float *a, const float start[4], float result[4])
{
    double m[9], largest = 0, square = 0;
    for (int i = 0; i < 9; i++) largest = fmax(largest, fabs((double)a[8 * i]));
    for (int i = 0; i < 9; i++) {
        m[i] = a[8 * i] / largest;
        square += m[i] * m[i];
    }
    double k[4][4] = {
        {m[0] - m[4] - m[8], m[1] + m[3], m[2] + m[6], m[7] - m[5]},
        {m[1] + m[3], m[4] - m[0] - m[8], m[5] + m[7], m[2] - m[6]},
        {m[2] + m[6], m[5] + m[7], m[8] - m[0] - m[4], m[3] - m[1]},
        {m[7] - m[5], m[2] - m[6], m[3] - m[1], m[0] + m[4] + m[8]},
    };
    double v[4][4];
    diagonalise(k, v);
    int best = 0;
    for (int i = 1; i < 4; i++)
        if (k[i][i] > k[best][best]) best = i;

    // The start projected on the eigenvectors that are as good as the best.
    const double limit = k[best][best] - DOUBLE_ROOT * sqrt(square);
    double q[4] = {0}, length = 0;
    for (int i = 0; i < 4; i++) {
        if (k[i][i] < limit) continue;
        double along = 0;
        for (int l = 0; l < 4; l++) along += v[l][i] * start[l];
        for (int l = 0; l < 4; l++) q[l] += along * v[l][i];
    }
    for (int l = 0; l < 4; l++) length += q[l] * q[l];
    // Exactly opposite: all are equally near.
    const int opposite = length < 1e-12;
    const double scale = opposite ? 1 : 1 / sqrt(length);
    for (int l = 0; l < 4; l++) result[l] = (float)(opposite ? v[l][best] : scale * q[l]);
}

// rotation, shape [9][8] from its lane on, of a unit quaternion.
static void rotation_of(const float q[4], float *rotation)
{
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double s = 2 / (x * x + y * y + z * z + w * w);
    const double r[9] = {1 - s * (y * y + z * z), s * (x * y - w * z),     s * (x * z + w * y),
                         s * (x * y + w * z),     1 - s * (x * x + z * z), s * (y * z - w * x),
                         s * (x * z - w * y),     s * (y * z + w * x),     1 - s * (x * x + y * y)};
    for (int i = 0; i < 9; i++) rotation[8 * i] = (float)r[i];
}

void pliant_polar_finish(const float *a, const int32_t missed[8], float *q, float *rotation)
{
    int32_t left[8], left_count = 0, again[8];
    float near[4 * 8], found[4 * 8], turned[9 * 8];
    for (int k = 0; k < 8; k++) left_count += left[k] = missed[k] != 0;
    replace_unsound(q);
    memcpy(near, q, sizeof near);
    for (int tries = 0; left_count > 0 && tries < FAR_TRIES; tries++) {
        come_near(a, near);
        replace_unsound(near);
        memcpy(found, near, sizeof found);
        try_block(a, found, turned, again);
        for (int k = 0; k < 8; k++) {
            if (!left[k] || again[k]) continue;
            float along = 0;
            for (int i = 0; i < 4; i++) along += found[8 * i + k] * q[8 * i + k];
            for (int i = 0; i < 4; i++)
                q[8 * i + k] = along < 0 ? -found[8 * i + k] : found[8 * i + k];
            for (int i = 0; i < 9; i++) rotation[8 * i + k] = turned[8 * i + k];
            left[k] = 0;
            left_count--;
        }
    }
    for (int k = 0; k < 8; k++) {
        if (!left[k]) continue;
        const float start[4] = {q[k], q[8 + k], q[16 + k], q[24 + k]};
        float result[4];
        solve_lane(a + k, start, result);
        for (int i = 0; i < 4; i++) q[8 * i + k] = result[i];
        rotation_of(result, rotation + k);
    }
}

void pliant_polar_blocks(int32_t block_count, const float *a, float *q, float *rotation)
{
    int32_t missed[8 * PLIANT_POLAR_GROUP];
    int32_t b = 0;
    for (; b + PLIANT_POLAR_GROUP <= block_count; b += PLIANT_POLAR_GROUP) {
        if (!try_group(a + 72 * b, q + 32 * b, rotation + 72 * b, missed)) continue;
        for (int32_t i = b; i < b + PLIANT_POLAR_GROUP; i++)
            pliant_polar_finish(a + 72 * i, missed + 8 * (i - b), q + 32 * i, rotation + 72 * i);
    }
    for (; b < block_count; b++)
        if (try_block(a + 72 * b, q + 32 * b, rotation + 72 * b, missed))
            pliant_polar_finish(a + 72 * b, missed, q + 32 * b, rotation + 72 * b);
}
