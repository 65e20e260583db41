// discretisation.c: what solves the reference problem: one row of functions for each method.
#include "discretisation.h"

#include "boundary_system.h"
#include "fem/fem_system.h"

const pliant_discretisation *pliant_discretisation_of(pliant_method method)
{
    static const pliant_discretisation *const methods[] = {
        [PLIANT_METHOD_BEM] = &pliant_boundary_system,
        [PLIANT_METHOD_FEM] = &pliant_fem_system,
    };
    return methods[method];
}
