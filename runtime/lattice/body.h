// body.h: one instance of a lattice: where its particles are, how fast, and what they are turned
// by.
//
// A step is match (v += (g - x) / h + h a, LSM-1), damp, then move (x += h v, LSM-2). Between match
// and move whoever owns the body may change velocities; after move, positions. Arrays are in
// blocks, see lattice.h: x of a particle at [slot], y 8 further, z 16 further. Lanes without a
// particle stay 0.
#pragma once

#include "lattice/fracture.h"
#include "lattice/lattice.h"
#include "lattice/team.h"

// Coordinates and steps are kept within this many cells, so that nothing overflows on the way to
// the squares of the sums.
#define PLIANT_BODY_EXTENT 1e9f
// So are speeds and accelerations that are given, in cells per s and per s^2: damping multiplies
// them by the former.
#define PLIANT_BODY_SPEED 1e12f

// Nanoseconds of the last step, by phase; added up over threads' turns.
typedef struct pliant_body_times {
    int64_t plates;   // bars and plates (LSM-4..6)
    int64_t regions;  // sums along z, A_r, polar decomposition, T_r (LSM-7, 9, 11), back along z
    int64_t goals;    // back along y and x, goals (LSM-12), velocities (LSM-1)
    int64_t damping;  // LSM-13, 14
    int64_t move;     // LSM-2 and fracture
} pliant_body_times;

struct pliant_body {
    const pliant_lattice *lattice;
    float *x, *v;         // shape [block][3][8], m, m/s
    float *acceleration;  // shape [block][3][8], m/s^2, of forces for the next step
    float *quaternion;    // shape [turn][4][8]: R_r of the last match
    int32_t has_forces;   // 1: acceleration holds something
    pliant_vec3 gravity;
    float origin[3];  // near the middle: sums are taken about it, m
    int64_t step_count;

    float damping, rigid_damping, strain_limit;
    int32_t damping_interval;
    pliant_body_times times;

    // What of the lattice the body uses: the lattice's own, or what may break.
    const int32_t *particle_constants_of, *region_constants_of;
    const pliant_particle_constants *particle_constants;
    const pliant_region_constants *region_constants;
    const pliant_irregular *irregular;
    const uint8_t *is_listed;   // of exceptions
    pliant_fracture *fracture;  // owned; NULL: unbreakable

    // Scratch of a step.
    float *sites;       // shape [site][9][8]: sums over plates, then what comes back to them
    float *plate_sums;  // shape [plate][9]
    float *weighed;     // shape [exceptions + 1][4]: m~ (x - origin); the last is 0
    float *
        listed_turns;  // shape [exceptions + 1][4][4]: p, -a, -b, -c of T_r; 0 where parts are used
    // The same of damping.
    float *fit_sites;                // shape [site][15][8]
    float *fit_plates;               // shape [plate][15]
    float *listed_fits;              // shape [exceptions + 1][16]
    double *slab_sums;               // shape [dims z][16]
    struct pliant_scratch *scratch;  // shape [worker]
    int32_t worker_count;
    pliant_team *team;  // owned; NULL: the caller alone
    pliant_arena arena;
};

// What one worker needs.
typedef struct pliant_scratch {
    float *rows;          // padded rows of one slab
    float *bars;          // shape [row_blocks][dims y][6][8]
    float *goals;         // shape [most rows of a slab][3][row_blocks][8]
    float *tails;         // see window.h
    float *doubled;       // 4 padded rows
    float *turns;         // shape [longest column + 4w][12][8]: T_r of a column
    float *apart;         // shape [column_regions][12]: T_r of regions made of parts
    float *repairs;       // shape [longest column][16][8], see parts.h
    int32_t *repair_of;   // shape [longest column]: which, or -1
    const float **strip;  // rows of a window
    float *fit_rows;      // 15 padded rows
    float *fit_bars;      // shape [row_blocks][dims y][15][8]
} pliant_scratch;

// v += (g - x) / h + h (gravity + a); then damping.
void pliant_body_match(pliant_body *body, float h);
void pliant_body_move(pliant_body *body, float h);  // x += h v; then fracture

static inline pliant_vec3 pliant_body_get(const float *array, int32_t slot)
{
    return (pliant_vec3){array[slot], array[slot + PLIANT_LANES], array[slot + 2 * PLIANT_LANES]};
}

static inline void pliant_body_set(float *array, int32_t slot, pliant_vec3 value)
{
    array[slot] = value.x;
    array[slot + PLIANT_LANES] = value.y;
    array[slot + 2 * PLIANT_LANES] = value.z;
}
