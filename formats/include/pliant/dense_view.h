// dense_view.h: the sections of a dense file (exact, untransformed Green's functions) as arrays.
//
// Checked as model_view.h says; pointers are borrowed until the reader is closed.
#pragma once

#include "pliant/reader.h"

typedef struct pliant_dense_view {
    int32_t free_count;    // m
    int32_t fixed_count;   // k; 0 without supports
    int32_t has_supports;  // 1: the fixed rows and columns are stored

    // One pointer per row of PLIANT_DENSE_SECTIONS; matrices row-major, row 3i+r of node i's
    // component r, column 3j+c of node j's component c. The last five are NULL without supports.
    const int32_t *nodes;         // [m], ascending vertex numbers
    const double *free_free;      // [3m][3m] displacement per traction
    const double *gravity_free;   // [3m][3] displacement per acceleration
    const int32_t *fixed_nodes;   // [k], ascending, none of nodes
    const double *free_fixed;     // [3m][3k] displacement per support displacement
    const double *fixed_free;     // [3k][3m] traction per traction
    const double *fixed_fixed;    // [3k][3k] traction per support displacement
    const double *gravity_fixed;  // [3k][3] traction per acceleration
} pliant_dense_view;

PLIANT_UNUSED_RESULT pliant_status pliant_dense_view_bind(const pliant_reader *reader,
                                                          pliant_dense_view *view,
                                                          pliant_error *err);
