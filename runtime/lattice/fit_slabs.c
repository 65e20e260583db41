// fit_slabs.c: the sums of fits over bars and plates, and what comes back to the particles.
#include "lattice/fits.h"
#include "lattice/slabs.h"
#include "pliant/vector_clones.h"

// ---- There ----

// The fit's fields of a block's particles, of what their velocities are beyond the whole's motion.
PLIANT_INLINE void fields_of(const pliant_body *body, const pliant_rigid_field *whole,
                             int32_t block, pliant_f8 *fields)
{
    const pliant_f8 share =
        pliant_f8_load(body->particle_constants[body->particle_constants_of[block]].share);
    const float *xs = body->x + (size_t)block * 3 * PLIANT_LANES;
    const float *vs = body->v + (size_t)block * 3 * PLIANT_LANES;
    pliant_f8 x[3], v[3], mx[3], rigid[3];
    for (int c = 0; c < 3; c++) x[c] = pliant_f8_load(xs + 8 * c) - pliant_f8_all(body->origin[c]);
    pliant_rigid_field_at(whole, x, rigid);
    for (int c = 0; c < 3; c++) {
        v[c] = pliant_f8_load(vs + 8 * c) - rigid[c];
        mx[c] = share * x[c];
        fields[PLIANT_FIT_V + c] = share * v[c];
        fields[PLIANT_FIT_X + c] = mx[c];
    }
    const pliant_f8 square = mx[0] * x[0] + mx[1] * x[1] + mx[2] * x[2];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        fields[PLIANT_FIT_SPIN + c] = mx[d] * v[e] - mx[e] * v[d];
        fields[PLIANT_FIT_SQUARE + c] = square - mx[c] * x[c];
        fields[PLIANT_FIT_PRODUCT + c] = mx[d] * x[e];
    }
}

PLIANT_INLINE void gather_bars(const pliant_body *body, const pliant_rigid_field *whole, int32_t z,
                               pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t *range = lattice->slab_rows + 2 * z, blocks = lattice->row_blocks;
    const size_t length = pliant_row_length(blocks),
                 apart = (size_t)lattice->dims[1] * PLIANT_FIT_FLOATS;
    int32_t listed = lattice->exceptions.slab_first[z];
    for (int32_t y = range[0]; y < range[1]; y++) {
        const int32_t *block_at = lattice->block_at + ((size_t)z * lattice->dims[1] + y) * blocks;
        for (int32_t k = 0; k < blocks; k++) {
            pliant_f8 fields[PLIANT_FIT_COUNT] = {{0}};
            if (block_at[k] >= 0) fields_of(body, whole, block_at[k], fields);
            for (int f = 0; f < PLIANT_FIT_COUNT; f++)
                pliant_f8_store(scratch->fit_rows + f * length + PLIANT_ROW_PAD + 8 * k, fields[f]);
        }
        pliant_slab_list(lattice, y, z, scratch->fit_rows, PLIANT_FIT_COUNT, body->listed_fits, 16,
                         &listed);
        float *bars = scratch->fit_bars + (size_t)y * PLIANT_FIT_FLOATS;
        for (int f = 0; f < PLIANT_FIT_COUNT; f++)
            pliant_window_along(scratch->fit_rows + f * length + PLIANT_ROW_PAD, NULL, blocks,
                                lattice->half_width, scratch->doubled, bars + 8 * f, NULL, apart);
    }
}

// The fit's fields of one particle, weighed, into values[16].
static void fields_of_one(const pliant_body *body, const pliant_rigid_field *whole, int32_t slot,
                          float *values)
{
    const int32_t block = slot / (3 * PLIANT_LANES);
    const float share =
        body->particle_constants[body->particle_constants_of[block]].share[slot % PLIANT_LANES];
    float x[3], v[3];
    for (int c = 0; c < 3; c++) x[c] = body->x[slot + PLIANT_LANES * c] - body->origin[c];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        v[c] = body->v[slot + PLIANT_LANES * c] -
               (whole->a[c] + (whole->omega[d] * x[e] - whole->omega[e] * x[d]));
        values[PLIANT_FIT_V + c] = share * v[c];
        values[PLIANT_FIT_X + c] = share * x[c];
    }
    const float square = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        values[PLIANT_FIT_SPIN + c] = share * (x[d] * v[e] - x[e] * v[d]);
        values[PLIANT_FIT_SQUARE + c] = share * (square - x[c] * x[c]);
        values[PLIANT_FIT_PRODUCT + c] = share * x[d] * x[e];
    }
}

static int32_t slot_at(const pliant_lattice *lattice, int32_t x, int32_t y, int32_t z)
{
    return lattice->block_at[((size_t)z * lattice->dims[1] + y) * lattice->row_blocks +
                             x / PLIANT_LANES] *
               3 * PLIANT_LANES +
           x % PLIANT_LANES;
}

static void gather_restricted(const pliant_body *body, const pliant_rigid_field *whole, int32_t z,
                              const pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_irregular *irregular = body->irregular;
    const int32_t w = lattice->half_width, width = 2 * w + 1;
    for (int32_t n = irregular->slab_head[z]; n >= 0; n = irregular->plates[n].next) {
        const pliant_plate_node *plate = &irregular->plates[n];
        const pliant_row *rows = irregular->rows + (size_t)n * width;
        float *sums = body->fit_plates + (size_t)n * PLIANT_FIT_COUNT;
        memset(sums, 0, PLIANT_FIT_COUNT * sizeof *sums);
        for (int32_t i = 0; i < plate->row_count; i++) {
            const int32_t y = plate->y + rows[i].row - w;
            if (rows[i].mask & PLIANT_ROW_WHOLE) {
                const float *bar =
                    scratch->fit_bars +
                    ((size_t)(plate->x / PLIANT_LANES) * lattice->dims[1] + y) * PLIANT_FIT_FLOATS +
                    plate->x % PLIANT_LANES;
                for (int f = 0; f < PLIANT_FIT_COUNT; f++) sums[f] += bar[8 * f];
                continue;
            }
            for (uint32_t rest = rows[i].mask; rest; rest &= rest - 1) {
                float values[PLIANT_FIT_COUNT];
                fields_of_one(body, whole,
                              slot_at(lattice, plate->x + __builtin_ctz(rest) - w, y, z), values);
                for (int f = 0; f < PLIANT_FIT_COUNT; f++) sums[f] += values[f];
            }
        }
    }
}

PLIANT_VECTOR_CLONES
void pliant_fits_gather(pliant_body *body, const pliant_rigid_field *whole, int32_t z,
                        pliant_scratch *scratch)
{
    gather_bars(body, whole, z, scratch);
    pliant_slab_gather(body->lattice, z, scratch->fit_bars, body->fit_sites, 0, PLIANT_FIT_COUNT,
                       scratch);
    gather_restricted(body, whole, z, scratch);
}

PLIANT_INLINE float *mean_rows(const pliant_lattice *lattice, pliant_scratch *scratch, int32_t y,
                               int32_t z)
{
    return scratch->rows +
           (size_t)(y - lattice->slab_rows[2 * z]) * 6 * pliant_row_length(lattice->row_blocks);
}

PLIANT_INLINE void spread_plates(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t *range = lattice->slab_rows + 2 * z;
    const size_t length = pliant_row_length(lattice->row_blocks);
    for (int32_t k = 0; k < lattice->row_blocks; k++) {
        pliant_window window =
            pliant_slab_strip(lattice, z, k, body->fit_sites, PLIANT_FIT_COUNT, scratch);
        for (int32_t y = range[0]; y < range[1]; y++) {
            pliant_f8 sums[PLIANT_FIT_TURN_COUNT], none[1];
            pliant_window_next(&window, y - range[0], 0, PLIANT_FIT_TURN_COUNT, sums, none);
            float *rows = mean_rows(lattice, scratch, y, z) + PLIANT_ROW_PAD + 8 * k;
            for (int f = 0; f < PLIANT_FIT_TURN_COUNT; f++)
                pliant_f8_store(rows + f * length, sums[f]);
        }
    }
}

// With `whole_rows` into bars, before the sums along x; else into particles, after.
static void spread_restricted(const pliant_body *body, int32_t z, int32_t whole_rows,
                              pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_irregular *irregular = body->irregular;
    const int32_t w = lattice->half_width, width = 2 * w + 1;
    const size_t length = pliant_row_length(lattice->row_blocks);
    for (int32_t n = irregular->slab_head[z]; n >= 0; n = irregular->plates[n].next) {
        const pliant_plate_node *plate = &irregular->plates[n];
        const pliant_row *rows = irregular->rows + (size_t)n * width;
        const float *turn = body->fit_plates + (size_t)n * PLIANT_FIT_COUNT;
        for (int32_t i = 0; i < plate->row_count; i++) {
            const int32_t is_whole = (rows[i].mask & PLIANT_ROW_WHOLE) != 0;
            if (is_whole != whole_rows) continue;
            float *row = mean_rows(lattice, scratch, plate->y + rows[i].row - w, z) +
                         PLIANT_ROW_PAD + plate->x;
            if (is_whole) {
                for (int f = 0; f < PLIANT_FIT_TURN_COUNT; f++) row[f * length] += turn[f];
                continue;
            }
            for (uint32_t rest = rows[i].mask; rest; rest &= rest - 1)
                for (int f = 0; f < PLIANT_FIT_TURN_COUNT; f++)
                    row[f * length + __builtin_ctz(rest) - w] += turn[f];
        }
    }
}

PLIANT_INLINE void spread_bars(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t *range = lattice->slab_rows + 2 * z, blocks = lattice->row_blocks;
    const size_t length = pliant_row_length(blocks);
    for (int32_t y = range[0]; y < range[1]; y++) {
        float *rows = mean_rows(lattice, scratch, y, z) + PLIANT_ROW_PAD;
        for (int f = 0; f < PLIANT_FIT_TURN_COUNT; f++) {
            pliant_window_along(rows + f * length, NULL, blocks, lattice->half_width,
                                scratch->doubled, scratch->fit_rows, NULL, 8);
            memcpy(rows + f * length, scratch->fit_rows,
                   (size_t)blocks * PLIANT_LANES * sizeof *rows);
        }
    }
    memset(scratch->fit_rows, 0, pliant_row_length(blocks) * sizeof *scratch->fit_rows);
}

PLIANT_INLINE void leave_out(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_exceptions *e = &lattice->exceptions;
    const size_t length = pliant_row_length(lattice->row_blocks);
    for (int32_t j = e->slab_first[z]; j < e->slab_first[z + 1]; j++) {
        const pliant_exception_row *place = &e->slab_items[j];
        const int32_t k = place->k;
        pliant_f8 total = {0};
        for (int32_t i = e->first[k]; i < e->first[k + 1]; i++)
            total += pliant_f8_load(body->listed_turns + 16 * (size_t)e->other[i]);
        float *row = scratch->rows + (size_t)place->row * 6 * length + PLIANT_ROW_PAD + place->x;
        for (int f = 0; f < PLIANT_FIT_TURN_COUNT; f++) row[f * length] -= total[f];
    }
}

// u = v - whole goes by k of the way to mean of a + (mean of omega) cross x. What momenta are left
// to u is added up on the way: PLIANT_WHOLE_V and PLIANT_WHOLE_SPIN of the slab's sums.
PLIANT_INLINE void blend(pliant_body *body, const pliant_rigid_field *field, int32_t z, float k,
                         pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const size_t length = pliant_row_length(lattice->row_blocks);
    pliant_f8 momentum[3] = {{0}}, spin[3] = {{0}};
    for (int32_t b = lattice->slab_first[z]; b < lattice->slab_first[z + 1]; b++) {
        const int32_t *place = lattice->block_place + 3 * (size_t)b;
        const pliant_particle_constants *constants =
            &body->particle_constants[body->particle_constants_of[b]];
        const pliant_f8 inverse = pliant_f8_load(constants->inverse_size);
        const pliant_f8 is_particle = pliant_f8_load(constants->is_particle);
        const pliant_f8 mass = pliant_f8_load(lattice->lane_mass + (size_t)b * PLIANT_LANES);
        const float *mean =
            mean_rows(lattice, scratch, place[1], z) + PLIANT_ROW_PAD + 8 * place[0];
        const float *xs = body->x + (size_t)b * 3 * PLIANT_LANES;
        float *vs = body->v + (size_t)b * 3 * PLIANT_LANES;
        pliant_f8 x[3], omega[3], whole[3], u[3];
        for (int c = 0; c < 3; c++) {
            x[c] = pliant_f8_load(xs + 8 * c) - pliant_f8_all(body->origin[c]);
            omega[c] = pliant_f8_load(mean + (PLIANT_FIT_TURN_OMEGA + c) * length);
        }
        pliant_rigid_field_at(field, x, whole);
        for (int c = 0; c < 3; c++) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            const pliant_f8 before = pliant_f8_load(vs + 8 * c) - whole[c];
            const pliant_f8 rigid =
                inverse * (pliant_f8_load(mean + (PLIANT_FIT_TURN_A + c) * length) +
                           (omega[d] * x[e] - omega[e] * x[d]));
            u[c] = before + pliant_f8_all(k) * (rigid - before);
            pliant_f8_store(vs + 8 * c, is_particle * (whole[c] + u[c]));
            momentum[c] += mass * u[c];
        }
        for (int c = 0; c < 3; c++) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            spin[c] += mass * (x[d] * u[e] - x[e] * u[d]);
        }
    }
    double *sums = body->slab_sums + (size_t)z * PLIANT_WHOLE_COUNT;
    for (int c = 0; c < 3; c++) {
        sums[PLIANT_WHOLE_V + c] = sums[PLIANT_WHOLE_SPIN + c] = 0;
        for (int lane = 0; lane < PLIANT_LANES; lane++) {
            sums[PLIANT_WHOLE_V + c] += (double)momentum[c][lane];
            sums[PLIANT_WHOLE_SPIN + c] += (double)spin[c][lane];
        }
    }
}

PLIANT_VECTOR_CLONES
void pliant_fits_spread(pliant_body *body, const pliant_rigid_field *whole, int32_t z, float k,
                        pliant_scratch *scratch)
{
    if (body->lattice->slab_first[z] == body->lattice->slab_first[z + 1]) return;
    spread_plates(body, z, scratch);
    spread_restricted(body, z, 1, scratch);
    spread_bars(body, z, scratch);
    spread_restricted(body, z, 0, scratch);
    leave_out(body, z, scratch);
    blend(body, whole, z, k, scratch);
}
