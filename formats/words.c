// words.c: the words of one line of a contact script.
#include "words.h"

#include "pliant/error.h"
#include "pliant/utf8.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Words and refusals ----

pliant_word pliant_words_peek(pliant_words *c)
{
    while (c->at < c->length && (c->text[c->at] == ' ' || c->text[c->at] == '\t')) c->at++;
    size_t end = c->at;
    while (end < c->length && c->text[end] != ' ' && c->text[end] != '\t') end++;
    return (pliant_word){.text = c->text + c->at, .length = end - c->at};
}

pliant_word pliant_words_take(pliant_words *c)
{
    const pliant_word w = pliant_words_peek(c);
    c->at += w.length;
    return w;
}

int pliant_word_is(pliant_word w, const char *text)
{
    return w.length == strlen(text) && memcmp(w.text, text, w.length) == 0;
}

// Characters before an offset, plus one. Bytes that are no UTF-8 count one each.
int32_t pliant_words_column(const char *text, size_t offset)
{
    int32_t column = 1;
    for (size_t at = 0; at < offset; column++) {
        const int size = pliant_utf8_character(text + at, offset - at);
        at += size > 0 ? (size_t)size : 1;
    }
    return column;
}

pliant_status pliant_words_refuse(pliant_words *c, pliant_status status, pliant_word w,
                                  const char *expected)
{
    char found[64] = "the end of the line";
    if (w.length > 0) {
        // A long word is cut between characters.
        size_t keep = 0;
        while (keep < w.length) {
            const int size = pliant_utf8_character(w.text + keep, w.length - keep);
            if (size == 0 || keep + (size_t)size > 40) break;
            keep += (size_t)size;
        }
        found[0] = '"';
        memcpy(found + 1, w.text, keep);
        strcpy(found + 1 + keep, keep < w.length ? "...\"" : "\"");
    }
    return pliant_error_set(
        c->err, status, "%.300s:%lld:%d: expected %s, found %s", c->name, (long long)c->line,
        (int)pliant_words_column(c->text, (size_t)(w.text - c->text)), expected, found);
}

// ---- Numbers and names ----

static size_t count_digits(const char *text)
{
    size_t count = 0;
    while (text[count] >= '0' && text[count] <= '9') count++;
    return count;
}

// [+-] digits [. digits] [e [+-] digits], with a digit before the exponent; strtod alone would take
// nan, inf and hexadecimal forms.
static int is_decimal(const char *text)
{
    if (*text == '+' || *text == '-') text++;
    size_t digits = count_digits(text);
    text += digits;
    if (*text == '.') {
        const size_t fraction = count_digits(++text);
        text += fraction;
        digits += fraction;
    }
    if (digits == 0) return 0;
    if (*text == 'e' || *text == 'E') {
        text++;
        if (*text == '+' || *text == '-') text++;
        const size_t exponent = count_digits(text);
        if (exponent == 0) return 0;
        text += exponent;
    }
    return *text == 0;
}

pliant_status pliant_words_number(pliant_words *c, const char *expected, double *value)
{
    char text[PLIANT_SCRIPT_LINE_LIMIT + 1];
    const pliant_word w = pliant_words_take(c);
    memcpy(text, w.text, w.length);
    text[w.length] = 0;
    if (!is_decimal(text)) return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, expected);
    char *end;
    const double found = strtod(text, &end);
    // The solver's numbers are floats; what they cannot hold is not finite there.
    if (*end != 0 || !(fabs(found) <= FLT_MAX))
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, "a number within +-3.4e38");
    *value = found;
    return PLIANT_OK;
}

pliant_status pliant_words_vector(pliant_words *c, double value[3])
{
    static const char *const expected[3] = {"x, a number", "y, a number", "z, a number"};
    for (int d = 0; d < 3; d++) {
        const pliant_status status = pliant_words_number(c, expected[d], &value[d]);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

// Digits only, up to `limit`; returns the bytes read, 0 when it is no such number.
static size_t read_integer(const char *text, size_t length, int64_t limit, int64_t *value)
{
    int64_t number = 0;
    size_t i = 0;
    for (; i < length && text[i] >= '0' && text[i] <= '9'; i++) {
        const int digit = text[i] - '0';
        if (number > (limit - digit) / 10) return 0;
        number = 10 * number + digit;
    }
    *value = number;
    return i;
}

pliant_status pliant_words_integer(pliant_words *c, const char *expected, int64_t least,
                                   int64_t limit, int64_t *value)
{
    const pliant_word w = pliant_words_take(c);
    if (w.length == 0 || read_integer(w.text, w.length, limit, value) != w.length || *value < least)
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, expected);
    return PLIANT_OK;
}

// Letters, digits, "_", "-", "." and every character beyond ASCII: no quoting in CSV or JSON.
static int is_name(pliant_word w)
{
    for (size_t i = 0; i < w.length; i++) {
        const unsigned char x = (unsigned char)w.text[i];
        if (!((x >= 'a' && x <= 'z') || (x >= 'A' && x <= 'Z') || (x >= '0' && x <= '9') ||
              x == '_' || x == '-' || x == '.' || x >= 0x80))
            return 0;
    }
    return w.length > 0;
}

pliant_status pliant_words_name(pliant_words *c, char name[PLIANT_SCRIPT_NAME_LIMIT])
{
    const pliant_word w = pliant_words_take(c);
    if (!is_name(w))
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, "a name of letters, digits, _ - .");
    if (w.length >= PLIANT_SCRIPT_NAME_LIMIT)
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, "a name of at most 63 bytes");
    memcpy(name, w.text, w.length);
    name[w.length] = 0;
    return PLIANT_OK;
}

// [L:] before K, source K or near X Y Z
pliant_status pliant_words_vertex(pliant_words *c, pliant_vertex_name *vertex)
{
    static const char expected[] = "a vertex: [L:]K, [L:]source K or [L:]near X Y Z";
    const pliant_word whole = pliant_words_take(c);
    int64_t number = 0;
    size_t length = read_integer(whole.text, whole.length, INT32_MAX, &number);
    pliant_word place = whole;
    if (length > 0 && length < whole.length && whole.text[length] == ':') {
        vertex->has_level = 1;
        vertex->level = (int32_t)number;
        place.text += length + 1;
        place.length -= length + 1;
        length = read_integer(place.text, place.length, INT32_MAX, &number);
    }
    if (pliant_word_is(place, "near")) {
        vertex->kind = PLIANT_VERTEX_NEAR;
        return pliant_words_vector(c, vertex->position);
    }
    if (pliant_word_is(place, "source")) {
        vertex->kind = PLIANT_VERTEX_SOURCE;
        const pliant_status status = pliant_words_integer(
            c, "the number of a vertex of the input mesh", 0, INT32_MAX, &number);
        if (status == PLIANT_OK) vertex->number = (int32_t)number;
        return status;
    }
    if (length == 0 || length != place.length)
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, whole, expected);
    vertex->kind = PLIANT_VERTEX_MODEL;
    vertex->number = (int32_t)number;
    return PLIANT_OK;
}

// A number that is above zero, or may be zero.
pliant_status pliant_words_positive(pliant_words *c, const char *expected, double *value)
{
    const pliant_word w = pliant_words_peek(c);
    const pliant_status status = pliant_words_number(c, expected, value);
    return status == PLIANT_OK && !(*value > 0)
               ? pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, expected)
               : status;
}

pliant_status pliant_words_not_negative(pliant_words *c, const char *expected, double *value)
{
    const pliant_word w = pliant_words_peek(c);
    const pliant_status status = pliant_words_number(c, expected, value);
    return status == PLIANT_OK && *value < 0
               ? pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, expected)
               : status;
}

// What stands before a number.
pliant_status pliant_words_label(pliant_words *c, const char *label)
{
    const pliant_word w = pliant_words_take(c);
    return pliant_word_is(w, label) ? PLIANT_OK
                                    : pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, label);
}
