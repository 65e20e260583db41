// phases.c: the phases of a step that are timed, of either kind of play.
#include "phases.h"

static const char *const greens_names[PLIANT_PHASE_COUNT] = {
    [PLIANT_PHASE_CAPACITANCE] = "capacitance",
    [PLIANT_PHASE_CONTACT] = "contact",
    [PLIANT_PHASE_SUMMATION] = "summation",
    [PLIANT_PHASE_SURFACE] = "surface",
    [PLIANT_PHASE_TOTAL] = "total",
};

static const char *const scene_names[PLIANT_SCENE_PHASE_COUNT] = {
    [PLIANT_SCENE_PHASE_MATCH] = "match",   [PLIANT_SCENE_PHASE_OBSTACLES] = "obstacles",
    [PLIANT_SCENE_PHASE_SEARCH] = "search", [PLIANT_SCENE_PHASE_CONTACTS] = "contacts",
    [PLIANT_SCENE_PHASE_MOTION] = "motion", [PLIANT_SCENE_PHASE_SURFACE] = "surface",
    [PLIANT_SCENE_PHASE_TOTAL] = "total",
};

_Static_assert((int)PLIANT_PHASE_COUNT <= PLIANT_PHASE_LIMIT, "phases of a step");
_Static_assert((int)PLIANT_SCENE_PHASE_COUNT <= PLIANT_PHASE_LIMIT, "phases of a step");

int pliant_phase_count(pliant_play_kind kind)
{
    return kind == PLIANT_PLAY_LATTICE ? (int)PLIANT_SCENE_PHASE_COUNT : (int)PLIANT_PHASE_COUNT;
}

const char *pliant_phase_name(pliant_play_kind kind, int phase)
{
    return kind == PLIANT_PLAY_LATTICE ? scene_names[phase] : greens_names[phase];
}
