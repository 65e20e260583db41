// reaction.h: tractions of held vertices, and what they do beyond the rim of the held part.
//
// In the equations of stiffness.h let u0 be the answer without r beyond the rim, and R0 the forces
// that then hold the solid: R0 = C^T (K_Ff u0 + K_FF C ubar - M_F pbar - m_F g). With the rim's
// vertices E,
//
//     Z = K_ff^-1 N_f     S = C^T K_Ff     N = C^T N_F     Q = N^-1 S Z     r0 = N^-1 R0
//     (I - E^T Q) r_E = E^T r0      u_f = u0 + Z r_E      r = r0 + Q r_E
//
// so that three solves more for each vertex of the rim, once, and a small dense system make the
// traction one field of hats on the whole surface, as it is for boundary elements: a constant
// stress under its own traction comes out exactly, and forces and moments of all columns are in
// balance with the vertex areas (GF-4). Without it (tractions of free vertices fade out in the
// rim's triangles and nothing takes over) the sphere under pressure was off by 7% instead of 1% at
// 162 vertices.
#pragma once

#include "fem/tetrahedra.h"

#include <petscmat.h>

typedef struct pliant_reaction {
    int32_t rim_count;
    int32_t *rim;  // [rim_count] held vertices with a free neighbour, ascending
    // From here on private.
    PetscInt held_count, vertex_count;
    int32_t *held;  // [held_count] vertices, ascending
    Mat N, factor;  // one component's
    Vec right, solution;
    double *responses;  // [3 rim_count][3n]: Z at free vertices, Q at held ones
    Mat coupling;       // I - E^T Q, factored
} pliant_reaction;

// `held` is [surface_count]; both are read during the call only. Not collective.
PetscErrorCode pliant_reaction_create(const pliant_tetrahedra *tetrahedra, const uint8_t *held,
                                      pliant_reaction **reaction);
// What was solved for the rim: `responses` [3 rim_count][3n] with Z at free vertices and S Z at
// held ones; given (PetscMalloc).
PetscErrorCode pliant_reaction_couple(pliant_reaction *reaction, double *responses);
// Columns [column_count][3n] in place: from u0 at free vertices and R0 at held ones to u and r.
PetscErrorCode pliant_reaction_finish(const pliant_reaction *reaction, int32_t column_count,
                                      double *columns);
PetscErrorCode pliant_reaction_destroy(pliant_reaction **reaction);
