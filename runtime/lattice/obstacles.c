// obstacles.c: all obstacles of a world, and which of them is near which chunk of its bodies.
#include "lattice/obstacles.h"

#include <math.h>
#include <string.h>

// What is inside an obstacle comes out at so many cells a second, and by so much of a cell a step
// at least, so that rounding does not stay.
#define EXPEL_SPEED 10.0f
#define EXPEL_LEAST 0.01f

// Where two obstacles hold off one particle each undoes a part of what the other did.
#define SWEEP_COUNT 3

void pliant_obstacles_lay_out(pliant_obstacles *obstacles, pliant_arena *arena, int32_t capacity,
                              int32_t chunk_capacity)
{
    obstacles->capacity = capacity;
    obstacles->chunk_capacity = chunk_capacity;
    obstacles->words = (capacity + 63) / 64;
    PLIANT_TAKE(arena, obstacles->solids, capacity);
    PLIANT_TAKE(arena, obstacles->present, capacity);
    PLIANT_TAKE(arena, obstacles->near, (size_t)chunk_capacity * (size_t)obstacles->words);
    PLIANT_TAKE(arena, obstacles->contacts, chunk_capacity);
}

void pliant_obstacles_set(pliant_obstacles *obstacles, int32_t index, const pliant_solid *solid)
{
    obstacles->solids[index] = *solid;
    obstacles->present_count = 0;
    for (int32_t i = 0; i < obstacles->capacity; i++)
        if (obstacles->solids[i].kind != PLIANT_OBSTACLE_NONE)
            obstacles->present[obstacles->present_count++] = i;
}

// Impulses among bodies may have made some particle faster than was measured.
static float fastest(const pliant_body *body, const pliant_chunk *chunk)
{
    float most = 0;
    for (int32_t p = chunk->begin; p < chunk->end; p++) {
        const float *v = body->v + body->lattice->slot[p];
        const float square = v[0] * v[0] + v[PLIANT_LANES] * v[PLIANT_LANES] +
                             v[2 * PLIANT_LANES] * v[2 * PLIANT_LANES];
        most = square > most ? square : most;
    }
    return sqrtf(most);
}

// Returns how many are near.
static int32_t find_near(const pliant_obstacles *obstacles, const pliant_chunk *chunk,
                         const pliant_body *body, uint64_t *near)
{
    float middle[3], square = 0;
    for (int c = 0; c < 3; c++) {
        middle[c] = 0.5f * (chunk->low[c] + chunk->high[c]);
        const float half = 0.5f * (chunk->high[c] - chunk->low[c]);
        square += half * half;
    }
    const float motion = obstacles->dt * fastest(body, chunk);
    int32_t count = 0;
    memset(near, 0, (size_t)obstacles->words * sizeof *near);
    for (int32_t i = 0; i < obstacles->present_count; i++) {
        const pliant_solid *solid = &obstacles->solids[obstacles->present[i]];
        if (!pliant_solid_is_near(solid, middle, sqrtf(square), motion)) continue;
        near[i / 64] |= (uint64_t)1 << i % 64;
        count++;
    }
    return count;
}

static void hold_off_chunk(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    const pliant_obstacles *obstacles = context;
    const pliant_crowd *crowd = obstacles->crowd;
    const pliant_chunk *chunk = &crowd->chunks[task];
    const pliant_member *m = &crowd->members[chunk->member];
    uint64_t *near = obstacles->near + (size_t)task * (size_t)obstacles->words;
    obstacles->contacts[task] = 0;
    const int32_t near_count = find_near(obstacles, chunk, m->body, near);
    if (near_count == 0) return;
    const int32_t *held_by = crowd->held_by + m->first;
    int32_t contacts = 0;
    for (int32_t p = chunk->begin; p < chunk->end; p++) {
        if (held_by[p] >= 0) continue;
        const int32_t slot = m->body->lattice->slot[p];
        const pliant_vec3 x = pliant_body_get(m->body->x, slot);
        pliant_vec3 v = pliant_body_get(m->body->v, slot);
        int32_t held = 0;
        for (int sweep = 0; sweep < SWEEP_COUNT; sweep++) {
            held = 0;
            for (int32_t word = 0; word < obstacles->words; word++)
                for (uint64_t bits = near[word]; bits; bits &= bits - 1) {
                    const int32_t i = 64 * word + __builtin_ctzll(bits);
                    held += pliant_solid_hold_off(&obstacles->solids[obstacles->present[i]], &x.x,
                                                  obstacles->dt, obstacles->bounce, &v.x);
                }
            contacts += sweep == 0 ? held : 0;
            if (held < 2 && sweep == 0) break;
            if (held == 0) break;
        }
        pliant_body_set(m->body->v, slot, v);
    }
    obstacles->contacts[task] = contacts;
}

int32_t pliant_obstacles_hold_off(pliant_obstacles *obstacles, pliant_team *team,
                                  const pliant_crowd *crowd, float dt, float bounce)
{
    obstacles->crowd = crowd;
    obstacles->dt = dt;
    obstacles->bounce = bounce;
    if (obstacles->present_count == 0) return 0;
    for (int32_t i = 0; i < obstacles->present_count; i++)
        pliant_solid_begin(&obstacles->solids[obstacles->present[i]], dt);
    pliant_team_run(team, crowd->chunk_count, hold_off_chunk, obstacles);
    int32_t contacts = 0;
    for (int32_t i = 0; i < crowd->chunk_count; i++) contacts += obstacles->contacts[i];
    return contacts;
}

static void expel_chunk(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    const pliant_obstacles *obstacles = context;
    const pliant_crowd *crowd = obstacles->crowd;
    const pliant_chunk *chunk = &crowd->chunks[task];
    const pliant_member *m = &crowd->members[chunk->member];
    const uint64_t *near = obstacles->near + (size_t)task * (size_t)obstacles->words;
    const float most =
        m->body->lattice->cell_size * fmaxf(EXPEL_SPEED * obstacles->dt, EXPEL_LEAST);
    for (int32_t word = 0; word < obstacles->words; word++)
        for (uint64_t bits = near[word]; bits; bits &= bits - 1) {
            const int32_t i = 64 * word + __builtin_ctzll(bits);
            const pliant_solid *solid = &obstacles->solids[obstacles->present[i]];
            for (int32_t p = chunk->begin; p < chunk->end; p++) {
                if (crowd->held_by[m->first + p] >= 0) continue;
                const int32_t slot = m->body->lattice->slot[p];
                pliant_vec3 x = pliant_body_get(m->body->x, slot);
                if (pliant_solid_expel(solid, most, &x.x)) pliant_body_set(m->body->x, slot, x);
            }
        }
}

void pliant_obstacles_expel(pliant_obstacles *obstacles, pliant_team *team)
{
    if (obstacles->present_count == 0) return;
    pliant_team_run(team, obstacles->crowd->chunk_count, expel_chunk, obstacles);
    for (int32_t i = 0; i < obstacles->present_count; i++)
        pliant_solid_end(&obstacles->solids[obstacles->present[i]]);
}
