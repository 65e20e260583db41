// wavelet.h: lifted second-generation wavelets on one domain of a multiresolution surface.
//
// A domain is a set of vertices, ascending and so coarse to fine; data on it are arrays over domain
// positions. The transform predicts every odd vertex m from coarser ones and keeps the difference,
// then (lifted) updates its parents so that every wavelet integrates to zero:
//
//     gamma_m = x_m - sum_k w_mk x_k          x_a += s_ma gamma_m,  s_ma = I_m / (2 I_a)
//
// Stencil nodes outside the domain count as zero with their weights kept (PLIANT_ZERO: right for a
// field that vanishes there) or are dropped and the rest renormalised (PLIANT_DROP).
//
// This follows: W. Sweldens, The lifting scheme, SIAM J. Math. Anal. 29(2), 1998; P. Schroeder and
// W. Sweldens, Spherical wavelets, SIGGRAPH 1995; GF 4.3. The zero extension is ours.
#pragma once

#include "pliant/hierarchy.h"

#include <stddef.h>

typedef enum pliant_wavelet_scheme {
    PLIANT_LINEAR = 0,     // predict by the parents' mean
    PLIANT_BUTTERFLY = 1,  // predict by the 8-point butterfly stencil
} pliant_wavelet_scheme;

typedef enum pliant_wavelet_lifting {
    PLIANT_UNLIFTED = 0,
    PLIANT_LIFTED = 1,
} pliant_wavelet_lifting;

typedef enum pliant_wavelet_boundary {
    PLIANT_ZERO = 0,
    PLIANT_DROP = 1,
} pliant_wavelet_boundary;

typedef struct pliant_wavelet_def {
    pliant_wavelet_scheme scheme;
    pliant_wavelet_lifting lifting;
    pliant_wavelet_boundary boundary;
} pliant_wavelet_def;

// Butterfly, lifted, zero.
pliant_wavelet_def pliant_wavelet_default(void);

#define PLIANT_STENCIL_LIMIT 8

// Up to three odd positions on the edges of one triangle, whose butterflies share most of their
// nodes: on line 12 rows are read instead of 24. With T = 1/2 (sum of corners) - 1/16 (sum of
// across) the prediction on the edge opposite to corner[k] is
//
//     T - 3/8 corner[k] + 3/16 across[k] - 1/16 (outer[k][0] + outer[k][1])
//
// where across[k] is the corner beyond that edge and outer[k] are the wings over there. Numbers are
// 2 x position, since x86 multiplies addresses by 8 at most and a row has 16 bytes.
typedef struct pliant_wavelet_triple {
    uint16_t corner[3], across[3], outer[3][2];
    uint16_t odd[3];  // distinct ones first; one that repeats odd[0] is not wanted
    uint16_t padding;
} pliant_wavelet_triple;

// The largest domain that such numbers reach.
#define PLIANT_TRIPLE_ROW_LIMIT 32767

// The plan of one domain's transform; const after create. Positions outside the domain are
// `count`, and every data array has count + 1 rows of which the last is zero.
typedef struct pliant_wavelet {
    pliant_wavelet_def def;
    int32_t count;        // nodes in the domain, m
    int32_t level_count;  // L + 1
    int32_t level_offset[PLIANT_LEVEL_LIMIT + 2];  // positions of level l: [level_offset[l], level_offset[l+1])
    int32_t stencil_size; // 2 or 8
    // The prediction of odd position p, at q = p - level_offset[1]: shape [count - level_offset[1]][stencil_size].
    const int32_t *predict_node;
    const double *predict_weight;
    const float *predict_weight_f;
    // The update of its two parents (same q): shape [..][2]; weight 0 where the parent is outside.
    const int32_t *update_node;
    const double *update_weight;
    // The same updates gathered by parent: entries update_offset[l][a] .. update_offset[l][a+1] of
    // update_odd and update_odd_weight are what the odd positions of level l+1 add to position a of
    // level l or coarser.
    const int32_t *update_offset[PLIANT_LEVEL_LIMIT + 1];
    const int32_t *update_odd;
    const float *update_odd_weight;
    // On line, for butterflies under zero extension in domains that triples reach: the odd
    // positions of level l + 1 are those of triples triple_offset[l] .. triple_offset[l+1], and
    // likewise singles.
    const pliant_wavelet_triple *triples;  // NULL: none
    const int32_t *singles;                // odd positions that are in no triple
    int32_t triple_offset[PLIANT_LEVEL_LIMIT + 1];
    int32_t single_offset[PLIANT_LEVEL_LIMIT + 1];
} pliant_wavelet;

// Plan the transform of the domain `nodes` (ascending vertex numbers, shape [count]). `areas`, shape
// [n], are the vertex areas a_i of the finest level. Inputs are read during the call only.
PLIANT_UNUSED_RESULT pliant_status pliant_wavelet_create(const pliant_hierarchy *hierarchy,
                                                         const double *areas, const int32_t *nodes,
                                                         int32_t count, const pliant_wavelet_def *def,
                                                         pliant_wavelet **wavelet, pliant_error *err);
void pliant_wavelet_destroy(pliant_wavelet *wavelet);  // NULL is fine

// Transforms in place, offline: x has shape [count + 1][width], its last row zero. Inverse stops
// at `level` (rows of finer levels keep their coefficients); level_count - 1 is the whole.
void pliant_wavelet_forward(const pliant_wavelet *wavelet, int32_t width, double *x);
void pliant_wavelet_inverse(const pliant_wavelet *wavelet, int32_t level, int32_t width, double *x);
// The transpose of inverse (whole), in place: dual test and least squares.
void pliant_wavelet_inverse_transpose(const pliant_wavelet *wavelet, int32_t width, double *x);
// The same in single precision, for searches that run them thousands of times.
void pliant_wavelet_forward_float(const pliant_wavelet *wavelet, int32_t width, float *x);
void pliant_wavelet_inverse_float(const pliant_wavelet *wavelet, int32_t level, int32_t width,
                                  float *x);
void pliant_wavelet_inverse_transpose_float(const pliant_wavelet *wavelet, int32_t width, float *x);

// On line: g has shape [count + 1][4] floats, 16-byte aligned, xyz0 each, its last row zero. In
// place inverse up to `level`.
void pliant_wavelet_inverse_online(const pliant_wavelet *wavelet, int32_t level, float *g);
// The same where few rows are nonzero: `support`, shape [(count + 63) / 64], has bit p % 64 of word
// p / 64 set for every row p that may be. Undoing the update then costs by those rows alone.
void pliant_wavelet_inverse_online_sparse(const pliant_wavelet *wavelet, int32_t level,
                                          const uint64_t *support, float *g);
