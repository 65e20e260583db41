// columns.h: shape matching of the regions of one column of blocks (LSM 3.2).
//
// From the sums over plates along z to those over regions (LSM-7), A_r, its rotation, T_r; and back
// along z to what every plate of the column hands on. A column is one worker's: it writes its
// sites, its regions' quaternions and its plates.
#pragma once

#include "lattice/body.h"

void pliant_column_match(pliant_body *body, int32_t column, pliant_scratch *scratch);
