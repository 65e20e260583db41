// scene_recording.c: the states of a scene at chosen steps of a contact script.
#include "scene_recording.h"

#include "recorder.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { THREAD_LIMIT = 4 };  // more have little to do in a scene that fits a picture

static pliant_status keep(void *context, pliant_player *player, int64_t step, pliant_error *err)
{
    pliant_scene_recording *recording = context;
    const pliant_scene *scene = pliant_player_scene(player);
    const pliant_instances *instances = pliant_scene_instances(scene);
    struct pliant_scene_state *state = &recording->states[recording->count];
    recording->vertex_count = pliant_instances_surface_count(instances);
    recording->instance_count = pliant_instances_count(instances);
    const size_t n = (size_t)recording->vertex_count;
    state->step = step;
    state->obstacle_count = pliant_scene_obstacles(scene, NULL, 0);
    state->displacement = malloc(n * sizeof *state->displacement);
    state->normals = malloc(n * sizeof *state->normals);
    state->obstacles = malloc(((size_t)state->obstacle_count + 1) * sizeof *state->obstacles);
    recording->count++;  // destroy frees what was allocated
    if (!state->displacement || !state->normals || !state->obstacles)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for step %lld", (long long)step);
    memcpy(state->displacement, pliant_instances_displacements(instances),
           n * sizeof *state->displacement);
    memcpy(state->normals, pliant_instances_normals(instances), n * sizeof *state->normals);
    (void)pliant_scene_obstacles(scene, state->obstacles, state->obstacle_count);
    return PLIANT_OK;
}

pliant_status pliant_scene_recording_create(const pliant_model *model, const char *script_path,
                                            const int64_t *steps, int32_t count,
                                            pliant_scene_recording **recording, pliant_error *err)
{
    pliant_player *player = NULL;
    pliant_scene_recording *made = calloc(1, sizeof *made);
    if (made) made->states = calloc((size_t)count + 1, sizeof *made->states);
    pliant_status status = PLIANT_OK;
    if (!made || !made->states) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d states", count);
        goto done;
    }
    pliant_player_def def = pliant_player_default(model);
    def.script_name = script_path;
    def.kind_rule = PLIANT_KIND_LATTICE;
    // The same bits from any number.
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    def.thread_count = processors < 1              ? 1
                       : processors < THREAD_LIMIT ? (int32_t)processors
                                                   : THREAD_LIMIT;
    status = pliant_player_create(model, &def, &player, err);
    if (status < 0) goto done;
    const pliant_recorder_def recorder = {script_path, steps, count, keep, made};
    status = pliant_recorder_run(&recorder, player, err);

done:
    pliant_player_destroy(player);
    if (status < 0) {
        pliant_scene_recording_destroy(made);
        return status;
    }
    *recording = made;
    return PLIANT_OK;
}

void pliant_scene_recording_destroy(pliant_scene_recording *recording)
{
    if (!recording) return;
    for (int32_t i = 0; recording->states && i < recording->count; i++) {
        free(recording->states[i].obstacles);
        free(recording->states[i].normals);
        free(recording->states[i].displacement);
    }
    free(recording->states);
    free(recording);
}
