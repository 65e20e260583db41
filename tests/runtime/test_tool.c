// test_tool.c: distances to tools and their motion, against their definitions.
#include "check.h"

#include "tool.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const pliant_tool ball = {
    .kind = PLIANT_TOOL_SPHERE, .a = {0.3f, -0.2f, 1.1f}, .radius = 0.7f};
static const pliant_tool slab = {
    .kind = PLIANT_TOOL_PLANE, .a = {0.1f, 0.2f, 0.3f}, .b = {3, -4, 12}};
static const pliant_tool rod = {
    .kind = PLIANT_TOOL_CAPSULE, .a = {-1, 0.5f, 0}, .b = {0.8f, 0.1f, 0.6f}, .radius = 0.25f};
static const pliant_tool pill = {
    .kind = PLIANT_TOOL_CAPSULE, .a = {1, 2, 3}, .b = {1, 2, 3}, .radius = 0.5f};
static const pliant_tool *const tools[] = {&ball, &slab, &rod, &pill};
enum { tool_count = 4 };

static pliant_tool_shape shape_of(const pliant_tool *tool)
{
    pliant_tool_shape shape;
    assert_int_equal(pliant_tool_shape_begin(tool, &shape), PLIANT_OK);
    return shape;
}

static void random_point(check_random *random, double size, double *x)
{
    for (int c = 0; c < 3; c++) x[c] = size * (2 * check_random_next(random) - 1);
}

static double distance_between(const double *x, const double *y)
{
    return sqrt((x[0] - y[0]) * (x[0] - y[0]) + (x[1] - y[1]) * (x[1] - y[1]) +
                (x[2] - y[2]) * (x[2] - y[2]));
}

// The distance to the nearest of many balls along the segment, or by the plane's equation.
static double slow_distance(const pliant_tool_shape *shape, const double *x)
{
    if (shape->kind == PLIANT_TOOL_PLANE)
        return (3 * (x[0] - shape->a[0]) - 4 * (x[1] - shape->a[1]) + 12 * (x[2] - shape->a[2])) /
               13;
    double least = INFINITY;
    enum { balls = 20000 };
    const int32_t last = shape->kind == PLIANT_TOOL_CAPSULE ? balls : 0;
    for (int32_t i = 0; i <= last; i++) {
        const double part = (double)i / balls;
        double centre[3];
        for (int c = 0; c < 3; c++)
            centre[c] = last ? shape->a[c] + part * (shape->b[c] - shape->a[c]) : shape->a[c];
        least = fmin(least, distance_between(x, centre) - shape->radius);
    }
    return least;
}

static void distances_are_those_to_the_shape(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    for (int t = 0; t < tool_count; t++) {
        const pliant_tool_shape shape = shape_of(tools[t]);
        for (int i = 0; i < 200; i++) {
            double x[3], normal[3] = {0};
            random_point(&random, 3, x);
            // Balls 1e-4 apart are nearer by the square of that.
            check_near(pliant_tool_shape_distance(&shape, x, normal), slow_distance(&shape, x),
                       1e-7);
            check_near(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2], 1,
                       1e-14);
        }
    }
}

static void the_normal_is_the_gradient(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    const double step = 1e-5;
    for (int t = 0; t < tool_count; t++) {
        const pliant_tool_shape shape = shape_of(tools[t]);
        for (int i = 0; i < 1000; i++) {
            double x[3], normal[3] = {0}, ignored[3] = {0};
            random_point(&random, 3, x);
            (void)pliant_tool_shape_distance(&shape, x, normal);
            for (int c = 0; c < 3; c++) {
                double forth[3], back[3];
                memcpy(forth, x, sizeof forth);
                memcpy(back, x, sizeof back);
                forth[c] += step;
                back[c] -= step;
                const double slope = (pliant_tool_shape_distance(&shape, forth, ignored) -
                                      pliant_tool_shape_distance(&shape, back, ignored)) /
                                     (2 * step);
                // Curvature changes over a capsule's seam, which few steps cross: an error of the
                // step then, else of its square; distances from the axis are rarely under 0.01.
                check_near(slope, normal[c], 1e-4);
            }
        }
    }
}

static void the_middle_of_a_ball_keeps_the_normal_there_was(void **state)
{
    (void)state;
    const pliant_tool_shape shape = shape_of(&ball);
    double normal[3] = {0, 1, 0};
    check_near(pliant_tool_shape_distance(&shape, shape.a, normal), -shape.radius, 0);
    assert_true(normal[0] == 0 && normal[1] == 1 && normal[2] == 0);
}

static void no_tool_is_infinitely_far(void **state)
{
    (void)state;
    const pliant_tool_shape shape =
        shape_of(&(pliant_tool){.kind = PLIANT_TOOL_NONE, .radius = NAN});
    double normal[3];
    assert_true(pliant_tool_shape_distance(&shape, (const double[]){1, 2, 3}, normal) == INFINITY);
}

static void what_is_no_tool_is_refused(void **state)
{
    (void)state;
    pliant_tool_shape shape;
    memset(&shape, 0x5a, sizeof shape);
    const pliant_tool_shape before = shape;
    const float bad[] = {NAN, INFINITY, -INFINITY, -1};
    for (int t = 0; t < tool_count; t++) {
        for (int i = 0; i < 4; i++) {
            for (int field = 0; field < 5; field++) {
                pliant_tool tool = *tools[t];
                float *const fields[] = {&tool.a.y, &tool.b.z, &tool.radius, &tool.friction,
                                         &tool.a.x};
                *fields[field] = bad[i];
                // Coordinates may be below 0; spheres have no b, planes no radius.
                if (i == 3 && (field == 0 || field == 1 || field == 4)) continue;
                if (field == 1 && tool.kind == PLIANT_TOOL_SPHERE) continue;
                if (field == 2 && tool.kind == PLIANT_TOOL_PLANE) continue;
                assert_int_equal(pliant_tool_shape_begin(&tool, &shape), PLIANT_ERR_ARGUMENT);
            }
        }
    }
    pliant_tool tool = ball;
    tool.radius = 0;
    assert_int_equal(pliant_tool_shape_begin(&tool, &shape), PLIANT_ERR_ARGUMENT);
    tool = ball;
    tool.friction = 2.5f;
    assert_int_equal(pliant_tool_shape_begin(&tool, &shape), PLIANT_ERR_ARGUMENT);
    tool = slab;
    tool.b = (pliant_vec3){0, 0, 0};
    assert_int_equal(pliant_tool_shape_begin(&tool, &shape), PLIANT_ERR_ARGUMENT);
    tool = ball;
    tool.kind = (pliant_tool_kind)17;
    assert_int_equal(pliant_tool_shape_begin(&tool, &shape), PLIANT_ERR_ARGUMENT);
    tool.kind = (pliant_tool_kind)-1;
    assert_int_equal(pliant_tool_shape_begin(&tool, &shape), PLIANT_ERR_ARGUMENT);
    assert_memory_equal(&shape, &before, sizeof shape);
}

static void motion_carries_the_surface_along(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    for (int t = 0; t < tool_count; t++) {
        for (int trial = 0; trial < 100; trial++) {
            // Moved rigidly: turned about a random axis by up to a radian, and shifted.
            double axis[3], shift[3], a[3], b[3], turned[3];
            random_point(&random, 1, axis);
            random_point(&random, 1, shift);
            const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
            for (int c = 0; c < 3; c++) axis[c] /= length;
            const double angle = check_random_next(&random);
            const pliant_tool_shape before = shape_of(tools[t]);
            memcpy(a, before.a, sizeof a);
            for (int c = 0; c < 3; c++)
                b[c] = before.kind == PLIANT_TOOL_CAPSULE ? before.b[c] - a[c] : before.b[c];
            const double along = axis[0] * b[0] + axis[1] * b[1] + axis[2] * b[2];
            const double cross[3] = {axis[1] * b[2] - axis[2] * b[1],
                                     axis[2] * b[0] - axis[0] * b[2],
                                     axis[0] * b[1] - axis[1] * b[0]};
            for (int c = 0; c < 3; c++)
                turned[c] =
                    b[c] * cos(angle) + cross[c] * sin(angle) + axis[c] * along * (1 - cos(angle));
            pliant_tool tool = *tools[t];
            tool.a = (pliant_vec3){(float)(a[0] + shift[0]), (float)(a[1] + shift[1]),
                                   (float)(a[2] + shift[2])};
            for (int c = 0; c < 3; c++)
                if (before.kind == PLIANT_TOOL_CAPSULE) turned[c] += a[c] + shift[c];
            tool.b = (pliant_vec3){(float)turned[0], (float)turned[1], (float)turned[2]};
            const pliant_tool_shape after = shape_of(&tool);
            const pliant_tool_motion motion = pliant_tool_motion_between(&before, &after);
            for (int i = 0; i < 20; i++) {
                double x[3], y[3], p[3] = {0}, q[3] = {0}, z[3], w[3];
                random_point(&random, 3, x);
                random_point(&random, 3, z);
                pliant_tool_motion_apply(&motion, x, y);
                pliant_tool_motion_apply(&motion, z, w);
                // Points keep their distance to the tool (in floats) and to each other.
                check_near(pliant_tool_shape_distance(&after, y, q),
                           pliant_tool_shape_distance(&before, x, p), 2e-6);
                check_near(distance_between(y, w), distance_between(x, z), 1e-12);
            }
        }
    }
}

static void a_tool_of_another_kind_has_not_moved(void **state)
{
    (void)state;
    const pliant_tool_shape before = shape_of(&ball), after = shape_of(&slab);
    const pliant_tool_motion motion = pliant_tool_motion_between(&before, &after);
    const double x[3] = {1, 2, 3};
    double y[3];
    pliant_tool_motion_apply(&motion, x, y);
    assert_memory_equal(x, y, sizeof x);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distances_are_those_to_the_shape),
        cmocka_unit_test(the_normal_is_the_gradient),
        cmocka_unit_test(the_middle_of_a_ball_keeps_the_normal_there_was),
        cmocka_unit_test(no_tool_is_infinitely_far),
        cmocka_unit_test(what_is_no_tool_is_refused),
        cmocka_unit_test(motion_carries_the_surface_along),
        cmocka_unit_test(a_tool_of_another_kind_has_not_moved),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
