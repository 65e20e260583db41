// dents.h: particles that are inside another body, and the way out.
//
// A particle in a deformed cell comes from a place at rest (the inverse of the cell's trilinear
// map), which has a depth and a direction to the surface there (rest_depth.h). So the way out is
// that of the undeformed shape, however crumpled the body, and never leads through it.
#pragma once

#include "lattice/touches.h"

// Which cell of another body each hashed participant is inside of and below its surface; the least
// numbered, whoever finds it first. Cells are those of the crowd.
void pliant_dents_choose(pliant_touches *touches, pliant_team *team);
// The touch of a hashed participant with the cell that was chosen for it: 1, or 0: there is none.
// Its cell names particles of the crowd.
int32_t pliant_dents_find(pliant_touches *touches, int32_t participant, pliant_touch *touch);
