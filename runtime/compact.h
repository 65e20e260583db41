// compact.h: a solver's own copy of sparse block columns in half precision, and its kernel.
//
// Blocks go in fours, for registers of sixteen numbers: a column of S is some 5 of these groups
// long, and its kernel has one loop without a remainder (a branch that goes wrong costs as much as
// two groups). A block takes 24 bytes, so that the columns of several contacts fit a core's cache.
// Numbers are halves scaled by a power of two a column, whose largest lies in [2^14, 2^15): they
// are rounded by 2^-11 of themselves, down to 2^-29 of the largest.
#pragma once

#include "columns.h"
#include "pliant/arena.h"

// Rows that 16 bits number.
#define PLIANT_COMPACT_ROW_LIMIT 65536

// Four blocks: column[c][b] holds half of component 0, 1, 2 per unit component c of block b, and
// behind them, for c = 0, the block's row. Groups at a column's end are filled up with zero blocks
// on its last row.
typedef struct pliant_compact_group {
    _Alignas(32) uint16_t column[3][4][4];
} pliant_compact_group;

typedef struct pliant_compact_columns {
    uint64_t *offset;  // shape [columns + 1], of groups; NULL: there is no copy
    float *scale;      // shape [columns]
    pliant_compact_group *group;
} pliant_compact_columns;

uint16_t pliant_half_from_float(float value);  // to nearest, ties to even
float pliant_half_to_float(uint16_t half);
int32_t pliant_half_in_hardware(void);  // 1: this machine converts them

// Copy `columns`, which are stored and whose rows are under the limit.
void pliant_compact_lay_out(pliant_arena *arena, const pliant_columns *columns,
                            pliant_compact_columns *compact);
void pliant_compact_fill(const pliant_columns *columns, pliant_compact_columns *compact);

// g[row] += block * value for the blocks of `count` groups; `value` has shape [3] and includes the
// column's scale, `g` is as in columns.h.
typedef void pliant_compact_kernel(const pliant_compact_group *group, size_t count,
                                   const float *value, float *g);

// The reference, in plain C.
pliant_compact_kernel pliant_compact_add_plain;
// A kernel by name: "avx512", "f16c", "plain"; NULL when this machine has not got it.
pliant_compact_kernel *pliant_compact_kernel_named(const char *name);
// The fastest that this machine has; NULL when that is the reference, which floats outrun.
pliant_compact_kernel *pliant_compact_kernel_best(void);
