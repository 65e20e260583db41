// spool.h: the transformed columns of one Green's function block, on disk, one rank's share.
//
// Columns arrive once, in any order, and are read many times while the thresholds are sought. They
// lie in a file of the spool's own, without a name, that goes when the process does; or in one that
// outlives it (partial.h), together with other spools' and with what an earlier run had solved.
#pragma once

#include "column_file.h"

typedef struct pliant_spool pliant_spool;

// A spool in `folder`. Messages name the folder.
PLIANT_UNUSED_RESULT pliant_status pliant_spool_create(const char *folder, pliant_spool **spool,
                                                       pliant_error *err);
// A spool that adds its columns to a stream of `file`, which is borrowed until destroy.
PLIANT_UNUSED_RESULT pliant_status pliant_spool_create_in(pliant_column_file *file, int32_t stream,
                                                          pliant_spool **spool, pliant_error *err);
void pliant_spool_destroy(pliant_spool *spool);  // NULL is fine

// Add a column; its arrays are copied out.
PLIANT_UNUSED_RESULT pliant_status pliant_spool_append(pliant_spool *spool,
                                                       const pliant_spooled *column,
                                                       pliant_error *err);
// Take in a column that lies elsewhere already; its arrays are borrowed until destroy.
PLIANT_UNUSED_RESULT pliant_status pliant_spool_adopt(pliant_spool *spool,
                                                      const pliant_spooled *column,
                                                      pliant_error *err);
// No more columns, in any spool of the file: map it for reading.
PLIANT_UNUSED_RESULT pliant_status pliant_spool_seal(pliant_spool *spool, pliant_error *err);

// After seal, in the order in which they came. Pointers are borrowed until destroy.
int32_t pliant_spool_column_count(const pliant_spool *spool);
pliant_spooled pliant_spool_column(const pliant_spool *spool, int32_t index);
