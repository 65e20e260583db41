// contact_law.h: the forces between rigid tools and compliant contacts: unilateral, with friction.
//
// A contact is a place where a tool may push. Forces f change gaps through the compliance among the
// contacts, which is symmetric and positive definite. Without friction there is one number for each
// contact, the force lambda along its normal:
//
//     r = A lambda + b        lambda >= 0,  r >= 0,  lambda r = 0 at every contact
//
// A linear complementarity problem, whose solution is the one minimum of lambda A lambda / 2 +
// b lambda over lambda >= 0. With Coulomb friction there are three, in the frame (normal, tangent,
// tangent), and r is the gap and how far the surface slips over the tool:
//
//     r = B f + b             f_n >= 0,  r_n >= 0,  f_n r_n = 0,  |f_t| <= mu f_n,
//                             r_t = 0  or  f_t = - mu f_n r_t / |r_t|
//
// Nothing here knows a model or a tool. Units: m, N, m/N.
#pragma once

#include "pliant/arena.h"

// Workspace for one problem at a time.
typedef struct pliant_contact_law {
    int32_t capacity;        // contacts
    int32_t *active;         // shape [3 capacity]: unknowns that are solved for
    uint8_t *is_active;      // shape [capacity]
    double *factor;          // shape [3 capacity][3 capacity]
    double *solution;        // shape [3 capacity]
    double *residual;        // shape [3 capacity]
    double *trial;           // shape [3 capacity]
    double *trial_residual;  // likewise
    double *direction;       // shape [2 capacity]: of slip
} pliant_contact_law;

// How a problem was solved.
typedef struct pliant_contact_law_report {
    int32_t count;    // of active sets tried (push), of sweeps (rub)
    int32_t is_done;  // 0: stopped at its limit; forces are still inside their cones
    // What is left of the conditions, as a length: the largest |min(r_i, A_ii lambda_i)|, or with
    // friction of the projection onto the cone (see rub).
    double residual;
} pliant_contact_law_report;

void pliant_contact_law_lay_out(pliant_arena *arena, int32_t capacity, pliant_contact_law *law);

// Without friction. `matrix` is A, shape [count][count], `b` has shape [count]. `lambda`, shape
// [count], says which contacts to start from (those above 0) and takes the solution: to rounding
// when is_done. An active set method that exchanges whole blocks while that makes progress, and
// then single contacts by a rule that cannot cycle.
pliant_contact_law_report pliant_contact_law_push(pliant_contact_law *law, int32_t count,
                                                  const double *matrix, const double *b,
                                                  double *lambda);

// With friction. `matrix` is B, shape [3 count][3 count], `b` has shape [3 count], `friction`, mu,
// [count]. `force`, shape [3 count], is where to start from and takes the solution. Sweeps of exact
// solutions of one contact after another, sped up by a solution of all with the regimes that these
// found (open, sticking, sliding this way), until the residual is at most `tolerance` (m) or after
// `limit` sweeps. The residual is the largest | f - P(f - (r + (mu |r_t|, 0)) / w) | w, w = B_nn
// and P the projection onto the cone (the conditions above are those of a fixed point).
pliant_contact_law_report pliant_contact_law_rub(pliant_contact_law *law, int32_t count,
                                                 const double *matrix, const double *b,
                                                 const double *friction, double tolerance,
                                                 int32_t limit, double *force);
