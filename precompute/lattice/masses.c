// masses.c: what every particle of a lattice weighs.
#include "lattice/masses.h"

#include "lattice/cell_measure.h"
#include "mesh/nearest.h"
#include "mesh/file_bytes.h"
#include "mesh/text_cursor.h"

#include "pliant/error.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Least share of a cell, of the mean.
static const double least_share = 0.125;

pliant_status pliant_masses_share(const pliant_mesh *mesh, const pliant_voxels *voxels,
                                  const int32_t *corners, int32_t particle_count, double *share,
                                  pliant_error *err)
{
    const int32_t cell_count = voxels->cell_count;
    double *volume = malloc((size_t)cell_count * sizeof *volume);
    double *area = malloc((size_t)cell_count * sizeof *area);
    pliant_status status = PLIANT_OK;
    if (!volume || !area)
        status =
            pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to share out %d cells", cell_count);
    if (status == PLIANT_OK) status = pliant_cell_measure(mesh, voxels, volume, area, err);
    if (status < 0) goto done;
    const double *measure = voxels->filling == PLIANT_VOXELS_SOLID ? volume : area;
    double mean = 0, sum = 0;
    for (int32_t i = 0; i < cell_count; i++) mean += fmax(measure[i], 0) / cell_count;
    const double least = least_share * mean;
    for (int32_t i = 0; i < cell_count; i++) sum += fmax(measure[i], least);
    const double scale = fabs(pliant_mesh_volume(mesh)) / (8 * sum);
    memset(share, 0, (size_t)particle_count * sizeof *share);
    for (int32_t i = 0; i < cell_count; i++)
        for (int c = 0; c < 8; c++)
            share[corners[8 * (size_t)i + (size_t)c]] += scale * fmax(measure[i], least);
done:
    free(area);
    free(volume);
    return status;
}

// The vertices that have a density: their positions and numbers. *count 0: none.
static pliant_status gather_known(const pliant_mesh *mesh, const double *densities, double **points,
                                  int32_t **vertices, int32_t *count, pliant_error *err)
{
    const size_t room = (size_t)mesh->vertex_count + 1;
    *points = malloc(3 * room * sizeof **points);
    *vertices = malloc(room * sizeof **vertices);
    *count = 0;
    if (!*points || !*vertices)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d densities",
                                mesh->vertex_count);
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        if (isnan(densities[v])) continue;
        memcpy(*points + 3 * (size_t)*count, mesh->vertices + 3 * (size_t)v, 3 * sizeof **points);
        (*vertices)[(*count)++] = v;
    }
    if (*count > 0) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                            "expected a density of some vertex, found none");
}

pliant_status pliant_masses_weigh(const pliant_mesh *mesh, const pliant_voxel_grid *grid,
                                  int32_t particle_count, const int32_t *particles,
                                  const double *share, double density, const double *densities,
                                  float *mass, double *total, pliant_error *err)
{
    double *points = NULL;
    int32_t *vertices = NULL, count = 0;
    pliant_nearest *nearest = NULL;
    pliant_status status = PLIANT_OK;
    if (densities) {
        status = gather_known(mesh, densities, &points, &vertices, &count, err);
        if (status == PLIANT_OK) status = pliant_nearest_create(points, count, &nearest, err);
    }
    *total = 0;
    for (int32_t i = 0; i < particle_count && status == PLIANT_OK; i++) {
        double here = density;
        if (densities) {
            double x[3];
            for (int d = 0; d < 3; d++)
                x[d] = grid->origin[d] + grid->size * particles[3 * (size_t)i + (size_t)d];
            here = densities[vertices[pliant_nearest_find(nearest, x)]];
        }
        const double exact = here * share[i];
        if (!(exact >= FLT_MIN && exact <= FLT_MAX))
            status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                      "particle %d of %d weighs %g: expected a mass from %g to %g",
                                      i, particle_count, exact, FLT_MIN, FLT_MAX);
        else *total += mass[i] = (float)exact;
    }
    pliant_nearest_destroy(nearest);
    free(vertices);
    free(points);
    return status;
}

// ---- Files ----

static pliant_status parse_densities(const char *name, pliant_file_bytes bytes,
                                     int32_t vertex_count, double *densities, pliant_error *err)
{
    pliant_text_cursor cursor = pliant_text_cursor_begin(name, bytes.data, bytes.size);
    cursor.comment = '#';
    int64_t count = 0;
    do {
        pliant_text_word word;
        while ((word = pliant_text_cursor_word(&cursor)).text) {
            double density;
            if (!pliant_text_word_number(word, &density) || !isfinite(density) || !(density > 0))
                return pliant_text_cursor_refuse(&cursor, word, "a density over 0", err);
            if (count < vertex_count) densities[count] = density;
            count++;
        }
    } while (pliant_text_cursor_line(&cursor));
    if (count == vertex_count) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: expected %d densities, one a vertex, found %lld", name,
                            vertex_count, (long long)count);
}

pliant_status pliant_masses_read(const char *path, int32_t vertex_count, double *densities,
                                 pliant_error *err)
{
    char text[PLIANT_FILE_NAME_SIZE];
    const char *name = pliant_file_bytes_name(path, text);
    pliant_file_bytes bytes = {0};
    pliant_status status = pliant_file_bytes_open(path, name, &bytes, err);
    if (status < 0) return status;
    status = parse_densities(name, bytes, vertex_count, densities, err);
    pliant_file_bytes_close(&bytes);
    return status;
}
