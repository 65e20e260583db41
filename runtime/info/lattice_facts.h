// lattice_facts.h: what a model's lattice is, for the description, and whether it is what it says.
#pragma once

#include "contents.h"

#include <stdio.h>

// Both show nothing of a model without a lattice.
void pliant_lattice_facts_print(const pliant_model_view *view, FILE *stream);
void pliant_lattice_facts_print_json(const pliant_model_view *view, FILE *stream);

// Beyond what binding has checked: regions and components are those of the cells, the masses add
// up, the mesh's vertices lie where they are embedded, and batches have the particles of their
// faces. PLIANT_OK without a lattice.
PLIANT_UNUSED_RESULT pliant_status pliant_lattice_facts_verify(const pliant_contents *contents,
                                                               pliant_error *err);
