// pending.h: the type of a set that a deadline left no time for, built in the time that later
// solves have left.
//
// A late solve resolves its constraints on a coarser level. While the set that was asked for stays
// the same, as in a contact that rests, every solve goes on with its inverse for as long as its own
// deadline allows; when it is whole, the solver takes it among its types, and contact is resolved
// as asked. Work is cut into slices of some ten to a hundred microseconds.
#pragma once

#include "capacitance.h"
#include "dense.h"

typedef enum pliant_pending_stage {
    PLIANT_PENDING_NONE,
    PLIANT_PENDING_PLAN,
    PLIANT_PENDING_EXTRACT,
    PLIANT_PENDING_WEIGH,
    PLIANT_PENDING_INVERT,
    PLIANT_PENDING_WHOLE,
    PLIANT_PENDING_REFUSED,  // not definite: this set needs a build in one piece
    PLIANT_PENDING_STAGE_COUNT
} pliant_pending_stage;

typedef struct pliant_pending {
    pliant_capacitance type;
    pliant_pending_stage stage;
    int32_t next;  // member to go on with
    pliant_dense_sweep sweep;
    double
        slice_ns[PLIANT_PENDING_STAGE_COUNT];  // what slices of a stage took of late, the slow ones
} pliant_pending;

void pliant_pending_lay_out(pliant_arena *arena, const pliant_model *model, int32_t capacity,
                            pliant_pending *pending);

// Go on with the type of `nodes` (ascending) until it is whole or `deadline` is near. When the last
// call was for others this one is only noted: sets of a contact that moves are not begun.
void pliant_pending_advance(const pliant_model *model, const pliant_node *nodes, int32_t count,
                            int64_t deadline, pliant_capacitance_scratch *scratch,
                            pliant_pending *pending);
// Which part of its operations is done, 0 to 1.
double pliant_pending_part(const pliant_pending *pending);
