// slow_lattice.h: lattice shape matching without FastLSM's sums, to measure what these save.
//
// Two ways to sum over every region, forward and back, in floats, 12 fields a particle beside each
// other, everything else alike and rotations by the library:
//     lists   one by one over a list of the region's particles, O(w^3)
//     planes  bars, plates and cubes of 2w + 1 each on a dense grid (LSM-3), O(w): each region is
//             its whole window, whatever it lacks
// Lists of many regions are longer than memory: they are made for some only, runs of neighbours
// spread over the lattice, and the time of these stands for all.
#pragma once

#include "lattices.h"

#include "lattice/polar.h"
#include "pliant/vector_clones.h"

#define SLOW_FIELDS 12       // of a particle: m~ x, m~ x x0^T; of a region: T_r
#define SLOW_LIMIT  8000000  // members in lists
#define SLOW_RUN    32       // neighbours with lists

typedef float slow_fields[SLOW_FIELDS];

typedef struct slow_lattice {
    const bench_lattice *from;
    int32_t count;           // particles
    float *share, *inverse;  // shape [count]: m~, 1 / |R|
    float *mass, *centre;    // shapes [count], [count][3]: M_r, c0_r
    float *rest, *v;         // shape [count][3]: x0 about the middle; velocities that come out
    float *quaternion;       // shape [(chosen_count + 7) / 8][4][8]
    slow_fields *fields, *sums, *turns;  // shape [count]
    int32_t chosen_count, *chosen;       // whose regions are matched, shape [chosen_count]
    // Lists: members of chosen[k] are member[first[k]] .. member[first[k + 1] - 1].
    int64_t *first;
    int32_t *member;
    // Planes: NULL when lists are used. Shape [nz + 2w][ny + 2w][nx + 2w].
    slow_fields *grid, *bars, *plates;
    int64_t *place;  // shape [count]: of a particle in these
    int64_t stride[3];
} slow_lattice;

// ---- Sums ----

static PLIANT_VECTOR_CLONES void slow_sum_lists(const slow_lattice *s, const slow_fields *from,
                                                slow_fields *to)
{
    for (int32_t k = 0; k < s->chosen_count; k++) {
        slow_fields sum = {0};
        for (int64_t i = s->first[k]; i < s->first[k + 1]; i++)
            for (int f = 0; f < SLOW_FIELDS; f++) sum[f] += from[s->member[i]][f];
        memcpy(to[s->chosen[k]], sum, sizeof sum);
    }
}

// LSM-3: the 2w + 1 neighbours along an axis, for every place that has some.
static PLIANT_VECTOR_CLONES void slow_sum_along(const slow_lattice *s, int64_t stride,
                                                const slow_fields *from, slow_fields *to)
{
    const int32_t w = s->from->regions->half_width, *dims = s->from->shape.dims;
    for (int32_t z = 0; z < dims[2]; z++)
        for (int32_t y = 0; y < dims[1]; y++) {
            const int64_t row = (z + w) * s->stride[2] + (y + w) * s->stride[1] + w;
            for (int32_t x = 0; x < dims[0]; x++) {
                slow_fields sum = {0};
                for (int32_t d = -w; d <= w; d++)
                    for (int f = 0; f < SLOW_FIELDS; f++) sum[f] += from[row + x + d * stride][f];
                memcpy(to[row + x], sum, sizeof sum);
            }
        }
}

static PLIANT_VECTOR_CLONES void slow_sum_planes(const slow_lattice *s, const slow_fields *from,
                                                 slow_fields *to)
{
    const int32_t w = s->from->regions->half_width;
    for (int32_t p = 0; p < s->count; p++) memcpy(s->grid[s->place[p]], from[p], sizeof *from);
    slow_sum_along(s, 1, (const slow_fields *)s->grid, s->bars);
    slow_sum_along(s, s->stride[1], (const slow_fields *)s->bars, s->plates);
    for (int32_t p = 0; p < s->count; p++) {
        slow_fields sum = {0};
        for (int32_t d = -w; d <= w; d++)
            for (int f = 0; f < SLOW_FIELDS; f++)
                sum[f] += s->plates[s->place[p] + d * s->stride[2]][f];
        memcpy(to[p], sum, sizeof sum);
    }
}

static inline void slow_sum(const slow_lattice *s, slow_fields *from, slow_fields *to)
{
    if (s->grid) slow_sum_planes(s, (const slow_fields *)from, to);
    else slow_sum_lists(s, (const slow_fields *)from, to);
}

// ---- A step ----

static PLIANT_VECTOR_CLONES void slow_weigh(const slow_lattice *s, const pliant_body *body)
{
    for (int32_t p = 0; p < s->count; p++)
        for (int c = 0; c < 3; c++) {
            const float at = body->x[body->lattice->slot[p] + PLIANT_LANES * c];
            const float x = s->share[p] * (at - body->origin[c]);
            s->fields[p][c] = x;
            for (int d = 0; d < 3; d++)
                s->fields[p][3 + 3 * c + d] = x * s->rest[3 * (size_t)p + d];
        }
}

// A_r (LSM-11), R_r, T_r of eight chosen regions.
static PLIANT_VECTOR_CLONES void slow_match(const slow_lattice *s, int32_t k)
{
    float a[9 * PLIANT_LANES] = {0}, r[9 * PLIANT_LANES];
    const int32_t lanes = s->chosen_count - k < PLIANT_LANES ? s->chosen_count - k : PLIANT_LANES;
    for (int32_t l = 0; l < lanes; l++) {
        const int32_t p = s->chosen[k + l];
        const float *sum = s->sums[p], *centre = s->centre + 3 * (size_t)p;
        for (int i = 0; i < 9; i++) a[8 * i + l] = sum[3 + i] - sum[i / 3] * centre[i % 3];
    }
    pliant_polar_block(a, s->quaternion + (size_t)k * 4, r);
    for (int32_t l = 0; l < lanes; l++) {
        const int32_t p = s->chosen[k + l];
        const float *centre = s->centre + 3 * (size_t)p;
        for (int c = 0; c < 3; c++) {
            float goal = s->sums[p][c] / s->mass[p];
            for (int d = 0; d < 3; d++) {
                s->turns[p][3 + 3 * c + d] = r[8 * (3 * c + d) + l];
                goal -= r[8 * (3 * c + d) + l] * centre[d];
            }
            s->turns[p][c] = goal;
        }
    }
}

// LSM-12, 1: of the chosen.
static PLIANT_VECTOR_CLONES void slow_accelerate(const slow_lattice *s, const pliant_body *body)
{
    for (int32_t k = 0; k < s->chosen_count; k++) {
        const int32_t p = s->chosen[k], slot = body->lattice->slot[p];
        const float *sum = s->sums[p], *rest = s->rest + 3 * (size_t)p;
        for (int c = 0; c < 3; c++) {
            float goal = sum[c];
            for (int d = 0; d < 3; d++) goal += sum[3 + 3 * c + d] * rest[d];
            const float x = body->x[slot + PLIANT_LANES * c] - body->origin[c];
            s->v[3 * (size_t)p + c] =
                body->v[slot + PLIANT_LANES * c] + (s->inverse[p] * goal - x) / BENCH_TIME_STEP;
        }
    }
}

// Velocities after the step that `body` is about to do; returns nanoseconds of all regions.
static inline double slow_step(const slow_lattice *s, const pliant_body *body)
{
    const double start = bench_cpu_ns();
    slow_weigh(s, body);
    const double weighed = bench_cpu_ns();
    slow_sum(s, s->fields, s->sums);
    for (int32_t k = 0; k < s->chosen_count; k += PLIANT_LANES) slow_match(s, k);
    slow_sum(s, s->turns, s->sums);
    slow_accelerate(s, body);
    return weighed - start + (bench_cpu_ns() - weighed) * s->count / s->chosen_count;
}

// Largest difference to the velocities of a body that has done its step, in cells a step.
static inline double slow_difference(const slow_lattice *s, const pliant_body *body)
{
    double most = 0;
    for (int32_t p = 0; p < s->count; p++)
        for (int c = 0; c < 3; c++)
            most = fmax(most, fabs((double)(s->v[3 * (size_t)p + c] -
                                            body->v[body->lattice->slot[p] + PLIANT_LANES * c])));
    return most * (double)BENCH_TIME_STEP / (double)body->lattice->cell_size;
}

// ---- Life ----

static inline void slow_list(slow_lattice *s)
{
    const bench_lattice *from = s->from;
    const int32_t w = from->regions->half_width, runs = (s->count + SLOW_RUN - 1) / SLOW_RUN;
    const int64_t width = 2 * w + 1, most = SLOW_LIMIT / (width * width * width) / SLOW_RUN;
    const int32_t step = most >= runs ? 1 : (int32_t)((runs + most - 1) / most);
    pliant_reach *reach = bench_take(1, sizeof *reach);
    pliant_links *links;
    pliant_error err = {""};
    require(pliant_links_create(&from->shape, &links, &err), &err);
    for (int32_t run = step / 2; run < runs; run += step)
        for (int32_t p = run * SLOW_RUN; p < s->count && p < (run + 1) * SLOW_RUN; p++)
            s->chosen[s->chosen_count++] = p;
    int64_t total = 0;
    for (int32_t k = 0; k < s->chosen_count; k++) total += from->regions->size[s->chosen[k]];
    s->first = bench_take((size_t)s->chosen_count + 1, sizeof *s->first);
    s->member = bench_take((size_t)total, sizeof *s->member);
    total = 0;
    for (int32_t k = 0; k < s->chosen_count; k++) {
        const int32_t *at = from->shape.particles + 3 * (size_t)s->chosen[k];
        pliant_links_reach(links, at[0], at[1], at[2], w, reach);
        for (int32_t z = 0; z <= 2 * w; z++)
            for (int32_t y = 0; y <= 2 * w; y++)
                for (uint32_t rest = reach->member[z][y]; rest; rest &= rest - 1)
                    s->member[total++] = pliant_links_particle(
                        links, at[0] + __builtin_ctz(rest) - w, at[1] + y - w, at[2] + z - w);
        s->first[k + 1] = total;
    }
    pliant_links_destroy(links);
    free(reach);
}

static inline void slow_lay_planes(slow_lattice *s)
{
    const int32_t w = s->from->regions->half_width, *dims = s->from->shape.dims;
    s->stride[0] = 1;
    s->stride[1] = dims[0] + 2 * w;
    s->stride[2] = s->stride[1] * (dims[1] + 2 * w);
    const size_t places = (size_t)s->stride[2] * (size_t)(dims[2] + 2 * w);
    s->grid = bench_take(places, sizeof *s->grid);
    s->bars = bench_take(places, sizeof *s->bars);
    s->plates = bench_take(places, sizeof *s->plates);
    s->place = bench_take((size_t)s->count, sizeof *s->place);
    for (int32_t p = 0; p < s->count; p++) {
        const int32_t *at = s->from->shape.particles + 3 * (size_t)p;
        s->place[p] = at[0] + w + (at[1] + w) * s->stride[1] + (at[2] + w) * s->stride[2];
        s->chosen[s->chosen_count++] = p;
    }
}

typedef enum slow_way { SLOW_LISTS, SLOW_PLANES } slow_way;

static inline slow_lattice slow_lattice_create(const bench_lattice *from, slow_way way)
{
    const size_t count = (size_t)from->shape.particle_count;
    slow_lattice s = {
        .from = from,
        .count = (int32_t)count,
        .share = bench_take(count, sizeof(float)),
        .inverse = bench_take(count, sizeof(float)),
        .mass = bench_take(count, sizeof(float)),
        .centre = bench_take(3 * count, sizeof(float)),
        .rest = bench_take(3 * count, sizeof(float)),
        .v = bench_take(3 * count, sizeof(float)),
        .fields = bench_take(count, sizeof(slow_fields)),
        .sums = bench_take(count, sizeof(slow_fields)),
        .turns = bench_take(count, sizeof(slow_fields)),
        .chosen = bench_take(count, sizeof(int32_t)),
    };
    if (way == SLOW_PLANES) slow_lay_planes(&s);
    else slow_list(&s);
    const int32_t lanes = (s.chosen_count + PLIANT_LANES - 1) / PLIANT_LANES * PLIANT_LANES;
    s.quaternion = bench_take(4 * (size_t)lanes, sizeof(float));
    for (int32_t k = 0; k < lanes; k++) s.quaternion[k / 8 * 32 + 24 + k % 8] = 1;
    const float *rest = pliant_lattice_positions(from->lattice);
    for (int32_t p = 0; p < s.count; p++) {
        s.inverse[p] = 1 / (float)from->regions->size[p];
        s.share[p] = s.inverse[p] * (float)pliant_lattice_particle_mass(from->lattice, p);
        s.fields[p][0] = s.share[p];
        for (int c = 0; c < 3; c++) {
            s.rest[3 * p + c] = rest[3 * p + c] - rest[3 * (s.count / 2) + c];
            s.fields[p][1 + c] = s.share[p] * s.rest[3 * p + c];
        }
    }
    slow_sum(&s, s.fields, s.sums);
    for (int32_t k = 0; k < s.chosen_count; k++) {
        const int32_t p = s.chosen[k];
        s.mass[p] = s.sums[p][0];
        for (int c = 0; c < 3; c++) s.centre[3 * p + c] = s.sums[p][1 + c] / s.mass[p];
    }
    return s;
}

static inline void slow_lattice_destroy(slow_lattice *s)
{
    void *all[] = {s->share,  s->inverse, s->mass,       s->centre, s->rest,  s->v,
                   s->fields, s->sums,    s->turns,      s->chosen, s->first, s->member,
                   s->grid,   s->bars,    s->quaternion, s->plates, s->place};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]);
}
