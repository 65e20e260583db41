// checksum.c: a 64-bit checksum that tells whole data from torn.
//
// This follows: FNV-1a (Fowler, Noll, Vo), which takes a byte at a time; here eight, with a
// rotation so that high bits reach low ones. Columns are gigabytes.
#include "checksum.h"

#include <string.h>

static const uint64_t basis = 0xCBF29CE484222325ull, prime = 0x100000001B3ull;

static uint64_t step(uint64_t state, uint64_t word)
{
    state ^= word;
    return (state << 29 | state >> 35) * prime;
}

uint64_t pliant_checksum(uint64_t state, const void *data, size_t size)
{
    const unsigned char *p = data;
    state = step(state ^ basis, size);
    for (; size >= 8; p += 8, size -= 8) {
        uint64_t word;
        memcpy(&word, p, 8);
        state = step(state, word);
    }
    if (size > 0) {
        uint64_t word = 0;
        memcpy(&word, p, size);
        state = step(state, word);
    }
    return state ^ state >> 32;
}
