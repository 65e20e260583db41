// compact.h: a solver's own copy of sparse block columns in half precision, and its kernel.
//
// A block with its row takes 20 bytes instead of 40, so that the columns of several contacts fit a
// core's cache. Numbers are halves scaled by a power of two a column, whose largest lies in
// [2^14, 2^15): relative rounding 2^-11 down to 2^-28 of the largest.
#pragma once

#include "columns.h"
#include "pliant/arena.h"

// Rows that 16 bits number.
#define PLIANT_COMPACT_ROW_LIMIT 65536

typedef struct pliant_compact_block {
    uint16_t column[3][3];  // [c][r]: half of component r per unit component c
    uint16_t row;
} pliant_compact_block;

typedef struct pliant_compact_columns {
    const uint64_t *offset;       // of the columns it was made from, borrowed
    float *scale;                 // shape [columns]
    pliant_compact_block *block;  // shape [nnz + 1]: kernels read up to one block past a column
} pliant_compact_columns;

uint16_t pliant_half_from_float(float value);  // to nearest, ties to even
float pliant_half_to_float(uint16_t half);

// Copy `columns`, which are stored; their rows are under the limit.
void pliant_compact_lay_out(pliant_arena *arena, const pliant_columns *columns,
                            pliant_compact_columns *compact);
void pliant_compact_fill(const pliant_columns *columns, pliant_compact_columns *compact);

// g[row] += block * value for `count` blocks; `value` has shape [3] and includes the column's scale,
// `g` is as in columns.h.
typedef void pliant_compact_kernel(const pliant_compact_block *block, size_t count,
                                   const float *value, float *g);

// The reference, in plain C.
pliant_compact_kernel pliant_compact_add_plain;
// A kernel by name: "avx512", "f16c", "plain"; NULL when this machine has not got it.
pliant_compact_kernel *pliant_compact_kernel_named(const char *name);
// The fastest that this machine has; NULL when that is the reference, which floats outrun.
pliant_compact_kernel *pliant_compact_kernel_best(void);
