// region.c: which vertices are held: expressions on rest coordinates, and lists of vertex numbers.
//
//   condition  = and-part { ("or" | "||") and-part }
//   and-part   = part { ("and" | "&&") part }
//   part       = { "not" | "!" } ( "(" condition ")" | comparison | call )
//   comparison = term relation term { relation term }      z<0.1   0 < x <= 2   0.5 > y
//   term       = "x" | "y" | "z" | number                  relation = "<" | "<=" | ">" | ">="
//   call       = "all(" condition { "," condition } ")"    true where all are
//              | "any(" condition { "," condition } ")"    true where one is
//              | "box(" x0, y0, z0, x1, y1, z1 ")"         closed: the faces belong to it
//              | "sphere(" x, y, z, radius ")"             closed
//
// An expression becomes a list of operations in postfix order, which every vertex runs through.
#include "region.h"

#include "components.h"
#include "file_bytes.h"
#include "pliant/error.h"
#include "text_cursor.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    NESTING_LIMIT = 100, // of parentheses: recursion on hostile text must not exhaust the stack
};
// Held vertices are on one line when none is farther from it than this part of the body's diagonal.
// The resistance to turning about the line goes with the square of the distance: at 1e-5 the
// solution of the reference problem keeps 6 of 16 digits. Rounding to float leaves 1e-7.
#define LINE_LIMIT 1e-5

// ---- Expressions: tokens ----

typedef enum token_kind { END, WORD, NUMBER, SYMBOL, UNKNOWN } token_kind;

typedef struct token {
    token_kind kind;
    const char *text;
    size_t length;
    double number;
} token;

typedef enum operation_kind { COMPARE, BOX, SPHERE, NOT, AND, OR } operation_kind;
typedef enum relation { LESS, LESS_EQUAL, GREATER, GREATER_EQUAL } relation;

typedef struct term {
    int axis; // 0, 1, 2, or -1: the number
    double number;
} term;

typedef struct operation {
    operation_kind kind;
    relation relation; // COMPARE: left relation right
    term left, right;
    double numbers[6]; // BOX, SPHERE
} operation;

typedef struct parser {
    const char *text;
    token token; // the one to read next
    operation *operations;
    size_t count, capacity;
    size_t depth, deepest; // truth values on the stack while the operations run
    int nesting;
    pliant_error *err;
} parser;

static int is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

static int is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static size_t number_length(const char *s)
{
    size_t n = *s == '+' || *s == '-';
    while (is_digit(s[n]) || s[n] == '.') n++;
    if (s[n] == 'e' || s[n] == 'E') {
        n++;
        if (s[n] == '+' || s[n] == '-') n++;
        while (is_digit(s[n])) n++;
    }
    return n;
}

static void advance(parser *p)
{
    const char *s = p->token.text + p->token.length;
    while (*s == ' ' || *s == '\t' || *s == '\n' || *s == '\r') s++;
    token t = {.kind = UNKNOWN, .text = s, .length = 1};
    if (*s == 0) {
        t.kind = END;
        t.length = 0;
    } else if (is_letter(*s)) {
        t.kind = WORD;
        while (is_letter(s[t.length]) || is_digit(s[t.length])) t.length++;
    } else if (is_digit(*s) || *s == '.' || *s == '+' || *s == '-') {
        t.length = number_length(s);
        const pliant_text_word word = {s, t.length};
        if (pliant_text_word_number(word, &t.number) && isfinite(t.number)) t.kind = NUMBER;
    } else if (strchr("<>!(),", *s)) {
        t.kind = SYMBOL;
        t.length = (*s == '<' || *s == '>') && s[1] == '=' ? 2 : 1;
    } else if ((*s == '&' || *s == '|') && s[1] == *s) {
        t.kind = SYMBOL;
        t.length = 2;
    }
    p->token = t;
}

static int is(const parser *p, const char *text)
{
    return p->token.length == strlen(text) && memcmp(p->token.text, text, p->token.length) == 0;
}

static int accept(parser *p, const char *text)
{
    if (!is(p, text)) return 0;
    advance(p);
    return 1;
}

static pliant_status refuse(const parser *p, const char *expected)
{
    char quote[PLIANT_TEXT_QUOTE_SIZE];
    const pliant_text_word found = {p->token.text, p->token.length};
    return pliant_error_set(p->err, PLIANT_ERR_ARGUMENT, "column %zu: expected %s, found %s",
                            (size_t)(p->token.text - p->text) + 1, expected,
                            p->token.kind == END ? "the end"
                                                 : pliant_text_word_quote(found, quote));
}

static pliant_status expect(parser *p, const char *text, const char *expected)
{
    return accept(p, text) ? PLIANT_OK : refuse(p, expected);
}

// ---- Expressions: grammar ----

// Add an operation; it takes `taken` truth values and leaves one.
static pliant_status emit(parser *p, operation o, size_t taken)
{
    if (p->count == p->capacity) {
        const size_t larger = p->capacity ? 2 * p->capacity : 16;
        operation *moved = realloc(p->operations, larger * sizeof *moved);
        if (!moved)
            return pliant_error_set(p->err, PLIANT_ERR_MEMORY, "no memory for the expression");
        p->operations = moved;
        p->capacity = larger;
    }
    p->operations[p->count++] = o;
    p->depth = p->depth + 1 - taken;
    if (p->depth > p->deepest) p->deepest = p->depth;
    return PLIANT_OK;
}

static pliant_status parse_condition(parser *p);

static int accept_term(parser *p, term *t)
{
    static const char *const axes[3] = {"x", "y", "z"};
    *t = (term){.axis = -1, .number = p->token.number};
    if (p->token.kind == NUMBER) {
        advance(p);
        return 1;
    }
    for (int k = 0; k < 3; k++) {
        if (!accept(p, axes[k])) continue;
        t->axis = k;
        return 1;
    }
    return 0;
}

static int accept_relation(parser *p, relation *r)
{
    static const char *const relations[] = {"<", "<=", ">", ">="};
    for (int k = 0; k < 4; k++) {
        if (!accept(p, relations[k])) continue;
        *r = (relation)k;
        return 1;
    }
    return 0;
}

// a < b < c is a < b and b < c.
static pliant_status parse_comparison(parser *p)
{
    operation o = {.kind = COMPARE};
    if (!accept_term(p, &o.left))
        return refuse(p, "a condition such as z<0.1, not, (, all(, any(, box( or sphere(");
    if (!accept_relation(p, &o.relation)) return refuse(p, "<, <=, > or >=");
    for (int links = 0;; links++) {
        const token at = p->token;
        if (!accept_term(p, &o.right)) return refuse(p, "a number, x, y or z");
        if (o.left.axis < 0 && o.right.axis < 0) {
            p->token = at;
            return refuse(p, "x, y or z on one side of the relation");
        }
        pliant_status status = emit(p, o, 0);
        if (status == PLIANT_OK && links > 0) status = emit(p, (operation){.kind = AND}, 2);
        if (status < 0) return status;
        o.left = o.right;
        if (!accept_relation(p, &o.relation)) return PLIANT_OK;
    }
}

static pliant_status parse_list(parser *p, operation_kind kind)
{
    pliant_status status = parse_condition(p);
    while (status == PLIANT_OK && accept(p, ",")) {
        status = parse_condition(p);
        if (status == PLIANT_OK) status = emit(p, (operation){.kind = kind}, 2);
    }
    return status < 0 ? status : expect(p, ")", "and, or, a comma or )");
}

static pliant_status parse_shape(parser *p, operation_kind kind, token name)
{
    const int wanted = kind == BOX ? 6 : 4;
    operation o = {.kind = kind};
    for (int k = 0; k < wanted; k++) {
        if (k > 0 && !accept(p, ","))
            return refuse(p, kind == BOX ? "a comma: box(x0,y0,z0, x1,y1,z1)"
                                         : "a comma: sphere(x,y,z,radius)");
        if (p->token.kind != NUMBER) return refuse(p, "a number");
        o.numbers[k] = p->token.number;
        advance(p);
    }
    const size_t column = (size_t)(name.text - p->text) + 1;
    for (int k = 0; kind == BOX && k < 3; k++)
        if (o.numbers[k] > o.numbers[k + 3])
            return pliant_error_set(p->err, PLIANT_ERR_ARGUMENT,
                                    "column %zu: an empty box: expected %c0 <= %c1, found %g > "
                                    "%g",
                                    column, "xyz"[k], "xyz"[k], o.numbers[k], o.numbers[k + 3]);
    if (kind == SPHERE && o.numbers[3] < 0)
        return pliant_error_set(p->err, PLIANT_ERR_ARGUMENT,
                                "column %zu: expected a radius of 0 or more, found %g", column,
                                o.numbers[3]);
    const pliant_status status = expect(p, ")", ")");
    return status < 0 ? status : emit(p, o, 0);
}

static pliant_status parse_call(parser *p)
{
    const token name = p->token;
    const int all = is(p, "all"), any = is(p, "any"), box = is(p, "box"), sphere = is(p, "sphere");
    if (!all && !any && !box && !sphere) return parse_comparison(p);
    advance(p);
    const pliant_status status = expect(p, "(", "(");
    if (status < 0) return status;
    return all || any ? parse_list(p, all ? AND : OR) : parse_shape(p, box ? BOX : SPHERE, name);
}

static pliant_status parse_part(parser *p)
{
    int negations = 0;
    while (accept(p, "not") || accept(p, "!")) negations = !negations;
    pliant_status status;
    if (p->nesting == NESTING_LIMIT)
        return pliant_error_set(p->err, PLIANT_ERR_ARGUMENT,
                                "column %zu: expected at most %d nested parentheses, found more",
                                (size_t)(p->token.text - p->text) + 1, NESTING_LIMIT);
    p->nesting++;
    if (accept(p, "(")) {
        status = parse_condition(p);
        if (status == PLIANT_OK) status = expect(p, ")", "and, or or )");
    } else {
        status = parse_call(p);
    }
    p->nesting--;
    if (status == PLIANT_OK && negations) status = emit(p, (operation){.kind = NOT}, 1);
    return status;
}

static pliant_status parse_and(parser *p)
{
    pliant_status status = parse_part(p);
    while (status == PLIANT_OK && (accept(p, "and") || accept(p, "&&"))) {
        status = parse_part(p);
        if (status == PLIANT_OK) status = emit(p, (operation){.kind = AND}, 2);
    }
    return status;
}

static pliant_status parse_condition(parser *p)
{
    pliant_status status = parse_and(p);
    while (status == PLIANT_OK && (accept(p, "or") || accept(p, "||"))) {
        status = parse_and(p);
        if (status == PLIANT_OK) status = emit(p, (operation){.kind = OR}, 2);
    }
    return status;
}

// ---- Expressions: evaluation ----

static int compare(const operation *o, const double *x)
{
    const double a = o->left.axis < 0 ? o->left.number : x[o->left.axis];
    const double b = o->right.axis < 0 ? o->right.number : x[o->right.axis];
    switch (o->relation) {
    case LESS:
        return a < b;
    case LESS_EQUAL:
        return a <= b;
    case GREATER:
        return a > b;
    case GREATER_EQUAL:
        return a >= b;
    }
    return 0;
}

static int in_shape(const operation *o, const double *x)
{
    const double *n = o->numbers;
    if (o->kind == BOX)
        return x[0] >= n[0] && x[1] >= n[1] && x[2] >= n[2] && x[0] <= n[3] && x[1] <= n[4] &&
               x[2] <= n[5];
    return hypot(hypot(x[0] - n[0], x[1] - n[1]), x[2] - n[2]) <= n[3];
}

static uint8_t evaluate(const parser *p, const double *x, uint8_t *stack)
{
    uint8_t *top = stack; // one past the last
    for (size_t i = 0; i < p->count; i++) {
        const operation *o = p->operations + i;
        switch (o->kind) {
        case COMPARE:
            *top++ = (uint8_t)compare(o, x);
            break;
        case BOX:
        case SPHERE:
            *top++ = (uint8_t)in_shape(o, x);
            break;
        case NOT:
            top[-1] = !top[-1];
            break;
        case AND:
            top--, top[-1] = top[-1] && *top;
            break;
        case OR:
            top--, top[-1] = top[-1] || *top;
            break;
        }
    }
    return stack[0];
}

pliant_status pliant_region_evaluate(const char *expression, const pliant_mesh *mesh, uint8_t *held,
                                     pliant_error *err)
{
    parser p = {.text = expression, .token = {.text = expression}, .err = err};
    uint8_t *stack = NULL;
    advance(&p);
    pliant_status status = parse_condition(&p);
    if (status == PLIANT_OK && p.token.kind != END) status = refuse(&p, "and, or or the end");
    if (status < 0) goto done;
    stack = malloc(p.deepest);
    if (!stack) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the expression");
        goto done;
    }
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        held[v] = evaluate(&p, mesh->vertices + 3 * (size_t)v, stack);
done:
    free(stack);
    free(p.operations);
    return status;
}

// ---- Lists ----

static pliant_status parse_numbers(const char *name, pliant_file_bytes bytes, int32_t vertex_count,
                                   uint8_t *held, pliant_error *err)
{
    pliant_text_cursor cursor = pliant_text_cursor_begin(name, bytes.data, bytes.size);
    cursor.comment = '#';
    int64_t count = 0;
    do {
        pliant_text_word word;
        while ((word = pliant_text_cursor_word(&cursor)).text) {
            int64_t vertex;
            if (!pliant_text_word_integer(word, &vertex))
                return pliant_text_cursor_refuse(&cursor, word, "a vertex number", err);
            if (vertex < 0 || vertex >= vertex_count) {
                char expected[64];
                snprintf(expected, sizeof expected, "a vertex number from 0 to %d",
                         vertex_count - 1);
                return pliant_text_cursor_refuse(&cursor, word, expected, err);
            }
            held[vertex] = 1;
            count++;
        }
    } while (pliant_text_cursor_line(&cursor));
    if (count == 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: expected vertex numbers, found none",
                                name);
    return PLIANT_OK;
}

pliant_status pliant_region_read(const char *path, int32_t vertex_count, uint8_t *held,
                                 pliant_error *err)
{
    char text[PLIANT_FILE_NAME_SIZE];
    const char *name = pliant_file_bytes_name(path, text);
    pliant_file_bytes bytes = {0};
    pliant_status status = pliant_file_bytes_open(path, name, &bytes, err);
    if (status < 0) return status;
    uint8_t *found = calloc((size_t)vertex_count + 1, 1);
    if (!found)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for %d vertices", name,
                                  vertex_count);
    if (status == PLIANT_OK) status = parse_numbers(name, bytes, vertex_count, found, err);
    if (status == PLIANT_OK) memcpy(held, found, (size_t)vertex_count);
    free(found);
    pliant_file_bytes_close(&bytes);
    return status;
}

// ---- Rigid motions ----

// What holds one body, found in three passes over the vertices.
typedef struct hold {
    int32_t count, first, farthest; // held vertices; one of them; the one farthest from it
    double span;                    // between the two
    double off_line;                // largest distance of a held vertex from their line
} hold;

static double distance(const double *a, const double *b)
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

static double line_distance(const double *a, const double *b, double span, const double *x)
{
    double along[3], from[3];
    for (int k = 0; k < 3; k++) {
        along[k] = (b[k] - a[k]) / span;
        from[k] = x[k] - a[k];
    }
    const double n[3] = {from[1] * along[2] - from[2] * along[1],
                         from[2] * along[0] - from[0] * along[2],
                         from[0] * along[1] - from[1] * along[0]};
    return hypot(hypot(n[0], n[1]), n[2]);
}

// A cavity's surface belongs to the body around it.
static int32_t body_of(const pliant_components *parts, int32_t component)
{
    return parts->depth[component] % 2 ? parts->outer[component] : component;
}

static void measure_holds(const pliant_mesh *mesh, const uint8_t *held,
                          const pliant_components *parts, hold *holds)
{
    for (int pass = 0; pass < 3; pass++)
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            if (!held[v] || parts->of_vertex[v] < 0) continue;
            const double *x = mesh->vertices + 3 * (size_t)v;
            hold *h = holds + body_of(parts, parts->of_vertex[v]);
            if (pass == 0) {
                if (h->count++ == 0) h->first = h->farthest = v;
                continue;
            }
            const double *a = mesh->vertices + 3 * (size_t)h->first;
            const double *b = mesh->vertices + 3 * (size_t)h->farthest;
            if (pass == 1 && distance(a, x) > h->span) {
                h->span = distance(a, x);
                h->farthest = v;
            } else if (pass == 2 && h->span > 0) {
                h->off_line = fmax(h->off_line, line_distance(a, b, h->span, x));
            }
        }
}

static pliant_status judge(const pliant_components *parts, int32_t body, const hold *h,
                           pliant_error *err)
{
    const double *box = parts->box[body];
    const double diagonal = distance(box, box + 3);
    char where[64] = "";
    if (parts->count > 1)
        snprintf(where, sizeof where, " of the component of vertex %d", parts->first_vertex[body]);
    if (h->count < 3)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "%d vertices%s are held: expected at least 3 that are not on one line, "
            "or the body moves freely",
            h->count, where);
    if (!(h->off_line > LINE_LIMIT * diagonal))
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "the %d held vertices%s are on one line: the body turns about it; hold "
            "at least one vertex beside the line",
            h->count, where);
    return PLIANT_OK;
}

pliant_status pliant_region_check(const pliant_mesh *mesh, const uint8_t *held, pliant_error *err)
{
    int32_t count = 0;
    for (int32_t v = 0; v < mesh->vertex_count; v++) count += held[v] != 0;
    if (count == 0)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "no vertex is held: expected at least 3 that are not on one line, or "
            "the body moves freely");
    if (count == mesh->vertex_count)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "all %d vertices are held: expected some that can move", count);
    pliant_components *parts = NULL;
    pliant_status status = pliant_components_create(mesh, "held vertices", &parts, err);
    if (status < 0) return status;
    hold *holds = calloc((size_t)parts->count + 1, sizeof *holds);
    if (!holds)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to check %d components",
                                  parts->count);
    if (status == PLIANT_OK) measure_holds(mesh, held, parts, holds);
    for (int32_t i = 0; status == PLIANT_OK && i < parts->count; i++)
        if (body_of(parts, i) == i) status = judge(parts, i, holds + i, err);
    free(holds);
    pliant_components_destroy(parts);
    return status;
}
