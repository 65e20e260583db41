// damping.h: what of the particles' velocities is no rigid motion of their regions dies out.
//
// Each region's rigid motion (v_r, omega_r) is the least squares fit of LSM-13, 14; a particle's
// velocity is blended by k towards the mean over its regions of their motion at its place. Sums and
// means are the fast summation again, 15 fields there and 6 back.
#pragma once

#include "lattice/body.h"

void pliant_body_damp(pliant_body *body, float k);
// v += k (v_rigid - v), of the rigid motion of the whole (Mueller et al., Position Based Dynamics,
// 2006).
void pliant_body_damp_rigid(pliant_body *body, float k);
