// mesh_file_obj.c: Wavefront OBJ: vertices and faces, with the file's vertex numbers.
//
// This follows: Wavefront, Object Files (.obj), appendix B1 of the Advanced Visualizer manual. Read
// are v and f (and fo, its old name). Everything else that begins with a letter is passed over:
// texture and normal data, names, groups, materials, lines, points, curves, and what exporters add.
// What follows x y z on a vertex line (a weight, a colour) is not looked at. Two passes: vertices,
// then faces, so that a face may stand before its vertices.
#include "mesh_file_formats.h"

#include "pliant/error.h"
#include "text_cursor.h"

static pliant_text_cursor begin(const pliant_mesh_source *source)
{
    pliant_text_cursor cursor = pliant_text_cursor_begin(source->name, source->bytes, source->size);
    cursor.comment = '#';
    cursor.continuation = '\\';
    return cursor;
}

static int is_vertex(pliant_text_word word)
{
    return pliant_text_word_is(word, "v");
}

static int is_face(pliant_text_word word)
{
    return pliant_text_word_is(word, "f") || pliant_text_word_is(word, "fo");
}

static int starts_with_letter(pliant_text_word word)
{
    const char c = word.text[0];
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

static pliant_status read_vertices(const pliant_mesh_source *source, pliant_mesh_builder *builder,
                                   pliant_error *err)
{
    static const char *const what[3] = {"the x coordinate", "the y coordinate", "the z coordinate"};
    pliant_text_cursor cursor = begin(source);
    do {
        const pliant_text_word word = pliant_text_cursor_word(&cursor);
        if (!word.text) continue;
        if (is_vertex(word)) {
            double x[3];
            for (int c = 0; c < 3; c++) {
                const pliant_status status =
                    pliant_text_cursor_number(&cursor, what[c], &x[c], err);
                if (status < 0) return status;
            }
            const pliant_status status = pliant_mesh_builder_vertex(builder, x, err);
            if (status < 0) return status;
        } else if (!starts_with_letter(word)) {
            return pliant_text_cursor_refuse(&cursor, word, "a statement such as v or f", err);
        }
    } while (pliant_text_cursor_line(&cursor));
    return PLIANT_OK;
}

// The vertex number of a corner: 12, 12/3, 12/3/4, 12//4. What follows the number is not looked up.
static int corner_number(pliant_text_word word, int64_t *number)
{
    size_t length = 0;
    while (length < word.length && word.text[length] != '/') length++;
    int slashes = 0;
    for (size_t i = length; i < word.length; i++) {
        const char c = word.text[i];
        if (c == '/') slashes++;
        else if (!((c >= '0' && c <= '9') || c == '-' || c == '+')) return 0;
    }
    return slashes <= 2 && pliant_text_word_integer((pliant_text_word){word.text, length}, number);
}

// The rest of an f line. `seen` vertices stand before it: relative numbers count back from there.
static pliant_status read_face(pliant_text_cursor *cursor, int32_t seen,
                               pliant_mesh_builder *builder, pliant_error *err)
{
    builder->line = cursor->line;
    for (;;) {
        const pliant_text_word word = pliant_text_cursor_word(cursor);
        if (!word.text) return pliant_mesh_builder_polygon(builder, err);
        int64_t number;
        if (!corner_number(word, &number))
            return pliant_text_cursor_refuse(cursor, word, "a vertex number", err);
        if (number < 0 && -number > seen)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s:%lld: face refers to vertex %lld, but %d stand before it",
                                    cursor->name, (long long)cursor->line, (long long)number, seen);
        if (number == 0)
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "%s:%lld: face refers to vertex 0 of %d, expected numbers from 1", cursor->name,
                (long long)cursor->line, builder->vertex_count);
        const int64_t index = number < 0 ? seen + number : number - 1;
        const pliant_status status = pliant_mesh_builder_corner(builder, index, number, err);
        if (status < 0) return status;
    }
}

pliant_status pliant_mesh_file_obj(const pliant_mesh_source *source, pliant_mesh_builder *builder,
                                   pliant_error *err)
{
    pliant_status status = read_vertices(source, builder, err);
    if (status < 0) return status;
    pliant_text_cursor cursor = begin(source);
    int32_t seen = 0;
    do {
        const pliant_text_word word = pliant_text_cursor_word(&cursor);
        if (!word.text) continue;
        if (is_vertex(word)) seen++;
        else if (is_face(word)) status = read_face(&cursor, seen, builder, err);
        if (status < 0) return status;
    } while (pliant_text_cursor_line(&cursor));
    return PLIANT_OK;
}

int pliant_mesh_file_is_obj(const pliant_mesh_source *source)
{
    // The first statements, as far as a screen: one of OBJ's own, then a vertex somewhere.
    enum { LINE_LIMIT = 200 };
    static const char *const known[] = {"v", "vt", "vn", "vp",     "f",
                                        "o", "g",  "s",  "mtllib", "usemtl"};
    pliant_text_cursor cursor = begin(source);
    do {
        const pliant_text_word word = pliant_text_cursor_word(&cursor);
        if (!word.text) continue;
        if (is_vertex(word)) {
            double x;
            return pliant_text_word_number(pliant_text_cursor_word(&cursor), &x);
        }
        int found = 0;
        for (size_t i = 0; i < sizeof known / sizeof *known; i++)
            found |= pliant_text_word_is(word, known[i]);
        if (!found) return 0;
    } while (cursor.line < LINE_LIMIT && pliant_text_cursor_line(&cursor));
    return 0;
}
