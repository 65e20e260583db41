// capacitance.h: the capacitance matrix of one boundary-value-problem type and its inverse.
//
// A type is the set S of nodes whose specified and unspecified values change places. Its matrix
//
//     C = - E^T Xi E,     C_ij = - (value at vertex k_i of xi_[l_j,k_j])          (GF-19, 67, 69)
//
// comes out of the compressed columns by selective reconstruction, a column at a time for all of S.
// Nodes may be of any stored levels, mixed (GF-68): the hats interpolate, so rows are values at
// vertices whatever the level. The explicit inverse is kept, so that a contact solve is one product
// of 3s x 3s.
//
// Weighted by the areas of the hats, -C is a contact compliance. What is inverted is that, scaled
// to a unit diagonal:
//
//     M = D A (E^T Xi E) D + shift,     D_ii = 1 / sqrt(diagonal of A E^T Xi E)
//
// As stored, its symmetric part is positive definite with reciprocity, for displaced free nodes and
// freed fixed nodes alike (their coupling is skew and drops out). Compression can break that: a
// type which lost it is marked rough, and one whose matrix has become singular is solved with the
// first shift of 2^-20, 2^-16, 2^-12, ... that restores definiteness, so that values stay finite.
//
// Passive, M is symmetric and positive definite by construction (its skew part, between free and
// freed fixed nodes, does no work): opposite elements are averaged, each weighted by how far its
// column is to be believed; of nodes on two levels the element at the finer vertex is taken for
// both, since there a point's displacement is near the hat's mean, which is what reciprocity is
// about. Where the least eigenvalue is under 2^-10, the
// diagonal is raised by a shift. All sets with one shift are parts of one matrix, so contact has
// one elastic energy whatever nodes come and go; and a larger shift is a softer body, which only
// loses energy. So the owner never lets the shift fall while there is contact (held_shift), and no
// loop can gain. (Tried and lost: one shift for a whole model. Thin parts make it larger than the
// diagonal, 3 to 7 on the evaluation mesh bunny_L4, where patches need none or tenths.)
//
// When nodes come and go, M and its inverse follow by bordering in O(s^2) (bordering.h); a residual
// is looked at after every update.
#pragma once

#include "dense.h"
#include "model.h"
#include "reconstruction.h"

typedef struct pliant_capacitance {
    int32_t count;       // s; -1: holds no type
    pliant_node *nodes;  // shape [count], in no order: this is the order of M
    int32_t *order;      // shape [count]: members by ascending vertex; with nodes, the key
    int32_t *slot;       // shape [count]: where plan[domain] leaves the node's value
    pliant_reconstruction plan[PLIANT_DOMAIN_COUNT];  // values of S, a plan a domain
    size_t leading;                                   // of matrix and inverse
    double *scale;                                    // shape [3 count]: D
    double *matrix;                                   // M
    double *inverse;                                  // M^-1
    size_t stride;                                    // of product
    float *product;                                   // C^-1, 3 s columns of `stride`
    double largest[PLIANT_DOMAIN_COUNT];  // diagonal of A E^T Xi E; at each node's arrival
    double shift;          // in M's diagonal; INFINITY: nothing helped, product is zero
    double residual;       // |M M^-1 x - x| / |x| for a random x, after an update
    int32_t update_count;  // nodes that came or went since the inverse was made from scratch
    pliant_status status;  // PLIANT_OK or PLIANT_ROUGH
    int64_t last_used;     // the owner's count of solves
} pliant_capacitance;

// Workspace for building; one serves all types of a solver.
typedef struct pliant_capacitance_scratch {
    pliant_compliance compliance;  // the rule
    double held_shift;             // least shift of what is built: the owner's, 0 when stored
    pliant_reconstruction_scratch domain[PLIANT_DOMAIN_COUNT];
    pliant_reconstruction border[PLIANT_DOMAIN_COUNT];  // values of the nodes that come
    int32_t *positions;                                 // shape [capacity]
    int32_t *index;                                     // shape [capacity]
    int32_t *slots;                                     // shape [capacity]
    int32_t *added;                                     // shape [capacity]
    int32_t *border_slot;                               // shape [capacity]
    int32_t *pivots;                                    // shape [3 capacity]
    double *work_matrix;                                // [3 capacity][leading]
    double *work;                                       // of dense.h and bordering.h
    double *vectors;                                    // shape [6][leading]
    float *blocks;                                      // shape [slots][16]
} pliant_capacitance_scratch;

// How many domains have both rows and columns: 2 with supports, else 1.
int32_t pliant_capacitance_domain_count(const pliant_model *model);

void pliant_capacitance_lay_out(pliant_arena *arena, const pliant_model *model, int32_t capacity,
                                pliant_capacitance *capacitance);
void pliant_capacitance_scratch_lay_out(pliant_arena *arena, const pliant_model *model,
                                        int32_t capacity, pliant_capacitance_scratch *scratch);
void pliant_capacitance_scratch_begin(const pliant_model *model, pliant_compliance compliance,
                                      pliant_capacitance_scratch *scratch);

// Extract and invert for `nodes`, shape [count], by ascending vertex, each vertex once. Allocates
// nothing, cannot fail.
void pliant_capacitance_build(const pliant_model *model, const pliant_node *nodes, int32_t count,
                              pliant_capacitance_scratch *scratch, pliant_capacitance *capacitance);

// Is this the type of `nodes` (ascending)?
int32_t pliant_capacitance_matches(const pliant_capacitance *capacitance, const pliant_node *nodes,
                                   int32_t count);
// How many nodes an update to `nodes` (ascending) would have to drop and add.
typedef struct pliant_capacitance_difference {
    int32_t dropped, added;
} pliant_capacitance_difference;
pliant_capacitance_difference pliant_capacitance_compare(const pliant_capacitance *capacitance,
                                                         const pliant_node *nodes, int32_t count);
// Make a copy that update may then change.
void pliant_capacitance_copy(const pliant_capacitance *from, pliant_capacitance *to);
// Turn the type, which is not rough, into that of `nodes` by bordering. 0: the type has to be
// built, since a residual is beyond 1e-9 (the inverse has drifted) or a pivot of the nodes that
// came is too small. These pivots stand for definiteness: for a symmetric M exactly, for a stored
// one, whose skew part is some percent, but for its square.
int32_t pliant_capacitance_update(const pliant_model *model, const pliant_node *nodes,
                                  int32_t count, pliant_capacitance_scratch *scratch,
                                  pliant_capacitance *capacitance);

// The part of an update that makes M: plan all members, and fill M's rows and columns of those from
// `kept` on; the others have scale and largest.
void pliant_capacitance_extend(const pliant_model *model, int32_t kept,
                               pliant_capacitance_scratch *scratch, pliant_capacitance *type);

// E^T Xi E itself, at (3 i + r) + (3 j + c) leading in `matrix`; the extraction part of build,
// after plan: for tests and benchmarks. Members are in the order of `nodes`.
void pliant_capacitance_plan(const pliant_model *model, const pliant_node *nodes, int32_t count,
                             pliant_capacitance_scratch *scratch, pliant_capacitance *capacitance);
void pliant_capacitance_extract(const pliant_model *model, const pliant_capacitance *capacitance,
                                pliant_capacitance_scratch *scratch, double *matrix);
// Build in parts, for those who have no time for the whole; each leaves the type for the next, and
// nodes, order, count and shift are the caller's to set: plan the members; extract columns begin ..
// end - 1; when all are there, set the scales; weigh columns begin .. end - 1, ascending; invert in
// slices, beginning with a zeroed state.
void pliant_capacitance_plan_members(const pliant_model *model, pliant_capacitance_scratch *scratch,
                                     pliant_capacitance *capacitance);
void pliant_capacitance_extract_columns(const pliant_model *model, int32_t begin, int32_t end,
                                        pliant_capacitance_scratch *scratch,
                                        pliant_capacitance *capacitance);
void pliant_capacitance_set_scales(const pliant_model *model, pliant_capacitance *capacitance);
void pliant_capacitance_weigh_columns(const pliant_model *model, int32_t begin, int32_t end,
                                      pliant_capacitance_scratch *scratch,
                                      pliant_capacitance *capacitance);
// DONE: the type is whole, and not rough.
pliant_dense_progress pliant_capacitance_sweep_step(const pliant_model *model,
                                                    pliant_capacitance_scratch *scratch,
                                                    pliant_dense_sweep *sweep,
                                                    pliant_capacitance *capacitance);
// After extract: the rest of build.
void pliant_capacitance_invert(const pliant_model *model, pliant_capacitance_scratch *scratch,
                               pliant_capacitance *capacitance);
