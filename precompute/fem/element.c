// element.c: integrals over straight tetrahedra and triangles, linear and quadratic, in closed
// form.
//
// With barycentric coordinates L_i, whose gradients g_i are constant, quadratic shape functions are
// L_i (2 L_i - 1) at corners and 4 L_i L_j at midpoints; products of their gradients are quadratic
// in L, which the four-point rule integrates exactly.
#include "fem/element.h"

#include <string.h>

static const int edges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

// Gradients of barycentric coordinates; returns the volume.
static double gradients(double x[4][3], double g[4][3])
{
    double e[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) e[k][i] = x[k + 1][i] - x[0][i];
    double six = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = e[(k + 1) % 3], *b = e[(k + 2) % 3];
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, l = (i + 2) % 3;
            g[k + 1][i] = a[j] * b[l] - a[l] * b[j];
        }
    }
    for (int i = 0; i < 3; i++) six += e[0][i] * g[1][i];
    for (int i = 0; i < 3; i++) {
        g[0][i] = 0;
        for (int k = 1; k < 4; k++) {
            g[k][i] /= six;
            g[0][i] -= g[k][i];
        }
    }
    return six / 6;
}

static void add_products(const pliant_material *material, double weight, int node_count,
                         double (*d)[3], double K[PLIANT_TET_NODES][PLIANT_TET_NODES][3][3])
{
    const double mu = weight * material->young / (2 * (1 + material->poisson));
    const double lambda = 2 * mu * material->poisson / (1 - 2 * material->poisson);
    for (int a = 0; a < node_count; a++)
        for (int b = 0; b < node_count; b++) {
            const double dot = mu * (d[a][0] * d[b][0] + d[a][1] * d[b][1] + d[a][2] * d[b][2]);
            for (int r = 0; r < 3; r++) {
                for (int c = 0; c < 3; c++)
                    K[a][b][r][c] += lambda * d[a][r] * d[b][c] + mu * d[a][c] * d[b][r];
                K[a][b][r][r] += dot;
            }
        }
}

double pliant_element_stiffness(const pliant_material *material, double x[4][3], int node_count,
                                double K[PLIANT_TET_NODES][PLIANT_TET_NODES][3][3])
{
    double g[4][3], d[PLIANT_TET_NODES][3];
    const double volume = gradients(x, g);
    memset(K, 0, sizeof(double[PLIANT_TET_NODES][PLIANT_TET_NODES][3][3]));
    if (node_count == 4) {
        add_products(material, volume, 4, g, K);
        return volume;
    }
    // The four points of degree 2: (near, far, far, far), near = (5 + 3 sqrt 5) / 20.
    const double near = 0.58541019662496845446, far = 0.13819660112501051518;
    for (int q = 0; q < 4; q++) {
        double L[4] = {far, far, far, far};
        L[q] = near;
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k < 4; k++) d[k][i] = (4 * L[k] - 1) * g[k][i];
            for (int k = 0; k < 6; k++) {
                const int a = edges[k][0], b = edges[k][1];
                d[4 + k][i] = 4 * (L[a] * g[b][i] + L[b] * g[a][i]);
            }
        }
        add_products(material, volume / 4, 10, d, K);
    }
    return volume;
}

double pliant_element_share(int node_count, int a)
{
    if (node_count == 4) return 1.0 / 4;
    return a < 4 ? -1.0 / 20 : 1.0 / 5;
}

// integral of L_1^a L_2^b L_3^c over a triangle of area 1 = 2 a! b! c! / (a + b + c + 2)!
double pliant_element_face_share(int node_count, int a, int k)
{
    if (node_count == 3) return a == k ? 1.0 / 6 : 1.0 / 12;
    if (a < 3) return a == k ? 1.0 / 30 : -1.0 / 60;
    const int first = a - 3, second = (a - 2) % 3;
    return k == first || k == second ? 2.0 / 15 : 1.0 / 15;
}
