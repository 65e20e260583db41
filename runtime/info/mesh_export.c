// mesh_export.c: OBJ and PLY writers.
#include "mesh_export.h"

#include "pliant/error.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

pliant_mesh_format pliant_mesh_export_format(const char *path)
{
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    if (!dot || dot == name) return PLIANT_MESH_UNKNOWN;
    if (strcasecmp(dot, ".obj") == 0) return PLIANT_MESH_OBJ;
    if (strcasecmp(dot, ".ply") == 0) return PLIANT_MESH_PLY;
    return PLIANT_MESH_UNKNOWN;
}

// One level: the vertices are a prefix of the finest level's.
typedef struct level_mesh {
    int32_t vertex_count, face_count;
    const double *vertices;
    const int32_t *faces;
} level_mesh;

// 17 digits bring every double back as it was.
static void write_obj(const level_mesh *mesh, FILE *file)
{
    fputs("# Written by pliant-info; vertices in the model's order, coarse to fine.\n", file);
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const double *x = mesh->vertices + 3 * (size_t)v;
        fprintf(file, "v %.17g %.17g %.17g\n", x[0], x[1], x[2]);
    }
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const int32_t *v = mesh->faces + 3 * (size_t)f;
        fprintf(file, "f %d %d %d\n", (int)v[0] + 1, (int)v[1] + 1, (int)v[2] + 1);
    }
}

static void write_ply(const level_mesh *mesh, FILE *file)
{
    fprintf(file,
            "ply\nformat binary_little_endian 1.0\ncomment Written by pliant-info; vertices in the "
            "model's order, coarse to fine.\nelement vertex %d\nproperty double x\nproperty double "
            "y\nproperty double z\nelement face %d\nproperty list uchar int vertex_indices\n"
            "end_header\n",
            (int)mesh->vertex_count, (int)mesh->face_count);
    fwrite(mesh->vertices, 3 * sizeof *mesh->vertices, (size_t)mesh->vertex_count, file);
    for (int32_t f = 0; f < mesh->face_count; f++) {
        fputc(3, file);
        fwrite(mesh->faces + 3 * (size_t)f, sizeof *mesh->faces, 3, file);
    }
}

// Write, close and rename; on failure nothing of ours is left.
static pliant_status write_file(const level_mesh *mesh, const char *path, const char *temporary,
                                pliant_error *err)
{
    struct stat info;
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return pliant_error_set(err, PLIANT_ERR_IO,
                                "%.400s: expected a file to replace, found something else", path);
    errno = 0;
    FILE *file = fopen(temporary, "wbe");
    if (!file)
        return pliant_error_set(err, PLIANT_ERR_IO, "%.400s: %s", temporary, strerror(errno));
    if (pliant_mesh_export_format(path) == PLIANT_MESH_OBJ) write_obj(mesh, file);
    else write_ply(mesh, file);
    int failed = fflush(file) != 0 || ferror(file) || fsync(fileno(file)) != 0;
    int error = errno;
    if (fclose(file) != 0 && !failed) failed = 1, error = errno;
    if (!failed && rename(temporary, path) != 0) failed = 1, error = errno;
    if (!failed) return PLIANT_OK;
    unlink(temporary);
    return pliant_error_set(err, PLIANT_ERR_IO, "%.400s: %s", path, strerror(error ? error : EIO));
}

pliant_status pliant_mesh_export(const pliant_contents *contents, const char *path, int32_t level,
                                 pliant_error *err)
{
    const pliant_model_view *v = &contents->model;
    const char *name = pliant_reader_name(contents->reader);
    if (contents->kind != PLIANT_CONTENTS_MODEL)
        return pliant_error_set(err, PLIANT_ERR_MISSING,
                                "%.400s: expected a model to export, found a %s file", name,
                                pliant_contents_kind_text(contents->kind));
    if (level < 0) level = v->level_count - 1;
    if (level >= v->level_count)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%.400s: --level: expected 0 to %d, found %d", name,
                                (int)v->level_count - 1, (int)level);
    pliant_hierarchy *hierarchy = NULL;
    pliant_status status = pliant_contents_hierarchy(contents, &hierarchy, err);
    if (status < 0) return status;
    char *temporary = malloc(strlen(path) + sizeof ".tmp");
    if (temporary) {
        const level_mesh mesh = {
            .vertex_count = hierarchy->vertex_count[level],
            .face_count = hierarchy->face_count[level],
            .vertices = v->vertices,
            .faces = hierarchy->faces[level],
        };
        strcpy(temporary, path);
        strcat(temporary, ".tmp");
        status = write_file(&mesh, path, temporary, err);
    } else {
        status =
            pliant_error_set(err, PLIANT_ERR_MEMORY, "%.400s: expected memory, found none", path);
    }
    free(temporary);
    pliant_hierarchy_destroy(hierarchy);
    return status;
}
