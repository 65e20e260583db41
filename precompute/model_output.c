// model_output.c: write the model file from the ranks' compressed columns.
//
// Columns are laid down in position order whatever the number of ranks was: a batch's shares follow
// each other by rank, as they were dealt out.
#include "model_output.h"

#include "interruption.h"
#include "refusal.h"

#include "pliant/error.h"
#include "pliant/writer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

// One rank's share of a batch, in the order of its columns.
typedef struct parcel {
    uint64_t count;  // blocks
    int32_t *rows;
    float *blocks;
    uint64_t capacity;
} parcel;

// Collective: blocks in every column, summed up to offsets, [columns + 1].
static PetscErrorCode gather_offsets(const pliant_greens *g, pliant_block_name block, int32_t level,
                                     uint64_t *offset)
{
    PetscFunctionBegin;
    const int32_t columns = pliant_greens_column_count(g->problem, block, level);
    const pliant_compression *c = g->blocks[block][level];
    memset(offset, 0, ((size_t)columns + 1) * sizeof *offset);
    for (int32_t i = 0; i < pliant_compression_column_count(c); i++) {
        int32_t column;
        const int32_t *rows;
        const float *blocks;
        const int32_t count = pliant_compression_column(c, i, &column, &rows, &blocks);
        offset[column + 1] = (uint64_t)count;
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, offset, columns + 1, MPI_UINT64_T, MPI_SUM, g->comm));
    for (int32_t j = 0; j < columns; j++) offset[j + 1] += offset[j];
    PetscFunctionReturn(0);
}

static PetscErrorCode reserve(parcel *p, uint64_t count)
{
    PetscFunctionBegin;
    if (count > p->capacity) {
        PetscCall(PetscFree(p->rows));
        PetscCall(PetscFree(p->blocks));
        PetscCall(PetscMalloc1(count, &p->rows));
        PetscCall(PetscMalloc1(9 * count, &p->blocks));
        p->capacity = count;
    }
    p->count = count;
    PetscFunctionReturn(0);
}

// Collective: bring the columns of a block's level to the first rank and write them.
static PetscErrorCode write_columns(pliant_writer *writer, pliant_greens *g,
                                    pliant_block_name block, int32_t level, const uint64_t *offset,
                                    int64_t written, pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(g->comm, &rank));
    PetscCallMPI(MPI_Comm_size(g->comm, &size));
    char row_path[PLIANT_PATH_LIMIT], block_path[PLIANT_PATH_LIMIT];
    pliant_section_level_path(block, level, "row", row_path);
    pliant_section_level_path(block, level, "block", block_path);

    const int32_t columns = pliant_greens_column_count(g->problem, block, level);
    parcel p = {0};
    int32_t next = 0;  // of this rank's columns, which are in batch order
    for (int32_t first = 0; first < columns; first += g->batch) {
        pliant_status status = PLIANT_OK;
        for (int r = 0; r < size; r++) {
            int32_t begin, end;
            pliant_greens_share(g, columns, first, r, &begin, &end);
            const uint64_t count = offset[end] - offset[begin];
            if (count == 0 || (rank != r && rank != 0)) continue;
            const int32_t *rows = NULL;
            const float *blocks = NULL;
            if (rank == r) {
                int32_t column;
                (void)pliant_compression_column(g->blocks[block][level], next, &column, &rows, &blocks);
            }
            if (rank == r && r > 0) {
                PetscCallMPI(MPI_Send(rows, (PetscMPIInt)count, MPI_INT32_T, 0, 0, g->comm));
                PetscCallMPI(MPI_Send(blocks, (PetscMPIInt)(9 * count), MPI_FLOAT, 0, 1, g->comm));
            } else if (rank == 0) {
                if (r > 0) {
                    PetscCall(reserve(&p, count));
                    PetscCallMPI(MPI_Recv(p.rows, (PetscMPIInt)count, MPI_INT32_T, r, 0, g->comm, MPI_STATUS_IGNORE));
                    PetscCallMPI(MPI_Recv(p.blocks, (PetscMPIInt)(9 * count), MPI_FLOAT, r, 1, g->comm, MPI_STATUS_IGNORE));
                    rows = p.rows;
                    blocks = p.blocks;
                }
                const uint64_t start[3] = {offset[begin], 0, 0}, box[3] = {count, 3, 3};
                if (status == PLIANT_OK) status = pliant_writer_write(writer, row_path, start, box, rows, err);
                if (status == PLIANT_OK) status = pliant_writer_write(writer, block_path, start, box, blocks, err);
            }
        }
        int32_t begin, end;
        pliant_greens_share(g, columns, first, rank, &begin, &end);
        next += end - begin;
        if (status == PLIANT_OK) status = pliant_interruption_check(err);
        const PetscErrorCode code = pliant_refusal_agree(g->comm, status, err);
        if (code) {
            PetscCall(PetscFree(p.rows));
            PetscCall(PetscFree(p.blocks));
            PetscCall(code);
        }
        const int32_t batch_end = columns - first < g->batch ? columns : first + g->batch;
        pliant_progress_update(progress, written + (int64_t)offset[batch_end]);
    }
    PetscCall(PetscFree(p.rows));
    PetscCall(PetscFree(p.blocks));
    PetscFunctionReturn(0);
}

static void summarise(const pliant_greens *g, pliant_block_name block, int32_t level, double *summary)
{
    const pliant_compression_result *result = &g->results[block][level].compression;
    const pliant_wavelet_def *def =
        pliant_greens_free_rows(block) ? &g->problem->free_wavelet->def : &g->problem->fixed_wavelet->def;
    summary[PLIANT_SUMMARY_EPS] = g->compression.eps;
    summary[PLIANT_SUMMARY_WAVELET] = def->scheme;
    summary[PLIANT_SUMMARY_LIFTED] = def->lifting;
    summary[PLIANT_SUMMARY_BOUNDARY] = def->boundary;
    summary[PLIANT_SUMMARY_RMS] = result->rms;
    summary[PLIANT_SUMMARY_MAX] = result->max;
    summary[PLIANT_SUMMARY_FACTOR] = result->kept ? (double)result->dense / (double)result->kept : 0;
    summary[PLIANT_SUMMARY_DEFINITE] = g->results[block][level].smallest_eigenvalue;
}

// The first rank's part besides the columns.
static pliant_status write_rest(pliant_writer *writer, const pliant_greens *g,
                                const pliant_lattice_data *lattice, const pliant_options *options,
                                const char *provenance, pliant_error *err)
{
    const pliant_problem *p = g->problem;
    pliant_status status = pliant_surface_output_write(writer, p->multires, &options->material, err);
    if (status < 0) return status;
    const struct {
        const char *path;
        const void *data;
    } sections[] = {
        {"/domains/free/nodes", p->free_nodes},
        {"/domains/free/level_offset", p->free_wavelet->level_offset},
        {"/domains/fixed/nodes", p->fixed_nodes},
        {"/domains/fixed/level_offset", p->fixed_wavelet->level_offset},
        {"/body/gravity/free", g->gravity_free},
    };
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++) {
        status = pliant_writer_write_all(writer, sections[i].path, sections[i].data, err);
        if (status < 0) return status;
    }
    if (p->relief) {
        const pliant_relief *r = p->relief;
        status = pliant_writer_write_all(writer, "/detail/level_count", r->vertex_count, err);
        if (status == PLIANT_OK) status = pliant_writer_write_all(writer, "/detail/offset", r->offset, err);
        if (status == PLIANT_OK)
            status = pliant_writer_write_all(writer, "/detail/source_index", r->source_index, err);
        if (status < 0) return status;
    }
    if (options->blocks == PLIANT_BLOCKS_ALL) {
        status = pliant_writer_write_all(writer, "/body/gravity/fixed", g->gravity_fixed, err);
        if (status < 0) return status;
    }
    if (lattice && (status = pliant_lattice_output_write(writer, lattice, err)) < 0) return status;
    return pliant_writer_write_provenance(writer, provenance, err);
}

// Offsets of every stored level's columns, NULL where there are none.
typedef struct all_offsets {
    uint64_t *of[PLIANT_BLOCK_COUNT][PLIANT_LEVEL_LIMIT + 1];
} all_offsets;

static pliant_status create(const char *path, const pliant_greens *g,
                            const pliant_lattice_data *lattice, const pliant_options *options,
                            const char *provenance, const all_offsets *offsets, pliant_writer **writer,
                            pliant_error *err)
{
    const pliant_problem *p = g->problem;
    const int32_t finest = p->multires->level_count - 1;
    pliant_model_layout layout = {.vertex_count = p->vertex_count,
                                  .face_count = p->multires->mesh->face_count,
                                  .level_count = finest + 1,
                                  .base_count = p->multires->vertex_count[0],
                                  .has_greens = 1,
                                  .free_count = p->free_count,
                                  .fixed_count = p->fixed_count,
                                  .text_bytes = strlen(provenance),
                                  .has_supports = options->blocks == PLIANT_BLOCKS_ALL};
    if (p->relief) {
        layout.detail_steps = p->relief->step_count;
        layout.detail_vertex_count = p->relief->vertex_count[p->relief->step_count];
    }
    if (lattice) layout.lattice = pliant_lattice_output_layout(lattice);
    for (int32_t l = 0; l <= finest; l++) {
        layout.free_columns[l] = p->free_hats->level_offset[l + 1];
        layout.fixed_columns[l] = p->fixed_hats->level_offset[l + 1];
        if (l >= p->levels.first && l <= p->levels.last) layout.level_mask |= 1u << l;
        for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
            if (offsets->of[b][l])
                layout.nnz[b][l] = offsets->of[b][l][pliant_greens_column_count(p, (pliant_block_name)b, l)];
    }
    pliant_section_def sections[PLIANT_SECTION_LIMIT];
    int32_t section_count;
    const pliant_status status = pliant_model_layout_sections(&layout, sections, &section_count, err);
    if (status < 0) return status;
    return pliant_writer_create(path, sections, section_count, writer, err);
}

// Collective: everything of one block's level.
static PetscErrorCode write_level(pliant_writer *writer, pliant_greens *g, pliant_block_name block,
                                  int32_t level, const uint64_t *offset, int64_t written,
                                  pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank;
    PetscCallMPI(MPI_Comm_rank(g->comm, &rank));
    PetscCall(write_columns(writer, g, block, level, offset, written, progress, err));
    pliant_status status = PLIANT_OK;
    if (rank == 0) {
        char offset_path[PLIANT_PATH_LIMIT];
        double summary[PLIANT_SUMMARY_COUNT];
        pliant_section_level_path(block, level, "column_offset", offset_path);
        summarise(g, block, level, summary);
        status = pliant_writer_write_all(writer, offset_path, offset, err);
        if (status == PLIANT_OK) status = pliant_writer_write_summary(writer, block, level, summary, err);
    }
    PliantCall(g->comm, status, err);
    PetscFunctionReturn(0);
}

static int64_t blocks_of(const pliant_greens *g, pliant_block_name block, int32_t level,
                         const uint64_t *offset)
{
    return (int64_t)offset[pliant_greens_column_count(g->problem, block, level)];
}

// Collective.
static PetscErrorCode write_model(const char *path, pliant_greens *g,
                                  const pliant_lattice_data *lattice, const pliant_options *options,
                                  const char *provenance, all_offsets *offsets,
                                  pliant_writer **writer, pliant_progress *progress, double *bytes,
                                  pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank;
    PetscCallMPI(MPI_Comm_rank(g->comm, &rank));
    const pliant_level_range levels = g->problem->levels;
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int32_t l = levels.first; l <= levels.last; l++) {
            const pliant_block_name block = (pliant_block_name)b;
            if (!g->blocks[b][l]) continue;
            const size_t columns = (size_t)pliant_greens_column_count(g->problem, block, l);
            PetscCall(PetscMalloc1(columns + 1, &offsets->of[b][l]));
            PetscCall(gather_offsets(g, block, l, offsets->of[b][l]));
        }
    pliant_status status = PLIANT_OK;
    if (rank == 0) {
        status = create(path, g, lattice, options, provenance, offsets, writer, err);
        if (status == PLIANT_OK) status = write_rest(*writer, g, lattice, options, provenance, err);
    }
    PliantCall(g->comm, status, err);
    int64_t total = 0, done = 0;  // blocks
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int32_t l = levels.first; l <= levels.last; l++)
            if (offsets->of[b][l])
                total += blocks_of(g, (pliant_block_name)b, l, offsets->of[b][l]);
    pliant_progress_begin(progress, "write", total);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int32_t l = levels.first; l <= levels.last; l++) {
            if (!offsets->of[b][l]) continue;
            PetscCall(write_level(*writer, g, (pliant_block_name)b, l, offsets->of[b][l], done,
                                  progress, err));
            done += blocks_of(g, (pliant_block_name)b, l, offsets->of[b][l]);
        }
    if (rank == 0) {
        char temporary[4200];
        snprintf(temporary, sizeof temporary, "%s.tmp", path);
        status = g->partial ? pliant_partial_name(g->partial, temporary, err) : PLIANT_OK;
        if (status == PLIANT_OK) {
            status = pliant_writer_commit(*writer, err);
            *writer = NULL;
        }
        struct stat file;
        *bytes = status == PLIANT_OK && stat(path, &file) == 0 ? (double)file.st_size : 0;
    }
    PliantCall(g->comm, status, err);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_model_output_write(const char *path, pliant_greens *g,
                                         const pliant_lattice_data *lattice,
                                         const pliant_options *options, const char *provenance,
                                         pliant_progress *progress, double *bytes,
                                         pliant_error *err)
{
    PetscFunctionBegin;
    all_offsets offsets = {0};
    pliant_writer *writer = NULL;
    const PetscErrorCode code =
        write_model(path, g, lattice, options, provenance, &offsets, &writer, progress, bytes, err);
    pliant_writer_abandon(writer);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int32_t l = 0; l <= PLIANT_LEVEL_LIMIT; l++) PetscCall(PetscFree(offsets.of[b][l]));
    PetscCall(code);
    PetscFunctionReturn(0);
}
