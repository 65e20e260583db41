// vector_clones.h: compile one function for several instruction sets, chosen when the program loads.
//
// The plain C stays the reference: the clones are the same source. Without compiler support, and
// under the sanitizers (whose runtime is not up yet when the choice is made), there is one version.
//
// Files that include this also let products and sums fuse where the machine can (the transform on
// line gains 15%): clang does so by itself, gcc not under -std=c11.
#pragma once

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("fp-contract=fast")
#endif

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PLIANT_VECTOR_CLONES
#elif defined(__has_feature)
#define PLIANT_VECTOR_CLONES
#elif defined(__GNUC__) && defined(__x86_64__)
#define PLIANT_VECTOR_CLONES \
    __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define PLIANT_VECTOR_CLONES
#endif
