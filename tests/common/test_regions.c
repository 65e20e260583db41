// test_regions.c: nodes rebuild exactly the regions that breadth-first search finds, and share
// them.
#include "exhaustion.h"

#include "cell_lattice.h"
#include "pliant/regions.h"

#include <string.h>

static pliant_regions *regions_of(const cell_lattice *l)
{
    pliant_regions *regions = NULL;
    pliant_error err = {""};
    check_ok(pliant_regions_create(&l->shape, l->slow->half_width, &regions, &err), &err);
    return regions;
}

static int32_t size_for(check_cells shape)
{
    return shape == CHECK_CELLS_TORUS ? 9 : 6;
}

static int32_t slow_size(const cell_lattice *l, int32_t i)
{
    return l->slow->region_offset[i + 1] - l->slow->region_offset[i];
}

static int is_member(const cell_lattice *l, int32_t r, int32_t i)
{
    for (int32_t k = l->slow->region_offset[r]; k < l->slow->region_offset[r + 1]; k++)
        if (l->slow->region[k] == i) return 1;
    return 0;
}

static int is_same_set(const cell_lattice *l, int32_t r, int32_t s)
{
    const int32_t *first = l->slow->region + l->slow->region_offset[r];
    return slow_size(l, r) == slow_size(l, s) &&
           !memcmp(first, l->slow->region + l->slow->region_offset[s],
                   (size_t)slow_size(l, r) * sizeof *first);
}

// Mark the members that the header's reading of region r's nodes has; each must be a particle, and
// have been taken once.
static int32_t read_nodes(const cell_lattice *l, const pliant_regions *regions, int32_t r,
                          const int32_t *node, char *is_taken)
{
    const int32_t w = regions->half_width, *at = l->particles + 3 * r;
    int32_t count = 0;
    for (int32_t plane = 0; plane <= 2 * w; plane++) {
        const int32_t code = node ? node[1 + plane] : PLIANT_PLANE_WHOLE;
        assert_in_range(code + 2, 0, regions->plate_node_count + 1);
        if (code == PLIANT_PLANE_NONE) continue;
        const int32_t *plate = code < 0 ? NULL : regions->plate_nodes + (size_t)code * (2 * w + 4);
        if (plate) {
            assert_int_equal(plate[0], at[0]);
            assert_int_equal(plate[1], at[1]);
            assert_int_equal(plate[2], at[2] + plane - w);
        }
        for (int32_t y = 0; y <= 2 * w; y++) {
            const uint32_t mask = plate ? (uint32_t)plate[3 + y] : PLIANT_ROW_WHOLE;
            for (int32_t bit = 0; bit <= 2 * w; bit++) {
                const int32_t i = cell_lattice_member(l, r, w, plane, y, bit);
                if (!(mask & PLIANT_ROW_WHOLE) && !(mask >> bit & 1)) continue;
                if (i < 0) {
                    assert_true(mask & PLIANT_ROW_WHOLE);
                    continue;
                }
                assert_false(is_taken[i]);
                is_taken[i] = 1;
                count++;
            }
        }
    }
    return count;
}

static void check_nodes(const cell_lattice *l)
{
    pliant_regions *regions = regions_of(l);
    const int32_t n = l->shape.particle_count, w = regions->half_width;
    char *is_taken = malloc((size_t)n);
    assert_non_null(is_taken);
    assert_int_equal(regions->particle_count, n);
    int32_t next = 0;
    for (int32_t r = 0; r < n; r++) {
        const int32_t *node = regions->region_nodes + (size_t)next * (2 * w + 2);
        const int is_irregular = next < regions->region_node_count && node[0] == r;
        next += is_irregular;
        assert_int_equal(regions->size[r], slow_size(l, r));
        memset(is_taken, 0, (size_t)n);
        assert_int_equal(read_nodes(l, regions, r, is_irregular ? node : NULL, is_taken),
                         slow_size(l, r));
        for (int32_t k = l->slow->region_offset[r]; k < l->slow->region_offset[r + 1]; k++)
            assert_true(is_taken[l->slow->region[k]]);
        // A node is only there where the window holds more.
        if (!is_irregular) continue;
        int32_t window = 0;
        for (int32_t i = 0; i < n; i++) {
            int inside = 1;
            for (int c = 0; c < 3; c++)
                inside &= abs(l->particles[3 * i + c] - l->particles[3 * r + c]) <= w;
            window += inside;
        }
        check_at_least(window, slow_size(l, r) + 1);
    }
    assert_int_equal(next, regions->region_node_count);
    free(is_taken);
    pliant_regions_destroy(regions);
}

static void nodes_rebuild_every_region(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 5; w += 1 + w / 3) {
            cell_lattice *l = cell_lattice_create(shape, size_for(shape), w);
            check_nodes(l);
            cell_lattice_destroy(l);
        }
}

static void nodes_of_the_greatest_half_width_rebuild_every_region(void **state)
{
    (void)state;
    static const check_cells shapes[] = {CHECK_CELLS_COMB, CHECK_CELLS_FOLDED, CHECK_CELLS_CORNERS};
    for (int k = 0; k < 3; k++) {
        cell_lattice *l = cell_lattice_create(shapes[k], k == 0 ? 9 : 5, 15);
        check_nodes(l);
        cell_lattice_destroy(l);
    }
}

// A particle of an irregular region is lacked by those that it lacks.
static void regions_are_mutual(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        cell_lattice *l = cell_lattice_create(shape, 4, 3);
        for (int32_t r = 0; r < l->shape.particle_count; r++)
            for (int32_t i = 0; i < r; i++)
                assert_int_equal(is_member(l, r, i), is_member(l, i, r));
        cell_lattice_destroy(l);
    }
}

static void equal_regions_share_and_others_do_not(void **state)
{
    (void)state;
    int32_t shared = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 1; w <= 5; w += 2) {
            cell_lattice *l = cell_lattice_create(shape, size_for(shape), w);
            pliant_regions *regions = regions_of(l);
            int32_t distinct = 0;
            for (int32_t r = 0; r < l->shape.particle_count; r++) {
                int32_t least = 0;
                while (!is_same_set(l, r, least)) least++;
                assert_int_equal(regions->share[r], least);
                distinct += least == r;
            }
            assert_int_equal(regions->region_count, distinct);
            shared += l->shape.particle_count - distinct;
            pliant_regions_destroy(regions);
            cell_lattice_destroy(l);
        }
    check_at_least(shared, 1000);
}

static void equal_plates_are_one_node(void **state)
{
    (void)state;
    int32_t uses = 0, nodes = 0;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int32_t w = 2; w <= 4; w += 2) {
            cell_lattice *l = cell_lattice_create(shape, size_for(shape), w);
            pliant_regions *regions = regions_of(l);
            const int32_t width = 2 * w + 4;
            for (int32_t a = 0; a < regions->plate_node_count; a++)
                for (int32_t b = 0; b < a; b++)
                    assert_memory_not_equal(regions->plate_nodes + (size_t)a * width,
                                            regions->plate_nodes + (size_t)b * width,
                                            (size_t)width * sizeof(int32_t));
            nodes += regions->plate_node_count;
            for (int32_t k = 0; k < regions->region_node_count; k++)
                for (int32_t plane = 0; plane <= 2 * w; plane++)
                    uses += regions->region_nodes[(size_t)k * (2 * w + 2) + 1 + plane] >= 0;
            pliant_regions_destroy(regions);
            cell_lattice_destroy(l);
        }
    print_message("%d plates in %d nodes\n", uses, nodes);
    check_at_least(uses, nodes + 100);
}

// Every region of a box is its window. Along an axis of n particles two windows are the same only
// if both are cut at both ends: i is like i - 1 when i - 1 and i are within w of either end.
static void boxes_have_no_nodes(void **state)
{
    (void)state;
    const int32_t n = 8;
    for (int32_t w = 1; w <= 15; w++) {
        cell_lattice *l = cell_lattice_create(CHECK_CELLS_CUBE, n - 1, w);
        pliant_regions *regions = regions_of(l);
        assert_int_equal(regions->region_node_count, 0);
        assert_int_equal(regions->plate_node_count, 0);
        int32_t along = 0;
        for (int32_t i = 0; i < n; i++) along += i == 0 || i > w || i + w <= n - 1;
        assert_int_equal(regions->region_count, along * along * along);
        pliant_regions_destroy(regions);
        cell_lattice_destroy(l);
    }
}

static void wrong_half_widths_and_shapes_are_refused(void **state)
{
    (void)state;
    cell_lattice *l = cell_lattice_create(CHECK_CELLS_CUBE, 3, 1);
    const int32_t wrong[] = {0, -1, 16, INT32_MAX, INT32_MIN};
    for (int k = 0; k < 5; k++) {
        pliant_regions *regions = NULL;
        pliant_error err = {""};
        assert_int_equal(pliant_regions_create(&l->shape, wrong[k], &regions, &err),
                         PLIANT_ERR_ARGUMENT);
        assert_null(regions);
        assert_non_null(strstr(err.text, "half-width: expected 1 to 15, found"));
    }
    pliant_lattice_shape shape = l->shape;
    shape.dims[0] = 2;
    pliant_regions *regions = NULL;
    pliant_error err = {""};
    assert_int_equal(pliant_regions_create(&shape, 1, &regions, &err), PLIANT_ERR_ARGUMENT);
    assert_null(regions);
    assert_non_null(strstr(err.text, "expected a place in"));
    pliant_regions_destroy(NULL);
    cell_lattice_destroy(l);
}

static void memory_may_run_out_anywhere(void **state)
{
    (void)state;
    if (!EXHAUSTING) skip();
    cell_lattice *l = cell_lattice_create(CHECK_CELLS_SPONGE, 8, 3);
    const long before = blocks_held();
    pliant_status status = PLIANT_ERR_MEMORY;
    long n = 0;
    for (; status == PLIANT_ERR_MEMORY; n++) {
        pliant_regions *regions = NULL;
        pliant_error err = {""};
        exhaust_after(n);
        status = pliant_regions_create(&l->shape, 3, &regions, &err);
        exhaust_never();
        if (status < 0) {
            assert_int_equal(status, PLIANT_ERR_MEMORY);
            assert_null(regions);
            assert_non_null(strstr(err.text, "no memory"));
        }
        pliant_regions_destroy(regions);
        assert_int_equal(blocks_held(), before);
    }
    assert_int_equal(status, PLIANT_OK);
    check_at_least(n, 15);
    pliant_links *links = NULL, *copy = NULL;
    pliant_error err = {""};
    check_ok(pliant_links_create(&l->shape, &links, &err), &err);
    const long held = blocks_held();
    status = PLIANT_ERR_MEMORY;
    for (n = 0; status == PLIANT_ERR_MEMORY; n++) {
        assert_null(copy);
        assert_int_equal(blocks_held(), held);
        exhaust_after(n);
        status = pliant_links_copy(links, &copy, &err);
        exhaust_never();
    }
    assert_int_equal(status, PLIANT_OK);
    check_at_least(n, 4);
    pliant_links_destroy(copy);
    pliant_links_destroy(links);
    assert_int_equal(blocks_held(), before);
    cell_lattice_destroy(l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nodes_rebuild_every_region),
        cmocka_unit_test(nodes_of_the_greatest_half_width_rebuild_every_region),
        cmocka_unit_test(regions_are_mutual),
        cmocka_unit_test(equal_regions_share_and_others_do_not),
        cmocka_unit_test(equal_plates_are_one_node),
        cmocka_unit_test(boxes_have_no_nodes),
        cmocka_unit_test(wrong_half_widths_and_shapes_are_refused),
        cmocka_unit_test(memory_may_run_out_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
