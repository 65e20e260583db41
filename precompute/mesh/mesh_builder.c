// mesh_builder.c: a mesh that grows while a file is read: vertices, then polygons.
#include "mesh_builder.h"

#include "pliant/error.h"
#include "polygon.h"
#include "weld.h"

#include <stdlib.h>
#include <string.h>

enum {
    // Three half-edges per face are counted in 32 bits.
    FACE_LIMIT = INT32_MAX / 3,
    VERTEX_LIMIT = INT32_MAX / 3,
    FIRST_CAPACITY = 1024,
};

pliant_mesh_builder pliant_mesh_builder_begin(const char *name)
{
    return (pliant_mesh_builder){.name = name};
}

void pliant_mesh_builder_end(pliant_mesh_builder *b)
{
    free(b->vertices);
    free(b->faces);
    free(b->corners);
    *b = (pliant_mesh_builder){.name = b->name};
}

// Room for `more` more items of that size, doubling. Returns the array, moved perhaps, or NULL.
static void *grow(void *array, int32_t *capacity, int32_t count, int32_t more, size_t size)
{
    const int64_t wanted = (int64_t)count + more;
    if (wanted <= *capacity) return array;
    int64_t larger = *capacity ? *capacity : FIRST_CAPACITY;
    while (larger < wanted) larger *= 2;
    if (larger > INT32_MAX) larger = INT32_MAX;
    void *moved = realloc(array, (size_t)larger * size);
    if (moved) *capacity = (int32_t)larger;
    return moved;
}

static pliant_status refuse_memory(const pliant_mesh_builder *b, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY,
                            "%s: no memory for more than %d vertices, %d faces", b->name,
                            b->vertex_count, b->face_count);
}

pliant_status pliant_mesh_builder_vertex(pliant_mesh_builder *b, const double x[3],
                                         pliant_error *err)
{
    if (b->vertex_count == VERTEX_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: more than %d vertices", b->name,
                                VERTEX_LIMIT);
    void *moved = grow(b->vertices, &b->vertex_capacity, b->vertex_count, 1, 3 * sizeof(double));
    if (!moved) return refuse_memory(b, err);
    b->vertices = moved;
    memcpy(b->vertices + 3 * (size_t)b->vertex_count++, x, 3 * sizeof(double));
    return PLIANT_OK;
}

// "name:line: face REASON" where the file has lines, else "name: face N REASON".
static pliant_status refuse_face(const pliant_mesh_builder *b, pliant_error *err,
                                 const char *reason)
{
    if (b->line > 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s:%lld: face %s", b->name,
                                (long long)b->line, reason);
    return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: face %lld %s", b->name,
                            (long long)b->polygon_count, reason);
}

pliant_status pliant_mesh_builder_corner(pliant_mesh_builder *b, int64_t index, int64_t written,
                                         pliant_error *err)
{
    if (index < 0 || index >= b->vertex_count) {
        pliant_error reason;
        (void)pliant_error_set(&reason, PLIANT_ERR_FORMAT, "refers to vertex %lld of %d",
                               (long long)written, b->vertex_count);
        return refuse_face(b, err, reason.text);
    }
    if (b->corner_count == PLIANT_POLYGON_CORNER_LIMIT) {
        pliant_error reason;
        (void)pliant_error_set(&reason, PLIANT_ERR_FORMAT, "has more than %d corners",
                               PLIANT_POLYGON_CORNER_LIMIT);
        return refuse_face(b, err, reason.text);
    }
    void *moved = grow(b->corners, &b->corner_capacity, b->corner_count, 1, sizeof *b->corners);
    if (!moved) return refuse_memory(b, err);
    b->corners = moved;
    b->corners[b->corner_count++] = (int32_t)index;
    return PLIANT_OK;
}

// Many programs write a triangle as a quadrilateral with a corner said twice.
static void merge_repeated(pliant_mesh_builder *b)
{
    int32_t kept = 1, left = b->corner_count;
    for (int32_t i = 1; i < b->corner_count; i++) {
        if (left > 3 && b->corners[i] == b->corners[kept - 1]) left--;
        else b->corners[kept++] = b->corners[i];
    }
    while (kept > 3 && b->corners[kept - 1] == b->corners[0]) kept--;
    b->corner_count = kept;
}

pliant_status pliant_mesh_builder_polygon(pliant_mesh_builder *b, pliant_error *err)
{
    if (b->corner_count < 3) {
        pliant_error reason;
        (void)pliant_error_set(&reason, PLIANT_ERR_FORMAT, "has %d corner%s, expected at least 3",
                               b->corner_count, b->corner_count == 1 ? "" : "s");
        return refuse_face(b, err, reason.text);
    }
    merge_repeated(b);
    const int32_t added = b->corner_count - 2;
    if (b->face_count > FACE_LIMIT - added)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: more than %d triangles", b->name,
                                FACE_LIMIT);
    void *moved = grow(b->faces, &b->face_capacity, b->face_count, added, 3 * sizeof(int32_t));
    if (!moved) return refuse_memory(b, err);
    b->faces = moved;
    const pliant_status status = pliant_polygon_split(b->vertices, b->corners, b->corner_count,
                                                      b->faces + 3 * (size_t)b->face_count, err);
    if (status < 0) return status;
    b->face_count += added;
    b->polygon_count++;
    b->corner_count = 0;
    return PLIANT_OK;
}

pliant_status pliant_mesh_builder_weld(pliant_mesh_builder *b, pliant_error *err)
{
    if (b->vertex_count == 0) return PLIANT_OK;
    int32_t *number = malloc((size_t)b->vertex_count * sizeof *number);
    if (!number) return refuse_memory(b, err);
    int32_t distinct;
    const pliant_status status =
        pliant_weld_points(b->vertices, b->vertex_count, number, &distinct, err);
    if (status < 0) {
        free(number);
        return status;
    }
    // number[i] is the first vertex on i's place; i >= number[i], so it has been renumbered before.
    int32_t kept = 0;
    for (int32_t i = 0; i < b->vertex_count; i++) {
        if (number[i] == i) {
            memmove(b->vertices + 3 * (size_t)kept, b->vertices + 3 * (size_t)i,
                    3 * sizeof(double));
            number[i] = kept++;
        } else {
            number[i] = number[number[i]];
        }
    }
    b->vertex_count = kept;
    int32_t faces = 0;
    for (int32_t f = 0; f < b->face_count; f++) {
        const int32_t *face = b->faces + 3 * (size_t)f;
        const int32_t v[3] = {number[face[0]], number[face[1]], number[face[2]]};
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        memcpy(b->faces + 3 * (size_t)faces++, v, sizeof v);
    }
    b->face_count = faces;
    free(number);
    return PLIANT_OK;
}

pliant_status pliant_mesh_builder_finish(const pliant_mesh_builder *b, pliant_mesh **mesh,
                                         pliant_error *err)
{
    if (b->vertex_count == 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: there are no vertices: is it a mesh of that format?", b->name);
    if (b->face_count == 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: there are %d vertices, but no faces",
                                b->name, b->vertex_count);
    pliant_mesh *m;
    const pliant_status status = pliant_mesh_create(b->vertex_count, b->face_count, &m, err);
    if (status < 0) return status;
    memcpy(m->vertices, b->vertices, (size_t)b->vertex_count * 3 * sizeof(double));
    memcpy(m->faces, b->faces, (size_t)b->face_count * 3 * sizeof(int32_t));
    *mesh = m;
    return PLIANT_OK;
}
