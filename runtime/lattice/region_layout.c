// region_layout.c: a lattice's regions as the step takes them: constants, exceptions, parts.
#include "lattice/region_layout.h"

#include "lattice/members.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Constants ----

static void set_constants(pliant_particle_constants *particle, pliant_region_constants *region,
                          int32_t lane, double share, int32_t size,
                          const pliant_region_moments *moments)
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

// What is needed while the regions are laid out.
typedef struct region_work {
    const pliant_regions *regions;
    pliant_prefix_sums sums;
    pliant_particle_constants *particle_constants;  // shape [block_count]
    pliant_region_constants *region_constants;      // shape [turn_count]
    int32_t *exception_of;                          // shape [particle_count]: index, or -1
    pliant_reach reach;
} region_work;

static pliant_status add_regions(pliant_lattice *lattice, region_work *work)
{
    const pliant_regions *regions = work->regions;
    const int32_t stride = 2 * lattice->half_width + 2;
    int32_t next = 0;
    for (int32_t i = 0; i < lattice->particle_count; i++) {
        const int32_t *node = regions->region_nodes + (size_t)next * stride;
        const int32_t is_irregular = next < regions->region_node_count && node[0] == i;
        const pliant_region_place place = pliant_lattice_place(lattice, i);
        pliant_members_find(lattice, regions, i, is_irregular ? node : NULL, &work->reach);
        const pliant_region_moments moments =
            pliant_members_weigh(lattice, &work->reach, i, &work->sums);
        set_constants(&work->particle_constants[place.block], &work->region_constants[place.turn],
                      place.lane, work->sums.share[i + 1] - work->sums.share[i], regions->size[i],
                      &moments);
        work->exception_of[i] = is_irregular ? next : -1;
        if (!is_irregular) continue;
        const int32_t k = next++;
        const int32_t lacking = pliant_members_lacking(&work->reach, lattice->half_width);
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

    return pliant_exceptions_reserve(lattice, regions);
}

pliant_status pliant_lattice_lay_out_regions(pliant_lattice *lattice, const pliant_lattice_def *def)
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
        if (status >= 0)
            status = pliant_exceptions_list(lattice, work->regions, work->exception_of);
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
