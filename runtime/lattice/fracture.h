// fracture.h: links that are stretched too far break, and the regions about them are found again.
//
// A link longer than 1 + strain limit times its rest length breaks for good (Terzopoulos and
// Fleischer, Modeling Inelastic Deformation, 1988; LSM 4). Only regions whose window holds an end
// of a broken link can change; their sizes, m~, masses and centres follow, and they are made of
// parts from then on, whatever they lack, so that pieces that fly apart do not see each other's
// rounding.
#pragma once

#include "lattice/lattice.h"

typedef struct pliant_fracture {
    pliant_links *links;  // owned: what still holds
    // Every block its own:
    int32_t *particle_constants_of, *region_constants_of;  // shape [block_count], [turn_count]
    pliant_particle_constants *particle_constants;
    pliant_region_constants *region_constants;
    pliant_irregular irregular;
    uint8_t *is_listed;    // shape [exceptions]: all 0
    int32_t *size;         // shape [particle_count], |R_i|
    uint8_t *state;        // shape [particle_count], while breaking
    int32_t *stale;        // shape [particle_count]: regions to look at again
    int32_t *light;        // shape [particle_count]: regions whose masses changed
    uint8_t *slab_breaks;  // shape [dims z]
    pliant_reach *reach;
    float *rows;        // 15 padded rows for each worker
    int64_t cut_count;  // links broken so far
    pliant_arena arena;
} pliant_fracture;

// Memory for whatever may break, so that nothing is allocated later.
PLIANT_UNUSED_RESULT pliant_status pliant_fracture_create(const pliant_lattice *lattice,
                                                          int32_t worker_count,
                                                          pliant_fracture **fracture,
                                                          pliant_error *err);
void pliant_fracture_destroy(pliant_fracture *fracture);  // NULL is fine
void pliant_fracture_copy(pliant_fracture *to, const pliant_fracture *from,
                          const pliant_lattice *lattice);

void pliant_fracture_mend(pliant_fracture *fracture, const pliant_lattice *lattice);  // all holds

struct pliant_body;
// Break what is stretched beyond the body's strain limit; returns how many links broke.
int64_t pliant_fracture_break(struct pliant_body *body);
