// surface.h: points that live on a triangle mesh, and how they move along it.
//
// This follows: K. Polthier, M. Schmies, Straightest geodesics on polyhedral surfaces, 1998: a walk
// goes straight on across an edge when the two faces are unfolded.
#pragma once

#include "pliant/mesh.h"

// A place on the surface: the corners of `face` with weights that are not negative and sum to 1.
typedef struct pliant_place {
    int32_t face;
    double weight[3];
} pliant_place;

typedef struct pliant_surface {
    const pliant_mesh *mesh;  // borrowed until destroy
    int32_t *twin;            // shape [face_count][3], of halfedge.h
    double *normals;          // shape [vertex_count][3], unit, faces weighted by their angles
} pliant_surface;

// `mesh` is closed and manifold: what is not is refused.
PLIANT_UNUSED_RESULT pliant_status pliant_surface_create(const pliant_mesh *mesh,
                                                         pliant_surface **surface,
                                                         pliant_error *err);
void pliant_surface_destroy(pliant_surface *surface);  // NULL is fine

void pliant_surface_position(const pliant_surface *surface, const pliant_place *place, double x[3]);
// The vertices' normals interpolated; unit.
void pliant_surface_normal(const pliant_surface *surface, const pliant_place *place, double n[3]);
// Walk along the surface by the tangential part of `d`.
pliant_place pliant_surface_walk(const pliant_surface *surface, const pliant_place *from,
                                 const double d[3]);

// The length of the diagonal of a mesh's bounding box.
double pliant_surface_diagonal(const pliant_mesh *mesh);
