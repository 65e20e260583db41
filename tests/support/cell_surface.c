// cell_surface.c: find the outer sides, pair them along edges, number the fans of corners.
#include "cell_surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A side that no other cell shares. Corners counterclockwise seen from outside.
typedef struct quad {
    int32_t cell, axis, sign;  // the outward normal is sign * axis
    int32_t corner[4][3];
} quad;

// Side `side` of a quad, from its corner `side` to the next.
typedef struct edge {
    int64_t key;
    int32_t cell, quad, side;
} edge;

static void *take(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    assert_non_null(memory);
    return memory;
}

static int64_t key_of(const int32_t x[3])
{
    return ((int64_t)x[2] * 4096 + x[1]) * 4096 + x[0];
}

static int order_keys(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static int order_edges(const void *a, const void *b)
{
    const edge *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    if (x->cell != y->cell) return x->cell < y->cell ? -1 : 1;
    return (x->quad > y->quad) - (x->quad < y->quad);
}

static quad make_quad(const int32_t *cell, int32_t number, int32_t axis, int32_t sign)
{
    static const int32_t round[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    quad q = {.cell = number, .axis = axis, .sign = sign};
    const int32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int k = 0; k < 4; k++) {
        const int32_t *at = round[sign > 0 ? k : 3 - k];
        q.corner[k][axis] = cell[axis] + (sign > 0);
        q.corner[k][u] = cell[u] + at[0];
        q.corner[k][v] = cell[v] + at[1];
    }
    return q;
}

static quad *find_quads(int32_t cell_count, const int32_t *cells, int32_t *quad_count)
{
    int64_t *keys = take((size_t)cell_count, sizeof *keys);
    quad *quads = take(6 * (size_t)cell_count, sizeof *quads);
    for (int32_t i = 0; i < cell_count; i++) keys[i] = key_of(cells + 3 * (size_t)i);
    qsort(keys, (size_t)cell_count, sizeof *keys, order_keys);
    *quad_count = 0;
    for (int32_t i = 0; i < cell_count; i++)
        for (int32_t side = 0; side < 6; side++) {
            const int32_t axis = side / 2, sign = side % 2 ? 1 : -1;
            int32_t next[3];
            memcpy(next, cells + 3 * (size_t)i, sizeof next);
            next[axis] += sign;
            const int64_t key = key_of(next);
            if (next[axis] >= 0 &&
                bsearch(&key, keys, (size_t)cell_count, sizeof *keys, order_keys))
                continue;
            quads[(*quad_count)++] = make_quad(cells + 3 * (size_t)i, i, axis, sign);
        }
    free(keys);
    return quads;
}

// ---- Fans: quad corners that are one vertex ----

static int32_t root_of(int32_t *parent, int32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

static void join(int32_t *parent, int32_t a, int32_t b)
{
    a = root_of(parent, a);
    b = root_of(parent, b);
    parent[a > b ? a : b] = a > b ? b : a;
}

// Two quads meet at an edge, or four where two cells touch along it: then each cell's own two, and
// `mate` of either's side is the other's, else -1. (The surface may come together again around both
// ends of such an edge; a vertex in the middle of each pair's keeps those apart.)
static int32_t *join_corners(int32_t quad_count, const quad *quads, int32_t *mate)
{
    const size_t count = 4 * (size_t)quad_count;
    edge *edges = take(count, sizeof *edges);
    int32_t *parent = take(count, sizeof *parent);
    for (int32_t q = 0; q < quad_count; q++)
        for (int32_t k = 0; k < 4; k++) {
            const int32_t *a = quads[q].corner[k], *b = quads[q].corner[(k + 1) % 4];
            const int32_t middle[3] = {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
            edges[4 * q + k] = (edge){key_of(middle), quads[q].cell, q, k};
            parent[4 * q + k] = 4 * q + k;
        }
    qsort(edges, count, sizeof *edges, order_edges);
    for (size_t i = 0; i < count; i += 2) {
        const edge *a = &edges[i], *b = &edges[i + 1];
        assert_true(a->key == b->key);
        const int is_shared =
            (i > 0 && edges[i - 1].key == a->key) || (i + 2 < count && edges[i + 2].key == a->key);
        mate[4 * a->quad + a->side] = is_shared ? 4 * b->quad + b->side : -1;
        mate[4 * b->quad + b->side] = is_shared ? 4 * a->quad + a->side : -1;
        join(parent, 4 * a->quad + a->side, 4 * b->quad + (b->side + 1) % 4);
        join(parent, 4 * b->quad + b->side, 4 * a->quad + (a->side + 1) % 4);
    }
    free(edges);
    return parent;
}

static int is_inside(const double *x, const int32_t *cell)
{
    for (int d = 0; d < 3; d++)
        if (x[d] < cell[d] || x[d] > cell[d] + 1) return 0;
    return 1;
}

// ---- The mesh ----

// Numbers of the mesh's vertices: fans of corners, middles of quads, middles of sides.
typedef struct numbering {
    int32_t quad_count, fan_count, split_count;
    int32_t *fan;    // shape [4 quad_count]: of a quad's corner
    int32_t *split;  // shape [4 quad_count]: of a quad's side, or -1
} numbering;

static numbering number_vertices(int32_t quad_count, const quad *quads)
{
    const int32_t count = 4 * quad_count;
    numbering n = {.quad_count = quad_count,
                   .fan = take((size_t)count, sizeof *n.fan),
                   .split = take((size_t)count, sizeof *n.split)};
    int32_t *mate = take((size_t)count, sizeof *mate);
    int32_t *parent = join_corners(quad_count, quads, mate);
    // A root is the least corner of its fan, so it has its number before the others ask.
    for (int32_t i = 0; i < count; i++) {
        const int32_t root = root_of(parent, i);
        n.fan[i] = root == i ? n.fan_count++ : n.fan[root];
    }
    const int32_t first = n.fan_count + quad_count;
    for (int32_t i = 0; i < count; i++)
        n.split[i] = mate[i] < 0 ? -1 : mate[i] < i ? n.split[mate[i]] : first + n.split_count++;
    free(parent);
    free(mate);
    return n;
}

// A corner less `inset` of the sum of the normals' directions, where that is in a cell of the fan.
static void place_fans(const numbering *n, const quad *quads, const int32_t *cells, double inset,
                       check_cell_surface *s)
{
    int32_t(*normal)[3] = take((size_t)n->fan_count, sizeof *normal);
    for (int32_t i = 0; i < 4 * n->quad_count; i++)
        normal[n->fan[i]][quads[i / 4].axis] += quads[i / 4].sign;
    for (int32_t f = 0; f < n->fan_count; f++) s->cell[f] = -1;
    for (int pass = 0; pass < 2; pass++)  // the second: those that had to stay at their corner
        for (int32_t i = 0; i < 4 * n->quad_count; i++) {
            const quad *q = &quads[i / 4];
            const int32_t fan = n->fan[i];
            double x[3];
            if (s->cell[fan] >= 0) continue;
            for (int d = 0; d < 3; d++) {
                const int32_t sum = normal[fan][d], direction = (sum > 0) - (sum < 0);
                x[d] = q->corner[i % 4][d] - (pass == 0 ? inset * direction : 0);
            }
            if (!is_inside(x, cells + 3 * (size_t)q->cell)) continue;
            s->cell[fan] = q->cell;
            memcpy(s->mesh->vertices + 3 * (size_t)fan, x, sizeof x);
        }
    free(normal);
}

// The middles of quads, and of sides that two cells share: each of a side's two quads gives
// half of where that is, and its inset.
static void place_middles(const numbering *n, const quad *quads, double inset,
                          check_cell_surface *s)
{
    for (int32_t q = 0; q < n->quad_count; q++) {
        const int32_t middle = n->fan_count + q;
        double *x = s->mesh->vertices + 3 * (size_t)middle;
        for (int d = 0; d < 3; d++)
            for (int k = 0; k < 4; k++) x[d] += 0.25 * quads[q].corner[k][d];
        x[quads[q].axis] -= inset * quads[q].sign;
        s->cell[middle] = quads[q].cell;
        for (int k = 0; k < 4; k++) {
            const int32_t split = n->split[4 * q + k];
            if (split < 0) continue;
            double *y = s->mesh->vertices + 3 * (size_t)split;
            for (int d = 0; d < 3; d++)
                y[d] += 0.25 * (quads[q].corner[k][d] + quads[q].corner[(k + 1) % 4][d]);
            y[quads[q].axis] -= inset * quads[q].sign;
            s->cell[split] = quads[q].cell;
        }
    }
}

static void add_faces(const numbering *n, check_cell_surface *s)
{
    int32_t *face = s->mesh->faces;
    for (int32_t i = 0; i < 4 * n->quad_count; i++) {
        const int32_t middle = n->fan_count + i / 4, split = n->split[i];
        const int32_t ends[2] = {n->fan[i], n->fan[i - i % 4 + (i + 1) % 4]};
        for (int side = 0; side < (split < 0 ? 1 : 2); side++, face += 3) {
            face[0] = side == 0 ? ends[0] : split;
            face[1] = split < 0 || side == 1 ? ends[1] : split;
            face[2] = middle;
        }
    }
}

check_cell_surface check_cell_surface_create(int32_t cell_count, const int32_t *cells, double inset)
{
    check_cell_surface s = {.mesh = NULL};
    pliant_error err = {""};
    int32_t quad_count = 0;
    quad *quads = find_quads(cell_count, cells, &quad_count);
    numbering n = number_vertices(quad_count, quads);
    // Either of the two quads at a split side has a face more for it.
    check_ok(pliant_mesh_create(n.fan_count + quad_count + n.split_count,
                                4 * quad_count + 2 * n.split_count, &s.mesh, &err),
             &err);
    s.cell = take((size_t)s.mesh->vertex_count, sizeof *s.cell);
    place_fans(&n, quads, cells, inset, &s);
    place_middles(&n, quads, inset, &s);
    add_faces(&n, &s);
    free(n.split);
    free(n.fan);
    free(quads);
    return s;
}

void check_cell_surface_destroy(check_cell_surface *surface)
{
    pliant_mesh_destroy(surface->mesh);
    free(surface->cell);
    *surface = (check_cell_surface){.mesh = NULL};
}
