// test_dents.c: depths at rest, and ways out of deformed cells.
#include "synthetic_lattice.h"
#include "surfaces.h"
#include "world_fixture.h"

#include "lattice/dents.h"
#include "lattice/rest_depth.h"
#include "lattice/world.h"

#include <stdio.h>
#include <unistd.h>

// Of a ball, the depth is |x| - 1 near the surface, exactly but for the facets, and no more than
// that below; the sign is right everywhere.
static void depths_are_distances_from_the_surface(void **state)
{
    (void)state;
    check_surface ball = check_sphere(3);
    check_lattice_def def = {.half_width = 2, .mesh = ball.mesh};
    const int32_t across = 14;
    int32_t *cells = check_ball_cells(across, &def.cell_count, def.origin);
    def.cells = cells;
    def.cell_size = 2.0 / across;
    check_lattice *made = check_lattice_create(&def);
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_dents_%d.h5", (int)getpid());
    check_lattice_write(made, path);
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_lattice *lattice = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    check_ok(pliant_lattice_create(model, 0, &lattice, &err), &err);
    pliant_body *body = body_at(lattice, (pliant_vec3){0, 0, 0}, 0);
    pliant_world *world = world_with(1, (pliant_vec3){0, 0, 0}, PLIANT_COLLISION_SURFACES);
    add_to(world, body);
    int32_t outside = 0, deep = 0;
    for (int32_t p = 0; p < lattice->particle_count; p++) {
        const float *x = lattice->rest + 3 * (size_t)p;
        const double expected = sqrt(pose_dot(x, x)) - 1, found = world->crowd.depth[p];
        outside += expected > 0;
        if (expected > -1.5 * def.cell_size) {
            check_near(found, expected, 0.012);  // facets of 642 vertices stand 0.006 off
        } else {
            deep++;
            check_at_most(found, -1.4 * def.cell_size);
            check_at_least(found, 1.25 * expected);  // steps along links are up to 12% longer
        }
    }
    check_at_least(outside, 200);
    check_at_least(deep, 200);
    pliant_world_destroy(world);
    pliant_body_destroy(body);
    pliant_lattice_destroy(lattice);
    pliant_model_close(model);
    check_lattice_destroy(made);
    check_surface_destroy(&ball);
    free(cells);
}

// Without a surface, of a cube of 6 cells: the steps to the nearest side.
static void depths_without_a_surface_are_of_the_outermost_particles(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 6, 1, 0.5);
    pliant_body *body = body_at(lattice, (pliant_vec3){0, 0, 0}, 0);
    pliant_world *world = world_with(1, (pliant_vec3){0, 0, 0}, 0);
    add_to(world, body);
    for (int32_t p = 0; p < lattice->particle_count; p++) {
        const int32_t *at = lattice->places + 3 * (size_t)p;
        int32_t least = 6;
        for (int c = 0; c < 3; c++) {
            const int32_t side = at[c] < 6 - at[c] ? at[c] : 6 - at[c];
            least = side < least ? side : least;
        }
        check_near(world->crowd.depth[p], -0.5 * least, 1e-6);
    }
    pliant_world_destroy(world);
    pliant_body_destroy(body);
    pliant_lattice_destroy(lattice);
}

// A cube turned, sheared and stretched, with a small one's corner inside: its place is the corners'
// mean by their weights, and the way out is the normal of the deformed side, by the deformed depth.
static void ways_out_are_those_of_the_deformed_shape(void **state)
{
    (void)state;
    const float dt = 0.01f;
    pliant_lattice *large = lattice_of(CHECK_CELLS_CUBE, 6, 1, 0.1);
    pliant_lattice *small = lattice_of(CHECK_CELLS_SINGLE, 1, 1, 0.1);
    check_random random = check_random_seed(51);
    int32_t found = 0;
    for (int trial = 0; trial < 40; trial++) {
        pliant_world *world = world_with(1, (pliant_vec3){0, 0, 0}, PLIANT_COLLISION_SURFACES);
        pliant_body *a = body_at(large, (pliant_vec3){0, 0, 0}, 0);
        add_to(world, a);
        // x = F X with det F > 0
        float F[3][3];
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                F[r][c] = (r == c) + 0.6f * ((float)check_random_next(&random) - 0.5f);
        for (int32_t p = 0; p < large->particle_count; p++) {
            const float *X = large->rest + 3 * (size_t)p;
            pliant_body_set(a->x, large->slot[p],
                            (pliant_vec3){pose_dot(F[0], X), pose_dot(F[1], X), pose_dot(F[2], X)});
        }
        // One corner of the small one at F (0.01, -0.02, 0.25): 0.05 below the upper side.
        const float X[3] = {0.01f, -0.02f, 0.25f};
        const float x[3] = {pose_dot(F[0], X), pose_dot(F[1], X), pose_dot(F[2], X)};
        pliant_body *b = body_at(small, (pliant_vec3){x[0] + 0.05f, x[1] + 0.05f, x[2] + 0.05f}, 0);
        add_to(world, b);
        pliant_crowd_measure(&world->crowd, NULL);
        pliant_touches_find(&world->touches, NULL, &world->crowd, PLIANT_COLLISION_SURFACES, dt);
        const pliant_touches *t = &world->touches;
        const int32_t corner = world->crowd.members[1].first;  // its particle 0
        for (int32_t i = 0; i < t->touch_count; i++) {
            const pliant_touch *touch = &t->touches[i];
            if (touch->b >= 0 || t->particle[touch->a] != corner) continue;
            found++;
            double place[3] = {0}, whole = 0;
            for (int k = 0; k < 8; k++) {
                const int32_t particle = t->particle[t->cells[touch->a].corners[k]];
                const pliant_vec3 y = place_of(a, particle);
                const double weight = t->cells[touch->a].weights[k];
                place[0] += weight * y.x, place[1] += weight * y.y, place[2] += weight * y.z;
                whole += weight;
            }
            check_near(whole, 1, 1e-6);
            for (int c = 0; c < 3; c++) check_near(place[c], x[c], 1e-6);
            // The side's normal is along F's first two columns' cross product.
            const float u[3] = {F[0][0], F[1][0], F[2][0]}, v[3] = {F[0][1], F[1][1], F[2][1]};
            float n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                          u[0] * v[1] - u[1] * v[0]};
            const float size = sqrtf(pose_dot(n, n)), w[3] = {F[0][2], F[1][2], F[2][2]};
            for (int c = 0; c < 3; c++) check_near(touch->normal[c], n[c] / size, 1e-5);
            const double depth = 0.05 * pose_dot(w, n) / size;
            check_near(touch->target, 0.1 * depth / dt, 1e-4);
        }
        pliant_world_destroy(world);
        pliant_body_destroy(a);
        pliant_body_destroy(b);
    }
    assert_int_equal(found, 40);
    pliant_lattice_destroy(large);
    pliant_lattice_destroy(small);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(depths_are_distances_from_the_surface),
        cmocka_unit_test(depths_without_a_surface_are_of_the_outermost_particles),
        cmocka_unit_test(ways_out_are_those_of_the_deformed_shape),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
