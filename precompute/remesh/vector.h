// vector.h: three doubles: the few operations that the remesher's geometry takes.
#pragma once

#include <math.h>

static inline double pliant_dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void pliant_subtract(const double *a, const double *b, double *c)
{
    for (int k = 0; k < 3; k++) c[k] = a[k] - b[k];
}

static inline void pliant_cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double pliant_length(const double *a)
{
    return sqrt(pliant_dot(a, a));
}

static inline double pliant_squared_distance(const double *a, const double *b)
{
    double d[3];
    pliant_subtract(a, b, d);
    return pliant_dot(d, d);
}

// Scale to length 1; what has no length stays.
static inline void pliant_normalize(double *a)
{
    const double length = pliant_length(a);
    if (!(length > 0)) return;
    for (int k = 0; k < 3; k++) a[k] /= length;
}

// (q - p) x (r - p): twice the area, along the normal.
static inline void pliant_face_normal(const double *p, const double *q, const double *r, double *n)
{
    double a[3], b[3];
    pliant_subtract(q, p, a);
    pliant_subtract(r, p, b);
    pliant_cross(a, b, n);
}
