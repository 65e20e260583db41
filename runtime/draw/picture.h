// picture.h: the whole picture: one panel for each state of a body, and a legend.
#pragma once

#include "obstacle_mesh.h"
#include "pliant/base.h"

// The body at rest; arrays are borrowed.
typedef struct pliant_body_shape {
    int32_t vertex_count, face_count;
    const double *rest;    // shape [vertex_count][3]
    const int32_t *faces;  // shape [face_count][3], counterclockwise from outside
    // Shape [vertex_count]: 1 where the reference problem holds the vertex; NULL: nowhere.
    const uint8_t *held;
    // Shape [vertex_count], 0 to 1: a hue for each vertex in place of how far it moved; NULL: none.
    const float *hue;
} pliant_body_shape;

// What bodies stand on and bump into; borrowed.
typedef struct pliant_surroundings {
    pliant_obstacle_mesh planes, solids;
    double ground[4];  // the plane that is shaded, as in surface.h
} pliant_surroundings;

// A vertex in contact: marked by a dot, and those near each other by one arrow along the mean of
// their directions (prescribed displacement or traction; zero: no arrow).
typedef struct pliant_mark {
    int32_t vertex;
    double direction[3];
} pliant_mark;

typedef struct pliant_panel {
    const pliant_vec3 *displacement;  // shape [vertex_count]; NULL: at rest
    const pliant_mark *marks;         // shape [mark_count]
    int32_t mark_count;
    const pliant_vec3 *normals;         // shape [vertex_count], unit; NULL: from the triangles
    const pliant_surroundings *around;  // NULL: the body stands on its lowest vertex at rest
    char label[40];                     // small letters and digits
} pliant_panel;

typedef struct pliant_picture_def {
    int32_t width, height;      // pixels
    int32_t columns;            // panels in a row; 0: all of them
    double azimuth, elevation;  // degrees, see camera.h
    double magnify;             // displacements are drawn this much larger
    double range;  // displacement at the colour map's end; 0: from the largest one drawn
    // 1: every panel shows the box from region[0..2] to region[3..5]; 0: all there is in any panel.
    int32_t has_region;
    double region[6];
} pliant_picture_def;

pliant_picture_def pliant_picture_default(void);

// Draw the panels, row by row, all seen by the same camera. `rgb` has shape [height][width][3].
// Refuses displacements that are not finite.
PLIANT_UNUSED_RESULT pliant_status pliant_picture_draw(const pliant_picture_def *def,
                                                       const pliant_body_shape *shape,
                                                       const pliant_panel *panels,
                                                       int32_t panel_count, uint8_t *rgb,
                                                       pliant_error *err);
