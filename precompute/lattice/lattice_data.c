// lattice_data.c: everything that a model file says of its lattice.
#include "lattice/lattice_data.h"

#include "lattice/masses.h"

#include "pliant/error.h"

#include <stdlib.h>

// ---- Particles ----

// Corner c of a cell: bit 0 steps along x, bit 1 along y, bit 2 along z.
static void corner_of(const int32_t *cell, int c, int32_t corner[3])
{
    for (int d = 0; d < 3; d++) corner[d] = cell[d] + (c >> d & 1);
}

static pliant_status number_particles(pliant_lattice_data *l, const char *name, pliant_error *err)
{
    const pliant_voxels *v = l->voxels;
    const int32_t dims[3] = {v->grid.dims[0] + 1, v->grid.dims[1] + 1, v->grid.dims[2] + 1};
    pliant_cell_set *set = NULL;
    pliant_status status = pliant_cell_set_create(dims, &set, err);
    if (status < 0) return status;
    for (int32_t i = 0; i < v->cell_count; i++)
        for (int c = 0; c < 8; c++) {
            int32_t at[3];
            corner_of(v->cells + 3 * (size_t)i, c, at);
            pliant_cell_set_insert(set, at[0], at[1], at[2]);
        }
    l->particle_count = pliant_cell_set_number(set);
    if (l->particle_count > PLIANT_LATTICE_LIMIT) {
        status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                  "%s: makes %d particles, expected at most %d: use fewer cells",
                                  name, l->particle_count, PLIANT_LATTICE_LIMIT);
        goto done;
    }
    l->particles = malloc(3 * (size_t)l->particle_count * sizeof *l->particles);
    l->corners = malloc(8 * (size_t)v->cell_count * sizeof *l->corners);
    l->mass = malloc((size_t)l->particle_count * sizeof *l->mass);
    if (!l->particles || !l->corners || !l->mass) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d particles",
                                  l->particle_count);
        goto done;
    }
    pliant_cell_set_list(set, l->particles);
    for (int32_t i = 0; i < v->cell_count; i++)
        for (int c = 0; c < 8; c++) {
            int32_t at[3];
            corner_of(v->cells + 3 * (size_t)i, c, at);
            l->corners[8 * (size_t)i + (size_t)c] = pliant_cell_set_find(set, at[0], at[1], at[2]);
        }
done:
    pliant_cell_set_destroy(set);
    return status;
}

static int32_t root_of(int32_t *parent, int32_t particle)
{
    while (parent[particle] != particle) particle = parent[particle] = parent[parent[particle]];
    return particle;
}

static pliant_status count_components(pliant_lattice_data *l, pliant_error *err)
{
    int32_t *parent = malloc((size_t)l->particle_count * sizeof *parent);
    if (!parent)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d particles",
                                l->particle_count);
    for (int32_t i = 0; i < l->particle_count; i++) parent[i] = i;
    l->component_count = l->particle_count;
    for (int32_t i = 0; i < l->voxels->cell_count; i++)
        for (int c = 1; c < 8; c++) {
            const int32_t a = root_of(parent, l->corners[8 * (size_t)i]);
            const int32_t b = root_of(parent, l->corners[8 * (size_t)i + (size_t)c]);
            if (a == b) continue;
            parent[a < b ? b : a] = a < b ? a : b;
            l->component_count--;
        }
    free(parent);
    return PLIANT_OK;
}

// ---- The rest, by their nouns ----

static pliant_status weigh(pliant_lattice_data *l, const pliant_lattice_data_def *def,
                           const pliant_mesh *mesh, pliant_error *err)
{
    double *share = malloc((size_t)l->particle_count * sizeof *share);
    if (!share)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d particles",
                                l->particle_count);
    pliant_status status =
        pliant_masses_share(mesh, l->voxels, l->corners, l->particle_count, share, err);
    if (status == PLIANT_OK)
        status = pliant_masses_weigh(mesh, &l->voxels->grid, l->particle_count, l->particles, share,
                                     def->density, def->densities, l->mass, &l->total_mass, err);
    free(share);
    return status;
}

static pliant_status find_regions(pliant_lattice_data *l, int32_t half_width, pliant_error *err)
{
    const int32_t *dims = l->voxels->grid.dims;
    const pliant_lattice_shape shape = {.dims = {dims[0] + 1, dims[1] + 1, dims[2] + 1},
                                        .particle_count = l->particle_count,
                                        .cell_count = l->voxels->cell_count,
                                        .particles = l->particles,
                                        .cells = l->voxels->cells};
    return pliant_regions_create(&shape, half_width, &l->regions, err);
}

static pliant_status find_batches(pliant_lattice_data *l, const pliant_mesh *mesh,
                                  pliant_error *err)
{
    const pliant_batches_input input = {.vertex_count = mesh->vertex_count,
                                        .face_count = mesh->face_count,
                                        .particle_count = l->particle_count,
                                        .faces = mesh->faces,
                                        .vertex_cell = l->embedding->cell,
                                        .corners = l->corners};
    return pliant_batches_create(&input, &l->batches, err);
}

static void note(const pliant_lattice_data *l, pliant_progress *progress)
{
    const int32_t *dims = l->voxels->grid.dims;
    if (progress)
        pliant_progress_note(progress, "lattice of %d x %d x %d cells: %d of them, %d particles",
                             dims[0], dims[1], dims[2], l->voxels->cell_count, l->particle_count);
}

pliant_status pliant_lattice_data_create(const pliant_lattice_data_def *def,
                                         const pliant_mesh *mesh, pliant_lattice_data **data,
                                         pliant_error *err)
{
    pliant_lattice_data *l = calloc(1, sizeof *l);
    if (!l) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a lattice");
    pliant_status status = pliant_voxels_create(mesh, def->name, def->cells, def->filling,
                                                def->available, &l->voxels, err);
    if (status == PLIANT_OK) status = number_particles(l, def->name, err);
    if (status == PLIANT_OK) note(l, def->progress);
    if (status == PLIANT_OK) status = count_components(l, err);
    if (status == PLIANT_OK) status = weigh(l, def, mesh, err);
    if (status == PLIANT_OK) status = find_regions(l, def->half_width, err);
    if (status == PLIANT_OK) status = pliant_embedding_create(mesh, l->voxels, &l->embedding, err);
    if (status == PLIANT_OK) status = find_batches(l, mesh, err);
    if (status < 0) pliant_lattice_data_destroy(l);
    else *data = l;
    return status;
}

void pliant_lattice_data_destroy(pliant_lattice_data *data)
{
    if (!data) return;
    pliant_batches_destroy(data->batches);
    pliant_embedding_destroy(data->embedding);
    pliant_regions_destroy(data->regions);
    free(data->mass);
    free(data->corners);
    free(data->particles);
    pliant_voxels_destroy(data->voxels);
    free(data);
}
