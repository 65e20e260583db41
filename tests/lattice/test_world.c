// test_world.c: holds and bones, what a world refuses, the same bits from any team, abuse.
#include "allocations.h"
#include "surfaces.h"
#include "world_fixture.h"

#include "lattice/world.h"

#include <stdio.h>

static const pliant_vec3 earth = {0, 0, -9.81f}, nowhere = {0, 0, 0};
static const float dt = 1.0f / 60;

static void check_place(pliant_vec3 found, double x, double y, double z, double tolerance)
{
    check_near(found.x, x, tolerance);
    check_near(found.y, y, tolerance);
    check_near(found.z, z, tolerance);
}

// ---- Holds ----

// The nearest particle is dragged about and has its hand's velocity; let go, it keeps it.
static void a_grabbed_particle_follows(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 3, 1, 0.1);
    pliant_body *body = body_at(lattice, nowhere, 0.1f);
    pliant_world *world = world_with(1, earth, 0);
    add_to(world, body);
    int32_t bound = 0;
    const pliant_vec3 corner = {0.3f, 0.3f, 0.3f};
    assert_int_equal(pliant_world_grab(world, 2, body, corner, 0, &bound), PLIANT_OK);
    assert_int_equal(bound, 1);
    const int32_t p = lattice->particle_count - 1;  // the corner of greatest coordinates
    const pliant_hold_info hold = pliant_world_hold(world, 2);
    check_place(hold.position, 0.15, 0.15, 0.15, 1e-6);
    assert_int_equal(hold.particle_count, 1);
    step_world(world, dt, 30);  // it hangs there
    check_place(place_of(body, p), 0.15, 0.15, 0.15, 1e-6);
    check_at_most(centre_of(body, 2), 0.05);
    for (int step = 1; step <= 120; step++) {
        const double t = step * dt;
        const pliant_vec3 to = {(float)(0.15 + t), (float)(0.15 + sin(3 * t)), 0.15f};
        assert_int_equal(pliant_world_move_hold(world, 2, to, NULL), PLIANT_OK);
        const pliant_vec3 before = place_of(body, p);
        step_world(world, dt, 1);
        check_place(place_of(body, p), to.x, to.y, to.z, 0);
        check_place(velocity_of(body, p), (to.x - before.x) / dt, (to.y - before.y) / dt, 0, 1e-4);
    }
    check_at_least(centre_of(body, 0), 1);  // all of it came along
    const pliant_vec3 v = velocity_of(body, p);
    assert_int_equal(pliant_world_let(world, 2), PLIANT_OK);
    assert_int_equal(pliant_world_hold(world, 2).particle_count, -1);
    check_place(velocity_of(body, p), v.x, v.y, v.z, 0);
    const float z = place_of(body, p).z;
    step_world(world, dt, 60);
    check_at_most(place_of(body, p).z, z - 3);
    pliant_world_destroy(world);
    pliant_body_destroy(body);
    pliant_lattice_destroy(lattice);
}

// A bar with a bone at each end: what is bound is where the bones have it, to the bit, whatever
// gravity and an obstacle do; the middle is in between.
static void bones_bind_exactly(void **state)
{
    (void)state;
    int32_t bar[2 * 2 * 12][3];
    for (int i = 0; i < 48; i++) bar[i][0] = i % 12, bar[i][1] = i / 12 % 2, bar[i][2] = i / 24;
    pliant_lattice *lattice = lattice_of_cells(48, bar[0], 2, 0.1, 0.01f);
    pliant_body *body = body_at(lattice, nowhere, 0.1f);
    pliant_world *world = world_with(1, earth, PLIANT_COLLISION_SELF);
    add_to(world, body);
    put_obstacle(world, 0, floor_at(-0.12f, 0.5f));
    int32_t bound[2];
    for (int b = 0; b < 2; b++) {
        const float x = b ? 0.45f : -0.45f;
        const pliant_vec3 from = {x - 0.1f, 0, 0}, to = {x + 0.1f, 0, 0};
        assert_int_equal(pliant_world_set_hold(world, b, (pliant_vec3){x, 0, 0}, NULL), PLIANT_OK);
        assert_int_equal(pliant_world_bind_near(world, b, body, from, to, 0.145f, &bound[b]),
                         PLIANT_OK);
        check_at_least(bound[b], 27);
    }
    static pliant_vec3 rest[200];
    pliant_body_positions(body, rest);
    pliant_pose pose = {0};
    for (int step = 1; step <= 90; step++) {
        const float half = 0.01f * (float)step, q[4] = {sinf(half), 0, 0, cosf(half)};
        const pliant_vec3 at = {0.45f + 0.002f * (float)step, 0, 0.004f * (float)step};
        assert_int_equal(pliant_world_move_hold(world, 1, at, q), PLIANT_OK);
        pose = pose_make(at, q);
        step_world(world, dt, 1);
        int32_t found[2] = {0, 0};
        for (int32_t p = 0; p < lattice->particle_count; p++) {
            const int32_t by = world->crowd.held_by[p];
            if (by < 0) continue;
            const int32_t hold = world->holds.held[by].hold;
            found[hold]++;
            const pliant_vec3 x = place_of(body, p);
            if (hold == 0) {
                check_place(x, rest[p].x, rest[p].y, rest[p].z, 3e-8);
                continue;
            }
            const float y[3] = {rest[p].x - 0.45f, rest[p].y, rest[p].z};
            float expected[3];
            pose_to_world(&pose, y, expected);
            check_place(x, expected[0], expected[1], expected[2], 1e-6);
        }
        assert_int_equal(found[0], bound[0]);
        assert_int_equal(found[1], bound[1]);
    }
    // The twist and the lift are shared out along the bar.
    step_world(world, dt, 120);
    const int32_t middle = pliant_lattice_nearest(lattice, (const double[]){0, 0, 0});
    check_at_least(place_of(body, middle).z, -0.05);
    check_at_most(place_of(body, middle).z, 0.36);
    pliant_world_destroy(world);
    pliant_body_destroy(body);
    pliant_lattice_destroy(lattice);
}

// Held particles push others and are not pushed.
static void what_is_held_pushes(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 2, 1, 0.1);
    pliant_body *hand = body_at(lattice, (pliant_vec3){-0.4f, 0, 0}, 0.1f);
    pliant_body *other = body_at(lattice, nowhere, 0.1f);
    pliant_world *world = world_with(1, nowhere, PLIANT_COLLISION_BODIES);
    add_to(world, hand);
    add_to(world, other);
    assert_int_equal(pliant_world_set_hold(world, 0, nowhere, NULL), PLIANT_OK);
    assert_int_equal(pliant_world_bind(world, 0, hand, NULL, lattice->particle_count), PLIANT_OK);
    for (int step = 1; step <= 60; step++) {
        const pliant_vec3 to = {0.02f * (float)step, 0, 0};
        assert_int_equal(pliant_world_move_hold(world, 0, to, NULL), PLIANT_OK);
        step_world(world, dt, 1);
        check_near(centre_of(hand, 0), -0.4 + to.x, 1e-6);
        check_at_least(centre_of(other, 0) - centre_of(hand, 0), 0.25);
    }
    check_at_least(centre_of(other, 0), 0.9);
    pliant_world_destroy(world);
    pliant_body_destroy(hand);
    pliant_body_destroy(other);
    pliant_lattice_destroy(lattice);
}

// Particles change hands; bodies leave, and the others' holds and obstacles' chunks stay theirs.
static void bodies_come_and_go(void **state)
{
    (void)state;
    pliant_lattice *small = lattice_of(CHECK_CELLS_CUBE, 2, 1, 0.1);
    pliant_lattice *large = lattice_of(CHECK_CELLS_BALL, 7, 2, 0.1);
    pliant_world *world = world_with(1, earth, 7);
    put_obstacle(world, 0, floor_at(-3, 0.5f));
    pliant_body *bodies[4];
    for (int i = 0; i < 4; i++) {
        bodies[i] = body_at(i == 1 ? large : small, (pliant_vec3){2 * (float)i, 0, 0}, 0.1f);
        add_to(world, bodies[i]);
        assert_int_equal(pliant_world_set_hold(world, i, nowhere, NULL), PLIANT_OK);
        const int32_t listed[] = {0, 5, 7};
        assert_int_equal(pliant_world_bind(world, i, bodies[i], listed, 3), PLIANT_OK);
    }
    // Hold 0 takes two of body 3's; hold 3 has one left.
    const int32_t taken[] = {5, 7};
    assert_int_equal(pliant_world_bind(world, 0, bodies[3], taken, 2), PLIANT_OK);
    assert_int_equal(pliant_world_hold(world, 0).particle_count, 5);
    assert_int_equal(pliant_world_hold(world, 3).particle_count, 1);
    step_world(world, dt, 5);
    assert_int_equal(pliant_world_remove(world, bodies[1]), PLIANT_OK);
    assert_int_equal(pliant_world_remove(world, bodies[1]), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_world_hold(world, 1).particle_count, 0);
    static pliant_vec3 before[27], after[27];
    pliant_body_positions(bodies[3], before);
    step_world(world, dt, 60);
    pliant_body_positions(bodies[3], after);
    const int32_t held[] = {0, 5, 7};
    for (int i = 0; i < 3; i++) {
        const pliant_vec3 x = before[held[i]];
        check_place(after[held[i]], x.x, x.y, x.z, 1e-6);
    }
    check_at_least(after[26].z, before[26].z - 0.3);  // the others hang from them
    const pliant_world_report report = pliant_world_last(world);
    assert_int_equal(report.body_count, 3);
    assert_int_equal(report.particle_count, 3 * 27);
    assert_int_equal(report.held_count, 9);
    // Back at the end, in another place of the numbering.
    add_to(world, bodies[1]);
    step_world(world, dt, 200);
    check_at_least(least_of(bodies[1], 2), -3 - 1e-5);
    check_at_most(least_of(bodies[1], 2), -2.9);
    pliant_world_destroy(world);
    for (int i = 0; i < 4; i++) pliant_body_destroy(bodies[i]);
    pliant_lattice_destroy(small);
    pliant_lattice_destroy(large);
}

// ---- Refusals ----

static void refusals_have_no_effect(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_CUBE, 2, 1, 0.1);
    pliant_body *bodies[3];
    for (int i = 0; i < 3; i++) bodies[i] = body_at(lattice, (pliant_vec3){(float)i, 0, 0}, 0);
    pliant_world_def def = pliant_world_default();
    def.body_capacity = 4;
    def.particle_capacity = 60;
    def.obstacle_capacity = 1;
    def.hold_capacity = 1;
    def.held_capacity = 10;
    pliant_world *world = NULL;
    pliant_error err = {""};
    check_ok(pliant_world_create(&def, &world, &err), &err);
    add_to(world, bodies[0]);
    assert_int_equal(pliant_world_add(world, bodies[0], &err), PLIANT_ERR_ARGUMENT);
    add_to(world, bodies[1]);
    assert_int_equal(pliant_world_add(world, bodies[2], &err), PLIANT_ERR_CAPACITY);
    assert_string_equal(err.text, "world: expected at most 60 particles, found 81");
    assert_int_equal(pliant_world_add(world, NULL, &err), PLIANT_ERR_ARGUMENT);

    const pliant_obstacle ball = pliant_obstacle_default(PLIANT_OBSTACLE_SPHERE);
    pliant_obstacle bad = ball;
    bad.radius = NAN;
    assert_int_equal(pliant_world_set_obstacle(world, 1, &ball), PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_world_set_obstacle(world, -1, &ball), PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_world_set_obstacle(world, 0, &bad), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_world_move_obstacle(world, 0, nowhere, NULL), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_world_obstacle(world, 0).kind, PLIANT_OBSTACLE_NONE);
    assert_int_equal(pliant_world_set_obstacle(world, 0, &ball), PLIANT_OK);
    assert_int_equal(pliant_world_move_obstacle(world, 0, (pliant_vec3){NAN, 0, 0}, NULL),
                     PLIANT_ERR_ARGUMENT);
    const pliant_obstacle none = pliant_obstacle_default(PLIANT_OBSTACLE_NONE);
    assert_int_equal(pliant_world_set_obstacle(world, 0, &none), PLIANT_OK);

    const float no_turn[4] = {0, 0, 0, 0};
    const int32_t wrong[] = {0, 27}, all = 27;
    int32_t bound = 77;
    assert_int_equal(pliant_world_set_hold(world, 1, nowhere, NULL), PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_world_set_hold(world, 0, nowhere, no_turn), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_world_bind(world, 0, bodies[0], NULL, 1), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_world_set_hold(world, 0, nowhere, NULL), PLIANT_OK);
    assert_int_equal(pliant_world_bind(world, 0, bodies[2], NULL, 1), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_world_bind(world, 0, bodies[0], wrong, 2), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_world_bind(world, 0, bodies[0], NULL, all), PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_world_bind_near(world, 0, bodies[0], nowhere, nowhere, 9, &bound),
                     PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_world_grab(world, 0, bodies[0], nowhere, 9, &bound),
                     PLIANT_ERR_CAPACITY);
    assert_int_equal(bound, 77);
    assert_int_equal(pliant_world_hold(world, 0).particle_count, 0);
    // Exactly full, and taken over and grabbed again without more room.
    assert_int_equal(pliant_world_bind(world, 0, bodies[0], NULL, 10), PLIANT_OK);
    assert_int_equal(pliant_world_bind(world, 0, bodies[0], NULL, 10), PLIANT_OK);
    assert_int_equal(pliant_world_bind(world, 0, bodies[0], NULL, 11), PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_world_grab(world, 0, bodies[0], nowhere, 0.105f, &bound), PLIANT_OK);
    assert_int_equal(bound, 7);

    assert_int_equal(pliant_world_step(world, 0), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_world_step(world, NAN), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_world_step(world, -dt), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_world_set_gravity(world, (pliant_vec3){0, INFINITY, 0}),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_world_set_collision(world, 8, 0), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_world_set_collision(world, 1, -1), PLIANT_ERR_ARGUMENT);
    step_world(world, dt, 1);
    pliant_world_destroy(world);

    for (int i = 0; i < 6; i++) {
        pliant_world_def broken = pliant_world_default();
        int32_t *counts[] = {&broken.body_capacity,     &broken.particle_capacity,
                             &broken.obstacle_capacity, &broken.hold_capacity,
                             &broken.held_capacity,     &broken.thread_count};
        *counts[i] = -1;
        world = (pliant_world *)&world;
        assert_int_equal(pliant_world_create(&broken, &world, &err), PLIANT_ERR_ARGUMENT);
        assert_null(world);
    }
    for (int i = 0; i < 3; i++) pliant_body_destroy(bodies[i]);
    pliant_lattice_destroy(lattice);
}

// ---- A scene with everything in it ----

typedef struct scene {
    pliant_lattice *lattices[2];
    pliant_body *bodies[12];
    pliant_world *world;
    pliant_world_report counted;  // contacts of all steps
} scene;

static scene scene_with(int32_t thread_count)
{
    scene s = {.lattices = {lattice_of(CHECK_CELLS_BALL, 4, 2, 0.1),
                            lattice_of(CHECK_CELLS_FOLDED, 4, 1, 0.08)},
               .world = world_with(thread_count, earth, 7)};
    assert_int_equal(pliant_world_set_collision(s.world, 7, 0.3f), PLIANT_OK);
    put_obstacle(s.world, 0, floor_at(0, 0.5f));
    pliant_obstacle cone = pliant_obstacle_default(PLIANT_OBSTACLE_CAPSULE);
    cone.b.z = 0.6f;
    cone.radius = 0.2f;
    cone.radius_b = 0.05f;
    cone.spin.y = 0.3f;
    put_obstacle(s.world, 3, cone);
    pliant_obstacle box = pliant_obstacle_default(PLIANT_OBSTACLE_BOX);
    box.a = (pliant_vec3){-0.8f, 0, 0.2f};
    box.b = (pliant_vec3){0.1f, 0.5f, 0.2f};
    box.velocity.x = 0.4f;
    box.restitution = 0.5f;
    put_obstacle(s.world, 63, box);
    for (int i = 0; i < 12; i++) {
        const pliant_vec3 at = {0.1f * (float)(i % 3), 0.08f * (float)(i % 2),
                                0.6f + 0.3f * (float)i};
        s.bodies[i] = body_at(s.lattices[i % 2], at, 0.05f);
        add_to(s.world, s.bodies[i]);
    }
    assert_int_equal(pliant_world_grab(s.world, 5, s.bodies[7], (pliant_vec3){0, 0, 2}, 0.1f, NULL),
                     PLIANT_OK);
    return s;
}

static void run_scene(scene *s, int32_t steps)
{
    for (int32_t step = 0; step < steps; step++) {
        const pliant_vec3 hand = {0.5f * sinf(0.1f * (float)step), 0, 2};
        assert_int_equal(pliant_world_move_hold(s->world, 5, hand, NULL), PLIANT_OK);
        step_world(s->world, dt, 1);
        const pliant_world_report report = pliant_world_last(s->world);
        s->counted.obstacle_contact_count += report.obstacle_contact_count;
        s->counted.body_contact_count += report.body_contact_count;
        s->counted.self_contact_count += report.self_contact_count;
        s->counted.surface_contact_count += report.surface_contact_count;
    }
}

static void end_scene(scene *s)
{
    pliant_world_destroy(s->world);
    for (int i = 0; i < 12; i++) pliant_body_destroy(s->bodies[i]);
    for (int i = 0; i < 2; i++) pliant_lattice_destroy(s->lattices[i]);
}

static void the_same_bits_come_from_any_team(void **state)
{
    (void)state;
    scene first = scene_with(1);
    run_scene(&first, 150);
    for (int32_t threads = 1; threads <= 3; threads++) {
        scene s = scene_with(threads);
        run_scene(&s, 150);
        for (int i = 0; i < 12; i++) {
            const size_t bytes = (size_t)s.bodies[i]->lattice->block_count * 24 * sizeof(float);
            assert_memory_equal(s.bodies[i]->x, first.bodies[i]->x, bytes);
            assert_memory_equal(s.bodies[i]->v, first.bodies[i]->v, bytes);
        }
        const pliant_world_report a = s.counted, b = first.counted;
        assert_int_equal(a.body_contact_count, b.body_contact_count);
        assert_int_equal(a.self_contact_count, b.self_contact_count);
        assert_int_equal(a.surface_contact_count, b.surface_contact_count);
        assert_int_equal(a.obstacle_contact_count, b.obstacle_contact_count);
        if (threads == 1) {
            printf("%d obstacle, %d ball, %d self, %d surface contacts\n", a.obstacle_contact_count,
                   a.body_contact_count, a.self_contact_count, a.surface_contact_count);
            check_at_least(a.obstacle_contact_count, 1000);
            check_at_least(a.body_contact_count, 1000);
            check_at_least(a.self_contact_count, 100);
            check_at_least(a.surface_contact_count, 5);
        }
        end_scene(&s);
    }
    end_scene(&first);
}

static void steps_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    scene s = scene_with(2);
    run_scene(&s, 5);
    const long before = atomic_load(&calls);
    run_scene(&s, 200);
    assert_int_equal(atomic_load(&calls) - before, 0);
    end_scene(&s);
}

// A body put back with what was saved of it goes on as it did.
static void a_saved_body_goes_on_the_same(void **state)
{
    (void)state;
    scene s = scene_with(1);
    run_scene(&s, 40);
    pliant_body *saved[12];
    for (int i = 0; i < 12; i++) {
        saved[i] = body_at(s.bodies[i]->lattice, nowhere, 0.05f);
        assert_int_equal(pliant_body_copy(saved[i], s.bodies[i]), PLIANT_OK);
    }
    const pliant_obstacle cone = pliant_world_obstacle(s.world, 3);
    const pliant_obstacle box = pliant_world_obstacle(s.world, 63);
    static pliant_vec3 first[2][1000];
    for (int turn = 0; turn < 2; turn++) {
        if (turn) {
            for (int i = 0; i < 12; i++)
                assert_int_equal(pliant_body_copy(s.bodies[i], saved[i]), PLIANT_OK);
            put_obstacle(s.world, 3, cone);
            put_obstacle(s.world, 63, box);
        }
        assert_int_equal(pliant_world_let(s.world, 5), PLIANT_OK);
        step_world(s.world, dt, 40);
        pliant_body_positions(s.bodies[4], first[turn]);
    }
    for (int32_t p = 0; p < s.bodies[4]->lattice->particle_count; p++)
        check_place(first[1][p], first[0][p].x, first[0][p].y, first[0][p].z, 1e-4);
    for (int i = 0; i < 12; i++) pliant_body_destroy(saved[i]);
    end_scene(&s);
}

// ---- Abuse ----

static float random_float(check_random *random, float size)
{
    return size * (2 * (float)check_random_next(random) - 1);
}

static pliant_vec3 random_vector(check_random *random, float size)
{
    const float x = random_float(random, size), y = random_float(random, size);
    return (pliant_vec3){x, y, random_float(random, size)};
}

// Throw, flatten, scatter, teleport obstacles through bodies, grab and tear, step by a millisecond
// or by a tenth of a second: everything stays finite. Left alone afterwards it calms down.
static void abuse_leaves_everything_finite(void **state)
{
    (void)state;
    const int32_t steps = COUNTING ? 100000 : 3000;  // fewer under the sanitizers
    pliant_lattice *lattices[2] = {lattice_of(CHECK_CELLS_CUBE, 2, 1, 0.1),
                                   lattice_of(CHECK_CELLS_SINGLE, 1, 1, 0.15)};
    pliant_world *world = world_with(1, earth, 7);
    pliant_body *bodies[4];
    for (int i = 0; i < 4; i++) {
        bodies[i] = body_at(lattices[i % 2], (pliant_vec3){0.3f * (float)i, 0, 0.5f}, 0.1f);
        add_to(world, bodies[i]);
    }
    put_obstacle(world, 0, floor_at(0, 0.5f));
    check_random random = check_random_seed(41);
    for (int32_t step = 0; step < steps; step++) {
        if (step % 7 == 0) {
            pliant_body *body = bodies[check_random_index(&random, 4)];
            const pliant_lattice *lattice = body->lattice;
            const int kind = check_random_index(&random, 8);
            const float size = powf(10, random_float(&random, 3));
            for (int32_t p = 0; p < lattice->particle_count; p++) {
                const int32_t slot = lattice->slot[p];
                if (kind == 0) pliant_body_set(body->v, slot, random_vector(&random, size));
                if (kind == 1) body->x[slot + 16] = 0.1f;
                if (kind == 2) pliant_body_set(body->x, slot, random_vector(&random, 1));
                if (kind == 3) pliant_body_set(body->x, slot, (pliant_vec3){0, 0, 0});
            }
            if (kind == 4) {
                pliant_obstacle o = pliant_obstacle_default(
                    (pliant_obstacle_kind)(2 + check_random_index(&random, 3)));
                o.a = random_vector(&random, 1);
                o.b = (pliant_vec3){0.3f, 0.5f, 0.2f};
                o.radius = 0.3f;
                o.radius_b = 0.1f;
                o.velocity = random_vector(&random, size);
                o.spin = random_vector(&random, 10);
                o.restitution = 1;
                put_obstacle(world, 1 + check_random_index(&random, 3), o);
            }
            if (kind == 5)
                assert_int_equal(
                    pliant_world_move_obstacle(world, 0, random_vector(&random, 0.5f), NULL),
                    PLIANT_OK);
            if (kind == 6)
                assert_int_equal(
                    pliant_world_grab(world, 0, body, random_vector(&random, 1), 0.1f, NULL),
                    PLIANT_OK);
            if (kind == 7) {
                const pliant_status status =
                    pliant_world_move_hold(world, 0, random_vector(&random, size), NULL);
                assert_true(status == PLIANT_OK || status == PLIANT_ERR_MISSING);
            }
        }
        step_world(world, step % 11 == 0 ? 0.1f : step % 5 == 0 ? 0.001f : dt, 1);
        if (step % 16) continue;
        for (int i = 0; i < 4; i++)
            for (int32_t p = 0; p < bodies[i]->lattice->particle_count; p++) {
                const pliant_vec3 x = place_of(bodies[i], p), v = velocity_of(bodies[i], p);
                assert_true(isfinite(x.x + x.y + x.z) && isfinite(v.x + v.y + v.z));
            }
    }
    // Left alone on a floor, from wherever they are: back to shape, and at rest.
    assert_int_equal(pliant_world_let(world, 0), PLIANT_OK);
    for (int i = 0; i < 4; i++)
        put_obstacle(world, i,
                     i ? pliant_obstacle_default(PLIANT_OBSTACLE_NONE) : floor_at(0, 0.5f));
    for (int i = 0; i < 4; i++) {
        pliant_vec3 x[27], v[27];
        for (int p = 0; p < 27; p++) {
            x[p] = random_vector(&random, 0.1f);
            x[p].x += (float)i;
            x[p].z += 0.5f;
            v[p] = nowhere;
        }
        assert_int_equal(pliant_body_set_positions(bodies[i], x), PLIANT_OK);
        assert_int_equal(pliant_body_set_velocities(bodies[i], v), PLIANT_OK);
    }
    step_world(world, dt, 1200);
    const pliant_world_sum sum = pliant_world_add_up(world);
    const double speed = sqrt(2 * sum.kinetic_energy / sum.mass);
    printf("left alone: %.5f m/s\n", speed);
    check_at_most(speed, 0.05);
    pliant_world_destroy(world);
    for (int i = 0; i < 4; i++) pliant_body_destroy(bodies[i]);
    for (int i = 0; i < 2; i++) pliant_lattice_destroy(lattices[i]);
}

// Without anything that gives energy, it only falls: no gravity, no motion of obstacles.
static void energy_does_not_grow_in_a_closed_box(void **state)
{
    (void)state;
    pliant_lattice *lattice = lattice_of(CHECK_CELLS_BALL, 3, 1, 0.1);
    pliant_world *world = world_with(1, nowhere, 7);
    assert_int_equal(pliant_world_set_collision(world, 7, 0.3f), PLIANT_OK);
    for (int i = 0; i < 6; i++) {
        pliant_obstacle wall = floor_at(0, 0.3f);
        const float side = i % 2 ? 1 : -1;
        wall.b = (pliant_vec3){i / 2 == 0 ? side : 0, i / 2 == 1 ? side : 0, i / 2 == 2 ? side : 0};
        wall.a = (pliant_vec3){-0.6f * wall.b.x, -0.6f * wall.b.y, -0.6f * wall.b.z};
        wall.restitution = 1;
        put_obstacle(world, i, wall);
    }
    pliant_body *bodies[8];
    check_random random = check_random_seed(42);
    for (int i = 0; i < 8; i++) {
        const pliant_vec3 at = {0.5f * (float)(i & 1) - 0.25f, 0.5f * (float)(i >> 1 & 1) - 0.25f,
                                0.5f * (float)(i >> 2) - 0.25f};
        bodies[i] = body_at(lattice, at, 0);
        const pliant_vec3 v = random_vector(&random, 2);
        for (int32_t p = 0; p < lattice->particle_count; p++)
            pliant_body_set(bodies[i]->v, lattice->slot[p], v);
        add_to(world, bodies[i]);
    }
    const double start = pliant_world_add_up(world).kinetic_energy;
    double most = 0;
    for (int step = 0; step < 3000; step++) {
        step_world(world, dt, 1);
        most = fmax(most, pliant_world_add_up(world).kinetic_energy);
    }
    printf("energy %.4f, at most %.4f, at last %.4f\n", start, most,
           pliant_world_add_up(world).kinetic_energy);
    check_at_most(most, 1.02 * start);
    check_at_most(pliant_world_add_up(world).kinetic_energy, 0.8 * start);
    pliant_world_destroy(world);
    for (int i = 0; i < 8; i++) pliant_body_destroy(bodies[i]);
    pliant_lattice_destroy(lattice);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(a_grabbed_particle_follows),
        cmocka_unit_test(bones_bind_exactly),
        cmocka_unit_test(what_is_held_pushes),
        cmocka_unit_test(bodies_come_and_go),
        cmocka_unit_test(refusals_have_no_effect),
        cmocka_unit_test(the_same_bits_come_from_any_team),
        cmocka_unit_test(steps_allocate_nothing),
        cmocka_unit_test(a_saved_body_goes_on_the_same),
        cmocka_unit_test(abuse_leaves_everything_finite),
        cmocka_unit_test(energy_does_not_grow_in_a_closed_box),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
