// input.h: the mesh that a run works on: read, checked, and with its levels.
#pragma once

#include "mesh/mesh_check.h"
#include "mesh/relief.h"
#include "options.h"
#include "progress.h"
#include "remesh/remesh.h"

typedef struct pliant_input {
    pliant_multires *multires;
    pliant_relief *relief;  // --detail: what was taken off the mesh; else NULL
    int32_t vertex_count;   // of MESH, before any change
    pliant_mesh_report report;
    pliant_remesh_report remesh;  // --remesh: what was made; else zero
} pliant_input;

// Read and check MESH, refine it or detect its levels, take detail off. A run without Green's
// functions and without --subdivide takes the mesh as it is, as its only level. Notes on what was
// mended go to `progress`. `input` is empty before; release it whatever comes back.
PLIANT_UNUSED_RESULT pliant_status pliant_input_read(const pliant_options *options,
                                                     pliant_progress *progress, pliant_input *input,
                                                     pliant_error *err);
void pliant_input_release(pliant_input *input);
