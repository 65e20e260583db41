// holds.h: rigid frames that particles are bound to: hands and bones.
//
// A bound particle keeps its place in the frame. In a step it gets the velocity that takes it to
// where the frame will have it, as something that nothing can push (inverse mass 0), and is put
// there exactly when the step has moved it.
#pragma once

#include "lattice/crowd.h"
#include "lattice/pose.h"

typedef struct pliant_hold {
    int32_t is_present, particle_count;
    pliant_pose pose, target;  // now, and at the end of the next step
} pliant_hold;

typedef struct pliant_held {
    int32_t particle, hold;  // of the crowd
    float offset[3];         // in the frame, m
} pliant_held;

typedef struct pliant_holds {
    int32_t hold_capacity, held_capacity, held_count;
    pliant_hold *holds;
    pliant_held *held;  // in no order; crowd.held_by tells where a particle's is
} pliant_holds;

// Twice, as arena.h says: to measure and to carve.
void pliant_holds_lay_out(pliant_holds *holds, pliant_arena *arena, int32_t hold_capacity,
                          int32_t held_capacity);

void pliant_holds_set(pliant_holds *holds, pliant_crowd *crowd, int32_t hold,
                      const pliant_pose *pose);
void pliant_holds_let(pliant_holds *holds, pliant_crowd *crowd, int32_t hold);
// Bind a particle of the crowd where it is, taking it over from whoever has it. There is room.
void pliant_holds_bind(pliant_holds *holds, pliant_crowd *crowd, int32_t hold, int32_t particle);
// Let all particles of a member go, and count those after it down: it is about to be removed.
void pliant_holds_forget(pliant_holds *holds, pliant_crowd *crowd, int32_t member);

// The velocities that take what is held to its target in `dt`.
void pliant_holds_aim(pliant_holds *holds, const pliant_crowd *crowd, float dt);
// What is held is there.
void pliant_holds_arrive(pliant_holds *holds, const pliant_crowd *crowd);
