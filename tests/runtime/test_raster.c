// test_raster.c: triangles to samples, and samples to pixels.
#include "check.h"

#include "draw/raster.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float black[3] = {0, 0, 0};

static pliant_raster *make_raster(int32_t width, int32_t height, int32_t samples)
{
    pliant_raster *raster = NULL;
    pliant_error err;
    check_ok(pliant_raster_create(width, height, samples, &raster, &err), &err);
    pliant_raster_clear(raster, black);
    return raster;
}

static void count_sample(const void *context, const float *attribute, float *colour)
{
    (void)context, (void)attribute;
    colour[0] += 1;
}

static void copy_attributes(const void *context, const float *attribute, float *colour)
{
    (void)context;
    for (int c = 0; c < 3; c++) colour[c] = attribute[c];
}

static pliant_raster_corner corner_at(double x, double y, double depth, float value)
{
    return (pliant_raster_corner){
        .x = (float)x, .y = (float)y, .depth = (float)depth, .attribute = {value}};
}

static void triangle_covers_the_samples_inside_it_and_no_others(void **state)
{
    (void)state;
    // Corners whose edges meet no sample point, so that there is one right answer.
    const double p[3][2] = {{1.3, 0.7}, {14.9, 5.2}, {4.6, 13.8}};
    for (int turn = 0; turn < 2; turn++) {  // either way round
        pliant_raster *raster = make_raster(16, 16, 2);
        pliant_raster_corner corner[3];
        for (int k = 0; k < 3; k++) {
            const int from = turn ? 2 - k : k;
            corner[k] = corner_at(p[from][0], p[from][1], 1, 0);
        }
        pliant_raster_triangle(raster, corner, count_sample, NULL);
        int inside_count = 0;
        for (int row = 0; row < 32; row++)
            for (int column = 0; column < 32; column++) {
                const double x = (column + 0.5) / 2, y = (row + 0.5) / 2;
                int inside = 1;
                for (int k = 0; k < 3; k++) {
                    const double *a = p[k], *b = p[(k + 1) % 3];
                    if ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) < 0) inside = 0;
                }
                inside_count += inside;
                assert_int_equal((int)raster->colour[3 * (row * 32 + column)], inside);
            }
        check_at_least(inside_count, 300);  // about 4 samples to each of its 81 pixels
        pliant_raster_destroy(raster);
    }
}

static void triangles_that_tile_a_square_cover_every_sample_once(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    // A grid whose inner points are moved at random, some of them exactly onto sample points.
    enum { SIDE = 6 };
    double at[SIDE + 1][SIDE + 1][2];
    for (int j = 0; j <= SIDE; j++)
        for (int i = 0; i <= SIDE; i++) {
            const int inner = i > 0 && i < SIDE && j > 0 && j < SIDE;
            at[j][i][0] = 8 * i + (inner ? floor(10 * check_random_next(&random) - 5) / 2 : 0);
            at[j][i][1] = 8 * j + (inner ? floor(10 * check_random_next(&random) - 5) / 2 : 0);
        }
    pliant_raster *raster = make_raster(8 * SIDE, 8 * SIDE, 1);
    for (int j = 0; j < SIDE; j++)
        for (int i = 0; i < SIDE; i++) {
            const double *quad[4] = {at[j][i], at[j][i + 1], at[j + 1][i + 1], at[j + 1][i]};
            for (int half = 0; half < 2; half++) {
                const int v[3] = {0, half + 1, half + 2};
                pliant_raster_corner corner[3];
                for (int k = 0; k < 3; k++)
                    corner[k] = corner_at(quad[v[k]][0], quad[v[k]][1], 1, 0);
                pliant_raster_triangle(raster, corner, count_sample, NULL);
            }
        }
    for (int i = 0; i < 64 * SIDE * SIDE; i++) assert_int_equal((int)raster->colour[3 * i], 1);
    pliant_raster_destroy(raster);
}

static void the_nearer_triangle_is_seen_in_whatever_order(void **state)
{
    (void)state;
    for (int order = 0; order < 2; order++) {
        pliant_raster *raster = make_raster(8, 8, 1);
        for (int k = 0; k < 2; k++) {
            const int near = (k == order);
            const double depth = near ? 1 : 2;
            const pliant_raster_corner corner[3] = {
                corner_at(-20, -20, depth, (float)(near ? 1 : 0.25)),
                corner_at(40, -20, depth, (float)(near ? 1 : 0.25)),
                corner_at(-20, 40, depth, (float)(near ? 1 : 0.25)),
            };
            pliant_raster_triangle(raster, corner, copy_attributes, NULL);
        }
        for (int i = 0; i < 64; i++) check_near((double)raster->colour[3 * i], 1, 1e-6);
        pliant_raster_destroy(raster);
    }
}

static void triangles_that_pierce_each_other_part_along_their_intersection(void **state)
{
    (void)state;
    // Depths x and 8 - x over an 8 x 8 picture cross at x = 4.
    pliant_raster *raster = make_raster(8, 8, 1);
    const pliant_raster_corner rising[3] = {corner_at(-16, -16, -16, 1), corner_at(48, -16, 48, 1),
                                            corner_at(-16, 48, -16, 1)};
    const pliant_raster_corner falling[3] = {corner_at(-16, -16, 24, 0), corner_at(48, -16, -40, 0),
                                             corner_at(-16, 48, 24, 0)};
    pliant_raster_triangle(raster, rising, copy_attributes, NULL);
    pliant_raster_triangle(raster, falling, copy_attributes, NULL);
    for (int i = 0; i < 64; i++) check_near((double)raster->colour[3 * i], i % 8 < 4 ? 1 : 0, 1e-5);
    pliant_raster_destroy(raster);
}

static void attributes_are_interpolated_linearly(void **state)
{
    (void)state;
    // Attribute = 0.1 + 0.02 x + 0.03 y at the corners and so everywhere; float weights: 1e-6.
    pliant_raster *raster = make_raster(8, 8, 1);
    const double p[3][2] = {{-5, -3}, {30, 1}, {2, 28}};
    pliant_raster_corner corner[3];
    for (int k = 0; k < 3; k++)
        corner[k] = corner_at(p[k][0], p[k][1], 1, (float)(0.1 + 0.02 * p[k][0] + 0.03 * p[k][1]));
    pliant_raster_triangle(raster, corner, copy_attributes, NULL);
    for (int y = 0; y < 8; y++)
        for (int x = 0; x < 8; x++)
            check_near((double)raster->colour[3 * (8 * y + x)],
                       0.1 + 0.02 * (x + 0.5) + 0.03 * (y + 0.5), 1e-6);
    pliant_raster_destroy(raster);
}

static void half_covered_pixel_has_half_the_light(void **state)
{
    (void)state;
    pliant_raster *raster = make_raster(2, 1, 4);
    // White left of x = 1.5.
    const pliant_raster_corner white[3] = {
        {-40, -40, 1, {1, 1, 1}}, {1.5f, -40, 1, {1, 1, 1}}, {1.5f, 400, 1, {1, 1, 1}}};
    pliant_raster_triangle(raster, white, copy_attributes, NULL);
    uint8_t rgb[6];
    pliant_raster_resolve(raster, rgb);
    // sRGB of half the light: 255 (1.055 0.5^(1/2.4) - 0.055) = 187.5.
    assert_int_equal(rgb[0], 255);
    check_near(rgb[3], 188, 1);
    pliant_raster_destroy(raster);
}

static void corners_that_are_nowhere_draw_nothing(void **state)
{
    (void)state;
    const double odd[] = {NAN, INFINITY, -INFINITY, 1e30, -3e7};
    pliant_raster *raster = make_raster(8, 8, 1);
    for (size_t k = 0; k < sizeof odd / sizeof *odd; k++)
        for (int c = 0; c < 3; c++) {
            pliant_raster_corner corner[3] = {corner_at(-9, -9, 1, 1), corner_at(30, -9, 1, 1),
                                              corner_at(-9, 30, 1, 1)};
            if (k % 2) corner[c].x = (float)odd[k];
            else corner[c].y = (float)odd[k];
            pliant_raster_triangle(raster, corner, copy_attributes, NULL);
        }
    for (int i = 0; i < 64 * 3; i++) assert_true(raster->colour[i] == 0);
    pliant_raster_destroy(raster);
}

static void nothing_is_drawn_outside_the_window(void **state)
{
    (void)state;
    pliant_raster *raster = make_raster(16, 12, 2);
    raster->left = 3;
    raster->right = 9;
    raster->top = 2;
    raster->bottom = 7;
    const pliant_raster_corner corner[3] = {corner_at(-50, -50, 1, 0), corner_at(200, -50, 1, 0),
                                            corner_at(-50, 200, 1, 0)};
    pliant_raster_triangle(raster, corner, count_sample, NULL);
    for (int row = 0; row < 24; row++)
        for (int column = 0; column < 32; column++) {
            const int inside = column >= 6 && column < 18 && row >= 4 && row < 14;
            check_near((double)raster->colour[3 * (row * 32 + column)], inside, 0);
        }
    pliant_raster_destroy(raster);
}

static void rasters_of_no_or_enormous_size_are_refused(void **state)
{
    (void)state;
    const int32_t sizes[][3] = {{0, 8, 1},         {8, -1, 1}, {4097, 8, 1},
                                {8, INT32_MAX, 1}, {8, 8, 0},  {8, 8, 9}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        pliant_raster *raster = NULL;
        assert_int_equal(pliant_raster_create(sizes[k][0], sizes[k][1], sizes[k][2], &raster, NULL),
                         PLIANT_ERR_ARGUMENT);
        assert_null(raster);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangle_covers_the_samples_inside_it_and_no_others),
        cmocka_unit_test(triangles_that_tile_a_square_cover_every_sample_once),
        cmocka_unit_test(the_nearer_triangle_is_seen_in_whatever_order),
        cmocka_unit_test(triangles_that_pierce_each_other_part_along_their_intersection),
        cmocka_unit_test(attributes_are_interpolated_linearly),
        cmocka_unit_test(half_covered_pixel_has_half_the_light),
        cmocka_unit_test(corners_that_are_nowhere_draw_nothing),
        cmocka_unit_test(nothing_is_drawn_outside_the_window),
        cmocka_unit_test(rasters_of_no_or_enormous_size_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
