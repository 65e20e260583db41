// surface.h: the embedded surface of a lattice made from a model.
#pragma once

#include "lattice/embedded.h"
#include "lattice/lattice.h"

// Embed the model's finest level, whose view has a lattice. The model is borrowed until detach.
PLIANT_UNUSED_RESULT pliant_status pliant_surface_attach(pliant_lattice *lattice,
                                                         const pliant_model *model,
                                                         pliant_error *err);
void pliant_surface_detach(pliant_lattice *lattice);  // without one is fine
