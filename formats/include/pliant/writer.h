// writer.h: write a model or dense file, whole or not at all. Implemented with HDF5.
//
// Create makes PATH.tmp with all sections at their final place and reserves the disk space; commit
// adds the section table and renames it to PATH, which stays as it was until then. The bytes depend
// on nothing but what is written. One writer is one thread's; in an MPI program one rank writes.
// Messages begin with the file's name.
#pragma once

#include "pliant/sections.h"

typedef struct pliant_writer pliant_writer;

// `sections` has shape [section_count] and is copied.
PLIANT_UNUSED_RESULT pliant_status pliant_writer_create(const char *path,
                                                        const pliant_section_def *sections,
                                                        int32_t section_count,
                                                        pliant_writer **writer, pliant_error *err);

// Write the box of elements start[d] .. start[d]+count[d]-1 of a section; `data` is that box,
// row-major, in the section's type. Entries beyond the rank are ignored. Every element must be
// written exactly once before commit.
PLIANT_UNUSED_RESULT pliant_status pliant_writer_write(pliant_writer *writer, const char *path,
                                                       const uint64_t start[3],
                                                       const uint64_t count[3], const void *data,
                                                       pliant_error *err);
// The whole section at once.
PLIANT_UNUSED_RESULT pliant_status pliant_writer_write_all(pliant_writer *writer, const char *path,
                                                           const void *data, pliant_error *err);
// A level's summary (shape [PLIANT_SUMMARY_COUNT]) and the same as attributes of its group.
PLIANT_UNUSED_RESULT pliant_status pliant_writer_write_summary(pliant_writer *writer,
                                                               pliant_block_name block,
                                                               int32_t level, const double *summary,
                                                               pliant_error *err);
// The provenance text (UTF-8 "key = value" lines, NUL-terminated) and its pairs as attributes of
// /provenance. May be shorter than the section: line breaks fill it up.
PLIANT_UNUSED_RESULT pliant_status pliant_writer_write_provenance(pliant_writer *writer,
                                                                  const char *text,
                                                                  pliant_error *err);

// HDF5 attributes of a group ("/mesh"). The runtime does not read them.
PLIANT_UNUSED_RESULT pliant_status pliant_writer_attribute_text(pliant_writer *writer,
                                                                const char *group, const char *name,
                                                                const char *text,
                                                                pliant_error *err);
PLIANT_UNUSED_RESULT pliant_status pliant_writer_attribute_number(pliant_writer *writer,
                                                                  const char *group,
                                                                  const char *name, double value,
                                                                  pliant_error *err);

// Finish: close the HDF5 part, checksums, table, fsync, rename. Ends the writer's life whatever it
// returns; when it refuses, PATH.tmp is gone and PATH as it was.
PLIANT_UNUSED_RESULT pliant_status pliant_writer_commit(pliant_writer *writer, pliant_error *err);
// End without a file: remove PATH.tmp. NULL is fine. Not after commit.
void pliant_writer_abandon(pliant_writer *writer);
