// cell_lattice.h: cells of a shape with their particles as the library takes them, and the same
// slow.
#pragma once

#include "cell_shapes.h"
#include "check.h"
#include "pliant/links.h"
#include "reference_lattice.h"

typedef struct cell_lattice {
    pliant_lattice_shape shape;  // its arrays are the next two
    int32_t *cells, *particles;
    reference_lattice *slow;
} cell_lattice;

cell_lattice *cell_lattice_create(check_cells shape, int32_t size, int32_t half_width);
void cell_lattice_destroy(cell_lattice *lattice);

// The particle of slow at bit `bit` of row [z][y] of a window of half-width w about `particle`, or
// -1.
int32_t cell_lattice_member(const cell_lattice *lattice, int32_t particle, int32_t w, int32_t z,
                            int32_t y, int32_t bit);
// `reach`, of the particle, has slow's members, size and regularity; half-width as slow's.
void cell_lattice_check_reach(const cell_lattice *lattice, int32_t particle,
                              const pliant_reach *reach);
