// voxel_grid.c: where the cubic cells of a lattice lie about a mesh.
#include "lattice/voxel_grid.h"

#include <math.h>

// Part of the longest side that the grid stands out at each of its ends: above the rounding of
// positions (a mesh of size 1 at 10^9 from the origin still has 2e-7), far below what shows.
static const double margin = 1e-6;
// Parts of a cell that a side may exceed a whole number of cells by rounding.
static const double rounding = 1e-9;

pliant_voxel_grid pliant_voxel_grid_place(const pliant_mesh *mesh, int32_t cell_count)
{
    double low[3], high[3], longest = 0;
    for (int d = 0; d < 3; d++) {
        low[d] = INFINITY;
        high[d] = -INFINITY;
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            low[d] = fmin(low[d], mesh->vertices[3 * (size_t)v + d]);
            high[d] = fmax(high[d], mesh->vertices[3 * (size_t)v + d]);
        }
        longest = fmax(longest, high[d] - low[d]);
    }
    pliant_voxel_grid grid = {.size = longest * (1 + 2 * margin) / cell_count};
    for (int d = 0; d < 3; d++) {
        const double cells = ceil((high[d] - low[d]) * (1 + 2 * margin) / grid.size - rounding);
        grid.dims[d] = cells < 1 ? 1 : cells > cell_count ? cell_count : (int32_t)cells;
        grid.origin[d] = (low[d] + high[d]) / 2 - grid.dims[d] * grid.size / 2;
    }
    return grid;
}
