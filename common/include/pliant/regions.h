// regions.h: the shape matching regions of a lattice, and how their sums are shared (LSM 2, 3.1).
//
// The sum over a region is made of bars along x, plates of bars along y, and planes of plates along
// z. Where a region is all particles of its (2w + 1)^3 window it takes the window's sums, shared by
// everybody: nothing is stored for it. An irregular region says plane by plane what it takes:
//
//     region node, 2w + 2 numbers: particle, then for the planes z - w .. z + w
//         -1: nothing, -2: all particles of the plane's window, k >= 0: plate node k
//     plate node, 2w + 4 numbers: x, y, z, then for the rows y - w .. y + w a mask
//         bit dx + w: the particle at x + dx is a member;
//         bit 31: the members are all particles of the row's window
//
// Equal restricted plates of one place are one node.
#pragma once

#include "pliant/links.h"

#define PLIANT_PLANE_NONE  (-1)
#define PLIANT_PLANE_WHOLE (-2)
#define PLIANT_ROW_WHOLE   ((uint32_t)1 << 31)

typedef struct pliant_regions {
    int32_t half_width;  // w
    int32_t particle_count;
    int32_t region_count;  // distinct ones
    int32_t *size;         // shape [particle_count], |R_i|
    int32_t *share;  // shape [particle_count], the least particle whose region is the same set
    int32_t region_node_count, plate_node_count;
    int32_t *region_nodes;  // shape [region_node_count][2w + 2], ascending by particle
    int32_t *plate_nodes;   // shape [plate_node_count][2w + 4]
} pliant_regions;

// Shape is only read during the call. PLIANT_ERR_ARGUMENT: half-width out of 1..15, or a shape
// that pliant_links_create refuses.
PLIANT_UNUSED_RESULT pliant_status pliant_regions_create(const pliant_lattice_shape *shape,
                                                         int32_t half_width,
                                                         pliant_regions **regions,
                                                         pliant_error *err);
void pliant_regions_destroy(pliant_regions *regions);  // NULL is fine

// What an irregular region takes of plane `plane` (0 .. 2w) of its window: PLIANT_PLANE_NONE,
// PLIANT_PLANE_WHOLE, or 0 and the rows' masks (shape [2w + 1]).
int32_t pliant_reach_plane(const pliant_reach *reach, int32_t w, int32_t plane, int32_t *masks);
