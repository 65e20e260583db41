// test_loop.c: the limit surface of Loop subdivision as sparse rows, against slow subdivision.
#include "check.h"

#include "loop_reference.h"
#include "surfaces.h"

#include "pliant/loop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BASES = 7 };

// Valences 3, 4, 5, 4 to 6, 6, any from 3 to 9 on a sphere, the same on a torus.
static pliant_mesh *base_mesh(int which, check_random *random)
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
    default:
        break;
    }
    check_surface sphere = check_sphere(1);
    pliant_mesh *mesh = which == 5 ? sphere.mesh : check_torus(4, 6);
    if (which == 5) sphere.mesh = NULL;
    check_flip_edges(mesh, 300, 3, 9, random);
    check_surface_destroy(&sphere);
    return mesh;
}

// A base mesh with its levels.
typedef struct levels {
    check_surface surface;
    pliant_hierarchy *hierarchy;
} levels;

static levels make_levels(pliant_mesh *base, int32_t count)
{
    levels l = {.surface = check_refine(base, count)};
    l.hierarchy = check_hierarchy(&l.surface);
    return l;
}

static void destroy_levels(levels *l)
{
    pliant_hierarchy_destroy(l->hierarchy);
    check_surface_destroy(&l->surface);
}

static pliant_loop_limit *limit_of(const levels *l, int32_t from, int32_t to)
{
    const pliant_hierarchy *h = l->hierarchy;
    pliant_loop_limit *limit = NULL;
    pliant_error err = {""};
    check_ok(pliant_loop_limit_create(to - from, h->vertex_count[from], h->face_count[from],
                                      h->faces + from, &limit, &err),
             &err);
    assert_int_equal(limit->vertex_count, h->vertex_count[to]);
    return limit;
}

static double *random_positions(int32_t count, check_random *random)
{
    double *x = malloc(3 * (size_t)count * sizeof *x);
    assert_non_null(x);
    for (size_t i = 0; i < 3 * (size_t)count; i++) x[i] = 2 * check_random_next(random) - 1;
    return x;
}

static double distance(const double *a, const double *b)
{
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

// ---- Weights ----

static void weights_are_those_of_the_thesis(void **state)
{
    (void)state;
    // beta: 3/16 at valence 3, 1/16 at 6 (where 1 - n beta = 5/8). chi: 1/5 and 1/12.
    check_near(pliant_loop_beta(3), 3.0 / 16, 1e-15);
    check_near(pliant_loop_beta(6), 1.0 / 16, 1e-15);
    check_near(pliant_loop_chi(3), 1.0 / 5, 1e-15);
    check_near(pliant_loop_chi(6), 1.0 / 12, 1e-15);
}

static void positions_sum_to_one_and_tangents_to_zero(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    for (int which = 0; which < BASES; which++) {
        levels l = make_levels(base_mesh(which, &random), 3);
        pliant_loop_limit *limit = limit_of(&l, 0, 3);
        for (int32_t v = 0; v < limit->vertex_count; v++) {
            double sum[3] = {0};
            for (size_t i = limit->offset[v]; i < limit->offset[v + 1]; i++) {
                const pliant_loop_entry *e = &limit->entries[i];
                assert_in_range(e->vertex, 0, l.hierarchy->vertex_count[0] - 1);
                check_at_least(e->position, 0);  // a limit point is in the hull of its controls
                sum[0] += e->position, sum[1] += e->along, sum[2] += e->across;
            }
            check_near(sum[0], 1, 1e-14);
            check_near(sum[1], 0, 1e-14);
            check_near(sum[2], 0, 1e-14);
        }
        pliant_loop_limit_destroy(limit);
        destroy_levels(&l);
    }
}

// ---- Against subdivision ----

// The limit surface is one: rows over the control mesh say the same as rows over what slow steps
// made of it.
static void the_limit_is_the_same_after_any_number_of_steps(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    for (int which = 0; which < BASES; which++) {
        levels l = make_levels(base_mesh(which, &random), 3);
        double *x = random_positions(l.hierarchy->vertex_count[0], &random);
        pliant_loop_limit *direct = limit_of(&l, 0, 3);
        for (int32_t made = 1; made <= 3; made++) {
            double *y = slow_loop(l.hierarchy, 0, made, x);
            pliant_loop_limit *rest = limit_of(&l, made, 3);
            for (int32_t v = 0; v < direct->vertex_count; v++) {
                double a[9], b[9];
                pliant_loop_limit_evaluate(direct, v, x, a);
                pliant_loop_limit_evaluate(rest, v, y, b);
                for (int k = 0; k < 9; k++) check_near(a[k], b[k], 1e-13);
            }
            pliant_loop_limit_destroy(rest);
            free(y);
        }
        pliant_loop_limit_destroy(direct);
        free(x);
        destroy_levels(&l);
    }
}

// A vertex's tangents on finer and finer meshes shrink, but span one plane.
static void tangents_of_a_vertex_span_one_plane_on_all_levels(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    for (int which = 0; which < BASES; which++) {
        levels l = make_levels(base_mesh(which, &random), 3);
        const double *x = l.surface.mesh->vertices;
        pliant_loop_limit *coarse = limit_of(&l, 0, 0), *fine = limit_of(&l, 0, 3);
        for (int32_t v = 0; v < coarse->vertex_count; v++) {
            double a[9], b[9], f[9], g[9];
            pliant_loop_limit_evaluate(coarse, v, x, a);
            pliant_loop_limit_evaluate(fine, v, x, b);
            check_near(distance(a, b), 0, 1e-14);
            const double sine = pliant_loop_frame(a + 3, a + 6, f);
            check_at_least(sine, 0.1);
            (void)pliant_loop_frame(b + 3, b + 6, g);
            check_near(distance(f + 6, g + 6), 0, 1e-12 / sine);
        }
        pliant_loop_limit_destroy(fine);
        pliant_loop_limit_destroy(coarse);
        destroy_levels(&l);
    }
}

// Steps move a vertex towards its limit by a factor of max(1/4, what is around it) a step; the
// subdominant eigenvalue is below 0.64 for valences up to 9, its square is what positions see.
static void slow_steps_converge_to_the_limit_and_its_normals(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    enum { DEEP = 6 };
    for (int which = 0; which < 4; which++) {
        levels l = make_levels(base_mesh(which, &random), DEEP);
        const pliant_hierarchy *h = l.hierarchy;
        const double *x = l.surface.mesh->vertices;
        pliant_loop_limit *limit = limit_of(&l, 0, 0);
        double last = 0;
        for (int32_t level = DEEP - 1; level <= DEEP; level++) {
            double *y = slow_loop(h, 0, level, x), worst = 0, worst_normal = 0;
            for (int32_t v = 0; v < h->vertex_count[0]; v++) {
                double point[9], frame[9], n[3] = {0};
                pliant_loop_limit_evaluate(limit, v, x, point);
                worst = fmax(worst, distance(point, y + 3 * v));
                (void)pliant_loop_frame(point + 3, point + 6, frame);
                for (int32_t f = 0; f < h->face_count[level]; f++) {
                    const int32_t *c = h->faces[level] + 3 * (size_t)f;
                    if (c[0] != v && c[1] != v && c[2] != v) continue;
                    double p[3], q[3];
                    for (int d = 0; d < 3; d++) {
                        p[d] = y[3 * c[1] + d] - y[3 * c[0] + d];
                        q[d] = y[3 * c[2] + d] - y[3 * c[0] + d];
                    }
                    for (int d = 0; d < 3; d++)
                        n[d] += p[(d + 1) % 3] * q[(d + 2) % 3] - p[(d + 2) % 3] * q[(d + 1) % 3];
                }
                const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
                for (int d = 0; d < 3; d++) n[d] /= length;
                worst_normal = fmax(worst_normal, distance(n, frame + 6));
            }
            free(y);
            if (level == DEEP) {
                check_at_most(worst, 0.45 * last);
                check_at_most(worst, 2e-3);
                check_at_most(worst_normal, 1e-2);
            }
            last = worst;
        }
        pliant_loop_limit_destroy(limit);
        destroy_levels(&l);
    }
}

// C1: normals of neighbours come together like the distances between them, by halves.
static void normals_turn_half_as_far_with_every_step(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    for (int which = 0; which < 5; which++) {
        levels l = make_levels(base_mesh(which, &random), 4);
        double turned[5];
        for (int32_t to = 2; to <= 4; to++) {
            pliant_loop_limit *limit = limit_of(&l, 0, to);
            double(*normal)[9] = malloc((size_t)limit->vertex_count * sizeof *normal);
            assert_non_null(normal);
            for (int32_t v = 0; v < limit->vertex_count; v++) {
                double point[9];
                pliant_loop_limit_evaluate(limit, v, l.surface.mesh->vertices, point);
                check_at_least(pliant_loop_frame(point + 3, point + 6, normal[v]), 0.1);
            }
            turned[to] = 0;
            for (int32_t h = 0; h < 3 * l.hierarchy->face_count[to]; h++) {
                const int32_t *faces = l.hierarchy->faces[to];
                const int32_t next = h % 3 == 2 ? h - 2 : h + 1;
                turned[to] =
                    fmax(turned[to], distance(normal[faces[h]] + 6, normal[faces[next]] + 6));
            }
            free(normal);
            pliant_loop_limit_destroy(limit);
            // Around vertices of other valences than 6 curvature is not continuous: normals there
            // turn by the subdominant eigenvalue times curvature's growth, a little above a half.
            if (to > 2) check_near(turned[to] / turned[to - 1], 0.5, 0.16);
        }
        destroy_levels(&l);
    }
}

static void rows_stay_short(void **state)
{
    (void)state;
    check_random random = check_random_seed(6);
    levels l = make_levels(base_mesh(4, &random), 4);
    pliant_loop_limit *limit = limit_of(&l, 1, 4);
    for (int32_t v = 0; v < limit->vertex_count; v++)
        check_at_most((double)(limit->offset[v + 1] - limit->offset[v]), 12);
    pliant_loop_limit_destroy(limit);
    destroy_levels(&l);
}

// ---- Numbers of the rows' vertices, refusals ----

static void what_was_renumbered_has_the_same_surface(void **state)
{
    (void)state;
    check_random random = check_random_seed(7);
    levels l = make_levels(base_mesh(5, &random), 2);
    const pliant_hierarchy *h = l.hierarchy;
    // Reverse the numbers of each level's own vertices.
    const int32_t n = h->vertex_count[2];
    int32_t *to = malloc((size_t)n * sizeof *to);
    assert_non_null(to);
    for (int32_t v = 0; v < n; v++) {
        const int32_t level = pliant_hierarchy_level_of(h, v);
        const int32_t first = level > 0 ? h->vertex_count[level - 1] : 0;
        to[v] = first + h->vertex_count[level] - 1 - v;
    }
    int32_t *faces[3];
    for (int32_t level = 0; level < 3; level++) {
        const size_t corners = 3 * (size_t)h->face_count[level];
        faces[level] = malloc(corners * sizeof **faces);
        assert_non_null(faces[level]);
        for (size_t i = 0; i < corners; i++) faces[level][i] = to[h->faces[level][i]];
    }
    double *x = random_positions(h->vertex_count[0], &random);
    double *y = malloc(3 * (size_t)h->vertex_count[0] * sizeof *y);
    assert_non_null(y);
    for (int32_t v = 0; v < h->vertex_count[0]; v++) memcpy(y + 3 * to[v], x + 3 * v, 24);
    pliant_loop_limit *a = limit_of(&l, 0, 2), *b = NULL;
    pliant_error err = {""};
    check_ok(pliant_loop_limit_create(2, h->vertex_count[0], h->face_count[0],
                                      (const int32_t *const *)faces, &b, &err),
             &err);
    for (int32_t v = 0; v < n; v++) {
        double p[9], q[9];
        pliant_loop_limit_evaluate(a, v, x, p);
        pliant_loop_limit_evaluate(b, to[v], y, q);
        for (int k = 0; k < 9; k++) check_near(p[k], q[k], 1e-14);
    }
    pliant_loop_limit_destroy(b);
    pliant_loop_limit_destroy(a);
    for (int32_t level = 0; level < 3; level++) free(faces[level]);
    free(y);
    free(x);
    free(to);
    destroy_levels(&l);
}

// A double cone: every row around the two apexes sees the whole rim.
static void huge_valences_are_refused_before_they_fill_the_memory(void **state)
{
    (void)state;
    enum { RIM = 3000 };
    pliant_mesh *cone = NULL;
    pliant_error err = {""};
    check_ok(pliant_mesh_create(RIM + 2, 2 * RIM, &cone, &err), &err);
    for (int32_t i = 0; i < RIM; i++) {
        const int32_t j = (i + 1) % RIM;
        memcpy(cone->faces + 6 * i, (int32_t[6]){i, j, RIM, j, i, RIM + 1}, 24);
    }
    levels l = make_levels(cone, 1);
    pliant_loop_limit *limit = NULL;
    const pliant_status status =
        pliant_loop_limit_create(1, l.hierarchy->vertex_count[0], l.hierarchy->face_count[0],
                                 l.hierarchy->faces, &limit, &err);
    assert_int_equal(status, PLIANT_ERR_MEMORY);
    assert_null(limit);
    if (!strstr(err.text, "valences are too large")) fail_msg("found \"%s\"", err.text);
    destroy_levels(&l);
}

static void frames_are_orthonormal_in_any_unit(void **state)
{
    (void)state;
    check_random random = check_random_seed(8);
    for (int i = 0; i < 100; i++) {
        double t[6], frame[9];
        const double unit = pow(10, 400 * check_random_next(&random) - 250);
        for (int k = 0; k < 6; k++) t[k] = unit * (check_random_next(&random) - 0.5);
        const double sine = pliant_loop_frame(t, t + 3, frame);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                double dot = 0;
                for (int d = 0; d < 3; d++) dot += frame[3 * a + d] * frame[3 * b + d];
                check_near(dot, a == b, 1e-14 / sine);
            }
    }
    double frame[9];
    check_near(pliant_loop_frame((double[]){1, 0, 0}, (double[]){2, 0, 0}, frame), 0, 0);
    assert_false(pliant_loop_frame((double[]){0, 0, 0}, (double[]){2, 0, 0}, frame) > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(weights_are_those_of_the_thesis),
        cmocka_unit_test(positions_sum_to_one_and_tangents_to_zero),
        cmocka_unit_test(the_limit_is_the_same_after_any_number_of_steps),
        cmocka_unit_test(tangents_of_a_vertex_span_one_plane_on_all_levels),
        cmocka_unit_test(slow_steps_converge_to_the_limit_and_its_normals),
        cmocka_unit_test(normals_turn_half_as_far_with_every_step),
        cmocka_unit_test(rows_stay_short),
        cmocka_unit_test(what_was_renumbered_has_the_same_surface),
        cmocka_unit_test(huge_valences_are_refused_before_they_fill_the_memory),
        cmocka_unit_test(frames_are_orthonormal_in_any_unit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
