// hierarchy.c: derive and check the levels of a mesh with subdivision connectivity.
//
// Only the base mesh is searched for edges. Above it the odd vertices are the edges: when every odd
// vertex of level l+1 lies once on each side of one edge of level l, and the base is manifold with
// at least three faces around every vertex, then all levels are closed, manifold and oriented.
#include "pliant/hierarchy.h"

#include "pliant/error.h"
#include "pliant/halfedge.h"

#include <stdlib.h>
#include <string.h>

// The counts alone, before anything is read or allocated by them. A closed level has 3/2 edges per
// face, each of which makes one odd vertex.
static pliant_status check_counts(int32_t level_count, const int32_t *vertex_count,
                                  int32_t face_count, pliant_error *err)
{
    if (level_count < 1 || level_count > PLIANT_LEVEL_LIMIT + 1)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "levels: expected 1..%d, found %d",
                                PLIANT_LEVEL_LIMIT + 1, level_count);
    const int64_t split = (int64_t)1 << 2 * (level_count - 1);
    if (face_count < 1 || face_count % split != 0 || face_count / split % 2 != 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "faces: expected a positive multiple of %lld (an even number of "
                                "base faces, %d levels), found %d",
                                (long long)(2 * split), level_count, face_count);
    const int64_t base_faces = face_count / split;
    if (vertex_count[0] < 4 || vertex_count[0] > base_faces)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "vertices of level 0: expected 4..%lld (closed, %lld faces), "
                                "found %d",
                                (long long)base_faces, (long long)base_faces, vertex_count[0]);
    for (int32_t l = 0; l + 1 < level_count; l++) {
        const int64_t faces = base_faces << 2 * l, expected = vertex_count[l] + faces / 2 * 3;
        if (vertex_count[l + 1] != expected)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "vertices of level %d: expected %lld (%d of level %d and one "
                                    "for each edge of its %lld faces), found %d",
                                    l + 1, (long long)expected, vertex_count[l], l,
                                    (long long)faces, vertex_count[l + 1]);
    }
    return PLIANT_OK;
}

// One block: the struct, all faces, the stencils.
static pliant_hierarchy *reserve(int32_t level_count, const int32_t *vertex_count,
                                 int32_t face_count)
{
    const size_t odd_count = (size_t)(vertex_count[level_count - 1] - vertex_count[0]);
    size_t all_faces = 0;
    for (int32_t l = 0, count = face_count; l < level_count; l++, count /= 4)
        all_faces += (size_t)count;
    char *block = malloc(sizeof(pliant_hierarchy) + odd_count * sizeof(pliant_stencil) +
                         all_faces * 3 * sizeof(int32_t));
    if (!block) return NULL;
    pliant_hierarchy *h = (pliant_hierarchy *)block;
    *h = (pliant_hierarchy){.level_count = level_count};
    h->stencils = (pliant_stencil *)(block + sizeof *h);
    int32_t *faces = (int32_t *)(block + sizeof *h + odd_count * sizeof(pliant_stencil));
    for (int32_t l = level_count - 1, count = face_count; l >= 0; l--, count /= 4) {
        h->vertex_count[l] = vertex_count[l];
        h->face_count[l] = count;
        h->faces[l] = faces;
        faces += 3 * (size_t)count;
    }
    return h;
}

static pliant_status copy_finest(pliant_hierarchy *h, const int32_t *faces, pliant_error *err)
{
    const int32_t finest = h->level_count - 1, vertex_count = h->vertex_count[finest];
    const size_t corner_count = 3 * (size_t)h->face_count[finest];
    for (size_t i = 0; i < corner_count; i++)
        if (faces[i] < 0 || faces[i] >= vertex_count)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "face %zu of level %d: expected vertices 0..%d, found %d",
                                    i / 3, finest, vertex_count - 1, faces[i]);
    memcpy((int32_t *)h->faces[finest], faces, corner_count * sizeof *faces);
    return PLIANT_OK;
}

// Join the four children of face f of level l to their parent, checking the order that hierarchy.h
// promises: corners coarse, midpoints odd, and the same midpoint wherever it is named.
static pliant_status join(pliant_hierarchy *h, int32_t l, int32_t f, pliant_error *err)
{
    const int32_t *child = h->faces[l + 1] + 12 * (size_t)f, *middle = child + 9;
    int32_t *face = (int32_t *)h->faces[l] + 3 * (size_t)f;
    for (int k = 0; k < 3; k++) {
        face[k] = child[3 * k];
        if (face[k] >= h->vertex_count[l])
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "face %d of level %d: expected a first corner of level %d "
                                    "(vertex 0..%d), found vertex %d",
                                    4 * f + k, l + 1, l, h->vertex_count[l] - 1, face[k]);
        if (middle[k] < h->vertex_count[l])
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "face %d of level %d: expected odd vertices (%d or more), "
                                    "found vertex %d",
                                    4 * f + 3, l + 1, h->vertex_count[l], middle[k]);
    }
    for (int k = 0; k < 3; k++) {
        const int32_t after = middle[k], before = middle[(k + 2) % 3];
        if (child[3 * k + 1] != after || child[3 * k + 2] != before)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "face %d of level %d: expected (%d, %d, %d) beside the middle "
                                    "face %d, found (%d, %d, %d)",
                                    4 * f + k, l + 1, face[k], after, before, 4 * f + 3, face[k],
                                    child[3 * k + 1], child[3 * k + 2]);
    }
    return PLIANT_OK;
}

// Enter the three edges of face f of level l at their odd vertices: sides[2 i + d] is the half-edge
// of odd vertex i of the level that runs from its lower parent to its higher one (d = 0) or back.
static pliant_status enter_edges(const pliant_hierarchy *h, int32_t l, int32_t f,
                                 const int32_t *parents, int32_t *sides, pliant_error *err)
{
    const int32_t *face = h->faces[l] + 3 * (size_t)f;
    const int32_t *middle = h->faces[l + 1] + 12 * (size_t)f + 9;
    for (int k = 0; k < 3; k++) {
        const int32_t a = face[k], b = face[(k + 1) % 3], m = middle[k];
        const int32_t *p = parents + 2 * (size_t)(m - h->vertex_count[0]);
        if (!(p[0] == a && p[1] == b) && !(p[0] == b && p[1] == a))
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "parents of vertex %d: expected %d and %d (face %d of level "
                                    "%d), found %d and %d",
                                    m, a, b, f, l, p[0], p[1]);
        int32_t *side = sides + 2 * (size_t)(m - h->vertex_count[l]) + (a > b);
        if (*side >= 0)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "vertex %d of level %d: expected one face of level %d on each "
                                    "side of its edge, found faces %d and %d on one side",
                                    m, l + 1, l, *side / 3, f);
        *side = 3 * f + k;
    }
    return PLIANT_OK;
}

// The corner across half-edge `s` of level l.
static int32_t corner_across(const pliant_hierarchy *h, int32_t l, const int32_t *sides, int32_t s)
{
    const int32_t *face = h->faces[l];
    const int32_t m = h->faces[l + 1][12 * (size_t)(s / 3) + 9 + s % 3];
    const int32_t back = face[s] > face[pliant_halfedge_next(s)];
    const int32_t twin = sides[2 * (size_t)(m - h->vertex_count[l]) + !back];
    return face[pliant_halfedge_previous(twin)];
}

// The stencils of the odd vertices that level l+1 adds.
static void fill_stencils(pliant_hierarchy *h, int32_t l, const int32_t *sides)
{
    const int32_t *face = h->faces[l];
    pliant_stencil *stencils =
        (pliant_stencil *)h->stencils + h->vertex_count[l] - h->vertex_count[0];
    const int32_t odd_count = h->vertex_count[l + 1] - h->vertex_count[l];
    for (int32_t i = 0; i < odd_count; i++) {
        const int32_t up = sides[2 * (size_t)i], down = sides[2 * (size_t)i + 1];
        const int32_t up_next = pliant_halfedge_next(up), up_last = pliant_halfedge_previous(up);
        const int32_t down_next = pliant_halfedge_next(down);
        const int32_t down_last = pliant_halfedge_previous(down);
        stencils[i] = (pliant_stencil){
            .parents = {face[up], face[down]},
            .opposite = {face[up_last], face[down_last]},
            .wings = {corner_across(h, l, sides, up_last), corner_across(h, l, sides, up_next),
                      corner_across(h, l, sides, down_next), corner_across(h, l, sides, down_last)},
        };
    }
}

// Level l from level l+1.
static pliant_status derive_level(pliant_hierarchy *h, int32_t l, const int32_t *parents,
                                  int32_t *sides, pliant_error *err)
{
    for (int32_t f = 0; f < h->face_count[l]; f++) {
        pliant_status status = join(h, l, f, err);
        if (status < 0) return status;
    }
    // As many half-edges as places for them: when none is taken twice, all are filled.
    const size_t side_count = 2 * (size_t)(h->vertex_count[l + 1] - h->vertex_count[l]);
    for (size_t i = 0; i < side_count; i++) sides[i] = -1;
    for (int32_t f = 0; f < h->face_count[l]; f++) {
        pliant_status status = enter_edges(h, l, f, parents, sides, err);
        if (status < 0) return status;
    }
    fill_stencils(h, l, sides);
    return PLIANT_OK;
}

static pliant_status check_base(const pliant_hierarchy *h, int32_t *sides, pliant_error *err)
{
    pliant_error detail = {{0}};
    pliant_status status =
        pliant_halfedge_match(h->vertex_count[0], h->face_count[0], h->faces[0], sides, &detail);
    if (status == PLIANT_OK) return status;
    return pliant_error_set(err, status, "level 0: %.480s", detail.text);
}

pliant_status pliant_hierarchy_create(int32_t level_count, const int32_t *vertex_count,
                                      int32_t face_count, const int32_t *faces,
                                      const int32_t *parents, pliant_hierarchy **hierarchy,
                                      pliant_error *err)
{
    pliant_status status = check_counts(level_count, vertex_count, face_count, err);
    if (status < 0) return status;
    pliant_hierarchy *h = reserve(level_count, vertex_count, face_count);
    // Half-edges: those of the base mesh, or two for each odd vertex of one level, which are those
    // of the level below; the last but one level has the most.
    const size_t side_count = 3 * (size_t)(level_count > 1 ? face_count / 4 : face_count);
    int32_t *sides = malloc(side_count * sizeof *sides);
    if (!h || !sides) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d levels of %d faces",
                                  level_count, face_count);
        goto done;
    }
    status = copy_finest(h, faces, err);
    for (int32_t l = level_count - 2; l >= 0 && status == PLIANT_OK; l--)
        status = derive_level(h, l, parents, sides, err);
    if (status == PLIANT_OK) status = check_base(h, sides, err);
    if (status < 0) goto done;
    *hierarchy = h;
    h = NULL;
done:
    free(sides);
    pliant_hierarchy_destroy(h);
    return status;
}

void pliant_hierarchy_destroy(pliant_hierarchy *hierarchy)
{
    free(hierarchy);
}

int32_t pliant_hierarchy_level_of(const pliant_hierarchy *hierarchy, int32_t vertex)
{
    int32_t level = 0;
    while (vertex >= hierarchy->vertex_count[level]) level++;
    return level;
}
