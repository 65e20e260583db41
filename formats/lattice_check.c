// lattice_check.c: the checks of a lattice's contents at bind.
//
// No memory but a bit for each face: sorted lists are compared by merging, and where a particle is
// looked for by its coordinates, by bisection.
#include "lattice_check.h"

#include "pliant/error.h"
#include "pliant/regions.h"

#include <math.h>
#include <stdlib.h>

// How far stored tangents may be from orthonormal; floats keep 1e-7.
#define TANGENT_TOLERANCE 1e-3f

// On line, squares of lengths and their inverses are floats.
#define CELL_SIZE_LEAST 1e-9
#define CELL_SIZE_MOST  1e9

typedef struct check {
    const char *name;
    const pliant_model_view *view;
    int32_t dims[3];
} check;

static pliant_status refuse(const check *c, const char *section, int64_t element,
                            const char *expected, double found, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: /lattice/%s: element %lld: expected %s, found %g", c->name,
                            section, (long long)element, expected, found);
}

static pliant_status refuse_range(const check *c, const char *section, int64_t element, int64_t low,
                                  int64_t high, int64_t found, pliant_error *err)
{
    return pliant_error_set(
        err, PLIANT_ERR_FORMAT, "%s: /lattice/%s: element %lld: expected %lld to %lld, found %lld",
        c->name, section, (long long)element, (long long)low, (long long)high, (long long)found);
}

// ---- Frame and summary ----

static pliant_status check_frame(const check *c, pliant_error *err)
{
    const double *x = c->view->lattice_frame;
    for (int i = 0; i < PLIANT_LATTICE_FRAME_COUNT; i++)
        if (!isfinite(x[i])) return refuse(c, "frame", i, "a finite number", x[i], err);
    for (int i = PLIANT_LATTICE_CELL_SIZE; i <= PLIANT_LATTICE_MASS; i++)
        if (!(x[i] > 0)) return refuse(c, "frame", i, "a number above 0", x[i], err);
    if (x[PLIANT_LATTICE_CELL_SIZE] < CELL_SIZE_LEAST ||
        x[PLIANT_LATTICE_CELL_SIZE] > CELL_SIZE_MOST)
        return refuse(c, "frame", PLIANT_LATTICE_CELL_SIZE, "1e-9 to 1e9",
                      x[PLIANT_LATTICE_CELL_SIZE], err);
    // On line, positions are floats.
    for (int i = 0; i < 3; i++) {
        const double last = x[i] + PLIANT_LATTICE_DIM_LIMIT * x[PLIANT_LATTICE_CELL_SIZE];
        if (!isfinite((float)x[i]) || !isfinite((float)last))
            return refuse(c, "frame", i, "positions that a float holds", last, err);
    }
    return PLIANT_OK;
}

static pliant_status check_summary(const check *c, pliant_error *err)
{
    const int32_t *x = c->view->lattice_summary;
    const int32_t np = c->view->lattice_particle_count;
    const struct {
        int item, low, high;
    } ranges[] = {{PLIANT_LATTICE_IS_SHELL, 0, 1},
                  {PLIANT_LATTICE_COMPONENT_COUNT, 1, c->view->lattice_cell_count},
                  {PLIANT_LATTICE_REGION_COUNT, 1, np}};
    for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++)
        if (x[ranges[i].item] < ranges[i].low || x[ranges[i].item] > ranges[i].high)
            return refuse_range(c, "summary", ranges[i].item, ranges[i].low, ranges[i].high,
                                x[ranges[i].item], err);
    return PLIANT_OK;
}

// ---- Cells and particles ----

// One number that orders points as (z, y, x) does; coordinates are below 2^10.
static int32_t key_of(int32_t x, int32_t y, int32_t z)
{
    return z << 20 | y << 10 | x;
}

static int32_t key_at(const int32_t *points, int32_t i)
{
    const int32_t *p = points + 3 * (size_t)i;
    return key_of(p[0], p[1], p[2]);
}

// Coordinates 0 .. limit - 1, strictly ascending; dims = largest coordinates + 1.
static pliant_status check_points(const check *c, const char *section, const int32_t *points,
                                  int32_t count, int32_t limit, int32_t dims[3], pliant_error *err)
{
    int32_t last = -1;
    dims[0] = dims[1] = dims[2] = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t *p = points + 3 * (size_t)i;
        for (int d = 0; d < 3; d++) {
            if (p[d] < 0 || p[d] >= limit)
                return refuse_range(c, section, 3 * (int64_t)i + d, 0, limit - 1, p[d], err);
            if (p[d] >= dims[d]) dims[d] = p[d] + 1;
        }
        const int32_t key = key_of(p[0], p[1], p[2]);
        if (key <= last)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /lattice/%s: row %d: expected to come after row %d by "
                                    "(z, y, x), found (%d, %d, %d)",
                                    c->name, section, (int)i, (int)i - 1, (int)p[0], (int)p[1],
                                    (int)p[2]);
        last = key;
    }
    return PLIANT_OK;
}

// The particles are the corners of the cells. Those of one kind (one of eight), cell by cell, are
// in the particles' order: eight lists are merged with the particles.
static pliant_status check_corners(const check *c, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    const int32_t nc = v->lattice_cell_count;
    int32_t at[8] = {0};
    for (int32_t p = 0; p < v->lattice_particle_count; p++) {
        const int32_t *x = v->lattice_particles + 3 * (size_t)p;
        const int32_t key = key_of(x[0], x[1], x[2]);
        int is_corner = 0;
        for (int k = 0; k < 8; k++) {
            if (at[k] == nc) continue;
            const int32_t corner =
                key_at(v->lattice_cells, at[k]) + key_of(k & 1, k >> 1 & 1, k >> 2);
            if (corner < key)
                return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                        "%s: /lattice/particles: row %d: expected corner %d of "
                                        "cell %d before it, found none",
                                        c->name, (int)p, k, (int)at[k]);
            if (corner > key) continue;
            is_corner = 1;
            at[k]++;
        }
        if (!is_corner)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /lattice/particles: row %d: expected a corner of a cell, "
                                    "found (%d, %d, %d)",
                                    c->name, (int)p, (int)x[0], (int)x[1], (int)x[2]);
    }
    for (int k = 0; k < 8; k++)
        if (at[k] < nc)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /lattice/particles: expected corner %d of cell %d, found "
                                    "none",
                                    c->name, k, (int)at[k]);
    return PLIANT_OK;
}

static pliant_status check_shape(check *c, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    int32_t cell_dims[3];
    pliant_status status = check_points(c, "cells", v->lattice_cells, v->lattice_cell_count,
                                        PLIANT_LATTICE_DIM_LIMIT - 1, cell_dims, err);
    if (status == PLIANT_OK)
        status = check_points(c, "particles", v->lattice_particles, v->lattice_particle_count,
                              PLIANT_LATTICE_DIM_LIMIT, c->dims, err);
    if (status == PLIANT_OK) status = check_corners(c, err);
    for (int32_t p = 0; status == PLIANT_OK && p < v->lattice_particle_count; p++)
        if (!(v->lattice_mass[p] > 0) || !isfinite(v->lattice_mass[p]))
            status =
                refuse(c, "mass", p, "a finite number above 0", (double)v->lattice_mass[p], err);
    return status;
}

// ---- Regions ----

// The first particle whose key is not below `key`, or np.
static int32_t lower_bound(const pliant_model_view *v, int32_t key)
{
    int32_t low = 0, high = v->lattice_particle_count;
    while (low < high) {
        const int32_t middle = low + (high - low) / 2;
        if (key_at(v->lattice_particles, middle) < key) low = middle + 1;
        else high = middle;
    }
    return low;
}

// Every particle names the least one with its region; they have one size.
static pliant_status check_sharing(const check *c, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    const int32_t *size = v->lattice_region_size, *share = v->lattice_region_share;
    const int32_t np = v->lattice_particle_count;
    int32_t count = 0;
    for (int32_t p = 0; p < np; p++) {
        if (size[p] < 1 || size[p] > np)
            return refuse_range(c, "region_size", p, 1, np, size[p], err);
        if (share[p] < 0 || share[p] > p)
            return refuse_range(c, "region_share", p, 0, p, share[p], err);
        if (share[share[p]] != share[p])
            return refuse(c, "region_share", p, "a particle that shares with itself", share[p],
                          err);
        if (size[share[p]] != size[p])
            return refuse_range(c, "region_size", p, size[share[p]], size[share[p]], size[p], err);
        count += share[p] == p;
    }
    const int32_t stated = v->lattice_summary[PLIANT_LATTICE_REGION_COUNT];
    if (count != stated)
        return refuse_range(c, "summary", PLIANT_LATTICE_REGION_COUNT, count, count, stated, err);
    return PLIANT_OK;
}

// The particles that a row's mask names are there; all of them, if it says so.
static pliant_status check_mask(const check *c, const int32_t *node, int32_t d, int64_t element,
                                pliant_error *err)
{
    const pliant_model_view *v = c->view;
    const int32_t w = v->lattice_half_width, y = node[1] + d;
    const uint32_t mask = (uint32_t)node[3 + w + d];
    const uint32_t members = mask & ~PLIANT_ROW_WHOLE, window = ((uint32_t)1 << (2 * w + 1)) - 1;
    if (mask == 0) return PLIANT_OK;
    if (members & ~window)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: /lattice/plate_nodes: element %lld: expected bits 0 to %d and "
                                "31, found %#x",
                                c->name, (long long)element, 2 * (int)w, (unsigned)mask);
    uint32_t there = 0;
    if (y >= 0 && y < c->dims[1]) {
        const int32_t first = node[0] < w ? 0 : node[0] - w;
        const int32_t end = key_of(node[0], y, node[2]) + w;  // x + w may reach into the next row
        for (int32_t p = lower_bound(v, key_of(first, y, node[2])); p < v->lattice_particle_count;
             p++) {
            const int32_t *x = v->lattice_particles + 3 * (size_t)p;
            if (key_of(x[0], x[1], x[2]) > end || x[1] != y || x[2] != node[2]) break;
            there |= 1u << (x[0] - node[0] + w);
        }
    }
    const int is_whole = (mask & PLIANT_ROW_WHOLE) != 0;
    if (members != 0 && (is_whole ? members == there : (members & ~there) == 0)) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: /lattice/plate_nodes: element %lld: expected %s of %#x, found %#x",
                            c->name, (long long)element, is_whole ? "all" : "some", (unsigned)there,
                            (unsigned)mask);
}

static pliant_status check_plates(const check *c, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    const int32_t w = v->lattice_half_width, length = 2 * w + 4;
    pliant_status status = PLIANT_OK;
    for (int32_t k = 0; status == PLIANT_OK && k < v->lattice_plate_node_count; k++) {
        const int32_t *node = v->lattice_plate_nodes + (size_t)length * (size_t)k;
        const int64_t element = (int64_t)length * k;
        for (int i = 0; i < 3; i++)
            if (node[i] < 0 || node[i] >= c->dims[i])
                return refuse_range(c, "plate_nodes", element + i, 0, c->dims[i] - 1, node[i], err);
        for (int32_t d = -w; status == PLIANT_OK && d <= w; d++)
            status = check_mask(c, node, d, element + 3 + w + d, err);
    }
    return status;
}

// A plane of a region at a particle: -1, none; -2, all of the window; else a plate node there.
static pliant_status check_code(const check *c, const int32_t *particle, int32_t d, int32_t code,
                                int64_t element, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    const int32_t z = particle[2] + d, nl = v->lattice_plate_node_count;
    const int is_plane = z >= 0 && z < c->dims[2];
    if (code == PLIANT_PLANE_NONE || (code == PLIANT_PLANE_WHOLE && is_plane)) return PLIANT_OK;
    if (code < 0 || code >= nl || !is_plane)
        return refuse_range(c, "region_nodes", element,
                            is_plane ? PLIANT_PLANE_WHOLE : PLIANT_PLANE_NONE,
                            is_plane ? nl - 1 : PLIANT_PLANE_NONE, code, err);
    const int32_t *plate =
        v->lattice_plate_nodes + (size_t)(2 * v->lattice_half_width + 4) * (size_t)code;
    if (plate[0] == particle[0] && plate[1] == particle[1] && plate[2] == z) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: /lattice/region_nodes: element %lld: expected a plate node at "
                            "(%d, %d, %d), found node "
                            "%d at (%d, %d, %d)",
                            c->name, (long long)element, (int)particle[0], (int)particle[1], (int)z,
                            (int)code, (int)plate[0], (int)plate[1], (int)plate[2]);
}

static pliant_status check_regions(const check *c, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    const int32_t w = v->lattice_half_width, length = 2 * w + 2;
    int32_t least = 0;
    for (int32_t r = 0; r < v->lattice_region_node_count; r++) {
        const int32_t *node = v->lattice_region_nodes + (size_t)length * (size_t)r;
        const int64_t element = (int64_t)length * r;
        if (node[0] < least || node[0] >= v->lattice_particle_count)
            return refuse_range(c, "region_nodes", element, least, v->lattice_particle_count - 1,
                                node[0], err);
        least = node[0] + 1;
        const int32_t *particle = v->lattice_particles + 3 * (size_t)node[0];
        for (int32_t d = -w; d <= w; d++) {
            const int32_t i = 1 + w + d;
            const pliant_status status = check_code(c, particle, d, node[i], element + i, err);
            if (status < 0) return status;
        }
    }
    return PLIANT_OK;
}

// ---- The embedded surface ----

static int is_orthonormal(const float t[6])
{
    const float uu = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
    const float vv = t[3] * t[3] + t[4] * t[4] + t[5] * t[5];
    const float uv = t[0] * t[3] + t[1] * t[4] + t[2] * t[5];
    return fabsf(uu - 1) <= TANGENT_TOLERANCE && fabsf(vv - 1) <= TANGENT_TOLERANCE &&
           fabsf(uv) <= TANGENT_TOLERANCE;
}

static pliant_status check_vertices(const check *c, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    for (int32_t i = 0; i < v->vertex_count; i++) {
        const int32_t cell = v->lattice_vertex_cell[i];
        if (cell < 0 || cell >= v->lattice_cell_count)
            return refuse_range(c, "vertex_cell", i, 0, v->lattice_cell_count - 1, cell, err);
        for (int d = 0; d < 3; d++) {
            const float offset = v->lattice_vertex_offset[3 * (size_t)i + (size_t)d];
            if (!(offset >= 0 && offset <= 1))
                return refuse(c, "vertex_offset", 3 * (int64_t)i + d, "0 to 1", (double)offset,
                              err);
        }
        const float *t = v->lattice_vertex_tangents + 6 * (size_t)i;
        if (!is_orthonormal(t))
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /lattice/vertex_tangents: vertex %d: expected two unit "
                                    "vectors at a right angle, found (%g, %g, %g), (%g, %g, %g)",
                                    c->name, (int)i, (double)t[0], (double)t[1], (double)t[2],
                                    (double)t[3], (double)t[4], (double)t[5]);
    }
    return PLIANT_OK;
}

// From 0 to `total`, never falling, at most `step` at a time.
static pliant_status check_offsets(const check *c, const char *section, const int32_t *offset,
                                   int32_t count, int32_t total, int32_t step, pliant_error *err)
{
    int64_t low = 0, high = 0;
    for (int32_t i = 0; i <= count; i++) {
        if (i == count) low = total > low ? total : low;
        if (offset[i] < low || offset[i] > high)
            return refuse_range(c, section, i, low, high, offset[i], err);
        low = offset[i];
        high = low + step > total ? total : low + step;
    }
    return PLIANT_OK;
}

// Every face is in one batch.
static pliant_status check_batch_faces(const check *c, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    const int32_t nf = v->face_count;
    pliant_status status = PLIANT_OK;
    unsigned char *seen = calloc(((size_t)nf + 7) / 8, 1);
    if (!seen)
        return pliant_error_set(err, PLIANT_ERR_MEMORY,
                                "%s: /lattice/batch_faces: no memory for %d faces", c->name,
                                (int)nf);
    for (int32_t i = 0; status == PLIANT_OK && i < nf; i++) {
        const int32_t face = v->lattice_batch_faces[i];
        if (face < 0 || face >= nf) {
            status = refuse_range(c, "batch_faces", i, 0, nf - 1, face, err);
        } else if (seen[face / 8] >> face % 8 & 1) {
            status = refuse(c, "batch_faces", i, "a face that is not in a batch yet", face, err);
        } else {
            seen[face / 8] |= (unsigned char)(1u << face % 8);
        }
    }
    free(seen);
    return status;
}

static pliant_status check_batches(const check *c, pliant_error *err)
{
    const pliant_model_view *v = c->view;
    const int32_t *offset = v->lattice_batch_point_offset, nb = v->lattice_batch_count;
    pliant_status status = check_offsets(c, "batch_face_offset", v->lattice_batch_face_offset, nb,
                                         v->face_count, v->face_count, err);
    if (status == PLIANT_OK) status = check_batch_faces(c, err);
    if (status == PLIANT_OK)
        status = check_offsets(c, "batch_point_offset", offset, nb, v->lattice_batch_point_count,
                               PLIANT_BATCH_LIMIT, err);
    for (int32_t b = 0; status == PLIANT_OK && b < nb; b++) {
        int32_t least = 0;
        for (int32_t i = offset[b]; i < offset[b + 1]; i++) {
            const int32_t point = v->lattice_batch_points[i];
            if (point < least || point >= v->lattice_particle_count)
                return refuse_range(c, "batch_points", i, least, v->lattice_particle_count - 1,
                                    point, err);
            least = point + 1;
        }
    }
    return status;
}

pliant_status pliant_lattice_check(const char *name, const pliant_model_view *view, int32_t dims[3],
                                   pliant_error *err)
{
    check c = {.name = name, .view = view};
    pliant_status status = check_frame(&c, err);
    if (status == PLIANT_OK) status = check_summary(&c, err);
    if (status == PLIANT_OK) status = check_shape(&c, err);
    if (status == PLIANT_OK) status = check_sharing(&c, err);
    if (status == PLIANT_OK) status = check_plates(&c, err);
    if (status == PLIANT_OK) status = check_regions(&c, err);
    if (status == PLIANT_OK) status = check_vertices(&c, err);
    if (status == PLIANT_OK) status = check_batches(&c, err);
    for (int d = 0; status == PLIANT_OK && d < 3; d++) dims[d] = c.dims[d];
    return status;
}
