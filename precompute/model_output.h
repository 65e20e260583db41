// model_output.h: write the model file from the ranks' compressed columns.
#pragma once

#include "greens.h"
#include "lattice_output.h"

// Collective. The first rank writes; the columns come to it batch by batch. `provenance` (first rank
// only) holds "key = value" lines; `lattice` (first rank only) may be NULL: none. Nothing stands under `path` until the file is whole. *bytes is its
// size, on the first rank.
PetscErrorCode pliant_model_output_write(const char *path, pliant_greens *greens,
                                         const pliant_lattice_data *lattice,
                                         const pliant_options *options, const char *provenance,
                                         pliant_progress *progress, double *bytes,
                                         pliant_error *err);
