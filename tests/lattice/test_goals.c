// test_goals.c: fast lattice shape matching is lattice shape matching, on every shape, to rounding.
//
// References are the slow sums in double of tests/support/reference_lattice.h; tolerances come from
// the depth of float sums and the conditions of the regions' rotations, see lattice_pair.c.
#include "lattice_pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const int32_t widths[] = {1, 2, 3, 5};
enum { width_count = sizeof widths / sizeof *widths };

// What representations of irregular regions a lattice uses.
typedef struct kinds {
    int32_t listed, minus, apart;
} kinds;

static void count_kinds(const pliant_lattice *l, kinds *k)
{
    for (int32_t i = 0; i < l->exceptions.count; i++) k->listed += l->exceptions.is_listed[i];
    for (int32_t c = 0; c < l->column_count; c++)
        for (int32_t n = l->irregular.column_head[c]; n >= 0; n = l->irregular.regions[n].next) {
            k->minus += l->irregular.regions[n].sign < 0;
            k->apart += l->irregular.regions[n].sign > 0;
        }
}

static double worst_of(lattice_pair *p, double worst)
{
    worst = fmax(worst, p->worst);
    lattice_pair_destroy(p);
    return worst;
}

static void goals_equal_slow_sums_on_every_shape(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    kinds k = {0};
    double worst = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int i = 0; i < width_count; i++) {
            lattice_pair *p =
                lattice_pair_create(shape, lattice_pair_size(shape, widths[i]), widths[i], NULL);
            count_kinds(p->lattice, &k);
            lattice_pair_check_constants(p);
            lattice_pair_deform(p, &random, 0.3);
            lattice_pair_check_goals(p);
            // The tolerance is worth something: a hundredth of a cell at most.
            for (int32_t j = 0; j < p->particle_count; j++)
                check_at_most(p->tolerance[j], 0.01 * p->cell_size);
            worst = worst_of(p, worst);
        }
    print_message("off by at most %.3f of the tolerance; regions with lists %d, window less parts "
                  "%d, of parts %d\n",
                  worst, k.listed, k.minus, k.apart);
    check_at_least(k.listed, 1000);
}

// Regions that lack more than a list takes: teeth that see each other but are joined far away, two
// sheets, and solids with a slit, whose regions at its edge are the window but for a few planes.
static void goals_of_regions_that_lack_much_equal_slow_sums(void **state)
{
    (void)state;
    check_random random = check_random_seed(15);
    enum { solid = CHECK_CELLS_SHAPES };
    static const struct {
        int32_t shape, size, w;
    } cases[] = {
        {CHECK_CELLS_COMB, 12, 5}, {CHECK_CELLS_FOLDED, 14, 8}, {solid, 10, 5}, {solid, 9, 4}};
    kinds k = {0};
    double worst = 0;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        lattice_pair *p;
        if (cases[i].shape == solid) {
            int32_t cells[1000][3], count = 0;
            for (int32_t j = 0; j < 1000; j++) {
                const int32_t x = j % 10, y = j / 10 % 10, z = j / 100;
                if (x >= cases[i].size || y >= cases[i].size || z >= cases[i].size) continue;
                if (z == 5 && y > 0) continue;  // joined along one side
                cells[count][0] = x, cells[count][1] = y, cells[count][2] = z;
                count++;
            }
            p = lattice_pair_create_cells(count, &cells[0][0], cases[i].w, NULL);
        } else {
            p = lattice_pair_create((check_cells)cases[i].shape, cases[i].size, cases[i].w, NULL);
        }
        count_kinds(p->lattice, &k);
        lattice_pair_check_constants(p);
        lattice_pair_deform(p, &random, 0.3);
        lattice_pair_check_goals(p);
        worst = worst_of(p, worst);
    }
    print_message("off by at most %.3f of the tolerance; regions with lists %d, window less parts "
                  "%d, of parts %d\n",
                  worst, k.listed, k.minus, k.apart);
    check_at_least(k.listed, 100);
    check_at_least(k.minus, 10);
    check_at_least(k.apart, 100);
}

// No order at all: rotations are ill-conditioned here and there, and inverted.
static void goals_of_scattered_particles_equal_slow_sums(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    double worst = 0;
    int32_t particles = 0, useful = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int i = 0; i < width_count; i++) {
            lattice_pair *p =
                lattice_pair_create(shape, lattice_pair_size(shape, widths[i]), widths[i], NULL);
            lattice_pair_scatter(p, &random, 10);
            lattice_pair_check_goals(p);
            for (int32_t j = 0; j < p->particle_count; j++)
                useful += p->tolerance[j] < 0.05 * p->cell_size;
            particles += p->particle_count;
            worst = worst_of(p, worst);
        }
    print_message("off by at most %.3f of the tolerance; below 1/20 cell for %d of %d particles\n",
                  worst, useful, particles);
    check_at_least(useful, 0.8 * particles);
}

// The same where coordinates have a thousand times the extent of the body: sums are relative.
static void goals_far_from_the_origin_are_as_exact(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    double worst = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 3; w++) {
            lattice_pair *p = lattice_pair_create(shape, lattice_pair_size(shape, w), w, NULL);
            lattice_pair_deform(p, &random, 0.3);
            for (int32_t i = 0; i < p->particle_count; i++) {
                p->slow->x[3 * i] += 1000;
                p->slow->x[3 * i + 1] -= 700;
                p->slow->x[3 * i + 2] += 300;
            }
            lattice_pair_set(p);
            lattice_pair_check_goals(p);
            worst = worst_of(p, worst);
        }
    print_message("off by at most %.3f of the tolerance\n", worst);
}

// A body that may break has all its irregular regions made of parts.
static void goals_of_breakable_bodies_equal_slow_sums(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    pliant_body_def def = pliant_body_default();
    def.strain_limit = 1e6f;
    double worst = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int i = 0; i < width_count; i++) {
            lattice_pair *p =
                lattice_pair_create(shape, lattice_pair_size(shape, widths[i]), widths[i], &def);
            assert_int_equal(p->body->irregular->region_count, p->lattice->irregular_count);
            lattice_pair_deform(p, &random, 0.3);
            lattice_pair_check_goals(p);
            worst = worst_of(p, worst);
        }
    print_message("off by at most %.3f of the tolerance\n", worst);
}

static void goals_at_the_greatest_half_widths_equal_slow_sums(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    static const check_cells shapes[] = {CHECK_CELLS_CUBE, CHECK_CELLS_COMB, CHECK_CELLS_SPONGE};
    double worst = 0;
    for (int s = 0; s < 3; s++)
        for (int32_t w = 8; w <= PLIANT_LATTICE_WIDTH_LIMIT; w += w == 8 ? 3 : 4) {
            lattice_pair *p = lattice_pair_create(shapes[s], 7, w, NULL);
            lattice_pair_deform(p, &random, 0.3);
            lattice_pair_check_goals(p);
            worst = worst_of(p, worst);
        }
    print_message("off by at most %.3f of the tolerance\n", worst);
}

// Whoever is far away is seen by those alone whose regions hold it: the others' goals keep their
// digits. (Of 1e6 cells, a float holds sixteenths.)
static void particles_thrown_far_away_spoil_their_own_regions_only(void **state)
{
    (void)state;
    check_random random = check_random_seed(14);
    static const check_cells shapes[] = {CHECK_CELLS_CUBE, CHECK_CELLS_COMB};
    for (int s = 0; s < 2; s++)
        for (int32_t w = 1; w <= 2; w++) {
            pliant_body_def def = pliant_body_default();
            def.strain_limit = 1e9f;  // sums are never mended by what is far away
            lattice_pair *p = lattice_pair_create(shapes[s], 7, w, &def);
            lattice_pair_deform(p, &random, 0.2);
            lattice_pair_goals(p);
            lattice_pair_tolerances(p);
            const reference_lattice *l = p->slow;
            // Two steps from the particle every goal is made of regions that do not hold it.
            const int32_t n = p->particle_count, thrown = 0;
            char *is_near = calloc((size_t)n, 1);
            assert_non_null(is_near);
            for (int32_t k = l->region_offset[thrown]; k < l->region_offset[thrown + 1]; k++)
                for (int32_t m = l->region_offset[l->region[k]];
                     m < l->region_offset[l->region[k] + 1]; m++)
                    is_near[l->region[m]] = 1;
            l->x[3 * thrown + 1] += 1e6 * p->cell_size;
            lattice_pair_goals(p);
            int32_t checked = 0;
            for (int32_t i = 0; i < n; i++) {
                if (is_near[i]) continue;
                checked++;
                for (int c = 0; c < 3; c++)
                    check_near(p->goals[3 * i + c], p->slow_goals[3 * i + c], p->tolerance[i]);
            }
            check_at_least(checked, n / 2);
            free(is_near);
            lattice_pair_destroy(p);
        }
}

// Rows of more than one block, and blocks apart from each other, along every axis.
static void goals_of_long_bodies_equal_slow_sums(void **state)
{
    (void)state;
    check_random random = check_random_seed(6);
    for (int axis = 0; axis < 3; axis++)
        for (int32_t w = 1; w <= 5; w += 2) {
            int32_t cells[2 * 60][3], count = 0;
            // Two strips; the second starts where the first is at its middle, a cell away from it.
            for (int32_t z = 0; z < 2; z++)
                for (int32_t i = 0; i < 40; i++, count++) {
                    cells[count][0] = cells[count][1] = cells[count][2] = 0;
                    cells[count][axis] = i + 13 * z;
                    cells[count][(axis + 1) % 3] = 2 * z;
                }
            // Ascending by (z, y, x).
            for (int32_t i = 1; i < count; i++)
                for (int32_t j = i; j > 0; j--) {
                    const int32_t *a = cells[j - 1], *b = cells[j];
                    const int32_t key_a = (a[2] * 100 + a[1]) * 100 + a[0];
                    const int32_t key_b = (b[2] * 100 + b[1]) * 100 + b[0];
                    if (key_a < key_b) break;
                    int32_t swap[3];
                    memcpy(swap, a, sizeof swap);
                    memcpy(cells[j - 1], b, sizeof swap);
                    memcpy(cells[j], swap, sizeof swap);
                }
            lattice_pair *p = lattice_pair_create_cells(count, &cells[0][0], w, NULL);
            lattice_pair_deform(p, &random, 0.2);
            lattice_pair_check_goals(p);
            lattice_pair_destroy(p);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(goals_equal_slow_sums_on_every_shape),
        cmocka_unit_test(goals_of_regions_that_lack_much_equal_slow_sums),
        cmocka_unit_test(goals_of_scattered_particles_equal_slow_sums),
        cmocka_unit_test(goals_far_from_the_origin_are_as_exact),
        cmocka_unit_test(goals_of_breakable_bodies_equal_slow_sums),
        cmocka_unit_test(goals_at_the_greatest_half_widths_equal_slow_sums),
        cmocka_unit_test(particles_thrown_far_away_spoil_their_own_regions_only),
        cmocka_unit_test(goals_of_long_bodies_equal_slow_sums),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
