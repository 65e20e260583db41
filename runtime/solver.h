// solver.h: one boundary value problem on a model: its statements, its last solution, its scratch.
#pragma once

#include "capacitance.h"
#include "compact.h"
#include "cost.h"
#include "model.h"
#include "pending.h"

// A node of S: its specified value, and after a solve the one of reference type that realises it.
typedef struct pliant_constraint {
    pliant_node node;
    pliant_vec3 value;  // displacement of a displaced node, traction of a freed one
} pliant_constraint;

// A node outside S with a specified value: traction of a free node, displacement of a fixed one.
typedef struct pliant_load {
    pliant_node node;
    int32_t is_specified;  // 0: released, but still in the sum until the next solve
    pliant_vec3 value;     // as stated
    pliant_vec3 summed;    // as it is in base, which is as it was in the last solve
    float
        weight[PLIANT_DOMAIN_COUNT];  // largest number of its column in a row domain; -1: not known
} pliant_load;

// Tractions beside what the caller states, on any nodes, also of S, and any number on one. Their
// owner changes the values between solves and says so in loads_changed; what was once summed may
// leave the list only when `summed` is zero again.
typedef struct pliant_load_list {
    int32_t count;
    pliant_load *loads;  // of the owner
    struct pliant_load_list *next;
    int32_t is_entered;  // the owner's note
} pliant_load_list;

// What a domain's rows hold. Rows are [count + 1][4] floats, xyz0, the last one zero.
typedef struct pliant_field {
    float *base;        // g of step (3): everything specified outside S; kept from solve to solve
    int32_t is_loaded;  // 0: base is zero
    float *g;           // g of step (6), and then values up to level `reconstructed`
    int32_t is_summed;  // 0: g is stale and to be summed when asked for
    uint64_t *support;  // shape [(count + 63) / 64]: a bit for every row that a column touched,
    int32_t is_sparse;  // if these are few and base is zero
    int32_t reconstructed;  // 0: coefficients (which the values of level 0 are)
    double magnitude;       // sum over the specified values of |value| * weight: bounds |base|
    double drift;           // bound of the rounding error in base, in the same unit
    float gravity_weight;
    // The last selective query's plan.
    pliant_reconstruction plan;
    int32_t query_count, query_is_planned;
    int32_t *query_positions, *query_slots;  // shape [query_capacity]
} pliant_field;

// One column of S in step (6), looked up: from floats, or from groups.
typedef struct pliant_term {
    const pliant_compact_group *group;  // NULL: from floats
    const int32_t *row;
    const float *block;
    size_t count;    // of groups or blocks
    float value[3];  // times the column's scale
} pliant_term;

struct pliant_solver {
    const pliant_model *model;  // borrowed
    pliant_arena arena;
    pliant_columns_kernel *add_column;
    // Columns of S in half precision, [row domain][column domain][level]; offset NULL: summed from
    // floats.
    pliant_compact_kernel *add_compact;  // NULL: all are
    pliant_compact_columns compact[PLIANT_DOMAIN_COUNT][PLIANT_DOMAIN_COUNT]
                                  [PLIANT_LEVEL_LIMIT + 1];
    int32_t domain_count;  // domains with rows: 2 with supports, else 1
    int32_t constraint_capacity, load_capacity, cache_count;
    int32_t query_capacity, query_at_once;  // see solver.c

    // Statements.
    int32_t constraint_count;
    pliant_constraint *constraints;  // shape [capacity], vertices ascending; a vertex has one level
    int32_t load_count;              // also those released since the last solve
    int32_t specified_count;         // without them
    pliant_load *loads;              // shape [2 load_capacity]
    int32_t *load_of;                // shape [n]: load that a vertex's node has now, or -1
    pliant_load_list *lists;         // NULL: none
    pliant_load_list received;       // of the solution taken over from an exchange
    int32_t loads_changed;
    pliant_vec3 gravity, summed_gravity;

    // The last solve.
    int32_t solved_count;
    pliant_constraint *solved;  // shape [capacity], vertices ascending: S as it was resolved
    pliant_vec3 *reference;     // shape [capacity]: g_S of step (5)
    const pliant_capacitance *solved_type;      // NULL: S is empty
    float *fixed_displacement;                  // shape [k][4]: supports of the finest level
    uint32_t used_levels[PLIANT_DOMAIN_COUNT];  // levels of loads and S in a domain, as bits
    pliant_field fields[PLIANT_DOMAIN_COUNT];
    pliant_solver_report report;

    // Types and scratch.
    pliant_capacitance *types;  // shape [cache_count]
    int64_t solve_count;
    pliant_capacitance_scratch scratch;
    pliant_capacitance extended;  // S and the nodes of pliant_solver_compliance
    double compliance_shift;      // of its answers, while contact lasts
    pliant_pending pending;       // what a late solve was asked for
    pliant_cost cost;
    pliant_constraint *candidate;  // shape [capacity]: S on a coarser level
    pliant_node *key;              // shape [capacity]
    pliant_term *terms;            // shape [capacity]
    float *contact_values;         // shape [3 capacity]: q of step (4)
    float *contact_solution;       // shape [stride]
    int32_t *query_scratch;        // shape [query_capacity]
    int32_t *all_rows;             // shape [max(m, k)]: 0, 1, 2, ...
};

// Index in `constraints` (shape [count], ascending) of a vertex, or where it would go as -1 -
// index.
int32_t pliant_constraint_find(const pliant_constraint *constraints, int32_t count, int32_t vertex);

// statements.c: the load of this very node, as long as it is in the sum, or -1; take one off the
// list.
int32_t pliant_loads_find(const pliant_solver *solver, pliant_node node);
void pliant_loads_forget(pliant_solver *solver, int32_t load);
// statements.c: state a load, for which there is room.
void pliant_loads_set(pliant_solver *solver, pliant_node node, pliant_vec3 value);

// load_list.c: enter a list; take it out again, with whatever of it is in the sum.
void pliant_load_list_enter(pliant_solver *solver, pliant_load_list *list);
void pliant_load_list_leave(pliant_solver *solver, pliant_load_list *list);
// All its tractions become zero. Then one more, which stays until the next clear; loads has room
// for `capacity`, of which those still on their way out of the sum take a part. 0: there is none
// left.
void pliant_load_list_clear(pliant_solver *solver, pliant_load_list *list);
int32_t pliant_load_list_press(pliant_solver *solver, pliant_load_list *list, int32_t capacity,
                               pliant_node node, pliant_vec3 traction);
// What all lists had at a node in the last solve.
pliant_vec3 pliant_load_lists_summed(const pliant_solver *solver, pliant_node node);

// exchange.c: how many loads of lists an exchange carries for solvers of this capacity.
int32_t pliant_exchange_room(int32_t load_capacity);

// Step (3), base.c: bring `base` up to date with the loads.
void pliant_solver_update_base(pliant_solver *solver);
// What is specified at a vertex of a domain outside its rows, as in the last solve: tractions of
// free ones, displacements of fixed ones; loads and what S solved for, through their hats.
pliant_vec3 pliant_solver_boundary_value(const pliant_solver *solver, int32_t vertex);

// Step (2), types.c: resolve the constraints so that the solve ends by `deadline` and have the type
// of that set. solver->solved and solved_count become the set; the report is filled in.
const pliant_capacitance *pliant_solver_resolve(pliant_solver *solver, int64_t deadline);
// What solving for the constraints as they are stated would take, ns.
double pliant_solver_predict(pliant_solver *solver);

// types.c: use what is left until `deadline` for the set that was asked for, when it was not
// solved.
void pliant_solver_prepare(pliant_solver *solver, int64_t deadline);
// Solve again on the same S with the same type, for other loads.
void pliant_solver_repeat(pliant_solver *solver);
// Steps (2) to (5) done elsewhere: take S and what was solved for it over, and sum.
void pliant_solver_adopt(pliant_solver *solver, const pliant_constraint *solved,
                         const pliant_vec3 *reference, int32_t count);

// Step (6): bring a domain's g up to date as coefficients.
void pliant_solver_sum(pliant_solver *solver, int32_t domain);

// slack.c: where displaced node `member` of the last S would be if it alone were let go, m. 0: not
// known, since the inverse has nothing for it.
int32_t pliant_solver_slack(const pliant_solver *solver, int32_t member, pliant_vec3 *u);
