// weld.h: which points stand on the same place, to the last bit.
#pragma once

#include "pliant/base.h"

// first[i] = the smallest number of a point that equals point i; `points` has shape [count][3],
// `first` has shape [count]. -0 equals 0. Finite coordinates only.
PLIANT_UNUSED_RESULT pliant_status pliant_weld_points(const double *points, int32_t count,
                                                      int32_t *first, int32_t *distinct_count,
                                                      pliant_error *err);
