// nearest.h: the nearest of a set of points, by a k-d tree.
//
// This follows: J. Bentley, Multidimensional binary search trees used for associative searching,
// Communications of the ACM 18(9), 1975. The tree is an order of the points: the middle one of a
// range splits it along the axis on which the range is longest.
#pragma once

#include "pliant/base.h"

typedef struct pliant_nearest pliant_nearest;

// `points` (shape [count][3], count >= 1) is borrowed until destroy.
PLIANT_UNUSED_RESULT pliant_status pliant_nearest_create(const double *points, int32_t count,
                                                         pliant_nearest **nearest,
                                                         pliant_error *err);
void pliant_nearest_destroy(pliant_nearest *nearest);  // NULL is fine

// The point nearest to `position`; of several the one with the least number.
int32_t pliant_nearest_find(const pliant_nearest *nearest, const double position[3]);
