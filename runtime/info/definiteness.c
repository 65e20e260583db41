// definiteness.c: how definite a model's stored contact compliance is, level by level.
#include "definiteness.h"

#include "pliant/compliance.h"
#include "pliant/error.h"
#include "pliant/mesh.h"

#include <math.h>
#include <stdlib.h>

// Two runs find the same number to the residuals of both, 1e-3 each.
static const double stored_tolerance = 3e-3;

double pliant_definiteness_ratio(const pliant_lanczos_result *level)
{
    return level->largest != 0 ? level->smallest / level->largest : 0;
}

static pliant_status check_areas(const char *name, int32_t count, const double *areas,
                                 pliant_error *err)
{
    for (int32_t v = 0; v < count; v++)
        if (!(areas[v] > 0) || !isfinite(areas[v]))
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%.250s: /mesh: vertex %d: expected an area above 0, found %g",
                                    name, (int)v, areas[v]);
    return PLIANT_OK;
}

static pliant_status measure_level(const pliant_contents *contents, const pliant_wavelet *wavelet,
                                   const pliant_hats *hats, int32_t level,
                                   pliant_lanczos_result *result, pliant_error *err)
{
    const pliant_greens_view *g = &contents->model.greens[PLIANT_FREE_FREE][level];
    const char *name = pliant_reader_name(contents->reader);
    if (!g->column_offset || g->column_count == 0) return PLIANT_OK;
    const pliant_compliance_def def = {.wavelet = wavelet,
                                       .hats = hats,
                                       .level = level,
                                       .columns = {.count = g->column_count,
                                                   .offset = g->column_offset,
                                                   .row = g->row,
                                                   .block = g->block}};
    pliant_error reason = {""};
    const pliant_status status = pliant_compliance_eigenvalues(&def, result, &reason);
    if (status < 0)
        return pliant_error_set(err, status, "%.250s: /greens/free-free/level%d: %.200s", name,
                                (int)level, reason.text);
    const double stored = g->summary[PLIANT_SUMMARY_DEFINITE];
    if (stored == 0 || fabs(stored - result->smallest) <= stored_tolerance * (1 + fabs(stored)))
        return PLIANT_OK;
    return pliant_error_set(
        err, PLIANT_ERR_FORMAT,
        "%.250s: /greens/free-free/level%d: smallest eigenvalue: expected %g as stored, found %g",
        name, (int)level, stored, result->smallest);
}

pliant_status pliant_definiteness_measure(const pliant_contents *contents,
                                          pliant_definiteness *definiteness, pliant_error *err)
{
    const pliant_model_view *v = &contents->model;
    const char *name = pliant_reader_name(contents->reader);
    *definiteness = (pliant_definiteness){.levels = {{.steps = 0}}};
    pliant_hierarchy *hierarchy = NULL;
    pliant_wavelet *wavelet = NULL;
    pliant_hats *hats = NULL;
    double *areas = malloc((size_t)v->vertex_count * sizeof *areas);
    pliant_status status =
        areas ? PLIANT_OK
              : pliant_error_set(err, PLIANT_ERR_MEMORY, "%.250s: no memory for %d vertices", name,
                                 (int)v->vertex_count);
    if (status == PLIANT_OK) status = pliant_contents_hierarchy(contents, &hierarchy, err);
    if (status < 0) goto done;
    pliant_mesh_vertex_areas(v->vertex_count, v->vertices, v->face_count, v->faces, areas);
    if ((status = check_areas(name, v->vertex_count, areas, err)) < 0) goto done;
    for (int32_t l = 0; l < v->level_count && status == PLIANT_OK; l++) {
        const double *summary = v->greens[PLIANT_FREE_FREE][l].summary;
        if (!summary) continue;
        const pliant_wavelet_def def = {(pliant_wavelet_scheme)summary[PLIANT_SUMMARY_WAVELET],
                                        (pliant_wavelet_lifting)summary[PLIANT_SUMMARY_LIFTED],
                                        (pliant_wavelet_boundary)summary[PLIANT_SUMMARY_BOUNDARY]};
        // Levels may have been transformed differently, as far as the format goes.
        status = pliant_wavelet_create(hierarchy, areas, v->free_nodes, v->free_count, &def,
                                       &wavelet, err);
        if (status == PLIANT_OK)
            status = pliant_hats_create(wavelet, v->free_nodes, areas, &hats, err);
        if (status == PLIANT_OK)
            status = measure_level(contents, wavelet, hats, l, &definiteness->levels[l], err);
        pliant_hats_destroy(hats);
        pliant_wavelet_destroy(wavelet);
        hats = NULL;
        wavelet = NULL;
    }
done:
    pliant_hierarchy_destroy(hierarchy);
    free(areas);
    return status;
}
