// csv.h: one row of comma-separated values per step.
//
//     step,time,solve_us,constraints,level,<probe>.x,<probe>.y,<probe>.z,...,
//     force.x,force.y,force.z
//
// solve_us is the whole step: from the state to the reconstructed surface.
#pragma once

#include "player.h"

typedef struct pliant_csv pliant_csv;

PLIANT_UNUSED_RESULT pliant_status pliant_csv_open(const char *path, pliant_csv **csv,
                                                   pliant_error *err);
// The header is written with the first row: the player's probes may not change afterwards.
PLIANT_UNUSED_RESULT pliant_status pliant_csv_add(pliant_csv *csv, const pliant_player *player,
                                                  const pliant_step *step, pliant_error *err);
// Without a row, write the header of `player`'s probes. Ends the csv's life whatever it returns.
PLIANT_UNUSED_RESULT pliant_status pliant_csv_commit(pliant_csv *csv, const pliant_player *player,
                                                     pliant_error *err);
void pliant_csv_abandon(pliant_csv *csv);  // NULL is fine; not after commit
