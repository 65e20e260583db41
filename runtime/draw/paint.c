// paint.c: flat shapes laid over a picture: rectangles, discs, arrows.
#include "paint.h"

#include <math.h>

#define DISC_CORNERS 24

static void take_colour(const void *context, const float *attribute, float *colour)
{
    (void)attribute;
    const float *flat = context;
    for (int c = 0; c < 3; c++) colour[c] = flat[c];
}

static void fill(pliant_raster *raster, const double (*point)[2], double depth, const float *colour)
{
    pliant_raster_corner corner[3];
    for (int k = 0; k < 3; k++)
        corner[k] = (pliant_raster_corner){
            .x = (float)point[k][0], .y = (float)point[k][1], .depth = (float)depth};
    pliant_raster_triangle(raster, corner, take_colour, colour);
}

void pliant_paint_rectangle(pliant_raster *raster, double x, double y, double width, double height,
                            const float *colour)
{
    const double x1 = x + width, y1 = y + height;
    const double halves[2][3][2] = {{{x, y}, {x1, y}, {x, y1}}, {{x1, y}, {x1, y1}, {x, y1}}};
    for (int k = 0; k < 2; k++) fill(raster, halves[k], -INFINITY, colour);
}

void pliant_paint_disc(pliant_raster *raster, double x, double y, double depth, double radius,
                       const float *colour)
{
    const double step = 2 * acos(-1.0) / DISC_CORNERS;
    for (int k = 0; k < DISC_CORNERS; k++) {
        const double slice[3][2] = {
            {x, y},
            {x + radius * cos(k * step), y + radius * sin(k * step)},
            {x + radius * cos((k + 1) * step), y + radius * sin((k + 1) * step)},
        };
        fill(raster, slice, depth, colour);
    }
}

void pliant_paint_arrow(pliant_raster *raster, double x0, double y0, double x1, double y1,
                        double thickness, double head, double rim, const float *colour)
{
    const double length = hypot(x1 - x0, y1 - y0);
    if (!(length > 0)) return;
    const double d[2] = {(x1 - x0) / length, (y1 - y0) / length};
    const double n[2] = {-d[1], d[0]};
    // Along d and across it: the head is as broad at its base as 0.9 of its length, so moving its
    // sides out by `rim` takes its point rim / sin(half its angle) further, its base's corners as
    // much outwards as similar triangles say.
    const double slope = 0.45, long_head = fmin(head, length);
    const double point = length + rim * sqrt(1 + 1 / (slope * slope));
    const double neck = length - long_head - rim;
    const double wing = slope * (point - neck);
    const double half = thickness / 2 + rim, tail = -rim;
    const double outline[7][2] = {{point, 0},    {neck, wing},  {neck, half}, {tail, half},
                                  {tail, -half}, {neck, -half}, {neck, -wing}};
    double at[7][2];
    for (int k = 0; k < 7; k++)
        for (int c = 0; c < 2; c++)
            at[k][c] = (c == 0 ? x0 : y0) + outline[k][0] * d[c] + outline[k][1] * n[c];
    static const int triangles[3][3] = {{0, 1, 6}, {2, 3, 4}, {2, 4, 5}};
    for (int t = 0; t < 3; t++) {
        const double corner[3][2] = {
            {at[triangles[t][0]][0], at[triangles[t][0]][1]},
            {at[triangles[t][1]][0], at[triangles[t][1]][1]},
            {at[triangles[t][2]][0], at[triangles[t][2]][1]},
        };
        fill(raster, corner, -INFINITY, colour);
    }
}
