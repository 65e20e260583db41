// statement.c: parse one line of a contact script (formats/README.md has the grammar).
//
// Words are separated by blanks and tabs; "#" begins a comment. Every refusal says where, what was
// expected and what was found; columns count characters, not bytes.
#include "pliant/script.h"

#include "pliant/error.h"
#include "pliant/utf8.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct cursor {
    const char *text;   // the line, `length` bytes without its comment
    size_t length, at;  // at: where the next word is looked for
    const char *name;
    int64_t line;
    pliant_error *err;
} cursor;

typedef struct word {
    const char *text;
    size_t length;  // 0 at the end of the line
} word;

// ---- Words and refusals ----

static word peek(cursor *c)
{
    while (c->at < c->length && (c->text[c->at] == ' ' || c->text[c->at] == '\t')) c->at++;
    size_t end = c->at;
    while (end < c->length && c->text[end] != ' ' && c->text[end] != '\t') end++;
    return (word){.text = c->text + c->at, .length = end - c->at};
}

static word take(cursor *c)
{
    const word w = peek(c);
    c->at += w.length;
    return w;
}

static int is_word(word w, const char *text)
{
    return w.length == strlen(text) && memcmp(w.text, text, w.length) == 0;
}

// Characters before an offset, plus one. Bytes that are no UTF-8 count one each.
static int32_t column_of(const char *text, size_t offset)
{
    int32_t column = 1;
    for (size_t at = 0; at < offset; column++) {
        const int size = pliant_utf8_character(text + at, offset - at);
        at += size > 0 ? (size_t)size : 1;
    }
    return column;
}

static pliant_status refuse(cursor *c, pliant_status status, word w, const char *expected)
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
    return pliant_error_set(c->err, status, "%.300s:%lld:%d: expected %s, found %s", c->name,
                            (long long)c->line, (int)column_of(c->text, (size_t)(w.text - c->text)),
                            expected, found);
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

static pliant_status parse_number(cursor *c, const char *expected, double *value)
{
    char text[PLIANT_SCRIPT_LINE_LIMIT + 1];
    const word w = take(c);
    memcpy(text, w.text, w.length);
    text[w.length] = 0;
    if (!is_decimal(text)) return refuse(c, PLIANT_ERR_FORMAT, w, expected);
    char *end;
    const double found = strtod(text, &end);
    // The solver's numbers are floats; what they cannot hold is not finite there.
    if (*end != 0 || !(fabs(found) <= FLT_MAX))
        return refuse(c, PLIANT_ERR_FORMAT, w, "a number within +-3.4e38");
    *value = found;
    return PLIANT_OK;
}

static pliant_status parse_vector(cursor *c, double value[3])
{
    static const char *const expected[3] = {"x, a number", "y, a number", "z, a number"};
    for (int d = 0; d < 3; d++) {
        const pliant_status status = parse_number(c, expected[d], &value[d]);
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

static pliant_status parse_integer(cursor *c, const char *expected, int64_t least, int64_t limit,
                                   int64_t *value)
{
    const word w = take(c);
    if (w.length == 0 || read_integer(w.text, w.length, limit, value) != w.length || *value < least)
        return refuse(c, PLIANT_ERR_FORMAT, w, expected);
    return PLIANT_OK;
}

// Letters, digits, "_", "-", "." and every character beyond ASCII: no quoting in CSV or JSON.
static int is_name(word w)
{
    for (size_t i = 0; i < w.length; i++) {
        const unsigned char x = (unsigned char)w.text[i];
        if (!((x >= 'a' && x <= 'z') || (x >= 'A' && x <= 'Z') || (x >= '0' && x <= '9') ||
              x == '_' || x == '-' || x == '.' || x >= 0x80))
            return 0;
    }
    return w.length > 0;
}

static pliant_status parse_name(cursor *c, pliant_statement *s)
{
    const word w = take(c);
    if (!is_name(w)) return refuse(c, PLIANT_ERR_FORMAT, w, "a name of letters, digits, _ - .");
    if (w.length >= sizeof s->name)
        return refuse(c, PLIANT_ERR_FORMAT, w, "a name of at most 63 bytes");
    memcpy(s->name, w.text, w.length);
    s->name[w.length] = 0;
    return PLIANT_OK;
}

// [L:] before K, source K or near X Y Z
static pliant_status parse_vertex(cursor *c, pliant_vertex_name *vertex)
{
    static const char expected[] = "a vertex: [L:]K, [L:]source K or [L:]near X Y Z";
    const word whole = take(c);
    int64_t number = 0;
    size_t length = read_integer(whole.text, whole.length, INT32_MAX, &number);
    word place = whole;
    if (length > 0 && length < whole.length && whole.text[length] == ':') {
        vertex->has_level = 1;
        vertex->level = (int32_t)number;
        place.text += length + 1;
        place.length -= length + 1;
        length = read_integer(place.text, place.length, INT32_MAX, &number);
    }
    if (is_word(place, "near")) {
        vertex->kind = PLIANT_VERTEX_NEAR;
        return parse_vector(c, vertex->position);
    }
    if (is_word(place, "source")) {
        vertex->kind = PLIANT_VERTEX_SOURCE;
        const pliant_status status =
            parse_integer(c, "the number of a vertex of the input mesh", 0, INT32_MAX, &number);
        if (status == PLIANT_OK) vertex->number = (int32_t)number;
        return status;
    }
    if (length == 0 || length != place.length) return refuse(c, PLIANT_ERR_FORMAT, whole, expected);
    vertex->kind = PLIANT_VERTEX_MODEL;
    vertex->number = (int32_t)number;
    return PLIANT_OK;
}

// ---- Statements ----

static pliant_status parse_version(cursor *c, pliant_statement *s)
{
    const word w = peek(c);
    const pliant_status status =
        parse_integer(c, "the language's version, 1", 1, INT32_MAX, &s->count);
    if (status == PLIANT_OK && s->count > PLIANT_SCRIPT_VERSION)
        return refuse(c, PLIANT_ERR_VERSION, w, "version 1 of the language, the newest known here");
    return status;
}

static pliant_status parse_probe(cursor *c, pliant_statement *s)
{
    const pliant_status status = parse_name(c, s);
    if (status < 0) return status;
    const word w = peek(c);
    if (is_word(w, "vertex")) take(c);
    else if (!is_word(w, "near")) return refuse(c, PLIANT_ERR_FORMAT, w, "vertex or near");
    return parse_vertex(c, &s->vertex);
}

static pliant_status parse_load(cursor *c, pliant_statement *s)
{
    const pliant_status status = parse_vertex(c, &s->vertex);
    return status < 0 ? status : parse_vector(c, s->value);
}

static pliant_status parse_gravity(cursor *c, pliant_statement *s)
{
    return parse_vector(c, s->value);
}

static pliant_status parse_release(cursor *c, pliant_statement *s)
{
    if (!is_word(peek(c), "all")) return parse_vertex(c, &s->vertex);
    take(c);
    s->vertex.kind = PLIANT_VERTEX_ALL;
    return PLIANT_OK;
}

// A number that is above zero, or may be zero.
static pliant_status parse_positive(cursor *c, const char *expected, double *value)
{
    const word w = peek(c);
    const pliant_status status = parse_number(c, expected, value);
    return status == PLIANT_OK && !(*value > 0) ? refuse(c, PLIANT_ERR_FORMAT, w, expected)
                                                : status;
}

static pliant_status parse_not_negative(cursor *c, const char *expected, double *value)
{
    const word w = peek(c);
    const pliant_status status = parse_number(c, expected, value);
    return status == PLIANT_OK && *value < 0 ? refuse(c, PLIANT_ERR_FORMAT, w, expected) : status;
}

// What stands before a number.
static pliant_status parse_label(cursor *c, const char *label)
{
    const word w = take(c);
    return is_word(w, label) ? PLIANT_OK : refuse(c, PLIANT_ERR_FORMAT, w, label);
}

static pliant_status parse_patch(cursor *c, pliant_statement *s)
{
    pliant_status status = parse_name(c, s);
    if (status < 0) return status;
    if (is_word(peek(c), "tolerance")) {
        take(c);
        return parse_not_negative(c, "a tolerance, a number >= 0", &s->scalar);
    }
    if (is_word(peek(c), "release")) {
        take(c);
        s->kind = PLIANT_STATEMENT_PATCH_RELEASE;
        return parse_release(c, s);
    }
    s->kind = PLIANT_STATEMENT_PATCH_DISPLACE;
    return parse_load(c, s);
}

static pliant_status parse_contact(cursor *c, pliant_statement *s)
{
    const pliant_status status = parse_label(c, "tolerance");
    return status < 0 ? status : parse_positive(c, "a tolerance, a number > 0", &s->scalar);
}

static pliant_status parse_sphere(cursor *c, pliant_statement *s)
{
    const pliant_status status = parse_vector(c, s->value);
    return status < 0 ? status : parse_positive(c, "a radius, a number > 0", &s->scalar);
}

static pliant_status parse_plane(cursor *c, pliant_statement *s)
{
    const word w = peek(c);
    const pliant_status status = parse_vector(c, s->value);
    if (status < 0) return status;
    if (s->value[0] == 0 && s->value[1] == 0 && s->value[2] == 0)
        return refuse(c, PLIANT_ERR_FORMAT, w, "a normal that is not 0 0 0");
    return parse_number(c, "the plane's distance, a number", &s->scalar);
}

static pliant_status parse_capsule(cursor *c, pliant_statement *s)
{
    pliant_status status = parse_vector(c, s->value);
    if (status == PLIANT_OK) status = parse_vector(c, s->end);
    return status < 0 ? status : parse_positive(c, "a radius, a number > 0", &s->scalar);
}

static const struct {
    const char *word;
    pliant_shape_kind kind;
    pliant_status (*parse)(cursor *c, pliant_statement *s);
} shapes[] = {
    {"sphere", PLIANT_SHAPE_SPHERE, parse_sphere},
    {"plane", PLIANT_SHAPE_PLANE, parse_plane},
    {"capsule", PLIANT_SHAPE_CAPSULE, parse_capsule},
};

static pliant_status parse_friction(cursor *c, pliant_statement *s)
{
    if (!is_word(peek(c), "friction")) return PLIANT_OK;
    take(c);
    return parse_not_negative(c, "a friction coefficient, a number >= 0", &s->friction);
}

static pliant_status parse_tool(cursor *c, pliant_statement *s)
{
    pliant_status status = parse_name(c, s);
    if (status < 0) return status;
    const word w = take(c);
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        if (!is_word(w, shapes[i].word)) continue;
        s->shape = shapes[i].kind;
        status = shapes[i].parse(c, s);
        return status < 0 ? status : parse_friction(c, s);
    }
    return refuse(c, PLIANT_ERR_FORMAT, w, "sphere, plane or capsule");
}

static pliant_status parse_proxy(cursor *c, pliant_statement *s)
{
    pliant_status status = parse_name(c, s);
    if (status == PLIANT_OK) status = parse_vector(c, s->value);
    if (status == PLIANT_OK && is_word(peek(c), "stiffness")) {
        take(c);
        status = parse_positive(c, "a stiffness, a number > 0", &s->stiffness);
    }
    return status < 0 ? status : parse_friction(c, s);
}

static pliant_status parse_move(cursor *c, pliant_statement *s)
{
    const pliant_status status = parse_name(c, s);
    return status < 0 ? status : parse_vector(c, s->value);
}

static pliant_status parse_deadline(cursor *c, pliant_statement *s)
{
    if (is_word(peek(c), "none")) {
        take(c);
        s->count = -1;
        return PLIANT_OK;
    }
    return parse_integer(c, "microseconds, a whole number from 0 to 1000000000, or none", 0,
                         PLIANT_SCRIPT_DEADLINE_LIMIT, &s->count);
}

static pliant_status parse_dt(cursor *c, pliant_statement *s)
{
    return parse_positive(c, "seconds, a number > 0", &s->scalar);
}

static pliant_status parse_step(cursor *c, pliant_statement *s)
{
    s->count = 1;
    if (peek(c).length == 0) return PLIANT_OK;
    return parse_integer(c, "a number of steps, 1 or more", 1, INT64_MAX, &s->count);
}

static pliant_status parse_expect(cursor *c, pliant_statement *s)
{
    pliant_status status = parse_name(c, s);
    if (status == PLIANT_OK) status = parse_vector(c, s->value);
    return status < 0 ? status : parse_not_negative(c, "a tolerance, a number >= 0", &s->scalar);
}

static const struct {
    const char *word;
    pliant_statement_kind kind;
    pliant_status (*parse)(cursor *c, pliant_statement *s);
} keywords[] = {
    {"pliant-script", PLIANT_STATEMENT_VERSION, parse_version},
    {"probe", PLIANT_STATEMENT_PROBE, parse_probe},
    {"displace", PLIANT_STATEMENT_DISPLACE, parse_load},
    {"traction", PLIANT_STATEMENT_TRACTION, parse_load},
    {"force", PLIANT_STATEMENT_FORCE, parse_load},
    {"support", PLIANT_STATEMENT_SUPPORT, parse_load},
    {"gravity", PLIANT_STATEMENT_GRAVITY, parse_gravity},
    {"release", PLIANT_STATEMENT_RELEASE, parse_release},
    {"patch", PLIANT_STATEMENT_PATCH, parse_patch},
    {"contact", PLIANT_STATEMENT_CONTACT, parse_contact},
    {"tool", PLIANT_STATEMENT_TOOL, parse_tool},
    {"proxy", PLIANT_STATEMENT_PROXY, parse_proxy},
    {"move", PLIANT_STATEMENT_MOVE, parse_move},
    {"drop", PLIANT_STATEMENT_DROP, parse_name},
    {"deadline", PLIANT_STATEMENT_DEADLINE, parse_deadline},
    {"dt", PLIANT_STATEMENT_DT, parse_dt},
    {"step", PLIANT_STATEMENT_STEP, parse_step},
    {"expect", PLIANT_STATEMENT_EXPECT, parse_expect},
};

// UTF-8 without control characters; comments, too.
static pliant_status check_text(const char *text, size_t length, const char *name, int64_t line,
                                pliant_error *err)
{
    if (length > PLIANT_SCRIPT_LINE_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%.300s:%lld:%d: expected a line of at most %d bytes, found more",
                                name, (long long)line, PLIANT_SCRIPT_LINE_LIMIT + 1,
                                PLIANT_SCRIPT_LINE_LIMIT);
    size_t wrong = pliant_utf8_check(text, length);
    for (size_t i = 0; i < wrong; i++)
        if (((unsigned char)text[i] < 0x20 && text[i] != '\t') || text[i] == 0x7f) wrong = i;
    if (wrong == length) return PLIANT_OK;
    return pliant_error_set(
        err, PLIANT_ERR_FORMAT, "%.300s:%lld:%d: expected UTF-8 text, found byte 0x%02x", name,
        (long long)line, (int)column_of(text, wrong), (unsigned char)text[wrong]);
}

static pliant_status parse(cursor *c, int first, pliant_statement *s)
{
    const word w = take(c);
    if (w.length == 0) return PLIANT_OK;
    if (first && !is_word(w, "pliant-script"))
        return refuse(c, PLIANT_ERR_FORMAT, w, "\"pliant-script 1\" as first statement");
    if (!first && is_word(w, "pliant-script"))
        return refuse(c, PLIANT_ERR_FORMAT, w, "pliant-script as first statement only");
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++) {
        if (!is_word(w, keywords[i].word)) continue;
        s->kind = keywords[i].kind;
        peek(c);
        s->column = column_of(c->text, c->at);
        const pliant_status status = keywords[i].parse(c, s);
        if (status < 0) return status;
        const word rest = peek(c);
        return rest.length > 0 ? refuse(c, PLIANT_ERR_FORMAT, rest, "the end of the line") : status;
    }
    return refuse(
        c, PLIANT_ERR_FORMAT, w,
        "probe, displace, traction, force, support, gravity, release, patch, contact, tool, "
        "proxy, move, drop, deadline, dt, step or expect");
}

pliant_status pliant_statement_parse(const char *text, size_t length, const char *name,
                                     int64_t line, int first, pliant_statement *statement,
                                     pliant_error *err)
{
    pliant_status status = check_text(text, length, name, line, err);
    if (status < 0) return status;
    const char *comment = length > 0 ? memchr(text, '#', length) : NULL;
    cursor c = {
        .text = text,
        .length = comment ? (size_t)(comment - text) : length,
        .name = name,
        .line = line,
        .err = err,
    };
    pliant_statement s;
    memset(&s, 0, sizeof s);
    s.line = line;
    s.column = 1;
    status = parse(&c, first, &s);
    if (status == PLIANT_OK) *statement = s;
    return status;
}
