// capacitance.h: the capacitance matrix of one boundary-value-problem type, extracted and inverted.
//
// A type is the set S of nodes whose specified and unspecified values change places. Its matrix
//
//     C = - E^T Xi E                                                       (GF-19)
//
// comes out of the compressed columns by selective reconstruction, a column at a time for all of S.
// The explicit inverse is kept, so that a contact solve is one product of 3s x 3s.
//
// Weighted by areas, -C is a contact compliance: with reciprocity its symmetric part is positive
// definite, for displaced free nodes and freed fixed nodes alike (their coupling is skew and drops
// out). Compression can break that. A type which lost it is marked rough; one whose matrix has
// become singular is solved with a diagonal shift of the scaled matrix (whose diagonal is one): the
// first of 2^-20, 2^-16, 2^-12, ... that restores definiteness, so that values stay finite.
#pragma once

#include "model.h"
#include "reconstruction.h"

typedef struct pliant_capacitance {
    int32_t count;      // s; -1: holds no type
    int32_t *vertices;  // shape [count], ascending: the key
    int32_t *slot;      // shape [count]: where plan[domain] leaves the node's value
    pliant_reconstruction plan[PLIANT_DOMAIN_COUNT];  // values of S, a plan a domain
    size_t stride;
    float *inverse;        // C^-1, 3 s columns of `stride`
    pliant_status status;  // PLIANT_OK or PLIANT_ROUGH
    int64_t last_used;     // the owner's count of solves
} pliant_capacitance;

// Workspace for building; one serves all types of a solver.
typedef struct pliant_capacitance_scratch {
    pliant_reconstruction_scratch domain[PLIANT_DOMAIN_COUNT];
    int32_t *positions;   // shape [capacity]
    int32_t *index;       // shape [capacity]
    int32_t *slots;       // shape [capacity]
    int32_t *pivots;      // shape [3 capacity]
    double *scale;        // shape [3 capacity]
    double *compliance;   // the scaled matrix, [3 capacity][stride]
    double *work_matrix;  // likewise
    double *work;         // of dense.h
    float *blocks;        // shape [slots][16]
} pliant_capacitance_scratch;

// How many domains have both rows and columns: 2 with supports, else 1.
int32_t pliant_capacitance_domain_count(const pliant_model *model);

void pliant_capacitance_lay_out(pliant_arena *arena, const pliant_model *model, int32_t capacity,
                                pliant_capacitance *capacitance);
void pliant_capacitance_scratch_lay_out(pliant_arena *arena, const pliant_model *model,
                                        int32_t capacity, pliant_capacitance_scratch *scratch);
void pliant_capacitance_scratch_begin(const pliant_model *model,
                                      pliant_capacitance_scratch *scratch);

// Extract and invert for `vertices`, shape [count], ascending. Allocates nothing, cannot fail.
void pliant_capacitance_build(const pliant_model *model, const int32_t *vertices, int32_t count,
                              pliant_capacitance_scratch *scratch, pliant_capacitance *capacitance);

// E^T Xi E itself, row-major blocks, compliance[(3 i + r) + (3 j + c) stride]; the extraction part
// of build, after plan: for tests and benchmarks.
void pliant_capacitance_plan(const pliant_model *model, const int32_t *vertices, int32_t count,
                             pliant_capacitance_scratch *scratch, pliant_capacitance *capacitance);
void pliant_capacitance_extract(const pliant_model *model, const pliant_capacitance *capacitance,
                                pliant_capacitance_scratch *scratch, double *compliance);
