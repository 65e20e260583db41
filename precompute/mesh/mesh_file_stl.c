// mesh_file_stl.c: stereolithography files, binary and ascii.
//
// Binary or ascii is decided by size and content: many binary files begin with "solid". Facet
// normals are not looked at (many writers leave them 0 or NaN). Equal positions are welded, and
// triangles that rounding to float has collapsed are dropped: the format has no vertex numbers to
// keep.
#include "mesh_file_formats.h"

#include "pliant/error.h"
#include "text_cursor.h"

#include <math.h>
#include <string.h>
#include <strings.h>

enum {
    HEADER_SIZE = 84,   // 80 bytes of anything, then the triangle count
    TRIANGLE_SIZE = 50, // normal, three corners, 2 bytes of anything
    ASCII_PROBE = 2048, // bytes of an ascii file that show a keyword and no zero byte
};

static uint32_t decode_uint(const unsigned char *b)
{
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static float decode_float(const unsigned char *b)
{
    const uint32_t bits = decode_uint(b);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static int fits_binary(const pliant_mesh_source *source)
{
    if (source->size < HEADER_SIZE) return 0;
    const uint64_t count = decode_uint((const unsigned char *)source->bytes + 80);
    return source->size == HEADER_SIZE + TRIANGLE_SIZE * count;
}

static int is_keyword(pliant_text_word word, const char *keyword)
{
    return word.text && word.length == strlen(keyword) &&
           strncasecmp(word.text, keyword, word.length) == 0;
}

static int looks_ascii(const pliant_mesh_source *source)
{
    const size_t probe = source->size < ASCII_PROBE ? source->size : ASCII_PROBE;
    if (memchr(source->bytes, 0, probe)) return 0;
    pliant_text_cursor cursor = pliant_text_cursor_begin(source->name, source->bytes, source->size);
    return is_keyword(pliant_text_cursor_word(&cursor), "solid");
}

static pliant_status add_triangle(pliant_mesh_builder *builder, double x[3][3], pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    for (int k = 0; status == PLIANT_OK && k < 3; k++) {
        const int32_t vertex = builder->vertex_count;
        status = pliant_mesh_builder_vertex(builder, x[k], err);
        if (status == PLIANT_OK) status = pliant_mesh_builder_corner(builder, vertex, vertex, err);
    }
    return status < 0 ? status : pliant_mesh_builder_polygon(builder, err);
}

static pliant_status read_binary(const pliant_mesh_source *source, pliant_mesh_builder *builder,
                                 pliant_error *err)
{
    const unsigned char *bytes = (const unsigned char *)source->bytes;
    if (source->size < HEADER_SIZE)
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT,
            "%s: expected the %d bytes of an STL header, or solid; found %zu bytes", source->name,
            HEADER_SIZE, source->size);
    const uint64_t count = decode_uint(bytes + 80);
    const uint64_t room = (source->size - HEADER_SIZE) / TRIANGLE_SIZE;
    const int in_part = (source->size - HEADER_SIZE) % TRIANGLE_SIZE != 0;
    // Less than a triangle may follow the last one: some writers add a line end.
    if (count != room)
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT,
            "%s: expected the %llu triangles that the STL header states, found %llu%s",
            source->name, (unsigned long long)count, (unsigned long long)room,
            count > room && in_part ? " and a part of one" : "");
    for (uint64_t t = 0; t < count; t++) {
        const unsigned char *corner = bytes + HEADER_SIZE + TRIANGLE_SIZE * t + 12;
        double x[3][3];
        for (int k = 0; k < 9; k++) {
            x[k / 3][k % 3] = (double)decode_float(corner + 4 * k);
            if (!isfinite(x[k / 3][k % 3]))
                return pliant_error_set(
                    err, PLIANT_ERR_FORMAT,
                    "%s: triangle %llu: the %c coordinate of corner %d is not finite", source->name,
                    (unsigned long long)t, "xyz"[k % 3], k / 3);
        }
        const pliant_status status = add_triangle(builder, x, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

// The next word, in whatever line; text NULL at the end of the file.
static pliant_text_word next_word(pliant_text_cursor *cursor)
{
    for (;;) {
        const pliant_text_word word = pliant_text_cursor_word(cursor);
        if (word.text || !pliant_text_cursor_line(cursor)) return word;
    }
}

static pliant_status expect(pliant_text_cursor *cursor, const char *keyword, pliant_error *err)
{
    const pliant_text_word word = next_word(cursor);
    return is_keyword(word, keyword) ? PLIANT_OK
                                     : pliant_text_cursor_refuse(cursor, word, keyword, err);
}

// The rest of a facet, after its keyword.
static pliant_status read_facet(pliant_text_cursor *cursor, pliant_mesh_builder *builder,
                                pliant_error *err)
{
    static const char *const what[3] = {"the x coordinate", "the y coordinate", "the z coordinate"};
    double x[3][3];
    (void)pliant_text_cursor_line(cursor); // the normal
    pliant_status status = expect(cursor, "outer", err);
    if (status == PLIANT_OK) status = expect(cursor, "loop", err);
    for (int k = 0; status == PLIANT_OK && k < 3; k++) {
        status = expect(cursor, "vertex", err);
        for (int c = 0; status == PLIANT_OK && c < 3; c++)
            status = pliant_text_cursor_number(cursor, what[c], &x[k][c], err);
    }
    if (status == PLIANT_OK) status = expect(cursor, "endloop", err);
    if (status == PLIANT_OK) status = expect(cursor, "endfacet", err);
    return status < 0 ? status : add_triangle(builder, x, err);
}

static pliant_status read_ascii(const pliant_mesh_source *source, pliant_mesh_builder *builder,
                                pliant_error *err)
{
    // Several solids may follow each other. Names run to the end of their line.
    pliant_text_cursor cursor = pliant_text_cursor_begin(source->name, source->bytes, source->size);
    int inside = 0;
    for (;;) {
        const pliant_text_word word = next_word(&cursor);
        pliant_status status = PLIANT_OK;
        if (!word.text && !inside) return PLIANT_OK;
        if (!inside && is_keyword(word, "solid")) {
            inside = 1;
            (void)pliant_text_cursor_line(&cursor);
        } else if (inside && is_keyword(word, "facet")) {
            status = read_facet(&cursor, builder, err);
        } else if (inside && is_keyword(word, "endsolid")) {
            inside = 0;
            (void)pliant_text_cursor_line(&cursor);
        } else {
            status = pliant_text_cursor_refuse(&cursor, word,
                                               inside ? "facet or endsolid" : "solid", err);
        }
        if (status < 0) return status;
    }
}

pliant_status pliant_mesh_file_stl(const pliant_mesh_source *source, pliant_mesh_builder *builder,
                                   pliant_error *err)
{
    const int ascii = !fits_binary(source) && looks_ascii(source);
    const pliant_status status =
        ascii ? read_ascii(source, builder, err) : read_binary(source, builder, err);
    return status < 0 ? status : pliant_mesh_builder_weld(builder, err);
}

int pliant_mesh_file_is_stl(const pliant_mesh_source *source)
{
    return fits_binary(source) || looks_ascii(source);
}
