// irregular.h: regions that are not all particles of their window, ready for summing (LSM 3.1).
//
// The sum over region r is the sum over its window, minus what of the window is not in r, where
// that is little; else it is made of r's parts alone:
//
//     sum_r = window - sum of parts  (sign -1)      sum_r = sum of parts  (sign +1)
//
// A part is a plane of the window, whole or restricted. A restricted plane, a plate, is made of
// rows, whole (the bars that everybody shares) or restricted to the particles of a mask. Equal
// plates of one place are one, whoever takes them. Regions hang on their column of blocks, plates
// on their slab, so that whoever works on a column or a slab owns what it writes to. Nodes have a
// fixed size: a body that breaks takes and gives them back without allocating.
#pragma once

#include "pliant/arena.h"
#include "pliant/regions.h"

typedef struct pliant_part {
    int32_t plane;  // z - z_r + w, 0 .. 2w
    int32_t plate;  // or -1: the whole plane
} pliant_part;

typedef struct pliant_region_node {
    int32_t next;  // of this column, or -1
    int32_t particle, block, lane, z;
    int32_t sign;  // -1 or +1, see above
    int32_t part_count;
} pliant_region_node;

typedef struct pliant_row {
    int32_t row;    // y - y_plate + w, 0 .. 2w
    uint32_t mask;  // bit dx + w; with PLIANT_ROW_WHOLE: all particles of the row's window
} pliant_row;

typedef struct pliant_plate_node {
    int32_t next;  // of this slab, or -1
    int32_t use_count;
    int32_t x, y, z;
    int32_t row_count;
} pliant_plate_node;

typedef struct pliant_irregular {
    int32_t half_width;
    int32_t column_count, slab_count;
    int32_t region_capacity, plate_capacity;
    int32_t region_count, plate_count;  // in use
    int32_t *column_head;               // shape [column_count]: first region node, or -1
    int32_t *slab_head;                 // shape [slab_count]: first plate node, or -1
    pliant_region_node *regions;        // shape [region_capacity]
    pliant_part *parts;                 // shape [region_capacity][2w + 1]
    pliant_plate_node *plates;          // shape [plate_capacity]
    pliant_row *rows;                   // shape [plate_capacity][2w + 1]
    int32_t free_region, free_plate;    // heads of what is not in use, or -1
} pliant_irregular;

// Twice, as arena.h says: to measure and to carve.
void pliant_irregular_lay_out(pliant_irregular *irregular, pliant_arena *arena);
void pliant_irregular_clear(pliant_irregular *irregular);  // nothing in use
// Into one of the same columns, slabs and half-width with at least the nodes that are in use.
void pliant_irregular_copy(pliant_irregular *irregular, const pliant_irregular *from);

// Which representation a region takes.
typedef enum pliant_region_rule {
    PLIANT_REGION_CHEAPEST,  // whichever has fewer parts
    PLIANT_REGION_APART,  // never minus: pieces that fly apart must not see each other's rounding
} pliant_region_rule;

// Where a region is: its particle, column and turn (see lattice.h), its place among the lanes.
typedef struct pliant_region_place {
    int32_t particle, column, turn, block, lane;
    int32_t x, y, z;
} pliant_region_place;

// Nodes that a region takes: members and window rows of `reach` are read. Returns -1 when the nodes
// do not suffice; then nothing has changed.
int32_t pliant_irregular_add(pliant_irregular *irregular, const pliant_region_place *place,
                             const pliant_reach *reach, pliant_region_rule rule);
// Give back the nodes of a particle's region, if it has any.
void pliant_irregular_remove(pliant_irregular *irregular, const pliant_region_place *place);
