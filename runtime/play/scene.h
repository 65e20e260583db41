// scene.h: executes the statements of a script that are about lattices, on a world of instances.
//
// The instances and the world are made when the first statement needs them (a grab, impulse, bone
// or step); what was stated before (obstacles, gravity, damping) is then given to them. After that
// only statements allocate, steps do not. Refusals have no effect; `reason` says why, not where in
// the script.
#pragma once

#include "actors.h"
#include "instances.h"
#include "phases.h"

typedef struct pliant_scene pliant_scene;

// The model is borrowed until destroy; the world has `thread_count` threads, 1 or more.
// PLIANT_ERR_MISSING: the model has no lattice.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_create(const pliant_model *model,
                                                       int32_t thread_count, pliant_scene **scene,
                                                       pliant_error *err);
void pliant_scene_destroy(pliant_scene *scene);  // NULL is fine

// Execute instances, damping, rigid-damping, strain-limit, grab, let, impulse, an obstacle,
// collide, bone, bind, turn, move, drop, gravity or release all.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_execute(pliant_scene *scene,
                                                        const pliant_statement *statement,
                                                        pliant_error *reason);
// The vertex of the surfaces (see pliant_scene_displacements) that a probe's words mean.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_find_vertex(const pliant_scene *scene,
                                                            const pliant_statement *statement,
                                                            int32_t *vertex, pliant_error *reason);
// Make the instances and the world if that has not been done.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_prepare(pliant_scene *scene, pliant_error *reason);

typedef struct pliant_scene_step_report {
    int64_t phase_ns[PLIANT_PHASE_LIMIT];  // PLIANT_SCENE_PHASE_...
    int32_t held_count;                    // particles in grabs and bones
    // What obstacles, grabs and bones did to the momentum of all instances, per dt, N:
    // the change that gravity does not explain.
    pliant_vec3 force;
} pliant_scene_step_report;

// Advance by dt seconds, with surfaces. Allocates nothing once prepared.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_step(pliant_scene *scene, double dt,
                                                     pliant_scene_step_report *report,
                                                     pliant_error *reason);

// The instances, to read; borrowed until destroy.
pliant_instances *pliant_scene_instances(const pliant_scene *scene);
// Obstacles as they are now: the first `capacity` to obstacles[capacity]; returns how many there
// are. `obstacles` may be NULL when capacity is 0.
int32_t pliant_scene_obstacles(const pliant_scene *scene, pliant_obstacle *obstacles,
                               int32_t capacity);
