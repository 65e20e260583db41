// crc32c.c: CRC-32C by the SSE 4.2 instruction, or eight bytes at a time by tables.
//
// This follows: RFC 3720, appendix B.4 (the polynomial and the test vectors); M. E. Kounavis and
// F. L. Berry, A systematic approach to building high performance software-based CRC generators,
// ISCC 2005 (slicing by eight).
#include "crc32c.h"

#include <string.h>

#if defined(__x86_64__)
#include <nmmintrin.h>
#endif

#define POLYNOMIAL 0x82f63b78u  // 0x1edc6f41, bits reversed

// Below this many bytes building the tables costs more than it saves.
#define TABLE_THRESHOLD 512

static uint32_t append_bitwise(uint32_t state, const unsigned char *p, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        state ^= p[i];
        for (int bit = 0; bit < 8; bit++) state = (state >> 1) ^ (state & 1 ? POLYNOMIAL : 0);
    }
    return state;
}

// table[k][b] is the state that byte b leaves k zero bytes later. Built on the stack on every call
// (two thousand steps), so that nothing global has to be initialised.
static void build_tables(uint32_t table[8][256])
{
    for (uint32_t b = 0; b < 256; b++) {
        uint32_t state = b;
        for (int bit = 0; bit < 8; bit++) state = (state >> 1) ^ (state & 1 ? POLYNOMIAL : 0);
        table[0][b] = state;
    }
    for (int k = 1; k < 8; k++) {
        for (int b = 0; b < 256; b++) {
            uint32_t state = table[k - 1][b];
            table[k][b] = (state >> 8) ^ table[0][state & 255];
        }
    }
}

uint32_t pliant_crc32c_portable(uint32_t crc, const void *data, size_t size)
{
    const unsigned char *p = data;
    uint32_t state = ~crc;
    if (size >= TABLE_THRESHOLD) {
        uint32_t table[8][256];
        build_tables(table);
        for (; size >= 8; p += 8, size -= 8) {
            uint32_t low = state ^ ((uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 |
                                    (uint32_t)p[3] << 24);
            state = table[7][low & 255] ^ table[6][low >> 8 & 255] ^ table[5][low >> 16 & 255] ^
                    table[4][low >> 24] ^ table[3][p[4]] ^ table[2][p[5]] ^ table[1][p[6]] ^
                    table[0][p[7]];
        }
    }
    return ~append_bitwise(state, p, size);
}

#if defined(__x86_64__)
__attribute__((target("sse4.2"))) static uint32_t append_sse(uint32_t crc, const void *data,
                                                             size_t size)
{
    const unsigned char *p = data;
    uint64_t state = (uint32_t)~crc;
    for (; size >= 8; p += 8, size -= 8) {
        uint64_t word;
        memcpy(&word, p, sizeof word);
        state = _mm_crc32_u64(state, word);
    }
    uint32_t tail = (uint32_t)state;
    for (; size > 0; p++, size--) tail = _mm_crc32_u8(tail, *p);
    return ~tail;
}
#endif

uint32_t pliant_crc32c(uint32_t crc, const void *data, size_t size)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("sse4.2")) return append_sse(crc, data, size);
#endif
    return pliant_crc32c_portable(crc, data, size);
}
