// lattice_output.h: write a lattice into a model file, or a file of its own.
#pragma once

#include "lattice/lattice_data.h"
#include "mesh/multires.h"
#include "options.h"

#include "pliant/writer.h"

// The sections that every model file has but for its provenance: mesh, levels, material.
PLIANT_UNUSED_RESULT pliant_status pliant_surface_output_write(pliant_writer *writer,
                                                               const pliant_multires *multires,
                                                               const pliant_material *material,
                                                               pliant_error *err);

// What a layout says of the lattice.
pliant_lattice_layout pliant_lattice_output_layout(const pliant_lattice_data *lattice);
// The sections of /lattice.
PLIANT_UNUSED_RESULT pliant_status pliant_lattice_output_write(pliant_writer *writer,
                                                               const pliant_lattice_data *lattice,
                                                               pliant_error *err);

// A file without Green's functions: mesh, material, lattice and provenance ("key = value" lines).
// Nothing stands under `path` until the file is whole. *bytes is its size.
PLIANT_UNUSED_RESULT pliant_status pliant_lattice_output_file(
    const char *path, const pliant_multires *multires, const pliant_material *material,
    const pliant_lattice_data *lattice, const char *provenance, double *bytes, pliant_error *err);
