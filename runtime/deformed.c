// deformed.c: places and normals of the deformed surface's touched vertices.
#include "deformed.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"
#include "vector.h"

#include <assert.h>
#include <math.h>
#include <string.h>

// A normal map's normal leans over by at most the angle of this cosine, 84 degrees: tilts beyond
// are walls, not bumps.
static const double least_cosine = 0.1;

void pliant_deformed_lay_out(pliant_arena *arena, const pliant_model *model,
                             pliant_deformed *deformed)
{
    const pliant_model_info info = pliant_model_describe(model);
    const size_t n = (size_t)info.vertex_count;
    deformed->model = model;
    deformed->vertex_count = info.vertex_count;
    deformed->face_count = info.face_count;
    deformed->rest = pliant_model_positions(model);
    deformed->faces = pliant_model_faces(model, info.level_count - 1);
    PLIANT_TAKE(arena, deformed->twin, 3 * (size_t)info.face_count);
    PLIANT_TAKE(arena, deformed->first, n);
    PLIANT_TAKE(arena, deformed->tilt, 2 * n);
    PLIANT_TAKE(arena, deformed->place_solution, n);
    PLIANT_TAKE(arena, deformed->place, 3 * n);
    PLIANT_TAKE(arena, deformed->normal_solution, n);
    PLIANT_TAKE(arena, deformed->normal, 3 * n);
    PLIANT_TAKE(arena, deformed->wanted, n);
    PLIANT_TAKE(arena, deformed->values, n);
}

// ---- Normals ----

// The next half-edge that starts where `h` does.
static int32_t around(const pliant_deformed *d, int32_t h)
{
    return d->twin[pliant_halfedge_previous(h)];
}

static int32_t end_of(const pliant_deformed *d, int32_t h)
{
    return d->faces[pliant_halfedge_next(h)];
}

// Twice the vector area of the faces around a vertex at `place` (shape [n][3]), as a unit vector; 0
// when they are folded up to nothing.
static int32_t find_mean(const pliant_deformed *d, const double *place, int32_t vertex,
                         double normal[3])
{
    const double *x = place + 3 * (size_t)vertex;
    normal[0] = normal[1] = normal[2] = 0;
    int32_t h = d->first[vertex];
    double edge[3], next[3], area[3];
    vector_subtract(place + 3 * (size_t)end_of(d, h), x, edge);
    double size = 0;
    do {
        h = around(d, h);
        vector_subtract(place + 3 * (size_t)end_of(d, h), x, next);
        vector_cross(edge, next, area);
        vector_add(1, area, normal);
        size += vector_length(area);
        memcpy(edge, next, sizeof edge);
    } while (h != d->first[vertex]);
    const double length = vector_length(normal);
    if (!(length > 1e-6 * size)) return 0;
    for (int c = 0; c < 3; c++) normal[c] /= length;
    return 1;
}

// The frame: the normal, the part of the first edge across it, and their cross product. 0: there is
// none.
static int32_t find_frame(const pliant_deformed *d, const double *place, int32_t vertex,
                          double frame[3][3])
{
    if (!find_mean(d, place, vertex, frame[0])) return 0;
    vector_subtract(place + 3 * (size_t)end_of(d, d->first[vertex]), place + 3 * (size_t)vertex,
                    frame[1]);
    const double edge_length = vector_length(frame[1]);
    vector_add(-vector_dot(frame[1], frame[0]), frame[0], frame[1]);
    const double length = vector_length(frame[1]);
    if (!(length > 1e-6 * edge_length)) return 0;
    for (int c = 0; c < 3; c++) frame[1][c] /= length;
    vector_cross(frame[0], frame[1], frame[2]);
    return 1;
}

static pliant_status tilt(pliant_deformed *d, const float *normals, pliant_error *err)
{
    for (int32_t v = 0; v < d->vertex_count; v++) {
        const float *n = normals + 3 * (size_t)v;
        const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
        double frame[3][3];
        if (!find_frame(d, d->rest, v, frame)) continue;
        const double along = vector_dot(normal, frame[0]);
        if (!(along > least_cosine * vector_length(normal)) || !isfinite(along))
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "pliant_proxy_def: normals: vertex %d: expected one within 84 "
                                    "degrees of the surface's, found (%g, %g, %g)",
                                    v, normal[0], normal[1], normal[2]);
        d->tilt[2 * (size_t)v] = vector_dot(normal, frame[1]) / along;
        d->tilt[2 * (size_t)v + 1] = vector_dot(normal, frame[2]) / along;
    }
    d->is_tilted = 1;
    return PLIANT_OK;
}

pliant_status pliant_deformed_fill(pliant_deformed *d, const float *normals, pliant_error *err)
{
    const pliant_status status =
        pliant_halfedge_match(d->vertex_count, d->face_count, d->faces, d->twin, err);
    if (status < 0) return status;
    // Downwards, so that it is the first in file order.
    for (int32_t h = 3 * d->face_count; h-- > 0;) d->first[d->faces[h]] = h;
    d->solution = 1;
    d->is_tilted = 0;
    return normals ? tilt(d, normals, err) : PLIANT_OK;
}

// ---- Evaluation ----

void pliant_deformed_begin(pliant_deformed *d)
{
    // Once in four thousand million solutions the numbers start again.
    if (++d->solution == 0) {
        memset(d->place_solution, 0, (size_t)d->vertex_count * sizeof *d->place_solution);
        memset(d->normal_solution, 0, (size_t)d->vertex_count * sizeof *d->normal_solution);
        d->solution = 1;
    }
    d->wanted_count = 0;
    d->evaluated_count = 0;
}

static void want(pliant_deformed *d, int32_t vertex)
{
    if (d->place_solution[vertex] == d->solution) return;
    d->place_solution[vertex] = d->solution;
    d->wanted[d->wanted_count++] = vertex;
}

void pliant_deformed_want_face(pliant_deformed *d, int32_t face)
{
    for (int k = 0; k < 3; k++) want(d, d->faces[3 * (size_t)face + k]);
}

void pliant_deformed_want_ring(pliant_deformed *d, int32_t face)
{
    pliant_deformed_want_face(d, face);
    for (int k = 0; k < 3; k++) {
        const int32_t begin = 3 * face + k;
        int32_t h = begin;
        do {
            want(d, end_of(d, h));
            h = around(d, h);
        } while (h != begin);
    }
}

void pliant_deformed_evaluate(pliant_deformed *d, pliant_solver *solver)
{
    if (d->wanted_count == 0) return;
    const pliant_status status =
        pliant_solver_displacements(solver, d->wanted, d->wanted_count, d->values);
    assert(status >= 0);
    (void)status;
    for (int32_t i = 0; i < d->wanted_count; i++) {
        const double *rest = d->rest + 3 * (size_t)d->wanted[i];
        double *place = d->place + 3 * (size_t)d->wanted[i];
        place[0] = rest[0] + (double)d->values[i].x;
        place[1] = rest[1] + (double)d->values[i].y;
        place[2] = rest[2] + (double)d->values[i].z;
    }
    d->evaluated_count += d->wanted_count;
    d->wanted_count = 0;
}

void pliant_deformed_corners(const pliant_deformed *d, int32_t face, double corners[3][3])
{
    for (int k = 0; k < 3; k++)
        memcpy(corners[k], d->place + 3 * (size_t)d->faces[3 * (size_t)face + k],
               3 * sizeof(double));
}

const double *pliant_deformed_normal(pliant_deformed *d, int32_t vertex)
{
    double *normal = d->normal + 3 * (size_t)vertex;
    if (d->normal_solution[vertex] == d->solution) return normal;
    d->normal_solution[vertex] = d->solution;
    double frame[3][3];
    const double *tilt = d->tilt + 2 * (size_t)vertex;
    if (d->is_tilted && find_frame(d, d->place, vertex, frame)) {
        memcpy(normal, frame[0], sizeof frame[0]);
        vector_add(tilt[0], frame[1], normal);
        vector_add(tilt[1], frame[2], normal);
        const double length = vector_length(normal);
        for (int c = 0; c < 3; c++) normal[c] /= length;
        return normal;
    }
    if (find_mean(d, d->place, vertex, normal)) return normal;
    // Crumpled to nothing around here: any direction is as good as the one at rest.
    if (!find_mean(d, d->rest, vertex, normal)) normal[2] = 1;
    return normal;
}
