// material.h: an isotropic linear elastic material.
#pragma once

#include "pliant/base.h"

typedef struct pliant_material {
    double young;    // Pa
    double poisson;  // in (-1, 0.5)
    double density;  // kg/m^3
} pliant_material;

// PLIANT_ERR_ARGUMENT names the constant that is out of its range.
PLIANT_UNUSED_RESULT pliant_status pliant_material_check(const pliant_material *material,
                                                         pliant_error *err);
