// report.h: what a played script has to say, as text and as JSON, to any stream.
//
// Nothing here checks the stream: whoever owns it does.
#pragma once

#include "compare.h"
#include "crew.h"

#include <stdio.h>

typedef struct pliant_report {
    const char *model, *script;  // names as given
    const pliant_model_info *info;
    int32_t threads, repeat;
    const pliant_crew_result *result;       // with a player
    const pliant_compare_summary *compare;  // NULL without --compare
} pliant_report;

// The end of a play: timings by phase, then probes and contact force at the last step.
void pliant_report_write(const pliant_report *report, FILE *stream);
void pliant_report_write_json(const pliant_report *report, FILE *stream);
// One step, one line.
void pliant_report_write_step(const pliant_player *player, const pliant_step *step, FILE *stream);
void pliant_report_write_step_json(const pliant_player *player, const pliant_step *step,
                                   FILE *stream);
// One expectation, one line: "ok" or how far off it is.
void pliant_report_write_expectation(const pliant_expectation *expectation, FILE *stream);
void pliant_report_write_expectation_json(const pliant_expectation *expectation, FILE *stream);
// The comparison alone.
void pliant_report_write_compare(const pliant_compare_summary *compare, FILE *stream);
