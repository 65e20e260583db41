// wavelet_rows.h: the offline transforms, included by wavelet.c once for each real type.
//
// `real` is the type, named(f) the function's name for it.
#include "pliant/wavelet.h"

// Every transform is a sequence of two linear maps a level, on the odd rows from their stencils
// and on the parents from their odd children, applied with a sign, or transposed.

static inline void named(axpy)(int32_t width, real a, const real *restrict x, real *restrict y)
{
    for (int32_t c = 0; c < width; c++) y[c] += a * x[c];
}

// x_m += sign sum_k w_mk x_k for the odd positions of level l + 1. The stencil's rows are summed in
// one sweep: the odd row is read and written once.
static inline void named(predict)(const pliant_wavelet *w, int32_t l, real sign, int32_t width, real *x)
{
    const size_t size = (size_t)w->stencil_size;
    for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++) {
        const size_t entry = (size_t)(p - w->level_offset[1]) * size;
        real *restrict y = x + (size_t)p * width;
        real weight[PLIANT_STENCIL_LIMIT];
        const real *row[PLIANT_STENCIL_LIMIT];
        for (size_t k = 0; k < size; k++) {
            weight[k] = sign * (real)w->predict_weight[entry + k];
            row[k] = x + (size_t)w->predict_node[entry + k] * width;
        }
        if (size == 2)
            for (int32_t c = 0; c < width; c++) y[c] += weight[0] * row[0][c] + weight[1] * row[1][c];
        else
            for (int32_t c = 0; c < width; c++)
                y[c] += weight[0] * row[0][c] + weight[1] * row[1][c] + weight[2] * row[2][c] +
                        weight[3] * row[3][c] + weight[4] * row[4][c] + weight[5] * row[5][c] +
                        weight[6] * row[6][c] + weight[7] * row[7][c];
    }
}

// x_k += w_mk x_m: the transpose. The zero row gathers garbage and is cleared by the caller.
static inline void named(predict_transpose)(const pliant_wavelet *w, int32_t l, int32_t width, real *x)
{
    const size_t size = (size_t)w->stencil_size;
    for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++) {
        const size_t entry = (size_t)(p - w->level_offset[1]) * size;
        for (size_t k = 0; k < size; k++)
            named(axpy)(width, (real)w->predict_weight[entry + k], x + (size_t)p * width,
                 x + (size_t)w->predict_node[entry + k] * width);
    }
}

// x_a += sign s_ma x_m for both parents of the odd positions of level l + 1.
static inline void named(update)(const pliant_wavelet *w, int32_t l, real sign, int32_t width, real *x)
{
    if (w->def.lifting == PLIANT_UNLIFTED) return;
    for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++)
        for (int k = 0; k < 2; k++) {
            const size_t entry = 2 * (size_t)(p - w->level_offset[1]) + k;
            if (w->update_node[entry] == w->count) continue;
            named(axpy)(width, sign * (real)w->update_weight[entry], x + (size_t)p * width,
                 x + (size_t)w->update_node[entry] * width);
        }
}

// x_m -= s_ma x_a: the transpose of undoing the update.
static inline void named(update_transpose)(const pliant_wavelet *w, int32_t l, int32_t width, real *x)
{
    if (w->def.lifting == PLIANT_UNLIFTED) return;
    for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++)
        for (int k = 0; k < 2; k++) {
            const size_t entry = 2 * (size_t)(p - w->level_offset[1]) + k;
            if (w->update_node[entry] == w->count) continue;
            named(axpy)(width, -(real)w->update_weight[entry], x + (size_t)w->update_node[entry] * width,
                 x + (size_t)p * width);
        }
}

PLIANT_VECTOR_CLONES
void named(pliant_wavelet_forward)(const pliant_wavelet *w, int32_t width, real *x)
{
    for (int32_t l = w->level_count - 2; l >= 0; l--) {
        named(predict)(w, l, -1, width, x);
        named(update)(w, l, +1, width, x);
    }
}

PLIANT_VECTOR_CLONES
void named(pliant_wavelet_inverse)(const pliant_wavelet *w, int32_t level, int32_t width, real *x)
{
    for (int32_t l = 0; l < level; l++) {
        named(update)(w, l, -1, width, x);
        named(predict)(w, l, +1, width, x);
    }
}

PLIANT_VECTOR_CLONES
void named(pliant_wavelet_inverse_transpose)(const pliant_wavelet *w, int32_t width, real *x)
{
    real *zero_row = x + (size_t)w->count * width;
    for (int32_t l = w->level_count - 2; l >= 0; l--) {
        named(predict_transpose)(w, l, width, x);
        memset(zero_row, 0, (size_t)width * sizeof *zero_row);
        named(update_transpose)(w, l, width, x);
    }
}
