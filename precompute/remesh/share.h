// share.h: which part of a surface each of many points on it stands for.
#pragma once

#include "remesh/surface.h"

typedef struct pliant_share {
    const pliant_surface *surface;
    double *areas;   // shape [vertices]: a third of the faces around
    int32_t *side;   // shape [vertices]: a half-edge of the surface that starts there
    int32_t *owner;  // shape [vertices]: the place to which a vertex belongs; -1 before
    // Its own: neighbours of every vertex, and the front of the search.
    int32_t *start, *neighbours;
    double *lengths, *distance;
    int32_t *heap, *slot, heap_count;
} pliant_share;

// `surface` is borrowed until destroy.
PLIANT_UNUSED_RESULT pliant_status pliant_share_create(const pliant_surface *surface,
                                                       pliant_share **share, pliant_error *err);
void pliant_share_destroy(pliant_share *share);  // NULL is fine

// Give every vertex of the surface to the place that is nearest along its edges. `x` has shape
// [count][3], the places' positions.
void pliant_share_out(pliant_share *share, const pliant_place *places, const double *x,
                      int32_t count);
