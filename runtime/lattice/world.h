// world.h: a world's parts, for the files that make it up.
#pragma once

#include "lattice/crowd.h"
#include "lattice/holds.h"
#include "lattice/impulses.h"
#include "lattice/obstacles.h"
#include "lattice/touches.h"

// Places and velocities that a world takes, m and m/s: beyond that floats are no coordinates.
#define PLIANT_WORLD_EXTENT 1e9f

struct pliant_world {
    pliant_crowd crowd;
    pliant_obstacles obstacles;
    pliant_holds holds;
    pliant_touches touches;
    pliant_impulses impulses;
    pliant_team *team;  // owned
    pliant_vec3 gravity;
    int32_t collision;
    float friction;
    pliant_world_report report;
    // Of the step under way: members whose bodies have no threads of their own.
    int32_t *alone;  // shape [member_capacity]
    int32_t alone_count;
    float dt;
    pliant_arena arena;
};

// 1: finite, and within the extent.
int32_t pliant_world_accepts(pliant_vec3 place);
