// mesh_output.c: a triangle mesh written for other programs.
#include "remesh/mesh_output.h"

#include "pliant/error.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static int ends_in(const char *path, const char *extension)
{
    const size_t length = strlen(path), tail = strlen(extension);
    return length > tail && strcasecmp(path + length - tail, extension) == 0;
}

int pliant_mesh_output_is_known(const char *path)
{
    return ends_in(path, ".obj") || ends_in(path, ".ply");
}

static void write_obj(FILE *file, const pliant_mesh *mesh)
{
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const double *x = mesh->vertices + 3 * (size_t)v;
        fprintf(file, "v %.17g %.17g %.17g\n", x[0], x[1], x[2]);
    }
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const int32_t *v = mesh->faces + 3 * (size_t)f;
        fprintf(file, "f %d %d %d\n", v[0] + 1, v[1] + 1, v[2] + 1);
    }
}

// Numbers are those of this machine: little-endian, as the model file is.
static void write_ply(FILE *file, const pliant_mesh *mesh)
{
    fprintf(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty double x\nproperty "
        "double y\n"
        "property double z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n",
        mesh->vertex_count, mesh->face_count);
    fwrite(mesh->vertices, sizeof(double), 3 * (size_t)mesh->vertex_count, file);
    for (int32_t f = 0; f < mesh->face_count; f++) {
        fputc(3, file);
        fwrite(mesh->faces + 3 * (size_t)f, sizeof(int32_t), 3, file);
    }
}

pliant_status pliant_mesh_output_write(const char *path, const pliant_mesh *mesh, pliant_error *err)
{
    char temporary[4096];
    if (!pliant_mesh_output_is_known(path))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: expected a name that ends in .obj or .ply", path);
    if ((size_t)snprintf(temporary, sizeof temporary, "%s.tmp", path) >= sizeof temporary)
        return pliant_error_set(err, PLIANT_ERR_IO, "%.100s...: the name is too long", path);
    FILE *file = fopen(temporary, "wb");
    if (!file) return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", temporary, strerror(errno));
    if (ends_in(path, ".obj")) write_obj(file, mesh);
    else write_ply(file, mesh);
    const int failed = ferror(file);
    if (fclose(file) != 0 || failed || rename(temporary, path) != 0) {
        const int reason = errno;
        remove(temporary);
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", path, strerror(reason));
    }
    return PLIANT_OK;
}
