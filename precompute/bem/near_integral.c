// near_integral.c: integrals over one element that is near, but does not hold, the vertex x.
#include "bem/near_integral.h"

#include "bem/kelvin_lanes.h"
#include "bem/triangle_rule.h"

#include <math.h>
#include <string.h>

// The element is halved at its longest edge until every piece is this many of its own longest edges
// away from x, measured to a ball round the piece; then 16 points of degree 8. Relative error of
// rows of H with the far field from 6 edges on, on a sphere of 642 vertices and a crumpled one:
//
//     0.75 edges   4e-7    2e-7         1.5 edges   1.3e-8   9e-9
//     1.0          3e-8    4e-8         2.0         6e-9     5e-9
//
// At 1.5 it is a fraction of the far field's 8e-8. Seven points would need 4 edges to be as good.
static const double leaf_ratio = 1.5;

enum {
    LEVELS = 48,  // halvings at most: pieces 1 / 2^24 as long, where the mesh touches itself
    POINTS = 16,
    CHUNKS = POINTS / PLIANT_LANES,
};

// A piece of the element: its corners relative to x, and the element's hats there.
typedef struct piece {
    double corners[3][3], hats[3][3];
    double area;
    int level;
} piece;

// True when the piece need not be halved; else *from is where its longest edge begins.
static int settled(const piece *p, int *from)
{
    double edge2 = 0, centre[3], radius2 = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = p->corners[k], *b = p->corners[(k + 1) % 3];
        const double x = b[0] - a[0], y = b[1] - a[1], z = b[2] - a[2];
        const double length2 = x * x + y * y + z * z;
        if (length2 > edge2) {
            edge2 = length2;
            *from = k;
        }
        centre[k] = (p->corners[0][k] + p->corners[1][k] + p->corners[2][k]) / 3;
    }
    for (int k = 0; k < 3; k++) {
        const double *a = p->corners[k];
        const double x = a[0] - centre[0], y = a[1] - centre[1], z = a[2] - centre[2];
        radius2 = fmax(radius2, x * x + y * y + z * z);
    }
    const double distance =
        sqrt(centre[0] * centre[0] + centre[1] * centre[1] + centre[2] * centre[2]);
    return p->level == LEVELS || distance >= sqrt(radius2) + leaf_ratio * sqrt(edge2);
}

// The rule, eight points to a vector.
typedef struct table {
    pliant_lanes points[CHUNKS][3], weights[CHUNKS];
} table;

PLIANT_LANES_INLINE void add_leaf(const pliant_kelvin_constants *constants,
                                  const double shear_normal[3], double d, const table *quadrature,
                                  const piece *leaf, pliant_lanes sums[3][PLIANT_INTEGRAL_COUNT])
{
    const pliant_lanes distance = d - (pliant_lanes){0};
    for (int chunk = 0; chunk < CHUNKS; chunk++) {
        const pliant_lanes *point = quadrature->points[chunk];
        pliant_lanes r[3], hats[3], f[PLIANT_INTEGRAL_COUNT];
        for (int i = 0; i < 3; i++) {
            r[i] = point[0] * leaf->corners[0][i] + point[1] * leaf->corners[1][i] +
                   point[2] * leaf->corners[2][i];
            hats[i] = point[0] * leaf->hats[0][i] + point[1] * leaf->hats[1][i] +
                      point[2] * leaf->hats[2][i];
        }
        const pliant_lanes scale = leaf->area * quadrature->weights[chunk];
        evaluate_kernels(constants, shear_normal, r, &distance, &scale, f);
        for (int k = 0; k < 3; k++)
            for (int m = 0; m < PLIANT_INTEGRAL_COUNT; m++) sums[k][m] += hats[k] * f[m];
    }
}

PLIANT_VECTOR_CLONES
static void integrate(const pliant_kelvin_constants *constants, const pliant_element *element,
                      const double x[3], pliant_element_integrals *integrals)
{
    table quadrature;
    const pliant_triangle_rule *rule = pliant_triangle_rule_of_degree(8);
    for (int q = 0; q < POINTS; q++) {
        for (int k = 0; k < 3; k++)
            quadrature.points[q / PLIANT_LANES][k][q % PLIANT_LANES] = rule->points[q][k];
        quadrature.weights[q / PLIANT_LANES][q % PLIANT_LANES] = rule->weights[q];
    }
    const double *n = element->normal;
    const double shear_normal[3] = {constants->shear * n[0], constants->shear * n[1],
                                    constants->shear * n[2]};
    const double d = (element->centre[0] - x[0]) * n[0] + (element->centre[1] - x[1]) * n[1] +
                     (element->centre[2] - x[2]) * n[2];
    pliant_lanes sums[3][PLIANT_INTEGRAL_COUNT];
    memset(sums, 0, sizeof sums);

    // Depth first: one waiting half per level.
    piece stack[LEVELS + 1];
    int waiting = 1;
    stack[0] = (piece){.hats = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .area = element->area};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            stack[0].corners[k][i] = element->centre[i] - x[i] + element->spokes[k][i];
    while (waiting) {
        piece *top = &stack[waiting - 1];
        int a = 0;
        if (settled(top, &a)) {
            add_leaf(constants, shear_normal, d, &quadrature, top, sums);
            waiting--;
            continue;
        }
        // Halve the longest edge a-b.
        const int b = (a + 1) % 3;
        top->area /= 2;
        top->level++;
        piece *other = top + 1;
        *other = *top;
        for (int i = 0; i < 3; i++) {
            top->corners[b][i] = other->corners[a][i] =
                (top->corners[a][i] + top->corners[b][i]) / 2;
            top->hats[b][i] = other->hats[a][i] = (top->hats[a][i] + top->hats[b][i]) / 2;
        }
        waiting++;
    }
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < PLIANT_INTEGRAL_COUNT; m++) {
            double sum = 0;
            for (int lane = 0; lane < PLIANT_LANES; lane++) sum += sums[k][m][lane];
            integrals->of_hat[k][m] = sum;
        }
}

void pliant_near_integral_set(const pliant_kelvin_constants *constants,
                              const pliant_element *element, const double x[3],
                              pliant_element_integrals *integrals)
{
    integrate(constants, element, x, integrals);
}
