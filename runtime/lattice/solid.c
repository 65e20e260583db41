// solid.c: an obstacle on its way through a step, and what it does to particles.
//
// This follows: B. V. Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, thesis,
// Berkeley 1996 (conservative advancement along distances), and for friction and impact J. J.
// Moreau's time stepping: velocities change so that the end of the step is admissible, by an
// impulse within Coulomb's cone.
#include "lattice/solid.h"

#include <float.h>

#define ADVANCE_LIMIT 24     // looks at the distance on the way of one particle
#define TOUCHES       1e-4f  // of the way: as near as that is contact

static int32_t is_finite3(pliant_vec3 a)
{
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

static int32_t is_within(float value, float least, float most)
{
    return value >= least && value <= most;
}

int32_t pliant_solid_accepts(const pliant_obstacle *o)
{
    if (o->kind == PLIANT_OBSTACLE_NONE) return 1;
    const float *q = o->rotation;
    const float turn = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!is_finite3(o->a) || !is_finite3(o->b) || !is_finite3(o->velocity) ||
        !is_finite3(o->spin) || !isfinite(turn) || turn < FLT_MIN)
        return 0;
    if (!is_within(o->friction, 0, 10) || !is_within(o->restitution, 0, 1)) return 0;
    switch (o->kind) {
    case PLIANT_OBSTACLE_PLANE: {
        const float square = o->b.x * o->b.x + o->b.y * o->b.y + o->b.z * o->b.z;
        return isfinite(square) && square >= FLT_MIN;
    }
    case PLIANT_OBSTACLE_SPHERE:
        return isfinite(o->radius) && o->radius > 0;
    case PLIANT_OBSTACLE_BOX:
        return o->b.x > 0 && o->b.y > 0 && o->b.z > 0;
    case PLIANT_OBSTACLE_CAPSULE:
        return isfinite(o->radius) && o->radius > 0 && isfinite(o->radius_b) && o->radius_b >= 0;
    default:
        return 0;
    }
}

static void copy3(pliant_vec3 from, float *to)
{
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

static void make_capsule(const pliant_obstacle *o, pliant_solid *solid)
{
    const float along[3] = {o->b.x - o->a.x, o->b.y - o->a.y, o->b.z - o->a.z};
    const float length = sqrtf(pose_dot(along, along));
    solid->radius_b = o->radius_b;
    // Where one ball swallows the other there are no sides.
    if (length <= fabsf(o->radius - o->radius_b) || length == 0) {
        const int is_b = o->radius_b > o->radius;
        solid->kind = PLIANT_OBSTACLE_SPHERE;
        if (is_b) memcpy(solid->middle, along, sizeof along);
        solid->radius = solid->reach = is_b ? o->radius_b : o->radius;
        return;
    }
    solid->length = length;
    for (int c = 0; c < 3; c++) {
        solid->axis[c] = along[c] / length;
        solid->middle[c] = 0.5f * along[c];
    }
    solid->slope = (o->radius - o->radius_b) / length;
    solid->cosine = sqrtf(fmaxf(1 - solid->slope * solid->slope, 0));
    solid->reach = 0.5f * length + fmaxf(o->radius, o->radius_b);
}

pliant_solid pliant_solid_make(const pliant_obstacle *o)
{
    pliant_solid solid = {.given = *o,
                          .kind = o->kind,
                          .friction = o->friction,
                          .restitution = o->restitution,
                          .radius = o->radius};
    copy3(o->velocity, solid.velocity);
    copy3(o->spin, solid.spin);
    solid.begin = solid.end = pose_make(o->a, o->rotation);
    switch (o->kind) {
    case PLIANT_OBSTACLE_PLANE: {
        copy3(o->b, solid.axis);
        const float length = sqrtf(pose_dot(solid.axis, solid.axis));
        for (int c = 0; c < 3; c++) solid.axis[c] /= length;
        solid.reach = INFINITY;
        break;
    }
    case PLIANT_OBSTACLE_SPHERE:
        solid.reach = o->radius;
        break;
    case PLIANT_OBSTACLE_BOX:
        copy3(o->b, solid.half);
        solid.reach = sqrtf(pose_dot(solid.half, solid.half));
        break;
    case PLIANT_OBSTACLE_CAPSULE:
        make_capsule(o, &solid);
        break;
    default:
        break;
    }
    return solid;
}

void pliant_solid_begin(pliant_solid *solid, float dt)
{
    if (solid->has_target) solid->end = solid->target;
    else solid->end = pose_advance(&solid->begin, solid->velocity, solid->spin, dt);
    solid->is_moving = memcmp(&solid->begin, &solid->end, sizeof solid->begin) != 0;
    float square = 0;
    for (int r = 0; r < 3; r++) {
        solid->shift[r] = solid->end.p[r] - solid->begin.p[r];
        for (int c = 0; c < 3; c++) {
            const float t = solid->end.R[3 * c + r] - solid->begin.R[3 * c + r];
            solid->turn[3 * r + c] = t;
            square += t * t;
        }
    }
    solid->turn_size = sqrtf(square);
}

void pliant_solid_end(pliant_solid *solid)
{
    if (solid->has_target) {
        memset(solid->velocity, 0, sizeof solid->velocity);
        memset(solid->spin, 0, sizeof solid->spin);
    }
    solid->has_target = 0;
    solid->begin = solid->end;
    solid->is_moving = 0;
}

// ---- Distances ----

// In the plane through the axis, (r, s) from end a, with the sides' normal (cosine, slope).
static float capsule_distance(const pliant_solid *solid, const float *y, float *normal)
{
    const float s = pose_dot(y, solid->axis);
    float out[3];
    for (int c = 0; c < 3; c++) out[c] = y[c] - s * solid->axis[c];
    const float r = sqrtf(pose_dot(out, out));
    const float along = solid->cosine * s - solid->slope * r;
    float from[3] = {y[0], y[1], y[2]}, radius = solid->radius;
    if (along > 0 && along < solid->cosine * solid->length) {
        float side[3];
        for (int c = 0; c < 3; c++) side[c] = r > 0 ? out[c] / r : 0;
        if (!(r > 0)) {  // on the axis: to any side
            const int flat = fabsf(solid->axis[0]) < 0.6f ? 0 : 1;
            for (int c = 0; c < 3; c++) side[c] = (c == flat) - solid->axis[flat] * solid->axis[c];
            const float size = sqrtf(pose_dot(side, side));
            for (int c = 0; c < 3; c++) side[c] /= size;
        }
        for (int c = 0; c < 3; c++)
            normal[c] = solid->cosine * side[c] + solid->slope * solid->axis[c];
        return solid->cosine * r + solid->slope * s - solid->radius;
    }
    if (along > 0) {
        radius = solid->radius_b;
        for (int c = 0; c < 3; c++) from[c] -= solid->length * solid->axis[c];
    }
    const float size = sqrtf(pose_dot(from, from));
    const float end = along > 0 ? 1.0f : -1.0f;
    for (int c = 0; c < 3; c++) normal[c] = size > 0 ? from[c] / size : end * solid->axis[c];
    return size - radius;
}

static float box_distance(const pliant_solid *solid, const float *y, float *normal)
{
    float outside[3], square = 0, deepest = -INFINITY;
    int nearest = 0;
    for (int c = 0; c < 3; c++) {
        const float beyond = fabsf(y[c]) - solid->half[c];
        outside[c] = beyond > 0 ? copysignf(beyond, y[c]) : 0;
        square += outside[c] * outside[c];
        if (beyond > deepest) deepest = beyond, nearest = c;
    }
    if (square > 0) {
        const float distance = sqrtf(square);
        for (int c = 0; c < 3; c++) normal[c] = outside[c] / distance;
        return distance;
    }
    for (int c = 0; c < 3; c++) normal[c] = c == nearest ? copysignf(1, y[c]) : 0;
    return deepest;
}

float pliant_solid_distance(const pliant_solid *solid, const float *y, float *normal)
{
    switch (solid->kind) {
    case PLIANT_OBSTACLE_PLANE:
        memcpy(normal, solid->axis, sizeof solid->axis);
        return pose_dot(y, solid->axis);
    case PLIANT_OBSTACLE_SPHERE: {
        float from[3];
        for (int c = 0; c < 3; c++) from[c] = y[c] - solid->middle[c];
        const float size = sqrtf(pose_dot(from, from));
        for (int c = 0; c < 3; c++) normal[c] = size > 0 ? from[c] / size : c == 2;
        return size - solid->radius;
    }
    case PLIANT_OBSTACLE_BOX:
        return box_distance(solid, y, normal);
    case PLIANT_OBSTACLE_CAPSULE:
        return capsule_distance(solid, y, normal);
    default:
        normal[0] = normal[1] = 0, normal[2] = 1;
        return INFINITY;
    }
}

// 1: y is farther than `distance` from a ball around the solid: a quick look before a close one.
static int32_t is_far(const pliant_solid *solid, const float *y, float distance)
{
    const float far = solid->reach + distance;
    float square = 0;
    for (int c = 0; c < 3; c++) square += (y[c] - solid->middle[c]) * (y[c] - solid->middle[c]);
    return square > far * far;
}

int32_t pliant_solid_is_near(const pliant_solid *solid, const float *x, float radius, float motion)
{
    float y[3];
    pose_to_frame(&solid->begin, x, y);
    float reach = radius + motion;
    if (solid->is_moving)
        reach += sqrtf(pose_dot(solid->shift, solid->shift)) +
                 solid->turn_size * (sqrtf(pose_dot(y, y)) + radius);
    if (is_far(solid, y, reach)) return 0;
    float normal[3];
    // Not "at most": what is not a number is near everything.
    return !(pliant_solid_distance(solid, y, normal) > reach);
}

// ---- Contact ----

// The part of the way y .. y + d after which it touches, the normal there; 1 or more: it does not.
static float advance(const pliant_solid *solid, const float *y, const float *d, float size,
                     float *normal)
{
    float t = 0, distance = pliant_solid_distance(solid, y, normal);
    if (distance <= 0) return 0;
    for (int i = 0; i < ADVANCE_LIMIT && distance > TOUCHES * size; i++) {
        t += distance / size;
        if (t >= 1) return 1;
        const float at[3] = {y[0] + t * d[0], y[1] + t * d[1], y[2] + t * d[2]};
        distance = pliant_solid_distance(solid, at, normal);
        // Once the distance grows on the way it does so for good.
        if (pose_dot(normal, d) >= 0) return 1;
    }
    return t;
}

int32_t pliant_solid_hold_off(const pliant_solid *solid, const float *x, float dt, float bounce,
                              float *v)
{
    float y[3], way[3], d[3], n[3];
    pose_to_frame(&solid->begin, x, y);
    for (int c = 0; c < 3; c++) way[c] = dt * v[c] - solid->shift[c];
    pose_turn_back(&solid->end, way, d);
    if (solid->is_moving)
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++) d[r] += solid->turn[3 * r + c] * (x[c] - solid->begin.p[c]);
    const float size = sqrtf(pose_dot(d, d));
    if (is_far(solid, y, size) || pliant_solid_distance(solid, y, n) >= size) return 0;
    const float t = advance(solid, y, d, size, n);
    const float dn = pose_dot(d, n);
    if (t >= 1 || dn >= 0) return 0;
    // Up to the surface, or back from it; along it less what the impulse of that can brake.
    const float after =
        solid->restitution > 0 && -dn > bounce * dt ? -solid->restitution * dn : t * dn;
    const float normal_change = after - dn;
    float along[3], square = 0, change[3], world[3];
    for (int c = 0; c < 3; c++) {
        along[c] = d[c] - dn * n[c];
        square += along[c] * along[c];
    }
    const float slide = sqrtf(square);
    const float braked =
        slide > solid->friction * normal_change ? solid->friction * normal_change / slide : 1;
    for (int c = 0; c < 3; c++) change[c] = normal_change * n[c] - braked * along[c];
    pose_turn(&solid->end, change, world);
    for (int c = 0; c < 3; c++) v[c] += world[c] / dt;
    return 1;
}

int32_t pliant_solid_expel(const pliant_solid *solid, float most, float *x)
{
    float y[3], n[3], out[3];
    pose_to_frame(&solid->end, x, y);
    if (is_far(solid, y, 0)) return 0;
    const float distance = pliant_solid_distance(solid, y, n);
    if (!(distance < 0)) return 0;
    pose_turn(&solid->end, n, out);
    const float by = fminf(-distance, most);
    for (int c = 0; c < 3; c++) x[c] += by * out[c];
    return 1;
}

// ---- As the caller sees it ----

pliant_obstacle pliant_solid_tell(const pliant_solid *solid)
{
    pliant_obstacle o = solid->given;
    if (o.kind == PLIANT_OBSTACLE_NONE) return o;
    const float *p = solid->begin.p;
    if (o.kind == PLIANT_OBSTACLE_CAPSULE)
        o.b = (pliant_vec3){o.b.x + (p[0] - o.a.x), o.b.y + (p[1] - o.a.y), o.b.z + (p[2] - o.a.z)};
    o.a = (pliant_vec3){p[0], p[1], p[2]};
    memcpy(o.rotation, solid->begin.q, sizeof o.rotation);
    o.velocity = (pliant_vec3){solid->velocity[0], solid->velocity[1], solid->velocity[2]};
    o.spin = (pliant_vec3){solid->spin[0], solid->spin[1], solid->spin[2]};
    return o;
}

pliant_obstacle pliant_obstacle_default(pliant_obstacle_kind kind)
{
    const int is_box = kind == PLIANT_OBSTACLE_BOX;
    return (pliant_obstacle){.kind = kind,
                             .b = {(float)is_box, (float)is_box, 1},
                             .radius = 1,
                             .radius_b = 1,
                             .rotation = {0, 0, 0, 1},
                             .friction = 0.5f};
}
