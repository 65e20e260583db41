// contents.h: an opened file of any kind that Pliant writes, bound and ready to be described.
#pragma once

#include "pliant/dense_view.h"
#include "pliant/hierarchy.h"
#include "pliant/model_view.h"

typedef enum pliant_contents_kind {
    PLIANT_CONTENTS_MODEL,
    PLIANT_CONTENTS_DENSE,
    PLIANT_CONTENTS_RECORDING,  // frames of pliant-play
    PLIANT_CONTENTS_OTHER,      // sections under unknown names
} pliant_contents_kind;

typedef struct pliant_contents {
    pliant_contents_kind kind;
    pliant_reader *reader;    // owned
    pliant_model_view model;  // of a model
    pliant_dense_view dense;  // of a dense file
    const char *text;         // provenance, not NUL-terminated; borrowed from reader
    size_t text_bytes;
} pliant_contents;

// Open and bind. Close takes what open has filled.
PLIANT_UNUSED_RESULT pliant_status pliant_contents_open(const char *path, pliant_contents *contents,
                                                        pliant_error *err);
void pliant_contents_close(pliant_contents *contents);

// Every checksum (binding has checked every index) and, of a model, the topology of its levels.
PLIANT_UNUSED_RESULT pliant_status pliant_contents_verify(const pliant_contents *contents,
                                                          pliant_error *err);

// The levels of a model's mesh; refusals begin with the file's name.
PLIANT_UNUSED_RESULT pliant_status pliant_contents_hierarchy(const pliant_contents *contents,
                                                             pliant_hierarchy **hierarchy,
                                                             pliant_error *err);

const char *pliant_contents_kind_text(pliant_contents_kind kind);  // "model", ...; static

// The next "key = value" line of the provenance at *at, or 0 at the end. Lines without " = " have
// an empty key.
typedef struct pliant_contents_pair {
    const char *key, *value;  // not NUL-terminated
    size_t key_bytes, value_bytes;
} pliant_contents_pair;
int pliant_contents_next_pair(const pliant_contents *contents, size_t *at,
                              pliant_contents_pair *pair);
