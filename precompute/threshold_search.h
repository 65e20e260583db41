// threshold_search.h: the sparsest coefficients of spooled columns that stay under given errors.
//
// A coefficient of column j is kept when it is on level 0, or large in the whole block,
//
//     w_i |xi~_ij|_F >= T,     w_i = the l2 norm over the nodes of its synthesis function,
//
// or large in its own column, |xi~_ij|_F >= t_j max_i |xi_ij|_F. T meets RMS (GF-70), each t_j meets
// MAX (GF-71) in its column. Compliant parts dominate RMS, so T alone would starve columns of small
// norm; a threshold relative to the column alone wastes coefficients on the compliant ones. What is
// kept is then refitted by least squares to the exact column, which lowers RMS by 3 to 7%.
#pragma once

#include "kept_set.h"
#include "spool.h"

#include "pliant/wavelet.h"

#include <mpi.h>

typedef struct pliant_threshold_targets {
    double rms;  // bound on GF-70, 0: none
    double max;  // bound on GF-71, 0: none
    // Told now and then what part of the search is done, 0 to 1: an estimate. NULL: nobody listens.
    void (*tell)(void *context, double part);
    void *context;
} pliant_threshold_targets;

typedef struct pliant_threshold_outcome {
    double error_energy;  // sum of |error_ij|_F^2 over this rank's columns, of what is stored
    double worst;         // largest GF-71 of this rank's columns
    double threshold;     // T
} pliant_threshold_outcome;

// Collective: fill `kept` from this rank's sealed spool. When a rank fails all return with an error
// status. `exact_energy` is the sum of |xi_ij|_F^2 over all ranks.
PLIANT_UNUSED_RESULT pliant_status pliant_threshold_search(const pliant_wavelet *wavelet,
                                                           const pliant_spool *spool,
                                                           const pliant_threshold_targets *targets,
                                                           double exact_energy, MPI_Comm comm,
                                                           pliant_kept_set *kept,
                                                           pliant_threshold_outcome *outcome,
                                                           pliant_error *err);
