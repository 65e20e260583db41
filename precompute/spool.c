// spool.c: the transformed columns of one Green's function block, on disk, one rank's share.
#include "spool.h"

#include "pliant/error.h"

#include <stdlib.h>

typedef struct entry {
    pliant_spooled column;  // without rows until seal where it lies in the file
    uint64_t offset;        // in the file
} entry;

struct pliant_spool {
    pliant_column_file *own, *file;  // own NULL: borrowed
    int32_t stream;
    entry *entries;
    int32_t entry_count, entry_capacity;
};

pliant_status pliant_spool_create_in(pliant_column_file *file, int32_t stream, pliant_spool **spool,
                                     pliant_error *err)
{
    pliant_spool *s = calloc(1, sizeof *s);
    if (!s) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a spool");
    s->file = file;
    s->stream = stream;
    *spool = s;
    return PLIANT_OK;
}

pliant_status pliant_spool_create(const char *folder, pliant_spool **spool, pliant_error *err)
{
    pliant_column_file *own;
    pliant_status status = pliant_column_file_create_temporary(folder, &own, err);
    if (status < 0) return status;
    status = pliant_spool_create_in(own, 0, spool, err);
    if (status < 0) pliant_column_file_destroy(own);
    else (*spool)->own = own;
    return status;
}

void pliant_spool_destroy(pliant_spool *spool)
{
    if (!spool) return;
    pliant_column_file_destroy(spool->own);
    free(spool->entries);
    free(spool);
}

static pliant_status enter(pliant_spool *s, const pliant_spooled *column, uint64_t offset,
                           pliant_error *err)
{
    if (s->entry_count == s->entry_capacity) {
        const int32_t capacity = s->entry_capacity ? 2 * s->entry_capacity : 256;
        entry *entries = realloc(s->entries, (size_t)capacity * sizeof *entries);
        if (!entries)
            return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d spooled columns", capacity);
        s->entries = entries;
        s->entry_capacity = capacity;
    }
    s->entries[s->entry_count++] = (entry){*column, offset};
    return PLIANT_OK;
}

pliant_status pliant_spool_append(pliant_spool *s, const pliant_spooled *column, pliant_error *err)
{
    uint64_t offset;
    const pliant_status status =
        pliant_column_file_append(s->file, s->stream, column, &offset, err);
    if (status < 0) return status;
    pliant_spooled later = *column;
    later.rows = NULL;
    return enter(s, &later, offset, err);
}

pliant_status pliant_spool_adopt(pliant_spool *s, const pliant_spooled *column, pliant_error *err)
{
    return enter(s, column, 0, err);
}

pliant_status pliant_spool_seal(pliant_spool *s, pliant_error *err)
{
    const pliant_status status = pliant_column_file_map(s->file, err);
    if (status < 0) return status;
    for (int32_t i = 0; i < s->entry_count; i++)
        if (!s->entries[i].column.rows)
            s->entries[i].column = pliant_column_file_at(s->file, s->entries[i].offset);
    return PLIANT_OK;
}

int32_t pliant_spool_column_count(const pliant_spool *spool)
{
    return spool->entry_count;
}

pliant_spooled pliant_spool_column(const pliant_spool *spool, int32_t index)
{
    return spool->entries[index].column;
}
