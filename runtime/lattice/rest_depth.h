// rest_depth.h: how far a lattice's particles are from its surface at rest.
//
// Between particles depths are interpolated as positions are, so that a place in a deformed cell
// has a depth and a way out: those of the place at rest that it comes from.
#pragma once

#include "lattice/lattice.h"

// depth[particle_count], m: signed distance from the embedded surface, below 0 inside; of a lattice
// without a model from its outermost particles. `corners` has shape [cell_count][8]. Distances
// beyond two cells are approximate, by steps along links.
void pliant_rest_depth_find(const pliant_lattice *lattice, const int32_t *corners, float *depth);
