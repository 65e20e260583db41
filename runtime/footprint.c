// footprint.c: which hats end within a set of vertices.
#include "footprint.h"

#include "pliant/hierarchy.h"

void pliant_footprint_lay_out(pliant_arena *arena, const pliant_model *model,
                              pliant_footprint *footprint)
{
    for (int32_t l = 0; l < model->finest_level; l++)
        PLIANT_TAKE(arena, footprint->child_count[l], model->hierarchy->vertex_count[l]);
    PLIANT_TAKE(arena, footprint->found, model->vertex_count);
}

static const int32_t *parents_of(const pliant_hierarchy *hierarchy, int32_t odd)
{
    return hierarchy->stencils[odd - hierarchy->vertex_count[0]].parents;
}

void pliant_footprint_begin(const pliant_model *model, pliant_footprint *footprint)
{
    const pliant_hierarchy *h = model->hierarchy;
    footprint->model = model;
    for (int32_t l = 0; l < model->finest_level; l++)
        for (int32_t odd = h->vertex_count[l]; odd < h->vertex_count[l + 1]; odd++)
            for (int side = 0; side < 2 && model->domain[odd] == PLIANT_DOMAIN_FREE; side++)
                footprint->child_count[l][parents_of(h, odd)[side]]++;
}

// Count, or take back, the vertices begin .. end - 1, odd ones of one level, at their parents.
static void tell_parents(pliant_footprint *footprint, const int32_t *vertices, int32_t begin,
                         int32_t end, int32_t count)
{
    for (int32_t i = begin; i < end; i++)
        for (int side = 0; side < 2; side++) {
            const int32_t parent = parents_of(footprint->model->hierarchy, vertices[i])[side];
            footprint->found[parent] = count == 0 ? 0 : footprint->found[parent] + count;
        }
}

void pliant_footprint_refine(pliant_footprint *footprint, const int32_t *vertices, int32_t count,
                             int32_t *levels)
{
    const pliant_hierarchy *h = footprint->model->hierarchy;
    int32_t begin = 0;  // of the vertices that level l + 1 adds
    while (begin < count && vertices[begin] < h->vertex_count[0]) begin++;
    for (int32_t l = 0; l < footprint->model->finest_level; l++) {
        int32_t end = begin;
        while (end < count && vertices[end] < h->vertex_count[l + 1]) end++;
        tell_parents(footprint, vertices, begin, end, 1);
        for (int32_t i = 0; i < begin; i++)
            if (levels[i] == l &&
                footprint->found[vertices[i]] == footprint->child_count[l][vertices[i]])
                levels[i] = l + 1;
        tell_parents(footprint, vertices, begin, end, 0);
        begin = end;
    }
}

// From fine to coarse (GF-53): a hat of level l is that of level l + 1 and halves of the odd
// children's, so it ends within the set when all of these do.
void pliant_footprint_fit(pliant_footprint *footprint, const int32_t *vertices, int32_t count,
                          const int32_t *index_of, int32_t *levels)
{
    const pliant_hierarchy *h = footprint->model->hierarchy;
    for (int32_t i = 0; i < count; i++) levels[i] = footprint->model->finest_level;
    int32_t end = count;  // of the vertices of level l + 1
    for (int32_t l = footprint->model->finest_level - 1; l >= 0; l--) {
        int32_t begin = end;
        while (begin > 0 && vertices[begin - 1] >= h->vertex_count[l]) begin--;
        for (int32_t i = begin; i < end; i++)
            for (int side = 0; side < 2 && levels[i] == l + 1; side++) {
                const int32_t parent = parents_of(h, vertices[i])[side];
                if (index_of[parent] >= 0) footprint->found[parent]++;
            }
        for (int32_t i = 0; i < begin; i++) {
            const int32_t vertex = vertices[i];
            if (levels[i] == l + 1 && footprint->found[vertex] == footprint->child_count[l][vertex])
                levels[i] = l;
            footprint->found[vertex] = 0;
        }
        end = begin;
    }
}
