// loop.c: the limit surface of Loop subdivision as sparse rows over the control mesh.
//
// Level by level, each vertex's row is combined from rows of the level before. Rows do not grow
// with the number of steps: a point of the limit surface sees the control vertices around its
// triangle, twelve of them where all valences are 6.
#include "pliant/loop.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"
#include "pliant/refine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TURN 6.28318530717958647692

// Entries a row, on average, beyond which a mesh is refused. Regular meshes have 12.
#define MEAN_LIMIT 64

double pliant_loop_beta(int32_t valence)
{
    const double q = 3.0 / 8 + cos(TURN / valence) / 4;
    return (5.0 / 8 - q * q) / valence;
}

// With m the mean of the neighbours, a step makes of (x, m):
//   x' = (1 - n beta) x + n beta m,   m' = 3/8 x + 5/8 m
// and x_oo = a x + (1 - a) m is what it leaves alone: a = 1 / (1 + 8 n beta / 3).
double pliant_loop_chi(int32_t valence)
{
    return 1 / (valence + 3 / (8 * pliant_loop_beta(valence)));
}

// Rows of one level.
typedef struct rows {
    int32_t count;
    size_t *offset;  // [count + 1]
    pliant_loop_entry *entries;
    size_t capacity;
} rows;

// A row under construction: dense sums, and which control vertices they are nonzero at.
typedef struct accumulator {
    double (*sum)[3];   // [control vertices], zero between rows
    uint8_t *touched;   // [control vertices]
    int32_t *vertices;  // [count]
    int32_t count;
} accumulator;

// What lives during create.
typedef struct work {
    int32_t *twin;     // of the level in hand; room for the finest
    int32_t *leaving;  // [vertices of the finest level]: first side that leaves each
    accumulator sum;
    rows coarse, fine;
} work;

static void add(accumulator *a, const rows *r, int32_t row, const double weight[3])
{
    for (size_t i = r->offset[row]; i < r->offset[row + 1]; i++) {
        const pliant_loop_entry *e = &r->entries[i];
        if (!a->touched[e->vertex]) {
            a->touched[e->vertex] = 1;
            a->vertices[a->count++] = e->vertex;
        }
        for (int k = 0; k < 3; k++) a->sum[e->vertex][k] += weight[k] * e->position;
    }
}

// The accumulated row becomes the next one of `r`.
static pliant_status append(rows *r, accumulator *a, pliant_error *err)
{
    const size_t begin = r->offset[r->count], end = begin + (size_t)a->count;
    if (end > r->capacity) {
        const size_t capacity = end + end / 2;
        pliant_loop_entry *entries = realloc(r->entries, capacity * sizeof *entries);
        if (!entries)
            return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %zu weights", capacity);
        r->entries = entries;
        r->capacity = capacity;
    }
    for (int32_t i = 0; i < a->count; i++) {
        const int32_t v = a->vertices[i];
        r->entries[begin + (size_t)i] =
            (pliant_loop_entry){a->sum[v][0], a->sum[v][1], a->sum[v][2], v};
        memset(a->sum[v], 0, sizeof a->sum[v]);
        a->touched[v] = 0;
    }
    a->count = 0;
    r->offset[++r->count] = end;
    return PLIANT_OK;
}

static pliant_status begin_rows(rows *r, int32_t vertex_count, pliant_error *err)
{
    size_t *offset = realloc(r->offset, ((size_t)vertex_count + 1) * sizeof *offset);
    if (!offset)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d vertices", vertex_count);
    r->offset = offset;
    r->offset[0] = 0;
    r->count = 0;
    return PLIANT_OK;
}

static pliant_status check_length(const rows *r, int32_t vertex_count, pliant_error *err)
{
    if (r->offset[r->count] <= MEAN_LIMIT * (size_t)vertex_count) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MEMORY,
                            "Loop subdivision of %d vertices: expected at most %d weights a "
                            "vertex, found more: valences are too large",
                            vertex_count, MEAN_LIMIT);
}

static void find_leaving(work *w, int32_t face_count, const int32_t *faces)
{
    for (int32_t h = 3 * face_count - 1; h >= 0; h--) w->leaving[faces[h]] = h;
}

// The next half-edge that leaves the same vertex, counterclockwise.
static int32_t turn(const int32_t *twin, int32_t h)
{
    return twin[pliant_halfedge_previous(h)];
}

static int32_t valence_at(const work *w, int32_t vertex)
{
    int32_t count = 0, h = w->leaving[vertex];
    do {
        count++;
        h = turn(w->twin, h);
    } while (h != w->leaving[vertex]);
    return count;
}

// The rows of the next level: those of `fine` from those of `coarse`.
static pliant_status step(work *w, int32_t face_count, const int32_t *faces,
                          const int32_t *fine_faces, pliant_error *err)
{
    const int32_t even_count = w->coarse.count, odd_count = face_count / 2 * 3;
    pliant_status status = begin_rows(&w->fine, even_count + odd_count, err);
    find_leaving(w, face_count, faces);
    for (int32_t v = 0; v < even_count && status == PLIANT_OK; v++) {
        const int32_t n = valence_at(w, v);
        const double beta = pliant_loop_beta(n), centre = 1 - n * beta;
        add(&w->sum, &w->coarse, v, (const double[3]){centre, 0, 0});
        int32_t h = w->leaving[v];
        for (int32_t i = 0; i < n; i++, h = turn(w->twin, h))
            add(&w->sum, &w->coarse, faces[pliant_halfedge_next(h)], (const double[3]){beta, 0, 0});
        status = append(&w->fine, &w->sum, err);
        if (status == PLIANT_OK) status = check_length(&w->fine, even_count + odd_count, err);
    }
    if (status < 0) return status;
    // Side k of face f is divided by corner k of its middle child; one side for each odd vertex.
    int32_t *side = w->leaving + even_count;  // coarse vertices need no more of it
    for (int32_t h = 0; h < 3 * face_count; h++)
        side[fine_faces[12 * (size_t)(h / 3) + 9 + (size_t)(h % 3)] - even_count] = h;
    for (int32_t m = 0; m < odd_count && status == PLIANT_OK; m++) {
        const double end[3] = {PLIANT_LOOP_END}, corner[3] = {PLIANT_LOOP_CORNER};
        const int32_t h = side[m], t = w->twin[h];
        add(&w->sum, &w->coarse, faces[h], end);
        add(&w->sum, &w->coarse, faces[t], end);
        add(&w->sum, &w->coarse, faces[pliant_halfedge_previous(h)], corner);
        add(&w->sum, &w->coarse, faces[pliant_halfedge_previous(t)], corner);
        status = append(&w->fine, &w->sum, err);
        if (status == PLIANT_OK) status = check_length(&w->fine, even_count + odd_count, err);
    }
    return status;
}

// The limit of the last level's vertices.
static pliant_status finish(work *w, int32_t face_count, const int32_t *faces, pliant_error *err)
{
    const int32_t vertex_count = w->coarse.count;
    pliant_status status = begin_rows(&w->fine, vertex_count, err);
    find_leaving(w, face_count, faces);
    for (int32_t v = 0; v < vertex_count && status == PLIANT_OK; v++) {
        const int32_t n = valence_at(w, v);
        const double chi = pliant_loop_chi(n), centre = 1 - n * chi;
        add(&w->sum, &w->coarse, v, (const double[3]){centre, 0, 0});
        int32_t h = w->leaving[v];
        for (int32_t i = 0; i < n; i++, h = turn(w->twin, h)) {
            const double angle = TURN * i / n;
            add(&w->sum, &w->coarse, faces[pliant_halfedge_next(h)],
                (const double[3]){chi, cos(angle), sin(angle)});
        }
        status = append(&w->fine, &w->sum, err);
        if (status == PLIANT_OK) status = check_length(&w->fine, vertex_count, err);
    }
    return status;
}

static void swap(work *w)
{
    const rows fine = w->fine;
    w->fine = w->coarse;
    w->coarse = fine;
}

static pliant_status reserve(work *w, int32_t step_count, int32_t vertex_count, int32_t face_count,
                             pliant_error *err)
{
    int64_t faces = face_count, vertices = vertex_count;
    for (int32_t l = 0; l < step_count && faces <= PLIANT_HALFEDGE_FACE_LIMIT; l++) {
        vertices += faces / 2 * 3;
        faces *= 4;
    }
    if (faces > PLIANT_HALFEDGE_FACE_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%d Loop steps of %d faces: expected at most %d faces, found %lld",
                                step_count, face_count, PLIANT_HALFEDGE_FACE_LIMIT,
                                (long long)faces);
    w->twin = malloc(3 * (size_t)faces * sizeof *w->twin);
    w->leaving = malloc((size_t)vertices * sizeof *w->leaving);
    w->sum.sum = calloc((size_t)vertex_count, sizeof *w->sum.sum);
    w->sum.touched = calloc((size_t)vertex_count, 1);
    w->sum.vertices = malloc((size_t)vertex_count * sizeof *w->sum.vertices);
    if (w->twin && w->leaving && w->sum.sum && w->sum.touched && w->sum.vertices) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %lld vertices",
                            (long long)vertices);
}

// The control mesh's rows: every vertex is itself.
static pliant_status start(work *w, int32_t vertex_count, pliant_error *err)
{
    pliant_status status = begin_rows(&w->coarse, vertex_count, err);
    for (int32_t v = 0; v < vertex_count && status == PLIANT_OK; v++) {
        w->sum.vertices[w->sum.count++] = v;
        w->sum.sum[v][0] = 1;
        status = append(&w->coarse, &w->sum, err);
    }
    return status;
}

pliant_status pliant_loop_limit_create(int32_t step_count, int32_t vertex_count, int32_t face_count,
                                       const int32_t *const *faces, pliant_loop_limit **limit,
                                       pliant_error *err)
{
    work w = {0};
    pliant_loop_limit *made = calloc(1, sizeof *made);
    pliant_status status = PLIANT_OK;
    if (!made) status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a limit surface");
    if (status == PLIANT_OK) status = reserve(&w, step_count, vertex_count, face_count, err);
    if (status == PLIANT_OK)
        status = pliant_halfedge_match(vertex_count, face_count, faces[0], w.twin, err);
    if (status == PLIANT_OK) status = start(&w, vertex_count, err);
    int32_t level = 0;
    for (; level < step_count && status == PLIANT_OK; level++) {
        status = step(&w, face_count, faces[level], faces[level + 1], err);
        pliant_refine_twins(face_count, w.twin);
        face_count *= 4;
        swap(&w);
    }
    if (status == PLIANT_OK) status = finish(&w, face_count, faces[level], err);
    if (status == PLIANT_OK) {
        *made = (pliant_loop_limit){w.fine.count, w.fine.offset, w.fine.entries};
        w.fine = (rows){0};
        *limit = made;
        made = NULL;
    }
    free(made);
    free(w.fine.entries);
    free(w.fine.offset);
    free(w.coarse.entries);
    free(w.coarse.offset);
    free(w.sum.vertices);
    free(w.sum.touched);
    free(w.sum.sum);
    free(w.leaving);
    free(w.twin);
    return status;
}

void pliant_loop_limit_destroy(pliant_loop_limit *limit)
{
    if (!limit) return;
    free(limit->entries);
    free(limit->offset);
    free(limit);
}

void pliant_loop_limit_evaluate(const pliant_loop_limit *limit, int32_t row, const double *vertices,
                                double point[9])
{
    memset(point, 0, 9 * sizeof *point);
    for (size_t i = limit->offset[row]; i < limit->offset[row + 1]; i++) {
        const pliant_loop_entry *e = &limit->entries[i];
        const double *x = vertices + 3 * (size_t)e->vertex;
        for (int c = 0; c < 3; c++) {
            point[c] += e->position * x[c];
            point[3 + c] += e->along * x[c];
            point[6 + c] += e->across * x[c];
        }
    }
}

static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

// a / |a|, whose square need not be a double; 0 of 0. Returns the length.
static double normalise(const double *a, double *unit)
{
    const double largest = fmax(fabs(a[0]), fmax(fabs(a[1]), fabs(a[2])));
    unit[0] = unit[1] = unit[2] = 0;
    if (largest == 0) return 0;
    const double x = a[0] / largest, y = a[1] / largest, z = a[2] / largest;
    const double length = sqrt(x * x + y * y + z * z);
    unit[0] = x / length, unit[1] = y / length, unit[2] = z / length;
    return largest * length;
}

double pliant_loop_frame(const double *along, const double *across, double frame[9])
{
    // Units first, so that the length of the normal is the sine.
    double other[3], normal[3];
    (void)normalise(along, frame);
    (void)normalise(across, other);
    cross(frame, other, normal);
    const double sine = normalise(normal, frame + 6);
    cross(frame + 6, frame, frame + 3);
    return sine;
}
