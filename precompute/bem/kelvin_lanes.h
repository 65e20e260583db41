// kelvin_lanes.h: the fundamental solutions of element.h for eight values of r at once.
//
// Written with gcc's vector extension, which clang shares: the compiler makes one 512-bit, two
// 256-bit or four 128-bit operations of each line, by the clone of the function that it is inlined
// into. Vectors go by pointer, because by value their calling convention would differ by clone.
#pragma once

#include "bem/element.h"

#include <stdint.h>

enum { PLIANT_LANES = 8 };
typedef double pliant_lanes __attribute__((vector_size(8 * PLIANT_LANES)));
typedef uint64_t pliant_lane_bits __attribute__((vector_size(8 * PLIANT_LANES)));

// One clone of a function for each generation of vector units; the machine at hand decides. For
// static functions only: clang 14 gives others a name that their callers do not find.
#if defined(__x86_64__)
#define PLIANT_VECTOR_CLONES                                                                       \
    __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define PLIANT_VECTOR_CLONES
#endif

// a * b + c may round once: -std=c11 forbids it to gcc, clang does it anyway.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("fp-contract=fast")
#endif

#define PLIANT_LANES_INLINE static inline __attribute__((always_inline))

// 1 / sqrt(a), to about two units in the last place. A guess from the halved exponent (error 3.4%),
// then Newton: 1.8e-3, 4.6e-6, 3.2e-11, 1.5e-21. The multiply-add units do all of it: the far field
// takes 0.225 s (bench_bem), with the hardware's square root and division 0.237 s.
PLIANT_LANES_INLINE void inverse_root(const pliant_lanes *a, pliant_lanes *result)
{
    const pliant_lanes half = 0.5 * *a;
    pliant_lanes y = (pliant_lanes)(0x5FE6EB50C7B537A9u - ((pliant_lane_bits)*a >> 1));
    for (int step = 0; step < 4; step++) y *= 1.5 - half * y * y;
    *result = y;
}

// The 15 kernels at r, times *scale. *d = r . n; shear_normal = (1 - 2 nu) n.
PLIANT_LANES_INLINE void evaluate_kernels(const pliant_kelvin_constants *constants,
                                          const double shear_normal[3], const pliant_lanes r[3],
                                          const pliant_lanes *d, const pliant_lanes *scale,
                                          pliant_lanes kernels[PLIANT_INTEGRAL_COUNT])
{
    // r^2 in units of the body's size, so that 1e-60 is lost in any r but zero. There (the caller
    // masks such lanes with scale 0, or the mesh touches itself) it keeps the numbers finite.
    const pliant_lanes r2 = r[0] * r[0] + (r[1] * r[1] + (r[2] * r[2] + 1e-60));
    pliant_lanes inverse;
    inverse_root(&r2, &inverse);
    const pliant_lanes a1 = inverse * *scale, inverse2 = inverse * inverse, a3 = a1 * inverse2;
    const pliant_lanes g[3] = {r[0] * a3, r[1] * a3, r[2] * a3};
    const pliant_lanes xx = r[0] * g[0], yy = r[1] * g[1], zz = r[2] * g[2];
    const pliant_lanes u = constants->diagonal * a1;
    const pliant_lanes d3 = 3 * *d * inverse2, s = constants->shear * *d * a3;

    pliant_lanes *U = kernels + PLIANT_INTEGRAL_U;
    U[0] = xx + u;
    U[1] = yy + u;
    U[2] = zz + u;
    U[3] = r[0] * g[1];
    U[4] = r[0] * g[2];
    U[5] = r[1] * g[2];

    pliant_lanes *S = kernels + PLIANT_INTEGRAL_S;
    S[0] = d3 * xx + s;
    S[1] = d3 * yy + s;
    S[2] = d3 * zz + s;
    S[3] = d3 * U[3];
    S[4] = d3 * U[4];
    S[5] = d3 * U[5];

    pliant_lanes *w = kernels + PLIANT_INTEGRAL_W;
    w[0] = g[1] * shear_normal[2] - g[2] * shear_normal[1];
    w[1] = g[2] * shear_normal[0] - g[0] * shear_normal[2];
    w[2] = g[0] * shear_normal[1] - g[1] * shear_normal[0];
}
