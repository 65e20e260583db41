// wavelet_online.c: the inverse transform as it runs in every frame, on rows of four floats.
//
// It reads rows of 16 bytes all over arrays that fit the first two caches, so its time is that of
// load instructions: those of rows, and as many of row numbers. Measured at 2143 nodes (Sapphire
// Rapids, three loads a cycle), whole transform:
//
//     butterfly   4.1 us  a stencil of eight row numbers for every odd position
//                 3.4     the numbers multiplied out, 16 or 32 bits
//                 2.8     odd positions in threes that share rows (pliant_wavelet_triple), 32 bits
//                 2.5     the same with 16 bits
//     linear      1.3     with fused products 1.15; numbers multiplied out 1.13
//     the update  2.1     gathered by parent; scattered from the odd rows twice that, because every
//                         scatter reads a row that another has just written; but a scatter of few
//                         rows costs next to nothing (a column or ten: 40 to 400 of them)
#include "pliant/wavelet.h"

#include "pliant/vector_clones.h"

typedef float row __attribute__((vector_size(16)));

#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

// x_a -= sum of s_ma gamma_m over the odd children m that level l + 1 adds.
INLINE void undo_update(const pliant_wavelet *w, int32_t l, row *restrict g)
{
    const int32_t *offset = w->update_offset[l];
    const int32_t *odd = w->update_odd;
    const float *weight = w->update_odd_weight;
    for (int32_t a = 0; a < w->level_offset[l + 1]; a++) {
        row sum = g[a];
        for (int32_t e = offset[a]; e < offset[a + 1]; e++) sum -= weight[e] * g[odd[e]];
        g[a] = sum;
    }
}

// The same from the odd rows that `support` marks.
INLINE void undo_update_of(const pliant_wavelet *w, int32_t l, const uint64_t *support, row *g)
{
    const int32_t begin = w->level_offset[l + 1], end = w->level_offset[l + 2];
    for (int32_t word = begin / 64; 64 * word < end; word++) {
        uint64_t bits = support[word];
        if (64 * word < begin) bits &= ~UINT64_C(0) << (begin - 64 * word);
        if (64 * word + 64 > end) bits &= ~UINT64_C(0) >> (64 * word + 64 - end);
        for (; bits; bits &= bits - 1) {
            const int32_t p = 64 * word + __builtin_ctzll(bits);
            const size_t entry = 2 * (size_t)(p - w->level_offset[1]);
            // A parent outside the domain is the zero row, with weight 0.
            for (int k = 0; k < 2; k++)
                g[w->update_node[entry + k]] -= (float)w->update_weight[entry + k] * g[p];
        }
    }
}

// x_m = gamma_m + sum_k w_mk x_k, with the weights as they are away from the border.
INLINE void predict_linear(const pliant_wavelet *w, int32_t l, row *g)
{
    const int32_t *node =
        w->predict_node + 2 * (size_t)(w->level_offset[l + 1] - w->level_offset[1]);
    for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++, node += 2)
        g[p] += 0.5f * (g[node[0]] + g[node[1]]);
}

INLINE row butterfly(const pliant_wavelet *w, int32_t p, const row *g)
{
    const int32_t *node = w->predict_node + 8 * (size_t)(p - w->level_offset[1]);
    return 0.5f * (g[node[0]] + g[node[1]]) + 0.125f * (g[node[2]] + g[node[3]]) -
           0.0625f * ((g[node[4]] + g[node[5]]) + (g[node[6]] + g[node[7]]));
}

INLINE row *at(row *g, uint16_t number)
{
    return (row *)((char *)g + 8 * (size_t)number);
}

INLINE row butterfly_of(const pliant_wavelet_triple *t, int k, row shared, row corner, row across,
                        row *g)
{
    return shared - 0.375f * corner + 0.1875f * across -
           0.0625f * (*at(g, t->outer[k][0]) + *at(g, t->outer[k][1]));
}

INLINE void predict_triple(const pliant_wavelet_triple *t, row *g)
{
    const row a = *at(g, t->corner[0]), b = *at(g, t->corner[1]), c = *at(g, t->corner[2]);
    const row x = *at(g, t->across[0]), y = *at(g, t->across[1]), z = *at(g, t->across[2]);
    const row shared = 0.5f * (a + b + c) - 0.0625f * (x + y + z);
    row *to[3] = {at(g, t->odd[0]), at(g, t->odd[1]), at(g, t->odd[2])};
    const row first = *to[0] + butterfly_of(t, 0, shared, a, x, g);
    const row second = *to[1] + butterfly_of(t, 1, shared, b, y, g);
    const row third = *to[2] + butterfly_of(t, 2, shared, c, z, g);
    // A third that is not wanted has the place of the first, which overwrites it.
    *to[2] = third;
    *to[1] = second;
    *to[0] = first;
}

INLINE void predict_butterfly(const pliant_wavelet *w, int32_t l, row *g)
{
    if (!w->triples) {
        for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++)
            g[p] += butterfly(w, p, g);
        return;
    }
    for (int32_t i = w->triple_offset[l]; i < w->triple_offset[l + 1]; i++)
        predict_triple(&w->triples[i], g);
    for (int32_t i = w->single_offset[l]; i < w->single_offset[l + 1]; i++)
        g[w->singles[i]] += butterfly(w, w->singles[i], g);
}

INLINE void predict_weighted(const pliant_wavelet *w, int32_t l, row *g)
{
    const int32_t size = w->stencil_size;
    for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++) {
        const size_t entry = (size_t)(p - w->level_offset[1]) * (size_t)size;
        row sum = g[p];
        for (int32_t k = 0; k < size; k++)
            sum += w->predict_weight_f[entry + k] * g[w->predict_node[entry + k]];
        g[p] = sum;
    }
}

INLINE void inverse(const pliant_wavelet *w, int32_t level, const uint64_t *support, row *g)
{
    for (int32_t l = 0; l < level; l++) {
        if (w->def.lifting == PLIANT_LIFTED) {
            if (support) undo_update_of(w, l, support, g);
            else undo_update(w, l, g);
        }
        if (w->def.boundary == PLIANT_DROP) predict_weighted(w, l, g);
        else if (w->def.scheme == PLIANT_LINEAR) predict_linear(w, l, g);
        else predict_butterfly(w, l, g);
    }
}

PLIANT_VECTOR_CLONES
void pliant_wavelet_inverse_online(const pliant_wavelet *w, int32_t level, float *g)
{
    inverse(w, level, NULL, (row *)g);
}

PLIANT_VECTOR_CLONES
void pliant_wavelet_inverse_online_sparse(const pliant_wavelet *w, int32_t level,
                                          const uint64_t *support, float *g)
{
    inverse(w, level, support, (row *)g);
}
