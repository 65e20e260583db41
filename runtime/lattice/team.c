// team.c: a few threads that share the tasks of one caller.
//
// `remaining` says all: a worker takes a task by counting it down, and may read what the run is
// about only after that, since no run ends before the tasks that were taken from it. So a worker
// that wakes late takes part in whatever run is on by then, and a run never waits for one that is
// still asleep. Which task it is comes after: every worker has a stretch of the tasks, the same in
// every run of as many, so that what they work on stays in its caches; one that is through with its
// own takes the next of another's.
#include "lattice/team.h"

#include "lattice/float_mode.h"
#include "pliant/error.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>

// Looks at an atomic before falling asleep, each of some 40 cycles: 0.3 to 0.5 ms, longer than what
// lies between two runs of a step, shorter than a frame. On virtual machines waking takes as long;
// with a tenth of this two threads took turns instead of working side by side.
#define SPIN_COUNT 20000

typedef struct member {
    pliant_team *team;
    int32_t worker;
    pthread_t thread;
} member;

// A worker's own tasks: next .. end - 1.
typedef struct stretch {
    _Alignas(64) atomic_int next;
    int32_t end;
} stretch;

struct pliant_team {
    int32_t thread_count, started;  // threads beside the caller: 0 .. thread_count - 1 of them
    int spin_count;
    // The run; written while `remaining` is 0.
    pliant_task *task;
    void *context;
    int32_t task_count;
    pliant_float_mode mode;
    _Alignas(64) atomic_int remaining;  // tasks that nobody has taken
    stretch stretches[PLIANT_TEAM_LIMIT];
    _Alignas(64) atomic_int finished;
    _Alignas(64) atomic_int sleeper_count;
    atomic_int is_caller_asleep, is_over;
    pthread_mutex_t lock;
    pthread_cond_t work, done;
    member members[PLIANT_TEAM_LIMIT];
};

static void relax(void)
{
#if defined(__SSE2__)
    _mm_pause();
#endif
}

// Take a task: its number, or -1 when none is left.
static int32_t take(pliant_team *team, int32_t worker)
{
    int left = atomic_load_explicit(&team->remaining, memory_order_relaxed);
    while (left > 0)
        if (atomic_compare_exchange_weak_explicit(&team->remaining, &left, left - 1,
                                                  memory_order_acquire, memory_order_relaxed)) {
            // There are as many tasks in the stretches as were counted, so this ends.
            for (int32_t k = worker;; k = k + 1 < team->thread_count ? k + 1 : 0) {
                stretch *s = &team->stretches[k];
                if (atomic_load_explicit(&s->next, memory_order_relaxed) >= s->end) continue;
                const int32_t task = atomic_fetch_add_explicit(&s->next, 1, memory_order_relaxed);
                if (task < s->end) return task;
            }
        }
    return -1;
}

static void work(pliant_team *team, int32_t worker)
{
    for (int32_t task = take(team, worker); task >= 0; task = take(team, worker)) {
        const int32_t task_count = team->task_count;
        if (pliant_float_mode_get() != team->mode) pliant_float_mode_set(team->mode);
        team->task(team->context, task, worker);
        // From here on the run may be over, and its description another's.
        if (atomic_fetch_add(&team->finished, 1) + 1 == task_count &&
            atomic_load(&team->is_caller_asleep)) {
            pthread_mutex_lock(&team->lock);
            pthread_cond_signal(&team->done);
            pthread_mutex_unlock(&team->lock);
        }
    }
}

static void *serve(void *argument)
{
    const member *m = argument;
    pliant_team *team = m->team;
    while (!atomic_load(&team->is_over)) {
        work(team, m->worker);
        for (int i = 0; i < team->spin_count; i++) {
            if (atomic_load_explicit(&team->remaining, memory_order_relaxed) > 0 ||
                atomic_load_explicit(&team->is_over, memory_order_relaxed))
                break;
            relax();
        }
        if (atomic_load_explicit(&team->remaining, memory_order_relaxed) > 0) continue;
        pthread_mutex_lock(&team->lock);
        // Counted before looking once more: the caller hands out before it looks for sleepers.
        atomic_fetch_add(&team->sleeper_count, 1);
        while (atomic_load(&team->remaining) == 0 && !atomic_load(&team->is_over))
            pthread_cond_wait(&team->work, &team->lock);
        atomic_fetch_sub(&team->sleeper_count, 1);
        pthread_mutex_unlock(&team->lock);
    }
    return NULL;
}

pliant_status pliant_team_create(int32_t thread_count, pliant_team **team, pliant_error *err)
{
    *team = NULL;
    if (thread_count < 1 || thread_count > PLIANT_TEAM_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "threads: expected 1 to %d, found %d",
                                PLIANT_TEAM_LIMIT, (int)thread_count);
    pliant_team *made = aligned_alloc(64, (sizeof *made + 63) / 64 * 64);
    if (!made) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a team of threads");
    *made = (pliant_team){.thread_count = thread_count};
    // More threads than processors: one that spins holds up one that works.
    made->spin_count = thread_count <= sysconf(_SC_NPROCESSORS_ONLN) ? SPIN_COUNT : 0;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->work, NULL);
    pthread_cond_init(&made->done, NULL);
    for (int32_t i = 0; i < thread_count - 1; i++) {
        made->members[i] = (member){.team = made, .worker = i + 1};
        if (pthread_create(&made->members[i].thread, NULL, serve, &made->members[i]) != 0) {
            pliant_team_destroy(made);
            return pliant_error_set(err, PLIANT_ERR_MEMORY, "threads: the system gave %d of %d",
                                    (int)i + 1, (int)thread_count);
        }
        made->started++;
    }
    *team = made;
    return PLIANT_OK;
}

void pliant_team_destroy(pliant_team *team)
{
    if (!team) return;
    pthread_mutex_lock(&team->lock);
    atomic_store(&team->is_over, 1);
    pthread_cond_broadcast(&team->work);
    pthread_mutex_unlock(&team->lock);
    for (int32_t i = 0; i < team->started; i++) pthread_join(team->members[i].thread, NULL);
    pthread_cond_destroy(&team->done);
    pthread_cond_destroy(&team->work);
    pthread_mutex_destroy(&team->lock);
    free(team);
}

int32_t pliant_team_thread_count(const pliant_team *team)
{
    return team ? team->thread_count : 1;
}

static void await_end(pliant_team *team)
{
    for (int i = 0; i < team->spin_count; i++) {
        if (atomic_load_explicit(&team->finished, memory_order_acquire) == team->task_count) return;
        relax();
    }
    pthread_mutex_lock(&team->lock);
    atomic_store(&team->is_caller_asleep, 1);
    while (atomic_load(&team->finished) != team->task_count)
        pthread_cond_wait(&team->done, &team->lock);
    atomic_store(&team->is_caller_asleep, 0);
    pthread_mutex_unlock(&team->lock);
}

void pliant_team_run(pliant_team *team, int32_t task_count, pliant_task *task, void *context)
{
    if (!team || team->started == 0 || task_count <= 1) {
        for (int32_t i = 0; i < task_count; i++) task(context, i, 0);
        return;
    }
    team->task = task;
    team->context = context;
    team->task_count = task_count;
    team->mode = pliant_float_mode_get();
    for (int32_t k = 0; k < team->thread_count; k++) {
        const int64_t count = task_count;
        atomic_store_explicit(&team->stretches[k].next, (int)(count * k / team->thread_count),
                              memory_order_relaxed);
        team->stretches[k].end = (int32_t)(count * (k + 1) / team->thread_count);
    }
    atomic_store_explicit(&team->finished, 0, memory_order_relaxed);
    atomic_store(&team->remaining, task_count);
    if (atomic_load(&team->sleeper_count) > 0) {
        pthread_mutex_lock(&team->lock);
        pthread_cond_broadcast(&team->work);
        pthread_mutex_unlock(&team->lock);
    }
    work(team, 0);
    await_end(team);
}
