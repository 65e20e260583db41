// singular_integral.h: integrals over one element, seen from one of its own vertices.
#pragma once

#include "bem/element.h"

// x is corner `own` of the element. The strongly singular integral of T with x's own hat is set to
// zero: rigid translation gives it (bem.c).
void pliant_singular_integral_set(const pliant_kelvin_constants *constants,
                                  const pliant_element *element, int own,
                                  pliant_element_integrals *integrals);
