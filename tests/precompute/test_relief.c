// test_relief.c: the finest levels of a mesh taken off as geometric detail, and put back.
#include "check.h"

#include "mesh/relief.h"
#include "surfaces.h"

#include "pliant/loop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double distance(const double *a, const double *b)
{
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

static pliant_multires *subdivide(const pliant_mesh *base, int32_t levels,
                                  pliant_subdivision_scheme scheme)
{
    pliant_multires *m = NULL;
    pliant_error err = {""};
    check_ok(pliant_multires_subdivide(base, levels, scheme, &m, &err), &err);
    return m;
}

// Roughen the finest vertices, so that their places carry more than the subdivision scheme.
static void roughen(pliant_multires *m, double size, check_random *random)
{
    for (int32_t i = 0; i < 3 * m->mesh->vertex_count; i++)
        m->mesh->vertices[i] += size * (check_random_next(random) - 0.5);
}

// The detailed shape at rest, from nothing but the control mesh and the relief, as
// formats/README.md says: its order is that in which subdivision numbers vertices. To be freed.
static double *restore(const pliant_multires *control, const pliant_relief *relief)
{
    const int32_t steps = relief->step_count, n = relief->vertex_count[steps];
    int32_t *faces[PLIANT_LEVEL_LIMIT + 1];
    for (int32_t d = 0; d <= steps; d++) {
        pliant_multires *m = subdivide(control->mesh, d, PLIANT_SUBDIVIDE_MIDPOINT);
        assert_int_equal(m->mesh->vertex_count, relief->vertex_count[d]);
        faces[d] = malloc(3 * (size_t)m->mesh->face_count * sizeof(int32_t));
        assert_non_null(faces[d]);
        memcpy(faces[d], m->mesh->faces, 3 * (size_t)m->mesh->face_count * sizeof(int32_t));
        pliant_multires_destroy(m);
    }
    pliant_loop_limit *limit = NULL;
    pliant_error err = {""};
    check_ok(pliant_loop_limit_create(steps, control->mesh->vertex_count, control->mesh->face_count,
                                      (const int32_t *const *)faces, &limit, &err),
             &err);
    double *x = malloc(3 * (size_t)n * sizeof *x);
    assert_non_null(x);
    for (int32_t v = 0; v < n; v++) {
        double p[9], frame[9];
        pliant_loop_limit_evaluate(limit, v, control->mesh->vertices, p);
        (void)pliant_loop_frame(p + 3, p + 6, frame);
        for (int c = 0; c < 3; c++) {
            x[3 * v + c] = p[c];
            for (int a = 0; a < 3; a++)
                x[3 * v + c] += frame[3 * a + c] * (double)relief->offset[3 * v + a];
        }
    }
    pliant_loop_limit_destroy(limit);
    for (int32_t d = 0; d <= steps; d++) free(faces[d]);
    return x;
}

static pliant_mesh *base_mesh(int which, check_random *random)
{
    pliant_mesh *mesh = which == 0   ? check_tetrahedron()
                        : which == 1 ? check_octahedron()
                        : which == 2 ? check_icosahedron()
                        : which == 3 ? check_torus(4, 5)
                                     : check_beside(check_cube(), check_block(1));
    if (which == 4) check_flip_edges(mesh, 100, 3, 9, random);
    return mesh;
}

// Offsets are floats of at most the shape's size, the frames orthonormal: 2^-24 of it each, in
// three components.
#define ROUNDING (3 * 0x1p-24)

static void the_detailed_shape_comes_back_after_subdivision(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    for (int which = 0; which < 5; which++)
        for (int scheme = 0; scheme < 3; scheme++)
            for (int32_t steps = 1; steps <= 3; steps++) {
                pliant_mesh *base = base_mesh(which, &random);
                pliant_multires *m = subdivide(base, 3, (pliant_subdivision_scheme)scheme);
                roughen(m, 0.02, &random);
                const size_t bytes = 3 * (size_t)m->mesh->vertex_count * sizeof(double);
                double *shape = malloc(bytes);
                assert_non_null(shape);
                memcpy(shape, m->mesh->vertices, bytes);
                pliant_relief *relief = NULL;
                pliant_error err = {""};
                check_ok(pliant_relief_split(&m, steps, &relief, &err), &err);
                assert_int_equal(m->level_count, 4 - steps);
                assert_int_equal(m->mesh->vertex_count, relief->vertex_count[0]);
                double *x = restore(m, relief);
                for (int32_t v = 0; v < relief->vertex_count[steps]; v++)
                    check_at_most(distance(x + 3 * v, shape + 3 * v), ROUNDING * 2);
                free(x);
                free(shape);
                pliant_relief_destroy(relief);
                pliant_multires_destroy(m);
                pliant_mesh_destroy(base);
            }
}

// What was shuffled gets its own order of vertices on the detail's levels.
static void the_detailed_shape_comes_back_after_detection(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    for (int which = 2; which < 5; which++) {
        pliant_mesh *base = base_mesh(which, &random);
        pliant_multires *made = subdivide(base, 3, PLIANT_SUBDIVIDE_LOOP), *m = NULL;
        roughen(made, 0.02, &random);
        pliant_mesh *shuffled = made->mesh;
        made->mesh = NULL;
        check_shuffle(shuffled, &random, NULL);
        pliant_error err = {""};
        check_ok(pliant_multires_detect(shuffled, &m, &err), &err);
        const int32_t level_count = m->level_count;
        assert_true(level_count >= 4);
        pliant_relief *relief = NULL;
        check_ok(pliant_relief_split(&m, 2, &relief, &err), &err);
        assert_int_equal(m->level_count, level_count - 2);
        double *x = restore(m, relief);
        int32_t *seen = calloc((size_t)shuffled->vertex_count, sizeof *seen);
        assert_non_null(seen);
        for (int32_t v = 0; v < relief->vertex_count[2]; v++) {
            const int32_t source = relief->source_index[v];
            assert_in_range(source, 0, shuffled->vertex_count - 1);
            assert_int_equal(seen[source]++, 0);
            check_at_most(distance(x + 3 * v, shuffled->vertices + 3 * source), ROUNDING * 2);
            if (v >= m->mesh->vertex_count) continue;
            assert_int_equal(m->source_index[v], source);
            check_at_most(distance(m->mesh->vertices + 3 * v, shuffled->vertices + 3 * source), 0);
        }
        free(seen);
        free(x);
        pliant_relief_destroy(relief);
        pliant_multires_destroy(m);
        pliant_mesh_destroy(shuffled);
        pliant_multires_destroy(made);
        pliant_mesh_destroy(base);
    }
}

static void the_control_mesh_is_the_levels_that_are_left(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    pliant_mesh *base = base_mesh(4, &random);
    pliant_multires *whole = subdivide(base, 3, PLIANT_SUBDIVIDE_BUTTERFLY);
    pliant_multires *m = subdivide(base, 3, PLIANT_SUBDIVIDE_BUTTERFLY);
    pliant_multires *coarse = subdivide(base, 2, PLIANT_SUBDIVIDE_BUTTERFLY);
    pliant_relief *relief = NULL;
    pliant_error err = {""};
    check_ok(pliant_relief_split(&m, 1, &relief, &err), &err);
    const size_t n = (size_t)coarse->mesh->vertex_count, base_count = (size_t)base->vertex_count;
    assert_int_equal(m->level_count, 3);
    assert_int_equal(m->mesh->vertex_count, n);
    assert_int_equal(m->mesh->face_count, coarse->mesh->face_count);
    assert_memory_equal(m->vertex_count, coarse->vertex_count, 3 * sizeof(int32_t));
    assert_memory_equal(m->mesh->faces, coarse->mesh->faces,
                        3 * (size_t)m->mesh->face_count * sizeof(int32_t));
    assert_memory_equal(m->parents, coarse->parents, 2 * (n - base_count) * sizeof(int32_t));
    assert_memory_equal(m->source_index, coarse->source_index, n * sizeof(int32_t));
    assert_memory_equal(m->mesh->vertices, whole->mesh->vertices, 3 * n * sizeof(double));
    pliant_relief_destroy(relief);
    pliant_multires_destroy(coarse);
    pliant_multires_destroy(m);
    pliant_multires_destroy(whole);
    pliant_mesh_destroy(base);
}

// A sphere over an icosahedron: offsets point along the normal but for the drift of its vertices
// within the surface; moving vertices sideways shows in the tangential part alone.
static void sizes_tell_normal_and_tangential_offsets_apart(void **state)
{
    (void)state;
    pliant_mesh *base = check_icosahedron();
    pliant_multires *m = subdivide(base, 3, PLIANT_SUBDIVIDE_LOOP);
    for (int32_t v = 0; v < m->mesh->vertex_count; v++) {
        double *x = m->mesh->vertices + 3 * v;
        const double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
        for (int c = 0; c < 3; c++) x[c] /= length;
    }
    pliant_relief *relief = NULL;
    pliant_error err = {""};
    check_ok(pliant_relief_split(&m, 2, &relief, &err), &err);
    // Loop's limit of the 42 vertices on the unit sphere has radii of about 0.92.
    check_near(relief->size.rms, 0.08, 0.02);
    check_at_most(relief->size.tangential_rms, 0.1 * relief->size.rms);
    check_at_least(relief->size.largest, relief->size.rms);
    check_at_least(relief->size.tangential_largest, relief->size.tangential_rms);
    check_at_least(relief->size.least_sine, 0.8);
    for (int32_t v = 0; v < relief->vertex_count[2]; v++)
        check_at_least((double)relief->offset[3 * v + 2], 0.05);
    pliant_relief_destroy(relief);
    pliant_multires_destroy(m);
    pliant_mesh_destroy(base);
}

static void refusals_name_what_is_wrong_and_leave_the_mesh(void **state)
{
    (void)state;
    pliant_mesh *base = check_octahedron();
    pliant_multires *m = subdivide(base, 2, PLIANT_SUBDIVIDE_LOOP);
    pliant_multires *before = m;
    pliant_relief *relief = NULL;
    pliant_error err = {""};
    for (int32_t steps = 0; steps <= 3; steps += 3) {
        assert_int_equal(pliant_relief_split(&m, steps, &relief, &err), PLIANT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "expected 1 to 2, the levels above the base, found"));
    }
    // Flattened to a line there is no normal.
    for (int32_t v = 0; v < m->mesh->vertex_count; v++)
        m->mesh->vertices[3 * v + 1] = m->mesh->vertices[3 * v + 2] = m->mesh->vertices[3 * v];
    assert_int_equal(pliant_relief_split(&m, 1, &relief, &err), PLIANT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "has no normal at"));
    assert_ptr_equal(m, before);
    assert_null(relief);
    assert_int_equal(m->level_count, 3);
    pliant_multires_destroy(m);
    pliant_mesh_destroy(base);
}

static void the_bunny_on_five_levels_comes_back_over_every_control_level(void **state)
{
    (void)state;
    const char *path = check_model_path("semireg/bunny_L5.obj");
    if (!path) skip();
    pliant_mesh *mesh = check_load_obj(path);
    assert_non_null(mesh);
    for (int32_t steps = 1; steps <= 5; steps++) {
        pliant_multires *m = NULL;
        pliant_relief *relief = NULL;
        pliant_error err = {""};
        check_ok(pliant_multires_detect(mesh, &m, &err), &err);
        check_ok(pliant_relief_split(&m, steps, &relief, &err), &err);
        double *x = restore(m, relief), worst = 0;
        for (int32_t v = 0; v < mesh->vertex_count; v++)
            worst = fmax(worst, distance(x + 3 * v, mesh->vertices + 3 * relief->source_index[v]));
        printf("%d steps: offsets %.4f rms, %.3f largest; tangential %.4f, %.3f; sine %.2f; "
               "back to %.1e\n",
               steps, relief->size.rms, relief->size.largest, relief->size.tangential_rms,
               relief->size.tangential_largest, relief->size.least_sine, worst);
        check_at_most(worst, ROUNDING);
        free(x);
        pliant_relief_destroy(relief);
        pliant_multires_destroy(m);
    }
    pliant_mesh_destroy(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_detailed_shape_comes_back_after_subdivision),
        cmocka_unit_test(the_detailed_shape_comes_back_after_detection),
        cmocka_unit_test(the_control_mesh_is_the_levels_that_are_left),
        cmocka_unit_test(sizes_tell_normal_and_tangential_offsets_apart),
        cmocka_unit_test(refusals_name_what_is_wrong_and_leave_the_mesh),
        cmocka_unit_test(the_bunny_on_five_levels_comes_back_over_every_control_level),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
