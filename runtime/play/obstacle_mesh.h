// obstacle_mesh.h: a scene's obstacles as triangles, to be looked at.
//
// Planes have no end: of each a square is made about the region that is looked at. Each obstacle
// has vertices of its own, and so has each side of a box, so that normals from faces are right.
#pragma once

#include "pliant/pliant.h"

typedef struct pliant_obstacle_mesh {
    int32_t vertex_count, face_count;
    double *positions;  // shape [vertex_count][3], m; owned
    int32_t *faces;     // shape [face_count][3], counterclockwise from outside; owned
    int32_t vertex_capacity, face_capacity;
} pliant_obstacle_mesh;  // zeroed is empty

// Replace the mesh by that of these obstacles; low and high, shape [3], bound the region. Allocates
// when it grows.
PLIANT_UNUSED_RESULT pliant_status pliant_obstacle_mesh_make(pliant_obstacle_mesh *mesh,
                                                             const pliant_obstacle *obstacles,
                                                             int32_t count, const double *low,
                                                             const double *high, pliant_error *err);
void pliant_obstacle_mesh_clear(pliant_obstacle_mesh *mesh);
