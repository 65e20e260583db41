// crowd.h: the bodies of a world, with their particles numbered through.
//
// Particle p of a member has the number member.first + p in the crowd. Numbers move up when a
// member is removed. Per-particle work is cut into chunks of one member's particles each.
#pragma once

#include "lattice/body.h"

#define PLIANT_CHUNK 256  // particles; a small body is one task, a large one some hundred

typedef struct pliant_member {
    pliant_body *body;  // borrowed
    int32_t first, particle_count;
    int32_t outer_first, outer_count;  // of outer[]
    int32_t cell_first, cell_count;    // of corners[]
    float radius;                      // of its particles as balls: half a cell, m
    float low[3], high[3];             // box of its particles, as last measured
} pliant_member;

typedef struct pliant_chunk {
    int32_t member, begin, end;  // particles of the member
    // As last measured: boxes of the positions and of the velocities, fastest speed.
    float low[3], high[3], slowest[3], fastest[3], speed;
} pliant_chunk;

typedef struct pliant_crowd {
    int32_t member_capacity, particle_capacity, chunk_capacity;
    int32_t member_count, particle_count, chunk_count, outer_count, cell_count;
    pliant_member *members;
    pliant_chunk *chunks;
    int32_t *owner;    // shape [particle_count]: member
    int32_t *outer;    // particles (of their member) that are not inside it
    int32_t *corners;  // shape [cell][8]: particles (of their member), x first; no more cells than
                       // particles
    float *depth;      // shape [particle_capacity]: see rest_depth.h
    int32_t *held_by;  // shape [particle_count]: its number in the holds' list, or -1
} pliant_crowd;

// Twice, as arena.h says: to measure and to carve.
void pliant_crowd_lay_out(pliant_crowd *crowd, pliant_arena *arena, int32_t member_capacity,
                          int32_t particle_capacity);
// PLIANT_ERR_CAPACITY: no room; PLIANT_ERR_ARGUMENT: it is there.
PLIANT_UNUSED_RESULT pliant_status pliant_crowd_add(pliant_crowd *crowd, pliant_body *body,
                                                    pliant_error *err);
void pliant_crowd_remove(pliant_crowd *crowd, int32_t member);
int32_t pliant_crowd_find(const pliant_crowd *crowd, const pliant_body *body);  // member, or -1

// Measure chunks and members.
void pliant_crowd_measure(pliant_crowd *crowd, pliant_team *team);

static inline int32_t pliant_crowd_slot(const pliant_crowd *crowd, int32_t particle)
{
    const pliant_member *m = &crowd->members[crowd->owner[particle]];
    return m->body->lattice->slot[particle - m->first];
}

// 1/kg; 0 for what is held.
static inline float pliant_crowd_inverse_mass(const pliant_crowd *crowd, int32_t particle)
{
    if (crowd->held_by[particle] >= 0) return 0;
    const pliant_member *m = &crowd->members[crowd->owner[particle]];
    const int32_t slot = m->body->lattice->slot[particle - m->first];
    return m->body->lattice
        ->lane_inverse[slot / (3 * PLIANT_LANES) * PLIANT_LANES + slot % (3 * PLIANT_LANES)];
}
