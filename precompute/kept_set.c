// kept_set.c: a growing list of sparse columns: the coefficients that will be stored.
#include "kept_set.h"

#include "pliant/error.h"

#include <stdlib.h>

static pliant_status no_memory(const pliant_kept_set *set, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for more than %llu compressed blocks",
                            (unsigned long long)set->count);
}

pliant_status pliant_kept_set_begin(pliant_kept_set *set, int32_t column, pliant_error *err)
{
    if (set->column_count == set->column_capacity) {
        const int32_t capacity = set->column_capacity ? 2 * set->column_capacity : 256;
        uint64_t *offset = realloc(set->offset, ((size_t)capacity + 1) * sizeof *offset);
        if (!offset) return no_memory(set, err);
        set->offset = offset;
        int32_t *columns = realloc(set->columns, (size_t)capacity * sizeof *columns);
        if (!columns) return no_memory(set, err);
        set->columns = columns;
        set->column_capacity = capacity;
    }
    set->columns[set->column_count] = column;
    set->offset[set->column_count++] = set->count;
    set->offset[set->column_count] = set->count;
    return PLIANT_OK;
}

pliant_status pliant_kept_set_add(pliant_kept_set *set, int32_t row, const double *block, pliant_error *err)
{
    if (set->count == set->capacity) {
        const uint64_t capacity = set->capacity ? set->capacity + set->capacity / 2 : 1 << 14;
        int32_t *rows = realloc(set->rows, capacity * sizeof *rows);
        if (!rows) return no_memory(set, err);
        set->rows = rows;
        float *blocks = realloc(set->blocks, capacity * 9 * sizeof *blocks);
        if (!blocks) return no_memory(set, err);
        set->blocks = blocks;
        set->capacity = capacity;
    }
    set->rows[set->count] = row;
    for (int e = 0; e < 9; e++) set->blocks[set->count * 9 + e] = (float)block[e];
    set->offset[set->column_count] = ++set->count;
    return PLIANT_OK;
}

void pliant_kept_set_clear(pliant_kept_set *set)
{
    set->column_count = 0;
    set->count = 0;
}

void pliant_kept_set_destroy(pliant_kept_set *set)
{
    free(set->blocks);
    free(set->rows);
    free(set->offset);
    free(set->columns);
    *set = (pliant_kept_set){0};
}
