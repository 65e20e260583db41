// test_obstacle_mesh.c: obstacles as triangles enclose what they should, seen from outside.
#include "check.h"

#include "obstacle_mesh.h"
#include "pliant/error.h"

#include <math.h>

static const double low[3] = {-1, -2, -3}, high[3] = {3, 2, 1};

// By the divergence theorem; positive when faces are counterclockwise from outside.
static double volume_of(const pliant_obstacle_mesh *mesh)
{
    double sum = 0;
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const double *a = mesh->positions + 3 * mesh->faces[3 * f];
        const double *b = mesh->positions + 3 * mesh->faces[3 * f + 1];
        const double *c = mesh->positions + 3 * mesh->faces[3 * f + 2];
        sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    return sum / 6;
}

static void check_volume(const pliant_obstacle *obstacle, double expected, double tolerance)
{
    pliant_obstacle_mesh mesh = {0};
    pliant_error err;
    check_ok(pliant_obstacle_mesh_make(&mesh, obstacle, 1, low, high, &err), &err);
    check_near(volume_of(&mesh), expected, tolerance * expected);
    for (int32_t i = 0; i < 3 * mesh.face_count; i++)
        assert_true(mesh.faces[i] >= 0 && mesh.faces[i] < mesh.vertex_count);
    pliant_obstacle_mesh_clear(&mesh);
}

static void solids_enclose_their_volume(void **state)
{
    (void)state;
    const double pi = acos(-1.0);
    pliant_obstacle o = pliant_obstacle_default(PLIANT_OBSTACLE_SPHERE);
    o.a = (pliant_vec3){3, -4, 5};
    o.radius = 2;
    // A polyhedron inscribed: 32 around and 16 from pole to pole lack about 1.3%.
    check_volume(&o, 4 * pi / 3 * 8 * 0.987, 0.006);

    o = pliant_obstacle_default(PLIANT_OBSTACLE_BOX);
    o.a = (pliant_vec3){3, -4, 5};
    o.b = (pliant_vec3){1, 2, 0.5f};
    o.rotation[0] = 0.6f;
    o.rotation[3] = 0.8f;
    check_volume(&o, 8, 1e-5);

    o = pliant_obstacle_default(PLIANT_OBSTACLE_CAPSULE);
    o.a = (pliant_vec3){1, 1, 1};
    o.b = (pliant_vec3){1, 5, 1};
    o.radius = o.radius_b = 0.5f;
    check_volume(&o, (pi + pi / 6) * 0.99, 0.01);
    // Tapered to a point: the cone between the seams, and the cap below its seam. With
    // sin(s) = r / L: ball's cap below latitude s, cone of base r cos s and height L - r sin s.
    o.radius_b = 0;
    const double r = 0.5, l = 4, s = asin(r / l), h = r + r * sin(s), base = r * cos(s);
    const double cap = pi * h * h * (3 * r - h) / 3;
    check_volume(&o, (cap + pi * base * base * (l - r * sin(s)) / 3) * 0.99, 0.01);
    // One ball inside the other: the larger alone, wherever it is.
    o.b = (pliant_vec3){1, 1.25f, 1};
    o.radius = 0.25f;
    o.radius_b = 2;
    check_volume(&o, 4 * pi / 3 * 8 * 0.987, 0.006);
}

static void capsules_reach_from_end_to_end(void **state)
{
    (void)state;
    pliant_obstacle o = pliant_obstacle_default(PLIANT_OBSTACLE_CAPSULE);
    pliant_obstacle_mesh mesh = {0};
    pliant_error err;
    o.a = (pliant_vec3){1, 1, 1};
    o.b = (pliant_vec3){1, 1, 4};
    o.radius = 0.5f;
    o.radius_b = 0.25f;
    o.rotation[0] = (float)sqrt(0.5);  // a quarter turn about x: z goes to -y
    o.rotation[3] = (float)sqrt(0.5);
    check_ok(pliant_obstacle_mesh_make(&mesh, &o, 1, low, high, &err), &err);
    double least = INFINITY, most = -INFINITY;
    for (int32_t v = 0; v < mesh.vertex_count; v++) {
        least = fmin(least, mesh.positions[3 * v + 1]);
        most = fmax(most, mesh.positions[3 * v + 1]);
    }
    check_near(most, 1.5, 1e-6);
    check_near(least, -2.25, 1e-6);
    pliant_obstacle_mesh_clear(&mesh);
}

static void planes_are_squares_about_the_region(void **state)
{
    (void)state;
    pliant_obstacle o[2] = {pliant_obstacle_default(PLIANT_OBSTACLE_PLANE),
                            pliant_obstacle_default(PLIANT_OBSTACLE_NONE)};
    pliant_obstacle_mesh mesh = {0};
    pliant_error err;
    o[0].a = (pliant_vec3){50, 0, 2};
    o[0].b = (pliant_vec3){0, 6, 8};
    check_ok(pliant_obstacle_mesh_make(&mesh, o, 2, low, high, &err), &err);
    assert_true(mesh.face_count > 0);
    double middle[3] = {0, 0, 0};
    for (int32_t v = 0; v < mesh.vertex_count; v++) {
        const double *p = mesh.positions + 3 * v;
        check_near(0.6 * p[1] + 0.8 * (p[2] - 2), 0, 1e-6);
        for (int c = 0; c < 3; c++) middle[c] += p[c] / mesh.vertex_count;
    }
    // The region's middle, (1, 0, -1), seen along the normal.
    check_near(middle[0], 1, 1e-6);
    check_near(middle[1], 0 + 0.6 * 2.4, 1e-6);
    check_near(middle[2], -1 + 0.8 * 2.4, 1e-6);
    // Faces look the way the normal does.
    const double *a = mesh.positions + 3 * mesh.faces[0], *b = mesh.positions + 3 * mesh.faces[1],
                 *c = mesh.positions + 3 * mesh.faces[2];
    assert_true((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0);
    // Made again, of nothing.
    check_ok(pliant_obstacle_mesh_make(&mesh, NULL, 0, low, high, &err), &err);
    assert_int_equal(mesh.vertex_count + mesh.face_count, 0);
    pliant_obstacle_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(solids_enclose_their_volume),
        cmocka_unit_test(capsules_reach_from_end_to_end),
        cmocka_unit_test(planes_are_squares_about_the_region),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
