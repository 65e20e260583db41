// hats.h: the hierarchical basis functions of one domain of a multiresolution surface (GF 6).
//
// The hat of vertex k on level l interpolates: it is 1 at k, 0 at the other vertices of that level,
// and linear refinement carries it to the finest one. Where both are in the domain (GF-53),
//
//     phi_[l,k] = phi_[l+1,k] + 1/2 sum of phi_[l+1,m] over the odd neighbours m of k on level l +
//     1
//
// An odd vertex outside the domain is left out, and so passes nothing on; a parent outside gives
// nothing. The same weights make hierarchical Green's functions of finer ones (GF-60..62).
#pragma once

#include "pliant/wavelet.h"

// Weights are in compressed columns, one for each hat: level l has the hats of positions 0 ..
// level_offset[l+1] - 1, and hat k has its weights in entries offset[l][k] .. offset[l][k+1] - 1.
// Their positions ascend and the first is k itself, of weight 1. Positions are coarse to fine, so
// what a hat takes from the vertices of level B alone (GF-60 from level B's functions) are its
// entries in front of the first position beyond level_offset[B+1] - 1. Const after create.
typedef struct pliant_hats {
    int32_t count;        // nodes in the domain, m
    int32_t level_count;  // L + 1
    int32_t level_offset[PLIANT_LEVEL_LIMIT +
                         2];  // positions of level l: [level_offset[l], level_offset[l+1])
    const int32_t
        *offset[PLIANT_LEVEL_LIMIT + 1];  // shape [level_offset[l+1] + 1]; owned, as the others
    const int32_t *position[PLIANT_LEVEL_LIMIT + 1];  // shape [offset[l][level_offset[l+1]]]
    const double
        *weight[PLIANT_LEVEL_LIMIT + 1];  // h_kj: the hat's value at the vertex of position j
    // Integrals of the hats over the surface, sum_j h_kj a_j: shape [level_offset[l+1]], m^2.
    const double *area[PLIANT_LEVEL_LIMIT + 1];
} pliant_hats;

// The hats of the domain that `wavelet` transforms (any scheme). `nodes`, its vertices, has shape
// [wavelet->count]; `areas`, shape [n], are the vertex areas a_i of the finest level (GF-4). Inputs
// are read during the call only.
PLIANT_UNUSED_RESULT pliant_status pliant_hats_create(const pliant_wavelet *wavelet,
                                                      const int32_t *nodes, const double *areas,
                                                      pliant_hats **hats, pliant_error *err);
void pliant_hats_destroy(pliant_hats *hats);  // NULL is fine
