// far_field.c: the integrals over all far elements, for eight collocation vertices at once.
//
// One rule, 7 points of degree 5, serves all far elements. The experiment (bench_bem, sphere of
// 2562 vertices): the sum over elements of |error of T|, relative to the row of H, when a rule
// serves from so many longest edges on, and how many of the pairs are that far.
//
//     edges away      2       3       4       6       8      12      16      20
//     pairs          99 %    98 %    97 %    93 %    89 %    77 %    59 %    37 %
//     7 points     8e-7    2e-7    8e-8    2e-8    5e-9    7e-10   2e-10   5e-11
//     4 points     8e-5    4e-5    2e-5    1e-5    5e-6    2e-6    1e-6    5e-7
//
// Seven points from 4 edges on cost 8e-8, and leave a rotation residual of 1e-11 to 2e-10. Four
// points (degree 3) would have to wait for 16 edges to stay at 1e-6; tried from 12 edges on, they
// took the far field from 0.23 s to 0.21 s of the assembly's 0.6 s and the residual to 8e-10. Not
// worth a second rule.
#include "bem/far_field.h"

#include "bem/triangle_rule.h"

enum { ORBITS = 2, POINTS = 1 + 3 * ORBITS };

// The hat-weighted sum over an orbit (triangle_rule.h) of weight w, with f_k at its point k, is
//     sum_q w phi_k(q) f_q = w [ other (f_0 + f_1 + f_2) + (share - other) f_k ]
// so the three hats share the bracket's first term.
typedef struct orbit {
    double reach;        // share - other: the points lie at centre + reach * spoke
    double common, own;  // w other, w (share - other)
} orbit;

typedef struct rule {
    double centre_weight;  // times the hat's third
    orbit orbits[ORBITS];
} rule;

static rule rule_from(const pliant_triangle_rule *source)
{
    rule result = {.centre_weight = source->weights[0] / 3};
    for (int o = 0; o < ORBITS; o++) {
        const double share = source->points[1 + 3 * o][0], other = source->points[1 + 3 * o][1];
        const double weight = source->weights[1 + 3 * o];
        result.orbits[o] = (orbit){share - other, weight * other, weight * (share - other)};
    }
    return result;
}

// Integrals of one element, times the lanes of `scale`; from = centre - x.
PLIANT_LANES_INLINE void add_element(const pliant_kelvin_constants *constants,
                                     const rule *quadrature, const pliant_element *element,
                                     const pliant_lanes from[3], const pliant_lanes *scale,
                                     pliant_row_sum *sums, pliant_lanes U[3][6])
{
    const double *n = element->normal;
    const double shear_normal[3] = {constants->shear * n[0], constants->shear * n[1],
                                    constants->shear * n[2]};
    const pliant_lanes d = from[0] * n[0] + from[1] * n[1] + from[2] * n[2];
    pliant_lanes f[POINTS][PLIANT_INTEGRAL_COUNT];
    evaluate_kernels(constants, shear_normal, from, &d, scale, f[0]);
    for (int o = 0; o < ORBITS; o++)
        for (int k = 0; k < 3; k++) {
            pliant_lanes r[3];
            for (int i = 0; i < 3; i++)
                r[i] = from[i] + quadrature->orbits[o].reach * element->spokes[k][i];
            evaluate_kernels(constants, shear_normal, r, &d, scale, f[1 + 3 * o + k]);
        }

    pliant_lanes *const a = sums[element->vertices[0]], *const b = sums[element->vertices[1]],
                        *const c = sums[element->vertices[2]];
    for (int m = 0; m < PLIANT_INTEGRAL_COUNT; m++) {
        pliant_lanes common = quadrature->centre_weight * f[0][m];
        for (int o = 0; o < ORBITS; o++)
            common += quadrature->orbits[o].common *
                      (f[1 + 3 * o][m] + f[2 + 3 * o][m] + f[3 + 3 * o][m]);
        pliant_lanes own[3] = {common, common, common};
        for (int k = 0; k < 3; k++)
            for (int o = 0; o < ORBITS; o++)
                own[k] += quadrature->orbits[o].own * f[1 + 3 * o + k][m];
        a[m] += own[0];
        b[m] += own[1];
        c[m] += own[2];
        if (U && m < 6)
            for (int k = 0; k < 3; k++) U[k][m] = own[k];
    }
}

PLIANT_VECTOR_CLONES
static void add_elements(const pliant_kelvin_constants *constants, const pliant_element *elements,
                         int32_t element_count, const pliant_lanes x[3], pliant_row_sum *sums,
                         pliant_lanes body[3][3], uint8_t *near)
{
    const rule quadrature = rule_from(pliant_triangle_rule_of_degree(5));
    for (int32_t e = 0; e < element_count; e++) {
        const pliant_element *element = elements + e;
        pliant_lanes from[3];
        for (int i = 0; i < 3; i++) from[i] = element->centre[i] - x[i];
        const pliant_lanes distance2 = from[0] * from[0] + from[1] * from[1] + from[2] * from[2];
        const pliant_lane_bits far = (pliant_lane_bits)(distance2 >= element->near_radius2);
        unsigned near_bits = 0;
        for (int lane = 0; lane < PLIANT_LANES; lane++)
            near_bits |= (unsigned)(~far[lane] & 1) << lane;
        near[e] = (uint8_t)near_bits;
        if (near_bits == 0xFF) continue;

        // Near lanes are integrated with scale 0: they add exactly nothing.
        const pliant_lanes area = element->area - (pliant_lanes){0};
        const pliant_lanes scale = (pliant_lanes)((pliant_lane_bits)area & far);
        if (!body) {
            add_element(constants, &quadrature, element, from, &scale, sums, NULL);
            continue;
        }
        pliant_lanes U[3][6];
        add_element(constants, &quadrature, element, from, &scale, sums, U);
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                for (int r = 0; r < 3; r++)
                    body[r][c] += element->loads[k][c] * U[k][pliant_integral_place[r][c]];
    }
}

void pliant_far_field_add(const pliant_kelvin_constants *constants, const pliant_element *elements,
                          int32_t element_count, const pliant_lanes x[3], pliant_row_sum *sums,
                          pliant_lanes body[3][3], uint8_t *near)
{
    add_elements(constants, elements, element_count, x, sums, body, near);
}
