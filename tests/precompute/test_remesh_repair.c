// test_remesh_repair.c: small defects are mended before a mesh is remeshed, large ones left to be
// named.
#include "check.h"

#include "mesh/mesh_check.h"
#include "remesh/repair.h"
#include "surfaces.h"

#include <stdlib.h>
#include <string.h>

// A mesh with room for more, to be spoilt.
static pliant_mesh *spoil(const pliant_mesh *from, int32_t more_vertices, int32_t more_faces)
{
    pliant_mesh *mesh = NULL;
    pliant_error err = {""};
    check_ok(pliant_mesh_create(from->vertex_count + more_vertices, from->face_count + more_faces,
                                &mesh, &err),
             &err);
    memcpy(mesh->vertices, from->vertices, 3 * (size_t)from->vertex_count * sizeof(double));
    memcpy(mesh->faces, from->faces, 3 * (size_t)from->face_count * sizeof(int32_t));
    return mesh;
}

// Repaired, it is the sphere again: closed, with so many vertices and faces. Frees it.
static pliant_repair_report check_repaired(pliant_mesh *mesh, int32_t vertices, int32_t faces)
{
    pliant_repair_report report;
    pliant_mesh_report checked;
    int32_t *source = NULL;
    pliant_error err = {""};
    check_ok(pliant_repair(&mesh, &source, &report, &err), &err);
    check_ok(pliant_mesh_check(mesh, "mesh", &checked, &err), &err);
    assert_int_equal(mesh->vertex_count, vertices);
    assert_int_equal(mesh->face_count, faces);
    assert_true(checked.volume > 0);
    assert_int_equal(checked.turned_count, 0);
    free(source);
    pliant_mesh_destroy(mesh);
    return report;
}

static void a_sound_mesh_stays_as_it_is(void **state)
{
    (void)state;
    check_surface s = check_sphere(2);
    pliant_mesh *mesh = spoil(s.mesh, 0, 0);
    pliant_repair_report report;
    int32_t *source = NULL;
    pliant_error err = {""};
    check_ok(pliant_repair(&mesh, &source, &report, &err), &err);
    assert_string_equal(report.text, "");
    assert_int_equal(mesh->vertex_count, s.mesh->vertex_count);
    assert_memory_equal(mesh->vertices, s.mesh->vertices,
                        3 * (size_t)mesh->vertex_count * sizeof(double));
    assert_memory_equal(mesh->faces, s.mesh->faces, 3 * (size_t)mesh->face_count * sizeof(int32_t));
    for (int32_t v = 0; v < mesh->vertex_count; v++) assert_int_equal(source[v], v);
    free(source);
    pliant_mesh_destroy(mesh);
    check_surface_destroy(&s);
}

static void a_soup_of_triangles_is_welded(void **state)
{
    (void)state;
    check_surface s = check_sphere(2);
    pliant_mesh *soup = NULL;
    pliant_error err = {""};
    check_ok(pliant_mesh_create(3 * s.mesh->face_count, s.mesh->face_count, &soup, &err), &err);
    for (int32_t h = 0; h < 3 * s.mesh->face_count; h++) {
        soup->faces[h] = h;
        memcpy(soup->vertices + 3 * (size_t)h, s.mesh->vertices + 3 * (size_t)s.mesh->faces[h],
               3 * sizeof(double));
    }
    const pliant_repair_report report = check_repaired(soup, 162, 320);
    assert_int_equal(report.welded, 960 - 162);
    check_surface_destroy(&s);
}

static void faces_the_wrong_way_are_turned(void **state)
{
    (void)state;
    check_surface s = check_sphere(2);
    pliant_mesh *mesh = spoil(s.mesh, 0, 0);
    for (int32_t f = 0; f < 320; f += 16) {
        const int32_t swapped = mesh->faces[3 * f];
        mesh->faces[3 * f] = mesh->faces[3 * f + 1];
        mesh->faces[3 * f + 1] = swapped;
    }
    assert_int_equal(check_repaired(mesh, 162, 320).turned, 20);
    check_surface_destroy(&s);
}

static void doubled_and_degenerate_faces_and_unused_vertices_go(void **state)
{
    (void)state;
    check_surface s = check_sphere(2);
    pliant_mesh *mesh = spoil(s.mesh, 1, 2);
    memcpy(mesh->faces + 3 * 320, mesh->faces, 3 * sizeof(int32_t));
    mesh->faces[3 * 321] = mesh->faces[3 * 321 + 1] = 5;
    mesh->faces[3 * 321 + 2] = 7;
    for (int k = 0; k < 3; k++) mesh->vertices[3 * 162 + k] = 5;
    const pliant_repair_report report = check_repaired(mesh, 162, 320);
    assert_int_equal(report.dropped, 2);
    assert_int_equal(report.unused, 1);
    check_surface_destroy(&s);
}

// A face split at the middle of a side, closed by a face without area.
static void a_face_without_area_is_flipped_away(void **state)
{
    (void)state;
    check_surface s = check_sphere(2);
    pliant_mesh *mesh = spoil(s.mesh, 1, 2);
    const int32_t a = mesh->faces[0], b = mesh->faces[1], c = mesh->faces[2], m = 162;
    for (int k = 0; k < 3; k++)
        mesh->vertices[3 * m + k] = (mesh->vertices[3 * a + k] + mesh->vertices[3 * b + k]) / 2;
    const int32_t faces[3][3] = {{a, m, c}, {m, b, c}, {a, b, m}};
    memcpy(mesh->faces, faces[0], sizeof faces[0]);
    memcpy(mesh->faces + 3 * 320, faces + 1, 2 * sizeof faces[0]);
    (void)check_repaired(mesh, 163, 322);
    check_surface_destroy(&s);
}

static void a_tiny_hole_is_closed_and_a_large_one_named(void **state)
{
    (void)state;
    check_surface s = check_sphere(4);
    pliant_mesh *mesh = spoil(s.mesh, 0, 0);
    mesh->face_count -= 1;
    assert_int_equal(check_repaired(mesh, 2562, 5120).filled, 1);
    mesh = spoil(s.mesh, 0, 0);
    mesh->face_count -= 700;
    pliant_repair_report report;
    pliant_mesh_report checked;
    int32_t *source = NULL;
    pliant_error err = {""};
    check_ok(pliant_repair(&mesh, &source, &report, &err), &err);
    assert_int_equal(report.filled, 0);
    assert_int_equal(pliant_mesh_check(mesh, "mesh", &checked, &err), PLIANT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "open"));
    free(source);
    pliant_mesh_destroy(mesh);
    check_surface_destroy(&s);
}

static void surfaces_that_touch_in_a_vertex_are_parted(void **state)
{
    (void)state;
    // Two tetrahedra, the second mirrored in a corner of the first.
    pliant_mesh *one = check_tetrahedron(), *mesh = spoil(one, 3, 4);
    int32_t number[4] = {0, 4, 5, 6};
    for (int v = 1; v < 4; v++)
        for (int k = 0; k < 3; k++)
            mesh->vertices[3 * number[v] + k] = 2 * one->vertices[k] - one->vertices[3 * v + k];
    for (int32_t f = 0; f < 4; f++) {
        mesh->faces[12 + 3 * f] = number[one->faces[3 * f]];
        mesh->faces[12 + 3 * f + 1] = number[one->faces[3 * f + 2]];
        mesh->faces[12 + 3 * f + 2] = number[one->faces[3 * f + 1]];
    }
    assert_int_equal(check_repaired(mesh, 8, 8).split, 1);
    pliant_mesh_destroy(one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sound_mesh_stays_as_it_is),
        cmocka_unit_test(a_soup_of_triangles_is_welded),
        cmocka_unit_test(faces_the_wrong_way_are_turned),
        cmocka_unit_test(doubled_and_degenerate_faces_and_unused_vertices_go),
        cmocka_unit_test(a_face_without_area_is_flipped_away),
        cmocka_unit_test(a_tiny_hole_is_closed_and_a_large_one_named),
        cmocka_unit_test(surfaces_that_touch_in_a_vertex_are_parted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL) != 0;
}
