// damping.c: what of the particles' velocities is no rigid motion of their regions dies out.
//
// The squares of LSM-14 cancel in floats when a body is many regions wide. So the rigid motion of
// the whole is taken out first, which the fit would reproduce anyway, and what the rest loses in
// momentum to rounding is given back: rigid motions and both momenta are kept as exactly as floats
// can.
#include "lattice/damping.h"

#include "lattice/plates.h"
#include "lattice/window.h"
#include "pliant/vector_clones.h"

#include <math.h>

// Of a particle, a bar, a plate, a region: sums of m~ times
//     v, x cross v, (yy + zz, xx + zz, xx + yy), (yz, xz, xy), x
enum { FIT_V = 0, FIT_SPIN = 3, FIT_SQUARE = 6, FIT_PRODUCT = 9, FIT_X = 12, FIT_COUNT = 15 };
// What a region hands back, the motion a + omega cross x.
enum { TURN_A = 0, TURN_OMEGA = 3, TURN_COUNT = 6 };

#define FIT_FLOATS  (FIT_COUNT * PLIANT_LANES)
#define TURN_FLOATS (TURN_COUNT * PLIANT_LANES)

static const float zero_row[FIT_FLOATS];

static float *site_at(const pliant_body *body, int32_t column, int32_t z)
{
    const pliant_lattice_column *c = &body->lattice->columns[column];
    const int32_t w = body->lattice->half_width, s = z - c->z + w;
    return s < 0 || s >= c->length + 2 * w
               ? NULL
               : body->fit_sites + (size_t)(c->first_site + s) * FIT_FLOATS;
}

// ---- Motion of the whole ----

// Sums over a slab, then over all: mass, m x, m v, m x cross v, m (xx, yy, zz, yz, xz, xy) about
// the body's origin.
enum { ALL_MASS, ALL_X, ALL_V = 4, ALL_SPIN = 7, ALL_XX = 10, ALL_COUNT = 16 };

typedef struct rigid_motion {
    double centre[3], velocity[3], omega[3];  // about the origin of the sums
    double spread;                            // mean square distance from the centre, m^2
} rigid_motion;

// The same as a + omega cross x, x from the body's origin.
typedef struct rigid_field {
    float a[3], omega[3];
} rigid_field;

static rigid_field field_of(const rigid_motion *m)
{
    rigid_field field;
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        field.a[c] =
            (float)(m->velocity[c] - (m->omega[d] * m->centre[e] - m->omega[e] * m->centre[d]));
        field.omega[c] = (float)m->omega[c];
    }
    return field;
}

PLIANT_INLINE void evaluate(const rigid_field *field, const pliant_f8 x[3], pliant_f8 v[3])
{
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        v[c] = pliant_f8_all(field->a[c]) +
               (pliant_f8_all(field->omega[d]) * x[e] - pliant_f8_all(field->omega[e]) * x[d]);
    }
}

PLIANT_VECTOR_CLONES
static void sum_slab(const pliant_body *body, int32_t z, double *sums)
{
    const pliant_lattice *lattice = body->lattice;
    pliant_f8 total[ALL_COUNT] = {{0}};
    for (int32_t b = lattice->slab_first[z]; b < lattice->slab_first[z + 1]; b++) {
        const pliant_f8 m = pliant_f8_load(lattice->lane_mass + (size_t)b * PLIANT_LANES);
        const float *xs = body->x + (size_t)b * 3 * PLIANT_LANES;
        const float *vs = body->v + (size_t)b * 3 * PLIANT_LANES;
        pliant_f8 x[3], v[3], mx[3];
        for (int c = 0; c < 3; c++) {
            x[c] = pliant_f8_load(xs + 8 * c) - pliant_f8_all(body->origin[c]);
            v[c] = pliant_f8_load(vs + 8 * c);
            mx[c] = m * x[c];
            total[ALL_X + c] += mx[c];
            total[ALL_V + c] += m * v[c];
            total[ALL_XX + c] += mx[c] * x[c];
        }
        total[ALL_MASS] += m;
        for (int c = 0; c < 3; c++) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            total[ALL_SPIN + c] += mx[d] * v[e] - mx[e] * v[d];
            total[ALL_XX + 3 + c] += mx[d] * x[e];
        }
    }
    for (int f = 0; f < ALL_COUNT; f++) {
        float lanes[PLIANT_LANES];
        pliant_f8_store(lanes, total[f]);
        sums[f] = 0;
        for (int k = 0; k < PLIANT_LANES; k++) sums[f] += (double)lanes[k];
    }
}

// omega of I omega = L; I, positive semidefinite, as xx' = yy + zz and so on. The directions that
// nothing resists turning about get nothing.
static void solve_spin(const double square[3], const double product[3], const double spin[3],
                       double omega[3])
{
    const double trace = square[0] + square[1] + square[2], least = 1e-12 * trace;
    const double a = square[0] + least, b = square[1] + least, c = square[2] + least;
    const double d = -product[0], e = -product[1], f = -product[2];  // yz, xz, xy
    const double xx = b * c - d * d, yy = a * c - e * e, zz = a * b - f * f;
    const double xy = d * e - c * f, xz = d * f - b * e, yz = e * f - a * d;
    const double determinant = a * xx + f * xy + e * xz;
    const double inverse = determinant > 0 ? 1 / determinant : 0;
    omega[0] = inverse * (xx * spin[0] + xy * spin[1] + xz * spin[2]);
    omega[1] = inverse * (xy * spin[0] + yy * spin[1] + yz * spin[2]);
    omega[2] = inverse * (xz * spin[0] + yz * spin[1] + zz * spin[2]);
}

static rigid_motion fit_whole(const double *sums)
{
    rigid_motion m;
    const double mass = sums[ALL_MASS];
    double spin[3], square[3], product[3], second[3];
    for (int c = 0; c < 3; c++) {
        m.centre[c] = sums[ALL_X + c] / mass;
        m.velocity[c] = sums[ALL_V + c] / mass;
    }
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        spin[c] =
            sums[ALL_SPIN + c] - mass * (m.centre[d] * m.velocity[e] - m.centre[e] * m.velocity[d]);
        second[c] = sums[ALL_XX + c] - mass * m.centre[c] * m.centre[c];
        product[c] = sums[ALL_XX + 3 + c] - mass * m.centre[d] * m.centre[e];
    }
    for (int c = 0; c < 3; c++) square[c] = second[(c + 1) % 3] + second[(c + 2) % 3];
    solve_spin(square, product, spin, m.omega);
    m.spread = (second[0] + second[1] + second[2]) / mass;
    return m;
}

typedef struct damp_task {
    pliant_body *body;
    float k;
    rigid_motion whole;
    rigid_field field;  // of `whole`
} damp_task;

static void sum_task(void *context, int32_t z, int32_t worker)
{
    (void)worker;
    const damp_task *task = context;
    sum_slab(task->body, z, task->body->slab_sums + (size_t)z * ALL_COUNT);
}

static void add_slabs(const pliant_body *body, double *sums)
{
    for (int f = 0; f < ALL_COUNT; f++) sums[f] = 0;
    for (int32_t z = 0; z < body->lattice->dims[2]; z++)
        for (int f = 0; f < ALL_COUNT; f++) sums[f] += body->slab_sums[(size_t)z * ALL_COUNT + f];
}

static void measure_whole(damp_task *task)
{
    double sums[ALL_COUNT];
    pliant_team_run(task->body->team, task->body->lattice->dims[2], sum_task, task);
    add_slabs(task->body, sums);
    task->whole = fit_whole(sums);
    task->field = field_of(&task->whole);
}

// v = keep v + add (a + omega cross x) for a slab.
PLIANT_VECTOR_CLONES
static void blend_slab(pliant_body *body, int32_t z, const rigid_field *field, float keep,
                       float add)
{
    const pliant_lattice *lattice = body->lattice;
    for (int32_t b = lattice->slab_first[z]; b < lattice->slab_first[z + 1]; b++) {
        const pliant_f8 is_particle =
            pliant_f8_load(body->particle_constants[body->particle_constants_of[b]].is_particle);
        const float *xs = body->x + (size_t)b * 3 * PLIANT_LANES;
        float *vs = body->v + (size_t)b * 3 * PLIANT_LANES;
        pliant_f8 x[3], rigid[3];
        for (int c = 0; c < 3; c++)
            x[c] = pliant_f8_load(xs + 8 * c) - pliant_f8_all(body->origin[c]);
        evaluate(field, x, rigid);
        for (int c = 0; c < 3; c++)
            pliant_f8_store(vs + 8 * c, pliant_f8_all(keep) * pliant_f8_load(vs + 8 * c) +
                                            pliant_f8_all(add) * is_particle * rigid[c]);
    }
}

// ---- There ----

// The fit's fields of a block's particles, of what their velocities are beyond the whole's motion.
PLIANT_INLINE void fields_of(const pliant_body *body, const rigid_field *whole, int32_t block,
                             pliant_f8 *fields)
{
    const pliant_f8 share =
        pliant_f8_load(body->particle_constants[body->particle_constants_of[block]].share);
    const float *xs = body->x + (size_t)block * 3 * PLIANT_LANES;
    const float *vs = body->v + (size_t)block * 3 * PLIANT_LANES;
    pliant_f8 x[3], v[3], mx[3], rigid[3];
    for (int c = 0; c < 3; c++) x[c] = pliant_f8_load(xs + 8 * c) - pliant_f8_all(body->origin[c]);
    evaluate(whole, x, rigid);
    for (int c = 0; c < 3; c++) {
        v[c] = pliant_f8_load(vs + 8 * c) - rigid[c];
        mx[c] = share * x[c];
        fields[FIT_V + c] = share * v[c];
        fields[FIT_X + c] = mx[c];
    }
    const pliant_f8 square = mx[0] * x[0] + mx[1] * x[1] + mx[2] * x[2];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        fields[FIT_SPIN + c] = mx[d] * v[e] - mx[e] * v[d];
        fields[FIT_SQUARE + c] = square - mx[c] * x[c];
        fields[FIT_PRODUCT + c] = mx[d] * x[e];
    }
}

PLIANT_INLINE void gather_bars(const pliant_body *body, const rigid_field *whole, int32_t z,
                               pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t *range = lattice->slab_rows + 2 * z, blocks = lattice->row_blocks;
    const size_t length = pliant_row_length(blocks), apart = (size_t)lattice->dims[1] * FIT_FLOATS;
    for (int32_t y = range[0]; y < range[1]; y++) {
        const int32_t *block_at = lattice->block_at + ((size_t)z * lattice->dims[1] + y) * blocks;
        for (int32_t k = 0; k < blocks; k++) {
            pliant_f8 fields[FIT_COUNT] = {{0}};
            if (block_at[k] >= 0) fields_of(body, whole, block_at[k], fields);
            for (int f = 0; f < FIT_COUNT; f++)
                pliant_f8_store(scratch->fit_rows + f * length + PLIANT_ROW_PAD + 8 * k, fields[f]);
        }
        float *bars = scratch->fit_bars + (size_t)y * FIT_FLOATS;
        for (int f = 0; f < FIT_COUNT; f++)
            pliant_window_along(scratch->fit_rows + f * length + PLIANT_ROW_PAD, NULL, blocks,
                                lattice->half_width, scratch->doubled, bars + 8 * f, NULL, apart);
    }
}

PLIANT_INLINE void gather_plates(const pliant_body *body, int32_t z, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const int32_t w = lattice->half_width, ny = lattice->dims[1];
    const int32_t *range = lattice->slab_rows + 2 * z;
    const int32_t first = range[0] - w, last = range[1] + w;
    for (int32_t k = 0; k < lattice->row_blocks; k++) {
        const float *bars = scratch->fit_bars + (size_t)k * ny * FIT_FLOATS;
        for (int32_t y = first - w; y < last + w; y++)
            scratch->strip[y - (first - w)] =
                y < range[0] || y >= range[1] ? zero_row : bars + (size_t)y * FIT_FLOATS;
        pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
        for (int32_t y = 0; y < ny; y++) {
            const int32_t column = lattice->column_at[y * lattice->row_blocks + k];
            float *site = column < 0 ? NULL : site_at(body, column, z);
            if (site && (y < first || y >= last)) memset(site, 0, FIT_FLOATS * sizeof *site);
        }
        for (int32_t y = first; y < last; y++) {
            const int32_t column =
                y < 0 || y >= ny ? -1 : lattice->column_at[y * lattice->row_blocks + k];
            float *site = column < 0 ? NULL : site_at(body, column, z);
            if (!site && w <= PLIANT_WINDOW_DIRECT) continue;
            pliant_f8 sums[FIT_COUNT], none[1];
            pliant_window_next(&window, y - first, 0, FIT_COUNT, sums, none);
            if (!site) continue;
            for (int f = 0; f < FIT_COUNT; f++) pliant_f8_store(site + 8 * f, sums[f]);
        }
    }
}

// The fit's fields of one particle, weighed, into values[16].
static void fields_of_one(const pliant_body *body, const rigid_field *whole, int32_t slot,
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
        values[FIT_V + c] = share * v[c];
        values[FIT_X + c] = share * x[c];
    }
    const float square = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        values[FIT_SPIN + c] = share * (x[d] * v[e] - x[e] * v[d]);
        values[FIT_SQUARE + c] = share * (square - x[c] * x[c]);
        values[FIT_PRODUCT + c] = share * x[d] * x[e];
    }
}

static int32_t slot_at(const pliant_lattice *lattice, int32_t x, int32_t y, int32_t z)
{
    return lattice->block_at[((size_t)z * lattice->dims[1] + y) * lattice->row_blocks +
                             x / PLIANT_LANES] *
               3 * PLIANT_LANES +
           x % PLIANT_LANES;
}

static void gather_restricted(const pliant_body *body, const rigid_field *whole, int32_t z,
                              const pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_irregular *irregular = body->irregular;
    const int32_t w = lattice->half_width, width = 2 * w + 1;
    for (int32_t n = irregular->slab_head[z]; n >= 0; n = irregular->plates[n].next) {
        const pliant_plate_node *plate = &irregular->plates[n];
        const pliant_row *rows = irregular->rows + (size_t)n * width;
        float *sums = body->fit_plates + (size_t)n * FIT_COUNT;
        memset(sums, 0, FIT_COUNT * sizeof *sums);
        for (int32_t i = 0; i < plate->row_count; i++) {
            const int32_t y = plate->y + rows[i].row - w;
            if (rows[i].mask & PLIANT_ROW_WHOLE) {
                const float *bar =
                    scratch->fit_bars +
                    ((size_t)(plate->x / PLIANT_LANES) * lattice->dims[1] + y) * FIT_FLOATS +
                    plate->x % PLIANT_LANES;
                for (int f = 0; f < FIT_COUNT; f++) sums[f] += bar[8 * f];
                continue;
            }
            for (uint32_t rest = rows[i].mask; rest; rest &= rest - 1) {
                float values[FIT_COUNT];
                fields_of_one(body, whole,
                              slot_at(lattice, plate->x + __builtin_ctz(rest) - w, y, z), values);
                for (int f = 0; f < FIT_COUNT; f++) sums[f] += values[f];
            }
        }
    }
}

static void gather_listed(const pliant_body *body, const rigid_field *whole, int32_t z)
{
    const pliant_exceptions *e = &body->lattice->exceptions;
    for (int32_t k = e->slab_first[z]; k < e->slab_first[z + 1]; k++)
        fields_of_one(body, whole, body->lattice->slot[e->particle[k]],
                      body->listed_fits + 16 * (size_t)k);
}

PLIANT_VECTOR_CLONES
static void gather_slab(pliant_body *body, const rigid_field *whole, int32_t z,
                        pliant_scratch *scratch)
{
    gather_bars(body, whole, z, scratch);
    gather_plates(body, z, scratch);
    gather_restricted(body, whole, z, scratch);
    gather_listed(body, whole, z);
}

// ---- Regions ----

// As in columns.c: sums = keep * window + more.
typedef struct repair {
    float keep[PLIANT_LANES];
    float more[FIT_COUNT][PLIANT_LANES];
} repair;

PLIANT_INLINE repair *repair_at(pliant_scratch *scratch, int32_t s, int32_t *count)
{
    repair *all = (repair *)(void *)scratch->fit_repairs;
    if (scratch->repair_of[s] >= 0) return &all[scratch->repair_of[s]];
    repair *r = &all[scratch->repair_of[s] = (*count)++];
    pliant_f8_store(r->keep, pliant_f8_all(1.0f));
    for (int f = 0; f < FIT_COUNT; f++) pliant_f8_store(r->more[f], (pliant_f8){0});
    return r;
}

PLIANT_INLINE void find_repairs(const pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_lattice_column *c = &lattice->columns[column];
    const pliant_exceptions *e = &lattice->exceptions;
    const pliant_irregular *irregular = body->irregular;
    const int32_t width = 2 * lattice->half_width + 1;
    int32_t count = 0;
    for (int32_t s = 0; s < c->length; s++) scratch->repair_of[s] = -1;
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
        repair *r = repair_at(scratch, place->s, &count);
        for (int f = 0; f < FIT_COUNT; f++)
            r->more[f][place->lane] = f < 8 ? -low[f] : -high[f - 8];
    }
    for (int32_t n = irregular->column_head[column]; n >= 0; n = irregular->regions[n].next) {
        const pliant_region_node *node = &irregular->regions[n];
        const pliant_part *parts = irregular->parts + (size_t)n * width;
        float total[FIT_COUNT] = {0};
        for (int32_t i = 0; i < node->part_count; i++) {
            const float *from =
                parts[i].plate >= 0
                    ? body->fit_plates + (size_t)parts[i].plate * FIT_COUNT
                    : body->fit_sites +
                          (size_t)(c->first_site + node->z - c->z + parts[i].plane) * FIT_FLOATS +
                          node->lane;
            const int32_t apart = parts[i].plate >= 0 ? 1 : PLIANT_LANES;
            for (int f = 0; f < FIT_COUNT; f++) total[f] += from[apart * f];
        }
        repair *r = repair_at(scratch, node->z - c->z, &count);
        r->keep[node->lane] = node->sign < 0 ? 1 : 0;
        for (int f = 0; f < FIT_COUNT; f++) r->more[f][node->lane] = (float)node->sign * total[f];
    }
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
        v[c] = sums[FIT_V + c] * inverse_mass;
        centre[c] = sums[FIT_X + c] * inverse_mass;
    }
    pliant_f8 far = {0};
    for (int c = 0; c < 3; c++) far += sums[FIT_X + c] * centre[c];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        spin[c] = sums[FIT_SPIN + c] - (sums[FIT_X + d] * v[e] - sums[FIT_X + e] * v[d]);
        square[c] = sums[FIT_SQUARE + c] - (far - sums[FIT_X + c] * centre[c]);
        product[c] = -(sums[FIT_PRODUCT + c] - sums[FIT_X + d] * centre[e]);
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
        pliant_f8_store(turn + 8 * (TURN_A + i),
                        is_particle * (v[i] - (omega[j] * centre[l] - omega[l] * centre[j])));
        pliant_f8_store(turn + 8 * (TURN_OMEGA + i), omega[i]);
    }
}

PLIANT_INLINE void fit_regions(pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_lattice_column *c = &lattice->columns[column];
    const int32_t w = lattice->half_width;
    for (int32_t s = 0; s < c->length + 2 * w; s++)
        scratch->strip[s] = body->fit_sites + (size_t)(c->first_site + s) * FIT_FLOATS;
    pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
    for (int32_t s = 0; s < c->length; s++) {
        float *turn = scratch->turns + (size_t)s * TURN_FLOATS;
        const int32_t block = lattice->turn_block[c->first_turn + s];
        pliant_f8 sums[FIT_COUNT], none[1];
        if (block >= 0 || w > PLIANT_WINDOW_DIRECT)
            pliant_window_next(&window, s, 0, FIT_COUNT, sums, none);
        if (block < 0) {
            memset(turn, 0, TURN_FLOATS * sizeof *turn);
            continue;
        }
        if (scratch->repair_of[s] >= 0) {
            const repair *r =
                (const repair *)(const void *)scratch->fit_repairs + scratch->repair_of[s];
            const pliant_f8 keep = pliant_f8_load(r->keep);
            for (int f = 0; f < FIT_COUNT; f++)
                sums[f] = keep * sums[f] + pliant_f8_load(r->more[f]);
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
        const float *turn = turns + (size_t)place->s * TURN_FLOATS + place->lane;
        float *to = body->listed_turns + 16 * (size_t)k;
        for (int f = 0; f < TURN_COUNT; f++) to[f] = body->is_listed[k] ? turn[8 * f] : 0;
    }
}

static void set_apart(const pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_irregular *irregular = body->irregular;
    float *apart = scratch->apart;
    for (int32_t n = irregular->column_head[column]; n >= 0; n = irregular->regions[n].next) {
        const pliant_region_node *node = &irregular->regions[n];
        float *turn = scratch->turns +
                      (size_t)(node->z - body->lattice->columns[column].z) * TURN_FLOATS +
                      node->lane;
        for (int f = 0; f < TURN_COUNT; f++, apart++) {
            *apart = turn[8 * f];
            if (node->sign > 0) turn[8 * f] = 0;
        }
    }
}

// A site holds on the way back what its plate's particles are handed: 6 fields.
PLIANT_INLINE void spread_regions(pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_lattice_column *c = &body->lattice->columns[column];
    const int32_t w = body->lattice->half_width;
    for (int32_t s = 0; s < 2 * w; s++)
        scratch->strip[s] = scratch->strip[2 * w + c->length + s] = zero_row;
    for (int32_t s = 0; s < c->length; s++)
        scratch->strip[2 * w + s] = scratch->turns + (size_t)s * TURN_FLOATS;
    pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
    for (int32_t s = 0; s < c->length + 2 * w; s++) {
        pliant_f8 sums[TURN_COUNT], none[1];
        pliant_window_next(&window, s, 0, TURN_COUNT, sums, none);
        float *site = body->fit_sites + (size_t)(c->first_site + s) * FIT_FLOATS;
        for (int f = 0; f < TURN_COUNT; f++) pliant_f8_store(site + 8 * f, sums[f]);
    }
}

static void spread_apart(pliant_body *body, int32_t column, const pliant_scratch *scratch)
{
    const pliant_irregular *irregular = body->irregular;
    const pliant_lattice_column *c = &body->lattice->columns[column];
    const int32_t width = 2 * body->lattice->half_width + 1;
    for (int32_t n = irregular->column_head[column]; n >= 0; n = irregular->regions[n].next)
        for (int32_t i = 0; i < irregular->regions[n].part_count; i++) {
            const int32_t plate = irregular->parts[(size_t)n * width + i].plate;
            if (plate >= 0)
                memset(body->fit_plates + (size_t)plate * FIT_COUNT, 0, TURN_COUNT * sizeof(float));
        }
    const float *turn = scratch->apart;
    for (int32_t n = irregular->column_head[column]; n >= 0;
         n = irregular->regions[n].next, turn += TURN_COUNT) {
        const pliant_region_node *node = &irregular->regions[n];
        for (int32_t i = 0; i < node->part_count; i++) {
            const pliant_part *part = &irregular->parts[(size_t)n * width + i];
            float *to =
                part->plate >= 0
                    ? body->fit_plates + (size_t)part->plate * FIT_COUNT
                    : body->fit_sites +
                          (size_t)(c->first_site + node->z - c->z + part->plane) * FIT_FLOATS +
                          node->lane;
            const int32_t apart = part->plate >= 0 ? 1 : PLIANT_LANES;
            for (int f = 0; f < TURN_COUNT; f++) to[apart * f] += (float)node->sign * turn[f];
        }
    }
}

PLIANT_VECTOR_CLONES
static void fit_column(pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_lattice_column *c = &lattice->columns[column];
    for (int32_t s = 0; s < c->length + 2 * lattice->half_width; s++) {
        const int32_t z = c->z - lattice->half_width + s;
        if (z < 0 || z >= lattice->dims[2] || lattice->slab_first[z] == lattice->slab_first[z + 1])
            memset(body->fit_sites + (size_t)(c->first_site + s) * FIT_FLOATS, 0,
                   FIT_FLOATS * sizeof(float));
    }
    find_repairs(body, column, scratch);
    fit_regions(body, column, scratch);
    list_turns(body, column, scratch->turns);
    set_apart(body, column, scratch);
    spread_regions(body, column, scratch);
    spread_apart(body, column, scratch);
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
    const int32_t w = lattice->half_width, ny = lattice->dims[1];
    const int32_t *range = lattice->slab_rows + 2 * z;
    const size_t length = pliant_row_length(lattice->row_blocks);
    for (int32_t k = 0; k < lattice->row_blocks; k++) {
        for (int32_t y = range[0] - w; y < range[1] + w; y++) {
            const int32_t column =
                y < 0 || y >= ny ? -1 : lattice->column_at[y * lattice->row_blocks + k];
            const float *site = column < 0 ? NULL : site_at(body, column, z);
            scratch->strip[y - (range[0] - w)] = site ? site : zero_row;
        }
        pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
        for (int32_t y = range[0]; y < range[1]; y++) {
            pliant_f8 sums[TURN_COUNT], none[1];
            pliant_window_next(&window, y - range[0], 0, TURN_COUNT, sums, none);
            float *rows = mean_rows(lattice, scratch, y, z) + PLIANT_ROW_PAD + 8 * k;
            for (int f = 0; f < TURN_COUNT; f++) pliant_f8_store(rows + f * length, sums[f]);
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
        const float *turn = body->fit_plates + (size_t)n * FIT_COUNT;
        for (int32_t i = 0; i < plate->row_count; i++) {
            const int32_t is_whole = (rows[i].mask & PLIANT_ROW_WHOLE) != 0;
            if (is_whole != whole_rows) continue;
            float *row = mean_rows(lattice, scratch, plate->y + rows[i].row - w, z) +
                         PLIANT_ROW_PAD + plate->x;
            if (is_whole) {
                for (int f = 0; f < TURN_COUNT; f++) row[f * length] += turn[f];
                continue;
            }
            for (uint32_t rest = rows[i].mask; rest; rest &= rest - 1)
                for (int f = 0; f < TURN_COUNT; f++)
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
        for (int f = 0; f < TURN_COUNT; f++) {
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
        for (int f = 0; f < TURN_COUNT; f++) row[f * length] -= total[f];
    }
}

// u = v - whole goes by k of the way to mean of a + (mean of omega) cross x. What momenta are left
// to u is added up on the way: ALL_V and ALL_SPIN of the slab's sums.
PLIANT_INLINE void blend(const damp_task *task, int32_t z, pliant_scratch *scratch)
{
    pliant_body *body = task->body;
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
            omega[c] = pliant_f8_load(mean + (TURN_OMEGA + c) * length);
        }
        evaluate(&task->field, x, whole);
        for (int c = 0; c < 3; c++) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            const pliant_f8 before = pliant_f8_load(vs + 8 * c) - whole[c];
            const pliant_f8 rigid = inverse * (pliant_f8_load(mean + (TURN_A + c) * length) +
                                               (omega[d] * x[e] - omega[e] * x[d]));
            u[c] = before + pliant_f8_all(task->k) * (rigid - before);
            pliant_f8_store(vs + 8 * c, is_particle * (whole[c] + u[c]));
            momentum[c] += mass * u[c];
        }
        for (int c = 0; c < 3; c++) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            spin[c] += mass * (x[d] * u[e] - x[e] * u[d]);
        }
    }
    double *sums = body->slab_sums + (size_t)z * ALL_COUNT;
    for (int c = 0; c < 3; c++) {
        sums[ALL_V + c] = sums[ALL_SPIN + c] = 0;
        for (int k = 0; k < PLIANT_LANES; k++) {
            sums[ALL_V + c] += (double)momentum[c][k];
            sums[ALL_SPIN + c] += (double)spin[c][k];
        }
    }
}

PLIANT_VECTOR_CLONES
static void spread_slab(const damp_task *task, int32_t z, pliant_scratch *scratch)
{
    pliant_body *body = task->body;
    if (body->lattice->slab_first[z] == body->lattice->slab_first[z + 1]) return;
    spread_plates(body, z, scratch);
    spread_restricted(body, z, 1, scratch);
    spread_bars(body, z, scratch);
    spread_restricted(body, z, 0, scratch);
    leave_out(body, z, scratch);
    blend(task, z, scratch);
}

// ---- Damping ----

static void gather_task(void *context, int32_t z, int32_t worker)
{
    const damp_task *task = context;
    gather_slab(task->body, &task->field, z, &task->body->scratch[worker]);
}

static void fit_task(void *context, int32_t column, int32_t worker)
{
    const damp_task *task = context;
    fit_column(task->body, column, &task->body->scratch[worker]);
}

static void spread_task(void *context, int32_t z, int32_t worker)
{
    const damp_task *task = context;
    spread_slab(task, z, &task->body->scratch[worker]);
}

static void subtract_task(void *context, int32_t z, int32_t worker)
{
    (void)worker;
    const damp_task *task = context;
    blend_slab(task->body, z, &task->field, 1, -1);
}

static void rigid_task(void *context, int32_t z, int32_t worker)
{
    (void)worker;
    const damp_task *task = context;
    blend_slab(task->body, z, &task->field, 1 - task->k, task->k);
}

// Squares of the sums lose what regions are made of when a body is torn over many times its size:
// damping would add energy then, and end in what is no number. All that is slowed down then is
// motion against the mean, which costs angular momentum. Pieces of what may break are summed apart
// and may go further, and beyond that fly on undamped. Returns 1 if that was it.
static int32_t damp_torn(damp_task *task)
{
    const double whole_sizes = 100, cells = 1e5;
    pliant_body *body = task->body;
    const int32_t *dims = body->lattice->dims;
    const double a = (double)body->lattice->cell_size;
    const double limit = a * (body->fracture ? cells : whole_sizes * (dims[0] + dims[1] + dims[2]));
    if (task->whole.spread < limit * limit) return 0;
    if (body->fracture) return 1;
    for (int c = 0; c < 3; c++) task->whole.omega[c] = 0;
    task->field = field_of(&task->whole);
    pliant_team_run(body->team, dims[2], rigid_task, task);
    return 1;
}

void pliant_body_damp(pliant_body *body, float k)
{
    const pliant_lattice *lattice = body->lattice;
    damp_task task = {.body = body, .k = k};
    measure_whole(&task);
    if (damp_torn(&task)) return;
    pliant_team_run(body->team, lattice->dims[2], gather_task, &task);
    pliant_team_run(body->team, lattice->column_count, fit_task, &task);
    pliant_team_run(body->team, lattice->dims[2], spread_task, &task);
    // Beyond the motion of the whole there were no momenta: what there is now is rounding, and
    // goes.
    double sums[ALL_COUNT];
    add_slabs(body, sums);
    task.whole = fit_whole(sums);
    task.field = field_of(&task.whole);
    pliant_team_run(body->team, lattice->dims[2], subtract_task, &task);
}

void pliant_body_damp_rigid(pliant_body *body, float k)
{
    damp_task task = {.body = body, .k = k};
    measure_whole(&task);
    if (damp_torn(&task)) return;
    pliant_team_run(body->team, body->lattice->dims[2], rigid_task, &task);
}
