// test_compliance.c: the passive contact compliance, and compliance among chosen nodes.
#include "levels_fixture.h"

extern void dsyev_(const char *job, const char *uplo, const int *n, double *a, const int *lda,
                   double *w, double *work, const int *work_count, int *info);

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(passive_compliance_is_symmetric_and_definite),
        cmocka_unit_test(a_closed_loop_yields_work_as_stored_and_none_when_passive),
        cmocka_unit_test(a_raise_stays_until_contact_ends),
        cmocka_unit_test(compliance_is_what_unit_forces_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
