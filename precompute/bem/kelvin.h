// kelvin.h: Kelvin's fundamental solutions of linear elastostatics, the scalar reference.
//
// The assembly uses the vector form of kelvin_lanes.h; tests and benchmarks compare it with this.
#pragma once

#include "bem/bem.h"

// Displacement U and traction T at y from a unit force at x: r = y - x is not zero, `normal` is
// the unit normal at y. Entry [i][j]: force along i, component j.
void pliant_kelvin_displacement(const pliant_material *material, const double r[3],
                                double U[3][3]);  // m/N
void pliant_kelvin_traction(const pliant_material *material, const double r[3],
                            const double normal[3], double T[3][3]);  // 1/m^2
