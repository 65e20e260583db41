// compact.c: sparse block columns in half precision: conversion, and the kernel that adds them.
#include "compact.h"

#include <math.h>
#include <string.h>

_Static_assert(sizeof(pliant_compact_group) == 96, "a group is three registers of halves");

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

static uint64_t group_count(const pliant_columns *columns, int32_t column)
{
    return (columns->offset[column + 1] - columns->offset[column] + 3) / 4;
}

void pliant_compact_lay_out(pliant_arena *arena, const pliant_columns *columns,
                            pliant_compact_columns *compact)
{
    uint64_t groups = 0;
    for (int32_t j = 0; j < columns->count; j++) groups += group_count(columns, j);
    PLIANT_TAKE(arena, compact->offset, columns->count + 1);
    PLIANT_TAKE(arena, compact->scale, columns->count);
    PLIANT_TAKE(arena, compact->group, groups);
}

void pliant_compact_fill(const pliant_columns *columns, pliant_compact_columns *compact)
{
    compact->offset[0] = 0;
    for (int32_t j = 0; j < columns->count; j++) {
        int exponent = 0;
        (void)frexpf(pliant_columns_weight(columns, j), &exponent);
        // Columns of nearly nothing use less of the range, so that both factors are normal numbers.
        if (exponent < least_exponent) exponent = least_exponent;
        const float factor = ldexpf(1, 15 - exponent);
        compact->scale[j] = ldexpf(1, exponent - 15);

        const uint64_t begin = columns->offset[j], count = columns->offset[j + 1] - begin;
        const uint64_t groups = group_count(columns, j);
        pliant_compact_group *group = compact->group + compact->offset[j];
        memset(group, 0, groups * sizeof *group);
        for (uint64_t i = 0; i < 4 * groups; i++) {
            uint16_t(*to)[4][4] = group[i / 4].column;
            const uint64_t e = begin + (i < count ? i : count - 1);
            to[0][i % 4][3] = (uint16_t)columns->row[e];
            for (int c = 0; c < 3 && i < count; c++)
                for (int r = 0; r < 3; r++)
                    to[c][i % 4][r] = pliant_half_from_float(
                        columns->block[9 * e + 3 * (size_t)r + (size_t)c] * factor);
        }
        compact->offset[j + 1] = compact->offset[j] + groups;
    }
}

// ---- Kernels ----

void pliant_compact_add_plain(const pliant_compact_group *group, size_t count, const float *value,
                              float *g)
{
    for (size_t i = 0; i < 4 * count; i++) {
        const uint16_t(*from)[4][4] = group[i / 4].column;
        const size_t b = i % 4;
        float *to = g + 4 * (size_t)from[0][b][3];
        for (int r = 0; r < 3; r++)
            to[r] += pliant_half_to_float(from[0][b][r]) * value[0] +
                     pliant_half_to_float(from[1][b][r]) * value[1] +
                     pliant_half_to_float(from[2][b][r]) * value[2];
    }
}

#if defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>
#include <immintrin.h>

// clang's __builtin_cpu_supports does not know F16C; AVX says that the system keeps the registers.
int32_t pliant_half_in_hardware(void)
{
    unsigned a, b, c = 0, d;
    return __get_cpuid(1, &a, &b, &c, &d) && (c & bit_F16C) && __builtin_cpu_supports("avx");
}

__attribute__((target("avx,f16c,fma"))) static void
add_f16c(const pliant_compact_group *group, size_t count, const float *value, float *g)
{
    const __m128 x = _mm_set1_ps(value[0]), y = _mm_set1_ps(value[1]), z = _mm_set1_ps(value[2]);
    for (const pliant_compact_group *end = group + count; group < end; group++)
        for (int b = 0; b < 4; b++) {
            const __m128 c0 = _mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)group->column[0][b]));
            const __m128 c1 = _mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)group->column[1][b]));
            const __m128 c2 = _mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)group->column[2][b]));
            float *to = g + 4 * (size_t)group->column[0][b][3];
            // The row, read as a half, is cleared.
            __m128 sum = _mm_mul_ps(_mm_blend_ps(c0, _mm_setzero_ps(), 8), x);
            sum = _mm_fmadd_ps(c2, z, _mm_fmadd_ps(c1, y, sum));
            _mm_store_ps(to, _mm_add_ps(_mm_load_ps(to), sum));
        }
}

__attribute__((target("avx512f,avx512vl,f16c,fma"))) static void
add_avx512(const pliant_compact_group *group, size_t count, const float *value, float *g)
{
    const __mmask16 xyz = 0x7777;
    const __m512 x = _mm512_set1_ps(value[0]), y = _mm512_set1_ps(value[1]);
    const __m512 z = _mm512_set1_ps(value[2]);
#define COLUMN(c) _mm256_load_si256((const __m256i *)group->column[c])
#define ROW(b)    (g + 4 * (size_t)group->column[0][b][3])
    for (const pliant_compact_group *end = group + count; group < end; group++) {
        __m512 sum = _mm512_mul_ps(_mm512_maskz_cvtph_ps(xyz, COLUMN(0)), x);
        sum = _mm512_fmadd_ps(_mm512_cvtph_ps(COLUMN(1)), y, sum);
        sum = _mm512_fmadd_ps(_mm512_cvtph_ps(COLUMN(2)), z, sum);
        float *to0 = ROW(0), *to1 = ROW(1), *to2 = ROW(2), *to3 = ROW(3);
        // One after the other: the rows of a last group may be one.
        _mm_store_ps(to0, _mm_add_ps(_mm_load_ps(to0), _mm512_castps512_ps128(sum)));
        _mm_store_ps(to1, _mm_add_ps(_mm_load_ps(to1), _mm512_extractf32x4_ps(sum, 1)));
        _mm_store_ps(to2, _mm_add_ps(_mm_load_ps(to2), _mm512_extractf32x4_ps(sum, 2)));
        _mm_store_ps(to3, _mm_add_ps(_mm_load_ps(to3), _mm512_extractf32x4_ps(sum, 3)));
    }
#undef COLUMN
#undef ROW
}

pliant_compact_kernel *pliant_compact_kernel_named(const char *name)
{
    __builtin_cpu_init();
    const int f16c = pliant_half_in_hardware() && __builtin_cpu_supports("fma");
    if (strcmp(name, "avx512") == 0 && f16c && __builtin_cpu_supports("avx512f") &&
        __builtin_cpu_supports("avx512vl"))
        return add_avx512;
    if (strcmp(name, "f16c") == 0 && f16c) return add_f16c;
    return strcmp(name, "plain") == 0 ? pliant_compact_add_plain : NULL;
}

#else

int32_t pliant_half_in_hardware(void)
{
    return 0;
}

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
