// utf8.h: is this text UTF-8?
#pragma once

#include <stddef.h>

// Bytes of the well-formed UTF-8 character at text[0 .. length), 1 to 4; 0: none is there.
// Overlong forms, surrogates and numbers beyond U+10FFFF are not well-formed.
int pliant_utf8_character(const char *text, size_t length);

// Offset of the first byte that is not part of well-formed text, or `length`.
size_t pliant_utf8_check(const char *text, size_t length);
