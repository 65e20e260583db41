// block_columns.c: a sparse matrix of 3x3 blocks, column by column.
#include "fem/block_columns.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

static pliant_status no_memory(pliant_error *err, int64_t count)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY,
                            "no memory for %lld blocks of the stiffness matrix", (long long)count);
}

pliant_status pliant_block_columns_create(int32_t column_count, pliant_block_columns **columns,
                                          pliant_error *err)
{
    pliant_block_columns *c = calloc(1, sizeof *c);
    if (c) c->offset = calloc((size_t)column_count + 1, sizeof *c->offset);
    if (!c || !c->offset) {
        free(c);
        return no_memory(err, column_count);
    }
    c->column_count = column_count;
    *columns = c;
    return PLIANT_OK;
}

void pliant_block_columns_destroy(pliant_block_columns *c)
{
    if (!c) return;
    free(c->column);
    free(c->block);
    free(c->row);
    free(c->offset);
    free(c);
}

static int grow(pliant_block_columns *c)
{
    const int64_t capacity = c->capacity < 1024 ? 1024 : 2 * c->capacity;
    int32_t *row = realloc(c->row, (size_t)capacity * sizeof *row);
    if (row) c->row = row;
    int32_t *column = realloc(c->column, (size_t)capacity * sizeof *column);
    if (column) c->column = column;
    double *block = realloc(c->block, (size_t)capacity * 9 * sizeof *block);
    if (block) c->block = block;
    if (!row || !column || !block) return 0;
    c->capacity = capacity;
    return 1;
}

void pliant_block_columns_add(pliant_block_columns *c, int32_t row, int32_t column, double scale,
                              const double block[3][3])
{
    if (c->status < 0) return;
    if (c->count == c->capacity && !grow(c)) {
        c->status = PLIANT_ERR_MEMORY;
        return;
    }
    const int64_t i = c->count++;
    c->row[i] = row;
    c->column[i] = column;
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++) c->block[9 * i + 3 * r + k] = scale * block[r][k];
}

typedef struct place {
    int32_t row;
    int64_t index;  // in the order of coming
} place;

static int compare_places(const void *a, const void *b)
{
    const place *s = a, *t = b;
    if (s->row != t->row) return s->row < t->row ? -1 : 1;
    return (s->index > t->index) - (s->index < t->index);
}

pliant_status pliant_block_columns_finish(pliant_block_columns *c, pliant_error *err)
{
    if (c->status < 0) return no_memory(err, c->count);
    const size_t count = (size_t)c->count;
    place *places = malloc((count + 1) * sizeof *places);
    int32_t *row = malloc((count + 1) * sizeof *row);
    double *block = malloc((count + 1) * 9 * sizeof *block);
    int64_t *fill = calloc((size_t)c->column_count + 2, sizeof *fill);
    pliant_status status = PLIANT_OK;
    if (!places || !row || !block || !fill) {
        status = no_memory(err, c->count);
        free(row);
        free(block);
        goto done;
    }
    for (int64_t i = 0; i < c->count; i++) fill[c->column[i] + 1]++;
    for (int32_t k = 0; k < c->column_count; k++) fill[k + 1] += fill[k];
    for (int64_t i = 0; i < c->count; i++) places[fill[c->column[i]]++] = (place){c->row[i], i};
    int64_t kept = 0, begin = 0;
    for (int32_t k = 0; k < c->column_count; k++) {
        const int64_t end = fill[k];
        qsort(places + begin, (size_t)(end - begin), sizeof *places, compare_places);
        c->offset[k] = kept;
        for (int64_t i = begin; i < end; i++) {
            const double *from = c->block + 9 * places[i].index;
            if (i > begin && places[i].row == places[i - 1].row) {
                for (int e = 0; e < 9; e++) block[9 * (kept - 1) + e] += from[e];
            } else {
                row[kept] = places[i].row;
                memcpy(block + 9 * kept++, from, 9 * sizeof *block);
            }
        }
        begin = end;
    }
    c->offset[c->column_count] = kept;
    free(c->row);
    free(c->block);
    free(c->column);
    c->row = row;
    c->block = block;
    c->column = NULL;
done:
    free(fill);
    free(places);
    return status;
}
