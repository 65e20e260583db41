// lattice_data.h: everything that a model file says of its lattice (formats/README.md, /lattice).
#pragma once

#include "lattice/batches.h"
#include "lattice/embedding.h"
#include "lattice/voxels.h"
#include "progress.h"

#include "pliant/regions.h"

typedef struct pliant_lattice_data_def {
    const char *name;    // the mesh's, for messages
    int32_t cells;       // along the longest side
    int32_t half_width;  // w, 1 .. PLIANT_LATTICE_WIDTH_LIMIT
    pliant_voxel_filling filling;
    double density;             // kg/m^3
    const double *densities;    // shape [vertex_count], NAN where not known; NULL: `density`
    double available;           // bytes that may be taken; 0: any number
    pliant_progress *progress;  // for a note before the long part; NULL: say nothing
} pliant_lattice_data_def;

typedef struct pliant_lattice_data {
    pliant_voxels *voxels;
    int32_t particle_count;
    int32_t *particles;  // shape [particle_count][3], ascending by (z, y, x)
    int32_t *corners;    // shape [voxels->cell_count][8]: particles; bit 0 of 8: x + 1, 1: y, 2: z
    int32_t component_count;  // connected by shared particles
    float *mass;              // shape [particle_count], kg
    double total_mass;        // kg, the sum of `mass`
    pliant_regions *regions;
    pliant_embedding *embedding;
    pliant_batches *batches;
} pliant_lattice_data;

// The lattice of a closed mesh (as pliant_mesh_check accepts them). The same input makes the same
// lattice, to the last bit.
PLIANT_UNUSED_RESULT pliant_status pliant_lattice_data_create(const pliant_lattice_data_def *def,
                                                              const pliant_mesh *mesh,
                                                              pliant_lattice_data **data,
                                                              pliant_error *err);
void pliant_lattice_data_destroy(pliant_lattice_data *data);  // NULL is fine
