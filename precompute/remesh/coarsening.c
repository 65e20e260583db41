// coarsening.c: a mesh coarsened step by step, with a map from every coarse mesh onto the fine
// one.
#include "remesh/coarsening.h"

#include "remesh/vector.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"

#include <stdlib.h>
#include <string.h>

// A vertex with more neighbours waits until some of them are gone.
enum { RING_LIMIT = 24 };
// The valence of what is left is kept low: every corner of a base vertex shares 360 degrees.
enum { VALENCE_LIMIT = 10 };

// What a step costs, in units of the bounding box's diagonal: the quadric error of the place that
// is left, and EVENNESS times the squared area around, so that flat parts are thinned evenly; over
// the worst face's quality, times a factor for valences away from 6. Tried from 0 to 1e-2 on the
// bunny: with more, its ears are left without vertices; with less, bases are uneven.
static const double evenness = 1e-3;
static const double valence_factor = 0.05;
// The least quality (1: equilateral) of the faces that a step makes, in its flat chart and, while
// there is another choice, in space; and how far they may turn.
static const double flat_quality = 0.02, space_quality = 0.15;
static const double turn_cosine = 0.2;

typedef struct step {
    int32_t vertex, into, ring_count;
    int32_t first;  // into rings, faces and flat
} step;

struct pliant_coarsening {
    const pliant_mesh *mesh;
    int32_t step_count;
    step *steps;
    int32_t used, capacity;
    // Of every step: the ring of the vertex, counterclockwise, from the one it slides into; the
    // face between each and the next; and where they lie in the chart, the vertex itself in its
    // origin.
    int32_t *rings, *ring_faces;
    double (*flat)[2];
};

// A star's faces and neighbours, counterclockwise.
typedef struct star {
    int count;
    int32_t ring[RING_LIMIT], faces[RING_LIMIT];  // face i has ring[i] and the next
    double flat[RING_LIMIT][2];
} star;

typedef struct work {
    const pliant_mesh *mesh;
    double *x;         // [n][3], in units of the diagonal
    int32_t *corners;  // [3 faces] the current faces
    int32_t *head;     // [n] first corner 3f + k of a vertex, or -1
    int32_t *chain;    // [3 faces] next corner of the same vertex
    int32_t *valence;  // [n] 0 once removed
    int32_t *mark;     // [n]
    int32_t stamp;
    double (*quadric)[10];
    double *cost;          // [n]
    int32_t *into;         // [n] the best neighbour, or -1
    int32_t *heap, *slot;  // vertices by cost; where each is, or -1
    int32_t heap_count;
} work;

// ---- Stars ----

// The star of v; 0 when it is too large.
static int find_star(const work *w, int32_t v, star *s)
{
    int32_t next[RING_LIMIT], face[RING_LIMIT], from[RING_LIMIT];
    int count = 0;
    if (w->valence[v] > RING_LIMIT) return 0;
    for (int32_t c = w->head[v]; c >= 0; c = w->chain[c]) {
        const int32_t f = c / 3, k = c % 3;
        from[count] = w->corners[3 * f + (k + 1) % 3];
        next[count] = w->corners[3 * f + (k + 2) % 3];
        face[count++] = f;
    }
    s->count = count;
    int at = 0;
    for (int i = 0; i < count; i++) {
        s->ring[i] = from[at];
        s->faces[i] = face[at];
        int then = 0;
        while (then < count - 1 && from[then] != next[at]) then++;
        at = then;
    }
    return 1;
}

// The map z^a of MAPS: angles at the vertex scaled to a full turn, lengths to that power. The power
// is kept near 1: tips of needles would be spread over many orders of magnitude.
static void flatten(const work *w, int32_t v, star *s)
{
    double angles[RING_LIMIT], total = 0, mean = 0;
    const double *o = w->x + 3 * (size_t)v;
    for (int i = 0; i < s->count; i++) {
        const double *p = w->x + 3 * (size_t)s->ring[i],
                     *q = w->x + 3 * (size_t)s->ring[(i + 1) % s->count];
        double a[3], b[3], c[3];
        pliant_subtract(p, o, a);
        pliant_subtract(q, o, b);
        pliant_cross(a, b, c);
        angles[i] = fmax(atan2(pliant_length(c), pliant_dot(a, b)), 1e-3);
        total += angles[i];
        mean += pliant_length(a) / s->count;
    }
    // No angle of the chart may reach half a turn.
    const double turn = 2 * acos(-1.0);
    double scaled = 0;
    for (int i = 0; i < s->count; i++) {
        angles[i] = fmin(angles[i] * turn / total, 0.45 * turn);
        scaled += angles[i];
    }
    const double power = fmin(fmax(turn / total, 2. / 3), 1.5);
    double at = 0;
    for (int i = 0; i < s->count; i++) {
        const double *p = w->x + 3 * (size_t)s->ring[i];
        const double radius = pow(fmax(sqrt(pliant_squared_distance(p, o)) / mean, 1e-3), power);
        s->flat[i][0] = radius * cos(at);
        s->flat[i][1] = radius * sin(at);
        at += angles[i] * turn / scaled;
    }
}

static double flat_area(const double *a, const double *b, const double *c)
{
    return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

static double flat_shape(const double *a, const double *b, const double *c)
{
    double sum = 0;
    for (int i = 0; i < 2; i++)
        sum += (b[i] - a[i]) * (b[i] - a[i]) + (c[i] - b[i]) * (c[i] - b[i]) +
               (a[i] - c[i]) * (a[i] - c[i]);
    return sum > 0 ? 4 * sqrt(3.) * flat_area(a, b, c) / sum : 0;
}

// ---- Costs ----

static double quadric_error(const double q[10], const double *x)
{
    return q[0] * x[0] * x[0] + q[4] * x[1] * x[1] + q[7] * x[2] * x[2] + q[9] +
           2 * (q[1] * x[0] * x[1] + q[2] * x[0] * x[2] + q[5] * x[1] * x[2] + q[3] * x[0] +
                q[6] * x[1] + q[8] * x[2]);
}

// May the star's vertex slide into ring[r]? Only if what is left is a manifold of the same kind:
// the two have two common neighbours, and nobody is left with fewer than three.
static int keeps_topology(work *w, const star *s, int32_t v, int r)
{
    const int k = s->count;
    const int32_t into = s->ring[r];
    if (w->valence[v] + w->valence[into] - 4 < 3) return 0;
    if (w->valence[s->ring[(r + 1) % k]] < 4 || w->valence[s->ring[(r + k - 1) % k]] < 4) return 0;
    w->stamp++;
    for (int i = 0; i < k; i++) w->mark[s->ring[i]] = w->stamp;
    int common = 0;
    for (int32_t c = w->head[into]; c >= 0; c = w->chain[c])
        common += w->mark[w->corners[pliant_halfedge_next(c)]] == w->stamp;
    return common == 2;
}

// The cost of sliding v into ring[r]; infinite if it may not.
static double slide_cost(work *w, const star *s, int32_t v, int r)
{
    const int k = s->count;
    const int32_t into = s->ring[r];
    if (!keeps_topology(w, s, v, r)) return INFINITY;
    const double *x = w->x + 3 * (size_t)into;
    double worst = 1, area = 0, turned = 1;
    for (int i = 1; i < k - 1; i++) {
        const int a = (r + i) % k, b = (r + i + 1) % k;
        if (flat_shape(s->flat[r], s->flat[a], s->flat[b]) < flat_quality) return INFINITY;
        const double *p = w->x + 3 * (size_t)s->ring[a], *q = w->x + 3 * (size_t)s->ring[b];
        double before[3], after[3];
        pliant_face_normal(x, p, q, after);
        pliant_face_normal(w->x + 3 * (size_t)v, p, q, before);
        const double size = pliant_length(after), old = pliant_length(before);
        const double sides = pliant_squared_distance(x, p) + pliant_squared_distance(p, q) +
                             pliant_squared_distance(q, x);
        worst = fmin(worst, 2 * sqrt(3.) * size / sides);
        area += size / 2;
        if (old > 0 && size > 0) turned = fmin(turned, pliant_dot(before, after) / (old * size));
    }
    const int valence = w->valence[v] + w->valence[into] - 4;
    double factor = 1 + valence_factor * (valence - 6) * (valence - 6);
    // Bad steps are not refused, but come after all others.
    if (worst < space_quality) factor *= 1e3 * space_quality / fmax(worst, 1e-6);
    if (turned < turn_cosine) factor *= 1e3;
    if (valence > VALENCE_LIMIT) factor *= 1e3;
    double sum[10];
    for (int i = 0; i < 10; i++) sum[i] = w->quadric[v][i] + w->quadric[into][i];
    const double error = fmax(quadric_error(sum, x), 0);
    return (error + evenness * area * area + 1e-30) * factor / (worst + 1e-6);
}

static void evaluate(work *w, int32_t v)
{
    star s;
    w->cost[v] = INFINITY;
    w->into[v] = -1;
    if (!find_star(w, v, &s)) return;
    flatten(w, v, &s);
    for (int r = 0; r < s.count; r++) {
        const double cost = slide_cost(w, &s, v, r);
        if (!(cost < w->cost[v])) continue;
        w->cost[v] = cost;
        w->into[v] = s.ring[r];
    }
}

// ---- The heap: the cheapest first, the smaller number among equals ----

static int is_before(const work *w, int32_t a, int32_t b)
{
    return w->cost[a] < w->cost[b] || (w->cost[a] == w->cost[b] && a < b);
}

static void put(work *w, int32_t at, int32_t v)
{
    w->heap[at] = v;
    w->slot[v] = at;
}

static void sift(work *w, int32_t at)
{
    const int32_t v = w->heap[at];
    while (at > 0 && is_before(w, v, w->heap[(at - 1) / 2])) {
        put(w, at, w->heap[(at - 1) / 2]);
        at = (at - 1) / 2;
    }
    for (;;) {
        int32_t child = 2 * at + 1;
        if (child >= w->heap_count) break;
        if (child + 1 < w->heap_count && is_before(w, w->heap[child + 1], w->heap[child])) child++;
        if (!is_before(w, w->heap[child], v)) break;
        put(w, at, w->heap[child]);
        at = child;
    }
    put(w, at, v);
}

static void drop(work *w, int32_t v)
{
    const int32_t at = w->slot[v], last = w->heap[--w->heap_count];
    w->slot[v] = -1;
    if (last == v) return;
    put(w, at, last);
    sift(w, at);
}

// ---- Steps ----

static void unchain(work *w, int32_t vertex, int32_t face)
{
    int32_t *link = w->head + vertex;
    while (*link >= 0 && *link / 3 != face) link = w->chain + *link;
    if (*link >= 0) *link = w->chain[*link];
}

static pliant_status record(pliant_coarsening *c, int32_t v, int32_t into, const star *s, int r,
                            pliant_error *err)
{
    if (c->used + s->count > c->capacity) {
        const int32_t capacity = c->capacity / 2 * 3 + 1024;
        int32_t *rings = realloc(c->rings, (size_t)capacity * sizeof *rings);
        if (rings) c->rings = rings;
        int32_t *faces = realloc(c->ring_faces, (size_t)capacity * sizeof *faces);
        if (faces) c->ring_faces = faces;
        double(*flat)[2] = realloc(c->flat, (size_t)capacity * sizeof *flat);
        if (flat) c->flat = flat;
        if (!rings || !faces || !flat)
            return pliant_error_set(err, PLIANT_ERR_MEMORY,
                                    "no memory for the steps of simplification");
        c->capacity = capacity;
    }
    c->steps[c->step_count++] =
        (step){.vertex = v, .into = into, .ring_count = s->count, .first = c->used};
    for (int i = 0; i < s->count; i++, c->used++) {
        const int j = (r + i) % s->count;
        c->rings[c->used] = s->ring[j];
        c->ring_faces[c->used] = s->faces[j];
        memcpy(c->flat[c->used], s->flat[j], sizeof c->flat[0]);
    }
    return PLIANT_OK;
}

static pliant_status slide(pliant_coarsening *c, work *w, int32_t v, pliant_error *err)
{
    star s;
    (void)find_star(w, v, &s);
    flatten(w, v, &s);
    const int32_t into = w->into[v];
    int r = 0;
    while (s.ring[r] != into) r++;
    const pliant_status status = record(c, v, into, &s, r, err);
    if (status < 0) return status;
    const int k = s.count;
    for (int i = 0; i < k; i++) {
        const int32_t a = s.ring[(r + i) % k], b = s.ring[(r + i + 1) % k],
                      f = s.faces[(r + i) % k];
        if (i == 0 || i == k - 1) {
            unchain(w, a, f);
            unchain(w, b, f);
            w->valence[a]--;
            w->valence[b]--;
            for (int j = 0; j < 3; j++) w->corners[3 * f + j] = -1;
        } else {
            for (int j = 0; j < 3; j++)
                if (w->corners[3 * f + j] == v) {
                    w->corners[3 * f + j] = into;
                    w->chain[3 * f + j] = w->head[into];
                    w->head[into] = 3 * f + j;
                }
            w->valence[into]++;
        }
    }
    w->head[v] = -1;
    w->valence[v] = 0;
    for (int i = 0; i < 10; i++) w->quadric[into][i] += w->quadric[v][i];
    drop(w, v);
    for (int i = 0; i < k; i++) {
        evaluate(w, s.ring[i]);
        sift(w, w->slot[s.ring[i]]);
    }
    return PLIANT_OK;
}

// In units of the diagonal, about the box's centre: quadrics lose digits otherwise.
static void scale(work *w)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    const int32_t n = w->mesh->vertex_count;
    for (int32_t v = 0; v < n; v++)
        for (int i = 0; i < 3; i++) {
            low[i] = fmin(low[i], w->mesh->vertices[3 * (size_t)v + i]);
            high[i] = fmax(high[i], w->mesh->vertices[3 * (size_t)v + i]);
        }
    const double diagonal = sqrt(pliant_squared_distance(low, high));
    for (int32_t v = 0; v < n; v++)
        for (int i = 0; i < 3; i++)
            w->x[3 * (size_t)v + i] =
                (w->mesh->vertices[3 * (size_t)v + i] - (low[i] + high[i]) / 2) / diagonal;
}

static void set_up(work *w)
{
    const pliant_mesh *mesh = w->mesh;
    scale(w);
    memcpy(w->corners, mesh->faces, 3 * (size_t)mesh->face_count * sizeof *w->corners);
    for (int32_t v = 0; v < mesh->vertex_count; v++) w->head[v] = -1;
    for (int32_t c = 3 * mesh->face_count - 1; c >= 0; c--) {
        const int32_t v = w->corners[c];
        w->chain[c] = w->head[v];
        w->head[v] = c;
        w->valence[v]++;
    }
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const double *p = w->x + 3 * (size_t)w->corners[3 * f];
        double n[4];
        pliant_face_normal(p, w->x + 3 * (size_t)w->corners[3 * f + 1],
                           w->x + 3 * (size_t)w->corners[3 * f + 2], n);
        const double area = pliant_length(n) / 2;
        pliant_normalize(n);
        n[3] = -pliant_dot(n, p);
        for (int k = 0; k < 3; k++) {
            double *q = w->quadric[w->corners[3 * f + k]];
            for (int i = 0, at = 0; i < 4; i++)
                for (int j = i; j < 4; j++) q[at++] += area / 3 * n[i] * n[j];
        }
    }
}

static void release(work *w)
{
    free(w->slot);
    free(w->heap);
    free(w->into);
    free(w->cost);
    free(w->quadric);
    free(w->mark);
    free(w->valence);
    free(w->chain);
    free(w->head);
    free(w->corners);
    free(w->x);
}

static int reserve(work *w)
{
    const size_t n = (size_t)w->mesh->vertex_count, corners = 3 * (size_t)w->mesh->face_count;
    w->x = malloc(3 * n * sizeof *w->x);
    w->corners = malloc(corners * sizeof *w->corners);
    w->head = malloc(n * sizeof *w->head);
    w->chain = malloc(corners * sizeof *w->chain);
    w->valence = calloc(n, sizeof *w->valence);
    w->mark = calloc(n, sizeof *w->mark);
    w->quadric = calloc(n, sizeof *w->quadric);
    w->cost = malloc(n * sizeof *w->cost);
    w->into = malloc(n * sizeof *w->into);
    w->heap = malloc(n * sizeof *w->heap);
    w->slot = malloc(n * sizeof *w->slot);
    return w->x && w->corners && w->head && w->chain && w->valence && w->mark && w->quadric &&
           w->cost && w->into && w->heap && w->slot;
}

pliant_status pliant_coarsening_create(const pliant_mesh *mesh, pliant_coarsening **coarsening,
                                       pliant_error *err)
{
    work w = {.mesh = mesh};
    pliant_coarsening *c = calloc(1, sizeof *c);
    if (c) {
        c->mesh = mesh;
        c->steps = malloc((size_t)mesh->vertex_count * sizeof *c->steps);
    }
    pliant_status status = PLIANT_OK;
    if (!c || !c->steps || !reserve(&w))
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to simplify %d faces",
                                  mesh->face_count);
    if (status == PLIANT_OK) {
        set_up(&w);
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            evaluate(&w, v);
            w.heap[w.heap_count] = v;
            w.slot[v] = w.heap_count++;
        }
        for (int32_t i = w.heap_count / 2; i >= 0; i--) sift(&w, i);
    }
    while (status == PLIANT_OK && w.heap_count > 0 && w.cost[w.heap[0]] < INFINITY) {
        // Neighbours two steps away may have changed since the cost was found.
        const int32_t v = w.heap[0], into = w.into[v];
        const double cost = w.cost[v];
        evaluate(&w, v);
        if (w.cost[v] != cost || w.into[v] != into) {
            sift(&w, 0);
            continue;
        }
        status = slide(c, &w, v, err);
    }
    release(&w);
    if (status < 0) {
        pliant_coarsening_destroy(c);
        return status;
    }
    *coarsening = c;
    return PLIANT_OK;
}

void pliant_coarsening_destroy(pliant_coarsening *coarsening)
{
    if (!coarsening) return;
    free(coarsening->flat);
    free(coarsening->ring_faces);
    free(coarsening->rings);
    free(coarsening->steps);
    free(coarsening);
}

int32_t pliant_coarsening_least(const pliant_coarsening *coarsening)
{
    return coarsening->mesh->vertex_count - coarsening->step_count;
}

// ---- The map ----

// The faces after the first `count` steps; corners of removed ones are -1.
static void replay(const pliant_coarsening *c, int32_t count, int32_t *corners)
{
    memcpy(corners, c->mesh->faces, 3 * (size_t)c->mesh->face_count * sizeof *corners);
    for (int32_t i = 0; i < count; i++) {
        const step *s = c->steps + i;
        for (int32_t j = 0; j < s->ring_count; j++) {
            int32_t *f = corners + 3 * (size_t)c->ring_faces[s->first + j];
            const int gone = j == 0 || j == s->ring_count - 1;
            f[0] = gone ? -1 : s->into;
            f[1] = gone ? -1 : c->rings[s->first + j];
            f[2] = gone ? -1 : c->rings[s->first + j + 1];
        }
    }
}

pliant_status pliant_coarsening_base(const pliant_coarsening *coarsening, int32_t vertex_count,
                                     pliant_mesh **base, pliant_error *err)
{
    const pliant_mesh *mesh = coarsening->mesh;
    const int32_t steps = mesh->vertex_count - vertex_count;
    int32_t *corners = malloc(3 * (size_t)mesh->face_count * sizeof *corners);
    int32_t *number = malloc((size_t)mesh->vertex_count * sizeof *number);
    pliant_status status = PLIANT_OK;
    pliant_mesh *b = NULL;
    if (!corners || !number)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a base mesh");
    else status = pliant_mesh_create(vertex_count, mesh->face_count - 2 * steps, &b, err);
    if (status == PLIANT_OK) {
        replay(coarsening, steps, corners);
        memset(number, 0, (size_t)mesh->vertex_count * sizeof *number);
        for (int32_t i = 0; i < steps; i++) number[coarsening->steps[i].vertex] = -1;
        int32_t at = 0;
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            if (number[v] < 0) continue;
            memcpy(b->vertices + 3 * (size_t)at, mesh->vertices + 3 * (size_t)v,
                   3 * sizeof(double));
            number[v] = at++;
        }
        at = 0;
        for (int32_t f = 0; f < mesh->face_count; f++) {
            if (corners[3 * (size_t)f] < 0) continue;
            for (int k = 0; k < 3; k++)
                b->faces[3 * (size_t)at + k] = number[corners[3 * (size_t)f + k]];
            at++;
        }
        *base = b;
    }
    free(number);
    free(corners);
    return status;
}

// Where a place of a face lies in the chart of a step.
static void to_chart(const pliant_coarsening *c, const step *s, int32_t j, const int32_t *corners,
                     const pliant_place *place, double p[2])
{
    p[0] = p[1] = 0;
    for (int k = 0; k < 3; k++) {
        const int32_t v = corners[k];
        const int32_t at = v == s->into ? 0 : v == c->rings[s->first + j] ? j : j + 1;
        for (int i = 0; i < 2; i++) p[i] += place->weight[k] * c->flat[s->first + at][i];
    }
}

// The face of the star in which p lies: the one that is least outside.
static pliant_place from_chart(const pliant_coarsening *c, const step *s, const double p[2])
{
    pliant_place best = {.face = -1};
    double least = -INFINITY;
    for (int32_t j = 0; j < s->ring_count; j++) {
        static const double origin[2] = {0, 0};
        const double *a = c->flat[s->first + j], *b = c->flat[s->first + (j + 1) % s->ring_count];
        const double area = flat_area(origin, a, b);
        const double weight[3] = {flat_area(a, b, p) / area, flat_area(b, origin, p) / area,
                                  flat_area(origin, a, p) / area};
        const double inside = fmin(fmin(weight[0], weight[1]), weight[2]);
        if (!(inside > least)) continue;
        least = inside;
        best.face = c->ring_faces[s->first + j];
        memcpy(best.weight, weight, sizeof weight);
    }
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += best.weight[k] = fmax(best.weight[k], 0);
    for (int k = 0; k < 3; k++) best.weight[k] /= sum;
    return best;
}

pliant_status pliant_coarsening_unfold(const pliant_coarsening *coarsening, int32_t vertex_count,
                                       pliant_place *places, int32_t count, pliant_error *err)
{
    const pliant_coarsening *c = coarsening;
    const pliant_mesh *mesh = c->mesh;
    const int32_t steps = mesh->vertex_count - vertex_count;
    const size_t faces = (size_t)mesh->face_count;
    int32_t *corners = malloc(3 * faces * sizeof *corners), *base = malloc(faces * sizeof *base),
            *head = malloc(faces * sizeof *head),
            *next = malloc((size_t)(count ? count : 1) * sizeof *next);
    if (!corners || !base || !head || !next) {
        free(next);
        free(head);
        free(base);
        free(corners);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to map %d points", count);
    }
    replay(c, steps, corners);
    int32_t base_count = 0;
    for (int32_t f = 0; f < mesh->face_count; f++) {
        head[f] = -1;
        if (corners[3 * (size_t)f] >= 0) base[base_count++] = f;
    }
    // The places of every face are a list.
    for (int32_t i = count - 1; i >= 0; i--) {
        places[i].face = base[places[i].face];
        next[i] = head[places[i].face];
        head[places[i].face] = i;
    }
    for (int32_t i = steps - 1; i >= 0; i--) {
        const step *s = c->steps + i;
        int32_t moved = -1;
        for (int32_t j = 1; j < s->ring_count - 1; j++) {
            const int32_t f = c->ring_faces[s->first + j];
            for (int32_t p = head[f], then; p >= 0; p = then) {
                then = next[p];
                double chart[2];
                to_chart(c, s, j, corners + 3 * (size_t)f, places + p, chart);
                places[p] = from_chart(c, s, chart);
                next[p] = moved;
                moved = p;
            }
            head[f] = -1;
        }
        for (int32_t p = moved, then; p >= 0; p = then) {
            then = next[p];
            next[p] = head[places[p].face];
            head[places[p].face] = p;
        }
        for (int32_t j = 0; j < s->ring_count; j++) {
            int32_t *f = corners + 3 * (size_t)c->ring_faces[s->first + j];
            f[0] = s->vertex;
            f[1] = c->rings[s->first + j];
            f[2] = c->rings[s->first + (j + 1) % s->ring_count];
        }
    }
    // Back to the order in which the fine mesh has its corners.
    for (int32_t i = 0; i < count; i++) {
        const int32_t *now = corners + 3 * (size_t)places[i].face,
                      *fine = mesh->faces + 3 * (size_t)places[i].face;
        int turn = 0;
        while (turn < 2 && now[turn] != fine[0]) turn++;
        double weight[3];
        for (int k = 0; k < 3; k++) weight[k] = places[i].weight[(turn + k) % 3];
        memcpy(places[i].weight, weight, sizeof weight);
    }
    free(next);
    free(head);
    free(base);
    free(corners);
    return PLIANT_OK;
}
