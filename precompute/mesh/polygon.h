// polygon.h: split a polygon of mesh vertices into triangles.
#pragma once

#include "pliant/base.h"

// Ear clipping takes quadratic time: a corner count from a hostile file must not stop the program.
enum { PLIANT_POLYGON_CORNER_LIMIT = 8192 };

// Write count - 2 triangles with the polygon's orientation; `vertices` has shape [.][3], `corners`
// [count] with 3 <= count <= PLIANT_POLYGON_CORNER_LIMIT, `triangles` [count - 2][3]. A
// quadrilateral is split along the diagonal that gives the better triangles; a larger simple
// polygon, convex or not, is covered exactly once. What crosses itself is split somehow. Fails for
// memory only.
PLIANT_UNUSED_RESULT pliant_status pliant_polygon_split(const double *vertices,
                                                        const int32_t *corners, int32_t count,
                                                        int32_t *triangles, pliant_error *err);
