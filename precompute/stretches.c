// stretches.c: the columns that earlier processes of a run have finished, wherever they lie.
#include "stretches.h"

#include "refusal.h"

#include "pliant/error.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// No machine has more; a journal that says so is damaged.
static const int32_t most_ranks = 1 << 20;

static pliant_status no_memory(pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for columns of an interrupted run");
}

void pliant_stretches_path(const char *folder, int32_t stretch, int32_t rank, char *path,
                           size_t size)
{
    snprintf(path, size, "%s/columns.%d.%d", folder, stretch, rank);
}

pliant_status pliant_stretches_add(pliant_stretches *p, int32_t ranks,
                                   const int32_t base[PLIANT_COLUMN_DOMAINS],
                                   const int32_t total[PLIANT_COLUMN_DOMAINS], pliant_error *err)
{
    if (ranks < 1 || ranks > most_ranks || p->file_count > INT32_MAX - ranks)
        return PLIANT_ERR_FORMAT;
    pliant_stretch *items = realloc(p->items, ((size_t)p->count + 1) * sizeof *items);
    if (items) p->items = items;
    uint64_t *ends = realloc(p->ends, ((size_t)p->file_count + (size_t)ranks) * sizeof *ends);
    if (ends) p->ends = ends;
    if (!items || !ends) return no_memory(err);
    memset(p->ends + p->file_count, 0, (size_t)ranks * sizeof *ends);
    pliant_stretch *s = &p->items[p->count++];
    *s = (pliant_stretch){.ranks = ranks, .first_file = p->file_count};
    memcpy(s->base, base, sizeof s->base);
    memcpy(s->done, base, sizeof s->done);
    memcpy(s->total, total, sizeof s->total);
    p->file_count += ranks;
    return PLIANT_OK;
}

int pliant_stretches_advance(pliant_stretches *p, const int32_t done[PLIANT_COLUMN_DOMAINS],
                             const void *ends, size_t size)
{
    if (p->count == 0) return 0;
    pliant_stretch *s = &p->items[p->count - 1];
    if (size != (size_t)s->ranks * sizeof *p->ends) return 0;
    for (int d = 0; d < PLIANT_COLUMN_DOMAINS; d++)
        if (done[d] < s->base[d] || done[d] > s->total[d]) return 0;
    memcpy(s->done, done, sizeof s->done);
    memcpy(p->ends + s->first_file, ends, size);
    return 1;
}

// Collective: every rank gets the first one's stretches.
static PetscErrorCode share(MPI_Comm comm, int rank, pliant_stretches *p, pliant_error *err)
{
    PetscFunctionBegin;
    int32_t counts[2] = {p->count, p->file_count};
    PetscCallMPI(MPI_Bcast(counts, 2, MPI_INT32_T, 0, comm));
    if (rank > 0) {
        p->count = counts[0];
        p->file_count = counts[1];
        p->items = calloc((size_t)counts[0] + 1, sizeof *p->items);
        p->ends = calloc((size_t)counts[1] + 1, sizeof *p->ends);
    }
    p->files = calloc((size_t)counts[1] + 1, sizeof *p->files);
    const int is_short = !p->files || (rank > 0 && (!p->items || !p->ends));
    PliantCall(comm, is_short ? no_memory(err) : PLIANT_OK, err);
    const int bytes = counts[0] * (int)sizeof *p->items;
    PetscCallMPI(MPI_Bcast(p->items, bytes, MPI_BYTE, 0, comm));
    PetscCallMPI(MPI_Bcast(p->ends, counts[1], MPI_UINT64_T, 0, comm));
    PetscFunctionReturn(0);
}

// This rank's share of the files checked byte for byte; others end where another rank says.
static pliant_status open_files(int rank, int size, pliant_stretches *p, pliant_error *err)
{
    for (int32_t s = 0; s < p->count; s++)
        for (int32_t r = 0; r < p->items[s].ranks; r++) {
            const int32_t f = p->items[s].first_file + r;
            if (p->ends[f] == 0) continue;
            char path[PATH_MAX + 64];
            pliant_stretches_path(p->folder, s, r, path, sizeof path);
            const pliant_status status =
                pliant_column_file_open(path, p->ends[f], &p->files[f], err);
            if (status == PLIANT_ERR_FORMAT)
                p->ends[f] = 0;  // cut short: damaged from somewhere on
            else if (status < 0) return status;
            if (f % size != rank || !p->files[f]) continue;
            uint64_t offset = 0, at = 0;
            int32_t stream;
            pliant_spooled column;
            while (pliant_column_file_next(p->files[f], p->row_limit, &offset, &stream, &column) &&
                   pliant_column_file_is_whole(p->files[f], at))
                at = offset;
            p->ends[f] = at;
        }
    return PLIANT_OK;
}

// Does column c of domain d count in stretch s?
static int counts_in(const pliant_stretches *p, int32_t s, int d, int32_t c)
{
    if (c < p->items[s].base[d] || c >= p->items[s].done[d]) return 0;
    for (int32_t later = s + 1; later < p->count; later++)
        if (p->items[later].base[d] <= c) return 0;
    return 1;
}

// Where every column lies.
static pliant_status index_columns(pliant_stretches *p, pliant_error *err)
{
    for (int stream = 0; stream < PLIANT_PARTIAL_STREAMS; stream++) {
        if (p->domain[stream] < 0) continue;
        const size_t count = (size_t)p->total[p->domain[stream]];
        p->places[stream] = malloc((count + 1) * sizeof *p->places[stream]);
        if (!p->places[stream]) return no_memory(err);
        for (size_t c = 0; c < count; c++) p->places[stream][c] = (pliant_column_place){.file = -1};
    }
    for (int32_t s = 0; s < p->count; s++)
        for (int32_t f = p->items[s].first_file; f < p->items[s].first_file + p->items[s].ranks;
             f++) {
            uint64_t offset = 0, at = 0;
            int32_t stream;
            pliant_spooled column;
            for (; p->files[f] && offset < p->ends[f]; at = offset) {
                if (!pliant_column_file_next(p->files[f], p->row_limit, &offset, &stream, &column))
                    break;
                if (stream < 0 || stream >= PLIANT_PARTIAL_STREAMS || p->domain[stream] < 0)
                    continue;
                const int d = p->domain[stream];
                if (column.column < 0 || column.column >= p->total[d] ||
                    !counts_in(p, s, d, column.column))
                    continue;
                pliant_column_place *where = &p->places[stream][column.column];
                if (where->file < 0) *where = (pliant_column_place){f, at};
            }
        }
    return PLIANT_OK;
}

int32_t pliant_stretches_columns(const pliant_stretches *p, pliant_column_domain d)
{
    int32_t count = p->total[d];
    for (int stream = 0; stream < PLIANT_PARTIAL_STREAMS; stream++) {
        if (p->domain[stream] != (int32_t)d) continue;
        for (int32_t c = 0; c < count; c++)
            if (p->places[stream][c].file < 0) count = c;
    }
    return count;
}

PetscErrorCode pliant_stretches_load(MPI_Comm comm, pliant_stretches *p, pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(comm, &rank));
    PetscCallMPI(MPI_Comm_size(comm, &size));
    PetscCall(share(comm, rank, p, err));
    if (p->count == 0) PetscFunctionReturn(0);
    PliantCall(comm, open_files(rank, size, p, err), err);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, p->ends, p->file_count, MPI_UINT64_T, MPI_MIN, comm));
    PliantCall(comm, index_columns(p, err), err);
    PetscFunctionReturn(0);
}

void pliant_stretches_clear(pliant_stretches *p)
{
    for (int stream = 0; stream < PLIANT_PARTIAL_STREAMS; stream++) {
        free(p->places[stream]);
        p->places[stream] = NULL;
    }
    for (int32_t f = 0; p->files && f < p->file_count; f++) pliant_column_file_destroy(p->files[f]);
    free(p->files);
    free(p->ends);
    free(p->items);
    p->files = NULL;
    p->ends = NULL;
    p->items = NULL;
    p->count = p->file_count = 0;
}

int pliant_stretches_find(const pliant_stretches *p, int32_t stream, int32_t column,
                          pliant_spooled *found)
{
    if (!p->places[stream]) return 0;
    const pliant_column_place where = p->places[stream][column];
    if (where.file < 0) return 0;
    *found = pliant_column_file_at(p->files[where.file], where.offset);
    return 1;
}
