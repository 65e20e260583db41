// solved_columns.h: all columns of a small solid, by either method, for tests.
#pragma once

#include "check.h"
#include "command.h"

#include "discretisation.h"
#include "fem/size_field.h"
#include "right_hand.h"

#include <petscsys.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct solved {
    pliant_problem *p;
    int32_t n, columns;
    double *xi;       // [3 columns][3n]: free nodes' columns, then held ones'
    double *gravity;  // [3][3n]
} solved;

// By finite elements of order 1 or 2, or (order 0) by boundary elements.
static solved solve_mesh(const pliant_mesh *mesh, const char *fixed, const char *young,
                         const char *poisson, int order)
{
    char path[512];
    snprintf(path, sizeof path, "%s/solid.obj", check_folder());
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        fprintf(out, "v %.17g %.17g %.17g\n", mesh->vertices[3 * v], mesh->vertices[3 * v + 1],
                mesh->vertices[3 * v + 2]);
    for (int32_t f = 0; f < mesh->face_count; f++)
        fprintf(out, "f %d %d %d\n", mesh->faces[3 * f] + 1, mesh->faces[3 * f + 1] + 1,
                mesh->faces[3 * f + 2] + 1);
    fclose(out);
    const char *argv[] = {
        "test",    path,      "--subdivide", "0",     "--fixed",  fixed,
        "--young", young,     "--poisson",   poisson, "--blocks", "all",
        "-o",      "none.h5", "--density",   "2",     "--method", order ? "fem" : "bem"};
    pliant_options options;
    pliant_options_action action;
    pliant_error err;
    check_ok(pliant_options_parse((int)(sizeof argv / sizeof *argv), (char **)(uintptr_t)argv,
                                  &options, &action, &err),
             &err);
    if (order) {
        options.order = order;
        options.growth = pliant_size_field_growth(order);
    }
    pliant_progress silent = pliant_progress_create(NULL);
    solved s = {0};
    assert_int_equal(pliant_problem_create(PETSC_COMM_SELF, &options, &silent, &s.p, &err), 0);
    s.n = s.p->vertex_count;
    s.columns = pliant_right_hand_count(s.p, PLIANT_BLOCKS_ALL);
    enum { batch = 40 };  // a block of 32 and one of 8
    const pliant_discretisation *method = pliant_discretisation_of(options.method);
    void *system = NULL;
    assert_int_equal(method->create(PETSC_COMM_SELF, s.p, &options, batch, &silent, &system, &err),
                     0);
    assert_int_equal(method->assemble(system, &silent, &err), 0);
    assert_int_equal(method->factor(system, &silent, &err), 0);
    const size_t rows = 3 * (size_t)s.n;
    s.xi = malloc(3 * (size_t)s.columns * rows * sizeof *s.xi);
    s.gravity = malloc(3 * rows * sizeof *s.gravity);
    pliant_column_share share;
    for (int32_t first = 0; first < s.columns; first += batch) {
        const int32_t count = s.columns - first < batch ? s.columns - first : batch;
        assert_int_equal(method->solve(system, first, count, &share, &err), 0);
        for (int32_t k = 0; k < 3 * count; k++)
            memcpy(s.xi + (3 * (size_t)first + (size_t)k) * rows,
                   share.columns + (size_t)k * share.ld, rows * sizeof *s.xi);
    }
    assert_int_equal(method->solve_gravity(system, &share, &err), 0);
    memcpy(s.gravity, share.columns, 3 * rows * sizeof *s.gravity);
    double worst, bound;
    assert_int_equal(method->residual(system, &worst, &bound), 0);
    check_at_most(worst, bound);
    assert_int_equal(method->destroy(&system), 0);
    return s;
}

static void forget(solved *s)
{
    free(s->gravity);
    free(s->xi);
    assert_int_equal(pliant_problem_destroy(&s->p), 0);
}
