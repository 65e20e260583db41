// patch.h: a contact on the finest scale that is met with few nodes of mixed levels.
//
// The nodes V are vertices of the patch, each with the coarsest hat that ends within the patch, or
// a finer one that does the same (footprint.h). V is what the last solve left, less the nodes that
// were dispensable for a while, plus one node at every place where the surface is off by more than
// the tolerance. A fuller V is a larger space of tractions that includes the smaller one's, and
// the whole patch as V is the contact on the finest level.
//
// Nothing jumps when V changes. A node that comes is stated where the surface is, or where the
// tolerance begins if that is nearer to its target, and goes on to its target by equal steps: a
// displacement prescribed where it is already moves nothing. A traction that loses its node, or
// whose node moves to another level, stays behind as a load, which moves nothing either, and which
// vanishes by equal steps.
#pragma once

#include "footprint.h"
#include "solver.h"

typedef struct pliant_patch_vertex {
    int32_t vertex;
    int32_t fit;        // coarsest level of a node here; -1: none stored has a hat for it
    int32_t is_anchor;  // 1: not of the patch, but the only node that it has (patch_choose.c)
    int32_t is_new;     // 1: was not in the patch in the last call
    pliant_vec3 target;

    // Its node.
    int32_t level;         // as stated; -1: it is none
    int32_t is_coming;     // 1: was none after the last call
    pliant_vec3 offset;    // of one that comes: it is stated at target + weight offset,
    float weight, step;    // and weight falls by step, from at most 1
    pliant_vec3 stated;    // where it is stated
    int32_t last_level;    // as stated in the last solve; -1: was none
    int32_t solved_level;  // as resolved there; -1: left out
    pliant_vec3 traction;  // as solved for there
    double slack;          // m, what the error would be without the node; INFINITY: not known
    int32_t idle;          // calls in a row in which the node was dispensable
    int32_t patience;      // so many before it goes; 0: it has not been given up yet
    pliant_vec3 came_for;  // target when it last came back

    double error;  // m, |u - target| as measured
} pliant_patch_vertex;

// A traction left behind: `weight` of it is stated in the load of the same index.
typedef struct pliant_patch_fade {
    pliant_vec3 traction;
    float weight;
} pliant_patch_fade;

struct pliant_patch {
    pliant_solver *solver;  // borrowed
    pliant_arena arena;
    pliant_patch_def def;
    pliant_footprint footprint;

    // What is to be the patch, vertices ascending; the same when is_set is 0.
    int32_t is_set, next_count;
    pliant_patch_vertex *next;  // shape [capacity + 1]
    int32_t *source;            // shape [n]: of a vertex in the caller's array, during set
    uint64_t *named;            // shape [(n + 63) / 64]: zero between calls

    // The patch of the last call; shape [capacity + 1]: an anchor may be in it.
    int32_t count;
    pliant_patch_vertex *vertices;  // ascending
    int32_t *numbers;               // the vertices alone
    int32_t *index_of;              // shape [n]: of a vertex in `vertices`, or -1
    pliant_vec3 *u;                 // as measured
    int32_t fade_capacity;
    pliant_load_list fading;   // the solver has it in its lists
    pliant_patch_fade *fades;  // shape [fade_capacity]
    pliant_patch_report report;

    // Scratch; shape [capacity + 1].
    int32_t *coming;   // vertices that are to become nodes, or cease to be, by index
    int32_t *nodes;    // vertices that are nodes
    int32_t *levels;   // of footprint
    uint8_t *is_held;  // no node this time, since one comes nearby
};

// Does the solver still hold what this patch stated, and not what somebody else did since?
int32_t pliant_patch_owns(const pliant_patch *patch, const pliant_patch_vertex *v);

// ---- patch_choose.c: which vertices of the patch are nodes, and where they belong ----

// The coarsest stored level from `level` on; the finest stored one where there is none and it has
// the vertex; else -1.
int32_t pliant_patch_stored_level(const pliant_model *model, int32_t vertex, int32_t level);
// Files without the finest levels may have no node for a small patch: then it gets an anchor, in
// its place in the list of `vertices`, which has room. Returns their number.
int32_t pliant_patch_add_anchor(const pliant_patch *patch, pliant_patch_vertex *vertices,
                                int32_t count);
// List in `coming` the vertices that are to become nodes, the largest errors first; or the nodes
// that are to go, the least needed first. Return how many.
int32_t pliant_patch_choose_coming(pliant_patch *patch);
int32_t pliant_patch_choose_going(pliant_patch *patch);
// After the last solve of a call: what each node would be off by without it, and for how long that
// would have done.
void pliant_patch_note_slack(pliant_patch *patch);

static inline double pliant_patch_distance(pliant_vec3 a, pliant_vec3 b)
{
    const double x = (double)a.x - (double)b.x, y = (double)a.y - (double)b.y;
    const double z = (double)a.z - (double)b.z;
    return __builtin_sqrt(x * x + y * y + z * z);
}
