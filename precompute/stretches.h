// stretches.h: the columns that earlier processes of a run have finished, wherever they lie.
//
// A stretch is what one process, of any number of ranks, got done: its files columns.STRETCH.RANK
// are never written again by another. A later stretch begins at a column of its own, at or before
// the end of the one before; from there on the earlier one's columns do not count. So every column
// has one place, however often and wherever runs were killed.
#pragma once

#include "column_file.h"

#include <petscsys.h>

// Streams of columns: two for each block of Green's functions.
enum { PLIANT_PARTIAL_STREAMS = 8 };

// The two domains that columns belong to, in the order in which they are solved for.
typedef enum pliant_column_domain {
    PLIANT_COLUMNS_FREE,
    PLIANT_COLUMNS_FIXED,
    PLIANT_COLUMN_DOMAINS
} pliant_column_domain;

typedef struct pliant_stretch {
    int32_t ranks, first_file;  // its files are first_file .. first_file + ranks - 1
    // By domain: its columns are base .. done - 1 of total.
    int32_t base[PLIANT_COLUMN_DOMAINS], done[PLIANT_COLUMN_DOMAINS], total[PLIANT_COLUMN_DOMAINS];
} pliant_stretch;

typedef struct pliant_column_place {
    int32_t file;  // -1: nowhere
    uint64_t offset;
} pliant_column_place;

typedef struct pliant_stretches {
    // The caller's.
    const char *folder;  // borrowed until clear
    int32_t row_limit;   // no column has more coefficients
    int32_t total[PLIANT_COLUMN_DOMAINS],
        domain[PLIANT_PARTIAL_STREAMS];  // of a stream; -1: not used
    // The same on all ranks, after load.
    pliant_stretch *items;
    int32_t count, file_count;
    uint64_t *ends;                                       // [file_count] bytes that count
    pliant_column_file **files;                           // [file_count]; NULL: empty
    pliant_column_place *places[PLIANT_PARTIAL_STREAMS];  // [total of its domain]
} pliant_stretches;                                       // zeroed but for the caller's: none

void pliant_stretches_path(const char *folder, int32_t stretch, int32_t rank, char *path,
                           size_t size);

// First rank: one more, of `ranks` files.
PLIANT_UNUSED_RESULT pliant_status pliant_stretches_add(pliant_stretches *stretches, int32_t ranks,
                                                        const int32_t base[PLIANT_COLUMN_DOMAINS],
                                                        const int32_t total[PLIANT_COLUMN_DOMAINS],
                                                        pliant_error *err);
// First rank: the last one has come to `done`; ends has its ranks' bytes. 0 when that cannot be.
int pliant_stretches_advance(pliant_stretches *stretches, const int32_t done[PLIANT_COLUMN_DOMAINS],
                             const void *ends, size_t size);
// Collective: the first rank's stretches are everybody's; their files are opened, checked and
// indexed.
PetscErrorCode pliant_stretches_load(MPI_Comm comm, pliant_stretches *stretches, pliant_error *err);
void pliant_stretches_clear(pliant_stretches *stretches);  // none again; the caller's fields stay

// After load: columns of a domain that are there from the first on.
int32_t pliant_stretches_columns(const pliant_stretches *stretches, pliant_column_domain domain);
// 0: nowhere. Borrowed until clear.
int pliant_stretches_find(const pliant_stretches *stretches, int32_t stream, int32_t column,
                          pliant_spooled *found);
