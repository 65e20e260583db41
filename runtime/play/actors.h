// actors.h: what acts on the bodies of a scene: obstacles, grabs and bones, and where they go.
//
// Actors that have a name share one space of names; a name is free again when its actor is gone.
// They are stated before there is a world as well: it is told when it comes. Moves and turns may be
// spread over steps; advance does one step's part.
#pragma once

#include "pliant/pliant.h"
#include "pliant/script.h"

#define PLIANT_OBSTACLE_LIMIT 1024  // of one scene, at once
#define PLIANT_HOLD_LIMIT     256   // grabs and bones, at once

typedef enum pliant_actor_kind {
    PLIANT_ACTOR_OBSTACLE,
    PLIANT_ACTOR_GRAB,
    PLIANT_ACTOR_BONE,
} pliant_actor_kind;

typedef struct pliant_actor {
    char name[PLIANT_SCRIPT_NAME_LIMIT];  // "": none
    pliant_actor_kind kind;
    int is_present;            // 0: its place in the list is free
    int32_t index;             // of the world's obstacle or hold
    pliant_obstacle obstacle;  // as it was put; where it has moved to, the world tells
    double position[3];        // reference point, where the next step ends
    double rotation[4];        // x, y, z, w
    // What is left of a move and of a turn.
    double goal[3], axis[3], angle;  // m, unit, rad
    int32_t move_steps, turn_steps;
} pliant_actor;

typedef struct pliant_actors pliant_actors;

PLIANT_UNUSED_RESULT pliant_status pliant_actors_create(pliant_actors **actors, pliant_error *err);
void pliant_actors_destroy(pliant_actors *actors);  // NULL is fine
// Put all obstacles there are into a new world, and all that follow. Borrowed until destroy.
void pliant_actors_enter(pliant_actors *actors, pliant_world *world);

const pliant_actor *pliant_actors_list(const pliant_actors *actors, int32_t *count);
const pliant_actor *pliant_actors_find(const pliant_actors *actors, const char *name);

// Refusals say what was expected and found, not where in the script; they have no effect.

// Name "": without one. A name that is an obstacle's: it is put there.
PLIANT_UNUSED_RESULT pliant_status pliant_actors_put_obstacle(pliant_actors *actors,
                                                              const char *name,
                                                              const pliant_obstacle *obstacle,
                                                              pliant_error *reason);
// A hold that holds nothing yet, or the one of that kind and name that is there. Needs a world.
PLIANT_UNUSED_RESULT pliant_status pliant_actors_put_hold(pliant_actors *actors, const char *name,
                                                          pliant_actor_kind kind,
                                                          const double position[3],
                                                          const pliant_actor **actor,
                                                          pliant_error *reason);
// steps 0: at once, with the next step.
PLIANT_UNUSED_RESULT pliant_status pliant_actors_move(pliant_actors *actors, const char *name,
                                                      const double position[3], int32_t steps,
                                                      pliant_error *reason);
PLIANT_UNUSED_RESULT pliant_status pliant_actors_turn(pliant_actors *actors, const char *name,
                                                      const double axis[3], double degrees,
                                                      int32_t steps, pliant_error *reason);
// Take an actor away; only a grab or bone where `holds_only`.
PLIANT_UNUSED_RESULT pliant_status pliant_actors_drop(pliant_actors *actors, const char *name,
                                                      int holds_only, pliant_error *reason);
void pliant_actors_drop_all(pliant_actors *actors);  // holds, and obstacles that have a name

// One step's part of all moves and turns, told to the world. Allocates nothing.
PLIANT_UNUSED_RESULT pliant_status pliant_actors_advance(pliant_actors *actors);
