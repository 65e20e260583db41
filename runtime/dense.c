// dense.c: the small dense matrices of contact: definiteness, inverse, product.
//
// This follows: G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed. (blocked Cholesky and
// LU); E. S. Quintana, G. Quintana, X. Sun, R. van de Geijn, A note on parallel matrix inversion,
// SIAM J. Sci. Comput. 22(5), 2001 (inversion by blocked Gauss-Jordan: all work is one kind of
// matrix product, in place).
#include "dense.h"

#include "pliant/vector_clones.h"

#include <math.h>
#include <string.h>

// Inlined into every clone: a function of its own would be compiled for the oldest machine only.
#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

typedef double lane8 __attribute__((vector_size(64)));
typedef float lane16 __attribute__((vector_size(64)));

size_t pliant_dense_stride(size_t n)
{
    return (n + PLIANT_DENSE_LANES - 1) / PLIANT_DENSE_LANES * PLIANT_DENSE_LANES;
}

size_t pliant_dense_leading(size_t n)
{
    const size_t stride = pliant_dense_stride(n);
    return stride % 64 == 0 ? stride + PLIANT_DENSE_LANES : stride;
}

size_t pliant_dense_work_count(size_t n)
{
    // A panel of all rows, and as many rows of all columns.
    return 2 * PLIANT_DENSE_PANEL * pliant_dense_stride(n);
}

// C += T R for `row_count` rows (a multiple of 8) and `column_count` columns, depth `depth`. R is
// [column][depth] with `depth_stride`. Tiles of 24 rows x 4 columns keep 12 sums in registers.
INLINE void multiply_add(size_t row_count, size_t column_count, size_t depth,
                         const double *restrict t, size_t t_stride, const double *restrict r,
                         size_t depth_stride, double *restrict c, size_t c_stride)
{
    size_t j = 0;
    for (; j + 4 <= column_count; j += 4) {
        const double *r0 = r + j * depth_stride, *r1 = r0 + depth_stride;
        const double *r2 = r1 + depth_stride, *r3 = r2 + depth_stride;
        size_t i = 0;
        for (; i + 24 <= row_count; i += 24) {
            double *to = c + i + j * c_stride;
            lane8 sum[4][3];
            for (int b = 0; b < 4; b++)
                for (int a = 0; a < 3; a++) sum[b][a] = ((lane8 *)(to + (size_t)b * c_stride))[a];
            const double *from = t + i;
            for (size_t k = 0; k < depth; k++, from += t_stride) {
                const lane8 *lanes = (const lane8 *)from;
                const lane8 t0 = lanes[0], t1 = lanes[1], t2 = lanes[2];
                sum[0][0] += t0 * r0[k], sum[0][1] += t1 * r0[k], sum[0][2] += t2 * r0[k];
                sum[1][0] += t0 * r1[k], sum[1][1] += t1 * r1[k], sum[1][2] += t2 * r1[k];
                sum[2][0] += t0 * r2[k], sum[2][1] += t1 * r2[k], sum[2][2] += t2 * r2[k];
                sum[3][0] += t0 * r3[k], sum[3][1] += t1 * r3[k], sum[3][2] += t2 * r3[k];
            }
            for (int b = 0; b < 4; b++)
                for (int a = 0; a < 3; a++) ((lane8 *)(to + (size_t)b * c_stride))[a] = sum[b][a];
        }
        for (; i < row_count; i += 8) {
            lane8 *to0 = (lane8 *)(c + i + j * c_stride);
            lane8 *to1 = (lane8 *)(c + i + (j + 1) * c_stride);
            lane8 *to2 = (lane8 *)(c + i + (j + 2) * c_stride);
            lane8 *to3 = (lane8 *)(c + i + (j + 3) * c_stride);
            lane8 sum0 = *to0, sum1 = *to1, sum2 = *to2, sum3 = *to3;
            for (size_t k = 0; k < depth; k++) {
                const lane8 t0 = *(const lane8 *)(t + i + k * t_stride);
                sum0 += t0 * r0[k], sum1 += t0 * r1[k], sum2 += t0 * r2[k], sum3 += t0 * r3[k];
            }
            *to0 = sum0, *to1 = sum1, *to2 = sum2, *to3 = sum3;
        }
    }
    for (; j < column_count; j++)
        for (size_t i = 0; i < row_count; i += 8) {
            lane8 *to = (lane8 *)(c + i + j * c_stride);
            lane8 sum = *to;
            for (size_t k = 0; k < depth; k++)
                sum += *(const lane8 *)(t + i + k * t_stride) * r[k + j * depth_stride];
            *to = sum;
        }
}

// Left-looking by panels of columns K: A[K.., K] -= L[K.., ..K] L[K, ..K]^T, then the panel alone.
PLIANT_VECTOR_CLONES
int32_t pliant_dense_definite(size_t n, size_t stride, double *matrix, double *work)
{
    enum { panel = PLIANT_DENSE_PANEL };
    const size_t rows = pliant_dense_stride(n);
    for (size_t k = 0; k < n; k += panel) {
        const size_t width = n - k < panel ? n - k : panel;
        for (size_t j = 0; j < width; j++)
            for (size_t i = 0; i < k; i++) work[i + j * rows] = -matrix[k + j + i * stride];
        multiply_add(rows - k, width, k, matrix + k, stride, work, rows, matrix + k + k * stride,
                     stride);
        for (size_t j = k; j < k + width; j++) {
            double *column = matrix + j * stride;
            if (!(column[j] > 0)) return 0;  // NaN is not positive either
            const double scale = 1 / sqrt(column[j]);
            if (!isfinite(scale)) return 0;
            for (size_t i = j; i < rows; i++) column[i] *= scale;
            for (size_t to = j + 1; to < k + width; to++) {
                const double factor = column[to];
                double *other = matrix + to * stride;
                for (size_t i = k; i < rows; i++) other[i] -= factor * column[i];
            }
        }
    }
    return 1;
}

static void swap_rows(size_t n, size_t stride, double *matrix, size_t a, size_t b)
{
    for (size_t j = 0; j < n; j++) {
        const double kept = matrix[a + j * stride];
        matrix[a + j * stride] = matrix[b + j * stride];
        matrix[b + j * stride] = kept;
    }
}

// Eliminate the columns K = k .. k+width-1 of all rows, in place: afterwards they hold what the
// product G of these steps makes of the unit vectors e_K. 0 when a pivot vanishes. `pivots` NULL:
// no rows are swapped, and pivots have to be above *least.
INLINE int32_t eliminate_panel(size_t n, size_t stride, size_t k, size_t width, double *matrix,
                               int32_t *pivots, double *least, double *most)
{
    const size_t rows = pliant_dense_stride(n);
    for (size_t c = k; c < k + width; c++) {
        double *column = matrix + c * stride;
        if (pivots) {
            size_t pivot = c;
            for (size_t i = c + 1; i < n; i++)
                if (fabs(column[i]) > fabs(column[pivot])) pivot = i;
            pivots[c] = (int32_t)pivot;
            if (pivot != c) swap_rows(n, stride, matrix, c, pivot);
        } else if (!(column[c] > *least)) {
            return 0;
        }
        const double magnitude = fabs(column[c]);
        if (!(magnitude > 0) || !isfinite(1 / magnitude)) return 0;
        if (pivots) *least = fmin(*least, magnitude);
        *most = fmax(*most, magnitude);
        const double inverse = 1 / column[c];
        // The column itself becomes that of G: -column / pivot, and 1 / pivot at the pivot.
        for (size_t i = 0; i < rows; i++) column[i] *= -inverse;
        column[c] = inverse;
        for (size_t to = k; to < k + width; to++) {
            if (to == c) continue;
            double *other = matrix + to * stride;
            const double factor = other[c];
            other[c] = 0;
            for (size_t i = 0; i < rows; i++) other[i] += factor * column[i];
        }
    }
    return 1;
}

// Columns first .. last - 1, none of the panel's, after the panel K was eliminated.
INLINE void update_columns(size_t rows, size_t stride, size_t k, size_t width, size_t first,
                           size_t last, double *matrix, double *work)
{
    for (size_t j = first; j < last; j++) {
        double *taken = matrix + k + j * stride, *kept = work + (j - first) * PLIANT_DENSE_PANEL;
        memcpy(kept, taken, width * sizeof *kept);
        memset(taken, 0, width * sizeof *taken);
    }
    multiply_add(rows, last - first, width, matrix + k * stride, stride, work, PLIANT_DENSE_PANEL,
                 matrix + first * stride, stride);
}

// A panel K at a time: G = I + (T - E_K) E_K^T with T the eliminated panel, so the other columns J
// become A[:,J] - E_K A[K,J] + T A[K,J].
PLIANT_VECTOR_CLONES
double pliant_dense_invert(size_t n, size_t stride, double *matrix, int32_t *pivots, double *work)
{
    enum { panel = PLIANT_DENSE_PANEL };
    const size_t rows = pliant_dense_stride(n);
    double least = INFINITY, most = 0;
    for (size_t k = 0; k < n; k += panel) {
        const size_t width = n - k < panel ? n - k : panel;
        if (!eliminate_panel(n, stride, k, width, matrix, pivots, &least, &most)) return 0;
        update_columns(rows, stride, k, width, 0, k, matrix, work);
        update_columns(rows, stride, k, width, k + width, n, matrix, work);
    }
    // (P A)^-1 P: the row swaps, undone on the columns, last first.
    for (size_t c = n; c-- > 0;) {
        const size_t other = (size_t)pivots[c];
        if (other == c) continue;
        for (size_t i = 0; i < n; i++) {
            const double kept = matrix[i + c * stride];
            matrix[i + c * stride] = matrix[i + other * stride];
            matrix[i + other * stride] = kept;
        }
    }
    return n ? least / most : 1;
}

PLIANT_VECTOR_CLONES
pliant_dense_progress pliant_dense_sweep_step(size_t n, size_t stride, double *matrix,
                                              double least_pivot, double *work,
                                              pliant_dense_sweep *sweep)
{
    enum { panel = PLIANT_DENSE_PANEL };
    if (sweep->panel >= n) return PLIANT_DENSE_DONE;
    const size_t k = sweep->panel, width = n - k < panel ? n - k : panel;
    if (!sweep->has_panel) {
        double most = 0;
        if (!eliminate_panel(n, stride, k, width, matrix, NULL, &least_pivot, &most))
            return PLIANT_DENSE_REFUSED;
        sweep->has_panel = 1;
        sweep->column = 0;
    } else {
        // Panels begin at multiples of the panel's width, so groups of columns do not straddle.
        const size_t first = sweep->column, left = n - first;
        const size_t last = first + (left < panel ? left : panel);
        if (first != k)
            update_columns(pliant_dense_stride(n), stride, k, width, first, last, matrix, work);
        sweep->column = last;
    }
    if (sweep->column >= n) {
        sweep->panel = k + width;
        sweep->has_panel = 0;
    }
    return sweep->panel >= n ? PLIANT_DENSE_DONE : PLIANT_DENSE_MORE;
}

PLIANT_VECTOR_CLONES
void pliant_dense_multiply(size_t n, size_t stride, const float *matrix, const float *x, float *y)
{
    memset(y, 0, stride * sizeof *y);
    size_t j = 0;
    for (; j + 8 <= n; j += 8) {
        const float *a = matrix + j * stride;
        for (size_t i = 0; i < stride; i += 16) {
            lane16 sum = *(lane16 *)(y + i), sum2;
            sum += *(const lane16 *)(a + i) * x[j];
            sum2 = *(const lane16 *)(a + i + stride) * x[j + 1];
            sum += *(const lane16 *)(a + i + 2 * stride) * x[j + 2];
            sum2 += *(const lane16 *)(a + i + 3 * stride) * x[j + 3];
            sum += *(const lane16 *)(a + i + 4 * stride) * x[j + 4];
            sum2 += *(const lane16 *)(a + i + 5 * stride) * x[j + 5];
            sum += *(const lane16 *)(a + i + 6 * stride) * x[j + 6];
            sum2 += *(const lane16 *)(a + i + 7 * stride) * x[j + 7];
            *(lane16 *)(y + i) = sum + sum2;
        }
    }
    for (; j < n; j++)
        for (size_t i = 0; i < stride; i += 16)
            *(lane16 *)(y + i) += *(const lane16 *)(matrix + i + j * stride) * x[j];
}

PLIANT_VECTOR_CLONES
void pliant_dense_multiply_double(size_t n, size_t stride, const double *matrix, const double *x,
                                  double *y)
{
    const size_t rows = pliant_dense_stride(n);
    memset(y, 0, rows * sizeof *y);
    size_t j = 0;
    for (; j + 4 <= n; j += 4) {
        const double *a = matrix + j * stride;
        for (size_t i = 0; i < rows; i += 8) {
            lane8 sum = *(lane8 *)(y + i), other;
            sum += *(const lane8 *)(a + i) * x[j];
            other = *(const lane8 *)(a + i + stride) * x[j + 1];
            sum += *(const lane8 *)(a + i + 2 * stride) * x[j + 2];
            other += *(const lane8 *)(a + i + 3 * stride) * x[j + 3];
            *(lane8 *)(y + i) = sum + other;
        }
    }
    for (; j < n; j++)
        for (size_t i = 0; i < rows; i += 8)
            *(lane8 *)(y + i) += *(const lane8 *)(matrix + i + j * stride) * x[j];
}
