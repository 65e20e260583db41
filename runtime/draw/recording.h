// recording.h: the states of a body at chosen steps of a contact script.
#pragma once

#include "picture.h"
#include "pliant/pliant.h"

typedef struct pliant_recording {
    int32_t count, vertex_count;
    struct pliant_recorded_state {
        int64_t step;               // 0: at rest
        pliant_vec3 *displacement;  // shape [vertex_count]; owned
        // Nodes not in their reference condition, and where patches, tools and proxies act; shape
        // [mark_count]; owned.
        pliant_mark *marks;
        int32_t mark_count;
    } * states;  // shape [count]; owned
} pliant_recording;

// Play a script ("-": standard input) with the surface reconstructed up to `level`, and keep the
// states after the steps asked for: ascending numbers, 0 for the rest, PLIANT_RECORDING_END last.
// The script's expectations are not looked at. Refuses a step that the script does not reach.
PLIANT_UNUSED_RESULT pliant_status pliant_recording_create(const pliant_model *model, int32_t level,
                                                           const char *script_path,
                                                           const int64_t *steps, int32_t count,
                                                           pliant_recording **recording,
                                                           pliant_error *err);
void pliant_recording_destroy(pliant_recording *recording);  // NULL is fine
