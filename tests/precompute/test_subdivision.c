// test_subdivision.c: Loop, butterfly and midpoint refinement of closed meshes.
#include "check.h"

#include "multires_hierarchy.h"
#include "mesh/multires.h"
#include "surfaces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const pliant_subdivision_scheme SCHEMES[3] = {
    PLIANT_SUBDIVIDE_LOOP, PLIANT_SUBDIVIDE_BUTTERFLY, PLIANT_SUBDIVIDE_MIDPOINT};

static pliant_multires *subdivide(const pliant_mesh *base, int32_t levels,
                                  pliant_subdivision_scheme scheme)
{
    pliant_multires *m = NULL;
    pliant_error err;
    check_ok(pliant_multires_subdivide(base, levels, scheme, &m, &err), &err);
    return m;
}

#define BASES 8

static pliant_mesh *base_mesh(int which)
{
    switch (which) {
    case 0:
        return check_tetrahedron();
    case 1:
        return check_octahedron();
    case 2:
        return check_icosahedron();
    case 3:
        return check_cube();
    case 4:
        return check_torus(4, 5);
    case 5:
        return check_block(1);
    case 6:
        return check_block(2);
    default:
        return check_beside(check_cube(), check_torus(3, 6));
    }
}

// A base of those with valences from 3 to 12.
static pliant_mesh *random_base(int which, check_random *random)
{
    pliant_mesh *mesh = base_mesh(which);
    check_flip_edges(mesh, 300, 3, 12, random);
    return mesh;
}

// ---- Topology ----

static void midpoint_steps_are_the_refinement_that_the_tests_make_themselves(void **state)
{
    (void)state;
    for (int which = 0; which < BASES; which++)
        for (int32_t levels = 0; levels <= 3; levels++) {
            check_surface s = check_refine(base_mesh(which), levels);
            pliant_mesh *base = base_mesh(which);
            pliant_multires *m = subdivide(base, levels, PLIANT_SUBDIVIDE_MIDPOINT);
            assert_int_equal(m->level_count, levels + 1);
            assert_memory_equal(m->vertex_count, s.vertex_count, sizeof m->vertex_count);
            assert_int_equal(m->mesh->vertex_count, s.mesh->vertex_count);
            assert_int_equal(m->mesh->face_count, s.mesh->face_count);
            assert_memory_equal(m->mesh->faces, s.mesh->faces,
                                (size_t)s.mesh->face_count * 3 * sizeof(int32_t));
            const size_t odd = (size_t)(s.mesh->vertex_count - base->vertex_count);
            if (odd) assert_memory_equal(m->parents, s.parents, odd * 2 * sizeof(int32_t));
            // Halves of coordinates below 6 in size: a rounding for each level.
            for (int32_t i = 0; i < 3 * s.mesh->vertex_count; i++)
                check_near(m->mesh->vertices[i], s.mesh->vertices[i], 3 * 6 * 1.2e-16);
            pliant_multires_destroy(m);
            pliant_mesh_destroy(base);
            check_surface_destroy(&s);
        }
}

static void all_schemes_and_valences_make_sound_hierarchies(void **state)
{
    (void)state;
    check_random random = check_random_seed(11);
    for (int which = 0; which < BASES; which++)
        for (int scheme = 0; scheme < 3; scheme++) {
            pliant_mesh *base = random_base(which, &random);
            pliant_multires *m = subdivide(base, 3, SCHEMES[scheme]);
            pliant_hierarchy *h = hierarchy_of(m);
            assert_memory_equal(h->faces[0], base->faces,
                                (size_t)base->face_count * 3 * sizeof(int32_t));
            for (int32_t v = 0; v < m->mesh->vertex_count; v++) {
                assert_int_equal(m->source_index[v], v < base->vertex_count ? v : -1);
                for (int c = 0; c < 3; c++) assert_true(isfinite(m->mesh->vertices[3 * v + c]));
            }
            assert_string_equal(m->note.text, "");
            pliant_hierarchy_destroy(h);
            pliant_multires_destroy(m);
            pliant_mesh_destroy(base);
        }
}

static void no_levels_give_the_base_back(void **state)
{
    (void)state;
    pliant_mesh *base = check_icosahedron();
    for (int scheme = 0; scheme < 3; scheme++) {
        pliant_multires *m = subdivide(base, 0, SCHEMES[scheme]);
        assert_int_equal(m->level_count, 1);
        assert_memory_equal(m->mesh->vertices, base->vertices, 36 * sizeof(double));
        assert_memory_equal(m->mesh->faces, base->faces, 60 * sizeof(int32_t));
        pliant_hierarchy_destroy(hierarchy_of(m));
        pliant_multires_destroy(m);
    }
    pliant_mesh_destroy(base);
}

// ---- Weights ----

// The odd vertex of `m` between two vertices, on any level; -1 if none.
static int32_t between(const pliant_multires *m, int32_t a, int32_t b)
{
    const int32_t low = a < b ? a : b, high = a < b ? b : a, base = m->vertex_count[0];
    for (int32_t v = base; v < m->mesh->vertex_count; v++)
        if (m->parents[2 * (v - base)] == low && m->parents[2 * (v - base) + 1] == high) return v;
    return -1;
}

// Compare with a file of the same base mesh that others subdivided: vertices pair up by their
// parents.
static void compare_steps(const char *base_path, const char *path, int32_t levels)
{
    pliant_mesh *base = check_load_obj(base_path), *file = check_load_obj(path);
    assert_non_null(base);
    assert_non_null(file);
    pliant_multires *m = subdivide(base, levels, PLIANT_SUBDIVIDE_LOOP), *reference = NULL;
    pliant_error err;
    check_ok(pliant_multires_detect(file, &reference, &err), &err);
    assert_int_equal(reference->level_count, levels + 1);
    assert_int_equal(m->mesh->vertex_count, reference->mesh->vertex_count);
    const int32_t n = m->mesh->vertex_count, n0 = m->vertex_count[0];
    int32_t *same = malloc((size_t)n * sizeof *same);
    assert_non_null(same);
    for (int32_t v = 0; v < n; v++) {
        const int32_t *p = m->parents + 2 * (v - n0);
        same[v] = v < n0 ? v : between(reference, same[p[0]], same[p[1]]);
        assert_true(same[v] >= 0);
        for (int c = 0; c < 3; c++) {
            // Nine significant digits are printed: half a unit of the ninth, and rounding.
            const double x = reference->mesh->vertices[3 * same[v] + c];
            const double unit = x == 0 ? 0 : pow(10, floor(log10(fabs(x))) - 8);
            check_near(m->mesh->vertices[3 * v + c], x, 0.5 * unit + 1e-14);
        }
    }
    free(same);
    pliant_multires_destroy(reference);
    pliant_multires_destroy(m);
    pliant_mesh_destroy(file);
    pliant_mesh_destroy(base);
}

static void loop_steps_match_the_reference_files_to_their_last_digit(void **state)
{
    (void)state;
    const char *base = check_model_path("semireg/spot_loop_base.obj");
    const char *one = check_model_path("semireg/spot_loop_L1_steps.obj");
    const char *two = check_model_path("semireg/spot_loop_L2_steps.obj");
    if (!base || !one || !two) skip();
    compare_steps(base, one, 1);
    compare_steps(base, two, 2);
}

static void every_scheme_commutes_with_affine_maps(void **state)
{
    (void)state;
    const double map[3][4] = {{1.1, 0.3, -0.2, 5}, {0.1, 0.7, 0.4, -3}, {-0.5, 0.2, 0.9, 2}};
    check_random random = check_random_seed(12);
    for (int which = 0; which < BASES; which++)
        for (int scheme = 0; scheme < 3; scheme++) {
            pliant_mesh *base = random_base(which, &random);
            pliant_multires *before = subdivide(base, 2, SCHEMES[scheme]);
            for (int32_t v = 0; v < base->vertex_count; v++) {
                double *x = base->vertices + 3 * v, y[3];
                for (int r = 0; r < 3; r++)
                    y[r] = map[r][0] * x[0] + map[r][1] * x[1] + map[r][2] * x[2] + map[r][3];
                memcpy(x, y, sizeof y);
            }
            pliant_multires *after = subdivide(base, 2, SCHEMES[scheme]);
            for (int32_t v = 0; v < before->mesh->vertex_count; v++) {
                const double *x = before->mesh->vertices + 3 * v,
                             *y = after->mesh->vertices + 3 * v;
                // Values up to about 20 through some tens of roundings.
                for (int r = 0; r < 3; r++)
                    check_near(y[r],
                               map[r][0] * x[0] + map[r][1] * x[1] + map[r][2] * x[2] + map[r][3],
                               1e-13);
            }
            pliant_multires_destroy(after);
            pliant_multires_destroy(before);
            pliant_mesh_destroy(base);
        }
}

static void butterfly_and_midpoint_keep_the_positions_of_coarser_vertices(void **state)
{
    (void)state;
    check_random random = check_random_seed(13);
    for (int which = 0; which < BASES; which++)
        for (int scheme = 1; scheme < 3; scheme++) {
            pliant_mesh *base = random_base(which, &random);
            pliant_multires *coarse = subdivide(base, 2, SCHEMES[scheme]);
            pliant_multires *fine = subdivide(base, 3, SCHEMES[scheme]);
            assert_memory_equal(coarse->mesh->vertices, fine->mesh->vertices,
                                (size_t)coarse->mesh->vertex_count * 3 * sizeof(double));
            assert_memory_equal(base->vertices, fine->mesh->vertices,
                                (size_t)base->vertex_count * 3 * sizeof(double));
            pliant_multires_destroy(fine);
            pliant_multires_destroy(coarse);
            pliant_mesh_destroy(base);
        }
}

static double polynomial(double i, double j, int degree)
{
    double p = 0.3 + 0.5 * i - 0.7 * j;
    if (degree >= 2) p += 0.11 * i * i - 0.05 * i * j + 0.07 * j * j;
    if (degree >= 3)
        p += 0.013 * i * i * i - 0.02 * i * i * j + 0.017 * i * j * j - 0.011 * j * j * j;
    return p;
}

static void regular_patches_reproduce_the_polynomials_that_theory_says(void **state)
{
    (void)state;
    // The torus cut open is the regular lattice: its vertex (i, j) gets the position (i, j, p(i,
    // j)). The 8-point butterfly reproduces cubic p (Dyn, Levin and Gregory 1990), odd Loop
    // vertices and midpoints linear p only. Stencils of edges inside [2, 9]^2 do not reach the cut.
    const int degree[3] = {1, 3, 1};
    for (int scheme = 0; scheme < 3; scheme++)
        for (int higher = 0; higher < 2; higher++) {
            pliant_mesh *base = check_torus(12, 12);
            for (int32_t v = 0; v < 144; v++) {
                const double i = v / 12, j = v % 12;
                memcpy(base->vertices + 3 * v,
                       (double[3]){i, j, polynomial(i, j, degree[scheme] + higher)},
                       3 * sizeof(double));
            }
            if (degree[scheme] + higher == 4)
                for (int32_t v = 0; v < 144; v++)
                    base->vertices[3 * v + 2] += 1e-3 * pow(v / 12, 4);
            pliant_multires *m = subdivide(base, 1, SCHEMES[scheme]);
            double worst = 0;
            int found = 0;
            for (int32_t k = 0; k < m->mesh->vertex_count - 144; k++) {
                const int32_t a = m->parents[2 * k], b = m->parents[2 * k + 1];
                const double i = (a / 12 + b / 12) / 2.0, j = (a % 12 + b % 12) / 2.0;
                if (fmin(a / 12, b / 12) < 2 || fmin(a % 12, b % 12) < 2 ||
                    fmax(a / 12, b / 12) > 9 || fmax(a % 12, b % 12) > 9)
                    continue;
                const double *x = m->mesh->vertices + 3 * (144 + k);
                check_near(x[0], i, 1e-13);
                check_near(x[1], j, 1e-13);
                double z = polynomial(i, j, degree[scheme] + higher);
                if (degree[scheme] + higher == 4) z += 1e-3 * pow(i, 4);
                worst = fmax(worst, fabs(x[2] - z));
                found++;
            }
            assert_int_equal(found, 7 * 8 * 2 + 7 * 7);
            if (higher) check_at_least(worst, 1e-4);  // the next degree is not reproduced
            else check_at_most(worst, 1e-12);
            pliant_multires_destroy(m);
            pliant_mesh_destroy(base);
        }
}

// The neighbours of `a` counterclockwise from `b`, by searching the faces; their number.
static int32_t ring_from(const pliant_mesh *mesh, int32_t a, int32_t b, int32_t ring[64])
{
    int32_t count = 0, next = b;
    do {
        ring[count++] = next;
        for (int32_t f = 0; f < mesh->face_count; f++)
            for (int k = 0; k < 3; k++) {
                const int32_t *v = mesh->faces + 3 * f;
                if (v[k] == a && v[(k + 1) % 3] == ring[count - 1]) next = v[(k + 2) % 3];
            }
    } while (next != b);
    return count;
}

// Zorin et al.'s rule for an extraordinary end `a` of the edge to `b`, term by term.
static void add_extraordinary(const pliant_mesh *mesh, const int32_t *ring, int32_t k, int32_t a,
                              double share, double x[3])
{
    double rest = 1;
    for (int32_t j = 0; j < k; j++) {
        const double t = 6.283185307179586 * j / k;
        double weight = (0.25 + cos(t) + 0.5 * cos(2 * t)) / k;
        if (k == 3) weight = j == 0 ? 5.0 / 12 : -1.0 / 12;
        if (k == 4) weight = j == 0 ? 3.0 / 8 : (j == 2 ? -1.0 / 8 : 0);
        rest -= weight;
        for (int c = 0; c < 3; c++) x[c] += share * weight * mesh->vertices[3 * ring[j] + c];
    }
    for (int c = 0; c < 3; c++) x[c] += share * rest * mesh->vertices[3 * a + c];
}

static void butterfly_weighs_every_kind_of_edge_as_the_paper_does(void **state)
{
    (void)state;
    check_random random = check_random_seed(14);
    int kinds[3] = {0}, valences[13] = {0};
    for (int which = 0; which < 2 * BASES; which++) {
        pliant_mesh *base = which < BASES ? random_base(which, &random) : base_mesh(which - BASES);
        pliant_multires *m = subdivide(base, 1, PLIANT_SUBDIVIDE_BUTTERFLY);
        const int32_t n0 = base->vertex_count;
        for (int32_t v = n0; v < m->mesh->vertex_count; v++) {
            const int32_t a = m->parents[2 * (v - n0)], b = m->parents[2 * (v - n0) + 1];
            int32_t ra[64], rb[64];
            const int32_t ka = ring_from(base, a, b, ra), kb = ring_from(base, b, a, rb);
            const int kind = (ka != 6) + (kb != 6);
            kinds[kind]++;
            valences[ka]++;
            double x[3] = {0};
            if (ka != 6) add_extraordinary(base, ra, ka, a, 1.0 / kind, x);
            if (kb != 6) add_extraordinary(base, rb, kb, b, 1.0 / kind, x);
            if (kind == 0)
                for (int c = 0; c < 3; c++) {
                    const double *y = base->vertices;
                    // Around a from b: opposite corners at 1 and 5, wings at 2 and 4.
                    x[c] = (y[3 * a + c] + y[3 * b + c]) / 2 +
                           (y[3 * ra[1] + c] + y[3 * ra[5] + c]) / 8 -
                           (y[3 * ra[2] + c] + y[3 * ra[4] + c] + y[3 * rb[2] + c] +
                            y[3 * rb[4] + c]) /
                               16;
                }
            for (int c = 0; c < 3; c++) check_near(m->mesh->vertices[3 * v + c], x[c], 1e-13);
        }
        pliant_multires_destroy(m);
        pliant_mesh_destroy(base);
    }
    for (int kind = 0; kind < 3; kind++) check_at_least(kinds[kind], 20);
    for (int k = 3; k <= 9; k++) check_at_least(valences[k], 1);
}

static void valences_of_thousands_take_no_longer_than_their_edges(void **state)
{
    (void)state;
    // A double pyramid over a ring of 20000: rings walked once for each of their edges would take
    // 20000^2 steps on each level, and the test minutes.
    enum { AROUND = 20000 };
    pliant_mesh *base = NULL;
    pliant_error err;
    check_ok(pliant_mesh_create(AROUND + 2, 2 * AROUND, &base, &err), &err);
    base->vertices[3 * AROUND + 2] = 1;
    base->vertices[3 * AROUND + 5] = -1;
    for (int32_t i = 0; i < AROUND; i++) {
        base->vertices[3 * i] = cos(6.283185307179586 * i / AROUND);
        base->vertices[3 * i + 1] = sin(6.283185307179586 * i / AROUND);
        const int32_t next = (i + 1) % AROUND;
        memcpy(base->faces + 6 * i, (int32_t[6]){i, next, AROUND, next, i, AROUND + 1},
               6 * sizeof(int32_t));
    }
    for (int scheme = 0; scheme < 3; scheme++) {
        pliant_multires *m = subdivide(base, 2, SCHEMES[scheme]);
        for (int32_t v = 0; v < m->mesh->vertex_count; v++)
            for (int c = 0; c < 3; c++) check_at_most(fabs(m->mesh->vertices[3 * v + c]), 1.3);
        pliant_multires_destroy(m);
    }
    pliant_mesh_destroy(base);
}

static void components_do_not_touch_each_other(void **state)
{
    (void)state;
    for (int scheme = 0; scheme < 3; scheme++) {
        pliant_mesh *both = check_beside(check_cube(), check_octahedron());
        pliant_mesh *alone = check_cube();
        pliant_multires *two = subdivide(both, 1, SCHEMES[scheme]);
        pliant_multires *one = subdivide(alone, 1, SCHEMES[scheme]);
        // Base vertices first (8, and 6 of the other), then the cube's 18 edges.
        assert_memory_equal(two->mesh->vertices, one->mesh->vertices, 8 * 3 * sizeof(double));
        assert_memory_equal(two->mesh->vertices + 14 * 3, one->mesh->vertices + 8 * 3,
                            18 * 3 * sizeof(double));
        pliant_multires_destroy(one);
        pliant_multires_destroy(two);
        pliant_mesh_destroy(alone);
        pliant_mesh_destroy(both);
    }
}

// ---- Refusals ----

static void refuse(const pliant_mesh *base, int32_t levels, int scheme, pliant_status status,
                   const char *text)
{
    pliant_multires *m = NULL;
    pliant_error err = {{0}};
    const pliant_status found =
        pliant_multires_subdivide(base, levels, (pliant_subdivision_scheme)scheme, &m, &err);
    if (found != status || m || !strstr(err.text, text)) {
        pliant_multires_destroy(m);
        fail_msg("%s: \"%s\", expected %s and \"%s\"", pliant_status_name(found), err.text,
                 pliant_status_name(status), text);
    }
}

static void levels_that_int32_cannot_number_are_refused_with_figures(void **state)
{
    (void)state;
    pliant_mesh *base = check_icosahedron();
    refuse(base, 14, 0, PLIANT_ERR_ARGUMENT,
           "14 levels above 20 base faces: level 14 has 5368709120 faces and 2684354562 vertices, "
           "expected at most 2147483647");
    refuse(base, 15, 1, PLIANT_ERR_ARGUMENT, "level 14 has 5368709120 faces");
    refuse(base, 16, 1, PLIANT_ERR_ARGUMENT, "levels to subdivide: expected 0..15, found 16");
    refuse(base, -1, 1, PLIANT_ERR_ARGUMENT, "levels to subdivide: expected 0..15, found -1");
    refuse(base, 1, 3, PLIANT_ERR_ARGUMENT, "subdivision scheme: expected 0..2, found 3");
    pliant_mesh_destroy(base);
}

static void bases_that_bound_no_solid_are_refused(void **state)
{
    (void)state;
    pliant_mesh *base = check_icosahedron();
    base->face_count--;
    refuse(base, 1, 0, PLIANT_ERR_FORMAT, "base mesh: edge from vertex");
    base->face_count = 0;
    refuse(base, 1, 0, PLIANT_ERR_FORMAT, "base mesh: closed mesh: expected");
    base->face_count = 20;
    base->faces[7] = 12;
    refuse(base, 1, 0, PLIANT_ERR_FORMAT, "base mesh: face 2: expected vertices 0..11, found 12");
    pliant_mesh_destroy(base);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(midpoint_steps_are_the_refinement_that_the_tests_make_themselves),
        cmocka_unit_test(all_schemes_and_valences_make_sound_hierarchies),
        cmocka_unit_test(no_levels_give_the_base_back),
        cmocka_unit_test(loop_steps_match_the_reference_files_to_their_last_digit),
        cmocka_unit_test(every_scheme_commutes_with_affine_maps),
        cmocka_unit_test(butterfly_and_midpoint_keep_the_positions_of_coarser_vertices),
        cmocka_unit_test(regular_patches_reproduce_the_polynomials_that_theory_says),
        cmocka_unit_test(butterfly_weighs_every_kind_of_edge_as_the_paper_does),
        cmocka_unit_test(valences_of_thousands_take_no_longer_than_their_edges),
        cmocka_unit_test(components_do_not_touch_each_other),
        cmocka_unit_test(levels_that_int32_cannot_number_are_refused_with_figures),
        cmocka_unit_test(bases_that_bound_no_solid_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
