// region_layout.h: a lattice's regions as the step takes them: constants, exceptions, parts.
#pragma once

#include "lattice/lattice.h"

// Blocks, slabs, columns and turns are placed. PLIANT_ERR_FORMAT: see pliant_exceptions_list.
PLIANT_UNUSED_RESULT pliant_status pliant_lattice_lay_out_regions(pliant_lattice *lattice,
                                                                  const pliant_lattice_def *def);
