// contact_levels.c: on which level the nodes are, place by place.
#include "contact_levels.h"

#include <string.h>

static int32_t odd_count(const pliant_model *model)
{
    return model->vertex_count - model->hierarchy->vertex_count[0];
}

void pliant_contact_levels_lay_out(pliant_arena *arena, const pliant_model *model,
                                   pliant_contact_levels *levels)
{
    levels->model = model;
    PLIANT_TAKE(arena, levels->first, model->vertex_count);
    PLIANT_TAKE(arena, levels->level, model->vertex_count);
    PLIANT_TAKE(arena, levels->child_begin, (size_t)model->vertex_count + 1);
    PLIANT_TAKE(arena, levels->children, 2 * (size_t)odd_count(model));
    PLIANT_TAKE(arena, levels->refined, model->domains[PLIANT_DOMAIN_FREE].count);
    PLIANT_TAKE(arena, levels->refined_at, model->vertex_count);
}

static const int32_t *parents_of(const pliant_contact_levels *levels, int32_t vertex)
{
    const pliant_hierarchy *hierarchy = levels->model->hierarchy;
    return hierarchy->stencils[vertex - hierarchy->vertex_count[0]].parents;
}

// Count, add up, and fill from the back, so that begin ends where it should.
static void list_children(pliant_contact_levels *levels)
{
    const pliant_model *model = levels->model;
    const int32_t n = model->vertex_count, base = model->hierarchy->vertex_count[0];
    memset(levels->child_begin, 0, ((size_t)n + 1) * sizeof *levels->child_begin);
    for (int32_t v = base; v < n; v++)
        for (int k = 0; k < 2; k++) levels->child_begin[parents_of(levels, v)[k]]++;
    for (int32_t v = 0; v < n; v++) levels->child_begin[v + 1] += levels->child_begin[v];
    for (int32_t v = n; v-- > base;)
        for (int k = 0; k < 2; k++)
            levels->children[--levels->child_begin[parents_of(levels, v)[k]]] = v;
}

static int32_t is_free(const pliant_contact_levels *levels, int32_t vertex)
{
    return levels->model->domain[vertex] == PLIANT_DOMAIN_FREE;
}

// The level of a node that was never replaced.
static int32_t default_level(const pliant_contact_levels *levels, int32_t vertex)
{
    const int32_t first = levels->first[vertex];
    return first > levels->coarsest ? first : levels->coarsest;
}

void pliant_contact_levels_begin(pliant_contact_levels *levels, int32_t coarsest, int32_t finest)
{
    const pliant_model *model = levels->model;
    levels->coarsest = coarsest;
    levels->finest = finest;
    for (int32_t v = 0, level = 0; v < model->vertex_count; v++) {
        while (v >= model->hierarchy->vertex_count[level]) level++;
        levels->first[v] = (uint8_t)level;
        levels->level[v] = (uint8_t)default_level(levels, v);
        levels->refined_at[v] = -1;
    }
    levels->refined_count = 0;
    list_children(levels);
}

// An odd vertex is halfway between its parents, of which fixed ones have no hats.
pliant_hat_values pliant_contact_levels_coarser(const pliant_contact_levels *levels, int32_t level,
                                                const pliant_hat_values *finer)
{
    pliant_hat_values coarser = {0};
    for (int32_t i = 0; i < finer->count; i++) {
        const int32_t is_odd = levels->first[finer->vertex[i]] > level;
        for (int k = 0; k <= is_odd; k++) {
            const int32_t v = is_odd ? parents_of(levels, finer->vertex[i])[k] : finer->vertex[i];
            if (!is_free(levels, v)) continue;
            int32_t at = 0;
            while (at < coarser.count && coarser.vertex[at] != v) at++;
            // All are corners of one triangle.
            if (at == 3) continue;
            if (at == coarser.count) coarser.vertex[coarser.count++] = v;
            coarser.value[at] += is_odd ? finer->value[i] / 2 : finer->value[i];
        }
    }
    return coarser;
}

pliant_hat_values pliant_contact_levels_hats(const pliant_contact_levels *levels, int32_t level,
                                             int32_t vertex)
{
    pliant_hat_values hats = {.count = 1, .vertex = {vertex}, .value = {1}};
    for (int32_t l = levels->first[vertex]; l-- > level;)
        hats = pliant_contact_levels_coarser(levels, l, &hats);
    return hats;
}

int32_t pliant_contact_levels_exists(const pliant_contact_levels *levels, int32_t vertex)
{
    const int32_t first = levels->first[vertex];
    if (first > levels->finest) return 0;
    if (first <= levels->coarsest) return 1;
    const int32_t *parents = parents_of(levels, vertex);
    // Nothing covers a vertex between fixed ones, so its node is always there.
    if (!is_free(levels, parents[0]) && !is_free(levels, parents[1])) return 1;
    for (int k = 0; k < 2; k++)
        if (is_free(levels, parents[k]) && levels->level[parents[k]] >= first &&
            pliant_contact_levels_exists(levels, parents[k]))
            return 1;
    return 0;
}

static void set_level(pliant_contact_levels *levels, int32_t vertex, int32_t level)
{
    levels->level[vertex] = (uint8_t)level;
    const int32_t was_refined = levels->refined_at[vertex] >= 0;
    const int32_t is_refined = level > default_level(levels, vertex);
    if (is_refined && !was_refined) {
        levels->refined_at[vertex] = levels->refined_count;
        levels->refined[levels->refined_count++] = vertex;
    } else if (!is_refined && was_refined) {
        const int32_t at = levels->refined_at[vertex];
        const int32_t last = levels->refined[--levels->refined_count];
        levels->refined[at] = last;
        levels->refined_at[last] = at;
        levels->refined_at[vertex] = -1;
    }
}

int32_t pliant_contact_levels_refine(pliant_contact_levels *levels, int32_t vertex,
                                     int32_t replaced[3])
{
    if (pliant_contact_levels_exists(levels, vertex)) return 0;
    for (int32_t level = levels->coarsest; level < levels->finest; level++) {
        const pliant_hat_values hats = pliant_contact_levels_hats(levels, level, vertex);
        int32_t count = 0;
        for (int32_t i = 0; i < hats.count; i++) {
            const int32_t v = hats.vertex[i];
            if (levels->level[v] == level && pliant_contact_levels_exists(levels, v))
                replaced[count++] = v;
        }
        for (int32_t i = 0; i < count; i++) set_level(levels, replaced[i], level + 1);
        if (count > 0) return count;
    }
    return 0;
}

int32_t pliant_contact_levels_replace(pliant_contact_levels *levels, int32_t vertex)
{
    const int32_t level = levels->level[vertex];
    if (level >= levels->finest) return 0;
    set_level(levels, vertex, level + 1);
    return 1;
}

pliant_child_range pliant_contact_levels_children(const pliant_contact_levels *levels,
                                                  int32_t vertex, int32_t level)
{
    pliant_child_range range = {levels->child_begin[vertex], levels->child_begin[vertex]};
    const int32_t end = levels->child_begin[vertex + 1];
    while (range.begin < end && levels->first[levels->children[range.begin]] < level) range.begin++;
    range.end = range.begin;
    while (range.end < end && levels->first[levels->children[range.end]] == level) range.end++;
    return range;
}

int32_t pliant_contact_levels_may_coarsen(const pliant_contact_levels *levels, int32_t vertex)
{
    const int32_t level = levels->level[vertex];
    if (level <= default_level(levels, vertex)) return 0;
    const pliant_child_range range = pliant_contact_levels_children(levels, vertex, level);
    for (int32_t i = range.begin; i < range.end; i++)
        if (levels->level[levels->children[i]] > level) return 0;
    return 1;
}

void pliant_contact_levels_coarsen(pliant_contact_levels *levels, int32_t vertex)
{
    set_level(levels, vertex, levels->level[vertex] - 1);
}
