// words.h: the words of one line of a contact script: numbers, names, vertices, refusals.
//
// Words are separated by blanks and tabs. Every refusal says where, what was expected and what was
// found; columns count characters, not bytes.
#pragma once

#include "pliant/script.h"

typedef struct pliant_words {
    const char *text;   // the line, `length` bytes without its comment
    size_t length, at;  // at: where the next word is looked for
    const char *name;   // of the script
    int64_t line;
    pliant_error *err;
} pliant_words;

typedef struct pliant_word {
    const char *text;
    size_t length;  // 0 at the end of the line
} pliant_word;

pliant_word pliant_words_peek(pliant_words *c);  // the next word, which stays the next
pliant_word pliant_words_take(pliant_words *c);
int pliant_word_is(pliant_word w, const char *text);  // 1: the same
// Characters before an offset, plus one. Bytes that are no UTF-8 count one each.
int32_t pliant_words_column(const char *text, size_t offset);
// "name:line:column: expected ..., found ..." of a word of this line; returns `status`.
PLIANT_UNUSED_RESULT pliant_status pliant_words_refuse(pliant_words *c, pliant_status status,
                                                       pliant_word w, const char *expected);

// Take what is named, or refuse. Numbers are finite, also in single precision.
PLIANT_UNUSED_RESULT pliant_status pliant_words_number(pliant_words *c, const char *expected,
                                                       double *value);
PLIANT_UNUSED_RESULT pliant_status pliant_words_positive(pliant_words *c, const char *expected,
                                                         double *value);
PLIANT_UNUSED_RESULT pliant_status pliant_words_not_negative(pliant_words *c, const char *expected,
                                                             double *value);
PLIANT_UNUSED_RESULT pliant_status pliant_words_vector(pliant_words *c, double value[3]);
PLIANT_UNUSED_RESULT pliant_status pliant_words_integer(pliant_words *c, const char *expected,
                                                        int64_t least, int64_t limit,
                                                        int64_t *value);
PLIANT_UNUSED_RESULT pliant_status pliant_words_name(pliant_words *c,
                                                     char name[PLIANT_SCRIPT_NAME_LIMIT]);
PLIANT_UNUSED_RESULT pliant_status pliant_words_label(pliant_words *c, const char *label);
// [L:] before K, source K or near X Y Z
PLIANT_UNUSED_RESULT pliant_status pliant_words_vertex(pliant_words *c, pliant_vertex_name *vertex);
