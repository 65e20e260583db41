// bem_reference.h: slow and obvious element integrals, with nothing in common with the fast ones
// but Kelvin's scalar formulas.
#pragma once

#include "bem/kelvin.h"

#include <math.h>
#include <string.h>

// Integrals of U and T over one triangle, weighted by its three hats.
typedef struct reference_blocks {
    double U[3][3][3], T[3][3][3];  // [hat][force][component]
} reference_blocks;

enum { GAUSS_POINTS = 12 };

// Gauss-Legendre on [0, 1]: Newton on the Legendre polynomial from Tricomi's guess.
static inline void reference_gauss(double x[GAUSS_POINTS], double w[GAUSS_POINTS])
{
    const int n = GAUSS_POINTS;
    for (int i = 0; i < n; i++) {
        double z = cos(3.14159265358979323846 * (i + 0.75) / (n + 0.5)), slope = 1;
        for (int step = 0; step < 20; step++) {
            double p = 1, previous = 0;
            for (int k = 1; k <= n; k++) {
                const double next = ((2 * k - 1) * z * p - (k - 1) * previous) / k;
                previous = p;
                p = next;
            }
            slope = n * (z * p - previous) / (z * z - 1);
            z -= p / slope;
        }
        x[i] = (1 + z) / 2;
        w[i] = 1 / ((1 - z * z) * slope * slope);
    }
}

// Add the point with barycentric coordinates `hats` (of the whole triangle).
static inline void reference_add_point(const pliant_material *material, double corners[3][3],
                                       const double normal[3], const double hats[3], double weight,
                                       reference_blocks *sum)
{
    double r[3], U[3][3], T[3][3];
    for (int i = 0; i < 3; i++)
        r[i] = hats[0] * corners[0][i] + hats[1] * corners[1][i] + hats[2] * corners[2][i];
    pliant_kelvin_displacement(material, r, U);
    pliant_kelvin_traction(material, r, normal, T);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                sum->U[k][i][j] += weight * hats[k] * U[i][j];
                sum->T[k][i][j] += weight * hats[k] * T[i][j];
            }
}

// The piece between three points, given by the whole triangle's barycentric coordinates: a square
// of 12 x 12 Gauss points folded onto it at the first one, where the fold's factor s cancels 1 / r.
static inline void reference_add_piece(const pliant_material *material, double corners[3][3],
                                       const double normal[3], double piece[3][3], double area,
                                       reference_blocks *sum)
{
    double x[GAUSS_POINTS], w[GAUSS_POINTS];
    reference_gauss(x, w);
    for (int a = 0; a < GAUSS_POINTS; a++)
        for (int b = 0; b < GAUSS_POINTS; b++) {
            const double s = x[a], t = x[b];
            double hats[3];
            for (int k = 0; k < 3; k++)
                hats[k] = (1 - s) * piece[0][k] + s * (1 - t) * piece[1][k] + s * t * piece[2][k];
            reference_add_point(material, corners, normal, hats, 2 * area * s * w[a] * w[b], sum);
        }
}

// Quarter the piece until x (the origin) is a longest edge away, or up to `levels` times.
static inline void reference_split(const pliant_material *material, double corners[3][3],
                                   const double normal[3], double piece[3][3], double area,
                                   int levels, reference_blocks *sum)
{
    double at[3][3], centre[3] = {0}, edge = 0, radius = 0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            at[k][i] = piece[k][0] * corners[0][i] + piece[k][1] * corners[1][i] +
                       piece[k][2] * corners[2][i];
            centre[i] += at[k][i] / 3;
        }
    for (int k = 0; k < 3; k++) {
        const double *a = at[k], *b = at[(k + 1) % 3];
        edge = fmax(edge, hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]));
        radius = fmax(radius, hypot(hypot(a[0] - centre[0], a[1] - centre[1]), a[2] - centre[2]));
    }
    if (levels == 0 || hypot(hypot(centre[0], centre[1]), centre[2]) - radius >= edge) {
        reference_add_piece(material, corners, normal, piece, area, sum);
        return;
    }
    double middle[3][3];
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++) middle[k][m] = (piece[k][m] + piece[(k + 1) % 3][m]) / 2;
    for (int k = 0; k < 3; k++) {
        double child[3][3];
        memcpy(child[0], piece[k], sizeof child[0]);
        memcpy(child[1], middle[k], sizeof child[1]);
        memcpy(child[2], middle[(k + 2) % 3], sizeof child[2]);
        reference_split(material, corners, normal, child, area / 4, levels - 1, sum);
    }
    reference_split(material, corners, normal, middle, area / 4, levels - 1, sum);
}

// Corners relative to x. When x is a corner, `own` is its number, and T with its hat is left zero;
// else own is -1.
static inline reference_blocks reference_integrals(const pliant_material *material,
                                                   double corners[3][3], int own)
{
    double p[3], q[3];
    for (int i = 0; i < 3; i++) {
        p[i] = corners[1][i] - corners[0][i];
        q[i] = corners[2][i] - corners[0][i];
    }
    double normal[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                        p[0] * q[1] - p[1] * q[0]};
    const double twice_area = hypot(hypot(normal[0], normal[1]), normal[2]);
    for (int i = 0; i < 3; i++) normal[i] /= twice_area;
    reference_blocks sum;
    memset(&sum, 0, sizeof sum);
    if (own < 0) {
        double whole[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        reference_split(material, corners, normal, whole, twice_area / 2, 20, &sum);
        return sum;
    }
    // A fan of 64 pieces round x, so that slivers are smooth too.
    enum { FAN = 64 };
    for (int k = 0; k < FAN; k++) {
        double piece[3][3];
        memset(piece, 0, sizeof piece);
        piece[0][own] = 1;
        for (int side = 0; side < 2; side++) {
            const double t = (double)(k + side) / FAN;
            piece[1 + side][(own + 1) % 3] = 1 - t;
            piece[1 + side][(own + 2) % 3] = t;
        }
        reference_add_piece(material, corners, normal, piece, twice_area / 2 / FAN, &sum);
    }
    memset(sum.T[own], 0, sizeof sum.T[own]);
    return sum;
}
