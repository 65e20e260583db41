// test_columns.c: the summation kernels against their plain-C reference.
#include "check.h"

#include "columns.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { row_total = 97, block_total = 61 };

static const char *const names[] = {"avx512", "avx2", "plain"};

static void fill(check_random *random, float *values, size_t count)
{
    for (size_t i = 0; i < count; i++) values[i] = (float)(2 * check_random_next(random) - 1);
}

static void every_kernel_equals_the_reference_for_every_count(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    static float block[9 * block_total];
    static _Alignas(64) float expected[4 * row_total], found[4 * row_total], start[4 * row_total];
    int32_t row[block_total];
    fill(&random, block, 9 * block_total);
    for (int32_t e = 0; e < block_total; e++) row[e] = e + e / 3 + (e > 40 ? 15 : 0);
    assert_in_range(row[block_total - 1], 0, row_total - 1);
    for (int32_t r = 0; r < row_total; r++) {
        fill(&random, start + 4 * r, 3);
        start[4 * r + 3] = 0;
    }
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        pliant_columns_kernel *kernel = pliant_columns_kernel_named(names[k]);
        if (!kernel) {
            print_message("skipped: no %s here\n", names[k]);
            continue;
        }
        for (size_t count = 0; count <= block_total; count++) {
            float value[3];
            fill(&random, value, 3);
            memcpy(expected, start, sizeof start);
            memcpy(found, start, sizeof start);
            pliant_columns_add_plain(row, block, count, value, expected);
            kernel(row, block, count, value, found);
            // Three products and sums of numbers below one, fused or not: 4 roundings of at most 4
            // u.
            for (int i = 0; i < 4 * row_total; i++) check_near(found[i], expected[i], 16 * 0x1p-24);
            for (int r = 0; r < row_total; r++) assert_true(found[4 * r + 3] == 0);
        }
    }
}

static void the_reference_multiplies_by_row_major_blocks(void **state)
{
    (void)state;
    const float block[9] = {1, 2, 3, 4, 5, 6, 7, 8, 9}, value[3] = {1, 10, 100};
    _Alignas(16) float g[8] = {0, 0, 0, 0, 1, 1, 1, 0};
    const int32_t row[1] = {1};
    pliant_columns_add_plain(row, block, 1, value, g);
    const float expected[8] = {0, 0, 0, 0, 322, 655, 988, 0};
    assert_memory_equal(g, expected, sizeof g);
}

static void no_kernel_reads_past_the_last_block(void **state)
{
    (void)state;
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    char *memory = mmap(NULL, 4 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    assert_true(memory != MAP_FAILED);
    // Blocks end at one forbidden page, rows at another.
    assert_int_equal(mprotect(memory + page, page, PROT_NONE), 0);
    assert_int_equal(mprotect(memory + 3 * page, page, PROT_NONE), 0);
    static _Alignas(64) float g[4 * 16];
    const float value[3] = {1, 1, 1};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        pliant_columns_kernel *kernel = pliant_columns_kernel_named(names[k]);
        for (size_t count = 0; kernel && count <= 13; count++) {
            const float *block = (const float *)(void *)(memory + page) - 9 * count;
            int32_t *row = (int32_t *)(void *)(memory + 3 * page) - count;
            for (size_t e = 0; e < count; e++) row[e] = (int32_t)e;
            kernel(row, block, count, value, g);  // a fault ends the program
        }
    }
    munmap(memory, 4 * page);
}

static void the_weight_of_a_column_is_its_largest_number(void **state)
{
    (void)state;
    float block[27] = {0};
    block[5] = -3, block[12] = 2, block[26] = 7;
    const uint64_t offset[4] = {0, 1, 3, 3};
    const int32_t row[3] = {0, 0, 1};
    const pliant_columns columns = {.count = 3, .offset = offset, .row = row, .block = block};
    check_near(pliant_columns_weight(&columns, 0), 3, 0);
    check_near(pliant_columns_weight(&columns, 1), 7, 0);
    check_near(pliant_columns_weight(&columns, 2), 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kernel_equals_the_reference_for_every_count),
        cmocka_unit_test(the_reference_multiplies_by_row_major_blocks),
        cmocka_unit_test(no_kernel_reads_past_the_last_block),
        cmocka_unit_test(the_weight_of_a_column_is_its_largest_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
