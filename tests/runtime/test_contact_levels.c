// test_contact_levels.c: nodes replaced and sent back at random, against hats summed by definition.
#include "check.h"

#include "synthetic_model.h"

#include "contact_levels.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct fixture {
    pliant_model *model;
    pliant_arena arena;
    pliant_contact_levels levels;
    int32_t n, finest;
} fixture;

static fixture set_up(int32_t depth, int32_t coarsest, int32_t finest)
{
    fixture f = {.finest = depth};
    char path[64];
    pliant_error err = {""};
    snprintf(path, sizeof path, "/tmp/pliant_test_contact_levels_%d.h5", (int)getpid());
    check_write_synthetic_levels(path, NULL, depth, 0.1, pliant_wavelet_default(),
                                 CHECK_FREE_BLOCK);
    check_ok(pliant_model_open(path, &f.model, &err), &err);
    unlink(path);
    f.n = f.model->vertex_count;
    pliant_contact_levels_lay_out(&f.arena, f.model, &f.levels);
    check_ok(pliant_arena_reserve(&f.arena, &err), &err);
    pliant_contact_levels_lay_out(&f.arena, f.model, &f.levels);
    pliant_contact_levels_begin(&f.levels, coarsest, finest);
    return f;
}

static void tear_down(fixture *f)
{
    pliant_arena_release(&f->arena);
    pliant_model_close(f->model);
}

static int32_t is_free(const fixture *f, int32_t vertex)
{
    return pliant_model_is_free(f->model, vertex) == 1;
}

// A hat at all vertices, from its definition (GF-53) upwards: one at its vertex, zero at the others
// of its level, and half of the parents' sum at odd vertices, in the domain.
static void make_hat(const fixture *f, pliant_node node, double *hat)
{
    const pliant_hierarchy *h = f->model->hierarchy;
    memset(hat, 0, (size_t)f->n * sizeof *hat);
    hat[node.vertex] = 1;
    for (int32_t v = h->vertex_count[node.level]; v < f->n; v++) {
        const int32_t *parents = h->stencils[v - h->vertex_count[0]].parents;
        hat[v] = is_free(f, v) ? (hat[parents[0]] + hat[parents[1]]) / 2 : 0;
    }
}

static void values_are_those_of_the_hats(void **state)
{
    (void)state;
    fixture f = set_up(3, 0, 3);
    double *hat = calloc((size_t)f.n, sizeof *hat);
    assert_non_null(hat);
    for (int32_t level = 0; level <= f.finest; level++)
        for (int32_t k = 0; k < f.model->hierarchy->vertex_count[level]; k++) {
            if (!is_free(&f, k)) continue;
            make_hat(&f, (pliant_node){level, k}, hat);
            for (int32_t v = 0; v < f.n; v++) {
                if (!is_free(&f, v)) continue;
                const pliant_hat_values hats = pliant_contact_levels_hats(&f.levels, level, v);
                double value = 0;
                for (int32_t i = 0; i < hats.count; i++)
                    if (hats.vertex[i] == k) value += hats.value[i];
                check_near(value, hat[v], 1e-15);
            }
        }
    free(hat);
    tear_down(&f);
}

static void children_are_the_odd_vertices_on_the_edges(void **state)
{
    (void)state;
    fixture f = set_up(3, 0, 3);
    const pliant_hierarchy *h = f.model->hierarchy;
    int32_t found = 0;
    for (int32_t v = 0; v < f.n; v++)
        for (int32_t level = 1; level <= f.finest; level++) {
            const pliant_child_range range = pliant_contact_levels_children(&f.levels, v, level);
            for (int32_t i = range.begin; i < range.end; i++, found++) {
                const int32_t child = f.levels.children[i];
                assert_in_range(child, h->vertex_count[level - 1], h->vertex_count[level] - 1);
                const int32_t *parents = h->stencils[child - h->vertex_count[0]].parents;
                assert_true(parents[0] == v || parents[1] == v);
            }
        }
    assert_int_equal(found, 2 * (f.n - h->vertex_count[0]));
    tear_down(&f);
}

// Nodes in force at their vertices: the matrix of all hats at all these must be regular, or forces
// would not be determined. Hats of one level are zero at each other's vertices, so ordered by
// levels it is triangular.
static void check_independent(const fixture *f)
{
    double *hat = calloc((size_t)f->n, sizeof *hat);
    assert_non_null(hat);
    for (int32_t k = 0; k < f->n; k++) {
        if (!is_free(f, k) || !pliant_contact_levels_exists(&f->levels, k)) continue;
        const int32_t level = f->levels.level[k];
        make_hat(f, (pliant_node){level, k}, hat);
        for (int32_t v = 0; v < f->n; v++) {
            if (v == k || hat[v] == 0 || !is_free(f, v)) continue;
            if (!pliant_contact_levels_exists(&f->levels, v)) continue;
            check_at_least(f->levels.level[v], level + 1);
        }
    }
    free(hat);
}

// Everything that hats of the coarsest level can express is a sum of hats in force: their values
// at the nodes' vertices, coarse to fine, give the coefficients.
static void check_expressible(const fixture *f, check_random *random)
{
    double *wanted = calloc((size_t)f->n, sizeof *wanted), *hat = calloc((size_t)f->n, sizeof *hat);
    assert_true(wanted && hat);
    for (int32_t k = 0; k < f->model->hierarchy->vertex_count[f->levels.coarsest]; k++) {
        if (!is_free(f, k)) continue;
        const double pressure = check_random_next(random);
        make_hat(f, (pliant_node){f->levels.coarsest, k}, hat);
        for (int32_t v = 0; v < f->n; v++) wanted[v] += pressure * hat[v];
    }
    for (int32_t level = f->levels.coarsest; level <= f->levels.finest; level++)
        for (int32_t k = 0; k < f->n; k++) {
            if (!is_free(f, k) || f->levels.level[k] != level) continue;
            if (!pliant_contact_levels_exists(&f->levels, k)) continue;
            const double pressure = wanted[k];
            check_at_least(pressure, -1e-12);  // children only add
            make_hat(f, (pliant_node){level, k}, hat);
            for (int32_t v = 0; v < f->n; v++) wanted[v] -= pressure * hat[v];
        }
    for (int32_t v = 0; v < f->n; v++)
        if (is_free(f, v)) check_near(wanted[v], 0, 1e-12);
    free(wanted);
    free(hat);
}

static void check_no_child_is_replaced(const fixture *f, int32_t vertex)
{
    const int32_t level = f->levels.level[vertex];
    const pliant_child_range range = pliant_contact_levels_children(&f->levels, vertex, level);
    for (int32_t i = range.begin; i < range.end; i++)
        assert_int_equal(f->levels.level[f->levels.children[i]], level);
}

static void replaced_nodes_keep_what_could_be_expressed(void **state)
{
    (void)state;
    check_random random = check_random_seed(21);
    for (int32_t coarsest = 0; coarsest < 3; coarsest++) {
        fixture f = set_up(3, coarsest, 3);
        int32_t refined = 0, coarsened = 0;
        for (int32_t round = 0; round < 400; round++) {
            const int32_t v = check_random_index(&random, f.n);
            int32_t replaced[3];
            if (is_free(&f, v) && check_random_next(&random) < 0.3)
                refined += pliant_contact_levels_refine(&f.levels, v, replaced);
            if (f.levels.refined_count > 0 && check_random_next(&random) < 0.5) {
                const int32_t k =
                    f.levels.refined[check_random_index(&random, f.levels.refined_count)];
                if (pliant_contact_levels_may_coarsen(&f.levels, k)) {
                    check_no_child_is_replaced(&f, k);
                    pliant_contact_levels_coarsen(&f.levels, k);
                    coarsened++;
                }
            }
            if (round % 50 != 49) continue;
            check_independent(&f);
            check_expressible(&f, &random);
        }
        check_at_least(refined, 20);
        check_at_least(coarsened, 20);
        tear_down(&f);
    }
}

static void refining_at_a_vertex_gives_it_a_node_level_by_level(void **state)
{
    (void)state;
    fixture f = set_up(3, 0, 3);
    for (int32_t v = 0; v < f.n; v += 7) {
        if (!is_free(&f, v)) continue;
        pliant_contact_levels_begin(&f.levels, 0, 3);
        int32_t replaced[3], rounds = 0;
        while (pliant_contact_levels_refine(&f.levels, v, replaced) > 0) rounds++;
        assert_true(pliant_contact_levels_exists(&f.levels, v));
        // One round a level, and none where fixed vertices leave it alone.
        check_at_most(rounds, f.levels.first[v]);
        if (v < f.model->hierarchy->vertex_count[0]) assert_int_equal(rounds, 0);
    }
    // The finest level of nodes is the last.
    pliant_contact_levels_begin(&f.levels, 1, 2);
    const int32_t fine = f.model->hierarchy->vertex_count[2];
    for (int32_t v = fine; v < f.n; v += 5) {
        int32_t replaced[3];
        if (!is_free(&f, v)) continue;
        while (pliant_contact_levels_refine(&f.levels, v, replaced) > 0) continue;
        assert_false(pliant_contact_levels_exists(&f.levels, v));
    }
    for (int32_t v = 0; v < f.n; v++)
        check_at_most(f.levels.level[v], f.levels.first[v] > 2 ? 3 : 2);
    tear_down(&f);
}

static void coarsening_everything_leaves_the_coarsest_level(void **state)
{
    (void)state;
    fixture f = set_up(3, 0, 3);
    check_random random = check_random_seed(2);
    for (int32_t i = 0; i < 100; i++) {
        int32_t replaced[3];
        const int32_t v = check_random_index(&random, f.n);
        if (is_free(&f, v)) (void)pliant_contact_levels_refine(&f.levels, v, replaced);
    }
    check_at_least(f.levels.refined_count, 10);
    for (int32_t round = 0; round < 3; round++)
        for (int32_t i = f.levels.refined_count; i-- > 0;)
            if (pliant_contact_levels_may_coarsen(&f.levels, f.levels.refined[i]))
                pliant_contact_levels_coarsen(&f.levels, f.levels.refined[i]);
    assert_int_equal(f.levels.refined_count, 0);
    int32_t left = 0;
    for (int32_t v = 0; v < f.n; v++)
        if (is_free(&f, v) && pliant_contact_levels_exists(&f.levels, v) &&
            v >= f.model->hierarchy->vertex_count[0])
            left++;
    // Those between fixed vertices, which nothing else covers.
    for (int32_t v = f.model->hierarchy->vertex_count[0]; v < f.n; v++) {
        const int32_t *parents =
            f.model->hierarchy->stencils[v - f.model->hierarchy->vertex_count[0]].parents;
        if (is_free(&f, v) && !is_free(&f, parents[0]) && !is_free(&f, parents[1])) left--;
    }
    check_at_most(left, 0);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_those_of_the_hats),
        cmocka_unit_test(children_are_the_odd_vertices_on_the_edges),
        cmocka_unit_test(replaced_nodes_keep_what_could_be_expressed),
        cmocka_unit_test(refining_at_a_vertex_gives_it_a_node_level_by_level),
        cmocka_unit_test(coarsening_everything_leaves_the_coarsest_level),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
