// refinement.c: columns of a level from those of the next finer one (GF-60..62).
//
// The finer columns lie in the ranks' spools as wavelet coefficients. For every group of coarse
// columns each rank adds up what it has of them; the sums meet at the rank that goes on with the
// group, which transforms them back to nodal values: from there they are like solved ones. Coarse
// columns are dealt to the ranks as solved ones are.
#include "refinement.h"

#include "refusal.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

enum {
    group = PLIANT_COLUMN_GROUP,
    entries = 9,
    width = group * entries,
};

typedef struct refiner {
    const pliant_wavelet *wavelet;  // of the rows
    const pliant_hats *hats;        // of the columns
    int32_t level;                  // of the coarse columns
    const pliant_spool *fine;
    int32_t *index;    // [fine columns] in this rank's spool, or -1
    double *sum;       // [m + 1][entries][group]
    pliant_compression *coarse;
} refiner;

static pliant_status create(pliant_greens *g, pliant_block_name block, int32_t level, refiner *r, pliant_error *err)
{
    const pliant_problem *p = g->problem;
    *r = (refiner){.wavelet = pliant_greens_free_rows(block) ? p->free_wavelet : p->fixed_wavelet,
                   .hats = pliant_greens_free_columns(block) ? p->free_hats : p->fixed_hats,
                   .level = level,
                   .fine = pliant_compression_spool(g->blocks[block][level + 1]),
                   .coarse = g->blocks[block][level]};
    const int32_t fine_count = r->hats->level_offset[level + 2];
    r->index = malloc(((size_t)fine_count + 1) * sizeof *r->index);
    r->sum = malloc(((size_t)r->wavelet->count + 1) * width * sizeof *r->sum);
    if (!r->index || !r->sum)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for refining columns of level %d", level);
    for (int32_t j = 0; j < fine_count; j++) r->index[j] = -1;
    for (int32_t i = 0; i < pliant_spool_column_count(r->fine); i++)
        r->index[pliant_spool_column(r->fine, i).column] = i;
    return PLIANT_OK;
}

// Column k of the group += h times what this rank has of fine column j.
static void add_column(const refiner *r, int32_t k, int32_t j, double h)
{
    if (r->index[j] < 0) return;
    const pliant_spooled column = pliant_spool_column(r->fine, r->index[j]);
    for (int32_t i = 0; i < column.count; i++) {
        double *row = r->sum + (size_t)column.rows[i] * width + k;
        for (int e = 0; e < entries; e++) row[e * group] += h * column.blocks[entries * (size_t)i + e];
    }
}

// This rank's part of coarse columns first .. first + count - 1. Of a hat's weights those at vertices
// of the next level come first: itself and its odd neighbours.
static void add_up(const refiner *r, int32_t first, int32_t count)
{
    const int32_t fine_count = r->hats->level_offset[r->level + 2];
    const int32_t *offset = r->hats->offset[r->level], *position = r->hats->position[r->level];
    memset(r->sum, 0, ((size_t)r->wavelet->count + 1) * width * sizeof *r->sum);
    for (int32_t k = 0; k < count; k++)
        for (int32_t e = offset[first + k]; e < offset[first + k + 1] && position[e] < fine_count; e++)
            add_column(r, k, position[e], r->hats->weight[r->level][e]);
}

static pliant_status hand_on(const refiner *r, int32_t first, int32_t count, pliant_error *err)
{
    double *nodal = pliant_compression_group(r->coarse);
    memcpy(nodal, r->sum, ((size_t)r->wavelet->count + 1) * width * sizeof *nodal);
    pliant_wavelet_inverse(r->wavelet, r->wavelet->level_count - 1, width, nodal);
    int32_t columns[group];
    for (int32_t k = 0; k < count; k++) columns[k] = first + k;
    return pliant_compression_add(r->coarse, columns, count, err);
}

// Collective.
static PetscErrorCode refine(pliant_greens *g, const refiner *r, pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(g->comm, &rank));
    PetscCallMPI(MPI_Comm_size(g->comm, &size));
    const int32_t columns = r->hats->level_offset[r->level + 1];
    const int values = (r->wavelet->count + 1) * width;
    for (int32_t batch = 0; batch < columns; batch += g->batch) {
        pliant_status status = PLIANT_OK;
        for (int owner = 0; owner < size; owner++) {
            int32_t begin, end;
            pliant_greens_share(g, columns, batch, owner, &begin, &end);
            for (int32_t first = begin; first < end; first += group) {
                const int32_t count = end - first < group ? end - first : group;
                add_up(r, first, count);
                PetscCallMPI(MPI_Reduce(rank == owner ? MPI_IN_PLACE : r->sum, r->sum, values, MPI_DOUBLE,
                                        MPI_SUM, owner, g->comm));
                // After a refusal go on summing, so that nobody waits.
                if (rank == owner && status == PLIANT_OK) status = hand_on(r, first, count, err);
            }
        }
        PliantCall(g->comm, status, err);
    }
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_refinement_run(pliant_greens *g, pliant_block_name block, int32_t level, pliant_error *err)
{
    PetscFunctionBegin;
    refiner r;
    PetscErrorCode code = pliant_refusal_agree(g->comm, create(g, block, level, &r, err), err);
    if (code == 0) code = refine(g, &r, err);
    free(r.sum);
    free(r.index);
    PetscCall(code);
    PetscFunctionReturn(0);
}
