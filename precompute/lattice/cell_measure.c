// cell_measure.c: how much of a solid, and of its surface, lies in each cell of a grid.
//
// Faces are cut along the planes between cells, and the divergence theorem is used along x in each
// row of cells: behind a piece of surface the solid fills, or stops filling, the piece's shadow,
// and in the piece's own cell i as much of it as is between the piece and the cell's far side,
//     V_i = sum_{pieces p in cells j < i} A_p + sum_{pieces p in i} A_p (i + 1 - x_p),
//     A_p = -(area vector of p)_x,  x_p: x of its centroid
// in units of a cell. Exact but for rounding: nothing is sampled. Pieces are made by halving a
// face's box of cells and the polygon with it, as voxels.c does with the overlap test, so that work
// follows the cells that a face touches.
#include "lattice/cell_measure.h"

#include "lattice/triangle_box.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A triangle has nine corners when cut by six planes; rounding may leave some twice.
enum { CORNER_LIMIT = 16 };

typedef struct polygon {
    int count;
    double corners[CORNER_LIMIT][3];  // grid coordinates
} polygon;

typedef struct measure {
    const pliant_voxels *voxels;
    double *shadow;  // [cell_count]: sum of A_p
    double *volume, *area;
} measure;

// The part of `from` on one side of x_axis = at: below with side 1, above with side -1.
static void cut(const polygon *from, int axis, double at, double side, polygon *to)
{
    to->count = 0;
    for (int c = 0; c < from->count; c++) {
        const double *p = from->corners[c], *q = from->corners[(c + 1) % from->count];
        const double over_p = side * (p[axis] - at), over_q = side * (q[axis] - at);
        if (to->count + 2 > CORNER_LIMIT) return;
        if (over_p <= 0) memcpy(to->corners[to->count++], p, sizeof to->corners[0]);
        if (!((over_p < 0 && over_q > 0) || (over_p > 0 && over_q < 0))) continue;
        // From the lower end whichever side asks, so that both get the same point.
        const double *a = p[axis] < q[axis] ? p : q, *b = a == p ? q : p;
        const double part = (at - a[axis]) / (b[axis] - a[axis]);
        double *x = to->corners[to->count++];
        for (int d = 0; d < 3; d++) x[d] = a[d] + part * (b[d] - a[d]);
        x[axis] = at;
    }
}

static void add_piece(const measure *m, const int32_t cell[3], const polygon *piece)
{
    const int32_t i = pliant_cell_set_find(m->voxels->set, cell[0], cell[1], cell[2]);
    if (i < 0) return;  // the cell's neighbour is touched, this one only by rounding
    double seen = 0, moment = 0, vector[3] = {0};
    const double *o = piece->corners[0];
    for (int c = 1; c + 1 < piece->count; c++) {
        double e[3], f[3];
        for (int d = 0; d < 3; d++) {
            e[d] = piece->corners[c][d] - o[d];
            f[d] = piece->corners[c + 1][d] - o[d];
        }
        const double part = (e[1] * f[2] - e[2] * f[1]) / 2;
        seen += part;
        moment += part * (o[0] - cell[0] + (e[0] + f[0]) / 3);
        vector[1] += (e[2] * f[0] - e[0] * f[2]) / 2;
        vector[2] += (e[0] * f[1] - e[1] * f[0]) / 2;
    }
    vector[0] = seen;
    m->shadow[i] -= seen;
    m->volume[i] -= seen - moment;
    m->area[i] += sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
}

// What of a face lies in the cells first .. last.
static void walk(const measure *m, const polygon *piece, const int32_t first[3],
                 const int32_t last[3])
{
    if (piece->count < 3) return;
    int widest = 0;
    for (int d = 1; d < 3; d++)
        if (last[d] - first[d] > last[widest] - first[widest]) widest = d;
    if (last[widest] == first[widest]) {
        add_piece(m, first, piece);
        return;
    }
    int32_t middle[3];
    polygon half;
    const int32_t at = first[widest] + (last[widest] - first[widest]) / 2;
    memcpy(middle, last, sizeof middle);
    middle[widest] = at;
    cut(piece, widest, at + 1, 1, &half);
    walk(m, &half, first, middle);
    memcpy(middle, first, sizeof middle);
    middle[widest] = at + 1;
    cut(piece, widest, at + 1, -1, &half);
    // A face in the plane between is the lower side's.
    int is_above = 0;
    for (int c = 0; c < half.count; c++) is_above |= half.corners[c][widest] > at + 1;
    if (is_above) walk(m, &half, middle, last);
}

pliant_status pliant_cell_measure(const pliant_mesh *mesh, const pliant_voxels *voxels,
                                  double *volume, double *area, pliant_error *err)
{
    const int32_t count = voxels->cell_count;
    measure m = {voxels, calloc((size_t)count + 1, sizeof *m.shadow), volume, area};
    if (!m.shadow)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to measure %d cells", count);
    memset(volume, 0, (size_t)count * sizeof *volume);
    memset(area, 0, (size_t)count * sizeof *area);
    for (int32_t f = 0; f < mesh->face_count; f++) {
        polygon face = {.count = 3};
        pliant_voxel_grid_triangle(&voxels->grid, mesh, f, face.corners);
        pliant_triangle_box triangle;
        pliant_triangle_box_prepare((const double(*)[3])face.corners, voxels->grid.dims, &triangle);
        walk(&m, &face, triangle.first, triangle.last);
    }
    double behind = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t *cell = voxels->cells + 3 * (size_t)i;
        if (i > 0 && (cell[1] != cell[-2] || cell[2] != cell[-1])) behind = 0;
        volume[i] += behind;
        behind += m.shadow[i];
    }
    free(m.shadow);
    return PLIANT_OK;
}
