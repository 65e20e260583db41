// near_integral.h: integrals over one element that is near, but does not hold, the vertex x.
#pragma once

#include "bem/element.h"

void pliant_near_integral_set(const pliant_kelvin_constants *constants,
                              const pliant_element *element, const double x[3],
                              pliant_element_integrals *integrals);
