// wavelet.c: lifted second-generation wavelets on one domain of a multiresolution surface.
//
// This follows: W. Sweldens, The lifting scheme: a construction of second generation wavelets, SIAM
// J. Math. Anal. 29(2), 1998; P. Schroeder and W. Sweldens, Spherical wavelets, SIGGRAPH 1995;
// N. Dyn, D. Levin, J. Gregory, A butterfly subdivision scheme, ACM TOG 9(2), 1990 (weights with
// w = 1/16, the same at every valence). We differ at the domain's border: see plan_prediction.
#include "pliant/wavelet.h"

#include "pliant/error.h"
#include "pliant/vector_clones.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Below this sum of the weights that are left, a butterfly stencil cut by the border would be
// renormalised into one with large weights of both signs: the parents alone predict better.
static const double least_butterfly_weight = 0.5;

static const double butterfly_weights[PLIANT_STENCIL_LIMIT] = {
    1.0 / 2, 1.0 / 2, 1.0 / 8, 1.0 / 8, -1.0 / 16, -1.0 / 16, -1.0 / 16, -1.0 / 16};

pliant_wavelet_def pliant_wavelet_default(void)
{
    return (pliant_wavelet_def){PLIANT_BUTTERFLY, PLIANT_LIFTED, PLIANT_ZERO};
}

// ---- Plan ----

// The arrays of a plan, while they are still writable.
typedef struct plan_arrays {
    int32_t *predict_node;
    double *predict_weight;
    float *predict_weight_f;
    int32_t *update_node;
    double *update_weight;
    int32_t *update_offset;
    int32_t *update_odd;
    float *update_odd_weight;
    pliant_wavelet_triple *triples;
    int32_t *singles;
} plan_arrays;

static int32_t has_triples(const pliant_wavelet *w)
{
    return w->def.scheme == PLIANT_BUTTERFLY && w->def.boundary == PLIANT_ZERO &&
           w->count <= PLIANT_TRIPLE_ROW_LIMIT;
}

// Carve the arrays out of `block`; with NULL only count the bytes.
static size_t lay_out(char *block, const pliant_wavelet *w, plan_arrays *arrays)
{
    const size_t odd = (size_t)(w->count - w->level_offset[1]);
    const size_t stencil = odd * (size_t)w->stencil_size;
    const int32_t is_grouped = has_triples(w);
    size_t offsets = 0;
    for (int32_t l = 0; l + 1 < w->level_count; l++) offsets += (size_t)w->level_offset[l + 1] + 1;

    size_t bytes = 0;
#define CARVE(field, number)                                                                       \
    do {                                                                                           \
        bytes = (bytes + 63) & ~(size_t)63;                                                        \
        if (block) arrays->field = (void *)(block + bytes);                                        \
        bytes += (number) * sizeof *arrays->field;                                                 \
    } while (0)
    CARVE(predict_node, stencil);
    CARVE(predict_weight, stencil);
    CARVE(predict_weight_f, stencil);
    CARVE(update_node, 2 * odd);
    CARVE(update_weight, 2 * odd);
    CARVE(update_offset, offsets);
    CARVE(update_odd, 2 * odd);
    CARVE(update_odd_weight, 2 * odd);
    CARVE(triples, is_grouped ? odd / 2 : 0);  // each has two of its own at least
    CARVE(singles, is_grouped ? odd : 0);
#undef CARVE
    return bytes;
}

// The prediction of one odd vertex: `node` and `weight` of stencil_size entries.
//
// Zero extension keeps every weight and reads the zero row outside the domain. Dropping divides the
// weights inside by their sum; where too little of a butterfly is inside, its nearest ring that has
// nodes inside (parents, opposite corners, wings) predicts by their mean, so that constants keep
// having no details.
static void plan_prediction(const pliant_wavelet *w, const pliant_stencil *stencil,
                            const int32_t *position, int32_t *node, double *weight)
{
    static const int32_t ring_end[] = {2, 4, 8};
    const int32_t *vertices = stencil->parents;  // the stencil's eight numbers follow each other
    const int32_t size = w->stencil_size;
    double inside = 0;
    for (int32_t k = 0; k < size; k++) {
        node[k] = position[vertices[k]];
        weight[k] = butterfly_weights[k];
        if (node[k] < w->count) inside += weight[k];
    }
    if (w->def.boundary == PLIANT_ZERO) return;

    int32_t begin = 0, end = size;
    if (size > 2 && inside < least_butterfly_weight) {
        inside = 0;
        for (int ring = 0; ring < 3 && inside == 0; ring++) {
            begin = ring == 0 ? 0 : ring_end[ring - 1];
            end = ring_end[ring];
            for (int32_t k = begin; k < end; k++) inside += node[k] < w->count;
        }
        for (int32_t k = begin; k < end; k++) weight[k] = 1;
    }
    for (int32_t k = 0; k < size; k++) {
        const int dropped = node[k] == w->count || k < begin || k >= end;
        weight[k] = dropped ? 0 : weight[k] / inside;
        if (dropped) node[k] = w->count;
    }
}

// Update weights s_ma = I_m / (2 I_a), with the scaling functions' integrals I brought down level by
// level: I_a(l) = I_a(l+1) + 1/2 sum of I_m(l+1) over the odd children m of a (hat functions' integrals).
static void plan_updates(const pliant_wavelet *w, plan_arrays *arrays, double *integral)
{
    const int32_t odd_begin = w->level_offset[1];
    for (int32_t l = w->level_count - 2; l >= 0; l--) {
        for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++)
            for (int k = 0; k < 2; k++) {
                const int32_t parent = arrays->update_node[2 * (size_t)(p - odd_begin) + k];
                if (parent < w->count) integral[parent] += integral[p] / 2;
            }
        for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++)
            for (int k = 0; k < 2; k++) {
                const size_t entry = 2 * (size_t)(p - odd_begin) + k;
                const int32_t parent = arrays->update_node[entry];
                arrays->update_weight[entry] =
                    parent < w->count ? integral[p] / (2 * integral[parent]) : 0;
            }
    }
}

// Turn the updates round, from "odd adds to its parents" to "parent gathers from its odd children",
// level by level: a gather writes each parent once, so the sums stay in registers.
static void gather_updates(pliant_wavelet *w, plan_arrays *arrays)
{
    const int32_t odd_begin = w->level_offset[1];
    int32_t *offset = arrays->update_offset;
    int32_t entries = 0;
    for (int32_t l = 0; l + 1 < w->level_count; l++) {
        const int32_t evens = w->level_offset[l + 1];
        const int32_t odd_end = w->level_offset[l + 2];
        // Count the children of every parent one place on, sum up, fill from each parent's end.
        memset(offset, 0, ((size_t)evens + 1) * sizeof *offset);
        for (int32_t p = evens; p < odd_end; p++)
            for (int k = 0; k < 2; k++) {
                const int32_t parent = arrays->update_node[2 * (size_t)(p - odd_begin) + k];
                if (parent < w->count) offset[parent]++;
            }
        for (int32_t a = 0; a < evens; a++) offset[a] = entries += offset[a];
        offset[evens] = entries;
        for (int32_t p = odd_end - 1; p >= evens; p--)
            for (int k = 0; k < 2; k++) {
                const size_t source = 2 * (size_t)(p - odd_begin) + k;
                const int32_t parent = arrays->update_node[source];
                if (parent == w->count) continue;
                const int32_t entry = --offset[parent];
                arrays->update_odd[entry] = p;
                arrays->update_odd_weight[entry] = (float)arrays->update_weight[source];
            }
        w->update_offset[l] = offset;
        offset += evens + 1;
    }
}

// ---- Plan of butterflies in threes ----

// Is this triangle of level l turned like the one of the base mesh that it lies in? The last child
// of a split is turned round, the others are not.
static int32_t is_upright(int32_t l, int32_t face)
{
    int32_t turns = 0;
    for (; l > 0; l--, face /= 4) turns += face % 4 == 3;
    return turns % 2 == 0;
}

// The vertices of a triple.
typedef struct triangle {
    int32_t corner[3], across[3], odd[3];
    const int32_t *outer[3];  // the two wings beyond each edge
} triangle;

// The triangle of a face of level l.
static triangle find_triangle(const pliant_hierarchy *hierarchy, int32_t l, int32_t face)
{
    const int32_t *corner = hierarchy->faces[l] + 3 * (size_t)face;
    const int32_t *middle = hierarchy->faces[l + 1] + 3 * (4 * (size_t)face + 3);  // ab, bc, ca
    triangle t;
    for (int k = 0; k < 3; k++) {
        t.corner[k] = corner[k];
        t.odd[k] = middle[(k + 1) % 3];
        const pliant_stencil *stencil =
            &hierarchy->stencils[t.odd[k] - hierarchy->vertex_count[0]];
        // The wings on this side are the other two corners across.
        const int beyond = stencil->opposite[0] == corner[k] ? 1 : 0;
        assert(stencil->opposite[1 - beyond] == corner[k]);
        t.across[k] = stencil->opposite[beyond];
        t.outer[k] = stencil->wings + 2 * beyond;
    }
    return t;
}

// From vertices to rows, with the odd positions that are inside and not taken yet in front. Returns
// how many those are.
static int32_t place_triangle(const triangle *from, const int32_t *position, int32_t count,
                              const uint8_t *is_taken, pliant_wavelet_triple *to)
{
    int32_t wanted = 0, unwanted = 2, order[3];
    for (int32_t k = 0; k < 3; k++) {
        const int32_t p = position[from->odd[k]];
        if (p < count && !is_taken[p]) order[wanted++] = k;
        else order[unwanted--] = k;
    }
    *to = (pliant_wavelet_triple){.padding = 0};
#define ROW(vertex) (uint16_t)(2 * position[vertex])
    for (int32_t i = 0; i < 3; i++) {
        const int32_t k = order[i];
        to->corner[i] = ROW(from->corner[k]);
        to->across[i] = ROW(from->across[k]);
        to->outer[i][0] = ROW(from->outer[k][0]);
        to->outer[i][1] = ROW(from->outer[k][1]);
        to->odd[i] = ROW(from->odd[order[i < wanted ? i : 0]]);
    }
#undef ROW
    return wanted;
}

// Upright triangles meet at edges only where those of the base mesh do. Taking them all leaves a
// few in a hundred of the odd positions, and of the triples a third has but two.
static void plan_triples(const pliant_hierarchy *hierarchy, const int32_t *position,
                         pliant_wavelet *w, plan_arrays *arrays, uint8_t *is_taken)
{
    int32_t triples = 0, singles = 0;
    memset(is_taken, 0, (size_t)w->count);
    for (int32_t l = 0; l + 1 < w->level_count; l++) {
        w->triple_offset[l] = triples;
        w->single_offset[l] = singles;
        for (int32_t f = 0; f < hierarchy->face_count[l]; f++) {
            if (!is_upright(l, f)) continue;
            const triangle found = find_triangle(hierarchy, l, f);
            pliant_wavelet_triple placed;
            const int32_t wanted = place_triangle(&found, position, w->count, is_taken, &placed);
            if (wanted < 2) continue;
            for (int32_t i = 0; i < wanted; i++) is_taken[placed.odd[i] / 2] = 1;
            arrays->triples[triples++] = placed;
        }
        for (int32_t p = w->level_offset[l + 1]; p < w->level_offset[l + 2]; p++)
            if (!is_taken[p]) arrays->singles[singles++] = p;
    }
    w->triple_offset[w->level_count - 1] = triples;
    w->single_offset[w->level_count - 1] = singles;
    w->triples = arrays->triples;
    w->singles = arrays->singles;
}

pliant_status pliant_wavelet_create(const pliant_hierarchy *hierarchy, const double *areas,
                                    const int32_t *nodes, int32_t count,
                                    const pliant_wavelet_def *def, pliant_wavelet **wavelet,
                                    pliant_error *err)
{
    const int32_t level_count = hierarchy->level_count;
    const int32_t n = hierarchy->vertex_count[level_count - 1];
    if (count < 0 || count > n)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "wavelet domain: expected 0 to %d nodes, found %d", n, count);
    for (int32_t p = 0; p < count; p++)
        if (nodes[p] < 0 || nodes[p] >= n || (p > 0 && nodes[p] <= nodes[p - 1]))
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "wavelet domain: node %d is %d: expected ascending numbers under %d",
                                    p, nodes[p], n);

    pliant_wavelet head = {.def = *def, .count = count, .level_count = level_count};
    head.stencil_size = def->scheme == PLIANT_BUTTERFLY ? 8 : 2;
    for (int32_t l = 0, p = 0; l < level_count; l++) {
        while (p < count && nodes[p] < hierarchy->vertex_count[l]) p++;
        head.level_offset[l + 1] = p;
    }

    pliant_status status = PLIANT_OK;
    plan_arrays arrays = {0};
    char *block = NULL;
    int32_t *position = NULL;
    double *integral = NULL;
    const size_t head_bytes = (sizeof head + 63) & ~(size_t)63;
    block = malloc(head_bytes + lay_out(NULL, &head, &arrays));
    position = malloc((size_t)n * sizeof *position);
    integral = malloc(((size_t)count + 1) * sizeof *integral);
    if (!block || !position || !integral) {
        free(block);
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the wavelets of %d nodes", count);
        goto done;
    }
    for (int32_t v = 0; v < n; v++) position[v] = count;
    for (int32_t p = 0; p < count; p++) {
        position[nodes[p]] = p;
        integral[p] = areas[nodes[p]];
    }

    pliant_wavelet *w = (pliant_wavelet *)block;
    *w = head;
    lay_out(block + head_bytes, w, &arrays);
    const int32_t base_count = hierarchy->vertex_count[0];
    for (int32_t p = w->level_offset[1]; p < count; p++) {
        const size_t q = (size_t)(p - w->level_offset[1]);
        const pliant_stencil *stencil = &hierarchy->stencils[nodes[p] - base_count];
        const size_t entry = q * (size_t)w->stencil_size;
        plan_prediction(w, stencil, position, arrays.predict_node + entry,
                        arrays.predict_weight + entry);
        for (int32_t k = 0; k < w->stencil_size; k++)
            arrays.predict_weight_f[entry + k] = (float)arrays.predict_weight[entry + k];
        for (int k = 0; k < 2; k++) arrays.update_node[2 * q + k] = position[stencil->parents[k]];
    }
    plan_updates(w, &arrays, integral);
    gather_updates(w, &arrays);
    // The integrals have served: their place keeps what is taken.
    if (has_triples(w)) plan_triples(hierarchy, position, w, &arrays, (uint8_t *)integral);
    w->predict_node = arrays.predict_node;
    w->predict_weight = arrays.predict_weight;
    w->predict_weight_f = arrays.predict_weight_f;
    w->update_node = arrays.update_node;
    w->update_weight = arrays.update_weight;
    w->update_odd = arrays.update_odd;
    w->update_odd_weight = arrays.update_odd_weight;
    *wavelet = w;
done:
    free(integral);
    free(position);
    return status;
}

void pliant_wavelet_destroy(pliant_wavelet *wavelet)
{
    free(wavelet);
}

// ---- Transforms, offline: the same source for double and for float ----

#define real               double
#define named(function)    function
#include "wavelet_rows.h"
#undef real
#undef named

#define real               float
#define named(function)    function##_float
#include "wavelet_rows.h"
