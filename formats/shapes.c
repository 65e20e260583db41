// shapes.c: the shapes of tools and obstacles, as words of a contact script.
#include "shapes.h"

static pliant_status parse_sphere(pliant_words *c, pliant_statement *s)
{
    const pliant_status status = pliant_words_vector(c, s->value);
    return status < 0 ? status : pliant_words_positive(c, "a radius, a number > 0", &s->scalar);
}

static pliant_status parse_plane(pliant_words *c, pliant_statement *s)
{
    const pliant_word w = pliant_words_peek(c);
    const pliant_status status = pliant_words_vector(c, s->value);
    if (status < 0) return status;
    if (s->value[0] == 0 && s->value[1] == 0 && s->value[2] == 0)
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, "a normal that is not 0 0 0");
    return pliant_words_number(c, "the plane's distance, a number", &s->scalar);
}

static pliant_status parse_capsule(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_vector(c, s->value);
    if (status == PLIANT_OK) status = pliant_words_vector(c, s->end);
    return status < 0 ? status : pliant_words_positive(c, "a radius, a number > 0", &s->scalar);
}

static pliant_status parse_box(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_vector(c, s->value);
    if (status < 0) return status;
    const pliant_word w = pliant_words_peek(c);
    status = pliant_words_vector(c, s->end);
    if (status < 0) return status;
    for (int d = 0; d < 3; d++)
        if (!(s->end[d] > s->value[d]))
            return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w,
                                       "a corner that is greater than the first in x, y and z");
    return PLIANT_OK;
}

static const struct {
    const char *word;
    pliant_shape_kind kind;
    pliant_status (*parse)(pliant_words *c, pliant_statement *s);
} shapes[] = {
    {"sphere", PLIANT_SHAPE_SPHERE, parse_sphere},
    {"plane", PLIANT_SHAPE_PLANE, parse_plane},
    {"capsule", PLIANT_SHAPE_CAPSULE, parse_capsule},
    {"box", PLIANT_SHAPE_BOX, parse_box},
};

enum { SHAPE_COUNT = sizeof shapes / sizeof *shapes };

pliant_shape_kind pliant_shape_of(pliant_word w)
{
    for (int i = 0; i < SHAPE_COUNT; i++)
        if (pliant_word_is(w, shapes[i].word)) return shapes[i].kind;
    return PLIANT_SHAPE_NONE;
}

const char *pliant_shape_keyword(pliant_shape_kind kind)
{
    for (int i = 0; i < SHAPE_COUNT; i++)
        if (shapes[i].kind == kind) return shapes[i].word;
    return "shape";
}

pliant_status pliant_shape_parse(pliant_words *c, pliant_word w, pliant_statement *s)
{
    s->shape = pliant_shape_of(w);
    for (int i = 0; i < SHAPE_COUNT; i++)
        if (shapes[i].kind == s->shape) return shapes[i].parse(c, s);
    return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, "a shape");
}

pliant_status pliant_shape_parse_friction(pliant_words *c, pliant_statement *s)
{
    if (!pliant_word_is(pliant_words_peek(c), "friction")) return PLIANT_OK;
    pliant_words_take(c);
    return pliant_words_not_negative(c, "a friction coefficient, a number >= 0", &s->friction);
}
