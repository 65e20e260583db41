// plates.h: sums over bars and plates of particles, and the same way back to the particles.
//
// Forward (LSM-4..6, with the moments factored out): from m~ x to the sums over every plate of
//     S = sum of m~ x, X = sum of (x_i - x_plate) m~ x, Y = sum of (y_i - y_plate) m~ x,
// 9 numbers, with lattice coordinates relative to the plate's middle: what LSM-11 subtracts, M c
// c0, is small from the start. Back (the transpose): from what the plates of a slab hold,
//     p = place of the plate's middle, a and b = what a step along x and y adds,
// to the sum of goals of every particle, p + (x_i - x) a + (y_i - y) b over all plates that hold
// it.
//
// A slab is one worker's: forward it writes the slab's sites and plates, back the velocities of the
// slab's particles.
#pragma once

#include "lattice/body.h"

#define PLIANT_SITE_FLOATS (9 * PLIANT_LANES)

void pliant_plates_gather(pliant_body *body, int32_t z, pliant_scratch *scratch);
// v += (g - x) / h + h a for the particles of the slab (LSM-12, 1).
void pliant_plates_scatter(pliant_body *body, int32_t z, float h, pliant_scratch *scratch);
