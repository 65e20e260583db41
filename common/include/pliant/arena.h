// arena.h: one block of memory that many arrays are carved from.
//
// A create function calls its lay_out() twice: on an empty arena, which only measures, and after
// pliant_arena_reserve on the reserved block, which hands out the same places:
//
//     pliant_arena arena = {0};
//     lay_out(&arena, thing);                     // pointers come out NULL
//     status = pliant_arena_reserve(&arena, err); // one allocation, zeroed
//     lay_out(&arena, thing);                     // pointers are good until release
//
// Every array starts on a cache line (64 bytes), so SIMD may load it aligned. Sizes may come from
// untrusted counts: a sum that overflows is refused by reserve.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

#define PLIANT_ARENA_ALIGN 64

typedef struct pliant_arena {
    char *base;   // NULL while measuring; owned
    size_t used;  // bytes taken so far; SIZE_MAX: more than there can be
    size_t size;  // bytes reserved
} pliant_arena;

// Room for `count` elements of `size` bytes: NULL while measuring.
void *pliant_arena_take(pliant_arena *arena, size_t count, size_t size);
// Set `pointer` to room for `count` of what it points to.
#define PLIANT_TAKE(arena, pointer, count)                                                         \
    ((pointer) = pliant_arena_take((arena), (size_t)(count), sizeof *(pointer)))

// Allocate what was measured, zeroed, and start carving. The arena must not hold a block yet.
PLIANT_UNUSED_RESULT pliant_status pliant_arena_reserve(pliant_arena *arena, pliant_error *err);
void pliant_arena_release(pliant_arena *arena);  // and forget; an empty arena is fine
