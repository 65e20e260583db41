// crowd.c: the bodies of a world, with their particles numbered through.
#include "lattice/crowd.h"

#include "lattice/rest_depth.h"
#include "pliant/error.h"

#include <math.h>
#include <string.h>

void pliant_crowd_lay_out(pliant_crowd *crowd, pliant_arena *arena, int32_t member_capacity,
                          int32_t particle_capacity)
{
    crowd->member_capacity = member_capacity;
    crowd->particle_capacity = particle_capacity;
    // Each member's last chunk may be short.
    crowd->chunk_capacity = particle_capacity / PLIANT_CHUNK + member_capacity;
    PLIANT_TAKE(arena, crowd->members, member_capacity);
    PLIANT_TAKE(arena, crowd->chunks, crowd->chunk_capacity);
    PLIANT_TAKE(arena, crowd->owner, particle_capacity);
    PLIANT_TAKE(arena, crowd->outer, particle_capacity);
    PLIANT_TAKE(arena, crowd->corners, 8 * (size_t)particle_capacity);
    PLIANT_TAKE(arena, crowd->depth, particle_capacity);
    PLIANT_TAKE(arena, crowd->held_by, particle_capacity);
}

int32_t pliant_crowd_find(const pliant_crowd *crowd, const pliant_body *body)
{
    for (int32_t i = 0; i < crowd->member_count; i++)
        if (crowd->members[i].body == body) return i;
    return -1;
}

static void cut_into_chunks(pliant_crowd *crowd)
{
    crowd->chunk_count = 0;
    for (int32_t i = 0; i < crowd->member_count; i++)
        for (int32_t p = 0; p < crowd->members[i].particle_count; p += PLIANT_CHUNK) {
            const int32_t left = crowd->members[i].particle_count - p;
            crowd->chunks[crowd->chunk_count++] = (pliant_chunk){
                .member = i, .begin = p, .end = p + (left < PLIANT_CHUNK ? left : PLIANT_CHUNK)};
        }
}

static void find_corners(pliant_crowd *crowd, pliant_member *member)
{
    const pliant_lattice *lattice = member->body->lattice;
    member->cell_first = crowd->cell_count;
    member->cell_count = lattice->cell_count;
    int32_t *corner = crowd->corners + 8 * (size_t)crowd->cell_count;
    for (int32_t i = 0; i < lattice->cell_count; i++) {
        const int32_t *cell = lattice->cells + 3 * (size_t)i;
        for (int k = 0; k < 8; k++)
            *corner++ = pliant_links_particle(lattice->links, cell[0] + (k & 1),
                                              cell[1] + (k >> 1 & 1), cell[2] + (k >> 2));
    }
    crowd->cell_count += lattice->cell_count;
}

// A particle that eight cells share is inside. What may break shows its inside.
static void find_outer(pliant_crowd *crowd, pliant_member *member)
{
    const int is_breakable = member->body->strain_limit > 0;
    int32_t *shared = crowd->held_by + member->first;  // not in use yet
    memset(shared, 0, (size_t)member->particle_count * sizeof *shared);
    const int32_t *corner = crowd->corners + 8 * (size_t)member->cell_first;
    for (int32_t i = 0; i < 8 * member->cell_count; i++) shared[corner[i]]++;
    member->outer_first = crowd->outer_count;
    for (int32_t p = 0; p < member->particle_count; p++)
        if (is_breakable || shared[p] < 8) crowd->outer[crowd->outer_count++] = p;
    member->outer_count = crowd->outer_count - member->outer_first;
}

// Instances of one lattice have the same depths.
static void find_depths(pliant_crowd *crowd, const pliant_member *member)
{
    const pliant_lattice *lattice = member->body->lattice;
    float *depth = crowd->depth + member->first;
    for (const pliant_member *m = crowd->members; m < member; m++)
        if (m->body->lattice == lattice) {
            memcpy(depth, crowd->depth + m->first, (size_t)m->particle_count * sizeof *depth);
            return;
        }
    pliant_rest_depth_find(lattice, crowd->corners + 8 * (size_t)member->cell_first, depth);
}

pliant_status pliant_crowd_add(pliant_crowd *crowd, pliant_body *body, pliant_error *err)
{
    if (pliant_crowd_find(crowd, body) >= 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "world: the body is in it already");
    if (crowd->member_count == crowd->member_capacity)
        return pliant_error_set(err, PLIANT_ERR_CAPACITY,
                                "world: expected at most %d bodies, found one more",
                                (int)crowd->member_capacity);
    const int32_t count = body->lattice->particle_count;
    if (count > crowd->particle_capacity - crowd->particle_count)
        return pliant_error_set(
            err, PLIANT_ERR_CAPACITY, "world: expected at most %d particles, found %lld",
            (int)crowd->particle_capacity, (long long)crowd->particle_count + count);
    const int32_t index = crowd->member_count++;
    pliant_member *member = &crowd->members[index];
    *member = (pliant_member){.body = body,
                              .first = crowd->particle_count,
                              .particle_count = count,
                              .radius = 0.5f * body->lattice->cell_size};
    crowd->particle_count += count;
    find_corners(crowd, member);
    find_outer(crowd, member);
    find_depths(crowd, member);
    for (int32_t p = 0; p < count; p++) {
        crowd->owner[member->first + p] = index;
        crowd->held_by[member->first + p] = -1;
    }
    cut_into_chunks(crowd);
    return PLIANT_OK;
}

void pliant_crowd_remove(pliant_crowd *crowd, int32_t index)
{
    const pliant_member gone = crowd->members[index];
    const int32_t end = gone.first + gone.particle_count, after = crowd->particle_count - end;
    memmove(crowd->held_by + gone.first, crowd->held_by + end,
            (size_t)after * sizeof *crowd->held_by);
    memmove(crowd->depth + gone.first, crowd->depth + end, (size_t)after * sizeof *crowd->depth);
    const int32_t cell_end = gone.cell_first + gone.cell_count;
    memmove(crowd->corners + 8 * (size_t)gone.cell_first, crowd->corners + 8 * (size_t)cell_end,
            8 * (size_t)(crowd->cell_count - cell_end) * sizeof *crowd->corners);
    const int32_t outer_end = gone.outer_first + gone.outer_count;
    memmove(crowd->outer + gone.outer_first, crowd->outer + outer_end,
            (size_t)(crowd->outer_count - outer_end) * sizeof *crowd->outer);
    for (int32_t i = index; i + 1 < crowd->member_count; i++) {
        crowd->members[i] = crowd->members[i + 1];
        crowd->members[i].first -= gone.particle_count;
        crowd->members[i].outer_first -= gone.outer_count;
        crowd->members[i].cell_first -= gone.cell_count;
        for (int32_t p = 0; p < crowd->members[i].particle_count; p++)
            crowd->owner[crowd->members[i].first + p] = i;
    }
    crowd->member_count--;
    crowd->particle_count -= gone.particle_count;
    crowd->outer_count -= gone.outer_count;
    crowd->cell_count -= gone.cell_count;
    cut_into_chunks(crowd);
}

static void measure_chunk(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    const pliant_crowd *crowd = context;
    pliant_chunk *chunk = &crowd->chunks[task];
    const pliant_body *body = crowd->members[chunk->member].body;
    float low[6], high[6], square = 0;
    for (int c = 0; c < 6; c++) low[c] = INFINITY, high[c] = -INFINITY;
    for (int32_t p = chunk->begin; p < chunk->end; p++) {
        const int32_t slot = body->lattice->slot[p];
        float speed = 0;
        for (int c = 0; c < 3; c++) {
            const float x = body->x[slot + PLIANT_LANES * c], v = body->v[slot + PLIANT_LANES * c];
            low[c] = x < low[c] ? x : low[c];
            high[c] = x > high[c] ? x : high[c];
            low[3 + c] = v < low[3 + c] ? v : low[3 + c];
            high[3 + c] = v > high[3 + c] ? v : high[3 + c];
            speed += v * v;
        }
        square = speed > square ? speed : square;
    }
    memcpy(chunk->low, low, sizeof chunk->low);
    memcpy(chunk->high, high, sizeof chunk->high);
    memcpy(chunk->slowest, low + 3, sizeof chunk->slowest);
    memcpy(chunk->fastest, high + 3, sizeof chunk->fastest);
    chunk->speed = sqrtf(square);
}

void pliant_crowd_measure(pliant_crowd *crowd, pliant_team *team)
{
    pliant_team_run(team, crowd->chunk_count, measure_chunk, crowd);
    for (int32_t i = 0; i < crowd->chunk_count; i++) {
        const pliant_chunk *chunk = &crowd->chunks[i];
        pliant_member *member = &crowd->members[chunk->member];
        for (int c = 0; c < 3; c++) {
            const int is_first = chunk->begin == 0;
            if (is_first || chunk->low[c] < member->low[c]) member->low[c] = chunk->low[c];
            if (is_first || chunk->high[c] > member->high[c]) member->high[c] = chunk->high[c];
        }
    }
}
