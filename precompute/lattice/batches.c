// batches.c: triangles in groups that need few lattice particles each, for shaders (LSM 4, end).
#include "lattice/batches.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"

#include <stdlib.h>
#include <string.h>

// A face's vertices hang in three cells of eight corners at most.
enum { FACE_POINTS = 24 };

typedef struct growth {
    const pliant_batches_input *in;
    pliant_batches *out;
    int32_t *twin;        // [3 face_count]
    uint8_t *face_mark;   // [face_count]: see the enum below
    uint8_t *point_used;  // [particle_count]: 1 in this batch
    int32_t *edge;        // [face_count]: faces beside the batch that are not in one
    int32_t *age;         // [face_count]: when a face came to the edge
    int32_t edge_count, clock;
    int32_t face_total, point_total;
    int32_t points[PLIANT_BATCH_LIMIT], point_count;
} growth;

enum { FACE_OPEN, FACE_AT_EDGE, FACE_TAKEN };

// The particles of a face that the batch has not yet, each once.
static int32_t find_new(const growth *g, int32_t face, int32_t points[FACE_POINTS])
{
    int32_t count = 0, cells[3];
    for (int c = 0; c < 3; c++) {
        cells[c] = g->in->vertex_cell[g->in->faces[3 * (size_t)face + (size_t)c]];
        if ((c > 0 && cells[c] == cells[0]) || (c > 1 && cells[c] == cells[1])) continue;
        for (int k = 0; k < 8; k++) {
            const int32_t point = g->in->corners[8 * (size_t)cells[c] + (size_t)k];
            int is_known = g->point_used[point];
            for (int32_t i = 0; i < count && !is_known; i++) is_known = points[i] == point;
            if (!is_known) points[count++] = point;
        }
    }
    return count;
}

// Take a face into the batch, and its neighbours to its edge.
static void take(growth *g, int32_t face)
{
    g->face_mark[face] = FACE_TAKEN;
    g->out->faces[g->face_total++] = face;
    for (int k = 0; k < 3; k++) {
        const int32_t beside = g->twin[3 * (size_t)face + (size_t)k] / 3;
        if (g->face_mark[beside] != FACE_OPEN) continue;
        g->face_mark[beside] = FACE_AT_EDGE;
        g->edge[g->edge_count++] = beside;
        g->age[beside] = g->clock++;
    }
}

static void use(growth *g, const int32_t *points, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        g->point_used[points[i]] = 1;
        g->points[g->point_count++] = points[i];
    }
}

// Take every face that is connected to the batch and needs no new particle.
static void take_free(growth *g)
{
    int32_t points[FACE_POINTS];
    for (int32_t i = 0; i < g->edge_count;) {
        const int32_t face = g->edge[i];
        if (find_new(g, face, points) > 0) {
            i++;
            continue;
        }
        // Its neighbours go to the end of the list, where the loop still comes.
        g->edge[i] = g->edge[--g->edge_count];
        take(g, face);
    }
}

// The face at the edge that needs the fewest new particles, if it fits; -1: none.
static int32_t choose(growth *g, int32_t points[FACE_POINTS], int32_t *count)
{
    int32_t best = -1, place = 0;
    *count = PLIANT_BATCH_LIMIT - g->point_count + 1;
    for (int32_t i = 0; i < g->edge_count; i++) {
        int32_t needed[FACE_POINTS];
        const int32_t n = find_new(g, g->edge[i], needed);
        if (n > *count || (n == *count && (best < 0 || g->age[g->edge[i]] > g->age[best])))
            continue;
        best = g->edge[i];
        place = i;
        *count = n;
        memcpy(points, needed, (size_t)n * sizeof *points);
    }
    if (best >= 0) g->edge[place] = g->edge[--g->edge_count];
    return best;
}

static void grow(growth *g, int32_t *next)
{
    int32_t points[FACE_POINTS], count = 0;
    for (;;) {
        int32_t face = -1;
        if (g->edge_count > 0) {
            face = choose(g, points, &count);
        } else {
            while (*next < g->in->face_count && g->face_mark[*next] == FACE_TAKEN) ++*next;
            if (*next == g->in->face_count) return;
            count = find_new(g, *next, points);
            if (g->point_count + count <= PLIANT_BATCH_LIMIT) face = *next;
        }
        if (face < 0) return;
        use(g, points, count);
        take(g, face);
        take_free(g);
    }
}

static int compare(const void *a, const void *b)
{
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

static pliant_status make_batches(growth *g, pliant_error *err)
{
    pliant_batches *b = g->out;
    size_t capacity = 0;
    int32_t next = 0;
    while (g->face_total < g->in->face_count) {
        g->point_count = 0;
        grow(g, &next);
        if ((size_t)(g->point_total + g->point_count) > capacity) {
            capacity = 2 * capacity + PLIANT_BATCH_LIMIT;
            int32_t *points = realloc(b->points, capacity * sizeof *points);
            if (!points)
                return pliant_error_set(err, PLIANT_ERR_MEMORY,
                                        "no memory for %zu particles of batches", capacity);
            b->points = points;
        }
        const int32_t first = b->face_offset[b->batch_count];
        qsort(b->faces + first, (size_t)(g->face_total - first), sizeof *b->faces, compare);
        qsort(g->points, (size_t)g->point_count, sizeof *g->points, compare);
        memcpy(b->points + g->point_total, g->points, (size_t)g->point_count * sizeof *b->points);
        g->point_total += g->point_count;
        b->batch_count++;
        b->face_offset[b->batch_count] = g->face_total;
        b->point_offset[b->batch_count] = g->point_total;
        for (int32_t i = 0; i < g->point_count; i++) g->point_used[g->points[i]] = 0;
        while (g->edge_count > 0) g->face_mark[g->edge[--g->edge_count]] = FACE_OPEN;
    }
    return PLIANT_OK;
}

pliant_status pliant_batches_create(const pliant_batches_input *input, pliant_batches **batches,
                                    pliant_error *err)
{
    const size_t faces = (size_t)input->face_count;
    growth g = {.in = input, .out = calloc(1, sizeof(pliant_batches))};
    g.twin = malloc(3 * faces * sizeof *g.twin);
    g.face_mark = calloc(faces, 1);
    g.point_used = calloc((size_t)input->particle_count, 1);
    g.edge = malloc(faces * sizeof *g.edge);
    g.age = malloc(faces * sizeof *g.age);
    if (g.out) {
        g.out->face_offset = calloc(faces + 1, sizeof *g.out->face_offset);
        g.out->point_offset = calloc(faces + 1, sizeof *g.out->point_offset);
        g.out->faces = malloc(faces * sizeof *g.out->faces);
    }
    pliant_status status = PLIANT_OK;
    if (!g.twin || !g.face_mark || !g.point_used || !g.edge || !g.age || !g.out ||
        !g.out->face_offset || !g.out->point_offset || !g.out->faces)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for batches of %d faces",
                                  input->face_count);
    if (status == PLIANT_OK)
        status = pliant_halfedge_match(input->vertex_count, input->face_count, input->faces, g.twin,
                                       err);
    if (status == PLIANT_OK) status = make_batches(&g, err);
    free(g.age);
    free(g.edge);
    free(g.point_used);
    free(g.face_mark);
    free(g.twin);
    if (status < 0) pliant_batches_destroy(g.out);
    else *batches = g.out;
    return status;
}

void pliant_batches_destroy(pliant_batches *batches)
{
    if (!batches) return;
    free(batches->points);
    free(batches->point_offset);
    free(batches->faces);
    free(batches->face_offset);
    free(batches);
}
