// approach.c: the first crossing of a point's way, the nearest face, and on which side of it.
#include "approach.h"

#include "model.h"
#include "triangle.h"
#include "vector.h"

#include <math.h>
#include <string.h>

// Groups are faces of the level this much coarser than the finest: 16 faces have some 15 corners,
// and the dragon's 19840 faces are 1240 groups, whose dues are read in half a microsecond.
enum { coarser = 2 };

void pliant_approach_lay_out(pliant_arena *arena, const pliant_model *model,
                             pliant_approach *approach)
{
    const int32_t finest = model->finest_level, level = finest > coarser ? finest - coarser : 0;
    approach->group_count = model->hierarchy->face_count[level];
    approach->group_size = 1 << 2 * (finest - level);
    PLIANT_TAKE(arena, approach->due, approach->group_count);
    PLIANT_TAKE(arena, approach->groups, approach->group_count);
}

typedef struct search {
    const pliant_approach_query *query;
    double length;                  // of the way
    pliant_nearest best;            // to `from`
    int32_t best_face;              // -1: none looked at
    double first;                   // how far along the way the first crossing is
    pliant_approach_result result;  // it
} search;

// Of faces that are equally near, sharing the nearest edge or corner, the one that faces the point
// most squarely tells the side: others may be seen from behind although the point is outside.
static int32_t is_better(const pliant_nearest *a, const pliant_nearest *b, double slack)
{
    if (a->distance < b->distance - slack) return 1;
    return a->distance <= b->distance + slack && fabs(a->side) > fabs(b->side);
}

static void touch(search *s, int32_t face, const double *weights)
{
    s->result.is_touching = 1;
    s->result.point.face = face;
    memcpy(s->result.point.weights, weights, sizeof s->result.point.weights);
}

static void look_at_distance(search *s, const pliant_deformed *deformed, int32_t face,
                             double *nearest)
{
    double corners[3][3];
    pliant_deformed_corners(deformed, face, corners);
    const pliant_nearest found = pliant_triangle_nearest(corners[0], s->query->from);
    *nearest = fmin(*nearest, found.distance);
    if (!is_better(&found, &s->best, s->query->slack)) return;
    s->best = found;
    s->best_face = face;
}

static void look_at_way(search *s, const pliant_deformed *deformed, int32_t face)
{
    double corners[3][3], at, weights[3];
    pliant_deformed_corners(deformed, face, corners);
    if (!pliant_triangle_crossed(corners[0], s->query->from, s->query->to, s->query->slack, &at,
                                 weights) ||
        at >= s->first)
        return;
    s->first = at;
    touch(s, face, weights);
}

typedef struct box {
    double low[3], high[3];
} box;

static box enclose(const pliant_deformed *deformed, int32_t first, int32_t count)
{
    box b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    const int32_t *corners = deformed->faces + 3 * (size_t)first;
    for (int32_t k = 0; k < 3 * count; k++) {
        const double *place = deformed->place + 3 * (size_t)corners[k];
        for (int c = 0; c < 3; c++) {
            b.low[c] = place[c] < b.low[c] ? place[c] : b.low[c];
            b.high[c] = place[c] > b.high[c] ? place[c] : b.high[c];
        }
    }
    return b;
}

static double diagonal_of(const box *b)
{
    double diagonal[3];
    vector_subtract(b->high, b->low, diagonal);
    return vector_length(diagonal);
}

static double distance_to(const box *b, const double *point)
{
    double beside[3];
    for (int c = 0; c < 3; c++)
        beside[c] = fmax(fmax(b->low[c] - point[c], point[c] - b->high[c]), 0);
    return vector_length(beside);
}

// Does the way meet the box? By slabs: the part of the way that is inside shrinks coordinate by
// coordinate.
static int32_t is_on_way(const box *b, const pliant_approach_query *query)
{
    double enter = 0, leave = 1;
    for (int c = 0; c < 3; c++) {
        const double step = query->to[c] - query->from[c];
        const double low = b->low[c] - query->slack - query->from[c];
        const double high = b->high[c] + query->slack - query->from[c];
        if (step == 0) {
            if (low > 0 || high < 0) return 0;
            continue;
        }
        enter = fmax(enter, fmin(low / step, high / step));
        leave = fmin(leave, fmax(low / step, high / step));
    }
    return enter <= leave;
}

// Look at all groups that may be within `distance` of the point.
static void look(pliant_approach *approach, pliant_deformed *deformed, pliant_solver *solver,
                 double distance, search *s)
{
    int32_t count = 0;
    for (int32_t g = 0; g < approach->group_count; g++)
        if (approach->due[g] <= approach->way + distance) approach->groups[count++] = g;
    const int32_t size = approach->group_size;
    for (int32_t i = 0; i < count; i++)
        for (int32_t k = 0; k < size; k++)
            pliant_deformed_want_face(deformed, size * approach->groups[i] + k);
    pliant_deformed_evaluate(deformed, solver);
    for (int32_t i = 0; i < count; i++) {
        const int32_t first = size * approach->groups[i];
        const box around = enclose(deformed, first, size);
        double nearest = distance_to(&around, s->query->from);
        // Far away, and no matter for what is nearest of all: the box will do.
        if (!(nearest > diagonal_of(&around) && nearest > s->best.distance)) {
            nearest = INFINITY;
            for (int32_t k = 0; k < size; k++) look_at_distance(s, deformed, first + k, &nearest);
        }
        approach->due[approach->groups[i]] = approach->way + nearest;
        if (nearest > s->length + s->query->slack || !is_on_way(&around, s->query)) continue;
        for (int32_t k = 0; k < size; k++) look_at_way(s, deformed, first + k);
    }
}

static int32_t is_inside(const search *s)
{
    return s->best_face >= 0 && s->best.distance <= s->query->swept &&
           s->best.side < -s->query->slack;
}

pliant_approach_result pliant_approach_search(pliant_approach *approach, pliant_deformed *deformed,
                                              pliant_solver *solver,
                                              const pliant_approach_query *query)
{
    search s = {.query = query, .best = {.distance = INFINITY}, .best_face = -1, .first = INFINITY};
    double way[3];
    vector_subtract(query->from, approach->at, way);
    approach->way += vector_length(way) + query->swept;
    memcpy(approach->at, query->from, sizeof approach->at);
    if (!isfinite(approach->way)) {
        approach->way = 0;
        for (int32_t g = 0; g < approach->group_count; g++) approach->due[g] = 0;
    }
    vector_subtract(query->to, query->from, way);
    s.length = vector_length(way);
    look(approach, deformed, solver, s.length, &s);
    // Which side the point is on only the nearest face of all knows.
    if (is_inside(&s)) look(approach, deformed, solver, s.best.distance, &s);
    // Come over it: then its way does not matter.
    if (is_inside(&s)) touch(&s, s.best_face, s.best.weights);
    return s.result;
}
