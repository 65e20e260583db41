// timings.c: how long the phases of played steps took, and what was odd about them.
#include "timings.h"

static const char *const phase_names[PLIANT_PHASE_COUNT] = {
    [PLIANT_PHASE_CAPACITANCE] = "capacitance",
    [PLIANT_PHASE_CONTACT] = "contact",
    [PLIANT_PHASE_SUMMATION] = "summation",
    [PLIANT_PHASE_SURFACE] = "surface",
    [PLIANT_PHASE_TOTAL] = "total",
};

const char *pliant_phase_name(pliant_phase phase)
{
    return phase_names[phase];
}

void pliant_timings_add(pliant_timings *timings, const pliant_step *step)
{
    const pliant_solver_report *report = &step->report;
    pliant_histogram_add(&timings->phases[PLIANT_PHASE_CAPACITANCE], report->capacitance_ns);
    pliant_histogram_add(&timings->phases[PLIANT_PHASE_CONTACT], report->contact_ns);
    pliant_histogram_add(&timings->phases[PLIANT_PHASE_SUMMATION], report->summation_ns);
    pliant_histogram_add(&timings->phases[PLIANT_PHASE_SURFACE], report->surface_ns);
    pliant_histogram_add(&timings->phases[PLIANT_PHASE_TOTAL], step->total_ns);
    if (step->status == PLIANT_ROUGH) timings->rough_count++;
    if (report->constraint_count > timings->most_constraints)
        timings->most_constraints = report->constraint_count;
}

void pliant_timings_merge(pliant_timings *timings, const pliant_timings *other)
{
    for (int p = 0; p < PLIANT_PHASE_COUNT; p++)
        pliant_histogram_merge(&timings->phases[p], &other->phases[p]);
    timings->rough_count += other->rough_count;
    if (other->most_constraints > timings->most_constraints)
        timings->most_constraints = other->most_constraints;
}
