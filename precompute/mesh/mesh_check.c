// mesh_check.c: is a mesh the boundary of a solid?
//
// Decisions:
//  - Components may be many: a component inside an even number of others bounds a body and looks
//    outwards; inside an odd number it bounds a cavity and looks into it. What looks the other way
//    is turned as a whole.
//  - A component whose faces disagree among themselves is refused, not repaired: which side is
//  right is
//    for the one who made it.
//  - Components that cross are refused where a vertex of one is seen inside another. Other
//    self-intersections are not looked for.
//  - Vertices are not welded here: that would change the numbers that scripts and lists use.
// Edges are matched by counting sorts, so time and memory are proportional to the mesh.
#include "mesh_check.h"

#include "components.h"
#include "pliant/error.h"
#include "weld.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Fourth powers of lengths (squared areas) and their sums stay finite and normal between these.
#define COORDINATE_LIMIT 1e60
#define EXTENT_LIMIT     1e-60
// A face is degenerate when its height over its longest side is below this part of the side.
// Collinear corners written with 7 to 9 digits leave 1e-7 to 1e-9; the thinnest faces of the
// evaluation meshes have 1e-2.
#define HEIGHT_LIMIT 1e-6
// A component is flat when its volume is below this part of area times diagonal. A plate of
// thickness t has t / (2 diagonal); one written in float and meant flat leaves up to some 1e-8.
#define VOLUME_LIMIT 1e-7

typedef struct check {
    pliant_mesh *mesh;
    const char *name;
    int32_t *order[2]; // shape [3 face_count]: half-edges or faces, sorted
    int32_t *start;    // shape [vertex_count + 1], counts of the sort
    int32_t *twin;     // shape [3 face_count]: the other half-edge of the edge
    int32_t *mark;     // shape [max(vertex_count, 3 face_count)]
    pliant_error *err;
} check;

// Half-edge 3f + k runs from corner k to corner k + 1 of face f.
static int32_t tail(const check *c, int32_t h)
{
    return c->mesh->faces[h];
}

static int32_t head(const check *c, int32_t h)
{
    return c->mesh->faces[h % 3 == 2 ? h - 2 : h + 1];
}

static int32_t low(const check *c, int32_t h)
{
    return tail(c, h) < head(c, h) ? tail(c, h) : head(c, h);
}

static int32_t high(const check *c, int32_t h)
{
    return tail(c, h) < head(c, h) ? head(c, h) : tail(c, h);
}

static int32_t least_corner(const check *c, int32_t f)
{
    const int32_t *v = c->mesh->faces + 3 * (size_t)f;
    const int32_t m = v[0] < v[1] ? v[0] : v[1];
    return m < v[2] ? m : v[2];
}

static int32_t largest_corner(const check *c, int32_t f)
{
    const int32_t *v = c->mesh->faces + 3 * (size_t)f;
    const int32_t m = v[0] > v[1] ? v[0] : v[1];
    return m > v[2] ? m : v[2];
}

static int32_t middle_corner(const check *c, int32_t f)
{
    const int32_t *v = c->mesh->faces + 3 * (size_t)f;
    // The sum of three may pass 32 bits.
    return (int32_t)((int64_t)v[0] + v[1] + v[2] - least_corner(c, f) - largest_corner(c, f));
}

// Sort `from` by a key in [0, vertex_count) into `to`, keeping the order of equals.
static void sort_by(const check *c, int32_t (*key)(const check *, int32_t), const int32_t *from,
                    int32_t *to, int32_t count)
{
    memset(c->start, 0, ((size_t)c->mesh->vertex_count + 1) * sizeof *c->start);
    for (int32_t i = 0; i < count; i++) c->start[key(c, from[i]) + 1]++;
    for (int32_t v = 0; v < c->mesh->vertex_count; v++) c->start[v + 1] += c->start[v];
    for (int32_t i = 0; i < count; i++) to[c->start[key(c, from[i])]++] = from[i];
}

// ---- One vertex, one face at a time ----

static pliant_status check_vertices(const check *c, pliant_mesh_report *report)
{
    const pliant_mesh *mesh = c->mesh;
    for (int k = 0; k < 3; k++) {
        report->bounding_min[k] = INFINITY;
        report->bounding_max[k] = -INFINITY;
    }
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            const double x = mesh->vertices[3 * (size_t)v + k];
            if (!isfinite(x))
                return pliant_error_set(c->err, PLIANT_ERR_FORMAT,
                                        "%s: vertex %d: the %c coordinate is not finite: %g",
                                        c->name, v, "xyz"[k], x);
            if (fabs(x) > COORDINATE_LIMIT)
                return pliant_error_set(
                    c->err, PLIANT_ERR_FORMAT,
                    "%s: vertex %d: the %c coordinate is too large: expected at most "
                    "%g, found %g",
                    c->name, v, "xyz"[k], COORDINATE_LIMIT, x);
            report->bounding_min[k] = fmin(report->bounding_min[k], x);
            report->bounding_max[k] = fmax(report->bounding_max[k], x);
        }
    double extent[3], largest = 0;
    for (int k = 0; k < 3; k++) {
        extent[k] = report->bounding_max[k] - report->bounding_min[k];
        largest = fmax(largest, extent[k]);
    }
    if (!(largest >= EXTENT_LIMIT))
        return pliant_error_set(c->err, PLIANT_ERR_FORMAT,
                                "%s: all vertices stand on one place: extent %g", c->name, largest);
    // Said here, for what was drawn in a coordinate plane; check_components finds the other planes.
    for (int k = 0; k < 3; k++)
        if (extent[k] <= VOLUME_LIMIT * largest)
            return pliant_error_set(
                c->err, PLIANT_ERR_FORMAT,
                "%s: the mesh is flat and encloses no volume: extent %g along %c, %g "
                "elsewhere",
                c->name, extent[k], "xyz"[k], largest);
    return PLIANT_OK;
}

static pliant_status check_numbers(const check *c)
{
    const pliant_mesh *mesh = c->mesh;
    memset(c->mark, 0, (size_t)mesh->vertex_count * sizeof *c->mark);
    for (int32_t h = 0; h < 3 * mesh->face_count; h++) {
        const int32_t v = mesh->faces[h];
        if (v < 0 || v >= mesh->vertex_count)
            return pliant_error_set(c->err, PLIANT_ERR_FORMAT,
                                    "%s: face %d refers to vertex %d of %d", c->name, h / 3, v,
                                    mesh->vertex_count);
        c->mark[v] = 1;
    }
    int32_t count = 0, first = -1;
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        if (!c->mark[v] && count++ == 0) first = v;
    if (count == 0) return PLIANT_OK;
    return pliant_error_set(
        c->err, PLIANT_ERR_FORMAT,
        "%s: %d of %d vertices %s used by no face (first: vertex %d); remove what is "
        "not used",
        c->name, count, mesh->vertex_count, count == 1 ? "is" : "are", first);
}

// The height over the longest side as a part of that side.
static double face_height(const pliant_mesh *mesh, const int32_t *v)
{
    const double *a = mesh->vertices + 3 * (size_t)v[0], *b = mesh->vertices + 3 * (size_t)v[1],
                 *c = mesh->vertices + 3 * (size_t)v[2];
    double longest = 0, p[3], q[3];
    double squared[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        p[k] = b[k] - a[k];
        q[k] = c[k] - a[k];
        squared[0] += p[k] * p[k];
        squared[1] += q[k] * q[k];
        squared[2] += (c[k] - b[k]) * (c[k] - b[k]);
    }
    for (int k = 0; k < 3; k++) longest = fmax(longest, squared[k]);
    const double n[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                         p[0] * q[1] - p[1] * q[0]};
    return longest > 0 ? sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / longest : 0;
}

static pliant_status check_faces(const check *c)
{
    const pliant_mesh *mesh = c->mesh;
    int32_t repeated = 0, thin = 0, first_repeated = -1, first_thin = -1;
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const int32_t *v = mesh->faces + 3 * (size_t)f;
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
            if (repeated++ == 0) first_repeated = f;
        } else if (!(face_height(mesh, v) > HEIGHT_LIMIT)) {
            if (thin++ == 0) first_thin = f;
        }
    }
    if (repeated) {
        const int32_t *v = mesh->faces + 3 * (size_t)first_repeated;
        return pliant_error_set(
            c->err, PLIANT_ERR_FORMAT,
            "%s: %d degenerate face%s with a vertex used twice (first: face %d, "
            "vertices %d, %d and %d)",
            c->name, repeated, repeated == 1 ? "" : "s", first_repeated, v[0], v[1], v[2]);
    }
    if (thin) {
        const int32_t *v = mesh->faces + 3 * (size_t)first_thin;
        return pliant_error_set(
            c->err, PLIANT_ERR_FORMAT,
            "%s: %d degenerate face%s without area (first: face %d, vertices %d, %d "
            "and %d: height / longest side is %.2g, expected more than %g)",
            c->name, thin, thin == 1 ? "" : "s", first_thin, v[0], v[1], v[2], face_height(mesh, v),
            HEIGHT_LIMIT);
    }
    return PLIANT_OK;
}

static pliant_status check_duplicates(const check *c)
{
    const int32_t count = c->mesh->face_count;
    for (int32_t f = 0; f < count; f++) c->order[0][f] = f;
    sort_by(c, largest_corner, c->order[0], c->order[1], count);
    sort_by(c, middle_corner, c->order[1], c->order[0], count);
    sort_by(c, least_corner, c->order[0], c->order[1], count);
    int32_t repeats = 0, face = INT32_MAX, earlier = -1;
    for (int32_t i = 1; i < count; i++) {
        const int32_t a = c->order[1][i - 1], b = c->order[1][i];
        if (least_corner(c, a) != least_corner(c, b) ||
            middle_corner(c, a) != middle_corner(c, b) ||
            largest_corner(c, a) != largest_corner(c, b))
            continue;
        repeats++;
        if (b < face) {
            face = b;
            earlier = a;
        }
    }
    if (repeats == 0) return PLIANT_OK;
    const int32_t *v = c->mesh->faces + 3 * (size_t)face;
    return pliant_error_set(
        c->err, PLIANT_ERR_FORMAT,
        "%s: %d duplicate face%s (first: face %d has the vertices %d, %d and %d of "
        "face %d)",
        c->name, repeats, repeats == 1 ? "" : "s", face, v[0], v[1], v[2], earlier);
}

// ---- Edges ----

// Many exporters write every face with vertices of its own: say so when that is why edges are open.
static void advise_weld(const check *c)
{
    int32_t distinct;
    pliant_error ignored;
    if (!c->err ||
        pliant_weld_points(c->mesh->vertices, c->mesh->vertex_count, c->mark, &distinct, &ignored) <
            0 ||
        distinct == c->mesh->vertex_count)
        return;
    const size_t length = strlen(c->err->text);
    snprintf(c->err->text + length, sizeof c->err->text - length,
             "; its %d vertices stand on %d places only: weld vertices of equal position first",
             c->mesh->vertex_count, distinct);
}

// Fill twin[]: every edge has two faces.
static pliant_status match_edges(const check *c)
{
    const int32_t count = 3 * c->mesh->face_count;
    for (int32_t h = 0; h < count; h++) c->order[0][h] = h;
    sort_by(c, high, c->order[0], c->order[1], count);
    sort_by(c, low, c->order[1], c->order[0], count);
    const int32_t *order = c->order[0];
    int32_t open = 0, crowded = 0, first_open = INT32_MAX, first_crowded = INT32_MAX, crowd = 0;
    for (int32_t i = 0, next; i < count; i = next) {
        for (next = i + 1; next < count && low(c, order[next]) == low(c, order[i]) &&
                           high(c, order[next]) == high(c, order[i]);)
            next++;
        if (next - i == 2) {
            c->twin[order[i]] = order[i + 1];
            c->twin[order[i + 1]] = order[i];
        } else if (next - i == 1) {
            open++;
            if (order[i] < first_open) first_open = order[i];
        } else {
            crowded++;
            if (order[i] < first_crowded) {
                first_crowded = order[i];
                crowd = next - i;
            }
        }
    }
    if (crowded)
        return pliant_error_set(
            c->err, PLIANT_ERR_FORMAT,
            "%s: the surface is not manifold: %d edge%s more than two faces (first: "
            "vertices %d and %d of face %d, %d faces)",
            c->name, crowded, crowded == 1 ? " has" : "s have", tail(c, first_crowded),
            head(c, first_crowded), first_crowded / 3, crowd);
    if (!open) return PLIANT_OK;
    (void)pliant_error_set(
        c->err, PLIANT_ERR_FORMAT,
        "%s: the surface is open: %d edge%s one face (first: vertices %d and %d of "
        "face %d)",
        c->name, open, open == 1 ? " has" : "s have", tail(c, first_open), head(c, first_open),
        first_open / 3);
    advise_weld(c);
    return PLIANT_ERR_FORMAT;
}

// Neighbours pass their common edge in opposite directions. If some do not, find out by walking
// from face to face whether turning faces could help: mark = 1 + (0 as the first face, 1 the other
// way).
static pliant_status check_orientation(const check *c)
{
    const int32_t faces = c->mesh->face_count;
    int32_t clashing = -1;
    for (int32_t h = 0; h < 3 * faces && clashing < 0; h++)
        if (tail(c, h) == tail(c, c->twin[h])) clashing = h;
    if (clashing < 0) return PLIANT_OK;
    memset(c->mark, 0, (size_t)faces * sizeof *c->mark);
    int32_t *stack = c->order[0], wrong = 0;
    int one_sided = 0;
    for (int32_t f = 0; f < faces; f++) {
        if (c->mark[f]) continue;
        int32_t size = 0, seen = 0, other = 0;
        c->mark[f] = 1;
        stack[size++] = f;
        while (size > 0) {
            const int32_t g = stack[--size];
            seen++;
            other += c->mark[g] == 2;
            for (int32_t h = 3 * g; h < 3 * g + 3; h++) {
                const int32_t neighbour = c->twin[h] / 3;
                const int clash = tail(c, h) == tail(c, c->twin[h]);
                const int32_t wanted = clash ? 3 - c->mark[g] : c->mark[g];
                if (!c->mark[neighbour]) {
                    c->mark[neighbour] = wanted;
                    stack[size++] = neighbour;
                } else if (c->mark[neighbour] != wanted) {
                    one_sided = 1;
                }
            }
        }
        wrong += other < seen - other ? other : seen - other;
    }
    if (one_sided)
        return pliant_error_set(
            c->err, PLIANT_ERR_FORMAT,
            "%s: the surface is not orientable: it has one side only, like Klein's "
            "bottle (met at vertices %d and %d of face %d)",
            c->name, tail(c, clashing), head(c, clashing), clashing / 3);
    return pliant_error_set(
        c->err, PLIANT_ERR_FORMAT,
        "%s: inconsistent orientation: %d of %d faces look the other way (first: "
        "faces %d and %d disagree at vertices %d and %d)",
        c->name, wrong, faces, clashing / 3, c->twin[clashing] / 3, tail(c, clashing),
        head(c, clashing));
}

// The faces around a vertex are one fan: going round from any reaches all.
static pliant_status check_fans(const check *c)
{
    const int32_t count = 3 * c->mesh->face_count;
    int32_t *fans = c->order[0], *passed = c->order[1];
    memset(fans, 0, (size_t)c->mesh->vertex_count * sizeof *fans);
    memset(passed, 0, (size_t)count * sizeof *passed);
    int32_t found = 0, first = INT32_MAX;
    for (int32_t h = 0; h < count; h++) {
        if (passed[h]) continue;
        // The half-edge before h runs into h's vertex; its twin leaves it again.
        for (int32_t g = h; !passed[g]; g = c->twin[g % 3 == 0 ? g + 2 : g - 1]) passed[g] = 1;
        if (++fans[tail(c, h)] != 2) continue;
        found++;
        if (tail(c, h) < first) first = tail(c, h);
    }
    if (!found) return PLIANT_OK;
    return pliant_error_set(
        c->err, PLIANT_ERR_FORMAT,
        "%s: the surface is not manifold: %d vert%s where separate fans of faces meet "
        "(first: vertex %d, %d fans)",
        c->name, found, found == 1 ? "ex" : "ices", first, fans[first]);
}

// ---- Components ----

static pliant_status check_components(const check *c, pliant_mesh_report *report)
{
    pliant_components *parts;
    pliant_status status = pliant_components_create(c->mesh, c->name, &parts, c->err);
    if (status < 0) return status;
    for (int32_t i = 0; status == PLIANT_OK && i < parts->count; i++) {
        double squared = 0;
        for (int k = 0; k < 3; k++) {
            const double side = parts->box[i][k + 3] - parts->box[i][k];
            squared += side * side;
        }
        if (!(fabs(parts->volume[i]) > VOLUME_LIMIT * parts->area[i] * sqrt(squared)))
            status = pliant_error_set(
                c->err, PLIANT_ERR_FORMAT,
                "%s: the component of vertex %d encloses no volume: %.3g, with area "
                "%.3g",
                c->name, parts->first_vertex[i], parts->volume[i], parts->area[i]);
    }
    if (status == PLIANT_OK) {
        report->component_count = parts->count;
        report->turned_count = 0;
        report->volume = 0;
        for (int32_t i = 0; i < parts->count; i++) {
            const int is_cavity = parts->depth[i] % 2;
            report->volume += is_cavity ? -fabs(parts->volume[i]) : fabs(parts->volume[i]);
            if ((parts->volume[i] < 0) == is_cavity) continue;
            for (int32_t j = parts->face_start[i]; j < parts->face_start[i + 1]; j++) {
                int32_t *v = c->mesh->faces + 3 * (size_t)parts->faces[j];
                const int32_t swapped = v[1];
                v[1] = v[2];
                v[2] = swapped;
                report->turned_count++;
            }
        }
    }
    pliant_components_destroy(parts);
    return status;
}

pliant_status pliant_mesh_check(pliant_mesh *mesh, const char *name, pliant_mesh_report *report,
                                pliant_error *err)
{
    if (mesh->vertex_count < 4 || mesh->face_count < 4)
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT,
            "%s: %d vertices and %d faces: a closed surface has at least 4 of each", name,
            mesh->vertex_count, mesh->face_count);
    if (mesh->face_count > INT32_MAX / 3)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: expected at most %d faces, found %d",
                                name, INT32_MAX / 3, mesh->face_count);
    const size_t edges = 3 * (size_t)mesh->face_count, vertices = (size_t)mesh->vertex_count + 1;
    const size_t larger = edges > vertices ? edges : vertices;
    pliant_mesh_report found = {0};
    check c = {.mesh = mesh, .name = name, .err = err};
    c.order[0] = malloc(larger * sizeof(int32_t));
    c.order[1] = malloc(larger * sizeof(int32_t));
    c.start = malloc(vertices * sizeof(int32_t));
    c.twin = malloc(edges * sizeof(int32_t));
    c.mark = malloc(larger * sizeof(int32_t));
    pliant_status status = PLIANT_OK;
    if (!c.order[0] || !c.order[1] || !c.start || !c.twin || !c.mark)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory to check %d faces", name,
                                  mesh->face_count);
    if (status == PLIANT_OK) status = check_vertices(&c, &found);
    if (status == PLIANT_OK) status = check_numbers(&c);
    if (status == PLIANT_OK) status = check_faces(&c);
    if (status == PLIANT_OK) status = check_duplicates(&c);
    if (status == PLIANT_OK) status = match_edges(&c);
    if (status == PLIANT_OK) status = check_orientation(&c);
    if (status == PLIANT_OK) status = check_fans(&c);
    if (status == PLIANT_OK) status = check_components(&c, &found);
    if (status == PLIANT_OK) *report = found;
    free(c.mark);
    free(c.twin);
    free(c.start);
    free(c.order[1]);
    free(c.order[0]);
    return status;
}
