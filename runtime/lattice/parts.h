// parts.h: what columns.c and fit_columns.c do alike for irregular regions, whatever is summed.
//
// A kind of sums has `count` fields, and moments along z of its first `with`; sites and plates hold
// the fields, regions the moments too. Static inline, so that both are constants.
#pragma once

#include "lattice/body.h"
#include "lattice/window.h"

// ---- Repairs: what makes a block's window sums those of its regions ----
//
//     sums = keep * window + more
//
// In memory keep, shape [8], then more, shape [fields][8]. scratch->repair_of says which of
// scratch->repairs a place of the column has.

#define PLIANT_REPAIR_FLOATS (16 * PLIANT_LANES)

PLIANT_INLINE void pliant_repairs_begin(pliant_scratch *scratch, int32_t length)
{
    for (int32_t s = 0; s < length; s++) scratch->repair_of[s] = -1;
}

// The repair of place s, made if there is none; `used` counts them.
PLIANT_INLINE float *pliant_repair_at(pliant_scratch *scratch, int32_t s, int32_t fields,
                                      int32_t *used)
{
    if (scratch->repair_of[s] >= 0)
        return scratch->repairs + (size_t)scratch->repair_of[s] * PLIANT_REPAIR_FLOATS;
    scratch->repair_of[s] = (*used)++;
    float *repair = scratch->repairs + (size_t)scratch->repair_of[s] * PLIANT_REPAIR_FLOATS;
    pliant_f8_store(repair, pliant_f8_all(1.0f));
    for (int32_t f = 0; f < fields; f++) pliant_f8_store(repair + 8 * (1 + f), (pliant_f8){0});
    return repair;
}

PLIANT_INLINE void pliant_repair_apply(const pliant_scratch *scratch, int32_t s, int32_t fields,
                                       float *sums)
{
    if (scratch->repair_of[s] < 0) return;
    const float *repair = scratch->repairs + (size_t)scratch->repair_of[s] * PLIANT_REPAIR_FLOATS;
    const pliant_f8 keep = pliant_f8_load(repair);
    for (int32_t f = 0; f < fields; f++)
        pliant_f8_store(sums + 8 * f,
                        keep * pliant_f8_load(sums + 8 * f) + pliant_f8_load(repair + 8 * (1 + f)));
}

// Less or instead: the sums of the column's regions that are made of parts, from `sites` (of the
// column's first on) and `plates` (shape [plate][count]).
PLIANT_INLINE void pliant_repair_parts(const pliant_body *body, int32_t column, const float *sites,
                                       const float *plates, const int32_t count, const int32_t with,
                                       int32_t *used, pliant_scratch *scratch)
{
    const int32_t w = body->lattice->half_width;
    const pliant_irregular *irregular = body->irregular;
    for (int32_t n = irregular->column_head[column]; n >= 0; n = irregular->regions[n].next) {
        const pliant_region_node *node = &irregular->regions[n];
        const pliant_part *parts = irregular->parts + (size_t)n * (2 * w + 1);
        const int32_t s = node->z - body->lattice->columns[column].z;
        float total[18] = {0};
        for (int32_t i = 0; i < node->part_count; i++) {
            const int32_t is_plate = parts[i].plate >= 0, apart = is_plate ? 1 : PLIANT_LANES;
            const float *from =
                is_plate ? plates + (size_t)parts[i].plate * count
                         : sites + (size_t)(s + parts[i].plane) * count * PLIANT_LANES + node->lane;
            const float dz = (float)(parts[i].plane - w);
            for (int32_t f = 0; f < count; f++) total[f] += from[apart * f];
            for (int32_t f = 0; f < with; f++) total[count + f] += dz * from[apart * f];
        }
        float *repair = pliant_repair_at(scratch, s, count + with, used);
        repair[node->lane] = node->sign < 0 ? 1 : 0;
        for (int32_t f = 0; f < count + with; f++)
            repair[8 * (1 + f) + node->lane] = (float)node->sign * total[f];
    }
}

// ---- On the way back ----

// What regions made of parts hand on is set aside, shape [region of the column][fields] in
// scratch->apart; those made of their parts alone leave the windows.
PLIANT_INLINE void pliant_turns_set_apart(const pliant_body *body, int32_t column, int32_t fields,
                                          float *turns, pliant_scratch *scratch)
{
    const pliant_irregular *irregular = body->irregular;
    float *apart = scratch->apart;
    for (int32_t n = irregular->column_head[column]; n >= 0; n = irregular->regions[n].next) {
        const pliant_region_node *node = &irregular->regions[n];
        const size_t s = (size_t)(node->z - body->lattice->columns[column].z);
        float *turn = turns + s * fields * PLIANT_LANES + node->lane;
        for (int32_t f = 0; f < fields; f++, apart++) {
            *apart = turn[8 * f];
            if (node->sign > 0) turn[8 * f] = 0;
        }
    }
}

// Plates of the column's regions hold nothing yet; `count` floats of each.
PLIANT_INLINE void pliant_plates_clear(const pliant_body *body, int32_t column, float *plates,
                                       int32_t count)
{
    const pliant_irregular *irregular = body->irregular;
    const int32_t width = 2 * body->lattice->half_width + 1;
    for (int32_t n = irregular->column_head[column]; n >= 0; n = irregular->regions[n].next)
        for (int32_t i = 0; i < irregular->regions[n].part_count; i++) {
            const int32_t plate = irregular->parts[(size_t)n * width + i].plate;
            if (plate >= 0) memset(plates + (size_t)plate * count, 0, count * sizeof *plates);
        }
}

// Sites outside the lattice, or in slabs without blocks, hold nothing: what the last step left
// there goes. `sites` is of the column's first on.
PLIANT_INLINE void pliant_sites_clear(const pliant_lattice *lattice, int32_t column, float *sites,
                                      int32_t count)
{
    const pliant_lattice_column *c = &lattice->columns[column];
    const size_t floats = (size_t)count * PLIANT_LANES;
    for (int32_t s = 0; s < c->length + 2 * lattice->half_width; s++) {
        const int32_t z = c->z - lattice->half_width + s;
        if (z < 0 || z >= lattice->dims[2] || lattice->slab_first[z] == lattice->slab_first[z + 1])
            memset(sites + s * floats, 0, floats * sizeof *sites);
    }
}
