// pose.h: rigid frames: where one is, how it is turned, and how it moves on.
#pragma once

#include "pliant/base.h"

#include <math.h>
#include <string.h>

// x = p + R y takes a point y of the frame to the world.
typedef struct pliant_pose {
    float p[3];
    float q[4];  // x, y, z, w; unit
    float R[9];  // of q, row-major
} pliant_pose;

static inline float pose_dot(const float *a, const float *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// to = R y; `to` may not be y.
static inline void pose_turn(const pliant_pose *pose, const float *y, float *to)
{
    for (int r = 0; r < 3; r++) to[r] = pose_dot(pose->R + 3 * r, y);
}

// to = R^T x; `to` may not be x.
static inline void pose_turn_back(const pliant_pose *pose, const float *x, float *to)
{
    for (int r = 0; r < 3; r++)
        to[r] = pose->R[r] * x[0] + pose->R[3 + r] * x[1] + pose->R[6 + r] * x[2];
}

static inline void pose_to_world(const pliant_pose *pose, const float *y, float *x)
{
    for (int r = 0; r < 3; r++) x[r] = pose->p[r] + pose_dot(pose->R + 3 * r, y);
}

static inline void pose_to_frame(const pliant_pose *pose, const float *x, float *y)
{
    const float d[3] = {x[0] - pose->p[0], x[1] - pose->p[1], x[2] - pose->p[2]};
    pose_turn_back(pose, d, y);
}

// Normalise q (no turn where it has no length) and make R of it.
static inline void pose_set_rotation(pliant_pose *pose, const float *q)
{
    double s[4] = {q[0], q[1], q[2], q[3]};
    const double length = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + s[3] * s[3]);
    for (int i = 0; i < 4; i++) s[i] = length > 0 ? s[i] / length : i == 3;
    const double x = s[0], y = s[1], z = s[2], w = s[3];
    const double R[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    for (int i = 0; i < 4; i++) pose->q[i] = (float)s[i];
    for (int i = 0; i < 9; i++) pose->R[i] = (float)R[i];
}

// 1: a quaternion that is about unit, or NULL.
static inline int32_t pose_accepts(const float *q)
{
    if (!q) return 1;
    const float square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    return square > 0.25f && square < 4;
}

static inline pliant_pose pose_make(pliant_vec3 position, const float *rotation)
{
    pliant_pose pose = {.p = {position.x, position.y, position.z}};
    const float none[4] = {0, 0, 0, 1};
    pose_set_rotation(&pose, rotation ? rotation : none);
    return pose;
}

// After `dt` seconds at a constant velocity and spin (rad/s, about p).
static inline pliant_pose pose_advance(const pliant_pose *pose, const float *velocity,
                                       const float *spin, float dt)
{
    pliant_pose next = *pose;
    for (int c = 0; c < 3; c++) next.p[c] += dt * velocity[c];
    const float rate = sqrtf(pose_dot(spin, spin));
    if (rate * dt == 0) return next;
    const float half = 0.5f * rate * dt, s = sinf(half) / rate, w = cosf(half);
    const float d[3] = {s * spin[0], s * spin[1], s * spin[2]}, *q = pose->q;
    // The turn times q.
    const float turned[4] = {w * q[0] + d[0] * q[3] + d[1] * q[2] - d[2] * q[1],
                             w * q[1] + d[1] * q[3] + d[2] * q[0] - d[0] * q[2],
                             w * q[2] + d[2] * q[3] + d[0] * q[1] - d[1] * q[0],
                             w * q[3] - d[0] * q[0] - d[1] * q[1] - d[2] * q[2]};
    pose_set_rotation(&next, turned);
    return next;
}
