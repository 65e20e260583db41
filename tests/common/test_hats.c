// test_hats.c: hierarchical basis functions: they interpolate, refine, add up to one, keep area.
#include "check.h"
#include "surfaces.h"

#include "pliant/hats.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// A surface, the part of it above a height, and that domain's hats.
typedef struct fixture {
    check_surface surface;
    pliant_hierarchy *hierarchy;
    int32_t *nodes, *position, count;  // position[n]: count outside the domain
    pliant_wavelet *wavelet;
    pliant_hats *hats;
} fixture;

static const double everywhere = -10, upper_part = -0.5, tip = 0.7;

static fixture make(check_surface surface, double lowest)
{
    fixture f = {.surface = surface, .hierarchy = check_hierarchy(&surface)};
    const int32_t n = surface.mesh->vertex_count;
    f.nodes = malloc((size_t)n * sizeof *f.nodes);
    f.position = malloc((size_t)n * sizeof *f.position);
    assert_non_null(f.nodes);
    assert_non_null(f.position);
    for (int32_t v = 0; v < n; v++)
        if (surface.mesh->vertices[3 * v + 2] >= lowest) f.nodes[f.count++] = v;
    for (int32_t v = 0; v < n; v++) f.position[v] = f.count;
    for (int32_t p = 0; p < f.count; p++) f.position[f.nodes[p]] = p;
    const pliant_wavelet_def def = pliant_wavelet_default();
    pliant_error err;
    check_ok(pliant_wavelet_create(f.hierarchy, surface.areas, f.nodes, f.count, &def, &f.wavelet, &err), &err);
    check_ok(pliant_hats_create(f.wavelet, f.nodes, surface.areas, &f.hats, &err), &err);
    return f;
}

static void destroy(fixture *f)
{
    pliant_hats_destroy(f->hats);
    pliant_wavelet_destroy(f->wavelet);
    free(f->position);
    free(f->nodes);
    pliant_hierarchy_destroy(f->hierarchy);
    check_surface_destroy(&f->surface);
}

// Surfaces of other kinds: valences 5 and 6, 3, 6 of genus 1; whole, cut, and a small rest.
enum { case_count = 6 };
static fixture make_case(int i)
{
    switch (i) {
    case 0: return make(check_blob(3), everywhere);
    case 1: return make(check_blob(3), upper_part);
    case 2: return make(check_blob(3), tip);
    case 3: return make(check_refine(check_tetrahedron(), 4), upper_part);
    case 4: return make(check_refine(check_torus(3, 4), 2), 0);
    default: return make(check_refine(check_cube(), 3), everywhere);
    }
}

// The hat of position k on level l at all positions, [count + 1]; the caller frees.
static double *dense(const pliant_hats *h, int32_t l, int32_t k)
{
    double *x = calloc((size_t)h->count + 1, sizeof *x);
    assert_non_null(x);
    for (int32_t e = h->offset[l][k]; e < h->offset[l][k + 1]; e++) x[h->position[l][e]] = h->weight[l][e];
    return x;
}

static void hats_are_one_at_their_vertex_and_nothing_at_others_of_their_level(void **state)
{
    (void)state;
    for (int i = 0; i < case_count; i++) {
        fixture f = make_case(i);
        const pliant_hats *h = f.hats;
        assert_int_equal(h->count, f.count);
        assert_int_equal(h->level_count, f.surface.level_count);
        for (int32_t l = 0; l < h->level_count; l++) {
            const int32_t columns = h->level_offset[l + 1];
            assert_int_equal(columns, f.wavelet->level_offset[l + 1]);
            assert_int_equal(h->offset[l][0], 0);
            for (int32_t k = 0; k < columns; k++) {
                int32_t e = h->offset[l][k];
                assert_int_equal(h->position[l][e], k);
                check_near(h->weight[l][e], 1, 0);
                for (e++; e < h->offset[l][k + 1]; e++) {
                    assert_true(h->position[l][e] >= columns && h->position[l][e] < h->count);
                    assert_true(h->position[l][e] > h->position[l][e - 1]);
                    assert_true(h->weight[l][e] > 0 && h->weight[l][e] < 1);
                }
            }
            // On the finest level a hat is its vertex (GF-52).
            if (l == h->level_count - 1) assert_int_equal(h->offset[l][columns], columns);
        }
        destroy(&f);
    }
}

// GF-53 from the hierarchy's own parents, whatever the plan of the wavelet says.
static void hats_of_a_level_are_sums_of_the_next_finer(void **state)
{
    (void)state;
    for (int i = 0; i < case_count; i++) {
        fixture f = make_case(i);
        const pliant_hats *h = f.hats;
        for (int32_t l = 0; l + 1 < h->level_count; l++)
            for (int32_t k = 0; k < h->level_offset[l + 1]; k++) {
                double *coarse = dense(h, l, k), *sum = dense(h, l + 1, k);
                for (int32_t v = f.hierarchy->vertex_count[l]; v < f.hierarchy->vertex_count[l + 1]; v++) {
                    const int32_t *parents = f.hierarchy->stencils[v - f.hierarchy->vertex_count[0]].parents;
                    if (f.position[v] == f.count || (parents[0] != f.nodes[k] && parents[1] != f.nodes[k])) continue;
                    double *odd = dense(h, l + 1, f.position[v]);
                    for (int32_t j = 0; j < f.count; j++) sum[j] += odd[j] / 2;
                    free(odd);
                }
                // Weights are multiples of 2^-L: sums are exact.
                for (int32_t j = 0; j < f.count; j++) check_near(coarse[j], sum[j], 0);
                free(coarse), free(sum);
            }
        destroy(&f);
    }
}

static void hats_of_a_level_add_up_to_one_where_no_ancestor_is_outside(void **state)
{
    (void)state;
    for (int i = 0; i < case_count; i++) {
        fixture f = make_case(i);
        const pliant_hats *h = f.hats;
        const int32_t base = f.hierarchy->vertex_count[0];
        int32_t partial = 0;
        for (int32_t l = 0; l < h->level_count; l++) {
            double *sum = calloc((size_t)f.count + 1, sizeof *sum);
            uint8_t *cut = calloc((size_t)f.surface.mesh->vertex_count, 1);
            for (int32_t e = 0; e < h->offset[l][h->level_offset[l + 1]]; e++)
                sum[h->position[l][e]] += h->weight[l][e];
            for (int32_t v = 0; v < f.surface.mesh->vertex_count; v++) {
                cut[v] = f.position[v] == f.count;
                if (v >= f.hierarchy->vertex_count[l] && v >= base)
                    for (int k = 0; k < 2; k++) cut[v] |= cut[f.hierarchy->stencils[v - base].parents[k]];
            }
            for (int32_t p = 0; p < f.count; p++) {
                if (!cut[f.nodes[p]]) check_near(sum[p], 1, 0);
                else assert_true(sum[p] >= 0 && sum[p] < 1);
                partial += cut[f.nodes[p]];
            }
            free(cut), free(sum);
        }
        // Only where the domain has a border are there such.
        assert_true(i == 0 || i == 5 ? partial == 0 : partial > 0);
        destroy(&f);
    }
}

static void hats_reproduce_what_is_linear_on_coarse_triangles(void **state)
{
    (void)state;
    // Midpoint refinement: finer vertices lie on the coarse triangles.
    fixture f = make(check_refine(check_cube(), 3), everywhere);
    const pliant_hats *h = f.hats;
    for (int32_t l = 0; l < h->level_count; l++) {
        double(*x)[3] = calloc((size_t)f.count, sizeof *x);
        for (int32_t k = 0; k < h->level_offset[l + 1]; k++)
            for (int32_t e = h->offset[l][k]; e < h->offset[l][k + 1]; e++)
                for (int c = 0; c < 3; c++)
                    x[h->position[l][e]][c] += h->weight[l][e] * f.surface.mesh->vertices[3 * f.nodes[k] + c];
        for (int32_t p = 0; p < f.count; p++)
            for (int c = 0; c < 3; c++)
                check_near(x[p][c], f.surface.mesh->vertices[3 * f.nodes[p] + c], 4 * DBL_EPSILON);
        free(x);
    }
    destroy(&f);
}

static void areas_of_a_levels_hats_add_up_to_the_surfaces(void **state)
{
    (void)state;
    for (int i = 0; i < case_count; i++) {
        fixture f = make_case(i);
        const pliant_hats *h = f.hats;
        double whole = 0;
        for (int32_t p = 0; p < f.count; p++) whole += f.surface.areas[f.nodes[p]];
        for (int32_t l = 0; l < h->level_count; l++) {
            double sum = 0;
            for (int32_t k = 0; k < h->level_offset[l + 1]; k++) {
                double area = 0;
                for (int32_t e = h->offset[l][k]; e < h->offset[l][k + 1]; e++)
                    area += h->weight[l][e] * f.surface.areas[f.nodes[h->position[l][e]]];
                // A few hundred products of one sign.
                check_near(h->area[l][k], area, 1e-13 * area);
                assert_true(area > 0);
                sum += area;
            }
            const int is_whole = i == 0 || i == 5 || l == h->level_count - 1;
            if (is_whole) check_near(sum, whole, 1e-13 * whole);
            else check_at_most(sum, whole * (1 + 1e-13));
        }
        destroy(&f);
    }
}

static void a_domain_without_nodes_has_no_hats(void **state)
{
    (void)state;
    fixture f = make(check_sphere(1), 10);
    assert_int_equal(f.hats->count, 0);
    for (int32_t l = 0; l < f.hats->level_count; l++) assert_int_equal(f.hats->level_offset[l + 1], 0);
    destroy(&f);
    pliant_hats_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hats_are_one_at_their_vertex_and_nothing_at_others_of_their_level),
        cmocka_unit_test(hats_of_a_level_are_sums_of_the_next_finer),
        cmocka_unit_test(hats_of_a_level_add_up_to_one_where_no_ancestor_is_outside),
        cmocka_unit_test(hats_reproduce_what_is_linear_on_coarse_triangles),
        cmocka_unit_test(areas_of_a_levels_hats_add_up_to_the_surfaces),
        cmocka_unit_test(a_domain_without_nodes_has_no_hats),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
