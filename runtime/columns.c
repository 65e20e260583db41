// columns.c: the kernel that adds sparse block columns into a vector of rows.
//
// A 3x3 block times a vector is three FMAs on (column of the block) x (one component), so all
// versions gather block columns from the row-major file order. Four blocks are 36 floats; with 16
// lanes their columns c = 0, 1, 2 come out of two loads at c and 18 + c through one and the same
// two-source permutation, and the last load ends exactly at the fourth block's last float.
#include "columns.h"

#include <math.h>
#include <string.h>

void pliant_columns_add_plain(const int32_t *row, const float *block, size_t count,
                              const float *value, float *g)
{
    for (size_t e = 0; e < count; e++, block += 9) {
        float *to = g + 4 * (size_t)row[e];
        for (int r = 0; r < 3; r++)
            to[r] +=
                block[3 * r] * value[0] + block[3 * r + 1] * value[1] + block[3 * r + 2] * value[2];
    }
}

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>

// Lines of the block array fetched ahead of use. The hardware's own prefetcher needs several
// lines before it follows a stream, and a column is only 20 to 40 lines long.
enum { prefetch_floats = 16 * 12 };

__attribute__((target("avx512f,avx512vl,fma"))) static void
add_avx512(const int32_t *row, const float *block, size_t count, const float *value, float *g)
{
    // Lanes 4b .. 4b+2 take column c of block b; lane 4b+3 is cleared.
    const __m512i gather =
        _mm512_setr_epi32(0, 3, 6, 0, 9, 12, 15, 0, 16, 19, 22, 0, 25, 28, 31, 0);
    const __mmask16 xyz = 0x7777;
    const __m512 x = _mm512_set1_ps(value[0]), y = _mm512_set1_ps(value[1]);
    const __m512 z = _mm512_set1_ps(value[2]);

    size_t e = 0;
    for (; e + 4 <= count; e += 4, block += 36) {
        _mm_prefetch((const char *)(block + prefetch_floats), _MM_HINT_T0);
        _mm_prefetch((const char *)(block + prefetch_floats + 16), _MM_HINT_T0);
        const __m512 c0 = _mm512_maskz_permutex2var_ps(xyz, _mm512_loadu_ps(block), gather,
                                                       _mm512_loadu_ps(block + 18));
        const __m512 c1 = _mm512_maskz_permutex2var_ps(xyz, _mm512_loadu_ps(block + 1), gather,
                                                       _mm512_loadu_ps(block + 19));
        const __m512 c2 = _mm512_maskz_permutex2var_ps(xyz, _mm512_loadu_ps(block + 2), gather,
                                                       _mm512_loadu_ps(block + 20));
        const __m512 sum = _mm512_fmadd_ps(c2, z, _mm512_fmadd_ps(c1, y, _mm512_mul_ps(c0, x)));
        float *to0 = g + 4 * (size_t)row[e], *to1 = g + 4 * (size_t)row[e + 1];
        float *to2 = g + 4 * (size_t)row[e + 2], *to3 = g + 4 * (size_t)row[e + 3];
        _mm_store_ps(to0, _mm_add_ps(_mm_load_ps(to0), _mm512_castps512_ps128(sum)));
        _mm_store_ps(to1, _mm_add_ps(_mm_load_ps(to1), _mm512_extractf32x4_ps(sum, 1)));
        _mm_store_ps(to2, _mm_add_ps(_mm_load_ps(to2), _mm512_extractf32x4_ps(sum, 2)));
        _mm_store_ps(to3, _mm_add_ps(_mm_load_ps(to3), _mm512_extractf32x4_ps(sum, 3)));
    }
    for (; e < count; e++, block += 9) {
        // One block: nine floats under a mask, its columns in the low lanes.
        const __m512 all = _mm512_maskz_loadu_ps(0x1ff, block);
        const __m128 c0 = _mm512_castps512_ps128(_mm512_maskz_permutexvar_ps(7, gather, all));
        const __m512i one = _mm512_set1_epi32(1);
        const __m512i gather1 = _mm512_add_epi32(gather, one);
        const __m512i gather2 = _mm512_add_epi32(gather1, one);
        const __m128 c1 = _mm512_castps512_ps128(_mm512_maskz_permutexvar_ps(7, gather1, all));
        const __m128 c2 = _mm512_castps512_ps128(_mm512_maskz_permutexvar_ps(7, gather2, all));
        float *to = g + 4 * (size_t)row[e];
        __m128 sum = _mm_mul_ps(c0, _mm512_castps512_ps128(x));
        sum = _mm_fmadd_ps(c1, _mm512_castps512_ps128(y), sum);
        sum = _mm_fmadd_ps(c2, _mm512_castps512_ps128(z), sum);
        _mm_store_ps(to, _mm_add_ps(_mm_load_ps(to), sum));
    }
}

// Two blocks, 18 floats: column c of the first from a load at c, of the second from one at 8 + c.
__attribute__((target("avx2,fma"))) static void add_avx2(const int32_t *row, const float *block,
                                                         size_t count, const float *value, float *g)
{
    const __m256i first = _mm256_setr_epi32(0, 3, 6, 0, 0, 0, 0, 0);
    const __m256i second = _mm256_setr_epi32(0, 0, 0, 0, 1, 4, 7, 1);
    const __m256 xyz = _mm256_castsi256_ps(_mm256_setr_epi32(-1, -1, -1, 0, -1, -1, -1, 0));
    const __m256 x = _mm256_set1_ps(value[0]), y = _mm256_set1_ps(value[1]);
    const __m256 z = _mm256_set1_ps(value[2]);
#define COLUMN(c)                                                                                  \
    _mm256_blend_ps(_mm256_permutevar8x32_ps(_mm256_loadu_ps(block + (c)), first),                 \
                    _mm256_permutevar8x32_ps(_mm256_loadu_ps(block + 8 + (c)), second), 0xf0)
    size_t e = 0;
    for (; e + 2 <= count; e += 2, block += 18) {
        _mm_prefetch((const char *)(block + prefetch_floats), _MM_HINT_T0);
        __m256 sum = _mm256_mul_ps(COLUMN(0), x);
        sum = _mm256_fmadd_ps(COLUMN(1), y, sum);
        sum = _mm256_and_ps(_mm256_fmadd_ps(COLUMN(2), z, sum), xyz);
        float *to0 = g + 4 * (size_t)row[e], *to1 = g + 4 * (size_t)row[e + 1];
        _mm_store_ps(to0, _mm_add_ps(_mm_load_ps(to0), _mm256_castps256_ps128(sum)));
        _mm_store_ps(to1, _mm_add_ps(_mm_load_ps(to1), _mm256_extractf128_ps(sum, 1)));
    }
#undef COLUMN
    if (e < count) pliant_columns_add_plain(row + e, block, 1, value, g);
}

pliant_columns_kernel *pliant_columns_kernel_named(const char *name)
{
    __builtin_cpu_init();
    const int fma = __builtin_cpu_supports("fma") != 0;
    if (strcmp(name, "avx512") == 0 && fma && __builtin_cpu_supports("avx512f") &&
        __builtin_cpu_supports("avx512vl"))
        return add_avx512;
    if (strcmp(name, "avx2") == 0 && fma && __builtin_cpu_supports("avx2")) return add_avx2;
    return strcmp(name, "plain") == 0 ? pliant_columns_add_plain : NULL;
}

#else

pliant_columns_kernel *pliant_columns_kernel_named(const char *name)
{
    return strcmp(name, "plain") == 0 ? pliant_columns_add_plain : NULL;
}

#endif

pliant_columns_kernel *pliant_columns_kernel_best(void)
{
    static const char *const names[] = {"avx512", "avx2", "plain"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        pliant_columns_kernel *kernel = pliant_columns_kernel_named(names[i]);
        if (kernel) return kernel;
    }
    return pliant_columns_add_plain;
}

float pliant_columns_weight(const pliant_columns *columns, int32_t column)
{
    const float *end = columns->block + 9 * columns->offset[column + 1];
    float weight = 0;
    for (const float *b = columns->block + 9 * columns->offset[column]; b < end; b++)
        weight = fmaxf(weight, fabsf(*b));
    return weight;
}
