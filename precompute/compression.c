// compression.c: wavelet compression of one Green's function block as its columns stream by.
//
// This follows: GF 4.5 for the paper's rule.
#include "compression.h"

#include "kept_set.h"
#include "spool.h"
#include "threshold_search.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    group = PLIANT_COLUMN_GROUP,
    entries = 9,
    width = group * entries,  // a row of the group: [entry][column]
};

// Coefficients under this part of their column's peak are not spooled: a tenth of what a float can
// tell from zero beside the peak, so errors measured from the spool are exact to rounding.
static const double spool_floor = 1e-8;

struct pliant_compression {
    const pliant_wavelet *wavelet;
    pliant_compression_def def;
    pliant_spool *spool;    // NULL: none; targets have one
    pliant_spool *decided;  // what the paper's rule keeps, for a later run; may be NULL
    double *nodal;          // [m + 1][entries][group], the caller's
    double *error;          // the same; the paper's rule only
    pliant_spooled
        scratch;  // a column on its way to the spool: room for m blocks; with a spool only
    pliant_kept_set kept;
    void (*tell)(void *context, double part);  // of the decision; NULL: nobody listens
    void *context;
    double exact_energy;      // sum over this rank's columns of |xi_j|^2
    double error_energy;      // the same of the stored columns' errors
    double worst;             // GF-71 so far
};

static pliant_status no_memory(pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for compressed columns");
}

// Everything but the spools.
static pliant_status create(const pliant_wavelet *wavelet, const pliant_compression_def *def,
                            pliant_compression **compression, pliant_error *err)
{
    pliant_compression *c = calloc(1, sizeof *c);
    *compression = c;
    if (!c) return no_memory(err);
    c->wavelet = wavelet;
    c->def = *def;
    const size_t rows = (size_t)wavelet->count + 1;
    c->nodal = calloc(rows * width, sizeof *c->nodal);
    if (!c->nodal) return no_memory(err);
    if (def->eps > 0) c->error = calloc(rows * width, sizeof *c->error);
    return def->eps > 0 && !c->error ? no_memory(err) : PLIANT_OK;
}

// Room for a column on its way to the spool.
static pliant_status create_scratch(pliant_compression *c, pliant_error *err)
{
    const size_t rows = (size_t)c->wavelet->count + 1;
    c->scratch.rows = calloc(rows, sizeof *c->scratch.rows);
    c->scratch.norms = calloc(rows, sizeof *c->scratch.norms);
    c->scratch.blocks = calloc(rows * entries, sizeof *c->scratch.blocks);
    return !c->scratch.rows || !c->scratch.norms || !c->scratch.blocks ? no_memory(err) : PLIANT_OK;
}

pliant_status pliant_compression_create(const pliant_wavelet *wavelet,
                                        const pliant_compression_def *def, const char *folder,
                                        pliant_compression **compression, pliant_error *err)
{
    pliant_compression *c;
    pliant_status status = create(wavelet, def, &c, err);
    if (status == PLIANT_OK && folder) {
        status = create_scratch(c, err);
        if (status == PLIANT_OK) status = pliant_spool_create(folder, &c->spool, err);
    }
    if (status < 0) {
        pliant_compression_destroy(c);
        return status;
    }
    *compression = c;
    return PLIANT_OK;
}

void pliant_compression_streams(const pliant_compression_def *def, pliant_compression_use use,
                                int streams[2])
{
    streams[0] = def->eps == 0 || use == PLIANT_COMPRESSION_REFINED;
    streams[1] = def->eps > 0;
}

pliant_status pliant_compression_create_in(const pliant_wavelet *wavelet,
                                           const pliant_compression_def *def,
                                           pliant_compression_use use, pliant_column_file *file,
                                           const int32_t streams[2],
                                           pliant_compression **compression, pliant_error *err)
{
    pliant_compression *c;
    int used[2];
    pliant_compression_streams(def, use, used);
    pliant_status status = create(wavelet, def, &c, err);
    if (status == PLIANT_OK && used[0]) {
        status = create_scratch(c, err);
        if (status == PLIANT_OK) status = pliant_spool_create_in(file, streams[0], &c->spool, err);
    }
    if (status == PLIANT_OK && used[1])
        status = pliant_spool_create_in(file, streams[1], &c->decided, err);
    if (status < 0) {
        pliant_compression_destroy(c);
        return status;
    }
    *compression = c;
    return PLIANT_OK;
}

pliant_status pliant_compression_restore(pliant_compression *c, const pliant_spooled *spooled,
                                         const pliant_spooled *kept, pliant_error *err)
{
    if (c->spool) {
        const pliant_status status = pliant_spool_adopt(c->spool, spooled, err);
        if (status < 0) return status;
    }
    c->exact_energy += c->decided ? kept->energy : spooled->energy;
    if (!c->decided) return PLIANT_OK;
    pliant_status status = pliant_kept_set_begin(&c->kept, kept->column, err);
    for (int32_t i = 0; i < kept->count && status == PLIANT_OK; i++) {
        double block[entries];
        for (int e = 0; e < entries; e++) block[e] = kept->blocks[entries * (size_t)i + e];
        status = pliant_kept_set_add(&c->kept, kept->rows[i], block, err);
    }
    c->error_energy += kept->error_energy;
    c->worst = fmax(c->worst, kept->error_worst);
    return status;
}

void pliant_compression_settle(pliant_compression *c)
{
    pliant_spool_destroy(c->decided);
    pliant_spool_destroy(c->spool);
    free((void *)(uintptr_t)c->scratch.blocks);
    free((void *)(uintptr_t)c->scratch.norms);
    free((void *)(uintptr_t)c->scratch.rows);
    free(c->error);
    free(c->nodal);
    c->spool = c->decided = NULL;
    c->scratch = (pliant_spooled){.count = 0};
    c->error = c->nodal = NULL;
}

void pliant_compression_destroy(pliant_compression *c)
{
    if (!c) return;
    pliant_compression_settle(c);
    pliant_kept_set_destroy(&c->kept);
    free(c);
}

void pliant_compression_listen(pliant_compression *c, void (*tell)(void *context, double part), void *context)
{
    c->tell = tell;
    c->context = context;
}

double *pliant_compression_group(pliant_compression *c)
{
    return c->nodal;
}

// Squared Frobenius norm of column k's block in a row of the group.
static double block_square(const double *row, int k)
{
    double sum = 0;
    for (int e = 0; e < entries; e++) sum += row[e * group + k] * row[e * group + k];
    return sum;
}

// Largest squared block norm and sum of squared block norms of each column.
static void measure(const double *x, int32_t rows, double *largest, double *sum)
{
    for (int k = 0; k < group; k++) largest[k] = sum[k] = 0;
    for (int32_t i = 0; i < rows; i++)
        for (int k = 0; k < group; k++) {
            const double square = block_square(x + (size_t)i * width, k);
            if (square > largest[k]) largest[k] = square;
            sum[k] += square;
        }
}

// GF-31..33: drop the block (i, j), i on level l >= 1, when |xi~_ij|_F < 2^(l-L) eps max_i |xi_ij|_F.
// c->nodal holds the coefficients; c->error becomes nodal values - W^-1 (what is kept, rounded).
static pliant_status keep_by_level(pliant_compression *c, const int32_t *columns, int32_t count,
                                   const double *peak_square, const double *energy,
                                   pliant_error *err)
{
    const pliant_wavelet *w = c->wavelet;
    const int32_t finest = w->level_count - 1;
    memcpy(c->error, c->nodal, ((size_t)w->count + 1) * width * sizeof *c->error);
    for (int32_t k = 0; k < count; k++) {
        pliant_status status = pliant_kept_set_begin(&c->kept, columns[k], err);
        for (int32_t l = 0; l <= finest && status == PLIANT_OK; l++) {
            const double bound = l == 0 ? 0 : ldexp(c->def.eps, l - finest) * sqrt(peak_square[k]);
            for (int32_t i = w->level_offset[l]; i < w->level_offset[l + 1] && status == PLIANT_OK; i++) {
                const double *row = c->nodal + (size_t)i * width;
                if (l > 0 && block_square(row, k) < bound * bound) continue;
                double block[entries];
                for (int e = 0; e < entries; e++) {
                    block[e] = row[e * group + k];
                    c->error[(size_t)i * width + e * group + k] -= (float)block[e];
                }
                status = pliant_kept_set_add(&c->kept, i, block, err);
            }
        }
        if (status < 0) return status;
    }
    pliant_wavelet_inverse(w, finest, width, c->error);
    double largest[group], sum[group];
    measure(c->error, w->count, largest, sum);
    for (int32_t k = 0; k < count; k++) {
        const double worst = peak_square[k] > 0 ? sqrt(largest[k] / peak_square[k]) : 0;
        c->error_energy += sum[k];
        c->worst = fmax(c->worst, worst);
        if (!c->decided) continue;
        const int32_t index = c->kept.column_count - count + k;
        const uint64_t begin = c->kept.offset[index];
        const float *blocks = c->kept.blocks + begin * entries;
        // Nobody reads the norms of what is decided on: any numbers will do.
        const pliant_spooled column = {.column = columns[k],
                                       .count = (int32_t)(c->kept.offset[index + 1] - begin),
                                       .rows = c->kept.rows + begin,
                                       .norms = blocks,
                                       .blocks = blocks,
                                       .peak = sqrt(peak_square[k]),
                                       .energy = energy[k],
                                       .error_energy = sum[k],
                                       .error_worst = worst};
        const pliant_status status = pliant_spool_append(c->decided, &column, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

static pliant_status spool_group(pliant_compression *c, const int32_t *columns, int32_t count,
                                 const double *peak_square, const double *energy, pliant_error *err)
{
    // The scratch arrays are ours; pliant_spooled only lends them to readers.
    int32_t *rows = (int32_t *)(uintptr_t)c->scratch.rows;
    float *norms = (float *)(uintptr_t)c->scratch.norms;
    float *blocks = (float *)(uintptr_t)c->scratch.blocks;
    for (int32_t k = 0; k < count; k++) {
        const double floor_square = peak_square[k] * spool_floor * spool_floor;
        pliant_spooled column = c->scratch;
        column.column = columns[k];
        column.count = 0;
        column.peak = sqrt(peak_square[k]);
        column.energy = energy[k];
        for (int32_t i = 0; i < c->wavelet->count; i++) {
            const double *row = c->nodal + (size_t)i * width;
            const double square = block_square(row, k);
            if (i >= c->wavelet->level_offset[1] && square <= floor_square) continue;
            float *block = blocks + entries * (size_t)column.count;
            for (int e = 0; e < entries; e++) block[e] = (float)row[e * group + k];
            norms[column.count] = (float)sqrt(square);
            rows[column.count++] = i;
        }
        const pliant_status status = pliant_spool_append(c->spool, &column, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

pliant_status pliant_compression_add(pliant_compression *c, const int32_t *columns, int32_t count,
                                     pliant_error *err)
{
    double peak_square[group], energy[group];
    measure(c->nodal, c->wavelet->count, peak_square, energy);
    for (int32_t k = 0; k < count; k++) c->exact_energy += energy[k];
    pliant_wavelet_forward(c->wavelet, width, c->nodal);
    pliant_status status = PLIANT_OK;
    if (c->def.eps > 0) status = keep_by_level(c, columns, count, peak_square, energy, err);
    if (c->spool && status == PLIANT_OK)
        status = spool_group(c, columns, count, peak_square, energy, err);
    return status;
}

pliant_status pliant_compression_decide(pliant_compression *c, MPI_Comm comm,
                                        pliant_compression_result *result, pliant_error *err)
{
    double exact;
    MPI_Allreduce(&c->exact_energy, &exact, 1, MPI_DOUBLE, MPI_SUM, comm);
    if (c->spool) {
        int32_t sealed = pliant_spool_seal(c->spool, err), all;
        MPI_Allreduce(&sealed, &all, 1, MPI_INT32_T, MPI_MIN, comm);
        if (all < 0) return (pliant_status)sealed;
    }
    if (c->def.eps == 0) {
        const pliant_threshold_targets targets = {c->def.rms, c->def.max, c->tell, c->context};
        pliant_threshold_outcome outcome;
        const pliant_status status = pliant_threshold_search(c->wavelet, c->spool, &targets, exact, comm,
                                                             &c->kept, &outcome, err);
        if (status < 0) return status;
        c->error_energy = outcome.error_energy;
        c->worst = outcome.worst;
    }
    uint64_t counts[2] = {c->kept.count, (uint64_t)c->kept.column_count * (uint64_t)c->wavelet->count}, all[2];
    double error, worst;
    MPI_Allreduce(counts, all, 2, MPI_UINT64_T, MPI_SUM, comm);
    MPI_Allreduce(&c->error_energy, &error, 1, MPI_DOUBLE, MPI_SUM, comm);
    MPI_Allreduce(&c->worst, &worst, 1, MPI_DOUBLE, MPI_MAX, comm);
    *result = (pliant_compression_result){.kept = all[0], .dense = all[1],
                                          .rms = exact > 0 ? sqrt(error / exact) : 0, .max = worst};
    return PLIANT_OK;
}

const pliant_spool *pliant_compression_spool(const pliant_compression *c)
{
    return c->spool;
}

const pliant_kept_set *pliant_compression_kept(const pliant_compression *c)
{
    return &c->kept;
}

int32_t pliant_compression_column_count(const pliant_compression *c)
{
    return c->kept.column_count;
}

int32_t pliant_compression_column(const pliant_compression *c, int32_t index, int32_t *column,
                                  const int32_t **rows, const float **blocks)
{
    const uint64_t begin = c->kept.offset[index];
    *column = c->kept.columns[index];
    *rows = c->kept.rows + begin;
    *blocks = c->kept.blocks + begin * entries;
    return (int32_t)(c->kept.offset[index + 1] - begin);
}
