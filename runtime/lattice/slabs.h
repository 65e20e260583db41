// slabs.h: what plates.c and fit_slabs.c do alike in a slab, whatever is summed.
//
// Bars have `with + plain` fields, the first `with` of which get moments along y; a site has the
// fields, then the moments. Static inline, so that the counts are constants.
#pragma once

#include "lattice/body.h"
#include "lattice/window.h"

// More zeros than any site has floats: what lies outside.
static const float pliant_slab_zeros[16 * PLIANT_LANES];

// The site of a column in slab z, of `count` fields; NULL: it has none there.
static inline float *pliant_slab_site(const pliant_lattice *lattice, float *sites, int32_t count,
                                      int32_t column, int32_t z)
{
    if (column < 0) return NULL;
    const pliant_lattice_column *c = &lattice->columns[column];
    const int32_t w = lattice->half_width, s = z - c->z + w;
    if (s < 0 || s >= c->length + 2 * w) return NULL;
    return sites + (size_t)(c->first_site + s) * count * PLIANT_LANES;
}

// Of a row (y, z) in padded rows: the fields of its particles that others' regions lack, one after
// another, `stride` floats apart; *k counts them along the slab.
PLIANT_INLINE void pliant_slab_list(const pliant_lattice *lattice, int32_t y, int32_t z,
                                    const float *rows, const int32_t fields, float *listed,
                                    const int32_t stride, int32_t *k)
{
    const size_t length = pliant_row_length(lattice->row_blocks);
    for (; *k < lattice->exceptions.slab_first[z + 1]; ++*k) {
        const int32_t *at = lattice->places + 3 * (size_t)lattice->exceptions.particle[*k];
        if (at[1] != y) return;
        float *to = listed + (size_t)stride * *k;
        for (int f = 0; f < fields; f++) to[f] = rows[f * length + PLIANT_ROW_PAD + at[0]];
    }
}

// Plates (LSM-4, 6): sums along y of bars, shape [row_blocks][dims y][with + plain][8], of the
// slab's rows, into the slab's sites.
PLIANT_INLINE void pliant_slab_gather(const pliant_lattice *lattice, int32_t z, const float *bars,
                                      float *sites, const int32_t with, const int32_t plain,
                                      pliant_scratch *scratch)
{
    const int32_t w = lattice->half_width, ny = lattice->dims[1], fields = with + plain;
    const int32_t *range = lattice->slab_rows + 2 * z;
    const int32_t first = range[0] - w, last = range[1] + w;  // plates that hold anything
    for (int32_t k = 0; k < lattice->row_blocks; k++) {
        const float *strip = bars + (size_t)k * ny * fields * PLIANT_LANES;
        for (int32_t y = first - w; y < last + w; y++)
            scratch->strip[y - (first - w)] = y < range[0] || y >= range[1]
                                                  ? pliant_slab_zeros
                                                  : strip + (size_t)y * fields * PLIANT_LANES;
        pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
        for (int32_t y = 0; y < ny; y++) {
            if (y >= first && y < last) continue;
            float *site = pliant_slab_site(lattice, sites, fields + with,
                                           lattice->column_at[y * lattice->row_blocks + k], z);
            if (site) memset(site, 0, (size_t)(fields + with) * PLIANT_LANES * sizeof *site);
        }
        for (int32_t y = first; y < last; y++) {
            const int32_t column =
                y < 0 || y >= ny ? -1 : lattice->column_at[y * lattice->row_blocks + k];
            float *site = pliant_slab_site(lattice, sites, fields + with, column, z);
            if (!site && w <= PLIANT_WINDOW_DIRECT) continue;
            pliant_f8 sums[PLIANT_WINDOW_FIELDS], moments[3];
            pliant_window_next(&window, y - first, with, plain, sums, moments);
            if (!site) continue;
            for (int f = 0; f < fields; f++) pliant_f8_store(site + 8 * f, sums[f]);
            for (int f = 0; f < with; f++) pliant_f8_store(site + 8 * (fields + f), moments[f]);
        }
    }
}

// On the way back: the strip of the slab's sites in block k of every row, from w below the slab's
// first row to w above its last, for windows along y. Sites have `count` fields.
PLIANT_INLINE pliant_window pliant_slab_strip(const pliant_lattice *lattice, int32_t z, int32_t k,
                                              float *sites, int32_t count, pliant_scratch *scratch)
{
    const int32_t w = lattice->half_width;
    const int32_t *range = lattice->slab_rows + 2 * z;
    for (int32_t y = range[0] - w; y < range[1] + w; y++) {
        const int32_t column =
            y < 0 || y >= lattice->dims[1] ? -1 : lattice->column_at[y * lattice->row_blocks + k];
        const float *site = pliant_slab_site(lattice, sites, count, column, z);
        scratch->strip[y - (range[0] - w)] = site ? site : pliant_slab_zeros;
    }
    return (pliant_window){.w = w, .rows = scratch->strip, .tails = scratch->tails};
}
