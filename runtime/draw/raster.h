// raster.h: triangles into a supersampled picture with a depth buffer.
//
// Coordinates are pixels, x to the right and y down, (0, 0) the upper left corner of the picture.
// A pixel has samples x samples sample points. Corners are snapped to 1/256 of a sample's step and
// coverage is decided in integers, so that triangles that share an edge neither overlap nor gape.
// Colours are linear light, 0 to 1.
#pragma once

#include "pliant/base.h"

#define PLIANT_RASTER_SIDE_LIMIT 4096  // pixels
#define PLIANT_RASTER_ATTRIBUTES 5     // numbers that a corner hands to the shader

typedef struct pliant_raster {
    int32_t width, height;  // pixels
    int32_t samples;        // sample points along a pixel's side
    float *colour;          // shape [height * samples][width * samples][3]
    float *depth;           // shape [height * samples][width * samples]; larger is farther away
    int32_t left, top, right, bottom;  // pixels drawn to: left <= x < right; at first all
} pliant_raster;

typedef struct pliant_raster_corner {
    float x, y;   // pixels
    float depth;  // -INFINITY: in front of everything
    float attribute[PLIANT_RASTER_ATTRIBUTES];
} pliant_raster_corner;

// Colour of a sample point from the interpolated attributes; `colour` holds what was there.
typedef void pliant_raster_shader(const void *context, const float *attribute, float *colour);

PLIANT_UNUSED_RESULT pliant_status pliant_raster_create(int32_t width, int32_t height,
                                                        int32_t samples, pliant_raster **raster,
                                                        pliant_error *err);
void pliant_raster_destroy(pliant_raster *raster);  // NULL is fine

// One colour everywhere, infinitely far away.
void pliant_raster_clear(pliant_raster *raster, const float *colour);

// Draw a triangle, either way round, where it is not behind what is drawn already (equal depth: the
// later one wins). A triangle with a corner that is not finite or far outside is left out.
void pliant_raster_triangle(pliant_raster *raster, const pliant_raster_corner *corners,
                            pliant_raster_shader *shader, const void *context);

// Average the samples of every pixel and encode: rgb has shape [height][width][3], sRGB.
void pliant_raster_resolve(const pliant_raster *raster, uint8_t *rgb);
