// cell_set.c: a set of cells of a box grid, one bit a cell, and their numbers in (z, y, x) order.
#include "lattice/cell_set.h"

#include "pliant/error.h"

#include <stdlib.h>

static int32_t words_of(int32_t length)
{
    return (length + 63) / 64;
}

double pliant_cell_set_bytes(const int32_t dims[3])
{
    const double rows = (double)dims[1] * dims[2];
    return rows * words_of(dims[0]) * sizeof(uint64_t) + (rows + 1) * sizeof(int32_t);
}

pliant_status pliant_cell_set_create(const int32_t dims[3], pliant_cell_set **set,
                                     pliant_error *err)
{
    pliant_cell_set *s = calloc(1, sizeof *s);
    const size_t rows = (size_t)dims[1] * (size_t)dims[2];
    if (s) {
        for (int k = 0; k < 3; k++) s->dims[k] = dims[k];
        s->word_count = words_of(dims[0]);
        s->bits = calloc(rows * (size_t)s->word_count, sizeof *s->bits);
        s->row_first = calloc(rows + 1, sizeof *s->row_first);
    }
    if (!s || !s->bits || !s->row_first) {
        pliant_cell_set_destroy(s);
        return pliant_error_set(err, PLIANT_ERR_MEMORY,
                                "no memory for a grid of %d x %d x %d cells", dims[0], dims[1],
                                dims[2]);
    }
    *set = s;
    return PLIANT_OK;
}

void pliant_cell_set_destroy(pliant_cell_set *set)
{
    if (!set) return;
    free(set->row_first);
    free(set->bits);
    free(set);
}

int32_t pliant_cell_set_number(pliant_cell_set *set)
{
    const size_t rows = (size_t)set->dims[1] * (size_t)set->dims[2];
    const uint64_t *bits = set->bits;
    int32_t count = 0;
    for (size_t r = 0; r < rows; r++) {
        set->row_first[r] = count;
        for (int32_t w = 0; w < set->word_count; w++) count += __builtin_popcountll(*bits++);
    }
    set->row_first[rows] = count;
    return count;
}

void pliant_cell_set_list(const pliant_cell_set *set, int32_t *cells)
{
    for (int32_t z = 0; z < set->dims[2]; z++)
        for (int32_t y = 0; y < set->dims[1]; y++) {
            const uint64_t *row = pliant_cell_set_row(set, y, z);
            for (int32_t w = 0; w < set->word_count; w++)
                for (uint64_t bits = row[w]; bits; bits &= bits - 1) {
                    *cells++ = 64 * w + __builtin_ctzll(bits);
                    *cells++ = y;
                    *cells++ = z;
                }
        }
}

int32_t pliant_cell_set_find(const pliant_cell_set *set, int32_t x, int32_t y, int32_t z)
{
    if (x < 0 || y < 0 || z < 0 || x >= set->dims[0] || y >= set->dims[1] || z >= set->dims[2])
        return -1;
    const uint64_t *row = pliant_cell_set_row(set, y, z);
    const uint64_t bit = (uint64_t)1 << (x & 63);
    if (!(row[x >> 6] & bit)) return -1;
    int32_t number = set->row_first[(size_t)z * (size_t)set->dims[1] + (size_t)y];
    for (int32_t w = 0; w < x >> 6; w++) number += __builtin_popcountll(row[w]);
    return number + __builtin_popcountll(row[x >> 6] & (bit - 1));
}
