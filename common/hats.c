// hats.c: the hierarchical basis functions of one domain of a multiresolution surface (GF 6).
#include "pliant/hats.h"

#include "pliant/arena.h"
#include "pliant/error.h"

#include <assert.h>
#include <stdlib.h>

// An odd vertex divides an edge, which lies in one triangle of each coarser level: no more than the
// hats of that triangle's corners reach it.
enum { corners = 3 };

// The hats of one level that reach a position.
typedef struct reach {
    int32_t count;
    int32_t hat[corners];  // ascending
    double weight[corners];
} reach;

typedef struct owner {
    pliant_hats hats;  // what the caller sees; first, so that destroy finds the rest
    pliant_arena arena;
} owner;

// The writable arrays of one level.
typedef struct level_arrays {
    int32_t *offset, *position;
    double *weight, *area;
} level_arrays;

static void lay_out(pliant_arena *arena, const pliant_hats *hats, const int32_t *entries,
                    level_arrays *levels)
{
    for (int32_t l = 0; l < hats->level_count; l++) {
        const int32_t columns = hats->level_offset[l + 1];
        PLIANT_TAKE(arena, levels[l].offset, columns + 1);
        PLIANT_TAKE(arena, levels[l].position, entries[l]);
        PLIANT_TAKE(arena, levels[l].weight, entries[l]);
        PLIANT_TAKE(arena, levels[l].area, columns);
    }
}

// Add half of what reaches a parent to what reaches its odd child.
static void add_half(const reach *parent, reach *child)
{
    for (int32_t i = 0; i < parent->count; i++) {
        int32_t at = 0;
        while (at < child->count && child->hat[at] < parent->hat[i]) at++;
        if (at == child->count || child->hat[at] != parent->hat[i]) {
            assert(child->count < corners);
            for (int32_t j = child->count++; j > at; j--) {
                child->hat[j] = child->hat[j - 1];
                child->weight[j] = child->weight[j - 1];
            }
            child->hat[at] = parent->hat[i];
            child->weight[at] = 0;
        }
        child->weight[at] += parent->weight[i] / 2;
    }
}

// The hats of level `level` at every position; returns how many weights that is.
static int32_t spread(const pliant_wavelet *w, int32_t level, reach *reaches)
{
    const int32_t columns = w->level_offset[level + 1];
    int32_t entries = columns;
    for (int32_t p = 0; p < columns; p++)
        reaches[p] = (reach){.count = 1, .hat = {p}, .weight = {1}};
    for (int32_t p = columns; p < w->count; p++) {
        const int32_t *parents = w->update_node + 2 * (size_t)(p - w->level_offset[1]);
        reaches[p].count = 0;
        for (int i = 0; i < 2; i++)
            if (parents[i] < w->count) add_half(&reaches[parents[i]], &reaches[p]);
        entries += reaches[p].count;
    }
    return entries;
}

// From hats at a position to positions of a hat, and the hats' areas.
static void gather(const pliant_wavelet *w, const reach *reaches, int32_t columns,
                   const int32_t *nodes, const double *areas, level_arrays *level)
{
    int32_t *offset = level->offset;
    // Count each hat's weights one place on, sum up, and fill from each hat's end.
    for (int32_t p = 0; p < w->count; p++)
        for (int32_t i = 0; i < reaches[p].count; i++) offset[reaches[p].hat[i]]++;
    int32_t entries = 0;
    for (int32_t k = 0; k < columns; k++) offset[k] = entries += offset[k];
    offset[columns] = entries;
    for (int32_t p = w->count; p-- > 0;)
        for (int32_t i = 0; i < reaches[p].count; i++) {
            const int32_t k = reaches[p].hat[i], entry = --offset[k];
            level->position[entry] = p;
            level->weight[entry] = reaches[p].weight[i];
            level->area[k] += reaches[p].weight[i] * areas[nodes[p]];
        }
}

pliant_status pliant_hats_create(const pliant_wavelet *wavelet, const int32_t *nodes,
                                 const double *areas, pliant_hats **hats, pliant_error *err)
{
    owner *o = calloc(1, sizeof *o);
    reach *reaches = malloc(((size_t)wavelet->count + 1) * sizeof *reaches);
    level_arrays levels[PLIANT_LEVEL_LIMIT + 1];
    int32_t entries[PLIANT_LEVEL_LIMIT + 1];
    pliant_status status = PLIANT_OK;
    if (!o || !reaches) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the hats of %d nodes",
                                  (int)wavelet->count);
        goto done;
    }
    pliant_hats *h = &o->hats;
    h->count = wavelet->count;
    h->level_count = wavelet->level_count;
    for (int32_t l = 0; l < h->level_count; l++) {
        h->level_offset[l + 1] = wavelet->level_offset[l + 1];
        entries[l] = spread(wavelet, l, reaches);
    }
    lay_out(&o->arena, h, entries, levels);
    status = pliant_arena_reserve(&o->arena, err);
    if (status < 0) goto done;
    lay_out(&o->arena, h, entries, levels);
    for (int32_t l = 0; l < h->level_count; l++) {
        (void)spread(wavelet, l, reaches);
        gather(wavelet, reaches, h->level_offset[l + 1], nodes, areas, &levels[l]);
        h->offset[l] = levels[l].offset;
        h->position[l] = levels[l].position;
        h->weight[l] = levels[l].weight;
        h->area[l] = levels[l].area;
    }
    *hats = h;
    o = NULL;
done:
    free(reaches);
    free(o);
    return status;
}

void pliant_hats_destroy(pliant_hats *hats)
{
    if (!hats) return;
    owner *o = (owner *)hats;
    pliant_arena_release(&o->arena);
    free(o);
}
