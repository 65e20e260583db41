// polar_block.h: the quick part of polar.h, for kernels that have the matrices in registers.
//
// Include it in a file whose kernel is a static PLIANT_VECTOR_CLONES function (vector_clones.h). It
// is written with gcc's vector extension, which clang shares: one 256-bit or two 128-bit operations
// of each line. Vectors go by pointer, because by value their calling convention would differ by
// clone. (Loops over the lanes were tried: gcc 12 gives up on the comparisons.)
//
// This follows: R is sought as a turn R0 R(p) of the last rotation, p = tan(angle / 2) axis. With
// B = R0^T A, S = B + B^T, z = axial(B - B^T), Davenport's matrix in that frame is
//   K = [tr B, z^T; z, S - tr B I],   tr(R^T A) = (1, p)^T K (1, p) / (1 + |p|^2)
// whose largest eigenvalue lambda has (M + (lambda - tr B) I) p = z, M = 2 tr B I - S (Shuster &
// Oh, Three-axis attitude determination from vector observations, 1981: QUEST). Newton's method
// on the rotation vector takes lambda = tr B; with p as the step it is Rayleigh quotient
// iteration, so that an angle e becomes O(e^3). The Rayleigh quotient of that p is lambda to
// O(e^6), and a second solution in the same frame then leaves O(e^7).
#pragma once

#include <stdint.h>
#include <string.h>

typedef float pliant_polar_lanes __attribute__((vector_size(32)));
typedef int32_t pliant_polar_masks __attribute__((vector_size(32)));  // 0 or -1; or floats' bits

typedef int64_t pliant_polar_pairs __attribute__((vector_size(32)));
// Eight numbers in memory. (memcpy is done in halves, which the loads of the whole then wait for.)
typedef float pliant_polar_memory __attribute__((vector_size(32), aligned(4), may_alias));

#define PLIANT_POLAR_INLINE static inline __attribute__((always_inline))

// A lane is done when |axial(B - B^T)| <= this |A| and the maximum is a strict one.
#define PLIANT_POLAR_RESIDUAL 1e-6f
// ... that is when det(2 tr B I - S) >= this |A|^2, with A scaled to |A| = 1/3 to 2: then s2 + s3
// > 1e-6 |A| or so, and its sign is no matter of round-off.
#define PLIANT_POLAR_DEFINITE 2e-5f
// Blocks that one call of pliant_polar_try may take, phase by phase: a block is one long chain of
// operations, so that a core has the time for another in between (bench_polar: 25%).
#define PLIANT_POLAR_GROUP 3
// A start further from |q|^2 = 1 than this is none.
#define PLIANT_POLAR_UNIT 1e-3f

// mask ? yes : *no, into *no.
PLIANT_POLAR_INLINE void pliant_polar_put(const pliant_polar_masks *mask,
                                          const pliant_polar_lanes *yes, pliant_polar_lanes *no)
{
    *no = (pliant_polar_lanes)((*mask & (pliant_polar_masks)*yes) |
                               (~*mask & (pliant_polar_masks)*no));
}

// 1 / sqrt(a) of normal numbers, to about two units in the last place: a guess from the halved
// exponent (error 3.4%), then Newton: 1.8e-3, 4.6e-6, 3.2e-11.
PLIANT_POLAR_INLINE void pliant_polar_inverse_root(const pliant_polar_lanes *a,
                                                   pliant_polar_lanes *result)
{
    const pliant_polar_lanes half = 0.5f * *a;
    pliant_polar_lanes y = (pliant_polar_lanes)(0x5F375A86 - ((pliant_polar_masks)*a >> 1));
    for (int step = 0; step < 3; step++) y *= 1.5f - half * y * y;
    *result = y;
}

PLIANT_POLAR_INLINE void pliant_polar_square(const pliant_polar_lanes q[4],
                                             pliant_polar_lanes *square)
{
    *square = q[0] * q[0] + q[1] * q[1] + (q[2] * q[2] + q[3] * q[3]);
}

// r, shape [9], of a quaternion of any length, *twice = 2 / |q|^2.
PLIANT_POLAR_INLINE void pliant_polar_matrix(const pliant_polar_lanes q[4],
                                             const pliant_polar_lanes *twice,
                                             pliant_polar_lanes r[9])
{
    const pliant_polar_lanes x2 = *twice * q[0], y2 = *twice * q[1], z2 = *twice * q[2];
    const pliant_polar_lanes xx = x2 * q[0], yy = y2 * q[1], zz = z2 * q[2];
    const pliant_polar_lanes xy = x2 * q[1], xz = x2 * q[2], yz = y2 * q[2];
    r[0] = 1 - (yy + zz), r[1] = xy - z2 * q[3], r[2] = xz + y2 * q[3];
    r[3] = xy + z2 * q[3], r[4] = 1 - (xx + zz), r[5] = yz - x2 * q[3];
    r[6] = xz - y2 * q[3], r[7] = yz + x2 * q[3], r[8] = 1 - (xx + yy);
}

// What a frame R says of A: z, and M by its diagonal and, negated, the rest.
typedef struct pliant_polar_frame {
    pliant_polar_lanes z[3], diagonal[3], xy, xz, yz;
} pliant_polar_frame;

PLIANT_POLAR_INLINE void pliant_polar_look(const pliant_polar_lanes r[9],
                                           const pliant_polar_lanes a[9], pliant_polar_frame *f)
{
    pliant_polar_lanes b[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            b[3 * i + j] = r[i] * a[j] + (r[3 + i] * a[3 + j] + r[6 + i] * a[6 + j]);
    f->z[0] = b[7] - b[5], f->z[1] = b[2] - b[6], f->z[2] = b[3] - b[1];
    f->diagonal[0] = 2 * (b[4] + b[8]), f->diagonal[1] = 2 * (b[0] + b[8]);
    f->diagonal[2] = 2 * (b[0] + b[4]);
    f->xy = b[1] + b[3], f->xz = b[2] + b[6], f->yz = b[5] + b[7];
}

// The turn (p, 1) as a quaternion times det(M + shift I): nothing divides, half turns have w = 0.
PLIANT_POLAR_INLINE void pliant_polar_solve(const pliant_polar_frame *f,
                                            const pliant_polar_lanes *shift,
                                            pliant_polar_lanes turn[4])
{
    const pliant_polar_lanes x = f->diagonal[0] + *shift, y = f->diagonal[1] + *shift;
    const pliant_polar_lanes w = f->diagonal[2] + *shift;
    const pliant_polar_lanes cxx = y * w - f->yz * f->yz, cxy = f->xy * w + f->xz * f->yz;
    const pliant_polar_lanes cxz = f->xy * f->yz + y * f->xz, cyy = x * w - f->xz * f->xz;
    const pliant_polar_lanes cyz = x * f->yz + f->xy * f->xz, czz = x * y - f->xy * f->xy;
    turn[0] = cxx * f->z[0] + (cxy * f->z[1] + cxz * f->z[2]);
    turn[1] = cxy * f->z[0] + (cyy * f->z[1] + cyz * f->z[2]);
    turn[2] = cxz * f->z[0] + (cyz * f->z[1] + czz * f->z[2]);
    turn[3] = x * cxx - (f->xy * cxy + f->xz * cxz);
}

// q = q t.
PLIANT_POLAR_INLINE void pliant_polar_apply(const pliant_polar_lanes t[4], pliant_polar_lanes q[4])
{
    const pliant_polar_lanes x = q[3] * t[0] + q[0] * t[3] + (q[1] * t[2] - q[2] * t[1]);
    const pliant_polar_lanes y = q[3] * t[1] + q[1] * t[3] + (q[2] * t[0] - q[0] * t[2]);
    const pliant_polar_lanes z = q[3] * t[2] + q[2] * t[3] + (q[0] * t[1] - q[1] * t[0]);
    const pliant_polar_lanes w = q[3] * t[3] - q[0] * t[0] - (q[1] * t[1] + q[2] * t[2]);
    q[0] = x, q[1] = y, q[2] = z, q[3] = w;
}

// m, shape [9]: a times the power of two that brings the sum of |a_rc| into [1, 2). *kept: the
// lane's rotation stays, because a is zero, denormal, beyond 1e37 or not finite; then m is no use.
PLIANT_POLAR_INLINE void pliant_polar_scale(const float *a, pliant_polar_lanes m[9],
                                            pliant_polar_masks *kept)
{
    pliant_polar_lanes size[9];
    for (int i = 0; i < 9; i++) {
        m[i] = *(const pliant_polar_memory *)(a + 8 * i);
        size[i] = (pliant_polar_lanes)((pliant_polar_masks)m[i] & 0x7fffffff);
    }
    const pliant_polar_lanes sum = (size[0] + size[1] + (size[2] + size[3])) +
                                   (size[4] + size[5] + (size[6] + size[7])) + size[8];
    const pliant_polar_masks exponent = (pliant_polar_masks)sum & 0x7f800000;
    const pliant_polar_lanes scale = (pliant_polar_lanes)(0x7f000000 - exponent);
    *kept = (exponent == 0) | (exponent >= 0x7f000000);
    for (int i = 0; i < 9; i++) m[i] *= scale;
}

// What a block carries from phase to phase of pliant_polar_try.
typedef struct pliant_polar_work {
    pliant_polar_lanes m[9];            // A, scaled
    pliant_polar_lanes q[4], to[4];     // the start, and where it leads, of any length
    pliant_polar_lanes r[9], twice;     // the matrix of one of them, and 2 / |to|^2
    pliant_polar_lanes turn[4], shift;  // p and 1, and lambda - tr B
    pliant_polar_masks kept;
    pliant_polar_frame f;
} pliant_polar_work;

// lambda - tr B = z . p / (1 + |p|^2) by the first solution.
PLIANT_POLAR_INLINE void pliant_polar_shift(pliant_polar_work *w)
{
    const pliant_polar_lanes *z = w->f.z, *p = w->turn;
    pliant_polar_lanes length;
    pliant_polar_square(p, &length);
    w->shift = (z[0] * p[0] + (z[1] * p[1] + z[2] * p[2])) * p[3] / length;
}

// Lanes that keep their rotation do not turn.
PLIANT_POLAR_INLINE void pliant_polar_turn(pliant_polar_work *w)
{
    for (int i = 0; i < 4; i++) {
        w->turn[i] = (pliant_polar_lanes)((pliant_polar_masks)w->turn[i] & ~w->kept);
        w->to[i] = w->q[i];
    }
    w->turn[3] = (pliant_polar_lanes)((pliant_polar_masks)w->turn[3] | (w->kept & 0x3f800000));
    pliant_polar_apply(w->turn, w->to);
    pliant_polar_lanes length;
    pliant_polar_square(w->to, &length);
    w->twice = 2 / length;
}

// Which lanes are done: comparisons that numbers that are none fail.
PLIANT_POLAR_INLINE void pliant_polar_judge(const pliant_polar_work *w, pliant_polar_masks *done)
{
    const pliant_polar_frame *f = &w->f;
    pliant_polar_lanes size = {0};
    for (int i = 0; i < 9; i++) size += w->m[i] * w->m[i];
    const pliant_polar_lanes residual = f->z[0] * f->z[0] + (f->z[1] * f->z[1] + f->z[2] * f->z[2]);
    const pliant_polar_lanes minor = f->diagonal[0] * f->diagonal[1] - f->xy * f->xy;
    const pliant_polar_lanes determinant = f->diagonal[2] * minor -
                                           f->yz * (f->diagonal[0] * f->yz + f->xy * f->xz) -
                                           f->xz * (f->diagonal[1] * f->xz + f->xy * f->yz);
    pliant_polar_lanes length;
    pliant_polar_square(w->q, &length);
    const pliant_polar_masks sound =
        (length > 1 - PLIANT_POLAR_UNIT) & (length < 1 + PLIANT_POLAR_UNIT);
    *done = sound & (w->kept | ((residual <= PLIANT_POLAR_RESIDUAL * PLIANT_POLAR_RESIDUAL * size) &
                                (f->diagonal[0] > 0.0f) & (minor > 0.0f) &
                                (determinant >= PLIANT_POLAR_DEFINITE * size)));
}

// Takes the unit quaternion on the start's side where the lane is done.
PLIANT_POLAR_INLINE int32_t pliant_polar_take(pliant_polar_work *w, const pliant_polar_masks *done,
                                              float *q, float *rotation, int32_t missed[8])
{
    const pliant_polar_lanes half = 0.5f * w->twice;  // 1 / |to|^2
    pliant_polar_lanes root;
    pliant_polar_inverse_root(&half, &root);
    pliant_polar_lanes inverse = half * root;
    inverse = (pliant_polar_lanes)((pliant_polar_masks)inverse ^
                                   ((pliant_polar_masks)w->turn[3] & (int32_t)0x80000000));
    for (int i = 0; i < 4; i++) {
        const pliant_polar_lanes unit = inverse * w->to[i];
        pliant_polar_put(done, &unit, &w->q[i]);
        *(pliant_polar_memory *)(q + 8 * i) = w->q[i];
    }
    for (int i = 0; i < 9; i++) *(pliant_polar_memory *)(rotation + 8 * i) = w->r[i];
    const pliant_polar_masks misses = ~*done;
    *(pliant_polar_memory *)missed = (pliant_polar_lanes)misses;
    const pliant_polar_pairs pairs = (pliant_polar_pairs)misses;
    return (pairs[0] | pairs[1] | pairs[2] | pairs[3]) != 0;
}

// One step for `count` blocks of eight lanes (a constant, at most PLIANT_POLAR_GROUP); a, q and
// rotation hold them one after another, shaped as in polar.h. Lanes that are not done keep their
// start and have missed[lane] != 0, and no rotation: pliant_polar_finish. Returns whether there are
// any.
PLIANT_POLAR_INLINE int32_t pliant_polar_try(int count, const float *a, float *q, float *rotation,
                                             int32_t *missed)
{
    pliant_polar_work work[PLIANT_POLAR_GROUP], *const end = work + count;
    const pliant_polar_lanes none = {0}, two = none + 2;
    int32_t any = 0;
    for (int b = 0; b < count; b++) pliant_polar_scale(a + 72 * b, work[b].m, &work[b].kept);
    for (int b = 0; b < count; b++)
        for (int i = 0; i < 4; i++)
            work[b].q[i] = *(const pliant_polar_memory *)(q + 32 * b + 8 * i);
    for (pliant_polar_work *w = work; w < end; w++) pliant_polar_matrix(w->q, &two, w->r);
    for (pliant_polar_work *w = work; w < end; w++) pliant_polar_look(w->r, w->m, &w->f);
    for (pliant_polar_work *w = work; w < end; w++) pliant_polar_solve(&w->f, &none, w->turn);
    for (pliant_polar_work *w = work; w < end; w++) pliant_polar_shift(w);
    for (pliant_polar_work *w = work; w < end; w++) pliant_polar_solve(&w->f, &w->shift, w->turn);
    for (pliant_polar_work *w = work; w < end; w++) pliant_polar_turn(w);
    for (pliant_polar_work *w = work; w < end; w++) pliant_polar_matrix(w->to, &w->twice, w->r);
    for (pliant_polar_work *w = work; w < end; w++) pliant_polar_look(w->r, w->m, &w->f);
    for (int b = 0; b < count; b++) {
        pliant_polar_masks done;
        pliant_polar_judge(&work[b], &done);
        any |= pliant_polar_take(&work[b], &done, q + 32 * b, rotation + 72 * b, missed + 8 * b);
    }
    return any;
}
