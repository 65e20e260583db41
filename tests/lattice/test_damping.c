// test_damping.c: LSM-13, 14 by fast sums, to rounding, on every shape; only what is not rigid
// dies.
//
// With P_r the projections onto region r's rigid velocities, damping is v += k (S v - v), S = M^-1
// sum P_r, weighed by m~: symmetric by mass and between 0 and 1, so that kinetic energy cannot
// grow.
#include "allocations.h"

#include "lattice/damping.h"
#include "lattice_pair.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const int32_t widths[] = {1, 2, 3, 5};

static int32_t size_for(check_cells shape, int32_t w)
{
    if (shape == CHECK_CELLS_TORUS) return 10;
    if (shape == CHECK_CELLS_TWO) return 4;
    return w > 3 ? 8 : 6;
}

// Where sums are taken about; a match would have set it.
static void set_origin(lattice_pair *p)
{
    for (int c = 0; c < 3; c++) {
        double middle = 0;
        for (int32_t i = 0; i < p->particle_count; i++)
            middle += p->slow->x[3 * i + c] / p->particle_count;
        p->body->origin[c] = (float)middle;
    }
}

static double speed_of(const lattice_pair *p)
{
    double speed = 0;
    for (int32_t i = 0; i < 3 * p->particle_count; i++) speed = fmax(speed, fabs(p->slow->v[i]));
    return speed;
}

// The worst difference of velocities.
static double apart(const lattice_pair *p)
{
    double worst = 0;
    for (int32_t i = 0; i < p->particle_count; i++)
        for (int c = 0; c < 3; c++) {
            const double off =
                (double)p->body->v[p->lattice->slot[i] + PLIANT_LANES * c] - p->slow->v[3 * i + c];
            worst = isfinite(off) ? fmax(worst, fabs(off)) : INFINITY;
        }
    return worst;
}

// omega = I^-1 L: I is raised by 1e-5 of its trace and by 1e-6 of M E^2, which is what rounding
// makes of it at that extent. v follows by that over the least eigenvalue of I, which is half the
// trace or so in the thick, (a / 2)^2 in the thin of one cell.
static double tolerance_of(const lattice_pair *p, double speed)
{
    const double extent = lattice_pair_extent(p), a = p->cell_size;
    const double trace = 2 * pow((p->half_width + 0.5) * a, 2);
    const double least = 0.25 * a * a;
    return speed * (2.5e-6 * trace + 5e-7 * extent * extent) / least;
}

static void damping_equals_the_reference(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    double worst = 0, used = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int i = 0; i < 4; i++)
            for (int breakable = 0; breakable < 2; breakable++) {
                pliant_body_def def = pliant_body_default();
                def.strain_limit = breakable ? 1e6f : 0;
                lattice_pair *p =
                    lattice_pair_create(shape, size_for(shape, widths[i]), widths[i], &def);
                lattice_pair_deform(p, &random, 0.2);
                lattice_pair_velocities(p, &random, 1);
                set_origin(p);
                const double tolerance = tolerance_of(p, 1);
                check_at_most(tolerance, 0.05);
                pliant_body_damp(p->body, 0.75f);
                reference_lattice_damp(p->slow, 0.75);
                const double off = apart(p);
                worst = fmax(worst, off), used = fmax(used, off / tolerance);
                if (off > tolerance)
                    print_error("%s, w = %d\n", check_cell_shape_name(shape), widths[i]);
                check_at_most(off, tolerance);
                lattice_pair_destroy(p);
            }
    print_message("off by at most %.2g m/s of 1 m/s, %.2f of the tolerance\n", worst, used);
}

static void rigid_damping_equals_the_reference(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int far = 0; far < 2; far++) {
            lattice_pair *p = lattice_pair_create(shape, 6, 1, NULL);
            lattice_pair_deform(p, &random, 0.2);
            for (int32_t i = 0; i < 3 * p->particle_count; i++) p->slow->x[i] += far ? 500 : 0;
            lattice_pair_velocities(p, &random, 1);
            set_origin(p);
            pliant_body_damp_rigid(p->body, 0.4f);
            reference_lattice_damp_rigid(p->slow, (double)0.4f);
            // Far away the middle itself is rounded: omega, of 1 / s or so, times an ulp.
            check_at_most(apart(p), 1e-5 + (far ? 500 * 1.2e-7 : 0));
            lattice_pair_destroy(p);
        }
}

// v + omega cross x, k = 1: to rounding, far away too, however wide the body.
static void rigid_motions_are_not_damped(void **state)
{
    (void)state;
    const double spin[3] = {3, -2, 5};
    double worst = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int i = 0; i < 4; i++)
            for (int far = 0; far < 2; far++) {
                check_random random = {3};
                lattice_pair *p =
                    lattice_pair_create(shape, size_for(shape, widths[i]), widths[i], NULL);
                lattice_pair_deform(p, &random, 0.2);
                for (int32_t j = 0; j < p->particle_count; j++)
                    for (int c = 0; c < 3; c++)
                        p->slow->v[3 * j + c] =
                            10 + spin[(c + 1) % 3] * p->slow->x[3 * j + (c + 2) % 3] -
                            spin[(c + 2) % 3] * p->slow->x[3 * j + (c + 1) % 3];
                for (int32_t j = 0; j < 3 * p->particle_count; j++) p->slow->x[j] += far ? 300 : 0;
                lattice_pair_set(p);
                set_origin(p);
                const double speed = speed_of(p);
                // Positions far away have lost digits that velocities have: omega times an ulp.
                const double tolerance = 2e-6 * speed + (far ? 10 * 300 * 1.2e-7 : 0);
                pliant_body_damp(p->body, 1);
                check_at_most(apart(p), tolerance);
                worst = fmax(worst, apart(p) / tolerance);
                pliant_body_damp_rigid(p->body, 1);
                check_at_most(apart(p), 2 * tolerance);
                lattice_pair_destroy(p);
            }
    print_message("off by at most %.2f of the tolerance\n", worst);
}

static void kinetic_energy_falls_and_momenta_stay(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int i = 0; i < 4; i++)
            for (int scattered = 0; scattered < 2; scattered++) {
                lattice_pair *p =
                    lattice_pair_create(shape, size_for(shape, widths[i]), widths[i], NULL);
                if (scattered) lattice_pair_scatter(p, &random, 6);
                else lattice_pair_deform(p, &random, 0.3);
                lattice_pair_velocities(p, &random, 1);
                set_origin(p);
                pliant_body_motion before = pliant_body_measure(p->body);
                const double extent = lattice_pair_extent(p);
                for (int n = 0; n < 6; n++) {
                    const float k = n % 3 == 0 ? 1 : n % 3 == 1 ? 0.5f : 0.1f;
                    if (n < 3) pliant_body_damp(p->body, k);
                    else pliant_body_damp_rigid(p->body, k);
                    const pliant_body_motion after = pliant_body_measure(p->body);
                    const double push = lattice_pair_rounding(p) * after.mass;  // of 1 m/s
                    check_at_most(after.kinetic_energy, before.kinetic_energy * (1 + 1e-5));
                    for (int c = 0; c < 3; c++) {
                        check_near(after.momentum[c], before.momentum[c], push);
                        check_near(after.angular_momentum[c], before.angular_momentum[c],
                                   push * extent);
                    }
                    before = after;
                }
                lattice_pair_destroy(p);
            }
}

// k = 1, every region the whole: all that is left is the rigid motion, so that once more changes
// nothing.
static void full_damping_leaves_the_rigid_motion(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_CUBE, 3, 3, NULL);
    lattice_pair_deform(p, &random, 0.2);
    lattice_pair_velocities(p, &random, 1);
    set_origin(p);
    pliant_body_damp(p->body, 1);
    lattice_pair_read(p);
    pliant_body_damp_rigid(p->body, 1);
    check_at_most(apart(p), 1e-4);  // what is raised
    lattice_pair_read(p);
    pliant_body_damp(p->body, 1);
    check_at_most(apart(p), 1e-6);
    lattice_pair_destroy(p);
}

static void damping_runs_every_so_many_steps(void **state)
{
    (void)state;
    check_random random = check_random_seed(6);
    for (int32_t interval = 1; interval <= 4; interval++) {
        pliant_body_def def = pliant_body_default();
        lattice_pair *p = lattice_pair_create(CHECK_CELLS_BALL, 5, 1, &def);
        def.damping = 0.5f;
        def.damping_interval = interval;
        pliant_body *damped = lattice_pair_body(p, &def);
        lattice_pair_deform(p, &random, 0.2);
        lattice_pair_velocities(p, &random, 1);
        assert_int_equal(pliant_body_copy(damped, p->body), PLIANT_OK);
        const size_t bytes = (size_t)p->lattice->block_count * 3 * PLIANT_LANES * sizeof(float);
        for (int n = 0; n < 9; n++) {
            assert_int_equal(pliant_body_copy(p->body, damped), PLIANT_OK);
            assert_int_equal(pliant_body_step(damped, 0.01f), PLIANT_OK);
            assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
            const int is_same = !memcmp(p->body->v, damped->v, bytes);
            assert_int_equal(is_same, n % interval != 0);
        }
        // Off, and on again.
        assert_int_equal(pliant_body_set_damping(damped, 0, 1), PLIANT_OK);
        assert_int_equal(pliant_body_copy(p->body, damped), PLIANT_OK);
        assert_int_equal(pliant_body_step(damped, 0.01f), PLIANT_OK);
        assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
        assert_memory_equal(p->body->v, damped->v, bytes);
        pliant_body_destroy(damped);
        lattice_pair_destroy(p);
    }
}

// Inertia is singular on a line and at a point: nothing turns about it, nothing blows up.
static void lines_and_points_are_damped_like_the_reference(void **state)
{
    (void)state;
    check_random random = check_random_seed(7);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int is_point = 0; is_point < 2; is_point++)
            for (int whole = 0; whole < 2; whole++) {
                lattice_pair *p = lattice_pair_create(shape, 5, 2, NULL);
                lattice_pair_rest(p);
                for (int32_t i = 0; i < p->particle_count; i++) {
                    if (is_point) p->slow->x[3 * i] = 0.25;
                    p->slow->x[3 * i + 1] = p->slow->x[3 * i + 2] = 0.25;
                }
                lattice_pair_velocities(p, &random, 1);
                set_origin(p);
                if (is_point) p->body->origin[0] = p->body->origin[1] = p->body->origin[2] = 0.25f;
                else p->body->origin[1] = p->body->origin[2] = 0.25f;
                if (whole) pliant_body_damp_rigid(p->body, 0.5f);
                else pliant_body_damp(p->body, 0.5f);
                assert_true(lattice_pair_is_finite(p));
                if (whole) reference_lattice_damp_rigid(p->slow, 0.5);
                else reference_lattice_damp(p->slow, 0.5);
                if (apart(p) > 1e-3) print_error("%s\n", check_cell_shape_name(shape));
                check_at_most(apart(p), whole || is_point ? 1e-5 : 1e-3);
                lattice_pair_destroy(p);
            }
}

static void damping_allocates_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    check_random random = check_random_seed(8);
    for (int32_t threads = 1; threads <= 3; threads += 2) {
        pliant_body_def def = pliant_body_default();
        def.thread_count = threads;
        lattice_pair *p = lattice_pair_create(CHECK_CELLS_COMB, 6, 3, &def);
        lattice_pair_deform(p, &random, 0.2);
        const long before = atomic_load(&calls);
        for (int n = 0; n < 5; n++) {
            pliant_body_damp(p->body, 0.5f);
            pliant_body_damp_rigid(p->body, 0.5f);
        }
        assert_int_equal(atomic_load(&calls) - before, 0);
        lattice_pair_destroy(p);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(damping_equals_the_reference),
        cmocka_unit_test(rigid_damping_equals_the_reference),
        cmocka_unit_test(rigid_motions_are_not_damped),
        cmocka_unit_test(kinetic_energy_falls_and_momenta_stay),
        cmocka_unit_test(full_damping_leaves_the_rigid_motion),
        cmocka_unit_test(damping_runs_every_so_many_steps),
        cmocka_unit_test(lines_and_points_are_damped_like_the_reference),
        cmocka_unit_test(damping_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
