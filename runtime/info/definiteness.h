// definiteness.h: how definite a model's stored contact compliance is, level by level.
#pragma once

#include "contents.h"
#include "pliant/lanczos.h"

typedef struct pliant_definiteness {
    // Eigenvalues by level, see pliant/compliance.h; steps 0: nothing is stored there.
    pliant_lanczos_result levels[PLIANT_LEVEL_LIMIT + 1];
} pliant_definiteness;

// Recompute them from a model's free-free blocks. PLIANT_ERR_FORMAT: the file says otherwise of
// itself, or its mesh has a vertex without area. Takes about a second for 2562 vertices.
PLIANT_UNUSED_RESULT pliant_status pliant_definiteness_measure(const pliant_contents *contents,
                                                               pliant_definiteness *definiteness,
                                                               pliant_error *err);

// lambda_min / lambda_max of a level.
double pliant_definiteness_ratio(const pliant_lanczos_result *level);
