// surface.c: points that live on a triangle mesh, and how they move along it.
#include "remesh/surface.h"

#include "remesh/vector.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"

#include <stdlib.h>

// A walk that has crossed so many edges goes round a vertex for rounding: it ends where it is.
enum { CROSSING_LIMIT = 256 };

static const double *corner(const pliant_mesh *mesh, int32_t face, int k)
{
    return mesh->vertices + 3 * (size_t)mesh->faces[3 * (size_t)face + k];
}

// Thuermer and Wuethrich: a vertex's normal does not depend on how its faces are split.
static void sum_normals(const pliant_mesh *mesh, double *normals)
{
    for (int32_t f = 0; f < mesh->face_count; f++) {
        double n[3];
        pliant_face_normal(corner(mesh, f, 0), corner(mesh, f, 1), corner(mesh, f, 2), n);
        pliant_normalize(n);
        for (int k = 0; k < 3; k++) {
            double a[3], b[3], c[3];
            pliant_subtract(corner(mesh, f, (k + 1) % 3), corner(mesh, f, k), a);
            pliant_subtract(corner(mesh, f, (k + 2) % 3), corner(mesh, f, k), b);
            pliant_cross(a, b, c);
            const double angle = atan2(pliant_length(c), pliant_dot(a, b));
            double *sum = normals + 3 * (size_t)mesh->faces[3 * (size_t)f + k];
            for (int i = 0; i < 3; i++) sum[i] += angle * n[i];
        }
    }
    for (int32_t v = 0; v < mesh->vertex_count; v++) pliant_normalize(normals + 3 * (size_t)v);
}

pliant_status pliant_surface_create(const pliant_mesh *mesh, pliant_surface **surface,
                                    pliant_error *err)
{
    pliant_surface *s = calloc(1, sizeof *s);
    if (s) {
        s->mesh = mesh;
        s->twin = malloc(3 * (size_t)mesh->face_count * sizeof *s->twin);
        s->normals = calloc(3 * (size_t)mesh->vertex_count, sizeof *s->normals);
    }
    if (!s || !s->twin || !s->normals) {
        pliant_surface_destroy(s);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a surface of %d faces",
                                mesh->face_count);
    }
    const pliant_status status =
        pliant_halfedge_match(mesh->vertex_count, mesh->face_count, mesh->faces, s->twin, err);
    if (status < 0) {
        pliant_surface_destroy(s);
        return status;
    }
    sum_normals(mesh, s->normals);
    *surface = s;
    return PLIANT_OK;
}

void pliant_surface_destroy(pliant_surface *surface)
{
    if (!surface) return;
    free(surface->normals);
    free(surface->twin);
    free(surface);
}

void pliant_surface_position(const pliant_surface *surface, const pliant_place *place, double x[3])
{
    const double *p[3];
    for (int k = 0; k < 3; k++) p[k] = corner(surface->mesh, place->face, k);
    for (int i = 0; i < 3; i++)
        x[i] = place->weight[0] * p[0][i] + place->weight[1] * p[1][i] + place->weight[2] * p[2][i];
}

void pliant_surface_normal(const pliant_surface *surface, const pliant_place *place, double n[3])
{
    for (int i = 0; i < 3; i++) n[i] = 0;
    for (int k = 0; k < 3; k++) {
        const int32_t v = surface->mesh->faces[3 * (size_t)place->face + k];
        for (int i = 0; i < 3; i++) n[i] += place->weight[k] * surface->normals[3 * (size_t)v + i];
    }
    pliant_normalize(n);
}

pliant_place pliant_surface_walk(const pliant_surface *surface, const pliant_place *from,
                                 const double d[3])
{
    const pliant_mesh *mesh = surface->mesh;
    pliant_place at = *from;
    double left[3] = {d[0], d[1], d[2]};
    for (int crossing = 0; crossing < CROSSING_LIMIT; crossing++) {
        const double *p[3];
        for (int k = 0; k < 3; k++) p[k] = corner(mesh, at.face, k);
        double n[3];
        pliant_face_normal(p[0], p[1], p[2], n);
        const double nn = pliant_dot(n, n);
        if (!(nn > 0)) break;
        // The weight of corner k grows by left . grad, grad = n x (opposite side) / |n|^2.
        double rate[3], first = 1;
        int side = -1;
        for (int k = 0; k < 3; k++) {
            double opposite[3], grad[3];
            pliant_subtract(p[(k + 2) % 3], p[(k + 1) % 3], opposite);
            pliant_cross(n, opposite, grad);
            rate[k] = pliant_dot(left, grad) / nn;
            if (!(rate[k] < 0)) continue;
            const double t = at.weight[k] / -rate[k];
            if (t < first) {
                first = t;
                side = k;
            }
        }
        double sum = 0;
        for (int k = 0; k < 3; k++) {
            at.weight[k] = fmax(at.weight[k] + first * rate[k], 0);
            if (k == side) at.weight[k] = 0;
            sum += at.weight[k];
        }
        for (int k = 0; k < 3; k++) at.weight[k] /= sum;
        if (side < 0) break;

        // Unfold: what ran along the edge still does, what ran across runs across in the next face.
        const int32_t h = 3 * at.face + (side + 1) % 3, twin = surface->twin[h];
        double edge[3], across[3], next_normal[3];
        pliant_subtract(p[(side + 2) % 3], p[(side + 1) % 3], edge);
        pliant_normalize(edge);
        pliant_normalize(n);
        pliant_cross(edge, n, across);
        const double along_part = pliant_dot(left, edge), across_part = pliant_dot(left, across);
        const int32_t next = twin / 3;
        pliant_face_normal(corner(mesh, next, 0), corner(mesh, next, 1), corner(mesh, next, 2),
                           next_normal);
        pliant_normalize(next_normal);
        double inward[3];
        pliant_cross(edge, next_normal, inward);
        for (int i = 0; i < 3; i++)
            left[i] = (1 - first) * (along_part * edge[i] + across_part * inward[i]);
        const int j = (int)(twin % 3);
        pliant_place then = {.face = next};
        then.weight[j] = at.weight[(side + 2) % 3];
        then.weight[(j + 1) % 3] = at.weight[(side + 1) % 3];
        at = then;
    }
    return at;
}

double pliant_surface_diagonal(const pliant_mesh *mesh)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        for (int i = 0; i < 3; i++) {
            low[i] = fmin(low[i], mesh->vertices[3 * (size_t)v + i]);
            high[i] = fmax(high[i], mesh->vertices[3 * (size_t)v + i]);
        }
    return sqrt(pliant_squared_distance(low, high));
}
