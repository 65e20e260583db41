// dents.c: particles that are inside another body, and the way out.
//
// This follows: S. Fisher and M. C. Lin, Fast Penetration Depth Estimation for Elastic Bodies Using
// Deformed Distance Fields, IROS 2001; and for finding points in cells M. Teschner et al., VMV
// 2003.
#include "lattice/dents.h"

#include <math.h>
#include <string.h>

#define DENT_TASK    64  // cells of a task
#define NEWTON_LIMIT 8
#define NEWTON_STEP  1.5f  // cells: farther at once is no cell that can be inverted
// Steps double their digits: what this leaves is rounding.
#define NEWTON_ENOUGH 1e-3f
// From the middle, in cells, by the map there. A point of a cell is that far out at most while the
// map at the middle is off by less than a quarter of a cell; cells bent more may miss some.
#define BESIDE     0.75f
#define CELL_SLACK 1e-3f  // beyond a cell's faces, so that nothing falls between two
// Cells stretched to more than this, in cells, are torn or thrown about and hold nobody.
#define CELL_STRETCH 4.0f
// Depths that change by less than this part of the way are those of a shape's middle: no way out.
#define NO_DIRECTION 0.1f
// As balls that overlap (touches.c).
#define PART_SHARE 0.1f
#define PART_SPEED 10.0f  // cells a second

// The corners of a cell of the crowd, and their depths. Made for the first point that is looked at:
// the cell's map as a polynomial about corner 0,
//
//     x = x_0 + p_1 a + p_2 b + p_3 ab + p_4 c + p_5 ac + p_6 bc + p_7 abc
//
// and its inverse at the middle, which tells that most points of the cell's box are beside it.
typedef struct hull {
    const pliant_member *member;
    const int32_t *particles;  // of the member
    float x[8][3], depth[8];
    int32_t is_made;
    float p[8][3], middle[3], inverse[3][3];
} hull;

static int32_t member_of_cell(const pliant_crowd *crowd, int32_t cell)
{
    int32_t least = 0, most = crowd->member_count;
    while (most - least > 1) {
        const int32_t middle = (least + most) / 2;
        if (crowd->members[middle].cell_first <= cell) least = middle;
        else most = middle;
    }
    return least;
}

static void load_hull(const pliant_crowd *crowd, const pliant_member *member, int32_t cell, hull *h)
{
    h->member = member;
    h->is_made = 0;
    h->particles = crowd->corners + 8 * (size_t)cell;
    for (int k = 0; k < 8; k++) {
        const int32_t p = h->particles[k], slot = member->body->lattice->slot[p];
        for (int c = 0; c < 3; c++) h->x[k][c] = member->body->x[slot + PLIANT_LANES * c];
        h->depth[k] = crowd->depth[member->first + p];
    }
}

static float determinant(const float m[3][3])
{
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// Solve m t = r; 0: it has no inverse to speak of, or turns the cell inside out.
static int32_t solve(const float m[3][3], const float r[3], float least, float t[3])
{
    const float whole = determinant(m);
    if (!(whole > least)) return 0;
    for (int c = 0; c < 3; c++) {
        float part[3][3];
        memcpy(part, m, sizeof part);
        for (int k = 0; k < 3; k++) part[k][c] = r[k];
        t[c] = determinant((const float(*)[3])part) / whole;
    }
    return 1;
}

// J[r][c] = dx_r / dt_c, and what is left of the way to the point (relative to corner 0).
static void map(const hull *h, const float *point, const float t[3], float J[3][3], float left[3])
{
    const float a = t[0], b = t[1], c = t[2];
    for (int r = 0; r < 3; r++) {
        const float p3 = h->p[3][r], p5 = h->p[5][r], p6 = h->p[6][r], p7 = h->p[7][r];
        J[r][0] = h->p[1][r] + p3 * b + p5 * c + p7 * b * c;
        J[r][1] = h->p[2][r] + p3 * a + p6 * c + p7 * a * c;
        J[r][2] = h->p[4][r] + p5 * a + p6 * b + p7 * a * b;
        left[r] = point[r] - (J[r][0] * a + (h->p[2][r] + p6 * c) * b + h->p[4][r] * c);
    }
}

static float least_volume(const hull *h)
{
    const float size = h->member->body->lattice->cell_size;
    return 1e-3f * size * size * size;
}

static void make(hull *h)
{
    for (int r = 0; r < 3; r++) {
        float e[8];
        for (int k = 0; k < 8; k++) e[k] = h->x[k][r] - h->x[0][r];
        h->p[1][r] = e[1];
        h->p[2][r] = e[2];
        h->p[3][r] = e[3] - e[1] - e[2];
        h->p[4][r] = e[4];
        h->p[5][r] = e[5] - e[1] - e[4];
        h->p[6][r] = e[6] - e[2] - e[4];
        h->p[7][r] = e[7] - e[6] - e[5] - e[3] + e[1] + e[2] + e[4];
    }
    const float half[3] = {0.5f, 0.5f, 0.5f}, none[3] = {0, 0, 0};
    float J[3][3], column[3];
    map(h, none, half, J, h->middle);
    for (int c = 0; c < 3; c++) {
        const float unit[3] = {c == 0, c == 1, c == 2};
        h->middle[c] = -h->middle[c];
        if (!solve((const float(*)[3])J, unit, least_volume(h), column))
            memset(column, 0, sizeof column);
        for (int r = 0; r < 3; r++) h->inverse[r][c] = column[r];
    }
    h->is_made = 1;
}

// The place t in the cell that the point is at, and the map's derivatives there. 1: it is in the
// cell.
static int32_t invert(hull *h, const float *x, float t[3], float J[3][3])
{
    if (!h->is_made) make(h);
    float point[3], left[3], step[3];
    for (int c = 0; c < 3; c++) point[c] = x[c] - h->x[0][c];
    for (int r = 0; r < 3; r++) {
        const float *row = h->inverse[r];
        t[r] = row[0] * (point[0] - h->middle[0]) + row[1] * (point[1] - h->middle[1]) +
               row[2] * (point[2] - h->middle[2]);
        if (!(fabsf(t[r]) <= BESIDE)) return 0;
        t[r] += 0.5f;
    }
    for (int i = 0; i < NEWTON_LIMIT; i++) {
        map(h, point, t, J, left);
        if (!solve((const float(*)[3])J, left, least_volume(h), step)) return 0;
        float farthest = 0;
        for (int c = 0; c < 3; c++) {
            t[c] += step[c];
            farthest = fabsf(step[c]) > farthest ? fabsf(step[c]) : farthest;
        }
        if (!(farthest <= NEWTON_STEP)) return 0;
        if (farthest > NEWTON_ENOUGH) continue;
        for (int c = 0; c < 3; c++)
            if (!(t[c] >= -CELL_SLACK && t[c] <= 1 + CELL_SLACK)) return 0;
        return 1;
    }
    return 0;
}

// Weights of the corners at t, and the slope of the depth.
static void find_weights(const hull *h, const float t[3], float weights[8], float slope[3])
{
    memset(slope, 0, 3 * sizeof *slope);
    for (int k = 0; k < 8; k++) {
        const float a = k & 1 ? t[0] : 1 - t[0], b = k & 2 ? t[1] : 1 - t[1],
                    d = k & 4 ? t[2] : 1 - t[2];
        weights[k] = a * b * d;
        slope[0] += (k & 1 ? 1 : -1) * b * d * h->depth[k];
        slope[1] += (k & 2 ? 1 : -1) * a * d * h->depth[k];
        slope[2] += (k & 4 ? 1 : -1) * a * b * h->depth[k];
    }
}

static float depth_at(const hull *h, const float weights[8])
{
    float depth = 0;
    for (int k = 0; k < 8; k++) depth += weights[k] * h->depth[k];
    return depth;
}

// ---- Choosing ----

typedef struct box {
    float low[3], high[3];
} box;

static box box_of(const hull *h)
{
    box b;
    for (int c = 0; c < 3; c++) {
        b.low[c] = b.high[c] = h->x[0][c];
        for (int k = 1; k < 8; k++) {
            b.low[c] = h->x[k][c] < b.low[c] ? h->x[k][c] : b.low[c];
            b.high[c] = h->x[k][c] > b.high[c] ? h->x[k][c] : b.high[c];
        }
    }
    return b;
}

// 1: some of it is below the surface.
static int32_t is_below(const pliant_crowd *crowd, const pliant_member *member, int32_t cell)
{
    const int32_t *corners = crowd->corners + 8 * (size_t)cell;
    const float *depth = crowd->depth + member->first;
    for (int k = 0; k < 8; k++)
        if (depth[corners[k]] < 0) return 1;
    return 0;
}

// 1: worth a look: in one piece, near another body.
static int32_t is_of_interest(const pliant_touches *touches, int32_t member, const hull *h,
                              const box *b)
{
    const float size = h->member->body->lattice->cell_size;
    float middle[3], reach = 0;
    for (int c = 0; c < 3; c++) {
        const float side = b->high[c] - b->low[c];
        if (!(side <= CELL_STRETCH * size)) return 0;
        middle[c] = 0.5f * (b->low[c] + b->high[c]);
        reach = fmaxf(reach, side);
    }
    return pliant_overlaps_has(&touches->overlaps, touches->crowd, member, middle, 0.25f * reach);
}

static void offer(pliant_touches *touches, int32_t member, int32_t cell, hull *h, const box *b,
                  int32_t k)
{
    const float *point = touches->hash.sorted + 4 * (size_t)k;
    for (int c = 0; c < 3; c++)
        if (!(point[c] >= b->low[c] && point[c] <= b->high[c])) return;
    if (touches->crowd->owner[touches->particle[k]] == member) return;
    int before = atomic_load_explicit(&touches->chosen[k], memory_order_relaxed);
    float weights[8], t[3], J[3][3], slope[3];
    if (before <= cell || !invert(h, point, t, J)) return;
    find_weights(h, t, weights, slope);
    if (!(depth_at(h, weights) < 0)) return;
    while (cell < before &&
           !atomic_compare_exchange_weak_explicit(&touches->chosen[k], &before, cell,
                                                  memory_order_relaxed, memory_order_relaxed)) {
    }
}

static void look_in_cell(pliant_touches *touches, int32_t member, int32_t cell)
{
    const pliant_hash *hash = &touches->hash;
    const pliant_member *m = &touches->crowd->members[member];
    if (!is_below(touches->crowd, m, cell)) return;
    hull h;
    load_hull(touches->crowd, m, cell, &h);
    const box b = box_of(&h);
    if (!is_of_interest(touches, member, &h, &b)) return;
    int32_t low[3], high[3];
    pliant_hash_cell(hash, b.low, low);
    pliant_hash_cell(hash, b.high, high);
    for (int32_t z = low[2]; z <= high[2]; z++)
        for (int32_t y = low[1]; y <= high[1]; y++) {
            const pliant_hash_range range =
                pliant_hash_find(hash, low[0], y, z, 0, high[0] - low[0]);
            for (int r = 0; r < 2; r++)
                for (int32_t k = range.from[r]; k < range.to[r]; k++)
                    offer(touches, member, cell, &h, &b, k);
        }
}

static void look_in_cells(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_touches *touches = context;
    const pliant_crowd *crowd = touches->crowd;
    const int32_t begin = task * DENT_TASK;
    int32_t member = member_of_cell(crowd, begin);
    for (int32_t cell = begin; cell < crowd->cell_count && cell < begin + DENT_TASK; cell++) {
        while (cell >= crowd->members[member].cell_first + crowd->members[member].cell_count)
            member++;
        if (touches->overlaps.count[member] > 0) look_in_cell(touches, member, cell);
    }
}

void pliant_dents_choose(pliant_touches *touches, pliant_team *team)
{
    for (int32_t k = 0; k < touches->hashed_count; k++)
        atomic_store_explicit(&touches->chosen[k], PLIANT_NO_CELL, memory_order_relaxed);
    const int32_t tasks = (touches->crowd->cell_count + DENT_TASK - 1) / DENT_TASK;
    pliant_team_run(team, tasks, look_in_cells, touches);
}

// ---- The way out ----

int32_t pliant_dents_find(pliant_touches *touches, int32_t participant, pliant_touch *touch)
{
    const pliant_crowd *crowd = touches->crowd;
    const int32_t cell = atomic_load_explicit(&touches->chosen[participant], memory_order_relaxed);
    if (cell == PLIANT_NO_CELL) return 0;
    hull h;
    load_hull(crowd, &crowd->members[member_of_cell(crowd, cell)], cell, &h);
    pliant_touched_cell *touched = &touches->cells[participant];
    float t[3], J[3][3], slope[3], n[3], turned[3][3];
    const float *point = touches->hash.sorted + 4 * (size_t)participant;
    if (!invert(&h, point, t, J)) return 0;
    find_weights(&h, t, touched->weights, slope);
    // The depth's gradient in space: J^T n = slope.
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) turned[r][c] = J[c][r];
    const float size = h.member->body->lattice->cell_size;
    if (!solve((const float(*)[3])turned, slope, least_volume(&h), n)) return 0;
    const float steepness = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (!(steepness > NO_DIRECTION)) return 0;
    const float out = -depth_at(&h, touched->weights) / steepness;
    for (int k = 0; k < 8; k++) touched->corners[k] = h.member->first + h.particles[k];
    *touch = (pliant_touch){.normal = {n[0] / steepness, n[1] / steepness, n[2] / steepness},
                            .target = fminf(PART_SHARE * out / touches->dt, PART_SPEED * size),
                            .a = participant,
                            .b = -1};
    return 1;
}
