// column_file.c: transformed columns in a file, in the order in which they came.
#include "column_file.h"

#include "checksum.h"

#include "pliant/error.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

// Before a column's rows, norms and blocks.
typedef struct column_head {
    uint32_t mark;
    int32_t stream, column, count;
    double peak, energy, error_energy, error_worst;
    uint64_t checksum;  // of the head with 0 here, then of each array
} column_head;

_Static_assert(sizeof(column_head) == 56, "on disk");

static const uint32_t head_mark = 0x4C4F4350;  // "PCOL"
enum { bytes_per_coefficient = sizeof(int32_t) + 10 * sizeof(float) };

struct pliant_column_file {
    char *name;  // of the file, or the folder of one without a name: for messages
    FILE *file;  // NULL: opened for reading
    uint64_t bytes;
    const char *map;
    uint64_t mapped;
};

static pliant_status refuse(const pliant_column_file *f, const char *what, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_IO, "%.400s: cannot %s the file of columns: %s",
                            f->name, what, strerror(errno));
}

static pliant_status create(const char *name, pliant_column_file **file, pliant_error *err)
{
    pliant_column_file *f = calloc(1, sizeof *f);
    if (f) f->name = strdup(name);
    if (!f || !f->name) {
        free(f);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a file of columns");
    }
    *file = f;
    return PLIANT_OK;
}

// Take over an open file for writing, -1: none with errno set.
static pliant_status take_over(pliant_column_file *f, int descriptor, pliant_column_file **file,
                               pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    if (descriptor < 0) status = refuse(f, "create", err);
    if (status == PLIANT_OK && !(f->file = fdopen(descriptor, "w+b"))) {
        close(descriptor);
        status = refuse(f, "open", err);
    }
    if (status < 0) {
        pliant_column_file_destroy(f);
        return status;
    }
    // Whole columns at a time: a few hundred kilobytes each.
    setvbuf(f->file, NULL, _IOFBF, 1 << 20);
    *file = f;
    return PLIANT_OK;
}

pliant_status pliant_column_file_create_temporary(const char *folder, pliant_column_file **file,
                                                  pliant_error *err)
{
    pliant_column_file *f = NULL;
    const pliant_status status = create(folder, &f, err);
    if (status < 0) return status;
    const size_t length = strlen(folder) + sizeof "/.pliant-spool-XXXXXX";
    char *path = malloc(length);
    if (!path) {
        pliant_column_file_destroy(f);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a file of columns");
    }
    snprintf(path, length, "%s/.pliant-spool-XXXXXX", folder);
    const int descriptor = mkstemp(path);
    if (descriptor >= 0) unlink(path);
    free(path);
    return take_over(f, descriptor, file, err);
}

pliant_status pliant_column_file_create(const char *path, pliant_column_file **file,
                                        pliant_error *err)
{
    pliant_column_file *f = NULL;
    const pliant_status status = create(path, &f, err);
    if (status < 0) return status;
    // A file of this name is one that no journal speaks of. Somebody may still have it open.
    unlink(path);
    return take_over(f, open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666), file, err);
}

static pliant_status map_bytes(pliant_column_file *f, int descriptor, pliant_error *err)
{
    if (f->bytes == 0) return PLIANT_OK;
    void *map = mmap(NULL, f->bytes, PROT_READ, MAP_SHARED, descriptor, 0);
    if (map == MAP_FAILED) return refuse(f, "map", err);
    f->map = map;
    f->mapped = f->bytes;
    return PLIANT_OK;
}

pliant_status pliant_column_file_open(const char *path, uint64_t bytes, pliant_column_file **file,
                                      pliant_error *err)
{
    pliant_column_file *f = NULL;
    pliant_status status = create(path, &f, err);
    if (status < 0) return status;
    f->bytes = bytes;
    struct stat found;
    const int descriptor = open(path, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0 || fstat(descriptor, &found) != 0) status = refuse(f, "open", err);
    else if ((uint64_t)found.st_size < bytes)
        status =
            pliant_error_set(err, PLIANT_ERR_FORMAT, "%.400s: expected %llu bytes, found %llu",
                             path, (unsigned long long)bytes, (unsigned long long)found.st_size);
    else status = map_bytes(f, descriptor, err);
    if (descriptor >= 0) close(descriptor);
    if (status < 0) {
        pliant_column_file_destroy(f);
        return status;
    }
    *file = f;
    return PLIANT_OK;
}

void pliant_column_file_destroy(pliant_column_file *f)
{
    if (!f) return;
    if (f->map) munmap((void *)(uintptr_t)f->map, f->mapped);
    if (f->file) fclose(f->file);
    free(f->name);
    free(f);
}

static uint64_t column_checksum(column_head head, const int32_t *rows, const float *norms,
                                const float *blocks)
{
    const size_t count = (size_t)head.count;
    head.checksum = 0;
    uint64_t sum = pliant_checksum(0, &head, sizeof head);
    sum = pliant_checksum(sum, rows, count * sizeof *rows);
    sum = pliant_checksum(sum, norms, count * sizeof *norms);
    return pliant_checksum(sum, blocks, 9 * count * sizeof *blocks);
}

pliant_status pliant_column_file_append(pliant_column_file *f, int32_t stream,
                                        const pliant_spooled *column, uint64_t *offset,
                                        pliant_error *err)
{
    const size_t count = (size_t)column->count;
    column_head head = {.mark = head_mark,
                        .stream = stream,
                        .column = column->column,
                        .count = column->count,
                        .peak = column->peak,
                        .energy = column->energy,
                        .error_energy = column->error_energy,
                        .error_worst = column->error_worst};
    head.checksum = column_checksum(head, column->rows, column->norms, column->blocks);
    if (fwrite(&head, sizeof head, 1, f->file) != 1 ||
        fwrite(column->rows, sizeof *column->rows, count, f->file) != count ||
        fwrite(column->norms, sizeof *column->norms, count, f->file) != count ||
        fwrite(column->blocks, 9 * sizeof *column->blocks, count, f->file) != count)
        return refuse(f, "write to", err);
    *offset = f->bytes;
    f->bytes += sizeof head + count * bytes_per_coefficient;
    return PLIANT_OK;
}

uint64_t pliant_column_file_bytes(const pliant_column_file *f)
{
    return f->bytes;
}

pliant_status pliant_column_file_sync(pliant_column_file *f, pliant_error *err)
{
    if (fflush(f->file) != 0 || fdatasync(fileno(f->file)) != 0) return refuse(f, "write to", err);
    return PLIANT_OK;
}

pliant_status pliant_column_file_map(pliant_column_file *f, pliant_error *err)
{
    if (f->map && f->mapped == f->bytes) return PLIANT_OK;
    if (fflush(f->file) != 0) return refuse(f, "write to", err);
    return map_bytes(f, fileno(f->file), err);
}

static pliant_spooled column_behind(const pliant_column_file *f, const column_head *head,
                                    uint64_t offset)
{
    const int32_t *rows = (const int32_t *)(const void *)(f->map + offset + sizeof *head);
    const float *norms = (const float *)(const void *)(rows + head->count);
    return (pliant_spooled){.column = head->column,
                            .count = head->count,
                            .rows = rows,
                            .norms = norms,
                            .blocks = norms + head->count,
                            .peak = head->peak,
                            .energy = head->energy,
                            .error_energy = head->error_energy,
                            .error_worst = head->error_worst};
}

pliant_spooled pliant_column_file_at(const pliant_column_file *f, uint64_t offset)
{
    column_head head;  // may lie across an eight-byte border
    memcpy(&head, f->map + offset, sizeof head);
    return column_behind(f, &head, offset);
}

int pliant_column_file_next(const pliant_column_file *f, int32_t rows, uint64_t *offset,
                            int32_t *stream, pliant_spooled *column)
{
    column_head head;
    if (*offset > f->mapped || f->mapped - *offset < sizeof head) return 0;
    memcpy(&head, f->map + *offset, sizeof head);
    const uint64_t left = f->mapped - *offset - sizeof head;
    if (head.mark != head_mark || head.count < 0 || head.count > rows ||
        left / bytes_per_coefficient < (uint64_t)head.count)
        return 0;
    *stream = head.stream;
    *column = column_behind(f, &head, *offset);
    *offset += sizeof head + (uint64_t)head.count * bytes_per_coefficient;
    return 1;
}

int pliant_column_file_is_whole(const pliant_column_file *f, uint64_t offset)
{
    column_head head;
    memcpy(&head, f->map + offset, sizeof head);
    const pliant_spooled c = column_behind(f, &head, offset);
    return head.checksum == column_checksum(head, c.rows, c.norms, c.blocks);
}
