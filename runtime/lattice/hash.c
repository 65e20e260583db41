// hash.c: points in a grid of cubic cells without bounds, to find the near ones.
//
// This follows: M. Teschner, B. Heidelberger, M. Mueller, D. Pomeranets, M. Gross, Optimized
// Spatial Hashing for Collision Detection of Deformable Objects, VMV 2003. We sort by counting
// instead of keeping lists, and hash rows of cells, so that three neighbouring cells are one range.
#include "lattice/hash.h"

#include <math.h>
#include <string.h>

#define HASH_LEAST_BUCKETS 64
#define HASH_CHUNK         1024  // points of a task
#define HASH_FARTHEST      1e9f  // cells from the origin; beyond that one is as good as another

static int32_t buckets_for(int32_t count)
{
    int32_t buckets = HASH_LEAST_BUCKETS;
    while (buckets < count) buckets *= 2;
    return buckets;
}

void pliant_hash_lay_out(pliant_hash *hash, pliant_arena *arena, int32_t capacity)
{
    hash->capacity = capacity;
    hash->bucket_capacity = buckets_for(capacity);
    PLIANT_TAKE(arena, hash->points, 4 * (size_t)capacity);
    PLIANT_TAKE(arena, hash->sorted, 4 * (size_t)capacity);
    PLIANT_TAKE(arena, hash->number, capacity);
    PLIANT_TAKE(arena, hash->cell, 3 * (size_t)capacity);
    PLIANT_TAKE(arena, hash->bucket, capacity);
    PLIANT_TAKE(arena, hash->first, (size_t)hash->bucket_capacity + 1);
}

void pliant_hash_cell(const pliant_hash *hash, const float *point, int32_t cell[3])
{
    for (int c = 0; c < 3; c++) {
        const float at = floorf(point[c] * hash->inverse_size);
        cell[c] = at >= -HASH_FARTHEST && at <= HASH_FARTHEST ? (int32_t)at
                  : at > 0                                    ? (int32_t)HASH_FARTHEST
                  : at < 0                                    ? -(int32_t)HASH_FARTHEST
                                                              : 0;
    }
}

static int32_t end_of(const pliant_hash *hash, int32_t begin)
{
    return hash->count - begin < HASH_CHUNK ? hash->count : begin + HASH_CHUNK;
}

static void choose_buckets(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_hash *hash = context;
    const uint32_t mask = (uint32_t)hash->bucket_count - 1;
    const int32_t begin = task * HASH_CHUNK, end = end_of(hash, begin);
    for (int32_t i = begin; i < end; i++) {
        int32_t cell[3];
        pliant_hash_cell(hash, hash->points + 4 * (size_t)i, cell);
        hash->bucket[i] = (int32_t)((pliant_hash_row(cell[1], cell[2]) + (uint32_t)cell[0]) & mask);
    }
}

static void gather(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_hash *hash = context;
    const int32_t begin = task * HASH_CHUNK, end = end_of(hash, begin);
    for (int32_t k = begin; k < end; k++) {
        const float *from = hash->points + 4 * (size_t)hash->number[k];
        memcpy(hash->sorted + 4 * (size_t)k, from, 4 * sizeof *from);
        pliant_hash_cell(hash, from, hash->cell + 3 * (size_t)k);
    }
}

void pliant_hash_fill(pliant_hash *hash, pliant_team *team, int32_t count, float size)
{
    hash->count = count;
    hash->bucket_count = buckets_for(count);
    hash->inverse_size = 1 / size;
    const int32_t tasks = (count + HASH_CHUNK - 1) / HASH_CHUNK;
    pliant_team_run(team, tasks, choose_buckets, hash);
    // Counting sort, stable: counts, then beginnings, which the scatter turns into ends.
    int32_t *first = hash->first;
    memset(first, 0, ((size_t)hash->bucket_count + 1) * sizeof *first);
    for (int32_t i = 0; i < count; i++) first[hash->bucket[i]]++;
    int32_t sum = 0;
    for (int32_t b = 0; b < hash->bucket_count; b++) {
        const int32_t here = first[b];
        first[b] = sum;
        sum += here;
    }
    for (int32_t i = 0; i < count; i++) hash->number[first[hash->bucket[i]]++] = i;
    memmove(first + 1, first, (size_t)hash->bucket_count * sizeof *first);
    first[0] = 0;
    pliant_team_run(team, tasks, gather, hash);
}
