// team.h: a few threads that share the tasks of one caller.
//
// A team is created once; its threads then wait for work, spinning for some microseconds and
// asleep after that. A run hands out tasks 0 .. task_count - 1, to each thread from a stretch of
// its own, then from others'; the caller works along as worker 0. What comes out must not depend on
// who did what: a task writes what no other task of its run reads or writes, `worker` is for
// scratch memory. Tasks run in the caller's floating-point mode.
//
// One caller at a time, and no run within a run. A run allocates nothing; it takes the team's lock
// only to wake sleepers or to sleep.
#pragma once

#include "pliant/base.h"

#define PLIANT_TEAM_LIMIT 64  // threads

typedef struct pliant_team pliant_team;
typedef void pliant_task(void *context, int32_t task, int32_t worker);

// `thread_count` includes the caller: 1 .. PLIANT_TEAM_LIMIT, else PLIANT_ERR_ARGUMENT.
PLIANT_UNUSED_RESULT pliant_status pliant_team_create(int32_t thread_count, pliant_team **team,
                                                      pliant_error *err);
void pliant_team_destroy(pliant_team *team);                // NULL is fine
int32_t pliant_team_thread_count(const pliant_team *team);  // NULL: 1

// Returns when all tasks are done. A team that is NULL is the caller alone.
void pliant_team_run(pliant_team *team, int32_t task_count, pliant_task *task, void *context);
