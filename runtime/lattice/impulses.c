// impulses.c: the impulses that keep apart what touches.
//
// This follows: sequential impulses (E. Catto, Iterative Dynamics with Temporal Coherence, GDC
// 2005) in the colours of a greedily coloured graph, as Box2D v3 has them. All touches at once,
// each scaled down by the touches of its busiest side (Jacobi), was tried and lost: five passes
// left 40% of the approach in a heap, and balls slipped between each other.
#include "lattice/impulses.h"

#include <math.h>
#include <string.h>

#define PASS_COUNT  8
#define TOUCH_TASK  256                        // touches of a task
#define LAST_COLOUR (PLIANT_COLOUR_LIMIT - 1)  // of what no other fits: one after another

void pliant_impulses_lay_out(pliant_impulses *impulses, pliant_arena *arena,
                             const pliant_touches *touches)
{
    PLIANT_TAKE(arena, impulses->used, touches->participant_capacity);
    PLIANT_TAKE(arena, impulses->colour, touches->touch_capacity);
    PLIANT_TAKE(arena, impulses->sorted, touches->touch_capacity);
}

// The first colour that none of its participants has yet, and has now.
static int32_t choose_colour(const pliant_touches *touches, const pliant_touch *touch,
                             uint64_t *used)
{
    const int32_t *others = touch->b >= 0 ? &touch->b : touches->cells[touch->a].corners;
    const int32_t count = touch->b >= 0 ? 1 : 8;
    uint64_t taken = used[touch->a] | (uint64_t)1 << LAST_COLOUR;
    for (int32_t i = 0; i < count; i++) taken |= used[others[i]];
    const int32_t colour = ~taken ? __builtin_ctzll(~taken) : LAST_COLOUR;
    used[touch->a] |= (uint64_t)1 << colour;
    for (int32_t i = 0; i < count; i++) used[others[i]] |= (uint64_t)1 << colour;
    return colour;
}

// Colour in the order of the tasks that found the touches, and sort by that.
static void colour_all(pliant_impulses *impulses, const pliant_touches *touches)
{
    uint64_t *used = impulses->used;
    int32_t *first = impulses->first;
    memset(used, 0, (size_t)touches->participant_count * sizeof *used);
    memset(first, 0, sizeof impulses->first);
    for (int32_t run = 0; run < touches->run_count; run++) {
        const int32_t begin = touches->run[2 * (size_t)run];
        for (int32_t i = begin; i < begin + touches->run[2 * (size_t)run + 1]; i++) {
            const int32_t colour = choose_colour(touches, &touches->touches[i], used);
            impulses->colour[i] = (uint8_t)colour;
            first[colour]++;
        }
    }
    int32_t sum = 0, next[PLIANT_COLOUR_LIMIT];
    for (int32_t c = 0; c <= PLIANT_COLOUR_LIMIT; c++) {
        const int32_t count = first[c];
        first[c] = sum;
        if (c < PLIANT_COLOUR_LIMIT) next[c] = sum;
        sum += count;
    }
    for (int32_t run = 0; run < touches->run_count; run++) {
        const int32_t begin = touches->run[2 * (size_t)run];
        for (int32_t i = begin; i < begin + touches->run[2 * (size_t)run + 1]; i++)
            impulses->sorted[next[impulses->colour[i]]++] = touches->touches[i];
    }
}

// The impulse on a, times the common inverse mass, for a velocity d of a against the other side; 0:
// none is needed.
static int32_t find_impulse(const pliant_touch *touch, const float d[3], float friction,
                            float impulse[3])
{
    const float *n = touch->normal;
    const float speed = n[0] * d[0] + n[1] * d[1] + n[2] * d[2], change = touch->target - speed;
    if (!(change > 0)) return 0;
    for (int c = 0; c < 3; c++) impulse[c] = change * n[c];
    if (friction == 0) return 1;
    const float along[3] = {d[0] - speed * n[0], d[1] - speed * n[1], d[2] - speed * n[2]};
    const float slide = sqrtf(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
    const float brake = slide > friction * change ? friction * change / slide : 1;
    for (int c = 0; c < 3; c++) impulse[c] -= brake * along[c];
    return 1;
}

static void push_pair(const pliant_touch *touch, float *velocity, float friction)
{
    float *v = velocity + 4 * (size_t)touch->a, *u = velocity + 4 * (size_t)touch->b, impulse[3];
    const float d[3] = {v[0] - u[0], v[1] - u[1], v[2] - u[2]}, inverse = v[3] + u[3];
    if (inverse == 0 || !find_impulse(touch, d, friction, impulse)) return;
    for (int c = 0; c < 3; c++) {
        v[c] += v[3] / inverse * impulse[c];
        u[c] -= u[3] / inverse * impulse[c];
    }
}

// A place between corners moves by their weights, and what acts there acts on them by these.
static void push_cell(const pliant_touch *touch, const pliant_touched_cell *cell, float *velocity,
                      float friction)
{
    float *v = velocity + 4 * (size_t)touch->a, impulse[3];
    float d[3] = {v[0], v[1], v[2]}, inverse = v[3];
    for (int k = 0; k < 8; k++) {
        const float *u = velocity + 4 * (size_t)cell->corners[k], weight = cell->weights[k];
        for (int c = 0; c < 3; c++) d[c] -= weight * u[c];
        inverse += weight * weight * u[3];
    }
    if (inverse == 0 || !find_impulse(touch, d, friction, impulse)) return;
    for (int c = 0; c < 3; c++) v[c] += v[3] / inverse * impulse[c];
    for (int k = 0; k < 8; k++) {
        float *u = velocity + 4 * (size_t)cell->corners[k];
        const float part = cell->weights[k] * u[3] / inverse;
        for (int c = 0; c < 3; c++) u[c] -= part * impulse[c];
    }
}

static void push(const pliant_impulses *impulses, const pliant_touch *touch)
{
    const pliant_touches *touches = impulses->touches;
    if (touch->b >= 0) push_pair(touch, touches->velocity, impulses->friction);
    else push_cell(touch, &touches->cells[touch->a], touches->velocity, impulses->friction);
}

static void push_some(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    const pliant_impulses *impulses = context;
    const int32_t begin = impulses->begin + task * TOUCH_TASK;
    for (int32_t i = begin; i < impulses->end && i < begin + TOUCH_TASK; i++)
        push(impulses, &impulses->sorted[i]);
}

void pliant_impulses_apply(pliant_impulses *impulses, pliant_team *team, pliant_touches *touches,
                           float friction)
{
    if (touches->touch_count == 0) return;
    impulses->touches = touches;
    impulses->friction = friction;
    colour_all(impulses, touches);
    for (int pass = 0; pass < PASS_COUNT; pass++)
        for (int32_t colour = 0; colour < PLIANT_COLOUR_LIMIT; colour++) {
            impulses->begin = impulses->first[colour];
            impulses->end = impulses->first[colour + 1];
            const int32_t count = impulses->end - impulses->begin;
            if (colour < LAST_COLOUR) {
                pliant_team_run(team, (count + TOUCH_TASK - 1) / TOUCH_TASK, push_some, impulses);
                continue;
            }
            for (int32_t i = impulses->begin; i < impulses->end; i++)
                push(impulses, &impulses->sorted[i]);
        }
}
