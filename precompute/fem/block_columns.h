// block_columns.h: a sparse matrix of 3x3 blocks, column by column.
#pragma once

#include "pliant/base.h"

typedef struct pliant_block_columns {
    int32_t column_count;
    int64_t *offset;  // shape [column_count + 1]
    int32_t *row;     // ascending in a column
    double *block;    // shape [offset[column_count]][3][3]
    // While it is built: blocks in the order in which they came.
    int64_t count, capacity;
    int32_t *column;
    pliant_status status;  // the first failure of add
} pliant_block_columns;

PLIANT_UNUSED_RESULT pliant_status pliant_block_columns_create(int32_t column_count,
                                                               pliant_block_columns **columns,
                                                               pliant_error *err);
// scale times the block is added at (row, column).
void pliant_block_columns_add(pliant_block_columns *columns, int32_t row, int32_t column,
                              double scale, const double block[3][3]);
// No more blocks: sort, and sum those at one place in the order in which they came. Tells of
// failures of add.
PLIANT_UNUSED_RESULT pliant_status pliant_block_columns_finish(pliant_block_columns *columns,
                                                               pliant_error *err);
void pliant_block_columns_destroy(pliant_block_columns *columns);  // NULL is fine
