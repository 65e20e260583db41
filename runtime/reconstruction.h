// reconstruction.h: selective inverse wavelet transform (GF 5.3): values of chosen nodes only.
//
// A plan is the closure of what the chosen nodes need: which coefficients to load into slots, and
// which sums over slots to form, in order. It is built once for a set of nodes and then applied to
// any number of vectors, at a cost that follows the number of chosen nodes times the number of
// levels. Applied to all nodes it is the whole inverse transform.
//
// One plan has one user at a time; the wavelet behind it is shared and const.
#pragma once

#include "pliant/arena.h"
#include "pliant/wavelet.h"

typedef struct pliant_reconstruction {
    const pliant_wavelet *wavelet;  // borrowed
    int32_t slot_count;
    int32_t *position;  // shape [slot_count]: the coefficient that a slot starts from
    int32_t op_count;
    int32_t *target;  // shape [op_count]: slot[target] += sum of weight * slot[source]
    int32_t *begin;   // shape [op_count + 1]: an op's entries in source and weight
    int32_t *source;
    float *weight;
} pliant_reconstruction;

// What building needs and leaves as it found it; one serves all plans of a domain.
typedef struct pliant_reconstruction_scratch {
    int32_t *slot_of;    // shape [count + 1]: slot of a position, -1 between calls
    int32_t *needed;     // shape [count]: positions whose value is needed, a segment a level
    uint8_t *is_needed;  // shape [count]: 0 between calls
} pliant_reconstruction_scratch;

// Room for any set of nodes of the domain; pages that no plan reaches are never touched again.
void pliant_reconstruction_lay_out(pliant_arena *arena, const pliant_wavelet *wavelet,
                                   pliant_reconstruction *plan);
void pliant_reconstruction_scratch_lay_out(pliant_arena *arena, const pliant_wavelet *wavelet,
                                           pliant_reconstruction_scratch *scratch);
// After the carving pass, once.
void pliant_reconstruction_scratch_begin(const pliant_wavelet *wavelet,
                                         pliant_reconstruction_scratch *scratch);

// Plan the values at `positions` (shape [count], any order, repeats allowed); slots[i] tells where
// the value of positions[i] will be.
void pliant_reconstruction_build(pliant_reconstruction *plan,
                                 pliant_reconstruction_scratch *scratch, const int32_t *positions,
                                 int32_t count, int32_t *slots);

// Load the slots from g, shape [m + 1][4], and run; `work` has shape [slot_count][4], both aligned.
void pliant_reconstruction_run(const pliant_reconstruction *plan, const float *g, float *work);

// Run on slots that hold 3x3 blocks, row-major in rows of 16 floats of which nine are used; `work`
// has shape [slot_count][16], 64-byte aligned.
void pliant_reconstruction_run_blocks(const pliant_reconstruction *plan, float *work);

// For loading a sparse column: map the plan's positions to slots in scratch->slot_of, and back to
// -1.
void pliant_reconstruction_map(const pliant_reconstruction *plan,
                               pliant_reconstruction_scratch *scratch);
void pliant_reconstruction_unmap(const pliant_reconstruction *plan,
                                 pliant_reconstruction_scratch *scratch);
