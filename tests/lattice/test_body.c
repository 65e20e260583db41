// test_body.c: a lattice body's steps are those of lattice shape matching, the same bits every
// time.
//
// References are the slow sums in double of tests/support/reference_lattice.h; tolerances come from
// the depth of float sums and the conditions of the regions' rotations, see lattice_pair.c.
#include "allocations.h"

#include "lattice_pair.h"

#include <math.h>
#include <string.h>

static const int32_t widths[] = {1, 2, 3, 5};
enum { width_count = sizeof widths / sizeof *widths };

// ---- Steps ----

// An error d of a goal is one of h v; it is added to x in every later step: after n of them at most
// n (n + 1) / 2 d, as |dg/dx - 1| <= 1 for small strains; twice that for rotations that follow.
static void steps_follow_the_reference(void **state)
{
    (void)state;
    enum { steps = 12 };
    check_random random = check_random_seed(7);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 3; w++) {
            const float h = 0.01f;
            lattice_pair *p = lattice_pair_create(shape, lattice_pair_size(shape, w), w, NULL);
            lattice_pair_deform(p, &random, 0.1);
            lattice_pair_velocities(p, &random, 0.5);
            assert_int_equal(pliant_body_set_gravity(p->body, (pliant_vec3){0, 0, -9.75f}), 0);
            for (int32_t i = 0; i < p->particle_count; i++)
                p->slow->f[3 * i + 2] = -9.75 * p->slow->mass[i];
            double tolerance = 0;
            for (int step = 1; step <= steps; step++) {
                if (step == 1) {
                    // Of the goals at the start; the state is put back.
                    double *v = malloc(3 * (size_t)p->particle_count * sizeof *v);
                    assert_non_null(v);
                    memcpy(v, p->slow->v, 3 * (size_t)p->particle_count * sizeof *v);
                    lattice_pair_goals(p);
                    lattice_pair_tolerances(p);
                    memcpy(p->slow->v, v, 3 * (size_t)p->particle_count * sizeof *v);
                    lattice_pair_set(p);
                    free(v);
                    for (int32_t i = 0; i < p->particle_count; i++)
                        tolerance = fmax(tolerance, p->tolerance[i]);
                    // Gravity acted in that match.
                    check_at_most(tolerance, 0.01 * p->cell_size);
                }
                assert_int_equal(pliant_body_step(p->body, h), PLIANT_OK);
                reference_lattice_step(p->slow, &(reference_step){.dt = (double)h});
                for (int32_t i = 0; i < p->particle_count; i++)
                    for (int c = 0; c < 3; c++)
                        check_near((double)p->body->x[p->lattice->slot[i] + PLIANT_LANES * c],
                                   p->slow->x[3 * i + c], step * (step + 1) * tolerance);
            }
            lattice_pair_destroy(p);
        }
}

// Damped steps forget errors instead; the whole of match, damp and move in the order of LSM.
static void damped_steps_follow_the_reference(void **state)
{
    (void)state;
    check_random random = check_random_seed(8);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        pliant_body_def def = pliant_body_default();
        def.damping = 0.25f;
        def.rigid_damping = 0.125f;
        lattice_pair *p = lattice_pair_create(shape, lattice_pair_size(shape, 2), 2, &def);
        lattice_pair_deform(p, &random, 0.1);
        lattice_pair_velocities(p, &random, 0.5);
        for (int step = 1; step <= 8; step++) {
            assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
            reference_lattice_step(
                p->slow,
                &(reference_step){.dt = (double)0.01f, .damping = 0.25, .rigid_damping = 0.125});
            // test_damping has the bounds of a single step.
            for (int32_t i = 0; i < p->particle_count; i++)
                for (int c = 0; c < 3; c++)
                    check_near((double)p->body->x[p->lattice->slot[i] + PLIANT_LANES * c],
                               p->slow->x[3 * i + c], 1e-3 * p->cell_size * step);
        }
        lattice_pair_destroy(p);
    }
}

// At rest anywhere, turned any way, and turning: goals are where the particles are.
static void rigid_motions_are_fixed_points(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int i = 0; i < width_count; i++)
            for (int has_damping = 0; has_damping < 2; has_damping++) {
                pliant_body_def def = pliant_body_default();
                def.position = (pliant_vec3){3, -2, 1};
                def.rotation[0] = 0.5f, def.rotation[1] = -0.5f, def.rotation[2] = 0.1f;
                def.rotation[3] = 0.7f;
                def.damping = def.rigid_damping = (float)has_damping;
                lattice_pair *p = lattice_pair_create(shape, lattice_pair_size(shape, widths[i]),
                                                      widths[i], &def);
                lattice_pair_read(p);
                const double spin[3] = {2, -1, 3};
                for (int32_t j = 0; j < p->particle_count; j++)
                    for (int c = 0; c < 3; c++)
                        p->slow->v[3 * j + c] =
                            1 + spin[(c + 1) % 3] * p->slow->x[3 * j + (c + 2) % 3] -
                            spin[(c + 2) % 3] * p->slow->x[3 * j + (c + 1) % 3];
                lattice_pair_set(p);
                const double h = 0.01;
                pliant_body_match(p->body, (float)h);
                double *before = malloc(3 * (size_t)p->particle_count * sizeof *before);
                assert_non_null(before);
                memcpy(before, p->slow->v, 3 * (size_t)p->particle_count * sizeof *before);
                lattice_pair_tolerances(p);
                for (int32_t j = 0; j < p->particle_count; j++)
                    for (int c = 0; c < 3; c++)
                        check_near((double)p->body->v[p->lattice->slot[j] + PLIANT_LANES * c],
                                   before[3 * j + c], p->tolerance[j] / h + 2e-5);
                free(before);
                lattice_pair_destroy(p);
            }
}

static void bodies_begin_where_their_definition_says(void **state)
{
    (void)state;
    pliant_body_def def = pliant_body_default();
    def.position = (pliant_vec3){1, 2, 3};
    def.velocity = (pliant_vec3){4, 5, 6};
    def.rotation[2] = def.rotation[3] = (float)sqrt(0.5);  // a quarter turn about z
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_BALL, 5, 1, &def);
    pliant_vec3 *values = malloc((size_t)p->particle_count * sizeof *values);
    assert_non_null(values);
    pliant_body_positions(p->body, values);
    for (int32_t i = 0; i < p->particle_count; i++) {
        const double *rest = p->slow->x0 + 3 * i;
        check_near((double)values[i].x, 1 - rest[1], 1e-6);
        check_near((double)values[i].y, 2 + rest[0], 1e-6);
        check_near((double)values[i].z, 3 + rest[2], 1e-6);
        const pliant_vec3 alone = pliant_body_position(p->body, i);
        assert_memory_equal(&alone, &values[i], sizeof alone);
    }
    pliant_body_velocities(p->body, values);
    for (int32_t i = 0; i < p->particle_count; i++)
        assert_true(values[i].x == 4 && values[i].y == 5 && values[i].z == 6);
    free(values);
    lattice_pair_destroy(p);
}

// ---- Forces ----

// Particle values of two bodies, and what they differ by.
static double difference(const lattice_pair *p, const pliant_body *a, const pliant_body *b,
                         int32_t particle, int c)
{
    const int32_t at = p->lattice->slot[particle] + PLIANT_LANES * c;
    return (double)a->v[at] - (double)b->v[at];
}

static void gravity_forces_and_impulses_are_exact(void **state)
{
    (void)state;
    check_random random = check_random_seed(9);
    const double h = 0.0625;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        lattice_pair *p = lattice_pair_create(shape, 5, 2, NULL);
        pliant_body *still = lattice_pair_body(p, NULL);
        lattice_pair_rest(p);
        const int32_t n = p->particle_count;
        double *expected = calloc(3 * (size_t)n, sizeof *expected);
        assert_non_null(expected);
        const double gravity[3] = {0.5, -9.75, 1.25};
        assert_int_equal(pliant_body_set_gravity(p->body, (pliant_vec3){0.5f, -9.75f, 1.25f}), 0);
        for (int k = 0; k < 20; k++) {
            const int32_t i = (int32_t)(check_random_next(&random) * n);
            const pliant_vec3 value = {(float)check_random_next(&random) - 0.5f,
                                       (float)check_random_next(&random) - 0.5f,
                                       (float)check_random_next(&random) - 0.5f};
            const double rate = (k % 2 ? h : 1) / p->slow->mass[i];
            expected[3 * i] += rate * (double)value.x;
            expected[3 * i + 1] += rate * (double)value.y;
            expected[3 * i + 2] += rate * (double)value.z;
            assert_int_equal(k % 2 ? pliant_body_force(p->body, i, value)
                                   : pliant_body_impulse(p->body, i, value),
                             PLIANT_OK);
        }
        pliant_body_match(p->body, (float)h);
        pliant_body_match(still, (float)h);
        // Goals are the same but for the rotations' start.
        const double tolerance = 2 * lattice_pair_rounding(p) * lattice_pair_extent(p) / h;
        for (int32_t i = 0; i < n; i++)
            for (int c = 0; c < 3; c++)
                check_near(difference(p, p->body, still, i, c),
                           expected[3 * i + c] + h * gravity[c], tolerance);
        // Forces acted once.
        lattice_pair_rest(p);
        pliant_body_match(p->body, (float)h);
        for (int32_t i = 0; i < n; i++)
            for (int c = 0; c < 3; c++)
                check_near(difference(p, p->body, still, i, c), h * gravity[c], tolerance);
        free(expected);
        pliant_body_destroy(still);
        lattice_pair_destroy(p);
    }
}

// A thrown body follows a parabola: symplectic steps fall g h^2 n (n + 1) / 2.
static void thrown_bodies_fall_as_points_do(void **state)
{
    (void)state;
    check_random random = check_random_seed(10);
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_SPONGE, 5, 2, NULL);
    lattice_pair_deform(p, &random, 0.2);
    lattice_pair_velocities(p, &random, 1);
    assert_int_equal(pliant_body_set_gravity(p->body, (pliant_vec3){0, 0, -10}), PLIANT_OK);
    const pliant_body_motion before = pliant_body_measure(p->body);
    const int steps = 100;
    const double h = 0.0078125;
    for (int step = 0; step < steps; step++)
        assert_int_equal(pliant_body_step(p->body, (float)h), PLIANT_OK);
    const pliant_body_motion after = pliant_body_measure(p->body);
    check_near(after.mass, before.mass, 0);
    for (int c = 0; c < 3; c++) {
        const double fall = c == 2 ? -10 * h * h * steps * (steps + 1) / 2 : 0;
        const double speed = before.momentum[c] / before.mass;
        check_near(after.centre[c] - before.centre[c], h * steps * speed + fall, 1e-4);
        check_near(after.momentum[c] / after.mass - speed, c == 2 ? -10 * h * steps : 0, 1e-4);
    }
    lattice_pair_destroy(p);
}

// ---- Bits ----

static void damp_and_break(pliant_body_def *def)
{
    *def = pliant_body_default();
    def->damping = 0.2f;
    def->damping_interval = 2;
    def->rigid_damping = 0.01f;
    def->strain_limit = 0.3f;
}

static void threads_and_runs_give_the_same_bits(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        pliant_body_def def;
        damp_and_break(&def);
        lattice_pair *p = lattice_pair_create(shape, 7, 2, &def);
        const size_t bytes = (size_t)p->lattice->block_count * 3 * PLIANT_LANES * sizeof(float);
        float *x = malloc(bytes), *v = malloc(bytes);
        assert_true(x && v);
        int64_t broken = -1;
        for (int32_t threads = 0; threads <= 3; threads++) {  // twice with one
            def.thread_count = threads ? threads : 1;
            pliant_body_destroy(p->body);
            p->body = lattice_pair_body(p, &def);
            check_random random = {11};
            lattice_pair_deform(p, &random, 0.1);
            lattice_pair_velocities(p, &random, 3);
            for (int step = 0; step < 12; step++)
                assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
            if (threads > 0) {
                assert_memory_equal(x, p->body->x, bytes);
                assert_memory_equal(v, p->body->v, bytes);
                assert_int_equal(broken, pliant_body_broken_count(p->body));
            }
            memcpy(x, p->body->x, bytes);
            memcpy(v, p->body->v, bytes);
            broken = pliant_body_broken_count(p->body);
        }
        if (shape == CHECK_CELLS_CUBE) check_at_least(broken, 1);
        free(x);
        free(v);
        lattice_pair_destroy(p);
    }
}

// A copy goes on as the body does, from before, amid and after breaking; forces come along.
static void copies_go_on_bit_for_bit(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        pliant_body_def def;
        damp_and_break(&def);
        lattice_pair *p = lattice_pair_create(shape, 6, 2, &def);
        pliant_body *copy = lattice_pair_body(p, &def);
        check_random random = {12};
        lattice_pair_deform(p, &random, 0.1);
        lattice_pair_velocities(p, &random, 3);
        const size_t bytes = (size_t)p->lattice->block_count * 3 * PLIANT_LANES * sizeof(float);
        for (int turn = 0; turn < 5; turn++) {
            assert_int_equal(pliant_body_set_gravity(p->body, (pliant_vec3){0, (float)turn, 0}), 0);
            assert_int_equal(pliant_body_force(p->body, turn, (pliant_vec3){1, 2, 3}), 0);
            // The copy has been elsewhere: nothing of that is left.
            assert_int_equal(pliant_body_impulse(copy, 0, (pliant_vec3){9, 9, 9}), PLIANT_OK);
            for (int step = 0; step < 3; step++)
                assert_int_equal(pliant_body_step(copy, 0.01f), PLIANT_OK);
            assert_int_equal(pliant_body_copy(copy, p->body), PLIANT_OK);
            for (int step = 0; step < 3; step++) {
                assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
                assert_int_equal(pliant_body_step(copy, 0.01f), PLIANT_OK);
                assert_memory_equal(copy->x, p->body->x, bytes);
                assert_memory_equal(copy->v, p->body->v, bytes);
                assert_int_equal(pliant_body_broken_count(copy), pliant_body_broken_count(p->body));
            }
        }
        pliant_body_destroy(copy);
        lattice_pair_destroy(p);
    }
}

static void copies_between_strangers_are_refused(void **state)
{
    (void)state;
    pliant_body_def breakable;
    damp_and_break(&breakable);
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_CUBE, 3, 1, &breakable);
    lattice_pair *other = lattice_pair_create(CHECK_CELLS_CUBE, 3, 1, NULL);
    pliant_body *whole = lattice_pair_body(p, NULL);
    assert_int_equal(pliant_body_copy(p->body, other->body), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_copy(whole, p->body), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_copy(p->body, whole), PLIANT_OK);
    pliant_body_destroy(whole);
    lattice_pair_destroy(other);
    lattice_pair_destroy(p);
}

static void steps_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    check_random random = check_random_seed(13);
    for (int32_t threads = 1; threads <= 2; threads++) {
        pliant_body_def def;
        damp_and_break(&def);
        def.thread_count = threads;
        lattice_pair *p = lattice_pair_create(CHECK_CELLS_SPONGE, 7, 2, &def);
        pliant_body *copy = lattice_pair_body(p, &def);
        lattice_pair_deform(p, &random, 0.1);
        lattice_pair_velocities(p, &random, 4);
        const long before = atomic_load(&calls);
        for (int step = 0; step < 20; step++) {
            assert_int_equal(pliant_body_force(p->body, step, (pliant_vec3){1, 0, 0}), PLIANT_OK);
            assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
            assert_int_equal(pliant_body_copy(copy, p->body), PLIANT_OK);
            check_at_least(pliant_body_measure(p->body).mass, 1);
        }
        assert_int_equal(atomic_load(&calls) - before, 0);
        check_at_least(pliant_body_broken_count(p->body), 100);
        pliant_body_destroy(copy);
        lattice_pair_destroy(p);
    }
}

// ---- Refusals ----

static void what_is_not_finite_is_refused_without_effect(void **state)
{
    (void)state;
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_CUBE, 2, 1, NULL);
    const int32_t n = p->particle_count;
    pliant_vec3 *values = calloc((size_t)n, sizeof *values);
    assert_non_null(values);
    const size_t bytes = (size_t)p->lattice->block_count * 3 * PLIANT_LANES * sizeof(float);
    float *x = malloc(bytes), *v = malloc(bytes);
    assert_true(x && v);
    memcpy(x, p->body->x, bytes);
    memcpy(v, p->body->v, bytes);
    const float wrong[] = {NAN, INFINITY, -INFINITY};
    for (int k = 0; k < 9; k++) {
        pliant_vec3 value = {1, 2, 3};
        (&value.x)[k % 3] = wrong[k / 3];
        values[n - 1] = value;
        assert_int_equal(pliant_body_set_positions(p->body, values), PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_body_set_velocities(p->body, values), PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_body_set_gravity(p->body, value), PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_body_force(p->body, 0, value), PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_body_impulse(p->body, 0, value), PLIANT_ERR_ARGUMENT);
        assert_int_equal(pliant_body_step(p->body, wrong[k / 3]), PLIANT_ERR_ARGUMENT);
    }
    const pliant_vec3 one = {1, 1, 1};
    assert_int_equal(pliant_body_force(p->body, -1, one), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_force(p->body, n, one), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_impulse(p->body, -1, one), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_impulse(p->body, n, one), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_step(p->body, 0), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_step(p->body, -0.01f), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_set_damping(p->body, NAN, 1), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_set_damping(p->body, 1.5f, 1), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_set_damping(p->body, 0.5f, 0), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_set_rigid_damping(p->body, -0.5f), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_body_set_strain_limit(p->body, 0.5f), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_body_set_strain_limit(p->body, NAN), PLIANT_ERR_ARGUMENT);
    assert_memory_equal(x, p->body->x, bytes);
    assert_memory_equal(v, p->body->v, bytes);
    assert_int_equal(p->body->has_forces, 0);
    assert_int_equal(p->body->step_count, 0);
    free(x);
    free(v);
    free(values);
    lattice_pair_destroy(p);
}

static void definitions_out_of_range_are_refused(void **state)
{
    (void)state;
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_SINGLE, 1, 1, NULL);
    for (int k = 0; k < 12; k++) {
        pliant_body_def def = pliant_body_default();
        switch (k) {
        case 0:
            def.position.y = NAN;
            break;
        case 1:
            def.velocity.z = INFINITY;
            break;
        case 2:
            def.rotation[3] = 0;
            break;
        case 3:
            def.rotation[0] = NAN;
            break;
        case 4:
            def.damping = -0.1f;
            break;
        case 5:
            def.damping = NAN;
            break;
        case 6:
            def.damping_interval = 0;
            break;
        case 7:
            def.rigid_damping = 1.1f;
            break;
        case 8:
            def.strain_limit = -1;
            break;
        case 9:
            def.strain_limit = NAN;
            break;
        case 10:
            def.thread_count = 0;
            break;
        default:
            def.thread_count = 65;
            break;
        }
        pliant_body *body = NULL;
        pliant_error err = {""};
        assert_int_equal(pliant_body_create(p->lattice, &def, &body, &err), PLIANT_ERR_ARGUMENT);
        assert_null(body);
        assert_non_null(strstr(err.text, "expected"));
    }
    lattice_pair_destroy(p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(steps_follow_the_reference),
        cmocka_unit_test(damped_steps_follow_the_reference),
        cmocka_unit_test(rigid_motions_are_fixed_points),
        cmocka_unit_test(bodies_begin_where_their_definition_says),
        cmocka_unit_test(gravity_forces_and_impulses_are_exact),
        cmocka_unit_test(thrown_bodies_fall_as_points_do),
        cmocka_unit_test(threads_and_runs_give_the_same_bits),
        cmocka_unit_test(copies_go_on_bit_for_bit),
        cmocka_unit_test(copies_between_strangers_are_refused),
        cmocka_unit_test(steps_allocate_nothing),
        cmocka_unit_test(what_is_not_finite_is_refused_without_effect),
        cmocka_unit_test(definitions_out_of_range_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
