// fit_columns.c: the fits of the regions of one column of blocks.
#include "lattice/fits.h"
#include "lattice/parts.h"
#include "pliant/vector_clones.h"

static const float zero_turn[PLIANT_FIT_TURN_COUNT * PLIANT_LANES];

// ---- Regions ----

PLIANT_INLINE void find_repairs(const pliant_body *body, int32_t column, const float *sites,
                                pliant_scratch *scratch)
{
    const pliant_exceptions *e = &body->lattice->exceptions;
    int32_t used = 0;
    pliant_repairs_begin(scratch, body->lattice->columns[column].length);
    for (int32_t i = e->column_first[column]; i < e->column_first[column + 1]; i++) {
        const pliant_exception_place *place = &e->column_items[i];
        const int32_t k = place->k;
        if (!body->is_listed[k]) continue;
        pliant_f8 low = {0}, high = {0};
        for (int32_t j = e->first[k]; j < e->first[k + 1]; j++) {
            const float *values = body->listed_fits + 16 * (size_t)e->other[j];
            low += pliant_f8_load(values);
            high += pliant_f8_load(values + 8);
        }
        float *repair =
            pliant_repair_at(scratch, place->s, PLIANT_FIT_COUNT, &used) + 8 + place->lane;
        for (int f = 0; f < PLIANT_FIT_COUNT; f++) repair[8 * f] = f < 8 ? -low[f] : -high[f - 8];
    }
    pliant_repair_parts(body, column, sites, body->fit_plates, PLIANT_FIT_COUNT, 0, &used, scratch);
}

// (v_r, omega_r) of LSM-13, 14 from the sums, as a + omega cross x:
//     L = sum m~ x cross v - M c cross v_r,  I = sum m~ [x]^T[x] - M [c]^T[c],  omega = I^-1 L
// What rounding may have made of I is bounded by raising its diagonal: by 1e-5 of its trace, and by
// what the cancelled squares leave.
PLIANT_INLINE void fit_block(const pliant_region_constants *constants, const pliant_f8 *sums,
                             float *turn)
{
    const pliant_f8 is_particle = pliant_f8_load(constants->is_particle);
    const pliant_f8 inverse_mass = pliant_f8_load(constants->inverse_mass);
    pliant_f8 v[3], centre[3], spin[3], square[3], product[3];
    for (int c = 0; c < 3; c++) {
        v[c] = sums[PLIANT_FIT_V + c] * inverse_mass;
        centre[c] = sums[PLIANT_FIT_X + c] * inverse_mass;
    }
    pliant_f8 far = {0};
    for (int c = 0; c < 3; c++) far += sums[PLIANT_FIT_X + c] * centre[c];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        spin[c] = sums[PLIANT_FIT_SPIN + c] -
                  (sums[PLIANT_FIT_X + d] * v[e] - sums[PLIANT_FIT_X + e] * v[d]);
        square[c] = sums[PLIANT_FIT_SQUARE + c] - (far - sums[PLIANT_FIT_X + c] * centre[c]);
        product[c] = -(sums[PLIANT_FIT_PRODUCT + c] - sums[PLIANT_FIT_X + d] * centre[e]);
    }
    const pliant_f8 raise =
        1e-5f * (square[0] + square[1] + square[2]) + 1e-6f * far + pliant_f8_all(1e-30f);
    // Scaled so that the determinant neither overflows nor is denormal.
    const pliant_f8 scale = 1 / (square[0] + square[1] + square[2] + 4 * raise);
    const pliant_f8 a = (square[0] + raise) * scale, b = (square[1] + raise) * scale,
                    c = (square[2] + raise) * scale;
    const pliant_f8 yz = product[0] * scale, xz = product[1] * scale, xy = product[2] * scale;
    const pliant_f8 cxx = b * c - yz * yz, cyy = a * c - xz * xz, czz = a * b - xy * xy;
    const pliant_f8 cxy = yz * xz - c * xy, cxz = yz * xy - b * xz, cyz = xz * xy - a * yz;
    const pliant_f8 determinant = a * cxx + xy * cxy + xz * cxz;
    // A matrix that is not definite in spite of it all turns nothing.
    const pliant_bits8 definite = (determinant > 1e-12f) & (cxx > 0.0f) & (a > 0.0f);
    pliant_f8 factor = (pliant_f8)((pliant_bits8)(scale / determinant) & definite);
    factor *= is_particle;
    pliant_f8 omega[3];
    omega[0] = factor * (cxx * spin[0] + cxy * spin[1] + cxz * spin[2]);
    omega[1] = factor * (cxy * spin[0] + cyy * spin[1] + cyz * spin[2]);
    omega[2] = factor * (cxz * spin[0] + cyz * spin[1] + czz * spin[2]);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        pliant_f8_store(turn + 8 * (PLIANT_FIT_TURN_A + i),
                        is_particle * (v[i] - (omega[j] * centre[l] - omega[l] * centre[j])));
        pliant_f8_store(turn + 8 * (PLIANT_FIT_TURN_OMEGA + i), omega[i]);
    }
}

PLIANT_INLINE void fit_regions(pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_lattice_column *c = &lattice->columns[column];
    const int32_t w = lattice->half_width;
    for (int32_t s = 0; s < c->length + 2 * w; s++)
        scratch->strip[s] = body->fit_sites + (size_t)(c->first_site + s) * PLIANT_FIT_FLOATS;
    pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
    for (int32_t s = 0; s < c->length; s++) {
        float *turn = scratch->turns + (size_t)s * (PLIANT_FIT_TURN_COUNT * PLIANT_LANES);
        const int32_t block = lattice->turn_block[c->first_turn + s];
        pliant_f8 sums[PLIANT_FIT_COUNT], none[1];
        if (block >= 0 || w > PLIANT_WINDOW_DIRECT)
            pliant_window_next(&window, s, 0, PLIANT_FIT_COUNT, sums, none);
        if (block < 0) {
            memset(turn, 0, (PLIANT_FIT_TURN_COUNT * PLIANT_LANES) * sizeof *turn);
            continue;
        }
        float repaired[PLIANT_FIT_FLOATS];
        if (scratch->repair_of[s] >= 0) {
            for (int f = 0; f < PLIANT_FIT_COUNT; f++) pliant_f8_store(repaired + 8 * f, sums[f]);
            pliant_repair_apply(scratch, s, PLIANT_FIT_COUNT, repaired);
            for (int f = 0; f < PLIANT_FIT_COUNT; f++) sums[f] = pliant_f8_load(repaired + 8 * f);
        }
        fit_block(&body->region_constants[body->region_constants_of[c->first_turn + s]], sums,
                  turn);
    }
}

// ---- Back ----

static void list_turns(pliant_body *body, int32_t column, const float *turns)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_exceptions *e = &lattice->exceptions;
    for (int32_t i = e->column_first[column]; i < e->column_first[column + 1]; i++) {
        const pliant_exception_place *place = &e->column_items[i];
        const int32_t k = place->k;
        const float *turn =
            turns + (size_t)place->s * (PLIANT_FIT_TURN_COUNT * PLIANT_LANES) + place->lane;
        float *to = body->listed_turns + 16 * (size_t)k;
        for (int f = 0; f < PLIANT_FIT_TURN_COUNT; f++)
            to[f] = body->is_listed[k] ? turn[8 * f] : 0;
    }
}

// A site holds on the way back what its plate's particles are handed: 6 fields.
PLIANT_INLINE void spread_regions(pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_lattice_column *c = &body->lattice->columns[column];
    const int32_t w = body->lattice->half_width;
    for (int32_t s = 0; s < 2 * w; s++)
        scratch->strip[s] = scratch->strip[2 * w + c->length + s] = zero_turn;
    for (int32_t s = 0; s < c->length; s++)
        scratch->strip[2 * w + s] =
            scratch->turns + (size_t)s * (PLIANT_FIT_TURN_COUNT * PLIANT_LANES);
    pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
    for (int32_t s = 0; s < c->length + 2 * w; s++) {
        pliant_f8 sums[PLIANT_FIT_TURN_COUNT], none[1];
        pliant_window_next(&window, s, 0, PLIANT_FIT_TURN_COUNT, sums, none);
        float *site = body->fit_sites + (size_t)(c->first_site + s) * PLIANT_FIT_FLOATS;
        for (int f = 0; f < PLIANT_FIT_TURN_COUNT; f++) pliant_f8_store(site + 8 * f, sums[f]);
    }
}

static void spread_apart(pliant_body *body, int32_t column, const pliant_scratch *scratch)
{
    const pliant_irregular *irregular = body->irregular;
    const pliant_lattice_column *c = &body->lattice->columns[column];
    const int32_t width = 2 * body->lattice->half_width + 1;
    pliant_plates_clear(body, column, body->fit_plates, PLIANT_FIT_COUNT);
    const float *turn = scratch->apart;
    for (int32_t n = irregular->column_head[column]; n >= 0;
         n = irregular->regions[n].next, turn += PLIANT_FIT_TURN_COUNT) {
        const pliant_region_node *node = &irregular->regions[n];
        for (int32_t i = 0; i < node->part_count; i++) {
            const pliant_part *part = &irregular->parts[(size_t)n * width + i];
            float *to = part->plate >= 0
                            ? body->fit_plates + (size_t)part->plate * PLIANT_FIT_COUNT
                            : body->fit_sites +
                                  (size_t)(c->first_site + node->z - c->z + part->plane) *
                                      PLIANT_FIT_FLOATS +
                                  node->lane;
            const int32_t apart = part->plate >= 0 ? 1 : PLIANT_LANES;
            for (int f = 0; f < PLIANT_FIT_TURN_COUNT; f++)
                to[apart * f] += (float)node->sign * turn[f];
        }
    }
}

PLIANT_VECTOR_CLONES
void pliant_fits_match(pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    float *sites =
        body->fit_sites + (size_t)lattice->columns[column].first_site * PLIANT_FIT_FLOATS;
    pliant_sites_clear(lattice, column, sites, PLIANT_FIT_COUNT);
    find_repairs(body, column, sites, scratch);
    fit_regions(body, column, scratch);
    list_turns(body, column, scratch->turns);
    pliant_turns_set_apart(body, column, PLIANT_FIT_TURN_COUNT, scratch->turns, scratch);
    spread_regions(body, column, scratch);
    spread_apart(body, column, scratch);
}
