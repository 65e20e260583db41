// vector.h: vectors of three doubles and 3x3 matrices, for geometry on the way of a step.
#pragma once

#include <math.h>

static inline double vector_dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double vector_length(const double *a)
{
    return sqrt(vector_dot(a, a));
}

// to = a - b; `to` may be either.
static inline void vector_subtract(const double *a, const double *b, double *to)
{
    for (int c = 0; c < 3; c++) to[c] = a[c] - b[c];
}

// to += factor a
static inline void vector_add(double factor, const double *a, double *to)
{
    for (int c = 0; c < 3; c++) to[c] += factor * a[c];
}

// `to` may be neither.
static inline void vector_cross(const double *a, const double *b, double *to)
{
    to[0] = a[1] * b[2] - a[2] * b[1];
    to[1] = a[2] * b[0] - a[0] * b[2];
    to[2] = a[0] * b[1] - a[1] * b[0];
}

// to = sum of weights[i] corners[i]; `corners` has shape [3][3].
static inline void vector_mix(const double *weights, const double *corners, double *to)
{
    for (int c = 0; c < 3; c++)
        to[c] = weights[0] * corners[c] + weights[1] * corners[3 + c] + weights[2] * corners[6 + c];
}

// to = matrix a, row-major; `to` may not be `a`.
static inline void vector_transform(const double *matrix, const double *a, double *to)
{
    for (int r = 0; r < 3; r++) to[r] = vector_dot(matrix + 3 * r, a);
}
