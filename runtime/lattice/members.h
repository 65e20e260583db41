// members.h: who is in a region, from the nodes that a file stores or regions.c has made, and what
// they weigh; for laying a lattice out.
#pragma once

#include "lattice/lattice.h"

// The window of a region and its members, as bits; those of a regular one (node NULL) are its
// window.
void pliant_members_find(const pliant_lattice *lattice, const pliant_regions *regions,
                         int32_t particle, const int32_t *node, pliant_reach *reach);
// How many particles of its window a region lacks.
int32_t pliant_members_lacking(const pliant_reach *reach, int32_t w);

// M_r and (c0_r - x0_r) / cell size of a region.
typedef struct pliant_region_moments {
    double mass, offset[3];
} pliant_region_moments;

// Sums of m~ and of x m~ over particles in order: a run of a row is a difference.
typedef struct pliant_prefix_sums {
    double *share, *moment;  // shape [particle_count + 1]
} pliant_prefix_sums;

pliant_region_moments pliant_members_weigh(const pliant_lattice *lattice, const pliant_reach *reach,
                                           int32_t particle, const pliant_prefix_sums *sums);
