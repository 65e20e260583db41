// hash.h: points in a grid of cubic cells without bounds, to find the near ones (spatial hashing).
//
// Filled anew every step from memory that create reserved. Points are sorted by bucket, within one
// by number, so that what is found comes in an order that depends on nothing but the points.
#pragma once

#include "lattice/team.h"
#include "pliant/arena.h"

typedef struct pliant_hash {
    int32_t capacity, bucket_capacity;
    int32_t count, bucket_count;  // of the last fill; buckets: a power of two
    float inverse_size;           // of a cell, 1/m
    float *points;    // shape [capacity][4], as put in: x, y, z, and what the caller likes
    float *sorted;    // shape [capacity][4]: the same by bucket
    int32_t *number;  // shape [capacity]: of a sorted point, as put in
    int32_t *cell;    // shape [capacity][3]: of a sorted point
    int32_t *bucket;  // shape [capacity]: scratch
    int32_t *first;   // shape [bucket_capacity + 1]
} pliant_hash;

// Twice, as arena.h says: to measure and to carve.
void pliant_hash_lay_out(pliant_hash *hash, pliant_arena *arena, int32_t capacity);

// Sort points[0 .. count - 1], in cells of `size` m. Within `size` of a point is what lies in its
// cell and the 26 around. What is not a number counts as 0.
void pliant_hash_fill(pliant_hash *hash, pliant_team *team, int32_t count, float size);

// The cell of a point.
void pliant_hash_cell(const pliant_hash *hash, const float *point, int32_t cell[3]);

// The sorted points of the cells x - 1 .. x + 1 of a row (y, z), and others of the same buckets:
// up to two ranges. Look at their cells.
typedef struct pliant_hash_range {
    int32_t from[2], to[2];
} pliant_hash_range;

static inline uint32_t pliant_hash_row(int32_t y, int32_t z)
{
    // Teschner's primes; x is added, so that a row's cells have buckets beside each other.
    return (uint32_t)y * 19349663u ^ (uint32_t)z * 83492791u;
}

static inline pliant_hash_range pliant_hash_find(const pliant_hash *hash, int32_t x, int32_t y,
                                                 int32_t z, int32_t before, int32_t after)
{
    const uint32_t mask = (uint32_t)hash->bucket_count - 1, row = pliant_hash_row(y, z);
    const uint32_t from = (row + (uint32_t)(x - before)) & mask;
    const uint32_t to = (row + (uint32_t)(x + after)) & mask;
    if (from <= to) return (pliant_hash_range){{hash->first[from], 0}, {hash->first[to + 1], 0}};
    return (pliant_hash_range){{hash->first[from], hash->first[0]},
                               {hash->first[mask + 1], hash->first[to + 1]}};
}
