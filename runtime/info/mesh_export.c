// mesh_export.c: OBJ and PLY writers.
#include "mesh_export.h"

#include "pliant/error.h"
#include "pliant/pliant.h"

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

// One level, whose vertices are a prefix of the finest level's, or the detail.
typedef struct level_mesh {
    int32_t vertex_count, face_count;
    int digits;  // that bring every coordinate back as it was: 17 of a double, 9 of a float
    const double *vertices;
    const int32_t *faces;
} level_mesh;

static void write_obj(const level_mesh *mesh, FILE *file)
{
    fputs("# Written by pliant-info; vertices in the model's order, coarse to fine.\n", file);
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const double *x = mesh->vertices + 3 * (size_t)v;
        fprintf(file, "v %.*g %.*g %.*g\n", mesh->digits, x[0], mesh->digits, x[1], mesh->digits,
                x[2]);
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

// Write under a temporary name, and move it to its place.
static pliant_status place_file(const level_mesh *mesh, const char *path, pliant_error *err)
{
    char *temporary = malloc(strlen(path) + sizeof ".tmp");
    if (!temporary)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%.400s: expected memory, found none",
                                path);
    strcpy(temporary, path);
    strcat(temporary, ".tmp");
    const pliant_status status = write_file(mesh, path, temporary, err);
    free(temporary);
    return status;
}

static pliant_status check_kind(const pliant_contents *contents, pliant_error *err)
{
    if (contents->kind == PLIANT_CONTENTS_MODEL) return PLIANT_OK;
    return pliant_error_set(
        err, PLIANT_ERR_MISSING, "%.400s: expected a model to export, found a %s file",
        pliant_reader_name(contents->reader), pliant_contents_kind_text(contents->kind));
}

pliant_status pliant_mesh_export(const pliant_contents *contents, const char *path, int32_t level,
                                 pliant_error *err)
{
    const pliant_model_view *v = &contents->model;
    pliant_status status = check_kind(contents, err);
    if (status < 0) return status;
    if (level < 0) level = v->level_count - 1;
    if (level >= v->level_count)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT, "%.400s: --level: expected 0 to %d, found %d",
            pliant_reader_name(contents->reader), (int)v->level_count - 1, (int)level);
    pliant_hierarchy *hierarchy = NULL;
    status = pliant_contents_hierarchy(contents, &hierarchy, err);
    if (status < 0) return status;
    const level_mesh mesh = {
        .vertex_count = hierarchy->vertex_count[level],
        .face_count = hierarchy->face_count[level],
        .digits = 17,
        .vertices = v->vertices,
        .faces = hierarchy->faces[level],
    };
    status = place_file(&mesh, path, err);
    pliant_hierarchy_destroy(hierarchy);
    return status;
}

pliant_status pliant_mesh_export_detail(const pliant_contents *contents, const char *path,
                                        pliant_error *err)
{
    pliant_model *model = NULL;
    pliant_detail *detail = NULL;
    pliant_vec3 *positions = NULL;
    double *vertices = NULL;
    pliant_status status = check_kind(contents, err);
    if (status < 0) return status;
    status = pliant_model_open(pliant_reader_name(contents->reader), &model, err);
    if (status < 0) return status;
    status = pliant_detail_create(model, contents->model.level_count - 1, &detail, err);
    if (status < 0) goto done;
    const pliant_detail_info info = pliant_detail_describe(detail);
    positions = malloc((size_t)info.vertex_count * sizeof *positions);
    vertices = malloc(3 * (size_t)info.vertex_count * sizeof *vertices);
    if (!positions || !vertices) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%.400s: no memory for %d vertices", path,
                                  (int)info.vertex_count);
        goto done;
    }
    status = pliant_detail_evaluate(detail, NULL, positions, NULL);
    for (int32_t i = 0; i < info.vertex_count; i++) {
        vertices[3 * (size_t)i] = (double)positions[i].x;
        vertices[3 * (size_t)i + 1] = (double)positions[i].y;
        vertices[3 * (size_t)i + 2] = (double)positions[i].z;
    }
    const level_mesh mesh = {
        .vertex_count = info.vertex_count,
        .face_count = info.face_count,
        .digits = 9,
        .vertices = vertices,
        .faces = pliant_detail_faces(detail),
    };
    if (status >= 0) status = place_file(&mesh, path, err);
done:
    free(vertices);
    free(positions);
    pliant_detail_destroy(detail);
    pliant_model_close(model);
    return status;
}
