// embedding.c: how a mesh's vertices hang in the cells of a lattice (LSM-15..17).
#include "lattice/embedding.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A sum of unit normals times angles is direction enough above this; below, where faces fold back
// on each other, one face's normal serves.
static const double least_normal = 1e-6;

static double length_of(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int d = 0; d < 3; d++)
        c[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

// The unit normal of a face; zero for one without.
static void face_normal(const pliant_mesh *mesh, int32_t face, double n[3])
{
    const double *x[3];
    double e[3], f[3];
    for (int c = 0; c < 3; c++)
        x[c] = mesh->vertices + 3 * (size_t)mesh->faces[3 * (size_t)face + c];
    for (int d = 0; d < 3; d++) {
        e[d] = x[1][d] - x[0][d];
        f[d] = x[2][d] - x[0][d];
    }
    cross(e, f, n);
    const double length = length_of(n);
    for (int d = 0; d < 3; d++) n[d] = length > 0 ? n[d] / length : 0;
}

// The angle of a face at its corner c.
static double angle_at(const pliant_mesh *mesh, int32_t face, int c)
{
    const int32_t *v = mesh->faces + 3 * (size_t)face;
    const double *x = mesh->vertices + 3 * (size_t)v[c];
    const double *y = mesh->vertices + 3 * (size_t)v[(c + 1) % 3];
    const double *z = mesh->vertices + 3 * (size_t)v[(c + 2) % 3];
    double e[3], f[3], n[3], cosine = 0;
    for (int d = 0; d < 3; d++) {
        e[d] = y[d] - x[d];
        f[d] = z[d] - x[d];
        cosine += e[d] * f[d];
    }
    cross(e, f, n);
    return atan2(length_of(n), cosine);
}

// `normals` has shape [vertex_count][3] and is zero.
static void find_normals(const pliant_mesh *mesh, double *normals)
{
    for (int32_t f = 0; f < mesh->face_count; f++) {
        double n[3];
        face_normal(mesh, f, n);
        for (int c = 0; c < 3; c++) {
            const double angle = angle_at(mesh, f, c);
            double *sum = normals + 3 * (size_t)mesh->faces[3 * (size_t)f + c];
            for (int d = 0; d < 3; d++) sum[d] += angle * n[d];
        }
    }
    // Where the sum has no direction, the normal of the first face there that has one.
    for (int32_t f = 0; f < mesh->face_count; f++)
        for (int c = 0; c < 3; c++) {
            double *sum = normals + 3 * (size_t)mesh->faces[3 * (size_t)f + c];
            if (length_of(sum) < least_normal) face_normal(mesh, f, sum);
        }
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        double *n = normals + 3 * (size_t)v;
        const double length = length_of(n);
        for (int d = 0; d < 3; d++) n[d] = length > 0 ? n[d] / length : d == 2;
    }
}

// U and V with U x V = n: T. Duff et al., Building an orthonormal basis, revisited, Journal of
// Computer Graphics Techniques 6(1), 2017.
static void find_tangents(const double n[3], float tangents[6])
{
    const double sign = copysign(1, n[2]);
    const double a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    const double u[3] = {1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
    const double v[3] = {b, sign + n[1] * n[1] * a, -n[1]};
    for (int d = 0; d < 3; d++) {
        tangents[d] = (float)u[d];
        tangents[3 + d] = (float)v[d];
    }
}

// The cell that holds a position, and where in it.
static int32_t hold(const pliant_voxels *voxels, const double position[3], float offset[3])
{
    double x[3];
    int32_t at[3];
    pliant_voxel_grid_locate(&voxels->grid, position, x);
    for (int d = 0; d < 3; d++) {
        const int32_t last = voxels->grid.dims[d] - 1;
        at[d] = x[d] < 0 ? 0 : x[d] > last ? last : (int32_t)x[d];
        const double part = x[d] - at[d];
        offset[d] = (float)(part < 0 ? 0 : part > 1 ? 1 : part);
    }
    return pliant_cell_set_find(voxels->set, at[0], at[1], at[2]);
}

pliant_status pliant_embedding_create(const pliant_mesh *mesh, const pliant_voxels *voxels,
                                      pliant_embedding **embedding, pliant_error *err)
{
    const size_t n = (size_t)mesh->vertex_count;
    double *normals = calloc(3 * n + 1, sizeof *normals);
    pliant_embedding *e = calloc(1, sizeof *e);
    pliant_status status = PLIANT_OK;
    if (e) {
        e->vertex_count = mesh->vertex_count;
        e->cell = malloc((n + 1) * sizeof *e->cell);
        e->offset = malloc((3 * n + 1) * sizeof *e->offset);
        e->tangents = malloc((6 * n + 1) * sizeof *e->tangents);
    }
    if (!normals || !e || !e->cell || !e->offset || !e->tangents) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to embed %d vertices",
                                  mesh->vertex_count);
        goto done;
    }
    find_normals(mesh, normals);
    for (size_t v = 0; v < n && status == PLIANT_OK; v++) {
        e->cell[v] = hold(voxels, mesh->vertices + 3 * v, e->offset + 3 * v);
        if (e->cell[v] < 0)
            status =
                pliant_error_set(err, PLIANT_ERR_FORMAT,
                                 "vertex %zu lies in no cell: the mesh is not the voxels' own", v);
        find_tangents(normals + 3 * v, e->tangents + 6 * v);
    }
done:
    free(normals);
    if (status < 0) pliant_embedding_destroy(e);
    else *embedding = e;
    return status;
}

void pliant_embedding_destroy(pliant_embedding *embedding)
{
    if (!embedding) return;
    free(embedding->tangents);
    free(embedding->offset);
    free(embedding->cell);
    free(embedding);
}
