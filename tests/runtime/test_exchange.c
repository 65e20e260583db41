// test_exchange.c: a received solution reads as the one that was published.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct fixture {
    pliant_model *model;
    pliant_solver *solver, *viewer;
    pliant_exchange *exchange;
    int32_t n;
    pliant_vec3 *sent, *received;  // shape [n]
} fixture;

static const pliant_solver_def roomy = {
    .constraint_capacity = 24, .load_capacity = 24, .cache_count = 2};

static fixture set_up(void)
{
    fixture f = {0};
    pliant_error err = {""};
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_exchange_%d.h5", (int)getpid());
    check_write_synthetic_levels(path, NULL, 2, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS);
    check_ok(pliant_model_open(path, &f.model, &err), &err);
    unlink(path);
    check_ok(pliant_solver_create(f.model, &roomy, &f.solver, &err), &err);
    check_ok(pliant_solver_create(f.model, &roomy, &f.viewer, &err), &err);
    check_ok(pliant_exchange_create(f.model, &roomy, &f.exchange, &err), &err);
    f.n = pliant_model_describe(f.model).vertex_count;
    f.sent = calloc((size_t)f.n, sizeof *f.sent);
    f.received = calloc((size_t)f.n, sizeof *f.received);
    assert_true(f.sent && f.received);
    return f;
}

static void tear_down(fixture *f)
{
    free(f->sent);
    free(f->received);
    pliant_exchange_destroy(f->exchange);
    pliant_solver_destroy(f->viewer);
    pliant_solver_destroy(f->solver);
    pliant_model_close(f->model);
}

static double largest(const pliant_vec3 *v, int32_t count)
{
    double most = 0;
    for (int32_t i = 0; i < count; i++)
        most = fmax(most,
                    fmax(fabs((double)v[i].x), fmax(fabs((double)v[i].y), fabs((double)v[i].z))));
    return most;
}

// The sums of base are in another order: some hundred float roundings of what cancels in them.
static void compare(const fixture *f, int32_t count, double size)
{
    for (int32_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            check_near((double)(&f->received[i].x)[c], (double)(&f->sent[i].x)[c], 2e-5 * size);
}

static void compare_solutions(fixture *f)
{
    for (int32_t level = 0; level <= 2; level++) {
        assert_int_equal(pliant_solver_surface(f->solver, level, f->sent), PLIANT_OK);
        assert_int_equal(pliant_solver_surface(f->viewer, level, f->received), PLIANT_OK);
        const int32_t count = pliant_model_level_vertex_count(f->model, level);
        compare(f, count, fmax(1, largest(f->sent, count)));
    }
    assert_int_equal(pliant_solver_displacements(f->solver, NULL, f->n, f->sent), PLIANT_OK);
    assert_int_equal(pliant_solver_displacements(f->viewer, NULL, f->n, f->received), PLIANT_OK);
    compare(f, f->n, fmax(1, largest(f->sent, f->n)));
    assert_int_equal(pliant_solver_tractions(f->solver, NULL, f->n, f->sent), PLIANT_OK);
    assert_int_equal(pliant_solver_tractions(f->viewer, NULL, f->n, f->received), PLIANT_OK);
    compare(f, f->n, fmax(1, largest(f->sent, f->n)));
    // What the contact solve found is copied.
    const pliant_vec3 a = pliant_solver_contact_force(f->solver);
    const pliant_vec3 b = pliant_solver_contact_force(f->viewer);
    assert_memory_equal(&a, &b, sizeof a);
    assert_int_equal(pliant_solver_last(f->viewer).constraint_count,
                     pliant_solver_last(f->solver).constraint_count);
}

static void change(fixture *f, check_random *random)
{
    const pliant_vec3 value = {(float)check_random_next(random) - 0.5f,
                               (float)check_random_next(random) - 0.5f, 0.1f};
    const int32_t level = check_random_index(random, 3);
    const int32_t count = pliant_model_level_vertex_count(f->model, level);
    const pliant_node node = {level, check_random_index(random, count)};
    const double kind = check_random_next(random);
    pliant_status status;
    if (kind < 0.2) status = pliant_solver_release(f->solver, node);
    else if (kind < 0.55) status = pliant_solver_press(f->solver, node, value);
    else if (kind < 0.6) status = pliant_solver_gravity(f->solver, value);
    else if (pliant_model_is_free(f->model, node.vertex))
        status = pliant_solver_displace(f->solver, node, value);
    else status = pliant_solver_support(f->solver, node, value);
    assert_true(status >= 0 || status == PLIANT_ERR_CAPACITY);
}

static void a_received_solution_reads_as_the_one_published(void **state)
{
    (void)state;
    fixture f = set_up();
    check_random random = check_random_seed(1);
    pliant_error err = {""};
    pliant_proxy *proxy = NULL;
    check_ok(pliant_proxy_create(f.solver, NULL, &proxy, &err), &err);
    assert_int_equal(pliant_solver_receive(f.viewer, f.exchange), 0);
    int32_t touched = 0, constrained = 0;
    for (int i = 0; i < 300; i++) {
        if (i % 60 == 59) pliant_solver_release_all(f.solver);
        for (int k = 0; k < 3; k++) change(&f, &random);
        if (i % 3 == 0) {
            const double far[3] = {0, 2, 0.2}, near[3] = {0, 0.5, 0.2};
            pliant_proxy_result r;
            assert_int_equal(pliant_proxy_place(proxy, far), PLIANT_OK);
            assert_true(pliant_proxy_step(proxy, near, PLIANT_NEVER, &r) >= 0);
            touched += r.face >= 0;
        } else {
            assert_true(pliant_solver_solve(f.solver, PLIANT_NEVER) >= 0);
        }
        constrained += pliant_solver_last(f.solver).constraint_count;
        // Statements made since are not in what is published.
        if (i % 2) change(&f, &random);
        assert_int_equal(pliant_solver_publish(f.solver, f.exchange), PLIANT_OK);
        if (i % 5 == 0) continue;
        assert_int_equal(pliant_solver_receive(f.viewer, f.exchange), 1);
        assert_int_equal(pliant_solver_receive(f.viewer, f.exchange), 0);
        compare_solutions(&f);
    }
    check_at_least(touched, 50);
    check_at_least(constrained, 1000);
    pliant_proxy_destroy(proxy);
    tear_down(&f);
}

// And no other: three were published since the receiver looked last.
static void the_receiver_gets_the_newest(void **state)
{
    (void)state;
    fixture f = set_up();
    const int32_t v = pliant_model_nearest(f.model, (const double[3]){1, 0, 0});
    for (int i = 1; i <= 9; i++) {
        assert_int_equal(
            pliant_solver_displace(f.solver, (pliant_node){2, v}, (pliant_vec3){(float)i, 0, 0}),
            PLIANT_OK);
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        assert_int_equal(pliant_solver_publish(f.solver, f.exchange), PLIANT_OK);
        if (i % 3) continue;
        assert_int_equal(pliant_solver_receive(f.viewer, f.exchange), 1);
        pliant_vec3 u;
        assert_int_equal(pliant_solver_displacements(f.viewer, &v, 1, &u), PLIANT_OK);
        check_near((double)u.x, i, 0);
    }
    tear_down(&f);
}

static void the_receiver_can_go_on_from_what_it_received(void **state)
{
    (void)state;
    fixture f = set_up();
    const pliant_node a = {2, pliant_model_nearest(f.model, (const double[3]){1, 0, 0})};
    const pliant_node b = {2, pliant_model_nearest(f.model, (const double[3]){0, 1, 0})};
    assert_int_equal(pliant_solver_displace(f.solver, a, (pliant_vec3){-0.1f, 0, 0}), PLIANT_OK);
    assert_int_equal(pliant_solver_press(f.solver, b, (pliant_vec3){0, -1, 0}), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_publish(f.solver, f.exchange), PLIANT_OK);
    assert_int_equal(pliant_solver_receive(f.viewer, f.exchange), 1);
    // The matrix of S did not come along.
    double matrix[9];
    assert_int_equal(pliant_solver_compliance(f.viewer, &b, 1, matrix), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_solver_solve(f.viewer, PLIANT_NEVER), PLIANT_OK);
    compare_solutions(&f);
    assert_int_equal(pliant_solver_compliance(f.viewer, &b, 1, matrix), PLIANT_OK);
    tear_down(&f);
}

static void what_does_not_fit_is_refused_without_effect(void **state)
{
    (void)state;
    fixture f = set_up(), other = set_up();
    pliant_error err = {""};
    assert_int_equal(pliant_solver_publish(other.solver, f.exchange), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_solver_receive(other.viewer, f.exchange), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_exchange_create(NULL, NULL, &f.exchange, &err), PLIANT_ERR_ARGUMENT);

    // More than the exchange has room for; then less again.
    const pliant_solver_def tight = {
        .constraint_capacity = 2, .load_capacity = 2, .cache_count = 1};
    pliant_exchange *small = NULL;
    check_ok(pliant_exchange_create(f.model, &tight, &small, &err), &err);
    const pliant_vec3 value = {0.1f, 0, 0};
    for (int pressed = 0; pressed < 2; pressed++) {
        int32_t count = 0;
        for (int32_t v = 0; count < 3; v++) {
            const pliant_node node = {2, v};
            if (pliant_model_is_free(f.model, v) != 1) continue;
            assert_int_equal(pressed ? pliant_solver_press(f.solver, node, value)
                                     : pliant_solver_displace(f.solver, node, value),
                             PLIANT_OK);
            assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
            assert_int_equal(pliant_solver_publish(f.solver, small),
                             ++count > 2 ? PLIANT_ERR_CAPACITY : PLIANT_OK);
        }
        pliant_solver_release_all(f.solver);
    }
    // A viewer must have room for whatever the exchange can carry.
    pliant_solver *viewer = NULL;
    check_ok(pliant_solver_create(f.model, &tight, &viewer, &err), &err);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_publish(f.solver, f.exchange), PLIANT_OK);
    assert_int_equal(pliant_solver_receive(viewer, f.exchange), PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_solver_receive(f.viewer, f.exchange), 1);
    pliant_solver_destroy(viewer);
    pliant_exchange_destroy(small);
    tear_down(&other);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_received_solution_reads_as_the_one_published),
        cmocka_unit_test(the_receiver_gets_the_newest),
        cmocka_unit_test(the_receiver_can_go_on_from_what_it_received),
        cmocka_unit_test(what_does_not_fit_is_refused_without_effect),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
