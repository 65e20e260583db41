// approach.h: does a point in free space meet the deformed surface on its way, or has the surface
// come over it?
//
// The faces are in groups, the descendants of one face of a coarser level: 16 of the finest. When a
// group is looked at, its corners are evaluated and its distance from the point is taken down.
// Until the point and the surface, by the bound of motion.h, have come as far together it need not
// be looked at again. So most steps in free space evaluate nothing, what is far away is looked at
// rarely, and however the surface deforms nothing is missed.
#pragma once

#include "deformed.h"
#include "sliding.h"

typedef struct pliant_approach {
    int32_t group_count, group_size;  // size: faces in a group
    double *due;                      // shape [group_count]: the way at which a group may be met
    double way;                       // that point and surface have come, m
    double at[3];                     // where the point was then
    int32_t *groups;                  // shape [group_count]: looked at in a search
} pliant_approach;

typedef struct pliant_approach_query {
    const double *from, *to;  // the point's way, shape [3], m
    double swept;  // the surface may have moved by this since the last search; infinite: by any
    double slack;  // lengths within it are rounding
} pliant_approach_query;

typedef struct pliant_approach_result {
    int32_t is_touching;
    pliant_sliding_point point;  // where
} pliant_approach_result;

void pliant_approach_lay_out(pliant_arena *arena, const pliant_model *model,
                             pliant_approach *approach);
pliant_approach_result pliant_approach_search(pliant_approach *approach, pliant_deformed *deformed,
                                              pliant_solver *solver,
                                              const pliant_approach_query *query);
