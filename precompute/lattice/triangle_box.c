// triangle_box.c: does a triangle touch a box of whole cells?
#include "lattice/triangle_box.h"

#include <math.h>

static double size_of(const double v[3])
{
    return fabs(v[0]) + fabs(v[1]) + fabs(v[2]);
}

static int32_t cut(double cell, int32_t count)
{
    return cell < 0 ? 0 : cell >= count ? count - 1 : (int32_t)cell;
}

void pliant_triangle_box_prepare(const double corners[3][3], const int32_t dims[3],
                                 pliant_triangle_box *t)
{
    double p[3][3], edge[3][3];
    for (int d = 0; d < 3; d++) {
        const double low = fmin(corners[0][d], fmin(corners[1][d], corners[2][d]));
        const double high = fmax(corners[0][d], fmax(corners[1][d], corners[2][d]));
        // A cell [i, i + 1] touches low .. high when i <= high and i + 1 >= low.
        t->first[d] = cut(ceil(low - PLIANT_TRIANGLE_SLACK) - 1, dims[d]);
        t->last[d] = cut(floor(high + PLIANT_TRIANGLE_SLACK), dims[d]);
        for (int c = 0; c < 3; c++) p[c][d] = corners[c][d] - t->first[d];
    }
    for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++) edge[c][d] = p[(c + 1) % 3][d] - p[c][d];

    for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++) {
            // The box's axis d times edge c.
            double *a = t->axis[3 * c + d];
            a[d] = 0;
            a[(d + 1) % 3] = -edge[c][(d + 2) % 3];
            a[(d + 2) % 3] = edge[c][(d + 1) % 3];
        }
    // A sliver's normal may be wrong, and the axes of a line or a point are zero: what touches is
    // separated along no axis whatever, right or wrong.
    double *n = t->axis[9];
    for (int d = 0; d < 3; d++)
        n[d] = edge[0][(d + 1) % 3] * edge[1][(d + 2) % 3] -
               edge[0][(d + 2) % 3] * edge[1][(d + 1) % 3];
    for (int i = 0; i < 10; i++) {
        const double *a = t->axis[i];
        t->low[i] = INFINITY;
        t->high[i] = -INFINITY;
        for (int c = 0; c < 3; c++) {
            const double along = a[0] * p[c][0] + a[1] * p[c][1] + a[2] * p[c][2];
            t->low[i] = fmin(t->low[i], along);
            t->high[i] = fmax(t->high[i], along);
        }
        t->slack[i] = PLIANT_TRIANGLE_SLACK * size_of(a);
    }
}

int pliant_triangle_box_overlaps(const pliant_triangle_box *t, const int32_t first[3],
                                 const int32_t last[3], double slack_factor)
{
    double centre[3], half[3];
    for (int d = 0; d < 3; d++) {
        half[d] = 0.5 * (last[d] - first[d] + 1);
        centre[d] = first[d] - t->first[d] + half[d];
    }
    for (int i = 0; i < 10; i++) {
        const double *a = t->axis[i];
        const double at = a[0] * centre[0] + a[1] * centre[1] + a[2] * centre[2];
        const double radius = fabs(a[0]) * half[0] + fabs(a[1]) * half[1] + fabs(a[2]) * half[2] +
                              slack_factor * t->slack[i];
        if (at - radius > t->high[i] || at + radius < t->low[i]) return 0;
    }
    return 1;
}
