// tool.c: the shapes of rigid tools: distance, and how they moved.
#include "tool.h"

#include <math.h>
#include <string.h>

// Coefficients above are not materials, and the conditions of friction may then have no solution.
static const float friction_limit = 2;

// ---- Vectors ----

static void set(pliant_vec3 v, double *to)
{
    to[0] = (double)v.x;
    to[1] = (double)v.y;
    to[2] = (double)v.z;
}

static int32_t is_finite(pliant_vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// ---- Shapes ----

static void find_axis(pliant_tool_shape *capsule)
{
    double along[3];
    for (int c = 0; c < 3; c++) along[c] = capsule->b[c] - capsule->a[c];
    const double square = dot(along, along);
    // Ends nearer than a float tells apart are one.
    const int32_t is_long = square > 1e-14 * capsule->radius * capsule->radius;
    for (int c = 0; c < 3; c++) capsule->axis[c] = is_long ? along[c] / square : 0;
}

pliant_status pliant_tool_shape_begin(const pliant_tool *tool, pliant_tool_shape *shape)
{
    pliant_tool_shape used = {.kind = tool->kind};
    if (tool->kind == PLIANT_TOOL_NONE) {
        *shape = used;
        return PLIANT_OK;
    }
    if (tool->kind != PLIANT_TOOL_SPHERE && tool->kind != PLIANT_TOOL_PLANE &&
        tool->kind != PLIANT_TOOL_CAPSULE)
        return PLIANT_ERR_ARGUMENT;
    if (!is_finite(tool->a) || !(tool->friction >= 0 && tool->friction <= friction_limit))
        return PLIANT_ERR_ARGUMENT;
    if (tool->kind != PLIANT_TOOL_SPHERE && !is_finite(tool->b)) return PLIANT_ERR_ARGUMENT;
    if (tool->kind != PLIANT_TOOL_PLANE && !(tool->radius > 0 && isfinite(tool->radius)))
        return PLIANT_ERR_ARGUMENT;
    used.friction = (double)tool->friction;
    set(tool->a, used.a);
    if (tool->kind == PLIANT_TOOL_PLANE) {
        set(tool->b, used.b);
        const double length = sqrt(dot(used.b, used.b));
        if (!(length > 0)) return PLIANT_ERR_ARGUMENT;
        for (int c = 0; c < 3; c++) used.b[c] /= length;
    } else {
        used.radius = (double)tool->radius;
    }
    if (tool->kind == PLIANT_TOOL_CAPSULE) {
        set(tool->b, used.b);
        find_axis(&used);
    }
    *shape = used;
    return PLIANT_OK;
}

pliant_tool_shape pliant_tool_shape_between(const pliant_tool_shape *from,
                                            const pliant_tool_shape *to, double part)
{
    pliant_tool_shape shape = *to;
    if (from->kind != to->kind || part >= 1) return shape;
    for (int c = 0; c < 3; c++) {
        shape.a[c] = from->a[c] + part * (to->a[c] - from->a[c]);
        shape.b[c] = from->b[c] + part * (to->b[c] - from->b[c]);
    }
    shape.radius = from->radius + part * (to->radius - from->radius);
    if (shape.kind == PLIANT_TOOL_CAPSULE) find_axis(&shape);
    if (shape.kind != PLIANT_TOOL_PLANE) return shape;
    const double length = sqrt(dot(shape.b, shape.b));
    // Halfway between opposite normals there is none.
    for (int c = 0; c < 3; c++) shape.b[c] = length > 0.1 ? shape.b[c] / length : to->b[c];
    return shape;
}

double pliant_tool_shape_distance(const pliant_tool_shape *shape, const double *x, double *normal)
{
    double away[3];
    for (int c = 0; c < 3; c++) away[c] = x[c] - shape->a[c];
    switch (shape->kind) {
    case PLIANT_TOOL_PLANE:
        memcpy(normal, shape->b, 3 * sizeof *normal);
        return dot(away, shape->b);
    case PLIANT_TOOL_CAPSULE: {
        // From the nearest point of the segment.
        const double part = fmin(fmax(dot(away, shape->axis), 0), 1);
        for (int c = 0; c < 3; c++) away[c] -= part * (shape->b[c] - shape->a[c]);
        break;
    }
    case PLIANT_TOOL_SPHERE:
        break;
    default:
        return INFINITY;
    }
    const double length = sqrt(dot(away, away));
    if (length > 0)
        for (int c = 0; c < 3; c++) normal[c] = away[c] / length;
    return length - shape->radius;
}

// ---- Motion ----

// Unit direction of the shape's axis; 0: it has none.
static int32_t get_axis(const pliant_tool_shape *shape, double *axis)
{
    const double *from = shape->kind == PLIANT_TOOL_PLANE     ? shape->b
                         : shape->kind == PLIANT_TOOL_CAPSULE ? shape->axis
                                                              : NULL;
    if (!from) return 0;
    const double length = sqrt(dot(from, from));
    if (!(length > 0)) return 0;
    for (int c = 0; c < 3; c++) axis[c] = from[c] / length;
    return 1;
}

pliant_tool_motion pliant_tool_motion_between(const pliant_tool_shape *before,
                                              const pliant_tool_shape *after)
{
    pliant_tool_motion motion = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    if (before->kind != after->kind) return motion;
    memcpy(motion.from, before->a, sizeof motion.from);
    memcpy(motion.to, after->a, sizeof motion.to);
    double p[3], q[3];
    if (!get_axis(before, p) || !get_axis(after, q)) return motion;
    // Rodrigues: R = I + [v] + [v]^2 / (1 + p q), v = p x q.
    const double v[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                         p[0] * q[1] - p[1] * q[0]};
    const double cosine = dot(p, q), square = dot(v, v);
    if (cosine < -0.5) return motion;  // not one step's rotation
    const double cross[9] = {0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0};
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            motion.rotation[3 * r + c] +=
                cross[3 * r + c] + (v[r] * v[c] - (r == c ? square : 0)) / (1 + cosine);
    return motion;
}

void pliant_tool_motion_apply(const pliant_tool_motion *motion, const double *x, double *y)
{
    double away[3];
    for (int c = 0; c < 3; c++) away[c] = x[c] - motion->from[c];
    for (int c = 0; c < 3; c++) y[c] = dot(motion->rotation + 3 * c, away) + motion->to[c];
}
