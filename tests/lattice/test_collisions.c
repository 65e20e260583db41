// test_collisions.c: bodies that meet each other and themselves: momentum, energy, distances.
#include "world_fixture.h"

#include "lattice/world.h"

#include <stdio.h>

static const pliant_vec3 nowhere = {0, 0, 0};
static const float dt = 1.0f / 60;

static void set_velocity(pliant_body *body, pliant_vec3 v)
{
    for (int32_t p = 0; p < body->lattice->particle_count; p++)
        pliant_body_set(body->v, body->lattice->slot[p], v);
}

// Least distance of particles of two bodies; of one, of those more than two cells apart at rest.
static double least_distance(const pliant_body *a, const pliant_body *b)
{
    double least = INFINITY;
    for (int32_t p = 0; p < a->lattice->particle_count; p++)
        for (int32_t q = 0; q < b->lattice->particle_count; q++) {
            const int32_t *i = a->lattice->places + 3 * (size_t)p;
            const int32_t *j = b->lattice->places + 3 * (size_t)q;
            int32_t apart = 0;
            for (int c = 0; c < 3; c++) apart += (i[c] - j[c]) * (i[c] - j[c]);
            if (a == b && apart <= 4) continue;
            const pliant_vec3 x = place_of(a, p), y = place_of(b, q);
            const double d[3] = {x.x - y.x, x.y - y.y, x.z - y.z};
            least = fmin(least, d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        }
    return sqrt(least);
}

// What the search finds is what comparing all with all finds.
static void touches_are_those_of_brute_force(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 3, 1, 0.1);
    check_random random = check_random_seed(31);
    const int32_t bits[] = {PLIANT_COLLISION_BODIES, PLIANT_COLLISION_SELF, 3};
    int32_t all = 0;
    for (int trial = 0; trial < 30; trial++) {
        pliant_world *world = world_with(1, nowhere, bits[trial % 3]);
        pliant_body *bodies[5];
        for (int i = 0; i < 5; i++) {
            const float s = 0.5f;
            bodies[i] = body_at(lattice,
                                (pliant_vec3){s * (float)check_random_next(&random),
                                              s * (float)check_random_next(&random),
                                              s * (float)check_random_next(&random)},
                                0);
            add_to(world, bodies[i]);
            // Crumpled, so that bodies touch themselves.
            for (int32_t p = 0; p < lattice->particle_count; p++)
                for (int c = 0; c < 3; c++) {
                    const int32_t at = lattice->slot[p] + PLIANT_LANES * c;
                    bodies[i]->x[at] += 0.3f * ((float)check_random_next(&random) - 0.5f);
                    bodies[i]->v[at] = (float)check_random_next(&random) - 0.5f;
                }
        }
        pliant_crowd_measure(&world->crowd, NULL);
        pliant_touches *t = &world->touches;
        pliant_touches_find(t, NULL, &world->crowd, bits[trial % 3], dt);
        check_near(t->narrowing, 1, 0);
        int32_t expected = 0;
        for (int a = 0; a < 5; a++)
            for (int b = a; b < 5; b++)
                for (int32_t p = 0; p < lattice->particle_count; p++)
                    for (int32_t q = a == b ? p + 1 : 0; q < lattice->particle_count; q++) {
                        int32_t apart = 0, is_inside = 0;
                        for (int c = 0; c < 3; c++) {
                            const int32_t i = lattice->places[3 * p + c];
                            const int32_t j = lattice->places[3 * q + c];
                            apart += (i - j) * (i - j);
                        }
                        for (int k = 0; k < 2; k++) {
                            const int32_t *at = lattice->places + 3 * (k ? q : p);
                            is_inside |= at[0] % 3 && at[1] % 3 && at[2] % 3;
                        }
                        const int32_t bit =
                            a == b ? PLIANT_COLLISION_SELF : PLIANT_COLLISION_BODIES;
                        if (is_inside || !(bits[trial % 3] & bit) || (a == b && apart <= 4))
                            continue;
                        const pliant_vec3 x = place_of(bodies[a], p), y = place_of(bodies[b], q);
                        const pliant_vec3 v = velocity_of(bodies[a], p);
                        const pliant_vec3 u = velocity_of(bodies[b], q);
                        const float d[3] = {x.x - y.x, x.y - y.y, x.z - y.z};
                        const float distance = sqrtf(pose_dot(d, d));
                        const float speed =
                            (d[0] * (v.x - u.x) + d[1] * (v.y - u.y) + d[2] * (v.z - u.z)) /
                            distance;
                        expected += distance - 0.1f + dt * speed < 0.002f && distance < t->size;
                    }
        check_near(t->touch_count, expected, 1);  // rounding at the threshold
        assert_int_equal(t->counts.bodies + t->counts.self, t->touch_count);
        all += expected;
        pliant_world_destroy(world);
        for (int i = 0; i < 5; i++) pliant_body_destroy(bodies[i]);
    }
    printf("%d touches\n", all);
    check_at_least(all, 1000);
    pliant_lattice_destroy(lattice);
}

// Two bodies of different cells, that hit off centre and spin afterwards.
typedef struct impact {
    pliant_lattice *large, *small;
    pliant_world *world;
    pliant_body *a, *b;
    pliant_world_sum before;
    int32_t touches, dents;
    double least, most_energy;
} impact;

static impact run_impact(int32_t collision, float friction, float speed, float h, float seconds)
{
    impact t = {.large = lattice_of(CHECK_CELLS_BALL, 6, 2, 0.1),
                .small = lattice_of(CHECK_CELLS_CUBE, 3, 1, 0.07),
                .world = world_with(1, nowhere, collision),
                .least = INFINITY};
    assert_int_equal(pliant_world_set_collision(t.world, collision, friction), PLIANT_OK);
    t.a = body_at(t.large, (pliant_vec3){-0.6f, 0, 0}, 0);
    t.b = body_at(t.small, (pliant_vec3){0.4f, 0.15f, 0.1f}, 0);
    set_velocity(t.a, (pliant_vec3){2 * speed, 0, 0.2f * speed});
    set_velocity(t.b, (pliant_vec3){-3 * speed, 0.1f * speed, 0});
    add_to(t.world, t.a);
    add_to(t.world, t.b);
    t.before = pliant_world_add_up(t.world);
    for (float time = 0; time < seconds; time += h) {
        step_world(t.world, h, 1);
        t.touches += pliant_world_last(t.world).body_contact_count;
        t.dents += pliant_world_last(t.world).surface_contact_count;
        t.least = fmin(t.least, least_distance(t.a, t.b));
        t.most_energy = fmax(t.most_energy, pliant_world_add_up(t.world).kinetic_energy);
    }
    const pliant_world_sum after = pliant_world_add_up(t.world);
    printf("collision %d: %d + %d touches, nearest %.4f of 0.085, energy %.4f, at most %.4f, -> "
           "%.4f\n",
           (int)collision, (int)t.touches, (int)t.dents, t.least, t.before.kinetic_energy,
           t.most_energy, after.kinetic_energy);
    // What 500 steps of shape matching round off, about the origin, a metre from the way; friction
    // between balls has a torque.
    const double scale = t.before.mass * 3 * speed;
    for (int c = 0; c < 3; c++) {
        check_near(after.momentum[c], t.before.momentum[c], 3e-5 * scale);
        if (friction == 0)
            check_near(after.angular_momentum[c], t.before.angular_momentum[c], 3e-5 * scale);
    }
    // Symplectic steps make energy to and fro by some parts of a thousand.
    check_at_most(t.most_energy, t.before.kinetic_energy * 1.005);
    // They went apart.
    check_at_least(centre_of(t.b, 0) - centre_of(t.a, 0), 0.5);
    return t;
}

static void end_impact(impact *t)
{
    pliant_world_destroy(t->world);
    pliant_body_destroy(t->a);
    pliant_body_destroy(t->b);
    pliant_lattice_destroy(t->large);
    pliant_lattice_destroy(t->small);
}

// Slower than half a ball a step, none enters another at all.
static void balls_collide_and_keep_momentum_and_energy(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        impact t = run_impact(PLIANT_COLLISION_BODIES, 0.5f * (float)i, 1, 1.0f / 240, 1.5f);
        check_at_least(t.least, 0.95 * 0.085);
        check_at_least(t.touches, 100);
        end_impact(&t);
        impact slow = run_impact(PLIANT_COLLISION_BODIES, 0.5f * (float)i, 0.3f, dt, 4);
        check_at_least(slow.least, 0.95 * 0.085);
        end_impact(&slow);
    }
}

// What enters another, fast or without balls, comes out the way it came.
static void what_enters_a_body_comes_out(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        const int32_t collision =
            PLIANT_COLLISION_SURFACES | (i ? PLIANT_COLLISION_BODIES : PLIANT_COLLISION_NONE);
        impact t = run_impact(collision, 0.2f * (float)i, i ? 1 : 0.4f, dt, 4);
        check_at_least(t.dents, 20);
        check_at_most(t.least, 0.06);
        check_at_least(least_distance(t.a, t.b), 0.085);
        end_impact(&t);
    }
}

// Impulses alone, in a crush of bodies with friction: equal and opposite, and no energy from them
// but where overlaps part.
static void impulses_keep_momentum_to_rounding(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 4, 1, 0.1);
    check_random random = check_random_seed(33);
    for (int trial = 0; trial < 8; trial++) {
        const int32_t bits[] = {1, 4, 5, 7};
        pliant_world *world = world_with(1, nowhere, bits[trial % 4]);
        pliant_body *bodies[4];
        for (int i = 0; i < 4; i++) {
            bodies[i] = body_at(lattice, (pliant_vec3){0.28f * (float)i, 0.1f, 0}, 0);
            add_to(world, bodies[i]);
            for (int32_t p = 0; p < lattice->particle_count; p++)
                for (int c = 0; c < 3; c++) {
                    const int32_t at = lattice->slot[p] + PLIANT_LANES * c;
                    bodies[i]->x[at] += 0.05f * ((float)check_random_next(&random) - 0.5f);
                    bodies[i]->v[at] = 20 * ((float)check_random_next(&random) - 0.5f);
                }
        }
        const pliant_world_sum before = pliant_world_add_up(world);
        pliant_crowd_measure(&world->crowd, NULL);
        pliant_touches_find(&world->touches, NULL, &world->crowd, bits[trial % 4], dt);
        pliant_impulses_apply(&world->impulses, NULL, &world->touches, trial < 4 ? 0 : 0.7f);
        pliant_touches_put_back(&world->touches, NULL);
        const pliant_world_sum after = pliant_world_add_up(world);
        printf("bits %d: %d touches, %d dents, energy %.3f -> %.3f\n", (int)bits[trial % 4],
               (int)world->touches.touch_count, (int)world->touches.counts.surfaces,
               before.kinetic_energy, after.kinetic_energy);
        assert_true((bits[trial % 4] & 4) == 0 || world->touches.counts.surfaces > 20);
        check_at_least(world->touches.touch_count, 20);
        const double scale = before.mass * 10;
        for (int c = 0; c < 3; c++) {
            check_near(after.momentum[c], before.momentum[c], 1e-7 * scale);
            if (trial < 4)
                check_near(after.angular_momentum[c], before.angular_momentum[c], 1e-6 * scale);
        }
        check_at_most(after.kinetic_energy, before.kinetic_energy);
        pliant_world_destroy(world);
        for (int i = 0; i < 4; i++) pliant_body_destroy(bodies[i]);
    }
    pliant_lattice_destroy(lattice);
}

// A heap in a bowl of planes comes to rest, and no ball is inside another.
static void a_heap_at_rest_does_not_overlap(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_BALL, 4, 2, 0.1);
    pliant_world *world = world_with(1, (pliant_vec3){0, 0, -9.81f},
                                     PLIANT_COLLISION_BODIES | PLIANT_COLLISION_SURFACES);
    put_obstacle(world, 0, floor_at(0, 0.5f));
    for (int i = 0; i < 4; i++) {
        pliant_obstacle wall = floor_at(0, 0.5f);
        const float x[] = {1, -1, 0, 0}, y[] = {0, 0, 1, -1};
        wall.b = (pliant_vec3){x[i], y[i], 0.3f};
        wall.a = (pliant_vec3){-0.5f * x[i], -0.5f * y[i], 0};
        put_obstacle(world, 1 + i, wall);
    }
    pliant_body *bodies[8];
    for (int i = 0; i < 8; i++) {
        const pliant_vec3 at = {0.05f * (float)(i % 3) - 0.05f, 0.04f * (float)(i % 2),
                                0.4f + 0.55f * (float)i};
        bodies[i] = body_at(lattice, at, 0.3f);
        add_to(world, bodies[i]);
    }
    step_world(world, 1.0f / 120, 1800);
    double least = INFINITY;
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < i; k++) least = fmin(least, least_distance(bodies[i], bodies[k]));
    const pliant_world_sum sum = pliant_world_add_up(world);
    printf("%d inside, nearest %.4f of 0.1, speed %.4f, %d touches\n",
           pliant_world_last(world).surface_contact_count, least,
           sqrt(2 * sum.kinetic_energy / sum.mass), pliant_world_last(world).body_contact_count);
    check_at_least(least, 0.7 * 0.1);  // the lowest ones carry seven
    assert_int_equal(pliant_world_last(world).surface_contact_count, 0);
    check_at_most(sqrt(2 * sum.kinetic_energy / sum.mass), 0.1);  // some heaps go on rocking
    check_at_least(pliant_world_last(world).body_contact_count, 16);
    pliant_world_destroy(world);
    for (int i = 0; i < 8; i++) pliant_body_destroy(bodies[i]);
    pliant_lattice_destroy(lattice);
}

// The plates of a U are pressed together: they stop at each other, and cross without.
static void a_folded_body_does_not_cross_itself(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_FOLDED, 6, 1, 0.1);
    double nearest[2];
    for (int i = 0; i < 2; i++) {
        pliant_world *world =
            world_with(1, nowhere, i ? PLIANT_COLLISION_SELF : PLIANT_COLLISION_NONE);
        pliant_body *body = body_at(lattice, nowhere, 0.1f);
        add_to(world, body);
        const pliant_world_sum before = pliant_world_add_up(world);
        nearest[i] = INFINITY;
        int32_t touches = 0;
        for (int step = 0; step < 60; step++) {
            // Towards the middle between the plates.
            for (int32_t p = 0; p < lattice->particle_count; p++) {
                const float z = place_of(body, p).z;
                body->v[lattice->slot[p] + 2 * PLIANT_LANES] -= copysignf(0.2f, z);
            }
            step_world(world, dt, 1);
            nearest[i] = fmin(nearest[i], least_distance(body, body));
            touches += pliant_world_last(world).self_contact_count;
        }
        if (i) check_at_least(touches, 100);
        else assert_int_equal(touches, 0);
        const pliant_world_sum after = pliant_world_add_up(world);
        for (int c = 0; c < 2; c++)
            // of 12 m/s that the kicks amount to
            check_near(after.momentum[c], before.momentum[c], 1e-4 * before.mass);
        pliant_world_destroy(world);
        pliant_body_destroy(body);
    }
    printf("nearest without %.4f, with %.4f\n", nearest[0], nearest[1]);
    check_at_most(nearest[0], 0.05);
    check_at_least(nearest[1], 0.08);
    pliant_lattice_destroy(lattice);
}

// Bodies put into each other part without flying off.
static void overlapping_bodies_part_slowly(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 3, 2, 0.1);
    pliant_world *world = world_with(1, nowhere, PLIANT_COLLISION_BODIES);
    pliant_body *bodies[3];
    for (int i = 0; i < 3; i++) {
        bodies[i] = body_at(lattice, (pliant_vec3){0.03f * (float)i, 0.02f * (float)i, 0}, 0.1f);
        add_to(world, bodies[i]);
    }
    double most = 0;
    for (int step = 0; step < 600; step++) {
        step_world(world, dt, 1);
        const pliant_world_sum sum = pliant_world_add_up(world);
        most = fmax(most, sqrt(2 * sum.kinetic_energy / sum.mass));
        check_near(sum.momentum[0], 0, 1e-4 * sum.mass);
    }
    printf("fastest %.3f m/s\n", most);
    check_at_most(most, 2);  // twice ten balls a second
    pliant_world_destroy(world);
    for (int i = 0; i < 3; i++) pliant_body_destroy(bodies[i]);
    pliant_lattice_destroy(lattice);
}

// More touches than there is room for: smaller balls, not fewer.
static void a_crush_narrows_the_balls(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 4, 1, 0.1);
    pliant_world_def def = pliant_world_default();
    def.particle_capacity = 125 * 12;
    def.body_capacity = 12;
    def.collision = PLIANT_COLLISION_BODIES;
    pliant_world *world = NULL;
    pliant_error err = {""};
    check_ok(pliant_world_create(&def, &world, &err), &err);
    pliant_body *bodies[12];
    for (int i = 0; i < 12; i++) {
        bodies[i] = body_at(lattice, (pliant_vec3){0.001f * (float)i, 0, 0}, 0.1f);
        add_to(world, bodies[i]);
        for (int32_t k = 0; k < 24 * lattice->block_count; k++) bodies[i]->x[k] *= 0.2f;
    }
    float least = 1;
    for (int step = 0; step < 200; step++) {
        step_world(world, dt, 1);
        least = fminf(least, pliant_world_last(world).narrowing);
    }
    check_at_most(least, 0.9);
    for (int i = 0; i < 12; i++)
        for (int32_t p = 0; p < 125; p++) assert_true(isfinite(place_of(bodies[i], p).x));
    pliant_world_destroy(world);
    for (int i = 0; i < 12; i++) pliant_body_destroy(bodies[i]);
    pliant_lattice_destroy(lattice);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(touches_are_those_of_brute_force),
        cmocka_unit_test(balls_collide_and_keep_momentum_and_energy),
        cmocka_unit_test(what_enters_a_body_comes_out),
        cmocka_unit_test(impulses_keep_momentum_to_rounding),
        cmocka_unit_test(a_heap_at_rest_does_not_overlap),
        cmocka_unit_test(a_folded_body_does_not_cross_itself),
        cmocka_unit_test(overlapping_bodies_part_slowly),
        cmocka_unit_test(a_crush_narrows_the_balls),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
