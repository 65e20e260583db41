// mesh.c: an indexed triangle mesh, and what its geometry says.
#include "pliant/mesh.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

pliant_status pliant_mesh_create(int32_t vertex_count, int32_t face_count, pliant_mesh **mesh,
                                 pliant_error *err)
{
    if (vertex_count < 0 || face_count < 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "mesh of %d vertices and %d faces",
                                vertex_count, face_count);
    const size_t vertex_bytes = (size_t)vertex_count * 3 * sizeof(double);
    const size_t face_bytes = (size_t)face_count * 3 * sizeof(int32_t);
    char *block = calloc(1, sizeof(pliant_mesh) + vertex_bytes + face_bytes);
    if (!block)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d vertices and %d faces",
                                vertex_count, face_count);
    pliant_mesh *m = (pliant_mesh *)block;
    m->vertex_count = vertex_count;
    m->face_count = face_count;
    m->vertices = (double *)(block + sizeof(pliant_mesh));
    m->faces = (int32_t *)(block + sizeof(pliant_mesh) + vertex_bytes);
    *mesh = m;
    return PLIANT_OK;
}

void pliant_mesh_destroy(pliant_mesh *mesh)
{
    free(mesh);
}

double pliant_mesh_volume(const pliant_mesh *mesh)
{
    // Sum of signed tetrahedra against the first vertex, which keeps the terms small far from 0.
    if (mesh->vertex_count == 0) return 0;
    const double *o = mesh->vertices;
    double six_volumes = 0;
    for (int32_t f = 0; f < mesh->face_count; f++) {
        double e[3][3];
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                e[k][c] = mesh->vertices[3 * (size_t)mesh->faces[3 * (size_t)f + k] + c] - o[c];
        six_volumes += e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
                       e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
                       e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
    }
    return six_volumes / 6;
}

void pliant_mesh_vertex_areas(int32_t vertex_count, const double *vertices, int32_t face_count,
                              const int32_t *faces, double *areas)
{
    memset(areas, 0, (size_t)vertex_count * sizeof *areas);
    for (int32_t f = 0; f < face_count; f++) {
        const int32_t *v = faces + 3 * (size_t)f;
        const double *a = vertices + 3 * (size_t)v[0], *b = vertices + 3 * (size_t)v[1],
                     *c = vertices + 3 * (size_t)v[2];
        const double p[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const double q[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        const double n[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                             p[0] * q[1] - p[1] * q[0]};
        const double sixth = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 6;
        for (int k = 0; k < 3; k++) areas[v[k]] += sixth;
    }
}
