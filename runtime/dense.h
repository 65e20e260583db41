// dense.h: the small dense matrices of contact: definiteness, inverse, product.
//
// LAPACK would do, but OpenBLAS (0.3.21, measured) allocates inside dgetri and dpotrf (2 to 290
// malloc calls for 90 to 900 unknowns) and wakes threads from 200 unknowns on, neither of which a
// frame may do. These kernels run on the caller's thread in memory the caller gives.
//
// Matrices are column-major with a leading dimension `stride`: element (i, j) at [i + j * stride].
// Rows n .. pliant_dense_stride(n)-1 of a matrix of n rows are zero on entry and on return; kernels
// do not look further, whatever the leading dimension.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

// Strides are multiples of this many elements, and matrices 64-byte aligned.
#define PLIANT_DENSE_LANES 16
// Columns eliminated together.
#define PLIANT_DENSE_PANEL 48

// Least stride for n rows.
size_t pliant_dense_stride(size_t n);
// A leading dimension for matrices that grow up to n rows: columns do not fall on the same cache
// sets.
size_t pliant_dense_leading(size_t n);
// Elements of workspace that invert and definite need for n rows.
size_t pliant_dense_work_count(size_t n);

// Is the symmetric matrix whose lower triangle is in `matrix` positive definite? 1: yes, 0: no. By
// Cholesky factorisation; destroys the lower triangle. `work` has shape [work_count].
int32_t pliant_dense_definite(size_t n, size_t stride, double *matrix, double *work);

// Invert in place, Gauss-Jordan with partial pivoting. Returns the smallest magnitude of a pivot
// over the largest, 0 when a pivot vanished (the matrix is then garbage). `pivots` has shape [n].
double pliant_dense_invert(size_t n, size_t stride, double *matrix, int32_t *pivots, double *work);

// The same without pivoting, for matrices whose symmetric part is positive definite, in slices: so
// that a caller with a deadline can stop between them. Zero the state, then step until it says so.
typedef struct pliant_dense_sweep {
    size_t panel, column;  // eliminated so far, and updated by the panel at hand
    int32_t has_panel;
} pliant_dense_sweep;
typedef enum pliant_dense_progress {
    PLIANT_DENSE_REFUSED = -1,  // a pivot is not above `least_pivot`: not definite; garbage is left
    PLIANT_DENSE_DONE = 0,
    PLIANT_DENSE_MORE = 1,
} pliant_dense_progress;
// One slice: some 2 n PLIANT_DENSE_PANEL^2 operations. `work` as for invert, not kept between
// slices.
pliant_dense_progress pliant_dense_sweep_step(size_t n, size_t stride, double *matrix,
                                              double least_pivot, double *work,
                                              pliant_dense_sweep *sweep);

// y = A x; `y` has shape [stride], 64-byte aligned: rows n .. stride-1 of A must be zero.
void pliant_dense_multiply(size_t n, size_t stride, const float *matrix, const float *x, float *y);

// y = A x in double; `y` has shape [pliant_dense_stride(n)].
void pliant_dense_multiply_double(size_t n, size_t stride, const double *matrix, const double *x,
                                  double *y);
