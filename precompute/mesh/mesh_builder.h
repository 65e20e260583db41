// mesh_builder.h: a mesh that grows while a file is read: vertices, then polygons.
//
// Memory follows what was added, never a count that a file promises.
#pragma once

#include "pliant/mesh.h"

typedef struct pliant_mesh_builder {
    const char *name; // of the file, for messages; borrowed
    int64_t line; // set by readers of text before each corner and polygon; 0: none, faces are named
    int32_t vertex_count, vertex_capacity;
    int32_t face_count, face_capacity;
    int32_t corner_count, corner_capacity;
    int64_t polygon_count;
    double *vertices; // shape [vertex_count][3]
    int32_t *faces;   // shape [face_count][3]
    int32_t *corners; // of the polygon that grows
} pliant_mesh_builder;

pliant_mesh_builder pliant_mesh_builder_begin(const char *name);
void pliant_mesh_builder_end(pliant_mesh_builder *builder);

PLIANT_UNUSED_RESULT pliant_status pliant_mesh_builder_vertex(pliant_mesh_builder *builder,
                                                              const double x[3], pliant_error *err);
// Add a corner to the polygon that grows: vertex `index`, 0-based, which the file calls `written`.
// Refuses what does not exist with the file's own number.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_builder_corner(pliant_mesh_builder *builder,
                                                              int64_t index, int64_t written,
                                                              pliant_error *err);
// Close the polygon and split it into triangles. Repeated neighbours in a polygon of four corners
// and more are one corner (a triangle written as a quadrilateral); a triangle is kept as it is.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_builder_polygon(pliant_mesh_builder *builder,
                                                               pliant_error *err);
// Make one vertex of those with equal positions, numbered by first appearance, and drop triangles
// that have collapsed to an edge or a point by that (their neighbours then meet).
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_builder_weld(pliant_mesh_builder *builder,
                                                            pliant_error *err);
// Copy what was built into a mesh. Refuses what has no vertex or no face.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_builder_finish(const pliant_mesh_builder *builder,
                                                              pliant_mesh **mesh,
                                                              pliant_error *err);
