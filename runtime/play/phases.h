// phases.h: the phases of a step that are timed, of either kind of play.
#pragma once

#define PLIANT_PHASE_LIMIT 8

typedef enum pliant_play_kind {
    PLIANT_PLAY_GREENS,   // the statics of Green's functions
    PLIANT_PLAY_LATTICE,  // the dynamics of a lattice
} pliant_play_kind;

enum {
    PLIANT_PHASE_CAPACITANCE,  // assembling and factoring C
    PLIANT_PHASE_CONTACT,      // selective reconstruction and C^-1
    PLIANT_PHASE_SUMMATION,    // sparse sums
    PLIANT_PHASE_SURFACE,      // inverse transform of the surface
    PLIANT_PHASE_TOTAL,        // from the state to the surface, by the player's clock
    PLIANT_PHASE_COUNT,
};

enum {
    PLIANT_SCENE_PHASE_MATCH,      // forces, shape matching, damping
    PLIANT_SCENE_PHASE_OBSTACLES,  // contacts with obstacles
    PLIANT_SCENE_PHASE_SEARCH,     // finding which bodies touch
    PLIANT_SCENE_PHASE_CONTACTS,   // contacts among bodies
    PLIANT_SCENE_PHASE_MOTION,     // motion, holds, fracture
    PLIANT_SCENE_PHASE_SURFACE,    // the embedded surfaces, with normals
    PLIANT_SCENE_PHASE_TOTAL,
    PLIANT_SCENE_PHASE_COUNT,
};

int pliant_phase_count(pliant_play_kind kind);                    // the last one is the total
const char *pliant_phase_name(pliant_play_kind kind, int phase);  // static
