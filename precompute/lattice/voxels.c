// voxels.c: the cells of a grid that a closed surface touches, and those inside it.
//
// A triangle's own box of cells is halved as long as the triangle touches the half, down to single
// cells: work follows the cells that are touched, whether triangles are smaller than cells or
// larger by a thousand. The flood goes by rows of cells, 64 to a word.
#include "lattice/voxels.h"

#include "lattice/triangle_box.h"
#include "mesh/components.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

// The list of the cells, and what a lattice makes of it: corner numbers, measures, particles and
// regions at about one particle a cell.
static const double bytes_per_cell = 12 + 8 * 4 + 16 + 100;
// Sets of the grid's size: of this file (solid and shell), and of the links of common/links.h.
enum { SOLID_SETS = 4, SHELL_SETS = 1, LINK_SETS = 15 };

// ---- Touched cells ----

static void touch(const pliant_triangle_box *triangle, const int32_t first[3],
                  const int32_t last[3], pliant_cell_set *set)
{
    int widest = 0;
    for (int d = 1; d < 3; d++)
        if (last[d] - first[d] > last[widest] - first[widest]) widest = d;
    const int is_cell = last[widest] == first[widest];
    if (!pliant_triangle_box_overlaps(triangle, first, last, is_cell ? 1 : 2)) return;
    if (is_cell) {
        pliant_cell_set_insert(set, first[0], first[1], first[2]);
        return;
    }
    // 30 halvings at most: three axes of 1024 cells.
    int32_t middle[3];
    memcpy(middle, last, sizeof middle);
    middle[widest] = first[widest] + (last[widest] - first[widest]) / 2;
    touch(triangle, first, middle, set);
    memcpy(middle, first, sizeof middle);
    middle[widest] = first[widest] + (last[widest] - first[widest]) / 2 + 1;
    touch(triangle, middle, last, set);
}

// Every cell that a face of a component of that depth touches.
static void touch_depth(const pliant_mesh *mesh, const pliant_voxel_grid *grid,
                        const pliant_components *parts, int32_t depth, pliant_cell_set *set)
{
    for (int32_t f = 0; f < mesh->face_count; f++) {
        if (parts->depth[parts->of_vertex[mesh->faces[3 * (size_t)f]]] != depth) continue;
        double corners[3][3];
        pliant_voxel_grid_triangle(grid, mesh, f, corners);
        pliant_triangle_box triangle;
        pliant_triangle_box_prepare((const double(*)[3])corners, grid->dims, &triangle);
        touch(&triangle, triangle.first, triangle.last, set);
    }
}

// ---- Flood ----

// Rows that wait to be looked at: a ring that holds each of them once at most.
typedef struct row_queue {
    int32_t *rows, capacity, begin, count;
    uint8_t *waits;
} row_queue;

static void push(row_queue *q, int32_t row)
{
    if (q->waits[row]) return;
    q->waits[row] = 1;
    int32_t end = q->begin + q->count++;
    if (end >= q->capacity) end -= q->capacity;
    q->rows[end] = row;
}

static int32_t pop(row_queue *q)
{
    const int32_t row = q->rows[q->begin];
    if (++q->begin == q->capacity) q->begin = 0;
    q->count--;
    q->waits[row] = 0;
    return row;
}

// Spread the flood along a row, as far as it is free: towards higher x within each word by
// doubling strides, from word to word by a carry, then back.
static void spread(uint64_t *flood, const uint64_t *wall, const pliant_cell_set *set)
{
    uint64_t carry = 0;
    for (int32_t w = 0; w < set->word_count; w++) {
        uint64_t open = ~wall[w] & pliant_cell_set_mask(set, w);
        uint64_t wet = flood[w] | (open & carry);
        for (int stride = 1; stride < 64; stride *= 2) {
            wet |= open & (wet << stride);
            open &= open << stride;
        }
        flood[w] = wet;
        carry = wet >> 63;
    }
    carry = 0;
    for (int32_t w = set->word_count - 1; w >= 0; w--) {
        uint64_t open = ~wall[w] & pliant_cell_set_mask(set, w);
        uint64_t wet = flood[w] | (open & carry);
        for (int stride = 1; stride < 64; stride *= 2) {
            wet |= open & (wet >> stride);
            open &= open >> stride;
        }
        flood[w] = wet;
        carry = wet << 63;
    }
}

// Let the flood of row (y, z) into the row beside it, and have that looked at if it took any.
static void overflow(const pliant_cell_set *wall, pliant_cell_set *flood, int32_t y, int32_t z,
                     int32_t to_y, int32_t to_z, row_queue *queue)
{
    if (to_y < 0 || to_z < 0 || to_y >= wall->dims[1] || to_z >= wall->dims[2]) return;
    const uint64_t *from = pliant_cell_set_row(flood, y, z);
    const uint64_t *blocked = pliant_cell_set_row(wall, to_y, to_z);
    uint64_t *to = pliant_cell_set_row(flood, to_y, to_z), taken = 0;
    for (int32_t w = 0; w < wall->word_count; w++) {
        const uint64_t in = from[w] & ~blocked[w] & ~to[w];
        to[w] |= in;
        taken |= in;
    }
    if (taken) push(queue, to_z * wall->dims[1] + to_y);
}

// Fill `flood` (empty) with the cells that the outside reaches where there is no wall.
static pliant_status flood_outside(const pliant_cell_set *wall, pliant_cell_set *flood,
                                   pliant_error *err)
{
    const int32_t ny = wall->dims[1], nz = wall->dims[2], row_count = ny * nz;
    row_queue queue = {.capacity = row_count,
                       .rows = malloc((size_t)row_count * sizeof *queue.rows),
                       .waits = calloc((size_t)row_count, 1)};
    pliant_status status = PLIANT_OK;
    if (!queue.rows || !queue.waits) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to flood %d rows of cells",
                                  row_count);
        goto done;
    }
    // Outermost cells are open to the outside, the two ends of every row among them.
    for (int32_t z = 0; z < nz; z++)
        for (int32_t y = 0; y < ny; y++) {
            uint64_t *row = pliant_cell_set_row(flood, y, z);
            const uint64_t *blocked = pliant_cell_set_row(wall, y, z);
            const int is_outer = y == 0 || z == 0 || y == ny - 1 || z == nz - 1;
            if (is_outer)
                for (int32_t w = 0; w < wall->word_count; w++)
                    row[w] = pliant_cell_set_mask(wall, w);
            pliant_cell_set_insert(flood, 0, y, z);
            pliant_cell_set_insert(flood, wall->dims[0] - 1, y, z);
            for (int32_t w = 0; w < wall->word_count; w++) row[w] &= ~blocked[w];
            push(&queue, z * ny + y);
        }
    while (queue.count > 0) {
        const int32_t at = pop(&queue), y = at % ny, z = at / ny;
        spread(pliant_cell_set_row(flood, y, z), pliant_cell_set_row(wall, y, z), wall);
        overflow(wall, flood, y, z, y - 1, z, &queue);
        overflow(wall, flood, y, z, y + 1, z, &queue);
        overflow(wall, flood, y, z, y, z - 1, &queue);
        overflow(wall, flood, y, z, y, z + 1, &queue);
    }
done:
    free(queue.rows);
    free(queue.waits);
    return status;
}

// ---- Both ----

static void clear(pliant_cell_set *set)
{
    const size_t rows = (size_t)set->dims[1] * (size_t)set->dims[2];
    memset(set->bits, 0, rows * (size_t)set->word_count * sizeof *set->bits);
}

// touched |= wall; inside ^= not flooded.
static void combine(const pliant_cell_set *wall, const pliant_cell_set *flood,
                    pliant_cell_set *touched, pliant_cell_set *inside)
{
    for (int32_t z = 0; z < wall->dims[2]; z++)
        for (int32_t y = 0; y < wall->dims[1]; y++) {
            const size_t at = (size_t)(pliant_cell_set_row(wall, y, z) - wall->bits);
            for (int32_t w = 0; w < wall->word_count; w++) {
                touched->bits[at + (size_t)w] |= wall->bits[at + (size_t)w];
                inside->bits[at + (size_t)w] ^=
                    ~flood->bits[at + (size_t)w] & pliant_cell_set_mask(wall, w);
            }
        }
}

// Components by depth, bodies (even) and cavities (odd) in turns, each a wall of its own: an
// untouched cell is in when an odd number of walls shuts it off.
static pliant_status fill(const pliant_mesh *mesh, const pliant_components *parts,
                          pliant_voxels *voxels, pliant_error *err)
{
    const pliant_voxel_grid *grid = &voxels->grid;
    int32_t deepest = 0;
    for (int32_t i = 0; i < parts->count; i++)
        if (parts->depth[i] > deepest) deepest = parts->depth[i];
    if (voxels->filling == PLIANT_VOXELS_SHELL) {
        for (int32_t depth = 0; depth <= deepest; depth++)
            touch_depth(mesh, grid, parts, depth, voxels->set);
        return PLIANT_OK;
    }
    pliant_cell_set *wall = NULL, *flood = NULL, *inside = NULL;
    pliant_status status = pliant_cell_set_create(grid->dims, &wall, err);
    if (status == PLIANT_OK) status = pliant_cell_set_create(grid->dims, &flood, err);
    if (status == PLIANT_OK) status = pliant_cell_set_create(grid->dims, &inside, err);
    for (int32_t depth = 0; depth <= deepest && status == PLIANT_OK; depth++) {
        clear(wall);
        clear(flood);
        touch_depth(mesh, grid, parts, depth, wall);
        status = flood_outside(wall, flood, err);
        if (status == PLIANT_OK) combine(wall, flood, voxels->set, inside);
    }
    if (status == PLIANT_OK) {
        const size_t rows = (size_t)grid->dims[1] * (size_t)grid->dims[2];
        for (size_t w = 0; w < rows * (size_t)wall->word_count; w++)
            voxels->set->bits[w] |= inside->bits[w];
    }
    pliant_cell_set_destroy(inside);
    pliant_cell_set_destroy(flood);
    pliant_cell_set_destroy(wall);
    return status;
}

static pliant_status refuse_size(const char *name, const pliant_voxel_grid *grid, double cell_count,
                                 double needed, double available, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY,
                            "%s: %.4g cells of a grid of %d x %d x %d need %.3g GB of memory "
                            "(%.3g GB are available here): use fewer cells",
                            name, cell_count, grid->dims[0], grid->dims[1], grid->dims[2],
                            needed / 1e9, available / 1e9);
}

pliant_status pliant_voxels_create(const pliant_mesh *mesh, const char *name, int32_t cells,
                                   pliant_voxel_filling filling, double available,
                                   pliant_voxels **voxels, pliant_error *err)
{
    if (cells < 1 || cells > PLIANT_VOXEL_CELL_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected 1 to %d cells, found %d",
                                PLIANT_VOXEL_CELL_LIMIT, cells);
    const pliant_voxel_grid grid = pliant_voxel_grid_place(mesh, cells);
    const int sets = filling == PLIANT_VOXELS_SOLID ? SOLID_SETS : SHELL_SETS;
    const double set_bytes = pliant_cell_set_bytes(grid.dims);
    double needed = (sets + LINK_SETS) * set_bytes;
    const double whole = (double)grid.dims[0] * grid.dims[1] * grid.dims[2];
    if (available > 0 && needed > available)
        return refuse_size(name, &grid, whole, needed, available, err);

    pliant_components *parts = NULL;
    pliant_voxels *v = calloc(1, sizeof *v);
    if (!v) return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for cells", name);
    v->grid = grid;
    v->filling = filling;
    pliant_status status = pliant_components_create(mesh, name, &parts, err);
    if (status == PLIANT_OK) status = pliant_cell_set_create(grid.dims, &v->set, err);
    if (status == PLIANT_OK) status = fill(mesh, parts, v, err);
    if (status < 0) goto done;
    v->cell_count = pliant_cell_set_number(v->set);
    needed = v->cell_count * bytes_per_cell + LINK_SETS * set_bytes;
    if (v->cell_count > INT32_MAX / 8 || (available > 0 && needed > available)) {
        status = refuse_size(name, &grid, v->cell_count, needed, available, err);
        goto done;
    }
    v->cells = malloc(3 * (size_t)v->cell_count * sizeof *v->cells);
    if (!v->cells) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for %d cells", name,
                                  v->cell_count);
        goto done;
    }
    pliant_cell_set_list(v->set, v->cells);
done:
    pliant_components_destroy(parts);
    if (status < 0) pliant_voxels_destroy(v);
    else *voxels = v;
    return status;
}

void pliant_voxels_destroy(pliant_voxels *voxels)
{
    if (!voxels) return;
    pliant_cell_set_destroy(voxels->set);
    free(voxels->cells);
    free(voxels);
}
