// lattice_pair.h: a lattice body beside the slow reference of the same, and what may lie between.
//
//     lattice_pair *p = lattice_pair_create(CHECK_CELLS_COMB, 5, 2, NULL);
//     lattice_pair_deform(p, &random, 0.3);   // p->slow->x, and the body's
//     lattice_pair_check_goals(p);            // to rounding
//     lattice_pair_destroy(p);
//
// Masses are uneven, cells 0.1 m. Every function fails the running test when something refuses.
#pragma once

#include "cell_shapes.h"
#include "check.h"
#include "lattice/body.h"
#include "reference_lattice.h"

typedef struct lattice_pair {
    int32_t particle_count, cell_count, half_width;
    int32_t *cells;
    float *mass;  // shape [particle_count], kg
    double cell_size;
    reference_lattice *slow;
    pliant_lattice *lattice;
    pliant_body *body;
    double *goals, *slow_goals;  // shape [particle_count][3]: of the last lattice_pair_goals
    double *tolerance;           // shape [particle_count]: of the last lattice_pair_tolerances
    double worst;                // greatest part of a tolerance that a check has found used
} lattice_pair;

// `def` may be NULL.
lattice_pair *lattice_pair_create(check_cells shape, int32_t size, int32_t half_width,
                                  const pliant_body_def *def);
lattice_pair *lattice_pair_create_cells(int32_t cell_count, const int32_t *cells,
                                        int32_t half_width, const pliant_body_def *def);
void lattice_pair_destroy(lattice_pair *pair);
// Another body of the pair's lattice; the caller's.
pliant_body *lattice_pair_body(const lattice_pair *pair, const pliant_body_def *def);

// Give the body slow->x and slow->v, which become the floats that the body has.
void lattice_pair_set(lattice_pair *pair);
void lattice_pair_rest(lattice_pair *pair);  // x0, still
// Turned, sheared a little and bent, `noise` cells of jitter on top; still.
void lattice_pair_deform(lattice_pair *pair, check_random *random, double noise);
// Anywhere in a box of `extent` cells; still.
void lattice_pair_scatter(lattice_pair *pair, check_random *random, double extent);
void lattice_pair_velocities(lattice_pair *pair, check_random *random, double speed);

// Goals of both, from where they are: the body's are x + v after a match with h = 1 from stillness.
// Its velocities are lost.
void lattice_pair_goals(lattice_pair *pair);
// How far goals may be apart by rounding; see lattice_pair.c. Needs lattice_pair_goals before.
void lattice_pair_tolerances(lattice_pair *pair);
void lattice_pair_check_goals(lattice_pair *pair);  // all three
// m~, 1 / |R|, 1 / M and c0 of the body are those of slow's regions.
void lattice_pair_check_constants(const lattice_pair *pair);

// The greatest distance of a particle from the middle that sums are taken about, m.
double lattice_pair_extent(const lattice_pair *pair);
// What sums of a window may lose, relative to the sum of what they are made of.
double lattice_pair_rounding(const lattice_pair *pair);
// Elastic energy times h^2: half the sum over regions of m~_i |x_i - T_r x0_i|^2, of slow->x.
double lattice_pair_potential(lattice_pair *pair);
// slow->x and slow->v become the body's.
void lattice_pair_read(lattice_pair *pair);
// Links of the body that are no longer whole are broken in slow too, and its regions found anew.
// Returns how many are broken.
int32_t lattice_pair_follow_breaks(lattice_pair *pair);
// The greatest relative change of a link's length, of the body.
double lattice_pair_strain(const lattice_pair *pair);
int lattice_pair_is_finite(const lattice_pair *pair);

// Sizes that give every shape particles inside, at its rim and, at the greater widths, regions that
// lack much of their window.
int32_t lattice_pair_size(check_cells shape, int32_t w);
