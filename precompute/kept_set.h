// kept_set.h: a growing list of sparse columns: the coefficients that will be stored.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

typedef struct pliant_kept_set {
    int32_t column_count, column_capacity;
    int32_t *columns;   // [column_count] position of each column
    uint64_t *offset;   // [column_count + 1] of its blocks
    uint64_t count, capacity;
    int32_t *rows;      // [count]
    float *blocks;      // [count][3][3]
} pliant_kept_set;      // zeroed: empty

// Begin the next column, then add its blocks (shape [3][3], rounded to float) by ascending row.
PLIANT_UNUSED_RESULT pliant_status pliant_kept_set_begin(pliant_kept_set *set, int32_t column,
                                                         pliant_error *err);
PLIANT_UNUSED_RESULT pliant_status pliant_kept_set_add(pliant_kept_set *set, int32_t row,
                                                       const double *block, pliant_error *err);
void pliant_kept_set_clear(pliant_kept_set *set);    // keeps its memory
void pliant_kept_set_destroy(pliant_kept_set *set);  // back to zero
