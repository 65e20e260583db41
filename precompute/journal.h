// journal.h: a file of records that grows at its end and is true to the last whole record, whatever
// moment its writer died.
//
// A record is a head (type, size, checksum) and its bytes. Reading stops at the first record that
// is not whole: that and what follows is what a dying writer left, and is cut off before the next
// is added.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

typedef struct pliant_journal pliant_journal;

typedef struct pliant_journal_record {
    int32_t type;
    uint32_t size;      // bytes
    const void *bytes;  // 8-byte aligned; borrowed until the next append, or destroy
} pliant_journal_record;

// Open the journal at `path` for adding records, or make an empty one; what it has is read. A tail
// that is not whole is cut off. Only one process has it: PLIANT_ERR_ARGUMENT while another does;
// PLIANT_ERR_FORMAT: not a journal; PLIANT_ERR_IO. Messages name the file.
PLIANT_UNUSED_RESULT pliant_status pliant_journal_open(const char *path, pliant_journal **journal,
                                                       pliant_error *err);
void pliant_journal_close(pliant_journal *journal);  // NULL is fine

// Add a record, not yet on the disk for sure.
PLIANT_UNUSED_RESULT pliant_status pliant_journal_append(pliant_journal *journal, int32_t type,
                                                         const void *bytes, size_t size,
                                                         pliant_error *err);
// Wait until everything added is on the disk. What it tells of must be there before.
PLIANT_UNUSED_RESULT pliant_status pliant_journal_sync(pliant_journal *journal, pliant_error *err);

// The record at *position (0: the first), which moves on. Returns 0 at the end. Records read at
// opening only, not those added since.
int pliant_journal_next(const pliant_journal *journal, size_t *position,
                        pliant_journal_record *record);
