// boundary_system.c: the boundary element method as a discretisation: bem/ and a dense system.
#include "boundary_system.h"

#include "bem/bem.h"
#include "dense_system.h"
#include "interruption.h"
#include "node_memory.h"
#include "refusal.h"
#include "right_hand.h"

#include "pliant/error.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// The backward error of sampled rows may be this large before it is an error: LU with partial
// pivoting stays near 1e-15 (measured on the sample and the evaluation meshes) unless the growth of
// its elements spoils it.
static const double residual_bound = 1e-10;

// A factorization shows no progress: above this many operations, ten seconds of a fast core, it is
// announced.
static const double long_factor_flops = 5e11;

// Rows are assembled a few vertices at a time, for the sake of progress.
static const int32_t assembly_step = 16;

// A row of the system kept from before the factorization, against which solutions are tested.
typedef struct sample_row {
    int32_t vertex;  // -1: this rank has none
    double *A;       // [3n][3]: three rows, column by column
    double *right;   // [3 columns][3]: the right-hand sides' rows
} sample_row;

typedef struct boundary_system {
    MPI_Comm comm;
    pliant_solver_groups groups;
    const pliant_problem *problem;
    const pliant_options *options;
    int32_t columns, batch;
    int32_t group_batch;  // the most columns of a batch that a group has
    pliant_dense_system *dense;
    sample_row sample;
    double worst;  // backward error of this rank's sampled rows and columns
} boundary_system;

// Of the memory available, for matrices and right-hand sides.
static const double memory_part = 0.9;

// Collective: one group a machine while every machine can hold a matrix of its own, since ScaLAPACK
// over a network is slow at what LAPACK does at full speed; else one for all.
static PetscErrorCode choose_groups(boundary_system *s)
{
    PetscFunctionBegin;
    if (s->options->groups > 0) {
        PetscCall(pliant_solver_groups_create(s->comm, s->options->groups, &s->groups));
        PetscFunctionReturn(0);
    }
    PetscCall(pliant_solver_groups_create_by_machine(s->comm, &s->groups));
    if (s->groups.count == 1) PetscFunctionReturn(0);
    pliant_dense_plan dense;
    PetscCall(pliant_dense_system_plan(s->groups.comm, s->problem->vertex_count, s->columns,
                                       s->batch, &dense));
    const double needed = dense.matrix_bytes + dense.right_hand_bytes + dense.batch_bytes;
    int fits = needed < memory_part * pliant_node_available(), all;
    PetscCallMPI(MPI_Allreduce(&fits, &all, 1, MPI_INT, MPI_MIN, s->comm));
    if (all) PetscFunctionReturn(0);
    PetscCall(pliant_solver_groups_destroy(&s->groups));
    PetscCall(pliant_solver_groups_create(s->comm, 1, &s->groups));
    PetscFunctionReturn(0);
}

static PetscErrorCode create(MPI_Comm comm, const pliant_problem *problem,
                             const pliant_options *options, int32_t batch,
                             pliant_progress *progress, void **system, pliant_error *err)
{
    PetscFunctionBegin;
    (void)progress;
    (void)err;
    boundary_system *s;
    PetscCall(PetscNew(&s));
    *s = (boundary_system){.comm = comm,
                           .problem = problem,
                           .options = options,
                           .columns = pliant_right_hand_count(problem, options->blocks),
                           .batch = batch};
    *system = s;
    PetscCall(choose_groups(s));
    s->group_batch = pliant_solver_groups_most(&s->groups, batch);
    PetscFunctionReturn(0);
}

static PetscErrorCode destroy(void **system)
{
    PetscFunctionBegin;
    boundary_system *s = *system;
    if (!s) PetscFunctionReturn(0);
    PetscCall(PetscFree(s->sample.right));
    PetscCall(PetscFree(s->sample.A));
    PetscCall(pliant_dense_system_destroy(&s->dense));
    PetscCall(pliant_solver_groups_destroy(&s->groups));
    PetscCall(PetscFree(*system));
    PetscFunctionReturn(0);
}

static PetscErrorCode plan(const void *system, pliant_solve_plan *out)
{
    PetscFunctionBegin;
    const boundary_system *s = system;
    pliant_dense_plan dense;
    PetscCall(pliant_dense_system_plan(s->groups.comm, s->problem->vertex_count, s->columns,
                                       s->group_batch, &dense));
    const double unknowns = 3.0 * s->problem->vertex_count;
    *out = (pliant_solve_plan){.solver = dense.kind,
                               .groups = s->groups.count,
                               .matrix_bytes = s->groups.count * dense.matrix_bytes,
                               .right_hand_bytes = s->groups.count * dense.right_hand_bytes,
                               .batch_bytes = s->groups.count * dense.batch_bytes,
                               .factor_flops =
                                   s->groups.count * 2 * unknowns * unknowns * unknowns / 3,
                               .solve_flops = 2 * unknowns * unknowns * 3 * s->columns};
    snprintf(out->system, sizeof out->system, "dense system of %.0f unknowns", unknowns);
    PetscFunctionReturn(0);
}

static const pliant_solver_groups *groups(const void *system)
{
    const boundary_system *s = system;
    return &s->groups;
}

static PetscErrorCode assemble(void *system, pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    boundary_system *s = system;
    const pliant_problem *p = s->problem;
    const pliant_blocks blocks = s->options->blocks;
    PetscCall(pliant_dense_system_create(s->groups.comm, p->vertex_count, s->columns,
                                         s->group_batch, &s->dense));
    const pliant_dense_rows rows = pliant_dense_system_rows(s->dense);
    const size_t unknowns = 3 * (size_t)p->vertex_count, ld = 3 * (size_t)assembly_step;
    double *B;
    PetscCall(PetscMalloc1(ld * unknowns, &B));
    pliant_bem *bem = NULL;
    pliant_status status = pliant_bem_create(p->multires->mesh, &s->options->material, &bem, err);
    pliant_progress_begin(progress, "assemble", rows.row_end - rows.row_begin);
    for (int32_t v = rows.row_begin; v < rows.row_end && status == PLIANT_OK; v += assembly_step) {
        if ((status = pliant_interruption_check(err)) < 0) break;
        const int32_t end = rows.row_end - v < assembly_step ? rows.row_end : v + assembly_step;
        const size_t at = 3 * (size_t)(v - rows.row_begin);
        status = pliant_bem_assemble(bem, v, end, p->held, rows.A + at, rows.ld_a, B, ld,
                                     rows.gravity + at, rows.ld_g, err);
        pliant_right_hand_contract(p, blocks, 3 * (end - v), B, ld, rows.right + at, rows.ld_right);
        pliant_progress_update(progress, end - rows.row_begin);
    }
    pliant_bem_destroy(bem);
    PetscCall(PetscFree(B));
    PliantCall(s->comm, status, err);

    // Keep one vertex's rows, against which the solutions will be tested.
    sample_row *sample = &s->sample;
    sample->vertex = rows.row_begin < rows.row_end ? (rows.row_begin + rows.row_end) / 2 : -1;
    PetscCall(PetscMalloc1(3 * unknowns, &sample->A));
    PetscCall(PetscMalloc1(9 * (size_t)s->columns, &sample->right));
    if (sample->vertex < 0) PetscFunctionReturn(0);
    const size_t at = 3 * (size_t)(sample->vertex - rows.row_begin);
    for (size_t u = 0; u < unknowns; u++)
        memcpy(sample->A + 3 * u, rows.A + u * rows.ld_a + at, 3 * sizeof(double));
    for (size_t j = 0; j < 3 * (size_t)s->columns; j++)
        memcpy(sample->right + 3 * j, rows.right + j * rows.ld_right + at, 3 * sizeof(double));
    PetscFunctionReturn(0);
}

static PetscErrorCode factor(void *system, pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    boundary_system *s = system;
    pliant_solve_plan planned;
    PetscCall(plan(s, &planned));
    if (planned.factor_flops > long_factor_flops) {
        double seconds;
        char about[64] = "";
        PetscCall(pliant_dense_system_estimate(s->dense, &seconds));
        if (seconds > 0) snprintf(about, sizeof about, ", about %.0f s", seconds);
        pliant_progress_note(progress,
                             "factor: %.2g TFLOP in one piece%s; the solves will take %.1f times that",
                             planned.factor_flops / 1e12, about,
                             planned.solve_flops / planned.factor_flops);
    }
    pliant_progress_begin(progress, "factor", 0);
    int singular;
    PetscCall(pliant_dense_system_factor(s->dense, &singular));
    PetscCall(pliant_node_wait(s->comm));
    pliant_status status = PLIANT_OK;
    if (singular)
        status = pliant_error_set(
            err, PLIANT_ERR_SINGULAR,
            "%s: the boundary element system is singular: hold more of the surface",
            s->options->mesh);
    PliantCall(s->comm, status, err);
    PetscFunctionReturn(0);
}

// Test a solved column against the kept rows: the backward error |A_s x - b_s| / (|A_s| |x| +
// |b_s|), with absolute values taken entry by entry, which scaling columns does not change; the
// largest.
static double sample_residual(const sample_row *sample, int32_t n, int32_t column,
                              const double *columns, size_t ld)
{
    double worst = 0;
    for (size_t j = 0; sample->vertex >= 0 && j < 3; j++) {
        const double *x = columns + j * ld, *b = sample->right + 3 * (3 * (size_t)column + j);
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

static PetscErrorCode solve(void *system, int32_t first, int32_t count, pliant_column_share *share,
                            pliant_error *err)
{
    PetscFunctionBegin;
    (void)err;
    boundary_system *s = system;
    int32_t begin, end;
    pliant_solver_groups_part(&s->groups, count, s->groups.index, &begin, &end);
    *share = (pliant_column_share){.begin = begin, .end = begin};
    if (begin == end) PetscFunctionReturn(0);
    PetscCall(pliant_dense_system_solve(s->dense, first + begin, end - begin, share));
    share->begin += begin;
    share->end += begin;
    // One column of every batch is enough to notice a bad factorization.
    if (share->end > share->begin)
        s->worst = fmax(s->worst, sample_residual(&s->sample, s->problem->vertex_count,
                                                  first + share->begin, share->columns, share->ld));
    PetscFunctionReturn(0);
}

static PetscErrorCode solve_gravity(void *system, pliant_column_share *share, pliant_error *err)
{
    PetscFunctionBegin;
    (void)err;
    boundary_system *s = system;
    // The first group's alone.
    *share = (pliant_column_share){0};
    if (s->groups.index == 0) PetscCall(pliant_dense_system_solve_gravity(s->dense, share));
    PetscFunctionReturn(0);
}

static PetscErrorCode residual(const void *system, double *worst, double *bound)
{
    PetscFunctionBegin;
    const boundary_system *s = system;
    PetscCallMPI(MPI_Allreduce(&s->worst, worst, 1, MPI_DOUBLE, MPI_MAX, s->comm));
    *bound = residual_bound;
    PetscFunctionReturn(0);
}

const pliant_discretisation pliant_boundary_system = {
    .name = "bem",
    .create = create,
    .plan = plan,
    .groups = groups,
    .assemble = assemble,
    .factor = factor,
    .solve = solve,
    .solve_gravity = solve_gravity,
    .residual = residual,
    .destroy = destroy,
};
