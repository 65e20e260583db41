// test_footprint.c: which hats end within a set, against the hats written out.
#include "check.h"

#include "footprint.h"
#include "synthetic_model.h"

#include "pliant/hats.h"
#include "pliant/pliant.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { levels = 3, n = 642 };

typedef struct fixture {
    pliant_model *model;
    pliant_hats *hats;
    pliant_arena arena;
    pliant_footprint footprint;
} fixture;

static int set_up(void **state)
{
    static fixture f;
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_footprint_%d.h5", (int)getpid());
    // Thresholds do not matter here.
    check_write_synthetic_levels(path, NULL, levels, 0.5, pliant_wavelet_default(),
                                 CHECK_FREE_BLOCK);
    pliant_error err = {""};
    check_ok(pliant_model_open(path, &f.model, &err), &err);
    unlink(path);
    const pliant_model_domain *domain = &f.model->domains[PLIANT_DOMAIN_FREE];
    check_ok(pliant_hats_create(domain->wavelet, domain->nodes, f.model->areas, &f.hats, &err),
             &err);
    for (int pass = 0; pass < 2; pass++) {
        if (pass) check_ok(pliant_arena_reserve(&f.arena, &err), &err);
        pliant_footprint_lay_out(&f.arena, f.model, &f.footprint);
    }
    pliant_footprint_begin(f.model, &f.footprint);
    *state = &f;
    return 0;
}

static int tear_down(void **state)
{
    fixture *f = *state;
    pliant_arena_release(&f->arena);
    pliant_hats_destroy(f->hats);
    pliant_model_close(f->model);
    return 0;
}

// Free vertices within a distance of a centre, and some more at random; index_of as fit wants it.
static int32_t make_set(const fixture *f, check_random *random, int32_t *vertices,
                        int32_t *index_of)
{
    const double *x = pliant_model_positions(f->model);
    const int32_t centre = check_random_index(random, n);
    const double radius = 1.6 * check_random_next(random), chance = check_random_next(random);
    const double holes = 0.1 * chance * chance * chance * chance;  // few sets have many
    int32_t count = 0;
    for (int32_t v = 0; v < n; v++) {
        double square = 0;
        for (int c = 0; c < 3; c++) {
            const double d = x[3 * v + c] - x[3 * centre + c];
            square += d * d;
        }
        const int32_t is_in = square < radius * radius ? check_random_next(random) > holes
                                                       : check_random_next(random) < holes / 4;
        index_of[v] = -1;
        if (!is_in || pliant_model_is_free(f->model, v) != 1) continue;
        index_of[v] = count;
        vertices[count++] = v;
    }
    return count;
}

static void a_hat_fits_when_it_is_zero_outside_the_set(void **state)
{
    fixture *f = *state;
    const pliant_model_domain *domain = &f->model->domains[PLIANT_DOMAIN_FREE];
    check_random random = check_random_seed(1);
    static int32_t vertices[n], index_of[n], found[n];
    int32_t coarse_count = 0;
    for (int trial = 0; trial < 200; trial++) {
        const int32_t count = make_set(f, &random, vertices, index_of);
        pliant_footprint_fit(&f->footprint, vertices, count, index_of, found);
        for (int32_t i = 0; i < count; i++) {
            const int32_t k = f->model->position[vertices[i]];
            int32_t expected = levels;
            for (int32_t l = levels - 1; l >= 0 && k < f->hats->level_offset[l + 1]; l--) {
                int32_t is_inside = 1;
                for (int32_t e = f->hats->offset[l][k]; e < f->hats->offset[l][k + 1]; e++)
                    is_inside &= index_of[domain->nodes[f->hats->position[l][e]]] >= 0;
                if (!is_inside) break;
                expected = l;
            }
            assert_int_equal(found[i], expected);
            coarse_count += expected < levels - 1;
        }
    }
    check_at_least(coarse_count, 200);
}

// Gaussian elimination: the rank of `rows` vectors of `width`, and whether each of `others` is
// among their combinations. Weights are multiples of 1/8, so that zeros are exact up to rounding.
static int32_t reduce(int32_t rows, int32_t width, double *a)
{
    int32_t rank = 0;
    for (int32_t c = 0; c < width && rank < rows; c++) {
        int32_t pivot = rank;
        for (int32_t r = rank; r < rows; r++)
            if (a[r * width + c] * a[r * width + c] > a[pivot * width + c] * a[pivot * width + c])
                pivot = r;
        if (a[pivot * width + c] * a[pivot * width + c] < 1e-16) continue;
        for (int32_t k = 0; k < width; k++) {
            const double swap = a[pivot * width + k];
            a[pivot * width + k] = a[rank * width + k];
            a[rank * width + k] = swap;
        }
        for (int32_t r = rank + 1; r < rows; r++) {
            const double factor = a[r * width + c] / a[rank * width + c];
            for (int32_t k = c; k < width; k++) a[r * width + k] -= factor * a[rank * width + k];
        }
        rank++;
    }
    return rank;
}

static void write_hat(const fixture *f, int32_t level, int32_t vertex, double *row)
{
    const int32_t k = f->model->position[vertex];
    memset(row, 0, (size_t)f->hats->count * sizeof *row);
    for (int32_t e = f->hats->offset[level][k]; e < f->hats->offset[level][k + 1]; e++)
        row[f->hats->position[level][e]] = f->hats->weight[level][e];
}

// Refined hats span what the fitting ones did: all together have the same rank. And they are as
// fine as can be: one level further and the rank goes up.
static void refining_keeps_the_span_and_goes_as_far_as_it_can(void **state)
{
    fixture *f = *state;
    check_random random = check_random_seed(2);
    static int32_t vertices[n], index_of[n], fit[n], nodes[n], levels_before[n], levels_after[n];
    const int32_t width = f->hats->count;
    int32_t refined_count = 0, kept_count = 0;
    for (int trial = 0; trial < 60; trial++) {
        const int32_t count = make_set(f, &random, vertices, index_of);
        pliant_footprint_fit(&f->footprint, vertices, count, index_of, fit);
        const double part = 1 - 0.3 * check_random_next(&random);
        int32_t node_count = 0;
        for (int32_t i = 0; i < count; i++) {
            if (check_random_next(&random) > part) continue;
            nodes[node_count] = vertices[i];
            levels_before[node_count] = levels_after[node_count] = fit[i];
            node_count++;
        }
        if (node_count == 0 || node_count > 200) continue;
        pliant_footprint_refine(&f->footprint, nodes, node_count, levels_after);
        double *rows = calloc(2 * (size_t)node_count * (size_t)width, sizeof *rows);
        assert_non_null(rows);
        for (int32_t i = 0; i < node_count; i++) {
            write_hat(f, levels_before[i], nodes[i], rows + (size_t)i * width);
            write_hat(f, levels_after[i], nodes[i], rows + (size_t)(node_count + i) * width);
            refined_count += levels_after[i] > levels_before[i];
        }
        assert_int_equal(reduce(2 * node_count, width, rows), node_count);
        for (int32_t i = 0; i < node_count; i++) {
            if (levels_after[i] == levels) continue;
            kept_count++;
            if (kept_count % 7 != 0) continue;  // it takes its time
            for (int32_t j = 0; j < node_count; j++)
                write_hat(f, levels_after[j], nodes[j], rows + (size_t)j * width);
            write_hat(f, levels_after[i] + 1, nodes[i], rows + (size_t)node_count * width);
            assert_int_equal(reduce(node_count + 1, width, rows), node_count + 1);
        }
        free(rows);
    }
    check_at_least(refined_count, 50);
    check_at_least(kept_count, 50);
}

static void all_nodes_of_a_set_are_refined_to_the_finest_level(void **state)
{
    fixture *f = *state;
    check_random random = check_random_seed(3);
    static int32_t vertices[n], index_of[n], found[n];
    for (int trial = 0; trial < 50; trial++) {
        const int32_t count = make_set(f, &random, vertices, index_of);
        pliant_footprint_fit(&f->footprint, vertices, count, index_of, found);
        pliant_footprint_refine(&f->footprint, vertices, count, found);
        for (int32_t i = 0; i < count; i++) assert_int_equal(found[i], levels);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hat_fits_when_it_is_zero_outside_the_set),
        cmocka_unit_test(refining_keeps_the_span_and_goes_as_far_as_it_can),
        cmocka_unit_test(all_nodes_of_a_set_are_refined_to_the_finest_level),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
