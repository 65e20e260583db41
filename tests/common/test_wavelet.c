// test_wavelet.c: the surface wavelets: inverse, adjoint, vanishing moments, what they reproduce.
#include "check.h"
#include "surfaces.h"

#include "pliant/wavelet.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// A surface with a domain on it: every vertex, or those that a height leaves free.
typedef struct domain {
    check_surface surface;
    pliant_hierarchy *hierarchy;
    int32_t *nodes, count;
} domain;

static domain make_domain(check_surface surface, double lowest)
{
    domain d = {.surface = surface, .hierarchy = check_hierarchy(&surface)};
    const int32_t n = surface.mesh->vertex_count;
    d.nodes = malloc((size_t)n * sizeof *d.nodes);
    assert_non_null(d.nodes);
    for (int32_t v = 0; v < n; v++)
        if (surface.mesh->vertices[3 * v + 2] >= lowest) d.nodes[d.count++] = v;
    return d;
}

static void free_domain(domain *d)
{
    free(d->nodes);
    pliant_hierarchy_destroy(d->hierarchy);
    check_surface_destroy(&d->surface);
}

static pliant_wavelet *plan(const domain *d, const double *areas, pliant_wavelet_def def)
{
    pliant_wavelet *w = NULL;
    pliant_error err;
    check_ok(pliant_wavelet_create(d->hierarchy, areas, d->nodes, d->count, &def, &w, &err), &err);
    return w;
}

static double *rows(const pliant_wavelet *w, int width)
{
    double *x = aligned_alloc(64, (((size_t)w->count + 1) * (size_t)width * sizeof *x + 63) & ~(size_t)63);
    assert_non_null(x);
    memset(x, 0, ((size_t)w->count + 1) * (size_t)width * sizeof *x);
    return x;
}

static void fill(check_random *random, const pliant_wavelet *w, int width, double *x)
{
    for (size_t i = 0; i < (size_t)w->count * (size_t)width; i++) x[i] = 2 * check_random_next(random) - 1;
}

// Every combination of scheme, lifting and boundary.
static pliant_wavelet_def variant(int i)
{
    return (pliant_wavelet_def){(pliant_wavelet_scheme)(i & 1), (pliant_wavelet_lifting)(i >> 1 & 1),
                                (pliant_wavelet_boundary)(i >> 2 & 1)};
}

static const double everywhere = -10, upper_part = -0.5;

static void inverse_undoes_forward_for_every_scheme(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    const double heights[] = {everywhere, upper_part};
    for (int h = 0; h < 2; h++) {
        domain d = make_domain(check_blob(3), heights[h]);
        for (int i = 0; i < 8; i++) {
            pliant_wavelet *w = plan(&d, d.surface.areas, variant(i));
            for (int width = 1; width <= 9; width += 4) {
                double *x = rows(w, width), *y = rows(w, width);
                fill(&random, w, width, x);
                memcpy(y, x, ((size_t)w->count + 1) * (size_t)width * sizeof *x);
                pliant_wavelet_forward(w, width, y);
                pliant_wavelet_inverse(w, w->level_count - 1, width, y);
                double worst = 0;
                for (size_t k = 0; k < ((size_t)w->count + 1) * (size_t)width; k++)
                    worst = fmax(worst, fabs(y[k] - x[k]));
                // A dozen rounded operations a level on values of size 1 (amplified by at most the
                // synthesis norm, under 10 here).
                check_at_most(worst, 1000 * DBL_EPSILON);
                free(x), free(y);
            }
            pliant_wavelet_destroy(w);
        }
        free_domain(&d);
    }
}

static void transpose_is_the_adjoint_of_inverse(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    domain d = make_domain(check_blob(3), upper_part);
    for (int i = 0; i < 8; i++) {
        pliant_wavelet *w = plan(&d, d.surface.areas, variant(i));
        double *x = rows(w, 3), *y = rows(w, 3), *wx = rows(w, 3), *ty = rows(w, 3);
        const size_t bytes = ((size_t)w->count + 1) * 3 * sizeof *x;
        fill(&random, w, 3, x), fill(&random, w, 3, y);
        memcpy(wx, x, bytes), memcpy(ty, y, bytes);
        pliant_wavelet_inverse(w, w->level_count - 1, 3, wx);
        pliant_wavelet_inverse_transpose(w, 3, ty);
        double left = 0, right = 0;
        for (size_t k = 0; k < 3 * (size_t)w->count; k++) left += y[k] * wx[k], right += ty[k] * x[k];
        // Sums of some 1500 products of size 1.
        check_near(left, right, 1e-11);
        free(x), free(y), free(wx), free(ty);
        pliant_wavelet_destroy(w);
    }
    free_domain(&d);
}

// Integral over the nodes of the synthesis function of position p.
static double moment(const pliant_wavelet *w, const double *areas, const int32_t *nodes, int32_t p, double *x)
{
    memset(x, 0, ((size_t)w->count + 1) * sizeof *x);
    x[p] = 1;
    pliant_wavelet_inverse(w, w->level_count - 1, 1, x);
    double sum = 0;
    for (int32_t i = 0; i < w->count; i++) sum += areas[nodes[i]] * x[i];
    return sum;
}

static void lifted_linear_wavelets_integrate_to_zero(void **state)
{
    (void)state;
    domain d = make_domain(check_blob(3), upper_part);
    pliant_wavelet *lifted = plan(&d, d.surface.areas, (pliant_wavelet_def){PLIANT_LINEAR, PLIANT_LIFTED, PLIANT_ZERO});
    pliant_wavelet *plain = plan(&d, d.surface.areas, (pliant_wavelet_def){PLIANT_LINEAR, PLIANT_UNLIFTED, PLIANT_ZERO});
    double *x = rows(lifted, 1);
    double worst = 0, smallest_plain = 1;
    int tested = 0;
    for (int32_t p = lifted->level_offset[1]; p < lifted->count; p++) {
        const int32_t *parents = lifted->update_node + 2 * (p - lifted->level_offset[1]);
        if (parents[0] == lifted->count || parents[1] == lifted->count) continue;
        worst = fmax(worst, fabs(moment(lifted, d.surface.areas, d.nodes, p, x)));
        smallest_plain = fmin(smallest_plain, fabs(moment(plain, d.surface.areas, d.nodes, p, x)));
        tested++;
    }
    assert_true(tested > 400);
    // Hat functions' areas are about 0.02 at this level; their sums round at 1e-16 of the whole.
    check_at_most(worst, 1e-15);
    check_at_least(smallest_plain, 1e-3);
    free(x);
    pliant_wavelet_destroy(plain);
    pliant_wavelet_destroy(lifted);
    free_domain(&d);
}

static void lifted_butterfly_wavelets_integrate_to_zero_on_a_regular_mesh(void **state)
{
    (void)state;
    // All valences 6 and equal areas: every even vertex then gets 6/2 + 6/8 - 12/16 = 3 of its odd
    // neighbours' integrals, as with linear prediction, so the update's integrals are exact.
    domain d = make_domain(check_refine(check_torus(6, 9), 2), everywhere);
    const int32_t n = d.surface.mesh->vertex_count;
    double *areas = malloc((size_t)n * sizeof *areas);
    for (int32_t v = 0; v < n; v++) areas[v] = 1;
    pliant_wavelet *w = plan(&d, areas, pliant_wavelet_default());
    double *x = rows(w, 1), worst = 0;
    for (int32_t p = w->level_offset[1]; p < w->count; p++)
        worst = fmax(worst, fabs(moment(w, areas, d.nodes, p, x)));
    check_at_most(worst, 1e-12);
    free(x);
    free(areas);
    pliant_wavelet_destroy(w);
    free_domain(&d);
}

static void constants_have_no_details_inside_a_domain(void **state)
{
    (void)state;
    domain d = make_domain(check_blob(3), upper_part);
    for (int i = 0; i < 8; i++) {
        pliant_wavelet *w = plan(&d, d.surface.areas, variant(i));
        double *x = rows(w, 1);
        for (int32_t p = 0; p < w->count; p++) x[p] = 1;
        pliant_wavelet_forward(w, 1, x);
        double inside = 0, border = 0;
        for (int32_t p = w->level_offset[1]; p < w->count; p++) {
            const size_t q = (size_t)(p - w->level_offset[1]) * (size_t)w->stencil_size;
            int cut = 0, any = 0;
            for (int k = 0; k < w->stencil_size; k++) {
                cut |= w->predict_node[q + k] == w->count;
                any |= w->predict_node[q + k] < w->count;
            }
            // With zero extension the border's details reach coarser levels through the update.
            const int finest = p >= w->level_offset[w->level_count - 1];
            if (w->def.boundary == PLIANT_DROP ? any : !cut && finest) inside = fmax(inside, fabs(x[p]));
            else border = fmax(border, fabs(x[p]));
        }
        check_at_most(inside, 1e-14 * 16);
        // Zero extension sees the jump at the border: the test would notice if it did not cut.
        if (w->def.boundary == PLIANT_ZERO) check_at_least(border, 0.05);
        free(x);
        pliant_wavelet_destroy(w);
    }
    free_domain(&d);
}

// Largest detail of a polynomial on odd vertices whose stencil lies in one flat face of a cube.
static double flat_detail(const domain *d, pliant_wavelet_scheme scheme, double square)
{
    pliant_wavelet *w = plan(d, d->surface.areas, (pliant_wavelet_def){scheme, PLIANT_UNLIFTED, PLIANT_ZERO});
    double *x = rows(w, 1), worst = 0;
    const double *v = d->surface.mesh->vertices;
    for (int32_t p = 0; p < w->count; p++) {
        const double *at = v + 3 * d->nodes[p];
        x[p] = 1 + 2 * at[0] - at[1] + square * (at[0] * at[0] + 0.5 * at[0] * at[1] * at[1]);
    }
    pliant_wavelet_forward(w, 1, x);
    int tested = 0;
    for (int32_t p = w->level_offset[2]; p < w->count; p++) {
        const pliant_stencil *s = &d->hierarchy->stencils[d->nodes[p] - d->hierarchy->vertex_count[0]];
        const int32_t *all = s->parents;
        int flat = 1;
        for (int k = 0; k < 8; k++) flat &= fabs(v[3 * all[k] + 2] - 1) < 1e-12;
        if (!flat) continue;
        worst = fmax(worst, fabs(x[p]));
        tested++;
    }
    assert_true(tested > 50);
    free(x);
    pliant_wavelet_destroy(w);
    return worst;
}

static void linear_functions_have_no_details_on_a_flat_face_and_cubics_none_with_butterfly(void **state)
{
    (void)state;
    domain d = make_domain(check_refine(check_cube(), 4), everywhere);
    // Midpoint refinement keeps a flat face affinely regular, where the linear rule is exact for
    // degree 1 and the butterfly for degree 3 (Dyn, Levin, Gregory 1990).
    check_at_most(flat_detail(&d, PLIANT_LINEAR, 0), 1e-14);
    check_at_most(flat_detail(&d, PLIANT_BUTTERFLY, 0), 1e-14);
    check_at_most(flat_detail(&d, PLIANT_BUTTERFLY, 1), 1e-14);
    check_at_least(flat_detail(&d, PLIANT_LINEAR, 1), 1e-3);
    free_domain(&d);
}

static void coarse_levels_reconstruct_to_the_same_coarse_values(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    domain d = make_domain(check_blob(3), upper_part);
    for (int i = 0; i < 8; i++) {
        pliant_wavelet *w = plan(&d, d.surface.areas, variant(i));
        double *x = rows(w, 1), *y = rows(w, 1);
        fill(&random, w, 1, x);
        // Unlifted, the value at a vertex is final once its level is reached; lifted, finer levels go
        // on changing it. Stopping at level l must equal the whole with finer details zero.
        for (int32_t level = 0; level < w->level_count; level++) {
            memcpy(y, x, ((size_t)w->count + 1) * sizeof *x);
            pliant_wavelet_inverse(w, level, 1, y);
            double *z = rows(w, 1);
            memcpy(z, x, (size_t)w->level_offset[level + 1] * sizeof *x);
            pliant_wavelet_inverse(w, w->level_count - 1, 1, z);
            for (int32_t p = 0; p < w->level_offset[level + 1]; p++) check_near(y[p], z[p], 1e-13);
            for (int32_t p = w->level_offset[level + 1]; p < w->count; p++) check_near(y[p], x[p], 0);
            free(z);
        }
        free(x), free(y);
        pliant_wavelet_destroy(w);
    }
    free_domain(&d);
}

static void single_precision_and_online_transforms_agree_with_double(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    domain d = make_domain(check_blob(4), upper_part);
    for (int i = 0; i < 8; i++) {
        pliant_wavelet *w = plan(&d, d.surface.areas, variant(i));
        double *x = rows(w, 4), *y = rows(w, 4);
        float *f = (float *)rows(w, 4), *t = (float *)rows(w, 4), *online = (float *)rows(w, 4);
        const size_t values = 4 * (size_t)w->count;
        for (int32_t level = 0; level < w->level_count; level++) {
            fill(&random, w, 4, x);
            for (size_t k = 0; k < values; k++) {
                if (k % 4 == 3) x[k] = 0;  // rows are xyz0
                f[k] = t[k] = online[k] = (float)x[k];
                x[k] = f[k];
            }
            memcpy(y, x, values * sizeof *x);
            pliant_wavelet_inverse(w, level, 4, x);
            pliant_wavelet_inverse_float(w, level, 4, f);
            pliant_wavelet_inverse_online(w, level, online);
            // A dozen float operations a level on values of size up to 10.
            for (size_t k = 0; k < values; k++) {
                check_near(f[k], x[k], 100 * FLT_EPSILON);
                check_near(online[k], x[k], 100 * FLT_EPSILON);
            }
            for (size_t k = values; k < values + 4; k++) check_near(online[k], 0, 0);
        }
        pliant_wavelet_inverse_transpose(w, 4, y);
        pliant_wavelet_inverse_transpose_float(w, 4, t);
        for (size_t k = 0; k < values; k++) check_near(t[k], y[k], 1000 * FLT_EPSILON);
        for (size_t k = 0; k < values; k++) t[k] = (float)y[k];
        pliant_wavelet_forward(w, 4, y);
        pliant_wavelet_forward_float(w, 4, t);
        for (size_t k = 0; k < values; k++) check_near(t[k], y[k], 1e-4);
        free(x), free(y), free(f), free(t), free(online);
        pliant_wavelet_destroy(w);
    }
    free_domain(&d);
}

static void sparse_transform_is_the_online_one_where_rows_are_zero(void **state)
{
    (void)state;
    check_random random = check_random_seed(6);
    domain d = make_domain(check_blob(3), upper_part);
    for (int i = 0; i < 8; i++) {
        pliant_wavelet *w = plan(&d, d.surface.areas, variant(i));
        const size_t words = ((size_t)w->count + 63) / 64, bytes = 4 * ((size_t)w->count + 1) * sizeof(float);
        uint64_t *support = malloc(words * sizeof *support);
        float *g = (float *)rows(w, 4), *full = (float *)rows(w, 4);
        // From nothing to everything touched; touched rows may be zero all the same.
        for (int part = 0; part <= 4; part++)
            for (int32_t level = 0; level < w->level_count; level++) {
                memset(support, 0, words * sizeof *support);
                memset(g, 0, bytes);
                for (int32_t p = 0; p < w->count; p++) {
                    if (check_random_next(&random) * 4 >= part) continue;
                    support[p / 64] |= UINT64_C(1) << p % 64;
                    for (int c = 0; c < 3; c++) g[4 * p + c] = (float)(2 * check_random_next(&random) - 1);
                }
                memcpy(full, g, bytes);
                pliant_wavelet_inverse_online(w, level, full);
                pliant_wavelet_inverse_online_sparse(w, level, support, g);
                // The same sums in another order.
                for (int32_t k = 0; k < 4 * (w->count + 1); k++) check_near(g[k], full[k], 50 * FLT_EPSILON);
            }
        free(support), free(g), free(full);
        pliant_wavelet_destroy(w);
    }
    free_domain(&d);
}

// Every odd position of every level is predicted once, by a triple or by itself; returns the part of
// them that is in triples.
static double check_triples(const pliant_wavelet *w)
{
    int32_t *seen = calloc((size_t)w->count + 1, sizeof *seen);
    assert_non_null(seen);
    int32_t in_triples = 0;
    for (int32_t l = 0; l + 1 < w->level_count; l++) {
        for (int32_t i = w->triple_offset[l]; i < w->triple_offset[l + 1]; i++) {
            const uint16_t *odd = w->triples[i].odd;
            assert_true(odd[0] != odd[1] && odd[1] != odd[2]);
            for (int k = 0; k < (odd[2] == odd[0] ? 2 : 3); k++, in_triples++) seen[odd[k] / 2]++;
        }
        for (int32_t i = w->single_offset[l]; i < w->single_offset[l + 1]; i++) seen[w->singles[i]]++;
        for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++)
            assert_int_equal(seen[p], 1);
    }
    for (int32_t p = 0; p < w->level_offset[1]; p++) assert_int_equal(seen[p], 0);
    free(seen);
    return (double)in_triples / fmax(1, w->count - w->level_offset[1]);
}

static void butterflies_in_threes_equal_those_one_by_one(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    // On the tetrahedron and the octahedron nodes of a stencil coincide.
    domain domains[] = {make_domain(check_refine(check_tetrahedron(), 3), everywhere),
                        make_domain(check_refine(check_octahedron(), 3), everywhere),
                        make_domain(check_refine(check_torus(3, 5), 2), everywhere),
                        make_domain(check_blob(4), everywhere), make_domain(check_blob(4), upper_part),
                        make_domain(check_blob(1), upper_part)};
    for (size_t i = 0; i < sizeof domains / sizeof *domains; i++) {
        for (int lifted = 0; lifted < 2; lifted++) {
            const pliant_wavelet_def def = {PLIANT_BUTTERFLY, (pliant_wavelet_lifting)lifted, PLIANT_ZERO};
            pliant_wavelet *w = plan(&domains[i], domains[i].surface.areas, def);
            assert_non_null(w->triples);
            const double part = check_triples(w);
            if (w->count > 1000) check_at_least(part, 0.9);
            pliant_wavelet plain = *w;  // as in domains that triples do not reach
            plain.triples = NULL;
            float *x = (float *)rows(w, 4), *y = (float *)rows(w, 4);
            for (size_t k = 0; k < 4 * (size_t)w->count; k++)
                x[k] = y[k] = k % 4 == 3 ? 0 : (float)(2 * check_random_next(&random) - 1);
            pliant_wavelet_inverse_online(w, w->level_count - 1, x);
            pliant_wavelet_inverse_online(&plain, w->level_count - 1, y);
            // A dozen float operations a level on values of size up to 10.
            for (size_t k = 0; k < 4 * (size_t)w->count + 4; k++)
                check_near(x[k], y[k], 100 * FLT_EPSILON);
            free(x), free(y);
            pliant_wavelet_destroy(w);
        }
        free_domain(&domains[i]);
    }
}

static void small_and_empty_domains_work(void **state)
{
    (void)state;
    domain d = make_domain(check_sphere(2), everywhere);
    const int32_t all = d.count;
    const int32_t counts[] = {0, 1, 5, all};
    for (int c = 0; c < 4; c++) {
        // The finest vertices alone: nothing on coarser levels.
        d.count = counts[c];
        int32_t *nodes = d.nodes;
        d.nodes = nodes + all - counts[c];
        pliant_wavelet *w = plan(&d, d.surface.areas, pliant_wavelet_default());
        double *x = rows(w, 1);
        for (int32_t p = 0; p < w->count; p++) x[p] = p;
        pliant_wavelet_forward(w, 1, x);
        pliant_wavelet_inverse(w, w->level_count - 1, 1, x);
        for (int32_t p = 0; p < w->count; p++) check_near(x[p], p, 1e-10);
        free(x);
        pliant_wavelet_destroy(w);
        d.nodes = nodes;
    }
    d.count = all;
    free_domain(&d);

    domain base = make_domain(check_refine(check_octahedron(), 0), everywhere);
    pliant_wavelet *w = plan(&base, base.surface.areas, pliant_wavelet_default());
    double *x = rows(w, 1);
    x[3] = 7;
    pliant_wavelet_forward(w, 1, x);
    check_near(x[3], 7, 0);
    free(x);
    pliant_wavelet_destroy(w);
    free_domain(&base);
}

static void nodes_out_of_order_or_range_are_refused(void **state)
{
    (void)state;
    domain d = make_domain(check_sphere(1), everywhere);
    const pliant_wavelet_def def = pliant_wavelet_default();
    pliant_wavelet *w = NULL;
    pliant_error err;
    int32_t nodes[3] = {1, 5, 5};
    assert_int_equal(pliant_wavelet_create(d.hierarchy, d.surface.areas, nodes, 3, &def, &w, &err), PLIANT_ERR_ARGUMENT);
    nodes[2] = d.count;
    assert_int_equal(pliant_wavelet_create(d.hierarchy, d.surface.areas, nodes, 3, &def, &w, &err), PLIANT_ERR_ARGUMENT);
    assert_null(w);
    free_domain(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inverse_undoes_forward_for_every_scheme),
        cmocka_unit_test(transpose_is_the_adjoint_of_inverse),
        cmocka_unit_test(lifted_linear_wavelets_integrate_to_zero),
        cmocka_unit_test(lifted_butterfly_wavelets_integrate_to_zero_on_a_regular_mesh),
        cmocka_unit_test(constants_have_no_details_inside_a_domain),
        cmocka_unit_test(linear_functions_have_no_details_on_a_flat_face_and_cubics_none_with_butterfly),
        cmocka_unit_test(coarse_levels_reconstruct_to_the_same_coarse_values),
        cmocka_unit_test(single_precision_and_online_transforms_agree_with_double),
        cmocka_unit_test(sparse_transform_is_the_online_one_where_rows_are_zero),
        cmocka_unit_test(butterflies_in_threes_equal_those_one_by_one),
        cmocka_unit_test(small_and_empty_domains_work),
        cmocka_unit_test(nodes_out_of_order_or_range_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
