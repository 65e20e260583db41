// timings.h: how long the phases of played steps took, and what was odd about them.
#pragma once

#include "histogram.h"
#include "player.h"

#include "pliant/hierarchy.h"

// How steps kept their deadline, and on which levels they were solved.
typedef struct pliant_punctuality {
    int64_t step_count;
    int64_t given_count;              // steps with a deadline
    int64_t least_given, most_given;  // ns from the solve's start, of those
    int64_t missed_count;       // steps that missed their deadline, in one of the next two ways
    int64_t coarser_count;      // solved on a coarser level than stated
    int64_t overrun_count;      // solved, on whatever level, after the deadline
    int64_t worst_lateness_ns;  // of those
    int64_t level_counts[PLIANT_LEVEL_LIMIT + 1];  // steps by the finest level of their constraints
} pliant_punctuality;                              // zeroed is empty

typedef struct pliant_timings {
    pliant_play_kind kind;  // whose phases these are; of the last step that was added
    pliant_histogram phases[PLIANT_PHASE_LIMIT];
    pliant_punctuality punctuality;
    int64_t rough_count;       // steps that solved with PLIANT_ROUGH
    int32_t most_constraints;  // the largest s
} pliant_timings;              // zeroed is empty; about 500 kB

void pliant_timings_add(pliant_timings *timings, const pliant_step *step);
void pliant_timings_merge(pliant_timings *timings, const pliant_timings *other);
void pliant_punctuality_merge(pliant_punctuality *punctuality, const pliant_punctuality *other);
