// triangle_box.h: does a triangle touch a box of whole cells?
//
// This follows: T. Akenine-Moeller, Fast 3D triangle-box overlap testing, Journal of Graphics Tools
// 6(1), 2001: separating axes, three of the box, the triangle's normal, and nine products of edges.
// Here a triangle's projections on them are made once, for all the boxes it is tested against.
//
// Coordinates are those of the grid: cell (i, j, k) is the closed cube from (i, j, k) to
// (i + 1, j + 1, k + 1). What touches in a point touches, and so does what rounding cannot tell
// from it: the test never misses a cell, and errs by less than PLIANT_TRIANGLE_SLACK of a cell.
#pragma once

#include "pliant/base.h"

// Coordinates up to 1024 carry 2^-42 from their rounding, products of them 2^-40 of an edge.
#define PLIANT_TRIANGLE_SLACK 0x1p-34

typedef struct pliant_triangle_box {
    int32_t first[3], last[3];  // cells of the triangle's own box, cut to the grid
    double axis[10][3];         // nine products of edges and the box's axes, and the normal
    double low[10], high[10];   // the triangle's projections on them, relative to `first`
    double slack[10];
} pliant_triangle_box;

// `corners` has shape [3][3], grid coordinates; dims are the grid's cells along x, y, z.
void pliant_triangle_box_prepare(const double corners[3][3], const int32_t dims[3],
                                 pliant_triangle_box *triangle);

// 1 when the triangle touches the box of the cells first .. last, inside the triangle's own box.
// `slack_factor` widens the slack: a box of several cells is asked with 2, so that it never denies
// what a cell of it affirms with 1.
int pliant_triangle_box_overlaps(const pliant_triangle_box *triangle, const int32_t first[3],
                                 const int32_t last[3], double slack_factor);
