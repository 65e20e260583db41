// test_fem_size_field.c: how long edges inside a solid should be, and that tetrahedra follow.
#include "check.h"
#include "surfaces.h"

#include "fem/size_field.h"
#include "fem/volume.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double distance(const double *a, const double *b)
{
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

static double size_at(const pliant_mesh *mesh, double growth, const double x[3])
{
    pliant_error err;
    pliant_size_field *field = NULL;
    check_ok(pliant_size_field_create(mesh, growth, &field, &err), &err);
    const double size = pliant_size_field_at(field, x);
    pliant_size_field_destroy(field);
    return size;
}

static void sizes_begin_with_the_edges_around_a_vertex(void **state)
{
    (void)state;
    check_surface blob = check_blob(2);
    const pliant_mesh *mesh = blob.mesh;
    for (int32_t v = 0; v < mesh->vertex_count; v += 7) {
        double sum = 0;
        int count = 0;
        for (int32_t f = 0; f < mesh->face_count; f++)
            for (int k = 0; k < 3; k++)
                if (mesh->faces[3 * f + k] == v) {
                    sum += distance(mesh->vertices + 3 * (size_t)v,
                                    mesh->vertices + 3 * (size_t)mesh->faces[3 * f + (k + 1) % 3]);
                    count++;
                }
        const double *x = mesh->vertices + 3 * (size_t)v;
        check_near(size_at(mesh, 1.7, x), sum / count, 1e-14);
    }
    check_surface_destroy(&blob);
}

// The slope at the surface, and the cube root deep inside.
static void sizes_grow_with_the_cube_root_of_the_distance(void **state)
{
    (void)state;
    check_surface sphere = check_sphere(4);
    const double *x = sphere.mesh->vertices;
    const double h = size_at(sphere.mesh, 1.2, x);
    const double below[3] = {x[0] * (1 - 1e-3 * h), x[1] * (1 - 1e-3 * h), x[2] * (1 - 1e-3 * h)};
    check_near((size_at(sphere.mesh, 1.2, below) - h) / (1e-3 * h), 0.2, 1e-3);
    const double half[3] = {x[0] / 2, x[1] / 2, x[2] / 2};
    check_near(pow(size_at(sphere.mesh, 1.2, half) / h, 3), 1 + 0.6 * 0.5 / h, 1e-9);
    check_near(size_at(sphere.mesh, 1, half), h, 1e-15);
    check_near(size_at(sphere.mesh, 0, half), h, 1e-15);
    check_surface_destroy(&sphere);
}

typedef struct filling {
    double tets;
    double edge_near, edge_deep;  // mean lengths, within a tenth of the surface, beyond a half
} filling;

static filling fill(const pliant_mesh *mesh, double growth)
{
    pliant_error err;
    pliant_tetrahedra *t = NULL;
    const pliant_volume_def def = {.surface = mesh, .mesh_name = "mesh", .growth = growth};
    check_ok(pliant_volume_create(&def, &t, &err), &err);
    assert_memory_equal(t->nodes, mesh->vertices,
                        3 * (size_t)mesh->vertex_count * sizeof *mesh->vertices);
    filling f = {.tets = t->tet_count};
    int near_count = 0, deep_count = 0;
    for (int32_t e = 0; e < t->tet_count; e++)
        for (int a = 0; a < 4; a++)
            for (int b = 0; b < a; b++) {
                const double *x = t->nodes + 3 * (size_t)t->tets[4 * (size_t)e + a],
                             *y = t->nodes + 3 * (size_t)t->tets[4 * (size_t)e + b];
                const double origin[3] = {0, 0, 0};
                const double deepest = 1 - fmin(distance(x, origin), distance(y, origin));
                if (deepest < 0.1) f.edge_near += distance(x, y), near_count++;
                if (deepest > 0.5) f.edge_deep += distance(x, y), deep_count++;
            }
    f.edge_near /= near_count;
    f.edge_deep /= deep_count;
    assert_true(pliant_tetrahedra_quality(t) > 0.05);
    pliant_tetrahedra_destroy(t);
    return f;
}

static void tetrahedra_follow_and_their_number_goes_with_the_surface(void **state)
{
    (void)state;
    filling alike[2], growing[2];
    for (int k = 0; k < 2; k++) {
        check_surface sphere = check_sphere(3 + k);
        alike[k] = fill(sphere.mesh, 1);
        growing[k] = fill(sphere.mesh, 1.2);
        const filling *g = &growing[k], *a = &alike[k];
        print_message(
            "%d vertices: %.0f tetrahedra alike, %.0f growing; edges %.3f and %.3f deep\n",
            sphere.mesh->vertex_count, a->tets, g->tets, a->edge_deep, g->edge_deep);
        assert_true(g->tets < 0.8 * a->tets);
        check_near(g->edge_near, a->edge_near, 0.15 * a->edge_near);
        // The inner half of the radius is 1 - 3/4 1/2 deep on average, and the surface's triangles
        // are nearly regular.
        const double h = sqrt(4 * 3.14159265 / sphere.mesh->face_count * 4 / sqrt(3));
        check_near(g->edge_deep / a->edge_deep, cbrt(1 + 0.6 * 0.625 / h), 0.1);
        check_surface_destroy(&sphere);
    }
    // With half the edges: 8 times as many, and 4 times but for the logarithm.
    check_at_least(alike[1].tets / alike[0].tets, 7);
    check_at_most(growing[1].tets / growing[0].tets, 6.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sizes_begin_with_the_edges_around_a_vertex),
        cmocka_unit_test(sizes_grow_with_the_cube_root_of_the_distance),
        cmocka_unit_test(tetrahedra_follow_and_their_number_goes_with_the_surface),
    };
    return cmocka_run_group_tests(tests, NULL, NULL) != 0;
}
