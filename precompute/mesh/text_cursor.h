// text_cursor.h: words of a text in memory, line by line, with the place for messages.
//
// The text need not end in a zero byte. Lines end in LF, CRLF or CR. Nothing is allocated.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

typedef struct pliant_text_word {
    const char *text; // NULL: there is none; borrowed from the text
    size_t length;
} pliant_text_word;

typedef struct pliant_text_cursor {
    const char *name;       // of the file, for messages; borrowed
    const char *at, *end;   // what is left
    const char *line_start; // for columns
    int64_t line;           // the first is 1
    char comment;           // from it on the line is not read; 0: none
    char continuation;      // before a line end it joins the next line; 0: none
} pliant_text_cursor;

// `text` and `name` are borrowed as long as the cursor is used. A UTF-8 byte order mark is passed.
pliant_text_cursor pliant_text_cursor_begin(const char *name, const char *text, size_t size);

// The next word of this line, up to white space; text NULL at the end of the line.
pliant_text_word pliant_text_cursor_word(pliant_text_cursor *cursor);
// Pass the rest of this line. 0 when no line follows.
int pliant_text_cursor_line(pliant_text_cursor *cursor);

// The next word as a finite number; `what` names it in the refusal: "expected the x coordinate".
PLIANT_UNUSED_RESULT pliant_status pliant_text_cursor_number(pliant_text_cursor *cursor,
                                                             const char *what, double *value,
                                                             pliant_error *err);
// The next word as a whole number in [0, 2^62].
PLIANT_UNUSED_RESULT pliant_status pliant_text_cursor_count(pliant_text_cursor *cursor,
                                                            const char *what, int64_t *value,
                                                            pliant_error *err);
// Fill `err` with "name:line: expected WHAT in column C, found 'word'".
pliant_status pliant_text_cursor_refuse(const pliant_text_cursor *cursor, pliant_text_word word,
                                        const char *what, pliant_error *err);

// 1 when the word is the zero-terminated text.
int pliant_text_word_is(pliant_text_word word, const char *text);
// 1 when the word is a decimal number, whatever the locale; also nan, inf, and overflow to
// infinity.
int pliant_text_word_number(pliant_text_word word, double *value);
// 1 when the word is a whole number; beyond +-2^62 it stays there.
int pliant_text_word_integer(pliant_text_word word, int64_t *value);
// The word for a message: printable, quoted, cut to the size; returns `text`.
enum { PLIANT_TEXT_QUOTE_SIZE = 40 };
const char *pliant_text_word_quote(pliant_text_word word, char text[PLIANT_TEXT_QUOTE_SIZE]);
