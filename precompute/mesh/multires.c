// multires.c: the storage of a mesh with its levels.
#include "mesh/multires.h"

#include "pliant/error.h"

#include <stdlib.h>

pliant_status pliant_multires_create(int32_t vertex_count, int32_t face_count, int32_t level_count,
                                     pliant_multires **multires, pliant_error *err)
{
    if (level_count < 1 || level_count > PLIANT_LEVEL_LIMIT + 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "levels above the base: expected 0..%d, found %d",
                                PLIANT_LEVEL_LIMIT, level_count - 1);
    // Each level has four faces for one, and a vertex more for each of the 3/2 edges per face.
    int64_t faces = face_count, vertices = vertex_count;
    int32_t counts[PLIANT_LEVEL_LIMIT + 1] = {vertex_count};
    for (int32_t l = 1; l < level_count; l++) {
        vertices += faces / 2 * 3;
        faces *= 4;
        if (faces > INT32_MAX)
            return pliant_error_set(
                err, PLIANT_ERR_ARGUMENT,
                "%d levels above %d base faces: level %d has %lld faces and %lld "
                "vertices, expected at most %d",
                level_count - 1, face_count, l, (long long)faces, (long long)vertices, INT32_MAX);
        counts[l] = (int32_t)vertices;
    }
    pliant_multires *m = calloc(1, sizeof *m);
    if (!m) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a multiresolution mesh");
    m->level_count = level_count;
    for (int32_t l = 0; l < level_count; l++) m->vertex_count[l] = counts[l];
    pliant_status status = pliant_mesh_create((int32_t)vertices, (int32_t)faces, &m->mesh, err);
    if (status < 0) goto refused;
    const size_t odd_count = (size_t)(vertices - vertex_count);
    m->parents = malloc((odd_count ? odd_count : 1) * 2 * sizeof *m->parents);
    m->source_index = malloc((size_t)vertices * sizeof *m->source_index);
    if (!m->parents || !m->source_index) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %lld vertices",
                                  (long long)vertices);
        goto refused;
    }
    *multires = m;
    return PLIANT_OK;
refused:
    pliant_multires_destroy(m);
    return status;
}

void pliant_multires_destroy(pliant_multires *multires)
{
    if (!multires) return;
    free(multires->source_index);
    free(multires->parents);
    pliant_mesh_destroy(multires->mesh);
    free(multires);
}
