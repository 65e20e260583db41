// contents.c: open a file, find out what it is, bind it, verify it.
#include "contents.h"

#include "pliant/error.h"

#include <string.h>

const char *pliant_contents_kind_text(pliant_contents_kind kind)
{
    switch (kind) {
    case PLIANT_CONTENTS_MODEL:
        return "model";
    case PLIANT_CONTENTS_DENSE:
        return "dense";
    case PLIANT_CONTENTS_RECORDING:
        return "recording";
    case PLIANT_CONTENTS_OTHER:
        break;
    }
    return "other";
}

static pliant_contents_kind kind_of(const pliant_reader *reader)
{
    if (pliant_reader_find(reader, "/mesh/vertices")) return PLIANT_CONTENTS_MODEL;
    if (pliant_reader_find(reader, "/dense/nodes")) return PLIANT_CONTENTS_DENSE;
    if (pliant_reader_find(reader, "/displacement")) return PLIANT_CONTENTS_RECORDING;
    return PLIANT_CONTENTS_OTHER;
}

pliant_status pliant_contents_open(const char *path, pliant_contents *contents, pliant_error *err)
{
    pliant_contents c;
    memset(&c, 0, sizeof c);
    pliant_status status = pliant_reader_open(path, &c.reader, err);
    if (status < 0) return status;
    c.kind = kind_of(c.reader);
    if (c.kind == PLIANT_CONTENTS_MODEL) status = pliant_model_view_bind(c.reader, &c.model, err);
    if (c.kind == PLIANT_CONTENTS_DENSE) status = pliant_dense_view_bind(c.reader, &c.dense, err);
    if (status < 0) {
        pliant_reader_close(c.reader);
        return status;
    }
    const pliant_section *text = pliant_reader_find(c.reader, "/provenance/text");
    if (text && text->type == PLIANT_U1) {
        c.text = text->data;
        c.text_bytes = (size_t)text->bytes;
    }
    *contents = c;
    return PLIANT_OK;
}

void pliant_contents_close(pliant_contents *contents)
{
    pliant_reader_close(contents->reader);
    memset(contents, 0, sizeof *contents);
}

pliant_status pliant_contents_hierarchy(const pliant_contents *contents,
                                        pliant_hierarchy **hierarchy, pliant_error *err)
{
    const pliant_model_view *v = &contents->model;
    pliant_error reason = {""};
    const pliant_status status =
        pliant_hierarchy_create(v->level_count, v->level_vertex_count, v->face_count, v->faces,
                                v->parents, hierarchy, &reason);
    if (status < 0)
        return pliant_error_set(err, status, "%.250s: /mesh: %.240s",
                                pliant_reader_name(contents->reader), reason.text);
    return status;
}

pliant_status pliant_contents_verify(const pliant_contents *contents, pliant_error *err)
{
    pliant_status status = pliant_reader_verify(contents->reader, err);
    if (status < 0 || contents->kind != PLIANT_CONTENTS_MODEL) return status;
    pliant_hierarchy *hierarchy = NULL;
    status = pliant_contents_hierarchy(contents, &hierarchy, err);
    pliant_hierarchy_destroy(hierarchy);
    return status;
}

int pliant_contents_next_pair(const pliant_contents *contents, size_t *at,
                              pliant_contents_pair *pair)
{
    while (*at < contents->text_bytes && contents->text[*at] == '\n') ++*at;
    if (*at >= contents->text_bytes) return 0;
    const char *line = contents->text + *at;
    const char *end = memchr(line, '\n', contents->text_bytes - *at);
    const size_t length = end ? (size_t)(end - line) : contents->text_bytes - *at;
    const char *equals = memmem(line, length, " = ", 3);
    pair->key = line;
    pair->key_bytes = equals ? (size_t)(equals - line) : 0;
    pair->value = equals ? equals + 3 : line;
    pair->value_bytes = length - (size_t)(pair->value - line);
    *at += length;
    return 1;
}
