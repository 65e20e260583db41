// reader.h: map a model or dense file and find its sections; needs no HDF5 library.
//
// Open checks the header, the table and the bounds of every section, not the payload (see verify),
// and copies nothing: data pointers lead into a read-only shared mapping, page-aligned, borrowed
// until close. Messages begin with the file's name. A reader is const after open; threads may share
// it. Nobody may shorten the file while it is mapped (the system answers that with SIGBUS); the
// writer never does, it replaces files by renaming.
#pragma once

#include "pliant/sections.h"

typedef struct pliant_reader pliant_reader;

typedef struct pliant_section {
    const char *path;
    pliant_section_type type;
    int32_t rank;
    uint64_t shape[3];  // 1 beyond the rank
    uint64_t count;     // elements: the product of shape
    uint64_t bytes;
    uint64_t offset;    // in the file; 0 when there are no elements
    uint32_t checksum;  // CRC-32C of the bytes
    const void *data;   // never NULL, even when there is nothing to read
} pliant_section;

PLIANT_UNUSED_RESULT pliant_status pliant_reader_open(const char *path, pliant_reader **reader,
                                                      pliant_error *err);
// The same from memory: `bytes`, aligned to 16, is borrowed until close; `name` (copied) stands in
// messages.
PLIANT_UNUSED_RESULT pliant_status pliant_reader_open_memory(const void *bytes, size_t size,
                                                             const char *name,
                                                             pliant_reader **reader,
                                                             pliant_error *err);
void pliant_reader_close(pliant_reader *reader);  // NULL is fine

const char *pliant_reader_name(const pliant_reader *reader);  // as opened, for messages
uint64_t pliant_reader_size(const pliant_reader *reader);     // bytes of the file
int32_t pliant_reader_version(const pliant_reader *reader);   // of the format
int32_t pliant_reader_section_count(const pliant_reader *reader);
const pliant_section *pliant_reader_section(const pliant_reader *reader, int32_t i);
const pliant_section *pliant_reader_find(const pliant_reader *reader, const char *path);  // or NULL

// Recompute the checksum of every section and of the bytes between them (HDF5's own), and name the
// first that differs. Reads every page.
PLIANT_UNUSED_RESULT pliant_status pliant_reader_verify(const pliant_reader *reader,
                                                        pliant_error *err);
