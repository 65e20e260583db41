// world_fixture.h: lattices of cell shapes without a file, bodies on them, and worlds, for tests.
#pragma once

#include "cell_shapes.h"
#include "check.h"

#include "lattice/body.h"
#include "pliant/pliant.h"
#include "pliant/regions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Cells of side `cell_size`, particles of `mass` each; the box's middle is the origin. Fails the
// test when something refuses.
static inline pliant_lattice *lattice_of_cells(int32_t cell_count, const int32_t *cells, int32_t w,
                                               double cell_size, float mass)
{
    pliant_lattice_shape shape = {.cell_count = cell_count, .cells = cells};
    int32_t *particles = malloc(24 * (size_t)cell_count * sizeof *particles);
    assert_non_null(particles);
    shape.particle_count = pliant_lattice_particles(cell_count, cells, particles);
    shape.particles = particles;
    for (int32_t i = 0; i < 3 * shape.particle_count; i++)
        if (particles[i] >= shape.dims[i % 3]) shape.dims[i % 3] = particles[i] + 1;
    float *masses = malloc((size_t)shape.particle_count * sizeof *masses);
    assert_non_null(masses);
    for (int32_t i = 0; i < shape.particle_count; i++) masses[i] = mass;
    pliant_error err = {""};
    pliant_regions *regions = NULL;
    check_ok(pliant_regions_create(&shape, w, &regions, &err), &err);
    pliant_lattice_def def = {.shape = shape,
                              .mass = masses,
                              .regions = regions,
                              .cell_size = cell_size,
                              .component_count = 1};
    for (int c = 0; c < 3; c++) def.origin[c] = -0.5 * cell_size * (shape.dims[c] - 1);
    pliant_lattice *lattice = NULL;
    check_ok(pliant_lattice_build(&def, &lattice, &err), &err);
    pliant_regions_destroy(regions);
    free(masses);
    free(particles);
    return lattice;
}

static inline pliant_lattice *lattice_of(check_cells shape, int32_t size, int32_t w,
                                         double cell_size)
{
    const int32_t count = check_cell_shape(shape, size, NULL);
    int32_t *cells = malloc(3 * (size_t)count * sizeof *cells);
    assert_non_null(cells);
    check_cell_shape(shape, size, cells);
    pliant_lattice *lattice = lattice_of_cells(count, cells, w, cell_size, 0.01f);
    free(cells);
    return lattice;
}

static inline pliant_body *body_at(const pliant_lattice *lattice, pliant_vec3 position,
                                   float damping)
{
    pliant_body_def def = pliant_body_default();
    def.position = position;
    def.damping = damping;
    pliant_body *body = NULL;
    pliant_error err = {""};
    check_ok(pliant_body_create(lattice, &def, &body, &err), &err);
    return body;
}

static inline pliant_world *world_with(int32_t thread_count, pliant_vec3 gravity, int32_t collision)
{
    pliant_world_def def = pliant_world_default();
    def.thread_count = thread_count;
    def.gravity = gravity;
    def.collision = collision;
    def.friction = 0;
    pliant_world *world = NULL;
    pliant_error err = {""};
    check_ok(pliant_world_create(&def, &world, &err), &err);
    return world;
}

static inline void add_to(pliant_world *world, pliant_body *body)
{
    pliant_error err = {""};
    check_ok(pliant_world_add(world, body, &err), &err);
}

static inline void step_world(pliant_world *world, float dt, int32_t count)
{
    for (int32_t i = 0; i < count; i++) assert_int_equal(pliant_world_step(world, dt), PLIANT_OK);
}

static inline pliant_vec3 place_of(const pliant_body *body, int32_t particle)
{
    return pliant_body_get(body->x, body->lattice->slot[particle]);
}

static inline pliant_vec3 velocity_of(const pliant_body *body, int32_t particle)
{
    return pliant_body_get(body->v, body->lattice->slot[particle]);
}

// Least coordinate of a body along an axis.
static inline float least_of(const pliant_body *body, int axis)
{
    float least = INFINITY;
    for (int32_t p = 0; p < body->lattice->particle_count; p++)
        least = fminf(least, body->x[body->lattice->slot[p] + PLIANT_LANES * axis]);
    return least;
}

static inline double centre_of(const pliant_body *body, int axis)
{
    double sum = 0;
    for (int32_t p = 0; p < body->lattice->particle_count; p++)
        sum += body->x[body->lattice->slot[p] + PLIANT_LANES * axis];
    return sum / body->lattice->particle_count;
}

static inline pliant_obstacle floor_at(float z, float friction)
{
    pliant_obstacle plane = pliant_obstacle_default(PLIANT_OBSTACLE_PLANE);
    plane.a.z = z;
    plane.friction = friction;
    return plane;
}

static inline void put_obstacle(pliant_world *world, int32_t index, pliant_obstacle obstacle)
{
    assert_int_equal(pliant_world_set_obstacle(world, index, &obstacle), PLIANT_OK);
}
