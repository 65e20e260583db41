// timings.c: how long the phases of played steps took, and what was odd about them.
#include "timings.h"

static void widen(pliant_punctuality *punctuality, int64_t least, int64_t most)
{
    if (punctuality->given_count == 0 || least < punctuality->least_given)
        punctuality->least_given = least;
    if (punctuality->given_count == 0 || most > punctuality->most_given)
        punctuality->most_given = most;
}

static void add_punctuality(pliant_punctuality *punctuality, const pliant_step *step)
{
    const pliant_solver_report *report = &step->report;
    if (step->deadline_ns < PLIANT_NEVER) {
        widen(punctuality, step->deadline_ns, step->deadline_ns);
        punctuality->given_count++;
    }
    // The solve's status leaves things out: a rough solve may be late as well.
    const int is_coarser = report->is_late != 0, is_overrun = report->lateness_ns > 0;
    punctuality->step_count++;
    punctuality->missed_count += is_coarser || is_overrun;
    punctuality->coarser_count += is_coarser;
    punctuality->overrun_count += is_overrun;
    if (report->lateness_ns > punctuality->worst_lateness_ns)
        punctuality->worst_lateness_ns = report->lateness_ns;
    if (report->level >= 0 && report->level <= PLIANT_LEVEL_LIMIT)
        punctuality->level_counts[report->level]++;
}

void pliant_punctuality_merge(pliant_punctuality *punctuality, const pliant_punctuality *other)
{
    if (other->given_count > 0) widen(punctuality, other->least_given, other->most_given);
    punctuality->step_count += other->step_count;
    punctuality->given_count += other->given_count;
    punctuality->missed_count += other->missed_count;
    punctuality->coarser_count += other->coarser_count;
    punctuality->overrun_count += other->overrun_count;
    if (other->worst_lateness_ns > punctuality->worst_lateness_ns)
        punctuality->worst_lateness_ns = other->worst_lateness_ns;
    for (int l = 0; l <= PLIANT_LEVEL_LIMIT; l++)
        punctuality->level_counts[l] += other->level_counts[l];
}

void pliant_timings_add(pliant_timings *timings, const pliant_step *step)
{
    const pliant_solver_report *report = &step->report;
    timings->kind = step->kind;
    for (int p = 0; p < pliant_phase_count(step->kind); p++)
        pliant_histogram_add(&timings->phases[p], step->phase_ns[p]);
    add_punctuality(&timings->punctuality, step);
    if (step->status == PLIANT_ROUGH) timings->rough_count++;
    if (report->constraint_count > timings->most_constraints)
        timings->most_constraints = report->constraint_count;
}

void pliant_timings_merge(pliant_timings *timings, const pliant_timings *other)
{
    if (other->phases[0].count > 0) timings->kind = other->kind;
    for (int p = 0; p < PLIANT_PHASE_LIMIT; p++)
        pliant_histogram_merge(&timings->phases[p], &other->phases[p]);
    pliant_punctuality_merge(&timings->punctuality, &other->punctuality);
    timings->rough_count += other->rough_count;
    if (other->most_constraints > timings->most_constraints)
        timings->most_constraints = other->most_constraints;
}
