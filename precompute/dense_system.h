// dense_system.h: the distributed dense linear system of the boundary element method, A v = B vbar.
//
// Two ways to factor it, both PETSc's, chosen by where the ranks are:
//
//   node       all ranks share one machine: every rank assembles its rows straight into one shared
//              matrix; its first rank factors and solves with LAPACK through MATSEQDENSE, on as many
//              threads as there are ranks, while the others sleep. No copy, no communication.
//   scalapack  ranks on several machines, or a matrix too large for LAPACK's 32-bit sizes:
//              MATSCALAPACK, block-cyclic over all ranks.
//
// Measured on two cores at 7686 unknowns: LU 2.6 s against 3.0 s, solves 104 against 69 GFLOP/s.
// PETSC_OPTIONS="-pliant_dense scalapack" (or node) overrules the choice.
#pragma once

#include "discretisation.h"

#include <petscsys.h>

#include <stddef.h>
#include <stdint.h>

typedef struct pliant_dense_system pliant_dense_system;

// Bytes on this machine that a system will need, all its ranks together, so that a run can be refused
// before it starts; the numbers as in create.
typedef struct pliant_dense_plan {
    const char *kind;        // "node" or "scalapack"
    double matrix_bytes;     // A
    double right_hand_bytes; // right-hand sides
    double batch_bytes;      // right-hand sides and solutions of one batch, with solver copies
} pliant_dense_plan;

// Collective.
PetscErrorCode pliant_dense_system_plan(MPI_Comm comm, int32_t n, int32_t columns, int32_t batch,
                                        pliant_dense_plan *plan);
// Collective: memory for n vertices and `columns` right-hand sides of three, zeroed; up to `batch` of
// them are solved for at once.
PetscErrorCode pliant_dense_system_create(MPI_Comm comm, int32_t n, int32_t columns, int32_t batch,
                                          pliant_dense_system **system);
PetscErrorCode pliant_dense_system_destroy(pliant_dense_system **system);  // collective

// Where this rank assembles: vertices row_begin .. row_end - 1; A and gravity are what
// pliant_bem_assemble fills, right has 3 x columns. Borrowed until factor (A) and destroy (the others).
typedef struct pliant_dense_rows {
    int32_t row_begin, row_end;
    double *A, *right, *gravity;
    size_t ld_a, ld_right, ld_g;
} pliant_dense_rows;
pliant_dense_rows pliant_dense_system_rows(const pliant_dense_system *system);

// Collective: seconds that factor will take, about, from a matrix of an eighth of the rows; 0: unknown.
PetscErrorCode pliant_dense_system_estimate(const pliant_dense_system *system, double *seconds);
// Collective: LU with partial pivoting in place of A. *singular is 1 when a pivot vanished.
PetscErrorCode pliant_dense_system_factor(pliant_dense_system *system, int *singular);

// Collective: solve for columns first .. first + count - 1 (count <= batch).
PetscErrorCode pliant_dense_system_solve(pliant_dense_system *system, int32_t first, int32_t count,
                                         pliant_column_share *share);
// Collective: solve for the three gravity columns.
PetscErrorCode pliant_dense_system_solve_gravity(pliant_dense_system *system, pliant_column_share *share);
