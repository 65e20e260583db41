// tetrahedra.c: a solid cut into tetrahedra whose boundary is the model's surface, linear or
// quadratic.
#include "fem/tetrahedra.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static pliant_status no_memory(pliant_error *err, int32_t count)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d tetrahedra", count);
}

static double six_volumes(const double *nodes, const int32_t *t)
{
    double e[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            e[k][i] = nodes[3 * (size_t)t[k + 1] + i] - nodes[3 * (size_t)t[0] + i];
    return e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
           e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
           e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
}

static double squared_edges(const double *nodes, const int32_t *t)
{
    double sum = 0;
    for (int a = 0; a < 4; a++)
        for (int b = a + 1; b < 4; b++)
            for (int i = 0; i < 3; i++) {
                const double d = nodes[3 * (size_t)t[a] + i] - nodes[3 * (size_t)t[b] + i];
                sum += d * d;
            }
    return sum;
}

static double quality(const double *nodes, const int32_t *t)
{
    const double v3 = fabs(six_volumes(nodes, t)) / 2, edges = squared_edges(nodes, t);
    return edges > 0 ? 12 * pow(v3, 2.0 / 3) / edges : 0;
}

double pliant_tetrahedra_quality(const pliant_tetrahedra *t)
{
    double worst = 1;
    for (int32_t e = 0; e < t->tet_count; e++)
        worst = fmin(worst, quality(t->nodes, t->tets + (size_t)e * t->tet_nodes));
    return worst;
}

double pliant_tetrahedra_face_area(const pliant_tetrahedra *t, int32_t face)
{
    const int32_t *v = t->faces + (size_t)face * (size_t)t->face_nodes;
    double e[2][3], sum = 0;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 3; i++)
            e[k][i] = t->nodes[3 * (size_t)v[k + 1] + i] - t->nodes[3 * (size_t)v[0] + i];
    for (int i = 0; i < 3; i++) {
        const double n =
            e[0][(i + 1) % 3] * e[1][(i + 2) % 3] - e[0][(i + 2) % 3] * e[1][(i + 1) % 3];
        sum += n * n;
    }
    return sqrt(sum) / 2;
}

pliant_following pliant_tetrahedra_follow(const pliant_tetrahedra *t, int32_t node)
{
    if (node < t->corner_count) return (pliant_following){1, {node, 0}, 1};
    const int32_t *ends = t->ends + 2 * (size_t)(node - t->corner_count);
    return (pliant_following){2, {ends[0], ends[1]}, 0.5};
}

// Below this a tetrahedron is flat: its volume is rounding.
static const double least_quality = 1e-9;

// ---- The boundary: triangles of one tetrahedron only ----

typedef struct triangle {
    int32_t v[3];  // ascending
} triangle;

static int compare_triangles(const void *a, const void *b)
{
    const int32_t *s = ((const triangle *)a)->v, *t = ((const triangle *)b)->v;
    for (int i = 0; i < 3; i++)
        if (s[i] != t[i]) return s[i] < t[i] ? -1 : 1;
    return 0;
}

static triangle triangle_of(int32_t a, int32_t b, int32_t c)
{
    if (a > b) {
        const int32_t s = a;
        a = b;
        b = s;
    }
    if (b > c) {
        const int32_t s = b;
        b = c;
        c = s;
    }
    if (a > b) {
        const int32_t s = a;
        a = b;
        b = s;
    }
    return (triangle){{a, b, c}};
}

// All triangles of tetrahedra, sorted; those that occur once remain, in `list`.
static int32_t keep_single(triangle *list, size_t count)
{
    qsort(list, count, sizeof *list, compare_triangles);
    int32_t kept = 0;
    for (size_t i = 0; i < count;) {
        size_t end = i + 1;
        while (end < count && compare_triangles(&list[i], &list[end]) == 0) end++;
        if ((end - i) % 2) list[kept++] = list[i];
        i = end;
    }
    return kept;
}

static pliant_status check_boundary(const pliant_mesh *surface, const pliant_tetrahedra *t,
                                    const char *name, pliant_error *err)
{
    const size_t count = 4 * (size_t)t->tet_count;
    triangle *list = malloc((count + (size_t)surface->face_count) * sizeof *list);
    if (!list) return no_memory(err, t->tet_count);
    for (int32_t e = 0; e < t->tet_count; e++) {
        const int32_t *v = t->tets + 4 * (size_t)e;
        for (int k = 0; k < 4; k++)
            list[4 * (size_t)e + k] = triangle_of(v[k == 0], v[1 + (k <= 1)], v[2 + (k <= 2)]);
    }
    const int32_t boundary = keep_single(list, count);
    pliant_status status = PLIANT_OK;
    for (int32_t f = 0; f < surface->face_count && status == PLIANT_OK; f++) {
        const int32_t *v = surface->faces + 3 * (size_t)f;
        const triangle key = triangle_of(v[0], v[1], v[2]);
        if (!bsearch(&key, list, (size_t)boundary, sizeof *list, compare_triangles))
            status = pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "%s: its boundary is not the model's surface: face %d, of vertices %d, %d and "
                "%d, is no boundary triangle of it",
                name, f, v[0], v[1], v[2]);
    }
    if (status == PLIANT_OK && boundary != surface->face_count)
        status = pliant_error_set(
            err, PLIANT_ERR_FORMAT,
            "%s: its boundary is not the model's surface: it has %d triangles, the surface %d",
            name, boundary, surface->face_count);
    free(list);
    return status;
}

// ---- Linear tetrahedra ----

pliant_status pliant_tetrahedra_allocate(pliant_tetrahedra *t, pliant_error *err)
{
    t->nodes = malloc(((size_t)t->node_count + 1) * 3 * sizeof *t->nodes);
    t->tets = malloc(((size_t)t->tet_count + 1) * (size_t)t->tet_nodes * sizeof *t->tets);
    t->regions = calloc((size_t)t->tet_count + 1, sizeof *t->regions);
    t->faces = malloc(((size_t)t->face_count + 1) * (size_t)t->face_nodes * sizeof *t->faces);
    t->ends = malloc(((size_t)(t->node_count - t->corner_count) + 1) * 2 * sizeof *t->ends);
    return t->nodes && t->tets && t->regions && t->faces && t->ends ? PLIANT_OK
                                                                    : no_memory(err, t->tet_count);
}

void pliant_tetrahedra_destroy(pliant_tetrahedra *t)
{
    if (!t) return;
    free(t->ends);
    free(t->faces);
    free(t->regions);
    free(t->tets);
    free(t->nodes);
    free(t);
}

// Copy corners that are used; `number` [def->node_count] takes their new numbers.
static pliant_status take(const pliant_mesh *surface, const pliant_tetrahedra_def *def,
                          int32_t *number, pliant_tetrahedra *t, pliant_error *err)
{
    const int32_t n = surface->vertex_count;
    for (int32_t i = 0; i < def->node_count; i++) number[i] = -1;
    for (size_t k = 0; k < 4 * (size_t)def->tet_count; k++) {
        const int32_t v = def->tets[k];
        if (v < 0 || v >= def->node_count)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: tetrahedron %zu: expected nodes below %d, found %d",
                                    def->name, k / 4, def->node_count, v);
        number[v] = 0;
    }
    t->corner_count = n;
    for (int32_t i = 0; i < def->node_count; i++) {
        if (i < n && number[i] < 0)
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT, "%s: no tetrahedron has surface vertex %d, at %g %g %g",
                def->name, i, surface->vertices[3 * (size_t)i],
                surface->vertices[3 * (size_t)i + 1], surface->vertices[3 * (size_t)i + 2]);
        if (number[i] == 0) number[i] = i < n ? i : t->corner_count++;
    }
    t->node_count = t->corner_count;
    const pliant_status status = pliant_tetrahedra_allocate(t, err);
    if (status < 0) return status;
    for (int32_t i = 0; i < def->node_count; i++)
        if (number[i] >= 0)
            memcpy(t->nodes + 3 * (size_t)number[i],
                   (i < n ? surface->vertices : def->nodes) + 3 * (size_t)i, 3 * sizeof *t->nodes);
    for (int32_t e = 0; e < t->tet_count; e++) {
        int32_t *v = t->tets + 4 * (size_t)e;
        for (int k = 0; k < 4; k++) v[k] = number[def->tets[4 * (size_t)e + k]];
        if (!(quality(t->nodes, v) > least_quality))
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: tetrahedron %d, near %g %g %g, is flat", def->name, e,
                                    t->nodes[3 * (size_t)v[0]], t->nodes[3 * (size_t)v[0] + 1],
                                    t->nodes[3 * (size_t)v[0] + 2]);
        if (six_volumes(t->nodes, v) < 0) {
            const int32_t swap = v[2];
            v[2] = v[3], v[3] = swap;
        }
        if (def->regions) t->regions[e] = def->regions[e];
    }
    memcpy(t->faces, surface->faces, 3 * (size_t)t->face_count * sizeof *t->faces);
    return check_boundary(surface, t, def->name, err);
}

pliant_status pliant_tetrahedra_create(const pliant_mesh *surface, const pliant_tetrahedra_def *def,
                                       pliant_tetrahedra **tetrahedra, pliant_error *err)
{
    pliant_tetrahedra *t = calloc(1, sizeof *t);
    int32_t *number = malloc(((size_t)def->node_count + 1) * sizeof *number);
    pliant_status status = PLIANT_OK;
    if (!t || !number) {
        status = no_memory(err, def->tet_count);
    } else if (def->node_count < surface->vertex_count || def->tet_count < 1) {
        status =
            pliant_error_set(err, PLIANT_ERR_FORMAT,
                             "%s: has %d nodes and %d tetrahedra for a surface of %d vertices",
                             def->name, def->node_count, def->tet_count, surface->vertex_count);
    } else {
        *t = (pliant_tetrahedra){.order = 1,
                                 .surface_count = surface->vertex_count,
                                 .tet_count = def->tet_count,
                                 .tet_nodes = 4,
                                 .face_count = surface->face_count,
                                 .face_nodes = 3};
        status = take(surface, def, number, t, err);
    }
    free(number);
    if (status < 0) pliant_tetrahedra_destroy(t);
    else *tetrahedra = t;
    return status;
}

// ---- Quadratic ones ----

static const int tet_edges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

// Edges by their smaller corner: bucket a holds the larger corners of its edges, ascending.
typedef struct edges {
    int64_t *offset;  // [corner_count + 1]
    int32_t *other;
} edges;

static int compare_numbers(const void *a, const void *b)
{
    const int32_t s = *(const int32_t *)a, t = *(const int32_t *)b;
    return (s > t) - (s < t);
}

static void sort_buckets(int32_t corner_count, edges *e)
{
    int64_t kept = 0, begin = 0;
    for (int32_t a = 0; a < corner_count; a++) {
        const int64_t end = e->offset[a + 1];
        qsort(e->other + begin, (size_t)(end - begin), sizeof *e->other, compare_numbers);
        e->offset[a] = kept;
        for (int64_t i = begin; i < end; i++)
            if (i == begin || e->other[i] != e->other[i - 1]) e->other[kept++] = e->other[i];
        begin = end;
    }
    e->offset[corner_count] = kept;
}

static void gather_edges(const pliant_tetrahedra *t, edges *e)
{
    for (int pass = 0; pass < 2; pass++) {
        for (int32_t i = 0; i < t->tet_count; i++)
            for (int k = 0; k < 6; k++) {
                const int32_t *v = t->tets + 4 * (size_t)i;
                const int32_t a = v[tet_edges[k][0]], b = v[tet_edges[k][1]], low = a < b ? a : b;
                if (pass == 0) e->offset[low + 1]++;
                else e->other[e->offset[low]++] = a < b ? b : a;
            }
        if (pass == 0)
            for (int32_t a = 0; a < t->corner_count; a++) e->offset[a + 1] += e->offset[a];
    }
    // Filling moved every bucket's begin to its end.
    memmove(e->offset + 1, e->offset, (size_t)t->corner_count * sizeof *e->offset);
    e->offset[0] = 0;
    sort_buckets(t->corner_count, e);
}

static int32_t find_edge(const edges *e, int32_t a, int32_t b)
{
    const int32_t low = a < b ? a : b, high = a < b ? b : a;
    int64_t begin = e->offset[low], end = e->offset[low + 1];
    while (begin < end) {
        const int64_t middle = (begin + end) / 2;
        if (e->other[middle] < high) begin = middle + 1;
        else end = middle;
    }
    return (int32_t)begin;
}

static void fill_quadratic(const pliant_tetrahedra *from, const edges *e, pliant_tetrahedra *t)
{
    memcpy(t->nodes, from->nodes, 3 * (size_t)t->corner_count * sizeof *t->nodes);
    memcpy(t->regions, from->regions, (size_t)t->tet_count * sizeof *t->regions);
    for (int32_t a = 0; a < t->corner_count; a++)
        for (int64_t i = e->offset[a]; i < e->offset[a + 1]; i++) {
            const int32_t b = e->other[i];
            t->ends[2 * i] = a, t->ends[2 * i + 1] = b;
            for (int c = 0; c < 3; c++)
                t->nodes[3 * ((size_t)t->corner_count + (size_t)i) + c] =
                    (t->nodes[3 * (size_t)a + c] + t->nodes[3 * (size_t)b + c]) / 2;
        }
    for (int32_t i = 0; i < t->tet_count; i++) {
        const int32_t *v = from->tets + 4 * (size_t)i;
        int32_t *w = t->tets + 10 * (size_t)i;
        memcpy(w, v, 4 * sizeof *w);
        for (int k = 0; k < 6; k++)
            w[4 + k] = t->corner_count + find_edge(e, v[tet_edges[k][0]], v[tet_edges[k][1]]);
    }
    for (int32_t f = 0; f < t->face_count; f++) {
        const int32_t *v = from->faces + 3 * (size_t)f;
        int32_t *w = t->faces + 6 * (size_t)f;
        memcpy(w, v, 3 * sizeof *w);
        for (int k = 0; k < 3; k++) w[3 + k] = t->corner_count + find_edge(e, v[k], v[(k + 1) % 3]);
    }
}

pliant_status pliant_tetrahedra_raise(pliant_tetrahedra *t, pliant_error *err)
{
    edges e = {.offset = calloc((size_t)t->corner_count + 2, sizeof *e.offset),
               .other = malloc(6 * (size_t)t->tet_count * sizeof *e.other)};
    pliant_tetrahedra quadratic = *t;
    pliant_status status = PLIANT_OK;
    if (!e.offset || !e.other) {
        status = no_memory(err, t->tet_count);
        goto done;
    }
    gather_edges(t, &e);
    if (e.offset[t->corner_count] > INT32_MAX - t->corner_count) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%d tetrahedra have too many edges",
                                  t->tet_count);
        goto done;
    }
    quadratic.order = 2;
    quadratic.node_count = t->corner_count + (int32_t)e.offset[t->corner_count];
    quadratic.tet_nodes = 10;
    quadratic.face_nodes = 6;
    status = pliant_tetrahedra_allocate(&quadratic, err);
    pliant_tetrahedra old = quadratic;
    if (status == PLIANT_OK) {
        fill_quadratic(t, &e, &quadratic);
        old = *t;
        *t = quadratic;
    }
    free(old.ends);
    free(old.faces);
    free(old.regions);
    free(old.tets);
    free(old.nodes);
done:
    free(e.other);
    free(e.offset);
    return status;
}
