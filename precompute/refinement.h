// refinement.h: columns of a level from those of the next finer one (GF-60..62).
#pragma once

#include "greens.h"

// Collective: add the columns of `level` to their compressor, from the spool of level + 1, which has
// been decided on:
//
//     xi_[l,k] = xi_[l+1,k] + 1/2 sum of xi_[l+1,m] over the odd neighbours m of k
PetscErrorCode pliant_refinement_run(pliant_greens *greens, pliant_block_name block, int32_t level,
                                     pliant_error *err);
