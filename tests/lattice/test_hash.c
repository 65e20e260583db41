// test_hash.c: the grid finds what comparing all with all finds, in an order of its own.
#include "check.h"

#include "lattice/hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { capacity = 6000 };

static pliant_hash hash_of(pliant_arena *arena)
{
    pliant_hash hash = {0};
    pliant_error err = {""};
    pliant_hash_lay_out(&hash, arena, capacity);
    check_ok(pliant_arena_reserve(arena, &err), &err);
    pliant_hash_lay_out(&hash, arena, capacity);
    return hash;
}

static float square_distance(const float *a, const float *b)
{
    float square = 0;
    for (int c = 0; c < 3; c++) square += (a[c] - b[c]) * (a[c] - b[c]);
    return square;
}

// How often the 27 cells around `point` hold point `number` that lies within `size`.
static int32_t find_all(const pliant_hash *hash, const float *point, float size, int32_t *found,
                        int32_t room)
{
    int32_t cell[3], count = 0;
    pliant_hash_cell(hash, point, cell);
    for (int32_t dz = -1; dz <= 1; dz++)
        for (int32_t dy = -1; dy <= 1; dy++) {
            const pliant_hash_range range =
                pliant_hash_find(hash, cell[0], cell[1] + dy, cell[2] + dz, 1, 1);
            for (int r = 0; r < 2; r++)
                for (int32_t k = range.from[r]; k < range.to[r]; k++) {
                    const int32_t *other = hash->cell + 3 * (size_t)k;
                    if (other[1] != cell[1] + dy || other[2] != cell[2] + dz ||
                        abs(other[0] - cell[0]) > 1)
                        continue;
                    if (square_distance(hash->sorted + 4 * (size_t)k, point) > size * size)
                        continue;
                    assert_true(count < room);
                    found[count++] = hash->number[k];
                }
        }
    return count;
}

static int by_value(const void *a, const void *b)
{
    return *(const int32_t *)a - *(const int32_t *)b;
}

static void candidates_are_those_of_brute_force(void **state)
{
    (void)state;
    pliant_arena arena = {0};
    pliant_hash hash = hash_of(&arena);
    check_random random = check_random_seed(21);
    static int32_t found[capacity];
    // Dense and sparse, near the origin and far from it, few points (few buckets, which wrap) too.
    const float spans[] = {0.5f, 3, 40}, places[] = {0, -1000, 1e7f};
    const int32_t counts[] = {1, 37, 2000};
    for (int trial = 0; trial < 27; trial++) {
        const float span = spans[trial % 3], place = places[trial / 3 % 3], size = 0.4f;
        const int32_t count = counts[trial / 9];
        for (int32_t i = 0; i < 4 * count; i++)
            hash.points[i] = place + span * (float)(2 * check_random_next(&random) - 1);
        pliant_hash_fill(&hash, NULL, count, size);
        for (int32_t i = 0; i < count; i += 1 + count / 200) {
            const float *point = hash.points + 4 * (size_t)i;
            const int32_t n = find_all(&hash, point, size, found, capacity);
            qsort(found, (size_t)n, sizeof *found, by_value);
            int32_t at = 0;
            for (int32_t j = 0; j < count; j++)
                if (square_distance(hash.points + 4 * (size_t)j, point) <= size * size) {
                    assert_true(at < n);
                    assert_int_equal(found[at++], j);
                }
            assert_int_equal(at, n);
        }
    }
    pliant_arena_release(&arena);
}

static void the_order_is_that_of_buckets_and_numbers_for_any_team(void **state)
{
    (void)state;
    static int32_t order[capacity];
    check_random random = check_random_seed(22);
    for (int32_t threads = 1; threads <= 3; threads++) {
        pliant_team *team = NULL;
        pliant_error err = {""};
        check_ok(pliant_team_create(threads, &team, &err), &err);
        pliant_arena arena = {0};
        pliant_hash hash = hash_of(&arena);
        random = check_random_seed(22);
        for (int32_t i = 0; i < 4 * capacity; i++)
            hash.points[i] = (float)check_random_next(&random);
        pliant_hash_fill(&hash, team, capacity, 0.1f);
        for (int32_t b = 0; b < hash.bucket_count; b++)
            for (int32_t k = hash.first[b] + 1; k < hash.first[b + 1]; k++)
                assert_true(hash.number[k - 1] < hash.number[k]);
        assert_int_equal(hash.first[hash.bucket_count], capacity);
        if (threads == 1) memcpy(order, hash.number, sizeof order);
        else assert_memory_equal(order, hash.number, sizeof order);
        pliant_arena_release(&arena);
        pliant_team_destroy(team);
    }
}

static void what_is_no_place_is_kept_apart(void **state)
{
    (void)state;
    pliant_arena arena = {0};
    pliant_hash hash = hash_of(&arena);
    const float odd[] = {NAN, INFINITY, -INFINITY, 3e38f};
    for (int i = 0; i < 16; i++) hash.points[i] = odd[i % 4 == 3 ? 3 : i / 4];
    pliant_hash_fill(&hash, NULL, 4, 1e-3f);
    assert_int_equal(hash.first[hash.bucket_count], 4);
    pliant_hash_fill(&hash, NULL, 0, 1);
    assert_int_equal(hash.first[hash.bucket_count], 0);
    pliant_arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(candidates_are_those_of_brute_force),
        cmocka_unit_test(the_order_is_that_of_buckets_and_numbers_for_any_team),
        cmocka_unit_test(what_is_no_place_is_kept_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
