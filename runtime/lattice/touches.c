// touches.c: where bodies touch each other or themselves, or are about to.
//
// Only particles that are not inside their body take part, and of different bodies those alone that
// are near another's box. Found pairs are put where there is room at that moment, but told of task
// by task, so that what is made of them does not depend on the team.
#include "lattice/touches.h"

#include "lattice/dents.h"

#include <math.h>
#include <string.h>

#define TOUCH_TASK       64    // hashed points of a task
#define TOUCH_TASK_ROOM  1024  // touches of a task: 16 a point, a dense packing has 6
#define TOUCHES_PER_BALL 4     // room for so many touches per particle of the world
#define NARROW_LIMIT     12    // attempts at smaller balls
#define NARROW_FACTOR    0.7f

// Beyond touching, in ball diameters: what is seen at all of things that approach slowly, and at
// most. Faster ones than the latter a step may pass a ball, but hardly a body of several. Half as
// much was tried: a quarter less time in a heap, but fast bodies entered each other and were parted
// again, which gave eight in a box 4% of energy (test_world).
#define MARGIN_LEAST 0.1f
#define MARGIN_MOST  1.0f

// How near to touching after the step counts, in ball diameters.
#define TOUCH_SLACK 0.02f
// Overlap parts by this share of it a step, and by at most so many ball diameters a second: what
// this adds of energy stays small whatever the overlap.
#define PART_SHARE 0.1f
#define PART_SPEED 10.0f

// Particles of one body closer than this at rest do not touch, in cells, squared.
#define SELF_NEAREST 4

static int32_t task_count_of(int32_t count, int32_t size)
{
    return (count + size - 1) / size;
}

void pliant_touches_lay_out(pliant_touches *touches, pliant_arena *arena, int32_t member_capacity,
                            int32_t particle_capacity)
{
    touches->participant_capacity = particle_capacity;
    touches->touch_capacity = particle_capacity < INT32_MAX / TOUCHES_PER_BALL - TOUCH_TASK_ROOM
                                  ? TOUCHES_PER_BALL * particle_capacity + TOUCH_TASK_ROOM
                                  : INT32_MAX;
    touches->run_capacity = task_count_of(particle_capacity, TOUCH_TASK) + 1;
    pliant_hash_lay_out(&touches->hash, arena, particle_capacity);
    pliant_overlaps_lay_out(&touches->overlaps, arena, member_capacity);
    PLIANT_TAKE(arena, touches->picked, particle_capacity);
    PLIANT_TAKE(arena, touches->picked_count,
                particle_capacity / PLIANT_CHUNK + (size_t)member_capacity + 1);
    PLIANT_TAKE(arena, touches->particle, touches->participant_capacity);
    PLIANT_TAKE(arena, touches->rest, 4 * (size_t)particle_capacity);
    PLIANT_TAKE(arena, touches->velocity, 4 * (size_t)touches->participant_capacity);
    PLIANT_TAKE(arena, touches->participant_of, particle_capacity);
    PLIANT_TAKE(arena, touches->chosen, touches->participant_capacity);
    PLIANT_TAKE(arena, touches->cells, touches->participant_capacity);
    PLIANT_TAKE(arena, touches->touches, touches->touch_capacity);
    PLIANT_TAKE(arena, touches->run, 2 * (size_t)touches->run_capacity);
}

// ---- Who takes part ----

static void pick(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_touches *touches = context;
    const pliant_crowd *crowd = touches->crowd;
    const int32_t begin = task * PLIANT_CHUNK;
    const int32_t end =
        crowd->outer_count - begin < PLIANT_CHUNK ? crowd->outer_count : begin + PLIANT_CHUNK;
    int32_t count = 0, member = 0;
    // Outer particles stand by members: find the first one's.
    int32_t most = crowd->member_count;
    while (most - member > 1) {
        const int32_t middle = (member + most) / 2;
        if (crowd->members[middle].outer_first <= begin) member = middle;
        else most = middle;
    }
    const int is_self = (touches->collision & PLIANT_COLLISION_SELF) != 0;
    for (int32_t i = begin; i < end; i++) {
        const pliant_member *m = &crowd->members[member];
        while (i >= m->outer_first + m->outer_count) m = &crowd->members[++member];
        if (!is_self && touches->overlaps.count[member] == 0) continue;
        const int32_t p = crowd->outer[i];
        const pliant_vec3 x = pliant_body_get(m->body->x, m->body->lattice->slot[p]);
        if (is_self ||
            pliant_overlaps_has(&touches->overlaps, crowd, member, &x.x, 0.5f * touches->size))
            touches->picked[begin + count++] = m->first + p;
    }
    touches->picked_count[task] = count;
}

static int32_t pick_all(pliant_touches *touches, pliant_team *team)
{
    const int32_t tasks = task_count_of(touches->crowd->outer_count, PLIANT_CHUNK);
    pliant_team_run(team, tasks, pick, touches);
    int32_t count = 0;
    for (int32_t task = 0; task < tasks; task++) {
        memmove(touches->picked + count, touches->picked + (size_t)task * PLIANT_CHUNK,
                (size_t)touches->picked_count[task] * sizeof *touches->picked);
        count += touches->picked_count[task];
    }
    return count;
}

static void load_points(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_touches *touches = context;
    const pliant_crowd *crowd = touches->crowd;
    const int32_t begin = task * PLIANT_CHUNK, count = touches->hashed_count;
    for (int32_t i = begin; i < count && i < begin + PLIANT_CHUNK; i++) {
        const pliant_member *m = &crowd->members[crowd->owner[touches->picked[i]]];
        const int32_t slot = m->body->lattice->slot[touches->picked[i] - m->first];
        float *point = touches->hash.points + 4 * (size_t)i;
        for (int c = 0; c < 3; c++) point[c] = m->body->x[slot + PLIANT_LANES * c];
        point[3] = m->radius;
    }
}

static void load_velocity(const pliant_crowd *crowd, int32_t particle, float *to)
{
    const float *v =
        crowd->members[crowd->owner[particle]].body->v + pliant_crowd_slot(crowd, particle);
    for (int c = 0; c < 3; c++) to[c] = v[PLIANT_LANES * c];
    to[3] = pliant_crowd_inverse_mass(crowd, particle);
}

static void load_velocities(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_touches *touches = context;
    const pliant_crowd *crowd = touches->crowd;
    const int32_t begin = task * PLIANT_CHUNK, count = touches->hashed_count;
    for (int32_t k = begin; k < count && k < begin + PLIANT_CHUNK; k++) {
        const int32_t particle = touches->picked[touches->hash.number[k]];
        load_velocity(crowd, particle, touches->velocity + 4 * (size_t)k);
        touches->particle[k] = particle;
        touches->participant_of[particle] = k;
        const int32_t member = crowd->owner[particle];
        const pliant_member *m = &crowd->members[member];
        int32_t *rest = touches->rest + 4 * (size_t)k;
        memcpy(rest, m->body->lattice->places + 3 * (size_t)(particle - m->first),
               3 * sizeof *rest);
        rest[3] = member;
        atomic_store_explicit(&touches->chosen[k], PLIANT_NO_CELL, memory_order_relaxed);
    }
}

// The corners of touched cells take part as well; until now they are named by the crowd's numbers.
static void add_corners(pliant_touches *touches)
{
    for (int32_t run = 0; run < touches->run_count; run++) {
        const int32_t begin = touches->run[2 * (size_t)run];
        for (int32_t i = begin; i < begin + touches->run[2 * (size_t)run + 1]; i++) {
            if (touches->touches[i].b >= 0) continue;
            int32_t *corners = touches->cells[touches->touches[i].a].corners;
            for (int k = 0; k < 8; k++) {
                int32_t *participant = &touches->participant_of[corners[k]];
                if (*participant < 0) {
                    *participant = touches->participant_count++;
                    touches->particle[*participant] = corners[k];
                    load_velocity(touches->crowd, corners[k],
                                  touches->velocity + 4 * (size_t)*participant);
                }
                corners[k] = *participant;
            }
        }
    }
}

// ---- Pairs ----

// fminf's care for NaN makes it a call.
static float least(float a, float b)
{
    return a < b ? a : b;
}

typedef struct finder {
    pliant_touches *touches;
    pliant_touch *found;  // shape [TOUCH_TASK_ROOM]
    int32_t count;
    int32_t is_full;
} finder;

// 1: it is inside another body, whose way out is all that counts.
static int is_inside(const pliant_touches *touches, int32_t k)
{
    return atomic_load_explicit(&touches->chosen[k], memory_order_relaxed) != PLIANT_NO_CELL;
}

// Whether two particles may touch at all, as they are at rest.
static int may_touch(const pliant_touches *touches, int32_t k, int32_t other)
{
    const int32_t *p = touches->rest + 4 * (size_t)k, *q = touches->rest + 4 * (size_t)other;
    if (p[3] != q[3])
        return (touches->collision & PLIANT_COLLISION_BODIES) && !is_inside(touches, k) &&
               !is_inside(touches, other);
    if (!(touches->collision & PLIANT_COLLISION_SELF)) return 0;
    int32_t square = 0;
    for (int c = 0; c < 3; c++) square += (p[c] - q[c]) * (p[c] - q[c]);
    return square > SELF_NEAREST;
}

static void look_at_pair(finder *f, int32_t k, int32_t other)
{
    const pliant_touches *touches = f->touches;
    const float *x = touches->hash.sorted + 4 * (size_t)k;
    const float *y = touches->hash.sorted + 4 * (size_t)other;
    const float d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
    const float square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (!(square <= touches->size * touches->size) || !may_touch(touches, k, other)) return;
    const float *v = touches->velocity + 4 * (size_t)k;
    const float *u = touches->velocity + 4 * (size_t)other;
    const float reach = touches->narrowing * (x[3] + y[3]), distance = sqrtf(square);
    // Two at one place part along z, whoever they are.
    const float scale = distance > 0 ? 1 / distance : 0;
    const float n[3] = {scale * d[0], scale * d[1], distance > 0 ? scale * d[2] : 1};
    const float gap = distance - reach;
    const float speed = n[0] * (v[0] - u[0]) + n[1] * (v[1] - u[1]) + n[2] * (v[2] - u[2]);
    if (!(gap + touches->dt * speed < TOUCH_SLACK * reach)) return;
    if (f->count == TOUCH_TASK_ROOM) {
        f->is_full = 1;
        return;
    }
    const float part = least(PART_SHARE * -gap / touches->dt, PART_SPEED * reach);
    f->found[f->count++] = (pliant_touch){.normal = {n[0], n[1], n[2]},
                                          .target = gap >= 0 ? -gap / touches->dt : part,
                                          .a = k,
                                          .b = other};
}

// The points of a row's cells that come after cell (x, y, z)'s own, so that each pair is seen once.
static void look_at_row(finder *f, int32_t k, int32_t dy, int32_t dz)
{
    const pliant_hash *hash = &f->touches->hash;
    const int32_t *cell = hash->cell + 3 * (size_t)k;
    const int is_own = dy == 0 && dz == 0;
    // Without self-collision most of what is near is the body's own.
    const int32_t *rest = f->touches->rest;
    const int32_t skipped =
        f->touches->collision & PLIANT_COLLISION_SELF ? -1 : rest[4 * (size_t)k + 3];
    const pliant_hash_range range =
        pliant_hash_find(hash, cell[0], cell[1] + dy, cell[2] + dz, is_own ? 0 : 1, 1);
    for (int r = 0; r < 2; r++)
        for (int32_t other = range.from[r]; other < range.to[r]; other++) {
            if (rest[4 * (size_t)other + 3] == skipped) continue;
            const int32_t *its = hash->cell + 3 * (size_t)other;
            const int32_t dx = its[0] - cell[0];
            if (dx > 1 || dx < (is_own ? 0 : -1) || its[1] != cell[1] + dy ||
                its[2] != cell[2] + dz || (is_own && dx == 0 && other <= k))
                continue;
            look_at_pair(f, k, other);
        }
}

static void find_pairs(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_touches *touches = context;
    pliant_touch found[TOUCH_TASK_ROOM];
    finder f = {.touches = touches, .found = found};
    const int32_t begin = task * TOUCH_TASK, count = touches->hashed_count;
    const int is_looking_for_balls =
        (touches->collision & (PLIANT_COLLISION_BODIES | PLIANT_COLLISION_SELF)) != 0;
    for (int32_t k = begin; k < count && k < begin + TOUCH_TASK; k++) {
        if (is_inside(touches, k) && f.count < TOUCH_TASK_ROOM &&
            pliant_dents_find(touches, k, &found[f.count]))
            f.count++;
        if (!is_looking_for_balls) continue;
        look_at_row(&f, k, 0, 0);
        look_at_row(&f, k, 1, 0);
        for (int32_t dy = -1; dy <= 1; dy++) look_at_row(&f, k, dy, 1);
    }
    const int32_t from = atomic_fetch_add_explicit(&touches->used, f.count, memory_order_relaxed);
    int32_t *run = touches->run + 2 * (size_t)task;
    run[0] = from;
    run[1] = f.count;
    if (f.is_full || from > touches->touch_capacity - f.count) {
        atomic_store_explicit(&touches->is_full, 1, memory_order_relaxed);
        run[1] = 0;
        return;
    }
    memcpy(touches->touches + from, found, (size_t)f.count * sizeof *found);
}

// How far to look: the largest ball's diameter, and what approaches in a step.
static float choose_size(const pliant_crowd *crowd, float dt)
{
    float low[3], high[3], radius = 0, square = 0;
    for (int c = 0; c < 3; c++) low[c] = INFINITY, high[c] = -INFINITY;
    for (int32_t i = 0; i < crowd->chunk_count; i++) {
        const pliant_chunk *chunk = &crowd->chunks[i];
        radius = fmaxf(radius, crowd->members[chunk->member].radius);
        for (int c = 0; c < 3; c++) {
            low[c] = fminf(low[c], chunk->slowest[c]);
            high[c] = fmaxf(high[c], chunk->fastest[c]);
        }
    }
    for (int c = 0; c < 3; c++) square += (high[c] - low[c]) * (high[c] - low[c]);
    const float motion = dt * sqrtf(square) / (2 * radius);
    return 2 * radius * (1 + fminf(fmaxf(motion, MARGIN_LEAST), MARGIN_MOST));
}

static void count_kinds(pliant_touches *touches)
{
    const int32_t *owner = touches->crowd->owner;
    for (int32_t i = 0; i < touches->touch_count; i++) {
        const pliant_touch *t = &touches->touches[i];
        if (t->b < 0) touches->counts.surfaces++;
        else if (owner[touches->particle[t->a]] == owner[touches->particle[t->b]])
            touches->counts.self++;
        else touches->counts.bodies++;
    }
}

void pliant_touches_find(pliant_touches *touches, pliant_team *team, const pliant_crowd *crowd,
                         int32_t collision, float dt)
{
    touches->crowd = crowd;
    touches->collision = collision;
    touches->dt = dt;
    touches->narrowing = 1;
    touches->touch_count = touches->participant_count = touches->run_count = 0;
    touches->hashed_count = 0;
    touches->counts = (pliant_touch_counts){0};
    if (collision == PLIANT_COLLISION_NONE || crowd->member_count == 0) return;
    touches->size = choose_size(crowd, dt);
    touches->overlaps.any = 0;
    pliant_overlaps_find(&touches->overlaps, crowd, 0.5f * touches->size);
    if (!(collision & PLIANT_COLLISION_SELF) && touches->overlaps.any == 0) return;
    touches->hashed_count = touches->participant_count = pick_all(touches, team);
    const int32_t chunks = task_count_of(touches->hashed_count, PLIANT_CHUNK);
    pliant_team_run(team, chunks, load_points, touches);
    pliant_hash_fill(&touches->hash, team, touches->hashed_count, touches->size);
    memset(touches->participant_of, -1,
           (size_t)crowd->particle_count * sizeof *touches->participant_of);
    pliant_team_run(team, chunks, load_velocities, touches);
    if (collision & PLIANT_COLLISION_SURFACES) pliant_dents_choose(touches, team);
    touches->run_count = task_count_of(touches->hashed_count, TOUCH_TASK);
    for (int attempt = 0; attempt < NARROW_LIMIT; attempt++) {
        atomic_store(&touches->used, 0);
        atomic_store(&touches->is_full, 0);
        pliant_team_run(team, touches->run_count, find_pairs, touches);
        touches->touch_count = atomic_load(&touches->used);
        if (!atomic_load(&touches->is_full)) break;
        touches->narrowing *= NARROW_FACTOR;
        touches->touch_count = touches->run_count = 0;
        if (attempt + 1 < NARROW_LIMIT)
            touches->run_count = task_count_of(touches->hashed_count, TOUCH_TASK);
    }
    add_corners(touches);
    count_kinds(touches);
}

static void put_back(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    const pliant_touches *touches = context;
    const int32_t begin = task * PLIANT_CHUNK, count = touches->participant_count;
    for (int32_t k = begin; k < count && k < begin + PLIANT_CHUNK; k++) {
        const int32_t particle = touches->particle[k];
        const int32_t slot = pliant_crowd_slot(touches->crowd, particle);
        float *v = touches->crowd->members[touches->crowd->owner[particle]].body->v + slot;
        const float *from = touches->velocity + 4 * (size_t)k;
        for (int c = 0; c < 3; c++) v[PLIANT_LANES * c] = from[c];
    }
}

void pliant_touches_put_back(pliant_touches *touches, pliant_team *team)
{
    if (touches->touch_count == 0) return;
    pliant_team_run(team, task_count_of(touches->participant_count, PLIANT_CHUNK), put_back,
                    touches);
}
