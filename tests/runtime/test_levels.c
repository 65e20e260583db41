// test_levels.c: constraints and loads on hierarchical hats, mixed, against dense matrices; updates
// of capacitance inverses; compliance; deadlines.
#include "check.h"

#include "solver.h"
#include "synthetic_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

extern void dgesv_(const int *n, const int *nrhs, double *a, const int *lda, int *pivots, double *b,
                   const int *ldb, int *info);
extern void dsyev_(const char *job, const char *uplo, const int *n, double *a, const int *lda,
                   double *w, double *work, const int *work_count, int *info);

enum { finest = 2, vertex_count = 162 };

typedef struct fixture {
    check_synthetic *exact;
    pliant_model *model;
    pliant_solver *solver;
} fixture;

static fixture set_up(double eps, check_blocks blocks, pliant_solver_def def)
{
    fixture f;
    char path[64];
    pliant_error err = {""};
    const check_synthetic_def made = {finest, eps, pliant_wavelet_default(), blocks,
                                      (2u << finest) - 1};
    f.exact = check_synthetic_create(&made);
    snprintf(path, sizeof path, "/tmp/pliant_test_levels_%d.h5", (int)getpid());
    check_synthetic_write(f.exact, path);
    check_ok(pliant_model_open(path, &f.model, &err), &err);
    unlink(path);
    check_ok(pliant_solver_create(f.model, &def, &f.solver, &err), &err);
    return f;
}

static void tear_down(fixture *f)
{
    pliant_solver_destroy(f->solver);
    pliant_model_close(f->model);
    check_synthetic_destroy(f->exact);
}

static const pliant_solver_def roomy = {
    .constraint_capacity = 60, .load_capacity = 60, .cache_count = 4};

// A node on a random level that has the vertex.
static pliant_node random_node(check_random *random)
{
    const int32_t vertex = check_random_index(random, vertex_count);
    const int32_t first = vertex < 12 ? 0 : vertex < 42 ? 1 : 2;
    return (pliant_node){first + check_random_index(random, finest + 1 - first), vertex};
}

static pliant_vec3 random_vector(check_random *random, double size)
{
    float v[3];
    for (int c = 0; c < 3; c++) v[c] = (float)(size * (2 * check_random_next(random) - 1));
    return (pliant_vec3){v[0], v[1], v[2]};
}

static double component(pliant_vec3 v, int c)
{
    return c == 0 ? v.x : c == 1 ? v.y : v.z;
}

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

// ---- Updates ----

static void ten_thousand_updates_equal_factorisations(void **state)
{
    (void)state;
    const pliant_compliance rules[] = {PLIANT_COMPLIANCE_STORED, PLIANT_COMPLIANCE_PASSIVE};
    for (int r = 0; r < 2; r++) {
        fixture f = set_up(0.02, CHECK_ALL_BLOCKS, roomy);
        check_random random = check_random_seed(31);
        pliant_arena arena = {0};
        pliant_capacitance kept = {0}, fresh = {0};
        pliant_capacitance_scratch scratch = {0};
        pliant_error err = {""};
        enum { capacity = 40 };
        for (int pass = 0; pass < 2; pass++) {
            if (pass) check_ok(pliant_arena_reserve(&arena, &err), &err);
            pliant_capacitance_lay_out(&arena, f.model, capacity, &kept);
            pliant_capacitance_lay_out(&arena, f.model, capacity, &fresh);
            pliant_capacitance_scratch_lay_out(&arena, f.model, capacity, &scratch);
        }
        pliant_capacitance_scratch_begin(f.model, rules[r], &scratch);
        pliant_node set[capacity];
        int32_t count = 0, rebuilt = 0;
        double worst = 0, worst_residual = 0;
        pliant_capacitance_build(f.model, set, 0, &scratch, &kept);
        for (int step = 0; step < 10000; step++) {
            // Add, drop, or move to another level; ascending vertices.
            const pliant_node node = random_node(&random);
            int32_t at = 0;
            while (at < count && set[at].vertex < node.vertex) at++;
            if (at < count && set[at].vertex == node.vertex) {
                if (check_random_next(&random) < 0.5) set[at] = node;
                else memmove(set + at, set + at + 1, (size_t)(--count - at) * sizeof *set);
            } else if (count < capacity - 5 * check_random_next(&random)) {
                memmove(set + at + 1, set + at, (size_t)(count++ - at) * sizeof *set);
                set[at] = node;
            } else {
                const int32_t gone = check_random_index(&random, count);
                memmove(set + gone, set + gone + 1, (size_t)(--count - gone) * sizeof *set);
            }
            if (kept.status == PLIANT_OK && kept.shift == scratch.held_shift &&
                pliant_capacitance_update(f.model, set, count, &scratch, &kept)) {
                worst_residual = fmax(worst_residual, kept.residual);
            } else {
                pliant_capacitance_build(f.model, set, count, &scratch, &kept);
                rebuilt++;
            }
            assert_true(pliant_capacitance_matches(&kept, set, count));
            if (step % 20 != 0) continue;
            pliant_capacitance_build(f.model, set, count, &scratch, &fresh);
            if (kept.shift != fresh.shift) continue;
            double largest = 0, off = 0;
            for (int32_t i = 0; i < count; i++)
                for (int32_t j = 0; j < count; j++)
                    for (size_t c = 0; c < 9; c++) {
                        const int32_t ki = kept.order[i], kj = kept.order[j];
                        const double a = kept.product[3 * (size_t)ki + c % 3 +
                                                      (3 * (size_t)kj + c / 3) * kept.stride];
                        const double b = fresh.product[3 * (size_t)i + c % 3 +
                                                       (3 * (size_t)j + c / 3) * fresh.stride];
                        largest = fmax(largest, fabs(b));
                        off = fmax(off, fabs(a - b));
                    }
            if (largest > 0) worst = fmax(worst, off / largest);
        }
        print_message("%s: worst difference %.2g, worst residual %.2g, %d rebuilt\n",
                      r ? "passive" : "stored", worst, worst_residual, rebuilt);
        // The products are floats of doubles that agree to some 1e-12.
        check_at_most(worst, 2 * 0x1p-24);
        check_at_most(worst_residual, 1e-9);
        check_at_most(rebuilt, 2500);
        pliant_arena_release(&arena);
        tear_down(&f);
    }
}

static void an_inverse_that_drifted_is_made_again(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    const pliant_vec3 u = {0, 0, -0.1f};
    for (int32_t v = 60; v < 80; v++)
        if (pliant_model_is_free(f.model, v))
            assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){2, v}, u), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).factored, 1);
    // Sound: one node more is an update.
    pliant_node more[2] = {{2, 100}, {2, 0}};
    while (!pliant_model_is_free(f.model, more[0].vertex)) more[0].vertex++;
    more[1].vertex = more[0].vertex + 1;
    while (!pliant_model_is_free(f.model, more[1].vertex)) more[1].vertex++;
    assert_int_equal(pliant_solver_displace(f.solver, more[0], u), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).factored, 0);
    assert_int_equal(pliant_solver_last(f.solver).updated, 1);
    check_at_most(pliant_solver_last(f.solver).residual, 1e-12);
    // One element of every kept inverse off by a millionth: seen, and factored.
    for (int32_t t = 0; t < f.solver->cache_count; t++) f.solver->types[t].inverse[7] += 1e-6;
    assert_int_equal(pliant_solver_displace(f.solver, more[1], u), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).factored, 1);
    assert_true(pliant_solver_last(f.solver).residual > 1e-9);
    tear_down(&f);
}

// ---- Passive compliance ----

// The spring body is smooth: it takes this much to cost it definiteness.
static const double spoiling_eps = 0.9;

// Smallest eigenvalue of the symmetric part over the largest magnitude; largest skew over that.
static double smallest_eigenvalue(const double *matrix, int n, double *skew)
{
    double *half = calloc((size_t)n * n, sizeof *half), *w = calloc((size_t)n, sizeof *w);
    double *work = calloc((size_t)(8 * n), sizeof *work);
    int count = 8 * n, info = 0;
    double largest = 0;
    *skew = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            half[i + j * n] = (matrix[i * n + j] + matrix[j * n + i]) / 2;
            largest = fmax(largest, fabs(matrix[i * n + j]));
            *skew = fmax(*skew, fabs(matrix[i * n + j] - matrix[j * n + i]) / 2);
        }
    dsyev_("N", "L", &n, half, &n, w, work, &count, &info);
    assert_int_equal(info, 0);
    *skew /= largest;
    const double smallest = w[0] / largest;
    free(half), free(w), free(work);
    return smallest;
}

static void passive_compliance_is_symmetric_and_definite(void **state)
{
    (void)state;
    pliant_solver_def def = roomy;
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    fixture f = set_up(spoiling_eps, CHECK_FREE_BLOCK, def);
    check_random random = check_random_seed(41);
    static double matrix[9 * 40 * 40];
    double worst_stored = INFINITY, skew, worst_skew = 0;
    for (int round = 0; round < 30; round++) {
        pliant_node nodes[40];
        int32_t count = 0;
        uint8_t taken[vertex_count] = {0};
        const int32_t level = round % 3;  // 2: mixed
        while (count < 10 + round) {
            pliant_node node = random_node(&random);
            if (level < 2 && node.level != 2 - level) continue;
            if (!pliant_model_is_free(f.model, node.vertex) || taken[node.vertex]) {
                if (level == 1 && count >= 20) break;
                continue;
            }
            taken[node.vertex] = 1;
            nodes[count++] = node;
        }
        f.solver->scratch.compliance = PLIANT_COMPLIANCE_STORED;
        assert_int_equal(pliant_solver_compliance(f.solver, nodes, count, matrix), PLIANT_OK);
        worst_stored = fmin(worst_stored, smallest_eigenvalue(matrix, 3 * count, &skew));
        worst_skew = fmax(worst_skew, skew);
        f.solver->scratch.compliance = PLIANT_COMPLIANCE_PASSIVE;
        assert_int_equal(pliant_solver_compliance(f.solver, nodes, 0, matrix), PLIANT_OK);
        assert_int_equal(pliant_solver_compliance(f.solver, nodes, count, matrix), PLIANT_OK);
        check_at_least(smallest_eigenvalue(matrix, 3 * count, &skew), 0);
        check_at_most(skew, 1e-15);
    }
    // Without the measure it is neither: else this would prove nothing.
    print_message("stored: smallest eigenvalue %.3g, skew %.3g of the largest element\n",
                  worst_stored, worst_skew);
    check_at_most(worst_stored, -1e-4);
    check_at_least(worst_skew, 1e-2);
    tear_down(&f);
}

// Work of the tool on a closed path of displacements and constraint sets, relative to what went
// back and forth.
static double work_round_a_loop(fixture *f, int32_t level, double *scale)
{
    double work = 0, turned = 0;
    pliant_vec3 previous_u[vertex_count] = {{0, 0, 0}};
    static double previous_f[3 * vertex_count];
    memset(previous_f, 0, sizeof previous_f);
    pliant_solver_release_all(f->solver);
    pliant_node nodes[vertex_count];
    int32_t count = 0;
    for (int32_t v = 0; v < pliant_model_level_vertex_count(f->model, level) && count < 12; v++)
        if (pliant_model_is_free(f->model, v) && f->model->view.vertices[3 * v] > 0.3)
            nodes[count++] = (pliant_node){level, v};
    enum { steps = 400 };
    for (int step = 0; step <= 2 * steps; step++) {
        // Every node goes round an ellipse of its own phase; the second round is counted.
        for (int32_t i = 0; i < count; i++) {
            const double t = 6.283185307179586 * (step % steps) / steps + 2.4 * i;
            const pliant_vec3 u = {(float)(0.1 * cos(t)), (float)(0.1 * sin(t)),
                                   (float)(0.05 * sin(t + i))};
            assert_int_equal(pliant_solver_displace(f->solver, nodes[i], u), PLIANT_OK);
        }
        assert_true(pliant_solver_solve(f->solver, PLIANT_NEVER) >= 0);
        for (int32_t i = 0; i < count; i++) {
            const double t = 6.283185307179586 * (step % steps) / steps + 2.4 * i;
            const pliant_vec3 u = {(float)(0.1 * cos(t)), (float)(0.1 * sin(t)),
                                   (float)(0.05 * sin(t + i))};
            const pliant_vec3 force = pliant_solver_node_force(f->solver, nodes[i]);
            for (int k = 0; k < 3; k++) {
                const double d = component(u, k) - component(previous_u[i], k);
                const double part = d * (component(force, k) + previous_f[3 * i + k]) / 2;
                if (step > steps) work += part, turned += fabs(part);
                previous_f[3 * i + k] = component(force, k);
            }
            previous_u[i] = u;
        }
    }
    *scale = turned;
    return work / turned;
}

static void a_closed_loop_yields_work_as_stored_and_none_when_passive(void **state)
{
    (void)state;
    double gained[2];
    for (int r = 0; r < 2; r++) {
        pliant_solver_def def = roomy;
        def.compliance = r ? PLIANT_COMPLIANCE_PASSIVE : PLIANT_COMPLIANCE_STORED;
        fixture f = set_up(0.2, CHECK_FREE_BLOCK, def);
        double scale;
        gained[r] = work_round_a_loop(&f, finest, &scale);
        assert_true(scale > 0);
        tear_down(&f);
    }
    print_message("work of a closed loop, part of what was exchanged: stored %.3g, passive %.3g\n",
                  gained[0], gained[1]);
    check_at_least(fabs(gained[0]), 1e-3);
    // The trapezoidal rule is exact for linear forces on straight steps.
    check_at_most(fabs(gained[1]), 1e-6);
}

static void a_raise_stays_until_contact_ends(void **state)
{
    (void)state;
    pliant_solver_def def = roomy;
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    fixture f = set_up(spoiling_eps, CHECK_FREE_BLOCK, def);
    check_random random = check_random_seed(43);
    double shift = 0;
    int grown = 0;
    for (int step = 0; step < 400; step++) {
        const pliant_node node = random_node(&random);
        if (!pliant_model_is_free(f.model, node.vertex)) continue;
        const pliant_status status =
            check_random_next(&random) < 0.6
                ? pliant_solver_displace(f.solver, node, random_vector(&random, 0.1))
                : pliant_solver_release(f.solver, node);
        if (status == PLIANT_ERR_CAPACITY) pliant_solver_release_all(f.solver), shift = 0;
        // Passive is never rough.
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        if (pliant_solver_last(f.solver).constraint_count == 0) {
            shift = 0;
            continue;
        }
        check_at_least(pliant_solver_last(f.solver).shift, shift);
        grown += pliant_solver_last(f.solver).shift > shift;
        shift = pliant_solver_last(f.solver).shift;
    }
    check_at_least(grown, 1);
    pliant_solver_release_all(f.solver);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    // A lone node needs none.
    const pliant_node lone = {2, pliant_model_nearest(f.model, (const double[]){0, 0, 1})};
    assert_int_equal(pliant_solver_displace(f.solver, lone, (pliant_vec3){0, 0, 0.1f}), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    check_near(pliant_solver_last(f.solver).shift, 0, 0);
    tear_down(&f);
}

// ---- Compliance among nodes ----

static void compliance_is_what_unit_forces_do(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    const pliant_node nodes[] = {{2, 70}, {1, 5}, {2, 90}};
    const pliant_node held[] = {{2, 75}, {1, 20}, {0, 0}};
    for (int with = 0; with < 2; with++) {
        for (int h = 0; with && h < 3; h++)
            assert_int_equal(
                pliant_solver_displace(f.solver, held[h], (pliant_vec3){0.1f, 0, -0.1f}),
                PLIANT_OK);
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        const int32_t vertices[] = {70, 5, 90};
        pliant_vec3 rest[3], moved[3];
        double matrix[81], largest = 0, worst = 0;
        assert_int_equal(pliant_solver_displacements(f.solver, vertices, 3, rest), PLIANT_OK);
        assert_int_equal(pliant_solver_compliance(f.solver, nodes, 3, matrix), PLIANT_OK);
        for (int j = 0; j < 9; j++) {
            const float p = (float)(1 / pliant_model_node_area(f.model, nodes[j / 3]));
            const pliant_vec3 traction = {j % 3 == 0 ? p : 0, j % 3 == 1 ? p : 0,
                                          j % 3 == 2 ? p : 0};
            assert_int_equal(pliant_solver_press(f.solver, nodes[j / 3], traction), PLIANT_OK);
            assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
            assert_int_equal(pliant_solver_displacements(f.solver, vertices, 3, moved), PLIANT_OK);
            assert_int_equal(pliant_solver_release(f.solver, nodes[j / 3]), PLIANT_OK);
            for (int i = 0; i < 9; i++) {
                const double found = component(moved[i / 3], i % 3) - component(rest[i / 3], i % 3);
                largest = fmax(largest, fabs(found));
                worst = fmax(worst, fabs(found - matrix[9 * i + j]));
            }
        }
        check_at_most(worst, 1e-5 * largest);
    }
    // Refusals: nodes of S, fixed ones, too many.
    double matrix[9];
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_compliance(f.solver, &held[0], 1, matrix), PLIANT_ERR_ARGUMENT);
    const pliant_node fixed = {2, f.exact->nodes[1][0]};
    assert_int_equal(pliant_solver_compliance(f.solver, &fixed, 1, matrix), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_compliance(f.solver, nodes, 61, matrix), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_compliance(f.solver, nodes, -1, matrix), PLIANT_ERR_ARGUMENT);
    tear_down(&f);
}

// ---- Deadlines ----

static void without_time_the_constraints_are_resolved_on_coarser_levels(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    // A dense patch and one node far from it.
    int32_t stated = 0;
    const double *x = f.model->view.vertices;
    for (int32_t v = 0; v < vertex_count; v++)
        if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.4)
            assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){finest, v},
                                                    (pliant_vec3){-0.05f, 0, 0}),
                             PLIANT_OK),
                stated++;
    int32_t lone = 161;
    while (!pliant_model_is_free(f.model, lone) || x[3 * lone] > -0.5) lone--;
    const pliant_vec3 pulled = {-0.1f, 0, 0.02f};
    assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){finest, lone}, pulled),
                     PLIANT_OK);
    stated++;
    assert_int_equal(pliant_solver_solve(f.solver, pliant_clock_ns() - 1), PLIANT_LATE);
    pliant_solver_report report = pliant_solver_last(f.solver);
    assert_int_equal(report.is_late, 1);
    assert_int_equal(report.level, 0);
    assert_int_equal(report.asked_count, stated);
    check_at_most(report.constraint_count, stated / 4);
    assert_true(report.lateness_ns > 0);
    // A valid state: what is resolved is met; the lone node is not lost.
    pliant_vec3 u[vertex_count];
    assert_int_equal(pliant_solver_surface(f.solver, finest, u), PLIANT_OK);
    assert_memory_equal(&u[lone], &pulled, sizeof pulled);
    int32_t met = 0;
    for (int32_t v = 0; v < 12; v++)
        if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.4) met++, check_near(u[v].x, -0.05f, 0);
    check_at_least(met, 1);
    const double coarse_force = pliant_solver_contact_force(f.solver).x;
    // With time it is all there, and of like force.
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    report = pliant_solver_last(f.solver);
    assert_int_equal(report.is_late, 0);
    assert_int_equal(report.level, finest);
    assert_int_equal(report.constraint_count, stated);
    check_near(coarse_force / pliant_solver_contact_force(f.solver).x, 1, 0.3);
    // And the set that is kept now is in time at once.
    assert_int_equal(pliant_solver_solve(f.solver, pliant_clock_ns() + 50000000), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).factored, 0);
    tear_down(&f);
}

static void a_contact_that_rests_is_resolved_as_stated_after_some_solves(void **state)
{
    (void)state;
    for (int32_t cache = 1; cache <= 2; cache++)
        for (int rule = 0; rule < 2; rule++) {
            pliant_solver_def def = roomy;
            def.cache_count = cache;
            def.compliance = rule ? PLIANT_COMPLIANCE_PASSIVE : PLIANT_COMPLIANCE_STORED;
            fixture f = set_up(0, CHECK_FREE_BLOCK, def);
            const double *x = f.model->view.vertices;
            for (int32_t v = 0; v < vertex_count; v++)
                if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.1)
                    assert_true(pliant_solver_displace(f.solver, (pliant_node){finest, v},
                                                       (pliant_vec3){-0.05f, 0, 0}) <= 0);
            const double all =
                pliant_cost_of_build(&f.solver->cost, pliant_solver_constraint_count(f.solver));
            int late = 0;
            float prepared = 0;
            while (late < 1000) {
                const pliant_status status =
                    pliant_solver_solve(f.solver, pliant_clock_ns() + (int64_t)(0.5 * all));
                const pliant_solver_report report = pliant_solver_last(f.solver);
                if (!report.is_late) break;
                assert_int_equal(status, PLIANT_LATE);
                check_at_least(report.prepared, prepared);
                prepared = report.prepared;
                late++;
            }
            assert_in_range(late, 1, 999);
            assert_int_equal(pliant_solver_last(f.solver).level, finest);
            assert_int_equal(pliant_solver_last(f.solver).factored, 0);
            // As good as made in one piece.
            pliant_solver *other = NULL;
            check_ok(pliant_solver_create(f.model, &def, &other, NULL), NULL);
            for (int32_t v = 0; v < vertex_count; v++)
                if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.1)
                    assert_true(pliant_solver_displace(other, (pliant_node){finest, v},
                                                       (pliant_vec3){-0.05f, 0, 0}) <= 0);
            assert_int_equal(pliant_solver_solve(other, PLIANT_NEVER), PLIANT_OK);
            assert_int_equal(pliant_solver_last(other).factored, 1);
            const pliant_vec3 a = pliant_solver_contact_force(f.solver);
            const pliant_vec3 b = pliant_solver_contact_force(other);
            check_near(a.x / b.x, 1, 1e-5);
            pliant_solver_destroy(other);
            tear_down(&f);
        }
}

static void the_finest_level_that_fits_is_taken(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    const double *x = f.model->view.vertices;
    int32_t seen[finest + 1] = {0};
    for (int round = 0; round < 60; round++) {
        pliant_solver_release_all(f.solver);
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        for (int32_t t = 0; t < f.solver->cache_count; t++) f.solver->types[t].count = -1;
        for (int32_t v = 0; v < vertex_count; v++)
            if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.1)
                assert_true(pliant_solver_displace(f.solver, (pliant_node){finest, v},
                                                   (pliant_vec3){-0.05f, 0, 0}) <= 0);
        // Predicted for level 2: some hundreds of microseconds; 1: tens; 0: a few.
        const int32_t s = pliant_solver_constraint_count(f.solver);
        const double all = pliant_cost_of_build(&f.solver->cost, s);
        const int64_t given = (int64_t)(all * (round % 3 == 0 ? 4 : round % 3 == 1 ? 0.4 : 0.02));
        const pliant_status status = pliant_solver_solve(f.solver, pliant_clock_ns() + given);
        const pliant_solver_report report = pliant_solver_last(f.solver);
        assert_int_equal(status != PLIANT_OK, report.is_late || report.lateness_ns > 0);
        if (report.level > 0 && report.is_late) check_at_most((double)report.predicted_ns, (double)given);
        seen[report.level]++;
    }
    print_message("levels 0, 1, 2 taken %d, %d, %d times\n", seen[0], seen[1], seen[2]);
    for (int l = 0; l <= finest; l++) check_at_least(seen[l], 5);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hats_refine_and_their_areas_add_up),
        cmocka_unit_test(any_mix_of_levels_equals_the_dense_construction),
        cmocka_unit_test(a_coarse_load_is_its_finer_loads),
        cmocka_unit_test(a_vertex_has_one_condition_whatever_its_level),
        cmocka_unit_test(ten_thousand_updates_equal_factorisations),
        cmocka_unit_test(an_inverse_that_drifted_is_made_again),
        cmocka_unit_test(passive_compliance_is_symmetric_and_definite),
        cmocka_unit_test(a_closed_loop_yields_work_as_stored_and_none_when_passive),
        cmocka_unit_test(a_raise_stays_until_contact_ends),
        cmocka_unit_test(compliance_is_what_unit_forces_do),
        cmocka_unit_test(without_time_the_constraints_are_resolved_on_coarser_levels),
        cmocka_unit_test(a_contact_that_rests_is_resolved_as_stated_after_some_solves),
        cmocka_unit_test(the_finest_level_that_fits_is_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
