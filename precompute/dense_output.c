// dense_output.c: the exact columns, untransformed, in a file for comparisons.
#include "dense_output.h"

#include "refusal.h"

#include <stdlib.h>

struct pliant_dense_output {
    MPI_Comm comm;
    PetscMPIInt rank, size;
    const pliant_problem *problem;
    pliant_blocks blocks;
    pliant_writer *writer;  // first rank only
    double *slab;           // one rank's columns, row-major
    size_t capacity;
};

PetscErrorCode pliant_dense_output_create(MPI_Comm comm, const char *path,
                                          const pliant_problem *problem, pliant_blocks blocks,
                                          pliant_dense_output **output, pliant_error *err)
{
    PetscFunctionBegin;
    pliant_dense_output *d;
    PetscCall(PetscNew(&d));
    *output = d;
    d->comm = comm;
    d->problem = problem;
    d->blocks = blocks;
    PetscCallMPI(MPI_Comm_rank(comm, &d->rank));
    PetscCallMPI(MPI_Comm_size(comm, &d->size));

    pliant_status status = PLIANT_OK;
    if (d->rank == 0) {
        pliant_section_def sections[PLIANT_SECTION_LIMIT];
        int32_t section_count;
        status = pliant_dense_layout_sections(problem->free_count,
                                              blocks == PLIANT_BLOCKS_ALL ? problem->fixed_count : -1,
                                              sections, &section_count, err);
        if (status == PLIANT_OK)
            status = pliant_writer_create(path, sections, section_count, &d->writer, err);
        if (status == PLIANT_OK)
            status = pliant_writer_write_all(d->writer, "/dense/nodes", problem->free_nodes, err);
        if (status == PLIANT_OK && blocks == PLIANT_BLOCKS_ALL)
            status = pliant_writer_write_all(d->writer, "/dense/fixed-nodes", problem->fixed_nodes, err);
    }
    PliantCall(comm, status, err);
    PetscFunctionReturn(0);
}

// The rows `nodes` of the solved columns, row-major.
static void pack(const int32_t *nodes, int32_t node_count, int32_t count, const double *columns,
                 size_t ld, double *slab)
{
    for (int32_t i = 0; i < node_count; i++)
        for (int r = 0; r < 3; r++)
            for (int32_t j = 0; j < 3 * count; j++)
                slab[(3 * (size_t)i + r) * 3 * (size_t)count + j] =
                    columns[(size_t)j * ld + 3 * (size_t)nodes[i] + r];
}

// Collective: one block's rows of everybody's columns, written by the first rank.
static PetscErrorCode add_rows(pliant_dense_output *d, const char *path, const int32_t *nodes,
                               int32_t node_count, int32_t first, int32_t count,
                               const double *columns, size_t ld, pliant_error *err)
{
    PetscFunctionBegin;
    const size_t values = 9 * (size_t)node_count * (size_t)count;
    int32_t mine[2] = {first, count}, *all;
    PetscCall(PetscMalloc1(2 * (size_t)d->size, &all));
    PetscCallMPI(MPI_Gather(mine, 2, MPI_INT32_T, all, 2, MPI_INT32_T, 0, d->comm));
    size_t needed = values;
    for (int r = 0; d->rank == 0 && r < d->size; r++) {
        const size_t theirs = 9 * (size_t)node_count * (size_t)all[2 * r + 1];
        if (theirs > needed) needed = theirs;
    }
    if (needed > d->capacity) {
        PetscCall(PetscFree(d->slab));
        PetscCall(PetscMalloc1(needed, &d->slab));
        d->capacity = needed;
    }
    pliant_status status = PLIANT_OK;
    if (d->rank > 0 && count > 0) {
        pack(nodes, node_count, count, columns, ld, d->slab);
        PetscCallMPI(MPI_Send(d->slab, (PetscMPIInt)values, MPI_DOUBLE, 0, 0, d->comm));
    }
    for (int r = 0; d->rank == 0 && r < d->size; r++) {
        const int32_t their_first = all[2 * r], their_count = all[2 * r + 1];
        if (their_count == 0) continue;
        if (r == 0)
            pack(nodes, node_count, count, columns, ld, d->slab);
        else
            PetscCallMPI(MPI_Recv(d->slab, (PetscMPIInt)(9 * node_count * their_count), MPI_DOUBLE, r, 0,
                                  d->comm, MPI_STATUS_IGNORE));
        const uint64_t start[3] = {0, 3 * (uint64_t)their_first, 0};
        const uint64_t box[3] = {3 * (uint64_t)node_count, 3 * (uint64_t)their_count, 1};
        // After a refusal go on receiving, so that nobody waits; the first refusal is the answer.
        if (status == PLIANT_OK) status = pliant_writer_write(d->writer, path, start, box, d->slab, err);
    }
    PetscCall(PetscFree(all));
    PliantCall(d->comm, status, err);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_output_add(pliant_dense_output *d, pliant_dense_source source, int32_t first,
                                       int32_t count, const double *columns, size_t ld, pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_problem *p = d->problem;
    static const char *const free_paths[] = {"/dense/free-free", "/dense/free-fixed", "/dense/gravity-free"};
    static const char *const fixed_paths[] = {"/dense/fixed-free", "/dense/fixed-fixed", "/dense/gravity-fixed"};
    PetscCall(add_rows(d, free_paths[source], p->free_nodes, p->free_count, first, count, columns, ld, err));
    if (d->blocks == PLIANT_BLOCKS_ALL)
        PetscCall(add_rows(d, fixed_paths[source], p->fixed_nodes, p->fixed_count, first, count, columns, ld, err));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_output_commit(pliant_dense_output *d, pliant_error *err)
{
    PetscFunctionBegin;
    pliant_status status = PLIANT_OK;
    if (d->writer) {
        status = pliant_writer_commit(d->writer, err);
        d->writer = NULL;
    }
    PliantCall(d->comm, status, err);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_output_destroy(pliant_dense_output **output)
{
    PetscFunctionBegin;
    pliant_dense_output *d = *output;
    if (!d) PetscFunctionReturn(0);
    pliant_writer_abandon(d->writer);
    PetscCall(PetscFree(d->slab));
    PetscCall(PetscFree(*output));
    PetscFunctionReturn(0);
}
