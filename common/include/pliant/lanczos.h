// lanczos.h: the smallest and the largest eigenvalue of a symmetric operator known by what it does.
//
// Lanczos' recurrence from a random vector, three vectors long. The basis is not reorthogonalised:
// what is lost then are copies of eigenvalues already found, which do not hurt the extreme ones
// (Paige), and thousands of steps stay cheap.
#pragma once

#include "pliant/base.h"

// y = M x, both of shape [n]; x may be changed on the way.
typedef void (*pliant_lanczos_apply)(void *context, double *x, double *y);

typedef struct pliant_lanczos_def {
    int32_t n;
    pliant_lanczos_apply apply;
    void *context;
    double tolerance;       // stop when both residuals are under this (absolute)
    int32_t step_capacity;  // and after so many steps whatever they are
} pliant_lanczos_def;

typedef struct pliant_lanczos_result {
    double smallest, largest;
    // Norms of M x - lambda x for the unit vectors found: an eigenvalue is that near, and the
    // smallest eigenvalue is no larger than `smallest`.
    double smallest_residual, largest_residual;
    int32_t steps;
} pliant_lanczos_result;

// Allocates. The start depends on n alone, so that two runs agree. PLIANT_ERR_ARGUMENT: the
// operator gave a number that is not finite.
PLIANT_UNUSED_RESULT pliant_status pliant_lanczos_extremes(const pliant_lanczos_def *def,
                                                           pliant_lanczos_result *result,
                                                           pliant_error *err);
