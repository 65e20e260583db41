// solid.h: an obstacle on its way through a step, and what it does to particles.
//
// All is reckoned in the solid's own frame, in which it rests: there a particle goes from y to
// y + d in the step. Solids are convex, so that their signed distance is convex and changes by at
// most |d| on the way. A particle that would enter is stopped at the tangent plane of the place
// where it would (conservative advancement), and so stays out, however fast it or the solid is.
#pragma once

#include "lattice/pose.h"
#include "pliant/pliant.h"

typedef struct pliant_solid {
    pliant_obstacle given;      // as set
    pliant_obstacle_kind kind;  // of what it comes to; PLIANT_OBSTACLE_NONE: there is none
    float friction, restitution;
    float axis[3];                   // unit; plane: normal; capsule: towards b
    float half[3];                   // box
    float radius, radius_b, length;  // sphere, capsule
    float slope, cosine;             // capsule: of its sides against the axis
    float middle[3], reach;          // a ball around it, in its frame; reach INFINITY: a plane
    pliant_pose begin, end;          // of the present step, or both as it is
    float velocity[3], spin[3];
    int32_t has_target;
    pliant_pose target;  // at the end of the next step
    // Of the step: d = end.R^T (h v - shift) + turn (x - begin.p).
    float shift[3], turn[9];
    float turn_size;  // bound of |turn|
    int32_t is_moving;
} pliant_solid;

// 1: a definition that can be taken.
int32_t pliant_solid_accepts(const pliant_obstacle *obstacle);
pliant_solid pliant_solid_make(const pliant_obstacle *obstacle);
pliant_obstacle pliant_solid_tell(const pliant_solid *solid);  // as an obstacle, as it is
// The pose at the end of a step of `dt` that begins, and what is derived from it.
void pliant_solid_begin(pliant_solid *solid, float dt);
void pliant_solid_end(pliant_solid *solid);  // it has arrived

// Signed distance of y from the surface, and the outward unit normal at the nearest place of it.
float pliant_solid_distance(const pliant_solid *solid, const float *y, float *normal);

// 1: particles within `radius` of x at the beginning that move by at most `motion` may touch it.
int32_t pliant_solid_is_near(const pliant_solid *solid, const float *x, float radius, float motion);

// Hold off a particle that is at x and leaves with velocity v (changed): 1 when it had to. Faster
// impacts than `bounce`, m/s, are given back by the restitution.
int32_t pliant_solid_hold_off(const pliant_solid *solid, const float *x, float dt, float bounce,
                              float *v);
// Move a particle that is inside at the end of the step out, by at most `most`: 1 when it was.
int32_t pliant_solid_expel(const pliant_solid *solid, float most, float *x);
