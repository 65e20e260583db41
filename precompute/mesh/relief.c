// relief.c: the finest levels of a mesh as geometric detail over a coarser control mesh.
#include "mesh/relief.h"

#include "pliant/error.h"
#include "pliant/loop.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// The levels being split off; [0] is the control mesh.
typedef struct split {
    const pliant_multires *from;
    int32_t control_level, step_count;
    int32_t face_count[PLIANT_LEVEL_LIMIT + 1];
    int32_t *faces[PLIANT_LEVEL_LIMIT + 1];  // renumbered
    int32_t *number;                         // [N]: new number of each vertex
} split;

static pliant_status reserve(split *s, pliant_error *err)
{
    const pliant_multires *m = s->from;
    int failed = 0;
    for (int32_t d = s->step_count, count = m->mesh->face_count; d >= 0; d--, count /= 4) {
        s->face_count[d] = count;
        s->faces[d] = malloc(3 * (size_t)count * sizeof **s->faces);
        failed |= !s->faces[d];
    }
    s->number = malloc((size_t)m->mesh->vertex_count * sizeof *s->number);
    if (!failed && s->number) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the detail of %d faces",
                            m->mesh->face_count);
}

static void release(split *s)
{
    free(s->number);
    for (int32_t d = 0; d <= s->step_count; d++) free(s->faces[d]);
}

// The faces of all levels from the finest, and the numbers that odd vertices get as they first
// appear on the sides of the faces in order: corner k of a middle child divides side k.
static void number_levels(split *s)
{
    const int32_t n = s->from->mesh->vertex_count, d_last = s->step_count;
    memcpy(s->faces[d_last], s->from->mesh->faces,
           3 * (size_t)s->face_count[d_last] * sizeof(int32_t));
    for (int32_t d = d_last - 1; d >= 0; d--)
        for (int32_t f = 0; f < s->face_count[d]; f++)
            for (int32_t k = 0; k < 3; k++)
                s->faces[d][3 * (size_t)f + (size_t)k] =
                    s->faces[d + 1][12 * (size_t)f + 3 * (size_t)k];
    const int32_t control_count = s->from->vertex_count[s->control_level];
    int32_t next = control_count;
    for (int32_t v = 0; v < n; v++) s->number[v] = v < control_count ? v : -1;
    for (int32_t d = 0; d < d_last; d++)
        for (int32_t h = 0; h < 3 * s->face_count[d]; h++) {
            const int32_t m = s->faces[d + 1][12 * (size_t)(h / 3) + 9 + (size_t)(h % 3)];
            if (s->number[m] < 0) s->number[m] = next++;
        }
    for (int32_t d = 0; d <= d_last; d++)
        for (size_t i = 0; i < 3 * (size_t)s->face_count[d]; i++)
            s->faces[d][i] = s->number[s->faces[d][i]];
}

// offset = F^T (x - S), F the frame at the limit point S.
static pliant_status measure(const split *s, const pliant_loop_limit *limit, pliant_relief *r,
                             pliant_error *err)
{
    const double *vertices = s->from->mesh->vertices;
    const int32_t n = s->from->mesh->vertex_count;
    double sum = 0, tangential_sum = 0;
    r->size.least_sine = 1;
    for (int32_t v = 0; v < n; v++) {
        const int32_t row = s->number[v];
        const double *x = vertices + 3 * (size_t)v;
        double point[9], frame[9], offset[3] = {0};
        pliant_loop_limit_evaluate(limit, row, vertices, point);
        const double sine = pliant_loop_frame(point + 3, point + 6, frame);
        if (!(sine >= PLIANT_LOOP_LEAST_SINE))
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%d levels of detail: the subdivision surface has no normal at "
                                    "(%g, %g, %g): its tangents are %.1e apart, expected %.0e: "
                                    "keep more levels elastic",
                                    s->step_count, x[0], x[1], x[2], sine, PLIANT_LOOP_LEAST_SINE);
        r->size.least_sine = fmin(r->size.least_sine, sine);
        for (int a = 0; a < 3; a++) {
            for (int c = 0; c < 3; c++) offset[a] += frame[3 * a + c] * (x[c] - point[c]);
            r->offset[3 * (size_t)row + (size_t)a] = (float)offset[a];
        }
        const double tangential = offset[0] * offset[0] + offset[1] * offset[1];
        const double square = tangential + offset[2] * offset[2];
        sum += square;
        tangential_sum += tangential;
        r->size.largest = fmax(r->size.largest, sqrt(square));
        r->size.tangential_largest = fmax(r->size.tangential_largest, sqrt(tangential));
    }
    r->size.rms = sqrt(sum / n);
    r->size.tangential_rms = sqrt(tangential_sum / n);
    return PLIANT_OK;
}

static pliant_status make_relief(const split *s, pliant_relief **relief, pliant_error *err)
{
    const pliant_multires *m = s->from;
    const size_t n = (size_t)m->mesh->vertex_count;
    pliant_loop_limit *limit = NULL;
    pliant_relief *r = calloc(1, sizeof *r);
    if (r) {
        r->offset = malloc(3 * n * sizeof *r->offset);
        r->source_index = malloc(n * sizeof *r->source_index);
    }
    pliant_status status = PLIANT_OK;
    if (!r || !r->offset || !r->source_index) {
        status =
            pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the detail of %zu vertices", n);
        goto done;
    }
    r->step_count = s->step_count;
    for (int32_t d = 0; d <= s->step_count; d++)
        r->vertex_count[d] = m->vertex_count[s->control_level + d];
    for (size_t v = 0; v < n; v++) r->source_index[s->number[v]] = m->source_index[v];
    status = pliant_loop_limit_create(s->step_count, r->vertex_count[0], s->face_count[0],
                                      (const int32_t *const *)s->faces, &limit, err);
    if (status == PLIANT_OK) status = measure(s, limit, r, err);
    if (status < 0) goto done;
    *relief = r;
    r = NULL;
done:
    pliant_loop_limit_destroy(limit);
    pliant_relief_destroy(r);
    return status;
}

// The levels up to the control mesh as a mesh of their own.
static pliant_status cut(const split *s, pliant_multires **control, pliant_error *err)
{
    const pliant_multires *m = s->from;
    const int32_t n = m->vertex_count[s->control_level], base = m->vertex_count[0];
    pliant_multires *c = NULL;
    const pliant_status status = pliant_multires_create(
        base, s->face_count[0] >> 2 * s->control_level, s->control_level + 1, &c, err);
    if (status < 0) return status;
    memcpy(c->mesh->vertices, m->mesh->vertices, 3 * (size_t)n * sizeof(double));
    memcpy(c->mesh->faces, s->faces[0], 3 * (size_t)s->face_count[0] * sizeof(int32_t));
    memcpy(c->parents, m->parents, 2 * (size_t)(n - base) * sizeof(int32_t));
    memcpy(c->source_index, m->source_index, (size_t)n * sizeof(int32_t));
    c->note = m->note;
    *control = c;
    return PLIANT_OK;
}

pliant_status pliant_relief_split(pliant_multires **multires, int32_t step_count,
                                  pliant_relief **relief, pliant_error *err)
{
    const int32_t finest = (*multires)->level_count - 1;
    if (step_count < 1 || step_count > finest)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "levels of detail: expected 1 to %d, the levels above the base, found %d", finest,
            step_count);
    split s = {.from = *multires, .control_level = finest - step_count, .step_count = step_count};
    pliant_multires *control = NULL;
    pliant_status status = reserve(&s, err);
    if (status == PLIANT_OK) {
        number_levels(&s);
        status = cut(&s, &control, err);
    }
    if (status == PLIANT_OK) status = make_relief(&s, relief, err);
    if (status == PLIANT_OK) {
        pliant_multires_destroy(*multires);
        *multires = control;
        control = NULL;
    }
    pliant_multires_destroy(control);
    release(&s);
    return status;
}

void pliant_relief_destroy(pliant_relief *relief)
{
    if (!relief) return;
    free(relief->source_index);
    free(relief->offset);
    free(relief);
}
