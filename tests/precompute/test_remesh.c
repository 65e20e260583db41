// test_remesh.c: arbitrary meshes become semi-regular ones that lie on them.
#include "check.h"

#include "remesh/cover.h"
#include "remesh/remesh.h"
#include "remesh/vector.h"
#include "surfaces.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// An irregular mesh of a smooth or sharp shape: vertices shuffled, edges flipped where that leaves
// the shape alone.
static pliant_mesh *shuffled(check_surface surface, int32_t flips)
{
    check_random random = check_random_seed(7);
    pliant_mesh *mesh = surface.mesh;
    surface.mesh = NULL;
    check_surface_destroy(&surface);
    check_flip_edges(mesh, flips, 4, 9, &random);
    check_shuffle(mesh, &random, NULL);
    return mesh;
}

static pliant_multires *remesh(const pliant_mesh *mesh, int32_t base, int32_t levels,
                               pliant_remesh_report *report)
{
    const pliant_remesh_def def = {base, levels};
    pliant_multires *m = NULL;
    pliant_error err = {""};
    check_ok(pliant_remesh(mesh, &def, &m, report, &err), &err);
    return m;
}

// Levels as hierarchy.h wants them, every vertex on the original, and the aims.
static void check_remeshed(const pliant_mesh *mesh, const pliant_multires *m,
                           const pliant_remesh_report *r)
{
    pliant_hierarchy *hierarchy = NULL;
    pliant_face_tree *tree = NULL;
    pliant_error err = {""};
    check_ok(pliant_hierarchy_create(m->level_count, m->vertex_count, m->mesh->face_count,
                                     m->mesh->faces, m->parents, &hierarchy, &err),
             &err);
    pliant_hierarchy_destroy(hierarchy);
    assert_int_equal(m->level_count, r->levels + 1);
    assert_int_equal(m->vertex_count[0], r->base_vertices);
    assert_int_equal(m->mesh->vertex_count - m->mesh->face_count / 2,
                     mesh->vertex_count - mesh->face_count / 2);
    const double diagonal = pliant_surface_diagonal(mesh);
    check_ok(pliant_face_tree_create(mesh, &tree, &err), &err);
    for (int32_t v = 0; v < m->mesh->vertex_count; v++) {
        double squared;
        (void)pliant_face_tree_closest(tree, m->mesh->vertices + 3 * (size_t)v, &squared);
        check_at_most(sqrt(squared), 1e-12 * diagonal);
    }
    pliant_face_tree_destroy(tree);
    assert_int_equal(r->fit.flipped_count, 0);
    check_at_least(r->fit.smallest_angle, PLIANT_REMESH_ANGLE);
    check_at_most(fmax(r->fit.there, r->fit.back), PLIANT_REMESH_DISTANCE);
    assert_true(r->met);
}

static void shapes_of_all_kinds_are_remeshed(void **state)
{
    (void)state;
    pliant_mesh *shapes[] = {
        shuffled(check_blob(3), 200),
        check_torus(24, 40),
        shuffled(check_refine(check_cube(), 3), 0),
        check_block(2),
        check_beside(check_icosahedron(), check_torus(12, 20)),
        check_tetrahedron(),
    };
    // Triangles across the box's edges cut them off: they have to be smaller. The last chooses by
    // itself.
    static const int32_t bases[] = {60, 100, 150, 400, 160, PLIANT_REMESH_AUTO};
    static const int32_t levels[] = {2, 2, 3, 2, 2, 3};
    static const char *const names[] = {"blob",      "torus",     "sharp box",
                                        "two holes", "two parts", "tetrahedron"};
    for (int i = 0; i < 6; i++) {
        pliant_remesh_report r;
        pliant_multires *m = remesh(shapes[i], bases[i], levels[i], &r);
        printf("%s: %d base vertices of %d, distance %.5f and %.5f, angle %.1f\n", names[i],
               r.base_vertices, shapes[i]->vertex_count, r.fit.there, r.fit.back,
               r.fit.smallest_angle);
        check_remeshed(shapes[i], m, &r);
        pliant_multires_destroy(m);
        pliant_mesh_destroy(shapes[i]);
    }
}

static void levels_are_found_again_in_any_order(void **state)
{
    (void)state;
    pliant_mesh *mesh = shuffled(check_blob(3), 200);
    pliant_remesh_report r;
    pliant_multires *m = remesh(mesh, 40, 3, &r), *found = NULL;
    check_random random = check_random_seed(3);
    check_shuffle(m->mesh, &random, NULL);
    pliant_error err = {""};
    check_ok(pliant_multires_detect(m->mesh, &found, &err), &err);
    check_at_least(found->level_count, 4);
    pliant_multires_destroy(found);
    pliant_multires_destroy(m);
    pliant_mesh_destroy(mesh);
}

// Flat faces between points of a smooth surface miss it by the square of their size.
static void distance_falls_with_the_square_of_size(void **state)
{
    (void)state;
    check_surface sphere = check_sphere(5);
    double mean[3];
    for (int32_t l = 1; l <= 3; l++) {
        pliant_remesh_report r;
        pliant_multires *m = remesh(sphere.mesh, 42, l, &r);
        mean[l - 1] = 0;
        for (int32_t f = 0; f < m->mesh->face_count; f++) {
            double centre[3] = {0, 0, 0};
            for (int k = 0; k < 9; k++)
                centre[k % 3] +=
                    m->mesh->vertices[3 * (size_t)m->mesh->faces[3 * f + k / 3] + k % 3] / 3;
            mean[l - 1] += (1 - pliant_length(centre)) / m->mesh->face_count;
        }
        pliant_multires_destroy(m);
    }
    const double order = log2(mean[0] / mean[2]) / 2;
    printf("distance %.2e %.2e %.2e: order %.2f\n", mean[0], mean[1], mean[2], order);
    check_at_least(order, 1.6);
    check_at_most(order, 2.4);
    check_surface_destroy(&sphere);
}

static void the_same_mesh_gives_the_same_bytes(void **state)
{
    (void)state;
    pliant_mesh *mesh = shuffled(check_blob(2), 50);
    pliant_remesh_report r[2];
    pliant_multires *m[2];
    for (int i = 0; i < 2; i++) m[i] = remesh(mesh, 30, 2, r + i);
    const size_t n = (size_t)m[0]->mesh->vertex_count;
    assert_memory_equal(m[0]->mesh->vertices, m[1]->mesh->vertices, 3 * n * sizeof(double));
    assert_memory_equal(m[0]->mesh->faces, m[1]->mesh->faces,
                        3 * (size_t)m[0]->mesh->face_count * sizeof(int32_t));
    assert_memory_equal(m[0]->source_index, m[1]->source_index, n * sizeof(int32_t));
    assert_memory_equal(&r[0].fit, &r[1].fit, sizeof r[0].fit);
    for (int i = 0; i < 2; i++) pliant_multires_destroy(m[i]);
    pliant_mesh_destroy(mesh);
}

static void a_source_is_named_once(void **state)
{
    (void)state;
    pliant_mesh *mesh = shuffled(check_blob(2), 50);
    pliant_remesh_report r;
    pliant_multires *m = remesh(mesh, 30, 2, &r);
    int32_t *seen = calloc((size_t)mesh->vertex_count, sizeof *seen), count = 0;
    assert_non_null(seen);
    for (int32_t v = 0; v < m->mesh->vertex_count; v++) {
        const int32_t source = m->source_index[v];
        if (source < 0) continue;
        assert_in_range(source, 0, mesh->vertex_count - 1);
        assert_int_equal(seen[source]++, 0);
        count++;
    }
    check_at_least(count, mesh->vertex_count / 3);
    free(seen);
    pliant_multires_destroy(m);
    pliant_mesh_destroy(mesh);
}

static void a_base_too_small_for_the_shape_is_refused(void **state)
{
    (void)state;
    pliant_mesh *torus = check_torus(8, 8);
    const pliant_remesh_def def = {4, 2};
    pliant_multires *m = NULL;
    pliant_remesh_report r;
    pliant_error err = {""};
    assert_int_equal(pliant_remesh(torus, &def, &m, &r, &err), PLIANT_ERR_ARGUMENT);
    assert_null(m);
    assert_non_null(strstr(err.text, "found 4"));
    pliant_mesh_destroy(torus);
}

// ---- The parts ----

static void base_corners_are_carried_to_their_own_vertices(void **state)
{
    (void)state;
    pliant_mesh *mesh = shuffled(check_blob(3), 200);
    pliant_coarsening *c = NULL;
    pliant_mesh *base = NULL;
    pliant_surface *s = NULL;
    pliant_error err = {""};
    check_ok(pliant_coarsening_create(mesh, &c, &err), &err);
    check_ok(pliant_surface_create(mesh, &s, &err), &err);
    const int32_t n = 20;
    assert_int_equal(pliant_coarsening_least(c), 4);
    check_ok(pliant_coarsening_base(c, n, &base, &err), &err);
    assert_int_equal(base->vertex_count, n);
    assert_int_equal(base->face_count, 2 * n - 4);
    pliant_place *places = calloc(3 * (size_t)base->face_count, sizeof *places);
    assert_non_null(places);
    for (int32_t h = 0; h < 3 * base->face_count; h++) {
        places[h].face = h / 3;
        places[h].weight[h % 3] = 1;
    }
    check_ok(pliant_coarsening_unfold(c, n, places, 3 * base->face_count, &err), &err);
    for (int32_t h = 0; h < 3 * base->face_count; h++) {
        double x[3];
        pliant_surface_position(s, places + h, x);
        check_at_most(sqrt(pliant_squared_distance(x, base->vertices + 3 * (size_t)base->faces[h])),
                      1e-9);
    }
    free(places);
    pliant_mesh_destroy(base);
    pliant_surface_destroy(s);
    pliant_coarsening_destroy(c);
    pliant_mesh_destroy(mesh);
}

static void a_walk_goes_straight_on_across_edges(void **state)
{
    (void)state;
    pliant_mesh *cube = check_cube();
    pliant_face_tree *tree = NULL;
    pliant_surface *s = NULL;
    pliant_error err = {""};
    check_ok(pliant_face_tree_create(cube, &tree, &err), &err);
    check_ok(pliant_surface_create(cube, &s, &err), &err);
    // From the top, over the edge x = 1, down the side: 0.75 along, 0.25 to the edge.
    const double from[3] = {0.75, 0.125, 1}, d[3] = {0.75, 0.25, 0.5};
    double x[3], squared;
    const pliant_place start = pliant_face_tree_closest(tree, from, &squared);
    check_near(squared, 0, 1e-30);
    const pliant_place end = pliant_surface_walk(s, &start, d);
    pliant_surface_position(s, &end, x);
    const double expected[3] = {1, 0.375, 0.5};
    for (int k = 0; k < 3; k++) check_near(x[k], expected[k], 1e-12);
    pliant_surface_destroy(s);
    pliant_face_tree_destroy(tree);
    pliant_mesh_destroy(cube);
}

static void the_tree_finds_what_all_faces_say(void **state)
{
    (void)state;
    check_surface blob = check_blob(2);
    const pliant_mesh *mesh = blob.mesh;
    pliant_face_tree *tree = NULL;
    pliant_error err = {""};
    check_ok(pliant_face_tree_create(mesh, &tree, &err), &err);
    check_random random = check_random_seed(11);
    for (int i = 0; i < 500; i++) {
        double x[3], least = INFINITY, found;
        for (int k = 0; k < 3; k++) x[k] = 4 * check_random_next(&random) - 2;
        for (int32_t f = 0; f < mesh->face_count; f++) {
            const double *p[3];
            double w[3], q[3];
            for (int k = 0; k < 3; k++) p[k] = mesh->vertices + 3 * (size_t)mesh->faces[3 * f + k];
            pliant_triangle_closest(p[0], p[1], p[2], x, w);
            for (int k = 0; k < 3; k++) q[k] = w[0] * p[0][k] + w[1] * p[1][k] + w[2] * p[2][k];
            least = fmin(least, pliant_squared_distance(q, x));
        }
        (void)pliant_face_tree_closest(tree, x, &found);
        check_near(found, least, 1e-14);
    }
    pliant_face_tree_destroy(tree);
    check_surface_destroy(&blob);
}

static void a_fit_sees_a_bump_and_a_turned_face(void **state)
{
    (void)state;
    check_surface sphere = check_sphere(3), other = check_sphere(3);
    pliant_face_tree *tree = NULL;
    pliant_surface *s = NULL;
    pliant_fit fit;
    pliant_error err = {""};
    check_ok(pliant_face_tree_create(sphere.mesh, &tree, &err), &err);
    check_ok(pliant_surface_create(sphere.mesh, &s, &err), &err);
    check_ok(pliant_fit_measure(s, tree, other.mesh, &fit, &err), &err);
    check_at_most(fmax(fit.there, fit.back), 1e-7);
    assert_int_equal(fit.flipped_count, 0);
    for (int k = 0; k < 3; k++) other.mesh->vertices[3 * 100 + k] *= 1.3;
    check_ok(pliant_fit_measure(s, tree, other.mesh, &fit, &err), &err);
    check_near(fit.back * pliant_surface_diagonal(sphere.mesh), 0.3, 1e-3);
    // A vertex pulled far along the surface turns faces over.
    for (int k = 0; k < 3; k++)
        other.mesh->vertices[3 * 100 + k] = sphere.mesh->vertices[3 * 100 + k] + (k == 0 ? 0.4 : 0);
    check_ok(pliant_fit_measure(s, tree, other.mesh, &fit, &err), &err);
    check_at_least(fit.flipped_count, 1);
    pliant_surface_destroy(s);
    pliant_face_tree_destroy(tree);
    check_surface_destroy(&other);
    check_surface_destroy(&sphere);
}

static void a_scan_with_thin_limbs_is_remeshed(void **state)
{
    (void)state;
    const char *path = check_model_path("armadillo.obj");
    if (!path) skip();
    pliant_mesh *mesh = check_load_obj(path);
    pliant_remesh_report r;
    pliant_multires *m = remesh(mesh, 600, 2, &r);
    check_remeshed(mesh, m, &r);
    pliant_multires_destroy(m);
    pliant_mesh_destroy(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shapes_of_all_kinds_are_remeshed),
        cmocka_unit_test(levels_are_found_again_in_any_order),
        cmocka_unit_test(distance_falls_with_the_square_of_size),
        cmocka_unit_test(the_same_mesh_gives_the_same_bytes),
        cmocka_unit_test(a_source_is_named_once),
        cmocka_unit_test(a_base_too_small_for_the_shape_is_refused),
        cmocka_unit_test(base_corners_are_carried_to_their_own_vertices),
        cmocka_unit_test(a_walk_goes_straight_on_across_edges),
        cmocka_unit_test(the_tree_finds_what_all_faces_say),
        cmocka_unit_test(a_fit_sees_a_bump_and_a_turned_face),
        cmocka_unit_test(a_scan_with_thin_limbs_is_remeshed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL) != 0;
}
