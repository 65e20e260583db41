// exceptions.h: what a region lacks of its window, particle by particle.
//
// Most irregular regions lack a few particles at the rim of their window, which are near but more
// than w steps away (a ball of 57,000 particles: one region in eight at w = 1, 4 particles each;
// two in five at w = 8, 12 each). Their sums are the window's minus those few. Lacking is mutual,
// so that one list serves both ways: sums of a region leave out the particles of its list, and a
// particle's goal leaves out the regions of its list. Regions that lack more are made of parts
// (irregular.h).
#pragma once

#include "pliant/arena.h"
#include "pliant/regions.h"

#define PLIANT_EXCEPTION_LIMIT 256  // of one region,
#define PLIANT_EXCEPTION_FEW                                                                       \
    32  // and where it has less than twice as many itself; see bench_lattice

// Where a particle with an irregular region is in its column.
typedef struct pliant_exception_place {
    int32_t k;  // its index
    int32_t s;  // above the column's lowest block
    int32_t lane;
} pliant_exception_place;

// Where it is in its slab.
typedef struct pliant_exception_row {
    int32_t k;
    int32_t row, x;  // above the slab's first row; along it
} pliant_exception_row;

typedef struct pliant_exceptions {
    int32_t count;          // particles with irregular regions, ascending
    int32_t *particle;      // shape [count]
    int32_t *slab_first;    // shape [slabs + 1]: the first of each slab
    int32_t *column_first;  // shape [columns + 1] into `column_items`
    // Those of each column and of each slab, the longest lists first: loops over lists then end
    // where the processor expects it.
    pliant_exception_place *column_items;  // shape [count]
    pliant_exception_row *slab_items;      // shape [count]
    // The list of k: items first[k] .. first[k + 1] - 1, an even number, filled up with `count`,
    // which stands for nothing.
    int32_t *first;      // shape [count + 1]
    int32_t *other;      // shape [items]: who is lacked, and whose region lacks k
    int16_t (*step)[4];  // shape [items]: its place less k's, and 1; all 0 for nothing
    uint8_t *is_listed;  // shape [count]: 1: the region's sums are mended by its list
} pliant_exceptions;

struct pliant_lattice;

// Room for an exception for every region node, and their places; the lists are still to come.
PLIANT_UNUSED_RESULT pliant_status pliant_exceptions_reserve(struct pliant_lattice *lattice,
                                                             const pliant_regions *regions);
// The lists, once is_listed says whose sums need them. exception_of has shape [particle_count]: a
// particle's index, or -1. PLIANT_ERR_FORMAT: one region lacks a particle whose own does not lack
// it.
PLIANT_UNUSED_RESULT pliant_status pliant_exceptions_list(struct pliant_lattice *lattice,
                                                          const pliant_regions *regions,
                                                          const int32_t *exception_of);
