// motion.c: bounds of a surface's motion from wavelet coefficients.
#include "motion.h"

#include "pliant/vector_clones.h"

#include <math.h>
#include <string.h>

void pliant_motion_lay_out(pliant_arena *arena, const pliant_solver *solver, pliant_motion *motion)
{
    const pliant_model *model = solver->model;
    const size_t rows = (size_t)model->domains[PLIANT_DOMAIN_FREE].count + 1;
    PLIANT_TAKE(arena, motion->before, 4 * rows);
    PLIANT_TAKE(arena, motion->work, 4 * rows);
    PLIANT_TAKE(arena, motion->fixed_before, 4 * (size_t)model->domains[PLIANT_DOMAIN_FIXED].count);
    PLIANT_TAKE(arena, motion->solved, solver->constraint_capacity);
}

void pliant_motion_fill(const pliant_model *model, pliant_motion *motion)
{
    const pliant_wavelet *wavelet = model->domains[PLIANT_DOMAIN_FREE].wavelet;
    const int32_t m = wavelet->count;
    float *sum = motion->before;
    for (int32_t l = 0; l < wavelet->level_count; l++) {
        memset(sum, 0, 4 * ((size_t)m + 1) * sizeof *sum);
        const int32_t begin = wavelet->level_offset[l], end = wavelet->level_offset[l + 1];
        // Three at once: x, y, z of a row are transformed alike.
        for (int32_t i = begin; i < end; i += 3) {
            memset(motion->work, 0, 4 * ((size_t)m + 1) * sizeof *motion->work);
            for (int32_t c = 0; c < 3 && i + c < end; c++)
                motion->work[4 * (size_t)(i + c) + c] = 1;
            pliant_wavelet_inverse_online(wavelet, wavelet->level_count - 1, motion->work);
            for (int32_t p = 0; p < m; p++)
                for (int c = 0; c < 3; c++)
                    sum[4 * (size_t)p] += fabsf(motion->work[4 * (size_t)p + c]);
        }
        float most = 0;
        for (int32_t p = 0; p < m; p++) most = fmaxf(most, sum[4 * (size_t)p]);
        motion->kappa[l] = (double)most;
    }
    memset(motion->before, 0, 4 * ((size_t)m + 1) * sizeof *motion->before);
    motion->is_same_set = 1;
}

// Four rows at a time.
typedef float row16 __attribute__((vector_size(64)));
typedef int32_t mask16 __attribute__((vector_size(64)));

static inline void take(const mask16 *where, const row16 *from, row16 *to)
{
    *to = (row16)((*where & (mask16)*from) | (~*where & (mask16)*to));
}

// Widen the box between `low` and `high` to the change from `then` to `now`.
static inline void widen(const row16 *now, const row16 *then, row16 *low, row16 *high)
{
    const row16 change = *now - *then;
    const mask16 rising = change > *high, falling = change < *low;
    take(&rising, &change, high);
    take(&falling, &change, low);
}

// A bound of the largest change in rows [begin, end), by the largest numbers of each component.
// Takes the rows over.
PLIANT_VECTOR_CLONES
static double compare(const float *g, float *before, int32_t begin, int32_t end)
{
    row16 low = {0}, high = {0}, now = {0}, then = {0};
    int32_t p = begin;
    for (; p + 4 <= end; p += 4) {
        memcpy(&now, g + 4 * (size_t)p, sizeof now);
        memcpy(&then, before + 4 * (size_t)p, sizeof then);
        widen(&now, &then, &low, &high);
        memcpy(before + 4 * (size_t)p, &now, sizeof now);
    }
    const size_t left = 4 * (size_t)(end - p) * sizeof *g;
    memset(&now, 0, sizeof now);
    memset(&then, 0, sizeof then);
    memcpy(&now, g + 4 * (size_t)p, left);
    memcpy(&then, before + 4 * (size_t)p, left);
    widen(&now, &then, &low, &high);
    memcpy(before + 4 * (size_t)p, &now, left);
    double square = 0;
    for (int c = 0; c < 3; c++) {
        double most = 0;
        for (int k = c; k < 16; k += 4) most = fmax(most, fmax((double)high[k], -(double)low[k]));
        square += most * most;
    }
    return sqrt(square);
}

static double size_of(pliant_vec3 v)
{
    return sqrt((double)v.x * (double)v.x + (double)v.y * (double)v.y + (double)v.z * (double)v.z);
}

// Fixed vertices that are under hats: |sum of hats| is at most the sum over the levels of the
// largest value on each.
static void look_at_fixed(pliant_motion *motion, const pliant_solver *solver)
{
    const pliant_model *model = solver->model;
    double most[PLIANT_LEVEL_LIMIT + 1] = {0}, size = 0;
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const pliant_node node = solver->solved[i].node;
        if (model->domain[node.vertex] == PLIANT_DOMAIN_FIXED)
            most[node.level] = fmax(most[node.level], size_of(solver->reference[i]));
    }
    for (int32_t i = 0; i < solver->load_count; i++) {
        const pliant_node node = solver->loads[i].node;
        if (model->domain[node.vertex] == PLIANT_DOMAIN_FIXED && node.level < model->finest_level)
            most[node.level] = fmax(most[node.level], size_of(solver->loads[i].summed));
    }
    for (int32_t l = 0; l < model->level_count; l++) size += most[l];
    motion->moved += size + motion->fixed_size;
    motion->fixed_size = size;
}

static pliant_vec3 difference(pliant_vec3 a, pliant_vec3 b)
{
    return (pliant_vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

// Displaced vertices go where they are told. Both sets ascend.
static void follow(pliant_motion *motion, const pliant_solver *solver)
{
    motion->is_same_set = motion->solved_count == solver->solved_count;
    for (int32_t i = 0, k = 0; i < solver->solved_count; i++) {
        const pliant_constraint *now = &solver->solved[i];
        while (k < motion->solved_count && motion->solved[k].node.vertex < now->node.vertex) k++;
        const pliant_constraint *then = &motion->solved[k];
        if (k == motion->solved_count || then->node.vertex != now->node.vertex) {
            motion->is_same_set = 0;
            continue;
        }
        motion->is_same_set &= then->node.level == now->node.level;
        motion->moved = fmax(motion->moved, size_of(difference(now->value, then->value)));
    }
    memcpy(motion->solved, solver->solved, (size_t)solver->solved_count * sizeof *motion->solved);
    motion->solved_count = solver->solved_count;
}

void pliant_motion_update(pliant_motion *motion, pliant_solver *solver)
{
    const pliant_model *model = solver->model;
    const pliant_wavelet *wavelet = model->domains[PLIANT_DOMAIN_FREE].wavelet;
    pliant_solver_sum(solver, PLIANT_DOMAIN_FREE);
    motion->moved = 0;
    for (int32_t l = 0; l < wavelet->level_count; l++)
        motion->moved +=
            motion->kappa[l] * compare(solver->fields[PLIANT_DOMAIN_FREE].g, motion->before,
                                       wavelet->level_offset[l], wavelet->level_offset[l + 1]);
    motion->moved = fmax(motion->moved, compare(solver->fixed_displacement, motion->fixed_before, 0,
                                                model->domains[PLIANT_DOMAIN_FIXED].count));
    follow(motion, solver);
    look_at_fixed(motion, solver);
}
