// test_solid.c: distances from obstacles, and particles that are held off by them.
#include "check.h"

#include "lattice/solid.h"

#include <stdio.h>

static float uniform(check_random *random, float least, float most)
{
    return least + (most - least) * (float)check_random_next(random);
}

static pliant_vec3 vector_of(check_random *random, float size)
{
    const float x = uniform(random, -size, size), y = uniform(random, -size, size);
    return (pliant_vec3){x, y, uniform(random, -size, size)};
}

// One of each kind somewhere, turned: planes, balls, boxes, capsules, cones, one end in the other.
static pliant_obstacle obstacle_of(check_random *random, int kind)
{
    pliant_obstacle o = pliant_obstacle_default((pliant_obstacle_kind)(kind < 4 ? kind + 1 : 4));
    o.a = vector_of(random, 1);
    for (int i = 0; i < 4; i++) o.rotation[i] = uniform(random, -1, 1);
    o.friction = 0;
    if (kind == 0) o.b = vector_of(random, 2);
    if (kind == 2) o.b = (pliant_vec3){uniform(random, 0.2f, 1), uniform(random, 0.2f, 1), 0.5f};
    if (kind >= 3) {
        const pliant_vec3 along = vector_of(random, kind == 5 ? 0.1f : 1.5f);
        o.b = (pliant_vec3){o.a.x + along.x, o.a.y + along.y, o.a.z + along.z};
        o.radius = uniform(random, 0.2f, 0.6f);
        o.radius_b = kind == 3 ? o.radius : kind == 4 ? 0 : uniform(random, 0.1f, 0.9f);
    }
    return o;
}

enum { kind_count = 6 };

// The distance is that of the nearest of many points where it is 0, whichever side one is on.
static void distances_are_euclidean(void **state)
{
    (void)state;
    check_random random = check_random_seed(11);
    for (int kind = 0; kind < kind_count; kind++) {
        const pliant_obstacle o = obstacle_of(&random, kind);
        assert_true(pliant_solid_accepts(&o));
        const pliant_solid solid = pliant_solid_make(&o);
        for (int i = 0; i < 2000; i++) {
            const pliant_vec3 at = vector_of(&random, 2);
            const float y[3] = {at.x, at.y, at.z};
            float n[3], m[3];
            const float distance = pliant_solid_distance(&solid, y, n);
            check_near(pose_dot(n, n), 1, 1e-5);
            // The nearest place of the surface is there, with the same normal a little outside.
            const float foot[3] = {y[0] - distance * n[0], y[1] - distance * n[1],
                                   y[2] - distance * n[2]};
            check_near(pliant_solid_distance(&solid, foot, m), 0, 2e-6);
            const float outside[3] = {foot[0] + 0.01f * n[0], foot[1] + 0.01f * n[1],
                                      foot[2] + 0.01f * n[2]};
            check_near(pliant_solid_distance(&solid, outside, m), 0.01, 2e-6);
            // No point of a ball of that radius is on the other side.
            for (int k = 0; k < 8; k++) {
                const pliant_vec3 to = vector_of(&random, 1);
                const float size = sqrtf(to.x * to.x + to.y * to.y + to.z * to.z);
                const float step = 0.999f * fabsf(distance) / size;
                const float z[3] = {y[0] + step * to.x, y[1] + step * to.y, y[2] + step * to.z};
                const float other = pliant_solid_distance(&solid, z, m);
                if (distance > 0) check_at_least(other, -1e-6);
                else check_at_most(other, 1e-6);
            }
        }
    }
}

// Whatever its speed and the solid's, a particle that begins outside ends outside, and one that is
// not in the way goes on as it was.
static void no_particle_enters(void **state)
{
    (void)state;
    check_random random = check_random_seed(12);
    int held = 0, crossing = 0;
    for (int i = 0; i < 60000; i++) {
        pliant_obstacle o = obstacle_of(&random, i % kind_count);
        const float fast = i % 2 ? 100 : 1;
        o.velocity = vector_of(&random, i % 3 ? fast : 0);
        o.spin = vector_of(&random, i % 5 ? 3 : 0);
        pliant_solid solid = pliant_solid_make(&o);
        const float dt = 0.02f;
        pliant_solid_begin(&solid, dt);
        const pliant_vec3 at = vector_of(&random, 2), leaves = vector_of(&random, fast);
        const float x[3] = {at.x, at.y, at.z}, before[3] = {leaves.x, leaves.y, leaves.z};
        float y[3], n[3], v[3] = {leaves.x, leaves.y, leaves.z};
        pose_to_frame(&solid.begin, x, y);
        if (pliant_solid_distance(&solid, y, n) < 0) continue;
        const int is_held = pliant_solid_hold_off(&solid, x, dt, 1, v);
        const float end[3] = {x[0] + dt * v[0], x[1] + dt * v[1], x[2] + dt * v[2]};
        pose_to_frame(&solid.end, end, y);
        const float out = pliant_solid_distance(&solid, y, n);
        check_at_least(out, -4e-6);
        held += is_held;
        if (is_held) {
            float far[3];
            for (int c = 0; c < 3; c++) far[c] = x[c] + dt * before[c];
            pose_to_frame(&solid.end, far, y);
            crossing += pliant_solid_distance(&solid, y, n) > 0;
        } else {
            for (int c = 0; c < 3; c++) assert_true(v[c] == before[c]);
        }
        const float size = dt * sqrtf(pose_dot(before, before));
        if (is_held) assert_true(pliant_solid_is_near(&solid, x, 0, size));
    }
    printf("%d held off, %d of them would have passed through\n", held, crossing);
    check_at_least(held, 1000);
    check_at_least(crossing, 500);
}

static pliant_solid floor_with(float friction, float restitution)
{
    pliant_obstacle o = pliant_obstacle_default(PLIANT_OBSTACLE_PLANE);
    o.friction = friction;
    o.restitution = restitution;
    pliant_solid solid = pliant_solid_make(&o);
    pliant_solid_begin(&solid, 0.01f);
    return solid;
}

// Coulomb: the impulse along is at most mu times the impulse out, and it is that when it slides.
static void friction_is_coulombs(void **state)
{
    (void)state;
    const float x[3] = {0, 0, 0};
    const pliant_solid rough = floor_with(0.25f, 0);
    float v[3] = {3, 4, -8};  // 5 along, of which 0.25 * 8 go
    assert_int_equal(pliant_solid_hold_off(&rough, x, 0.01f, 1, v), 1);
    check_near(v[0], 1.8, 1e-5);
    check_near(v[1], 2.4, 1e-5);
    check_near(v[2], 0, 1e-6);
    float w[3] = {0.6f, 0.8f, -8};
    assert_int_equal(pliant_solid_hold_off(&rough, x, 0.01f, 1, w), 1);
    for (int c = 0; c < 3; c++) check_near(w[c], 0, 1e-6);
}

static void fast_impacts_bounce_and_slow_ones_rest(void **state)
{
    (void)state;
    const float x[3] = {0, 0, 0.01f};
    const pliant_solid bouncy = floor_with(0, 0.5f);
    float v[3] = {0, 0, -8}, w[3] = {0, 0, -1.5f};
    assert_int_equal(pliant_solid_hold_off(&bouncy, x, 0.01f, 2, v), 1);
    check_near(v[2], 4, 1e-5);
    // Slower than "bounce": up to the floor, 0.01 m in 0.01 s.
    assert_int_equal(pliant_solid_hold_off(&bouncy, x, 0.01f, 2, w), 1);
    check_near(w[2], -1, 1e-5);
}

static void a_moving_solid_carries_along(void **state)
{
    (void)state;
    pliant_obstacle o = pliant_obstacle_default(PLIANT_OBSTACLE_PLANE);
    o.velocity = (pliant_vec3){2, 0, 3};
    o.spin = (pliant_vec3){0, 0, 1};
    o.friction = 10;
    pliant_solid solid = pliant_solid_make(&o);
    pliant_solid_begin(&solid, 0.01f);
    const float x[3] = {0, 1, 0};
    float v[3] = {0, 0, 0};
    assert_int_equal(pliant_solid_hold_off(&solid, x, 0.01f, 1, v), 1);
    // velocity + spin x (0, 1, 0), along the chord
    check_near(v[0], 2 - 1, 1e-3);
    check_near(v[1], 0, 1e-2);
    check_near(v[2], 3, 1e-5);
}

static void what_is_inside_comes_out_step_by_step(void **state)
{
    (void)state;
    pliant_obstacle o = pliant_obstacle_default(PLIANT_OBSTACLE_SPHERE);
    pliant_solid solid = pliant_solid_make(&o);
    pliant_solid_begin(&solid, 0.01f);
    float x[3] = {0, 0, 0.5f}, v[3] = {0, 0, 0};
    assert_int_equal(pliant_solid_hold_off(&solid, x, 0.01f, 1, v), 0);
    for (int i = 0; i < 4; i++) pliant_solid_expel(&solid, 0.1f, x);
    check_near(x[2], 0.9, 1e-6);
    for (int i = 0; i < 4; i++) pliant_solid_expel(&solid, 0.1f, x);
    check_near(x[2], 1, 1e-6);
    // On its way in it is stopped, though it is inside already.
    float y[3] = {0, 0, 0.9f}, down[3] = {0, 0, -1};
    assert_int_equal(pliant_solid_hold_off(&solid, y, 0.01f, 1, down), 1);
    check_near(down[2], 0, 1e-6);
}

static void a_target_is_reached_and_kept(void **state)
{
    (void)state;
    pliant_obstacle o = pliant_obstacle_default(PLIANT_OBSTACLE_CAPSULE);
    o.a = (pliant_vec3){1, 2, 3};
    o.b = (pliant_vec3){1, 2, 5};
    o.velocity = (pliant_vec3){1, 0, 0};
    pliant_solid solid = pliant_solid_make(&o);
    pliant_solid_begin(&solid, 0.5f);
    pliant_solid_end(&solid);
    pliant_obstacle now = pliant_solid_tell(&solid);
    check_near(now.a.x, 1.5, 1e-6);
    check_near(now.b.x, 1.5, 1e-6);
    check_near(now.b.z, 5, 1e-6);
    const float turned[4] = {0, 1, 0, 1};
    solid.target = pose_make((pliant_vec3){7, 2, 3}, turned);
    solid.has_target = 1;
    for (int i = 0; i < 2; i++) {
        pliant_solid_begin(&solid, 0.5f);
        assert_int_equal(solid.is_moving, i == 0);
        pliant_solid_end(&solid);
        now = pliant_solid_tell(&solid);
        check_near(now.a.x, 7, 1e-6);
        check_near(now.rotation[1], sqrt(0.5), 1e-6);
        check_near(now.velocity.x, 0, 0);
    }
    // Told and set again it is the same.
    const pliant_solid again = pliant_solid_make(&now);
    const float x[3] = {8.5f, 2.1f, 3.2f};
    float y[3], n[3], m[3];
    pose_to_frame(&solid.begin, x, y);
    const float distance = pliant_solid_distance(&solid, y, n);
    pose_to_frame(&again.begin, x, y);
    check_near(pliant_solid_distance(&again, y, m), distance, 1e-6);
    check_at_most(distance, 0);  // the axis lies along x now
}

static void spinning_solids_turn_at_their_rate(void **state)
{
    (void)state;
    pliant_pose pose = pose_make((pliant_vec3){0, 0, 0}, NULL);
    const float none[3] = {0, 0, 0}, spin[3] = {0, 0, 2};
    for (int i = 0; i < 100; i++) pose = pose_advance(&pose, none, spin, 0.005f);  // by 1 rad
    check_near(pose.R[0], cos(1), 1e-5);
    check_near(pose.R[3], sin(1), 1e-5);
}

static void impossible_obstacles_are_not_accepted(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        pliant_obstacle o = pliant_obstacle_default(PLIANT_OBSTACLE_CAPSULE);
        assert_true(pliant_solid_accepts(&o));
        if (i == 0) o.radius = 0;
        if (i == 1) o.radius_b = -1;
        if (i == 2) o.a.x = NAN;
        if (i == 3) o.spin.z = INFINITY;
        if (i == 4) memset(o.rotation, 0, sizeof o.rotation);
        if (i == 5) o.friction = -0.1f;
        if (i == 6) o.restitution = 1.1f;
        if (i == 7) o.kind = (pliant_obstacle_kind)7;
        if (i == 8) o.kind = PLIANT_OBSTACLE_PLANE, o.b = (pliant_vec3){0, 0, 0};
        if (i == 9) o.kind = PLIANT_OBSTACLE_BOX, o.b.y = 0;
        if (i == 10) o.kind = PLIANT_OBSTACLE_SPHERE, o.radius = NAN;
        if (i == 11) o.friction = NAN;
        assert_false(pliant_solid_accepts(&o));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distances_are_euclidean),
        cmocka_unit_test(no_particle_enters),
        cmocka_unit_test(friction_is_coulombs),
        cmocka_unit_test(fast_impacts_bounce_and_slow_ones_rest),
        cmocka_unit_test(a_moving_solid_carries_along),
        cmocka_unit_test(what_is_inside_comes_out_step_by_step),
        cmocka_unit_test(a_target_is_reached_and_kept),
        cmocka_unit_test(spinning_solids_turn_at_their_rate),
        cmocka_unit_test(impossible_obstacles_are_not_accepted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
