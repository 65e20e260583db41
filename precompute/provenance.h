// provenance.h: what a model file says of its making: "key = value" lines.
#pragma once

#include "run.h"

// The text, NUL-terminated, to be freed with free; NULL without memory. `mesh` is the finest level;
// what the run did not make, Green's functions or a lattice, has no lines.
char *pliant_provenance_text(const pliant_run_summary *summary, const pliant_mesh *mesh,
                             const pliant_options *options, const char *command_line);

// The revision that the program was built from; static.
const char *pliant_provenance_revision(void);
