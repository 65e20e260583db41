// discretisation.h: what solves the reference problem: one row of functions for each method.
//
// Whatever the method, the unknowns that come out are those of the boundary value problem, by
// surface vertex: displacements at free ones, tractions at fixed ones. The columns solved for are
// those of right_hand.h: responses to the hats of the finest level asked for, as tractions of free
// nodes and, with all blocks, as displacements of fixed nodes behind them.
#pragma once

#include "problem.h"
#include "solver_groups.h"

#include <stddef.h>

// Whole columns of Xi, on the rank that goes on with them. Borrowed until the next solve.
typedef struct pliant_column_share {
    int32_t begin, end;     // columns of the batch, from 0, that are this rank's
    const double *columns;  // [end - begin] times 3 columns of 3n values, leading dimension ld
    size_t ld;
} pliant_column_share;

// Bytes that a system will need, all ranks together, so that a run can be refused before it starts.
typedef struct pliant_solve_plan {
    const char *solver;   // a word, for the summary
    int32_t groups;
    char system[160];     // "dense system of 1926 unknowns", for a note
    double matrix_bytes;  // with its factors
    double right_hand_bytes;
    double batch_bytes;   // right-hand sides and solutions of one batch, with solver copies
    double factor_flops;  // 0: not known
    double solve_flops;   // of all columns; 0: not known
} pliant_solve_plan;

// Every function is collective over all ranks. `system` is the method's own; it has dealt the ranks out
// to groups when it is created, each with an operator of its own.
typedef struct pliant_discretisation {
    const char *name;
    // Look at the problem; both are borrowed until destroy. `batch` columns are solved for at once.
    PetscErrorCode (*create)(MPI_Comm comm, const pliant_problem *problem,
                             const pliant_options *options, int32_t batch,
                             pliant_progress *progress, void **system, pliant_error *err);
    PetscErrorCode (*plan)(const void *system, pliant_solve_plan *plan);
    const pliant_solver_groups *(*groups)(const void *system);  // borrowed until destroy
    PetscErrorCode (*assemble)(void *system, pliant_progress *progress, pliant_error *err);
    // PLIANT_REFUSED when the system is singular.
    PetscErrorCode (*factor)(void *system, pliant_progress *progress, pliant_error *err);
    // Columns first .. first + count - 1, count <= batch; shares are those of
    // pliant_solver_groups_share.
    PetscErrorCode (*solve)(void *system, int32_t first, int32_t count, pliant_column_share *share,
                            pliant_error *err);
    // The three columns of a unit acceleration's body force, as one.
    PetscErrorCode (*solve_gravity)(void *system, pliant_column_share *share, pliant_error *err);
    // The largest backward error seen in columns so far, and what it may be.
    PetscErrorCode (*residual)(const void *system, double *worst, double *bound);
    PetscErrorCode (*destroy)(void **system);  // *system may be NULL
} pliant_discretisation;

const pliant_discretisation *pliant_discretisation_of(pliant_method method);
