// test_mesh.c: volumes and areas of indexed triangle meshes.
#include "check.h"

#include "pliant/mesh.h"
#include "surfaces.h"

#include <math.h>
#include <string.h>

static void a_new_mesh_is_zero_and_holds_what_was_asked(void **state)
{
    (void)state;
    pliant_mesh *m = NULL;
    pliant_error err;
    check_ok(pliant_mesh_create(5, 7, &m, &err), &err);
    assert_int_equal(m->vertex_count, 5);
    assert_int_equal(m->face_count, 7);
    for (int i = 0; i < 15; i++) assert_true(m->vertices[i] == 0);
    for (int i = 0; i < 21; i++) assert_int_equal(m->faces[i], 0);
    pliant_mesh_destroy(m);
    check_ok(pliant_mesh_create(0, 0, &m, &err), &err);
    check_near(pliant_mesh_volume(m), 0, 0);
    pliant_mesh_destroy(m);
    pliant_mesh_destroy(NULL);
}

static void negative_counts_are_refused(void **state)
{
    (void)state;
    const int32_t counts[][2] = {{-1, 4}, {4, -1}, {INT32_MIN, INT32_MIN}};
    for (int i = 0; i < 3; i++) {
        pliant_mesh *m = NULL;
        pliant_error err = {{0}};
        assert_int_equal(pliant_mesh_create(counts[i][0], counts[i][1], &m, &err),
                         PLIANT_ERR_ARGUMENT);
        assert_null(m);
        assert_non_null(strstr(err.text, "mesh of"));
    }
}

static void turning_the_faces_turns_the_sign_of_the_volume(void **state)
{
    (void)state;
    pliant_mesh *m = check_block(2);
    check_near(pliant_mesh_volume(m), 13, 1e-13);
    for (int32_t f = 0; f < m->face_count; f++) {
        const int32_t keep = m->faces[3 * f];
        m->faces[3 * f] = m->faces[3 * f + 1];
        m->faces[3 * f + 1] = keep;
    }
    check_near(pliant_mesh_volume(m), -13, 1e-13);
    pliant_mesh_destroy(m);
}

static void the_volume_of_a_small_body_far_away_keeps_its_digits(void **state)
{
    (void)state;
    pliant_mesh *m = check_icosahedron();
    // Multiples of 2^-20, so that moving is exact and changes no difference of coordinates.
    for (int i = 0; i < 36; i++) m->vertices[i] = round(ldexp(m->vertices[i], 20)) * 0x1p-20;
    const double here = pliant_mesh_volume(m);
    check_near(here, 2.5361507, 1e-5);
    const double away[3] = {1234567.25, -7654321.5, 3141592.75};
    for (int i = 0; i < 36; i++) m->vertices[i] += away[i % 3];
    check_near(pliant_mesh_volume(m), here, 1e-14);
    pliant_mesh_destroy(m);
}

static void hat_function_areas_share_each_face_in_thirds(void **state)
{
    (void)state;
    double areas[8];
    pliant_mesh *cube = check_cube();
    pliant_mesh_vertex_areas(8, cube->vertices, 12, cube->faces, areas);
    int32_t faces_at[8] = {0};
    for (int i = 0; i < 36; i++) faces_at[cube->faces[i]]++;
    double sum = 0;
    for (int v = 0; v < 8; v++) {
        check_near(areas[v], faces_at[v] * 2.0 / 3, 1e-14);  // every face has area 2
        sum += areas[v];
    }
    check_near(sum, 24, 1e-13);
    pliant_mesh_destroy(cube);
}

static void spheres_approach_theirs_in_second_order(void **state)
{
    (void)state;
    // Inscribed facets of edge h lose O(h^2) of area and volume, and refinement halves h: theory 2
    // in the exponent, accept 1.9 to 2.1.
    const double pi = 3.141592653589793;
    double area_error[5], volume_error[5];
    for (int32_t levels = 1; levels < 5; levels++) {
        check_surface s = check_sphere(levels);
        double area = 0;
        for (int32_t v = 0; v < s.mesh->vertex_count; v++) area += s.areas[v];
        area_error[levels] = 4 * pi - area;
        volume_error[levels] = 4 * pi / 3 - pliant_mesh_volume(s.mesh);
        check_surface_destroy(&s);
    }
    for (int levels = 2; levels < 5; levels++) {
        check_near(log2(area_error[levels - 1] / area_error[levels]), 2, 0.1);
        check_near(log2(volume_error[levels - 1] / volume_error[levels]), 2, 0.1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_new_mesh_is_zero_and_holds_what_was_asked),
        cmocka_unit_test(negative_counts_are_refused),
        cmocka_unit_test(turning_the_faces_turns_the_sign_of_the_volume),
        cmocka_unit_test(the_volume_of_a_small_body_far_away_keeps_its_digits),
        cmocka_unit_test(hat_function_areas_share_each_face_in_thirds),
        cmocka_unit_test(spheres_approach_theirs_in_second_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
