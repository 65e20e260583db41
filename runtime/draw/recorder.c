// recorder.c: a contact script played for the sake of chosen steps.
#include "recorder.h"

#include "pliant/error.h"
#include "pliant/script.h"

typedef struct recorder {
    const pliant_recorder_def *def;
    int32_t kept;  // of def->step_count
} recorder;

static int is_complete(const recorder *r)
{
    return r->kept == r->def->step_count;
}

static pliant_status keep(recorder *r, pliant_player *player, int64_t step, pliant_error *err)
{
    const pliant_status status = r->def->keep(r->def->context, player, step, err);
    if (status >= 0) r->kept++;
    return status;
}

static pliant_status stepped(void *context, pliant_player *player, const pliant_step *step,
                             pliant_error *err)
{
    recorder *r = context;
    if (is_complete(r) || step->number != r->def->steps[r->kept]) return PLIANT_OK;
    const pliant_status status = keep(r, player, step->number, err);
    if (status < 0) return status;
    // A negative status is how an observer ends a play (`step 1000000` goes no further than what is
    // wanted); run tells this end from a failure.
    return is_complete(r) ? PLIANT_ERR_ARGUMENT : PLIANT_OK;
}

// The state before the first step, if it is wanted and not there yet.
static pliant_status keep_start(recorder *r, pliant_player *player, pliant_error *err)
{
    if (r->kept > 0 || r->def->steps[0] != 0) return PLIANT_OK;
    const pliant_status status = pliant_player_prepare(player, err);
    return status < 0 ? status : keep(r, player, 0, err);
}

static pliant_status check_steps(const pliant_recorder_def *def, pliant_error *err)
{
    if (def->step_count < 1 || def->step_count > PLIANT_RECORDING_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%d steps: expected 1 to %d",
                                def->step_count, PLIANT_RECORDING_LIMIT);
    for (int32_t i = 0; i < def->step_count; i++)
        if (def->steps[i] < 0 || (i > 0 && def->steps[i] <= def->steps[i - 1]))
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "step %lld: expected ascending numbers from 0",
                                    (long long)def->steps[i]);
    return PLIANT_OK;
}

static pliant_status play(recorder *r, pliant_player *player, pliant_script *script,
                          pliant_error *err)
{
    const pliant_observer observer = {.context = r, .stepped = stepped};
    pliant_status status = PLIANT_OK;
    while (status >= 0 && !is_complete(r)) {
        pliant_statement statement;
        int more = 1;
        status = pliant_script_next(script, &statement, &more, err);
        if (status < 0 || !more) break;
        if (statement.kind == PLIANT_STATEMENT_EXPECT) continue;
        if (statement.kind == PLIANT_STATEMENT_STEP) status = keep_start(r, player, err);
        if (status >= 0 && !is_complete(r))
            status = pliant_player_execute(player, &statement, &observer, err);
    }
    return status;
}

pliant_status pliant_recorder_run(const pliant_recorder_def *def, pliant_player *player,
                                  pliant_error *err)
{
    recorder r = {.def = def};
    pliant_script *script = NULL;
    pliant_status status = check_steps(def, err);
    if (status < 0) return status;
    // Green's functions start at rest, whatever the script does first.
    if (pliant_player_kind(player) == PLIANT_PLAY_GREENS) status = keep_start(&r, player, err);
    if (status < 0 || is_complete(&r)) return status;
    status = pliant_script_open(def->script_path, &script, err);
    if (status < 0) return status;
    status = play(&r, player, script, err);
    pliant_script_close(script);
    if (status >= 0 && !is_complete(&r)) status = keep_start(&r, player, err);
    if (is_complete(&r)) return PLIANT_OK;
    if (status < 0) return status;
    const int64_t next = def->steps[r.kept], last = pliant_player_last(player)->number;
    if (next != PLIANT_RECORDING_END)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: step %lld: expected one of its %lld steps", def->script_path,
                                (long long)next, (long long)last);
    status = pliant_player_prepare(player, err);
    return status < 0 ? status : keep(&r, player, last, err);
}

pliant_status pliant_recorder_count_steps(const char *script_path, int64_t *count,
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
