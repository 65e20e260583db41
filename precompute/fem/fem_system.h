// fem_system.h: the finite element method as a discretisation.
#pragma once

#include "discretisation.h"

extern const pliant_discretisation pliant_fem_system;
