// reference_lattice.h: FastLSM's slow obvious path, in double, straight from the formulas.
//
// It shares no code with the library: one-rings from a dense grid of cells, regions by
// breadth-first search, all sums one by one, rotations by LAPACK's eigenvectors of Davenport's 4 x
// 4 matrix. Cost and memory go with the sum of the regions' sizes: meant for a few thousand
// particles.
//
//     reference_lattice *l = reference_lattice_create(cell_count, cells, 2, 0.1, NULL);
//     l->x[3 * i] += 0.01;                 // x and v are there to be written
//     reference_lattice_step(l, &(reference_step){.dt = 0.01});
//     reference_lattice_destroy(l);
//
// LSM-n: Rivers & James, FastLSM, ACM TOG 26(3), 2007. Tests fail on lack of memory.
#pragma once

#include <stdint.h>

typedef struct reference_lattice {
    int32_t particle_count, half_width;
    int32_t *particles;    // shape [particle_count][3]: the cells' corners, ascending by (z, y, x)
    double *x0;            // shape [particle_count][3]: cell_size * particles, m
    double *mass;          // kg
    double *x, *v, *f;     // shape [particle_count][3]: m, m/s, N; at first x0, 0, 0
    int32_t *ring_offset;  // one-ring of i: ring[ring_offset[i] .. ring_offset[i + 1]), without i,
    int32_t *ring;         //   ascending; -1 in the place of a broken link's other end
    int32_t *region_offset;  // R_i: region[region_offset[i] .. region_offset[i + 1]), ascending;
    int32_t *region;         //   also the regions that i is in, as links go both ways
    double *turn;            // shape [particle_count][4]: each region's last rotation (x, y, z, w)
} reference_lattice;

// What the shape match of a region found.
typedef struct reference_match {
    double mass;         // M_r
    double centre0[3];   // c0_r
    double centre[3];    // c_r (LSM-9)
    double moment[9];    // A_r (LSM-10), row r column c at 3 r + c
    double rotation[9];  // R_r
} reference_match;

typedef struct reference_step {
    double dt;             // s
    double damping;        // k of LSM-13, 14, 0..1
    double rigid_damping;  // the same for the body as a whole
} reference_step;

typedef struct reference_motion {
    double mass, centre[3], momentum[3], angular_momentum[3];  // about the origin
    double kinetic_energy;
} reference_motion;

// `cells` has shape [cell_count][3], in any order. `mass` has shape [particle_count], NULL: 1 each.
reference_lattice *reference_lattice_create(int32_t cell_count, const int32_t *cells,
                                            int32_t half_width, double cell_size,
                                            const double *mass);
void reference_lattice_destroy(reference_lattice *lattice);

// The particle at those coordinates, or -1.
int32_t reference_lattice_find(const reference_lattice *lattice, const int32_t place[3]);
// 1: i and j share a cell and their link is whole.
int reference_lattice_linked(const reference_lattice *lattice, int32_t i, int32_t j);
// Break the link between i and j, which there must be, for good; regions() must follow.
void reference_lattice_break(reference_lattice *lattice, int32_t i, int32_t j);
// Find all regions anew.
void reference_lattice_regions(reference_lattice *lattice);

// Region r's match of the positions as they are. Where the rotation is not unique it is the one
// nearest to lattice->turn, which takes the result.
void reference_lattice_match(reference_lattice *lattice, int32_t r, reference_match *match);
// g, shape [particle_count][3]: the mean of the regions' goals (LSM-12).
void reference_lattice_goals(reference_lattice *lattice, double *g);
// v goes by k of the way to the mean of the regions' rigid velocities (LSM-13, 14).
void reference_lattice_damp(reference_lattice *lattice, double k);
// The same with all particles as one region (Mueller et al., Position based dynamics, 2006).
void reference_lattice_damp_rigid(reference_lattice *lattice, double k);
// LSM-1, the dampings at the old positions, LSM-2. Forces stay as they are.
void reference_lattice_step(reference_lattice *lattice, const reference_step *step);

reference_motion reference_lattice_motion(const reference_lattice *lattice);
