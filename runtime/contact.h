// contact.h: rigid tools on a solver: what a pliant_contact holds, and its steps.
//
// A frame goes round: choose the pairs of a node and a tool that may touch (contact_pairs.c), have
// their forces from the contact law, press these as loads and solve (contact_forces.c), see how far
// all vertices near the tools are from them (contact_candidates.c); then replace nodes where the
// surface between them strays too far (contact_adapt.c), until it does not.
#pragma once

#include "contact_law.h"
#include "contact_levels.h"
#include "solver.h"
#include "tool.h"
#include "vertex_tree.h"

// A vertex near a tool.
typedef struct pliant_contact_candidate {
    int32_t vertex, tool;
    double gap;  // m, below 0: inside
} pliant_contact_candidate;

// A node that a tool may push.
typedef struct pliant_contact_pair {
    pliant_node node;
    int32_t tool;
    int32_t index;           // of the node in `nodes`; -1: came after the last law
    double area;             // m^2, of its hat
    double x[3];             // where its vertex is now
    double gap;              // m
    double normal[3];        // out of the tool
    double pushed_along[3];  // the normal that the law had
    double pressure[3];      // N/m^2, of the tool on the hat: what is pressed
    double gap_before;       // m, before carrying over
    double carried[3];       // what comes to that from nodes that are gone, while carrying over
    // What the law takes for the gap is gap + offset: a change of level starts with the offset that
    // leaves everything where it is, and lets it fade.
    double offset;
    int32_t fade;  // solves until it has
    // Where the vertex would be if it stuck to the tool; without force, where it was.
    double anchor[3];
    int32_t is_sliding;
} pliant_contact_pair;

// What a tool exerted at a vertex whose node is gone since others went back to coarser levels.
typedef struct pliant_contact_loss {
    pliant_node node;
    int32_t tool;
    double pressure[3];  // N/m^2
} pliant_contact_loss;

// A node's traction as it was stated to the solver.
typedef struct pliant_contact_load {
    pliant_node node;
    pliant_vec3 traction;
} pliant_contact_load;

// Room for losses, a multiple of the node capacity: a node that goes back has some six children,
// half of which it shares.
#define PLIANT_CONTACT_LOSS_PART 4

struct pliant_contact {
    pliant_solver *solver;  // borrowed
    const pliant_model *model;
    pliant_arena arena;
    pliant_contact_def def;
    double span;  // m, longest side of the model's box
    pliant_vertex_tree tree;
    pliant_contact_levels levels;
    pliant_contact_law law;

    pliant_tool_shape *asked;    // shape [tool_capacity]: as set
    pliant_tool_shape *reached;  // likewise: as solved for
    pliant_tool_result *results;
    pliant_contact_report report;

    // Vertices near tools. `query` lists theirs and then the samples that bound the displacement.
    int32_t candidate_count, candidate_capacity;
    pliant_contact_candidate *candidates;
    int32_t query_count;
    int32_t *query;             // shape [candidate_capacity + sample_capacity]
    pliant_vec3 *displacement;  // likewise
    int32_t sample_capacity;
    int32_t *found;         // shape [m]
    int32_t *candidate_of;  // shape [tool_capacity][n]: or -1

    int32_t pair_count;
    pliant_contact_pair *pairs;       // shape [node_capacity]
    pliant_contact_pair *next_pairs;  // likewise; between choices, those before
    int32_t carried_count;            // how many there were before carrying over
    int32_t *pair_of;                 // shape [tool_capacity][n]: or -1
    double *keys;                     // shape [node_capacity]: a heap of those chosen so far
    int32_t *chosen;                  // likewise: their candidates

    // The compliance, of these nodes and with that held.
    int32_t node_count;
    pliant_node *nodes;  // shape [node_capacity]
    int32_t *node_of;    // shape [n]: index, or -1
    double *compliance;  // shape [3 node_count][3 node_count]
    int32_t is_compliance_known;
    int32_t held_count;
    pliant_node *held;      // shape [constraint_capacity of the solver]
    double *node_force;     // shape [3 node_capacity]; scratch between laws
    double *node_shift;     // likewise: what these displace the nodes by
    pliant_vec3 *traction;  // shape [node_capacity]: of these nodes

    // The contact law's problem, and what the solver was told.
    double *matrix;    // shape [3 node_capacity][3 node_capacity]
    double *row;       // shape [3 node_capacity]: of the compliance, along an axis
    double *b;         // shape [3 node_capacity]
    double *force;     // shape [3 node_capacity]: in the pairs' frames
    double *friction;  // shape [node_capacity]
    double *frames;    // shape [node_capacity][3][3]: normal, tangent, tangent
    int32_t load_count;
    pliant_contact_load *loads;  // shape [node_capacity]
    int32_t room;                // nodes that the solver has room for
    pliant_status solver_status;

    // Levels.
    int32_t fading_count;  // pairs with an offset
    int32_t coarsened_count;
    int32_t *coarsened;  // shape [m]: vertices whose nodes are to go back in the next solve
    int32_t loss_count;
    pliant_contact_loss *losses;  // shape [loss_capacity]
    int32_t touched_count;
    int32_t *touched;    // shape [node_capacity]: nodes whose force in node_force is not zero
    uint16_t *calm;      // shape [n]: solves for which a node has had no need to be replaced
    uint16_t *patience;  // shape [n]: for how many it must have had none
};

// ---- contact_candidates.c ----

// How many vertices are looked at to bound the displacement.
int32_t pliant_contact_sample_capacity(const pliant_solver *solver);
// List the vertices that may come to touch the tools as `reached`, near where they are. After a
// solve.
void pliant_contact_list_candidates(pliant_contact *contact);
// Where candidates and pairs are after a solve, and how far from the tools.
void pliant_contact_evaluate(pliant_contact *contact);
// The same of one pair, from the last evaluation.
void pliant_contact_place_pair(pliant_contact *contact, pliant_contact_pair *pair);
// The candidate of a vertex and a tool, put on the list if it is not yet; -1: no room.
int32_t pliant_contact_find_candidate(pliant_contact *contact, int32_t vertex, int32_t tool);
// Has the caller stated something about this vertex?
int32_t pliant_contact_is_taken(const pliant_contact *contact, int32_t vertex);

// ---- contact_pairs.c ----

// Choose the pairs: nodes in force that are pushed or near. Those that stay keep their state.
void pliant_contact_choose_pairs(pliant_contact *contact);
// The same after nodes were replaced or sent back: the new ones exert the pressure that the old
// ones did, exactly where hats became finer.
void pliant_contact_carry_over(pliant_contact *contact);
// Undo that: pairs as they were. Levels are the caller's to undo.
void pliant_contact_carry_back(pliant_contact *contact);
// How the two parents of an odd vertex share what a tool exerts there: by what it exerts on them.
// Both 0: neither is pushed.
void pliant_contact_share(const pliant_contact *contact, const int32_t *parents, int32_t tool,
                          double *share);
// The pair of a vertex and a tool, or NULL.
const pliant_contact_pair *pliant_contact_pair_at(const pliant_contact *contact, int32_t vertex,
                                                  int32_t tool);
// Does the tool push it?
int32_t pliant_contact_is_pushed(const pliant_contact_pair *pair);
// The tool's pressure at a vertex, the sum over hats, [3].
void pliant_contact_pressure_at(const pliant_contact *contact, int32_t vertex, int32_t tool,
                                double *pressure);
// The pairs' offsets around a vertex, interpolated.
double pliant_contact_offset_at(const pliant_contact *contact, int32_t vertex, int32_t tool);

// ---- contact_forces.c ----

// Solve the contact law for the pairs, linear about where they are: into their pressures.
void pliant_contact_apply_law(pliant_contact *contact);
// Press what the pairs say and solve.
void pliant_contact_press(pliant_contact *contact, int64_t deadline);
// How far the pairs are from the conditions of contact, m.
double pliant_contact_residual(const pliant_contact *contact);
// How far normals have turned since the law had them, rad.
double pliant_contact_turn(const pliant_contact *contact);
// Forget loads that the caller has replaced or taken out, and see what room there is.
void pliant_contact_check_loads(pliant_contact *contact);

// ---- contact_adapt.c ----

// Does the surface stray nowhere from the tools by more than the tolerance allows?
int32_t pliant_contact_is_fine(const pliant_contact *contact);
// Replace nodes where the surface strays from the tools by more than that, and carry over. Returns
// how many were replaced.
int32_t pliant_contact_refine(pliant_contact *contact);
// After a solve: list nodes to go back, which have long had no need to be replaced.
void pliant_contact_coarsen(pliant_contact *contact);
// After carrying over and a solve: offsets that leave the pairs where they are.
void pliant_contact_set_offsets(pliant_contact *contact);
// At the next solve, before tools move: let these nodes go back and carry over, unless that moves
// gaps by more than it was thought to. Pairs are as solved for, before and after.
void pliant_contact_go_back(pliant_contact *contact, int64_t deadline);
// Fade offsets by a solve's share.
void pliant_contact_fade(pliant_contact *contact);
// At create: every replaced node asks for the least patience.
void pliant_contact_begin_patience(pliant_contact *contact);
// Tell the report and the tools' results about penetration and errors.
void pliant_contact_judge(pliant_contact *contact);
