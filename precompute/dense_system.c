// dense_system.c: the distributed dense linear system of the boundary element method, A v = B vbar.
#include "dense_system.h"

#include "node_memory.h"

#include <petscmat.h>
#include <string.h>

// LAPACK's and PETSc's 32-bit sizes: rows * rows must stay under 2^31.
static const PetscInt largest_sequential = 46340;

typedef enum dense_kind { NODE, SCALAPACK } dense_kind;

struct pliant_dense_system {
    MPI_Comm comm;
    PetscMPIInt rank, size;
    dense_kind kind;
    int32_t n, columns, batch;
    int32_t row_begin, row_end;  // vertices
    Mat A;                       // factored in place; node: the first rank's only
    double *right_sides, *gravity;  // this rank's rows, leading dimension 3 (row_end - row_begin)
    pliant_node_memory matrix, right, solution;  // node: shared by all ranks
    double *received, *whole;    // scalapack: columns as they arrive, and whole
};

// A batch needs no more room than there are columns; gravity is one.
static int32_t at_once(int32_t columns, int32_t batch)
{
    return columns < 1 ? 1 : columns < batch ? columns : batch;
}

// Collective.
static PetscErrorCode choose_kind(MPI_Comm comm, int32_t n, dense_kind *kind)
{
    PetscFunctionBegin;
    PetscMPIInt size, node_size;
    PetscCallMPI(MPI_Comm_size(comm, &size));
    PetscCall(pliant_node_size(comm, &node_size));
    int together = node_size == size, everyone;
    PetscCallMPI(MPI_Allreduce(&together, &everyone, 1, MPI_INT, MPI_MIN, comm));
    *kind = everyone && 3 * (int64_t)n <= largest_sequential ? NODE : SCALAPACK;

    static const char *const names[] = {"node", "scalapack"};
    PetscInt chosen = *kind;
    PetscBool set;
    PetscCall(PetscOptionsGetEList(NULL, NULL, "-pliant_dense", names, 2, &chosen, &set));
    if (set) *kind = (dense_kind)chosen;
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_system_plan(MPI_Comm comm, int32_t n, int32_t columns, int32_t batch,
                                        pliant_dense_plan *plan)
{
    PetscFunctionBegin;
    dense_kind kind;
    PetscCall(choose_kind(comm, n, &kind));
    batch = at_once(columns, batch);
    const double rows = 3.0 * n, matrix = rows * rows * sizeof(double);
    const double column = rows * 3 * sizeof(double);
    *plan = (pliant_dense_plan){.kind = kind == NODE ? "node" : "scalapack",
                                // ScaLAPACK's block-cyclic copy stands beside the rows once.
                                .matrix_bytes = kind == NODE ? matrix : 2 * matrix,
                                .right_hand_bytes = column * columns,
                                .batch_bytes = (kind == NODE ? 2 : 6) * column * batch};
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_system_create(MPI_Comm comm, int32_t n, int32_t columns, int32_t batch,
                                          pliant_dense_system **system)
{
    PetscFunctionBegin;
    pliant_dense_system *s;
    PetscCall(PetscNew(&s));
    s->comm = comm;
    s->n = n;
    s->columns = columns;
    s->batch = at_once(columns, batch);
    s->matrix.file = s->right.file = s->solution.file = -1;
    PetscCallMPI(MPI_Comm_rank(comm, &s->rank));
    PetscCallMPI(MPI_Comm_size(comm, &s->size));
    s->row_begin = pliant_column_split(n, s->rank, s->size);
    s->row_end = pliant_column_split(n, s->rank + 1, s->size);
    PetscCall(choose_kind(comm, n, &s->kind));

    const size_t rows = 3 * (size_t)n, own_rows = 3 * (size_t)(s->row_end - s->row_begin);
    const size_t columns_at_once = 3 * (size_t)s->batch;
    if (s->kind == NODE) {
        int a, r, x;
        PetscCall(pliant_node_memory_create(comm, rows * rows * sizeof(double), &s->matrix, &a));
        PetscCall(pliant_node_memory_create(comm, rows * columns_at_once * sizeof(double), &s->right, &r));
        PetscCall(pliant_node_memory_create(comm, rows * columns_at_once * sizeof(double), &s->solution, &x));
        if (!a || !r || !x) {
            // No shared memory between these ranks (a locked-down container, say): go without.
            pliant_node_memory_destroy(&s->matrix);
            pliant_node_memory_destroy(&s->right);
            pliant_node_memory_destroy(&s->solution);
            s->kind = SCALAPACK;
        }
    }
    if (s->kind == NODE) {
        PetscCall(pliant_node_widen(comm, s->rank == 0));
    } else {
        PetscCall(MatCreateDense(comm, (PetscInt)own_rows, (PetscInt)own_rows, (PetscInt)rows,
                                 (PetscInt)rows, NULL, &s->A));
        PetscCall(PetscMalloc1(rows * (columns_at_once / s->size + 3), &s->received));
        PetscCall(PetscMalloc1(rows * (columns_at_once / s->size + 3), &s->whole));
    }
    PetscCall(PetscCalloc1(own_rows * 3 * (size_t)columns, &s->right_sides));
    PetscCall(PetscCalloc1(own_rows * 3, &s->gravity));
    *system = s;
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_system_destroy(pliant_dense_system **system)
{
    PetscFunctionBegin;
    pliant_dense_system *s = *system;
    if (!s) PetscFunctionReturn(0);
    PetscCall(PetscFree(s->whole));
    PetscCall(PetscFree(s->received));
    PetscCall(PetscFree(s->gravity));
    PetscCall(PetscFree(s->right_sides));
    PetscCall(MatDestroy(&s->A));
    pliant_node_memory_destroy(&s->solution);
    pliant_node_memory_destroy(&s->right);
    pliant_node_memory_destroy(&s->matrix);
    PetscCall(PetscFree(*system));
    PetscFunctionReturn(0);
}

pliant_dense_rows pliant_dense_system_rows(const pliant_dense_system *s)
{
    const size_t own_rows = 3 * (size_t)(s->row_end - s->row_begin);
    pliant_dense_rows rows = {.row_begin = s->row_begin, .row_end = s->row_end, .right = s->right_sides,
                              .gravity = s->gravity, .ld_right = own_rows, .ld_g = own_rows};
    if (s->kind == NODE) {
        rows.A = s->matrix.values + 3 * (size_t)s->row_begin;
        rows.ld_a = 3 * (size_t)s->n;
    } else {
        // The array outlives the get/restore pair: MATDENSE keeps its storage until it is destroyed.
        if (MatDenseGetArrayWrite(s->A, &rows.A) == 0) {
            double *a = rows.A;
            (void)MatDenseRestoreArrayWrite(s->A, &a);
        }
        rows.ld_a = own_rows;
    }
    return rows;
}

PetscErrorCode pliant_dense_system_estimate(const pliant_dense_system *s, double *seconds)
{
    PetscFunctionBegin;
    *seconds = 0;
    // Operations grow with the cube.
    static const PetscInt part = 8;
    const PetscInt rows = 3 * s->n / part;
    if (s->kind == SCALAPACK || rows == 0) PetscFunctionReturn(0);
    // The first one wakes the threads and touches the memory.
    for (int trial = 0; s->rank == 0 && trial < 2; trial++) {
        Mat small;
        double *a;
        PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, rows, rows, NULL, &small));
        PetscCall(MatDenseGetArrayWrite(small, &a));
        // Any numbers without a small pivot.
        for (PetscInt j = 0; j < rows; j++)
            for (PetscInt i = 0; i < rows; i++)
                a[(size_t)j * (size_t)rows + (size_t)i] = i == j ? (double)rows : (double)((7 * i + 13 * j) % 11) / 11;
        PetscCall(MatDenseRestoreArrayWrite(small, &a));
        pliant_node_threads(s->size);
        const double begin = MPI_Wtime();
        PetscCall(MatLUFactor(small, NULL, NULL, NULL));
        *seconds = (MPI_Wtime() - begin) * part * part * part;
        pliant_node_threads(1);
        PetscCall(MatDestroy(&small));
    }
    PetscCall(pliant_node_wait(s->comm));
    PetscCallMPI(MPI_Bcast(seconds, 1, MPI_DOUBLE, 0, s->comm));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_system_factor(pliant_dense_system *s, int *singular)
{
    PetscFunctionBegin;
    *singular = 0;
    const PetscInt rows = 3 * s->n;
    if (s->kind == NODE) {
        PetscCall(pliant_node_wait(s->comm));
        if (s->rank == 0) {
            pliant_node_threads(s->size);
            PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, rows, rows, s->matrix.values, &s->A));
            // A vanished pivot is an error to PETSc; to us it is an answer.
            PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
            const PetscErrorCode code = MatLUFactor(s->A, NULL, NULL, NULL);
            PetscCall(PetscPopErrorHandler());
            PetscCheck(code == 0 || code == PETSC_ERR_MAT_LU_ZRPVT, PETSC_COMM_SELF, code,
                       "LU factorization failed");
            *singular = code != 0;
            pliant_node_threads(1);
        }
        PetscCall(pliant_node_wait(s->comm));
    } else {
        PetscCall(MatAssemblyBegin(s->A, MAT_FINAL_ASSEMBLY));
        PetscCall(MatAssemblyEnd(s->A, MAT_FINAL_ASSEMBLY));
        PetscCall(MatConvert(s->A, MATSCALAPACK, MAT_INPLACE_MATRIX, &s->A));
        PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
        const PetscErrorCode code = MatLUFactor(s->A, NULL, NULL, NULL);
        PetscCall(PetscPopErrorHandler());
        *singular = code != 0;
    }
    PetscCallMPI(MPI_Bcast(singular, 1, MPI_INT, 0, s->comm));
    PetscFunctionReturn(0);
}

// This rank's rows of right-hand sides, into `right` with leading dimension ld.
static void place_right(const pliant_dense_system *s, const double *source, int32_t count,
                        double *right, size_t ld)
{
    const size_t own_rows = 3 * (size_t)(s->row_end - s->row_begin);
    for (size_t j = 0; j < 3 * (size_t)count; j++)
        memcpy(right + j * ld, source + j * own_rows, own_rows * sizeof *right);
}

static PetscErrorCode solve_on_node(pliant_dense_system *s, const double *source, int32_t count)
{
    PetscFunctionBegin;
    const size_t rows = 3 * (size_t)s->n;
    place_right(s, source, count, s->right.values + 3 * (size_t)s->row_begin, rows);
    PetscCall(pliant_node_wait(s->comm));
    if (s->rank == 0) {
        Mat R, X;
        pliant_node_threads(s->size);
        PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, (PetscInt)rows, 3 * count, s->right.values, &R));
        PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, (PetscInt)rows, 3 * count, s->solution.values, &X));
        PetscCall(MatMatSolve(s->A, R, X));
        PetscCall(MatDestroy(&X));
        PetscCall(MatDestroy(&R));
        pliant_node_threads(1);
    }
    PetscCall(pliant_node_wait(s->comm));
    PetscFunctionReturn(0);
}

static PetscErrorCode solve_by_scalapack(pliant_dense_system *s, const double *source, int32_t count)
{
    PetscFunctionBegin;
    const PetscInt rows = 3 * s->n;
    const size_t own_rows = 3 * (size_t)(s->row_end - s->row_begin);
    Mat R, X;
    double *right;
    PetscCall(MatCreateDense(s->comm, (PetscInt)own_rows, PETSC_DECIDE, rows, 3 * count, NULL, &R));
    PetscCall(MatDenseGetArrayWrite(R, &right));
    place_right(s, source, count, right, own_rows);
    PetscCall(MatDenseRestoreArrayWrite(R, &right));
    PetscCall(MatAssemblyBegin(R, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(R, MAT_FINAL_ASSEMBLY));
    PetscCall(MatConvert(R, MATSCALAPACK, MAT_INPLACE_MATRIX, &R));
    PetscCall(MatDuplicate(R, MAT_DO_NOT_COPY_VALUES, &X));
    PetscCall(MatMatSolve(s->A, R, X));
    PetscCall(MatDestroy(&R));
    PetscCall(MatConvert(X, MATDENSE, MAT_INPLACE_MATRIX, &X));

    // Columns of one owner lie together in the rows' local storage: send them as they are.
    PetscMPIInt *counts;
    PetscInt local_rows;
    PetscCall(MatGetLocalSize(X, &local_rows, NULL));
    PetscCall(PetscMalloc1(4 * (size_t)s->size, &counts));
    PetscMPIInt *send = counts, *send_at = send + s->size, *receive = send_at + s->size,
                *receive_at = receive + s->size;
    const int32_t own = pliant_column_split(count, s->rank + 1, s->size) - pliant_column_split(count, s->rank, s->size);
    PetscMPIInt *all_rows;
    PetscCall(PetscMalloc1(s->size, &all_rows));
    PetscMPIInt mine = (PetscMPIInt)local_rows;
    PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, all_rows, 1, MPI_INT, s->comm));
    for (int r = 0, out = 0, in = 0; r < s->size; r++) {
        send[r] = mine * 3 * (pliant_column_split(count, r + 1, s->size) - pliant_column_split(count, r, s->size));
        receive[r] = all_rows[r] * 3 * own;
        send_at[r] = out, receive_at[r] = in;
        out += send[r], in += receive[r];
    }
    const double *solution;
    PetscCall(MatDenseGetArrayRead(X, &solution));
    PetscCallMPI(MPI_Alltoallv(solution, send, send_at, MPI_DOUBLE, s->received, receive, receive_at,
                               MPI_DOUBLE, s->comm));
    PetscCall(MatDenseRestoreArrayRead(X, &solution));
    for (int r = 0, row = 0; r < s->size; row += all_rows[r], r++)
        for (int32_t c = 0; c < 3 * own; c++)
            memcpy(s->whole + (size_t)c * rows + row,
                   s->received + receive_at[r] + (size_t)c * all_rows[r],
                   (size_t)all_rows[r] * sizeof(double));
    PetscCall(PetscFree(all_rows));
    PetscCall(PetscFree(counts));
    PetscCall(MatDestroy(&X));
    PetscFunctionReturn(0);
}

// Collective: `source` is this rank's rows of three right-hand sides for each of `count` columns.
static PetscErrorCode solve(pliant_dense_system *s, const double *source, int32_t count,
                            pliant_column_share *share)
{
    PetscFunctionBegin;
    share->begin = pliant_column_split(count, s->rank, s->size);
    share->end = pliant_column_split(count, s->rank + 1, s->size);
    share->ld = 3 * (size_t)s->n;
    if (s->kind == NODE) {
        PetscCall(solve_on_node(s, source, count));
        share->columns = s->solution.values + 3 * (size_t)share->begin * share->ld;
    } else {
        PetscCall(solve_by_scalapack(s, source, count));
        share->columns = s->whole;
    }
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_system_solve(pliant_dense_system *s, int32_t first, int32_t count,
                                         pliant_column_share *share)
{
    PetscFunctionBegin;
    PetscCheck(count <= s->batch, s->comm, PETSC_ERR_ARG_SIZ, "batch of %d columns, room for %d",
               count, s->batch);
    PetscCheck(first >= 0 && first + count <= s->columns, s->comm, PETSC_ERR_ARG_OUTOFRANGE,
               "columns %d to %d of %d", first, first + count - 1, s->columns);
    PetscCall(solve(s, s->right_sides + 9 * (size_t)(s->row_end - s->row_begin) * (size_t)first, count, share));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_dense_system_solve_gravity(pliant_dense_system *s, pliant_column_share *share)
{
    PetscFunctionBegin;
    PetscCall(solve(s, s->gravity, 1, share));
    PetscFunctionReturn(0);
}
