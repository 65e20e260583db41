// test_compare.c: --compare's exact answers are exact, and its figures are what they say.
#include "check.h"

#include "compare.h"
#include "synthetic_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// The synthetic body of 162 vertices: as it is in memory, its model file and its dense file.
typedef struct fixture {
    char folder[64], model_path[96], dense_path[96];
    check_synthetic *synthetic;
    pliant_model *model;
} fixture;

static fixture create(double eps, check_blocks blocks)
{
    fixture f;
    pliant_error err;
    strcpy(f.folder, "/tmp/pliant-compare-XXXXXX");
    assert_non_null(mkdtemp(f.folder));
    snprintf(f.model_path, sizeof f.model_path, "%s/model.h5", f.folder);
    snprintf(f.dense_path, sizeof f.dense_path, "%s/dense.h5", f.folder);
    const check_synthetic_def def = {
        .levels = 2,
        .eps = eps,
        .blocks = blocks,
        .wavelet = pliant_wavelet_default(),
        .level_mask = 7,
    };
    f.synthetic = check_synthetic_create(&def);
    check_synthetic_write(f.synthetic, f.model_path);
    check_synthetic_write_dense(f.synthetic, f.dense_path);
    check_ok(pliant_model_open(f.model_path, &f.model, &err), &err);
    return f;
}

static void destroy(fixture *f)
{
    pliant_model_close(f->model);
    check_synthetic_destroy(f->synthetic);
    unlink(f->model_path);
    unlink(f->dense_path);
    rmdir(f->folder);
}

static pliant_player *create_player(const fixture *f)
{
    pliant_error err;
    pliant_player *player;
    const pliant_player_def def = pliant_player_default(f->model);
    check_ok(pliant_player_create(f->model, &def, &player, &err), &err);
    return player;
}

static void execute(pliant_player *player, pliant_statement_kind kind, int32_t vertex, double x,
                    double y, double z)
{
    pliant_error err;
    const pliant_statement statement = {
        .kind = kind,
        .vertex = {.kind = PLIANT_VERTEX_MODEL, .number = vertex},
        .value = {x, y, z},
        .count = 1,
    };
    check_ok(pliant_player_execute(player, &statement, NULL, &err), &err);
}

static void specify(check_problem *problem, int32_t vertex, int is_displaced, const float *value)
{
    problem->is_displaced[vertex] = (uint8_t)is_displaced;
    for (int c = 0; c < 3; c++) problem->value[3 * (size_t)vertex + (size_t)c] = (double)value[c];
}

// Random displacements, tractions, supports, freed vertices and gravity: the comparison's exact
// answer is that of the stiffness matrix, which knows nothing of Green's functions.
static void exact_answers_are_those_of_the_stiffness_matrix(void **state)
{
    (void)state;
    fixture f = create(0, CHECK_ALL_BLOCKS);
    const check_synthetic *s = f.synthetic;
    const int32_t n = s->surface.mesh->vertex_count;
    check_random random = check_random_seed(21);
    pliant_error err;
    double *u = calloc(3 * (size_t)n, sizeof *u), *p = calloc(3 * (size_t)n, sizeof *p);
    for (int trial = 0; trial < 8; trial++) {
        pliant_player *player = create_player(&f);
        pliant_compare *compare;
        check_ok(pliant_compare_open(f.dense_path, f.model, &compare, &err), &err);
        check_problem problem = check_problem_create(s);
        const int count = 1 << trial % 5;
        double force[3] = {0};
        int32_t displaced[16], displaced_count = 0;
        for (int i = 0; i < count; i++) {
            const int32_t v = s->nodes[0][check_random_index(&random, s->counts[0])];
            const int32_t w = s->nodes[0][check_random_index(&random, s->counts[0])];
            const int32_t h = s->nodes[1][check_random_index(&random, s->counts[1])];
            float value[3];
            for (int c = 0; c < 3; c++) value[c] = (float)(check_random_next(&random) - 0.5);
            execute(player, PLIANT_STATEMENT_TRACTION, w, value[0], value[1], value[2]);
            specify(&problem, w, 0, value);
            execute(player, PLIANT_STATEMENT_DISPLACE, v, value[1], value[2], value[0]);
            const float turned[3] = {value[1], value[2], value[0]};
            specify(&problem, v, 1, turned);
            // Every other time the fixed vertex is moved or freed.
            if (i % 2 == 0) {
                execute(player, PLIANT_STATEMENT_SUPPORT, h, value[0], value[1], value[2]);
                specify(&problem, h, 1, value);
            } else {
                execute(player, PLIANT_STATEMENT_TRACTION, h, value[0], value[1], value[2]);
                specify(&problem, h, 0, value);
            }
        }
        for (int32_t i = 0; i < s->counts[0]; i++)
            if (problem.is_displaced[s->nodes[0][i]]) displaced[displaced_count++] = s->nodes[0][i];
        if (trial > 3) {
            const float g[3] = {0.5f, -0.25f, -2};
            execute(player, PLIANT_STATEMENT_GRAVITY, 0, g[0], g[1], g[2]);
            for (int c = 0; c < 3; c++) problem.gravity[c] = (double)g[c];
        }
        execute(player, PLIANT_STATEMENT_STEP, 0, 0, 0, 0);
        check_ok(pliant_compare_add(compare, player, &err), &err);
        check_synthetic_solve(s, &problem, u, p);

        double largest = 0, difference = 0;
        const double *exact = pliant_compare_exact(compare);
        for (int32_t i = 0; i < 3 * n; i++) {
            largest = fmax(largest, fabs(u[i]));
            difference = fmax(difference, fabs(exact[i] - u[i]));
        }
        // Double round-off times the condition of the system, about 1e4 here.
        check_at_most(difference, 1e-11 * largest);
        for (int32_t i = 0; i < displaced_count; i++)
            for (int c = 0; c < 3; c++)
                force[c] += s->surface.areas[displaced[i]] * p[3 * displaced[i] + c];
        // And so the played step, from the same columns as floats, is off by float round-off times
        // the condition of C. That the figures are this small proves the force as well.
        const pliant_compare_summary summary = pliant_compare_result(compare);
        assert_int_equal(summary.step_count, 1);
        check_at_most(summary.rms, 1e-4);
        check_at_most(summary.max_worst, 1e-4);
        check_at_most(summary.force_worst, 1e-3);
        const pliant_vec3 played = pliant_player_last(player)->force;
        const double size = sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
        check_near(played.x, force[0], 1e-3 * size);
        check_near(played.y, force[1], 1e-3 * size);
        check_near(played.z, force[2], 1e-3 * size);
        check_problem_destroy(&problem);
        pliant_compare_close(compare);
        pliant_player_destroy(player);
    }
    free(u);
    free(p);
    destroy(&f);
}

// ---- Mixed levels ----

// A node's hat at all vertices, from the definition (GF-53).
static void make_hat(const check_synthetic *s, pliant_node node, double *hat)
{
    const pliant_hierarchy *h = s->hierarchy;
    const int32_t n = s->surface.mesh->vertex_count;
    memset(hat, 0, (size_t)n * sizeof *hat);
    hat[node.vertex] = 1;
    for (int32_t v = h->vertex_count[node.level]; v < n; v++) {
        const int32_t *parents = h->stencils[v - h->vertex_count[0]].parents;
        int same_domain = 0;
        for (int d = 0; d < 2; d++) {
            int both = 0;
            for (int32_t i = 0; i < s->counts[d]; i++)
                both += s->nodes[d][i] == v || s->nodes[d][i] == node.vertex;
            same_domain |= both == 2;
        }
        if (same_domain) hat[v] = (hat[parents[0]] + hat[parents[1]]) / 2;
    }
}

// Add what a value of reference type on a node's hat does, by the stiffness matrix: the unknowns v
// (displacements of free nodes, tractions of fixed ones) and the displacements u, shape [n][3].
static void add_response(const check_synthetic *s, pliant_node node, const double value[3],
                         double *v, double *u)
{
    const int32_t n = s->surface.mesh->vertex_count;
    double *hat = calloc((size_t)n, sizeof *hat), *w = calloc(6 * (size_t)n, sizeof *w);
    double *p = w + 3 * (size_t)n;
    check_problem problem = check_problem_create(s);
    make_hat(s, node, hat);
    for (int32_t i = 0; i < 3 * n; i++) problem.value[i] = hat[i / 3] * value[i % 3];
    check_synthetic_solve(s, &problem, w, p);
    for (int32_t i = 0; i < 3 * n; i++) {
        v[i] += problem.is_displaced[i / 3] ? p[i] : w[i];
        u[i] += w[i];
    }
    check_problem_destroy(&problem);
    free(hat);
    free(w);
}

typedef struct stated {
    pliant_node node;
    int is_changed, is_displaced;
    float value[3];
} stated;

// What GF-68, 69 say of nodes that act through hats, by superposition of the stiffness matrix's
// answers: v at the changed nodes' vertices is what they specify.
static void solve_stated(const check_synthetic *s, const stated *list, int count, double *u,
                         double force[3])
{
    extern void dgesv_(const int *n, const int *nrhs, double *a, const int *lda, int *pivots,
                       double *b, const int *ldb, int *info);
    const int32_t n = s->surface.mesh->vertex_count;
    const size_t size = 3 * (size_t)n;
    int changed[16], changed_count = 0, pivots[48], info;
    double matrix[48 * 48], x[48];
    double *v = calloc(size, sizeof *v), *unused = calloc(size, sizeof *unused);
    memset(u, 0, size * sizeof *u);
    for (int i = 0; i < count; i++) {
        if (list[i].is_changed) {
            changed[changed_count++] = i;
            continue;
        }
        const double value[3] = {(double)list[i].value[0], (double)list[i].value[1],
                                 (double)list[i].value[2]};
        add_response(s, list[i].node, value, v, u);
    }
    const int rows = 3 * changed_count;
    for (int j = 0; j < rows; j++) {
        double unit[3] = {0};
        unit[j % 3] = 1;
        double *column = calloc(size, sizeof *column);
        add_response(s, list[changed[j / 3]].node, unit, column, unused);
        for (int i = 0; i < rows; i++)
            matrix[i + rows * j] = column[3 * list[changed[i / 3]].node.vertex + i % 3];
        x[j] = (double)list[changed[j / 3]].value[j % 3] -
               v[3 * list[changed[j / 3]].node.vertex + j % 3];
        free(column);
    }
    dgesv_(&rows, &(int){1}, matrix, &rows, pivots, x, &rows, &info);
    assert_int_equal(info, 0);
    double *hat = calloc((size_t)n, sizeof *hat);
    for (int c = 0; c < 3; c++) force[c] = 0;
    for (int j = 0; j < changed_count; j++) {
        add_response(s, list[changed[j]].node, x + 3 * j, v, u);
        if (!list[changed[j]].is_displaced) continue;
        make_hat(s, list[changed[j]].node, hat);
        for (int32_t i = 0; i < 3 * n; i++)
            force[i % 3] += s->surface.areas[i / 3] * hat[i / 3] * x[3 * j + i % 3];
    }
    free(hat);
    free(v);
    free(unused);
}

static void nodes_of_mixed_levels_act_through_their_hats(void **state)
{
    (void)state;
    fixture f = create(0, CHECK_ALL_BLOCKS);
    const check_synthetic *s = f.synthetic;
    const int32_t n = s->surface.mesh->vertex_count;
    check_random random = check_random_seed(33);
    pliant_error err;
    double *u = calloc(3 * (size_t)n, sizeof *u);
    static const pliant_statement_kind kinds[] = {
        PLIANT_STATEMENT_DISPLACE, PLIANT_STATEMENT_TRACTION, PLIANT_STATEMENT_SUPPORT,
        PLIANT_STATEMENT_TRACTION};
    for (int trial = 0; trial < 6; trial++) {
        pliant_player *player = create_player(&f);
        pliant_compare *compare;
        check_ok(pliant_compare_open(f.dense_path, f.model, &compare, &err), &err);
        stated list[12];
        int count = 0;
        for (int i = 0; i < 12; i++) {
            const int kind = i % 4, domain = kind >= 2;  // displaced, loaded, supported, freed
            const int32_t level = check_random_index(&random, 3);
            const int32_t limit = s->wavelets[domain]->level_offset[level + 1];
            if (limit == 0) continue;
            stated *one = &list[count];
            *one = (stated){.node = {level, s->nodes[domain][check_random_index(&random, limit)]},
                            .is_changed = kind == 0 || kind == 3,
                            .is_displaced = kind == 0};
            int known = 0;
            for (int j = 0; j < count; j++) known |= list[j].node.vertex == one->node.vertex;
            if (known) continue;
            for (int c = 0; c < 3; c++) one->value[c] = (float)(check_random_next(&random) - 0.5);
            const pliant_statement statement = {
                .kind = kinds[kind],
                .vertex = {.kind = PLIANT_VERTEX_MODEL,
                           .has_level = 1,
                           .level = level,
                           .number = one->node.vertex},
                .value = {(double)one->value[0], (double)one->value[1], (double)one->value[2]},
            };
            check_ok(pliant_player_execute(player, &statement, NULL, &err), &err);
            count++;
        }
        execute(player, PLIANT_STATEMENT_STEP, 0, 0, 0, 0);
        check_ok(pliant_compare_add(compare, player, &err), &err);
        double force[3], largest = 0, difference = 0;
        solve_stated(s, list, count, u, force);
        const double *exact = pliant_compare_exact(compare);
        for (int32_t i = 0; i < 3 * n; i++) {
            largest = fmax(largest, fabs(u[i]));
            difference = fmax(difference, fabs(exact[i] - u[i]));
        }
        // Double round-off times the condition of the system, about 1e4 here.
        check_at_most(difference, 1e-10 * largest);
        // The played step, from float columns of the hats themselves: round-off times the
        // condition of C. This compares its force with the exact one as well.
        const pliant_compare_summary summary = pliant_compare_result(compare);
        check_at_most(summary.rms, 1e-4);
        check_at_most(summary.max_worst, 1e-4);
        check_at_most(summary.force_worst, 1e-3);
        const pliant_vec3 played = pliant_player_last(player)->force;
        const double length = sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
        check_near(played.x, force[0], 1e-3 * length);
        check_near(played.y, force[1], 1e-3 * length);
        check_near(played.z, force[2], 1e-3 * length);
        pliant_compare_close(compare);
        pliant_player_destroy(player);
    }
    free(u);
    destroy(&f);
}

static void a_vertex_that_changes_level_has_another_column(void **state)
{
    (void)state;
    fixture f = create(0, CHECK_ALL_BLOCKS);
    const int32_t n = f.synthetic->surface.mesh->vertex_count;
    pliant_error err;
    pliant_compare *kept, *fresh;
    pliant_player *player = create_player(&f);
    double *previous = calloc(3 * (size_t)n, sizeof *previous);
    check_ok(pliant_compare_open(f.dense_path, f.model, &kept, &err), &err);
    for (int i = 0; i < 6; i++) {
        const pliant_statement statement = {
            .kind = PLIANT_STATEMENT_TRACTION,
            .vertex = {.kind = PLIANT_VERTEX_MODEL,
                       .has_level = 1,
                       .level = i % 3,
                       .number = f.synthetic->nodes[0][2]},
            .value = {0, 0, 1},
        };
        check_ok(pliant_player_execute(player, &statement, NULL, &err), &err);
        execute(player, PLIANT_STATEMENT_STEP, 0, 0, 0, 0);
        check_ok(pliant_compare_open(f.dense_path, f.model, &fresh, &err), &err);
        check_ok(pliant_compare_add(kept, player, &err), &err);
        check_ok(pliant_compare_add(fresh, player, &err), &err);
        const double *exact = pliant_compare_exact(kept);
        const size_t size = 3 * (size_t)n * sizeof *exact;
        assert_memory_equal(exact, pliant_compare_exact(fresh), size);
        assert_true(memcmp(exact, previous, size) != 0);
        memcpy(previous, exact, size);
        pliant_compare_close(fresh);
    }
    free(previous);
    pliant_compare_close(kept);
    pliant_player_destroy(player);
    destroy(&f);
}

// One vertex at a time, all of them twice, so that gathered columns are replaced and read again.
static void one_unit_value_gives_one_column_of_the_dense_file(void **state)
{
    (void)state;
    fixture f = create(0, CHECK_ALL_BLOCKS);
    const check_synthetic *s = f.synthetic;
    const size_t m = (size_t)s->counts[0];
    pliant_error err;
    pliant_compare *compare;
    pliant_player *player = create_player(&f);
    check_ok(pliant_compare_open(f.dense_path, f.model, &compare, &err), &err);
    const double *exact = pliant_compare_exact(compare);
    for (int round = 0; round < 2; round++)
        for (int domain = 0; domain < 2; domain++)
            for (int32_t j = 0; j < s->counts[domain]; j++) {
                const int32_t vertex = s->nodes[domain][j];
                const double *xi = s->xi[domain == 0 ? PLIANT_FREE_FREE : PLIANT_FREE_FIXED];
                const size_t width = 3 * (size_t)s->counts[domain];
                execute(player, domain == 0 ? PLIANT_STATEMENT_TRACTION : PLIANT_STATEMENT_SUPPORT,
                        vertex, 0, 0, 1);
                execute(player, PLIANT_STATEMENT_STEP, 0, 0, 0, 0);
                check_ok(pliant_compare_add(compare, player, &err), &err);
                for (size_t i = 0; i < m; i++)
                    for (size_t r = 0; r < 3; r++)
                        check_near(exact[3 * (size_t)s->nodes[0][i] + r],
                                   xi[(3 * i + r) * width + 3 * (size_t)j + 2], 0);
                execute(player, PLIANT_STATEMENT_RELEASE, vertex, 0, 0, 0);
            }
    pliant_compare_close(compare);
    pliant_player_destroy(player);
    destroy(&f);
}

// The figures, computed again from the surface and the exact answer.
static void figures_are_relative_norms_and_the_worst_step_is_named(void **state)
{
    (void)state;
    fixture f = create(0.2, CHECK_ALL_BLOCKS);
    const int32_t n = f.synthetic->surface.mesh->vertex_count;
    pliant_error err;
    pliant_compare *compare;
    pliant_player *player = create_player(&f);
    check_ok(pliant_compare_open(f.dense_path, f.model, &compare, &err), &err);
    double square = 0, exact_square = 0, rms_worst = 0, max_worst = 0;
    int rms_step = 0, max_step = 0;
    for (int step = 1; step <= 12; step++) {
        const int32_t v = f.synthetic->nodes[0][(13 * step) % f.synthetic->counts[0]];
        execute(player, PLIANT_STATEMENT_DISPLACE, v, 0.1, 0, -0.2);
        if (step % 4 == 0) execute(player, PLIANT_STATEMENT_RELEASE, v, 0, 0, 0);
        execute(player, PLIANT_STATEMENT_STEP, 0, 0, 0, 0);
        check_ok(pliant_compare_add(compare, player, &err), &err);
        const double *exact = pliant_compare_exact(compare);
        const pliant_vec3 *u = pliant_player_surface(player);
        double d2 = 0, u2 = 0, dm = 0, um = 0;
        for (int32_t i = 0; i < n; i++) {
            const double dx = u[i].x - exact[3 * i], dy = u[i].y - exact[3 * i + 1],
                         dz = u[i].z - exact[3 * i + 2];
            const double d = dx * dx + dy * dy + dz * dz;
            const double e = exact[3 * i] * exact[3 * i] + exact[3 * i + 1] * exact[3 * i + 1] +
                             exact[3 * i + 2] * exact[3 * i + 2];
            d2 += d, u2 += e;
            dm = fmax(dm, d), um = fmax(um, e);
        }
        square += d2, exact_square += u2;
        if (sqrt(d2 / u2) > rms_worst) rms_worst = sqrt(d2 / u2), rms_step = step;
        if (sqrt(dm / um) > max_worst) max_worst = sqrt(dm / um), max_step = step;
    }
    const pliant_compare_summary summary = pliant_compare_result(compare);
    assert_int_equal(summary.step_count, 12);
    check_near(summary.rms, sqrt(square / exact_square), 1e-12);
    check_near(summary.rms_worst, rms_worst, 1e-12);
    check_near(summary.max_worst, max_worst, 1e-12);
    assert_int_equal(summary.rms_step, rms_step);
    assert_int_equal(summary.max_step, max_step);
    // Compressed this much, it is not exact: the comparison sees something.
    check_at_least(summary.rms, 1e-4);
    pliant_compare_close(compare);
    pliant_player_destroy(player);
    destroy(&f);
}

static void nothing_against_nothing_is_no_difference(void **state)
{
    (void)state;
    fixture f = create(0.2, CHECK_FREE_BLOCK);
    pliant_error err;
    pliant_compare *compare;
    pliant_player *player = create_player(&f);
    check_ok(pliant_compare_open(f.dense_path, f.model, &compare, &err), &err);
    execute(player, PLIANT_STATEMENT_STEP, 0, 0, 0, 0);
    check_ok(pliant_compare_add(compare, player, &err), &err);
    const pliant_compare_summary summary = pliant_compare_result(compare);
    check_near(summary.rms, 0, 0);
    check_near(summary.max_worst, 0, 0);
    check_near(summary.force_worst, 0, 0);
    pliant_compare_close(compare);
    pliant_player_destroy(player);
    destroy(&f);
}

static void a_dense_file_without_supports_refuses_a_moved_support(void **state)
{
    (void)state;
    fixture f = create(0, CHECK_ALL_BLOCKS), bare = create(0, CHECK_FREE_BLOCK);
    pliant_error err;
    char expected[256];
    pliant_compare *compare;
    pliant_player *player = create_player(&f);
    check_ok(pliant_compare_open(bare.dense_path, f.model, &compare, &err), &err);
    execute(player, PLIANT_STATEMENT_DISPLACE, f.synthetic->nodes[0][3], 0, 0, 1);
    execute(player, PLIANT_STATEMENT_STEP, 0, 0, 0, 0);
    check_ok(pliant_compare_add(compare, player, &err), &err);
    execute(player, PLIANT_STATEMENT_SUPPORT, f.synthetic->nodes[1][2], 0, 0, 1);
    execute(player, PLIANT_STATEMENT_STEP, 0, 0, 0, 0);
    assert_int_equal(pliant_compare_add(compare, player, &err), PLIANT_ERR_MISSING);
    snprintf(expected, sizeof expected,
             "%s: step 2 changes the fixed vertex %d: expected a dense file with /dense/free-fixed "
             "(--blocks all)",
             bare.dense_path, (int)f.synthetic->nodes[1][2]);
    assert_string_equal(err.text, expected);
    pliant_compare_close(compare);
    pliant_player_destroy(player);
    destroy(&f);
    destroy(&bare);
}

static void another_models_dense_file_is_refused(void **state)
{
    (void)state;
    fixture f = create(0, CHECK_FREE_BLOCK);
    char path[128];
    pliant_error err;
    pliant_compare *compare = NULL;
    snprintf(path, sizeof path, "%s/other.h5", f.folder);
    char dense[128];
    snprintf(dense, sizeof dense, "%s/other-dense.h5", f.folder);
    check_write_synthetic_model(path, dense, 1, 0, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    assert_int_equal(pliant_compare_open(dense, f.model, &compare, &err), PLIANT_ERR_MISSING);
    assert_non_null(strstr(err.text, "other-dense.h5:/dense/nodes: expected the model's"));
    // A model is no dense file.
    assert_int_equal(pliant_compare_open(f.model_path, f.model, &compare, &err),
                     PLIANT_ERR_MISSING);
    assert_null(compare);
    unlink(path);
    unlink(dense);
    destroy(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_answers_are_those_of_the_stiffness_matrix),
        cmocka_unit_test(nodes_of_mixed_levels_act_through_their_hats),
        cmocka_unit_test(a_vertex_that_changes_level_has_another_column),
        cmocka_unit_test(one_unit_value_gives_one_column_of_the_dense_file),
        cmocka_unit_test(figures_are_relative_norms_and_the_worst_step_is_named),
        cmocka_unit_test(nothing_against_nothing_is_no_difference),
        cmocka_unit_test(a_dense_file_without_supports_refuses_a_moved_support),
        cmocka_unit_test(another_models_dense_file_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
