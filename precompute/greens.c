// greens.c: the Green's functions: columns of Xi solved batch by batch and compressed on the way.
//
// Each batch of columns is solved together and split over the ranks, so that every rank transforms
// whole columns. Xi as a whole never exists.
#include "greens.h"

#include "interruption.h"
#include "refinement.h"
#include "refusal.h"
#include "right_hand.h"

#include "pliant/compliance.h"
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
    // PETSC_OPTIONS="-pliant_batch N" overrules.
    PetscInt chosen = (PetscInt)(batch < least_batch     ? least_batch
                                 : batch > largest_batch ? largest_batch
                                                         : batch);
    (void)PetscOptionsGetInt(NULL, NULL, "-pliant_batch", &chosen, NULL);
    return chosen < 1 ? 1 : chosen > INT16_MAX ? INT16_MAX : (int32_t)chosen;
}

void pliant_greens_share(const pliant_greens *greens, int32_t column_count, int32_t first, int rank,
                         int32_t *begin, int32_t *end)
{
    const int32_t left = column_count - first;
    pliant_solver_groups_share(&greens->groups, left < greens->batch ? left : greens->batch, rank,
                               begin, end);
    *begin += first;
    *end += first;
}

int pliant_greens_free_rows(pliant_block_name block)
{
    return block == PLIANT_FREE_FREE || block == PLIANT_FREE_FIXED;
}

int pliant_greens_free_columns(pliant_block_name block)
{
    return block == PLIANT_FREE_FREE || block == PLIANT_FIXED_FREE;
}

int32_t pliant_greens_column_count(const pliant_problem *p, pliant_block_name block, int32_t level)
{
    return (pliant_greens_free_columns(block) ? p->free_hats : p->fixed_hats)->level_offset[level + 1];
}

static pliant_compression_use use_of(const pliant_problem *p, int32_t level)
{
    return level > p->levels.first ? PLIANT_COMPRESSION_REFINED : PLIANT_COMPRESSION_ALONE;
}

// A compressor for one level. Coarser levels are refined from its spool.
static pliant_status create_level(pliant_greens *g, pliant_block_name block, int32_t level, pliant_error *err)
{
    const pliant_problem *p = g->problem;
    const pliant_wavelet *wavelet =
        pliant_greens_free_rows(block) ? p->free_wavelet : p->fixed_wavelet;
    const pliant_compression_use use = use_of(p, level);
    int needs[2];
    if (g->partial && level == p->levels.last) {
        const int32_t streams[2] = {2 * block, 2 * block + 1};
        return pliant_compression_create_in(wavelet, &g->compression, use,
                                            pliant_partial_file(g->partial), streams,
                                            &g->blocks[block][level], err);
    }
    pliant_compression_streams(&g->compression, use, needs);
    return pliant_compression_create(wavelet, &g->compression, needs[0] ? g->folder : NULL,
                                     &g->blocks[block][level], err);
}

void pliant_greens_streams(const pliant_problem *problem, const pliant_options *options,
                           int32_t domain[PLIANT_PARTIAL_STREAMS])
{
    int used[2];
    pliant_compression_streams(&options->compression, use_of(problem, problem->levels.last), used);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int k = 0; k < 2; k++) {
            const int is_asked = b == PLIANT_FREE_FREE || options->blocks == PLIANT_BLOCKS_ALL;
            const int is_free = pliant_greens_free_columns((pliant_block_name)b);
            domain[2 * b + k] = !is_asked || !used[k] ? -1
                                : is_free             ? PLIANT_COLUMNS_FREE
                                                      : PLIANT_COLUMNS_FIXED;
        }
}

// This rank's columns of a block from what an earlier run has left, in the order of solving.
static pliant_status restore_block(pliant_greens *g, pliant_block_name block, pliant_error *err)
{
    const int32_t level = g->problem->levels.last;
    const pliant_column_domain domain =
        pliant_greens_free_columns(block) ? PLIANT_COLUMNS_FREE : PLIANT_COLUMNS_FIXED;
    const int32_t count = pliant_greens_column_count(g->problem, block, level);
    const int32_t done = pliant_partial_done(g->partial, domain);
    for (int32_t first = 0; first < done; first += g->batch) {
        int32_t begin, end;
        pliant_greens_share(g, count, first, g->groups.world_rank, &begin, &end);
        for (int32_t column = begin; column < end; column++) {
            pliant_spooled spooled, kept;
            const int is_spooled = pliant_partial_find(g->partial, 2 * block, column, &spooled);
            const int is_kept = pliant_partial_find(g->partial, 2 * block + 1, column, &kept);
            const pliant_status status = pliant_compression_restore(
                g->blocks[block][level], is_spooled ? &spooled : NULL, is_kept ? &kept : NULL, err);
            if (status < 0) return status;
        }
    }
    return PLIANT_OK;
}

// Collective.
static PetscErrorCode restore(pliant_greens *g, pliant_error *err)
{
    PetscFunctionBegin;
    g->residual = pliant_partial_residual(g->partial);
    pliant_status status = PLIANT_OK;
    for (int b = 0; b < PLIANT_BLOCK_COUNT && status == PLIANT_OK; b++)
        if (g->blocks[b][g->problem->levels.last])
            status = restore_block(g, (pliant_block_name)b, err);
    PliantCall(g->comm, status, err);

    const size_t free_size = 9 * (size_t)g->problem->free_count,
                 fixed_size = 9 * (size_t)g->problem->fixed_count;
    float *gravity;
    PetscCall(PetscMalloc1(free_size + fixed_size, &gravity));
    g->has_gravity = pliant_partial_gravity(g->partial, gravity, free_size + fixed_size);
    if (g->has_gravity) {
        memcpy(g->gravity_free, gravity, free_size * sizeof *gravity);
        memcpy(g->gravity_fixed, gravity + free_size, fixed_size * sizeof *gravity);
    }
    PetscCall(PetscFree(gravity));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_greens_create(const pliant_solver_groups *groups,
                                    const pliant_problem *problem, const pliant_options *options,
                                    const char *folder,
                                    pliant_partial *partial, pliant_greens **greens,
                                    pliant_error *err)
{
    PetscFunctionBegin;
    pliant_greens *g;
    PetscCall(PetscNew(&g));
    *greens = g;
    const MPI_Comm comm = groups->world;
    g->comm = comm;
    PetscCall(pliant_solver_groups_duplicate(groups, &g->groups));
    g->problem = problem;
    g->compression = options->compression;
    g->folder = folder;
    g->partial = partial;
    if (partial) PetscCall(pliant_partial_begin(partial, err));
    g->batch = pliant_greens_batch(comm);
    pliant_status status = PLIANT_OK;
    for (int b = 0; b < PLIANT_BLOCK_COUNT && status == PLIANT_OK; b++)
        if (b == PLIANT_FREE_FREE || options->blocks == PLIANT_BLOCKS_ALL)
            status = create_level(g, (pliant_block_name)b, problem->levels.last, err);
    g->gravity_free = calloc((size_t)problem->free_count * 9 + 1, sizeof *g->gravity_free);
    g->gravity_fixed = calloc((size_t)problem->fixed_count * 9 + 1, sizeof *g->gravity_fixed);
    if (status == PLIANT_OK && (!g->gravity_free || !g->gravity_fixed))
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the gravity columns");
    PliantCall(comm, status, err);
    if (partial) PetscCall(restore(g, err));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_greens_destroy(pliant_greens **greens)
{
    PetscFunctionBegin;
    pliant_greens *g = *greens;
    if (!g) PetscFunctionReturn(0);
    free(g->gravity_fixed);
    free(g->gravity_free);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int32_t l = 0; l <= PLIANT_LEVEL_LIMIT; l++) pliant_compression_destroy(g->blocks[b][l]);
    PetscCall(pliant_solver_groups_destroy(&g->groups));
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
    const int32_t level = p->levels.last;
    pliant_compression *free_rows = g->blocks[fixed_columns ? PLIANT_FREE_FIXED : PLIANT_FREE_FREE][level];
    pliant_compression *fixed_rows = g->blocks[fixed_columns ? PLIANT_FIXED_FIXED : PLIANT_FIXED_FREE][level];
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

// Columns of one domain, which are those from `before` on of the system's.
static PetscErrorCode solve_domain(pliant_greens *g, const pliant_discretisation *method, void *system,
                                   int fixed_columns, int32_t before, pliant_dense_output *dense,
                                   pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_problem *p = g->problem;
    const pliant_hats *hats = fixed_columns ? p->fixed_hats : p->free_hats;
    const int32_t columns = hats->level_offset[p->levels.last + 1];
    const pliant_column_domain domain = fixed_columns ? PLIANT_COLUMNS_FIXED : PLIANT_COLUMNS_FREE;
    for (int32_t first = g->partial ? pliant_partial_done(g->partial, domain) : 0; first < columns;
         first += g->batch) {
        const int32_t count = columns - first < g->batch ? columns - first : g->batch;
        pliant_column_share share;
        const double begin = pliant_progress_clock();
        PetscCall(method->solve(system, before + first, count, &share, err));
        const double solved = pliant_progress_clock();
        g->solve_seconds += solved - begin;

        double worst, bound;
        PetscCall(method->residual(system, &worst, &bound));
        g->residual = fmax(g->residual, worst);

        const int32_t mine = share.end - share.begin, position = first + share.begin;
        PliantCall(g->comm, compress(g, fixed_columns, position, mine, share.columns, share.ld, err), err);
        if (dense)
            PetscCall(pliant_dense_output_add(
                dense, fixed_columns ? PLIANT_DENSE_FIXED : PLIANT_DENSE_FREE, position, mine,
                share.columns, share.ld, err));
        if (g->partial)
            PetscCall(pliant_partial_advance(g->partial, domain, first + count, g->residual, err));
        else PliantCall(g->comm, pliant_interruption_check(err), err);
        g->transform_seconds += pliant_progress_clock() - solved;
        pliant_progress_update(progress, before + first + count);
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
static PetscErrorCode solve_gravity(pliant_greens *g, const pliant_discretisation *method, void *system,
                                    pliant_dense_output *dense, pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_problem *p = g->problem;
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(g->comm, &rank));
    PetscCallMPI(MPI_Comm_size(g->comm, &size));
    pliant_column_share share;
    PetscCall(method->solve_gravity(system, &share, err));
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
        PetscCall(pliant_dense_output_add(dense, PLIANT_DENSE_GRAVITY, 0, mine, share.columns,
                                          share.ld, err));
    if (g->partial) {
        const size_t free_size = 9 * (size_t)p->free_count, fixed_size = 9 * (size_t)p->fixed_count;
        float *gravity;
        PetscCall(PetscMalloc1(free_size + fixed_size, &gravity));
        memcpy(gravity, g->gravity_free, free_size * sizeof *gravity);
        memcpy(gravity + free_size, g->gravity_fixed, fixed_size * sizeof *gravity);
        PetscCall(pliant_partial_store_gravity(g->partial, gravity, free_size + fixed_size, err));
        PetscCall(PetscFree(gravity));
    }
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_greens_solve(pliant_greens *g, const pliant_discretisation *method, void *system,
                                   pliant_dense_output *dense, pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    const int32_t level = g->problem->levels.last;
    const int all = g->blocks[PLIANT_FIXED_FIXED][level] != NULL;
    const int32_t free_columns = g->problem->free_hats->level_offset[level + 1];
    int32_t done = 0;
    for (int d = 0; g->partial && d < PLIANT_COLUMN_DOMAINS; d++)
        done += pliant_partial_done(g->partial, (pliant_column_domain)d);
    pliant_progress_begin_at(
        progress, "solve", done,
        pliant_right_hand_count(g->problem, all ? PLIANT_BLOCKS_ALL : PLIANT_BLOCKS_FREE));
    PetscCall(solve_domain(g, method, system, 0, 0, dense, progress, err));
    if (all) PetscCall(solve_domain(g, method, system, 1, free_columns, dense, progress, err));
    if (!g->has_gravity) PetscCall(solve_gravity(g, method, system, dense, err));
    double worst;
    PetscCallMPI(MPI_Allreduce(&g->residual, &worst, 1, MPI_DOUBLE, MPI_MAX, g->comm));
    g->residual = worst;
    PetscFunctionReturn(0);
}

// Collective, for pliant_compliance_def: rounding may differ from rank to rank when everybody sums for
// himself, and with it the number of steps; so one does it for all.
static void sum_over_ranks(void *context, double *values, int32_t count)
{
    const pliant_greens *g = context;
    PetscMPIInt rank;
    (void)MPI_Comm_rank(g->comm, &rank);
    (void)MPI_Reduce(rank == 0 ? MPI_IN_PLACE : values, values, count, MPI_DOUBLE, MPI_SUM, 0, g->comm);
    (void)MPI_Bcast(values, count, MPI_DOUBLE, 0, g->comm);
}

// Collective: the eigenvalues of the contact compliance that is stored.
static PetscErrorCode measure_definiteness(pliant_greens *g, int32_t level, pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_problem *p = g->problem;
    if (p->free_hats->level_offset[level + 1] == 0) PetscFunctionReturn(0);
    const pliant_kept_set *kept = pliant_compression_kept(g->blocks[PLIANT_FREE_FREE][level]);
    const uint64_t none = 0;
    const pliant_compliance_def def = {.wavelet = p->free_wavelet,
                                       .hats = p->free_hats,
                                       .level = level,
                                       .columns = {.count = kept->column_count,
                                                   .column = kept->columns,
                                                   .offset = kept->offset ? kept->offset : &none,
                                                   .row = kept->rows,
                                                   .block = kept->blocks},
                                       .sum = sum_over_ranks,
                                       .context = g};
    pliant_lanczos_result found = {0};
    PliantCall(g->comm, pliant_compliance_eigenvalues(&def, &found, err), err);
    pliant_greens_result *result = &g->results[PLIANT_FREE_FREE][level];
    result->smallest_eigenvalue = found.smallest;
    result->largest_eigenvalue = found.largest;
    PetscFunctionReturn(0);
}

// Progress of the level that is being decided on, in columns.
typedef struct level_progress {
    pliant_progress *progress;
    int64_t before, columns;
} level_progress;

static void tell_level(void *context, double part)
{
    const level_progress *level = context;
    pliant_progress_update(level->progress, level->before + (int64_t)(part * (double)level->columns));
}

PetscErrorCode pliant_greens_compress(pliant_greens *g, pliant_progress *progress,
                                      pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_level_range levels = g->problem->levels;
    int64_t total = 0, done = 0;  // columns of all levels
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int32_t l = levels.first; g->blocks[b][levels.last] && l <= levels.last; l++)
            total += pliant_greens_column_count(g->problem, (pliant_block_name)b, l);
    pliant_progress_begin(progress, "compress", total);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++) {
        const pliant_block_name block = (pliant_block_name)b;
        if (!g->blocks[b][levels.last]) continue;
        for (int32_t l = levels.last; l >= levels.first; l--) {
            pliant_compression *fine = g->blocks[b][l];
            level_progress level = {progress, done, pliant_greens_column_count(g->problem, block, l)};
            pliant_compression_listen(fine, tell_level, &level);
            PliantCall(g->comm, pliant_compression_decide(fine, g->comm, &g->results[b][l].compression, err), err);
            if (l > levels.first) {
                PliantCall(g->comm, create_level(g, block, l - 1, err), err);
                PetscCall(pliant_refinement_run(g, block, l - 1, err));
            }
            pliant_compression_settle(fine);
            if (block == PLIANT_FREE_FREE) PetscCall(measure_definiteness(g, l, err));
            done += pliant_greens_column_count(g->problem, block, l);
            pliant_progress_update(progress, done);
        }
    }
    PetscFunctionReturn(0);
}
