// plates.c: sums over bars and plates of particles, and the same way back to the particles.
#include "lattice/plates.h"

#include "lattice/slabs.h"
#include "pliant/vector_clones.h"

// ---- Forward ----

// m~ (x - origin) of the particles of row (y, z), in three padded rows.
PLIANT_INLINE void load_row(const pliant_body *body, int32_t y, int32_t z, float *rows)
{
    const pliant_lattice *lattice = body->lattice;
    const size_t length = pliant_row_length(lattice->row_blocks);
    const int32_t *block_at =
        lattice->block_at + ((size_t)z * lattice->dims[1] + y) * lattice->row_blocks;
    for (int32_t k = 0; k < lattice->row_blocks; k++) {
        const int32_t block = block_at[k];
        float *to = rows + PLIANT_ROW_PAD + 8 * k;
        if (block < 0) {
            for (int c = 0; c < 3; c++) pliant_f8_store(to + c * length, (pliant_f8){0});
            continue;
        }
        const pliant_f8 share =
            pliant_f8_load(body->particle_constants[body->particle_constants_of[block]].share);
        const float *x = body->x + (size_t)block * 3 * PLIANT_LANES;
        for (int c = 0; c < 3; c++)
            pliant_f8_store(to + c * length,
                            share * (pliant_f8_load(x + 8 * c) - pliant_f8_all(body->origin[c])));
    }
}

static int32_t row_is_empty(const pliant_lattice *lattice, int32_t y, int32_t z)
{
    const int32_t *block_at =
        lattice->block_at + ((size_t)z * lattice->dims[1] + y) * lattice->row_blocks;
    for (int32_t k = 0; k < lattice->row_blocks; k++)
        if (block_at[k] >= 0) return 0;
    return 1;
}

// Bars (LSM-4, 5): sums and moments along x, shape [row_blocks][dims y][6][8].
PLIANT_INLINE void sum_bars(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t *range = lattice->slab_rows + 2 * z;
    const size_t length = pliant_row_length(lattice->row_blocks);
    const size_t apart = (size_t)lattice->dims[1] * 6 * PLIANT_LANES;
    int32_t listed = lattice->exceptions.slab_first[z];
    for (int32_t y = range[0]; y < range[1]; y++) {
        float *bars = scratch->bars + (size_t)y * 6 * PLIANT_LANES;
        if (row_is_empty(lattice, y, z)) {
            for (int32_t k = 0; k < lattice->row_blocks; k++)
                memset(bars + apart * k, 0, 6 * PLIANT_LANES * sizeof *bars);
            continue;
        }
        load_row(body, y, z, scratch->rows);
        pliant_slab_list(lattice, y, z, scratch->rows, 3, body->weighed, 4, &listed);
        for (int c = 0; c < 3; c++)
            pliant_window_along(scratch->rows + c * length + PLIANT_ROW_PAD, NULL,
                                lattice->row_blocks, lattice->half_width, scratch->doubled,
                                bars + 8 * c, bars + 8 * (3 + c), apart);
    }
}

// m~ (x - origin) of the particle at (x, y, z); there is one.
static void weigh(const pliant_body *body, int32_t x, int32_t y, int32_t z, float *value)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t lane = x % PLIANT_LANES;
    const int32_t block =
        lattice
            ->block_at[((size_t)z * lattice->dims[1] + y) * lattice->row_blocks + x / PLIANT_LANES];
    const float share = body->particle_constants[body->particle_constants_of[block]].share[lane];
    const float *at = body->x + (size_t)block * 3 * PLIANT_LANES + lane;
    for (int c = 0; c < 3; c++) value[c] = share * (at[8 * c] - body->origin[c]);
}

// Restricted plates: whole rows are bars, the others are added particle by particle.
static void sum_restricted(pliant_body *body, int32_t z, const pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_irregular *irregular = body->irregular;
    const int32_t w = lattice->half_width, width = 2 * w + 1;
    for (int32_t n = irregular->slab_head[z]; n >= 0; n = irregular->plates[n].next) {
        const pliant_plate_node *plate = &irregular->plates[n];
        const pliant_row *rows = irregular->rows + (size_t)n * width;
        float sums[9] = {0};
        for (int32_t i = 0; i < plate->row_count; i++) {
            const int32_t y = plate->y + rows[i].row - w;
            float row[6] = {0};
            if (rows[i].mask & PLIANT_ROW_WHOLE) {
                const float *bar =
                    scratch->bars +
                    (((size_t)(plate->x / PLIANT_LANES) * lattice->dims[1] + y) * 6) *
                        PLIANT_LANES +
                    plate->x % PLIANT_LANES;
                for (int f = 0; f < 6; f++) row[f] = bar[8 * f];
            } else {
                for (uint32_t rest = rows[i].mask; rest; rest &= rest - 1) {
                    const int32_t dx = __builtin_ctz(rest) - w;
                    float value[3];
                    weigh(body, plate->x + dx, y, z, value);
                    for (int c = 0; c < 3; c++) row[c] += value[c], row[3 + c] += dx * value[c];
                }
            }
            for (int f = 0; f < 6; f++) sums[f] += row[f];
            for (int c = 0; c < 3; c++) sums[6 + c] += (rows[i].row - w) * row[c];
        }
        memcpy(body->plate_sums + 9 * (size_t)n, sums, sizeof sums);
    }
}

PLIANT_VECTOR_CLONES
void pliant_plates_gather(pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    sum_bars(body, z, scratch);
    pliant_slab_gather(body->lattice, z, scratch->bars, body->sites, 3, 3, scratch);
    sum_restricted(body, z, scratch);
}

// ---- Back ----

// What a bar holds, -p and a, in six padded rows for each row y of the slab.
PLIANT_INLINE float *bar_rows(const pliant_lattice *lattice, pliant_scratch *scratch, int32_t y,
                              int32_t z)
{
    return scratch->rows +
           (size_t)(y - lattice->slab_rows[2 * z]) * 6 * pliant_row_length(lattice->row_blocks);
}

// From plates to bars: p of a bar is the sum of p + (y_bar - y) b. (Its negative is what sums and
// moments of the last direction start from.)
PLIANT_INLINE void spread_plates(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t *range = lattice->slab_rows + 2 * z;
    const size_t length = pliant_row_length(lattice->row_blocks);
    for (int32_t k = 0; k < lattice->row_blocks; k++) {
        pliant_window window = pliant_slab_strip(lattice, z, k, body->sites, 9, scratch);
        for (int32_t y = range[0]; y < range[1]; y++) {
            // b comes first, it has the moments; a plate's y is less than the bar's by what the
            // moment counts.
            pliant_f8 sums[9], moments[3];
            pliant_window_next(&window, y - range[0], 3, 6, sums, moments);
            float *rows = bar_rows(lattice, scratch, y, z) + PLIANT_ROW_PAD + 8 * k;
            for (int c = 0; c < 3; c++) {
                pliant_f8_store(rows + c * length, moments[c] - sums[3 + c]);
                pliant_f8_store(rows + (3 + c) * length, sums[6 + c]);
            }
        }
    }
}

// From restricted plates to their whole rows' bars.
static void spread_restricted(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_irregular *irregular = body->irregular;
    const int32_t w = lattice->half_width, width = 2 * w + 1;
    const size_t length = pliant_row_length(lattice->row_blocks);
    for (int32_t n = irregular->slab_head[z]; n >= 0; n = irregular->plates[n].next) {
        const pliant_plate_node *plate = &irregular->plates[n];
        const pliant_row *rows = irregular->rows + (size_t)n * width;
        const float *sums = body->plate_sums + 9 * (size_t)n;
        for (int32_t i = 0; i < plate->row_count; i++) {
            if (!(rows[i].mask & PLIANT_ROW_WHOLE)) continue;
            const float dy = (float)(rows[i].row - w);
            float *bar = bar_rows(lattice, scratch, plate->y + rows[i].row - w, z) +
                         PLIANT_ROW_PAD + plate->x;
            for (int c = 0; c < 3; c++) {
                bar[c * length] -= sums[3 + c] + dy * sums[c];
                bar[(3 + c) * length] += sums[6 + c];
            }
        }
    }
}

// Minus the sums of goals, three rows for each row y of the slab.
PLIANT_INLINE float *goal_rows(const pliant_lattice *lattice, pliant_scratch *scratch, int32_t y,
                               int32_t z)
{
    return scratch->goals +
           (size_t)(y - lattice->slab_rows[2 * z]) * 3 * lattice->row_blocks * PLIANT_LANES;
}

// From bars to particles: the sum of p + (x_i - x) a is minus the sum of -p and of the moment of a.
PLIANT_INLINE void spread_bars(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t *range = lattice->slab_rows + 2 * z, blocks = lattice->row_blocks;
    const size_t length = pliant_row_length(blocks);
    for (int32_t y = range[0]; y < range[1]; y++) {
        if (row_is_empty(lattice, y, z)) continue;
        const float *rows = bar_rows(lattice, scratch, y, z) + PLIANT_ROW_PAD;
        float *goals = goal_rows(lattice, scratch, y, z);
        for (int c = 0; c < 3; c++)
            pliant_window_along(rows + (3 + c) * length, rows + c * length, blocks,
                                lattice->half_width, scratch->doubled, scratch->bars,
                                goals + (size_t)c * blocks * PLIANT_LANES, 8);
    }
}

// From restricted plates to the particles of their restricted rows.
static void spread_masks(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_irregular *irregular = body->irregular;
    const int32_t w = lattice->half_width, width = 2 * w + 1;
    const size_t length = (size_t)lattice->row_blocks * PLIANT_LANES;
    for (int32_t n = irregular->slab_head[z]; n >= 0; n = irregular->plates[n].next) {
        const pliant_plate_node *plate = &irregular->plates[n];
        const pliant_row *rows = irregular->rows + (size_t)n * width;
        const float *sums = body->plate_sums + 9 * (size_t)n;
        for (int32_t i = 0; i < plate->row_count; i++) {
            if (rows[i].mask & PLIANT_ROW_WHOLE) continue;
            const float dy = (float)(rows[i].row - w);
            float *row = goal_rows(lattice, scratch, plate->y + rows[i].row - w, z) + plate->x - w;
            for (uint32_t rest = rows[i].mask; rest; rest &= rest - 1) {
                const int32_t bit = __builtin_ctz(rest);
                for (int c = 0; c < 3; c++)
                    row[c * length + bit] -= sums[3 + c] + dy * sums[c] + (bit - w) * sums[6 + c];
            }
        }
    }
}

// A particle's goal leaves out the regions that lack it: T_r of each, applied to its place.
PLIANT_INLINE void leave_out(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_exceptions *e = &lattice->exceptions;
    const size_t length = (size_t)lattice->row_blocks * PLIANT_LANES;
    for (int32_t j = e->slab_first[z]; j < e->slab_first[z + 1]; j++) {
        const pliant_exception_row *place = &e->slab_items[j];
        const int32_t k = place->k;
        pliant_f8 total = {0};
        for (int32_t i = e->first[k]; i < e->first[k + 1]; i += 2) {
            const float *one = body->listed_turns + 16 * (size_t)e->other[i];
            const float *two = body->listed_turns + 16 * (size_t)e->other[i + 1];
            const pliant_f8 step = pliant_f8_steps(e->step[i]);
            total += pliant_f8_load(one) * pliant_f8_of(3, 3, 3, 3, 0, 0, 0, 0, step) +
                     pliant_f8_load(one + 8) * pliant_f8_of(1, 1, 1, 1, 2, 2, 2, 2, step) +
                     pliant_f8_load(two) * pliant_f8_of(7, 7, 7, 7, 4, 4, 4, 4, step) +
                     pliant_f8_load(two + 8) * pliant_f8_of(5, 5, 5, 5, 6, 6, 6, 6, step);
        }
        float *row = scratch->goals + (size_t)place->row * 3 * length + place->x;
        for (int c = 0; c < 3; c++) row[c * length] += total[c] + total[4 + c];
    }
}

PLIANT_INLINE void accelerate(pliant_body *body, int32_t z, float h, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const size_t length = (size_t)lattice->row_blocks * PLIANT_LANES;
    const pliant_f8 rate = pliant_f8_all(1 / h), step = pliant_f8_all(h);
    const float gravity[3] = {body->gravity.x, body->gravity.y, body->gravity.z};
    for (int32_t b = lattice->slab_first[z]; b < lattice->slab_first[z + 1]; b++) {
        const int32_t *place = lattice->block_place + 3 * (size_t)b;
        const pliant_particle_constants *constants =
            &body->particle_constants[body->particle_constants_of[b]];
        const pliant_f8 inverse = pliant_f8_load(constants->inverse_size);
        const pliant_f8 is_particle = pliant_f8_load(constants->is_particle);
        const float *goal = goal_rows(lattice, scratch, place[1], z) + 8 * place[0];
        const float *x = body->x + (size_t)b * 3 * PLIANT_LANES;
        const float *a = body->acceleration + (size_t)b * 3 * PLIANT_LANES;
        float *v = body->v + (size_t)b * 3 * PLIANT_LANES;
        for (int c = 0; c < 3; c++) {
            const pliant_f8 offset = pliant_f8_load(x + 8 * c) - pliant_f8_all(body->origin[c]);
            pliant_f8 pull = pliant_f8_all(gravity[c]);
            if (body->has_forces) pull += pliant_f8_load(a + 8 * c);
            const pliant_f8 change =
                step * pull - rate * (inverse * pliant_f8_load(goal + c * length) + offset);
            pliant_f8_store(v + 8 * c, pliant_f8_load(v + 8 * c) + is_particle * change);
        }
    }
}

PLIANT_VECTOR_CLONES
void pliant_plates_scatter(pliant_body *body, int32_t z, float h, pliant_scratch *scratch)
{
    if (body->lattice->slab_first[z] == body->lattice->slab_first[z + 1]) return;
    spread_plates(body, z, scratch);
    spread_restricted(body, z, scratch);
    spread_bars(body, z, scratch);
    spread_masks(body, z, scratch);
    leave_out(body, z, scratch);
    accelerate(body, z, h, scratch);
}
