// table.c: checksums and sizes of the section table, alike for writer and reader.
#include "table.h"

#include "crc32c.h"

#include <stdlib.h>

uint32_t pliant_table_checksum(const void *user_block)
{
    const unsigned char *bytes = user_block;
    const unsigned char zero[sizeof(uint32_t)] = {0};
    const size_t field = offsetof(pliant_header, checksum);
    uint32_t crc = pliant_crc32c(0, bytes, field);
    crc = pliant_crc32c(crc, zero, sizeof zero);
    return pliant_crc32c(crc, bytes + field + sizeof zero, PLIANT_USER_BLOCK - field - sizeof zero);
}

static int order_spans(const void *a, const void *b)
{
    const pliant_span *x = a, *y = b;
    return (x->offset > y->offset) - (x->offset < y->offset);
}

uint32_t pliant_table_rest_checksum(const void *file, uint64_t size, pliant_span *spans,
                                    int32_t span_count)
{
    const unsigned char *bytes = file;
    if (span_count > 0) qsort(spans, (size_t)span_count, sizeof *spans, order_spans);
    uint64_t at = PLIANT_USER_BLOCK;
    uint32_t crc = 0;
    for (int32_t i = 0; i < span_count; i++) {
        if (spans[i].bytes == 0) continue;
        crc = pliant_crc32c(crc, bytes + at, (size_t)(spans[i].offset - at));
        at = spans[i].offset + spans[i].bytes;
    }
    return pliant_crc32c(crc, bytes + at, (size_t)(size - at));
}

int pliant_table_bytes(pliant_section_type type, int32_t rank, const uint64_t *shape,
                       uint64_t *count, uint64_t *bytes)
{
    uint64_t product = 1, total;
    for (int32_t d = 0; d < rank; d++) {
        // A zero elsewhere must not hide an absurd length: every partial product counts.
        if (shape[d] > INT64_MAX ||
            __builtin_mul_overflow(product, shape[d] ? shape[d] : 1, &product))
            return 0;
    }
    if (__builtin_mul_overflow(product, pliant_section_type_size(type), &total) ||
        total > INT64_MAX)
        return 0;
    for (int32_t d = 0; d < rank; d++)
        if (shape[d] == 0) product = 0;
    *count = product;
    *bytes = product * pliant_section_type_size(type);
    return 1;
}
