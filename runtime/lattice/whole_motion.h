// whole_motion.h: the rigid motion that fits a whole body's velocities best.
//
// Sums are taken a slab at a time and then in the order of the slabs, so that they are the same
// from any number of threads.
#pragma once

#include "lattice/body.h"
#include "lattice/window.h"

// Sums over a slab: mass, m x, m v, m x cross v, m (xx, yy, zz, yz, xz, xy), x from the body's
// origin. body->slab_sums has shape [dims z][PLIANT_WHOLE_COUNT].
enum {
    PLIANT_WHOLE_MASS,
    PLIANT_WHOLE_X,
    PLIANT_WHOLE_V = 4,
    PLIANT_WHOLE_SPIN = 7,
    PLIANT_WHOLE_XX = 10,
    PLIANT_WHOLE_COUNT = 16
};

typedef struct pliant_whole_motion {
    double centre[3], velocity[3], omega[3];  // from the body's origin
    double spread;                            // mean square distance from the centre, m^2
} pliant_whole_motion;

// The same as a velocity a + omega cross x, x from the body's origin.
typedef struct pliant_rigid_field {
    float a[3], omega[3];
} pliant_rigid_field;

// Of the body as it is: takes the slabs' sums.
pliant_whole_motion pliant_whole_measure(pliant_body *body);
// Of the slabs' sums as they are.
pliant_whole_motion pliant_whole_fit(const pliant_body *body);
pliant_rigid_field pliant_whole_field(const pliant_whole_motion *motion);
// v = keep v + add (a + omega cross x)
void pliant_whole_blend(pliant_body *body, const pliant_rigid_field *field, float keep, float add);

PLIANT_INLINE void pliant_rigid_field_at(const pliant_rigid_field *field, const pliant_f8 x[3],
                                         pliant_f8 v[3])
{
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        v[c] = pliant_f8_all(field->a[c]) +
               (pliant_f8_all(field->omega[d]) * x[e] - pliant_f8_all(field->omega[e]) * x[d]);
    }
}
