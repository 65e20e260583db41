// crc32c.h: the CRC-32C checksum (Castagnoli) that guards the model file.
#pragma once

#include <stddef.h>
#include <stdint.h>

// Checksum of `size` bytes appended to a run whose checksum is `crc` (0 for an empty run).
uint32_t pliant_crc32c(uint32_t crc, const void *data, size_t size);
// The same without the processor's instruction; the reference for tests.
uint32_t pliant_crc32c_portable(uint32_t crc, const void *data, size_t size);
