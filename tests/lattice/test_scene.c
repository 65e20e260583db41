// test_scene.c: scripts on a lattice: what is grabbed, moved, bumped into, and what is refused.
#include "allocations.h"

#include "check.h"

#include "pliant/error.h"
#include "script_lines.h"
#include "synthetic_lattice.h"
#include "synthetic_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 4 };                     // cells
static const double cell_size = 0.25;  // m: all is exact in binary
static const double mass = 2;          // kg

static pliant_model *cube;    // a lattice alone, 125 particles in a unit cube from 0 0 0, w = 2
static pliant_model *greens;  // Green's functions alone

static int set_up(void **state)
{
    (void)state;
    char path[64];
    pliant_error err;
    snprintf(path, sizeof path, "/tmp/pliant_test_scene_%d.h5", (int)getpid());
    check_lattice *lattice = check_lattice_create(&(check_lattice_def){.shape = CHECK_CELLS_CUBE,
                                                                       .size = SIDE,
                                                                       .half_width = 2,
                                                                       .cell_size = cell_size,
                                                                       .mass = mass});
    check_lattice_write(lattice, path);
    check_lattice_destroy(lattice);
    check_ok(pliant_model_open(path, &cube, &err), &err);
    unlink(path);
    check_write_synthetic_model(path, NULL, 1, 0, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    check_ok(pliant_model_open(path, &greens, &err), &err);
    unlink(path);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    pliant_model_close(greens);
    pliant_model_close(cube);
    return 0;
}

static pliant_player *create_with(int32_t thread_count)
{
    pliant_error err;
    pliant_player *player;
    pliant_player_def def = pliant_player_default(cube);
    def.script_name = "t.script";
    def.thread_count = thread_count;
    check_ok(pliant_player_create(cube, &def, &player, &err), &err);
    return player;
}

static pliant_player *create(void)
{
    return create_with(1);
}

static pliant_instances *instances_of(const pliant_player *player)
{
    return pliant_scene_instances(pliant_player_scene(player));
}

static pliant_vec3 particle(const pliant_player *player, int32_t instance, int32_t p)
{
    return pliant_instances_position(instances_of(player), instance, p);
}

static void check_vec3(pliant_vec3 found, double x, double y, double z, double tolerance)
{
    check_near((double)found.x, x, tolerance);
    check_near((double)found.y, y, tolerance);
    check_near((double)found.z, z, tolerance);
}

static int32_t last_corner(void)
{
    return (SIDE + 1) * (SIDE + 1) * (SIDE + 1) - 1;  // at 1 1 1
}

// ---- Grabs and bones ----

static void a_grabbed_particle_goes_where_it_is_moved(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player,
                  "dt 0.01\ngrab near 1.1 1.2 1.05 hand\nmove hand 1.5 1 1.25 over 5\nstep 2");
    check_vec3(particle(player, 0, last_corner()), 1.2, 1, 1.1, 1e-6);
    check_play_ok(player, "step 3");
    check_vec3(particle(player, 0, last_corner()), 1.5, 1, 1.25, 1e-6);
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 1);
    check_near(pliant_player_last(player)->time, 0.05, 1e-12);
    // It stays there, and the rest follows in its shape, which may turn about it.
    check_play_ok(player, "damping 0.5\nrigid-damping 0.5\nstep 300");
    check_vec3(particle(player, 0, last_corner()), 1.5, 1, 1.25, 1e-6);
    const pliant_vec3 x = particle(player, 0, 0);
    check_near(hypot(hypot((double)x.x - 1.5, (double)x.y - 1), (double)x.z - 1.25), sqrt(3), 0.6);
    check_play_ok(player, "let hand\nstep");
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 0);
    pliant_player_destroy(player);
}

static void a_radius_grabs_what_is_within(void **state)
{
    (void)state;
    pliant_player *player = create();
    // The top layer: 25 particles within 0.1 of the plane z = 1 need a wide ball from above.
    check_play_ok(player, "grab near 0.5 0.5 6 radius 5.1 lid\nstep");
    int32_t held = pliant_player_last(player)->report.constraint_count;
    assert_int_equal(held, 25);
    // Those of a second grab with the name come to it; they keep their places about its point.
    check_play_ok(player, "grab 0 lid\nmove lid 0.5 0.5 6.5\nstep");
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 26);
    check_vec3(particle(player, 0, 0), 0, 0, 0.5, 1e-6);
    check_vec3(particle(player, 0, last_corner()), 1, 1, 1.5, 1e-6);
    // Where nobody is within, the nearest is meant.
    check_play_ok(player, "grab near 9 9 9 radius 0.5 far\nstep");
    pliant_player_destroy(player);
}

static void a_bone_turns_what_is_bound_to_it(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "bone arm 1 1 0\nbind arm %d\nturn arm 0 0 3 90 over 10\nstep 10", 0);
    // (0,0,0) - (1,1,0) = (-1,-1,0), turned by a right angle: (1,-1,0).
    check_vec3(particle(player, 0, 0), 2, 0, 0, 1e-5);
    check_play_ok(player, "move arm 1 1 1\nturn arm 0 0 1 -90\nstep");
    check_vec3(particle(player, 0, 0), 0, 0, 1, 1e-5);
    check_play_refused(player, "bind leg 1", "no bone leg here");
    check_play_refused(player, "bone arm 0 0 0", "arm is there already");
    check_play_ok(player, "let arm\nstep");
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 0);
    pliant_player_destroy(player);
}

// ---- Instances ----

static void instances_stand_where_they_are_placed(void **state)
{
    (void)state;
    pliant_player *player = create();
    pliant_error err;
    check_play_ok(player,
                  "instances 5 at 1 2 3 step 2 3 4 columns 2 rows 2\ninstances 1 at 0 0 50");
    check_ok(pliant_player_prepare(player, &err), &err);
    const int32_t n = pliant_instances_vertex_count(instances_of(player));
    assert_int_equal(pliant_player_surface_count(player), 6 * n);
    static const double places[6][3] = {{1, 2, 3}, {3, 2, 3}, {1, 5, 3},
                                        {3, 5, 3}, {1, 2, 7}, {0, 0, 50}};
    for (int32_t i = 0; i < 6; i++)
        for (int32_t v = 0; v < n; v++)
            check_vec3(pliant_player_surface(player)[i * n + v], places[i][0], places[i][1],
                       places[i][2], 1e-5);
    // Statements about vertices and particles may name one; "near" looks where they are now.
    check_play_ok(
        player,
        "collide none\nprobe p instance 4 vertex 0\ngrab near 4 3 4 a\ngrab instance 5 0 b\n"
        "move b 0 0 51\nstep");
    int32_t count;
    const pliant_probe *probe = pliant_player_probes(player, &count);
    check_vec3(probe->u, 1, 2, 7, 1e-5);
    check_vec3(particle(player, 5, 0), 0, 0, 51, 1e-5);
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 2);
    check_play_refused(player, "probe q instance 6 vertex 0", "instance 6 of 6");
    check_play_refused(player, "grab instance 6 0 c", "instance 6 of 6");
    check_play_refused(player, "instances 2", "expected before");
    pliant_player_destroy(player);
}

static void random_turns_follow_from_their_seed_and_keep_the_middle(void **state)
{
    (void)state;
    pliant_vec3 first[3];
    for (int pass = 0; pass < 3; pass++) {
        pliant_player *player = create();
        pliant_error err;
        check_play_ok(player, "instances 3 step 5 0 0 random %d velocity 0 0 -1",
                      pass == 2 ? 8 : 7);
        check_ok(pliant_player_prepare(player, &err), &err);
        for (int32_t i = 0; i < 3; i++) {
            pliant_vec3 mean = {0, 0, 0};
            for (int32_t p = 0; p <= last_corner(); p++) {
                const pliant_vec3 x = particle(player, i, p);
                mean.x += x.x / 125;
                mean.y += x.y / 125;
                mean.z += x.z / 125;
            }
            check_vec3(mean, 0.5 + 5 * i, 0.5, 0.5, 1e-5);
            const pliant_vec3 corner = particle(player, i, 0);
            const double r[3] = {(double)corner.x - 0.5 - 5 * i, (double)corner.y - 0.5,
                                 (double)corner.z - 0.5};
            check_near(r[0] * r[0] + r[1] * r[1] + r[2] * r[2], 0.75, 1e-5);
            if (pass == 0) first[i] = corner;
            else assert_int_equal(memcmp(&corner, &first[i], sizeof corner) == 0, pass == 1);
        }
        check_play_ok(player, "dt 0.5\nstep");
        pliant_player_destroy(player);
    }
}

// ---- Forces ----

static void what_falls_obeys_the_integrator(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "gravity 0 0 -10\ndt 0.01\nprobe p near 0 0 0\nstep 100");
    int32_t count;
    // v_n = n h g, x_n = h sum of v_k (LSM-1, 2): h^2 g n (n + 1) / 2.
    check_vec3(pliant_player_probes(player, &count)->u, 0, 0, -10 * 1e-4 * 100 * 101 / 2, 1e-4);
    // Nothing acts but gravity.
    check_vec3(pliant_player_last(player)->force, 0, 0, 0, 1e-3 * mass * 10);
    pliant_player_destroy(player);
}

static void at_rest_the_contact_force_is_the_weight(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "gravity 0 0 -10\ndt 0.01\ndamping 0.5\nrigid-damping 0.5\n"
                          "plane 0 0 2 -0.2 friction 0.5 as floor\nstep 600");
    double force = 0;
    for (int i = 0; i < 50; i++) {
        check_play_ok(player, "step");
        force += (double)pliant_player_last(player)->force.z / 50;
    }
    check_near(force, mass * 10, 0.01 * mass * 10);
    for (int32_t p = 0; p <= last_corner(); p++)
        check_at_least((double)particle(player, 0, p).z, -0.1 - 1e-3);
    // The floor is moved up, and pushes; then it is dropped.
    check_play_ok(player, "move floor 0 0 0.1 over 50\nstep 100");
    check_at_least((double)particle(player, 0, 0).z, 0.1 - 1e-3);
    check_play_ok(player, "drop floor\nstep 100");
    check_at_most((double)particle(player, 0, 0).z, -2);
    pliant_player_destroy(player);
}

static void an_impulse_is_momentum(void **state)
{
    (void)state;
    pliant_player *player = create();
    // Shared in proportion to mass: all particles get the same velocity, p / m.
    check_play_ok(player,
                  "dt 0.125\nimpulse near 0.5 0.5 0.5 radius 5 4 0 -2\nprobe p near 0 0 0\nstep 8");
    int32_t count;
    check_vec3(pliant_player_probes(player, &count)->u, 2, 0, -1, 1e-4);
    check_vec3(pliant_player_last(player)->force, 0, 0, 0, 1e-3);
    pliant_player_destroy(player);
}

static void release_all_lets_go_of_what_has_a_name(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player,
                  "gravity 0 0 -10\ngrab 0\ngrab 1 hand\nsphere 9 9 9 1 as ball\nsphere 8 8 8 1\n"
                  "bone arm 0 0 0\nbind arm 2\nstep");
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 3);
    assert_int_equal(pliant_scene_obstacles(pliant_player_scene(player), NULL, 0), 2);
    check_play_ok(player, "release all\nstep 10");
    assert_int_equal(pliant_player_last(player)->report.constraint_count, 0);
    assert_int_equal(pliant_scene_obstacles(pliant_player_scene(player), NULL, 0), 1);
    check_near((double)pliant_player_last(player)->force.z, 0, 1e-3 * mass * 10);
    check_play_refused(player, "move hand 0 0 0", "no hand here");
    check_play_ok(player, "capsule 0 0 9 0 0 10 1 taper 0 as hand");  // the name is free again
    pliant_player_destroy(player);
}

static void obstacles_are_where_the_script_says(void **state)
{
    (void)state;
    pliant_player *player = create();
    pliant_obstacle o[4];
    check_play_ok(player, "box 1 2 3 2 4 6 friction 0.25 as crate\nplane 0 3 4 10\n"
                          "capsule 0 0 9 0 0 10 1 taper 0.5 as cone\nmove crate 9 9 9 over 4\n"
                          "turn cone 0 1 0 90");
    const pliant_scene *scene = pliant_player_scene(player);
    assert_int_equal(pliant_scene_obstacles(scene, o, 4), 3);
    assert_int_equal(o[0].kind, PLIANT_OBSTACLE_BOX);
    check_vec3(o[0].a, 1.5, 3, 4.5, 0);
    check_vec3(o[0].b, 0.5, 1, 1.5, 0);
    check_near((double)o[0].friction, 0.25, 0);
    check_vec3(o[1].b, 0, 0.6, 0.8, 1e-6);
    check_vec3(o[1].a, 0, 1.2, 1.6, 1e-6);
    check_near((double)o[2].radius_b, 0.5, 0);
    check_play_ok(player, "step 2");
    assert_int_equal(pliant_scene_obstacles(scene, o, 4), 3);
    check_vec3(o[0].a, 5.25, 6, 6.75, 1e-5);
    check_near((double)o[2].rotation[1], sqrt(0.5), 1e-6);
    check_play_ok(player, "step 5");
    assert_int_equal(pliant_scene_obstacles(scene, o, 4), 3);
    check_vec3(o[0].a, 9, 9, 9, 1e-5);
    check_play_ok(player, "sphere 5 5 5 1 as crate");  // put there at once, as something else
    assert_int_equal(pliant_scene_obstacles(scene, o, 4), 3);
    assert_int_equal(o[0].kind, PLIANT_OBSTACLE_SPHERE);
    check_vec3(o[0].a, 5, 5, 5, 0);
    check_play_refused(player, "grab 0 crate", "crate is an obstacle or a bone");
    check_play_refused(player, "let crate", "crate is an obstacle");
    check_play_ok(player, "grab 0 hand");
    check_play_refused(player, "sphere 0 0 0 1 as hand", "hand is a grab");
    pliant_player_destroy(player);
}

static void stretched_links_break(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player,
                  "strain-limit 0.5\ndt 0.01\ngrab near 0.5 0.5 -5 radius 5.1 floor\n"
                  "grab near 0.5 0.5 6 radius 5.1 lid\nmove lid 0.5 0.5 16 over 200\nstep 400");
    // Between the two nothing holds together any more.
    check_at_least((double)pliant_body_broken_count(pliant_instances_body(instances_of(player), 0)),
                   9);
    for (int32_t p = 0; p <= last_corner(); p++) {
        const pliant_vec3 x = particle(player, 0, p);
        assert_true(isfinite(x.x) && isfinite(x.y) && isfinite(x.z));
    }
    pliant_player_destroy(player);
    player = create();
    check_play_ok(player, "step");
    check_play_refused(player, "strain-limit 0.5", "made unbreakable");
    pliant_player_destroy(player);
}

// ---- Kinds of play ----

static void statements_of_the_other_kind_are_refused_by_name(void **state)
{
    (void)state;
    static const char *const lines[][2] = {
        {"displace 3 0 0 1", "displace is about Green's functions"},
        {"traction 3 0 0 1", "traction is about Green's functions"},
        {"patch p tolerance 1", "patch is about Green's functions"},
        {"tool t sphere 0 0 0 1", "tool is about Green's functions"},
        {"proxy p 0 0 0", "proxy is about Green's functions"},
        {"deadline 100", "deadline is about Green's functions"},
        {"release 3", "expected release all"},
        {"probe p vertex 1:3", "level 1"},
        {"probe p vertex 100000", "vertex 100000 of"},
        {"probe p vertex source 100000", "source vertex 100000 is not in the model"},
        {"grab 125 hand", "particle 125 of 125"},
        {"move hand 0 0 0", "no hand here"},
        {"drop hand", "no hand here"},
    };
    pliant_player *player = create();
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++)
        check_play_refused(player, lines[i][0], lines[i][1]);
    check_play_ok(player, "step");
    pliant_player_destroy(player);

    pliant_error err;
    pliant_player_def def = pliant_player_default(greens);
    def.script_name = "t.script";
    check_ok(pliant_player_create(greens, &def, &player, &err), &err);
    check_play_refused(player, "sphere 0 0 0 1", "sphere is about a lattice");
    check_play_refused(player, "grab 1 hand", "--lattice makes one");
    check_play_refused(player, "probe p instance 1 vertex 3", "instance 1 of 1");
    check_play_ok(player, "displace near 0 0 1 0 0 -0.1\nstep");
    check_play_refused(player, "instances 2", "this play is of Green's functions already");
    assert_null(pliant_player_scene(player));
    pliant_player_destroy(player);
    def.kind_rule = PLIANT_KIND_LATTICE;
    assert_true(pliant_player_create(greens, &def, &player, &err) < 0);
    assert_non_null(strstr(err.text, "expected a lattice"));
}

static void options_of_greens_functions_are_refused(void **state)
{
    (void)state;
    pliant_error err;
    pliant_player *player = NULL;
    pliant_player_def def = pliant_player_default(cube);
    def.greens_option = "--passive";
    assert_int_equal(pliant_player_create(cube, &def, &player, &err), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "--passive"));
}

// ---- Promises ----

static const char crowd[] = "dt 0.01\ngravity 0 0 -10\ndamping 0.2 every 2\n"
                            "instances 6 at 0 0 0.5 step 1.3 1.3 1.3 columns 2 rows 1 random 3\n"
                            "plane 0.2 0 1 0 friction 0.3\nsphere 1 0.5 0 0.6 as ball\n"
                            "collide all friction 0.2\nprobe p instance 3 near 0 0 0\n"
                            "grab instance 5 near 0 0 9 hand\nmove hand 1 1 1 over 60\n"
                            "move ball 0 0.5 0.3 over 80\nstep 120";

static void threads_change_no_bit(void **state)
{
    (void)state;
    pliant_player *one = create_with(1), *two = create_with(2);
    check_play_ok(one, "%s", crowd);
    check_play_ok(two, "%s", crowd);
    const size_t count = (size_t)pliant_player_surface_count(one);
    assert_memory_equal(pliant_player_surface(one), pliant_player_surface(two),
                        count * sizeof(pliant_vec3));
    assert_memory_equal(&pliant_player_last(one)->force, &pliant_player_last(two)->force,
                        sizeof(pliant_vec3));
    pliant_player_destroy(one);
    pliant_player_destroy(two);
}

static void steps_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    pliant_player *player = create();
    check_play_ok(player, "%s", crowd);
    pliant_statement step;
    pliant_error err;
    check_ok(pliant_statement_parse("step 50", 7, "t", 1, 0, &step, &err), &err);
    const long before = atomic_load(&calls);
    const pliant_status status = pliant_player_execute(player, &step, NULL, &err);
    assert_int_equal(atomic_load(&calls) - before, 0);
    check_ok(status, &err);
    pliant_player_destroy(player);
}

static void steps_are_timed_by_phase(void **state)
{
    (void)state;
    pliant_player *player = create();
    check_play_ok(player, "%s", crowd);
    const pliant_step *last = pliant_player_last(player);
    assert_int_equal(last->kind, PLIANT_PLAY_LATTICE);
    int64_t sum = 0;
    for (int p = 0; p < PLIANT_SCENE_PHASE_TOTAL; p++) {
        check_at_least((double)last->phase_ns[p], 0);
        sum += last->phase_ns[p];
    }
    assert_true(last->phase_ns[PLIANT_SCENE_PHASE_MATCH] > 0);
    assert_true(last->phase_ns[PLIANT_SCENE_PHASE_SURFACE] > 0);
    check_at_most((double)sum, (double)last->total_ns);
    assert_int_equal(last->total_ns, last->phase_ns[PLIANT_SCENE_PHASE_TOTAL]);
    pliant_player_destroy(player);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(a_grabbed_particle_goes_where_it_is_moved),
        cmocka_unit_test(a_radius_grabs_what_is_within),
        cmocka_unit_test(a_bone_turns_what_is_bound_to_it),
        cmocka_unit_test(instances_stand_where_they_are_placed),
        cmocka_unit_test(random_turns_follow_from_their_seed_and_keep_the_middle),
        cmocka_unit_test(what_falls_obeys_the_integrator),
        cmocka_unit_test(at_rest_the_contact_force_is_the_weight),
        cmocka_unit_test(an_impulse_is_momentum),
        cmocka_unit_test(release_all_lets_go_of_what_has_a_name),
        cmocka_unit_test(obstacles_are_where_the_script_says),
        cmocka_unit_test(stretched_links_break),
        cmocka_unit_test(statements_of_the_other_kind_are_refused_by_name),
        cmocka_unit_test(options_of_greens_functions_are_refused),
        cmocka_unit_test(threads_change_no_bit),
        cmocka_unit_test(steps_allocate_nothing),
        cmocka_unit_test(steps_are_timed_by_phase),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
