// recording.c: the states of a body at chosen steps of a contact script.
#include "recording.h"

#include "player.h"
#include "pliant/error.h"
#include "pliant/script.h"

#include <stdlib.h>
#include <string.h>

typedef struct recorder {
    pliant_recording *recording;
    const int64_t *wanted;
    int32_t wanted_count;
    int complete;  // 1: every state is there; the rest of the script need not be played
} recorder;

// A contact on a vertex finer than the level drawn has no place in the picture.
static void put_mark(const pliant_recording *recording, struct pliant_recorded_state *state,
                     int32_t vertex, pliant_vec3 v)
{
    if (vertex >= recording->vertex_count) return;
    state->marks[state->mark_count++] =
        (pliant_mark){.vertex = vertex, .direction = {(double)v.x, (double)v.y, (double)v.z}};
}

static pliant_status keep(recorder *r, pliant_player *player, int64_t step, pliant_error *err)
{
    pliant_recording *recording = r->recording;
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
    if (recording->count == r->wanted_count) r->complete = 1;
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
        // Whether the expectations hold is pliant-play's question; the picture is wanted either
        // way.
        if (statement.kind == PLIANT_STATEMENT_EXPECT) continue;
        status = pliant_player_execute(player, &statement, &observer, err);
    }
    pliant_script_close(script);
    if (r->complete) return PLIANT_OK;
    if (status < 0) return status;
    const int64_t next = r->wanted[r->recording->count], last = pliant_player_last(player)->number;
    if (next != PLIANT_RECORDING_END)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: step %lld: expected one of its %lld steps", path,
                                (long long)next, (long long)last);
    return keep(r, player, last, err);
}

pliant_status pliant_recording_create(const pliant_model *model, int32_t level,
                                      const char *script_path, const int64_t *steps, int32_t count,
                                      pliant_recording **recording, pliant_error *err)
{
    if (count < 1 || count > PLIANT_RECORDING_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%d steps: expected 1 to %d", count,
                                PLIANT_RECORDING_LIMIT);
    for (int32_t i = 0; i < count; i++)
        if (steps[i] < 0 || (i > 0 && steps[i] <= steps[i - 1]))
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "step %lld: expected ascending numbers from 0",
                                    (long long)steps[i]);
    pliant_player *player = NULL;
    pliant_recording *made = calloc(1, sizeof *made);
    if (made) made->states = calloc((size_t)count, sizeof *made->states);
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
    recorder r = {.recording = made, .wanted = steps, .wanted_count = count};
    if (steps[0] == 0) status = keep(&r, player, 0, err);
    if (status >= 0 && !r.complete) status = play(&r, player, script_path, err);

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

pliant_status pliant_recording_count_steps(const char *script_path, int64_t *count,
                                           pliant_error *err)
{
    pliant_script *script = NULL;
    pliant_status status = pliant_script_open(script_path, &script, err);
    if (status < 0) return status;
    int64_t sum = 0;
    int more = 1;
    for (;;) {
        pliant_statement statement;
        status = pliant_script_next(script, &statement, &more, err);
        if (status < 0 || !more) break;
        if (statement.kind != PLIANT_STATEMENT_STEP) continue;
        if (statement.count > INT64_MAX - 1 - sum) {
            status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                      "%s: more steps than can be numbered", script_path);
            break;
        }
        sum += statement.count;
    }
    pliant_script_close(script);
    if (status < 0) return status;
    *count = sum;
    return PLIANT_OK;
}
