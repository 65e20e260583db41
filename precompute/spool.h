// spool.h: the transformed columns of one Green's function block, on disk, one rank's share.
//
// Columns arrive once, in any order, and are read many times while the thresholds are sought. The
// file has no name: it goes when the process does, however that ends.
#pragma once

#include "pliant/base.h"

typedef struct pliant_spool pliant_spool;

typedef struct pliant_spooled {
    int32_t column;        // position in the column domain
    int32_t count;         // coefficients kept
    const int32_t *rows;   // [count] ascending positions in the row domain
    const float *norms;    // [count] |xi~_ij|_F
    const float *blocks;   // [count][3][3]
    double peak;           // max_i |xi_ij|_F of the exact nodal values (GF-32)
    double energy;         // sum_i |xi_ij|_F^2 of the exact nodal values
} pliant_spooled;

// A spool in `folder`. Messages name the folder.
PLIANT_UNUSED_RESULT pliant_status pliant_spool_create(const char *folder, pliant_spool **spool,
                                                       pliant_error *err);
void pliant_spool_destroy(pliant_spool *spool);  // NULL is fine

// Add a column; its arrays are copied out.
PLIANT_UNUSED_RESULT pliant_status pliant_spool_append(pliant_spool *spool,
                                                       const pliant_spooled *column,
                                                       pliant_error *err);
// No more columns: map the file for reading.
PLIANT_UNUSED_RESULT pliant_status pliant_spool_seal(pliant_spool *spool, pliant_error *err);

// After seal. Pointers are borrowed until destroy.
int32_t pliant_spool_column_count(const pliant_spool *spool);
pliant_spooled pliant_spool_column(const pliant_spool *spool, int32_t index);
