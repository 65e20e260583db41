// test_solver.c: the capacitance matrix algorithm on files, against direct and dense solves.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// ---- A model, its file and a solver ----

typedef struct fixture {
    check_synthetic *exact;
    char path[64];
    pliant_model *model;
    pliant_solver *solver;
    int32_t n, finest;
} fixture;

static fixture set_up(int32_t levels, double eps, pliant_wavelet_def wavelet, check_blocks blocks,
                      pliant_solver_def def)
{
    fixture f = {.finest = levels};
    pliant_error err = {""};
    f.exact = check_synthetic_create(&(check_synthetic_def){levels, eps, wavelet, blocks, 0});
    snprintf(f.path, sizeof f.path, "/tmp/pliant_test_solver_%d.h5", (int)getpid());
    check_synthetic_write(f.exact, f.path);
    check_ok(pliant_model_open(f.path, &f.model, &err), &err);
    unlink(f.path);  // the mapping stays; nothing is left behind when a case fails
    check_ok(pliant_solver_create(f.model, &def, &f.solver, &err), &err);
    f.n = f.exact->surface.mesh->vertex_count;
    return f;
}

static void tear_down(fixture *f)
{
    pliant_solver_destroy(f->solver);
    pliant_model_close(f->model);
    check_synthetic_destroy(f->exact);
}

static const pliant_solver_def roomy = {
    .constraint_capacity = 64, .load_capacity = 64, .cache_count = 3};

static pliant_node node_of(const fixture *f, int32_t vertex)
{
    return (pliant_node){f->finest, vertex};
}

static pliant_vec3 random_vector(check_random *random, double size)
{
    pliant_vec3 v;
    v.x = (float)(size * (2 * check_random_next(random) - 1));
    v.y = (float)(size * (2 * check_random_next(random) - 1));
    v.z = (float)(size * (2 * check_random_next(random) - 1));
    return v;
}

static pliant_vec3 vector_at(const double *values, int32_t vertex)
{
    const double *from = values + 3 * (size_t)vertex;
    return (pliant_vec3){(float)from[0], (float)from[1], (float)from[2]};
}

static void put_vector(double *values, int32_t vertex, pliant_vec3 v)
{
    double *to = values + 3 * (size_t)vertex;
    to[0] = v.x, to[1] = v.y, to[2] = v.z;
}

// State one boundary value problem to both sides.
static void specify(fixture *f, check_problem *problem, int32_t vertex, int32_t displaced,
                    pliant_vec3 value)
{
    const pliant_node node = node_of(f, vertex);
    const int32_t is_free = pliant_model_is_free(f->model, vertex);
    pliant_status status = !displaced ? pliant_solver_press(f->solver, node, value)
                           : is_free  ? pliant_solver_displace(f->solver, node, value)
                                      : pliant_solver_support(f->solver, node, value);
    assert_int_equal(status, PLIANT_OK);
    problem->is_displaced[vertex] = (uint8_t)displaced;
    put_vector(problem->value, vertex, value);
}

enum { with_displaced = 1, with_pressed = 2, with_supports = 4, with_freed = 8, with_gravity = 16 };

// Sizes of random values such that each kind of load moves the surface by about as much: the
// sphere's compliance is about 1 / (E R) and its area 4 pi.
static void specify_random(fixture *f, check_problem *problem, check_random *random, int32_t kinds,
                           int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        const int32_t v = check_random_index(random, f->n);
        const int32_t is_free = pliant_model_is_free(f->model, v);
        const int32_t displace = check_random_next(random) < 0.5;
        if (is_free && displace && kinds & with_displaced)
            specify(f, problem, v, 1, random_vector(random, 0.1));
        if (is_free && !displace && kinds & with_pressed)
            specify(f, problem, v, 0, random_vector(random, 1));
        if (!is_free && displace && kinds & with_supports)
            specify(f, problem, v, 1, random_vector(random, 0.1));
        if (!is_free && !displace && kinds & with_freed)
            specify(f, problem, v, 0, random_vector(random, 1));
    }
    if (kinds & with_gravity) {
        const pliant_vec3 g = random_vector(random, 0.1);
        assert_int_equal(pliant_solver_gravity(f->solver, g), PLIANT_OK);
        problem->gravity[0] = g.x, problem->gravity[1] = g.y, problem->gravity[2] = g.z;
    }
}

static double largest(const double *values, int32_t count)
{
    double most = 0;
    for (int32_t i = 0; i < count; i++) most = fmax(most, fabs(values[i]));
    return most;
}

static double largest_difference(const pliant_vec3 *found, const double *expected, int32_t vertices)
{
    double most = 0;
    for (int32_t v = 0; v < vertices; v++) {
        const double d[3] = {found[v].x - expected[3 * (size_t)v],
                             found[v].y - expected[3 * (size_t)v + 1],
                             found[v].z - expected[3 * (size_t)v + 2]};
        for (int c = 0; c < 3; c++) most = isfinite(d[c]) ? fmax(most, fabs(d[c])) : INFINITY;
    }
    return most;
}

// Solve with the library and compare displacements and tractions of all vertices, relative to the
// largest of each.
static void compare(fixture *f, const double *u, const double *p, double u_tolerance,
                    double p_tolerance)
{
    pliant_vec3 *found = calloc((size_t)f->n, sizeof *found);
    assert_non_null(found);
    assert_int_equal(pliant_solver_solve(f->solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_surface(f->solver, f->finest, found), PLIANT_OK);
    check_at_most(largest_difference(found, u, f->n) / fmax(largest(u, 3 * f->n), 1e-30),
                  u_tolerance);
    if (p) {
        assert_int_equal(pliant_solver_tractions(f->solver, NULL, f->n, found), PLIANT_OK);
        check_at_most(largest_difference(found, p, f->n) / fmax(largest(p, 3 * f->n), 1e-30),
                      p_tolerance);
    }
    free(found);
}

// ---- Against a direct solve of the changed problem ----

// Stored coefficients are floats, u = 2^-24 = 6e-8, and a value is the sum of some hundred products
// of them whose roundings are independent: 10 u of the largest. C inherits that, relative to its
// diagonal, and C^-1 magnifies it by the condition of C, some ten for scattered nodes of this
// sphere (a node's neighbours move a third as much as itself): 100 u = 6e-6 for tractions.
// Displacements are C's image of those and lose the factor again: 30 u = 2e-6.
static const double u_tolerance = 30 * 0x1p-24, p_tolerance = 100 * 0x1p-24;

static void check_against_direct(pliant_wavelet_def wavelet, int32_t levels, int32_t kinds,
                                 uint64_t seed)
{
    fixture f = set_up(levels, 0, wavelet, CHECK_ALL_BLOCKS, roomy);
    check_random random = check_random_seed(seed);
    double *u = calloc(3 * (size_t)f.n, sizeof *u), *p = calloc(3 * (size_t)f.n, sizeof *p);
    for (int round = 0; round < 4; round++) {
        check_problem problem = check_problem_create(f.exact);
        pliant_solver_release_all(f.solver);
        specify_random(&f, &problem, &random, kinds, 4 << round);
        check_synthetic_solve(f.exact, &problem, u, p);
        compare(&f, u, p, u_tolerance, p_tolerance);
        check_problem_destroy(&problem);
    }
    free(u);
    free(p);
    tear_down(&f);
}

static void displaced_vertices_equal_a_direct_solve(void **state)
{
    (void)state;
    check_against_direct(pliant_wavelet_default(), 2, with_displaced, 1);
}

static void displaced_and_pressed_vertices_equal_a_direct_solve(void **state)
{
    (void)state;
    check_against_direct(pliant_wavelet_default(), 2, with_displaced | with_pressed, 2);
}

static void supports_and_gravity_equal_a_direct_solve(void **state)
{
    (void)state;
    check_against_direct(pliant_wavelet_default(), 2,
                         with_displaced | with_pressed | with_supports | with_gravity, 3);
}

static void freed_supports_equal_a_direct_solve(void **state)
{
    (void)state;
    check_against_direct(pliant_wavelet_default(), 2,
                         with_displaced | with_pressed | with_supports | with_freed | with_gravity,
                         4);
}

static void every_wavelet_equals_a_direct_solve(void **state)
{
    (void)state;
    for (int32_t kind = 0; kind < 8; kind++)
        check_against_direct((pliant_wavelet_def){(pliant_wavelet_scheme)(kind & 1),
                                                  (pliant_wavelet_lifting)(kind >> 1 & 1),
                                                  (pliant_wavelet_boundary)(kind >> 2)},
                             kind == 1 ? 3 : 1 + kind % 2,
                             with_displaced | with_pressed | with_freed | with_gravity,
                             10 + (uint64_t)kind);
}

// ---- Against the same algorithm on the thresholded matrices ----

static void thresholded_columns_equal_the_dense_algorithm_on_what_is_stored(void **state)
{
    (void)state;
    fixture f = set_up(2, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS, roomy);
    check_at_least(f.exact->compressed[PLIANT_FREE_FREE].summary[PLIANT_SUMMARY_FACTOR], 1.5);
    check_random random = check_random_seed(5);
    double *u = calloc(3 * (size_t)f.n, sizeof *u), *p = calloc(3 * (size_t)f.n, sizeof *p);
    double *u_exact = calloc(3 * (size_t)f.n, sizeof *u),
           *p_exact = calloc(3 * (size_t)f.n, sizeof *p);
    check_synthetic_round(f.exact);
    for (int round = 0; round < 4; round++) {
        check_problem problem = check_problem_create(f.exact);
        pliant_solver_release_all(f.solver);
        specify_random(&f, &problem, &random, 31, 4 << round);
        check_synthetic_solve_dense(f.exact, &problem, u, p);
        compare(&f, u, p, u_tolerance, p_tolerance);
        // And it is a different problem from the exact one: the comparison means something.
        check_synthetic_solve(f.exact, &problem, u_exact, p_exact);
        double most = 0;
        for (int32_t k = 0; k < 3 * f.n; k++) most = fmax(most, fabs(u[k] - u_exact[k]));
        check_at_least(most / largest(u_exact, 3 * f.n), 10 * u_tolerance);
        check_problem_destroy(&problem);
    }
    free(u);
    free(p);
    free(u_exact);
    free(p_exact);
    tear_down(&f);
}

static void values_at_constraints_are_exact(void **state)
{
    (void)state;
    fixture f = set_up(2, 0.2, pliant_wavelet_default(), CHECK_ALL_BLOCKS, roomy);
    check_random random = check_random_seed(6);
    check_problem problem = check_problem_create(f.exact);
    specify_random(&f, &problem, &random, 31, 40);
    pliant_vec3 *u = calloc((size_t)f.n, sizeof *u), *p = calloc((size_t)f.n, sizeof *p);
    assert_true(pliant_solver_solve(f.solver, PLIANT_NEVER) >= 0);
    for (int32_t level = 0; level <= f.finest; level++) {
        const int32_t count = pliant_model_level_vertex_count(f.model, level);
        assert_int_equal(pliant_solver_surface(f.solver, level, u), PLIANT_OK);
        assert_int_equal(pliant_solver_tractions(f.solver, NULL, count, p), PLIANT_OK);
        for (int32_t v = 0; v < count; v++) {
            const pliant_vec3 expected = vector_at(problem.value, v);
            const pliant_vec3 *found = problem.is_displaced[v] ? &u[v] : &p[v];
            assert_memory_equal(found, &expected, sizeof expected);
        }
    }
    free(u);
    free(p);
    check_problem_destroy(&problem);
    tear_down(&f);
}

// ---- The paths agree ----

// Round-off between two float paths: sums of some hundred products in another order, 30 u of the
// largest value with room for the signs to conspire.
static const double path_tolerance = 30 * 0x1p-24;

static double vector_difference(const pliant_vec3 *a, const pliant_vec3 *b, int32_t count)
{
    double most = 0;
    for (int32_t i = 0; i < count; i++)
        most = fmax(most, fmax(fabs((double)a[i].x - b[i].x),
                               fmax(fabs((double)a[i].y - b[i].y), fabs((double)a[i].z - b[i].z))));
    return most;
}

static double vector_size(const pliant_vec3 *a, int32_t count)
{
    double most = 0;
    for (int32_t i = 0; i < count; i++)
        most = fmax(most,
                    fmax(fabs((double)a[i].x), fmax(fabs((double)a[i].y), fabs((double)a[i].z))));
    return most;
}

static void chosen_vertices_equal_the_whole_surface(void **state)
{
    (void)state;
    for (int32_t kind = 0; kind < 4; kind++) {
        const pliant_wavelet_def wavelet = {(pliant_wavelet_scheme)(kind & 1),
                                            (pliant_wavelet_lifting)(kind >> 1), PLIANT_ZERO};
        fixture f = set_up(2, 0.05, wavelet, CHECK_ALL_BLOCKS, roomy);
        check_random random = check_random_seed(7);
        check_problem problem = check_problem_create(f.exact);
        specify_random(&f, &problem, &random, 31, 30);
        pliant_vec3 *whole = calloc((size_t)f.n, sizeof *whole);
        pliant_vec3 *reactions = calloc((size_t)f.n, sizeof *reactions);
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        assert_int_equal(pliant_solver_surface(f.solver, f.finest, whole), PLIANT_OK);
        assert_int_equal(pliant_solver_tractions(f.solver, NULL, f.n, reactions), PLIANT_OK);
        const double size = vector_size(whole, f.n), pressure = vector_size(reactions, f.n);
        for (int round = 0; round < 20; round++) {
            int32_t vertices[40];
            pliant_vec3 chosen[40];
            const int32_t count = 1 + check_random_index(&random, round < 15 ? 6 : 40);
            for (int32_t i = 0; i < count; i++) vertices[i] = check_random_index(&random, f.n);
            // A level between puts another one's values into the rows.
            assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
            if (round % 3 == 1)
                assert_int_equal(pliant_solver_surface(f.solver, 1, (pliant_vec3[162]){{0}}),
                                 PLIANT_OK);
            assert_int_equal(pliant_solver_displacements(f.solver, vertices, count, chosen),
                             PLIANT_OK);
            for (int32_t i = 0; i < count; i++)
                check_at_most(vector_difference(&chosen[i], &whole[vertices[i]], 1),
                              path_tolerance * size);
            assert_int_equal(pliant_solver_tractions(f.solver, vertices, count, chosen), PLIANT_OK);
            for (int32_t i = 0; i < count; i++)
                check_at_most(vector_difference(&chosen[i], &reactions[vertices[i]], 1),
                              path_tolerance * pressure);
        }
        free(whole);
        free(reactions);
        check_problem_destroy(&problem);
        tear_down(&f);
    }
}

static void a_coarser_surface_is_the_partial_inverse(void **state)
{
    (void)state;
    fixture f = set_up(3, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS, roomy);
    check_random random = check_random_seed(9);
    check_problem problem = check_problem_create(f.exact);
    specify_random(&f, &problem, &random, 31, 12);
    check_synthetic_round(f.exact);
    double *u = calloc(3 * (size_t)f.n, sizeof *u), *p = calloc(3 * (size_t)f.n, sizeof *p);
    check_synthetic_solve_dense(f.exact, &problem, u, p);
    const pliant_wavelet *w = f.exact->wavelets[0];
    double *x = calloc(3 * ((size_t)w->count + 1), sizeof *x);
    pliant_vec3 *found = calloc((size_t)f.n, sizeof *found);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    // Up, down and the same twice: every level starts from the same coefficients.
    const int32_t levels[] = {0, 1, 2, 3, 2, 2, 0, 3, 1};
    for (size_t k = 0; k < sizeof levels / sizeof *levels; k++) {
        const int32_t level = levels[k];
        memset(x, 0, 3 * ((size_t)w->count + 1) * sizeof *x);
        for (int32_t i = 0; i < w->count; i++)
            for (int c = 0; c < 3; c++)
                x[3 * (size_t)i + c] = u[3 * (size_t)f.exact->nodes[0][i] + c];
        pliant_wavelet_forward(w, 3, x);
        pliant_wavelet_inverse(w, level, 3, x);
        memset(found, 0x5a, (size_t)f.n * sizeof *found);
        assert_int_equal(pliant_solver_surface(f.solver, level, found), PLIANT_OK);
        const int32_t count = pliant_model_level_vertex_count(f.model, level);
        const double size = largest(u, 3 * f.n);
        for (int32_t i = 0; i < w->level_offset[level + 1]; i++) {
            const int32_t v = f.exact->nodes[0][i];
            assert_in_range(v, 0, count - 1);
            if (problem.is_displaced[v]) continue;  // step (8)
            check_at_most(largest_difference(&found[v], x + 3 * (size_t)i, 1), u_tolerance * size);
        }
        // Nothing behind the level's vertices is written.
        for (size_t b = 0; b < (size_t)(f.n - count) * sizeof *found; b++)
            assert_int_equal(((unsigned char *)(found + count))[b], 0x5a);
    }
    free(u);
    free(p);
    free(x);
    free(found);
    check_problem_destroy(&problem);
    tear_down(&f);
}

static void cached_types_repeat_to_the_bit_in_any_order_of_statements(void **state)
{
    (void)state;
    fixture f = set_up(2, 0.02, pliant_wavelet_default(), CHECK_FREE_BLOCK, roomy);
    int32_t patch[3][4] = {{20, 21, 80, 5}, {100, 3, 50, 51}, {7, 61, 62, 64}};  // free positions
    for (int32_t k = 0; k < 12; k++) patch[k / 4][k % 4] = f.exact->nodes[0][patch[k / 4][k % 4]];
    pliant_vec3 *first[3], *again = calloc((size_t)f.n, sizeof *again);
    for (int32_t k = 0; k < 6; k++) {
        pliant_solver_release_all(f.solver);
        for (int32_t i = 0; i < 4; i++) {
            const int32_t which = k < 3 ? i : 3 - i;
            const pliant_vec3 u = {0, 0.01f * (float)which, -0.1f};
            assert_int_equal(pliant_solver_displace(f.solver, node_of(&f, patch[k % 3][which]), u),
                             PLIANT_OK);
        }
        assert_int_equal(pliant_solver_constraint_count(f.solver), 4);
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        assert_int_equal(pliant_solver_last(f.solver).factored, k < 3);
        assert_int_equal(pliant_solver_last(f.solver).constraint_count, 4);
        if (k < 3) first[k] = calloc((size_t)f.n, sizeof **first);
        pliant_vec3 *to = k < 3 ? first[k] : again;
        assert_int_equal(pliant_solver_surface(f.solver, f.finest, to), PLIANT_OK);
        if (k >= 3) assert_memory_equal(to, first[k - 3], (size_t)f.n * sizeof *to);
    }
    // A fourth type takes the place of the least recently used, which is the first.
    for (int32_t k = 0; k < 3; k++) {
        pliant_solver_release_all(f.solver);
        const int32_t count = k == 0 ? 1 : 4;
        for (int32_t i = 0; i < count; i++)
            assert_int_equal(pliant_solver_displace(f.solver, node_of(&f, patch[k == 2 ? 0 : k][i]),
                                                    (pliant_vec3){0, 0, 0.1f}),
                             PLIANT_OK);
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        assert_int_equal(pliant_solver_last(f.solver).factored, k != 1);
    }
    for (int32_t k = 0; k < 3; k++) free(first[k]);
    free(again);
    tear_down(&f);
}

static void a_coherent_walk_of_100000_steps_does_not_drift(void **state)
{
    (void)state;
    fixture f = set_up(1, 0, pliant_wavelet_default(), CHECK_ALL_BLOCKS, roomy);
    check_random random = check_random_seed(8);
    pliant_vec3 *walked = calloc((size_t)f.n, sizeof *walked),
                *fresh = calloc((size_t)f.n, sizeof *fresh);
    check_problem problem = check_problem_create(f.exact);
    double worst = 0;
    for (int32_t step = 0; step < 100000; step++) {
        // Mostly one small change; now and then a load a million times larger comes and goes.
        const int32_t v = check_random_index(&random, f.n);
        const double kind = check_random_next(&random), size = step % 1000 == 500 ? 1e6 : 1;
        if (kind < 0.2) {
            assert_int_equal(pliant_solver_release(f.solver, node_of(&f, v)), PLIANT_OK);
            problem.is_displaced[v] = !pliant_model_is_free(f.model, v);
            put_vector(problem.value, v, (pliant_vec3){0, 0, 0});
        } else if (pliant_model_is_free(f.model, v)) {
            specify(&f, &problem, v, kind < 0.22, random_vector(&random, kind < 0.22 ? 0.1 : size));
        } else {
            specify(&f, &problem, v, 1, random_vector(&random, 0.1 * size));
        }
        if (kind > 0.95) {
            const pliant_vec3 g = random_vector(&random, size);
            assert_int_equal(pliant_solver_gravity(f.solver, g), PLIANT_OK);
            problem.gravity[0] = g.x, problem.gravity[1] = g.y, problem.gravity[2] = g.z;
        }
        if (step % 1000 == 501) {  // the large ones leave
            pliant_solver_release_all(f.solver);
            check_problem_destroy(&problem);
            problem = check_problem_create(f.exact);
        }
        if (pliant_solver_constraint_count(f.solver) > 12) pliant_solver_release_all(f.solver);
        if (pliant_solver_constraint_count(f.solver) == 0 && step % 1000 > 12) {
            check_problem_destroy(&problem);
            problem = check_problem_create(f.exact);
            pliant_solver_release_all(f.solver);
        }
        assert_true(pliant_solver_solve(f.solver, PLIANT_NEVER) >= 0);
        if (step % 5000 != 4999) continue;

        pliant_solver *other = NULL;
        pliant_error err = {""};
        check_ok(pliant_solver_create(f.model, &roomy, &other, &err), &err);
        pliant_solver *kept = f.solver;
        f.solver = other;
        check_problem ignored = check_problem_create(f.exact);
        for (int32_t w = 0; w < f.n; w++) {
            const pliant_vec3 value = vector_at(problem.value, w);
            const int32_t displaced = problem.is_displaced[w];
            if (displaced != !pliant_model_is_free(f.model, w) || vector_size(&value, 1) > 0)
                specify(&f, &ignored, w, displaced, value);
        }
        const pliant_vec3 g = {(float)problem.gravity[0], (float)problem.gravity[1],
                               (float)problem.gravity[2]};
        assert_int_equal(pliant_solver_gravity(other, g), PLIANT_OK);
        assert_true(pliant_solver_solve(other, PLIANT_NEVER) >= 0);
        assert_int_equal(pliant_solver_surface(other, f.finest, fresh), PLIANT_OK);
        f.solver = kept;
        assert_int_equal(pliant_solver_surface(kept, f.finest, walked), PLIANT_OK);
        worst = fmax(worst,
                     vector_difference(walked, fresh, f.n) / fmax(vector_size(fresh, f.n), 1e-30));
        check_problem_destroy(&ignored);
        pliant_solver_destroy(other);
    }
    print_message("worst relative drift %.2g\n", worst);
    // The base is summed afresh before its drift bound passes 256 u = 1.5e-5 of the loads'
    // magnitude.
    check_at_most(worst, 256 * 0x1p-24);
    check_problem_destroy(&problem);
    free(walked);
    free(fresh);
    tear_down(&f);
}

static void
half_precision_changes_no_force_and_displacements_by_less_than_its_rounding(void **state)
{
    (void)state;
    fixture f = set_up(3, 0.02, pliant_wavelet_default(), CHECK_ALL_BLOCKS, roomy);
    pliant_solver_def def = roomy;
    def.storage = PLIANT_STORAGE_HALF;
    pliant_solver *exact = f.solver, *half = NULL;
    pliant_error err = {""};
    check_ok(pliant_solver_create(f.model, &def, &half, &err), &err);
    pliant_vec3 *expected = calloc((size_t)f.n, sizeof *expected);
    pliant_vec3 *found = calloc((size_t)f.n, sizeof *found);
    double worst = 0;
    for (int trial = 0; trial < 20; trial++) {
        for (int side = 0; side < 2; side++) {
            check_random random = check_random_seed((uint64_t)trial);
            check_problem ignored = check_problem_create(f.exact);
            f.solver = side ? half : exact;
            pliant_solver_release_all(f.solver);
            specify_random(&f, &ignored, &random, trial % 2 ? with_displaced : 31, 5 + trial);
            assert_true(pliant_solver_solve(f.solver, PLIANT_NEVER) >= 0);
            check_problem_destroy(&ignored);
        }
        const pliant_vec3 a = pliant_solver_contact_force(exact),
                          b = pliant_solver_contact_force(half);
        assert_memory_equal(&a, &b, sizeof a);
        assert_int_equal(pliant_solver_surface(exact, f.finest, expected), PLIANT_OK);
        assert_int_equal(pliant_solver_surface(half, f.finest, found), PLIANT_OK);
        worst = fmax(worst, vector_difference(found, expected, f.n) / vector_size(expected, f.n));
    }
    print_message("displacements differ by at most %.2g of the largest\n", worst);
    // Coefficients are rounded by 2^-12 on average and 2^-11 at most, independently; a displacement
    // is a sum over s <= 24 nodes whose contributions may exceed the largest displacement
    // severalfold.
    check_at_most(worst, 16 * 0x1p-11);
    check_at_least(worst, 0x1p-16);  // it is half precision that was compared
    free(found);
    free(expected);
    f.solver = exact;
    pliant_solver_destroy(half);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(displaced_vertices_equal_a_direct_solve),
        cmocka_unit_test(displaced_and_pressed_vertices_equal_a_direct_solve),
        cmocka_unit_test(supports_and_gravity_equal_a_direct_solve),
        cmocka_unit_test(freed_supports_equal_a_direct_solve),
        cmocka_unit_test(every_wavelet_equals_a_direct_solve),
        cmocka_unit_test(thresholded_columns_equal_the_dense_algorithm_on_what_is_stored),
        cmocka_unit_test(values_at_constraints_are_exact),
        cmocka_unit_test(chosen_vertices_equal_the_whole_surface),
        cmocka_unit_test(a_coarser_surface_is_the_partial_inverse),
        cmocka_unit_test(cached_types_repeat_to_the_bit_in_any_order_of_statements),
        cmocka_unit_test(
            half_precision_changes_no_force_and_displacements_by_less_than_its_rounding),
        cmocka_unit_test(a_coherent_walk_of_100000_steps_does_not_drift),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
