// size_field.h: how long edges inside a solid should be: as those of the surface nearby, growing
// with the distance from it.
//
// The response to a hat of width h is the smoother the deeper one looks: d under the surface it
// varies over lengths of h + d. Quadratic elements of size s err there by (s / d)^3, the surface's
// flat faces by (h / d)^2 everywhere; both are equal for s = h^(2/3) d^(1/3). So sizes grow with
// the cube root of the distance: meshes converge as uniform ones do, to second order, while the
// number of elements goes with that of the surface's vertices times a logarithm, instead of its
// 3/2th power. Linear elements err by (s / d)^2, which leaves nothing to gain.
#pragma once

#include "pliant/mesh.h"

typedef struct pliant_size_field pliant_size_field;

// What is good for elements of an order; README.md has what other growths cost and err.
double pliant_size_field_growth(int order);

// `growth` - 1 is added to the length for every unit of distance at the surface; 1 or less: the
// surface's own length everywhere.
// `surface` is borrowed until destroy.
PLIANT_UNUSED_RESULT pliant_status pliant_size_field_create(const pliant_mesh *surface,
                                                            double growth,
                                                            pliant_size_field **field,
                                                            pliant_error *err);
void pliant_size_field_destroy(pliant_size_field *field);  // NULL is fine

// The length wished for at x; m.
double pliant_size_field_at(const pliant_size_field *field, const double x[3]);
