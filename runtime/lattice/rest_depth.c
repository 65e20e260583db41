// rest_depth.c: how far a lattice's particles are from its surface at rest.
//
// This follows: S. Fisher and M. C. Lin, Fast Penetration Depth Estimation for Elastic Bodies Using
// Deformed Distance Fields, IROS 2001. The field stands on the lattice itself, so that it deforms
// as the lattice does. Which side of the surface a particle is on is asked of the vertices' normals
// at the nearest place (J. A. Baerentzen and H. Aanaes, Signed Distance Computation Using the Angle
// Weighted Pseudonormal, IEEE TVCG 11(3), 2005, take those of edges and vertices for what we
// interpolate).
#include "lattice/rest_depth.h"

#include "model.h"
#include "triangle.h"
#include "vector.h"

#include <math.h>
#include <string.h>

// Corners of cells that the surface touches are within the diagonal of it, in cells.
#define BAND 1.75

#define SWEEP_COUNT 2  // there and back; once is enough where nothing lies in the way

// Depth of one particle below a face, if that is the nearest so far. Normals are of its corners.
static void look_at_face(const float *place, const double *corners, const double *normals,
                         float *depth)
{
    const double point[3] = {place[0], place[1], place[2]};
    const pliant_nearest nearest = pliant_triangle_nearest(corners, point);
    if (!(nearest.distance < fabsf(*depth))) return;
    double foot[3], normal[3], out[3];
    vector_mix(nearest.weights, corners, foot);
    vector_mix(nearest.weights, normals, normal);
    vector_subtract(point, foot, out);
    *depth = (float)(vector_dot(out, normal) < 0 ? -nearest.distance : nearest.distance);
}

static void load_face(const pliant_model_view *view, int32_t face, double *corners, double *normals)
{
    for (int k = 0; k < 3; k++) {
        const int32_t vertex = view->faces[3 * (size_t)face + (size_t)k];
        const float *tangents = view->lattice_vertex_tangents + 6 * (size_t)vertex;
        const double u[3] = {tangents[0], tangents[1], tangents[2]};
        const double v[3] = {tangents[3], tangents[4], tangents[5]};
        vector_cross(u, v, normals + 3 * k);
        memcpy(corners + 3 * k, view->vertices + 3 * (size_t)vertex, 3 * sizeof *corners);
    }
}

static void measure_faces(const pliant_lattice *lattice, float *depth)
{
    const pliant_model_view *view = &lattice->model->view;
    for (int32_t face = 0; face < view->face_count; face++) {
        double corners[9], normals[9];
        load_face(view, face, corners, normals);
        int32_t low[3], high[3];
        for (int c = 0; c < 3; c++) {
            const double a = corners[c], b = corners[3 + c], d = corners[6 + c];
            const double least = (fmin(fmin(a, b), d) - lattice->origin[c]) / lattice->cell_size;
            const double most = (fmax(fmax(a, b), d) - lattice->origin[c]) / lattice->cell_size;
            low[c] = (int32_t)fmax(ceil(least - BAND), 0);
            high[c] = (int32_t)fmin(floor(most + BAND), lattice->dims[c] - 1);
        }
        for (int32_t z = low[2]; z <= high[2]; z++)
            for (int32_t y = low[1]; y <= high[1]; y++)
                for (int32_t x = low[0]; x <= high[0]; x++) {
                    const int32_t p = pliant_links_particle(lattice->links, x, y, z);
                    if (p >= 0)
                        look_at_face(lattice->rest + 3 * (size_t)p, corners, normals, depth + p);
                }
    }
}

static void measure_outside(const pliant_lattice *lattice, const int32_t *corners, float *depth)
{
    for (int32_t p = 0; p < lattice->particle_count; p++) depth[p] = 0;
    for (int32_t i = 0; i < 8 * lattice->cell_count; i++) depth[corners[i]]++;
    for (int32_t p = 0; p < lattice->particle_count; p++) depth[p] = depth[p] < 8 ? 0 : -INFINITY;
}

// Deep places, which start at -INFINITY, by what comes before or after: no farther from the surface
// than a neighbour is, and the way to it. What is exact is less than that anyway.
static void sweep(const pliant_lattice *lattice, int32_t sign, float *depth)
{
    const int32_t count = lattice->particle_count;
    for (int32_t i = 0; i < count; i++) {
        const int32_t p = sign > 0 ? count - 1 - i : i;
        const int32_t *at = lattice->places + 3 * (size_t)p;
        for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
            int32_t step[3];
            pliant_link_direction(d, step);
            const int32_t other =
                pliant_links_particle(lattice->links, at[0] + sign * step[0],
                                      at[1] + sign * step[1], at[2] + sign * step[2]);
            if (other < 0) continue;
            const int32_t square = step[0] * step[0] + step[1] * step[1] + step[2] * step[2];
            const float reached = depth[other] - lattice->cell_size * sqrtf((float)square);
            if (reached > depth[p]) depth[p] = reached;
        }
    }
}

void pliant_rest_depth_find(const pliant_lattice *lattice, const int32_t *corners, float *depth)
{
    for (int32_t p = 0; p < lattice->particle_count; p++) depth[p] = -INFINITY;
    const int has_surface = lattice->model && lattice->model->view.lattice_vertex_tangents;
    if (has_surface) measure_faces(lattice, depth);
    else measure_outside(lattice, corners, depth);
    for (int i = 0; i < SWEEP_COUNT; i++) {
        sweep(lattice, -1, depth);
        sweep(lattice, 1, depth);
    }
    for (int32_t p = 0; p < lattice->particle_count; p++)
        if (isinf(depth[p])) depth[p] = 0;  // no surface anywhere near
}
