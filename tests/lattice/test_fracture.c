// test_fracture.c: what breaks stays broken, and what is left is a lattice of what still holds.
//
// The reference breaks the same links and finds all regions anew.
#include "allocations.h"

#include "lattice_pair.h"

#include <math.h>
#include <string.h>

static pliant_body_def breakable(float limit)
{
    pliant_body_def def = pliant_body_default();
    def.strain_limit = limit;
    return def;
}

static int32_t size_for(check_cells shape)
{
    return shape == CHECK_CELLS_TORUS ? 9 : shape == CHECK_CELLS_TWO ? 4 : 6;
}

// Put the body where slow->x says and let it break there, without a step of its own.
static int64_t break_here(lattice_pair *p)
{
    lattice_pair_set(p);
    for (int c = 0; c < 3; c++) {
        double middle = 0;
        for (int32_t i = 0; i < p->particle_count; i++)
            middle += p->slow->x[3 * i + c] / p->particle_count;
        p->body->origin[c] = (float)middle;
    }
    return pliant_fracture_break(p->body);
}

static double length_of_link(const lattice_pair *p, int32_t i, int32_t j)
{
    double now = 0, rest = 0;
    for (int c = 0; c < 3; c++) {
        now += pow(p->slow->x[3 * i + c] - p->slow->x[3 * j + c], 2);
        rest += pow(p->slow->x0[3 * i + c] - p->slow->x0[3 * j + c], 2);
    }
    return sqrt(now / rest);
}

// Regions are those of a body built from scratch of the links that hold.
static void check_regions(const lattice_pair *p)
{
    const pliant_fracture *f = p->body->fracture;
    int32_t irregular = 0;
    for (int32_t i = 0; i < p->particle_count; i++) {
        pliant_reach reach;
        const int32_t *at = p->slow->particles + 3 * i;
        assert_int_equal(f->size[i], p->slow->region_offset[i + 1] - p->slow->region_offset[i]);
        pliant_links_reach(f->links, at[0], at[1], at[2], p->half_width, &reach);
        irregular += !reach.is_regular;
    }
    assert_int_equal(f->irregular.region_count, irregular);
    lattice_pair_check_constants(p);
}

// ---- Which links break ----

static void links_break_when_they_are_too_long_and_only_then(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    const double limit = 0.25;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        const pliant_body_def def = breakable((float)limit);
        lattice_pair *p = lattice_pair_create(shape, size_for(shape), 1, &def);
        lattice_pair_rest(p);
        for (int32_t i = 0; i < 3 * p->particle_count; i++)
            p->slow->x[i] += 0.2 * p->cell_size * (2 * check_random_next(&random) - 1);
        const int64_t broken = break_here(p);
        int64_t expected = 0;
        for (int32_t i = 0; i < p->particle_count; i++)
            for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
                const int32_t *at = p->slow->particles + 3 * i;
                int32_t step[3];
                pliant_link_direction(d, step);
                if (!pliant_links_has(p->lattice->links, at[0], at[1], at[2], d)) continue;
                const int32_t j = pliant_links_particle(p->lattice->links, at[0] + step[0],
                                                        at[1] + step[1], at[2] + step[2]);
                const double length = length_of_link(p, i, j);
                const int holds =
                    pliant_links_has(p->body->fracture->links, at[0], at[1], at[2], d);
                if (fabs(length - 1 - limit) > 1e-6) assert_int_equal(holds, length < 1 + limit);
                expected += !holds;
            }
        assert_int_equal(broken, expected);
        assert_int_equal(pliant_body_broken_count(p->body), expected);
        if (shape != CHECK_CELLS_SINGLE) check_at_least(broken, 10);
        // Where it is, nothing more breaks; back at rest, nothing mends.
        assert_int_equal(pliant_fracture_break(p->body), 0);
        memcpy(p->slow->x, p->slow->x0, 3 * (size_t)p->particle_count * sizeof(double));
        assert_int_equal(break_here(p), 0);
        assert_int_equal(lattice_pair_follow_breaks(p), expected);
        lattice_pair_destroy(p);
    }
}

static void links_below_the_limit_hold(void **state)
{
    (void)state;
    const pliant_body_def def = breakable(0.25f);
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_BALL, 6, 2, &def);
    for (int32_t i = 0; i < p->particle_count; i++)
        for (int c = 0; c < 3; c++)
            p->slow->x[3 * i + c] = p->slow->x0[3 * i + c] * (c == 1 ? 1.2499 : 0.1);
    assert_int_equal(break_here(p), 0);
    assert_int_equal(pliant_body_broken_count(p->body), 0);
    // Along y, and along all diagonals: (0.1, 1.25, 0.1) is shorter than 1.25 times (1, 1, 1).
    for (int32_t i = 0; i < p->particle_count; i++) p->slow->x[3 * i + 1] *= 1.2501 / 1.2499;
    check_at_least((double)break_here(p), 1);
    lattice_pair_destroy(p);
    // Breakable at infinity: never.
    const pliant_body_def never = breakable(INFINITY);
    p = lattice_pair_create(CHECK_CELLS_BALL, 6, 2, &never);
    check_random random = check_random_seed(2);
    lattice_pair_scatter(p, &random, 1000);
    for (int step = 0; step < 5; step++)
        assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
    assert_int_equal(pliant_body_broken_count(p->body), 0);
    lattice_pair_destroy(p);
}

// ---- What is left ----

// Cuts at random, more and more, down to dust.
static void goals_after_random_breaks_equal_rebuilt_regions(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    double worst = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 3; w++) {
            const pliant_body_def def = breakable(0.5f);
            lattice_pair *p = lattice_pair_create(shape, size_for(shape), w, &def);
            int64_t total = 0;
            for (int turn = 0; turn < 3; turn++) {
                lattice_pair_rest(p);
                const double noise = 0.24 + 0.03 * turn;
                for (int32_t i = 0; i < 3 * p->particle_count; i++)
                    p->slow->x[i] += noise * p->cell_size * (2 * check_random_next(&random) - 1);
                total += break_here(p);
                assert_int_equal(lattice_pair_follow_breaks(p), total);
                check_regions(p);
                lattice_pair_deform(p, &random, 0.2);
                lattice_pair_check_goals(p);
            }
            if (shape != CHECK_CELLS_SINGLE) check_at_least((double)total, 10);
            worst = fmax(worst, p->worst);
            lattice_pair_destroy(p);
        }
    print_message("off by at most %.3f of the tolerance\n", worst);
}

// Stretch apart what lies on either side of a plane: everything that crosses it breaks.
static int64_t cut_plane(lattice_pair *p, int axis, double at)
{
    memcpy(p->slow->x, p->slow->x0, 3 * (size_t)p->particle_count * sizeof(double));
    for (int32_t i = 0; i < p->particle_count; i++)
        if (p->slow->particles[3 * i + axis] > at) p->slow->x[3 * i + axis] += 3 * p->cell_size;
    return break_here(p);
}

static void goals_after_staged_cuts_equal_rebuilt_regions(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    double worst = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 3; w++) {
            const pliant_body_def def = breakable(1);
            lattice_pair *p = lattice_pair_create(shape, size_for(shape), w, &def);
            int64_t total = 0;
            for (int turn = 0; turn < 5; turn++) {
                // Planes across each axis; some are cut twice, where nothing is left to break.
                total += cut_plane(p, turn % 3, turn < 3 ? 2.5 : 4.5);
                assert_int_equal(cut_plane(p, turn % 3, turn < 3 ? 2.5 : 4.5), 0);
                assert_int_equal(lattice_pair_follow_breaks(p), total);
                assert_int_equal(pliant_body_broken_count(p->body), total);
                check_regions(p);
                lattice_pair_deform(p, &random, 0.2);
                lattice_pair_check_goals(p);
            }
            worst = fmax(worst, p->worst);
            lattice_pair_destroy(p);
        }
    print_message("off by at most %.3f of the tolerance\n", worst);
}

// Everything that can break is broken: every particle is alone, and its goal is where it is.
static void dust_stays_where_it_is(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    for (int32_t w = 1; w <= 3; w++) {
        const pliant_body_def def = breakable(0.5f);
        lattice_pair *p = lattice_pair_create(CHECK_CELLS_CUBE, 4, w, &def);
        for (int32_t i = 0; i < 3 * p->particle_count; i++) p->slow->x[i] = 10 * p->slow->x0[i];
        const int64_t broken = break_here(p);
        int64_t links = 0;
        for (int32_t i = 0; i < p->particle_count; i++)
            links += p->slow->ring_offset[i + 1] - p->slow->ring_offset[i];
        assert_int_equal(broken, links / 2);
        lattice_pair_follow_breaks(p);
        check_regions(p);
        lattice_pair_scatter(p, &random, 5);
        lattice_pair_velocities(p, &random, 1);
        double *v = malloc(3 * (size_t)p->particle_count * sizeof *v);
        assert_non_null(v);
        memcpy(v, p->slow->v, 3 * (size_t)p->particle_count * sizeof *v);
        pliant_body_match(p->body, 1);
        const double tolerance = lattice_pair_rounding(p) * lattice_pair_extent(p);
        for (int32_t i = 0; i < 3 * p->particle_count; i++)
            check_near((double)p->body->v[p->lattice->slot[i / 3] + PLIANT_LANES * (i % 3)], v[i],
                       tolerance + 1e-6);
        free(v);
        lattice_pair_destroy(p);
    }
}

// Breaking in steps of its own motion, held against the reference link by link and step by step.
static void bodies_torn_apart_follow_the_reference(void **state)
{
    (void)state;
    check_random random = check_random_seed(6);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 2; w++) {
            const pliant_body_def def = breakable(0.2f);
            lattice_pair *p = lattice_pair_create(shape, size_for(shape), w, &def);
            lattice_pair_rest(p);
            for (int32_t i = 0; i < p->particle_count; i++)
                for (int c = 0; c < 3; c++)
                    p->slow->v[3 * i + c] = (p->slow->particles[3 * i] > 2 ? 4 : -4) * (c == 0) +
                                            check_random_next(&random) - 0.5;
            lattice_pair_set(p);
            for (int step = 0; step < 10; step++) {
                assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
                reference_lattice_step(p->slow, &(reference_step){.dt = (double)0.01f});
                for (int32_t i = 0; i < p->particle_count; i++)
                    for (int c = 0; c < 3; c++)
                        check_near((double)p->body->x[p->lattice->slot[i] + PLIANT_LANES * c],
                                   p->slow->x[3 * i + c], 1e-4 * p->cell_size * (step + 1));
                // Links at the limit may go either way: the body decides.
                lattice_pair_follow_breaks(p);
                lattice_pair_read(p);
            }
            if (shape != CHECK_CELLS_SINGLE && shape != CHECK_CELLS_TWO)
                check_at_least((double)pliant_body_broken_count(p->body), 3);
            lattice_pair_destroy(p);
        }
}

// ---- Pieces ----

// Two pieces of one body. The smaller one flies a million cells away: the other's goals keep their
// digits. Where the larger one leaves, sums are taken about it, and the smaller one's goals are as
// exact as floats are at that distance: here of a thousand cells.
static void pieces_that_fly_away_are_forgotten(void **state)
{
    (void)state;
    check_random random = check_random_seed(7);
    static const check_cells shapes[] = {CHECK_CELLS_CUBE, CHECK_CELLS_SPONGE, CHECK_CELLS_COMB};
    for (int s = 0; s < 3; s++)
        for (int32_t w = 1; w <= 3; w++)
            for (int larger_leaves = 0; larger_leaves < 2; larger_leaves++) {
                const pliant_body_def def = breakable(1);
                lattice_pair *p = lattice_pair_create(shapes[s], 6, w, &def);
                const double plane = larger_leaves ? 1.5 : 4.5;
                check_at_least((double)cut_plane(p, 0, plane), 10);
                lattice_pair_follow_breaks(p);
                lattice_pair_deform(p, &random, 0.2);
                lattice_pair_goals(p);
                lattice_pair_tolerances(p);
                for (int32_t i = 0; i < p->particle_count; i++)
                    if (p->slow->particles[3 * i] > plane)
                        p->slow->x[3 * i] += (larger_leaves ? 1e3 : 1e6) * p->cell_size;
                lattice_pair_goals(p);
                if (larger_leaves) lattice_pair_tolerances(p);  // with that extent
                for (int32_t i = 0; i < p->particle_count; i++)
                    for (int c = 0; c < 3 && p->slow->particles[3 * i] < plane; c++)
                        check_near(p->goals[3 * i + c], p->slow_goals[3 * i + c], p->tolerance[i]);
                lattice_pair_destroy(p);
            }
}

static void momenta_are_kept_through_breaking(void **state)
{
    (void)state;
    check_random random = check_random_seed(8);
    for (check_cells shape = 1; shape < CHECK_CELLS_SHAPES; shape++) {
        const pliant_body_def def = breakable(0.15f);
        lattice_pair *p = lattice_pair_create(shape, 6, 2, &def);
        lattice_pair_deform(p, &random, 0.1);
        lattice_pair_velocities(p, &random, 4);
        const pliant_body_motion before = pliant_body_measure(p->body);
        const double h = 0.01;
        const int steps = 20;
        for (int step = 0; step < steps; step++)
            assert_int_equal(pliant_body_step(p->body, (float)h), PLIANT_OK);
        check_at_least((double)pliant_body_broken_count(p->body), 10);
        const pliant_body_motion after = pliant_body_measure(p->body);
        // What test_motion allows a step, and pieces go apart: extent as it is at the end.
        lattice_pair_read(p);
        const double extent = lattice_pair_extent(p);
        const double bound = steps * before.mass * lattice_pair_rounding(p) * extent / h;
        for (int c = 0; c < 3; c++) {
            check_near(after.momentum[c], before.momentum[c], bound);
            check_near(after.angular_momentum[c], before.angular_momentum[c],
                       bound * extent + steps * 2e-6 * before.mass * extent * extent / h);
        }
        lattice_pair_destroy(p);
    }
}

// ---- Life ----

static void breaking_allocates_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    check_random random = check_random_seed(9);
    const pliant_body_def def = breakable(0.5f);
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_BALL, 8, 3, &def);
    int64_t broken = 0;
    for (int turn = 0; turn < 10; turn++) {
        lattice_pair_rest(p);
        lattice_pair_velocities(p, &random, 2 + turn);  // 0.2 cells a step, and more
        const long before = atomic_load(&calls);
        assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
        assert_int_equal(atomic_load(&calls) - before, 0);
        const int64_t now = pliant_body_broken_count(p->body);
        assert_true(now >= broken);
        broken = now;
    }
    check_at_least((double)broken, 1000);
    lattice_pair_destroy(p);
}

// A copy of a whole body mends; one of a broken body is broken alike, whatever it was before.
static void copies_take_what_is_broken(void **state)
{
    (void)state;
    check_random random = check_random_seed(10);
    const pliant_body_def def = breakable(0.5f);
    for (int32_t w = 1; w <= 3; w++) {
        lattice_pair *p = lattice_pair_create(CHECK_CELLS_SPONGE, 6, w, &def);
        pliant_body *whole = lattice_pair_body(p, NULL), *mine = p->body;
        pliant_body *other = lattice_pair_body(p, &def);
        cut_plane(p, 0, 2.5);
        cut_plane(p, 1, 3.5);
        const int64_t broken = pliant_body_broken_count(mine);
        check_at_least((double)broken, 10);
        lattice_pair_follow_breaks(p);
        // The other is broken elsewhere first.
        p->body = other;
        check_at_least((double)cut_plane(p, 2, 1.5), 10);
        assert_int_equal(pliant_body_copy(other, mine), PLIANT_OK);
        assert_int_equal(pliant_body_broken_count(other), broken);
        assert_int_equal(lattice_pair_follow_breaks(p), broken);
        check_regions(p);
        lattice_pair_deform(p, &random, 0.2);
        lattice_pair_check_goals(p);
        // It breaks on from there.
        cut_plane(p, 2, 2.5);
        lattice_pair_follow_breaks(p);
        check_regions(p);
        lattice_pair_deform(p, &random, 0.2);
        lattice_pair_check_goals(p);
        // Mended, and broken once more.
        assert_int_equal(pliant_body_copy(mine, whole), PLIANT_OK);
        assert_int_equal(pliant_body_broken_count(mine), 0);
        p->body = mine;
        reference_lattice *slow = p->slow;
        lattice_pair *fresh = lattice_pair_create(CHECK_CELLS_SPONGE, 6, w, NULL);
        p->slow = fresh->slow;
        fresh->slow = slow;
        check_regions(p);
        lattice_pair_deform(p, &random, 0.2);
        lattice_pair_check_goals(p);
        cut_plane(p, 1, 2.5);
        lattice_pair_follow_breaks(p);
        check_regions(p);
        lattice_pair_deform(p, &random, 0.2);
        lattice_pair_check_goals(p);
        lattice_pair_destroy(fresh);
        pliant_body_destroy(whole);
        pliant_body_destroy(other);
        lattice_pair_destroy(p);
    }
}

static void limits_can_be_changed(void **state)
{
    (void)state;
    check_random random = check_random_seed(11);
    const pliant_body_def def = breakable(100);
    lattice_pair *p = lattice_pair_create(CHECK_CELLS_CUBE, 4, 1, &def);
    lattice_pair_deform(p, &random, 0.3);
    assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
    assert_int_equal(pliant_body_broken_count(p->body), 0);
    assert_int_equal(pliant_body_set_strain_limit(p->body, 0.1f), PLIANT_OK);
    lattice_pair_deform(p, &random, 0.3);
    assert_int_equal(pliant_body_step(p->body, 0.01f), PLIANT_OK);
    check_at_least((double)pliant_body_broken_count(p->body), 10);
    assert_int_equal(pliant_body_set_strain_limit(p->body, 0), PLIANT_ERR_ARGUMENT);
    lattice_pair_destroy(p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(links_break_when_they_are_too_long_and_only_then),
        cmocka_unit_test(links_below_the_limit_hold),
        cmocka_unit_test(goals_after_random_breaks_equal_rebuilt_regions),
        cmocka_unit_test(goals_after_staged_cuts_equal_rebuilt_regions),
        cmocka_unit_test(dust_stays_where_it_is),
        cmocka_unit_test(bodies_torn_apart_follow_the_reference),
        cmocka_unit_test(pieces_that_fly_away_are_forgotten),
        cmocka_unit_test(momenta_are_kept_through_breaking),
        cmocka_unit_test(breaking_allocates_nothing),
        cmocka_unit_test(copies_take_what_is_broken),
        cmocka_unit_test(limits_can_be_changed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
