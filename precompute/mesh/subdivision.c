// subdivision.c: refine a closed triangle mesh by Loop, butterfly or midpoint steps.
//
// This follows: C. Loop, Smooth subdivision surfaces based on triangles, master's thesis,
// University of Utah, 1987; D. Zorin, P. Schroeder, W. Sweldens, Interpolating subdivision for
// meshes with arbitrary topology, SIGGRAPH 1996 (tension w = 0: the 8-point stencil where both ends
// are regular). We weigh a butterfly ring through its first two Fourier modes, so that a vertex of
// any valence costs time linear in it.
#include "mesh/multires.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"
#include "pliant/loop.h"
#include "pliant/refine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TURN 6.28318530717958647692

// One level being refined in place: the mesh's arrays have room for the finest.
typedef struct step {
    int32_t vertex_count, face_count;  // of this level
    double *vertices;
    int32_t *faces;
    int32_t *parents;  // rows of the odd vertices that this step adds
    int32_t *twin;     // [face_count][3]
    int32_t *odd;      // [face_count][3]: the odd vertex on each half-edge
    double *sum;       // [vertex_count][3]: scratch of the even rule
    int32_t *count;    // valence of each vertex, or rings that reached each odd vertex
} step;

// ---- Positions ----

static const double *at(const step *s, int32_t vertex)
{
    return s->vertices + 3 * (size_t)vertex;
}

static void add(double *x, double weight, const double *y)
{
    for (int c = 0; c < 3; c++) x[c] += weight * y[c];
}

// The corner opposite to half-edge h in its own triangle.
static const double *opposite(const step *s, int32_t h)
{
    return at(s, s->faces[pliant_halfedge_previous(h)]);
}

// The odd vertex of h = the ends and opposite corners of its edge with these weights.
static void place_odd(step *s, int32_t h, double end, double corner)
{
    double *x = s->vertices + 3 * (size_t)s->odd[h];
    memset(x, 0, 3 * sizeof *x);
    add(x, end, at(s, s->faces[h]));
    add(x, end, at(s, s->faces[s->twin[h]]));
    if (corner == 0) return;
    add(x, corner, opposite(s, h));
    add(x, corner, opposite(s, s->twin[h]));
}

static void place_midpoints(step *s)
{
    for (int32_t h = 0; h < 3 * s->face_count; h++)
        if (h < s->twin[h]) place_odd(s, h, 0.5, 0);
}

// Valences and, where asked for, the sums of the neighbours.
static void visit_neighbours(step *s, double *sum)
{
    memset(s->count, 0, (size_t)s->vertex_count * sizeof *s->count);
    if (sum) memset(sum, 0, (size_t)s->vertex_count * 3 * sizeof *sum);
    for (int32_t h = 0; h < 3 * s->face_count; h++) {
        s->count[s->faces[h]]++;
        if (sum) add(sum + 3 * (size_t)s->faces[h], 1, at(s, s->faces[pliant_halfedge_next(h)]));
    }
}

static void place_loop(step *s)
{
    for (int32_t h = 0; h < 3 * s->face_count; h++)
        if (h < s->twin[h]) place_odd(s, h, PLIANT_LOOP_END, PLIANT_LOOP_CORNER);
    visit_neighbours(s, s->sum);
    for (int32_t v = 0; v < s->vertex_count; v++) {
        const double beta = pliant_loop_beta(s->count[v]), centre = 1 - s->count[v] * beta;
        double *x = s->vertices + 3 * (size_t)v;
        for (int c = 0; c < 3; c++) x[c] = centre * x[c] + beta * s->sum[3 * (size_t)v + c];
    }
}

// The next half-edge that leaves the same vertex, counterclockwise.
static int32_t turn(const step *s, int32_t h)
{
    return s->twin[pliant_halfedge_previous(h)];
}

// The ring of an extraordinary vertex of valence 3 or 4: weights of neighbours 0, 1, 2, (3) counted
// from the edge's other end.
static void add_small_ring(step *s, int32_t first, int32_t valence)
{
    static const double weights[2][4] = {{5.0 / 12, -1.0 / 12, -1.0 / 12, 0},
                                         {3.0 / 8, 0, -1.0 / 8, 0}};
    int32_t h = first;
    for (int32_t i = 0; i < valence; i++, h = turn(s, h)) {
        double *x = s->vertices + 3 * (size_t)s->odd[h];
        add(x, 0.75, at(s, s->faces[h]));
        for (int32_t j = 0, g = h; j < valence; j++, g = turn(s, g))
            add(x, weights[valence - 3][j], at(s, s->faces[s->twin[g]]));
    }
}

// The ring of an extraordinary vertex of valence K >= 5: 3/4 of the vertex and, of neighbour j
// counted from the edge's other end i,
//   s_(j-i) = (1/4 + cos(t (j-i)) + cos(2 t (j-i)) / 2) / K,  t = 2 pi / K.
// The cosines of differences split into sums that all edges share.
static void add_ring(step *s, int32_t first, int32_t valence)
{
    double mode[5][3] = {{0}};  // neighbours times 1, cos t j, sin t j, cos 2 t j, sin 2 t j
    int32_t h = first;
    for (int32_t j = 0; j < valence; j++, h = turn(s, h)) {
        const double *x = at(s, s->faces[s->twin[h]]), t = TURN * j / valence;
        const double basis[5] = {1, cos(t), sin(t), cos(2 * t), sin(2 * t)};
        for (int k = 0; k < 5; k++) add(mode[k], basis[k], x);
    }
    for (int32_t i = 0; i < valence; i++, h = turn(s, h)) {
        double *x = s->vertices + 3 * (size_t)s->odd[h];
        const double t = TURN * i / valence;
        const double basis[5] = {0.25, cos(t), sin(t), cos(2 * t) / 2, sin(2 * t) / 2};
        add(x, 0.75, at(s, s->faces[h]));
        for (int k = 0; k < 5; k++) add(x, basis[k] / valence, mode[k]);
    }
}

// 1/2 of the ends, 1/8 of the opposite corners, -1/16 of the wings.
static void place_regular(step *s, int32_t h)
{
    place_odd(s, h, 0.5, 0.125);
    double *x = s->vertices + 3 * (size_t)s->odd[h];
    for (int side = 0; side < 2; side++, h = s->twin[h]) {
        add(x, -0.0625, opposite(s, s->twin[pliant_halfedge_next(h)]));
        add(x, -0.0625, opposite(s, s->twin[pliant_halfedge_previous(h)]));
    }
}

// Regular ends (valence 6) count only when both are; an edge between two extraordinary vertices
// takes the mean of what both rings say.
static void place_butterfly(step *s)
{
    visit_neighbours(s, NULL);
    for (int32_t h = 0; h < 3 * s->face_count; h++) {
        if (h > s->twin[h]) continue;
        if (s->count[s->faces[h]] == 6 && s->count[s->faces[s->twin[h]]] == 6) place_regular(s, h);
        else memset(s->vertices + 3 * (size_t)s->odd[h], 0, 3 * sizeof(double));
    }
    for (int32_t h = 0; h < 3 * s->face_count; h++) {
        // Each vertex once, from the first of its half-edges: its valence then turns negative.
        const int32_t v = s->faces[h], valence = s->count[v];
        if (valence < 0 || valence == 6) continue;
        (valence < 5 ? add_small_ring : add_ring)(s, h, valence);
        s->count[v] = -valence;
    }
    for (int32_t h = 0; h < 3 * s->face_count; h++) {
        if (h > s->twin[h] || s->count[s->faces[h]] > 0 || s->count[s->faces[s->twin[h]]] > 0)
            continue;
        double *x = s->vertices + 3 * (size_t)s->odd[h];
        for (int c = 0; c < 3; c++) x[c] /= 2;
    }
}

// ---- The whole ----

static void refine(step *s, pliant_subdivision_scheme scheme)
{
    pliant_refine_number(s->vertex_count, s->face_count, s->faces, s->twin, s->odd, s->parents);
    switch (scheme) {
    case PLIANT_SUBDIVIDE_LOOP:
        place_loop(s);
        break;
    case PLIANT_SUBDIVIDE_BUTTERFLY:
        place_butterfly(s);
        break;
    case PLIANT_SUBDIVIDE_MIDPOINT:
        place_midpoints(s);
        break;
    }
    pliant_refine_faces(s->face_count, s->odd, s->faces);
    s->parents += s->face_count / 2 * 3 * (size_t)2;
    s->vertex_count += s->face_count / 2 * 3;
}

static pliant_status match_base(const pliant_mesh *base, int32_t **twin, pliant_error *err)
{
    pliant_error detail = {{0}};
    *twin = malloc(3 * (size_t)(base->face_count > 0 ? base->face_count : 1) * sizeof **twin);
    if (!*twin)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d faces", base->face_count);
    pliant_status status =
        pliant_halfedge_match(base->vertex_count, base->face_count, base->faces, *twin, &detail);
    if (status < 0) return pliant_error_set(err, status, "base mesh: %.480s", detail.text);
    return PLIANT_OK;
}

pliant_status pliant_multires_subdivide(const pliant_mesh *base, int32_t levels,
                                        pliant_subdivision_scheme scheme,
                                        pliant_multires **multires, pliant_error *err)
{
    int32_t *twin = NULL, *fine_twin = NULL, *odd = NULL, *count = NULL;
    double *sum = NULL;
    pliant_multires *m = NULL;
    if (levels < 0 || levels > PLIANT_LEVEL_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "levels to subdivide: expected 0..%d, found %d", PLIANT_LEVEL_LIMIT,
                                levels);
    if (scheme < PLIANT_SUBDIVIDE_LOOP || scheme > PLIANT_SUBDIVIDE_MIDPOINT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "subdivision scheme: expected 0..2, found %d", (int)scheme);
    pliant_status status = match_base(base, &twin, err);
    if (status < 0) goto done;
    status = pliant_multires_create(base->vertex_count, base->face_count, levels + 1, &m, err);
    if (status < 0) goto done;

    memcpy(m->mesh->vertices, base->vertices, (size_t)base->vertex_count * 3 * sizeof(double));
    memcpy(m->mesh->faces, base->faces, (size_t)base->face_count * 3 * sizeof(int32_t));
    for (int32_t v = 0; v < m->mesh->vertex_count; v++)
        m->source_index[v] = v < base->vertex_count ? v : -1;
    if (levels > 0) {
        // Scratch for the last but one level, the finest that is refined.
        const size_t side_count = 3 * (size_t)(m->mesh->face_count / 4);
        const size_t vertex_count = (size_t)m->vertex_count[levels - 1];
        fine_twin = realloc(twin, side_count * sizeof *twin);
        if (fine_twin) twin = fine_twin;
        odd = malloc(side_count * sizeof *odd);
        count = malloc(vertex_count * sizeof *count);
        sum = malloc(vertex_count * 3 * sizeof *sum);
        if (!fine_twin || !odd || !count || !sum) {
            status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to subdivide to %d faces",
                                      m->mesh->face_count);
            goto done;
        }
        step s = {.vertex_count = base->vertex_count,
                  .face_count = base->face_count,
                  .vertices = m->mesh->vertices,
                  .faces = m->mesh->faces,
                  .parents = m->parents,
                  .twin = twin,
                  .odd = odd,
                  .sum = sum,
                  .count = count};
        for (int32_t l = 0; l < levels; l++, s.face_count *= 4) {
            refine(&s, scheme);
            if (l + 1 < levels) pliant_refine_twins(s.face_count, s.twin);
        }
    }
    *multires = m;
    m = NULL;
done:
    pliant_multires_destroy(m);
    free(sum);
    free(count);
    free(odd);
    free(twin);
    return status;
}
