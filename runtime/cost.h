// cost.h: what the steps of a contact solve take on this machine, from their operation counts.
//
// The direct algorithms of the CMA have predictable operation counts (GF 8.2). For s nodes, n = 3s:
//
//     build     node s + block s^2 + square n^2 + cube n^3     plan, extract, weigh, invert
//     update    (come or gone + 2) (update_node s + update_square n^2)
//     contact   contact_square n^2
//     sums      per stored block
//
// The factors are measured when a solver is created, on its own model and in its own memory, so
// that they hold for this machine and this compression; what solves then really take corrects them.
#pragma once

#include "capacitance.h"
#include "columns.h"

typedef struct pliant_cost {
    double node, block, square, cube;   // ns
    double update_node, update_square;  // ns
    double contact_square, sum_block;   // ns
    double build_trust, update_trust;   // measured over predicted, of late
} pliant_cost;

// Time small problems on `type` (which is garbage afterwards) with `capacity` nodes at most; takes
// some milliseconds. `rows` is a domain's g, of which zeros are added up; it stays zero.
void pliant_cost_calibrate(pliant_cost *cost, const pliant_model *model, int32_t capacity,
                           pliant_columns_kernel *add_column, float *rows,
                           pliant_capacitance_scratch *scratch, pliant_capacitance *type);

double pliant_cost_of_build(const pliant_cost *cost, int32_t count);  // ns
double pliant_cost_of_update(const pliant_cost *cost, int32_t count,
                             pliant_capacitance_difference difference);  // ns
// Steps (4) to (6) for `count` nodes whose columns have `blocks` blocks.
double pliant_cost_of_contact(const pliant_cost *cost, int32_t count, uint64_t blocks);  // ns

// Is updating the quicker way, by rule of thumb? Results then do not depend on how fast a machine
// was at the moment: only deadlines make them.
int32_t pliant_cost_prefers_update(int32_t count, pliant_capacitance_difference difference);

// A prediction by build or update, and what it came to: corrects the trust that is pointed to.
void pliant_cost_learn(double *trust, double predicted, double measured);
