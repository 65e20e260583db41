// bordering.c: inverses that follow their matrix when three rows and columns come or go.
//
// This follows: G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed., 2.1.4 (the Sherman,
// Morrison and Woodbury formulas); D. L. James, Multiresolution Green's function methods, thesis,
// University of British Columbia, 2001, which updates capacitance inverses so (GF 5.4, step 2).
#include "bordering.h"

#include "dense.h"
#include "pliant/vector_clones.h"

#include <math.h>
#include <string.h>

typedef double lane8 __attribute__((vector_size(64)));

// F = B b and H = c B in one pass over B; all of them [3][rows].
PLIANT_VECTOR_CLONES
static void apply_both(size_t n, size_t stride, const double *inverse, const double *b,
                       const double *c, size_t border_stride, double *f, double *h)
{
    const size_t rows = pliant_dense_stride(n);
    memset(f, 0, 3 * rows * sizeof *f);
    memset(h, 0, 3 * rows * sizeof *h);
    const double *c0 = c, *c1 = c + border_stride, *c2 = c1 + border_stride;
    for (size_t j = 0; j < n; j++) {
        const double *column = inverse + j * stride;
        const double b0 = b[j], b1 = b[j + border_stride], b2 = b[j + 2 * border_stride];
        lane8 sum0 = {0}, sum1 = {0}, sum2 = {0};
        for (size_t i = 0; i < rows; i += 8) {
            const lane8 a = *(const lane8 *)(column + i);
            *(lane8 *)(f + i) += a * b0;
            *(lane8 *)(f + rows + i) += a * b1;
            *(lane8 *)(f + 2 * rows + i) += a * b2;
            lane8 r0, r1, r2;
            memcpy(&r0, c0 + i, sizeof r0);
            memcpy(&r1, c1 + i, sizeof r1);
            memcpy(&r2, c2 + i, sizeof r2);
            sum0 += a * r0, sum1 += a * r1, sum2 += a * r2;
        }
        for (int k = 0; k < 8; k++) {
            h[j] += sum0[k];
            h[j + rows] += sum1[k];
            h[j + 2 * rows] += sum2[k];
        }
    }
}

// B += F T with F [3][rows] and T [3][rows], a row of T times a column of F.
PLIANT_VECTOR_CLONES
static void add_rank3(size_t n, size_t stride, double *matrix, const double *f, const double *t)
{
    const size_t rows = pliant_dense_stride(n);
    for (size_t j = 0; j < n; j++) {
        double *column = matrix + j * stride;
        const double t0 = t[j], t1 = t[j + rows], t2 = t[j + 2 * rows];
        for (size_t i = 0; i < rows; i += 8)
            *(lane8 *)(column + i) += *(const lane8 *)(f + i) * t0 +
                                      *(const lane8 *)(f + rows + i) * t1 +
                                      *(const lane8 *)(f + 2 * rows + i) * t2;
    }
}

// The inverse of a 3x3 matrix by cofactors; its determinant.
static double invert3(const double *m, double *inverse)
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            inverse[3 * c + r] = m[3 * r1 + c1] * m[3 * r2 + c2] - m[3 * r1 + c2] * m[3 * r2 + c1];
        }
    const double determinant = m[0] * inverse[0] + m[1] * inverse[3] + m[2] * inverse[6];
    for (int e = 0; e < 9; e++) inverse[e] /= determinant;
    return determinant;
}

// Least pivot of the symmetric part's Cholesky factorisation.
static double least_pivot_of(const double *m)
{
    double s[3][3];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) s[r][c] = (m[3 * r + c] + m[3 * c + r]) / 2;
    double least = INFINITY;
    for (int k = 0; k < 3; k++) {
        if (!(s[k][k] > 0)) return s[k][k] < 0 ? s[k][k] : 0;
        least = fmin(least, s[k][k]);
        for (int r = k + 1; r < 3; r++)
            for (int c = k + 1; c < 3; c++) s[r][c] -= s[r][k] * s[k][c] / s[k][k];
    }
    return least;
}

int32_t pliant_bordering_append(size_t n, size_t stride, double *inverse, const double *columns,
                                const double *rows, const double *corner, double least_pivot,
                                double *work)
{
    const size_t old_rows = pliant_dense_stride(n);
    double *f = work, *h = work + 3 * old_rows, *t = work + 6 * old_rows;
    apply_both(n, stride, inverse, columns, rows, stride, f, h);
    double schur[9], inverted[9];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            double sum = corner[3 * r + c];
            const double *row = rows + (size_t)r * stride, *column = f + (size_t)c * old_rows;
            for (size_t k = 0; k < n; k++) sum -= row[k] * column[k];
            schur[3 * r + c] = sum;
        }
    if (!(least_pivot_of(schur) > least_pivot)) return 0;
    const double determinant = invert3(schur, inverted);
    if (!isfinite(1 / determinant)) return 0;
    // T = S^-1 H, which is also minus the new rows.
    for (int r = 0; r < 3; r++)
        for (size_t j = 0; j < old_rows; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += inverted[3 * r + k] * h[j + (size_t)k * old_rows];
            t[j + (size_t)r * old_rows] = sum;
        }
    add_rank3(n, stride, inverse, f, t);
    for (size_t c = 0; c < 3; c++) {
        double *column = inverse + (n + c) * stride;
        memset(column, 0, pliant_dense_stride(n + 3) * sizeof *column);
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < 3; k++) column[i] -= f[i + k * old_rows] * inverted[3 * k + c];
        for (size_t r = 0; r < 3; r++) column[n + r] = inverted[3 * r + c];
    }
    for (size_t j = 0; j < n; j++) {
        double *column = inverse + j * stride + n;
        // Beyond the old rows a new column may never have been cleared.
        memset(column, 0, (pliant_dense_stride(n + 3) - n) * sizeof *column);
        for (size_t r = 0; r < 3; r++) column[r] = -t[j + r * old_rows];
    }
    return 1;
}

void pliant_bordering_move_last(size_t n, size_t stride, double *matrix, size_t first)
{
    const size_t last = n - 3, rows = pliant_dense_stride(n);
    if (first != last) {
        for (size_t c = 0; c < 3; c++)
            memcpy(matrix + (first + c) * stride, matrix + (last + c) * stride,
                   rows * sizeof *matrix);
        for (size_t j = 0; j < n; j++)
            for (size_t r = 0; r < 3; r++)
                matrix[first + r + j * stride] = matrix[last + r + j * stride];
    }
    for (size_t j = 0; j < n; j++)
        for (size_t r = 0; r < 3; r++) matrix[last + r + j * stride] = 0;
}

int32_t pliant_bordering_remove(size_t n, size_t stride, double *inverse, size_t first,
                                double *work)
{
    const size_t rows = pliant_dense_stride(n);
    double *f = work, *t = work + 3 * rows, block[9], inverted[9];
    for (size_t r = 0; r < 3; r++)
        for (size_t c = 0; c < 3; c++) block[3 * r + c] = inverse[first + r + (first + c) * stride];
    const double determinant = invert3(block, inverted);
    if (!isfinite(determinant) || !isfinite(1 / determinant)) return 0;
    for (size_t c = 0; c < 3; c++)
        memcpy(f + c * rows, inverse + (first + c) * stride, rows * sizeof *f);
    memset(t, 0, 3 * rows * sizeof *t);
    for (size_t r = 0; r < 3; r++)
        for (size_t j = 0; j < n; j++)
            for (size_t k = 0; k < 3; k++)
                t[j + r * rows] -= inverted[3 * r + k] * inverse[first + k + j * stride];
    add_rank3(n, stride, inverse, f, t);
    pliant_bordering_move_last(n, stride, inverse, first);
    return 1;
}
