// text_cursor.c: words of a text in memory, line by line, with the place for messages.
#include "text_cursor.h"

#include "pliant/error.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    // Numbers are copied for strtod, which wants a zero byte at the end. The longest exact decimal
    // of
    // a double has 767 significant digits; nobody writes more.
    NUMBER_LENGTH_LIMIT = 1100,
};
#define INTEGER_LIMIT ((int64_t)1 << 62)

pliant_text_cursor pliant_text_cursor_begin(const char *name, const char *text, size_t size)
{
    const size_t mark = size >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    return (pliant_text_cursor){
        .name = name, .at = text + mark, .end = text + size, .line_start = text + mark, .line = 1};
}

static int is_line_end(char c)
{
    return c == '\n' || c == '\r';
}

static int is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

// Pass the line end that stands at `at`.
static void pass_line_end(pliant_text_cursor *c)
{
    if (*c->at == '\r' && c->end - c->at > 1 && c->at[1] == '\n') c->at++;
    c->at++;
    c->line++;
    c->line_start = c->at;
}

static int continues(const pliant_text_cursor *c)
{
    return c->continuation && *c->at == c->continuation && c->end - c->at > 1 &&
           is_line_end(c->at[1]);
}

static void pass_to_line_end(pliant_text_cursor *c)
{
    while (c->at < c->end && !is_line_end(*c->at)) c->at++;
}

pliant_text_word pliant_text_cursor_word(pliant_text_cursor *c)
{
    for (; c->at < c->end; c->at++) {
        if (continues(c)) {
            c->at++;
            pass_line_end(c);
            c->at--;
        } else if (!is_blank(*c->at)) {
            break;
        }
    }
    if (c->at < c->end && c->comment && *c->at == c->comment) pass_to_line_end(c);
    if (c->at == c->end || is_line_end(*c->at)) return (pliant_text_word){NULL, 0};
    const char *start = c->at;
    while (c->at < c->end && !is_blank(*c->at) && !is_line_end(*c->at) && !continues(c) &&
           !(c->comment && *c->at == c->comment))
        c->at++;
    return (pliant_text_word){start, (size_t)(c->at - start)};
}

int pliant_text_cursor_line(pliant_text_cursor *c)
{
    // A comment does not continue: a path in it may well end in a backslash.
    while (c->at < c->end && !is_line_end(*c->at)) {
        if (c->comment && *c->at == c->comment) {
            pass_to_line_end(c);
        } else if (continues(c)) {
            c->at++;
            pass_line_end(c);
        } else {
            c->at++;
        }
    }
    if (c->at == c->end) return 0;
    pass_line_end(c);
    return c->at < c->end;
}

int pliant_text_word_is(pliant_text_word word, const char *text)
{
    return word.text && word.length == strlen(text) && memcmp(word.text, text, word.length) == 0;
}

const char *pliant_text_word_quote(pliant_text_word word, char text[PLIANT_TEXT_QUOTE_SIZE])
{
    static const char cut[] = "...'";
    const size_t room = PLIANT_TEXT_QUOTE_SIZE - 1 - sizeof cut;
    const size_t length = word.length < room ? word.length : room;
    text[0] = '\'';
    for (size_t i = 0; i < length; i++)
        text[1 + i] = word.text[i] >= 0x20 && word.text[i] < 0x7f ? word.text[i] : '?';
    memcpy(text + 1 + length, length < word.length ? cut : "'", length < word.length ? 5 : 2);
    return text;
}

pliant_status pliant_text_cursor_refuse(const pliant_text_cursor *c, pliant_text_word word,
                                        const char *what, pliant_error *err)
{
    char quote[PLIANT_TEXT_QUOTE_SIZE];
    if (!word.text)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s:%lld: expected %s, found the end of the %s", c->name,
                                (long long)c->line, what, c->at == c->end ? "file" : "line");
    return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s:%lld: expected %s in column %lld, found %s",
                            c->name, (long long)c->line, what,
                            (long long)(word.text - c->line_start) + 1,
                            pliant_text_word_quote(word, quote));
}

pliant_status pliant_text_cursor_number(pliant_text_cursor *c, const char *what, double *value,
                                        pliant_error *err)
{
    const pliant_text_word word = pliant_text_cursor_word(c);
    double number;
    if (!word.text || !pliant_text_word_number(word, &number))
        return pliant_text_cursor_refuse(c, word, what, err);
    if (!isfinite(number)) {
        char quote[PLIANT_TEXT_QUOTE_SIZE];
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s:%lld: %s is not finite: %s", c->name,
                                (long long)c->line, what, pliant_text_word_quote(word, quote));
    }
    *value = number;
    return PLIANT_OK;
}

pliant_status pliant_text_cursor_count(pliant_text_cursor *c, const char *what, int64_t *value,
                                       pliant_error *err)
{
    const pliant_text_word word = pliant_text_cursor_word(c);
    int64_t number;
    if (!word.text || !pliant_text_word_integer(word, &number) || number < 0)
        return pliant_text_cursor_refuse(c, word, what, err);
    *value = number;
    return PLIANT_OK;
}

int pliant_text_word_integer(pliant_text_word word, int64_t *value)
{
    size_t i = 0;
    const int minus = word.length && word.text[0] == '-';
    if (word.length && (word.text[0] == '-' || word.text[0] == '+')) i++;
    if (i == word.length) return 0;
    int64_t number = 0;
    for (; i < word.length; i++) {
        const int digit = word.text[i] - '0';
        if (digit < 0 || digit > 9) return 0;
        number = number > (INTEGER_LIMIT - digit) / 10 ? INTEGER_LIMIT : 10 * number + digit;
    }
    *value = minus ? -number : number;
    return 1;
}

// strtod in the C locale: a program that set a locale with a decimal comma reads the same file.
static double convert_slowly(pliant_text_word word)
{
    char copy[NUMBER_LENGTH_LIMIT + 1];
    memcpy(copy, word.text, word.length);
    copy[word.length] = 0;
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    const double value = plain ? strtod_l(copy, NULL, plain) : strtod(copy, NULL);
    if (plain) freelocale(plain);
    return value;
}

static int is_word(const char *text, size_t length, const char *lower)
{
    if (length != strlen(lower)) return 0;
    for (size_t i = 0; i < length; i++)
        if ((text[i] | 0x20) != lower[i]) return 0;
    return 1;
}

int pliant_text_word_number(pliant_text_word word, double *value)
{
    // Exact powers of ten: with a mantissa below 2^53 one multiplication or division rounds once,
    // so the result is the nearest double (W. D. Clinger, How to read floating point numbers
    // accurately, 1990). Everything else goes to strtod.
    static const double power[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                   1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                   1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const char *at = word.text, *end = word.text + word.length;
    if (word.length == 0 || word.length > NUMBER_LENGTH_LIMIT) return 0;
    const int minus = *at == '-';
    if (*at == '-' || *at == '+') at++;
    const size_t rest = (size_t)(end - at);
    if (is_word(at, rest, "nan") || is_word(at, rest, "-nan") || is_word(at, rest, "nan(ind)")) {
        *value = NAN;
        return 1;
    }
    if (is_word(at, rest, "inf") || is_word(at, rest, "infinity")) {
        *value = minus ? -INFINITY : INFINITY;
        return 1;
    }
    uint64_t mantissa = 0;
    int digits = 0, exact = 1, exponent = 0;
    for (int fraction = 0; at < end; at++) {
        if (*at == '.' && !fraction) {
            fraction = 1;
            continue;
        }
        if (*at < '0' || *at > '9') break;
        digits++;
        if (mantissa > (UINT64_C(1) << 53) / 10 - 1) exact = 0;
        else mantissa = 10 * mantissa + (uint64_t)(*at - '0');
        exponent -= fraction;
    }
    if (digits == 0) return 0;
    if (at < end && (*at == 'e' || *at == 'E')) {
        int64_t written;
        const pliant_text_word tail = {at + 1, (size_t)(end - at - 1)};
        if (!pliant_text_word_integer(tail, &written)) return 0;
        if (written < -100000 || written > 100000) exact = 0;
        else exponent += (int)written;
        at = end;
    }
    if (at != end) return 0;
    if (exact && exponent >= -22 && exponent <= 22) {
        const double m = (double)mantissa;
        const double v = exponent < 0 ? m / power[-exponent] : m * power[exponent];
        *value = minus ? -v : v;
    } else {
        *value = convert_slowly(word);
    }
    return 1;
}
