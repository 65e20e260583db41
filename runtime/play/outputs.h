// outputs.h: everything that pliant-play writes while it plays, behind one observer.
#pragma once

#include "compare.h"
#include "options.h"
#include "player.h"

typedef struct pliant_outputs pliant_outputs;

// Open what `options` ask for; `level` is the one that players reconstruct. Both inputs are
// borrowed until the end.
PLIANT_UNUSED_RESULT pliant_status pliant_outputs_open(const pliant_play_options *options,
                                                       const pliant_model *model, int32_t level,
                                                       pliant_outputs **outputs, pliant_error *err);
// Hand this to the players. Its refused() tells and goes on when a person types.
pliant_observer pliant_outputs_observer(pliant_outputs *outputs);
int64_t
pliant_outputs_refused_count(const pliant_outputs *outputs);    // statements told and passed over
int pliant_outputs_pipe_closed(const pliant_outputs *outputs);  // 1: nobody reads standard output
// NULL without --compare, or before the first step.
const pliant_compare_summary *pliant_outputs_compared(pliant_outputs *outputs);
// Put every file in its place. On refusal those not yet in place are removed. Call once, then
// destroy; destroy alone removes what is unfinished.
PLIANT_UNUSED_RESULT pliant_status pliant_outputs_commit(pliant_outputs *outputs,
                                                         const pliant_player *player,
                                                         pliant_error *err);
void pliant_outputs_destroy(pliant_outputs *outputs);  // NULL is fine

// Flush standard output and refuse when anything written to it was lost.
PLIANT_UNUSED_RESULT pliant_status pliant_outputs_flush(pliant_outputs *outputs, pliant_error *err);
