// size_field.c: how long edges inside a solid should be.
#include "fem/size_field.h"

#include "mesh/nearest.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>

struct pliant_size_field {
    const pliant_mesh *surface;
    double growth;
    pliant_nearest *nearest;
    double *length;  // shape [vertex_count]: of the edges around a vertex, on average
};

double pliant_size_field_growth(int order)
{
    return order == 1 ? 1 : 1.1;
}

static double distance(const double *a, const double *b)
{
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

static pliant_status measure(pliant_size_field *field, pliant_error *err)
{
    const pliant_mesh *mesh = field->surface;
    int32_t *count = calloc((size_t)mesh->vertex_count + 1, sizeof *count);
    field->length = calloc((size_t)mesh->vertex_count + 1, sizeof *field->length);
    if (!count || !field->length) {
        free(count);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the sizes of elements");
    }
    // Every edge comes up once in each direction, as the surface is closed.
    for (int32_t f = 0; f < mesh->face_count; f++)
        for (int k = 0; k < 3; k++) {
            const int32_t a = mesh->faces[3 * (size_t)f + k],
                          b = mesh->faces[3 * (size_t)f + (k + 1) % 3];
            field->length[a] +=
                distance(mesh->vertices + 3 * (size_t)a, mesh->vertices + 3 * (size_t)b);
            count[a]++;
        }
    for (int32_t v = 0; v < mesh->vertex_count; v++) field->length[v] /= count[v] ? count[v] : 1;
    free(count);
    return PLIANT_OK;
}

pliant_status pliant_size_field_create(const pliant_mesh *surface, double growth,
                                       pliant_size_field **field, pliant_error *err)
{
    pliant_size_field *made = calloc(1, sizeof *made);
    if (!made)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the sizes of elements");
    made->surface = surface;
    made->growth = fmax(growth, 1);
    pliant_status status = measure(made, err);
    if (status == PLIANT_OK)
        status =
            pliant_nearest_create(surface->vertices, surface->vertex_count, &made->nearest, err);
    if (status < 0) {
        pliant_size_field_destroy(made);
        return status;
    }
    *field = made;
    return PLIANT_OK;
}

void pliant_size_field_destroy(pliant_size_field *field)
{
    if (!field) return;
    pliant_nearest_destroy(field->nearest);
    free(field->length);
    free(field);
}

// h (1 + 3 (growth - 1) d / h)^(1/3): growth - 1 is the slope at the surface.
double pliant_size_field_at(const pliant_size_field *field, const double x[3])
{
    const int32_t v = pliant_nearest_find(field->nearest, x);
    const double h = field->length[v], d = distance(x, field->surface->vertices + 3 * (size_t)v);
    return h > 0 ? h * cbrt(1 + 3 * (field->growth - 1) * d / h) : h;
}
