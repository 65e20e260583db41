// test_statements.c: what a solver accepts and refuses, and that a refusal has no effect.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { n = 162 };

static char path[2][64];  // with and without supports
static pliant_model *models[2];
static int32_t free_vertex[n], fixed_vertex[n];

static int open_models(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        snprintf(path[k], sizeof path[k], "/tmp/pliant_test_statements_%d_%d.h5", (int)getpid(), k);
        check_write_synthetic_model(path[k], NULL, 2, 0.02, pliant_wavelet_default(),
                                    k == 0 ? CHECK_ALL_BLOCKS : CHECK_FREE_BLOCK);
        pliant_error err = {""};
        check_ok(pliant_model_open(path[k], &models[k], &err), &err);
        unlink(path[k]);
    }
    int32_t free_count = 0, fixed_count = 0;
    for (int32_t v = 0; v < n; v++)
        if (pliant_model_is_free(models[0], v)) free_vertex[free_count++] = v;
        else fixed_vertex[fixed_count++] = v;
    return 0;
}

static int close_models(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) pliant_model_close(models[k]);
    return 0;
}

static pliant_solver *create(int k, int32_t constraints, int32_t loads)
{
    const pliant_solver_def def = {
        .constraint_capacity = constraints, .load_capacity = loads, .cache_count = 2};
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    check_ok(pliant_solver_create(models[k], &def, &solver, &err), &err);
    return solver;
}

static pliant_node node(int32_t vertex)
{
    return (pliant_node){2, vertex};
}

static const pliant_vec3 down = {0, 0, -0.1f}, side = {0.2f, 0, 0}, zero = {0, 0, 0};

// The state as it can be seen: displacements and tractions after a solve.
typedef struct picture {
    pliant_vec3 u[n], p[n];
    int32_t constraints;
} picture;

static picture take_picture(pliant_solver *solver)
{
    static picture p;
    memset(&p, 0, sizeof p);
    assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
    p.constraints = pliant_solver_constraint_count(solver);
    assert_int_equal(pliant_solver_surface(solver, 2, p.u), PLIANT_OK);
    int32_t vertices[n], count = 0;
    for (int32_t v = 0; v < n; v++)
        if (pliant_model_is_free(models[0], v)) vertices[count++] = v;
    assert_int_equal(pliant_solver_tractions(solver, vertices, count, p.p), PLIANT_OK);
    return p;
}

static void check_same(const picture *a, const picture *b)
{
    assert_memory_equal(a, b, sizeof *a);
}

static void bad_nodes_and_values_are_refused_without_effect(void **state)
{
    (void)state;
    pliant_solver *solver = create(0, 4, 4);
    assert_int_equal(pliant_solver_displace(solver, node(free_vertex[3]), down), PLIANT_OK);
    assert_int_equal(pliant_solver_press(solver, node(free_vertex[9]), side), PLIANT_OK);
    const picture before = take_picture(solver);

    const pliant_node bad[] = {{2, -1}, {2, n},         {2, INT32_MAX}, {-1, 0},
                               {3, 0},  {INT32_MIN, 0}, {0, 12},        {1, 42}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(pliant_solver_displace(solver, bad[i], down), PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_solver_press(solver, bad[i], down), PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_solver_support(solver, bad[i], down), PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_solver_release(solver, bad[i]), PLIANT_ERR_ARGUMENT);
    }
    // Levels that the file could hold but does not.
    for (int32_t level = 0; level < 2; level++) {
        const pliant_node coarse = {level, 3};
        assert_int_equal(pliant_solver_displace(solver, coarse, down), PLIANT_ERR_MISSING);
        assert_int_equal(pliant_solver_press(solver, coarse, down), PLIANT_ERR_MISSING);
        assert_int_equal(pliant_solver_release(solver, coarse), PLIANT_ERR_MISSING);
    }
    const pliant_vec3 wrong[] = {{NAN, 0, 0}, {0, INFINITY, 0}, {0, 0, -INFINITY}};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(pliant_solver_displace(solver, node(free_vertex[0]), wrong[i]),
                         PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_solver_press(solver, node(free_vertex[0]), wrong[i]),
                         PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_solver_support(solver, node(fixed_vertex[0]), wrong[i]),
                         PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_solver_gravity(solver, wrong[i]), PLIANT_ERR_ARGUMENT);
    }
    assert_int_equal(pliant_solver_displace(solver, node(fixed_vertex[0]), down),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_support(solver, node(free_vertex[0]), down),
                     PLIANT_ERR_ARGUMENT);
    const picture after = take_picture(solver);
    check_same(&before, &after);
    pliant_solver_destroy(solver);
}

static void bad_queries_are_refused_and_write_nothing(void **state)
{
    (void)state;
    pliant_solver *solver = create(1, 4, 4);
    assert_int_equal(pliant_solver_displace(solver, node(free_vertex[3]), down), PLIANT_OK);
    const picture before = take_picture(solver);
    pliant_vec3 u[n + 1];
    memset(u, 0x5a, sizeof u);
    const int32_t below[2] = {free_vertex[1], -1}, beyond[2] = {free_vertex[1], n};
    const int32_t fixed[2] = {free_vertex[1], fixed_vertex[0]};
    assert_int_equal(pliant_solver_surface(solver, 3, u), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_surface(solver, -1, u), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_surface(solver, 2, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_displacements(solver, below, 2, u), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_displacements(solver, beyond, 2, u), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_displacements(solver, NULL, n + 1, u), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_displacements(solver, NULL, -1, u), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_displacements(solver, NULL, 1, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_tractions(solver, beyond, 2, u), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_tractions(solver, fixed, 2, u), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_solver_displacements(solver, NULL, 0, NULL), PLIANT_OK);
    for (size_t i = 0; i < sizeof u; i++) assert_int_equal(((unsigned char *)u)[i], 0x5a);
    const picture after = take_picture(solver);
    check_same(&before, &after);
    pliant_solver_destroy(solver);
}

static void without_the_fixed_blocks_supports_are_missing(void **state)
{
    (void)state;
    pliant_solver *solver = create(1, 4, 4);
    assert_int_equal(pliant_solver_displace(solver, node(free_vertex[3]), down), PLIANT_OK);
    const picture before = take_picture(solver);
    assert_int_equal(pliant_model_describe(models[1]).has_supports, 0);
    assert_int_equal(pliant_solver_support(solver, node(fixed_vertex[0]), down),
                     PLIANT_ERR_MISSING);
    assert_int_equal(pliant_solver_press(solver, node(fixed_vertex[0]), down), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_solver_release(solver, node(fixed_vertex[0])), PLIANT_OK);
    const picture after = take_picture(solver);
    check_same(&before, &after);
    pliant_solver_destroy(solver);
}

static void capacities_are_refused_and_come_free_again(void **state)
{
    (void)state;
    pliant_solver *solver = create(0, 3, 2);
    for (int i = 0; i < 3; i++)
        assert_int_equal(pliant_solver_displace(solver, node(free_vertex[i]), down), PLIANT_OK);
    for (int i = 3; i < 5; i++)
        assert_int_equal(pliant_solver_press(solver, node(free_vertex[i]), side), PLIANT_OK);
    const picture before = take_picture(solver);
    assert_int_equal(pliant_solver_displace(solver, node(free_vertex[7]), down),
                     PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_solver_press(solver, node(fixed_vertex[1]), down), PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_solver_press(solver, node(free_vertex[7]), down), PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_solver_support(solver, node(fixed_vertex[1]), down),
                     PLIANT_ERR_CAPACITY);
    // Moves into a full list leave the node where it was.
    assert_int_equal(pliant_solver_displace(solver, node(free_vertex[3]), down),
                     PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_solver_press(solver, node(free_vertex[0]), down), PLIANT_ERR_CAPACITY);
    const picture after = take_picture(solver);
    check_same(&before, &after);
    // New values for old nodes are no new nodes.
    assert_int_equal(pliant_solver_displace(solver, node(free_vertex[1]), side), PLIANT_OK);
    assert_int_equal(pliant_solver_press(solver, node(free_vertex[4]), down), PLIANT_OK);
    // Released places are there at once, solved in between or not, over and over.
    for (int round = 0; round < 50; round++) {
        pliant_solver_release_all(solver);
        for (int i = 0; i < 3; i++)
            assert_int_equal(pliant_solver_displace(solver, node(free_vertex[round + i]), down),
                             PLIANT_OK);
        for (int i = 0; i < 2; i++)
            assert_int_equal(pliant_solver_press(solver, node(free_vertex[round + 20 + i]), down),
                             PLIANT_OK);
        assert_int_equal(pliant_solver_press(solver, node(free_vertex[round + 25]), down),
                         PLIANT_ERR_CAPACITY);
        if (round % 3 == 0) assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
    }
    pliant_solver_destroy(solver);
}

static void the_last_statement_about_a_vertex_holds(void **state)
{
    (void)state;
    pliant_solver *one = create(0, 8, 8), *other = create(0, 8, 8);
    const int32_t a = free_vertex[10], b = free_vertex[30], c = fixed_vertex[5];
    // one: straight; other: through all the conditions, solving in between.
    assert_int_equal(pliant_solver_displace(one, node(a), down), PLIANT_OK);
    assert_int_equal(pliant_solver_press(one, node(b), side), PLIANT_OK);
    assert_int_equal(pliant_solver_support(one, node(c), side), PLIANT_OK);

    assert_int_equal(pliant_solver_press(other, node(a), side), PLIANT_OK);
    assert_int_equal(pliant_solver_displace(other, node(b), side), PLIANT_OK);
    assert_int_equal(pliant_solver_press(other, node(c), side), PLIANT_OK);
    assert_int_equal(pliant_solver_constraint_count(other), 2);
    assert_true(pliant_solver_solve(other, PLIANT_NEVER) >= 0);
    assert_int_equal(pliant_solver_release(other, node(free_vertex[50])),
                     PLIANT_OK);  // nothing there
    assert_int_equal(pliant_solver_displace(other, node(a), down), PLIANT_OK);
    assert_int_equal(pliant_solver_press(other, node(b), side), PLIANT_OK);
    assert_int_equal(pliant_solver_support(other, node(c), side), PLIANT_OK);
    assert_int_equal(pliant_solver_constraint_count(other), 1);
    const picture straight = take_picture(one), winding = take_picture(other);
    for (int32_t v = 0; v < n; v++) {
        // Round-off between a fresh and a coherent sum.
        check_near(winding.u[v].x, straight.u[v].x, 1e-6);
        check_near(winding.u[v].z, straight.u[v].z, 1e-6);
    }
    assert_memory_equal(&winding.u[a], &down, sizeof down);
    assert_memory_equal(&winding.u[c], &side, sizeof side);

    pliant_solver_release_all(other);
    assert_int_equal(pliant_solver_constraint_count(other), 0);
    const picture empty = take_picture(other);
    for (int32_t v = 0; v < n; v++) assert_memory_equal(&empty.u[v], &zero, sizeof zero);
    pliant_solver_destroy(one);
    pliant_solver_destroy(other);
}

static void statements_show_only_after_the_next_solve(void **state)
{
    (void)state;
    pliant_solver *solver = create(0, 8, 8);
    const int32_t asked[3] = {free_vertex[10], fixed_vertex[2], free_vertex[40]};
    pliant_vec3 u[3], p[3], u_later[3], p_later[3];
    assert_int_equal(pliant_solver_displacements(solver, asked, 3, u),
                     PLIANT_OK);  // before any solve
    for (int i = 0; i < 3; i++) assert_memory_equal(&u[i], &zero, sizeof zero);
    assert_int_equal(pliant_solver_displace(solver, node(asked[0]), down), PLIANT_OK);
    assert_int_equal(pliant_solver_support(solver, node(asked[1]), side), PLIANT_OK);
    assert_int_equal(pliant_solver_press(solver, node(asked[2]), side), PLIANT_OK);
    assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
    assert_int_equal(pliant_solver_displacements(solver, asked, 3, u), PLIANT_OK);
    assert_int_equal(pliant_solver_tractions(solver, asked, 3, p), PLIANT_OK);
    const pliant_vec3 force = pliant_solver_contact_force(solver);
    check_near(force.z, pliant_model_area(models[0], asked[0]) * (double)p[0].z,
               1e-6 * fabs(force.z));
    pliant_solver_release_all(solver);
    assert_int_equal(pliant_solver_press(solver, node(asked[0]), side), PLIANT_OK);
    assert_int_equal(pliant_solver_displacements(solver, asked, 3, u_later), PLIANT_OK);
    assert_int_equal(pliant_solver_tractions(solver, asked, 3, p_later), PLIANT_OK);
    const pliant_vec3 force_later = pliant_solver_contact_force(solver);
    assert_memory_equal(u, u_later, sizeof u);
    assert_memory_equal(p, p_later, sizeof p);
    assert_memory_equal(&force, &force_later, sizeof force);
    pliant_solver_destroy(solver);
}

static void bad_definitions_are_refused(void **state)
{
    (void)state;
    const pliant_solver_def bad[] = {{0, 8, 1, 0, 0},         {-5, 8, 1, 0, 0}, {8, -1, 1, 0, 0},
                                     {8, 8, 1, 2, 0},         {8, 8, 0, 0, 0},  {8, 8, -1, 0, 0},
                                     {8, 8, INT32_MAX, 0, 0}, {8, 8, 1, 0, 2}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        pliant_solver *solver = NULL;
        pliant_error err = {""};
        assert_int_equal(pliant_solver_create(models[0], &bad[i], &solver, &err),
                         PLIANT_ERR_ARGUMENT);
        assert_null(solver);
        assert_true(err.text[0] != 0);
    }
    pliant_solver *solver = NULL;
    assert_int_equal(pliant_solver_create(NULL, NULL, &solver, NULL), PLIANT_ERR_ARGUMENT);
    // No more than the mesh has room for: huge capacities are small ones.
    const pliant_solver_def huge = {INT32_MAX, INT32_MAX, 1, PLIANT_STORAGE_HALF,
                                    PLIANT_COMPLIANCE_PASSIVE};
    pliant_error err = {""};
    check_ok(pliant_solver_create(models[0], &huge, &solver, &err), &err);
    pliant_solver_destroy(solver);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_nodes_and_values_are_refused_without_effect),
        cmocka_unit_test(bad_queries_are_refused_and_write_nothing),
        cmocka_unit_test(without_the_fixed_blocks_supports_are_missing),
        cmocka_unit_test(capacities_are_refused_and_come_free_again),
        cmocka_unit_test(the_last_statement_about_a_vertex_holds),
        cmocka_unit_test(statements_show_only_after_the_next_solve),
        cmocka_unit_test(bad_definitions_are_refused),
    };
    return cmocka_run_group_tests(tests, open_models, close_models);
}
