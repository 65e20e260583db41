// scene_recording.c: the states of a scene at chosen steps of a contact script.
#include "scene_recording.h"

#include "player.h"
#include "recording.h"

#include "pliant/error.h"
#include "pliant/script.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { THREAD_LIMIT = 4 };  // more have little to do in a scene that fits a picture

typedef struct recorder {
    pliant_scene_recording *recording;
    const int64_t *wanted;
    int32_t wanted_count;
    int complete;  // 1: every state is there; the rest of the script need not be played
} recorder;

static pliant_status keep(recorder *r, const pliant_player *player, int64_t step, pliant_error *err)
{
    pliant_scene_recording *recording = r->recording;
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
    r->complete = recording->count == r->wanted_count;
    return PLIANT_OK;
}

static pliant_status stepped(void *context, pliant_player *player, const pliant_step *step,
                             pliant_error *err)
{
    recorder *r = context;
    if (r->complete || step->number != r->wanted[r->recording->count]) return PLIANT_OK;
    const pliant_status status = keep(r, player, step->number, err);
    if (status < 0) return status;
    // A negative status is how an observer ends a play; the caller tells this end from a failure.
    return r->complete ? PLIANT_ERR_ARGUMENT : PLIANT_OK;
}

static pliant_status keep_start(recorder *r, pliant_player *player, pliant_error *err)
{
    if (r->recording->count > 0 || r->wanted[0] != 0) return PLIANT_OK;
    const pliant_status status = pliant_player_prepare(player, err);
    return status < 0 ? status : keep(r, player, 0, err);
}

static pliant_status play(recorder *r, pliant_player *player, const char *path, pliant_error *err)
{
    pliant_script *script = NULL;
    pliant_status status = pliant_script_open(path, &script, err);
    if (status < 0) return status;
    const pliant_observer observer = {.context = r, .stepped = stepped};
    int more = 1;
    while (status >= 0 && !r->complete) {
        pliant_statement statement;
        status = pliant_script_next(script, &statement, &more, err);
        if (status < 0 || !more) break;
        // Whether the expectations hold is pliant-play's question.
        if (statement.kind == PLIANT_STATEMENT_EXPECT) continue;
        if (statement.kind == PLIANT_STATEMENT_STEP) status = keep_start(r, player, err);
        if (status >= 0 && !r->complete)
            status = pliant_player_execute(player, &statement, &observer, err);
    }
    pliant_script_close(script);
    if (!r->complete && status >= 0) status = keep_start(r, player, err);
    if (r->complete) return PLIANT_OK;
    if (status < 0) return status;
    const int64_t next = r->wanted[r->recording->count], last = pliant_player_last(player)->number;
    if (next != PLIANT_RECORDING_END)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: step %lld: expected one of its %lld steps", path,
                                (long long)next, (long long)last);
    status = pliant_player_prepare(player, err);
    return status < 0 ? status : keep(r, player, last, err);
}

pliant_status pliant_scene_recording_create(const pliant_model *model, const char *script_path,
                                            const int64_t *steps, int32_t count,
                                            pliant_scene_recording **recording, pliant_error *err)
{
    pliant_player *player = NULL;
    pliant_scene_recording *made = calloc(1, sizeof *made);
    if (made) made->states = calloc((size_t)count, sizeof *made->states);
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
    recorder r = {.recording = made, .wanted = steps, .wanted_count = count};
    status = play(&r, player, script_path, err);

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
