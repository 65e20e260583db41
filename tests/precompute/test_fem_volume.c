// test_fem_volume.c: insides of surfaces: meshed, read from Gmsh files, refused.
#include "check.h"
#include "command.h"
#include "surfaces.h"

#include "fem/volume.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static pliant_tetrahedra *fill(const pliant_mesh *mesh, const char *file)
{
    pliant_error err;
    pliant_tetrahedra *t = NULL;
    check_ok(
        pliant_volume_create(
            &(pliant_volume_def){.surface = mesh, .mesh_name = "mesh", .file = file}, &t, &err),
        &err);
    return t;
}

static double volume_of(const pliant_tetrahedra *t)
{
    double sum = 0;
    for (int32_t e = 0; e < t->tet_count; e++) {
        const int32_t *v = t->tets + (size_t)e * t->tet_nodes;
        double a[3][3];
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                a[k][i] = t->nodes[3 * (size_t)v[k + 1] + i] - t->nodes[3 * (size_t)v[0] + i];
        const double six = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                           a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
        assert_true(six > 0);
        sum += six / 6;
    }
    return sum;
}

static void check_kept(const pliant_tetrahedra *t, const pliant_mesh *mesh)
{
    assert_int_equal(t->surface_count, mesh->vertex_count);
    assert_memory_equal(t->nodes, mesh->vertices,
                        3 * (size_t)mesh->vertex_count * sizeof *mesh->vertices);
    for (int32_t f = 0; f < mesh->face_count; f++)
        assert_memory_equal(t->faces + (size_t)f * t->face_nodes, mesh->faces + 3 * (size_t)f,
                            3 * sizeof *mesh->faces);
    check_near(volume_of(t), pliant_mesh_volume(mesh), 1e-12 * pliant_mesh_volume(mesh));
}

static void the_inside_is_filled_and_the_surface_kept(void **state)
{
    (void)state;
    check_surface solids[] = {check_blob(3), check_refine(check_torus(8, 6), 1),
                              check_refine(check_block(2), 1),
                              check_refine(check_beside(check_cube(), check_icosahedron()), 2)};
    for (int i = 0; i < 4; i++) {
        pliant_tetrahedra *t = fill(solids[i].mesh, NULL);
        check_kept(t, solids[i].mesh);
        pliant_error err;
        const int32_t corners = t->node_count;
        check_ok(pliant_tetrahedra_raise(t, &err), &err);
        check_kept(t, solids[i].mesh);
        for (int32_t k = corners; k < t->node_count; k++)
            for (int c = 0; c < 3; c++) {
                const int32_t *ends = t->ends + 2 * (size_t)(k - corners);
                check_near(
                    t->nodes[3 * (size_t)k + c],
                    (t->nodes[3 * (size_t)ends[0] + c] + t->nodes[3 * (size_t)ends[1] + c]) / 2, 0);
            }
        // Midpoints are where element and face say: between those corners.
        static const int ends[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
        for (int32_t e = 0; e < t->tet_count; e++)
            for (int k = 0; k < 6; k++) {
                const int32_t *v = t->tets + 10 * (size_t)e,
                              *end = t->ends + 2 * (size_t)(v[4 + k] - corners);
                const int32_t a = v[ends[k][0]], b = v[ends[k][1]];
                assert_true(end[0] == (a < b ? a : b) && end[1] == (a < b ? b : a));
            }
        for (int32_t f = 0; f < t->face_count; f++)
            for (int k = 0; k < 3; k++) {
                const int32_t *v = t->faces + 6 * (size_t)f,
                              *end = t->ends + 2 * (size_t)(v[3 + k] - corners);
                const int32_t a = v[k], b = v[(k + 1) % 3];
                assert_true(end[0] == (a < b ? a : b) && end[1] == (a < b ? b : a));
            }
        print_message("solid %d: %d tetrahedra, quality %.2f\n", i, t->tet_count,
                      pliant_tetrahedra_quality(t));
        check_at_least(pliant_tetrahedra_quality(t), 0.02);
        pliant_tetrahedra_destroy(t);
        check_surface_destroy(&solids[i]);
    }
}

// A cavity stays empty, and what lies in it is filled again.
static void cavities_stay_empty(void **state)
{
    (void)state;
    check_surface sphere = check_sphere(2);
    const int32_t n = sphere.mesh->vertex_count, faces = sphere.mesh->face_count;
    static const double radius[3] = {1, 0.6, 0.3};
    pliant_mesh *mesh = NULL;
    pliant_error err;
    check_ok(pliant_mesh_create(3 * n, 3 * faces, &mesh, &err), &err);
    for (int s = 0; s < 3; s++) {
        for (int32_t i = 0; i < 3 * n; i++)
            mesh->vertices[3 * n * s + i] = radius[s] * sphere.mesh->vertices[i];
        for (int32_t f = 0; f < faces; f++)
            for (int k = 0; k < 3; k++)
                mesh->faces[3 * (faces * s + f) + k] =
                    n * s + sphere.mesh->faces[3 * f + (s == 1 ? 2 - k : k)];
    }
    pliant_tetrahedra *t = fill(mesh, NULL);
    check_kept(t, mesh);
    pliant_tetrahedra_destroy(t);
    pliant_mesh_destroy(mesh);
    check_surface_destroy(&sphere);
}

// ---- Files ----

typedef struct spoil {
    int32_t moved;  // node moved off its place; -1: none
    double by;
    int32_t left_out;   // tetrahedron; -1: none
    int element;        // Gmsh's type; 0: tetrahedra
    const char *group;  // name of the physical volume of tetrahedra with x > 0; NULL: none
    int is_shuffled;    // nodes numbered backwards, with gaps
} spoil;

static const char *write_msh(const pliant_tetrahedra *t, spoil how)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/volume.msh", check_folder());
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fprintf(out, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n");
    if (how.group) fprintf(out, "$PhysicalNames\n1\n3 7 \"%s\"\n$EndPhysicalNames\n", how.group);
    fprintf(out, "$Nodes\n%d\n", t->node_count);
    for (int32_t i = 0; i < t->node_count; i++) {
        const double *x = t->nodes + 3 * (size_t)i;
        fprintf(out, "%d %.17g %.17g %.17g\n", how.is_shuffled ? 5 * (t->node_count - i) : i + 1,
                x[0] + (i == how.moved ? how.by : 0), x[1], x[2]);
    }
    fprintf(out, "$EndNodes\n$Elements\n%d\n", t->tet_count - (how.left_out >= 0));
    for (int32_t e = 0; e < t->tet_count; e++) {
        if (e == how.left_out) continue;
        const int32_t *v = t->tets + 4 * (size_t)e;
        double middle = 0;
        for (int k = 0; k < 4; k++) middle += t->nodes[3 * (size_t)v[k]];
        const int inside = how.group && middle > 0;
        fprintf(out, "%d %d 2 %d %d", e + 1, how.element ? how.element : 4, inside ? 7 : 0,
                inside ? 2 : 1);
        for (int k = 0; k < 4; k++)
            fprintf(out, " %d", how.is_shuffled ? 5 * (t->node_count - v[k]) : v[k] + 1);
        for (int k = 4; how.element == 5 && k < 8; k++) fprintf(out, " %d", v[k - 4] + 1);
        fprintf(out, "\n");
    }
    fprintf(out, "$EndElements\n");
    fclose(out);
    return path;
}

static void refused(const pliant_mesh *mesh, const char *file, const char *region, const char *part)
{
    pliant_error err = {""};
    pliant_tetrahedra *t = NULL;
    const pliant_volume_def def = {.surface = mesh,
                                   .mesh_name = "mesh",
                                   .file = file,
                                   .region_count = region != NULL,
                                   .region_names = &region};
    assert_true(pliant_volume_create(&def, &t, &err) < 0);
    if (!strstr(err.text, part)) {
        print_error("'%s' is not in '%s'\n", part, err.text);
        fail();
    }
    assert_null(strchr(err.text, '\n'));
}

static void files_give_what_they_hold(void **state)
{
    (void)state;
    check_surface blob = check_blob(1);
    pliant_tetrahedra *t = fill(blob.mesh, NULL);
    for (int i = 0; i < 2; i++) {
        // Off by less than 1e-6 of the size: put in place.
        pliant_tetrahedra *again =
            fill(blob.mesh,
                 write_msh(t, (spoil){.moved = 3, .by = 5e-7, .left_out = -1, .is_shuffled = i}));
        check_kept(again, blob.mesh);
        assert_int_equal(again->tet_count, t->tet_count);
        assert_int_equal(again->node_count, t->node_count);
        pliant_tetrahedra_destroy(again);
    }
    pliant_error err;
    pliant_tetrahedra *parts = NULL;
    const char *name = "right: half";
    const pliant_volume_def def = {
        .surface = blob.mesh,
        .mesh_name = "mesh",
        .region_count = 1,
        .region_names = &name,
        .file = write_msh(t, (spoil){.moved = -1, .left_out = -1, .group = name})};
    check_ok(pliant_volume_create(&def, &parts, &err), &err);
    int32_t count = 0;
    for (int32_t e = 0; e < parts->tet_count; e++) {
        double middle = 0;
        for (int k = 0; k < 4; k++)
            middle += parts->nodes[3 * (size_t)parts->tets[4 * (size_t)e + k]];
        assert_int_equal(parts->regions[e], middle > 0);
        count += parts->regions[e];
    }
    assert_true(count > 0 && count < parts->tet_count);
    pliant_tetrahedra_destroy(parts);
    refused(blob.mesh, def.file, "left", "has no physical volume 'left'");
    pliant_tetrahedra_destroy(t);
    check_surface_destroy(&blob);
}

static void files_that_do_not_fit_are_refused(void **state)
{
    (void)state;
    check_surface blob = check_blob(1), other = check_blob(2);
    pliant_tetrahedra *t = fill(blob.mesh, NULL);
    refused(blob.mesh, "none.msh", NULL, "none.msh: cannot be opened");
    refused(blob.mesh, "scripts/sample/whale.obj", NULL, "expected a Gmsh mesh file");
    refused(blob.mesh, write_msh(t, (spoil){.moved = 3, .by = 1e-3, .left_out = -1}), NULL,
            "no node of it lies at vertex 3");
    refused(other.mesh, write_msh(t, (spoil){.moved = -1, .left_out = -1}), NULL,
            "no node of it lies at vertex");
    refused(blob.mesh, write_msh(t, (spoil){.moved = -1, .left_out = 0}), NULL,
            "its boundary is not the model's surface");
    refused(blob.mesh, write_msh(t, (spoil){.moved = -1, .left_out = -1, .element = 5}), NULL,
            "found elements of type 5");
    pliant_tetrahedra_destroy(t);
    check_surface_destroy(&other);
    check_surface_destroy(&blob);
}

static void flat_and_loose_tetrahedra_are_refused(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_tetrahedron();
    pliant_error err;
    pliant_tetrahedra *t = NULL;
    double nodes[18];
    memcpy(nodes, mesh->vertices, 12 * sizeof *nodes);
    for (int i = 0; i < 6; i++) nodes[12 + i] = 0;
    const int32_t whole[] = {0, 1, 2, 3}, flat[] = {0, 1, 2, 3, 4, 5, 4, 5}, loose[] = {0, 1, 2, 4},
                  wrong[] = {0, 1, 2, 9};
    check_ok(pliant_tetrahedra_create(mesh, &(pliant_tetrahedra_def){"x", 4, 1, nodes, whole, NULL},
                                      &t, &err),
             &err);
    assert_int_equal(t->node_count, 4);
    pliant_tetrahedra_destroy(t);
    assert_true(pliant_tetrahedra_create(
                    mesh, &(pliant_tetrahedra_def){"x", 6, 2, nodes, flat, NULL}, &t, &err) < 0);
    assert_non_null(strstr(err.text, "is flat"));
    assert_true(pliant_tetrahedra_create(
                    mesh, &(pliant_tetrahedra_def){"x", 6, 1, nodes, loose, NULL}, &t, &err) < 0);
    assert_non_null(strstr(err.text, "no tetrahedron has surface vertex 3"));
    assert_true(pliant_tetrahedra_create(
                    mesh, &(pliant_tetrahedra_def){"x", 6, 1, nodes, wrong, NULL}, &t, &err) < 0);
    assert_non_null(strstr(err.text, "found 9"));
    pliant_mesh_destroy(mesh);
}

// Two overlapping cubes turned into one component by hand would be no manifold; a sphere with one
// vertex pushed through the other side is one that cuts itself.
static void a_surface_that_cuts_itself_is_refused_with_advice(void **state)
{
    (void)state;
    check_surface sphere = check_sphere(2);
    for (int i = 0; i < 3; i++) sphere.mesh->vertices[3 * 40 + i] *= -1.4;
    refused(sphere.mesh, NULL, NULL, "cannot be cut into tetrahedra");
    refused(sphere.mesh, NULL, NULL, "--volume FILE.msh");
    check_surface_destroy(&sphere);
    // And the next one goes well.
    check_surface blob = check_blob(1);
    pliant_tetrahedra *t = fill(blob.mesh, NULL);
    check_kept(t, blob.mesh);
    pliant_tetrahedra_destroy(t);
    check_surface_destroy(&blob);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_inside_is_filled_and_the_surface_kept),
        cmocka_unit_test(cavities_stay_empty),
        cmocka_unit_test(files_give_what_they_hold),
        cmocka_unit_test(files_that_do_not_fit_are_refused),
        cmocka_unit_test(flat_and_loose_tetrahedra_are_refused),
        cmocka_unit_test(a_surface_that_cuts_itself_is_refused_with_advice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
