// checksum.h: a 64-bit checksum that tells whole data from torn.
#pragma once

#include <stddef.h>
#include <stdint.h>

// Checksum of `size` bytes appended to a run whose checksum is `state` (0 for an empty run). Every
// change within eight bytes of a run is seen; others are missed once in 2^64. Not against malice.
uint64_t pliant_checksum(uint64_t state, const void *data, size_t size);
