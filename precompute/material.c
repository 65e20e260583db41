// material.c: an isotropic linear elastic material.
#include "material.h"

#include "pliant/error.h"

#include <math.h>

pliant_status pliant_material_check(const pliant_material *material, pliant_error *err)
{
    if (!(material->young > 0 && material->young < INFINITY))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "Young's modulus: expected more than 0, found %g", material->young);
    if (!(material->poisson > -1 && material->poisson < 0.5))
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "Poisson's ratio: expected more than -1 and less than 0.5, found %g",
            material->poisson);
    if (!(material->density >= 0 && material->density < INFINITY))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "density: expected at least 0, found %g",
                                material->density);
    return PLIANT_OK;
}
