// surface.h: a lit, coloured triangle surface in a picture, and its soft shadow on the ground.
#pragma once

#include "camera.h"
#include "raster.h"

// What a vertex's value stands for.
typedef enum pliant_surface_palette {
    PLIANT_PALETTE_MAP,   // a place on the colour map
    PLIANT_PALETTE_HUES,  // a hue, all of one lightness: what is apart from what
    PLIANT_PALETTE_ICE,   // nothing: what bodies bump into
} pliant_surface_palette;

// What is drawn; arrays are borrowed.
typedef struct pliant_surface {
    int32_t vertex_count, face_count;
    const double *positions;  // shape [vertex_count][3]
    const int32_t *faces;     // shape [face_count][3], counterclockwise from outside
    const float *value;       // shape [vertex_count]: 0 to 1; NULL: 0
    const uint8_t *held;      // shape [vertex_count]: 1 where tinted as held; NULL: nowhere
    // Unit normals, shape [vertex_count]; NULL: from the triangles.
    const pliant_vec3 *normals;
    pliant_surface_palette palette;
} pliant_surface;

PLIANT_UNUSED_RESULT pliant_status pliant_surface_draw(const pliant_surface *surface,
                                                       const pliant_camera *camera,
                                                       pliant_raster *raster, pliant_error *err);

// Darken the picture where the surface shadows the plane with the points ground[0..2] . x =
// ground[3], ground[2] > 0, under a wide, high light. Drawn after the plane and before the surface;
// nothing happens when the camera looks from below the plane.
PLIANT_UNUSED_RESULT pliant_status pliant_surface_shade_ground(
    const pliant_surface *surface, const pliant_camera *camera, const double *ground,
    const pliant_frame *frame, pliant_raster *raster, pliant_error *err);

// The tint of held vertices, linear light.
void pliant_surface_held_colour(float *colour);
