// test_arena.c: measure, reserve, carve.
#include "check.h"

#include "pliant/arena.h"

#include <stdint.h>
#include <string.h>

typedef struct parts {
    double *numbers;
    char *text;
    int32_t *nothing;
    float *last;
} parts;

static void lay_out(pliant_arena *arena, parts *p)
{
    PLIANT_TAKE(arena, p->numbers, 9);
    PLIANT_TAKE(arena, p->text, 1);
    PLIANT_TAKE(arena, p->nothing, 0);
    PLIANT_TAKE(arena, p->last, 17);
}

static void what_is_measured_is_carved_zeroed_and_aligned(void **state)
{
    (void)state;
    pliant_arena arena = {0};
    pliant_error err = {""};
    parts p;
    lay_out(&arena, &p);
    assert_null(p.numbers);
    assert_null(p.last);
    const size_t measured = arena.used;
    assert_int_equal(measured, 128 + 64 + 0 + 128);
    check_ok(pliant_arena_reserve(&arena, &err), &err);
    lay_out(&arena, &p);
    assert_int_equal(arena.used, measured);
    assert_int_equal((uintptr_t)p.numbers % PLIANT_ARENA_ALIGN, 0);
    assert_int_equal((uintptr_t)p.text % PLIANT_ARENA_ALIGN, 0);
    assert_int_equal((uintptr_t)p.last % PLIANT_ARENA_ALIGN, 0);
    assert_true((char *)(p.numbers + 9) <= p.text && p.text + 1 <= (char *)p.last);
    for (int i = 0; i < 9; i++) assert_true(p.numbers[i] == 0);
    for (int i = 0; i < 17; i++) assert_true(p.last[i] == 0);
    memset(p.last, 1, 17 * sizeof *p.last);  // ASan sees the end
    pliant_arena_release(&arena);
    assert_null(arena.base);
    assert_int_equal(arena.used, 0);
    pliant_arena_release(&arena);
}

static void sizes_that_overflow_are_refused(void **state)
{
    (void)state;
    const size_t counts[] = {SIZE_MAX, SIZE_MAX / 8, SIZE_MAX / 8 - 6, SIZE_MAX / 16};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        pliant_arena arena = {0};
        pliant_error err = {""};
        (void)pliant_arena_take(&arena, counts[i], 8);
        (void)pliant_arena_take(&arena, counts[i], 8);
        (void)pliant_arena_take(&arena, 1, 1);
        assert_int_equal(arena.used, SIZE_MAX);
        assert_int_equal(pliant_arena_reserve(&arena, &err), PLIANT_ERR_MEMORY);
        assert_true(err.text[0] != 0);
        assert_null(arena.base);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_measured_is_carved_zeroed_and_aligned),
        cmocka_unit_test(sizes_that_overflow_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
