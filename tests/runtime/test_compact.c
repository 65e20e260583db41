// test_compact.c: half precision, the copy of columns in it, and its kernels against the reference.
#include "check.h"

#include "compact.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
__attribute__((target("avx,f16c"))) static float widen(uint16_t half)
{
    return _cvtsh_ss(half);
}
__attribute__((target("avx,f16c"))) static uint16_t narrow(float value)
{
    return _cvtss_sh(value, 0);
}
#else
static float widen(uint16_t half)
{
    return pliant_half_to_float(half);
}
static uint16_t narrow(float value)
{
    return pliant_half_from_float(value);
}
#endif

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static float float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void every_half_is_the_float_that_the_standard_says_and_comes_back(void **state)
{
    (void)state;
    for (uint32_t half = 0; half < 65536; half++) {
        const double sign = half & 0x8000 ? -1 : 1;
        const int exponent = half >> 10 & 31;
        const double mantissa = half & 0x3ff;
        const float found = pliant_half_to_float((uint16_t)half);
        if (exponent == 31 && mantissa > 0) {
            assert_true(isnan(found));
            assert_true(isnan(pliant_half_to_float(pliant_half_from_float(found))));
            continue;
        }
        const double expected = exponent == 31  ? sign * INFINITY
                                : exponent == 0 ? sign * ldexp(mantissa, -24)
                                                : sign * ldexp(1024 + mantissa, exponent - 25);
        assert_true(found == (float)expected);
        assert_int_equal(signbit(found) != 0, half >> 15);
        assert_int_equal(pliant_half_from_float(found), half);
    }
}

static void floats_become_the_nearest_half_ties_to_even(void **state)
{
    (void)state;
    // Between every two neighbours, the middle and the floats beside it, by definition of rounding.
    for (uint32_t half = 0; half < 0x7bff; half++) {
        const float below = pliant_half_to_float((uint16_t)half);
        const float above = pliant_half_to_float((uint16_t)(half + 1));
        const float middle = below + (above - below) / 2;  // exact: one more bit
        const uint32_t even = half % 2 ? half + 1 : half;
        assert_int_equal(pliant_half_from_float(middle), even);
        assert_int_equal(pliant_half_from_float(-middle), even | 0x8000);
        assert_int_equal(pliant_half_from_float(nextafterf(middle, 0)), half);
        assert_int_equal(pliant_half_from_float(nextafterf(middle, INFINITY)), half + 1);
    }
    // The largest is 65504; half a step beyond, 65520, rounds to what would be even: infinity.
    assert_int_equal(pliant_half_from_float(nextafterf(65520, 0)), 0x7bff);
    assert_int_equal(pliant_half_from_float(65520), 0x7c00);
    assert_int_equal(pliant_half_from_float(-INFINITY), 0xfc00);
}

static void conversions_are_those_of_the_processor(void **state)
{
    (void)state;
    if (!pliant_half_in_hardware()) skip();
    for (uint32_t half = 0; half < 65536; half++)
        assert_int_equal(bits_of(pliant_half_to_float((uint16_t)half)),
                         bits_of(widen((uint16_t)half)));
    for (uint64_t bits = 0; bits <= UINT32_MAX; bits += 4093) {
        const float value = float_of((uint32_t)bits);
        if (!isnan(value)) assert_int_equal(pliant_half_from_float(value), narrow(value));
    }
}

// ---- Columns ----

enum { row_count = 97, column_count = 24 };

typedef struct sample {
    pliant_columns columns;
    uint64_t offset[column_count + 1];
    int32_t row[column_count * column_count];
    float block[9 * column_count * column_count];
    pliant_compact_columns compact;
    pliant_arena arena;
} sample;

// Column j has j blocks (so that groups end everywhere) of size 10^(j - 12); the last is tiny.
static sample *make_sample(void)
{
    check_random random = check_random_seed(1);
    sample *s = calloc(1, sizeof *s);
    assert_non_null(s);
    for (int32_t j = 0; j < column_count; j++) {
        const double size = j == column_count - 1 ? 1e-37 : pow(10, j - 12);
        s->offset[j + 1] = s->offset[j] + (uint64_t)j;
        for (int32_t i = 0; i < j; i++) {
            const size_t e = s->offset[j] + (size_t)i;
            s->row[e] = i * (row_count / j) + j % 3;
            for (int k = 0; k < 9; k++)
                s->block[9 * e + (size_t)k] =
                    (float)(size * (2 * check_random_next(&random) - 1) * pow(10, -(k % 4)));
        }
    }
    s->columns = (pliant_columns){
        .count = column_count, .offset = s->offset, .row = s->row, .block = s->block};
    pliant_error err = {""};
    pliant_compact_lay_out(&s->arena, &s->columns, &s->compact);
    check_ok(pliant_arena_reserve(&s->arena, &err), &err);
    pliant_compact_lay_out(&s->arena, &s->columns, &s->compact);
    pliant_compact_fill(&s->columns, &s->compact);
    return s;
}

static void free_sample(sample *s)
{
    pliant_arena_release(&s->arena);
    free(s);
}

static void a_copy_holds_every_number_to_half_precision(void **state)
{
    (void)state;
    sample *s = make_sample();
    for (int32_t j = 0; j < column_count; j++) {
        const uint64_t groups = s->compact.offset[j + 1] - s->compact.offset[j];
        assert_int_equal(groups, ((uint64_t)j + 3) / 4);
        const float weight = pliant_columns_weight(&s->columns, j), scale = s->compact.scale[j];
        if (j > 0 && weight > 1e-30f)
            assert_true(weight / scale >= 0x1p14f && weight / scale < 0x1p15f);
        for (int32_t i = 0; i < 4 * (int32_t)groups; i++) {
            const pliant_compact_group *group = s->compact.group + s->compact.offset[j] + i / 4;
            const uint16_t(*from)[4][4] = group->column;
            const size_t e = s->offset[j] + (size_t)(i < j ? i : j - 1);
            assert_int_equal(from[0][i % 4][3], s->row[e]);
            for (int c = 0; c < 3; c++)
                for (int r = 0; r < 3; r++) {
                    const float found = scale * pliant_half_to_float(from[c][i % 4][r]);
                    const float expected = i < j ? s->block[9 * e + (size_t)(3 * r + c)] : 0;
                    // Eleven bits, down to the subnormal halves: 2^-25 of at least 2^14.
                    check_near(found, expected, 0x1p-11 * fabs(expected) + 0x1p-25 * (double)scale);
                }
        }
    }
    free_sample(s);
}

static void every_kernel_adds_what_the_reference_adds(void **state)
{
    (void)state;
    static const char *const names[] = {"avx512", "f16c", "plain"};
    static _Alignas(64) float expected[4 * row_count], found[4 * row_count];
    check_random random = check_random_seed(2);
    sample *s = make_sample();
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        pliant_compact_kernel *kernel = pliant_compact_kernel_named(names[k]);
        if (!kernel) {
            print_message("skipped: no %s here\n", names[k]);
            continue;
        }
        for (int32_t j = 0; j < column_count; j++) {
            const pliant_compact_group *group = s->compact.group + s->compact.offset[j];
            const size_t groups = (size_t)(s->compact.offset[j + 1] - s->compact.offset[j]);
            float value[3];
            for (int c = 0; c < 3; c++)
                value[c] = (float)(2 * check_random_next(&random) - 1) * 0x1p-15f;
            for (int i = 0; i < 4 * row_count; i++)
                expected[i] = i % 4 == 3 ? 0 : (float)(2 * check_random_next(&random) - 1);
            memcpy(found, expected, sizeof found);
            pliant_compact_add_plain(group, groups, value, expected);
            kernel(group, groups, value, found);
            // Three products and sums of numbers below one, fused or not: 4 roundings of at most 4
            // u.
            for (int i = 0; i < 4 * row_count; i++) check_near(found[i], expected[i], 16 * 0x1p-24);
            for (int r = 0; r < row_count; r++) assert_true(found[4 * r + 3] == 0);
        }
    }
    free_sample(s);
}

static void the_reference_multiplies_by_the_columns(void **state)
{
    (void)state;
    const float block[9] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    const uint64_t offset[2] = {0, 1};
    const int32_t row[1] = {1};
    const pliant_columns columns = {.count = 1, .offset = offset, .row = row, .block = block};
    pliant_compact_columns compact = {0};
    pliant_arena arena = {0};
    pliant_compact_lay_out(&arena, &columns, &compact);
    check_ok(pliant_arena_reserve(&arena, NULL), &(pliant_error){""});
    pliant_compact_lay_out(&arena, &columns, &compact);
    pliant_compact_fill(&columns, &compact);
    // Small whole numbers and a power of two: nothing is rounded.
    const float scale = compact.scale[0], value[3] = {1 * scale, 10 * scale, 100 * scale};
    _Alignas(16) float g[8] = {0, 0, 0, 0, 1, 1, 1, 0};
    pliant_compact_add_plain(compact.group, 1, value, g);
    const float expected[8] = {0, 0, 0, 0, 322, 655, 988, 0};
    assert_memory_equal(g, expected, sizeof g);
    pliant_arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_half_is_the_float_that_the_standard_says_and_comes_back),
        cmocka_unit_test(floats_become_the_nearest_half_ties_to_even),
        cmocka_unit_test(conversions_are_those_of_the_processor),
        cmocka_unit_test(a_copy_holds_every_number_to_half_precision),
        cmocka_unit_test(every_kernel_adds_what_the_reference_adds),
        cmocka_unit_test(the_reference_multiplies_by_the_columns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
