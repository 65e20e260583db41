// share.c: which part of a surface each of many points on it stands for.
//
// This follows: Q. Du, V. Faber, M. Gunzburger, Centroidal Voronoi tessellations: applications and
// algorithms, SIAM Review 41(4), 1999; distances are Dijkstra's, along edges: a Voronoi cell then
// is rough at its rim, but cannot reach across to another sheet.
#include "remesh/share.h"

#include "remesh/vector.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"

#include <stdlib.h>

pliant_status pliant_share_create(const pliant_surface *surface, pliant_share **share,
                                  pliant_error *err)
{
    const pliant_mesh *mesh = surface->mesh;
    const size_t n = (size_t)mesh->vertex_count, sides = 3 * (size_t)mesh->face_count;
    pliant_share *s = calloc(1, sizeof *s);
    if (s) {
        s->surface = surface;
        s->start = calloc(n + 2, sizeof *s->start);
        s->neighbours = malloc(sides * sizeof *s->neighbours);
        s->lengths = malloc(sides * sizeof *s->lengths);
        s->areas = malloc(n * sizeof *s->areas);
        s->distance = malloc(n * sizeof *s->distance);
        s->side = malloc(n * sizeof *s->side);
        s->owner = malloc(n * sizeof *s->owner);
        s->heap = malloc(n * sizeof *s->heap);
        s->slot = malloc(n * sizeof *s->slot);
    }
    if (!s || !s->start || !s->neighbours || !s->lengths || !s->areas || !s->side || !s->distance ||
        !s->owner || !s->heap || !s->slot) {
        pliant_share_destroy(s);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to share out %d faces",
                                mesh->face_count);
    }
    pliant_mesh_vertex_areas(mesh->vertex_count, mesh->vertices, mesh->face_count, mesh->faces,
                             s->areas);
    // Every edge from a vertex is the side that starts there, of one face.
    for (size_t h = 0; h < sides; h++) s->start[mesh->faces[h] + 2]++;
    for (size_t v = 1; v <= n; v++) s->start[v + 1] += s->start[v];
    for (int32_t h = 0; h < (int32_t)sides; h++) {
        const int32_t from = mesh->faces[h], to = mesh->faces[pliant_halfedge_next(h)];
        const int32_t at = s->start[from + 1]++;
        s->side[from] = h;
        s->neighbours[at] = to;
        s->lengths[at] = sqrt(pliant_squared_distance(mesh->vertices + 3 * (size_t)from,
                                                      mesh->vertices + 3 * (size_t)to));
    }
    *share = s;
    return PLIANT_OK;
}

void pliant_share_destroy(pliant_share *share)
{
    if (!share) return;
    free(share->slot);
    free(share->heap);
    free(share->owner);
    free(share->side);
    free(share->distance);
    free(share->areas);
    free(share->lengths);
    free(share->neighbours);
    free(share->start);
    free(share);
}

static void put(pliant_share *s, int32_t at, int32_t v)
{
    s->heap[at] = v;
    s->slot[v] = at;
}

// v has come closer to an owner.
static void approach(pliant_share *s, int32_t v, double distance, int32_t owner)
{
    if (!(distance < s->distance[v])) return;
    s->distance[v] = distance;
    s->owner[v] = owner;
    int32_t at = s->slot[v] >= 0 ? s->slot[v] : s->heap_count++;
    for (; at > 0 && distance < s->distance[s->heap[(at - 1) / 2]]; at = (at - 1) / 2)
        put(s, at, s->heap[(at - 1) / 2]);
    put(s, at, v);
}

static int32_t take_nearest(pliant_share *s)
{
    const int32_t v = s->heap[0], last = s->heap[--s->heap_count];
    s->slot[v] = -1;
    if (s->heap_count == 0) return v;
    int32_t at = 0;
    for (int32_t child; (child = 2 * at + 1) < s->heap_count; at = child) {
        if (child + 1 < s->heap_count &&
            s->distance[s->heap[child + 1]] < s->distance[s->heap[child]])
            child++;
        if (!(s->distance[s->heap[child]] < s->distance[last])) break;
        put(s, at, s->heap[child]);
    }
    put(s, at, last);
    return v;
}

void pliant_share_out(pliant_share *share, const pliant_place *places, const double *x,
                      int32_t count)
{
    pliant_share *s = share;
    const pliant_mesh *mesh = s->surface->mesh;
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        s->distance[v] = INFINITY;
        s->slot[v] = s->owner[v] = -1;
    }
    s->heap_count = 0;
    for (int32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            const int32_t v = mesh->faces[3 * (size_t)places[i].face + k];
            approach(
                s, v,
                sqrt(pliant_squared_distance(mesh->vertices + 3 * (size_t)v, x + 3 * (size_t)i)),
                i);
        }
    while (s->heap_count > 0) {
        const int32_t v = take_nearest(s);
        for (int32_t j = s->start[v]; j < s->start[v + 1]; j++)
            approach(s, s->neighbours[j], s->distance[v] + s->lengths[j], s->owner[v]);
    }
}
