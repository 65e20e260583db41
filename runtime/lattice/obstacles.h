// obstacles.h: all obstacles of a world, and which of them is near which chunk of its bodies.
#pragma once

#include "lattice/crowd.h"
#include "lattice/solid.h"

typedef struct pliant_obstacles {
    int32_t capacity, chunk_capacity;
    pliant_solid *solids;
    int32_t *present;  // shape [present_count]: those that there are
    int32_t present_count;
    uint64_t *near;  // shape [chunk][words]: bit i: present[i] may be touched in this step
    int32_t words;
    int32_t *contacts;  // shape [chunk]: pairs of a particle and an obstacle that holds it off
    // Of the step under way.
    const pliant_crowd *crowd;
    float dt, bounce;
} pliant_obstacles;

// Twice, as arena.h says: to measure and to carve.
void pliant_obstacles_lay_out(pliant_obstacles *obstacles, pliant_arena *arena, int32_t capacity,
                              int32_t chunk_capacity);
void pliant_obstacles_set(pliant_obstacles *obstacles, int32_t index, const pliant_solid *solid);

// Where they go in a step of `dt`, and the velocities of what would enter them. The crowd is
// measured. Impacts faster than `bounce` m/s rebound. Returns the number of contacts.
int32_t pliant_obstacles_hold_off(pliant_obstacles *obstacles, pliant_team *team,
                                  const pliant_crowd *crowd, float dt, float bounce);
// After the motion: out of them with what is inside, at a bounded speed, and they have arrived.
void pliant_obstacles_expel(pliant_obstacles *obstacles, pliant_team *team);
