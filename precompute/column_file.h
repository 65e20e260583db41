// column_file.h: transformed columns in a file, in the order in which they came; each has a head
// that says what it is and a checksum that says whether it is whole.
//
// A file without a name goes when the process does; one with a name can be read by a later run.
// Columns of several streams may share a file.
#pragma once

#include "pliant/base.h"

typedef struct pliant_column_file pliant_column_file;

typedef struct pliant_spooled {
    int32_t column;       // position in the column domain
    int32_t count;        // coefficients kept
    const int32_t *rows;  // [count] ascending positions in the row domain
    const float *norms;   // [count] |xi~_ij|_F
    const float *blocks;  // [count][3][3]
    double peak;          // max_i |xi_ij|_F of the exact nodal values (GF-32)
    double energy;        // sum_i |xi_ij|_F^2 of the exact nodal values
    // Of a column that the paper's rule has decided on, else 0: sum_i |error_ij|_F^2, and its
    // GF-71.
    double error_energy, error_worst;
} pliant_spooled;

// An empty file without a name in `folder`; messages name the folder.
PLIANT_UNUSED_RESULT pliant_status pliant_column_file_create_temporary(const char *folder,
                                                                       pliant_column_file **file,
                                                                       pliant_error *err);
// An empty file at `path`, in place of what is there; messages name it.
PLIANT_UNUSED_RESULT pliant_status pliant_column_file_create(const char *path,
                                                             pliant_column_file **file,
                                                             pliant_error *err);
// The first `bytes` of a file, mapped for reading. PLIANT_ERR_FORMAT: it is shorter.
PLIANT_UNUSED_RESULT pliant_status pliant_column_file_open(const char *path, uint64_t bytes,
                                                           pliant_column_file **file,
                                                           pliant_error *err);
void pliant_column_file_destroy(pliant_column_file *file);  // NULL is fine; a name stays

// Add a column to a stream (0, 1, ...); its arrays are copied out. *offset is where it begins.
PLIANT_UNUSED_RESULT pliant_status pliant_column_file_append(pliant_column_file *file,
                                                             int32_t stream,
                                                             const pliant_spooled *column,
                                                             uint64_t *offset, pliant_error *err);
uint64_t pliant_column_file_bytes(const pliant_column_file *file);
// Wait until everything added is on the disk.
PLIANT_UNUSED_RESULT pliant_status pliant_column_file_sync(pliant_column_file *file,
                                                           pliant_error *err);
// Map what is there for reading. Nothing may be added any more; again is fine.
PLIANT_UNUSED_RESULT pliant_status pliant_column_file_map(pliant_column_file *file,
                                                          pliant_error *err);

// Of a mapped file: the column that begins at `offset`; pointers are borrowed until destroy.
pliant_spooled pliant_column_file_at(const pliant_column_file *file, uint64_t offset);
// The column at *offset, which moves on; 0 at the end of the file, or where no column of `rows`
// rows at most begins. Its checksum is not looked at.
int pliant_column_file_next(const pliant_column_file *file, int32_t rows, uint64_t *offset,
                            int32_t *stream, pliant_spooled *column);
// Is the column at `offset`, which next has found there, as it was written?
int pliant_column_file_is_whole(const pliant_column_file *file, uint64_t offset);
