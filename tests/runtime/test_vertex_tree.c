// test_vertex_tree.c: what the tree finds near a tool, against looking at all vertices.
#include "check.h"

#include "surfaces.h"
#include "vertex_tree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static pliant_vertex_tree tree_over(const int32_t *vertices, int32_t count, const double *positions,
                                    pliant_arena *arena)
{
    pliant_vertex_tree tree;
    pliant_error err = {""};
    *arena = (pliant_arena){0};
    pliant_vertex_tree_lay_out(arena, count, &tree);
    check_ok(pliant_arena_reserve(arena, &err), &err);
    pliant_vertex_tree_lay_out(arena, count, &tree);
    pliant_vertex_tree_build(&tree, vertices, positions);
    return tree;
}

static pliant_tool_shape random_tool(check_random *random)
{
    pliant_tool tool = {.kind = (pliant_tool_kind)(1 + check_random_index(random, 3))};
    tool.a = (pliant_vec3){(float)(3 * check_random_next(random) - 1.5),
                           (float)(3 * check_random_next(random) - 1.5),
                           (float)(3 * check_random_next(random) - 1.5)};
    tool.b = (pliant_vec3){(float)(check_random_next(random) - 0.5),
                           (float)(check_random_next(random) - 0.5), 0.1f};
    tool.radius = 0.01f + (float)(0.3 * check_random_next(random));
    pliant_tool_shape shape;
    assert_int_equal(pliant_tool_shape_begin(&tool, &shape), PLIANT_OK);
    return shape;
}

static void every_vertex_within_reach_is_found_once_and_few_others(void **state)
{
    (void)state;
    check_random random = check_random_seed(7);
    enum { most = 3000 };
    double *positions = calloc(3 * most, sizeof *positions);
    int32_t *vertices = calloc(most, sizeof *vertices), *found = calloc(most, sizeof *found);
    uint8_t *times = calloc(most, 1);
    assert_true(positions && vertices && found && times);
    for (int32_t i = 0; i < most; i++) {
        // On a sphere, as surfaces are; some coincide.
        double *x = positions + 3 * i, length = 0;
        for (int c = 0; c < 3; c++) {
            x[c] = i % 10 == 9 ? x[c - 3] : 2 * check_random_next(&random) - 1;
            length += x[c] * x[c];
        }
        for (int c = 0; c < 3; c++) x[c] /= sqrt(length);
    }
    const int32_t counts[] = {1, 2, 7, 8, 9, 100, 1000};
    int64_t asked = 0, listed = 0, right = 0;
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        // Every third vertex.
        for (int32_t i = 0; i < counts[k]; i++) vertices[i] = (3 * i + 1) % most;
        pliant_arena arena;
        const pliant_vertex_tree tree = tree_over(vertices, counts[k], positions, &arena);
        for (int trial = 0; trial < 200; trial++) {
            const pliant_tool_shape shape = random_tool(&random);
            const double reach = 0.3 * check_random_next(&random) - 0.05;
            const int32_t count = pliant_vertex_tree_near(&tree, &shape, reach, found);
            memset(times, 0, most);
            for (int32_t i = 0; i < count; i++) times[found[i]]++;
            for (int32_t i = 0; i < counts[k]; i++) {
                double ignored[3];
                const int32_t is_near = pliant_tool_shape_distance(
                                            &shape, positions + 3 * vertices[i], ignored) <= reach;
                assert_in_range(times[vertices[i]], is_near, 1);
                right += counts[k] == 1000 && is_near;
            }
            asked += counts[k] == 1000 ? 1000 : 0;
            listed += counts[k] == 1000 ? count : 0;
        }
        pliant_arena_release(&arena);
    }
    printf("    of %ld vertices %ld are near and %ld found\n", (long)asked, (long)right,
           (long)listed);
    // Leaves on a sphere of 1000 are some 0.1 wide, tools 0.3 to 1.
    check_at_most((double)listed, 2 * (double)right);
    check_at_most((double)listed, 0.5 * (double)asked);
    free(positions);
    free(vertices);
    free(found);
    free(times);
}

static void no_tool_finds_nothing_and_no_vertices_are_fine(void **state)
{
    (void)state;
    const double positions[3] = {0, 0, 0};
    const int32_t vertices[1] = {0};
    int32_t found[1];
    pliant_arena arena;
    pliant_vertex_tree tree = tree_over(vertices, 1, positions, &arena);
    pliant_tool_shape shape;
    assert_int_equal(pliant_tool_shape_begin(&(pliant_tool){.kind = PLIANT_TOOL_NONE}, &shape),
                     PLIANT_OK);
    assert_int_equal(pliant_vertex_tree_near(&tree, &shape, 1e9, found), 0);
    pliant_arena_release(&arena);
    tree = tree_over(vertices, 0, positions, &arena);
    check_random random = check_random_seed(1);
    shape = random_tool(&random);
    assert_int_equal(pliant_vertex_tree_near(&tree, &shape, 1e9, found), 0);
    pliant_arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_vertex_within_reach_is_found_once_and_few_others),
        cmocka_unit_test(no_tool_finds_nothing_and_no_vertices_are_fine),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
