// element.h: integrals over straight tetrahedra and triangles, linear and quadratic, in closed
// form.
#pragma once

#include "material.h"

enum { PLIANT_TET_NODES = 10, PLIANT_FACE_NODES = 6 };  // at most

// Blocks of the stiffness matrix, K[a][b][r][c] = component r of the force at node a per
// displacement c of node b, N/m:
//
//     K_ab,rc = integral of lambda N_a,r N_b,c + mu N_a,c N_b,r + mu d_rc grad N_a . grad N_b
//
// `x` has the corners; node_count is 4 or 10, numbered as in tetrahedra.h. Returns the volume.
double pliant_element_stiffness(const pliant_material *material, double x[4][3], int node_count,
                                double K[PLIANT_TET_NODES][PLIANT_TET_NODES][3][3]);

// integral of N_a over a tetrahedron of volume 1.
double pliant_element_share(int node_count, int a);

// integral of N_a phi_k over a triangle of area 1: N_a of node_count 3 or 6, phi_k the linear hat
// of corner k.
double pliant_element_face_share(int node_count, int a, int k);
