// mesh_file_off.c: the Object File Format of Geomview and its many writers.
//
// This follows: Geomview manual, section "OFF Files". A vertex is a line that begins with x y z, a
// face a line that begins with its corner count and corners; normals, colours and texture
// coordinates after them are not looked at, which serves COFF, NOFF, STOFF and files that carry
// colours without saying so. Refused: 4OFF and nOFF (not three dimensions) and OFF BINARY.
#include "mesh_file_formats.h"

#include "pliant/error.h"
#include "text_cursor.h"

#include <string.h>

static pliant_text_cursor begin(const pliant_mesh_source *source)
{
    pliant_text_cursor cursor = pliant_text_cursor_begin(source->name, source->bytes, source->size);
    cursor.comment = '#';
    return cursor;
}

// [ST][C][N][4][n]OFF
static int is_keyword(pliant_text_word word)
{
    if (!word.text || word.length < 3 || word.length > 8) return 0;
    if (memcmp(word.text + word.length - 3, "OFF", 3) != 0) return 0;
    for (size_t i = 0; i + 3 < word.length; i++)
        if (!memchr("STCN4n", word.text[i], 6)) return 0;
    return 1;
}

// The next line that holds a word, from where the cursor stands; its first word is looked at only.
static int next_statement(pliant_text_cursor *cursor)
{
    do {
        pliant_text_cursor peek = *cursor;
        if (pliant_text_cursor_word(&peek).text) return 1;
    } while (pliant_text_cursor_line(cursor));
    return 0;
}

static pliant_status refuse_end(const pliant_text_cursor *cursor, int64_t promised, int64_t found,
                                const char *what, pliant_error *err)
{
    return pliant_error_set(
        err, PLIANT_ERR_FORMAT, "%s:%lld: expected %lld %s, found the end of the file after %lld",
        cursor->name, (long long)cursor->line, (long long)promised, what, (long long)found);
}

// The keyword, which old files leave out, and the three counts.
static pliant_status read_header(pliant_text_cursor *cursor, int64_t *vertex_count,
                                 int64_t *face_count, pliant_error *err)
{
    if (!next_statement(cursor))
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: expected OFF, found nothing",
                                cursor->name);
    pliant_text_cursor peek = *cursor;
    pliant_text_word word = pliant_text_cursor_word(&peek);
    double number;
    if (is_keyword(word)) {
        if (memchr(word.text, '4', word.length) || memchr(word.text, 'n', word.length))
            return pliant_text_cursor_refuse(&peek, word, "OFF in three dimensions", err);
        *cursor = peek;
        word = pliant_text_cursor_word(&peek);
        if (pliant_text_word_is(word, "BINARY"))
            return pliant_text_cursor_refuse(&peek, word, "ascii OFF", err);
        if (!next_statement(cursor)) return refuse_end(cursor, 3, 0, "counts", err);
    } else if (!pliant_text_word_number(word, &number)) {
        return pliant_text_cursor_refuse(&peek, word, "OFF", err);
    }
    pliant_status status = pliant_text_cursor_count(cursor, "the vertex count", vertex_count, err);
    if (status == PLIANT_OK)
        status = pliant_text_cursor_count(cursor, "the face count", face_count, err);
    // The edge count follows; many writers leave it out or write 0.
    if (status == PLIANT_OK) (void)pliant_text_cursor_line(cursor);
    return status;
}

pliant_status pliant_mesh_file_off(const pliant_mesh_source *source, pliant_mesh_builder *builder,
                                   pliant_error *err)
{
    static const char *const what[3] = {"the x coordinate", "the y coordinate", "the z coordinate"};
    pliant_text_cursor cursor = begin(source);
    int64_t vertex_count, face_count;
    pliant_status status = read_header(&cursor, &vertex_count, &face_count, err);
    for (int64_t v = 0; status == PLIANT_OK && v < vertex_count; v++) {
        if (!next_statement(&cursor)) return refuse_end(&cursor, vertex_count, v, "vertices", err);
        double x[3];
        for (int c = 0; status == PLIANT_OK && c < 3; c++)
            status = pliant_text_cursor_number(&cursor, what[c], &x[c], err);
        if (status == PLIANT_OK) status = pliant_mesh_builder_vertex(builder, x, err);
        (void)pliant_text_cursor_line(&cursor);
    }
    for (int64_t f = 0; status == PLIANT_OK && f < face_count; f++) {
        if (!next_statement(&cursor)) return refuse_end(&cursor, face_count, f, "faces", err);
        builder->line = cursor.line;
        int64_t corner_count, index;
        status = pliant_text_cursor_count(&cursor, "a corner count", &corner_count, err);
        for (int64_t k = 0; status == PLIANT_OK && k < corner_count; k++) {
            status = pliant_text_cursor_count(&cursor, "a vertex number", &index, err);
            if (status == PLIANT_OK)
                status = pliant_mesh_builder_corner(builder, index, index, err);
        }
        if (status == PLIANT_OK) status = pliant_mesh_builder_polygon(builder, err);
        (void)pliant_text_cursor_line(&cursor);
    }
    return status;
}

int pliant_mesh_file_is_off(const pliant_mesh_source *source)
{
    pliant_text_cursor cursor = begin(source);
    return next_statement(&cursor) && is_keyword(pliant_text_cursor_word(&cursor));
}
