// compact.c: sparse block columns in half precision: conversion, and the kernel that adds them.
#include "compact.h"

#include <math.h>
#include <string.h>

_Static_assert(sizeof(pliant_compact_block) == 20, "a block is 20 bytes");

// ---- Halves: IEEE 754 binary16 ----

float pliant_half_to_float(uint16_t half)
{
    const uint32_t sign = (uint32_t)(half & 0x8000) << 16, magnitude = half & 0x7fff;
    if (magnitude < 0x400) {  // subnormal or zero: a multiple of 2^-24
        const float value = (float)magnitude * 0x1p-24f;
        return sign ? -value : value;
    }
    // Shift exponent and mantissa into place and correct the exponent's bias, 15 to 127; infinities
    // and NaNs (quiet, as the processor makes them) keep the largest exponent.
    uint32_t bits = sign | ((magnitude << 13) + ((127 - 15) << 23));
    if (magnitude >= 0x7c00) bits |= 0x7f800000;
    if (magnitude > 0x7c00) bits |= 0x00400000;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

uint16_t pliant_half_from_float(float value)
{
    const uint16_t sign = signbit(value) ? 0x8000 : 0;
    const float magnitude = fabsf(value);
    if (isnan(value)) return sign | 0x7e00;
    if (magnitude >= 65520) return sign | 0x7c00;  // half way from the largest half to 2^16
    if (magnitude < 0x1p-14f) return sign | (uint16_t)rintf(magnitude * 0x1p24f);
    uint32_t bits;
    memcpy(&bits, &magnitude, sizeof bits);
    // Ties to even: add just under half a unit, and the last bit that stays.
    bits += 0xfff + (bits >> 13 & 1);
    return sign | (uint16_t)((bits >> 13) - ((127 - 15) << 10));
}

// ---- Conversion ----

static const int least_exponent = -100;

void pliant_compact_lay_out(pliant_arena *arena, const pliant_columns *columns,
                            pliant_compact_columns *compact)
{
    PLIANT_TAKE(arena, compact->scale, columns->count);
    PLIANT_TAKE(arena, compact->block, columns->offset[columns->count] + 1);
}

void pliant_compact_fill(const pliant_columns *columns, pliant_compact_columns *compact)
{
    compact->offset = columns->offset;
    for (int32_t j = 0; j < columns->count; j++) {
        int exponent = 0;
        (void)frexpf(pliant_columns_weight(columns, j), &exponent);
        // Columns of nearly nothing use less of the range, so that both factors are normal numbers.
        if (exponent < least_exponent) exponent = least_exponent;
        const float factor = ldexpf(1, 15 - exponent);
        compact->scale[j] = ldexpf(1, exponent - 15);
        for (uint64_t e = columns->offset[j]; e < columns->offset[j + 1]; e++) {
            pliant_compact_block *to = &compact->block[e];
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++)
                    to->column[c][r] =
                        pliant_half_from_float(columns->block[9 * e + (size_t)(3 * r + c)] * factor);
            to->row = (uint16_t)columns->row[e];
        }
    }
}

// ---- Kernels ----

void pliant_compact_add_plain(const pliant_compact_block *block, size_t count, const float *value,
                              float *g)
{
    for (size_t e = 0; e < count; e++, block++) {
        float *to = g + 4 * (size_t)block->row;
        for (int r = 0; r < 3; r++)
            to[r] += pliant_half_to_float(block->column[0][r]) * value[0] +
                     pliant_half_to_float(block->column[1][r]) * value[1] +
                     pliant_half_to_float(block->column[2][r]) * value[2];
    }
}

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>

// Fetched ahead of use, as in columns.c.
enum { prefetch_blocks = 32 };

// One block: four halves from each column on, of which the fourth, the next column's or the row,
// meets a zero or is cleared.
__attribute__((target("avx,f16c,fma"))) static void
add_f16c(const pliant_compact_block *block, size_t count, const float *value, float *g)
{
    const __m128 x = _mm_setr_ps(value[0], value[0], value[0], 0);
    const __m128 y = _mm_setr_ps(value[1], value[1], value[1], 0);
    const __m128 z = _mm_setr_ps(value[2], value[2], value[2], 0);
    for (size_t e = 0; e < count; e++, block++) {
        _mm_prefetch((const char *)(block + prefetch_blocks), _MM_HINT_T0);
        const __m128 c0 = _mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)block->column[0]));
        const __m128 c1 = _mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)block->column[1]));
        const __m128 c2 = _mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)block->column[2]));
        float *to = g + 4 * (size_t)block->row;
        __m128 sum = _mm_fmadd_ps(c0, x, _mm_load_ps(to));
        sum = _mm_fmadd_ps(c1, y, sum);
        sum = _mm_fmadd_ps(_mm_blend_ps(c2, _mm_setzero_ps(), 8), z, sum);
        _mm_store_ps(to, sum);
    }
}

// Four blocks, 40 halves: 16 from column c of the first block on hold that column in lanes 0 to 2, and
// the second block's in lanes 10 to 12; likewise the other two blocks. The last load ends two halves
// behind the fourth block.
__attribute__((target("avx512f,avx512vl,f16c,fma"))) static void
add_avx512(const pliant_compact_block *block, size_t count, const float *value, float *g)
{
    const __m512i gather = _mm512_setr_epi32(0, 1, 2, 0, 10, 11, 12, 0, 16, 17, 18, 0, 26, 27, 28, 0);
    const __mmask16 xyz = 0x7777;
    const __m512 x = _mm512_set1_ps(value[0]), y = _mm512_set1_ps(value[1]);
    const __m512 z = _mm512_set1_ps(value[2]);
#define COLUMN(c)                                                                                  \
    _mm512_maskz_permutex2var_ps(                                                                  \
        xyz, _mm512_cvtph_ps(_mm256_loadu_si256((const __m256i *)block[0].column[c])), gather,     \
        _mm512_cvtph_ps(_mm256_loadu_si256((const __m256i *)block[2].column[c])))
    size_t e = 0;
    for (; e + 4 <= count; e += 4, block += 4) {
        _mm_prefetch((const char *)(block + prefetch_blocks), _MM_HINT_T0);
        const __m512 c0 = COLUMN(0), c1 = COLUMN(1), c2 = COLUMN(2);
        const __m512 sum = _mm512_fmadd_ps(c2, z, _mm512_fmadd_ps(c1, y, _mm512_mul_ps(c0, x)));
        float *to0 = g + 4 * (size_t)block[0].row, *to1 = g + 4 * (size_t)block[1].row;
        float *to2 = g + 4 * (size_t)block[2].row, *to3 = g + 4 * (size_t)block[3].row;
        _mm_store_ps(to0, _mm_add_ps(_mm_load_ps(to0), _mm512_castps512_ps128(sum)));
        _mm_store_ps(to1, _mm_add_ps(_mm_load_ps(to1), _mm512_extractf32x4_ps(sum, 1)));
        _mm_store_ps(to2, _mm_add_ps(_mm_load_ps(to2), _mm512_extractf32x4_ps(sum, 2)));
        _mm_store_ps(to3, _mm_add_ps(_mm_load_ps(to3), _mm512_extractf32x4_ps(sum, 3)));
    }
#undef COLUMN
    if (e < count) add_f16c(block, count - e, value, g);
}

pliant_compact_kernel *pliant_compact_kernel_named(const char *name)
{
    __builtin_cpu_init();
    const int f16c = __builtin_cpu_supports("f16c") != 0 && __builtin_cpu_supports("fma") != 0;
    if (strcmp(name, "avx512") == 0 && f16c && __builtin_cpu_supports("avx512f") &&
        __builtin_cpu_supports("avx512vl"))
        return add_avx512;
    if (strcmp(name, "f16c") == 0 && f16c) return add_f16c;
    return strcmp(name, "plain") == 0 ? pliant_compact_add_plain : NULL;
}

#else

pliant_compact_kernel *pliant_compact_kernel_named(const char *name)
{
    return strcmp(name, "plain") == 0 ? pliant_compact_add_plain : NULL;
}

#endif

pliant_compact_kernel *pliant_compact_kernel_best(void)
{
    pliant_compact_kernel *kernel = pliant_compact_kernel_named("avx512");
    return kernel ? kernel : pliant_compact_kernel_named("f16c");
}
