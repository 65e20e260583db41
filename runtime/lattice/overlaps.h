// overlaps.h: which bodies' boxes meet (sort and sweep).
#pragma once

#include "lattice/crowd.h"

#define PLIANT_OVERLAP_LIMIT 48  // others that one body's box meets; beyond that it meets all

typedef struct pliant_overlaps {
    int32_t *order;   // shape [member_capacity]: members by least x, then number
    int32_t *count;   // shape [member_capacity]; above PLIANT_OVERLAP_LIMIT: others too
    int32_t *others;  // shape [member_capacity][PLIANT_OVERLAP_LIMIT]
    int32_t any;      // members that meet somebody
} pliant_overlaps;

// Twice, as arena.h says: to measure and to carve.
void pliant_overlaps_lay_out(pliant_overlaps *overlaps, pliant_arena *arena,
                             int32_t member_capacity);
// Boxes as measured, each enlarged by `margin` m to all sides.
void pliant_overlaps_find(pliant_overlaps *overlaps, const pliant_crowd *crowd, float margin);
// 1: x lies in the enlarged box of some other that the member meets.
int32_t pliant_overlaps_has(const pliant_overlaps *overlaps, const pliant_crowd *crowd,
                            int32_t member, const float *x, float margin);
