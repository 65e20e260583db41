// columns.h: sparse block columns of one Green's function block, and the kernel that sums them.
//
// The kernel is the inner loop of GF-42 and GF-45:
//
//     g[row[e]] += block[e] * value        for the stored blocks e of one column
//
// on rows of four floats (xyz0). It reads exactly the column's rows and blocks, never past them.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

typedef struct pliant_columns {
    int32_t count;           // columns
    const uint64_t *offset;  // shape [count + 1]; NULL: this block is not stored
    const int32_t *row;      // shape [nnz], ascending and distinct within a column
    const float *block;      // shape [nnz][3][3]: component r per unit component c
} pliant_columns;

// `row` has shape [count], `block` [count][3][3], `value` [3], `g` [rows][4], 16-byte aligned.
typedef void pliant_columns_kernel(const int32_t *row, const float *block, size_t count,
                                   const float *value, float *g);

// The reference, in plain C.
pliant_columns_kernel pliant_columns_add_plain;
// A kernel by name: "avx512", "avx2", "plain"; NULL when this machine has not got it.
pliant_columns_kernel *pliant_columns_kernel_named(const char *name);
// The fastest this machine has.
pliant_columns_kernel *pliant_columns_kernel_best(void);

// The largest magnitude among the numbers of one column; 0 for an empty one.
float pliant_columns_weight(const pliant_columns *columns, int32_t column);
