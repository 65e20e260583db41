// arena.c: one block of memory that many arrays are carved from.
#include "pliant/arena.h"

#include "pliant/error.h"

#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

void *pliant_arena_take(pliant_arena *arena, size_t count, size_t size)
{
    const size_t begin = arena->used;
    const size_t slack = PLIANT_ARENA_ALIGN - 1;
    if (begin == SIZE_MAX || (size && count > (SIZE_MAX - slack) / size)) {
        arena->used = SIZE_MAX;
        return NULL;
    }
    const size_t bytes = (count * size + slack) & ~slack;
    arena->used = bytes < SIZE_MAX - begin ? begin + bytes : SIZE_MAX;
    if (!arena->base) return NULL;
    assert(arena->used <= arena->size);
    return arena->base + begin;
}

pliant_status pliant_arena_reserve(pliant_arena *arena, pliant_error *err)
{
    assert(!arena->base);
    const size_t size = arena->used;
    // aligned_alloc wants a multiple of the alignment, which every take leaves, and not nothing.
    char *base = size == SIZE_MAX
                     ? NULL
                     : aligned_alloc(PLIANT_ARENA_ALIGN, size ? size : PLIANT_ARENA_ALIGN);
    if (!base)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "memory: expected %zu bytes, found less",
                                size);
    // Writing every page now keeps page faults out of the first frames.
    memset(base, 0, size);
    *arena = (pliant_arena){.base = base, .used = 0, .size = size};
    return PLIANT_OK;
}

void pliant_arena_release(pliant_arena *arena)
{
    free(arena->base);
    *arena = (pliant_arena){0};
}
