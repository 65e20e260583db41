// links.h: which particles of a lattice hold on to each other.
//
// A lattice is made of cubic cells; its particles are their corners. Two particles are linked when
// they share a cell (the one-ring N_i of LSM 2), so every link runs along one of 26 directions,
// 13 and their opposites. Links may be cut one by one; what is reached from a particle in w steps
// along links is its shape matching region R_i. Everything is kept as rows of bits along x, so that
// a region is reached a row at a time.
#pragma once

#include "pliant/base.h"

#define PLIANT_LATTICE_DIM_LIMIT   1024       // particles along an axis
#define PLIANT_LATTICE_WIDTH_LIMIT 15         // half-width w: a window row is 31 bits
#define PLIANT_LATTICE_LIMIT       (1 << 26)  // particles
#define PLIANT_LINK_DIRECTIONS     13
#define PLIANT_WINDOW_LIMIT        (2 * PLIANT_LATTICE_WIDTH_LIMIT + 1)

typedef struct pliant_lattice_shape {
    int32_t dims[3];  // particles along x, y, z
    int32_t particle_count;
    int32_t cell_count;
    const int32_t *particles;  // shape [particle_count][3], ascending by (z, y, x); borrowed
    const int32_t *cells;      // shape [cell_count][3], least corners, likewise; borrowed
} pliant_lattice_shape;

// The distinct corners of `cells` (shape [cell_count][3]), ascending by (z, y, x). `particles` has
// room for [8 * cell_count][3]; returns how many there are.
int32_t pliant_lattice_particles(int32_t cell_count, const int32_t *cells, int32_t *particles);

// Direction d of 0..12, as (dx, dy, dz): those after (0, 0, 0) in the order of (dz, dy, dx).
static inline void pliant_link_direction(int32_t d, int32_t step[3])
{
    step[0] = (d + 14) % 3 - 1;
    step[1] = (d + 14) / 3 % 3 - 1;
    step[2] = (d + 14) / 9 - 1;
}

typedef struct pliant_links pliant_links;

// Shape is only read during the call. PLIANT_ERR_ARGUMENT: not sorted, or beyond the limits.
PLIANT_UNUSED_RESULT pliant_status pliant_links_create(const pliant_lattice_shape *shape,
                                                       pliant_links **links, pliant_error *err);
PLIANT_UNUSED_RESULT pliant_status pliant_links_copy(const pliant_links *from, pliant_links **links,
                                                     pliant_error *err);
void pliant_links_restore(pliant_links *links, const pliant_links *from);  // of the same shape
void pliant_links_destroy(pliant_links *links);                            // NULL is fine

int32_t pliant_links_particle(const pliant_links *links, int32_t x, int32_t y, int32_t z);  // -1
// 1: the particle at (x, y, z) is linked along direction d.
int32_t pliant_links_has(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t d);
// Bit k: the particle at (x + k, y, z) is linked along direction d; 32 of them, x >= 0.
uint32_t pliant_links_row(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t d);
// 1: the cell whose least corner this is is there, and all its corners are linked.
int32_t pliant_links_is_whole(const pliant_links *links, int32_t x, int32_t y, int32_t z);
void pliant_links_cut(pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t d);
// The directions that (x, y, z) is linked along, bit d for direction d.
uint32_t pliant_links_mask(const pliant_links *links, int32_t x, int32_t y, int32_t z);

// A region in its window of (2w + 1)^3 places, as rows of bits: bit dx + w of row [dz + w][dy + w].
typedef struct pliant_reach {
    int32_t size;        // |R|
    int32_t is_regular;  // 1: every particle of the window is a member
    uint32_t member[PLIANT_WINDOW_LIMIT][PLIANT_WINDOW_LIMIT];
    uint32_t window[PLIANT_WINDOW_LIMIT][PLIANT_WINDOW_LIMIT];  // the particles that there are
    // Scratch: links of the window's particles.
    uint32_t link[PLIANT_LINK_DIRECTIONS][PLIANT_WINDOW_LIMIT][PLIANT_WINDOW_LIMIT];
} pliant_reach;

// The particles of the window of (x, y, z), as `window` and `member` of `reach`; size is theirs.
void pliant_links_window(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t w,
                         pliant_reach *reach);
// What the particle at (x, y, z) reaches in w steps.
void pliant_links_reach(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t w,
                        pliant_reach *reach);
