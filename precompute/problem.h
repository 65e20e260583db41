// problem.h: the reference boundary value problem: surface, levels, support, domains (GF 3.2.1).
#pragma once

#include "mesh/relief.h"
#include "options.h"
#include "progress.h"

#include "pliant/hats.h"

#include <petscsys.h>

typedef struct pliant_problem {
    pliant_multires *multires;
    pliant_relief *relief;     // --detail: what was taken off the mesh; on the first rank, else NULL
    pliant_remesh_report remesh;  // what --remesh made; on the first rank
    int32_t input_count;       // vertices of MESH; on the first rank
    pliant_hierarchy *hierarchy;
    int32_t vertex_count;      // n
    uint8_t *held;             // [n] 1 at fixed nodes
    int32_t free_count, fixed_count;
    int32_t *free_nodes, *fixed_nodes;  // ascending vertex numbers
    double *areas;             // [n] a_i (GF-4)
    // Transforms of the rows: displacements vanish where the solid is held, so their stencils may
    // read zeros there; tractions of the held part do not vanish beyond it, so theirs drop nodes.
    pliant_wavelet *free_wavelet, *fixed_wavelet;
    pliant_hats *free_hats, *fixed_hats;  // their hierarchical basis functions
    pliant_level_range levels;  // columns asked for: first to last, of levels 0 to L
    double volume;
    int32_t component_count;
} pliant_problem;

// Collective: the first rank reads and checks the inputs, all ranks get the problem. Notes on what
// was mended go to `progress`.
PetscErrorCode pliant_problem_create(MPI_Comm comm, const pliant_options *options,
                                     pliant_progress *progress, pliant_problem **problem,
                                     pliant_error *err);
PetscErrorCode pliant_problem_destroy(pliant_problem **problem);
