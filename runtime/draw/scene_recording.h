// scene_recording.h: the states of a scene at chosen steps of a contact script.
#pragma once

#include "pliant/pliant.h"

typedef struct pliant_scene_recording {
    int32_t count, instance_count;
    int32_t vertex_count;  // of all instances
    struct pliant_scene_state {
        int64_t step;                         // 0: where the script has placed things
        pliant_vec3 *displacement, *normals;  // shape [vertex_count]; owned
        pliant_obstacle *obstacles;           // shape [obstacle_count]; owned
        int32_t obstacle_count;
    } * states;  // shape [count]; owned
} pliant_scene_recording;

// Play a script ("-": standard input) on the model's lattice and keep the states after the steps
// asked for: ascending numbers, 0 for the start, PLIANT_RECORDING_END last. The script's
// expectations are not looked at. Refuses a step that the script does not reach.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_recording_create(
    const pliant_model *model, const char *script_path, const int64_t *steps, int32_t count,
    pliant_scene_recording **recording, pliant_error *err);
void pliant_scene_recording_destroy(pliant_scene_recording *recording);  // NULL is fine
