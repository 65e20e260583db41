// fit.c: how well one mesh stands for another.
#include "remesh/fit.h"

#include "remesh/vector.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"

#include <stdlib.h>

// Samples stand closer than this share of the diagonal, but no face has more than so many a side.
static const double sample_spacing = 1. / 200;
enum { SIDE_LIMIT = 64 };

static const double *corner(const pliant_mesh *mesh, int32_t face, int k)
{
    return mesh->vertices + 3 * (size_t)mesh->faces[3 * (size_t)face + k];
}

// The largest squared distance of samples of `from` to the mesh of `tree`.
static double farthest(const pliant_mesh *from, const pliant_face_tree *tree, double spacing)
{
    double largest = 0;
    for (int32_t f = 0; f < from->face_count; f++) {
        const double *p[3];
        double side = 0;
        for (int k = 0; k < 3; k++) p[k] = corner(from, f, k);
        for (int k = 0; k < 3; k++)
            side = fmax(side, sqrt(pliant_squared_distance(p[k], p[(k + 1) % 3])));
        const double wanted = ceil(side / spacing);
        const int steps = wanted < 2 ? 2 : wanted > SIDE_LIMIT ? SIDE_LIMIT : (int)wanted;
        for (int i = 0; i <= steps; i++)
            for (int j = 0; i + j <= steps + 1; j++) {
                // One more than the grid: the centre.
                double w[3] = {(double)i / steps, (double)j / steps, 0};
                if (i + j > steps) {
                    if (i > 0) continue;
                    w[0] = w[1] = 1. / 3;
                }
                w[2] = 1 - w[0] - w[1];
                double x[3], squared;
                for (int k = 0; k < 3; k++) x[k] = w[0] * p[0][k] + w[1] * p[1][k] + w[2] * p[2][k];
                (void)pliant_face_tree_closest(tree, x, &squared);
                largest = fmax(largest, squared);
            }
    }
    return largest;
}

static double angle_between(const double *a, const double *b)
{
    double c[3];
    pliant_cross(a, b, c);
    return atan2(pliant_length(c), pliant_dot(a, b)) * 180 / acos(-1.0);
}

// Angles in faces, between neighbours, and against the original.
static void measure_angles(const pliant_surface *original, const pliant_face_tree *tree,
                           const pliant_mesh *mesh, const int32_t *twin, pliant_fit *fit)
{
    fit->smallest_angle = 180;
    double total = 0;
    for (int32_t f = 0; f < mesh->face_count; f++) {
        double n[3], centre[3], m[3], squared;
        pliant_face_normal(corner(mesh, f, 0), corner(mesh, f, 1), corner(mesh, f, 2), n);
        for (int k = 0; k < 3; k++) {
            double a[3], b[3], other[3];
            pliant_subtract(corner(mesh, f, (k + 1) % 3), corner(mesh, f, k), a);
            pliant_subtract(corner(mesh, f, (k + 2) % 3), corner(mesh, f, k), b);
            fit->smallest_angle = fmin(fit->smallest_angle, angle_between(a, b));
            const int32_t g = twin[3 * (size_t)f + k] / 3;
            pliant_face_normal(corner(mesh, g, 0), corner(mesh, g, 1), corner(mesh, g, 2), other);
            fit->fold = fmax(fit->fold, angle_between(n, other));
        }
        for (int i = 0; i < 3; i++)
            centre[i] = (corner(mesh, f, 0)[i] + corner(mesh, f, 1)[i] + corner(mesh, f, 2)[i]) / 3;
        const pliant_place at = pliant_face_tree_closest(tree, centre, &squared);
        pliant_surface_normal(original, &at, m);
        const double deviation = angle_between(n, m);
        total += deviation;
        fit->normal_largest = fmax(fit->normal_largest, deviation);
        fit->flipped_count += deviation > 90;
    }
    fit->normal_mean = total / mesh->face_count;
}

pliant_status pliant_fit_measure(const pliant_surface *original, const pliant_face_tree *tree,
                                 const pliant_mesh *mesh, pliant_fit *fit, pliant_error *err)
{
    *fit = (pliant_fit){0};
    pliant_face_tree *other = NULL;
    pliant_status status = pliant_face_tree_create(mesh, &other, err);
    if (status < 0) return status;
    int32_t *twin = malloc(3 * (size_t)mesh->face_count * sizeof *twin);
    if (!twin)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to measure %d faces",
                                  mesh->face_count);
    else
        status =
            pliant_halfedge_match(mesh->vertex_count, mesh->face_count, mesh->faces, twin, err);
    if (status == PLIANT_OK) {
        const double diagonal = pliant_surface_diagonal(original->mesh),
                     spacing = sample_spacing * diagonal;
        measure_angles(original, tree, mesh, twin, fit);
        fit->back = sqrt(farthest(mesh, tree, spacing)) / diagonal;
        fit->there = sqrt(farthest(original->mesh, other, spacing)) / diagonal;
    }
    free(twin);
    pliant_face_tree_destroy(other);
    return status;
}
