// weld.c: which points stand on the same place, to the last bit.
#include "weld.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

static uint64_t hash_point(const double *p)
{
    uint64_t hash = 0;
    for (int c = 0; c < 3; c++) {
        const double value = p[c] + 0.0; // -0 becomes 0
        uint64_t bits;
        memcpy(&bits, &value, sizeof bits);
        // The finishing steps of splitmix64 (S. Vigna): every input bit reaches every output bit.
        hash = (hash ^ bits) + 0x9E3779B97F4A7C15u;
        hash = (hash ^ (hash >> 30)) * 0xBF58476D1CE4E5B9u;
        hash = (hash ^ (hash >> 27)) * 0x94D049BB133111EBu;
        hash ^= hash >> 31;
    }
    return hash;
}

pliant_status pliant_weld_points(const double *points, int32_t count, int32_t *first,
                                 int32_t *distinct_count, pliant_error *err)
{
    // Open addressing, at most half full.
    size_t slots = 16;
    while (slots < 2 * (size_t)count) slots *= 2;
    int32_t *table = malloc(slots * sizeof *table);
    if (!table)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to weld %d points", count);
    memset(table, 0xff, slots * sizeof *table); // every slot -1
    int32_t distinct = 0;
    for (int32_t i = 0; i < count; i++) {
        const double *p = points + 3 * (size_t)i;
        size_t slot = hash_point(p) & (slots - 1);
        for (; table[slot] >= 0; slot = (slot + 1) & (slots - 1)) {
            const double *q = points + 3 * (size_t)table[slot];
            if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) break;
        }
        if (table[slot] < 0) {
            table[slot] = i;
            distinct++;
        }
        first[i] = table[slot];
    }
    free(table);
    *distinct_count = distinct;
    return PLIANT_OK;
}
