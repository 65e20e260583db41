// voxel_grid.c: where the cubic cells of a lattice lie about a mesh.
#include "lattice/voxel_grid.h"

#include <math.h>

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
    pliant_voxel_grid grid = {.size = longest / cell_count};
    for (int d = 0; d < 3; d++) {
        const double cells = ceil((high[d] - low[d]) / grid.size - rounding);
        grid.dims[d] = cells < 1 ? 1 : cells > cell_count ? cell_count : (int32_t)cells;
        grid.origin[d] = (low[d] + high[d]) / 2 - grid.dims[d] * grid.size / 2;
    }
    return grid;
}
