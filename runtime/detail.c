// detail.c: make a detail: topology, limit surface and shape at rest, from a model's file.
//
// This follows: A. Lee, H. Moreton, H. Hoppe, Displaced subdivision surfaces, SIGGRAPH 2000, and GF
// 9.2. We keep a vector in the local frame where they keep a number along the normal, and sum the
// limit surface from sparse rows where they subdivide: a dozen control vertices a point, whatever
// the depth, each point on its own.
#include "detail.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"
#include "pliant/loop.h"
#include "pliant/refine.h"
#include "model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// What lives during create.
typedef struct plan {
    const pliant_model *model;
    int32_t level, finest, steps;
    // Triangles by level, of the model and then of the detail; [level .. finest + steps].
    const int32_t *faces[PLIANT_LEVEL_LIMIT + 1];
    int32_t *made[PLIANT_LEVEL_LIMIT + 1];  // those of them that are owned
    int32_t face_count;                     // of the last
    int32_t *twin;                          // of the last
    double *shape;                          // rest positions, shape [N][3]
    double *offset;                         // in the frames over `level`, shape [N][3]
    pliant_loop_limit *limit;               // over `level`
} plan;

static void release(plan *p)
{
    pliant_loop_limit_destroy(p->limit);
    free(p->offset);
    free(p->shape);
    free(p->twin);
    for (int32_t l = 0; l <= PLIANT_LEVEL_LIMIT; l++) free(p->made[l]);
}

static pliant_status no_memory(const plan *p, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a detail of %d vertices",
                            p->model->view.detail_vertex_count);
}

// The triangles of the detail's levels, from those of the model's finest.
static pliant_status refine(plan *p, pliant_error *err)
{
    const pliant_hierarchy *h = p->model->hierarchy;
    for (int32_t l = 0; l <= p->finest; l++) p->faces[l] = h->faces[l];
    p->face_count = h->face_count[p->finest];
    const size_t side_count = 3 * ((size_t)p->face_count << 2 * p->steps);
    p->twin = malloc(side_count * sizeof *p->twin);
    int32_t *odd = malloc(side_count / 4 * sizeof *odd);
    pliant_status status = p->twin && odd ? PLIANT_OK : no_memory(p, err);
    int32_t vertex_count = h->vertex_count[p->finest];
    if (status == PLIANT_OK)
        status =
            pliant_halfedge_match(vertex_count, p->face_count, p->faces[p->finest], p->twin, err);
    for (int32_t l = p->finest; l < p->finest + p->steps && status == PLIANT_OK; l++) {
        const size_t corner_count = 3 * (size_t)p->face_count;
        int32_t *faces = malloc(4 * corner_count * sizeof *faces);
        p->faces[l + 1] = p->made[l + 1] = faces;
        if (!faces) {
            status = no_memory(p, err);
            break;
        }
        memcpy(faces, p->faces[l], corner_count * sizeof *faces);
        pliant_refine_number(vertex_count, p->face_count, faces, p->twin, odd, NULL);
        pliant_refine_faces(p->face_count, odd, faces);
        pliant_refine_twins(p->face_count, p->twin);
        vertex_count += p->face_count / 2 * 3;
        p->face_count *= 4;
    }
    free(odd);
    return status;
}

static pliant_status limit_over(const plan *p, int32_t level, pliant_loop_limit **limit,
                                pliant_error *err)
{
    const pliant_hierarchy *h = p->model->hierarchy;
    return pliant_loop_limit_create(p->finest - level + p->steps, h->vertex_count[level],
                                    h->face_count[level], p->faces + level, limit, err);
}

// Point and frame of the limit surface at rest.
static pliant_status stand(const plan *p, const pliant_loop_limit *limit, int32_t level,
                           int32_t vertex, double point[9], double frame[9], pliant_error *err)
{
    pliant_loop_limit_evaluate(limit, vertex, p->model->view.vertices, point);
    const double sine = pliant_loop_frame(point + 3, point + 6, frame);
    if (sine >= PLIANT_LOOP_LEAST_SINE) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "/detail: vertex %d: expected tangents of the surface over level %d at "
                            "least %.0e apart, found %.1e",
                            vertex, level, PLIANT_LOOP_LEAST_SINE, sine);
}

// The detailed shape at rest, from the offsets over the finest level.
static pliant_status restore(plan *p, const pliant_loop_limit *limit, pliant_error *err)
{
    const float *offset = p->model->view.detail_offset;
    for (int32_t v = 0; v < limit->vertex_count; v++) {
        double point[9], frame[9];
        const pliant_status status = stand(p, limit, p->finest, v, point, frame, err);
        if (status < 0) return status;
        for (int c = 0; c < 3; c++) {
            double x = point[c];
            for (int a = 0; a < 3; a++)
                x += frame[3 * a + c] * (double)offset[3 * (size_t)v + (size_t)a];
            if (!(fabs(x) < 1e30))
                return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                        "/detail: vertex %d: expected a position within 1e30, "
                                        "found %g",
                                        v, x);
            p->shape[3 * (size_t)v + (size_t)c] = x;
        }
    }
    return PLIANT_OK;
}

// The offsets over the level that is asked for.
static pliant_status measure(plan *p, pliant_error *err)
{
    for (int32_t v = 0; v < p->limit->vertex_count; v++) {
        double point[9], frame[9];
        const pliant_status status = stand(p, p->limit, p->level, v, point, frame, err);
        if (status < 0) return status;
        for (int a = 0; a < 3; a++) {
            double sum = 0;
            for (int c = 0; c < 3; c++)
                sum += frame[3 * a + c] * (p->shape[3 * (size_t)v + (size_t)c] - point[c]);
            p->offset[3 * (size_t)v + (size_t)a] = sum;
        }
    }
    return PLIANT_OK;
}

static pliant_status make_plan(plan *p, pliant_error *err)
{
    const size_t n = (size_t)p->model->view.detail_vertex_count;
    pliant_status status = refine(p, err);
    if (status < 0) return status;
    p->shape = malloc(3 * n * sizeof *p->shape);
    p->offset = malloc(3 * n * sizeof *p->offset);
    if (!p->shape || !p->offset) return no_memory(p, err);
    pliant_loop_limit *finest = NULL;
    status = limit_over(p, p->finest, &finest, err);
    if (status == PLIANT_OK) status = restore(p, finest, err);
    if (p->level == p->finest) {
        p->limit = finest;
    } else {
        pliant_loop_limit_destroy(finest);
        if (status == PLIANT_OK) status = limit_over(p, p->level, &p->limit, err);
    }
    if (status == PLIANT_OK) status = measure(p, err);
    return status;
}

static void lay_out(pliant_arena *arena, pliant_detail *d, size_t entry_count)
{
    const size_t n = (size_t)d->info.vertex_count, corners = 3 * (size_t)d->info.face_count;
    PLIANT_TAKE(arena, d->offset, n + 1);
    PLIANT_TAKE(arena, d->column, entry_count);
    PLIANT_TAKE(arena, d->weight, 3 * entry_count + 1);
    PLIANT_TAKE(arena, d->rest, 12 * n);
    PLIANT_TAKE(arena, d->faces, corners);
    PLIANT_TAKE(arena, d->ring_offset, n + 1);
    PLIANT_TAKE(arena, d->ring, corners);
}

static double length_of(const double *x)
{
    return hypot(hypot(x[0], x[1]), x[2]);
}

static void copy_rows(pliant_detail *d, const plan *p)
{
    const pliant_loop_limit *limit = p->limit;
    for (int32_t v = 0; v < limit->vertex_count; v++) {
        double point[9];
        pliant_loop_limit_evaluate(limit, v, p->model->view.vertices, point);
        const double along = length_of(point + 3), across = length_of(point + 6);
        for (size_t i = limit->offset[v]; i < limit->offset[v + 1]; i++) {
            const pliant_loop_entry *e = &limit->entries[i];
            d->column[i] = e->vertex;
            d->weight[3 * i] = (float)e->position;
            d->weight[3 * i + 1] = (float)(e->along / along);
            d->weight[3 * i + 2] = (float)(e->across / across);
        }
        d->offset[v + 1] = limit->offset[v + 1];
        for (size_t c = 0; c < 3; c++) {
            float *rest = d->rest + 12 * (size_t)v + 4 * c;
            rest[0] = (float)point[c];
            rest[1] = (float)(point[3 + c] / along);
            rest[2] = (float)(point[6 + c] / across);
            rest[3] = (float)p->offset[3 * (size_t)v + c];
        }
    }
}

static void copy_rings(pliant_detail *d, const int32_t *twin)
{
    const int32_t side_count = 3 * d->info.face_count;
    // A vertex has as many neighbours as sides leave it; its place in `ring_offset` first holds one
    // of these.
    int32_t *leaving = d->ring_offset;
    for (int32_t h = side_count - 1; h >= 0; h--) leaving[d->faces[h]] = h;
    int32_t at = 0;
    for (int32_t v = 0; v < d->info.vertex_count; v++) {
        const int32_t first = leaving[v];
        int32_t h = first;
        d->ring_offset[v] = at;
        do {
            d->ring[at++] = d->faces[pliant_halfedge_next(h)];
            h = twin[pliant_halfedge_previous(h)];
        } while (h != first);
    }
    d->ring_offset[d->info.vertex_count] = at;
}

// The root mean square of the edges.
static double typical_edge(const pliant_detail *d, const double *shape)
{
    double sum = 0;
    const int32_t side_count = 3 * d->info.face_count;
    for (int32_t h = 0; h < side_count; h++) {
        const double *a = shape + 3 * (size_t)d->faces[h];
        const double *b = shape + 3 * (size_t)d->faces[pliant_halfedge_next(h)];
        for (int c = 0; c < 3; c++) sum += (a[c] - b[c]) * (a[c] - b[c]);
    }
    return sqrt(sum / side_count);
}

static pliant_status build(const plan *p, pliant_detail **detail, pliant_error *err)
{
    const pliant_model_view *view = &p->model->view;
    pliant_detail *d = calloc(1, sizeof *d);
    if (!d) return no_memory(p, err);
    d->info = (pliant_detail_info){.level = p->level,
                                   .control_count = p->model->hierarchy->vertex_count[p->level],
                                   .vertex_count = view->detail_vertex_count,
                                   .face_count = p->face_count};
    d->source_index = view->detail_source_index;
    const size_t entry_count = p->limit->offset[p->limit->vertex_count];
    lay_out(&d->arena, d, entry_count);
    const pliant_status status = pliant_arena_reserve(&d->arena, err);
    if (status < 0) {
        free(d);
        return status;
    }
    lay_out(&d->arena, d, entry_count);
    memcpy(d->faces, p->faces[p->finest + p->steps], 3 * (size_t)p->face_count * sizeof *d->faces);
    copy_rows(d, p);
    copy_rings(d, p->twin);
    const double edge = typical_edge(d, p->shape);
    d->inverse_length = edge > 1e-30 ? (float)(1 / edge) : 1;
    *detail = d;
    return PLIANT_OK;
}

pliant_status pliant_detail_create(const pliant_model *model, int32_t level, pliant_detail **detail,
                                   pliant_error *err)
{
    if (!model || !detail)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_detail_create: expected a model and a place, found NULL");
    const char *name = pliant_reader_name(model->reader);
    plan p = {.model = model,
              .level = level,
              .finest = model->finest_level,
              .steps = model->view.detail_steps};
    if (p.steps == 0)
        return pliant_error_set(err, PLIANT_ERR_MISSING,
                                "%s: /detail: expected geometric detail (pliant-precompute "
                                "--detail), found none",
                                name);
    if (level < 0 || level > p.finest)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: control level of the detail: expected 0 to %d, found %d", name,
                                p.finest, level);
    pliant_error reason = {""};
    pliant_status status = make_plan(&p, &reason);
    if (status == PLIANT_OK) status = build(&p, detail, &reason);
    release(&p);
    if (status < 0) return pliant_error_set(err, status, "%.200s: %.280s", name, reason.text);
    return PLIANT_OK;
}

void pliant_detail_destroy(pliant_detail *detail)
{
    if (!detail) return;
    pliant_arena_release(&detail->arena);
    free(detail);
}

pliant_detail_info pliant_detail_describe(const pliant_detail *detail)
{
    return detail->info;
}

const int32_t *pliant_detail_faces(const pliant_detail *detail)
{
    return detail->faces;
}

const int32_t *pliant_detail_source_index(const pliant_detail *detail)
{
    return detail->source_index;
}
