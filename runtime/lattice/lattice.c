// lattice.c: one lattice with one half-width, laid out for the step.
#include "lattice/lattice.h"

#include "lattice/surface.h"
#include "model.h"
#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Layout ----

static void lay_out(pliant_arena *arena, pliant_lattice *lattice)
{
    const int32_t *dims = lattice->dims;
    const size_t table = (size_t)dims[2] * dims[1] * lattice->row_blocks;
    PLIANT_TAKE(arena, lattice->places, 3 * (size_t)lattice->particle_count);
    PLIANT_TAKE(arena, lattice->cells, 3 * (size_t)lattice->cell_count);
    PLIANT_TAKE(arena, lattice->rest, 3 * (size_t)lattice->particle_count);
    PLIANT_TAKE(arena, lattice->slot, lattice->particle_count);
    PLIANT_TAKE(arena, lattice->block_at, table);
    PLIANT_TAKE(arena, lattice->block_place, 3 * (size_t)lattice->block_count);
    PLIANT_TAKE(arena, lattice->block_particles, lattice->block_count);
    PLIANT_TAKE(arena, lattice->slab_first, dims[2] + 1);
    PLIANT_TAKE(arena, lattice->slab_rows, 2 * (size_t)dims[2]);
    PLIANT_TAKE(arena, lattice->column_at, (size_t)dims[1] * lattice->row_blocks);
    PLIANT_TAKE(arena, lattice->columns, (size_t)dims[1] * lattice->row_blocks);
    PLIANT_TAKE(arena, lattice->lane_mass, (size_t)lattice->block_count * PLIANT_LANES);
    PLIANT_TAKE(arena, lattice->lane_inverse, (size_t)lattice->block_count * PLIANT_LANES);
    PLIANT_TAKE(arena, lattice->particle_constants_of, lattice->block_count);
}

static int32_t count_blocks(const pliant_lattice_shape *shape)
{
    int32_t count = 0;
    const int32_t *p = shape->particles;
    for (int32_t i = 0; i < shape->particle_count; i++, p += 3)
        count +=
            i == 0 || p[0] / PLIANT_LANES != p[-3] / PLIANT_LANES || p[1] != p[-2] || p[2] != p[-1];
    return count;
}

static void place_blocks(pliant_lattice *lattice, const pliant_lattice_def *def)
{
    const int32_t *dims = lattice->dims;
    memset(lattice->block_at, -1,
           (size_t)dims[2] * dims[1] * lattice->row_blocks * sizeof *lattice->block_at);
    int32_t block = -1;
    for (int32_t i = 0; i < lattice->particle_count; i++) {
        const int32_t *p = lattice->places + 3 * (size_t)i;
        int32_t *at = lattice->block_at + ((size_t)p[2] * dims[1] + p[1]) * lattice->row_blocks +
                      p[0] / PLIANT_LANES;
        if (*at < 0) {
            *at = ++block;
            lattice->block_particles[block] = i;
            int32_t *place = lattice->block_place + 3 * (size_t)block;
            place[0] = p[0] / PLIANT_LANES, place[1] = p[1], place[2] = p[2];
        }
        const int32_t lane = p[0] % PLIANT_LANES;
        lattice->slot[i] = block * 3 * PLIANT_LANES + lane;
        lattice->lane_mass[block * PLIANT_LANES + lane] = def->mass[i];
        lattice->lane_inverse[block * PLIANT_LANES + lane] = 1 / def->mass[i];
        lattice->mass += def->mass[i];
        for (int c = 0; c < 3; c++)
            lattice->rest[3 * (size_t)i + c] = (float)(lattice->origin[c] + def->cell_size * p[c]);
    }
}

static void place_slabs(pliant_lattice *lattice)
{
    for (int32_t z = 0, b = 0; z < lattice->dims[2]; z++) {
        lattice->slab_first[z] = b;
        int32_t *rows = lattice->slab_rows + 2 * z;
        for (; b < lattice->block_count && lattice->block_place[3 * b + 2] == z; b++) {
            if (rows[1] == 0) rows[0] = lattice->block_place[3 * b + 1];
            rows[1] = lattice->block_place[3 * b + 1] + 1;
        }
    }
    lattice->slab_first[lattice->dims[2]] = lattice->block_count;
}

static void place_columns(pliant_lattice *lattice)
{
    const int32_t count = lattice->dims[1] * lattice->row_blocks;
    memset(lattice->column_at, -1, (size_t)count * sizeof *lattice->column_at);
    for (int32_t b = 0; b < lattice->block_count; b++) {
        const int32_t *place = lattice->block_place + 3 * (size_t)b;
        int32_t *at = lattice->column_at + place[1] * lattice->row_blocks + place[0];
        if (*at < 0) {
            *at = lattice->column_count++;
            lattice->columns[*at] =
                (pliant_lattice_column){.x = place[0], .y = place[1], .z = place[2]};
        }
        lattice->columns[*at].length = place[2] - lattice->columns[*at].z + 1;
    }
    for (int32_t c = 0; c < lattice->column_count; c++) {
        lattice->columns[c].first_site = lattice->site_count;
        lattice->columns[c].first_turn = lattice->turn_count;
        lattice->site_count += lattice->columns[c].length + 2 * lattice->half_width;
        lattice->turn_count += lattice->columns[c].length;
    }
}

// What belongs to regions is kept column by column, as the sums along z come by.
static pliant_status place_turns(pliant_lattice *lattice, pliant_error *err)
{
    PLIANT_TAKE(&lattice->turn_arena, lattice->turn_block, lattice->turn_count);
    PLIANT_TAKE(&lattice->turn_arena, lattice->region_constants_of, lattice->turn_count);
    const pliant_status status = pliant_arena_reserve(&lattice->turn_arena, err);
    if (status < 0) return status;
    PLIANT_TAKE(&lattice->turn_arena, lattice->turn_block, lattice->turn_count);
    PLIANT_TAKE(&lattice->turn_arena, lattice->region_constants_of, lattice->turn_count);
    for (int32_t c = 0; c < lattice->column_count; c++) {
        const pliant_lattice_column *column = &lattice->columns[c];
        for (int32_t s = 0; s < column->length; s++)
            lattice->turn_block[column->first_turn + s] =
                lattice->block_at[((size_t)(column->z + s) * lattice->dims[1] + column->y) *
                                      lattice->row_blocks +
                                  column->x];
    }
    return PLIANT_OK;
}

// ---- Members, from the nodes that a file stores or regions.c has made ----

// Bits of the window of a region and of its members; the members of a regular one are its window.
static void find_members(const pliant_lattice *lattice, const pliant_regions *regions,
                         int32_t particle, const int32_t *node, pliant_reach *reach)
{
    const int32_t w = lattice->half_width, *at = lattice->places + 3 * (size_t)particle;
    pliant_links_window(lattice->links, at[0], at[1], at[2], w, reach);
    reach->is_regular = node == NULL;
    for (int32_t plane = 0; node && plane <= 2 * w; plane++) {
        const int32_t code = node[1 + plane];
        if (code == PLIANT_PLANE_WHOLE) continue;
        for (int32_t y = 0; y <= 2 * w; y++) {
            const uint32_t mask =
                code < 0 ? 0 : (uint32_t)regions->plate_nodes[(size_t)code * (2 * w + 4) + 3 + y];
            reach->member[plane][y] =
                mask & PLIANT_ROW_WHOLE ? reach->window[plane][y] : mask & reach->window[plane][y];
        }
    }
    reach->size = regions->size[particle];
}

// M_r and (c0_r - x0_r) / cell size of a region.
typedef struct region_moments {
    double mass, offset[3];
} region_moments;

// Sums of m~ and of x m~ over particles in order: a run of a row is a difference.
typedef struct prefix_sums {
    double *share, *moment;  // shape [particle_count + 1]
} prefix_sums;

static region_moments moments_of(const pliant_lattice *lattice, const pliant_reach *reach,
                                 int32_t particle, const prefix_sums *sums)
{
    const int32_t w = lattice->half_width, *at = lattice->places + 3 * (size_t)particle;
    double mass = 0, offset[3] = {0};
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++) {
            uint32_t rest = reach->member[z][y];
            double row = 0, moment = 0;
            while (rest) {
                const int32_t start = __builtin_ctz(rest);
                const int32_t length = __builtin_ctz(~(rest >> start));
                const int32_t first = pliant_links_particle(lattice->links, at[0] + start - w,
                                                            at[1] + y - w, at[2] + z - w);
                row += sums->share[first + length] - sums->share[first];
                moment += sums->moment[first + length] - sums->moment[first];
                rest &= ~((((uint32_t)1 << length) - 1) << start);
            }
            mass += row;
            offset[0] += moment - at[0] * row;
            offset[1] += (y - w) * row;
            offset[2] += (z - w) * row;
        }
    return (region_moments){mass, {offset[0] / mass, offset[1] / mass, offset[2] / mass}};
}

// ---- Constants ----

static void set_constants(pliant_particle_constants *particle, pliant_region_constants *region,
                          int32_t lane, double share, int32_t size, const region_moments *moments)
{
    // Symmetric regions have their centre in their middle; what rounding leaves there is dust that
    // would make equal blocks differ.
    const double dust = 1e-9;
    particle->share[lane] = (float)share;
    particle->inverse_size[lane] = (float)(1.0 / size);
    particle->is_particle[lane] = region->is_particle[lane] = 1;
    region->inverse_mass[lane] = (float)(1 / moments->mass);
    for (int c = 0; c < 3; c++)
        region->offset[c][lane] = fabs(moments->offset[c]) < dust ? 0 : (float)moments->offset[c];
}

static uint64_t hash_bytes(const void *bytes, size_t size)
{
    uint64_t h = 14695981039346656037u;  // FNV-1a, a word at a time
    for (size_t k = 0; k < size; k += sizeof(uint32_t)) {
        uint32_t word;
        memcpy(&word, (const char *)bytes + k, sizeof word);
        h = (h ^ word) * 1099511628211u;
    }
    return h ^ h >> 29;
}

// Move the distinct ones of `count` items of `size` bytes to the front, in the order of their first
// appearance; of[i] says which item i is. Returns how many; -1: no memory.
static int32_t keep_distinct(void *items, size_t size, int32_t count, int32_t *of)
{
    uint32_t slots = 64;
    while (slots < 2 * (uint32_t)count) slots *= 2;
    int32_t *table = malloc(slots * sizeof *table);
    if (!table) return -1;
    memset(table, -1, slots * sizeof *table);
    char *all = items;
    int32_t kept = 0;
    for (int32_t i = 0; i < count; i++) {
        uint32_t at = (uint32_t)hash_bytes(all + i * size, size) & (slots - 1);
        while (table[at] >= 0 && memcmp(all + table[at] * size, all + i * size, size) != 0)
            at = (at + 1) & (slots - 1);
        if (table[at] < 0) {
            memmove(all + kept * size, all + i * size, size);
            table[at] = kept++;
        }
        of[i] = table[at];
    }
    free(table);
    return kept;
}

static pliant_status share_constants(pliant_lattice *lattice, pliant_particle_constants *particles,
                                     pliant_region_constants *regions)
{
    const int32_t particle_count = keep_distinct(particles, sizeof *particles, lattice->block_count,
                                                 lattice->particle_constants_of);
    const int32_t region_count =
        keep_distinct(regions, sizeof *regions, lattice->turn_count, lattice->region_constants_of);
    if (particle_count < 0 || region_count < 0) return PLIANT_ERR_MEMORY;
    lattice->particle_constants_count = particle_count;
    lattice->region_constants_count = region_count;
    PLIANT_TAKE(&lattice->particle_arena, lattice->particle_constants, particle_count);
    PLIANT_TAKE(&lattice->region_arena, lattice->region_constants, region_count);
    if (pliant_arena_reserve(&lattice->particle_arena, NULL) < 0 ||
        pliant_arena_reserve(&lattice->region_arena, NULL) < 0)
        return PLIANT_ERR_MEMORY;
    PLIANT_TAKE(&lattice->particle_arena, lattice->particle_constants, particle_count);
    PLIANT_TAKE(&lattice->region_arena, lattice->region_constants, region_count);
    memcpy(lattice->particle_constants, particles, (size_t)particle_count * sizeof *particles);
    memcpy(lattice->region_constants, regions, (size_t)region_count * sizeof *regions);
    return PLIANT_OK;
}

// ---- Regions ----

static void lay_out_exceptions(pliant_arena *arena, pliant_lattice *lattice)
{
    pliant_exceptions *e = &lattice->exceptions;
    PLIANT_TAKE(arena, e->particle, e->count);
    PLIANT_TAKE(arena, e->slab_first, lattice->dims[2] + 1);
    PLIANT_TAKE(arena, e->column_first, lattice->column_count + 1);
    PLIANT_TAKE(arena, e->column_items, e->count);
    PLIANT_TAKE(arena, e->slab_items, e->count);
    PLIANT_TAKE(arena, e->first, e->count + 1);
    PLIANT_TAKE(arena, e->is_listed, e->count);
}

static void index_exceptions(pliant_lattice *lattice, const pliant_regions *regions)
{
    pliant_exceptions *e = &lattice->exceptions;
    const int32_t stride = 2 * lattice->half_width + 2;
    for (int32_t k = 0; k < e->count; k++) {
        e->particle[k] = regions->region_nodes[(size_t)k * stride];
        const pliant_region_place place = pliant_lattice_place(lattice, e->particle[k]);
        e->slab_first[place.z + 1]++;
        e->column_first[place.column + 1]++;
    }
    for (int32_t z = 0; z < lattice->dims[2]; z++) e->slab_first[z + 1] += e->slab_first[z];
    for (int32_t c = 0; c < lattice->column_count; c++)
        e->column_first[c + 1] += e->column_first[c];
    // Filled from the back, so that the offsets end where they began.
    for (int32_t k = e->count; k-- > 0;) {
        const pliant_region_place place = pliant_lattice_place(lattice, e->particle[k]);
        e->column_items[--e->column_first[place.column + 1]] =
            (pliant_exception_place){k, place.z - lattice->columns[place.column].z, place.lane};
    }
    for (int32_t c = 0; c < lattice->column_count; c++) e->column_first[c] = e->column_first[c + 1];
    e->column_first[lattice->column_count] = e->count;
}

static int32_t list_length(const pliant_exceptions *e, int32_t k)
{
    return e->first[k + 1] - e->first[k];
}

static int compare_places(const void *a, const void *b, void *exceptions)
{
    const pliant_exception_place *p = a, *q = b;
    const int32_t longer = list_length(exceptions, q->k) - list_length(exceptions, p->k);
    return longer ? longer : p->k - q->k;
}

static int compare_rows(const void *a, const void *b, void *exceptions)
{
    const pliant_exception_row *p = a, *q = b;
    const int32_t longer = list_length(exceptions, q->k) - list_length(exceptions, p->k);
    return longer ? longer : p->k - q->k;
}

// Once the lists' lengths are known.
static void order_exceptions(pliant_lattice *lattice)
{
    pliant_exceptions *e = &lattice->exceptions;
    for (int32_t c = 0; c < lattice->column_count; c++)
        qsort_r(e->column_items + e->column_first[c],
                (size_t)(e->column_first[c + 1] - e->column_first[c]), sizeof *e->column_items,
                compare_places, e);
    for (int32_t z = 0; z < lattice->dims[2]; z++) {
        for (int32_t k = e->slab_first[z]; k < e->slab_first[z + 1]; k++) {
            const int32_t *at = lattice->places + 3 * (size_t)e->particle[k];
            e->slab_items[k] = (pliant_exception_row){k, at[1] - lattice->slab_rows[2 * z], at[0]};
        }
        qsort_r(e->slab_items + e->slab_first[z], (size_t)(e->slab_first[z + 1] - e->slab_first[z]),
                sizeof *e->slab_items, compare_rows, e);
    }
}

// What is needed while the regions are laid out.
typedef struct region_work {
    const pliant_regions *regions;
    prefix_sums sums;
    pliant_particle_constants *particle_constants;  // shape [block_count]
    pliant_region_constants *region_constants;      // shape [turn_count]
    int32_t *exception_of;                          // shape [particle_count]: index, or -1
    uint64_t balance;                               // see list_lacking
    pliant_reach reach;
} region_work;

static int32_t count_lacking(const pliant_reach *reach, int32_t w)
{
    int32_t count = 0;
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++)
            count += __builtin_popcount(reach->window[z][y] & ~reach->member[z][y]);
    return count;
}

// A number for the ordered pair (a, b): splitmix64 (Steele, Lea, Flood 2014).
static uint64_t name_pair(int32_t a, int32_t b)
{
    uint64_t x = ((uint64_t)(uint32_t)a << 32 | (uint32_t)b) + 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

// A pair is listed when the sums of either need it. Returns how many items particle k's list has;
// -1: the other's region lacks nothing. work->balance is left as it was when all lack each other.
static int32_t list_lacking(const pliant_lattice *lattice, region_work *work, int32_t k,
                            int32_t *others, int16_t (*steps)[4])
{
    const pliant_exceptions *e = &lattice->exceptions;
    const int32_t w = lattice->half_width;
    const int32_t *at = lattice->places + 3 * (size_t)e->particle[k];
    int32_t count = 0;
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++) {
            uint32_t rest = work->reach.window[z][y] & ~work->reach.member[z][y];
            for (; rest; rest &= rest - 1) {
                const int32_t x = __builtin_ctz(rest);
                const int32_t other = work->exception_of[pliant_links_particle(
                    lattice->links, at[0] + x - w, at[1] + y - w, at[2] + z - w)];
                if (other < 0) return -1;
                work->balance += name_pair(k, other) - name_pair(other, k);
                if (!e->is_listed[k] && !e->is_listed[other]) continue;
                if (others) {
                    others[count] = other;
                    const int16_t step[4] = {(int16_t)(x - w), (int16_t)(y - w), (int16_t)(z - w),
                                             1};
                    memcpy(steps[count], step, sizeof step);
                }
                count++;
            }
        }
    if (count % 2 == 1) {
        if (others) {
            others[count] = e->count;
            memset(steps[count], 0, sizeof *steps);
        }
        count++;
    }
    return count;
}

static void lay_out_items(pliant_arena *arena, pliant_exceptions *e)
{
    PLIANT_TAKE(arena, e->other, e->first[e->count]);
    PLIANT_TAKE(arena, e->step, e->first[e->count]);
}

static pliant_status list_exceptions(pliant_lattice *lattice, region_work *work)
{
    pliant_exceptions *e = &lattice->exceptions;
    const int32_t stride = 2 * lattice->half_width + 2;
    for (int32_t pass = 0; pass < 2; pass++) {  // count, then fill
        for (int32_t k = 0; k < e->count; k++) {
            find_members(lattice, work->regions, e->particle[k],
                         work->regions->region_nodes + (size_t)k * stride, &work->reach);
            const int32_t count = pass == 0 ? list_lacking(lattice, work, k, NULL, NULL)
                                            : list_lacking(lattice, work, k, e->other + e->first[k],
                                                           e->step + e->first[k]);
            if (count < 0) return PLIANT_ERR_FORMAT;
            if (count > INT32_MAX - e->first[k]) return PLIANT_ERR_MEMORY;
            e->first[k + 1] = e->first[k] + count;
        }
        if (work->balance != 0) return PLIANT_ERR_FORMAT;
        if (pass > 0) break;
        lay_out_items(&lattice->items_arena, e);
        if (pliant_arena_reserve(&lattice->items_arena, NULL) < 0) return PLIANT_ERR_MEMORY;
        lay_out_items(&lattice->items_arena, e);
    }
    order_exceptions(lattice);
    return PLIANT_OK;
}

static pliant_status add_regions(pliant_lattice *lattice, region_work *work)
{
    const pliant_regions *regions = work->regions;
    const int32_t stride = 2 * lattice->half_width + 2;
    int32_t next = 0;
    for (int32_t i = 0; i < lattice->particle_count; i++) {
        const int32_t *node = regions->region_nodes + (size_t)next * stride;
        const int32_t is_irregular = next < regions->region_node_count && node[0] == i;
        const pliant_region_place place = pliant_lattice_place(lattice, i);
        find_members(lattice, regions, i, is_irregular ? node : NULL, &work->reach);
        const region_moments moments = moments_of(lattice, &work->reach, i, &work->sums);
        set_constants(&work->particle_constants[place.block], &work->region_constants[place.turn],
                      place.lane, work->sums.share[i + 1] - work->sums.share[i], regions->size[i],
                      &moments);
        work->exception_of[i] = is_irregular ? next : -1;
        if (!is_irregular) continue;
        const int32_t k = next++;
        const int32_t lacking = count_lacking(&work->reach, lattice->half_width);
        lattice->exceptions.is_listed[k] =
            lacking <= PLIANT_EXCEPTION_LIMIT &&
            (lacking <= PLIANT_EXCEPTION_FEW || lacking <= regions->size[i] / 2);
        if (lattice->exceptions.is_listed[k]) continue;
        if (pliant_irregular_add(&lattice->irregular, &place, &work->reach,
                                 PLIANT_REGION_CHEAPEST) < 0)
            return PLIANT_ERR_MEMORY;
    }
    return PLIANT_OK;
}

static pliant_status reserve_regions(pliant_lattice *lattice, const pliant_regions *regions)
{
    // Some regions are kept by what they lack: a plate of the file may be needed both ways.
    lattice->irregular = (pliant_irregular){
        .half_width = lattice->half_width,
        .column_count = lattice->column_count,
        .slab_count = lattice->dims[2],
        .region_capacity = regions->region_node_count,
        .plate_capacity = 2 * regions->plate_node_count,
    };
    pliant_irregular_lay_out(&lattice->irregular, &lattice->irregular_arena);
    pliant_status status = pliant_arena_reserve(&lattice->irregular_arena, NULL);
    if (status < 0) return status;
    pliant_irregular_lay_out(&lattice->irregular, &lattice->irregular_arena);
    pliant_irregular_clear(&lattice->irregular);

    lattice->exceptions.count = regions->region_node_count;
    lay_out_exceptions(&lattice->exceptions_arena, lattice);
    status = pliant_arena_reserve(&lattice->exceptions_arena, NULL);
    if (status < 0) return status;
    lay_out_exceptions(&lattice->exceptions_arena, lattice);
    index_exceptions(lattice, regions);
    return PLIANT_OK;
}

static pliant_status make_regions(pliant_lattice *lattice, const pliant_lattice_def *def)
{
    const int32_t count = lattice->particle_count;
    pliant_status status = reserve_regions(lattice, def->regions);
    if (status < 0) return status;
    region_work *work = calloc(1, sizeof *work);
    if (!work) return PLIANT_ERR_MEMORY;
    work->regions = def->regions;
    work->sums.share = calloc((size_t)count + 1, sizeof *work->sums.share);
    work->sums.moment = calloc((size_t)count + 1, sizeof *work->sums.moment);
    work->particle_constants =
        calloc((size_t)lattice->block_count, sizeof *work->particle_constants);
    work->region_constants = calloc((size_t)lattice->turn_count, sizeof *work->region_constants);
    work->exception_of = malloc((size_t)count * sizeof *work->exception_of);
    status = PLIANT_ERR_MEMORY;
    if (work->sums.share && work->sums.moment && work->particle_constants &&
        work->region_constants && work->exception_of) {
        for (int32_t i = 0; i < count; i++) {
            const double share = (double)def->mass[i] / def->regions->size[i];
            work->sums.share[i + 1] = work->sums.share[i] + share;
            work->sums.moment[i + 1] =
                work->sums.moment[i] + share * lattice->places[3 * (size_t)i];
        }
        status = add_regions(lattice, work);
        if (status >= 0) status = list_exceptions(lattice, work);
        if (status >= 0)
            status = share_constants(lattice, work->particle_constants, work->region_constants);
    }
    for (int32_t c = 0; c < lattice->column_count; c++) {
        int32_t most = 0;
        for (int32_t n = lattice->irregular.column_head[c]; n >= 0;
             n = lattice->irregular.regions[n].next)
            most++;
        if (most > lattice->column_regions) lattice->column_regions = most;
    }
    free(work->sums.share);
    free(work->sums.moment);
    free(work->particle_constants);
    free(work->region_constants);
    free(work->exception_of);
    free(work);
    return status;
}

// ---- Life ----

pliant_status pliant_lattice_build(const pliant_lattice_def *def, pliant_lattice **result,
                                   pliant_error *err)
{
    pliant_lattice *lattice = calloc(1, sizeof *lattice);
    if (!lattice) return pliant_error_set(err, PLIANT_ERR_MEMORY, "lattice: no memory");
    pliant_status status = pliant_links_create(&def->shape, &lattice->links, err);
    if (status < 0) goto done;
    memcpy(lattice->dims, def->shape.dims, sizeof lattice->dims);
    memcpy(lattice->origin, def->origin, sizeof lattice->origin);
    lattice->half_width = def->regions->half_width;
    lattice->row_blocks = (lattice->dims[0] + PLIANT_LANES - 1) / PLIANT_LANES;
    lattice->particle_count = def->shape.particle_count;
    lattice->cell_count = def->shape.cell_count;
    lattice->cell_size = (float)def->cell_size;
    lattice->region_count = def->regions->region_count;
    lattice->irregular_count = def->regions->region_node_count;
    lattice->component_count = def->component_count;
    lattice->is_shell = def->is_shell;
    lattice->block_count = count_blocks(&def->shape);
    lay_out(&lattice->arena, lattice);
    status = pliant_arena_reserve(&lattice->arena, err);
    if (status < 0) goto done;
    lay_out(&lattice->arena, lattice);
    memcpy(lattice->places, def->shape.particles,
           3 * (size_t)lattice->particle_count * sizeof *lattice->places);
    memcpy(lattice->cells, def->shape.cells,
           3 * (size_t)lattice->cell_count * sizeof *lattice->cells);
    place_blocks(lattice, def);
    place_slabs(lattice);
    place_columns(lattice);
    status = place_turns(lattice, err);
    if (status < 0) goto done;
    status = make_regions(lattice, def);
    if (status == PLIANT_ERR_FORMAT)
        (void)pliant_error_set(err, status,
                               "lattice: expected regions that lack each other or neither, found a "
                               "region that lacks a particle alone");
    else if (status < 0)
        (void)pliant_error_set(err, status, "lattice: no memory for %d particles",
                               lattice->particle_count);
done:
    if (status < 0) {
        pliant_lattice_destroy(lattice);
        return status;
    }
    *result = lattice;
    return PLIANT_OK;
}

void pliant_lattice_destroy(pliant_lattice *lattice)
{
    if (!lattice) return;
    pliant_arena_release(&lattice->arena);
    pliant_arena_release(&lattice->turn_arena);
    pliant_arena_release(&lattice->particle_arena);
    pliant_arena_release(&lattice->region_arena);
    pliant_arena_release(&lattice->exceptions_arena);
    pliant_arena_release(&lattice->items_arena);
    pliant_arena_release(&lattice->irregular_arena);
    pliant_links_destroy(lattice->links);
    pliant_surface_detach(lattice);
    free(lattice);
}

// ---- From a model ----

// Regions of another half-width than the file's are found again.
static pliant_status find_regions(const pliant_model_view *view, const pliant_lattice_shape *shape,
                                  int32_t half_width, pliant_regions **found,
                                  pliant_regions *stored, pliant_error *err)
{
    if (half_width != 0 && half_width != view->lattice_half_width)
        return pliant_regions_create(shape, half_width, found, err);
    int32_t region_count = 0;
    for (int32_t i = 0; i < view->lattice_particle_count; i++)
        region_count += view->lattice_region_share[i] == i;
    // What the file maps is only read.
    *stored = (pliant_regions){
        .half_width = view->lattice_half_width,
        .particle_count = view->lattice_particle_count,
        .region_count = region_count,
        .size = (int32_t *)view->lattice_region_size,
        .share = (int32_t *)view->lattice_region_share,
        .region_node_count = view->lattice_region_node_count,
        .plate_node_count = view->lattice_plate_node_count,
        .region_nodes = (int32_t *)view->lattice_region_nodes,
        .plate_nodes = (int32_t *)view->lattice_plate_nodes,
    };
    return PLIANT_OK;
}

pliant_status pliant_lattice_create(const pliant_model *model, int32_t half_width,
                                    pliant_lattice **result, pliant_error *err)
{
    if (!model || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_lattice_create: expected a model and a place, found NULL");
    const char *name = pliant_reader_name(model->reader);
    const pliant_model_view *view = &model->view;
    if (view->lattice_particle_count == 0)
        return pliant_error_set(
            err, PLIANT_ERR_MISSING,
            "%s: expected a lattice, found Green's functions alone (pliant-precompute --lattice "
            "makes one)",
            name);
    if (half_width < 0 || half_width > PLIANT_LATTICE_WIDTH_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "half-width: expected 1 to %d, or 0 for the file's, found %d",
                                PLIANT_LATTICE_WIDTH_LIMIT, half_width);
    pliant_lattice_def def = {
        .shape = {.dims = {view->lattice_dims[0], view->lattice_dims[1], view->lattice_dims[2]},
                  .particle_count = view->lattice_particle_count,
                  .cell_count = view->lattice_cell_count,
                  .particles = view->lattice_particles,
                  .cells = view->lattice_cells},
        .mass = view->lattice_mass,
        .cell_size = view->lattice_frame[PLIANT_LATTICE_CELL_SIZE],
        .component_count = view->lattice_summary[PLIANT_LATTICE_COMPONENT_COUNT],
        .is_shell = view->lattice_summary[PLIANT_LATTICE_IS_SHELL],
    };
    for (int c = 0; c < 3; c++) def.origin[c] = view->lattice_frame[PLIANT_LATTICE_ORIGIN + c];
    pliant_error reason = {""};
    pliant_regions *found = NULL, stored;
    pliant_status status = find_regions(view, &def.shape, half_width, &found, &stored, &reason);
    def.regions = found ? found : &stored;
    pliant_lattice *lattice = NULL;
    if (status >= 0) status = pliant_lattice_build(&def, &lattice, &reason);
    pliant_regions_destroy(found);
    if (status >= 0) status = pliant_surface_attach(lattice, model, &reason);
    if (status < 0) {
        pliant_lattice_destroy(lattice);
        return pliant_error_set(err, status, "%s: %.400s", name, reason.text);
    }
    *result = lattice;
    return PLIANT_OK;
}

// ---- Questions ----

pliant_lattice_info pliant_lattice_describe(const pliant_lattice *lattice)
{
    const pliant_model_view *view = lattice->model ? &lattice->model->view : NULL;
    return (pliant_lattice_info){
        .particle_count = lattice->particle_count,
        .cell_count = lattice->cell_count,
        .component_count = lattice->component_count,
        .half_width = lattice->half_width,
        .region_count = lattice->region_count,
        .irregular_count = lattice->irregular_count,
        .is_shell = lattice->is_shell,
        .dims = {lattice->dims[0], lattice->dims[1], lattice->dims[2]},
        .vertex_count = view ? view->vertex_count : 0,
        .face_count = view ? view->face_count : 0,
        .batch_count = view ? view->lattice_batch_count : 0,
        .cell_size = (double)lattice->cell_size,
        .mass = lattice->mass,
    };
}

double pliant_lattice_particle_mass(const pliant_lattice *lattice, int32_t particle)
{
    if (particle < 0 || particle >= lattice->particle_count) return 0;
    const int32_t slot = lattice->slot[particle], block = slot / (3 * PLIANT_LANES);
    return (double)lattice->lane_mass[block * PLIANT_LANES + slot % PLIANT_LANES];
}

const float *pliant_lattice_positions(const pliant_lattice *lattice)
{
    return lattice->rest;
}

int32_t pliant_lattice_nearest(const pliant_lattice *lattice, const double *position)
{
    int32_t nearest = 0;
    double least = INFINITY;
    for (int32_t i = 0; i < lattice->particle_count; i++) {
        double distance = 0;
        for (int c = 0; c < 3; c++) {
            const double d = lattice->rest[3 * (size_t)i + c] - position[c];
            distance += d * d;
        }
        if (distance < least) least = distance, nearest = i;
    }
    return nearest;
}
