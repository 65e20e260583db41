// dense_output.h: the exact columns, untransformed, in a file for comparisons.
#pragma once

#include "problem.h"

#include "pliant/writer.h"

typedef struct pliant_dense_output pliant_dense_output;

// Collective. The first rank writes; `supports`: fixed rows and columns too.
PetscErrorCode pliant_dense_output_create(MPI_Comm comm, const char *path,
                                          const pliant_problem *problem, pliant_blocks blocks,
                                          pliant_dense_output **output, pliant_error *err);
// Whose columns.
typedef enum pliant_dense_source {
    PLIANT_DENSE_FREE,
    PLIANT_DENSE_FIXED,
    PLIANT_DENSE_GRAVITY,
} pliant_dense_source;

// Collective: this rank adds the solved columns of positions first .. first + count - 1 of the source
// domain (gravity: 0, and count 1 on one rank). columns has 3 count columns of 3n values, leading
// dimension ld.
PetscErrorCode pliant_dense_output_add(pliant_dense_output *output, pliant_dense_source source,
                                       int32_t first, int32_t count, const double *columns, size_t ld,
                                       pliant_error *err);
// Collective: the file gets its name. Destroy without it leaves nothing behind.
PetscErrorCode pliant_dense_output_commit(pliant_dense_output *output, pliant_error *err);
PetscErrorCode pliant_dense_output_destroy(pliant_dense_output **output);  // collective
