// repair.c: small defects of a mesh file mended, so that it bounds a solid.
#include "remesh/repair.h"

#include "mesh/polygon.h"
#include "mesh/weld.h"
#include "remesh/surface.h"
#include "remesh/vector.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Height over longest side of a face without area; mesh_check's limit.
static const double height_limit = 1e-6;

typedef struct side {
    int32_t low, high, index;  // ends, and half-edge 3f + k
} side;

typedef struct work {
    const pliant_mesh *mesh;
    int32_t *first;  // [vertices] of equal place
    int32_t *faces;  // [face_capacity][3]
    int32_t face_count, face_capacity;
    side *sides;     // [3 face_capacity]
    int32_t *stack;  // [3 face_capacity]
    int8_t *mark;    // [face_capacity]
} work;

static int compare_sides(const void *a, const void *b)
{
    const side *p = a, *q = b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    return p->index < q->index ? -1 : 1;
}

static void sort_sides(work *w)
{
    for (int32_t h = 0; h < 3 * w->face_count; h++) {
        const int32_t a = w->faces[h], b = w->faces[pliant_halfedge_next(h)];
        w->sides[h] = (side){a < b ? a : b, a < b ? b : a, h};
    }
    qsort(w->sides, 3 * (size_t)w->face_count, sizeof *w->sides, compare_sides);
}

static const double *position(const work *w, int32_t v)
{
    return w->mesh->vertices + 3 * (size_t)v;
}

static double height(const work *w, const int32_t *f)
{
    double n[3], longest = 0;
    for (int k = 0; k < 3; k++)
        longest =
            fmax(longest, pliant_squared_distance(position(w, f[k]), position(w, f[(k + 1) % 3])));
    pliant_face_normal(position(w, f[0]), position(w, f[1]), position(w, f[2]), n);
    return longest > 0 ? pliant_length(n) / longest : 0;
}

// ---- Faces that should not be ----

// A face without area has its longest side in common with a neighbour. Flipping that side gives the
// neighbour's area to both, when it has the middle corner between its ends.
static int flip_flat(work *w)
{
    sort_sides(w);
    int flipped = 0;
    for (int32_t i = 0; i + 1 < 3 * w->face_count; i++) {
        const side *s = w->sides + i;
        if (s[0].low != s[1].low || s[0].high != s[1].high) continue;
        for (int turn = 0; turn < 2; turn++) {
            const int32_t h = s[turn].index, g = s[1 - turn].index;
            int32_t *f = w->faces + h / 3 * 3, *other = w->faces + g / 3 * 3;
            if (height(w, f) > height_limit || !(height(w, other) > height_limit)) continue;
            const int32_t a = w->faces[h], b = w->faces[pliant_halfedge_next(h)],
                          c = w->faces[pliant_halfedge_previous(h)],
                          d = w->faces[pliant_halfedge_previous(g)];
            const double ab = pliant_squared_distance(position(w, a), position(w, b));
            if (w->faces[g] != b || c == d ||
                ab < pliant_squared_distance(position(w, b), position(w, c)) ||
                ab < pliant_squared_distance(position(w, c), position(w, a)))
                continue;
            f[0] = a, f[1] = d, f[2] = c;
            other[0] = d, other[1] = b, other[2] = c;
            flipped++;
            break;
        }
        // Sides of those two are out of date now: the next round finds what is left.
        if (flipped) return flipped;
    }
    return flipped;
}

static int compare_triples(const void *a, const void *b)
{
    const int32_t *p = a, *q = b;
    for (int k = 0; k < 4; k++)
        if (p[k] != q[k]) return p[k] < q[k] ? -1 : 1;
    return 0;
}

static pliant_status drop_faces(work *w, pliant_repair_report *report, pliant_error *err)
{
    int32_t kept = 0;
    for (int32_t f = 0; f < w->face_count; f++) {
        int32_t v[3];
        for (int k = 0; k < 3; k++) v[k] = w->first[w->faces[3 * (size_t)f + k]];
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        memcpy(w->faces + 3 * (size_t)kept++, v, sizeof v);
    }
    report->dropped += w->face_count - kept;
    w->face_count = kept;
    int32_t(*sorted)[4] = malloc(((size_t)kept + 1) * sizeof *sorted);
    if (!sorted)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to repair %d faces", kept);
    for (int32_t f = 0; f < kept; f++) {
        const int32_t *v = w->faces + 3 * (size_t)f;
        int32_t *s = sorted[f];
        memcpy(s, v, 3 * sizeof *v);
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2 - i; j++)
                if (s[j] > s[j + 1]) {
                    const int32_t swapped = s[j];
                    s[j] = s[j + 1];
                    s[j + 1] = swapped;
                }
        s[3] = f;
    }
    qsort(sorted, (size_t)kept, sizeof *sorted, compare_triples);
    for (int32_t i = 1; i < kept; i++)
        if (memcmp(sorted[i], sorted[i - 1], 3 * sizeof(int32_t)) == 0)
            w->faces[3 * (size_t)sorted[i][3]] = -1;
    free(sorted);
    int32_t left = 0;
    for (int32_t f = 0; f < kept; f++)
        if (w->faces[3 * (size_t)f] >= 0)
            memmove(w->faces + 3 * (size_t)left++, w->faces + 3 * (size_t)f, 3 * sizeof(int32_t));
    report->dropped += kept - left;
    w->face_count = left;
    return PLIANT_OK;
}

// ---- Orientation ----

// Neighbours walk their common side in opposite directions; the smaller part of each piece is
// turned.
static void turn_faces(work *w, int32_t *twin, pliant_repair_report *report)
{
    memset(w->mark, 0, (size_t)w->face_count);
    int32_t *list = w->stack;
    for (int32_t f = 0; f < w->face_count; f++) {
        if (w->mark[f]) continue;
        int32_t size = 0, other = 0, seen = 0;
        w->mark[f] = 1;
        for (list[size++] = f; seen < size; seen++) {
            const int32_t g = list[seen];
            other += w->mark[g] == 2;
            for (int32_t h = 3 * g; h < 3 * g + 3; h++) {
                if (twin[h] < 0 || w->mark[twin[h] / 3]) continue;
                const int clash = w->faces[h] == w->faces[twin[h]];
                w->mark[twin[h] / 3] = (int8_t)(clash ? 3 - w->mark[g] : w->mark[g]);
                list[size++] = twin[h] / 3;
            }
        }
        const int wrong = other <= size - other ? 2 : 1;
        for (int32_t i = 0; i < size; i++) {
            if (w->mark[list[i]] != wrong) continue;
            int32_t *v = w->faces + 3 * (size_t)list[i];
            const int32_t swapped = v[1];
            v[1] = v[2];
            v[2] = swapped;
            report->turned++;
        }
    }
}

static void match_sides(work *w, int32_t *twin)
{
    sort_sides(w);
    for (int32_t h = 0; h < 3 * w->face_count; h++) twin[h] = -1;
    for (int32_t i = 0, next; i < 3 * w->face_count; i = next) {
        for (next = i + 1; next < 3 * w->face_count && w->sides[next].low == w->sides[i].low &&
                           w->sides[next].high == w->sides[i].high;)
            next++;
        if (next - i != 2) continue;
        twin[w->sides[i].index] = w->sides[i + 1].index;
        twin[w->sides[i + 1].index] = w->sides[i].index;
    }
}

// ---- Holes ----

// Close every small loop of open sides. Where two loops meet in a vertex, neither is touched.
static pliant_status fill_holes(work *w, const int32_t *twin, pliant_repair_report *report,
                                pliant_error *err)
{
    const int32_t n = w->mesh->vertex_count, sides = 3 * w->face_count;
    int32_t *next = malloc(((size_t)n + 1) * sizeof *next);
    if (!next) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to look for holes");
    for (int32_t v = 0; v < n; v++) next[v] = -1;
    for (int32_t h = 0; h < sides; h++) {
        if (twin[h] >= 0) continue;
        // The hole runs the other way.
        const int32_t from = w->faces[pliant_halfedge_next(h)];
        next[from] = next[from] == -1 ? w->faces[h] : -2;
    }
    const double limit = PLIANT_HOLE_LENGTH_LIMIT * pliant_surface_diagonal(w->mesh);
    pliant_status status = PLIANT_OK;
    for (int32_t v = 0; v < n && status == PLIANT_OK; v++) {
        int32_t loop[PLIANT_HOLE_SIDE_LIMIT], count = 0, at = v;
        double length = 0;
        while (next[at] >= 0 && count < PLIANT_HOLE_SIDE_LIMIT) {
            loop[count++] = at;
            length += sqrt(pliant_squared_distance(position(w, at), position(w, next[at])));
            at = next[at];
            if (at == v) break;
        }
        if (count < 3 || at != v || length > limit || w->face_count + count - 2 > w->face_capacity)
            continue;
        status = pliant_polygon_split(w->mesh->vertices, loop, count,
                                      w->faces + 3 * (size_t)w->face_count, err);
        w->face_count += count - 2;
        report->filled++;
        for (int32_t i = 0; i < count; i++) next[loop[i]] = -1;
    }
    free(next);
    return status;
}

// ---- The new mesh ----

// Vertices that are used, those of several fans once for each.
static pliant_status rebuild(work *w, const int32_t *twin, pliant_mesh **mesh, int32_t **source,
                             pliant_repair_report *report, pliant_error *err)
{
    const int32_t sides = 3 * w->face_count, n = w->mesh->vertex_count;
    int32_t *number = w->stack, *origin = malloc(((size_t)sides + 1) * sizeof *origin),
            *seen = malloc(((size_t)n + 1) * sizeof *seen);
    int32_t count = 0;
    pliant_status status = PLIANT_OK;
    pliant_mesh *made = NULL;
    if (!origin || !seen) {
        status =
            pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to repair %d faces", w->face_count);
        goto done;
    }
    for (int32_t h = 0; h < sides; h++) number[h] = -1;
    for (int32_t v = 0; v < n; v++) seen[v] = -1;
    // Old vertices keep their order; further fans come behind.
    for (int32_t h = 0; h < sides; h++) seen[w->faces[h]] = -2;
    for (int32_t v = 0; v < n; v++) {
        if (seen[v] == -1) {
            report->unused += w->first[v] == v;
            continue;
        }
        origin[count] = v;
        seen[v] = count++;
    }
    // A corner of vertex v whose fan has not been met: walk both ways until it is round or open.
    int8_t *taken = calloc((size_t)n + 1, 1);
    if (!taken) {
        status =
            pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to repair %d faces", w->face_count);
        goto done;
    }
    for (int32_t h = 0; h < sides; h++) {
        if (number[h] >= 0) continue;
        const int32_t v = w->faces[h];
        int32_t mine = seen[v];
        if (taken[v]) {
            mine = count;
            origin[count++] = v;
            report->split++;
        }
        taken[v] = 1;
        int32_t g = h;
        while (g >= 0 && number[g] < 0 && w->faces[g] == v) {
            number[g] = mine;
            g = twin[pliant_halfedge_previous(g)];
        }
        for (g = twin[h] < 0 ? -1 : pliant_halfedge_next(twin[h]);
             g >= 0 && number[g] < 0 && w->faces[g] == v;
             g = twin[g] < 0 ? -1 : pliant_halfedge_next(twin[g]))
            number[g] = mine;
    }
    free(taken);
    status = pliant_mesh_create(count, w->face_count, &made, err);
    if (status < 0) goto done;
    for (int32_t v = 0; v < count; v++)
        memcpy(made->vertices + 3 * (size_t)v, position(w, origin[v]), 3 * sizeof(double));
    memcpy(made->faces, number, (size_t)sides * sizeof *number);
    pliant_mesh_destroy(*mesh);
    *mesh = made;
    *source = origin;
    origin = NULL;
done:
    free(seen);
    free(origin);
    return status;
}

static void say(char *text, size_t size, int32_t count, const char *one, const char *many)
{
    const size_t used = strlen(text);
    if (count > 0)
        snprintf(text + used, size - used, "%s%d %s", used ? ", " : "", count,
                 count == 1 ? one : many);
}

pliant_status pliant_repair(pliant_mesh **mesh, int32_t **source, pliant_repair_report *report,
                            pliant_error *err)
{
    const pliant_mesh *m = *mesh;
    *report = (pliant_repair_report){0};
    // Every hole's side is a side of a face, and makes less than a face.
    const int64_t capacity = 2 * (int64_t)m->face_count + 2;
    if (capacity > PLIANT_HALFEDGE_FACE_LIMIT / 2)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "expected at most %d faces, found %d",
                                PLIANT_HALFEDGE_FACE_LIMIT / 4, m->face_count);
    work w = {.mesh = m, .face_count = m->face_count, .face_capacity = (int32_t)capacity};
    const size_t sides = 3 * (size_t)capacity;
    int32_t *twin = malloc(sides * sizeof *twin), distinct = 0;
    w.first = malloc(((size_t)m->vertex_count + 1) * sizeof *w.first);
    w.faces = malloc(sides * sizeof *w.faces);
    w.sides = malloc(sides * sizeof *w.sides);
    w.stack = malloc(sides * sizeof *w.stack);
    w.mark = malloc((size_t)capacity);
    pliant_status status = PLIANT_OK;
    if (!twin || !w.first || !w.faces || !w.sides || !w.stack || !w.mark)
        status =
            pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to repair %d faces", m->face_count);
    if (status == PLIANT_OK)
        status = pliant_weld_points(m->vertices, m->vertex_count, w.first, &distinct, err);
    if (status == PLIANT_OK) {
        report->welded = m->vertex_count - distinct;
        memcpy(w.faces, m->faces, 3 * (size_t)m->face_count * sizeof *w.faces);
        status = drop_faces(&w, report, err);
    }
    if (status == PLIANT_OK) {
        match_sides(&w, twin);
        turn_faces(&w, twin, report);
        enum { FLIP_LIMIT = 100 };
        for (int round = 0; round < FLIP_LIMIT && flip_flat(&w); round++) report->dropped++;
        match_sides(&w, twin);
        status = fill_holes(&w, twin, report, err);
    }
    if (status == PLIANT_OK) {
        match_sides(&w, twin);
        status = rebuild(&w, twin, mesh, source, report, err);
    }
    if (status == PLIANT_OK) {
        char *text = report->text;
        const size_t size = sizeof report->text;
        say(text, size, report->welded, "vertex welded to another on its place",
            "vertices welded to others on their places");
        say(text, size, report->dropped, "degenerate or duplicate face removed",
            "degenerate or duplicate faces removed");
        say(text, size, report->turned, "face turned", "faces turned");
        say(text, size, report->filled, "small hole closed", "small holes closed");
        say(text, size, report->split, "vertex split between separate fans of faces",
            "vertices split between separate fans of faces");
        say(text, size, report->unused, "unused vertex dropped", "unused vertices dropped");
    }
    free(w.mark);
    free(w.stack);
    free(w.sides);
    free(w.faces);
    free(w.first);
    free(twin);
    return status;
}
