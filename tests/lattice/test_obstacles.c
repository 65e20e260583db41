// test_obstacles.c: bodies that rest on obstacles, slide on them, and are pushed by them.
#include "world_fixture.h"

#include "lattice/world.h"

#include <stdio.h>

static const pliant_vec3 earth = {0, 0, -9.81f}, nowhere = {0, 0, 0};
static const float dt = 1.0f / 60;

// A cube falls a little and comes to rest on its floor: it neither sinks nor drifts, and the floor
// carries its weight.
static void a_cube_rests_on_a_plane(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 4, 2, 0.1);
    pliant_body *body = body_at(lattice, (pliant_vec3){0, 0, 0.25f}, 0.2f);
    pliant_world *world = world_with(1, earth, PLIANT_COLLISION_NONE);
    add_to(world, body);
    put_obstacle(world, 0, floor_at(0, 0.5f));
    step_world(world, dt, 600);
    const double height = centre_of(body, 2), x = centre_of(body, 0), y = centre_of(body, 1);
    check_near(height, 0.175, 0.025);  // a fifth of half a side: it is soft
    check_at_least(least_of(body, 2), -1e-6);
    step_world(world, dt, 600);
    check_near(centre_of(body, 2), height, 1e-5);
    check_near(centre_of(body, 0), x, 1e-6);
    check_near(centre_of(body, 1), y, 1e-6);
    check_at_least(least_of(body, 2), -1e-6);
    check_at_most(pliant_world_add_up(world).kinetic_energy, 1e-6);
    assert_in_range(pliant_world_last(world).obstacle_contact_count, 4, 25);
    pliant_world_destroy(world);
    pliant_body_destroy(body);
    pliant_lattice_destroy(lattice);
}

// Balls fall on obstacles of every kind, fast; no particle is inside one after any step.
static void nothing_enters_obstacles(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_BALL, 5, 2, 0.1);
    const int32_t particles = lattice->particle_count;
    for (int trial = 0; trial < 4; trial++) {
        pliant_world *world = world_with(1, earth, PLIANT_COLLISION_NONE);
        pliant_body *body = body_at(lattice, (pliant_vec3){0.05f, 0.02f, 1}, 0.1f);
        add_to(world, body);
        pliant_obstacle o = pliant_obstacle_default((pliant_obstacle_kind)(1 + trial));
        if (trial == 1) o.radius = 0.3f;
        if (trial == 2) o.b = (pliant_vec3){0.3f, 0.2f, 0.1f}, o.rotation[0] = 0.4f;
        if (trial == 3)
            o.a.z = -1, o.b = (pliant_vec3){0, 0, 0.4f}, o.radius = 0.5f, o.radius_b = 0;
        put_obstacle(world, 0, o);
        put_obstacle(world, 1, floor_at(-1, 0.5f));
        for (int32_t p = 0; p < particles; p++)
            pliant_body_set(body->v, lattice->slot[p], (pliant_vec3){0, 0, -20});
        int32_t contacts = 0;
        for (int step = 0; step < 400; step++) {
            step_world(world, dt, 1);
            contacts += pliant_world_last(world).obstacle_contact_count;
            for (int i = 0; i < 2; i++) {
                const pliant_solid *solid = &world->obstacles.solids[i];
                for (int32_t p = 0; p < particles; p++) {
                    const pliant_vec3 x = place_of(body, p);
                    float y[3], n[3];
                    pose_to_frame(&solid->begin, &x.x, y);
                    check_at_least(pliant_solid_distance(solid, y, n), -2e-6);
                }
            }
        }
        check_at_least(contacts, 100);
        pliant_world_destroy(world);
        pliant_body_destroy(body);
    }
    pliant_lattice_destroy(lattice);
}

// On an incline with tan = 0.5, gravity turned instead of the plane: it stays where mu is larger
// and slides with g (sin - mu cos) where it is smaller.
static void friction_decides_who_slides(void **state)
{
    (void)state;
    const float slope = atanf(0.5f), g = 9.81f, fine = 1.0f / 240;
    const float frictions[] = {0, 0.2f, 0.4f, 0.6f, 0.9f};
    int32_t slab[6 * 6 * 2][3];
    for (int i = 0; i < 72; i++) slab[i][0] = i % 6, slab[i][1] = i / 6 % 6, slab[i][2] = i / 36;
    pliant_lattice *lattice = lattice_of_cells(72, slab[0], 2, 0.1, 0.01f);
    for (int i = 0; i < 5; i++) {
        const pliant_vec3 down = {g * sinf(slope), 0, -g * cosf(slope)};
        pliant_world *world = world_with(1, down, PLIANT_COLLISION_NONE);
        pliant_body *body = body_at(lattice, (pliant_vec3){0, 0, 0.1f}, 0.3f);
        add_to(world, body);
        put_obstacle(world, 0, floor_at(0, frictions[i]));
        step_world(world, fine, 240);
        const double before = pliant_world_add_up(world).momentum[0], at = centre_of(body, 0);
        step_world(world, fine, 240);
        const pliant_world_sum sum = pliant_world_add_up(world);
        const double found = (sum.momentum[0] - before) / sum.mass;
        const double expected = g * (sin(slope) - frictions[i] * cos(slope));
        printf("friction %.1f: acceleration %.4f, Coulomb's %.4f\n", (double)frictions[i], found,
               fmax(expected, 0));
        if (expected > 0) check_near(found, expected, 0.01 * g);
        else check_near(centre_of(body, 0), at, 1e-5);
        pliant_world_destroy(world);
        pliant_body_destroy(body);
    }
    pliant_lattice_destroy(lattice);
}

// A wall that comes along takes the cube with it at its own speed, and a lift lifts it.
static void a_moving_plane_pushes(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 3, 1, 0.1);
    pliant_body *body = body_at(lattice, nowhere, 0.2f);
    pliant_world *world = world_with(1, nowhere, PLIANT_COLLISION_NONE);
    add_to(world, body);
    pliant_obstacle wall = pliant_obstacle_default(PLIANT_OBSTACLE_PLANE);
    wall.b = (pliant_vec3){1, 0, 0};
    wall.a.x = -0.5f;
    wall.velocity.x = 2;
    put_obstacle(world, 0, wall);
    for (int step = 0; step < 120; step++) {
        step_world(world, dt, 1);
        const float face = pliant_world_obstacle(world, 0).a.x;
        check_near(face, -0.5 + 2 * (step + 1) * dt, 1e-4);
        check_at_least(least_of(body, 0), face - 1e-5);
    }
    const pliant_world_sum sum = pliant_world_add_up(world);
    // An elastic body goes off at up to twice the wall's speed.
    check_at_least(sum.momentum[0] / sum.mass, 2);
    check_at_most(sum.momentum[0] / sum.mass, 4);
    // Moved by the caller: it arrives, pushes on the way, and stands still then.
    const float before = pliant_world_obstacle(world, 0).a.x;
    assert_int_equal(pliant_world_move_obstacle(world, 0, (pliant_vec3){before + 1, 0, 0}, NULL),
                     PLIANT_OK);
    step_world(world, dt, 1);
    check_near(pliant_world_obstacle(world, 0).a.x, before + 1, 1e-6);
    check_at_least(least_of(body, 0), before + 1 - 1e-5);
    step_world(world, dt, 1);
    check_near(pliant_world_obstacle(world, 0).a.x, before + 1, 0);
    pliant_world_destroy(world);
    pliant_body_destroy(body);
    pliant_lattice_destroy(lattice);
}

// Put into an obstacle, a body comes out by and by; nothing flies apart.
static void what_is_put_inside_comes_out(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 3, 1, 0.1);
    pliant_body *body = body_at(lattice, (pliant_vec3){0.2f, 0, 0}, 0.2f);
    pliant_world *world = world_with(1, nowhere, PLIANT_COLLISION_NONE);
    add_to(world, body);
    put_obstacle(world, 0, pliant_obstacle_default(PLIANT_OBSTACLE_SPHERE));
    double most = 0;
    for (int step = 0; step < 300; step++) {
        step_world(world, dt, 1);
        const pliant_world_sum sum = pliant_world_add_up(world);
        most = fmax(most, sqrt(2 * sum.kinetic_energy / sum.mass));
    }
    printf("fastest on the way out: %.2f m/s\n", most);
    check_at_most(most, 10 * 0.1 * 3);  // ten cells a second, thrice
    for (int32_t p = 0; p < lattice->particle_count; p++) {
        const pliant_vec3 x = place_of(body, p);
        check_at_least(sqrt(x.x * x.x + x.y * x.y + x.z * x.z), 1 - 1e-5);
    }
    pliant_world_destroy(world);
    pliant_body_destroy(body);
    pliant_lattice_destroy(lattice);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cube_rests_on_a_plane),      cmocka_unit_test(nothing_enters_obstacles),
        cmocka_unit_test(friction_decides_who_slides),  cmocka_unit_test(a_moving_plane_pushes),
        cmocka_unit_test(what_is_put_inside_comes_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
