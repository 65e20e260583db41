// recorder.h: a contact script played for the sake of chosen steps.
#pragma once

#include "player.h"

#include "pliant/base.h"

#include <stdint.h>

#define PLIANT_RECORDING_LIMIT 64         // states of one picture
#define PLIANT_RECORDING_END   INT64_MAX  // the script's last step, whatever its number

typedef struct pliant_recorder_def {
    const char *script_path;  // "-": standard input
    // Ascending: 0 for the start (Green's functions: at rest; a lattice: where the statements
    // before the first step have placed things), PLIANT_RECORDING_END last. Shape [step_count].
    const int64_t *steps;
    int32_t step_count;
    // Called once for each of them, in this order; refuses by a status < 0.
    pliant_status (*keep)(void *context, pliant_player *player, int64_t step, pliant_error *err);
    void *context;
} pliant_recorder_def;

// Play until the last step asked for is kept. The script's expectations are not looked at: whether
// they hold is pliant-play's question. Refuses a step that the script does not reach.
PLIANT_UNUSED_RESULT pliant_status pliant_recorder_run(const pliant_recorder_def *def,
                                                       pliant_player *player, pliant_error *err);

// How many steps a script makes, without playing it.
PLIANT_UNUSED_RESULT pliant_status pliant_recorder_count_steps(const char *script_path,
                                                               int64_t *count, pliant_error *err);
