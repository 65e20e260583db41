// impulses.h: the impulses that keep apart what touches.
//
// A touch alone takes away approach beyond what its target allows, and friction sliding, by an
// impulse that makes both sides equally fast: kinetic energy falls, whatever the heap (only the
// bounded speed at which overlaps part adds some). It acts on both sides, equal and opposite, along
// the line between them but for friction, so that momentum and, without friction between balls,
// angular momentum are kept to rounding. Touches act one after another, several passes over all
// (Gauss-Seidel); those without a common participant have one colour and act side by side, so that
// the team's size changes nothing.
#pragma once

#include "lattice/touches.h"

#define PLIANT_COLOUR_LIMIT 64

typedef struct pliant_impulses {
    uint64_t *used;        // shape [participant_capacity]: bit c: it has a touch of colour c
    uint8_t *colour;       // shape [touch_capacity]
    pliant_touch *sorted;  // shape [touch_capacity]: by colour, then as found
    int32_t first[PLIANT_COLOUR_LIMIT + 1];
    // Of the pass under way.
    pliant_touches *touches;
    float friction;
    int32_t begin, end;
} pliant_impulses;

// Twice, as arena.h says: to measure and to carve. For touches laid out before.
void pliant_impulses_lay_out(pliant_impulses *impulses, pliant_arena *arena,
                             const pliant_touches *touches);
// Change the participants' velocities.
void pliant_impulses_apply(pliant_impulses *impulses, pliant_team *team, pliant_touches *touches,
                           float friction);
