// exceptions.c: what a region lacks of its window, particle by particle.
#include "lattice/exceptions.h"

#include "lattice/members.h"

#include <stdlib.h>
#include <string.h>

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

pliant_status pliant_exceptions_reserve(pliant_lattice *lattice, const pliant_regions *regions)
{
    lattice->exceptions.count = regions->region_node_count;
    lay_out_exceptions(&lattice->exceptions_arena, lattice);
    const pliant_status status = pliant_arena_reserve(&lattice->exceptions_arena, NULL);
    if (status < 0) return status;
    lay_out_exceptions(&lattice->exceptions_arena, lattice);
    index_exceptions(lattice, regions);
    return PLIANT_OK;
}

// What is needed while lists are made.
typedef struct list_work {
    const pliant_regions *regions;
    const int32_t *exception_of;  // shape [particle_count]: index, or -1
    uint64_t balance;             // see list_lacking
    pliant_reach reach;
} list_work;

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
static int32_t list_lacking(const pliant_lattice *lattice, list_work *work, int32_t k,
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

pliant_status pliant_exceptions_list(pliant_lattice *lattice, const pliant_regions *regions,
                                     const int32_t *exception_of)
{
    pliant_exceptions *e = &lattice->exceptions;
    list_work *work = &(list_work){.regions = regions, .exception_of = exception_of};
    const int32_t stride = 2 * lattice->half_width + 2;
    for (int32_t pass = 0; pass < 2; pass++) {  // count, then fill
        for (int32_t k = 0; k < e->count; k++) {
            pliant_members_find(lattice, work->regions, e->particle[k],
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
