// levels_fixture.h: a small model with the columns of all levels, a solver on it, random nodes.
#pragma once

#include "check.h"

#include "solver.h"
#include "synthetic_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { finest = 2, vertex_count = 162 };

typedef struct fixture {
    check_synthetic *exact;
    pliant_model *model;
    pliant_solver *solver;
} fixture;

static inline fixture set_up(double eps, check_blocks blocks, pliant_solver_def def)
{
    fixture f;
    char path[64];
    pliant_error err = {""};
    const check_synthetic_def made = {finest, eps, pliant_wavelet_default(), blocks,
                                      (2u << finest) - 1};
    f.exact = check_synthetic_create(&made);
    snprintf(path, sizeof path, "/tmp/pliant_test_levels_%d.h5", (int)getpid());
    check_synthetic_write(f.exact, path);
    check_ok(pliant_model_open(path, &f.model, &err), &err);
    unlink(path);
    check_ok(pliant_solver_create(f.model, &def, &f.solver, &err), &err);
    return f;
}

static inline void tear_down(fixture *f)
{
    pliant_solver_destroy(f->solver);
    pliant_model_close(f->model);
    check_synthetic_destroy(f->exact);
}

static const pliant_solver_def roomy = {
    .constraint_capacity = 60, .load_capacity = 60, .cache_count = 4};

// A node on a random level that has the vertex.
static inline pliant_node random_node(check_random *random)
{
    const int32_t vertex = check_random_index(random, vertex_count);
    const int32_t first = vertex < 12 ? 0 : vertex < 42 ? 1 : 2;
    return (pliant_node){first + check_random_index(random, finest + 1 - first), vertex};
}

static inline pliant_vec3 random_vector(check_random *random, double size)
{
    float v[3];
    for (int c = 0; c < 3; c++) v[c] = (float)(size * (2 * check_random_next(random) - 1));
    return (pliant_vec3){v[0], v[1], v[2]};
}

static inline double component(pliant_vec3 v, int c)
{
    return c == 0 ? v.x : c == 1 ? v.y : v.z;
}
