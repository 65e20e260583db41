// table.h: the user block as it lies on disk: header, section table, checksums.
//
// Little-endian; the structs below are the bytes. formats/README.md is the specification.
#pragma once

#include "pliant/sections.h"

#define PLIANT_MAGIC       "PLIANT\x1a\n"  // 8 bytes; ^Z stops an accidental `type` of the file
#define PLIANT_ENDIAN_MARK 0x01020304u

typedef struct pliant_header {
    char magic[8];
    uint32_t endian;         // PLIANT_ENDIAN_MARK as the writer stores it
    uint32_t version;        // PLIANT_FORMAT_VERSION
    uint64_t file_size;      // bytes
    uint32_t user_block;     // PLIANT_USER_BLOCK
    uint32_t entry_size;     // sizeof(pliant_entry)
    uint32_t section_count;  // entries that follow the header
    uint32_t rest_checksum;  // of all bytes behind the user block that belong to no section
    uint32_t reserved[5];    // 0
    uint32_t checksum;       // of the whole user block, this field taken as 0
} pliant_header;

typedef struct pliant_entry {
    char path[PLIANT_PATH_LIMIT];  // NUL-terminated
    uint16_t type;                 // pliant_section_type
    uint16_t rank;                 // 1 .. 3
    uint32_t checksum;             // of the section's bytes
    uint64_t shape[3];             // 1 beyond the rank
    uint64_t offset;               // in the file; 0 for a section without elements
} pliant_entry;

_Static_assert(sizeof(pliant_header) == 64, "header is 64 bytes on disk");
_Static_assert(sizeof(pliant_entry) == 96, "table entry is 96 bytes on disk");
_Static_assert(sizeof(pliant_header) + PLIANT_SECTION_LIMIT * sizeof(pliant_entry) <=
                   PLIANT_USER_BLOCK,
               "the table fits into the user block");

// Checksum of a user block (PLIANT_USER_BLOCK bytes) for its header's `checksum` field.
uint32_t pliant_table_checksum(const void *user_block);

// Checksum of all bytes of file[PLIANT_USER_BLOCK .. size) outside the given spans, which do not
// overlap and lie inside. Sorts `spans` by offset.
typedef struct pliant_span {
    uint64_t offset, bytes;
} pliant_span;
uint32_t pliant_table_rest_checksum(const void *file, uint64_t size, pliant_span *spans,
                                    int32_t span_count);

// Product of the first `rank` lengths times the type's size; 0 and no effect when it does not fit.
int pliant_table_bytes(pliant_section_type type, int32_t rank, const uint64_t *shape,
                       uint64_t *count, uint64_t *bytes);
