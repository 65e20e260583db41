// compliance.h: the contact compliance of one level as a symmetric operator, and how definite it
// is.
//
// With G_ij the 3x3 value at vertex k_i of the stored hierarchical Green's function xi^_[l,k_j]
// (GF-69) and A_i the area of hat [l,k_i], tractions s at the hats do the work s . A G s, which a
// passive solid never gives back: the symmetric part of A G is positive definite but for
// discretisation and compression. Here it is scaled to a diagonal of ones,
//
//     M = D^-1/2 (A G + (A G)^T) / 2 D^-1/2      D = the diagonal of A G
//
// and applied from the sparse columns, without being formed.
#pragma once

#include "pliant/hats.h"
#include "pliant/lanczos.h"

// Some or all stored columns of a level: those of positions column[i], or of i where column is
// NULL.
typedef struct pliant_compliance_columns {
    int32_t count;
    const int32_t *column;   // [count] or NULL; may be unordered
    const uint64_t *offset;  // [count + 1]
    const int32_t *row;      // [offset[count]] positions of the row domain, wavelet coefficients
    const float *block;      // [offset[count]][3][3]
} pliant_compliance_columns;

// Where the columns lie with several processes: add up values[count] over all of them, with the
// same result on each.
typedef void (*pliant_compliance_sum)(void *context, double *values, int32_t count);

typedef struct pliant_compliance_def {
    const pliant_wavelet *wavelet;  // of the columns' rows, and of the same domain
    const pliant_hats *hats;
    int32_t level;
    pliant_compliance_columns columns;
    pliant_compliance_sum sum;  // NULL: all columns are here
    void *context;
} pliant_compliance_def;

// Smallest and largest eigenvalue of M, to 1e-3. Collective where columns are apart. All of
// `def` is read during the call only. PLIANT_ERR_ARGUMENT: the level has no hats, or numbers are
// too large for doubles.
PLIANT_UNUSED_RESULT pliant_status pliant_compliance_eigenvalues(const pliant_compliance_def *def,
                                                                 pliant_lanczos_result *result,
                                                                 pliant_error *err);
