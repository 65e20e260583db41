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
    for (int32_t l = 0; l < model->level_count; l++)
        PLIANT_TAKE(arena, model->node_areas[l], model->hierarchy->vertex_count[l]);
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
// transformed alike, whatever their level.
static pliant_status bind_greens(pliant_model *model, pliant_error *err)
{
    const pliant_model_view *view = &model->view;
    const int32_t blocks = view->has_supports ? PLIANT_BLOCK_COUNT : 1;
    if (!view->has_greens) return PLIANT_OK;
    for (int32_t l = 0; l < view->level_count; l++) {
        if (!view->greens[PLIANT_FREE_FREE][l].column_offset) continue;
        if (model->stored_levels == 0) model->coarsest_stored = l;
        model->finest_stored = l;
        model->stored_levels |= 1u << l;
        for (int32_t b = 0; b < blocks; b++)
            bind_columns(&view->greens[b][l], &model->greens[b / 2][b % 2][l]);
    }
    // The view has made sure that there is a level, and that each has all blocks or the first.
    for (int32_t b = 0; b < blocks; b++) {
        const pliant_greens_view *first = &view->greens[b / 2 * 2][model->finest_stored];
        for (int32_t l = 0; l < view->level_count; l++)
            if (view->greens[b][l].column_offset &&
                !same_wavelet(wavelet_of(first), wavelet_of(&view->greens[b][l])))
                return pliant_error_set(
                    err, PLIANT_ERR_FORMAT,
                    "%s: /greens/%s/level%d: expected one wavelet for all columns of a row domain, "
                    "found two",
                    pliant_reader_name(model->reader), pliant_block_text((pliant_block_name)b), l);
    }
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

static void sum_areas(pliant_model *model)
{
    const pliant_hierarchy *h = model->hierarchy;
    const int32_t base = h->vertex_count[0];
    for (int32_t l = model->finest_level; l >= 0; l--) {
        const int32_t count = h->vertex_count[l];
        const double *finer = l < model->finest_level ? model->node_areas[l + 1] : model->areas;
        double *areas = model->node_areas[l];
        for (int32_t v = 0; v < count; v++) areas[v] = finer[v];
        if (l == model->finest_level) continue;
        for (int32_t m = count; m < h->vertex_count[l + 1]; m++)
            for (int side = 0; side < 2; side++) {
                const int32_t parent = h->stencils[m - base].parents[side];
                if (model->domain[parent] == model->domain[m]) areas[parent] += finer[m] / 2;
            }
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
    const int32_t l = model->finest_stored;
    if (!view->has_greens) return PLIANT_OK;
    model->domains[PLIANT_DOMAIN_FREE] = (pliant_model_domain){
        .count = view->free_count, .nodes = view->free_nodes, .gravity = view->gravity_free};
    model->domains[PLIANT_DOMAIN_FIXED] = (pliant_model_domain){
        .count = view->fixed_count, .nodes = view->fixed_nodes, .gravity = view->gravity_fixed};
    for (int32_t d = 0; d < PLIANT_DOMAIN_COUNT; d++) {
        pliant_model_domain *domain = &model->domains[d];
        const pliant_block_name block = d == PLIANT_DOMAIN_FIXED && view->has_supports
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
    sum_areas(model);
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

pliant_status pliant_model_check_greens(const pliant_model *model, pliant_error *err)
{
    if (model->view.has_greens) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MISSING,
                            "%s: expected Green's functions, found a lattice only (made with "
                            "--no-greens)",
                            pliant_reader_name(model->reader));
}

pliant_model_info pliant_model_describe(const pliant_model *model)
{
    static const double none[PLIANT_SUMMARY_COUNT] = {0};
    const pliant_model_view *view = &model->view;
    const double *stored = view->greens[PLIANT_FREE_FREE][model->finest_stored].summary;
    const double *summary = stored ? stored : none;
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
        .has_supports = view->has_supports,
        .coarsest_constraint_level = model->coarsest_stored,
        .finest_constraint_level = model->finest_stored,
        .detail_steps = view->detail_steps,
        .detail_vertex_count = view->detail_vertex_count,
    };
}

pliant_level_info pliant_model_level(const pliant_model *model, int32_t level)
{
    if (level < 0 || level > model->finest_level) return (pliant_level_info){0};
    pliant_level_info info = {.vertex_count = model->hierarchy->vertex_count[level]};
    if (!(model->stored_levels >> level & 1)) return info;
    const pliant_greens_view *greens = &model->view.greens[PLIANT_FREE_FREE][level];
    info.column_count = greens->column_count;
    info.rms = greens->summary[PLIANT_SUMMARY_RMS];
    info.max = greens->summary[PLIANT_SUMMARY_MAX];
    info.factor = greens->summary[PLIANT_SUMMARY_FACTOR];
    info.smallest_eigenvalue = greens->summary[PLIANT_SUMMARY_DEFINITE];
    return info;
}

pliant_status pliant_model_check_node(const pliant_model *model, pliant_node node)
{
    if (node.level < 0 || node.level > model->finest_level || node.vertex < 0 ||
        node.vertex >= model->hierarchy->vertex_count[node.level])
        return PLIANT_ERR_ARGUMENT;
    return model->stored_levels >> node.level & 1 ? PLIANT_OK : PLIANT_ERR_MISSING;
}

int32_t pliant_model_hats_at(const pliant_model *model, int32_t level, int32_t vertex,
                             int32_t *vertices, float *weights)
{
    const pliant_hierarchy *h = model->hierarchy;
    const int32_t base = h->vertex_count[0], coarse = h->vertex_count[level];
    // From fine to coarse, the highest number first, a vertex hands half its weight to each parent
    // (GF-53). What has weight between two levels are corners of one triangle: three of the finer
    // level, which give way to three of the coarser one by one.
    int32_t at[6] = {vertex}, count = 1;
    float weight[6] = {1};
    while (count > 0) {
        int32_t finest = 0;
        for (int32_t k = 1; k < count; k++)
            if (at[k] > at[finest]) finest = k;
        const int32_t v = at[finest];
        if (v < coarse) break;
        const float half = weight[finest] / 2;
        at[finest] = at[--count], weight[finest] = weight[count];
        for (int side = 0; side < 2; side++) {
            const int32_t parent = h->stencils[v - base].parents[side];
            if (model->domain[parent] != model->domain[vertex]) continue;
            int32_t k = 0;
            while (k < count && at[k] != parent) k++;
            if (k == count) at[count] = parent, weight[count++] = 0;
            weight[k] += half;
        }
    }
    for (int32_t k = 0; k < count; k++) vertices[k] = at[k], weights[k] = weight[k];
    return count;
}

double pliant_model_node_area(const pliant_model *model, pliant_node node)
{
    const pliant_status status = pliant_model_check_node(model, node);
    return status == PLIANT_ERR_ARGUMENT ? 0 : model->node_areas[node.level][node.vertex];
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
    if (vertex < 0 || vertex >= model->vertex_count || !model->view.has_greens) return -1;
    return model->domain[vertex] == PLIANT_DOMAIN_FREE;
}

double pliant_model_area(const pliant_model *model, int32_t vertex)
{
    return vertex < 0 || vertex >= model->vertex_count ? 0 : model->areas[vertex];
}

int32_t pliant_model_nearest_on(const pliant_model *model, int32_t level, const double *position)
{
    if (level < 0 || level > model->finest_level || !model->view.has_greens) return -1;
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    const int32_t count = domain->wavelet->level_offset[level + 1];
    int32_t nearest = -1;
    double least = 0;
    for (int32_t p = 0; p < count; p++) {
        const double *x = model->view.vertices + 3 * (size_t)domain->nodes[p];
        double distance = 0;
        for (int c = 0; c < 3; c++) distance += (x[c] - position[c]) * (x[c] - position[c]);
        if (nearest >= 0 && distance >= least) continue;
        nearest = domain->nodes[p];
        least = distance;
    }
    return nearest;
}

int32_t pliant_model_nearest(const pliant_model *model, const double *position)
{
    return pliant_model_nearest_on(model, model->finest_level, position);
}
