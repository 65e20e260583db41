// capacitance.c: the capacitance matrix of one boundary-value-problem type, extracted and inverted.
#include "capacitance.h"

#include "dense.h"

#include <math.h>
#include <string.h>

enum { block_floats = 16 };  // a slot of pliant_reconstruction_run_blocks

int32_t pliant_capacitance_domain_count(const pliant_model *model)
{
    return model->greens[PLIANT_DOMAIN_FIXED][PLIANT_DOMAIN_FIXED].offset ? 2 : 1;
}

void pliant_capacitance_lay_out(pliant_arena *arena, const pliant_model *model, int32_t capacity,
                                pliant_capacitance *capacitance)
{
    const size_t n = 3 * (size_t)capacity;
    PLIANT_TAKE(arena, capacitance->vertices, capacity);
    PLIANT_TAKE(arena, capacitance->slot, capacity);
    PLIANT_TAKE(arena, capacitance->inverse, n * pliant_dense_stride(n));
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++)
        pliant_reconstruction_lay_out(arena, model->domains[d].wavelet, &capacitance->plan[d]);
}

void pliant_capacitance_scratch_lay_out(pliant_arena *arena, const pliant_model *model,
                                        int32_t capacity, pliant_capacitance_scratch *scratch)
{
    const size_t n = 3 * (size_t)capacity, stride = pliant_dense_stride(n);
    int32_t slots = 0;
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++) {
        pliant_reconstruction_scratch_lay_out(arena, model->domains[d].wavelet,
                                              &scratch->domain[d]);
        if (model->domains[d].count > slots) slots = model->domains[d].count;
    }
    PLIANT_TAKE(arena, scratch->positions, capacity);
    PLIANT_TAKE(arena, scratch->index, capacity);
    PLIANT_TAKE(arena, scratch->slots, capacity);
    PLIANT_TAKE(arena, scratch->pivots, n);
    PLIANT_TAKE(arena, scratch->scale, n);
    PLIANT_TAKE(arena, scratch->compliance, n * stride);
    PLIANT_TAKE(arena, scratch->work_matrix, n * stride);
    PLIANT_TAKE(arena, scratch->work, pliant_dense_work_count(n));
    PLIANT_TAKE(arena, scratch->blocks, (size_t)slots * block_floats);
}

void pliant_capacitance_scratch_begin(const pliant_model *model,
                                      pliant_capacitance_scratch *scratch)
{
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++)
        pliant_reconstruction_scratch_begin(model->domains[d].wavelet, &scratch->domain[d]);
}

// The members of S in domain d: their numbers in S go to scratch->index.
static int32_t list_domain(const pliant_model *model, const int32_t *vertices, int32_t count,
                           int32_t d, int32_t *index)
{
    int32_t listed = 0;
    for (int32_t i = 0; i < count; i++)
        if (model->domain[vertices[i]] == d) index[listed++] = i;
    return listed;
}

void pliant_capacitance_plan(const pliant_model *model, const int32_t *vertices, int32_t count,
                             pliant_capacitance_scratch *scratch, pliant_capacitance *capacitance)
{
    capacitance->count = count;
    capacitance->stride = pliant_dense_stride(3 * (size_t)count);
    memcpy(capacitance->vertices, vertices, (size_t)count * sizeof *vertices);
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++) {
        const int32_t listed = list_domain(model, vertices, count, d, scratch->index);
        for (int32_t i = 0; i < listed; i++)
            scratch->positions[i] = model->position[vertices[scratch->index[i]]];
        pliant_reconstruction_build(&capacitance->plan[d], &scratch->domain[d], scratch->positions,
                                    listed, scratch->slots);
        for (int32_t i = 0; i < listed; i++)
            capacitance->slot[scratch->index[i]] = scratch->slots[i];
    }
}

// Put a column's blocks into their slots; the others are zero.
static void load_column(const pliant_columns *columns, int32_t column, const int32_t *slot_of,
                        int32_t slot_count, float *blocks)
{
    memset(blocks, 0, (size_t)slot_count * block_floats * sizeof *blocks);
    for (uint64_t e = columns->offset[column]; e < columns->offset[column + 1]; e++) {
        const int32_t slot = slot_of[columns->row[e]];
        if (slot >= 0)
            memcpy(blocks + (size_t)slot * block_floats, columns->block + 9 * e,
                   9 * sizeof *blocks);
    }
}

void pliant_capacitance_extract(const pliant_model *model, const pliant_capacitance *capacitance,
                                pliant_capacitance_scratch *scratch, double *compliance)
{
    const size_t stride = capacitance->stride;
    const int32_t *vertices = capacitance->vertices;
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++) {
        const int32_t rows = list_domain(model, vertices, capacitance->count, d, scratch->index);
        if (rows == 0) continue;
        const pliant_reconstruction *plan = &capacitance->plan[d];
        const int32_t *slot_of = scratch->domain[d].slot_of;
        pliant_reconstruction_map(plan, &scratch->domain[d]);
        for (int32_t j = 0; j < capacitance->count; j++) {
            const pliant_columns *columns = &model->greens[d][model->domain[vertices[j]]];
            load_column(columns, model->position[vertices[j]], slot_of, plan->slot_count,
                        scratch->blocks);
            pliant_reconstruction_run_blocks(plan, scratch->blocks);
            for (int32_t i = 0; i < rows; i++) {
                const int32_t member = scratch->index[i];
                const float *from =
                    scratch->blocks + (size_t)capacitance->slot[member] * block_floats;
                double *to = compliance + 3 * (size_t)member + 3 * (size_t)j * stride;
                for (int r = 0; r < 3; r++)
                    for (int c = 0; c < 3; c++) to[r + (size_t)c * stride] = from[3 * r + c];
            }
        }
        pliant_reconstruction_unmap(plan, &scratch->domain[d]);
    }
    for (size_t j = 0; j < 3 * (size_t)capacitance->count; j++)
        for (size_t i = 3 * (size_t)capacitance->count; i < stride; i++)
            compliance[i + j * stride] = 0;
}

// Weight rows by areas and scale rows and columns so that the diagonal is +-1: free and fixed nodes
// differ in units, and large and small triangles in size. A diagonal that compression destroyed,
// under 2^-20 of its domain's largest, says nothing about its node, which then counts as one of the
// largest.
static void weigh(const pliant_model *model, const pliant_capacitance *capacitance, double *matrix,
                  double *scale)
{
    const size_t n = 3 * (size_t)capacitance->count, stride = capacitance->stride;
    const int32_t *vertices = capacitance->vertices;
    double most[PLIANT_DOMAIN_COUNT] = {0};
    for (size_t k = 0; k < n; k++) {
        scale[k] = fabs(matrix[k + k * stride]) * model->areas[vertices[k / 3]];
        const int32_t d = model->domain[vertices[k / 3]];
        most[d] = fmax(most[d], scale[k]);
    }
    for (size_t k = 0; k < n; k++) {
        const double limit = most[model->domain[vertices[k / 3]]];
        const double diagonal = scale[k] >= 0x1p-20 * limit ? scale[k] : limit;
        scale[k] = diagonal > 0 && isfinite(1 / sqrt(diagonal)) ? 1 / sqrt(diagonal) : 1;
    }
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            matrix[i + j * stride] *= model->areas[vertices[i / 3]] * scale[i] * scale[j];
}

// Is the symmetric part of `matrix` + shift I positive definite? Uses work_matrix.
static int32_t is_definite(const double *matrix, size_t n, size_t stride, double shift,
                           pliant_capacitance_scratch *scratch)
{
    double *half = scratch->work_matrix;
    for (size_t j = 0; j < n; j++) {
        for (size_t i = j; i < n; i++)
            half[i + j * stride] = (matrix[i + j * stride] + matrix[j + i * stride]) / 2;
        for (size_t i = n; i < stride; i++) half[i + j * stride] = 0;
        half[j + j * stride] += shift;
    }
    return pliant_dense_definite(n, stride, half, scratch->work);
}

// Invert a copy of `matrix` + shift I into work_matrix.
static double invert_shifted(const double *matrix, size_t n, size_t stride, double shift,
                             pliant_capacitance_scratch *scratch)
{
    memcpy(scratch->work_matrix, matrix, n * stride * sizeof *matrix);
    for (size_t k = 0; k < n; k++) scratch->work_matrix[k + k * stride] += shift;
    return pliant_dense_invert(n, stride, scratch->work_matrix, scratch->pivots, scratch->work);
}

// C^-1 = - (E^T Xi E)^-1, with the scaling undone. 0 when it does not fit into floats.
static int32_t store_inverse(const pliant_model *model, pliant_capacitance *capacitance,
                             const pliant_capacitance_scratch *scratch)
{
    const size_t n = 3 * (size_t)capacitance->count, stride = capacitance->stride;
    float largest = 0;
    for (size_t j = 0; j < n; j++) {
        const double column_scale = -scratch->scale[j] * model->areas[capacitance->vertices[j / 3]];
        float *to = capacitance->inverse + j * stride;
        for (size_t i = 0; i < n; i++) {
            to[i] =
                (float)(scratch->work_matrix[i + j * stride] * scratch->scale[i] * column_scale);
            largest = fmaxf(largest, isfinite(to[i]) ? fabsf(to[i]) : INFINITY);
        }
        for (size_t i = n; i < stride; i++) to[i] = 0;
    }
    return isfinite(largest);
}

void pliant_capacitance_build(const pliant_model *model, const int32_t *vertices, int32_t count,
                              pliant_capacitance_scratch *scratch, pliant_capacitance *capacitance)
{
    pliant_capacitance_plan(model, vertices, count, scratch, capacitance);
    pliant_capacitance_extract(model, capacitance, scratch, scratch->compliance);
    const size_t n = 3 * (size_t)count, stride = capacitance->stride;
    const double *matrix = scratch->compliance;
    weigh(model, capacitance, scratch->compliance, scratch->scale);

    // Entries carry float rounding, n of them a row: pivots below n 2^-24 of the largest are noise.
    const double least_pivot = (double)n * 0x1p-24;
    capacitance->status = is_definite(matrix, n, stride, 0, scratch) ? PLIANT_OK : PLIANT_ROUGH;
    if (invert_shifted(matrix, n, stride, 0, scratch) > least_pivot &&
        store_inverse(model, capacitance, scratch))
        return;
    // With entries of at most about one no eigenvalue is below -n, and 2^-20 times 16^15 is far
    // beyond.
    capacitance->status = PLIANT_ROUGH;
    double shift = 0x1p-20;
    for (int attempt = 0; attempt <= 15; attempt++, shift *= 16)
        if (is_definite(matrix, n, stride, shift, scratch) &&
            invert_shifted(matrix, n, stride, shift, scratch) > least_pivot &&
            store_inverse(model, capacitance, scratch))
            return;
    // Nothing to be had from this matrix: contact gives way without force.
    memset(capacitance->inverse, 0, n * stride * sizeof *capacitance->inverse);
}
