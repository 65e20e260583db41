// test_triangle.c: nearest points and crossings of triangles, also right at edges and corners.
#include "check.h"

#include "surfaces.h"
#include "triangle.h"

#include <math.h>
#include <string.h>

static void random_point(check_random *random, double size, double *x)
{
    for (int c = 0; c < 3; c++) x[c] = size * (2 * check_random_next(random) - 1);
}

static double distance(const double *a, const double *b)
{
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

static void place_of(const double *corners, const double *weights, double *place)
{
    for (int c = 0; c < 3; c++)
        place[c] =
            weights[0] * corners[c] + weights[1] * corners[3 + c] + weights[2] * corners[6 + c];
}

static void the_nearest_point_is_nearer_than_any_sample(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    int32_t inside = 0, on_edge = 0, at_corner = 0;
    for (int trial = 0; trial < 2000; trial++) {
        double corners[9], point[3], foot[3];
        for (int k = 0; k < 3; k++) random_point(&random, 1, corners + 3 * k);
        random_point(&random, 2, point);
        if (trial % 50 == 0) memcpy(corners + 3, corners, 3 * sizeof *corners);  // without area
        const pliant_nearest nearest = pliant_triangle_nearest(corners, point);
        const double *w = nearest.weights;
        check_near(w[0] + w[1] + w[2], 1, 1e-12);
        check_at_least(fmin(w[0], fmin(w[1], w[2])), 0);
        place_of(corners, w, foot);
        check_near(distance(foot, point), nearest.distance, 1e-12);
        check_at_most(fabs(nearest.side), nearest.distance + 1e-12);
        for (int i = 0; i <= 10; i++)
            for (int j = 0; i + j <= 10; j++) {
                double sample[3];
                place_of(corners, (const double[3]){i / 10.0, j / 10.0, (10 - i - j) / 10.0},
                         sample);
                check_at_least(distance(sample, point), nearest.distance - 1e-12);
            }
        const int zeros = (w[0] == 0) + (w[1] == 0) + (w[2] == 0);
        inside += zeros == 0, on_edge += zeros == 1, at_corner += zeros == 2;
    }
    check_at_least(inside, 50);
    check_at_least(on_edge, 50);
    check_at_least(at_corner, 50);
}

// From outside a closed surface to inside there is a crossing from the outer side, wherever the
// segment is aimed: at insides, edges and corners of faces. On the way out there is none.
static void there_is_no_way_into_a_closed_surface_between_its_faces(void **state)
{
    (void)state;
    check_surface surface = check_blob(2);
    const pliant_mesh *mesh = surface.mesh;
    check_random random = check_random_seed(2);
    for (int trial = 0; trial < 3000; trial++) {
        const int32_t *face =
            mesh->faces + 3 * (size_t)check_random_index(&random, mesh->face_count);
        double aim[3], far[3], weights[3] = {1, 0, 0};
        if (trial % 3 == 1) weights[0] = weights[1] = 0.5;
        if (trial % 3 == 2) weights[0] = 0.2, weights[1] = 0.3, weights[2] = 0.5;
        for (int c = 0; c < 3; c++)
            aim[c] = weights[0] * mesh->vertices[3 * face[0] + c] +
                     weights[1] * mesh->vertices[3 * face[1] + c] +
                     weights[2] * mesh->vertices[3 * face[2] + c];
        for (int c = 0; c < 3; c++) far[c] = 3 * aim[c];
        // The blob is seen whole from its middle.
        const double inner[3] = {0.3 * aim[0], 0.3 * aim[1], 0.3 * aim[2]};
        int in = 0, out = 0;
        for (int32_t f = 0; f < mesh->face_count; f++) {
            double corners[9], at, w[3];
            for (int k = 0; k < 3; k++)
                memcpy(corners + 3 * k, mesh->vertices + 3 * (size_t)mesh->faces[3 * f + k],
                       3 * sizeof *corners);
            if (pliant_triangle_crossed(corners, far, inner, 1e-12, &at, w)) {
                double place[3];
                place_of(corners, w, place);
                check_at_most(distance(place, aim), 1e-9);
                in++;
            }
            out += pliant_triangle_crossed(corners, inner, far, 1e-12, &at, w);
        }
        check_at_least(in, 1);
        assert_int_equal(out, 0);
    }
    check_surface_destroy(&surface);
}

static void ends_on_the_plane_begin_outside_and_do_not_go_through(void **state)
{
    (void)state;
    const double corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const double on[3] = {0.25, 0.25, 0}, above[3] = {0.25, 0.25, 1}, below[3] = {0.25, 0.25, -1};
    const double beside[3] = {0.8, 0.8, -1};
    double at, w[3];
    assert_int_equal(pliant_triangle_crossed(corners, on, below, 1e-12, &at, w), 1);
    check_near(at, 0, 0);
    assert_int_equal(pliant_triangle_crossed(corners, above, on, 1e-12, &at, w), 0);
    assert_int_equal(pliant_triangle_crossed(corners, on, above, 1e-12, &at, w), 0);
    assert_int_equal(pliant_triangle_crossed(corners, below, above, 1e-12, &at, w), 0);
    assert_int_equal(pliant_triangle_crossed(corners, above, beside, 1e-12, &at, w), 0);
    assert_int_equal(pliant_triangle_crossed(corners, above, below, 1e-12, &at, w), 1);
    check_near(at, 0.5, 1e-15);
    check_near(w[0], 0.5, 1e-15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_nearest_point_is_nearer_than_any_sample),
        cmocka_unit_test(there_is_no_way_into_a_closed_surface_between_its_faces),
        cmocka_unit_test(ends_on_the_plane_begin_outside_and_do_not_go_through),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
