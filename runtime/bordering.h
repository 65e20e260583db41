// bordering.h: inverses that follow their matrix when three rows and columns come or go.
//
// With B = M^-1 and blocks of three rows and columns, b = the new columns, c^T = the new rows,
// d = the corner, S = d - c B b:
//
//     [M b; c d]^-1 = [B + F S^-1 H, -F S^-1; -S^-1 H, S^-1],   F = B b,  H = c B
//
// and what is left of B without the rows and columns I is B - B_I B_II^-1 B^I. All of it O(n^2).
// Layout as in dense.h.
#pragma once

#include <stddef.h>
#include <stdint.h>

// Append three rows and columns to `inverse`, of n rows. `columns` (b) is [3][stride], `rows`
// (c, row by row) likewise, zero behind n; `corner` is row-major, `work` has shape [12 stride].
// 0, and nothing was changed, when a pivot of the Cholesky factorisation of S's symmetric part is
// not above `least_pivot` (-INFINITY: do not ask), or S is singular.
int32_t pliant_bordering_append(size_t n, size_t stride, double *inverse, const double *columns,
                                const double *rows, const double *corner, double least_pivot,
                                double *work);
// Remove rows and columns first .. first + 2 from `inverse`, of n rows; the last three take their
// place. 0 when the block there is singular: nothing was changed.
int32_t pliant_bordering_remove(size_t n, size_t stride, double *inverse, size_t first,
                                double *work);
// Move the last three rows and columns of a matrix to first .. first + 2, and clear them.
void pliant_bordering_move_last(size_t n, size_t stride, double *matrix, size_t first);
