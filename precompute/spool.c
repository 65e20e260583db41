// spool.c: the transformed columns of one Green's function block, on disk, one rank's share.
#include "spool.h"

#include "pliant/error.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

typedef struct entry {
    int32_t column, count;
    uint64_t offset;  // of the rows; norms and blocks follow
    double peak, energy;
} entry;

struct pliant_spool {
    char *folder;
    FILE *file;
    uint64_t bytes;
    entry *entries;
    int32_t entry_count, entry_capacity;
    const char *map;
};

static pliant_status refuse(const pliant_spool *spool, const char *what, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot %s the temporary file of columns: %s",
                            spool->folder, what, strerror(errno));
}

pliant_status pliant_spool_create(const char *folder, pliant_spool **spool, pliant_error *err)
{
    pliant_spool *s = calloc(1, sizeof *s);
    const size_t length = strlen(folder) + sizeof "/.pliant-spool-XXXXXX";
    char *path = malloc(length);
    pliant_status status = PLIANT_OK;
    if (!s || !path || !(s->folder = strdup(folder))) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a spool");
        goto done;
    }
    snprintf(path, length, "%s/.pliant-spool-XXXXXX", folder);
    const int file = mkstemp(path);
    if (file < 0) {
        status = refuse(s, "create", err);
        goto done;
    }
    unlink(path);
    s->file = fdopen(file, "w+b");
    if (!s->file) {
        close(file);
        status = refuse(s, "open", err);
        goto done;
    }
    // Whole columns at a time: a few hundred kilobytes each.
    setvbuf(s->file, NULL, _IOFBF, 1 << 20);
    *spool = s;
    s = NULL;
done:
    free(path);
    pliant_spool_destroy(s);
    return status;
}

void pliant_spool_destroy(pliant_spool *spool)
{
    if (!spool) return;
    if (spool->map) munmap((void *)(uintptr_t)spool->map, spool->bytes);
    if (spool->file) fclose(spool->file);
    free(spool->entries);
    free(spool->folder);
    free(spool);
}

pliant_status pliant_spool_append(pliant_spool *s, const pliant_spooled *column, pliant_error *err)
{
    if (s->entry_count == s->entry_capacity) {
        const int32_t capacity = s->entry_capacity ? 2 * s->entry_capacity : 256;
        entry *entries = realloc(s->entries, (size_t)capacity * sizeof *entries);
        if (!entries)
            return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d spooled columns", capacity);
        s->entries = entries;
        s->entry_capacity = capacity;
    }
    const size_t count = (size_t)column->count;
    if (fwrite(column->rows, sizeof *column->rows, count, s->file) != count ||
        fwrite(column->norms, sizeof *column->norms, count, s->file) != count ||
        fwrite(column->blocks, 9 * sizeof *column->blocks, count, s->file) != count)
        return refuse(s, "write to", err);
    s->entries[s->entry_count++] = (entry){column->column, column->count, s->bytes, column->peak, column->energy};
    s->bytes += count * (sizeof *column->rows + 10 * sizeof *column->blocks);
    return PLIANT_OK;
}

pliant_status pliant_spool_seal(pliant_spool *s, pliant_error *err)
{
    if (fflush(s->file) != 0) return refuse(s, "write to", err);
    if (s->bytes == 0) return PLIANT_OK;
    void *map = mmap(NULL, s->bytes, PROT_READ, MAP_SHARED, fileno(s->file), 0);
    if (map == MAP_FAILED) return refuse(s, "map", err);
    s->map = map;
    return PLIANT_OK;
}

int32_t pliant_spool_column_count(const pliant_spool *spool)
{
    return spool->entry_count;
}

pliant_spooled pliant_spool_column(const pliant_spool *spool, int32_t index)
{
    const entry *e = &spool->entries[index];
    const int32_t *rows = (const int32_t *)(const void *)(spool->map + e->offset);
    const float *norms = (const float *)(const void *)(rows + e->count);
    return (pliant_spooled){.column = e->column, .count = e->count, .rows = rows, .norms = norms,
                            .blocks = norms + e->count, .peak = e->peak, .energy = e->energy};
}
