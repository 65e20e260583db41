// cell_lattice.c: cells of a shape with their particles as the library takes them, and the same
// slow.
#include "cell_lattice.h"

#include <stdlib.h>

cell_lattice *cell_lattice_create(check_cells shape, int32_t size, int32_t half_width)
{
    cell_lattice *l = calloc(1, sizeof *l);
    assert_non_null(l);
    const int32_t count = check_cell_shape(shape, size, NULL);
    l->cells = malloc(3 * (size_t)count * sizeof *l->cells);
    l->particles = malloc(24 * (size_t)count * sizeof *l->particles);
    assert_true(l->cells && l->particles);
    check_cell_shape(shape, size, l->cells);
    l->shape = (pliant_lattice_shape){.cell_count = count,
                                      .cells = l->cells,
                                      .particles = l->particles,
                                      .particle_count =
                                          pliant_lattice_particles(count, l->cells, l->particles)};
    for (int32_t i = 0; i < 3 * l->shape.particle_count; i++)
        if (l->particles[i] >= l->shape.dims[i % 3]) l->shape.dims[i % 3] = l->particles[i] + 1;
    l->slow = reference_lattice_create(count, l->cells, half_width, 1, NULL);
    return l;
}

void cell_lattice_destroy(cell_lattice *l)
{
    if (!l) return;
    reference_lattice_destroy(l->slow);
    free(l->cells);
    free(l->particles);
    free(l);
}

int32_t cell_lattice_member(const cell_lattice *l, int32_t particle, int32_t w, int32_t z,
                            int32_t y, int32_t bit)
{
    const int32_t *at = l->slow->particles + 3 * particle;
    return reference_lattice_find(
        l->slow, (const int32_t[3]){at[0] + bit - w, at[1] + y - w, at[2] + z - w});
}

void cell_lattice_check_reach(const cell_lattice *l, int32_t particle, const pliant_reach *reach)
{
    const reference_lattice *slow = l->slow;
    const int32_t w = slow->half_width, *at = slow->particles + 3 * particle;
    const int32_t first = slow->region_offset[particle], end = slow->region_offset[particle + 1];
    int32_t bits = 0, window = 0;
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++) {
            bits += __builtin_popcount(reach->member[z][y]);
            window += __builtin_popcount(reach->window[z][y]);
        }
    for (int32_t k = first; k < end; k++) {
        const int32_t *other = slow->particles + 3 * slow->region[k];
        const int32_t x = other[0] - at[0] + w, y = other[1] - at[1] + w, z = other[2] - at[2] + w;
        assert_true(reach->member[z][y] >> x & 1);
        assert_true(reach->window[z][y] >> x & 1);
    }
    assert_int_equal(bits, end - first);
    assert_int_equal(reach->size, end - first);
    assert_int_equal(reach->is_regular, window == bits);
}
