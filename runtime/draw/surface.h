// surface.h: a lit, coloured triangle surface in a picture, and its soft shadow on the ground.
#pragma once

#include "camera.h"
#include "raster.h"

// What is drawn; arrays are borrowed.
typedef struct pliant_surface {
    int32_t vertex_count, face_count;
    const double *positions;  // shape [vertex_count][3]
    const int32_t *faces;     // shape [face_count][3], counterclockwise from outside
    const float *value;       // shape [vertex_count]: place on the colour map, 0 to 1
    const uint8_t *held;      // shape [vertex_count]: 1 where tinted as held
} pliant_surface;

PLIANT_UNUSED_RESULT pliant_status pliant_surface_draw(const pliant_surface *surface,
                                                       const pliant_camera *camera,
                                                       pliant_raster *raster, pliant_error *err);

// Darken the picture where the surface shadows the plane z = ground under a wide, high light. Drawn
// before the surface; nothing happens when the camera looks from below the plane.
PLIANT_UNUSED_RESULT pliant_status pliant_surface_shade_ground(
    const pliant_surface *surface, const pliant_camera *camera, double ground,
    const pliant_frame *frame, pliant_raster *raster, pliant_error *err);

// The tint of held vertices, linear light.
void pliant_surface_held_colour(float *colour);
