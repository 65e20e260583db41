// recording.c: the states of a body at chosen steps of a contact script.
#include "recording.h"

#include "recorder.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

// A contact on a vertex finer than the level drawn has no place in the picture.
static void put_mark(const pliant_recording *recording, struct pliant_recorded_state *state,
                     int32_t vertex, pliant_vec3 v)
{
    if (vertex >= recording->vertex_count) return;
    state->marks[state->mark_count++] =
        (pliant_mark){.vertex = vertex, .direction = {(double)v.x, (double)v.y, (double)v.z}};
}

static pliant_status keep(void *context, pliant_player *player, int64_t step, pliant_error *err)
{
    pliant_recording *recording = context;
    struct pliant_recorded_state *state = &recording->states[recording->count];
    int32_t condition_count = 0;
    const pliant_condition *conditions = pliant_player_conditions(player, &condition_count);
    const pliant_props *props = pliant_player_props(player);
    const int32_t touched_count = pliant_props_marks(props, NULL, 0);
    pliant_prop_mark *touched = malloc(((size_t)touched_count + 1) * sizeof *touched);
    state->displacement =
        malloc(((size_t)recording->vertex_count + 1) * sizeof *state->displacement);
    state->marks =
        malloc(((size_t)condition_count + (size_t)touched_count + 1) * sizeof *state->marks);
    recording->count++;  // destroy frees what was allocated
    if (!state->displacement || !state->marks || !touched) {
        free(touched);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for step %lld", (long long)step);
    }
    state->step = step;
    memcpy(state->displacement, pliant_player_surface(player),
           (size_t)recording->vertex_count * sizeof *state->displacement);
    state->mark_count = 0;
    for (int32_t i = 0; i < condition_count; i++)
        put_mark(recording, state, conditions[i].node.vertex, conditions[i].value);
    (void)pliant_props_marks(props, touched, touched_count);
    for (int32_t i = 0; i < touched_count; i++)
        put_mark(recording, state, touched[i].vertex, touched[i].direction);
    free(touched);
    return PLIANT_OK;
}

pliant_status pliant_recording_create(const pliant_model *model, int32_t level,
                                      const char *script_path, const int64_t *steps, int32_t count,
                                      pliant_recording **recording, pliant_error *err)
{
    pliant_player *player = NULL;
    pliant_recording *made = calloc(1, sizeof *made);
    if (made) made->states = calloc((size_t)count + 1, sizeof *made->states);
    pliant_status status = PLIANT_OK;
    if (!made || !made->states) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d states", count);
        goto done;
    }
    pliant_player_def def = pliant_player_default(model);
    def.script_name = script_path;
    def.level = level;
    status = pliant_player_create(model, &def, &player, err);
    if (status < 0) goto done;
    made->vertex_count = pliant_player_surface_count(player);
    const pliant_recorder_def recorder = {script_path, steps, count, keep, made};
    status = pliant_recorder_run(&recorder, player, err);

done:
    pliant_player_destroy(player);
    if (status < 0) {
        pliant_recording_destroy(made);
        return status;
    }
    *recording = made;
    return PLIANT_OK;
}

void pliant_recording_destroy(pliant_recording *recording)
{
    if (!recording) return;
    for (int32_t i = 0; recording->states && i < recording->count; i++) {
        free(recording->states[i].marks);
        free(recording->states[i].displacement);
    }
    free(recording->states);
    free(recording);
}
