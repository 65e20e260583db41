// greens.c: the Green's functions: columns of Xi solved batch by batch and compressed on the way.
//
// Each batch of columns is solved together and split over the ranks, so that every rank transforms
// whole columns. Xi as a whole never exists.
#include "greens.h"

#include "refusal.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { group = PLIANT_COLUMN_GROUP };

// Measured at 7686 unknowns on two threads: batches of 128 vertices are solved at the speed of one
// LAPACK call for all columns (6.0 s both); twice and four times as many gain nothing. Every rank gets
// whole groups.
static const int32_t batch_per_rank = 64, least_batch = 128, largest_batch = 512;

int32_t pliant_greens_batch(MPI_Comm comm)
{
    PetscMPIInt size = 1;
    (void)MPI_Comm_size(comm, &size);
    const int64_t batch = (int64_t)batch_per_rank * size;
    return (int32_t)(batch < least_batch ? least_batch : batch > largest_batch ? largest_batch : batch);
}

void pliant_greens_share(const pliant_greens *greens, int32_t column_count, int32_t first, int rank,
                         int size, int32_t *begin, int32_t *end)
{
    const int64_t left = column_count - first, count = left < greens->batch ? left : greens->batch;
    *begin = first + (int32_t)(count * rank / size);
    *end = first + (int32_t)(count * (rank + 1) / size);
}

PetscErrorCode pliant_greens_create(MPI_Comm comm, const pliant_problem *problem,
                                    const pliant_options *options, const char *folder,
                                    pliant_greens **greens, pliant_error *err)
{
    PetscFunctionBegin;
    pliant_greens *g;
    PetscCall(PetscNew(&g));
    *greens = g;
    g->comm = comm;
    g->problem = problem;
    g->batch = pliant_greens_batch(comm);
    pliant_status status = PLIANT_OK;
    for (int b = 0; b < PLIANT_BLOCK_COUNT && status == PLIANT_OK; b++) {
        if (b != PLIANT_FREE_FREE && options->blocks == PLIANT_BLOCKS_FREE) continue;
        const int free_rows = b == PLIANT_FREE_FREE || b == PLIANT_FREE_FIXED;
        status = pliant_compression_create(free_rows ? problem->free_wavelet : problem->fixed_wavelet,
                                           &options->compression, folder, &g->blocks[b], err);
    }
    g->gravity_free = calloc((size_t)problem->free_count * 9 + 1, sizeof *g->gravity_free);
    g->gravity_fixed = calloc((size_t)problem->fixed_count * 9 + 1, sizeof *g->gravity_fixed);
    if (status == PLIANT_OK && (!g->gravity_free || !g->gravity_fixed))
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the gravity columns");
    PliantCall(comm, status, err);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_greens_destroy(pliant_greens **greens)
{
    PetscFunctionBegin;
    pliant_greens *g = *greens;
    if (!g) PetscFunctionReturn(0);
    free(g->gravity_fixed);
    free(g->gravity_free);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++) pliant_compression_destroy(g->blocks[b]);
    PetscCall(PetscFree(*greens));
    PetscFunctionReturn(0);
}

// The rows `nodes` of `count` solved columns (3 values each), into the group's interleaved rows.
static void interleave(const int32_t *nodes, int32_t node_count, const double *columns, size_t ld,
                       int32_t count, double *x)
{
    for (int32_t i = 0; i < node_count; i++) {
        const double *row = columns + 3 * (size_t)nodes[i];
        double *target = x + (size_t)i * 9 * group;
        for (int32_t k = 0; k < count; k++)
            for (int c = 0; c < 3; c++) {
                const double *value = row + (3 * (size_t)k + c) * ld;
                for (int r = 0; r < 3; r++) target[(3 * r + c) * group + k] = value[r];
            }
        for (int e = 0; e < 9; e++)
            for (int32_t k = count; k < group; k++) target[e * group + k] = 0;
    }
    memset(x + (size_t)node_count * 9 * group, 0, 9 * group * sizeof *x);
}

// Hand this rank's solved columns to the two blocks of their domain, group by group.
static pliant_status compress(pliant_greens *g, int fixed_columns, int32_t position, int32_t count,
                              const double *columns, size_t ld, pliant_error *err)
{
    const pliant_problem *p = g->problem;
    pliant_compression *free_rows = g->blocks[fixed_columns ? PLIANT_FREE_FIXED : PLIANT_FREE_FREE];
    pliant_compression *fixed_rows = g->blocks[fixed_columns ? PLIANT_FIXED_FIXED : PLIANT_FIXED_FREE];
    for (int32_t first = 0; first < count; first += group) {
        const int32_t size = count - first < group ? count - first : group;
        const double *source = columns + 3 * (size_t)first * ld;
        int32_t positions[group];
        for (int32_t k = 0; k < size; k++) positions[k] = position + first + k;
        interleave(p->free_nodes, p->free_count, source, ld, size, pliant_compression_group(free_rows));
        pliant_status status = pliant_compression_add(free_rows, positions, size, err);
        if (status < 0) return status;
        if (!fixed_rows) continue;
        interleave(p->fixed_nodes, p->fixed_count, source, ld, size, pliant_compression_group(fixed_rows));
        status = pliant_compression_add(fixed_rows, positions, size, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

// Test solved columns against the kept rows: the backward error |A_s x - b_s| / (|A_s| |x| + |b_s|),
// with absolute values taken entry by entry, which scaling columns does not change; the largest.
static double sample_residual(const pliant_sample_row *sample, int32_t n, const int32_t *vertices,
                              int32_t count, const double *columns, size_t ld)
{
    double worst = 0;
    for (int32_t j = 0; sample->vertex >= 0 && j < 3 * count; j++) {
        const double *x = columns + (size_t)j * ld;
        const double *b = sample->B + 3 * (3 * (size_t)vertices[j / 3] + j % 3);
        for (int r = 0; r < 3; r++) {
            double residual = -b[r], size = fabs(b[r]);
            for (size_t u = 0; u < 3 * (size_t)n; u++) {
                const double term = sample->A[3 * u + r] * x[u];
                residual += term;
                size += fabs(term);
            }
            worst = fmax(worst, size > 0 ? fabs(residual) / size : 0);
        }
    }
    return worst;
}

// Columns of one domain.
static PetscErrorCode solve_domain(pliant_greens *g, pliant_dense_system *system, int fixed_columns,
                                   const pliant_sample_row *sample, pliant_dense_output *dense,
                                   int64_t done, pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_problem *p = g->problem;
    const int32_t *nodes = fixed_columns ? p->fixed_nodes : p->free_nodes;
    const int32_t node_count = fixed_columns ? p->fixed_count : p->free_count;
    for (int32_t first = 0; first < node_count; first += g->batch) {
        const int32_t count = node_count - first < g->batch ? node_count - first : g->batch;
        pliant_dense_share share;
        const double begin = pliant_progress_clock();
        PetscCall(pliant_dense_system_solve(system, nodes + first, count, &share));
        const double solved = pliant_progress_clock();
        g->solve_seconds += solved - begin;

        const int32_t mine = share.end - share.begin, position = first + share.begin;
        PliantCall(g->comm, compress(g, fixed_columns, position, mine, share.columns, share.ld, err), err);
        // One column of every batch is enough to notice a bad factorization.
        if (mine > 0)
            g->residual = fmax(g->residual, sample_residual(sample, p->vertex_count, nodes + position, 1,
                                                            share.columns, share.ld));
        if (dense)
            PetscCall(pliant_dense_output_add(dense, nodes + position, mine, share.columns, share.ld, err));
        g->transform_seconds += pliant_progress_clock() - solved;
        pliant_progress_update(progress, done + first + count);
    }
    PetscFunctionReturn(0);
}

static void transform_gravity(const pliant_wavelet *wavelet, const int32_t *nodes, const double *columns,
                              size_t ld, double *x, float *gravity)
{
    for (int32_t i = 0; i < wavelet->count; i++)
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                x[9 * (size_t)i + 3 * r + c] = columns[c * ld + 3 * (size_t)nodes[i] + r];
    memset(x + 9 * (size_t)wavelet->count, 0, 9 * sizeof *x);
    pliant_wavelet_forward(wavelet, 9, x);
    for (size_t e = 0; e < 9 * (size_t)wavelet->count; e++) gravity[e] = (float)x[e];
}

// The three body-force columns, transformed but not thresholded, on every rank.
static PetscErrorCode solve_gravity(pliant_greens *g, pliant_dense_system *system,
                                    pliant_dense_output *dense, pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_problem *p = g->problem;
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(g->comm, &rank));
    PetscCallMPI(MPI_Comm_size(g->comm, &size));
    pliant_dense_share share;
    PetscCall(pliant_dense_system_solve(system, &p->vertex_count, 1, &share));
    const int32_t most = p->free_count > p->fixed_count ? p->free_count : p->fixed_count;
    const int mine = share.end > share.begin;
    double *x;
    PetscCall(PetscMalloc1(9 * ((size_t)most + 1), &x));
    if (mine) {
        transform_gravity(p->free_wavelet, p->free_nodes, share.columns, share.ld, x, g->gravity_free);
        transform_gravity(p->fixed_wavelet, p->fixed_nodes, share.columns, share.ld, x, g->gravity_fixed);
    }
    PetscCall(PetscFree(x));
    const int owner_here = mine ? rank : 0;
    int owner;
    PetscCallMPI(MPI_Allreduce(&owner_here, &owner, 1, MPI_INT, MPI_MAX, g->comm));
    PetscCallMPI(MPI_Bcast(g->gravity_free, 9 * p->free_count, MPI_FLOAT, owner, g->comm));
    PetscCallMPI(MPI_Bcast(g->gravity_fixed, 9 * p->fixed_count, MPI_FLOAT, owner, g->comm));
    if (dense)
        PetscCall(pliant_dense_output_add(dense, &p->vertex_count, mine, share.columns, share.ld, err));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_greens_solve(pliant_greens *g, pliant_dense_system *system,
                                   const pliant_sample_row *sample, pliant_dense_output *dense,
                                   pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    const int all = g->blocks[PLIANT_FIXED_FIXED] != NULL;
    const pliant_problem *p = g->problem;
    pliant_progress_begin(progress, "solve", p->free_count + (all ? p->fixed_count : 0));
    PetscCall(solve_domain(g, system, 0, sample, dense, 0, progress, err));
    if (all) PetscCall(solve_domain(g, system, 1, sample, dense, p->free_count, progress, err));
    PetscCall(solve_gravity(g, system, dense, err));
    double worst;
    PetscCallMPI(MPI_Allreduce(&g->residual, &worst, 1, MPI_DOUBLE, MPI_MAX, g->comm));
    g->residual = worst;
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_greens_compress(pliant_greens *g, pliant_error *err)
{
    PetscFunctionBegin;
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        if (g->blocks[b])
            PliantCall(g->comm, pliant_compression_decide(g->blocks[b], g->comm, &g->results[b], err), err);
    PetscFunctionReturn(0);
}
