// mesh_file_ply.c: PLY, ascii and binary of either endianness.
//
// This follows: G. Turk, The PLY Polygon File Format, 1994. Read are x, y, z of the element vertex
// and the list vertex_indices (or vertex_index) of the element face, of whatever scalar types,
// among whatever other properties and elements, in whatever order. Triangle strips are refused.
#include "mesh_file_formats.h"

#include "pliant/error.h"
#include "text_cursor.h"

#include <limits.h>
#include <math.h>
#include <string.h>

enum {
    ELEMENT_LIMIT = 32,   // elements in one file; five is much
    PROPERTY_LIMIT = 512, // properties of all elements together; splat files have some 60
};

typedef enum encoding { ASCII, LITTLE, BIG } encoding;
typedef enum scalar { INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64, SCALARS } scalar;
static const int scalar_size[SCALARS] = {1, 1, 2, 2, 4, 4, 4, 8};
static const char *const scalar_name[SCALARS][2] = {
    {"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
    {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"},
};

typedef enum role { OTHER, X, Y, Z, CORNERS } role;

typedef struct property {
    scalar type;
    int is_list;
    scalar count_type; // of a list
    role role;
} property;

typedef enum kind { REST, VERTEX, FACE } kind;
static const char *const kind_name[] = {"elements", "vertices", "faces"};

typedef struct element {
    kind kind;
    int64_t count;
    int first, property_count; // in header.properties
} element;

typedef struct header {
    encoding encoding;
    int element_count, property_count;
    element elements[ELEMENT_LIMIT];
    property properties[PROPERTY_LIMIT];
} header;

static pliant_status refuse(const pliant_text_cursor *cursor, pliant_error *err, const char *reason)
{
    return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s:%lld: %s", cursor->name,
                            (long long)cursor->line, reason);
}

// ---- Header ----

static pliant_status read_format(pliant_text_cursor *cursor, header *h, pliant_error *err)
{
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    const pliant_text_word word = pliant_text_cursor_word(cursor);
    for (int i = 0; i < 3; i++) {
        if (!pliant_text_word_is(word, names[i])) continue;
        h->encoding = (encoding)i;
        return PLIANT_OK;
    }
    return pliant_text_cursor_refuse(cursor, word,
                                     "ascii, binary_little_endian or binary_big_endian", err);
}

static pliant_status read_element(pliant_text_cursor *cursor, header *h, pliant_error *err)
{
    if (h->element_count == ELEMENT_LIMIT) return refuse(cursor, err, "more than 32 elements");
    element *e = h->elements + h->element_count;
    const pliant_text_word name = pliant_text_cursor_word(cursor);
    if (!name.text) return pliant_text_cursor_refuse(cursor, name, "the name of an element", err);
    e->kind = pliant_text_word_is(name, "vertex") ? VERTEX
              : pliant_text_word_is(name, "face") ? FACE
                                                  : REST;
    for (int i = 0; i < h->element_count; i++)
        if (e->kind != REST && h->elements[i].kind == e->kind)
            return refuse(cursor, err, "the element is declared twice");
    e->first = h->property_count;
    e->property_count = 0;
    const pliant_status status = pliant_text_cursor_count(cursor, "a count", &e->count, err);
    if (status == PLIANT_OK) h->element_count++;
    return status;
}

static pliant_status read_type(pliant_text_cursor *cursor, pliant_text_word word, scalar *type,
                               pliant_error *err)
{
    for (int t = 0; t < SCALARS; t++) {
        if (!pliant_text_word_is(word, scalar_name[t][0]) &&
            !pliant_text_word_is(word, scalar_name[t][1]))
            continue;
        *type = (scalar)t;
        return PLIANT_OK;
    }
    return pliant_text_cursor_refuse(cursor, word, "a scalar type such as float or uchar", err);
}

static role property_role(const element *e, const property *p, pliant_text_word name)
{
    if (e->kind == VERTEX && !p->is_list) {
        if (pliant_text_word_is(name, "x")) return X;
        if (pliant_text_word_is(name, "y")) return Y;
        if (pliant_text_word_is(name, "z")) return Z;
    }
    if (e->kind == FACE && p->is_list &&
        (pliant_text_word_is(name, "vertex_indices") || pliant_text_word_is(name, "vertex_index")))
        return CORNERS;
    return OTHER;
}

static pliant_status read_property(pliant_text_cursor *cursor, header *h, pliant_error *err)
{
    if (h->element_count == 0) return refuse(cursor, err, "a property before the first element");
    if (h->property_count == PROPERTY_LIMIT) return refuse(cursor, err, "more than 512 properties");
    element *e = h->elements + h->element_count - 1;
    property *p = h->properties + h->property_count;
    *p = (property){.role = OTHER};
    pliant_text_word word = pliant_text_cursor_word(cursor);
    pliant_status status = PLIANT_OK;
    if (pliant_text_word_is(word, "list")) {
        p->is_list = 1;
        status = read_type(cursor, pliant_text_cursor_word(cursor), &p->count_type, err);
        word = pliant_text_cursor_word(cursor);
    }
    if (status == PLIANT_OK) status = read_type(cursor, word, &p->type, err);
    if (status < 0) return status;
    const pliant_text_word name = pliant_text_cursor_word(cursor);
    if (!name.text) return pliant_text_cursor_refuse(cursor, name, "the name of a property", err);
    p->role = property_role(e, p, name);
    for (int i = e->first; i < h->property_count; i++)
        if (p->role != OTHER && h->properties[i].role == p->role)
            return refuse(cursor, err, "the property is declared twice");
    e->property_count++;
    h->property_count++;
    return PLIANT_OK;
}

// What must be there to make a mesh.
static pliant_status check_header(const pliant_text_cursor *cursor, const header *h,
                                  pliant_error *err)
{
    int found[CORNERS + 1] = {0}, has_faces = 0;
    for (int i = 0; i < h->property_count; i++) found[h->properties[i].role] = 1;
    for (int i = 0; i < h->element_count; i++) has_faces |= h->elements[i].kind == FACE;
    if (!found[X] || !found[Y] || !found[Z])
        return refuse(cursor, err, "expected an element vertex with the properties x, y and z");
    if (!has_faces)
        return refuse(cursor, err, "expected an element face, found points or strips only");
    if (!found[CORNERS])
        return refuse(cursor, err, "expected a list vertex_indices in the element face");
    return PLIANT_OK;
}

static pliant_status read_header(pliant_text_cursor *cursor, header *h, pliant_error *err)
{
    pliant_text_word word = pliant_text_cursor_word(cursor);
    if (!pliant_text_word_is(word, "ply"))
        return pliant_text_cursor_refuse(cursor, word, "ply", err);
    int has_format = 0;
    while (pliant_text_cursor_line(cursor)) {
        word = pliant_text_cursor_word(cursor);
        pliant_status status = PLIANT_OK;
        if (!word.text || pliant_text_word_is(word, "comment") ||
            pliant_text_word_is(word, "obj_info")) {
            continue;
        } else if (pliant_text_word_is(word, "format")) {
            status = read_format(cursor, h, err);
            has_format = 1;
        } else if (pliant_text_word_is(word, "element")) {
            status = read_element(cursor, h, err);
        } else if (pliant_text_word_is(word, "property")) {
            status = read_property(cursor, h, err);
        } else if (pliant_text_word_is(word, "end_header")) {
            if (!has_format) return refuse(cursor, err, "expected a format line before end_header");
            status = check_header(cursor, h, err);
            (void)pliant_text_cursor_line(cursor);
            return status;
        } else {
            status = pliant_text_cursor_refuse(
                cursor, word, "format, element, property, comment or end_header", err);
        }
        if (status < 0) return status;
    }
    return refuse(cursor, err, "expected end_header, found the end of the file");
}

// ---- Body ----

// What is read now, for messages.
typedef struct place {
    const element *element;
    int64_t number;
} place;

static pliant_status refuse_end(const pliant_text_cursor *cursor, place at, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: expected %lld %s, found the end of the file after %lld",
                            cursor->name, (long long)at.element->count, kind_name[at.element->kind],
                            (long long)at.number);
}

static double decode(const unsigned char *bytes, scalar type, encoding order)
{
    uint64_t bits = 0;
    const int size = scalar_size[type];
    for (int i = 0; i < size; i++)
        bits |= (uint64_t)bytes[i] << 8 * (order == LITTLE ? i : size - 1 - i);
    switch (type) {
    case INT8:
        return (double)(int8_t)bits;
    case INT16:
        return (double)(int16_t)bits;
    case INT32:
        return (double)(int32_t)bits;
    case UINT8:
    case UINT16:
    case UINT32:
        return (double)bits;
    case FLOAT32: {
        const uint32_t half = (uint32_t)bits;
        float value;
        memcpy(&value, &half, sizeof value);
        return (double)value;
    }
    default: {
        double value;
        memcpy(&value, &bits, sizeof value);
        return value;
    }
    }
}

// One scalar; NaN and infinity are for the caller to judge.
static pliant_status read_scalar(pliant_text_cursor *cursor, encoding order, scalar type, place at,
                                 double *value, pliant_error *err)
{
    if (order == ASCII) {
        const pliant_text_word word = pliant_text_cursor_word(cursor);
        if (!word.text && cursor->at == cursor->end) return refuse_end(cursor, at, err);
        if (!word.text || !pliant_text_word_number(word, value))
            return pliant_text_cursor_refuse(cursor, word, "a number", err);
        return PLIANT_OK;
    }
    if (cursor->end - cursor->at < scalar_size[type]) return refuse_end(cursor, at, err);
    *value = decode((const unsigned char *)cursor->at, type, order);
    cursor->at += scalar_size[type];
    return PLIANT_OK;
}

static pliant_status refuse_value(const pliant_text_cursor *cursor, encoding order, place at,
                                  const char *what, double value, pliant_error *err)
{
    if (order == ASCII)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s:%lld: %s: %g", cursor->name,
                                (long long)cursor->line, what, value);
    return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: %s %lld: %s: %g", cursor->name,
                            at.element->kind == VERTEX ? "vertex" : "face", (long long)at.number,
                            what, value);
}

static pliant_status read_list(pliant_text_cursor *cursor, encoding order, const property *p,
                               place at, pliant_mesh_builder *builder, pliant_error *err)
{
    double count;
    pliant_status status = read_scalar(cursor, order, p->count_type, at, &count, err);
    if (status < 0) return status;
    if (!(count >= 0 && count <= UINT_MAX) || count != floor(count))
        return refuse_value(cursor, order, at, "expected a list length, found", count, err);
    const int64_t length = (int64_t)count;
    if (!builder && order != ASCII) {
        if ((cursor->end - cursor->at) / scalar_size[p->type] < length)
            return refuse_end(cursor, at, err);
        cursor->at += length * scalar_size[p->type];
        return PLIANT_OK;
    }
    for (int64_t k = 0; k < length; k++) {
        double index;
        status = read_scalar(cursor, order, p->type, at, &index, err);
        if (status < 0) return status;
        if (!builder) continue;
        if (!(fabs(index) <= UINT_MAX) || index != floor(index))
            return refuse_value(cursor, order, at, "expected a vertex number, found", index, err);
        status = pliant_mesh_builder_corner(builder, (int64_t)index, (int64_t)index, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

// One vertex, face or other element; `builder` NULL passes it.
static pliant_status read_instance(pliant_text_cursor *cursor, const header *h, place at,
                                   pliant_mesh_builder *builder, pliant_error *err)
{
    static const char *const what[3] = {"the x coordinate is not finite",
                                        "the y coordinate is not finite",
                                        "the z coordinate is not finite"};
    const element *e = at.element;
    double x[3] = {0, 0, 0};
    if (builder) builder->line = h->encoding == ASCII ? cursor->line : 0;
    for (int i = e->first; i < e->first + e->property_count; i++) {
        const property *p = h->properties + i;
        pliant_status status;
        if (p->is_list) {
            status =
                read_list(cursor, h->encoding, p, at, p->role == CORNERS ? builder : NULL, err);
        } else {
            double value;
            status = read_scalar(cursor, h->encoding, p->type, at, &value, err);
            if (status == PLIANT_OK && p->role >= X && p->role <= Z) {
                if (!isfinite(value))
                    return refuse_value(cursor, h->encoding, at, what[p->role - X], value, err);
                x[p->role - X] = value;
            }
        }
        if (status < 0) return status;
    }
    if (h->encoding == ASCII) {
        const pliant_text_word word = pliant_text_cursor_word(cursor);
        if (word.text) return pliant_text_cursor_refuse(cursor, word, "the end of the line", err);
    }
    if (!builder) return PLIANT_OK;
    return e->kind == VERTEX ? pliant_mesh_builder_vertex(builder, x, err)
                             : pliant_mesh_builder_polygon(builder, err);
}

// The fewest bytes that an instance takes in a binary file; *fixed: it always takes that many.
static int64_t least_size(const header *h, const element *e, int *fixed)
{
    int64_t size = 0;
    *fixed = 1;
    for (int i = e->first; i < e->first + e->property_count; i++) {
        const property *p = h->properties + i;
        size += scalar_size[p->is_list ? p->count_type : p->type];
        if (p->is_list) *fixed = 0;
    }
    return size;
}

// Find out before anything is read that a binary file cannot hold an element.
static pliant_status check_room(const pliant_text_cursor *cursor, const element *e, int64_t size,
                                pliant_error *err)
{
    const int64_t left = cursor->end - cursor->at;
    if (e->count <= left / size) return PLIANT_OK;
    return pliant_error_set(
        err, PLIANT_ERR_FORMAT,
        "%s: expected %lld %s of at least %lld byte%s, found %lld bytes for them", cursor->name,
        (long long)e->count, kind_name[e->kind], (long long)size, size == 1 ? "" : "s",
        (long long)left);
}

// Go to the next line that holds a word, or to the end.
static void pass_empty_lines(pliant_text_cursor *cursor)
{
    for (;;) {
        pliant_text_cursor peek = *cursor;
        if (pliant_text_cursor_word(&peek).text || !pliant_text_cursor_line(cursor)) return;
    }
}

// Pass over the body and give the elements of one kind to the builder.
static pliant_status read_body(pliant_text_cursor cursor, const header *h, kind wanted,
                               pliant_mesh_builder *builder, pliant_error *err)
{
    for (int i = 0; i < h->element_count; i++) {
        const element *e = h->elements + i;
        if (e->property_count == 0) continue; // takes no room
        if (h->encoding != ASCII) {
            int fixed;
            const int64_t size = least_size(h, e, &fixed);
            const pliant_status status = check_room(&cursor, e, size, err);
            if (status < 0) return status;
            if (fixed && e->kind != wanted) {
                cursor.at += e->count * size;
                continue;
            }
        }
        for (place at = {e, 0}; at.number < e->count; at.number++) {
            if (h->encoding == ASCII) pass_empty_lines(&cursor);
            const pliant_status status =
                read_instance(&cursor, h, at, e->kind == wanted ? builder : NULL, err);
            if (status < 0) return status;
            if (h->encoding == ASCII) (void)pliant_text_cursor_line(&cursor);
        }
        if (e->kind == wanted) return PLIANT_OK;
    }
    return PLIANT_OK;
}

pliant_status pliant_mesh_file_ply(const pliant_mesh_source *source, pliant_mesh_builder *builder,
                                   pliant_error *err)
{
    pliant_text_cursor cursor = pliant_text_cursor_begin(source->name, source->bytes, source->size);
    header h = {.encoding = ASCII};
    pliant_status status = read_header(&cursor, &h, err);
    // Two passes, so that faces may stand before the vertices that their triangles are chosen by.
    if (status == PLIANT_OK) status = read_body(cursor, &h, VERTEX, builder, err);
    if (status == PLIANT_OK) status = read_body(cursor, &h, FACE, builder, err);
    return status;
}

int pliant_mesh_file_is_ply(const pliant_mesh_source *source)
{
    return source->size > 3 && memcmp(source->bytes, "ply", 3) == 0 &&
           (source->bytes[3] == '\n' || source->bytes[3] == '\r');
}
