// compression.h: wavelet compression of one Green's function block as its columns stream by.
//
// Columns come in groups, nodal and exact; either the paper's threshold decides at once what is kept
// (GF-31..33), or they are spooled and threshold_search.h finds the sparsest set that stays under the
// errors asked for. One rank holds whole columns; MPI only sums up counts and errors.
#pragma once

#include "kept_set.h"
#include "spool.h"

#include "pliant/wavelet.h"

#include <mpi.h>

// Columns are transformed in groups, interleaved: it keeps the vector units full.
#define PLIANT_COLUMN_GROUP 8

typedef struct pliant_compression_def {
    double eps;  // > 0: the paper's threshold; 0: the targets below
    double rms;  // bound on GF-70, 0: none
    double max;  // bound on GF-71, 0: none
} pliant_compression_def;

typedef struct pliant_compression pliant_compression;  // one block, one rank's columns

// What was achieved, over all ranks.
typedef struct pliant_compression_result {
    uint64_t kept, dense;    // blocks
    double rms, max;         // GF-70, GF-71, of what is stored
} pliant_compression_result;

// `wavelet` (the row domain's) is borrowed until destroy; the spool goes to `folder`, which may be
// NULL with the paper's threshold: no spool then.
PLIANT_UNUSED_RESULT pliant_status pliant_compression_create(const pliant_wavelet *wavelet,
                                                             const pliant_compression_def *def,
                                                             const char *folder,
                                                             pliant_compression **compression,
                                                             pliant_error *err);
// The same with columns in `file` (borrowed until settle), so that a later run can go on: what a
// search or refinement reads in one of its streams, what the paper's rule keeps in another. `use`
// says whether coarser levels will be refined from these columns.
typedef enum pliant_compression_use {
    PLIANT_COMPRESSION_ALONE,
    PLIANT_COMPRESSION_REFINED
} pliant_compression_use;
PLIANT_UNUSED_RESULT pliant_status pliant_compression_create_in(
    const pliant_wavelet *wavelet, const pliant_compression_def *def, pliant_compression_use use,
    pliant_column_file *file, const int32_t streams[2], pliant_compression **compression,
    pliant_error *err);
void pliant_compression_destroy(pliant_compression *compression);  // NULL is fine

// Streams that a column goes to, [0] what is read later, [1] what is kept: 1 or 0.
void pliant_compression_streams(const pliant_compression_def *def, pliant_compression_use use,
                                int streams[2]);
// Take in a column from an earlier run: from either stream, NULL where there is none; borrowed
// until destroy. Columns come in the order in which they would have been added.
PLIANT_UNUSED_RESULT pliant_status pliant_compression_restore(pliant_compression *compression,
                                                              const pliant_spooled *spooled,
                                                              const pliant_spooled *kept,
                                                              pliant_error *err);

// Where the caller puts the next group's nodal values: shape [m + 1][3][3][PLIANT_COLUMN_GROUP],
// entry [i][r][c][k] the component r at row node i due to component c of the k-th column. Borrowed.
double *pliant_compression_group(pliant_compression *compression);
// Transform, threshold and spool the group's first `count` columns, named by column position.
PLIANT_UNUSED_RESULT pliant_status pliant_compression_add(pliant_compression *compression,
                                                          const int32_t *columns, int32_t count,
                                                          pliant_error *err);

// Whom `decide` tells what part of it is done, 0 to 1.
void pliant_compression_listen(pliant_compression *compression, void (*tell)(void *context, double part),
                               void *context);
// Collective: decide what is kept, once all columns are in. When a rank fails all return, that rank
// with its status and the others with PLIANT_OK or theirs: agree on it before going on.
PLIANT_UNUSED_RESULT pliant_status pliant_compression_decide(pliant_compression *compression,
                                                             MPI_Comm comm,
                                                             pliant_compression_result *result,
                                                             pliant_error *err);

// The exact columns added here, as floats; borrowed until settle, readable after decide. NULL: none.
const pliant_spool *pliant_compression_spool(const pliant_compression *compression);
// Keep the decision alone: free the work arrays and the spool.
void pliant_compression_settle(pliant_compression *compression);

// What is stored of the columns added here, in that order; borrowed.
const pliant_kept_set *pliant_compression_kept(const pliant_compression *compression);
// The same of the index-th column: returns their number and borrows them (until the next call).
// *column is its position.
int32_t pliant_compression_column(const pliant_compression *compression, int32_t index, int32_t *column,
                                  const int32_t **rows, const float **blocks);
int32_t pliant_compression_column_count(const pliant_compression *compression);
