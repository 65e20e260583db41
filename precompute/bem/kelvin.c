// kelvin.c: Kelvin's fundamental solutions of linear elastostatics, the scalar reference.
//
// This follows: C. A. Brebbia, J. C. F. Telles, L. C. Wrobel, Boundary Element Techniques, 1984, with
// r,i = r_i / |r| and mu = E / (2 (1 + nu)).
#include "bem/kelvin.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

// U_ij = 1 / (16 pi mu (1 - nu) r) * [ (3 - 4 nu) d_ij + r,i r,j ]
void pliant_kelvin_displacement(const pliant_material *material, const double r[3], double U[3][3])
{
    const double nu = material->poisson, mu = material->young / (2 * (1 + nu));
    const double length = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    const double factor = 1 / (16 * pi * mu * (1 - nu) * length);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            U[i][j] = factor * ((i == j ? 3 - 4 * nu : 0) + r[i] / length * (r[j] / length));
}

// T_ij = -1 / (8 pi (1 - nu) r^2) *
//        { dr/dn [ (1 - 2 nu) d_ij + 3 r,i r,j ] - (1 - 2 nu) (r,i n_j - r,j n_i) }
void pliant_kelvin_traction(const pliant_material *material, const double r[3],
                            const double normal[3], double T[3][3])
{
    const double nu = material->poisson;
    const double length = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    const double e[3] = {r[0] / length, r[1] / length, r[2] / length};
    const double slope = e[0] * normal[0] + e[1] * normal[1] + e[2] * normal[2];
    const double factor = -1 / (8 * pi * (1 - nu) * length * length);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            T[i][j] = factor * (slope * ((i == j ? 1 - 2 * nu : 0) + 3 * e[i] * e[j]) -
                                (1 - 2 * nu) * (e[i] * normal[j] - e[j] * normal[i]));
}
