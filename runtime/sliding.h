// sliding.h: a point held on a triangle surface and pulled by a spring: where it slides to.
//
// The point is at weights w of a face with corners x_a. Pulled by a device at h it gives way
// elastically, and the spring between it and the device does too; as compliances in series,
//
//     F = C^-1 (h - x),    C = I / k + sum of w_a C_a,    x = sum of w_a x_a
//
// which is minus the slope by h of the energy E(h, w) = 1/2 (h - x) . C^-1 (h - x). Without
// friction w is where F stands along the smoothed normal N = sum of w_a n_a, normalised
// (Morgenbesser and Srinivasan 1996):
//
//     rho_i = F . tau_i = 0,    tau_i = (I - N N^T) (x_i - x_0),    i = 1, 2
//
// N is continuous over edges, so w and F are. With friction the point moves only as far as
// Coulomb's cone around N needs: |rho| <= mu (-F . N), measured in the face's metric.
//
// Where N is the face's own normal and C is the same all over, rho is minus the slope of E by w:
// the force depends on the device's place alone and a closed path takes as much work as it gives.
// Else E changes a little on the way without work, which is the caller's to watch. (Tried and lost:
// the slope of C in rho, 1/2 F . (C_i - C_0) F. Being another one on either side of an edge it
// makes the point snap over edges or catch on them, and F jump by 6% at a depth of one edge.)
//
// Compliances C_a belong to corners, and are linear in between, so that neither their values nor
// the sliding depend on which side of an edge the point is said to be.
//
// This follows: C. B. Zilles and J. K. Salisbury, A constraint-based god-object method for haptic
// display, IROS 1995; D. L. James and D. K. Pai, A unified treatment of elastostatic contact
// simulation for real time haptics, Haptics-e 2(1), 2001 (compliances interpolated over faces).
#pragma once

#include "pliant/base.h"

typedef struct pliant_sliding_face {
    double place[3][3];       // x_a, m
    double normal[3][3];      // n_a, unit
    double compliance[3][9];  // C_a, symmetric and not negative, m/N
} pliant_sliding_face;

// Look a face of the surface up.
typedef void pliant_sliding_fetch(void *context, int32_t face, pliant_sliding_face *to);

typedef struct pliant_sliding_surface {
    const int32_t *twin;  // shape [face_count][3] (halfedge.h)
    pliant_sliding_fetch *fetch;
    void *context;
    double give;      // 1 / k, m/N, above 0
    double friction;  // mu
} pliant_sliding_surface;

// A point on the surface.
typedef struct pliant_sliding_point {
    int32_t face;
    double weights[3];  // sum 1, none below 0
} pliant_sliding_point;

typedef struct pliant_sliding_state {
    double place[3];   // x
    double normal[3];  // N
    double force[3];   // F, on the surface
    double press;      // -F . N; 0 or less: the device is outside
    double depth;      // (x - h) . N
    double energy;     // E
} pliant_sliding_state;

// The state at a point, as it is.
void pliant_sliding_look(const pliant_sliding_surface *surface, const pliant_sliding_point *point,
                         const double *device, pliant_sliding_state *state);

// Move the point to where it slides to, and tell the state there. 1: it moved, 0: it stayed.
int32_t pliant_sliding_move(const pliant_sliding_surface *surface, pliant_sliding_point *point,
                            const double *device, pliant_sliding_state *state);
