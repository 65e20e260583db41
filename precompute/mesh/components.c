// components.c: the connected components of a surface, and which of them lie inside others.
#include "components.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    // Ray against triangle tests per pair of components: enough for 1000 vertices against 10,000
    // faces,
    // some 0.1 s. Of more vertices only some are looked at, but always the least count.
    TEST_LIMIT = 10000000,
    LEAST_SAMPLES = 8,
};

void pliant_components_destroy(pliant_components *c)
{
    if (!c) return;
    free(c->of_vertex);
    free(c->first_vertex);
    free(c->face_start);
    free(c->faces);
    free(c->volume);
    free(c->area);
    free(c->box);
    free(c->outer);
    free(c->depth);
    free(c);
}

static int32_t find(int32_t *parent, int32_t v)
{
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

// Number the components by their smallest vertex; of_vertex serves as the union-find forest.
static int32_t number_vertices(const pliant_mesh *mesh, int32_t *of_vertex)
{
    for (int32_t v = 0; v < mesh->vertex_count; v++) of_vertex[v] = v;
    for (int32_t f = 0; f < mesh->face_count; f++)
        for (int k = 1; k < 3; k++) {
            const int32_t a = find(of_vertex, mesh->faces[3 * (size_t)f]);
            const int32_t b = find(of_vertex, mesh->faces[3 * (size_t)f + k]);
            of_vertex[a < b ? b : a] = a < b ? a : b;
        }
    for (int32_t v = 0; v < mesh->vertex_count; v++) of_vertex[v] = find(of_vertex, v);
    // A root is the smallest of its component, so it is numbered before the others.
    int32_t count = 0;
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        of_vertex[v] = of_vertex[v] == v ? count++ : of_vertex[of_vertex[v]];
    return count;
}

// Vertices without a face are components of none: give the others their numbers without them.
static int32_t drop_unused(const pliant_mesh *mesh, int32_t *of_vertex, int32_t count,
                           int32_t *number)
{
    memset(number, 0, (size_t)count * sizeof *number);
    for (int32_t f = 0; f < mesh->face_count; f++)
        number[of_vertex[mesh->faces[3 * (size_t)f]]] = 1;
    int32_t kept = 0;
    for (int32_t i = 0; i < count; i++) number[i] = number[i] ? kept++ : -1;
    for (int32_t v = 0; v < mesh->vertex_count; v++) of_vertex[v] = number[of_vertex[v]];
    return kept;
}

static void group_faces(const pliant_mesh *mesh, pliant_components *c)
{
    for (int32_t f = 0; f < mesh->face_count; f++)
        c->face_start[c->of_vertex[mesh->faces[3 * (size_t)f]] + 1]++;
    for (int32_t i = 0; i < c->count; i++) c->face_start[i + 1] += c->face_start[i];
    for (int32_t f = 0; f < mesh->face_count; f++)
        c->faces[c->face_start[c->of_vertex[mesh->faces[3 * (size_t)f]]]++] = f;
    memmove(c->face_start + 1, c->face_start, (size_t)c->count * sizeof *c->face_start);
    c->face_start[0] = 0;
}

static void measure(const pliant_mesh *mesh, pliant_components *c)
{
    for (int32_t i = 0; i < c->count; i++) c->first_vertex[i] = -1;
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const int32_t i = c->of_vertex[v];
        if (i < 0) continue;
        const double *x = mesh->vertices + 3 * (size_t)v;
        for (int k = 0; k < 3; k++) {
            const int first = c->first_vertex[i] < 0;
            c->box[i][k] = first ? x[k] : fmin(c->box[i][k], x[k]);
            c->box[i][k + 3] = first ? x[k] : fmax(c->box[i][k + 3], x[k]);
        }
        if (c->first_vertex[i] < 0) c->first_vertex[i] = v;
    }
    for (int32_t f = 0; f < mesh->face_count; f++) {
        // A sixth of the determinant, about a vertex of the component: terms stay small far from 0.
        const int32_t *v = mesh->faces + 3 * (size_t)f, i = c->of_vertex[v[0]];
        const double *o = mesh->vertices + 3 * (size_t)c->first_vertex[i];
        double e[3][3];
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < 3; d++) e[k][d] = mesh->vertices[3 * (size_t)v[k] + d] - o[d];
        c->volume[i] += (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
                         e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
                         e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
                        6;
        double p[3], q[3];
        for (int d = 0; d < 3; d++) {
            p[d] = e[1][d] - e[0][d];
            q[d] = e[2][d] - e[0][d];
        }
        const double n[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                             p[0] * q[1] - p[1] * q[0]};
        c->area[i] += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
    }
}

// ---- Nesting: parity of a ray along +x ----

// Does the edge u-v, seen along x, cross the half-line from p along +y? Both faces of the edge ask
// with the same order of ends, so both get the same answer and the ray slips through no seam.
static int crosses(const pliant_mesh *mesh, int32_t u, int32_t v, const double *p)
{
    const double *a = mesh->vertices + 3 * (size_t)(u < v ? u : v);
    const double *b = mesh->vertices + 3 * (size_t)(u < v ? v : u);
    if ((a[2] > p[2]) == (b[2] > p[2])) return 0;
    const double side = (a[1] - p[1]) * (b[2] - p[2]) - (b[1] - p[1]) * (a[2] - p[2]);
    return b[2] > a[2] ? side > 0 : side < 0;
}

static int is_inside(const pliant_mesh *mesh, const pliant_components *c, int32_t component,
                     const double *p)
{
    int inside = 0;
    for (int32_t j = c->face_start[component]; j < c->face_start[component + 1]; j++) {
        const int32_t *v = mesh->faces + 3 * (size_t)c->faces[j];
        if (!(crosses(mesh, v[0], v[1], p) ^ crosses(mesh, v[1], v[2], p) ^
              crosses(mesh, v[2], v[0], p)))
            continue;
        // The ray's line meets the triangle, n . (a + t ex - p) = 0: ahead of p?
        const double *a = mesh->vertices + 3 * (size_t)v[0];
        const double *b = mesh->vertices + 3 * (size_t)v[1];
        const double *d = mesh->vertices + 3 * (size_t)v[2];
        const double e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const double g[3] = {d[0] - a[0], d[1] - a[1], d[2] - a[2]};
        const double n[3] = {e[1] * g[2] - e[2] * g[1], e[2] * g[0] - e[0] * g[2],
                             e[0] * g[1] - e[1] * g[0]};
        const double ahead = n[0] * (a[0] - p[0]) + n[1] * (a[1] - p[1]) + n[2] * (a[2] - p[2]);
        if ((ahead > 0 && n[0] > 0) || (ahead < 0 && n[0] < 0)) inside = !inside;
    }
    return inside;
}

static int box_has(const double *box, const double *p)
{
    for (int k = 0; k < 3; k++)
        if (!(p[k] > box[k] && p[k] < box[k + 3])) return 0;
    return 1;
}

static int boxes_overlap(const double *a, const double *b)
{
    for (int k = 0; k < 3; k++)
        if (!(a[k] < b[k + 3] && b[k] < a[k + 3])) return 0;
    return 1;
}

// 1 when component `i` lies inside `j`, 0 when not, and crossing[] = a vertex inside, one outside,
// when both kinds were found.
static int lies_inside(const pliant_mesh *mesh, const pliant_components *c, int32_t i, int32_t j,
                       int32_t crossing[2])
{
    crossing[0] = crossing[1] = -1;
    if (!boxes_overlap(c->box[i], c->box[j])) return 0;
    const int32_t faces = c->face_start[i + 1] - c->face_start[i];
    const int32_t others = c->face_start[j + 1] - c->face_start[j];
    int32_t samples = TEST_LIMIT / others;
    if (samples < LEAST_SAMPLES) samples = LEAST_SAMPLES;
    // Corner k of the faces, spread evenly over the component: about half the faces have own
    // vertices.
    const int32_t step = faces > samples ? faces / samples : 1;
    for (int32_t k = 0; k < faces; k += step) {
        const int32_t v = mesh->faces[3 * (size_t)c->faces[c->face_start[i] + k]];
        const double *p = mesh->vertices + 3 * (size_t)v;
        const int inside = box_has(c->box[j], p) && is_inside(mesh, c, j, p);
        if (crossing[!inside] < 0) crossing[!inside] = v;
        if (crossing[0] >= 0 && crossing[1] >= 0) break;
    }
    return crossing[0] >= 0;
}

static pliant_status nest(const pliant_mesh *mesh, const char *name, pliant_components *c,
                          pliant_error *err)
{
    for (int32_t i = 0; i < c->count; i++) {
        c->outer[i] = -1;
        for (int32_t j = 0; j < c->count; j++) {
            int32_t crossing[2];
            if (i == j || !lies_inside(mesh, c, i, j, crossing)) continue;
            if (crossing[1] >= 0)
                return pliant_error_set(
                    err, PLIANT_ERR_FORMAT,
                    "%s: two components cross: vertex %d is inside the component of vertex %d, "
                    "vertex "
                    "%d is outside; join them into one surface or move them apart",
                    name, crossing[0], c->first_vertex[j], crossing[1]);
            c->depth[i]++;
            // Of nested surroundings the innermost encloses least.
            if (c->outer[i] < 0 || fabs(c->volume[j]) < fabs(c->volume[c->outer[i]]))
                c->outer[i] = j;
        }
    }
    return PLIANT_OK;
}

pliant_status pliant_components_create(const pliant_mesh *mesh, const char *name,
                                       pliant_components **components, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    int32_t *number = NULL;
    pliant_components *c = calloc(1, sizeof *c);
    if (c) c->of_vertex = malloc(((size_t)mesh->vertex_count + 1) * sizeof *c->of_vertex);
    if (!c || !c->of_vertex) goto memory;
    const int32_t found = number_vertices(mesh, c->of_vertex);
    number = malloc(((size_t)found + 1) * sizeof *number);
    if (!number) goto memory;
    c->count = drop_unused(mesh, c->of_vertex, found, number);
    if (c->count > PLIANT_COMPONENT_LIMIT) {
        status =
            pliant_error_set(err, PLIANT_ERR_FORMAT,
                             "%s: the surface has %d separate components, at most %d are accepted",
                             name, c->count, PLIANT_COMPONENT_LIMIT);
        goto done;
    }
    const size_t count = (size_t)c->count + 1;
    c->first_vertex = malloc(count * sizeof *c->first_vertex);
    c->face_start = calloc(count, sizeof *c->face_start);
    c->faces = malloc(((size_t)mesh->face_count + 1) * sizeof *c->faces);
    c->volume = calloc(count, sizeof *c->volume);
    c->area = calloc(count, sizeof *c->area);
    c->box = malloc(count * sizeof *c->box);
    c->outer = malloc(count * sizeof *c->outer);
    c->depth = calloc(count, sizeof *c->depth);
    if (!c->first_vertex || !c->face_start || !c->faces || !c->volume || !c->area || !c->box ||
        !c->outer || !c->depth)
        goto memory;
    group_faces(mesh, c);
    measure(mesh, c);
    status = nest(mesh, name, c, err);
    goto done;
memory:
    status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory to find the components", name);
done:
    free(number);
    if (status < 0) pliant_components_destroy(c);
    else *components = c;
    return status;
}
