// solver.c: K X = B for blocks of right-hand sides: rows of a table of two.
//
// This follows: P. R. Amestoy, I. S. Duff, J.-Y. L'Excellent, J. Koster, A fully asynchronous
// multifrontal solver using distributed dynamic scheduling, SIAM J. Matrix Anal. Appl. 23, 2001
// (MUMPS); P. Vanek, J. Mandel, M. Brezina, Algebraic multigrid by smoothed aggregation for second
// and fourth order elliptic problems, Computing 56, 1996.
#include "fem/solver.h"

#include <math.h>
#include <petscksp.h>

struct pliant_fem_solver {
    const struct kind *kind;
    Mat factor;  // direct
    KSP ksp;     // multigrid
};

typedef struct kind {
    const char *name;
    PetscErrorCode (*create)(pliant_fem_solver *, Mat, Vec, int *);
    PetscErrorCode (*solve)(pliant_fem_solver *, Mat, Mat, int *);
} kind;

// ---- Direct ----

// MUMPS solves for this many right-hand sides at once: measured at 65856 unknowns, 98 ms each
// alone, 9.4 in 32, 8.3 in 64, 5.8 in 256.
static const PetscInt solve_block = 192;

static PetscErrorCode create_direct(pliant_fem_solver *s, Mat K, Vec coordinates, int *singular)
{
    PetscFunctionBegin;
    (void)coordinates;
    MatFactorInfo info;
    MatFactorError error;
    PetscCall(MatFactorInfoInitialize(&info));
    PetscCall(MatGetFactor(K, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, &s->factor));
    PetscCall(MatMumpsSetIcntl(s->factor, 27, solve_block));
    PetscCall(MatCholeskyFactorSymbolic(s->factor, K, NULL, &info));
    PetscCall(MatCholeskyFactorNumeric(s->factor, K, &info));
    // MUMPS's failures are silent unless asked for.
    PetscCall(MatFactorGetError(s->factor, &error));
    *singular = error != MAT_FACTOR_NOERROR;
    PetscFunctionReturn(0);
}

static PetscErrorCode solve_direct(pliant_fem_solver *s, Mat B, Mat X, int *converged)
{
    PetscFunctionBegin;
    *converged = 1;
    PetscCall(MatMatSolve(s->factor, B, X));
    PetscFunctionReturn(0);
}

// ---- Multigrid ----

// The residual relative to the right-hand side; columns of different solvers then agree to 1e-7 of
// their largest value or better.
static const double multigrid_tolerance = 1e-9;
static const PetscInt multigrid_steps = 2000;

static PetscErrorCode create_multigrid(pliant_fem_solver *s, Mat K, Vec coordinates, int *singular)
{
    PetscFunctionBegin;
    MPI_Comm comm;
    MatNullSpace rigid;
    PC pc;
    *singular = 0;
    PetscCall(PetscObjectGetComm((PetscObject)K, &comm));
    PetscCall(MatNullSpaceCreateRigidBody(coordinates, &rigid));
    PetscCall(MatSetNearNullSpace(K, rigid));
    PetscCall(MatNullSpaceDestroy(&rigid));
    PetscCall(KSPCreate(comm, &s->ksp));
    PetscCall(KSPSetOptionsPrefix(s->ksp, "pliant_fem_"));
    PetscCall(KSPSetOperators(s->ksp, K, K));
    PetscCall(KSPSetType(s->ksp, KSPCG));
    PetscCall(KSPSetNormType(s->ksp, KSP_NORM_UNPRECONDITIONED));
    PetscCall(KSPSetTolerances(s->ksp, multigrid_tolerance, 0, PETSC_DEFAULT, multigrid_steps));
    PetscCall(KSPGetPC(s->ksp, &pc));
    PetscCall(PCSetType(pc, PCGAMG));
    PetscCall(KSPSetFromOptions(s->ksp));
    PetscCall(KSPSetUp(s->ksp));
    PetscFunctionReturn(0);
}

static PetscErrorCode solve_multigrid(pliant_fem_solver *s, Mat B, Mat X, int *converged)
{
    PetscFunctionBegin;
    PetscInt columns;
    *converged = 1;
    PetscCall(MatGetSize(B, NULL, &columns));
    for (PetscInt j = 0; j < columns; j++) {
        Vec b, x;
        KSPConvergedReason reason;
        PetscCall(MatDenseGetColumnVecRead(B, j, &b));
        PetscCall(MatDenseGetColumnVecWrite(X, j, &x));
        PetscCall(KSPSolve(s->ksp, b, x));
        PetscCall(KSPGetConvergedReason(s->ksp, &reason));
        if (reason < 0) *converged = 0;
        PetscCall(MatDenseRestoreColumnVecWrite(X, j, &x));
        PetscCall(MatDenseRestoreColumnVecRead(B, j, &b));
    }
    PetscFunctionReturn(0);
}

// ---- The table ----

static const kind kinds[] = {
    [PLIANT_SOLVER_DIRECT] = {"direct", create_direct, solve_direct},
    [PLIANT_SOLVER_MULTIGRID] = {"multigrid", create_multigrid, solve_multigrid},
};

const char *pliant_fem_solver_name(pliant_solver_choice choice)
{
    return kinds[choice].name;
}

// Factors of solids' matrices under nested dissection grow like unknowns^(4/3).
static const double factor_entries = 10;
// Multigrid's hierarchy and vectors, as multiples of K.
static const double multigrid_matrices = 2.5;
// Of the memory available, so that there is room for columns.
static const double memory_part = 0.6;

pliant_fem_solver_plan pliant_fem_solver_choose(pliant_solver_choice asked, double unknowns,
                                                double nonzeros, double available)
{
    // MUMPS's fronts and stack beside the factors: half as much again.
    const double direct = 1.5 * sizeof(double) * factor_entries * pow(unknowns, 4.0 / 3);
    pliant_solver_choice chosen = asked;
    if (asked == PLIANT_SOLVER_AUTO)
        chosen = available > 0 && direct > memory_part * available ? PLIANT_SOLVER_MULTIGRID
                                                                   : PLIANT_SOLVER_DIRECT;
    return (pliant_fem_solver_plan){chosen, chosen == PLIANT_SOLVER_DIRECT
                                                ? direct
                                                : multigrid_matrices * nonzeros *
                                                      (sizeof(double) + sizeof(PetscInt))};
}

PetscErrorCode pliant_fem_solver_create(pliant_solver_choice choice, Mat K, Vec coordinates,
                                        pliant_fem_solver **solver, int *singular)
{
    PetscFunctionBegin;
    PetscCall(PetscNew(solver));
    (*solver)->kind = &kinds[choice];
    PetscCall(kinds[choice].create(*solver, K, coordinates, singular));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_fem_solver_solve(pliant_fem_solver *solver, Mat B, Mat X, int *converged)
{
    PetscFunctionBegin;
    PetscCall(solver->kind->solve(solver, B, X, converged));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_fem_solver_destroy(pliant_fem_solver **solver)
{
    PetscFunctionBegin;
    if (!*solver) PetscFunctionReturn(0);
    PetscCall(KSPDestroy(&(*solver)->ksp));
    PetscCall(MatDestroy(&(*solver)->factor));
    PetscCall(PetscFree(*solver));
    PetscFunctionReturn(0);
}
