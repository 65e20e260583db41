// model.c: open a model file: map it, bind its sections, plan both domains' wavelets.
#include "model.h"

#include "pliant/error.h"
#include "pliant/hierarchy.h"
#include "pliant/mesh.h"

#include <math.h>
#include <stdlib.h>

static void lay_out(pliant_arena *arena, pliant_model *model)
{
    PLIANT_TAKE(arena, model->areas, model->vertex_count);
    PLIANT_TAKE(arena, model->position, model->vertex_count);
    PLIANT_TAKE(arena, model->domain, model->vertex_count);
    PLIANT_TAKE(arena, model->from_source, model->vertex_count);
}

static pliant_wavelet_def wavelet_of(const pliant_greens_view *greens)
{
    return (pliant_wavelet_def){
        .scheme = (pliant_wavelet_scheme)greens->summary[PLIANT_SUMMARY_WAVELET],
        .lifting = (pliant_wavelet_lifting)greens->summary[PLIANT_SUMMARY_LIFTED],
        .boundary = (pliant_wavelet_boundary)greens->summary[PLIANT_SUMMARY_BOUNDARY],
    };
}

static int32_t same_wavelet(pliant_wavelet_def a, pliant_wavelet_def b)
{
    return a.scheme == b.scheme && a.lifting == b.lifting && a.boundary == b.boundary;
}

static void bind_columns(const pliant_greens_view *greens, pliant_columns *columns)
{
    *columns = (pliant_columns){.count = greens->column_count,
                                .offset = greens->column_offset,
                                .row = greens->row,
                                .block = greens->block};
}

// Blocks of one row domain are summed before they are transformed back, so they must have been
// transformed alike.
static pliant_status bind_greens(pliant_model *model, pliant_error *err)
{
    const pliant_model_view *view = &model->view;
    const int32_t l = model->finest_level;
    const char *name = pliant_reader_name(model->reader);
    if (!view->greens[PLIANT_FREE_FREE][l].column_offset)
        return pliant_error_set(
            err, PLIANT_ERR_MISSING,
            "%s: /greens/free-free: expected the columns of level %d, found none", name, l);
    const int32_t has_supports = view->has_supports &&
                                 view->greens[PLIANT_FREE_FIXED][l].column_offset &&
                                 view->greens[PLIANT_FIXED_FREE][l].column_offset &&
                                 view->greens[PLIANT_FIXED_FIXED][l].column_offset;
    bind_columns(&view->greens[PLIANT_FREE_FREE][l], &model->greens[0][0]);
    if (!has_supports) return PLIANT_OK;
    bind_columns(&view->greens[PLIANT_FREE_FIXED][l], &model->greens[0][1]);
    bind_columns(&view->greens[PLIANT_FIXED_FREE][l], &model->greens[1][0]);
    bind_columns(&view->greens[PLIANT_FIXED_FIXED][l], &model->greens[1][1]);
    if (!same_wavelet(wavelet_of(&view->greens[PLIANT_FREE_FREE][l]),
                      wavelet_of(&view->greens[PLIANT_FREE_FIXED][l])) ||
        !same_wavelet(wavelet_of(&view->greens[PLIANT_FIXED_FREE][l]),
                      wavelet_of(&view->greens[PLIANT_FIXED_FIXED][l])))
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT,
            "%s: /greens: expected one wavelet for all columns of a row domain, "
            "found two",
            name);
    return PLIANT_OK;
}

static void index_vertices(pliant_model *model)
{
    const pliant_model_view *view = &model->view;
    for (int32_t d = 0; d < PLIANT_DOMAIN_COUNT; d++)
        for (int32_t p = 0; p < model->domains[d].count; p++) {
            model->position[model->domains[d].nodes[p]] = p;
            model->domain[model->domains[d].nodes[p]] = (uint8_t)d;
        }
    for (int32_t v = 0; v < model->vertex_count; v++) model->from_source[v] = -1;
    // Every input vertex is a model vertex, so input numbers beyond n come from no sound tool.
    for (int32_t v = model->vertex_count; v-- > 0;) {
        const int32_t source = view->source_index[v];
        if (source >= 0 && source < model->vertex_count) model->from_source[source] = v;
    }
}

// Wavelet weights and nodal forces divide by areas.
static pliant_status check_areas(const pliant_model *model, pliant_error *err)
{
    for (int32_t v = 0; v < model->vertex_count; v++)
        if (!(model->areas[v] > 0) || !isfinite(model->areas[v]))
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "/mesh: vertex %d: expected an area above 0, found %g", v,
                                    model->areas[v]);
    return PLIANT_OK;
}

static pliant_status plan_domains(pliant_model *model, pliant_error *err)
{
    const pliant_model_view *view = &model->view;
    const int32_t l = model->finest_level;
    model->domains[PLIANT_DOMAIN_FREE] = (pliant_model_domain){
        .count = view->free_count, .nodes = view->free_nodes, .gravity = view->gravity_free};
    model->domains[PLIANT_DOMAIN_FIXED] = (pliant_model_domain){
        .count = view->fixed_count, .nodes = view->fixed_nodes, .gravity = view->gravity_fixed};
    for (int32_t d = 0; d < PLIANT_DOMAIN_COUNT; d++) {
        pliant_model_domain *domain = &model->domains[d];
        const pliant_block_name block = d == PLIANT_DOMAIN_FIXED && model->greens[1][0].offset
                                            ? PLIANT_FIXED_FREE
                                            : PLIANT_FREE_FREE;
        const pliant_wavelet_def def = wavelet_of(&view->greens[block][l]);
        pliant_status status = pliant_wavelet_create(model->hierarchy, model->areas, domain->nodes,
                                                     domain->count, &def, &domain->wavelet, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

// All that is computed from the sections rather than mapped.
static pliant_status derive(pliant_model *model, pliant_error *err)
{
    const pliant_model_view *view = &model->view;
    pliant_status status =
        pliant_hierarchy_create(view->level_count, view->level_vertex_count, view->face_count,
                                view->faces, view->parents, &model->hierarchy, err);
    if (status < 0) return status;
    lay_out(&model->arena, model);
    status = pliant_arena_reserve(&model->arena, err);
    if (status < 0) return status;
    lay_out(&model->arena, model);
    pliant_mesh_vertex_areas(view->vertex_count, view->vertices, view->face_count, view->faces,
                             model->areas);
    status = check_areas(model, err);
    if (status < 0) return status;
    status = plan_domains(model, err);
    if (status < 0) return status;
    index_vertices(model);
    return PLIANT_OK;
}

pliant_status pliant_model_open(const char *path, pliant_model **result, pliant_error *err)
{
    if (!path || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_model_open: expected a path and a place, found NULL");
    pliant_model *model = calloc(1, sizeof *model);
    if (!model) return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for a model", path);

    pliant_status status = pliant_reader_open(path, &model->reader, err);
    if (status < 0) goto done;
    status = pliant_model_view_bind(model->reader, &model->view, err);
    if (status < 0) goto done;
    const pliant_model_view *view = &model->view;
    model->level_count = view->level_count;
    model->finest_level = view->level_count - 1;
    model->vertex_count = view->vertex_count;
    status = bind_greens(model, err);
    if (status < 0) goto done;

    // What follows knows no file, so its messages get the file's name here.
    pliant_error reason = {""};
    status = derive(model, &reason);
    if (status < 0) {
        (void)pliant_error_set(err, status, "%s: %.400s", path, reason.text);
        goto done;
    }
done:
    if (status < 0) {
        pliant_model_close(model);
        return status;
    }
    *result = model;
    return PLIANT_OK;
}

void pliant_model_close(pliant_model *model)
{
    if (!model) return;
    for (int32_t d = 0; d < PLIANT_DOMAIN_COUNT; d++)
        pliant_wavelet_destroy(model->domains[d].wavelet);
    pliant_arena_release(&model->arena);
    pliant_hierarchy_destroy(model->hierarchy);
    pliant_reader_close(model->reader);
    free(model);
}

pliant_status pliant_model_verify(const pliant_model *model, pliant_error *err)
{
    return pliant_reader_verify(model->reader, err);
}

pliant_model_info pliant_model_describe(const pliant_model *model)
{
    const pliant_model_view *view = &model->view;
    const double *summary = view->greens[PLIANT_FREE_FREE][model->finest_level].summary;
    return (pliant_model_info){
        .vertex_count = view->vertex_count,
        .face_count = view->face_count,
        .level_count = view->level_count,
        .free_count = view->free_count,
        .fixed_count = view->fixed_count,
        .young = view->material[0],
        .poisson = view->material[1],
        .density = view->material[2],
        .rms = summary[PLIANT_SUMMARY_RMS],
        .max = summary[PLIANT_SUMMARY_MAX],
        .factor = summary[PLIANT_SUMMARY_FACTOR],
        .has_supports = model->greens[1][1].offset != NULL,
    };
}

int32_t pliant_model_level_vertex_count(const pliant_model *model, int32_t level)
{
    return level < 0 || level > model->finest_level ? 0 : model->hierarchy->vertex_count[level];
}

int32_t pliant_model_level_face_count(const pliant_model *model, int32_t level)
{
    return level < 0 || level > model->finest_level ? 0 : model->hierarchy->face_count[level];
}

const double *pliant_model_positions(const pliant_model *model)
{
    return model->view.vertices;
}

const int32_t *pliant_model_faces(const pliant_model *model, int32_t level)
{
    return level < 0 || level > model->finest_level ? NULL : model->hierarchy->faces[level];
}

int32_t pliant_model_from_source(const pliant_model *model, int32_t source)
{
    return source < 0 || source >= model->vertex_count ? -1 : model->from_source[source];
}

int32_t pliant_model_is_free(const pliant_model *model, int32_t vertex)
{
    if (vertex < 0 || vertex >= model->vertex_count) return -1;
    return model->domain[vertex] == PLIANT_DOMAIN_FREE;
}

double pliant_model_area(const pliant_model *model, int32_t vertex)
{
    return vertex < 0 || vertex >= model->vertex_count ? 0 : model->areas[vertex];
}

int32_t pliant_model_nearest(const pliant_model *model, const double *position)
{
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    int32_t nearest = -1;
    double least = 0;
    for (int32_t p = 0; p < domain->count; p++) {
        const double *x = model->view.vertices + 3 * (size_t)domain->nodes[p];
        double distance = 0;
        for (int c = 0; c < 3; c++) distance += (x[c] - position[c]) * (x[c] - position[c]);
        if (nearest >= 0 && distance >= least) continue;
        nearest = domain->nodes[p];
        least = distance;
    }
    return nearest;
}
