// solver.c: K X = B for blocks of right-hand sides: rows of a table of two.
//
// This follows: Y. Chen, T. A. Davis, W. W. Hager, S. Rajamanickam, Algorithm 887: CHOLMOD,
// supernodal sparse Cholesky factorization and update/downdate, ACM Trans. Math. Softw. 35(3),
// 2008; P. R. Amestoy, I. S. Duff, J.-Y. L'Excellent, J. Koster, A fully asynchronous multifrontal
// solver using distributed dynamic scheduling, SIAM J. Matrix Anal. Appl. 23, 2001 (MUMPS); P.
// Vanek, J. Mandel, M. Brezina, Algebraic multigrid by smoothed aggregation for second and fourth
// order elliptic problems, Computing 56, 1996.
#include "fem/solver.h"

#include <math.h>
#include <petscksp.h>

struct pliant_fem_solver {
    const struct kind *kind;
    Mat factor;    // direct
    double flops;  // of this rank for a right-hand side, where PETSc does not count them
    KSP ksp;       // multigrid
};

typedef struct kind {
    const char *name;
    PetscErrorCode (*create)(pliant_fem_solver *, Mat, Vec, int *);
    PetscErrorCode (*solve)(pliant_fem_solver *, Mat, Mat, int *);
} kind;

// ---- Direct ----

// Measured in milliseconds a right-hand side, quadratic tetrahedra, one core:
//
//   unknowns  right-hand sides at once:  12     24     48     96    192
//   340179    CHOLMOD                    62     44     35     40     54
//             MUMPS                                                  54
//   65163     CHOLMOD                                                 6
//             MUMPS                                                   5
//
// CHOLMOD orders by METIS, which Debian's MUMPS cannot: 304 million factor entries instead of 340,
// and at 235035 unknowns of linear tetrahedra 151 instead of 173. It works on one rank alone.
enum { CHOLMOD_BLOCK = 48, MUMPS_BLOCK = 192 };

static PetscErrorCode factor_by_cholmod(pliant_fem_solver *s, Mat K, int *singular)
{
    PetscFunctionBegin;
    MatFactorInfo info;
    PetscCall(MatFactorInfoInitialize(&info));
    PetscCall(MatGetFactor(K, MATSOLVERCHOLMOD, MAT_FACTOR_CHOLESKY, &s->factor));
    PetscCall(MatCholeskyFactorSymbolic(s->factor, K, NULL, &info));
    // No factorization is an error to PETSc; to us it is an answer.
    PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
    const PetscErrorCode code = MatCholeskyFactorNumeric(s->factor, K, &info);
    PetscCall(PetscPopErrorHandler());
    *singular = code != 0;
    PetscFunctionReturn(0);
}

static PetscErrorCode factor_by_mumps(pliant_fem_solver *s, Mat K, int *singular)
{
    PetscFunctionBegin;
    MatFactorInfo info;
    MatFactorError error;
    PetscCall(MatFactorInfoInitialize(&info));
    PetscCall(MatGetFactor(K, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, &s->factor));
    PetscCall(MatMumpsSetIcntl(s->factor, 27, MUMPS_BLOCK));
    PetscCall(MatCholeskyFactorSymbolic(s->factor, K, NULL, &info));
    PetscCall(MatCholeskyFactorNumeric(s->factor, K, &info));
    // MUMPS's failures are silent unless asked for.
    PetscCall(MatFactorGetError(s->factor, &error));
    *singular = error != MAT_FACTOR_NOERROR;
    if (*singular) PetscFunctionReturn(0);
    // Nor does it count for PETSc. INFOG(29) is in millions when it is negative.
    PetscMPIInt size;
    PetscReal flops;
    PetscInt entries;
    PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)K), &size));
    PetscCall(MatMumpsGetRinfog(s->factor, 3, &flops));
    PetscCall(MatMumpsGetInfog(s->factor, 29, &entries));
    PetscCall(PetscLogFlops(flops / size));
    s->flops = 4 * (entries < 0 ? -1e6 * entries : (double)entries) / size;
    PetscFunctionReturn(0);
}

static PetscErrorCode create_direct(pliant_fem_solver *s, Mat K, Vec coordinates, int *singular)
{
    PetscFunctionBegin;
    (void)coordinates;
    PetscMPIInt size;
    PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)K), &size));
    if (size == 1) PetscCall(factor_by_cholmod(s, K, singular));
    else PetscCall(factor_by_mumps(s, K, singular));
    PetscFunctionReturn(0);
}

static PetscErrorCode solve_direct(pliant_fem_solver *s, Mat B, Mat X, int *converged)
{
    PetscFunctionBegin;
    PetscInt columns;
    *converged = 1;
    PetscCall(MatGetSize(B, NULL, &columns));
    PetscCall(MatMatSolve(s->factor, B, X));
    PetscCall(PetscLogFlops(s->flops * columns));
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

int32_t pliant_fem_solver_block(pliant_solver_choice choice, int ranks)
{
    return choice == PLIANT_SOLVER_DIRECT && ranks == 1 ? CHOLMOD_BLOCK : MUMPS_BLOCK;
}

// Entries of factors by order of the elements, as multiples of unknowns^1.4: measured on tetrahedra
// that grow inwards, 65163 to 340179 unknowns of quadratic ones (30 and 304 million), 235035 of
// linear ones (151 million). 4/3 is the power for uniform solids.
static const double factor_entries[] = {[1] = 4.6, [2] = 5.5}, factor_power = 1.4;
// Besides the factors: CHOLMOD's fronts and its copy of the matrix.
static const double factor_overhead = 1.25;
// Multigrid's hierarchy and vectors, as multiples of K.
static const double multigrid_matrices = 2.5;
// Of the memory available, so that there is room for columns.
static const double memory_part = 0.6;

pliant_fem_solver_plan pliant_fem_solver_choose(pliant_solver_choice asked, int order,
                                                double unknowns, double nonzeros, double available)
{
    const double direct =
        factor_overhead * sizeof(double) * factor_entries[order] * pow(unknowns, factor_power);
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
