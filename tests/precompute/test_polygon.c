// test_polygon.c: polygons are covered once by triangles that all look the same way.
#include "check.h"

#include "mesh/polygon.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Signed area of a triangle in the plane of x and y.
static double plane_area(const double *vertices, const int32_t *t)
{
    const double *a = vertices + 3 * t[0], *b = vertices + 3 * t[1], *c = vertices + 3 * t[2];
    return ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
}

// Split a polygon with corners in order; every triangle must look up, and the areas add up.
static void check_cover(const double *vertices, int32_t count, double area, double least)
{
    int32_t *corners = malloc((size_t)count * sizeof *corners);
    int32_t *triangles = malloc((size_t)count * 3 * sizeof *triangles);
    assert_non_null(corners);
    assert_non_null(triangles);
    for (int32_t i = 0; i < count; i++) corners[i] = i;
    pliant_error err;
    check_ok(pliant_polygon_split(vertices, corners, count, triangles, &err), &err);
    double sum = 0;
    for (int32_t t = 0; t < count - 2; t++) {
        const double part = plane_area(vertices, triangles + 3 * t);
        check_at_least(part, least);
        sum += part;
    }
    // Areas of all positive triangles that sum to the polygon's cover it once.
    check_near(sum, area, 1e-12 * fabs(area) * count);
    free(corners);
    free(triangles);
}

static void quadrilaterals_split_along_the_better_diagonal(void **state)
{
    (void)state;
    static const int32_t corners[4] = {0, 1, 2, 3};
    static const struct {
        double x[4][2];
        int diagonal; // from this corner
    } cases[] = {
        {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 0}, // a tie goes to the first corner
        {{{0, 0}, {2, 0}, {3, 1}, {1, 1}}, 1}, // the short diagonal of a rhomboid
        {{{0, 0}, {4, 0}, {1, 1}, {0, 4}}, 0}, // not convex at corner 2: only 0-2 is inside
        {{{0, 4}, {0, 0}, {4, 0}, {1, 1}}, 1}, // not convex at corner 3
        {{{0, 0}, {1, 0}, {2, 0}, {1, 1}}, 1}, // corner 1 in the middle of a straight side
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double x[12] = {0};
        for (int k = 0; k < 4; k++) memcpy(x + 3 * k, cases[i].x[k], 2 * sizeof(double));
        int32_t t[6];
        pliant_error err;
        check_ok(pliant_polygon_split(x, corners, 4, t, &err), &err);
        const int d = cases[i].diagonal;
        for (int k = 0; k < 2; k++) {
            int has = 0;
            for (int c = 0; c < 3; c++) has += t[3 * k + c] == d || t[3 * k + c] == d + 2;
            assert_int_equal(has, 2);
            check_at_least(plane_area(x, t + 3 * k), 1e-3);
        }
    }
}

static void polygons_that_are_not_convex_are_covered_once(void **state)
{
    (void)state;
    // An L, and a square with corners in the middle of its sides: no triangle without area.
    static const double ell[] = {0, 0, 5, 3, 0, 5, 3, 1, 5, 1, 1, 5, 1, 3, 5, 0, 3, 5};
    check_cover(ell, 6, 5, 1e-3);
    static const double square[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 2, 1, 0,
                                    2, 2, 0, 1, 2, 0, 0, 2, 0, 0, 1, 0};
    check_cover(square, 8, 4, 1e-3);
    // A comb of 50 teeth.
    double comb[3 * 200] = {0};
    int32_t n = 0;
    for (int i = 0; i <= 100; i++, n++) {
        comb[3 * n] = 100 - i;
        comb[3 * n + 1] = i % 2 ? 1 : 10;
    }
    comb[3 * n] = 0, comb[3 * n++ + 1] = 0;
    comb[3 * n] = 100, comb[3 * n++ + 1] = 0;
    check_cover(comb, n, 550, 1e-6);
    // Stars with random radii, some spirals of them narrow; the area by the shoelace formula.
    check_random random = check_random_seed(3);
    for (int round = 0; round < 200; round++) {
        double star[3 * 60] = {0}, area = 0;
        const int count = 5 + (int)(55 * check_random_next(&random));
        for (int i = 0; i < count; i++) {
            const double angle = 6.283185307179586 * i / count,
                         r = 0.05 + check_random_next(&random);
            star[3 * i] = r * cos(angle);
            star[3 * i + 1] = r * sin(angle);
        }
        for (int i = 0; i < count; i++) {
            const double *a = star + 3 * i, *b = star + 3 * ((i + 1) % count);
            area += (a[0] * b[1] - a[1] * b[0]) / 2;
        }
        check_cover(star, count, area, 0);
    }
}

static void polygons_without_a_plane_are_split_somehow(void **state)
{
    (void)state;
    // All corners on one place, on one line, infinitely far apart, and a pentagram: no crash, every
    // number among the corners'.
    static const double x[4][15] = {
        {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1},
        {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4},
        {1e308, 0, 0, -1e308, 0, 0, 0, 1e308, 0, 0, -1e308, 0, 0, 0, 1e308},
        {1, 0, 0, -0.81, 0.59, 0, 0.31, -0.95, 0, 0.31, 0.95, 0, -0.81, -0.59, 0},
    };
    static const int32_t corners[5] = {0, 1, 2, 3, 4};
    for (int i = 0; i < 4; i++)
        for (int count = 3; count <= 5; count++) {
            int32_t triangles[9] = {-1, -1, -1, -1, -1, -1, -1, -1, -1};
            pliant_error err;
            check_ok(pliant_polygon_split(x[i], corners, count, triangles, &err), &err);
            for (int k = 0; k < 3 * (count - 2); k++) assert_in_range(triangles[k], 0, count - 1);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quadrilaterals_split_along_the_better_diagonal),
        cmocka_unit_test(polygons_that_are_not_convex_are_covered_once),
        cmocka_unit_test(polygons_without_a_plane_are_split_somehow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
