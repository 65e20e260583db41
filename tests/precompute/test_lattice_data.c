// test_lattice_data.c: a lattice without memory: every allocation that fails is refused, and leaks
// none.
#include "check.h"

#include "lattice/lattice_data.h"
#include "surfaces.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

// The sanitizers have their own malloc family, so under them there is nothing to fail.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
#define FAILING 0
#else
#define FAILING 1
#endif

static long made, live, fail_at = -1;  // allocations since the start; not freed; the one to fail

#if FAILING
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *memory, size_t size);
extern void __libc_free(void *memory);

static int fails(void)
{
    if (made++ != fail_at) return 0;
    errno = ENOMEM;
    return 1;
}
void *malloc(size_t size)
{
    if (fails()) return NULL;
    live++;
    return __libc_malloc(size);
}
void *calloc(size_t count, size_t size)
{
    if (fails()) return NULL;
    live++;
    return __libc_calloc(count, size);
}
void *realloc(void *memory, size_t size)
{
    if (fails()) return NULL;
    live += !memory;
    return __libc_realloc(memory, size);
}
void free(void *memory)
{
    live -= memory != NULL;
    __libc_free(memory);
}
#endif

static void check_every_failure(const pliant_mesh *mesh, pliant_voxel_filling filling)
{
    const pliant_lattice_data_def def = {
        .name = "mesh", .cells = 9, .half_width = 2, .filling = filling, .density = 1};
    pliant_status status = PLIANT_ERR_MEMORY;
    long refused = 0;
    for (long fail = 0; status < 0; fail++) {
        pliant_lattice_data *lattice = NULL;
        pliant_error err = {""};
        const long before = live;
        made = 0;
        fail_at = fail;
        status = pliant_lattice_data_create(&def, mesh, &lattice, &err);
        fail_at = -1;
        if (status == PLIANT_OK) {
            pliant_lattice_data_destroy(lattice);
        } else {
            refused++;
            assert_int_equal(status, PLIANT_ERR_MEMORY);
            assert_null(lattice);
            if (!err.text[0]) fail_msg("allocation %ld: no text", fail);
        }
        if (live != before) fail_msg("allocation %ld: %ld left", fail, live - before);
    }
    print_message("%ld allocations refused\n", refused);
    assert_true(refused > 30);
}

static void every_allocation_that_fails_is_refused_and_leaves_nothing(void **state)
{
    (void)state;
    if (!FAILING) skip();
    pliant_mesh *mesh = check_torus(6, 9);
    check_every_failure(mesh, PLIANT_VOXELS_SOLID);
    check_every_failure(mesh, PLIANT_VOXELS_SHELL);
    pliant_mesh_destroy(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_allocation_that_fails_is_refused_and_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
