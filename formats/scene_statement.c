// scene_statement.c: the statements of a contact script about lattices.
#include "scene_statement.h"

#include "shapes.h"

// ---- What several have in common ----

pliant_status pliant_scene_statement_instance(pliant_words *c, pliant_statement *s)
{
    if (!pliant_word_is(pliant_words_peek(c), "instance")) return PLIANT_OK;
    pliant_words_take(c);
    s->has_instance = 1;
    return pliant_words_integer(c, "the number of an instance, from 0", 0, INT32_MAX, &s->instance);
}

pliant_status pliant_scene_statement_over(pliant_words *c, pliant_statement *s)
{
    if (!pliant_word_is(pliant_words_peek(c), "over")) return PLIANT_OK;
    pliant_words_take(c);
    return pliant_words_integer(c, "a number of steps, 1 or more", 1, INT32_MAX, &s->count);
}

// [instance I] K or near X Y Z [radius R]
static pliant_status parse_particles(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_scene_statement_instance(c, s);
    if (status < 0) return status;
    if (!pliant_word_is(pliant_words_peek(c), "near")) {
        int64_t number = 0;
        status = pliant_words_integer(c, "a particle: K or near X Y Z", 0, INT32_MAX, &number);
        s->vertex.kind = PLIANT_VERTEX_MODEL;
        s->vertex.number = (int32_t)number;
        return status;
    }
    pliant_words_take(c);
    s->vertex.kind = PLIANT_VERTEX_NEAR;
    status = pliant_words_vector(c, s->vertex.position);
    if (status < 0 || !pliant_word_is(pliant_words_peek(c), "radius")) return status;
    pliant_words_take(c);
    return pliant_words_positive(c, "a radius, a number > 0", &s->scalar);
}

static pliant_status parse_share(pliant_words *c, const char *expected, double *value)
{
    const pliant_word w = pliant_words_peek(c);
    const pliant_status status = pliant_words_not_negative(c, expected, value);
    return status == PLIANT_OK && *value > 1
               ? pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, expected)
               : status;
}

// ---- Statements ----

static pliant_status parse_instances(pliant_words *c, pliant_statement *s)
{
    pliant_copies *copies = &s->copies;
    copies->seed = -1;
    pliant_status status = pliant_words_integer(c, "a number of instances, 1 to 1000000", 1,
                                                PLIANT_SCRIPT_COPIES_LIMIT, &s->count);
    while (status == PLIANT_OK && pliant_words_peek(c).length > 0) {
        const pliant_word w = pliant_words_take(c);
        if (pliant_word_is(w, "at")) status = pliant_words_vector(c, s->value);
        else if (pliant_word_is(w, "velocity")) status = pliant_words_vector(c, copies->velocity);
        else if (pliant_word_is(w, "step")) {
            copies->has_step = 1;
            status = pliant_words_vector(c, s->end);
        } else if (pliant_word_is(w, "columns"))
            status = pliant_words_integer(c, "a number of columns, 1 or more", 1,
                                          PLIANT_SCRIPT_COPIES_LIMIT, &copies->columns);
        else if (pliant_word_is(w, "rows"))
            status = pliant_words_integer(c, "a number of rows, 1 or more", 1,
                                          PLIANT_SCRIPT_COPIES_LIMIT, &copies->rows);
        else if (pliant_word_is(w, "random"))
            status = pliant_words_integer(c, "a seed, a whole number from 0", 0, INT64_MAX,
                                          &copies->seed);
        else
            status = pliant_words_refuse(c, PLIANT_ERR_FORMAT, w,
                                         "at, step, columns, rows, random or velocity");
    }
    return status;
}

static pliant_status parse_damping(pliant_words *c, pliant_statement *s)
{
    const pliant_status status = parse_share(c, "a damping, a number from 0 to 1", &s->scalar);
    s->count = 1;
    if (status < 0 || !pliant_word_is(pliant_words_peek(c), "every")) return status;
    pliant_words_take(c);
    return pliant_words_integer(c, "a number of steps, 1 or more", 1, INT32_MAX, &s->count);
}

static pliant_status parse_rigid_damping(pliant_words *c, pliant_statement *s)
{
    return parse_share(c, "a damping, a number from 0 to 1", &s->scalar);
}

static pliant_status parse_strain_limit(pliant_words *c, pliant_statement *s)
{
    return pliant_words_not_negative(c, "a strain limit, a number >= 0", &s->scalar);
}

static pliant_status parse_grab(pliant_words *c, pliant_statement *s)
{
    const pliant_status status = parse_particles(c, s);
    if (status < 0 || pliant_words_peek(c).length == 0) return status;
    return pliant_words_name(c, s->name);
}

static pliant_status parse_name(pliant_words *c, pliant_statement *s)
{
    return pliant_words_name(c, s->name);
}

static pliant_status parse_impulse(pliant_words *c, pliant_statement *s)
{
    const pliant_status status = parse_particles(c, s);
    return status < 0 ? status : pliant_words_vector(c, s->value);
}

// none, all, or some of self, bodies, surfaces; [friction MU]
static pliant_status parse_collide(pliant_words *c, pliant_statement *s)
{
    static const struct {
        const char *word;
        int64_t bit;
    } kinds[] = {{"self", PLIANT_COLLIDE_SELF},
                 {"bodies", PLIANT_COLLIDE_BODIES},
                 {"surfaces", PLIANT_COLLIDE_SURFACES}};
    const pliant_word first = pliant_words_take(c);
    s->count = PLIANT_COLLIDE_NONE;
    if (pliant_word_is(first, "none")) return PLIANT_OK;
    if (pliant_word_is(first, "all")) {
        s->count = PLIANT_COLLIDE_SELF | PLIANT_COLLIDE_BODIES | PLIANT_COLLIDE_SURFACES;
        return pliant_shape_parse_friction(c, s);
    }
    for (pliant_word w = first; w.length > 0; w = pliant_words_take(c)) {
        int k = 0;
        while (k < 3 && !pliant_word_is(w, kinds[k].word)) k++;
        if (k == 3)
            return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w,
                                       "none, all, or some of self, bodies and surfaces");
        s->count |= kinds[k].bit;
        if (pliant_word_is(pliant_words_peek(c), "friction"))
            return pliant_shape_parse_friction(c, s);
    }
    return s->count ? PLIANT_OK
                    : pliant_words_refuse(c, PLIANT_ERR_FORMAT, first,
                                          "none, all, or some of self, bodies and surfaces");
}

static pliant_status parse_bone(pliant_words *c, pliant_statement *s)
{
    const pliant_status status = pliant_words_name(c, s->name);
    return status < 0 ? status : pliant_words_vector(c, s->value);
}

static pliant_status parse_bind(pliant_words *c, pliant_statement *s)
{
    const pliant_status status = pliant_words_name(c, s->name);
    return status < 0 ? status : parse_particles(c, s);
}

static pliant_status parse_turn(pliant_words *c, pliant_statement *s)
{
    pliant_status status = pliant_words_name(c, s->name);
    if (status < 0) return status;
    const pliant_word w = pliant_words_peek(c);
    status = pliant_words_vector(c, s->value);
    if (status < 0) return status;
    if (s->value[0] == 0 && s->value[1] == 0 && s->value[2] == 0)
        return pliant_words_refuse(c, PLIANT_ERR_FORMAT, w, "an axis that is not 0 0 0");
    status = pliant_words_number(c, "an angle in degrees, a number", &s->scalar);
    return status < 0 ? status : pliant_scene_statement_over(c, s);
}

static const struct {
    const char *word;
    pliant_statement_kind kind;
    pliant_status (*parse)(pliant_words *c, pliant_statement *s);
} keywords[] = {
    {"instances", PLIANT_STATEMENT_INSTANCES, parse_instances},
    {"damping", PLIANT_STATEMENT_DAMPING, parse_damping},
    {"rigid-damping", PLIANT_STATEMENT_RIGID_DAMPING, parse_rigid_damping},
    {"strain-limit", PLIANT_STATEMENT_STRAIN_LIMIT, parse_strain_limit},
    {"grab", PLIANT_STATEMENT_GRAB, parse_grab},
    {"let", PLIANT_STATEMENT_LET, parse_name},
    {"impulse", PLIANT_STATEMENT_IMPULSE, parse_impulse},
    {"collide", PLIANT_STATEMENT_COLLIDE, parse_collide},
    {"bone", PLIANT_STATEMENT_BONE, parse_bone},
    {"bind", PLIANT_STATEMENT_BIND, parse_bind},
    {"turn", PLIANT_STATEMENT_TURN, parse_turn},
};

enum { KEYWORD_COUNT = sizeof keywords / sizeof *keywords };

pliant_statement_kind pliant_scene_statement_of(pliant_word w)
{
    for (int i = 0; i < KEYWORD_COUNT; i++)
        if (pliant_word_is(w, keywords[i].word)) return keywords[i].kind;
    return pliant_shape_of(w) != PLIANT_SHAPE_NONE ? PLIANT_STATEMENT_OBSTACLE
                                                   : PLIANT_STATEMENT_NONE;
}

const char *pliant_scene_statement_keyword(pliant_statement_kind kind)
{
    for (int i = 0; i < KEYWORD_COUNT; i++)
        if (keywords[i].kind == kind) return keywords[i].word;
    return NULL;
}

// SHAPE [taper R] [friction MU] [as NAME]; a taper of capsules only
static pliant_status parse_obstacle(pliant_words *c, pliant_word w, pliant_statement *s)
{
    pliant_status status = pliant_shape_parse(c, w, s);
    if (status == PLIANT_OK && s->shape == PLIANT_SHAPE_CAPSULE &&
        pliant_word_is(pliant_words_peek(c), "taper")) {
        pliant_words_take(c);
        s->has_taper = 1;
        status = pliant_words_not_negative(c, "a radius, a number >= 0", &s->taper);
    }
    if (status == PLIANT_OK) status = pliant_shape_parse_friction(c, s);
    if (status < 0 || !pliant_word_is(pliant_words_peek(c), "as")) return status;
    pliant_words_take(c);
    return pliant_words_name(c, s->name);
}

pliant_status pliant_scene_statement_parse(pliant_words *c, pliant_word w, pliant_statement *s)
{
    for (int i = 0; i < KEYWORD_COUNT; i++)
        if (pliant_word_is(w, keywords[i].word)) return keywords[i].parse(c, s);
    return parse_obstacle(c, w, s);
}
