// triangle.h: where a point or a segment meets a triangle.
#pragma once

#include "pliant/base.h"

typedef struct pliant_nearest {
    double distance;    // from the point, m
    double side;        // of the triangle's plane that the point is on: height over it, m
    double weights[3];  // of the corners at the nearest point
} pliant_nearest;

// The point of a triangle (`corners`, shape [3][3]) that is nearest to `point`.
// This follows: C. Ericson, Real-Time Collision Detection, 2005, 5.1.5.
pliant_nearest pliant_triangle_nearest(const double *corners, const double *point);

// Does the segment go through the triangle from its outer side to its inner one? Ends within
// `slack` of the plane count as on it: beginning there is beginning outside, ending there is not
// going through. Then `*at` is how far along (0 .. 1) and `weights` where. Points within `slack`
// beside an edge count as on it, so that there is no way between two triangles.
int32_t pliant_triangle_crossed(const double *corners, const double *from, const double *to,
                                double slack, double *at, double weights[3]);
