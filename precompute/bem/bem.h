// bem.h: collocation boundary elements for linear elastostatics, continuous linear triangles.
//
// c(x) u(x) + PV int T(x,y) u(y) dS = int U(x,y) p(y) dS becomes H u = G p at the vertices. With
// the reference problem's unknowns moved left it reads A v = B vbar:
//
//     A = [ H at free columns | -G at fixed columns ]     v    = u at free nodes, p at fixed ones
//     B = [ G at free columns | -H at fixed columns ]     vbar = p at free nodes, u at fixed ones
//
// Unknown 3j + c belongs to vertex j, component c, in mesh vertex order.
#pragma once

#include "material.h"

#include "pliant/mesh.h"

#include <stddef.h>

typedef struct pliant_bem pliant_bem;  // geometry, material and quadrature tables; const after create

// `mesh` is borrowed until destroy and must have passed pliant_mesh_check.
PLIANT_UNUSED_RESULT pliant_status pliant_bem_create(const pliant_mesh *mesh,
                                                     const pliant_material *material,
                                                     pliant_bem **bem, pliant_error *err);
void pliant_bem_destroy(pliant_bem *bem);  // NULL is fine

// Assemble the rows of collocation vertices row_begin .. row_end - 1. A, B are column-major with
// leading dimension ld_a, ld_b and 3n columns; A and B point at row 3 row_begin of column 0. `fixed`
// has shape [n], 1 at fixed nodes. `gravity` (NULL: none), leading dimension ld_g, 3 columns, points
// at row 3 row_begin too: the right-hand sides of A v = b for the body force density * e_c, c = x, y,
// z, that is for a unit acceleration. Rows depend on nothing but their own vertex: any split of the
// rows over callers gives the same bits. Threads may assemble different rows at once.
PLIANT_UNUSED_RESULT pliant_status pliant_bem_assemble(const pliant_bem *bem, int32_t row_begin,
                                                       int32_t row_end, const uint8_t *fixed,
                                                       double *A, size_t ld_a, double *B,
                                                       size_t ld_b, double *gravity, size_t ld_g,
                                                       pliant_error *err);
