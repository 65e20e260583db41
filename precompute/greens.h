// greens.h: the Green's functions: columns of Xi solved batch by batch and compressed on the way,
// and from them those of coarser levels.
#pragma once

#include "compression.h"
#include "dense_output.h"
#include "discretisation.h"
#include "partial.h"
#include "problem.h"

#include "pliant/sections.h"

// What is known of one level of one block, over all ranks.
typedef struct pliant_greens_result {
    pliant_compression_result compression;  // dense 0: not asked for
    // Of the free-free block, of what is stored: see pliant/compliance.h. 0, 0 where not known.
    double smallest_eigenvalue, largest_eigenvalue;
} pliant_greens_result;

typedef struct pliant_greens {
    MPI_Comm comm;
    const pliant_problem *problem;
    pliant_compression_def compression;
    const char *folder;       // of spools; borrowed until compress
    pliant_partial *partial;  // where solved columns wait; NULL: in spools that go with the run
    int32_t batch;            // columns solved for at once
    pliant_solver_groups groups;
    // By block and level; NULL where not asked for, or not yet there: coarser levels come with
    // compress.
    pliant_compression *blocks[PLIANT_BLOCK_COUNT][PLIANT_LEVEL_LIMIT + 1];
    pliant_greens_result results[PLIANT_BLOCK_COUNT][PLIANT_LEVEL_LIMIT + 1];
    float *gravity_free, *gravity_fixed;  // [m][3][3], [k][3][3]: wavelet coefficients; all ranks
    int has_gravity;                      // 1: they are an earlier run's
    double residual;                      // largest backward error of sampled rows and columns
    double solve_seconds, transform_seconds;
} pliant_greens;

// Columns in a batch: enough right-hand sides for the dense library, whole groups for every rank.
int32_t pliant_greens_batch(MPI_Comm comm);

// Is this block's row (or column) domain the free one?
int pliant_greens_free_rows(pliant_block_name block);
int pliant_greens_free_columns(pliant_block_name block);
// Columns of a block's level.
int32_t pliant_greens_column_count(const pliant_problem *problem, pliant_block_name block, int32_t level);

// The streams of `partial` and their domains.
void pliant_greens_streams(const pliant_problem *problem, const pliant_options *options,
                           int32_t domain[PLIANT_PARTIAL_STREAMS]);

// Collective: compressors for the blocks asked for, for columns that `groups` solve for, with spools in `folder` (borrowed until
// compress). Solved columns go to `partial` (borrowed until destroy, may be NULL), and what is in
// it is taken in.
PetscErrorCode pliant_greens_create(const pliant_solver_groups *groups,
                                    const pliant_problem *problem, const pliant_options *options,
                                    const char *folder,
                                    pliant_partial *partial, pliant_greens **greens,
                                    pliant_error *err);
PetscErrorCode pliant_greens_destroy(pliant_greens **greens);

// Collective: solve those columns of the finest level asked for that are not there yet. `dense` may
// be NULL. When the partial data is whole, `system` is only asked for its residual's bound.
PetscErrorCode pliant_greens_solve(pliant_greens *greens, const pliant_discretisation *method,
                                   void *system, pliant_dense_output *dense,
                                   pliant_progress *progress, pliant_error *err);
// Collective: choose what is kept, level by level: each coarser one refined from the next finer.
PetscErrorCode pliant_greens_compress(pliant_greens *greens, pliant_progress *progress,
                                      pliant_error *err);

// The batches of a level's columns, the same on every rank and when they are written.
// This rank's share of the batch that begins at position `first`.
void pliant_greens_share(const pliant_greens *greens, int32_t column_count, int32_t first, int rank,
                         int32_t *begin, int32_t *end);
