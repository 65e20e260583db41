// cell_set.h: a set of cells of a box grid, one bit a cell, and their numbers in (z, y, x) order.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

typedef struct pliant_cell_set {
    int32_t dims[3];     // cells along x, y, z, each 1 .. 1024
    int32_t word_count;  // words to a row along x
    uint64_t *bits;      // shape [dims[2]][dims[1]][word_count]; none set beyond dims[0]
    int32_t *row_first;  // shape [dims[2] * dims[1] + 1]: members before a row; see number
} pliant_cell_set;

// Bytes that a set takes, for deciding before there is one.
double pliant_cell_set_bytes(const int32_t dims[3]);

// An empty set.
PLIANT_UNUSED_RESULT pliant_status pliant_cell_set_create(const int32_t dims[3],
                                                          pliant_cell_set **set, pliant_error *err);
void pliant_cell_set_destroy(pliant_cell_set *set);  // NULL is fine

// Number the members in order; good until the next insertion. Returns how many there are.
int32_t pliant_cell_set_number(pliant_cell_set *set);
// The members in order; `cells` has shape [number's result][3].
void pliant_cell_set_list(const pliant_cell_set *set, int32_t *cells);
// A member's number, or -1 for what is no member or beyond the grid. After number.
int32_t pliant_cell_set_find(const pliant_cell_set *set, int32_t x, int32_t y, int32_t z);

// The words of row (y, z).
static inline uint64_t *pliant_cell_set_row(const pliant_cell_set *set, int32_t y, int32_t z)
{
    return set->bits + ((size_t)z * (size_t)set->dims[1] + (size_t)y) * (size_t)set->word_count;
}

static inline void pliant_cell_set_insert(pliant_cell_set *set, int32_t x, int32_t y, int32_t z)
{
    pliant_cell_set_row(set, y, z)[x >> 6] |= (uint64_t)1 << (x & 63);
}

// Those bits of a row's word that are cells of the grid.
static inline uint64_t pliant_cell_set_mask(const pliant_cell_set *set, int32_t word)
{
    const int32_t left = set->dims[0] - 64 * word;
    return left >= 64 ? ~(uint64_t)0 : ((uint64_t)1 << left) - 1;
}
