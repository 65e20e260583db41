// test_reference_lattice.c: the slow FastLSM that fast ones are held against does what LSM says.
#include "check.h"

#include "cell_shapes.h"
#include "reference_lattice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double uniform(check_random *random)
{
    return 2 * check_random_next(random) - 1;
}

static reference_lattice *create(check_cells shape, int32_t size, int32_t half_width,
                                 const double *mass)
{
    const int32_t count = check_cell_shape(shape, size, NULL);
    int32_t *cells = malloc((size_t)count * 3 * sizeof *cells);
    assert_non_null(cells);
    check_cell_shape(shape, size, cells);
    reference_lattice *l = reference_lattice_create(count, cells, half_width, 0.5, mass);
    free(cells);
    return l;
}

static int is_member(const reference_lattice *l, int32_t r, int32_t i)
{
    for (int32_t k = l->region_offset[r]; k < l->region_offset[r + 1]; k++)
        if (l->region[k] == i) return 1;
    return 0;
}

static int32_t size_of(const reference_lattice *l, int32_t r)
{
    return l->region_offset[r + 1] - l->region_offset[r];
}

static int32_t find(const reference_lattice *l, int32_t x, int32_t y, int32_t z)
{
    const int32_t i = reference_lattice_find(l, (const int32_t[3]){x, y, z});
    assert_true(i >= 0);
    return i;
}

// Each region has itself, ascending members, and is mutual.
static void check_regions(const reference_lattice *l)
{
    for (int32_t r = 0; r < l->particle_count; r++) {
        assert_true(is_member(l, r, r));
        for (int32_t k = l->region_offset[r]; k < l->region_offset[r + 1]; k++) {
            if (k > l->region_offset[r]) assert_true(l->region[k] > l->region[k - 1]);
            assert_true(is_member(l, l->region[k], r));
        }
    }
}

// ---- Shapes and regions ----

static void shapes_have_the_cells_they_say(void **state)
{
    (void)state;
    static const int32_t counts[CHECK_CELLS_SHAPES] = {
        [CHECK_CELLS_SINGLE] = 1,
        [CHECK_CELLS_CUBE] = 216,
        [CHECK_CELLS_COMB] = 2 * (11 + 6 * 5),
        [CHECK_CELLS_CHECKER] = 108,
        [CHECK_CELLS_CORNERS] = 54,
        [CHECK_CELLS_TWO] = 432,
        [CHECK_CELLS_FOLDED] = 78,
    };
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        const int32_t count = check_cell_shape(shape, 6, NULL);
        if (counts[shape]) assert_int_equal(count, counts[shape]);
        assert_in_range(count, 1, 13 * 13 * 13);
        assert_true(strlen(check_cell_shape_name(shape)) > 0);
        int32_t *cells = malloc((size_t)count * 3 * sizeof *cells);
        assert_non_null(cells);
        assert_int_equal(check_cell_shape(shape, 6, cells), count);
        int32_t last = -1;
        for (int32_t i = 0; i < count; i++) {
            const int32_t key = (cells[3 * i + 2] * 100 + cells[3 * i + 1]) * 100 + cells[3 * i];
            assert_true(key > last);
            last = key;
        }
        free(cells);
    }
}

static void particles_are_corners_in_order(void **state)
{
    (void)state;
    reference_lattice *l = create(CHECK_CELLS_SINGLE, 1, 1, NULL);
    assert_int_equal(l->particle_count, 8);
    for (int32_t i = 0; i < 8; i++) {
        for (int axis = 0; axis < 3; axis++) {
            assert_int_equal(l->particles[3 * i + axis], i >> axis & 1);
            check_near(l->x0[3 * i + axis], 0.5 * (i >> axis & 1), 0);
        }
        assert_int_equal(size_of(l, i), 8);
    }
    reference_lattice_destroy(l);
}

// Inside a cube R_r is the box of side 2 w + 1, at the boundary the box cut.
static void regions_of_a_cube_are_boxes(void **state)
{
    (void)state;
    for (int32_t w = 1; w <= 4; w++) {
        reference_lattice *l = create(CHECK_CELLS_CUBE, 5, w, NULL);
        assert_int_equal(l->particle_count, 216);
        check_regions(l);
        for (int32_t r = 0; r < l->particle_count; r++) {
            int32_t expected = 1;
            for (int axis = 0; axis < 3; axis++) {
                const int32_t p = l->particles[3 * r + axis];
                expected *= (p + w > 5 ? 5 : p + w) - (p - w < 0 ? 0 : p - w) + 1;
            }
            assert_int_equal(size_of(l, r), expected);
        }
        reference_lattice_destroy(l);
    }
}

static void regions_do_not_leap_gaps(void **state)
{
    (void)state;
    reference_lattice *two = create(CHECK_CELLS_TWO, 3, 5, NULL);
    check_regions(two);
    for (int32_t r = 0; r < two->particle_count; r++) assert_int_equal(size_of(two, r), 64);
    reference_lattice_destroy(two);

    // The upper sheet is a long way round: x - 1 cells there, one up, x - 1 back.
    // back.
    reference_lattice *folded = create(CHECK_CELLS_FOLDED, 6, 5, NULL);
    check_regions(folded);
    const int32_t lower = find(folded, 6, 3, 1), upper = find(folded, 6, 3, 2);
    assert_false(reference_lattice_linked(folded, lower, upper));
    assert_false(is_member(folded, lower, upper));
    assert_true(is_member(folded, find(folded, 1, 3, 1), find(folded, 1, 3, 2)));
    assert_true(is_member(folded, find(folded, 3, 3, 1), find(folded, 3, 3, 2)));
    assert_false(is_member(folded, find(folded, 4, 3, 1), find(folded, 4, 3, 2)));
    reference_lattice_destroy(folded);
}

// Cells that touch at a corner share that particle, and nothing else leads across.
static void corners_lead_on(void **state)
{
    (void)state;
    reference_lattice *l = create(CHECK_CELLS_CORNERS, 2, 1, NULL);  // cells 000 and 111
    assert_int_equal(l->particle_count, 15);
    check_regions(l);
    assert_int_equal(size_of(l, find(l, 1, 1, 1)), 15);
    assert_int_equal(size_of(l, find(l, 0, 0, 0)), 8);
    assert_false(reference_lattice_linked(l, find(l, 1, 0, 1), find(l, 2, 1, 2)));
    reference_lattice_destroy(l);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        l = create(shape, 4, 2, NULL);
        check_regions(l);
        reference_lattice_destroy(l);
    }
}

// A row of two cells cut through the middle: all links from its first plane to the others.
static void broken_links_lead_nowhere(void **state)
{
    (void)state;
    const int32_t cells[] = {0, 0, 0, 1, 0, 0};
    reference_lattice *l = reference_lattice_create(2, cells, 2, 1, NULL);
    for (int32_t i = 0; i < 12; i++) assert_int_equal(size_of(l, i), 12);
    for (int32_t i = 0; i < 12; i++)
        for (int32_t j = 0; j < 12; j++)
            if (l->particles[3 * i] == 0 && l->particles[3 * j] == 1)
                reference_lattice_break(l, i, j);
    reference_lattice_regions(l);
    check_regions(l);
    for (int32_t i = 0; i < 12; i++)
        assert_int_equal(size_of(l, i), l->particles[3 * i] == 0 ? 4 : 8);
    reference_lattice_destroy(l);
}

// ---- Matching ----

// Two cells in a row, w = 1, the last plane pulled by d along the row. Planes have regions of 8, 12
// and 8, so m~ = 1/8, 1/12, 1/8 and the regions' centres move by 0, (1/2) / (4/3) d, (1/2) / (5/6)
// d; nothing turns. The planes' goals are the means of what they are in: 3/16, 13/40, 39/80 d.
static void a_pulled_row_has_the_goals_found_by_hand(void **state)
{
    (void)state;
    const int32_t cells[] = {0, 0, 0, 1, 0, 0};
    const double d = 0.25, expected[] = {3 / 16.0, 13 / 40.0, 39 / 80.0};
    reference_lattice *l = reference_lattice_create(2, cells, 1, 1, NULL);
    double g[36];
    for (int32_t i = 0; i < 12; i++)
        if (l->particles[3 * i] == 2) l->x[3 * i] += d;
    reference_lattice_goals(l, g);
    for (int32_t i = 0; i < 12; i++) {
        check_near(g[3 * i] - l->x0[3 * i], expected[l->particles[3 * i]] * d, 1e-14);
        check_near(g[3 * i + 1], l->x0[3 * i + 1], 1e-14);
        check_near(g[3 * i + 2], l->x0[3 * i + 2], 1e-14);
    }
    // The region at the first end: its mass is 4 (1/8 + 1/12), and A the variance along the row.
    reference_match match;
    reference_lattice_match(l, 0, &match);
    check_near(match.mass, 5 / 6.0, 1e-15);
    check_near(match.centre[0], 0.4, 1e-15);
    check_near(match.moment[0], 0.5 * 0.16 + 1 / 3.0 * 0.36, 1e-15);
    check_near(match.moment[4], 5 / 24.0, 1e-15);
    reference_lattice_destroy(l);
}

static void place_rigidly(reference_lattice *l, const double axis[3], double angle,
                          const double shift[3], double *goal)
{
    for (int32_t i = 0; i < l->particle_count; i++) {
        const double *p = l->x0 + 3 * i;
        double dot = 0, turned[3];
        for (int k = 0; k < 3; k++) dot += axis[k] * p[k];
        for (int k = 0; k < 3; k++) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            turned[k] = cos(angle) * p[k] + sin(angle) * (axis[a] * p[b] - axis[b] * p[a]) +
                        (1 - cos(angle)) * dot * axis[k];
        }
        for (int k = 0; k < 3; k++) goal[3 * i + k] = turned[k] + shift[k];
    }
}

static void rigid_motions_are_fixed_points(void **state)
{
    (void)state;
    const double axis[3] = {2 / 7.0, 3 / 7.0, 6 / 7.0}, shift[3] = {3, -1, 2};
    check_random random = check_random_seed(1);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        double mass[1000];
        for (int i = 0; i < 1000; i++) mass[i] = 0.5 + check_random_next(&random);
        reference_lattice *l = create(shape, 4, 2, mass);
        double *g = malloc((size_t)l->particle_count * 3 * sizeof *g);
        assert_non_null(g);
        for (double angle = 0; angle < 3.2; angle += 0.5) {
            place_rigidly(l, axis, angle, shift, l->x);
            reference_lattice_goals(l, g);
            for (int32_t i = 0; i < 3 * l->particle_count; i++) check_near(g[i], l->x[i], 1e-12);
        }
        free(g);
        reference_lattice_destroy(l);
    }
}

static void scatter(reference_lattice *l, double by, check_random *random)
{
    for (int32_t i = 0; i < 3 * l->particle_count; i++) {
        l->x[i] += by * uniform(random);
        l->v[i] = uniform(random);
    }
}

static void check_same_momenta(const reference_motion *a, const reference_motion *b,
                               double tolerance)
{
    for (int axis = 0; axis < 3; axis++) {
        check_near(a->momentum[axis], b->momentum[axis], tolerance);
        check_near(a->angular_momentum[axis], b->angular_momentum[axis], tolerance);
    }
}

// Angular momentum: goals turn nothing because R^T A is symmetric, and x cross v is the same before
// and behind x += h v.
static void steps_keep_momenta(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        double mass[1000];
        for (int i = 0; i < 1000; i++) mass[i] = 0.5 + check_random_next(&random);
        reference_lattice *l = create(shape, 4, 2, mass);
        scatter(l, 0.3, &random);
        const reference_motion before = reference_lattice_motion(l);
        for (int step = 0; step < 20; step++) {
            const reference_step def = {.dt = 0.02, .damping = 0.3, .rigid_damping = 0.1};
            reference_lattice_step(l, &def);
        }
        const reference_motion after = reference_lattice_motion(l);
        check_same_momenta(&after, &before, 1e-8);
        check_near(after.centre[0], before.centre[0] + 0.4 * before.momentum[0] / before.mass,
                   1e-10);
        reference_lattice_destroy(l);
    }
}

static void forces_push(void **state)
{
    (void)state;
    reference_lattice *l = create(CHECK_CELLS_CUBE, 3, 1, NULL);
    for (int32_t i = 0; i < l->particle_count; i++) l->f[3 * i + 2] = -9.81 * l->mass[i];
    for (int step = 0; step < 10; step++) reference_lattice_step(l, &(reference_step){.dt = 0.01});
    for (int32_t i = 0; i < l->particle_count; i++) {
        check_near(l->v[3 * i + 2], -0.981, 1e-12);
        check_near(l->x[3 * i + 2], l->x0[3 * i + 2] - 9.81 * 1e-4 * 55, 1e-12);
    }
    reference_lattice_destroy(l);
}

// ---- Damping ----

static void damping_leaves_rigid_motion_alone(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    const double spin[3] = {1, -2, 0.5}, velocity[3] = {3, 1, -1};
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        reference_lattice *l = create(shape, 4, 1, NULL);
        scatter(l, 0.2, &random);
        for (int32_t i = 0; i < l->particle_count; i++)
            for (int k = 0; k < 3; k++) {
                const int a = (k + 1) % 3, b = (k + 2) % 3;
                l->v[3 * i + k] =
                    velocity[k] + spin[a] * l->x[3 * i + b] - spin[b] * l->x[3 * i + a];
            }
        double *v = malloc((size_t)l->particle_count * 3 * sizeof *v);
        assert_non_null(v);
        memcpy(v, l->v, (size_t)l->particle_count * 3 * sizeof *v);
        reference_lattice_damp(l, 1);
        // Spins of two pieces are one spin here, too.
        reference_lattice_damp_rigid(l, 1);
        for (int32_t i = 0; i < 3 * l->particle_count; i++) check_near(l->v[i], v[i], 1e-11);
        free(v);
        reference_lattice_destroy(l);
    }
}

// By halves the rest halves, momenta stay and energy falls; and one region is the whole cell.
static void damping_takes_what_is_not_rigid(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    reference_lattice *l = create(CHECK_CELLS_SINGLE, 1, 1, NULL);
    scatter(l, 0.1, &random);
    double v[24], half[24];
    memcpy(v, l->v, sizeof v);
    const reference_motion before = reference_lattice_motion(l);
    reference_lattice_damp(l, 0.5);
    memcpy(half, l->v, sizeof half);
    const reference_motion between = reference_lattice_motion(l);
    memcpy(l->v, v, sizeof v);
    reference_lattice_damp(l, 1);
    const reference_motion after = reference_lattice_motion(l);
    check_same_momenta(&before, &between, 1e-13);
    check_same_momenta(&before, &after, 1e-13);
    check_at_least(before.kinetic_energy, between.kinetic_energy + 0.1);
    check_at_least(between.kinetic_energy, after.kinetic_energy + 0.01);
    for (int i = 0; i < 24; i++) check_near(half[i], 0.5 * (v[i] + l->v[i]), 1e-14);
    memcpy(half, l->v, sizeof half);
    memcpy(l->v, v, sizeof v);
    reference_lattice_damp_rigid(l, 1);
    for (int i = 0; i < 24; i++) check_near(l->v[i], half[i], 1e-13);
    reference_lattice_destroy(l);
}

// Squeezed to a line and to a point there is no inertia about it: finite, momenta kept.
static void damping_bears_lines_and_points(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    for (int rank = 0; rank < 2; rank++) {
        reference_lattice *l = create(CHECK_CELLS_CUBE, 2, 1, NULL);
        scatter(l, 0, &random);
        for (int32_t i = 0; i < 3 * l->particle_count; i++)
            l->x[i] = i % 3 == 0 && rank ? l->x[i] : 1;
        const reference_motion before = reference_lattice_motion(l);
        reference_lattice_damp(l, 0.7);
        const reference_motion after = reference_lattice_motion(l);
        check_same_momenta(&before, &after, 1e-12);
        check_at_most(after.kinetic_energy, before.kinetic_energy);
        reference_lattice_destroy(l);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shapes_have_the_cells_they_say),
        cmocka_unit_test(particles_are_corners_in_order),
        cmocka_unit_test(regions_of_a_cube_are_boxes),
        cmocka_unit_test(regions_do_not_leap_gaps),
        cmocka_unit_test(corners_lead_on),
        cmocka_unit_test(broken_links_lead_nowhere),
        cmocka_unit_test(a_pulled_row_has_the_goals_found_by_hand),
        cmocka_unit_test(rigid_motions_are_fixed_points),
        cmocka_unit_test(steps_keep_momenta),
        cmocka_unit_test(forces_push),
        cmocka_unit_test(damping_leaves_rigid_motion_alone),
        cmocka_unit_test(damping_takes_what_is_not_rigid),
        cmocka_unit_test(damping_bears_lines_and_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
