// greens.h: the Green's functions: columns of Xi solved batch by batch and compressed on the way.
#pragma once

#include "compression.h"
#include "dense_system.h"
#include "dense_output.h"
#include "problem.h"

#include "pliant/sections.h"

typedef struct pliant_greens {
    MPI_Comm comm;
    const pliant_problem *problem;
    int32_t batch;                                    // columns' vertices solved for at once
    pliant_compression *blocks[PLIANT_BLOCK_COUNT];   // NULL where not asked for
    pliant_compression_result results[PLIANT_BLOCK_COUNT];
    float *gravity_free, *gravity_fixed;  // [m][3][3], [k][3][3]: wavelet coefficients; all ranks
    double residual;                      // largest backward error of sampled rows and columns
    double solve_seconds, transform_seconds;
} pliant_greens;

// Vertices in a batch: enough right-hand sides for the dense library, whole groups for every rank.
int32_t pliant_greens_batch(MPI_Comm comm);

// Collective: compressors for the blocks asked for, with spools in `folder`.
PetscErrorCode pliant_greens_create(MPI_Comm comm, const pliant_problem *problem,
                                    const pliant_options *options, const char *folder,
                                    pliant_greens **greens, pliant_error *err);
PetscErrorCode pliant_greens_destroy(pliant_greens **greens);

// A row of the system kept from before the factorization, against which solutions are tested.
typedef struct pliant_sample_row {
    int32_t vertex;  // -1: this rank has none
    double *A, *B;   // [3n][3] each: three rows, column by column
} pliant_sample_row;

// Collective: solve all columns of the factored system. `dense` may be NULL.
PetscErrorCode pliant_greens_solve(pliant_greens *greens, pliant_dense_system *system,
                                   const pliant_sample_row *sample, pliant_dense_output *dense,
                                   pliant_progress *progress, pliant_error *err);
// Collective: choose what is kept in every block.
PetscErrorCode pliant_greens_compress(pliant_greens *greens, pliant_error *err);

// The batches of a domain's columns, the same on every rank and when they are written.
// This rank's share of the batch that begins at position `first`.
void pliant_greens_share(const pliant_greens *greens, int32_t column_count, int32_t first, int rank,
                         int size, int32_t *begin, int32_t *end);
