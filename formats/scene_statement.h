// scene_statement.h: the statements of a contact script about lattices.
#pragma once

#include "words.h"

#define PLIANT_SCRIPT_COPIES_LIMIT 1000000  // instances of one statement

// The kind that a keyword begins; PLIANT_STATEMENT_NONE: none of these.
pliant_statement_kind pliant_scene_statement_of(pliant_word w);
const char *pliant_scene_statement_keyword(pliant_statement_kind kind);  // static; NULL: not one
// What stands after the keyword `w`, which pliant_scene_statement_of knows.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_statement_parse(pliant_words *c, pliant_word w,
                                                                pliant_statement *s);
// [instance I]
PLIANT_UNUSED_RESULT pliant_status pliant_scene_statement_instance(pliant_words *c,
                                                                   pliant_statement *s);
// [over COUNT]
PLIANT_UNUSED_RESULT pliant_status pliant_scene_statement_over(pliant_words *c,
                                                               pliant_statement *s);
