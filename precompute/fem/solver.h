// solver.h: K X = B for blocks of right-hand sides: rows of a table of two.
//
//   direct     sparse Cholesky, blocks of right-hand sides at once: CHOLMOD on one rank, MUMPS on
//              several
//   multigrid  conjugate gradients with smoothed aggregation (PETSc's GAMG) that knows the rigid
//   motions
#pragma once

#include "options.h"

#include <petscmat.h>

typedef struct pliant_fem_solver pliant_fem_solver;

typedef struct pliant_fem_solver_plan {
    pliant_solver_choice kind;  // what was chosen
    double bytes;               // of factors or hierarchy
} pliant_fem_solver_plan;

// From the order of the elements, the number of unknowns and of entries in K, and the memory that
// there is.
pliant_fem_solver_plan pliant_fem_solver_choose(pliant_solver_choice asked, int order,
                                                double unknowns, double nonzeros, double available);
// How many right-hand sides are best solved for at once, by a group of so many ranks.
int32_t pliant_fem_solver_block(pliant_solver_choice kind, int ranks);
const char *pliant_fem_solver_name(pliant_solver_choice kind);

// Collective. K is referenced. *singular is 1 when there is no factorization: K is not positive
// definite.
PetscErrorCode pliant_fem_solver_create(pliant_solver_choice kind, Mat K, Vec coordinates,
                                        pliant_fem_solver **solver, int *singular);
// Collective. B and X are dense, rows as K's. *converged is 0 when the iteration gave up.
PetscErrorCode pliant_fem_solver_solve(pliant_fem_solver *solver, Mat B, Mat X, int *converged);
PetscErrorCode pliant_fem_solver_destroy(pliant_fem_solver **solver);
