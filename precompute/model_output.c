// model_output.c: write the model file from the ranks' compressed columns.
//
// Columns are laid down in position order whatever the number of ranks was: a batch's shares follow
// each other by rank, as they were dealt out.
#include "model_output.h"

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

static int fixed_columns(pliant_block_name block)
{
    return block == PLIANT_FREE_FIXED || block == PLIANT_FIXED_FIXED;
}

static int32_t column_count(const pliant_greens *g, pliant_block_name block)
{
    return fixed_columns(block) ? g->problem->fixed_count : g->problem->free_count;
}

// Collective: blocks in every column, summed up to offsets, [columns + 1].
static PetscErrorCode gather_offsets(const pliant_greens *g, pliant_block_name block, uint64_t *offset)
{
    PetscFunctionBegin;
    const int32_t columns = column_count(g, block);
    pliant_compression *c = g->blocks[block];
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

// Collective: bring one block's columns to the first rank and write them.
static PetscErrorCode write_block(pliant_writer *writer, pliant_greens *g, pliant_block_name block,
                                  int32_t level, const uint64_t *offset, pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(g->comm, &rank));
    PetscCallMPI(MPI_Comm_size(g->comm, &size));
    char row_path[PLIANT_PATH_LIMIT], block_path[PLIANT_PATH_LIMIT];
    pliant_section_level_path(block, level, "row", row_path);
    pliant_section_level_path(block, level, "block", block_path);

    const int32_t columns = column_count(g, block);
    parcel p = {0};
    int32_t next = 0;  // of this rank's columns, which are in batch order
    for (int32_t first = 0; first < columns; first += g->batch) {
        pliant_status status = PLIANT_OK;
        for (int r = 0; r < size; r++) {
            int32_t begin, end;
            pliant_greens_share(g, columns, first, r, size, &begin, &end);
            const uint64_t count = offset[end] - offset[begin];
            if (count == 0 || (rank != r && rank != 0)) continue;
            const int32_t *rows = NULL;
            const float *blocks = NULL;
            if (rank == r) {
                int32_t column;
                (void)pliant_compression_column(g->blocks[block], next, &column, &rows, &blocks);
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
        pliant_greens_share(g, columns, first, rank, size, &begin, &end);
        next += end - begin;
        PliantCall(g->comm, status, err);
    }
    PetscCall(PetscFree(p.rows));
    PetscCall(PetscFree(p.blocks));
    PetscFunctionReturn(0);
}

static void summarise(const pliant_greens *g, const pliant_options *options, pliant_block_name block,
                      double *summary)
{
    const pliant_compression_result *result = &g->results[block];
    const int free_rows = block == PLIANT_FREE_FREE || block == PLIANT_FREE_FIXED;
    const pliant_wavelet_def *def = free_rows ? &g->problem->free_wavelet->def : &g->problem->fixed_wavelet->def;
    summary[PLIANT_SUMMARY_EPS] = options->compression.eps;
    summary[PLIANT_SUMMARY_WAVELET] = def->scheme;
    summary[PLIANT_SUMMARY_LIFTED] = def->lifting;
    summary[PLIANT_SUMMARY_BOUNDARY] = def->boundary;
    summary[PLIANT_SUMMARY_RMS] = result->rms;
    summary[PLIANT_SUMMARY_MAX] = result->max;
    summary[PLIANT_SUMMARY_FACTOR] = result->kept ? (double)result->dense / (double)result->kept : 0;
    summary[PLIANT_SUMMARY_RESERVED] = 0;
}

// The first rank's part besides the columns.
static pliant_status write_mesh(pliant_writer *writer, const pliant_greens *g,
                                const pliant_options *options, const char *provenance, pliant_error *err)
{
    const pliant_problem *p = g->problem;
    const pliant_multires *m = p->multires;
    const double material[3] = {options->material.young, options->material.poisson, options->material.density};
    const struct {
        const char *path;
        const void *data;
    } sections[] = {
        {"/mesh/vertices", m->mesh->vertices},
        {"/mesh/faces", m->mesh->faces},
        {"/mesh/level_count", m->vertex_count},
        {"/mesh/parents", m->parents},
        {"/mesh/source_index", m->source_index},
        {"/material", material},
        {"/domains/free/nodes", p->free_nodes},
        {"/domains/free/level_offset", p->free_wavelet->level_offset},
        {"/domains/fixed/nodes", p->fixed_nodes},
        {"/domains/fixed/level_offset", p->fixed_wavelet->level_offset},
        {"/body/gravity/free", g->gravity_free},
    };
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++) {
        const pliant_status status = pliant_writer_write_all(writer, sections[i].path, sections[i].data, err);
        if (status < 0) return status;
    }
    if (options->blocks == PLIANT_BLOCKS_ALL) {
        const pliant_status status = pliant_writer_write_all(writer, "/body/gravity/fixed", g->gravity_fixed, err);
        if (status < 0) return status;
    }
    return pliant_writer_write_provenance(writer, provenance, err);
}

static pliant_status create(const char *path, const pliant_greens *g, const pliant_options *options,
                            const char *provenance, uint64_t *const offsets[PLIANT_BLOCK_COUNT],
                            pliant_writer **writer, pliant_error *err)
{
    const pliant_problem *p = g->problem;
    const int32_t finest = p->multires->level_count - 1;
    pliant_model_layout layout = {.vertex_count = p->vertex_count,
                                  .face_count = p->multires->mesh->face_count,
                                  .level_count = finest + 1,
                                  .base_count = p->multires->vertex_count[0],
                                  .free_count = p->free_count,
                                  .fixed_count = p->fixed_count,
                                  .text_bytes = strlen(provenance),
                                  .has_supports = options->blocks == PLIANT_BLOCKS_ALL,
                                  .level_mask = 1u << finest};
    for (int32_t l = 0; l <= finest; l++) {
        layout.free_columns[l] = p->free_wavelet->level_offset[l + 1];
        layout.fixed_columns[l] = p->fixed_wavelet->level_offset[l + 1];
    }
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        if (offsets[b]) layout.nnz[b][finest] = offsets[b][column_count(g, (pliant_block_name)b)];
    pliant_section_def sections[PLIANT_SECTION_LIMIT];
    int32_t section_count;
    const pliant_status status = pliant_model_layout_sections(&layout, sections, &section_count, err);
    if (status < 0) return status;
    return pliant_writer_create(path, sections, section_count, writer, err);
}

PetscErrorCode pliant_model_output_write(const char *path, pliant_greens *g,
                                         const pliant_options *options, const char *provenance,
                                         double *bytes, pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank;
    PetscCallMPI(MPI_Comm_rank(g->comm, &rank));
    const int32_t finest = g->problem->multires->level_count - 1;
    uint64_t *offsets[PLIANT_BLOCK_COUNT] = {NULL};
    pliant_writer *writer = NULL;
    PetscErrorCode code = 0;
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++) {
        if (!g->blocks[b]) continue;
        PetscCall(PetscMalloc1((size_t)column_count(g, (pliant_block_name)b) + 1, &offsets[b]));
        PetscCall(gather_offsets(g, (pliant_block_name)b, offsets[b]));
    }
    pliant_status status = PLIANT_OK;
    if (rank == 0) {
        status = create(path, g, options, provenance, offsets, &writer, err);
        if (status == PLIANT_OK) status = write_mesh(writer, g, options, provenance, err);
    }
    code = pliant_refusal_agree(g->comm, status, err);
    for (int b = 0; b < PLIANT_BLOCK_COUNT && code == 0; b++) {
        if (!offsets[b]) continue;
        const pliant_block_name block = (pliant_block_name)b;
        code = write_block(writer, g, block, finest, offsets[b], err);
        if (code) break;
        if (rank == 0) {
            char offset_path[PLIANT_PATH_LIMIT];
            double summary[PLIANT_SUMMARY_COUNT];
            pliant_section_level_path(block, finest, "column_offset", offset_path);
            summarise(g, options, block, summary);
            status = pliant_writer_write_all(writer, offset_path, offsets[b], err);
            if (status == PLIANT_OK) status = pliant_writer_write_summary(writer, block, finest, summary, err);
        }
        code = pliant_refusal_agree(g->comm, status, err);
    }
    if (code == 0) {
        if (rank == 0) {
            status = pliant_writer_commit(writer, err);
            writer = NULL;
            struct stat file;
            *bytes = status == PLIANT_OK && stat(path, &file) == 0 ? (double)file.st_size : 0;
        }
        code = pliant_refusal_agree(g->comm, status, err);
    }
    pliant_writer_abandon(writer);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++) PetscCall(PetscFree(offsets[b]));
    PetscCall(code);
    PetscFunctionReturn(0);
}
