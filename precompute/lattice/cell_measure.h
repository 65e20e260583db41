// cell_measure.h: how much of a solid, and of its surface, lies in each cell of a grid.
#pragma once

#include "lattice/voxels.h"

// Of every cell: the part of its volume that the mesh bounds, 0 to 1 but for rounding, and the area
// of the mesh in it in faces of a cell (size^2). Both have shape [voxels->cell_count]. The mesh is
// the one that was voxelised; the volumes of all cells, touched or inside, add up to the mesh's
// own.
PLIANT_UNUSED_RESULT pliant_status pliant_cell_measure(const pliant_mesh *mesh,
                                                       const pliant_voxels *voxels, double *volume,
                                                       double *area, pliant_error *err);
