// links.c: which particles of a lattice hold on to each other.
#include "pliant/links.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

// Rows of bits of one (y, z): a particle is here, the cell whose least corner is here has all its
// links, and the links along each direction.
enum { ROW_PARTICLES, ROW_WHOLE, ROW_LINKS, ROW_KINDS = ROW_LINKS + PLIANT_LINK_DIRECTIONS };

// Bit 0 of a row stands this far left of x = 0, so that a window needs no clipping on its left.
#define MARGIN (PLIANT_LATTICE_WIDTH_LIMIT + 1)

struct pliant_links {
    int32_t dims[3];
    int32_t word_count;  // of a row
    int32_t row_count;   // rows that hold particles
    int32_t *row;        // shape [dims z][dims y]: a row's place, or -1
    int32_t *first;      // shape [row_count]: the row's first particle
    uint64_t *bits;      // shape [row_count][ROW_KINDS][word_count]
};

static int compare_places(const void *a, const void *b)
{
    const int32_t *p = a, *q = b;
    for (int c = 2; c >= 0; c--)
        if (p[c] != q[c]) return p[c] < q[c] ? -1 : 1;
    return 0;
}

int32_t pliant_lattice_particles(int32_t cell_count, const int32_t *cells, int32_t *particles)
{
    size_t count = 0;
    for (int32_t i = 0; i < cell_count; i++)
        for (int32_t corner = 0; corner < 8; corner++, count++)
            for (int32_t c = 0; c < 3; c++)
                particles[3 * count + c] = cells[3 * (size_t)i + c] + (corner >> c & 1);
    qsort(particles, count, 3 * sizeof *particles, compare_places);
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        if (kept > 0 && !compare_places(particles + 3 * (kept - 1), particles + 3 * i)) continue;
        memmove(particles + 3 * kept++, particles + 3 * i, 3 * sizeof *particles);
    }
    return (int32_t)kept;
}

// ---- Rows ----

static uint64_t *row_bits(const pliant_links *links, int32_t row, int32_t kind)
{
    return links->bits + ((size_t)row * ROW_KINDS + kind) * links->word_count;
}

static int32_t row_at(const pliant_links *links, int32_t y, int32_t z)
{
    if (y < 0 || y >= links->dims[1] || z < 0 || z >= links->dims[2]) return -1;
    return links->row[(size_t)z * links->dims[1] + y];
}

static void set_bit(uint64_t *bits, int32_t x)
{
    bits[(x + MARGIN) / 64] |= (uint64_t)1 << (x + MARGIN) % 64;
}

static void clear_bit(uint64_t *bits, int32_t x)
{
    bits[(x + MARGIN) / 64] &= ~((uint64_t)1 << (x + MARGIN) % 64);
}

static int32_t has_bit(const uint64_t *bits, int32_t x)
{
    return bits[(x + MARGIN) / 64] >> (x + MARGIN) % 64 & 1;
}

// Bits x .. x + 31, of which a window keeps the first 2w + 1; x >= -MARGIN.
static uint32_t window_bits(const uint64_t *bits, int32_t x)
{
    const int32_t word = (x + MARGIN) / 64, shift = (x + MARGIN) % 64;
    const uint64_t low = bits[word] >> shift;
    return (uint32_t)(shift ? low | bits[word + 1] << (64 - shift) : low);
}

// ---- Life ----

static pliant_status allocate(pliant_links *links, pliant_error *err)
{
    const size_t table = (size_t)links->dims[1] * links->dims[2];
    links->row = malloc(table * sizeof *links->row);
    links->first = malloc((size_t)links->row_count * sizeof *links->first);
    links->bits =
        calloc((size_t)links->row_count * ROW_KINDS * links->word_count, sizeof *links->bits);
    if (links->row && links->first && links->bits) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "lattice: no memory for the links of %d rows",
                            links->row_count);
}

static pliant_status check_shape(const pliant_lattice_shape *shape, pliant_error *err)
{
    for (int c = 0; c < 3; c++)
        if (shape->dims[c] < 2 || shape->dims[c] > PLIANT_LATTICE_DIM_LIMIT)
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "lattice: expected 2 to %d particles along each axis, found %d",
                                    PLIANT_LATTICE_DIM_LIMIT, shape->dims[c]);
    if (shape->particle_count < 8 || shape->particle_count > PLIANT_LATTICE_LIMIT ||
        shape->cell_count < 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "lattice: expected 8 to %d particles and a cell, found %d and %d",
                                PLIANT_LATTICE_LIMIT, shape->particle_count, shape->cell_count);
    for (int32_t i = 0; i < shape->particle_count; i++) {
        const int32_t *p = shape->particles + 3 * (size_t)i;
        for (int c = 0; c < 3; c++)
            if (p[c] < 0 || p[c] >= shape->dims[c])
                return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                        "lattice: particle %d: expected a place in 0..%d, found %d",
                                        i, shape->dims[c] - 1, p[c]);
        if (i > 0 && compare_places(p - 3, p) >= 0)
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "lattice: particle %d: expected ascending places", i);
    }
    return PLIANT_OK;
}

static pliant_status link_cell(pliant_links *links, const int32_t *cell, int32_t i,
                               pliant_error *err)
{
    for (int32_t corner = 0; corner < 8; corner++)
        if (pliant_links_particle(links, cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1),
                                  cell[2] + (corner >> 2)) < 0)
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "lattice: cell %d: expected particles at its corners", i);
    set_bit(row_bits(links, row_at(links, cell[1], cell[2]), ROW_WHOLE), cell[0]);
    // Direction (dx, dy, dz) starts at every corner that it does not lead out of the cell from.
    for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
        int32_t step[3];
        pliant_link_direction(d, step);
        for (int32_t corner = 0; corner < 8; corner++) {
            int32_t p[3], inside = 1;
            for (int c = 0; c < 3; c++) {
                p[c] = cell[c] + (corner >> c & 1);
                inside &= p[c] + step[c] >= cell[c] && p[c] + step[c] <= cell[c] + 1;
            }
            if (inside) set_bit(row_bits(links, row_at(links, p[1], p[2]), ROW_LINKS + d), p[0]);
        }
    }
    return PLIANT_OK;
}

pliant_status pliant_links_create(const pliant_lattice_shape *shape, pliant_links **result,
                                  pliant_error *err)
{
    pliant_status status = check_shape(shape, err);
    if (status < 0) return status;
    pliant_links *links = calloc(1, sizeof *links);
    if (!links) return pliant_error_set(err, PLIANT_ERR_MEMORY, "lattice: no memory for links");
    memcpy(links->dims, shape->dims, sizeof links->dims);
    links->word_count = (shape->dims[0] + 2 * MARGIN + 63) / 64 + 1;
    const int32_t *p = shape->particles;
    for (int32_t i = 0; i < shape->particle_count; i++)
        links->row_count += i == 0 || p[3 * i + 1] != p[3 * i - 2] || p[3 * i + 2] != p[3 * i - 1];
    status = allocate(links, err);
    if (status < 0) goto done;

    memset(links->row, -1, (size_t)links->dims[1] * links->dims[2] * sizeof *links->row);
    for (int32_t i = 0, row = -1; i < shape->particle_count; i++, p += 3) {
        int32_t *at = links->row + (size_t)p[2] * links->dims[1] + p[1];
        if (*at < 0) links->first[ *at = ++row] = i;
        set_bit(row_bits(links, *at, ROW_PARTICLES), p[0]);
    }
    for (int32_t i = 0; i < shape->cell_count && status >= 0; i++)
        status = link_cell(links, shape->cells + 3 * (size_t)i, i, err);
done:
    if (status < 0) {
        pliant_links_destroy(links);
        return status;
    }
    *result = links;
    return PLIANT_OK;
}

pliant_status pliant_links_copy(const pliant_links *from, pliant_links **result, pliant_error *err)
{
    pliant_links *links = malloc(sizeof *links);
    if (!links) return pliant_error_set(err, PLIANT_ERR_MEMORY, "lattice: no memory for links");
    *links = *from;
    const pliant_status status = allocate(links, err);
    if (status < 0) {
        pliant_links_destroy(links);
        return status;
    }
    memcpy(links->row, from->row, (size_t)from->dims[1] * from->dims[2] * sizeof *links->row);
    memcpy(links->first, from->first, (size_t)from->row_count * sizeof *links->first);
    pliant_links_restore(links, from);
    *result = links;
    return PLIANT_OK;
}

void pliant_links_restore(pliant_links *links, const pliant_links *from)
{
    memcpy(links->bits, from->bits,
           (size_t)from->row_count * ROW_KINDS * from->word_count * sizeof *links->bits);
}

void pliant_links_destroy(pliant_links *links)
{
    if (!links) return;
    free(links->row);
    free(links->first);
    free(links->bits);
    free(links);
}

// ---- Links one by one ----

int32_t pliant_links_particle(const pliant_links *links, int32_t x, int32_t y, int32_t z)
{
    const int32_t row = row_at(links, y, z);
    if (row < 0 || x < 0 || x >= links->dims[0]) return -1;
    const uint64_t *bits = row_bits(links, row, ROW_PARTICLES);
    if (!has_bit(bits, x)) return -1;
    int32_t rank = links->first[row];
    const int32_t word = (x + MARGIN) / 64;
    for (int32_t k = 0; k < word; k++) rank += __builtin_popcountll(bits[k]);
    return rank + __builtin_popcountll(bits[word] & (((uint64_t)1 << (x + MARGIN) % 64) - 1));
}

int32_t pliant_links_has(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t d)
{
    const int32_t row = row_at(links, y, z);
    if (row < 0 || x < 0 || x >= links->dims[0]) return 0;
    return has_bit(row_bits(links, row, ROW_LINKS + d), x);
}

uint32_t pliant_links_row(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t d)
{
    const int32_t row = row_at(links, y, z);
    return row < 0 || x >= links->dims[0] ? 0 : window_bits(row_bits(links, row, ROW_LINKS + d), x);
}

int32_t pliant_links_is_whole(const pliant_links *links, int32_t x, int32_t y, int32_t z)
{
    const int32_t row = row_at(links, y, z);
    if (row < 0 || x < 0 || x >= links->dims[0]) return 0;
    return has_bit(row_bits(links, row, ROW_WHOLE), x);
}

uint32_t pliant_links_mask(const pliant_links *links, int32_t x, int32_t y, int32_t z)
{
    uint32_t mask = 0;
    for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++)
        mask |= (uint32_t)pliant_links_has(links, x, y, z, d) << d;
    return mask;
}

void pliant_links_cut(pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t d)
{
    if (!pliant_links_has(links, x, y, z, d)) return;
    clear_bit(row_bits(links, row_at(links, y, z), ROW_LINKS + d), x);
    // The cells that hold both ends: their least corner is at most one below both.
    int32_t step[3], least[3], most[3];
    pliant_link_direction(d, step);
    const int32_t from[3] = {x, y, z};
    for (int c = 0; c < 3; c++) {
        most[c] = step[c] < 0 ? from[c] + step[c] : from[c];
        least[c] = step[c] == 0 ? most[c] - 1 : most[c];
    }
    for (int32_t cz = least[2]; cz <= most[2]; cz++)
        for (int32_t cy = least[1]; cy <= most[1]; cy++) {
            const int32_t row = row_at(links, cy, cz);
            for (int32_t cx = least[0]; row >= 0 && cx <= most[0]; cx++)
                clear_bit(row_bits(links, row, ROW_WHOLE), cx);
        }
}

// ---- Reach ----

// 1: every cell of the window, cut to the lattice's box, is there and whole, so that every particle
// of the window is reached.
static int32_t is_whole(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t w)
{
    const int32_t low = x < w ? w - x : 0;  // cells x - w .. x + w - 1
    const int32_t high = x + w > links->dims[0] - 1 ? links->dims[0] - 1 - x + w : 2 * w;
    const uint32_t full = (high >= 32 ? 0 : (uint32_t)1 << high) - ((uint32_t)1 << low);
    const int32_t y1 = y + w < links->dims[1] ? y + w : links->dims[1] - 1;
    const int32_t z1 = z + w < links->dims[2] ? z + w : links->dims[2] - 1;
    for (int32_t cz = z > w ? z - w : 0; cz < z1; cz++)
        for (int32_t cy = y > w ? y - w : 0; cy < y1; cy++) {
            const int32_t row = row_at(links, cy, cz);
            if (row < 0) return 0;
            if ((window_bits(row_bits(links, row, ROW_WHOLE), x - w) & full) != full) return 0;
        }
    return 1;
}

static uint32_t shifted(uint32_t row, int32_t step)
{
    return step > 0 ? row << 1 : step < 0 ? row >> 1 : row;
}

// One step along every link from the members within `ring` rows of the centre; returns whether
// anything was reached.
static uint32_t grow(pliant_reach *reach, int32_t w, int32_t ring)
{
    const uint32_t inside = ((uint32_t)1 << (2 * w + 1)) - 1;
    uint32_t before[PLIANT_WINDOW_LIMIT][PLIANT_WINDOW_LIMIT];
    for (int32_t z = w - ring; z <= w + ring; z++)
        memcpy(&before[z][w - ring], &reach->member[z][w - ring],
               (2 * (size_t)ring + 1) * sizeof before[z][0]);
    const int32_t low = w - ring, high = w + ring;
    for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
        int32_t step[3];
        pliant_link_direction(d, step);
        for (int32_t z = low > 0 ? low - 1 : 0; z <= high; z++)
            for (int32_t y = low > 0 ? low - 1 : 0; y <= (high < 2 * w ? high + 1 : high); y++) {
                const int32_t ty = y + step[1], tz = z + step[2];
                if (ty < 0 || ty > 2 * w || tz > 2 * w) continue;
                const uint32_t link = reach->link[d][z][y];
                if (!link) continue;
                // Along the link, and back along it.
                if (y >= low && y <= high && z >= low)
                    reach->member[tz][ty] |= shifted(before[z][y] & link, step[0]) & inside;
                if (ty >= low && ty <= high && tz >= low && tz <= high)
                    reach->member[z][y] |= shifted(before[tz][ty], -step[0]) & link & inside;
            }
    }
    uint32_t change = 0;
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++) {
            const int32_t was = y >= low && y <= high && z >= low && z <= high;
            change |= reach->member[z][y] & ~(was ? before[z][y] : 0);
        }
    return change;
}

static int32_t count_rows(uint32_t rows[PLIANT_WINDOW_LIMIT][PLIANT_WINDOW_LIMIT], int32_t w)
{
    int32_t count = 0;
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++) count += __builtin_popcount(rows[z][y]);
    return count;
}

void pliant_links_window(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t w,
                         pliant_reach *reach)
{
    const uint32_t inside = ((uint32_t)1 << (2 * w + 1)) - 1;
    for (int32_t dz = 0; dz <= 2 * w; dz++)
        for (int32_t dy = 0; dy <= 2 * w; dy++) {
            const int32_t row = row_at(links, y + dy - w, z + dz - w);
            reach->window[dz][dy] =
                row < 0 ? 0 : window_bits(row_bits(links, row, ROW_PARTICLES), x - w) & inside;
            reach->member[dz][dy] = reach->window[dz][dy];
        }
    reach->size = count_rows(reach->window, w);
    reach->is_regular = 1;
}

void pliant_links_reach(const pliant_links *links, int32_t x, int32_t y, int32_t z, int32_t w,
                        pliant_reach *reach)
{
    const uint32_t inside = ((uint32_t)1 << (2 * w + 1)) - 1;
    pliant_links_window(links, x, y, z, w, reach);
    const int32_t window_size = reach->size;
    if (is_whole(links, x, y, z, w)) return;

    for (int32_t dz = 0; dz <= 2 * w; dz++)
        for (int32_t dy = 0; dy <= 2 * w; dy++) {
            reach->member[dz][dy] = 0;
            const int32_t row = row_at(links, y + dy - w, z + dz - w);
            for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++)
                reach->link[d][dz][dy] =
                    row < 0 ? 0 : window_bits(row_bits(links, row, ROW_LINKS + d), x - w) & inside;
        }
    reach->member[w][w] = (uint32_t)1 << w;
    for (int32_t ring = 0; ring < w; ring++)
        if (!grow(reach, w, ring)) break;
    reach->size = count_rows(reach->member, w);
    reach->is_regular = reach->size == window_size;
}
