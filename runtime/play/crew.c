// crew.c: players that run one script, several at once and several times over.
#include "crew.h"

#include "pliant/error.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// One player's thread.
typedef struct member {
    const pliant_model *model;
    const pliant_crew_def *def;
    const pliant_observer *observer;  // told about the first pass; may be NULL
    pliant_player *player;            // of the first pass
    pliant_timings *timings, *warm_up;
    pliant_timings *current;  // where this pass is counted
    int64_t step_count;
    int is_observed;   // 1: during the observed pass
    atomic_int *stop;  // shared: 1 once a member has failed
    int was_stopped;   // 1: by another's failure
    pthread_t thread;
    pliant_status status;
    pliant_error err;
} member;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// ---- What a member hears from its player ----

static pliant_status stepped(void *context, pliant_player *player, const pliant_step *step,
                             pliant_error *err)
{
    member *m = context;
    pliant_timings_add(m->current, step);
    m->step_count++;
    if (atomic_load_explicit(m->stop, memory_order_relaxed)) {
        m->was_stopped = 1;
        return pliant_error_set(err, PLIANT_ERR_IO, "stopped: another player failed");
    }
    if (!m->is_observed || !m->observer->stepped) return PLIANT_OK;
    return m->observer->stepped(m->observer->context, player, step, err);
}

static pliant_status expected(void *context, const pliant_expectation *expectation,
                              pliant_error *err)
{
    member *m = context;
    if (!m->is_observed || !m->observer->expected) return PLIANT_OK;
    return m->observer->expected(m->observer->context, expectation, err);
}

static int refused(void *context, const pliant_error *reason)
{
    member *m = context;
    if (!m->is_observed || !m->observer->refused) return 0;
    return m->observer->refused(m->observer->context, reason);
}

// ---- Passes ----

static pliant_status play_pass(member *m, pliant_player **player)
{
    pliant_script *script = NULL;
    pliant_status status = pliant_player_create(m->model, &m->def->player, player, &m->err);
    if (status >= 0) status = pliant_script_open(m->def->script, &script, &m->err);
    if (status >= 0) {
        const pliant_observer observer = {m, stepped, expected, refused};
        status = pliant_player_play(*player, script, &observer, &m->err);
    }
    pliant_script_close(script);
    return status;
}

static void *play_all(void *context)
{
    member *m = context;
    for (int32_t pass = 0; m->status >= 0 && pass < m->def->repeat; pass++) {
        pliant_player *player = NULL;
        m->current = m->def->repeat > 1 && pass == 0 ? m->warm_up : m->timings;
        m->is_observed = m->observer && pass == 0;
        m->status = play_pass(m, &player);
        if (pass == 0) m->player = player;
        else pliant_player_destroy(player);
    }
    if (m->status < 0) atomic_store_explicit(m->stop, 1, memory_order_relaxed);
    return NULL;
}

static void clear_member(member *m)
{
    pliant_player_destroy(m->player);
    free(m->timings);
    free(m->warm_up);
}

static pliant_status run(member *members, int32_t count, pliant_error *err)
{
    int32_t started = 0;
    pliant_status status = PLIANT_OK;
    // The first member plays on this thread, so one player needs no other.
    for (int32_t i = 1; i < count; i++, started++)
        if (pthread_create(&members[i].thread, NULL, play_all, &members[i]) != 0) {
            status = pliant_error_set(err, PLIANT_ERR_MEMORY,
                                      "--threads: the system gave %d threads of %d",
                                      (int)started + 1, (int)count);
            break;
        }
    if (status >= 0) play_all(&members[0]);
    else atomic_store_explicit(members[0].stop, 1, memory_order_relaxed);
    for (int32_t i = 0; i < started; i++) pthread_join(members[i + 1].thread, NULL);
    for (int32_t i = 0; status >= 0 && i < count; i++)
        if (members[i].status < 0 && !members[i].was_stopped) {
            status = members[i].status;
            if (err) *err = members[i].err;
        }
    return status;
}

pliant_status pliant_crew_play(const pliant_model *model, const pliant_crew_def *def,
                               pliant_crew_result *result, pliant_error *err)
{
    memset(result, 0, sizeof *result);
    if (def->threads < 1 || def->threads > PLIANT_CREW_LIMIT || def->repeat < 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%d players and %d passes",
                                (int)def->threads, (int)def->repeat);
    member *members = calloc((size_t)def->threads, sizeof *members);
    if (!members) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the players");
    pliant_status status = PLIANT_OK;
    atomic_int stop = 0;
    for (int32_t i = 0; i < def->threads; i++) {
        member *m = &members[i];
        m->stop = &stop;
        m->model = model;
        m->def = def;
        m->observer = i == 0 ? def->observer : NULL;
        m->timings = calloc(1, sizeof *m->timings);
        m->warm_up = calloc(1, sizeof *m->warm_up);
        if (!m->timings || !m->warm_up)
            status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the timings");
    }
    if (status >= 0) {
        const double start = now();
        status = run(members, def->threads, err);
        result->seconds = now() - start;
        for (int32_t i = 0; i < def->threads; i++) {
            result->step_count += members[i].step_count;
            if (i == 0) continue;
            pliant_timings_merge(members[0].timings, members[i].timings);
            pliant_timings_merge(members[0].warm_up, members[i].warm_up);
        }
        result->player = members[0].player;
        result->timings = members[0].timings;
        result->warm_up = members[0].warm_up;
        members[0] = (member){0};
    }
    for (int32_t i = 0; i < def->threads; i++) clear_member(&members[i]);
    free(members);
    return status;
}

void pliant_crew_result_clear(pliant_crew_result *result)
{
    pliant_player_destroy(result->player);
    free(result->timings);
    free(result->warm_up);
    memset(result, 0, sizeof *result);
}
