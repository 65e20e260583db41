// touches.h: where bodies touch each other or themselves, or are about to.
//
// Participants are particles that take part in touches; their velocities are gathered here, changed
// by pliant_impulses_apply, and put back. A touch is between participant a and either participant b
// or a place in a cell of another body, whose eight corners share it. Its normal points from there
// to a. To keep them apart, a must not approach by more than the gap that is left allows:
//
//     n . (v_a - v_b) >= target
//
// with target = -gap / h while there is one. Where they overlap it is positive, a bounded speed at
// which they part.
#pragma once

#include "lattice/crowd.h"
#include "lattice/hash.h"
#include "lattice/overlaps.h"

#include <stdatomic.h>

#define PLIANT_NO_CELL INT32_MAX

typedef struct pliant_touch {
    float normal[3], target;  // -, m/s
    int32_t a, b;             // participants; b < 0: a place in a cell, the one of participant a
} pliant_touch;

// A place in a cell: who shares in it, by how much; the sum is 1.
typedef struct pliant_touched_cell {
    int32_t corners[8];  // participants
    float weights[8];
} pliant_touched_cell;

typedef struct pliant_touch_counts {
    int32_t bodies, self, surfaces;
} pliant_touch_counts;

typedef struct pliant_touches {
    pliant_hash hash;
    pliant_overlaps overlaps;
    int32_t touch_capacity, participant_capacity;
    int32_t touch_count, participant_count;
    int32_t hashed_count;   // of the participants: those that look for others; then cells' corners
    int32_t *picked;        // shape [particle_capacity]: crowd numbers of what was hashed
    int32_t *picked_count;  // shape [outer chunks]
    int32_t *particle;      // shape [participant_capacity]: crowd number
    int32_t *rest;  // shape [particle_capacity][4]: of what is hashed: place in its lattice, member
    float *velocity;          // shape [participant_capacity][4]: v, m/s, and inverse mass, 1/kg
    int32_t *participant_of;  // shape [particle_capacity]: of crowd numbers, or -1
    atomic_int *chosen;  // shape [participant_capacity]: cell of the crowd that a participant is
                         // inside of, or PLIANT_NO_CELL
    pliant_touched_cell *cells;  // shape [participant_capacity]
    pliant_touch *touches;
    // Of each task's touches, which lie together: from, count.
    int32_t *run;  // shape [tasks][2]
    int32_t run_count, run_capacity;
    atomic_int used;     // of touches, by the tasks at work
    atomic_int is_full;  // 1: there was no room
    pliant_touch_counts counts;
    float narrowing;
    // Of the search under way.
    const pliant_crowd *crowd;
    int32_t collision;
    float dt, size;  // s, m
} pliant_touches;

// Twice, as arena.h says: to measure and to carve.
void pliant_touches_lay_out(pliant_touches *touches, pliant_arena *arena, int32_t member_capacity,
                            int32_t particle_capacity);
// Find what touches in a step of `dt`. The crowd is measured. Never fails: where there are more
// than there is room for, balls are taken smaller until there is (`narrowing`).
void pliant_touches_find(pliant_touches *touches, pliant_team *team, const pliant_crowd *crowd,
                         int32_t collision, float dt);
// Put the participants' velocities back into their bodies.
void pliant_touches_put_back(pliant_touches *touches, pliant_team *team);
