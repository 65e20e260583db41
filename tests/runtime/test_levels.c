// test_levels.c: constraints and loads on hierarchical hats, mixed, against dense matrices.
#include "levels_fixture.h"

extern void dgesv_(const int *n, const int *nrhs, double *a, const int *lda, int *pivots, double *b,
                   const int *ldb, int *info);

// ---- Hats ----

static void hats_refine_and_their_areas_add_up(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    const pliant_hierarchy *h = f.model->hierarchy;
    for (int32_t l = 0; l <= finest; l++) {
        // h[k][v], the hat of k at v, by the refinement relation (GF-53).
        static double hat[vertex_count][vertex_count];
        memset(hat, 0, sizeof hat);
        for (int32_t k = 0; k < h->vertex_count[l]; k++) hat[k][k] = 1;
        for (int32_t v = h->vertex_count[l]; v < vertex_count; v++)
            for (int side = 0; side < 2; side++) {
                const int32_t parent = h->stencils[v - 12].parents[side];
                if (f.model->domain[parent] != f.model->domain[v]) continue;
                for (int32_t k = 0; k < h->vertex_count[l]; k++) hat[k][v] += hat[k][parent] / 2;
            }
        for (int32_t k = 0; k < h->vertex_count[l]; k++) {
            double area = 0;
            for (int32_t v = 0; v < vertex_count; v++) area += hat[k][v] * f.exact->surface.areas[v];
            check_near(pliant_model_node_area(f.model, (pliant_node){l, k}), area, 1e-14);
        }
        for (int32_t v = 0; v < vertex_count; v++) {
            int32_t vertices[3];
            float weights[3];
            const int32_t count = pliant_model_hats_at(f.model, l, v, vertices, weights);
            assert_in_range(count, 0, 3);
            double found = 0, expected = 0;
            for (int32_t i = 0; i < count; i++) {
                check_near(weights[i], hat[vertices[i]][v], 1e-7);
                found += (double)weights[i];
            }
            for (int32_t k = 0; k < h->vertex_count[l]; k++) expected += hat[k][v];
            check_near(found, expected, 1e-6);
        }
    }
    tear_down(&f);
}

// ---- Solves against dense matrices ----

typedef struct condition {
    pliant_node node;
    int32_t is_changed;  // in S
    pliant_vec3 value;
} condition;

// Values on all rows by GF-7, 18 with hats as columns: displacements of free vertices, tractions of
// fixed ones. x[3 i]: what S solved for.
static void solve_dense(const fixture *f, const condition *conditions, int32_t count, double *v,
                        double *x)
{
    memset(v, 0, 3 * vertex_count * sizeof *v);
    int32_t changed[vertex_count];
    int s = 0;
    for (int32_t i = 0; i < count; i++) {
        const condition *c = &conditions[i];
        if (c->is_changed) {
            changed[s++] = i;
            continue;
        }
        for (int32_t row = 0; row < 3 * vertex_count; row++)
            for (int k = 0; k < 3; k++)
                v[row] += component(c->value, k) *
                          check_synthetic_element(f->exact, row / 3, row % 3, c->node.level,
                                                  c->node.vertex, k);
    }
    const int n = 3 * s;
    if (n == 0) return;
    double *matrix = calloc((size_t)n * n, sizeof *matrix);
    int *pivots = calloc((size_t)n, sizeof *pivots), info = 0;
    assert_true(matrix && pivots);
    for (int i = 0; i < n; i++) {
        const condition *row = &conditions[changed[i / 3]];
        x[i] = component(row->value, i % 3) - v[3 * row->node.vertex + i % 3];
        for (int j = 0; j < n; j++) {
            const pliant_node column = conditions[changed[j / 3]].node;
            matrix[i + j * n] = check_synthetic_element(f->exact, row->node.vertex, i % 3,
                                                        column.level, column.vertex, j % 3);
        }
    }
    dgesv_(&n, &(int){1}, matrix, &n, pivots, x, &n, &info);
    assert_int_equal(info, 0);
    for (int j = 0; j < n; j++) {
        const pliant_node column = conditions[changed[j / 3]].node;
        for (int32_t row = 0; row < 3 * vertex_count; row++)
            v[row] += x[j] * check_synthetic_element(f->exact, row / 3, row % 3, column.level,
                                                     column.vertex, j % 3);
    }
    free(matrix);
    free(pivots);
}

// One condition a vertex at most: the last one counts.
static int32_t add_condition(condition *conditions, int32_t count, condition added)
{
    for (int32_t i = 0; i < count; i++)
        if (conditions[i].node.vertex == added.node.vertex) {
            conditions[i] = added;
            return count;
        }
    conditions[count] = added;
    return count + 1;
}

static void compare_with_dense(fixture *f, const condition *conditions, int32_t count,
                               double tolerance)
{
    static double v[3 * vertex_count], x[3 * vertex_count];
    solve_dense(f, conditions, count, v, x);
    pliant_vec3 u[vertex_count], p[vertex_count];
    assert_int_equal(pliant_solver_surface(f->solver, finest, u), PLIANT_OK);
    assert_int_equal(pliant_solver_tractions(f->solver, NULL, vertex_count, p), PLIANT_OK);
    // The field that the rows do not hold: hats of loads and of what S solved for.
    static double boundary[3 * vertex_count];
    memset(boundary, 0, sizeof boundary);
    pliant_vec3 force = {0, 0, 0};
    for (int32_t i = 0, s = 0; i < count; i++) {
        const condition *c = &conditions[i];
        double value[3];
        for (int k = 0; k < 3; k++) value[k] = c->is_changed ? x[3 * s + k] : component(c->value, k);
        const double area = pliant_model_node_area(f->model, c->node);
        if (c->is_changed && pliant_model_is_free(f->model, c->node.vertex)) {
            force.x += (float)(area * value[0]), force.y += (float)(area * value[1]);
            force.z += (float)(area * value[2]);
        }
        s += c->is_changed;
        for (int32_t w = 0; w < vertex_count; w++) {
            int32_t vertices[3];
            float weights[3];
            if (f->model->domain[w] != f->model->domain[c->node.vertex]) continue;
            const int32_t hats =
                pliant_model_hats_at(f->model, c->node.level, w, vertices, weights);
            for (int32_t h = 0; h < hats; h++)
                if (vertices[h] == c->node.vertex)
                    for (int k = 0; k < 3; k++)
                        boundary[3 * w + k] += (double)weights[h] * value[k];
        }
    }
    double largest[2] = {0}, worst[2] = {0};
    for (int32_t w = 0; w < vertex_count; w++)
        for (int k = 0; k < 3; k++) {
            const int is_free = pliant_model_is_free(f->model, w) == 1;
            const double *of_u = is_free ? v : boundary, *of_p = is_free ? boundary : v;
            largest[0] = fmax(largest[0], fabs(of_u[3 * w + k]));
            largest[1] = fmax(largest[1], fabs(of_p[3 * w + k]));
            worst[0] = fmax(worst[0], fabs(component(u[w], k) - of_u[3 * w + k]));
            worst[1] = fmax(worst[1], fabs(component(p[w], k) - of_p[3 * w + k]));
        }
    check_at_most(worst[0], tolerance * largest[0]);
    check_at_most(worst[1], 10 * tolerance * largest[1]);
    const pliant_vec3 found = pliant_solver_contact_force(f->solver);
    for (int k = 0; k < 3; k++)
        check_near(component(found, k), component(force, k), 10 * tolerance * largest[1]);
}

static void any_mix_of_levels_equals_the_dense_construction(void **state)
{
    (void)state;
    // Nothing dropped, and compressed (against what is stored): float sums of some hundred terms.
    for (int kind = 0; kind < 2; kind++) {
        fixture f = set_up(kind ? 0.05 : 0, CHECK_ALL_BLOCKS, roomy);
        if (kind) check_synthetic_round(f.exact);
        check_random random = check_random_seed(21);
        for (int round = 0; round < 12; round++) {
            condition conditions[vertex_count];
            int32_t count = 0;
            pliant_solver_release_all(f.solver);
            for (int i = 0; i < 14; i++) {
                const int32_t is_displaced = i % 3 != 0;
                condition c = {.node = random_node(&random), .value = random_vector(&random, 0.1)};
                const int32_t is_free = pliant_model_is_free(f.model, c.node.vertex);
                const pliant_status status =
                    !is_displaced ? pliant_solver_press(f.solver, c.node, c.value)
                    : is_free     ? pliant_solver_displace(f.solver, c.node, c.value)
                                  : pliant_solver_support(f.solver, c.node, c.value);
                assert_int_equal(status, PLIANT_OK);
                c.is_changed = is_displaced == is_free;
                count = add_condition(conditions, count, c);
            }
            assert_true(pliant_solver_solve(f.solver, PLIANT_NEVER) >= 0);
            compare_with_dense(&f, conditions, count, 2e-5);
        }
        tear_down(&f);
    }
}

static void a_coarse_load_is_its_finer_loads(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    const pliant_node coarse = {0, 1};
    const pliant_vec3 p = {0.5f, -1, 0.25f};
    pliant_vec3 u[vertex_count], sum[vertex_count];
    assert_int_equal(pliant_solver_press(f.solver, coarse, p), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_surface(f.solver, finest, u), PLIANT_OK);
    pliant_solver_release_all(f.solver);
    for (int32_t v = 0; v < vertex_count; v++) {
        int32_t vertices[3];
        float weights[3];
        const int32_t count = pliant_model_hats_at(f.model, 0, v, vertices, weights);
        for (int32_t k = 0; k < count; k++)
            if (vertices[k] == coarse.vertex && pliant_model_is_free(f.model, v))
                assert_int_equal(
                    pliant_solver_press(f.solver, (pliant_node){finest, v},
                                        (pliant_vec3){weights[k] * p.x, weights[k] * p.y,
                                                      weights[k] * p.z}),
                    PLIANT_OK);
    }
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_surface(f.solver, finest, sum), PLIANT_OK);
    double largest = 0, worst = 0;
    for (int32_t v = 0; v < vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            largest = fmax(largest, fabs(component(u[v], k)));
            worst = fmax(worst, fabs(component(u[v], k) - component(sum[v], k)));
        }
    check_at_most(worst, 2e-6 * largest);
    tear_down(&f);
}

static void a_vertex_has_one_condition_whatever_its_level(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    const pliant_vec3 u = {0, 0, -0.1f}, p = {0, 0, 1};
    pliant_vec3 before[vertex_count], after[vertex_count];
    assert_int_equal(pliant_solver_press(f.solver, (pliant_node){1, 3}, p), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_surface(f.solver, finest, before), PLIANT_OK);
    // Through other levels and kinds, and back: the same state to the rounding of sums.
    assert_int_equal(pliant_solver_press(f.solver, (pliant_node){2, 3}, p), PLIANT_OK);
    assert_int_equal(pliant_solver_press(f.solver, (pliant_node){0, 3}, p), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){0, 3}, u), PLIANT_OK);
    assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){2, 3}, u), PLIANT_OK);
    assert_int_equal(pliant_solver_constraint_count(f.solver), 1);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    check_near(pliant_solver_node_force(f.solver, (pliant_node){0, 3}).z, 0, 0);
    assert_true(pliant_solver_node_force(f.solver, (pliant_node){2, 3}).z < 0);
    assert_int_equal(pliant_solver_press(f.solver, (pliant_node){1, 3}, p), PLIANT_OK);
    assert_int_equal(pliant_solver_press(f.solver, (pliant_node){0, 3}, p), PLIANT_OK);
    assert_int_equal(pliant_solver_press(f.solver, (pliant_node){1, 3}, p), PLIANT_OK);
    assert_int_equal(pliant_solver_constraint_count(f.solver), 0);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_surface(f.solver, finest, after), PLIANT_OK);
    for (int32_t v = 0; v < vertex_count; v++)
        for (int k = 0; k < 3; k++)
            check_near(component(after[v], k), component(before[v], k), 1e-6);
    // Released by any of its levels, nothing is left.
    assert_int_equal(pliant_solver_release(f.solver, (pliant_node){2, 3}), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_surface(f.solver, finest, after), PLIANT_OK);
    for (int32_t v = 0; v < vertex_count; v++) check_near(after[v].z, 0, 1e-7);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hats_refine_and_their_areas_add_up),
        cmocka_unit_test(any_mix_of_levels_equals_the_dense_construction),
        cmocka_unit_test(a_coarse_load_is_its_finer_loads),
        cmocka_unit_test(a_vertex_has_one_condition_whatever_its_level),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
