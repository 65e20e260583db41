// tool.h: the shapes of rigid tools: distance, and how they moved.
#pragma once

#include "pliant/pliant.h"

// A tool in double, its normal of length one. NONE is infinitely far from everything.
typedef struct pliant_tool_shape {
    pliant_tool_kind kind;
    double a[3];
    double b[3];     // plane: unit normal; capsule: other end
    double axis[3];  // capsule: (b - a) / |b - a|^2; 0 for one without length, a sphere
    double radius;
    double friction;
} pliant_tool_shape;

// PLIANT_ERR_ARGUMENT when the tool is not one (pliant.h says what is wanted).
PLIANT_UNUSED_RESULT pliant_status pliant_tool_shape_begin(const pliant_tool *tool,
                                                           pliant_tool_shape *shape);

// Signed distance from the tool's surface to x, above 0 outside. Its slope is one at most. `normal`
// takes its gradient, which points out of the tool; in the middle of a ball, where there is none,
// it stays as it is.
double pliant_tool_shape_distance(const pliant_tool_shape *shape, const double *x, double *normal);

// A part of the way from one shape to another; of two kinds, the other.
pliant_tool_shape pliant_tool_shape_between(const pliant_tool_shape *from,
                                            const pliant_tool_shape *to, double part);

// A rigid motion y = rotation (x - from) + to.
typedef struct pliant_tool_motion {
    double rotation[9];
    double from[3], to[3];
} pliant_tool_motion;

// The least rotation that takes one shape's axis to the other's, about their points a; none for
// spheres, for shapes of two kinds, or when the axis was reversed.
pliant_tool_motion pliant_tool_motion_between(const pliant_tool_shape *before,
                                              const pliant_tool_shape *after);
void pliant_tool_motion_apply(const pliant_tool_motion *motion, const double *x, double *y);
