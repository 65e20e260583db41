// voxels.h: the cells of a grid that a closed surface touches, and those inside it.
//
// A cell is in when a triangle touches it, be it in one point of its boundary (triangle_box.h), and
// with PLIANT_VOXELS_SOLID also when the surface shuts it off from the outside: the outside is what
// can be reached from beyond the grid through faces of cells that no triangle touches. What a
// closed surface bounds is thereby in, and so are pockets whose way out is narrower than a cell. A
// component that bounds a cavity (mesh/components.h) is an outside of its own: the cavity is open.
#pragma once

#include "lattice/cell_set.h"
#include "lattice/voxel_grid.h"

typedef enum pliant_voxel_filling {
    PLIANT_VOXELS_SOLID,
    PLIANT_VOXELS_SHELL,  // touched cells only
} pliant_voxel_filling;

typedef struct pliant_voxels {
    pliant_voxel_grid grid;
    pliant_voxel_filling filling;
    int32_t cell_count;
    int32_t *cells;        // shape [cell_count][3], ascending by (z, y, x)
    pliant_cell_set *set;  // the same, numbered
} pliant_voxels;

// Voxelise a closed mesh (as pliant_mesh_check accepts them) on its grid of `cells` cells along the
// longest side. `name` is for messages. What needs more than `available` bytes (0: any number) is
// refused before it is allocated, with PLIANT_ERR_MEMORY and both numbers.
PLIANT_UNUSED_RESULT pliant_status pliant_voxels_create(const pliant_mesh *mesh, const char *name,
                                                        int32_t cells, pliant_voxel_filling filling,
                                                        double available, pliant_voxels **voxels,
                                                        pliant_error *err);
void pliant_voxels_destroy(pliant_voxels *voxels);  // NULL is fine
