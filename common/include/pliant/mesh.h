// mesh.h: an indexed triangle mesh, and what its geometry says.
//
// Faces are counterclockwise seen from outside. Coordinates are in the input's own unit of length.
#pragma once

#include "pliant/base.h"

typedef struct pliant_mesh {
    int32_t vertex_count, face_count;
    double *vertices;  // shape [vertex_count][3]
    int32_t *faces;    // shape [face_count][3]
} pliant_mesh;

// Room for that many vertices and faces, zeroed; one block, freed by destroy (NULL is fine).
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_create(int32_t vertex_count, int32_t face_count,
                                                      pliant_mesh **mesh, pliant_error *err);
void pliant_mesh_destroy(pliant_mesh *mesh);

// Signed volume enclosed by a closed mesh, positive when the faces look outwards.
double pliant_mesh_volume(const pliant_mesh *mesh);

// Hat-function areas a_i = one third of the incident triangles' area (GF-4).
// `areas` has shape [vertex_count]. Takes bare arrays, so that a mapped file can be passed as it is.
void pliant_mesh_vertex_areas(int32_t vertex_count, const double *vertices, int32_t face_count,
                              const int32_t *faces, double *areas);
