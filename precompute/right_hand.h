// right_hand.h: the right-hand sides of the columns that are solved for (GF 7.3).
//
// The columns of level B answer to its hats as boundary values, so their right-hand sides are
// combinations of B's columns, B_hat = B H, with the hats' values in H. Rows are contracted as they
// are assembled: B as a whole, 3n x 3n, never exists, nor does it on the finest level, where H merely
// chooses the columns asked for.
#pragma once

#include "problem.h"

// Columns solved for: the free hats of level problem->levels.last and, with all blocks, the fixed
// ones behind them.
int32_t pliant_right_hand_count(const pliant_problem *problem, pliant_blocks blocks);

// Some rows of B into the same rows of B_hat, both column by column: B has 3n columns, leading
// dimension ld_b; right 3 pliant_right_hand_count(...), leading dimension ld_right.
void pliant_right_hand_contract(const pliant_problem *problem, pliant_blocks blocks, int32_t rows,
                                const double *B, size_t ld_b, double *right, size_t ld_right);
