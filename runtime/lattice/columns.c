// columns.c: shape matching of the regions of one column of blocks.
#include "lattice/columns.h"

#include "lattice/parts.h"
#include "lattice/plates.h"
#include "lattice/polar.h"
#include "lattice/polar_block.h"
#include "lattice/window.h"
#include "pliant/vector_clones.h"

// Of a region: c, p, a, b, each 3 numbers. A step of one cell along x, y, z adds a, b, c to the
// goal p of the region's own particle.
#define TURN_FLOATS (12 * PLIANT_LANES)

// The places of c, p, a, b in a turn, and of b, p, a in a site on the way back.
enum { TURN_C = 0, TURN_P = 3, TURN_A = 6, TURN_B = 9, SITE_B = 0, SITE_P = 3, SITE_A = 6 };

static const float zero_turn[TURN_FLOATS];

// ---- Sums of irregular regions ----

// Less the particles that a region lacks, two at a time.
PLIANT_INLINE void repair_listed(const pliant_body *body, int32_t k, float *repair)
{
    const pliant_exceptions *e = &body->lattice->exceptions;
    pliant_f8 sum = {0}, x = {0}, y = {0}, z = {0};
    for (int32_t i = e->first[k]; i < e->first[k + 1]; i += 2) {
        const float *one = body->weighed + 4 * (size_t)e->other[i];
        const float *two = body->weighed + 4 * (size_t)e->other[i + 1];
        const pliant_f8 value = __builtin_shufflevector(pliant_f4_load(one), pliant_f4_load(two), 0,
                                                        1, 2, 3, 4, 5, 6, 7);
        const pliant_f8 step = pliant_f8_steps(e->step[i]);
        sum += value;
        x += value * pliant_f8_of(0, 0, 0, 0, 4, 4, 4, 4, step);
        y += value * pliant_f8_of(1, 1, 1, 1, 5, 5, 5, 5, step);
        z += value * pliant_f8_of(2, 2, 2, 2, 6, 6, 6, 6, step);
    }
    for (int c = 0; c < 3; c++) {
        repair[8 * c] = -(sum[c] + sum[4 + c]);
        repair[8 * (3 + c)] = -(x[c] + x[4 + c]);
        repair[8 * (6 + c)] = -(y[c] + y[4 + c]);
        repair[8 * (9 + c)] = -(z[c] + z[4 + c]);
    }
}

PLIANT_INLINE void find_repairs(const pliant_body *body, int32_t column, const float *sites,
                                pliant_scratch *scratch)
{
    const pliant_exceptions *e = &body->lattice->exceptions;
    int32_t used = 0;
    pliant_repairs_begin(scratch, body->lattice->columns[column].length);
    for (int32_t i = e->column_first[column]; i < e->column_first[column + 1]; i++) {
        const pliant_exception_place *place = &e->column_items[i];
        if (!body->is_listed[place->k]) continue;
        float *repair = pliant_repair_at(scratch, place->s, 12, &used);
        repair_listed(body, place->k, repair + 8 + place->lane);
    }
    pliant_repair_parts(body, column, sites, body->plate_sums, 9, 3, &used, scratch);
}

// ---- Matching ----

// Regions of a column are matched by threes: the rotations of one block are one long chain of
// operations, which those of the next two fill.
typedef struct match_group {
    int32_t count;
    const pliant_region_constants *constants[PLIANT_POLAR_GROUP];  // NULL: no block there
    float sums[PLIANT_POLAR_GROUP][12 * PLIANT_LANES];
    float a[PLIANT_POLAR_GROUP * 9 * PLIANT_LANES], rotation[PLIANT_POLAR_GROUP * 9 * PLIANT_LANES];
    int32_t missed[PLIANT_POLAR_GROUP * PLIANT_LANES];
} match_group;

// A_r (LSM-11) of eight regions:
//     A_r = sum of m~ x d^T - (sum of m~ x) d0^T, d = x0 - x0_r in cells, d0 = c0_r - x0_r
PLIANT_INLINE void find_moments(match_group *group, int32_t i)
{
    const pliant_region_constants *constants = group->constants[i];
    float *a = group->a + (size_t)i * 9 * PLIANT_LANES;
    if (!constants) {
        for (int f = 0; f < 9; f++) pliant_f8_store(a + 8 * f, (pliant_f8){0});
        return;
    }
    const float *sums = group->sums[i];
    const pliant_f8 is_particle = pliant_f8_load(constants->is_particle);
    for (int c = 0; c < 3; c++) {
        const pliant_f8 sum = pliant_f8_load(sums + 8 * c);
        for (int d = 0; d < 3; d++)
            pliant_f8_store(a + 8 * (3 * c + d),
                            is_particle * (pliant_f8_load(sums + 8 * (3 + 3 * d + c)) -
                                           sum * pliant_f8_load(constants->offset[d])));
    }
}

// c_r (LSM-9) and T_r of eight regions.
PLIANT_INLINE void find_turn(const match_group *group, int32_t i, float cell_size, float *turn)
{
    const pliant_region_constants *constants = group->constants[i];
    if (!constants) {
        for (int f = 0; f < 12; f++) pliant_f8_store(turn + 8 * f, (pliant_f8){0});
        return;
    }
    const float *rotation = group->rotation + (size_t)i * 9 * PLIANT_LANES;
    const pliant_f8 is_particle = pliant_f8_load(constants->is_particle);
    const pliant_f8 inverse_mass = pliant_f8_load(constants->inverse_mass);
    const pliant_f8 scale = is_particle * pliant_f8_all(cell_size);
    for (int c = 0; c < 3; c++) {
        pliant_f8 goal = pliant_f8_load(group->sums[i] + 8 * c) * inverse_mass;
        pliant_f8 axis[3];
        for (int d = 0; d < 3; d++) {
            axis[d] = scale * pliant_f8_load(rotation + 8 * (3 * c + d));
            goal -= pliant_f8_load(constants->offset[d]) * axis[d];
        }
        pliant_f8_store(turn + 8 * (TURN_A + c), axis[0]);
        pliant_f8_store(turn + 8 * (TURN_B + c), axis[1]);
        pliant_f8_store(turn + 8 * (TURN_C + c), axis[2]);
        pliant_f8_store(turn + 8 * (TURN_P + c), is_particle * goal);
    }
}

PLIANT_INLINE void match_group_of(match_group *group, float cell_size, float *quaternions,
                                  float *turns)
{
    for (int32_t i = 0; i < group->count; i++) find_moments(group, i);
    int32_t any = 0;
    if (group->count == PLIANT_POLAR_GROUP)
        any = pliant_polar_try(PLIANT_POLAR_GROUP, group->a, quaternions, group->rotation,
                               group->missed);
    else
        for (int32_t i = 0; i < group->count; i++)
            any |= pliant_polar_try(1, group->a + 72 * i, quaternions + 32 * i,
                                    group->rotation + 72 * i, group->missed + 8 * i);
    for (int32_t i = 0; any && i < group->count; i++)
        pliant_polar_finish(group->a + 72 * i, group->missed + 8 * i, quaternions + 32 * i,
                            group->rotation + 72 * i);
    for (int32_t i = 0; i < group->count; i++)
        find_turn(group, i, cell_size, turns + (size_t)i * TURN_FLOATS);
}

// Sums over regions along z (LSM-7), and what is made of them.
PLIANT_INLINE void match_regions(pliant_body *body, int32_t column, float *turns,
                                 pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_lattice_column *c = &lattice->columns[column];
    const int32_t w = lattice->half_width;
    const float *sites = body->sites + (size_t)c->first_site * PLIANT_SITE_FLOATS;
    for (int32_t s = 0; s < c->length + 2 * w; s++)
        scratch->strip[s] = sites + (size_t)s * PLIANT_SITE_FLOATS;
    pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
    match_group group;
    for (int32_t first = 0; first < c->length; first += group.count) {
        int32_t block_count = 0;
        group.count =
            c->length - first < PLIANT_POLAR_GROUP ? c->length - first : PLIANT_POLAR_GROUP;
        for (int32_t i = 0; i < group.count; i++) {
            const int32_t s = first + i, turn = c->first_turn + s;
            const int32_t is_block = lattice->turn_block[turn] >= 0;
            block_count += is_block;
            group.constants[i] =
                is_block ? &body->region_constants[body->region_constants_of[turn]] : NULL;
            if (!is_block && w <= PLIANT_WINDOW_DIRECT) continue;
            pliant_f8 sum[9], moment[3];
            pliant_window_next(&window, s, 3, 6, sum, moment);
            for (int f = 0; f < 9; f++) pliant_f8_store(group.sums[i] + 8 * f, sum[f]);
            for (int f = 0; f < 3; f++) pliant_f8_store(group.sums[i] + 8 * (9 + f), moment[f]);
            pliant_repair_apply(scratch, s, 12, group.sums[i]);
        }
        if (block_count == 0) {
            memset(turns + (size_t)first * TURN_FLOATS, 0,
                   (size_t)group.count * TURN_FLOATS * sizeof *turns);
            continue;
        }
        match_group_of(&group, lattice->cell_size,
                       body->quaternion + (size_t)(c->first_turn + first) * 4 * PLIANT_LANES,
                       turns + (size_t)first * TURN_FLOATS);
    }
}

// T_r of listed regions, for those who leave it out.
PLIANT_INLINE void list_turns(pliant_body *body, int32_t column, const float *turns)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_exceptions *e = &lattice->exceptions;
    for (int32_t i = e->column_first[column]; i < e->column_first[column + 1]; i++) {
        const pliant_exception_place *place = &e->column_items[i];
        const int32_t k = place->k;
        const float *turn = turns + (size_t)place->s * TURN_FLOATS + place->lane;
        float *to = body->listed_turns + 16 * (size_t)k;
        if (!body->is_listed[k]) {
            memset(to, 0, 16 * sizeof *to);
            continue;
        }
        for (int c = 0; c < 3; c++) {
            to[c] = turn[8 * (TURN_P + c)];
            to[4 + c] = -turn[8 * (TURN_A + c)];
            to[8 + c] = -turn[8 * (TURN_B + c)];
            to[12 + c] = -turn[8 * (TURN_C + c)];
        }
    }
}

// Back along z: p of a plate is the sum of p + (z_plate - z_r) c.
PLIANT_INLINE void spread_regions(pliant_body *body, int32_t column, const float *turns,
                                  pliant_scratch *scratch)
{
    const pliant_lattice_column *c = &body->lattice->columns[column];
    const int32_t w = body->lattice->half_width;
    for (int32_t s = 0; s < 2 * w; s++)
        scratch->strip[s] = scratch->strip[2 * w + c->length + s] = zero_turn;
    for (int32_t s = 0; s < c->length; s++)
        scratch->strip[2 * w + s] = turns + (size_t)s * TURN_FLOATS;
    pliant_window window = {.w = w, .rows = scratch->strip, .tails = scratch->tails};
    float *site = body->sites + (size_t)c->first_site * PLIANT_SITE_FLOATS;
    for (int32_t s = 0; s < c->length + 2 * w; s++, site += PLIANT_SITE_FLOATS) {
        pliant_f8 sum[12], moment[3];
        pliant_window_next(&window, s, 3, 9, sum, moment);
        for (int k = 0; k < 3; k++) {
            pliant_f8_store(site + 8 * (SITE_P + k), sum[TURN_P + k] - moment[k]);
            pliant_f8_store(site + 8 * (SITE_A + k), sum[TURN_A + k]);
            pliant_f8_store(site + 8 * (SITE_B + k), sum[TURN_B + k]);
        }
    }
}

// What regions made of parts hand to them: to whole planes, and to restricted plates.
static void spread_apart(pliant_body *body, int32_t column, const pliant_scratch *scratch)
{
    const pliant_irregular *irregular = body->irregular;
    const pliant_lattice_column *c = &body->lattice->columns[column];
    const int32_t w = body->lattice->half_width, width = 2 * w + 1;
    pliant_plates_clear(body, column, body->plate_sums, 9);
    const float *turn = scratch->apart;
    for (int32_t n = irregular->column_head[column]; n >= 0;
         n = irregular->regions[n].next, turn += 12) {
        const pliant_region_node *node = &irregular->regions[n];
        const float sign = (float)node->sign;
        for (int32_t i = 0; i < node->part_count; i++) {
            const pliant_part *part = &irregular->parts[(size_t)n * width + i];
            const float dz = (float)(part->plane - w);
            float *to = part->plate >= 0
                            ? body->plate_sums + 9 * (size_t)part->plate
                            : body->sites +
                                  (size_t)(c->first_site + node->z - c->z + part->plane) *
                                      PLIANT_SITE_FLOATS +
                                  node->lane;
            const int32_t apart = part->plate >= 0 ? 1 : PLIANT_LANES;
            for (int k = 0; k < 3; k++) {
                to[apart * (SITE_P + k)] += sign * (turn[TURN_P + k] + dz * turn[TURN_C + k]);
                to[apart * (SITE_A + k)] += sign * turn[TURN_A + k];
                to[apart * (SITE_B + k)] += sign * turn[TURN_B + k];
            }
        }
    }
}

PLIANT_VECTOR_CLONES
void pliant_column_match(pliant_body *body, int32_t column, pliant_scratch *scratch)
{
    const pliant_lattice *lattice = body->lattice;
    float *sites = body->sites + (size_t)lattice->columns[column].first_site * PLIANT_SITE_FLOATS;
    pliant_sites_clear(lattice, column, sites, 9);
    find_repairs(body, column, sites, scratch);
    match_regions(body, column, scratch->turns, scratch);
    list_turns(body, column, scratch->turns);
    pliant_turns_set_apart(body, column, 12, scratch->turns, scratch);
    spread_regions(body, column, scratch->turns, scratch);
    spread_apart(body, column, scratch);
}
