// allocations.h: count the allocations of a test program; to be included by its one source file.
//
// The program's own malloc family stands before the C library's and counts. The sanitizers have
// theirs there, so under them such tests are skipped (COUNTING is 0).
#pragma once

#include "check.h"

#include <stdatomic.h>
#include <stdlib.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
#define COUNTING 0
#else
#define COUNTING 1
#endif

static atomic_long calls;

#if COUNTING
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *memory, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);
extern void __libc_free(void *memory);

void *malloc(size_t size)
{
    atomic_fetch_add(&calls, 1);
    return __libc_malloc(size);
}
void *calloc(size_t count, size_t size)
{
    atomic_fetch_add(&calls, 1);
    return __libc_calloc(count, size);
}
void *realloc(void *memory, size_t size)
{
    atomic_fetch_add(&calls, 1);
    return __libc_realloc(memory, size);
}
void *aligned_alloc(size_t alignment, size_t size)
{
    atomic_fetch_add(&calls, 1);
    return __libc_memalign(alignment, size);
}
int posix_memalign(void **memory, size_t alignment, size_t size)
{
    atomic_fetch_add(&calls, 1);
    *memory = __libc_memalign(alignment, size);
    return *memory ? 0 : 12;
}
void free(void *memory)
{
    if (memory) atomic_fetch_add(&calls, 1);
    __libc_free(memory);
}
void *mmap(void *address, size_t length, int protection, int flags, int file, off_t offset)
{
    atomic_fetch_add(&calls, 1);
    return (void *)syscall(SYS_mmap, address, length, protection, flags, file, offset);
}
#endif

static void the_counter_counts(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    const long before = atomic_load(&calls);
    void *volatile memory = malloc(10);
    free(memory);
    assert_int_equal(atomic_load(&calls) - before, 2);
}
