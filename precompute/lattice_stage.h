// lattice_stage.h: the lattice that a command line asks for, from the run's mesh.
#pragma once

#include "lattice/lattice_data.h"
#include "mesh/multires.h"
#include "options.h"
#include "progress.h"

// What the final lines say of it.
typedef struct pliant_lattice_summary {
    int32_t cells, particles, half_width, components, regions, irregular_regions, batches;
    int32_t dims[3];  // of the grid, in cells
    double cell_size, mass;
    pliant_voxel_filling filling;
} pliant_lattice_summary;

// Build it on the mesh's finest level. `input_count` is the number of MESH's vertices, for
// --lattice-mass: its densities count where a vertex of the finest level is one of MESH.
PLIANT_UNUSED_RESULT pliant_status pliant_lattice_stage_build(
    const pliant_options *options, const pliant_multires *multires, int32_t input_count,
    pliant_progress *progress, pliant_lattice_data **lattice, pliant_lattice_summary *summary,
    pliant_error *err);
