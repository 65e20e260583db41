// float_mode.h: how a thread treats denormal floats, to set for a step and to put back.
//
// A body that comes to rest fills with denormals, which cost some processors a hundred cycles each.
// A step flushes them to zero (FTZ, DAZ) and restores the caller's mode at its end:
//
//     const pliant_float_mode before = pliant_float_mode_flush();
//     ...                              // in functions of their own: the compiler knows of no order
//     pliant_float_mode_set(before);
//
// Where the machine has no such mode these do nothing.
#pragma once

#include <stdint.h>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

typedef uint64_t pliant_float_mode;

static inline pliant_float_mode pliant_float_mode_get(void)
{
#if defined(__SSE2__)
    return _mm_getcsr();
#elif defined(__aarch64__)
    uint64_t mode;
    __asm__ volatile("mrs %0, fpcr" : "=r"(mode));
    return mode;
#else
    return 0;
#endif
}

static inline void pliant_float_mode_set(pliant_float_mode mode)
{
#if defined(__SSE2__)
    _mm_setcsr((unsigned)mode);
#elif defined(__aarch64__)
    __asm__ volatile("msr fpcr, %0" : : "r"(mode));
#else
    (void)mode;
#endif
}

// Flush denormal results and operands to zero from now on; returns the mode before.
static inline pliant_float_mode pliant_float_mode_flush(void)
{
    const pliant_float_mode before = pliant_float_mode_get();
#if defined(__SSE2__)
    pliant_float_mode_set(before | 0x8040);  // FTZ, DAZ
#elif defined(__aarch64__)
    pliant_float_mode_set(before | (uint64_t)1 << 24);  // FZ
#endif
    return before;
}
