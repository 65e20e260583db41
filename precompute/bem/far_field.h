// far_field.h: the integrals over all elements that are far from a collocation vertex, for eight
// collocation vertices at once.
#pragma once

#include "bem/kelvin_lanes.h"

// An element is far from x when the distance is at least this many of its longest edges; see the
// experiment in far_field.c.
#define PLIANT_FAR_FIELD_RATIO 4.0

typedef pliant_lanes pliant_row_sum[PLIANT_INTEGRAL_COUNT];

// Add the integrals over the elements to sums[vertex] of each element's three vertices, in the
// lanes of x (shape [3]) that are far from the element. Bit l of near[element] is set where lane l
// is not: that integral is left to the caller. `body` is nullable: added to body[r][c] is the
// integral of row r, column c of U's bracket times the load -y_c n_c (element.h).
void pliant_far_field_add(const pliant_kelvin_constants *constants, const pliant_element *elements,
                          int32_t element_count, const pliant_lanes x[3], pliant_row_sum *sums,
                          pliant_lanes body[3][3], uint8_t *near);
