// boundary_system.h: the boundary element method as a discretisation: bem/ and a dense system.
#pragma once

#include "discretisation.h"

extern const pliant_discretisation pliant_boundary_system;
