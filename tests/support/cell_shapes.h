// cell_shapes.h: sets of lattice cells that try what voxel lattices do: thin parts, gaps, corners.
//
//     int32_t count = check_cell_shape(CHECK_CELLS_COMB, 5, NULL);
//     int32_t *cells = malloc((size_t)count * 3 * sizeof *cells);
//     check_cell_shape(CHECK_CELLS_COMB, 5, cells);
#pragma once

#include <stdint.h>

typedef enum check_cells {
    CHECK_CELLS_SINGLE,   // one cell, whatever the size
    CHECK_CELLS_CUBE,     // size^3
    CHECK_CELLS_BALL,     // cells of that cube with their centre in its inscribed ball
    CHECK_CELLS_SHELL,    // cells that the sphere half a cell inside that ball passes through
    CHECK_CELLS_COMB,     // teeth along y, size of them, a cell apart, on a spine along x; 2 thick
    CHECK_CELLS_TORUS,    // a solid ring about z, as wide as size (6 or more: else it has no hole)
    CHECK_CELLS_CHECKER,  // every second cell of the cube: they touch along edges
    CHECK_CELLS_CORNERS,  // every fourth: they touch at corners only
    CHECK_CELLS_TWO,      // two cubes, a cell apart along x: windows reach across, regions do not
    CHECK_CELLS_FOLDED,   // a U of two plates size x size, a cell apart, joined along one side
    CHECK_CELLS_SPONGE,   // about half of the cube's cells, at random but always the same
    CHECK_CELLS_SHAPES    // how many shapes there are
} check_cells;

// "comb" and so on, for messages; static.
const char *check_cell_shape_name(check_cells shape);

// Fill `cells`, shape [count][3], unless it is NULL: the least corner of each cell, >= 0, ascending
// by (z, y, x). Returns the count; at least 1 for size >= 1, at most (2 size + 1)^3.
int32_t check_cell_shape(check_cells shape, int32_t size, int32_t *cells);
