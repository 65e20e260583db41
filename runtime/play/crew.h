// crew.h: players that run one script, several at once and several times over.
//
// One crew is `threads` players, each with its own solver on the shared model, each playing the
// whole script `repeat` times from the reference state; every pass gets a new solver, so that no
// pass profits from another's factorisations. With one pass its timings are the result; with more
// the first pass of each player counts as warm-up (pages of the model, caches) and is kept apart.
// Only the first pass of the first player is observed.
#pragma once

#include "timings.h"

#define PLIANT_CREW_LIMIT 256  // players at once

typedef struct pliant_crew_def {
    const char *script;  // path, or "-" for standard input (one thread and one pass only)
    pliant_player_def player;
    int32_t threads, repeat;          // at least 1
    const pliant_observer *observer;  // of the first player's first pass; may be NULL
} pliant_crew_def;

typedef struct pliant_crew_result {
    pliant_player *player;    // the first, as its first pass left it; owned, destroy it
    pliant_timings *timings;  // of all that is not warm-up; owned
    pliant_timings *warm_up;  // empty with one pass; owned
    int64_t step_count;       // of all players and passes, warm-up included
    double seconds;           // wall time of the above, output included
} pliant_crew_result;

// On refusal `result` still holds the first player when there is one.
PLIANT_UNUSED_RESULT pliant_status pliant_crew_play(const pliant_model *model,
                                                    const pliant_crew_def *def,
                                                    pliant_crew_result *result, pliant_error *err);
void pliant_crew_result_clear(pliant_crew_result *result);  // zeroed is fine
