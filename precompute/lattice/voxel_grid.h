// voxel_grid.h: where the cubic cells of a lattice lie about a mesh.
#pragma once

#include "pliant/mesh.h"

#include <stddef.h>

// Particles are numbered 0 .. 1023 on each axis, so cells end at 1022.
enum { PLIANT_VOXEL_CELL_LIMIT = 1023 };

typedef struct pliant_voxel_grid {
    double origin[3];  // least corner of cell (0, 0, 0), m
    double size;       // edge of a cell, m
    int32_t dims[3];   // cells along x, y, z
} pliant_voxel_grid;

// A grid centred on the mesh's bounding box: `cell_count` (1 .. PLIANT_VOXEL_CELL_LIMIT) cells
// along its longest side, as many as it takes along the others, at least one. There is no margin:
// what touches the grid's own boundary, or stands out of it by rounding, is in the outermost cells,
// since there are no others.
pliant_voxel_grid pliant_voxel_grid_place(const pliant_mesh *mesh, int32_t cell_count);

// Grid coordinates of a position: (x - origin) / size. Everything that goes from positions to cells
// does it by this, so that all agree to the last bit.
static inline void pliant_voxel_grid_locate(const pliant_voxel_grid *grid, const double position[3],
                                            double coordinates[3])
{
    for (int d = 0; d < 3; d++) coordinates[d] = (position[d] - grid->origin[d]) / grid->size;
}

// The corners of a face in grid coordinates.
static inline void pliant_voxel_grid_triangle(const pliant_voxel_grid *grid,
                                              const pliant_mesh *mesh, int32_t face,
                                              double corners[3][3])
{
    for (int c = 0; c < 3; c++)
        pliant_voxel_grid_locate(
            grid, mesh->vertices + 3 * (size_t)mesh->faces[3 * (size_t)face + c], corners[c]);
}
