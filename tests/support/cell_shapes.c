// cell_shapes.c: sets of lattice cells that try what voxel lattices do: thin parts, gaps, corners.
#include "cell_shapes.h"

#include <math.h>

const char *check_cell_shape_name(check_cells shape)
{
    static const char *const names[CHECK_CELLS_SHAPES] = {
        [CHECK_CELLS_SINGLE] = "single",   [CHECK_CELLS_CUBE] = "cube",
        [CHECK_CELLS_BALL] = "ball",       [CHECK_CELLS_SHELL] = "shell",
        [CHECK_CELLS_COMB] = "comb",       [CHECK_CELLS_TORUS] = "torus",
        [CHECK_CELLS_CHECKER] = "checker", [CHECK_CELLS_CORNERS] = "corners",
        [CHECK_CELLS_TWO] = "two",         [CHECK_CELLS_FOLDED] = "folded",
        [CHECK_CELLS_SPONGE] = "sponge",
    };
    return names[shape];
}

// The sphere of that radius about the middle of the cube has points inside and outside of the cell.
static int is_crossed(double radius, const double middle[3])
{
    double nearest = 0, farthest = 0;
    for (int k = 0; k < 3; k++) {
        const double d = fabs(middle[k]);
        nearest += fmax(d - 0.5, 0) * fmax(d - 0.5, 0);
        farthest += (d + 0.5) * (d + 0.5);
    }
    return nearest <= radius * radius && radius * radius <= farthest;
}

static int is_in_torus(int32_t size, const double middle[3], int32_t z)
{
    const double thickness = fmax(size / 6.0, 0.75), radius = size / 2.0 - thickness;
    const double off = hypot(middle[0], middle[1]) - radius, height = z + 0.5 - ceil(thickness);
    return off * off + height * height <= thickness * thickness;
}

// A hash of the cell's place: the sponge is the same on every machine.
static int is_in_sponge(int32_t x, int32_t y, int32_t z)
{
    uint32_t hash = (uint32_t)x * 73856093u ^ (uint32_t)y * 19349663u ^ (uint32_t)z * 83492791u;
    hash = (hash ^ hash >> 16) * 0x7feb352du;
    hash = (hash ^ hash >> 15) * 0x846ca68bu;
    return (hash ^ hash >> 16) & 1;
}

static int is_member(check_cells shape, int32_t size, int32_t x, int32_t y, int32_t z)
{
    const int in_cube = x < size && y < size && z < size;
    const double h = 0.5 * size, middle[3] = {x + 0.5 - h, y + 0.5 - h, z + 0.5 - h};
    switch (shape) {
    case CHECK_CELLS_SINGLE:
        return !x && !y && !z;
    case CHECK_CELLS_CUBE:
        return in_cube;
    case CHECK_CELLS_BALL:
        return middle[0] * middle[0] + middle[1] * middle[1] + middle[2] * middle[2] <= h * h;
    case CHECK_CELLS_SHELL:
        return in_cube && is_crossed(h - 0.5, middle);
    case CHECK_CELLS_COMB:
        return z < 2 && y < size && x < 2 * size - 1 && (y == 0 || x % 2 == 0);
    case CHECK_CELLS_TORUS:
        return is_in_torus(size, middle, z);
    case CHECK_CELLS_CHECKER:
        return in_cube && (x + y + z) % 2 == 0;
    case CHECK_CELLS_CORNERS:
        return in_cube && (x + y) % 2 == 0 && (y + z) % 2 == 0;
    case CHECK_CELLS_TWO:
        return x < 2 * size + 1 && x != size && y < size && z < size;
    case CHECK_CELLS_FOLDED:
        return x < size && y < size && z < 3 && (z != 1 || x == 0);
    case CHECK_CELLS_SPONGE:
        return in_cube && (is_in_sponge(x, y, z) || (!x && !y && !z));
    default:
        return 0;
    }
}

int32_t check_cell_shape(check_cells shape, int32_t size, int32_t *cells)
{
    const int32_t extent = 2 * size + 1;
    int32_t count = 0;
    for (int32_t z = 0; z < extent; z++)
        for (int32_t y = 0; y < extent; y++)
            for (int32_t x = 0; x < extent; x++) {
                if (!is_member(shape, size, x, y, z)) continue;
                if (cells) {
                    cells[3 * count] = x;
                    cells[3 * count + 1] = y;
                    cells[3 * count + 2] = z;
                }
                count++;
            }
    return count;
}
