// compare.h: every played step against the exact answer from a dense file.
//
// The changed boundary value problem is solved directly, in double precision, from the dense
// Green's functions (GF-7, 10): for the nodes whose type is changed, the reference-type values x
// that give the specified ones, then the displacements of all nodes. Compared are the reconstructed
// vertices (up to the player's level) and the total contact force.
#pragma once

#include "player.h"

typedef struct pliant_compare pliant_compare;

// Relative differences: RMS |u - u'|_2 / |u'|_2 over the vertices of a step, MAX the largest
// vertex's |u_i - u'_i| / max |u'_i|, force |F - F'| / |F'|, with ' the exact ones. A step whose
// exact answer is zero counts 0 when the played one is zero too, else infinity.
typedef struct pliant_compare_summary {
    int64_t step_count;
    double rms;  // over the vertices of all steps together
    double rms_worst, max_worst, force_worst;
    int64_t rms_step, max_step, force_step;  // where the worst stood, 0 without a step
} pliant_compare_summary;

// Map a dense file and check that its nodes are the model's. `model` is borrowed until close.
PLIANT_UNUSED_RESULT pliant_status pliant_compare_open(const char *path, const pliant_model *model,
                                                       pliant_compare **compare, pliant_error *err);
void pliant_compare_close(pliant_compare *compare);  // NULL is fine
// Solve the player's present state and compare with its last step.
PLIANT_UNUSED_RESULT pliant_status pliant_compare_add(pliant_compare *compare,
                                                      const pliant_player *player,
                                                      pliant_error *err);
pliant_compare_summary pliant_compare_result(const pliant_compare *compare);
// The exact displacements of the last step added, shape [n][3], m; borrowed until close.
const double *pliant_compare_exact(const pliant_compare *compare);
