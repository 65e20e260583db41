// statement.c: parse one line of a contact script (formats/README.md has the grammar).
#include "pliant/script.h"

#include "scene_statement.h"
#include "shapes.h"
#include "words.h"

#include "pliant/error.h"
#include "pliant/utf8.h"

#include <string.h>

// ---- Statements ----

static pliant_status parse_version(pliant_words *c, pliant_statement *s)
{
    const pliant_word w = pliant_words_peek(c);
    const pliant_status status =
        pliant_words_integer(c, "the language's version, 1", 1, INT32_MAX, &s->count);
    if (status == PLIANT_OK && s->count > PLIANT_SCRIPT_VERSION)
        return pliant_words_refuse(c, PLIANT_ERR_VERSION, w,
                                   "version 1 of the language, the newest known here");
    return status;
}

static pliant_status parse_probe(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_name(c, s->name);
    if (status == PLIANT_OK) status = pliant_scene_statement_instance(c, s);
    if (status < 0) return status;
    const pliant_word w = pliant_words_peek(c);
    if (pliant_word_is(w, "vertex")) pliant_words_take(c);
    else if (!pliant_word_is(w, "near"))
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, "vertex or near");
    return pliant_words_vertex(c, &s->vertex);
}

static pliant_status parse_load(pliant_words *c, pliant_statement *s)
{
    const pliant_status status = pliant_words_vertex(c, &s->vertex);
    return status < 0 ? status : pliant_words_vector(c, s->value);
}

static pliant_status parse_gravity(pliant_words *c, pliant_statement *s)
{
    return pliant_words_vector(c, s->value);
}

static pliant_status parse_release(pliant_words *c, pliant_statement *s)
{
    if (!pliant_word_is(pliant_words_peek(c), "all")) return pliant_words_vertex(c, &s->vertex);
    pliant_words_take(c);
    s->vertex.kind = PLIANT_VERTEX_ALL;
    return PLIANT_OK;
}

static pliant_status parse_patch(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_name(c, s->name);
    if (status < 0) return status;
    if (pliant_word_is(pliant_words_peek(c), "tolerance")) {
        pliant_words_take(c);
        return pliant_words_not_negative(c, "a tolerance, a number >= 0", &s->scalar);
    }
    if (pliant_word_is(pliant_words_peek(c), "release")) {
        pliant_words_take(c);
        s->kind = PLIANT_STATEMENT_PATCH_RELEASE;
        return parse_release(c, s);
    }
    s->kind = PLIANT_STATEMENT_PATCH_DISPLACE;
    return parse_load(c, s);
}

static pliant_status parse_contact(pliant_words *c, pliant_statement *s)
{
    const pliant_status status = pliant_words_label(c, "tolerance");
    return status < 0 ? status : pliant_words_positive(c, "a tolerance, a number > 0", &s->scalar);
}

static pliant_status parse_tool(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_name(c, s->name);
    if (status < 0) return status;
    const pliant_word w = pliant_words_take(c);
    if (pliant_shape_of(w) == PLIANT_SHAPE_NONE || pliant_shape_of(w) == PLIANT_SHAPE_BOX)
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, "sphere, plane or capsule");
    status = pliant_shape_parse(c, w, s);
    return status < 0 ? status : pliant_shape_parse_friction(c, s);
}

static pliant_status parse_proxy(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_name(c, s->name);
    if (status == PLIANT_OK) status = pliant_words_vector(c, s->value);
    if (status == PLIANT_OK && pliant_word_is(pliant_words_peek(c), "stiffness")) {
        pliant_words_take(c);
        status = pliant_words_positive(c, "a stiffness, a number > 0", &s->stiffness);
    }
    return status < 0 ? status : pliant_shape_parse_friction(c, s);
}

static pliant_status parse_move(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_name(c, s->name);
    if (status == PLIANT_OK) status = pliant_words_vector(c, s->value);
    return status < 0 ? status : pliant_scene_statement_over(c, s);
}

static pliant_status parse_drop(pliant_words *c, pliant_statement *s)
{
    return pliant_words_name(c, s->name);
}

static pliant_status parse_deadline(pliant_words *c, pliant_statement *s)
{
    if (pliant_word_is(pliant_words_peek(c), "none")) {
        pliant_words_take(c);
        s->count = -1;
        return PLIANT_OK;
    }
    return pliant_words_integer(c, "microseconds, a whole number from 0 to 1000000000, or none", 0,
                                PLIANT_SCRIPT_DEADLINE_LIMIT, &s->count);
}

static pliant_status parse_dt(pliant_words *c, pliant_statement *s)
{
    return pliant_words_positive(c, "seconds, a number > 0", &s->scalar);
}

static pliant_status parse_step(pliant_words *c, pliant_statement *s)
{
    s->count = 1;
    if (pliant_words_peek(c).length == 0) return PLIANT_OK;
    return pliant_words_integer(c, "a number of steps, 1 or more", 1, INT64_MAX, &s->count);
}

static pliant_status parse_expect(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_name(c, s->name);
    if (status == PLIANT_OK) status = pliant_words_vector(c, s->value);
    return status < 0 ? status
                      : pliant_words_not_negative(c, "a tolerance, a number >= 0", &s->scalar);
}

static const struct {
    const char *word;
    pliant_statement_kind kind;
    pliant_status (*parse)(pliant_words *c, pliant_statement *s);
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
    {"drop", PLIANT_STATEMENT_DROP, parse_drop},
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
        (long long)line, (int)pliant_words_column(text, wrong), (unsigned char)text[wrong]);
}

static pliant_status parse_arguments(pliant_words *c, pliant_word w, pliant_statement *s)
{
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++)
        if (keywords[i].kind == s->kind) return keywords[i].parse(c, s);
    return pliant_scene_statement_parse(c, w, s);
}

static pliant_statement_kind kind_of(pliant_word w)
{
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++)
        if (pliant_word_is(w, keywords[i].word)) return keywords[i].kind;
    return pliant_scene_statement_of(w);
}

static pliant_status parse(pliant_words *c, int first, pliant_statement *s)
{
    const pliant_word w = pliant_words_take(c);
    if (w.length == 0) return PLIANT_OK;
    if (first && !pliant_word_is(w, "pliant-script"))
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w,
                                   "\"pliant-script 1\" as first statement");
    if (!first && pliant_word_is(w, "pliant-script"))
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w,
                                   "pliant-script as first statement only");
    s->kind = kind_of(w);
    if (s->kind == PLIANT_STATEMENT_NONE)
        return pliant_words_refuse(
            c, PLIANT_ERR_FORMAT, w,
            "a statement such as probe, displace, grab, step or expect (--help lists all)");
    pliant_words_peek(c);
    s->column = pliant_words_column(c->text, c->at);
    const pliant_status status = parse_arguments(c, w, s);
    if (status < 0) return status;
    const pliant_word rest = pliant_words_peek(c);
    return rest.length > 0 ? pliant_words_refuse(c, PLIANT_ERR_FORMAT, rest, "the end of the line")
                           : status;
}

const char *pliant_statement_keyword(pliant_statement_kind kind, pliant_shape_kind shape)
{
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++)
        if (keywords[i].kind == kind) return keywords[i].word;
    if (kind == PLIANT_STATEMENT_OBSTACLE) return pliant_shape_keyword(shape);
    if (kind == PLIANT_STATEMENT_PATCH_DISPLACE || kind == PLIANT_STATEMENT_PATCH_RELEASE)
        return "patch";
    const char *keyword = pliant_scene_statement_keyword(kind);
    return keyword ? keyword : "statement";
}

pliant_statement_family pliant_statement_family_of(pliant_statement_kind kind)
{
    switch (kind) {
    case PLIANT_STATEMENT_NONE:
    case PLIANT_STATEMENT_VERSION:
    case PLIANT_STATEMENT_PROBE:
    case PLIANT_STATEMENT_GRAVITY:
    case PLIANT_STATEMENT_RELEASE:
    case PLIANT_STATEMENT_MOVE:
    case PLIANT_STATEMENT_DROP:
    case PLIANT_STATEMENT_DT:
    case PLIANT_STATEMENT_STEP:
    case PLIANT_STATEMENT_EXPECT:
        return PLIANT_FAMILY_COMMON;
    case PLIANT_STATEMENT_DISPLACE:
    case PLIANT_STATEMENT_TRACTION:
    case PLIANT_STATEMENT_FORCE:
    case PLIANT_STATEMENT_SUPPORT:
    case PLIANT_STATEMENT_PATCH:
    case PLIANT_STATEMENT_PATCH_DISPLACE:
    case PLIANT_STATEMENT_PATCH_RELEASE:
    case PLIANT_STATEMENT_CONTACT:
    case PLIANT_STATEMENT_TOOL:
    case PLIANT_STATEMENT_PROXY:
    case PLIANT_STATEMENT_DEADLINE:
        return PLIANT_FAMILY_GREENS;
    default:
        return PLIANT_FAMILY_LATTICE;
    }
}

pliant_status pliant_statement_parse(const char *text, size_t length, const char *name,
                                     int64_t line, int first, pliant_statement *statement,
                                     pliant_error *err)
{
    pliant_status status = check_text(text, length, name, line, err);
    if (status < 0) return status;
    const char *comment = length > 0 ? memchr(text, '#', length) : NULL;
    pliant_words c = {
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
