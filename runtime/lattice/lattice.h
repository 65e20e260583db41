// lattice.h: one lattice with one half-width, laid out for the step; const once made, and shared.
//
// Particles live in blocks of 8 places along x (lanes), so that the sums of LSM 3 run over lanes. A
// block with at least one particle is kept; lanes without one have no mass. Blocks are numbered by
// (z, y, x). A slab is the blocks of one z; a column the blocks of one (x, y) above each other,
// over which sums along z run. For every place of a column that reaches w above and below its
// particles there is room for a plate's sums.
#pragma once

#include "lattice/exceptions.h"
#include "lattice/irregular.h"
#include "pliant/pliant.h"

#define PLIANT_LANES 8

// What a step knows of a block's particles, and of its regions. Equal ones are stored once: inside
// a solid all are equal, and stay in the cache.
typedef struct pliant_particle_constants {
    float share[PLIANT_LANES];         // m~_i = m_i / |R_i|, kg; 0: no particle
    float inverse_size[PLIANT_LANES];  // 1 / |R_i|
    float is_particle[PLIANT_LANES];   // 1, 0
} pliant_particle_constants;

typedef struct pliant_region_constants {
    float inverse_mass[PLIANT_LANES];  // 1 / M_r, 1/kg
    float offset[3][PLIANT_LANES];     // (c0_r - x0_r) / cell size
    float is_particle[PLIANT_LANES];
} pliant_region_constants;

typedef struct pliant_lattice_column {
    int32_t x, y;        // x in blocks
    int32_t z, length;   // from its lowest to its highest block
    int32_t first_site;  // of its length + 2w sites, from z - w
    int32_t first_turn;  // of its length turns: what belongs to its regions
} pliant_lattice_column;

struct pliant_lattice {
    const pliant_model *model;  // for the embedded surface; NULL: made from a definition alone
    struct pliant_embedded *embedded;  // owned; NULL without a model
    int32_t half_width;                // w
    int32_t dims[3];
    int32_t row_blocks;  // blocks that a row of dims[0] places takes
    int32_t particle_count, cell_count;
    int32_t region_count, irregular_count, component_count, is_shell;
    float cell_size;
    double origin[3], mass;

    pliant_links *links;
    int32_t *places;  // shape [particle_count][3]: lattice coordinates
    int32_t *cells;   // shape [cell_count][3]
    float *rest;      // shape [particle_count][3], m
    int32_t *slot;    // shape [particle_count]: place of x in a block array of shape [block][3][8]

    int32_t block_count, column_count, site_count, turn_count;
    int32_t *block_at;         // shape [dims z][dims y][row_blocks], or -1
    int32_t *block_place;      // shape [block_count][3]: x in blocks, y, z
    int32_t *block_particles;  // shape [block_count]: its first particle; lanes follow in order
    int32_t *slab_first;       // shape [dims z + 1]: first block of a slab
    int32_t *slab_rows;  // shape [dims z][2]: rows y that hold blocks, from .. to (past the end)
    int32_t *column_at;  // shape [dims y][row_blocks], or -1
    pliant_lattice_column *columns;
    float *lane_mass;                // shape [block_count][8], kg
    float *lane_inverse;             // shape [block_count][8], 1/kg; 0: no particle
    int32_t *turn_block;             // shape [turn_count]: the block there, or -1
    int32_t *particle_constants_of;  // shape [block_count]
    int32_t *region_constants_of;    // shape [turn_count], where there is a block
    int32_t particle_constants_count, region_constants_count;
    pliant_particle_constants *particle_constants;
    pliant_region_constants *region_constants;
    pliant_exceptions exceptions;  // regions that lack little
    pliant_irregular irregular;    // and those that lack much
    int32_t column_regions;        // most of the latter in a column

    pliant_arena arena, turn_arena, particle_arena, region_arena, exceptions_arena, items_arena,
        irregular_arena;
};

// What a lattice is made of; everything is only read during the call.
typedef struct pliant_lattice_def {
    pliant_lattice_shape shape;
    const float *mass;              // shape [particle_count], kg, above 0
    const pliant_regions *regions;  // with the half-width
    double origin[3], cell_size;    // m
    int32_t component_count, is_shell;
} pliant_lattice_def;

PLIANT_UNUSED_RESULT pliant_status pliant_lattice_build(const pliant_lattice_def *def,
                                                        pliant_lattice **lattice,
                                                        pliant_error *err);

static inline pliant_region_place pliant_lattice_place(const pliant_lattice *lattice,
                                                       int32_t particle)
{
    const int32_t *at = lattice->places + 3 * (size_t)particle, slot = lattice->slot[particle];
    const int32_t column = lattice->column_at[at[1] * lattice->row_blocks + at[0] / PLIANT_LANES];
    return (pliant_region_place){.particle = particle,
                                 .column = column,
                                 .turn = lattice->columns[column].first_turn + at[2] -
                                         lattice->columns[column].z,
                                 .block = slot / (3 * PLIANT_LANES),
                                 .lane = slot % PLIANT_LANES,
                                 .x = at[0],
                                 .y = at[1],
                                 .z = at[2]};
}
