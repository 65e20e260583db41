// exhaustion.h: memory that runs out at a chosen allocation; to be included by a program's one
// source.
//
//     for (long n = 0; status == PLIANT_ERR_MEMORY; n++) {
//         exhaust_after(n);         // n allocations succeed, the next one fails
//         status = create(...);
//         exhaust_never();
//     }
//     assert_int_equal(blocks_held(), before);   // and nothing has leaked
//
// The sanitizers have their malloc there: under them such tests are skipped (EXHAUSTING is 0).
#pragma once

#include "check.h"

#include <stdlib.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
#define EXHAUSTING 0
#else
#define EXHAUSTING 1
#endif

static long allocations_left = -1, blocks;  // -1: no end

static inline void exhaust_after(long count)
{
    allocations_left = count;
}

static inline void exhaust_never(void)
{
    allocations_left = -1;
}

static inline long blocks_held(void)
{
    return blocks;
}

#if EXHAUSTING
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *memory, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);
extern void __libc_free(void *memory);

static int is_exhausted(void)
{
    if (allocations_left < 0) return 0;
    if (allocations_left-- > 0) return 0;
    return 1;  // and from now on there is enough again
}

static void *counted(void *block)
{
    blocks += block != NULL;
    return block;
}

void *malloc(size_t size)
{
    return is_exhausted() ? NULL : counted(__libc_malloc(size));
}
void *calloc(size_t count, size_t size)
{
    return is_exhausted() ? NULL : counted(__libc_calloc(count, size));
}
void *realloc(void *memory, size_t size)
{
    if (is_exhausted()) return NULL;
    blocks -= memory != NULL;
    return counted(__libc_realloc(memory, size));
}
void *aligned_alloc(size_t alignment, size_t size)
{
    return is_exhausted() ? NULL : counted(__libc_memalign(alignment, size));
}
void free(void *memory)
{
    blocks -= memory != NULL;
    __libc_free(memory);
}
#endif
