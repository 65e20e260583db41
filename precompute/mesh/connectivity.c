// connectivity.c: find the levels of a mesh that somebody subdivided, in whatever order it comes.
//
// This follows: G. Taubin, Detecting and reconstructing subdivision connectivity, The Visual
// Computer 18, 2002: a mesh is one 4-to-1 refinement exactly if its faces can be covered by tiles
// of a middle face and the three around it. We grow the coarse (even) vertices instead of the
// tiles. All neighbours of an even vertex are odd; an odd vertex has six neighbours, of which those
// straight ahead and straight back are even. So one even vertex decides about its whole component,
// in linear time, and a contradiction proves that it is not even.
//
// No choice is left to try. An odd vertex has valence 6, so any other valence marks an even vertex;
// and a component of valence 6 throughout is a torus whose triangulation is a lattice modulo
// translations (Euler's formula; it is oriented), which looks the same from every vertex: any may
// be the even one, and we take its lowest, which keeps coarse-to-fine input as it is.
#include "mesh/multires.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"

#include <stdlib.h>
#include <string.h>

enum { EVEN = 1, ODD = 2 };  // 0: not reached yet

// One level while it is taken apart. Vertices and faces have numbers of their own on each.
typedef struct level {
    int32_t vertex_count, face_count;
    int32_t *faces;     // [face_count][3]
    int32_t *origin;    // [vertex_count]: the input's vertex, ascending
    int32_t *children;  // [face_count][4]: faces of the next finer level at corners 0, 1, 2 and in
                        // the middle; the middle face begins with the midpoint of corners 0 and 1
} level;

// What covering needs; sized for the input and used again by every level.
typedef struct cover {
    int32_t *twin;       // [faces][3], matched for the level in hand
    int32_t *leaving;    // [vertices]: some half-edge that leaves each vertex
    int32_t *valence;    // [vertices]
    int32_t *queue;      // [vertices]
    uint8_t *parity;     // [vertices]: EVEN or ODD
    int32_t *number;     // [vertices]: number on the coarser level
    int32_t *component;  // [input's vertices]
    int32_t *seed;       // [component_count]
    int32_t component_count;
    int32_t refused_component, covered_component;  // the first of either kind, or -1
} cover;

// ---- Covering ----

static int32_t head(const level *l, int32_t h)
{
    return l->faces[pliant_halfedge_next(h)];
}

// The next half-edge that leaves the same vertex.
static int32_t turn(const cover *c, int32_t h)
{
    return c->twin[pliant_halfedge_previous(h)];
}

// Number the components by their lowest vertices.
static void find_components(cover *c, const level *input)
{
    for (int32_t v = 0; v < input->vertex_count; v++) c->component[v] = -1;
    for (int32_t h = 0; h < 3 * input->face_count; h++) c->leaving[input->faces[h]] = h;
    c->component_count = 0;
    for (int32_t v = 0; v < input->vertex_count; v++) {
        if (c->component[v] >= 0) continue;
        int32_t waiting = 0;
        c->queue[waiting++] = v;
        c->component[v] = c->component_count++;
        while (waiting > 0) {
            const int32_t first = c->leaving[c->queue[--waiting]];
            int32_t h = first;
            do {
                const int32_t w = head(input, h);
                if (c->component[w] < 0) {
                    c->component[w] = c->component[v];
                    c->queue[waiting++] = w;
                }
                h = turn(c, h);
            } while (h != first);
        }
    }
}

// Half-edges and valences of the level, and in each component the even vertex to begin with.
static void prepare(cover *c, const level *l)
{
    memset(c->parity, 0, (size_t)l->vertex_count);
    memset(c->valence, 0, (size_t)l->vertex_count * sizeof *c->valence);
    for (int32_t h = 0; h < 3 * l->face_count; h++) {
        c->valence[l->faces[h]]++;
        c->leaving[l->faces[h]] = h;
    }
    for (int32_t i = 0; i < c->component_count; i++) c->seed[i] = -1;
    for (int32_t v = 0; v < l->vertex_count; v++) {
        int32_t *seed = &c->seed[c->component[l->origin[v]]];
        if (*seed < 0 || (c->valence[*seed] == 6 && c->valence[v] != 6)) *seed = v;
    }
}

// Grow the even vertices of one component from its seed. PLIANT_ERR_MISSING with the contradiction.
static pliant_status cover_component(cover *c, const level *l, int32_t seed, pliant_error *why)
{
    int32_t begin = 0, end = 0;
    c->queue[end++] = seed;
    c->parity[seed] = EVEN;
    while (begin < end) {
        const int32_t v = c->queue[begin++], first = c->leaving[v];
        int32_t h = first;
        do {
            const int32_t m = head(l, h);
            // Straight on through m: half of its six half-edges further.
            const int32_t ahead = turn(c, turn(c, turn(c, c->twin[h]))), b = head(l, ahead);
            if (c->valence[m] != 6)
                return pliant_error_set(
                    why, PLIANT_ERR_MISSING,
                    "vertex %d of valence %d would be the midpoint of an edge "
                    "from vertex %d of valence %d, if vertex %d of valence %d is "
                    "a coarse one",
                    l->origin[m], c->valence[m], l->origin[v], c->valence[v], l->origin[seed],
                    c->valence[seed]);
            if (c->parity[m] == EVEN || c->parity[b] == ODD)
                return pliant_error_set(
                    why, PLIANT_ERR_MISSING,
                    "vertex %d of valence %d would be both an end and the "
                    "midpoint of a coarse edge, if vertex %d of valence %d is a "
                    "coarse one",
                    l->origin[c->parity[m] == EVEN ? m : b],
                    c->valence[c->parity[m] == EVEN ? m : b], l->origin[seed], c->valence[seed]);
            c->parity[m] = ODD;
            if (!c->parity[b]) {
                c->parity[b] = EVEN;
                c->queue[end++] = b;
            }
            h = turn(c, h);
        } while (h != first);
    }
    // Neighbours of even vertices are odd, and those of odd ones are neighbours of the two even
    // ones beside them: the component has been reached whole, without a contradiction.
    return PLIANT_OK;
}

// ---- One level coarser ----

static pliant_status reserve_level(level *l, int32_t vertex_count, int32_t face_count,
                                   pliant_error *err)
{
    l->vertex_count = vertex_count;
    l->face_count = face_count;
    l->faces = malloc((size_t)face_count * 3 * sizeof *l->faces);
    l->origin = malloc((size_t)vertex_count * sizeof *l->origin);
    l->children = malloc((size_t)face_count * 4 * sizeof *l->children);
    if (l->faces && l->origin && l->children) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d faces", face_count);
}

static void release_level(level *l)
{
    free(l->children);
    free(l->origin);
    free(l->faces);
    *l = (level){0};
}

// The even vertices in their order, and a face for every tile in the order of the middle faces.
static void build_coarse(const cover *c, const level *fine, level *coarse)
{
    int32_t count = 0;
    for (int32_t v = 0; v < fine->vertex_count; v++) {
        if (c->parity[v] == ODD) continue;
        coarse->origin[count] = fine->origin[v];
        c->number[v] = count++;
    }
    count = 0;
    for (int32_t f = 0; f < fine->face_count; f++) {
        const int32_t *m = fine->faces + 3 * (size_t)f;
        if (c->parity[m[0]] != ODD || c->parity[m[1]] != ODD || c->parity[m[2]] != ODD) continue;
        int32_t *face = coarse->faces + 3 * (size_t)count,
                *child = coarse->children + 4 * (size_t)count;
        for (int32_t k = 0; k < 3; k++) {
            // Corner k lies across the side that arrives at midpoint k.
            const int32_t across = c->twin[3 * f + (k + 2) % 3];
            face[k] = c->number[fine->faces[pliant_halfedge_previous(across)]];
            child[k] = across / 3;
        }
        child[3] = f;
        count++;
    }
}

// The level below `fine`, or PLIANT_ERR_MISSING and why there is none.
static pliant_status coarsen(cover *c, const level *fine, level *coarse, pliant_error *why)
{
    prepare(c, fine);
    c->refused_component = c->covered_component = -1;
    for (int32_t i = 0; i < c->component_count; i++) {
        // The first contradiction is told; the rest are only looked for, to say who could go on.
        const int32_t refused_before = c->refused_component >= 0;
        const pliant_status status =
            cover_component(c, fine, c->seed[i], refused_before ? NULL : why);
        if (status < 0 && !refused_before) c->refused_component = i;
        if (status == PLIANT_OK && c->covered_component < 0) c->covered_component = i;
    }
    if (c->refused_component >= 0) return PLIANT_ERR_MISSING;

    int32_t even_count = 0;
    for (int32_t v = 0; v < fine->vertex_count; v++) even_count += c->parity[v] == EVEN;
    pliant_status status = reserve_level(coarse, even_count, fine->face_count / 4, why);
    if (status < 0) return status;
    build_coarse(c, fine, coarse);
    // Tiles may close up so tightly that their corners make no manifold (a torus three vertices
    // round, say, has no coarser level that is a mesh).
    pliant_error detail = {{0}};
    status = pliant_halfedge_match(coarse->vertex_count, coarse->face_count, coarse->faces, c->twin,
                                   &detail);
    if (status == PLIANT_OK || status == PLIANT_ERR_MEMORY) return status;
    return pliant_error_set(why, PLIANT_ERR_MISSING,
                            "the coarser level of %d vertices is no closed "
                            "manifold mesh",
                            coarse->vertex_count);
}

// ---- The result, coarse to fine ----

// Number the input's vertices level by level, each level in the input's order.
static void number_vertices(const level *levels, int32_t level_count, int32_t *number)
{
    const int32_t vertex_count = levels[level_count - 1].vertex_count;
    for (int32_t v = 0; v < vertex_count; v++) number[v] = -1;
    int32_t next = 0;
    for (int32_t l = 0; l < level_count; l++)
        for (int32_t i = 0; i < levels[l].vertex_count; i++)
            if (number[levels[l].origin[i]] < 0) number[levels[l].origin[i]] = next++;
}

// Put the base faces in the order of the first input face in each. `order` takes sides: 3 times the
// face plus the corner to begin with, which is 0. `scratch`, `first` have room for the input's
// faces.
static void order_base(const level *levels, int32_t level_count, int32_t *order, int32_t *scratch,
                       int32_t *first)
{
    for (int32_t f = 0; f < levels[level_count - 1].face_count; f++) first[f] = f;
    for (int32_t l = level_count - 2; l >= 0; l--) {
        for (int32_t f = 0; f < levels[l].face_count; f++) {
            const int32_t *child = levels[l].children + 4 * (size_t)f;
            int32_t lowest = first[child[0]];
            for (int k = 1; k < 4; k++)
                if (first[child[k]] < lowest) lowest = first[child[k]];
            scratch[f] = lowest;
        }
        memcpy(first, scratch, (size_t)levels[l].face_count * sizeof *first);
    }
    // No two have the same first face: lay them out at it, and gather.
    for (int32_t f = 0; f < levels[level_count - 1].face_count; f++) scratch[f] = -1;
    for (int32_t f = 0; f < levels[0].face_count; f++) scratch[first[f]] = f;
    int32_t count = 0;
    for (int32_t f = 0; f < levels[level_count - 1].face_count; f++)
        if (scratch[f] >= 0) order[count++] = 3 * scratch[f];
}

// From the ordered sides of a level to those of the next finer one (hierarchy.h's child order),
// from the last on, in place; and the parents of the odd vertices between.
static void descend(const level *coarse, const level *fine, const int32_t *number,
                    int32_t base_count, int32_t *order, int32_t (*parents)[2])
{
    for (int32_t i = coarse->face_count - 1; i >= 0; i--) {
        const int32_t f = order[i] / 3, begin = order[i] % 3;
        const int32_t *corners = coarse->faces + 3 * (size_t)f,
                      *child = coarse->children + 4 * (size_t)f;
        const int32_t *middle = fine->faces + 3 * (size_t)child[3];
        for (int32_t k = 0; k < 3; k++) {
            const int32_t at = (begin + k) % 3, input = coarse->origin[corners[at]];
            const int32_t *small = fine->faces + 3 * (size_t)child[at];
            int32_t turned = 0;
            while (fine->origin[small[turned]] != input) turned++;
            order[4 * (size_t)i + (size_t)k] = 3 * child[at] + turned;

            const int32_t a = number[input], b = number[coarse->origin[corners[(at + 1) % 3]]];
            int32_t *row = parents[number[fine->origin[middle[at]]] - base_count];
            row[0] = a < b ? a : b;
            row[1] = a < b ? b : a;
        }
        order[4 * (size_t)i + 3] = 3 * child[3] + begin;
    }
}

static pliant_status assemble(const pliant_mesh *mesh, const level *levels, int32_t level_count,
                              cover *c, pliant_multires **multires, pliant_error *err)
{
    pliant_multires *m = NULL;
    pliant_status status =
        pliant_multires_create(levels[0].vertex_count, levels[0].face_count, level_count, &m, err);
    if (status < 0) return status;
    int32_t *number = c->number, *order = m->mesh->faces;
    number_vertices(levels, level_count, number);
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        m->source_index[number[v]] = v;
        memcpy(m->mesh->vertices + 3 * (size_t)number[v], mesh->vertices + 3 * (size_t)v,
               3 * sizeof(double));
    }
    // The sides wait in the last third of the room for faces, where each is read before the face
    // that needs its place is written.
    order += 2 * (size_t)mesh->face_count;
    order_base(levels, level_count, order, c->twin, c->twin + mesh->face_count);
    for (int32_t l = 0; l + 1 < level_count; l++)
        descend(&levels[l], &levels[l + 1], number, m->vertex_count[0], order,
                (int32_t(*)[2])m->parents);
    for (int32_t i = 0; i < mesh->face_count; i++) {
        const int32_t f = order[i] / 3, begin = order[i] % 3;
        const int32_t v[3] = {mesh->faces[3 * f + begin], mesh->faces[3 * f + (begin + 1) % 3],
                              mesh->faces[3 * f + (begin + 2) % 3]};
        for (int k = 0; k < 3; k++) m->mesh->faces[3 * (size_t)i + (size_t)k] = number[v[k]];
    }
    *multires = m;
    return PLIANT_OK;
}

// ---- The whole ----

static pliant_status reserve_cover(cover *c, const pliant_mesh *mesh, pliant_error *err)
{
    const size_t vertices = mesh->vertex_count > 0 ? (size_t)mesh->vertex_count : 1;
    const size_t faces = mesh->face_count > 0 ? (size_t)mesh->face_count : 1;
    c->twin = malloc(faces * 3 * sizeof *c->twin);
    c->leaving = malloc(vertices * sizeof *c->leaving);
    c->valence = malloc(vertices * sizeof *c->valence);
    c->queue = malloc(vertices * sizeof *c->queue);
    c->parity = malloc(vertices);
    c->number = malloc(vertices * sizeof *c->number);
    c->component = malloc(vertices * sizeof *c->component);
    c->seed = malloc(vertices * sizeof *c->seed);
    if (c->twin && c->leaving && c->valence && c->queue && c->parity && c->number && c->component &&
        c->seed)
        return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %zu vertices and %zu faces",
                            vertices, faces);
}

static void release_cover(cover *c)
{
    free(c->seed);
    free(c->component);
    free(c->number);
    free(c->parity);
    free(c->queue);
    free(c->valence);
    free(c->leaving);
    free(c->twin);
}

// Levels from the input (finest[0]) downwards: finest[-1], finest[-2], ... PLIANT_ERR_MISSING is
// how it ends; `why` says what stopped it.
static pliant_status find_levels(cover *c, level *finest, int32_t *coarser_count, pliant_error *why)
{
    pliant_status status = PLIANT_OK;
    for (*coarser_count = 0; *coarser_count < PLIANT_LEVEL_LIMIT; ++*coarser_count) {
        status = coarsen(c, finest - *coarser_count, finest - *coarser_count - 1, why);
        if (status < 0) break;
    }
    return status;
}

pliant_status pliant_multires_detect(const pliant_mesh *mesh, pliant_multires **multires,
                                     pliant_error *err)
{
    cover c = {0};
    level levels[PLIANT_LEVEL_LIMIT + 1] = {{0}}, *finest = &levels[PLIANT_LEVEL_LIMIT];
    pliant_error why = {{0}};
    int32_t coarser_count = 0;
    pliant_status status = reserve_cover(&c, mesh, err);
    if (status < 0) goto done;
    status = pliant_halfedge_match(mesh->vertex_count, mesh->face_count, mesh->faces, c.twin, err);
    if (status < 0) goto done;
    status = reserve_level(finest, mesh->vertex_count, mesh->face_count, err);
    if (status < 0) goto done;
    memcpy(finest->faces, mesh->faces, (size_t)mesh->face_count * 3 * sizeof *mesh->faces);
    for (int32_t v = 0; v < mesh->vertex_count; v++) finest->origin[v] = v;
    find_components(&c, finest);

    status = find_levels(&c, finest, &coarser_count, &why);
    if (status < 0 && status != PLIANT_ERR_MISSING) {
        (void)pliant_error_set(err, status, "%s", why.text);
        goto done;
    }
    if (coarser_count == 0) {
        status =
            pliant_error_set(err, PLIANT_ERR_MISSING,
                             "no subdivision connectivity: %.300s; take the mesh as a base mesh "
                             "with --subdivide L",
                             why.text);
        goto done;
    }
    status = assemble(mesh, finest - coarser_count, coarser_count + 1, &c, multires, err);
    if (status < 0) goto done;
    if (c.refused_component >= 0 && c.covered_component >= 0)
        (void)pliant_error_set(
            &(*multires)->note, PLIANT_OK,
            "%d levels, as many as all %d components have: %.300s, where another "
            "component could be coarser",
            coarser_count + 1, c.component_count, why.text);
done:
    for (int32_t l = 0; l <= PLIANT_LEVEL_LIMIT; l++) release_level(&levels[l]);
    release_cover(&c);
    return status;
}
