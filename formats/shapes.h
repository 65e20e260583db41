// shapes.h: the shapes of tools and obstacles, as words of a contact script.
#pragma once

#include "words.h"

pliant_shape_kind pliant_shape_of(pliant_word w);  // NONE: no shape's keyword
// "sphere", ...; static
const char *pliant_shape_keyword(pliant_shape_kind kind);
// What stands after the keyword `w`, which pliant_shape_of knows.
PLIANT_UNUSED_RESULT pliant_status pliant_shape_parse(pliant_words *c, pliant_word w,
                                                      pliant_statement *s);
// [friction MU]
PLIANT_UNUSED_RESULT pliant_status pliant_shape_parse_friction(pliant_words *c,
                                                               pliant_statement *s);
