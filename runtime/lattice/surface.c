// surface.c: the embedded surface of a lattice: deformed with a body, or as weights for shaders.
#include "lattice/surface.h"

#include "lattice/body.h"
#include "model.h"
#include "pliant/error.h"

#include <stdlib.h>

_Static_assert(PLIANT_BATCH_PARTICLES == PLIANT_BATCH_LIMIT,
               "batches of the file are the library's");

static void find_corner(const int32_t cell[3], int32_t k, int32_t at[3])
{
    for (int c = 0; c < 3; c++) at[c] = cell[c] + (k >> c & 1);
}

static int32_t slot_at(const pliant_lattice *lattice, const int32_t at[3])
{
    const size_t row = (size_t)at[2] * lattice->dims[1] + at[1];
    const int32_t block = lattice->block_at[row * lattice->row_blocks + at[0] / PLIANT_LANES];
    return 3 * PLIANT_LANES * block + at[0] % PLIANT_LANES;
}

pliant_status pliant_surface_attach(pliant_lattice *lattice, const pliant_model *model,
                                    pliant_error *err)
{
    const pliant_model_view *view = &model->view;
    int32_t *slots = malloc(8 * (size_t)lattice->cell_count * sizeof *slots);
    if (!slots)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "lattice: no memory for %d cells",
                                lattice->cell_count);
    for (int32_t c = 0; c < lattice->cell_count; c++)
        for (int32_t k = 0; k < 8; k++) {
            int32_t at[3];
            find_corner(lattice->cells + 3 * (size_t)c, k, at);
            slots[8 * (size_t)c + k] = slot_at(lattice, at);
        }
    const pliant_embedded_def def = {
        .vertex_count = view->vertex_count,
        .cell_count = lattice->cell_count,
        .cell = view->lattice_vertex_cell,
        .offset = view->lattice_vertex_offset,
        .tangents = view->lattice_vertex_tangents,
        .corner_slots = slots,
        .cell_size = lattice->cell_size,
    };
    const pliant_status status = pliant_embedded_create(&def, &lattice->embedded, err);
    free(slots);
    if (status >= 0) lattice->model = model;
    return status;
}

void pliant_surface_detach(pliant_lattice *lattice)
{
    pliant_embedded_destroy(lattice->embedded);
    lattice->embedded = NULL;
}

pliant_status pliant_body_surface(const pliant_body *body, pliant_vec3 *positions,
                                  pliant_vec3 *normals)
{
    const pliant_embedded *embedded = body->lattice->embedded;
    if (!embedded) return PLIANT_ERR_MISSING;
    pliant_embedded_evaluate(embedded, body->x, 0, embedded->vertex_count, positions, normals);
    return PLIANT_OK;
}

// phi_i = product of the offsets of its corner, or one less them; grad phi_i in 1/m.
static void find_weights(const float *offset, const float *tangents, double cell_size, int32_t k,
                         pliant_vertex_weights *weights)
{
    double factor[3], gradient[3], u = 0, v = 0;
    for (int c = 0; c < 3; c++) factor[c] = k >> c & 1 ? (double)offset[c] : 1 - (double)offset[c];
    for (int c = 0; c < 3; c++) {
        const double slope = (k >> c & 1 ? 1 : -1) / cell_size;
        gradient[c] = slope * factor[(c + 1) % 3] * factor[(c + 2) % 3];
        u += (double)tangents[c] * gradient[c];
        v += (double)tangents[3 + c] * gradient[c];
    }
    weights->position[k] = (float)(factor[0] * factor[1] * factor[2]);
    weights->u[k] = (float)u;
    weights->v[k] = (float)v;
}

pliant_status pliant_lattice_vertex(const pliant_lattice *lattice, int32_t vertex,
                                    pliant_vertex_weights *weights)
{
    if (!lattice->embedded) return PLIANT_ERR_MISSING;
    const pliant_model_view *view = &lattice->model->view;
    if (vertex < 0 || vertex >= view->vertex_count || !weights) return PLIANT_ERR_ARGUMENT;
    const int32_t *cell = lattice->cells + 3 * (size_t)view->lattice_vertex_cell[vertex];
    for (int32_t k = 0; k < 8; k++) {
        int32_t at[3];
        find_corner(cell, k, at);
        weights->particle[k] = pliant_links_particle(lattice->links, at[0], at[1], at[2]);
        find_weights(view->lattice_vertex_offset + 3 * (size_t)vertex,
                     view->lattice_vertex_tangents + 6 * (size_t)vertex,
                     view->lattice_frame[PLIANT_LATTICE_CELL_SIZE], k, weights);
    }
    return PLIANT_OK;
}

pliant_status pliant_lattice_find_batch(const pliant_lattice *lattice, int32_t batch,
                                        pliant_lattice_batch *found)
{
    if (!lattice->embedded) return PLIANT_ERR_MISSING;
    const pliant_model_view *view = &lattice->model->view;
    if (batch < 0 || batch >= view->lattice_batch_count || !found) return PLIANT_ERR_ARGUMENT;
    const int32_t *faces = view->lattice_batch_face_offset + batch;
    const int32_t *points = view->lattice_batch_point_offset + batch;
    *found = (pliant_lattice_batch){
        .face_count = faces[1] - faces[0],
        .particle_count = points[1] - points[0],
        .faces = view->lattice_batch_faces + faces[0],
        .particles = view->lattice_batch_points + points[0],
    };
    return PLIANT_OK;
}
