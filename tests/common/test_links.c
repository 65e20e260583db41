// test_links.c: links are shared cells, until they are cut, and regions what w steps along them
// reach.
#include "cell_lattice.h"

#include <stdlib.h>
#include <string.h>

static pliant_links *links_of(const cell_lattice *l)
{
    pliant_links *links = NULL;
    pliant_error err = {""};
    check_ok(pliant_links_create(&l->shape, &links, &err), &err);
    return links;
}

static void directions_and_their_opposites_are_the_26_neighbours(void **state)
{
    (void)state;
    int is_taken[27] = {0};
    int32_t last = 0;
    for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
        int32_t step[3];
        pliant_link_direction(d, step);
        const int32_t key = step[0] + 3 * step[1] + 9 * step[2];
        assert_true(key > last);
        last = key;
        is_taken[13 + key] = is_taken[13 - key] = 1;
    }
    for (int32_t k = 0; k < 27; k++) assert_int_equal(is_taken[k], k != 13);
}

static void particles_are_the_cells_corners_in_order(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        cell_lattice *l = cell_lattice_create(shape, 6, 1);
        assert_int_equal(l->shape.particle_count, l->slow->particle_count);
        assert_memory_equal(l->particles, l->slow->particles,
                            3 * (size_t)l->shape.particle_count * sizeof *l->particles);
        cell_lattice_destroy(l);
    }
}

static void places_find_their_particles(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        cell_lattice *l = cell_lattice_create(shape, 6, 1);
        pliant_links *links = links_of(l);
        for (int32_t z = -2; z < l->shape.dims[2] + 2; z++)
            for (int32_t y = -2; y < l->shape.dims[1] + 2; y++)
                for (int32_t x = -2; x < l->shape.dims[0] + 2; x++)
                    assert_int_equal(pliant_links_particle(links, x, y, z),
                                     reference_lattice_find(l->slow, (const int32_t[3]){x, y, z}));
        pliant_links_destroy(links);
        cell_lattice_destroy(l);
    }
}

// All questions about links, of all places in and about the box.
static void check_links(const cell_lattice *l, const pliant_links *links)
{
    for (int32_t z = -1; z <= l->shape.dims[2]; z++)
        for (int32_t y = -1; y <= l->shape.dims[1]; y++)
            for (int32_t x = -1; x <= l->shape.dims[0]; x++) {
                const int32_t i = reference_lattice_find(l->slow, (const int32_t[3]){x, y, z});
                uint32_t mask = 0;
                for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
                    int32_t step[3];
                    pliant_link_direction(d, step);
                    const int32_t j = reference_lattice_find(
                        l->slow, (const int32_t[3]){x + step[0], y + step[1], z + step[2]});
                    const int expected =
                        i >= 0 && j >= 0 && reference_lattice_linked(l->slow, i, j);
                    assert_int_equal(pliant_links_has(links, x, y, z, d), expected);
                    mask |= (uint32_t)expected << d;
                    if (x < 0) continue;
                    assert_int_equal(pliant_links_row(links, x, y, z, d) & 1, expected);
                }
                assert_int_equal(pliant_links_mask(links, x, y, z), mask);
            }
}

static void links_are_shared_cells(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        cell_lattice *l = cell_lattice_create(shape, 5, 1);
        pliant_links *links = links_of(l);
        check_links(l, links);
        pliant_links_destroy(links);
        cell_lattice_destroy(l);
    }
}

static void rows_are_links_one_by_one(void **state)
{
    (void)state;
    cell_lattice *l = cell_lattice_create(CHECK_CELLS_SPONGE, 40, 1);  // rows of several words
    pliant_links *links = links_of(l);
    for (int32_t z = 0; z < l->shape.dims[2]; z += 3)
        for (int32_t y = -1; y <= l->shape.dims[1]; y++)
            for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++)
                for (int32_t x = 0; x < l->shape.dims[0]; x++) {
                    const uint32_t row = pliant_links_row(links, x, y, z, d);
                    for (int32_t k = 0; k < 32; k++)
                        assert_int_equal(row >> k & 1, pliant_links_has(links, x + k, y, z, d));
                }
    pliant_links_destroy(links);
    cell_lattice_destroy(l);
}

static void check_reaches(const cell_lattice *l, const pliant_links *links)
{
    static pliant_reach reach;
    for (int32_t i = 0; i < l->shape.particle_count; i++) {
        const int32_t *at = l->particles + 3 * i;
        pliant_links_reach(links, at[0], at[1], at[2], l->slow->half_width, &reach);
        cell_lattice_check_reach(l, i, &reach);
    }
}

static void reaches_are_breadth_first_searches(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 5; w++) {
            cell_lattice *l = cell_lattice_create(shape, 6, w);
            pliant_links *links = links_of(l);
            check_reaches(l, links);
            pliant_links_destroy(links);
            cell_lattice_destroy(l);
        }
}

static void reaches_of_the_greatest_half_width_are_breadth_first_searches(void **state)
{
    (void)state;
    static const struct {
        check_cells shape;
        int32_t size, w;
    } cases[] = {{CHECK_CELLS_COMB, 12, 15},
                 {CHECK_CELLS_FOLDED, 10, 15},
                 {CHECK_CELLS_CORNERS, 7, 15},
                 {CHECK_CELLS_SPONGE, 8, 14},
                 {CHECK_CELLS_COMB, 10, 9}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        cell_lattice *l = cell_lattice_create(cases[k].shape, cases[k].size, cases[k].w);
        pliant_links *links = links_of(l);
        check_reaches(l, links);
        pliant_links_destroy(links);
        cell_lattice_destroy(l);
    }
}

// The window is all particles about a place, whether or not they are reached.
static void windows_hold_all_particles(void **state)
{
    (void)state;
    static pliant_reach reach;
    const int32_t w = 3;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        cell_lattice *l = cell_lattice_create(shape, 5, 1);
        pliant_links *links = links_of(l);
        for (int32_t i = 0; i < l->shape.particle_count; i += 7) {
            const int32_t *at = l->particles + 3 * i;
            int32_t count = 0;
            pliant_links_window(links, at[0], at[1], at[2], w, &reach);
            for (int32_t z = 0; z <= 2 * w; z++)
                for (int32_t y = 0; y <= 2 * w; y++) {
                    for (int32_t x = 0; x < 32; x++) {
                        const int is_there =
                            x <= 2 * w && cell_lattice_member(l, i, w, z, y, x) >= 0;
                        assert_int_equal(reach.window[z][y] >> x & 1, is_there);
                        count += is_there;
                    }
                    assert_int_equal(reach.member[z][y], reach.window[z][y]);
                }
            assert_int_equal(reach.size, count);
        }
        pliant_links_destroy(links);
        cell_lattice_destroy(l);
    }
}

// ---- Cuts ----

static void cut_some(cell_lattice *l, pliant_links *links, check_random *random, double part)
{
    for (int32_t i = 0; i < l->shape.particle_count; i++)
        for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
            const int32_t *at = l->particles + 3 * i;
            int32_t step[3];
            pliant_link_direction(d, step);
            if (check_random_next(random) >= part) continue;
            if (!pliant_links_has(links, at[0], at[1], at[2], d)) {
                pliant_links_cut(links, at[0], at[1], at[2], d);  // nothing to cut: nothing happens
                continue;
            }
            pliant_links_cut(links, at[0], at[1], at[2], d);
            reference_lattice_break(
                l->slow, i,
                pliant_links_particle(links, at[0] + step[0], at[1] + step[1], at[2] + step[2]));
        }
    reference_lattice_regions(l->slow);
}

static void cuts_are_those_of_a_graph(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 3; w++) {
            cell_lattice *l = cell_lattice_create(shape, 5, w);
            pliant_links *links = links_of(l);
            for (int turn = 0; turn < 3; turn++) {
                cut_some(l, links, &random, turn == 0 ? 0.01 : 0.5);
                check_links(l, links);
                check_reaches(l, links);
            }
            pliant_links_destroy(links);
            cell_lattice_destroy(l);
        }
}

static void single_cuts_are_seen_by_every_region(void **state)
{
    (void)state;
    // One cut of a whole cube in each direction: at w = 1 both ends lose each other, nobody else.
    for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
        cell_lattice *l = cell_lattice_create(CHECK_CELLS_CUBE, 4, 1);
        pliant_links *links = links_of(l);
        int32_t step[3];
        pliant_link_direction(d, step);
        pliant_links_cut(links, 2, 2, 2, d);
        const int32_t i = pliant_links_particle(links, 2, 2, 2);
        const int32_t j = pliant_links_particle(links, 2 + step[0], 2 + step[1], 2 + step[2]);
        reference_lattice_break(l->slow, i, j);
        reference_lattice_regions(l->slow);
        assert_int_equal(l->slow->region_offset[i + 1] - l->slow->region_offset[i], 26);
        check_reaches(l, links);
        check_links(l, links);
        pliant_links_destroy(links);
        cell_lattice_destroy(l);
    }
}

static void copies_are_cut_apart_and_restored(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        cell_lattice *whole = cell_lattice_create(shape, 5, 2);
        cell_lattice *broken = cell_lattice_create(shape, 5, 2);
        pliant_links *links = links_of(whole), *copy = NULL;
        pliant_error err = {""};
        check_ok(pliant_links_copy(links, &copy, &err), &err);
        cut_some(broken, copy, &random, 0.3);
        check_links(broken, copy);
        check_links(whole, links);
        check_reaches(whole, links);
        pliant_links *again = NULL;
        check_ok(pliant_links_copy(copy, &again, &err), &err);
        pliant_links_restore(copy, links);
        check_links(whole, copy);
        check_reaches(whole, copy);
        check_links(broken, again);
        check_reaches(broken, again);
        pliant_links_destroy(links);
        pliant_links_destroy(copy);
        pliant_links_destroy(again);
        cell_lattice_destroy(whole);
        cell_lattice_destroy(broken);
    }
}

// ---- Refusals ----

static void refuse(const pliant_lattice_shape *shape, const char *words)
{
    pliant_links *links = NULL;
    pliant_error err = {""};
    assert_int_equal(pliant_links_create(shape, &links, &err), PLIANT_ERR_ARGUMENT);
    assert_null(links);
    if (!strstr(err.text, words)) fail_msg("\"%s\" lacks \"%s\"", err.text, words);
}

static void shapes_that_are_none_are_refused(void **state)
{
    (void)state;
    cell_lattice *l = cell_lattice_create(CHECK_CELLS_CUBE, 3, 1);
    const size_t bytes = 3 * (size_t)l->shape.particle_count * sizeof(int32_t);
    int32_t *particles = malloc(bytes);
    assert_non_null(particles);
    memcpy(particles, l->particles, bytes);
    pliant_lattice_shape shape = l->shape;

    for (int c = 0; c < 3; c++) {
        shape = l->shape;
        shape.dims[c] = PLIANT_LATTICE_DIM_LIMIT + 1;
        refuse(&shape, "along each axis, found 1025");
        shape.dims[c] = 1;
        refuse(&shape, "along each axis, found 1");
        shape.dims[c] = 3;
        refuse(&shape, "expected a place in 0..2, found 3");
    }
    shape = l->shape;
    shape.particle_count = 7;
    refuse(&shape, "found 7 and 27");
    shape.particle_count = PLIANT_LATTICE_LIMIT + 1;
    refuse(&shape, "expected 8 to");
    shape = l->shape;
    shape.cell_count = 0;
    refuse(&shape, "and a cell, found 64 and 0");

    shape = l->shape;
    shape.particles = particles;
    for (int32_t k = 1; k < 3; k++) {  // swapped, twice
        memcpy(particles, l->particles, bytes);
        memcpy(particles + 30, l->particles + 33, 3 * sizeof *particles);
        if (k == 1) memcpy(particles + 33, l->particles + 30, 3 * sizeof *particles);
        refuse(&shape, "particle 11: expected ascending places");
    }
    memcpy(particles, l->particles, bytes);
    particles[1] = -1;
    refuse(&shape, "particle 0: expected a place in 0..3, found -1");

    // A particle less: some cell lacks a corner.
    memcpy(particles, l->particles + 3, bytes - 3 * sizeof *particles);
    shape.particle_count--;
    refuse(&shape, "cell 0: expected particles at its corners");
    shape = l->shape;
    int32_t cells[] = {3, 0, 0};
    shape.cells = cells, shape.cell_count = 1;
    refuse(&shape, "cell 0: expected particles at its corners");
    cells[0] = -1;
    refuse(&shape, "cell 0: expected particles at its corners");
    cells[0] = INT32_MIN, cells[1] = 1000000;
    refuse(&shape, "cell 0: expected particles at its corners");
    cells[0] = cells[1] = cells[2] = INT32_MAX;
    refuse(&shape, "cell 0: expected particles at its corners");
    free(particles);
    cell_lattice_destroy(l);
}

static void nothing_is_destroyed_quietly(void **state)
{
    (void)state;
    pliant_links_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directions_and_their_opposites_are_the_26_neighbours),
        cmocka_unit_test(particles_are_the_cells_corners_in_order),
        cmocka_unit_test(places_find_their_particles),
        cmocka_unit_test(links_are_shared_cells),
        cmocka_unit_test(rows_are_links_one_by_one),
        cmocka_unit_test(reaches_are_breadth_first_searches),
        cmocka_unit_test(reaches_of_the_greatest_half_width_are_breadth_first_searches),
        cmocka_unit_test(windows_hold_all_particles),
        cmocka_unit_test(cuts_are_those_of_a_graph),
        cmocka_unit_test(single_cuts_are_seen_by_every_region),
        cmocka_unit_test(copies_are_cut_apart_and_restored),
        cmocka_unit_test(shapes_that_are_none_are_refused),
        cmocka_unit_test(nothing_is_destroyed_quietly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
