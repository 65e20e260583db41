// paint.h: flat shapes laid over a picture: rectangles, discs, arrows. Coordinates as raster.h's.
#pragma once

#include "raster.h"

void pliant_paint_rectangle(pliant_raster *raster, double x, double y, double width, double height,
                            const float *colour);

// A round dot at a depth, hidden by what is nearer (-INFINITY: by nothing).
void pliant_paint_disc(pliant_raster *raster, double x, double y, double depth, double radius,
                       const float *colour);

// An arrow from (x0, y0) to its point at (x1, y1), over everything: its shaft `thickness` wide, its
// head `head` long; grown on all sides by `rim`.
void pliant_paint_arrow(pliant_raster *raster, double x0, double y0, double x1, double y1,
                        double thickness, double head, double rim, const float *colour);
