// utf8.c: well-formed UTF-8, as RFC 3629 section 4 defines it.
#include "pliant/utf8.h"

int pliant_utf8_character(const char *text, size_t length)
{
    if (length == 0) return 0;
    const unsigned char *c = (const unsigned char *)text;
    if (c[0] < 0x80) return 1;
    int size;
    unsigned char low = 0x80, high = 0xbf;  // of the second byte
    if (c[0] >= 0xc2 && c[0] <= 0xdf) {
        size = 2;
    } else if (c[0] >= 0xe0 && c[0] <= 0xef) {
        size = 3;
        if (c[0] == 0xe0) low = 0xa0;
        if (c[0] == 0xed) high = 0x9f;
    } else if (c[0] >= 0xf0 && c[0] <= 0xf4) {
        size = 4;
        if (c[0] == 0xf0) low = 0x90;
        if (c[0] == 0xf4) high = 0x8f;
    } else {
        return 0;
    }
    if (length < (size_t)size || c[1] < low || c[1] > high) return 0;
    for (int i = 2; i < size; i++)
        if (c[i] < 0x80 || c[i] > 0xbf) return 0;
    return size;
}

size_t pliant_utf8_check(const char *text, size_t length)
{
    size_t at = 0;
    while (at < length) {
        const int size = pliant_utf8_character(text + at, length - at);
        if (size == 0) return at;
        at += (size_t)size;
    }
    return length;
}
