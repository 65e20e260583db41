// element.h: a flat triangle with linear hats, and what is integrated over it.
//
// With r = y - x, w = (1 - 2 nu) r x n and d = r . n, the fundamental solutions are
//
//     U_ij =  1 / (16 pi mu (1 - nu)) * [ (3 - 4 nu) d_ij / r + r_i r_j / r^3 ]
//     T_ij = -1 / (8 pi (1 - nu)) * { S_ij - (antisymmetric matrix of w / r^3)_ij }
//     S_ij =  d [ (1 - 2 nu) d_ij / r^3 + 3 r_i r_j / r^5 ]
//
// so an integral over an element is 15 numbers per hat: two symmetric brackets and a vector. The
// factors in front wait until a whole row has been summed. d is constant over a flat element.
#pragma once

#include "bem/bem.h"

enum {
    PLIANT_INTEGRAL_U = 0,   // 6: the bracket of U, xx yy zz xy xz yz
    PLIANT_INTEGRAL_S = 6,   // 6: S, in the same order
    PLIANT_INTEGRAL_W = 12,  // 3: w / r^3; its matrix has w_z at 01, w_x at 12, w_y at 20
    PLIANT_INTEGRAL_COUNT = 15,
};

typedef struct pliant_element_integrals {
    double of_hat[3][PLIANT_INTEGRAL_COUNT];  // of the hat functions of the element's vertices
} pliant_element_integrals;

typedef struct pliant_element {
    int32_t vertices[3];
    double centre[3];
    double spokes[3][3];  // corner k - centre
    double normal[3];     // unit, outward
    double area;
    double near_radius2;  // square of the distance from the centre from which far_field.c serves
    double loads[3][3];   // -y_c n_c at corner k: the traction of bem.c's particular solution c
} pliant_element;

// Where row r, column c of a symmetric bracket is kept.
static const int pliant_integral_place[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};

// The constants of the brackets above.
typedef struct pliant_kelvin_constants {
    double diagonal;  // 3 - 4 nu
    double shear;     // 1 - 2 nu
} pliant_kelvin_constants;

// Corners are points of shape [3].
void pliant_element_set(pliant_element *element, const int32_t vertices[3], const double *a,
                        const double *b, const double *c);
