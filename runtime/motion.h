// motion.h: how far the surface is at most from where it was, without evaluating it.
//
// The coefficients g of a solution say it: with changes v = sum of g_i psi_i,
//
//     |v(x)| <= sum over levels l of  kappa_l  max of |g_i| over level l,
//     kappa_l = max over x of the sum of |psi_i(x)| over level l
//
// The kappas are measured at create, by transforming every unit coefficient; they are 1 for hats
// without lifting, up to 2 for lifted butterflies. |g_i| is taken component by component. An update
// costs one pass over the coefficients, a microsecond for 2143 nodes, a tenth of the solve that
// made them.
#pragma once

#include "solver.h"

typedef struct pliant_motion {
    double kappa[PLIANT_LEVEL_LIMIT + 1];
    float *before;        // shape [m + 1][4]: g of the last update
    float *fixed_before;  // shape [k][4]: the supports then
    float *work;          // shape [m + 1][4]
    double fixed_size;    // how far other fixed vertices may have been: freed ones, coarse supports
    int32_t solved_count;
    pliant_constraint *solved;  // shape [constraint_capacity]: S then
    int32_t is_same_set;        // 1: S is the set that it was then, whatever its values
    double moved;               // m: no vertex is further from where it was at the last update
} pliant_motion;

void pliant_motion_lay_out(pliant_arena *arena, const pliant_solver *solver, pliant_motion *motion);
void pliant_motion_fill(const pliant_model *model, pliant_motion *motion);
// To the solver's last solve. The bound is crude where fixed vertices are freed or supported
// through coarse hats: as if they had come from the other side of rest. It leaves out that vertices
// which enter or leave S jump by what compression does to their columns.
void pliant_motion_update(pliant_motion *motion, pliant_solver *solver);
