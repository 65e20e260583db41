// fits.h: the rigid motions that fit the velocities of regions best (LSM-13, 14), by fast
// summation.
//
// The same three ways as matching: slabs gather bars and plates, columns sum along z, fit, and hand
// back along z, slabs spread to the particles. All is of velocities beyond the motion of the whole.
#pragma once

#include "lattice/whole_motion.h"

// Of a particle, a bar, a plate, a region: sums of m~ times
//     v, x cross v, (yy + zz, xx + zz, xx + yy), (yz, xz, xy), x
enum {
    PLIANT_FIT_V = 0,
    PLIANT_FIT_SPIN = 3,
    PLIANT_FIT_SQUARE = 6,
    PLIANT_FIT_PRODUCT = 9,
    PLIANT_FIT_X = 12,
    PLIANT_FIT_COUNT = 15
};
// What a region hands back, the motion a + omega cross x.
enum { PLIANT_FIT_TURN_A = 0, PLIANT_FIT_TURN_OMEGA = 3, PLIANT_FIT_TURN_COUNT = 6 };

#define PLIANT_FIT_FLOATS (PLIANT_FIT_COUNT * PLIANT_LANES)

void pliant_fits_gather(pliant_body *body, const pliant_rigid_field *whole, int32_t z,
                        pliant_scratch *scratch);
void pliant_fits_match(pliant_body *body, int32_t column, pliant_scratch *scratch);
// v beyond the whole goes by k of the way to the mean over a particle's regions. What momenta are
// left are added up on the way, into the slab's sums of whole_motion.h.
void pliant_fits_spread(pliant_body *body, const pliant_rigid_field *whole, int32_t z, float k,
                        pliant_scratch *scratch);
