// lattice_stage.c: the lattice that a command line asks for, from the run's mesh.
#include "lattice_stage.h"

#include "lattice/masses.h"
#include "node_memory.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// --lattice-mass at the vertices of the finest level; NAN at those that subdivision made.
static pliant_status read_densities(const pliant_options *options, const pliant_multires *multires,
                                    int32_t input_count, double **densities, pliant_error *err)
{
    const int32_t n = multires->mesh->vertex_count;
    double *listed = malloc((size_t)input_count * sizeof *listed);
    *densities = malloc((size_t)n * sizeof **densities);
    pliant_status status = PLIANT_OK;
    if (!listed || !*densities)
        status =
            pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d densities", input_count);
    if (status == PLIANT_OK)
        status = pliant_masses_read(options->lattice_mass, input_count, listed, err);
    for (int32_t v = 0; v < n && status == PLIANT_OK; v++) {
        const int32_t source = multires->source_index[v];
        (*densities)[v] = source >= 0 ? listed[source] : NAN;
    }
    free(listed);
    return status;
}

static pliant_lattice_summary summarise(const pliant_lattice_data *l)
{
    pliant_lattice_summary s = {.cells = l->voxels->cell_count,
                                .particles = l->particle_count,
                                .half_width = l->regions->half_width,
                                .components = l->component_count,
                                .regions = l->regions->region_count,
                                .irregular_regions = l->regions->region_node_count,
                                .batches = l->batches->batch_count,
                                .cell_size = l->voxels->grid.size,
                                .mass = l->total_mass,
                                .filling = l->voxels->filling};
    memcpy(s.dims, l->voxels->grid.dims, sizeof s.dims);
    return s;
}

pliant_status pliant_lattice_stage_build(const pliant_options *options,
                                         const pliant_multires *multires, int32_t input_count,
                                         pliant_progress *progress, pliant_lattice_data **lattice,
                                         pliant_lattice_summary *summary, pliant_error *err)
{
    double *densities = NULL;
    pliant_status status = PLIANT_OK;
    if (options->lattice_mass)
        status = read_densities(options, multires, input_count, &densities, err);
    if (status == PLIANT_OK) {
        const pliant_lattice_data_def def = {.name = options->mesh,
                                             .cells = options->lattice_cells,
                                             .half_width = options->half_width,
                                             .filling = options->filling,
                                             .density = options->material.density,
                                             .densities = densities,
                                             .available = pliant_node_available(),
                                             .progress = progress};
        status = pliant_lattice_data_create(&def, multires->mesh, lattice, err);
    }
    free(densities);
    if (status < 0) return status;
    *summary = summarise(*lattice);
    return PLIANT_OK;
}
