// halfedge.c: which triangle lies across an edge of a closed triangle mesh.
#include "pliant/halfedge.h"

#include "pliant/error.h"

#include <stdlib.h>

// Where the half-edges that leave each vertex lie: leaving[offset[v]] .. leaving[offset[v + 1]].
static pliant_status sort_by_origin(int32_t vertex_count, int32_t face_count, const int32_t *faces,
                                    int32_t *offset, int32_t *leaving, pliant_error *err)
{
    for (int32_t h = 0; h < 3 * face_count; h++) {
        const int32_t v = faces[h];
        if (v < 0 || v >= vertex_count)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "face %d: expected vertices 0..%d, found %d", h / 3,
                                    vertex_count - 1, v);
        if (v == faces[pliant_halfedge_next(h)])
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "face %d: expected three different vertices, found %d twice",
                                    h / 3, v);
        offset[v + 1]++;
    }
    for (int32_t v = 0; v < vertex_count; v++) {
        // Fewer than three would make two faces share two edges; subdividing that is not manifold.
        if (offset[v + 1] < 3)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "vertex %d: expected at least 3 faces around it, found %d", v,
                                    offset[v + 1]);
        offset[v + 1] += offset[v];
    }
    // Filling moves offset[v] to the end of v's part, which is where v + 1 begins: shift back
    // after.
    for (int32_t h = 0; h < 3 * face_count; h++) leaving[offset[faces[h]]++] = h;
    for (int32_t v = vertex_count; v > 0; v--) offset[v] = offset[v - 1];
    offset[0] = 0;
    return PLIANT_OK;
}

// Match the half-edges leaving `v` with those arriving there. `towards[w]` is the half-edge from
// some vertex to w that was met last; it is v's own if it lies in v's part of the list.
static pliant_status match_vertex(int32_t v, const int32_t *faces, const int32_t *offset,
                                  const int32_t *leaving, int32_t *towards, int32_t *twin,
                                  pliant_error *err)
{
    for (int32_t i = offset[v]; i < offset[v + 1]; i++) {
        const int32_t h = leaving[i], w = faces[pliant_halfedge_next(h)], met = towards[w];
        if (met >= 0 && faces[met] == v)
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "edge from vertex %d to %d: expected one face on its left, found %d and %d "
                "(more than two faces on an edge, or faces of opposite orientation)",
                v, w, met / 3, h / 3);
        towards[w] = h;
    }
    for (int32_t i = offset[v]; i < offset[v + 1]; i++) {
        // The side before a leaving one arrives at v.
        const int32_t h = pliant_halfedge_previous(leaving[i]), w = faces[h], met = towards[w];
        if (met < 0 || faces[met] != v)
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "edge from vertex %d to %d of face %d: expected a face on its right, found none "
                "(open, or faces of opposite orientation)",
                w, v, h / 3);
        twin[h] = met;
    }
    return PLIANT_OK;
}

// The faces around a vertex are one ring.
static pliant_status check_fan(int32_t v, const int32_t *offset, const int32_t *leaving,
                               const int32_t *twin, pliant_error *err)
{
    const int32_t first = leaving[offset[v]], expected = offset[v + 1] - offset[v];
    int32_t h = first, found = 0;
    do {
        h = twin[pliant_halfedge_previous(h)];
        found++;
    } while (h != first);
    if (found != expected)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "vertex %d: expected one ring of %d faces around it, found a ring "
                                "of %d (surfaces touch there)",
                                v, expected, found);
    return PLIANT_OK;
}

pliant_status pliant_halfedge_match(int32_t vertex_count, int32_t face_count, const int32_t *faces,
                                    int32_t *twin, pliant_error *err)
{
    if (vertex_count < 1 || face_count < 1 || face_count > PLIANT_HALFEDGE_FACE_LIMIT ||
        vertex_count > face_count)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "closed mesh: expected 1..%d faces and no more vertices than "
                                "faces, found %d vertices and %d faces",
                                PLIANT_HALFEDGE_FACE_LIMIT, vertex_count, face_count);
    const size_t side_count = 3 * (size_t)face_count;
    int32_t *offset = calloc((size_t)vertex_count + 1, sizeof *offset);
    int32_t *leaving = malloc(side_count * sizeof *leaving);
    int32_t *towards = malloc((size_t)vertex_count * sizeof *towards);
    pliant_status status = PLIANT_OK;
    if (!offset || !leaving || !towards) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the edges of %d faces",
                                  face_count);
        goto done;
    }
    status = sort_by_origin(vertex_count, face_count, faces, offset, leaving, err);
    if (status < 0) goto done;
    for (int32_t v = 0; v < vertex_count; v++) towards[v] = -1;
    for (int32_t v = 0; v < vertex_count && status == PLIANT_OK; v++)
        status = match_vertex(v, faces, offset, leaving, towards, twin, err);
    if (status < 0) goto done;
    // Every half-edge has a twin and none has two, so that following twins around a vertex returns.
    for (int32_t v = 0; v < vertex_count && status == PLIANT_OK; v++)
        status = check_fan(v, offset, leaving, twin, err);
done:
    free(towards);
    free(leaving);
    free(offset);
    return status;
}
