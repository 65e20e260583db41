// test_patch.c: patches keep what they promise inside, cost as few nodes as their targets are
// smooth, and change without jumps.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { levels = 3, n = 642, patch_limit = 200 };
static const float push = 0.2f;

// Exact columns (eps 0), compressed ones, and levels 0 and 1 alone.
enum { EXACT, COMPRESSED, COARSE, model_count };
static pliant_model *models[model_count];

static int open_models(void **state)
{
    (void)state;
    for (int k = 0; k < model_count; k++) {
        char path[64];
        snprintf(path, sizeof path, "/tmp/pliant_test_patch_%d_%d.h5", (int)getpid(), k);
        const check_synthetic_def def = {.levels = levels,
                                         .eps = k == COMPRESSED ? 0.02 : 0,
                                         .wavelet = pliant_wavelet_default(),
                                         .blocks = CHECK_FREE_BLOCK,
                                         .level_mask = k == COARSE ? 3 : 15};
        check_synthetic *s = check_synthetic_create(&def);
        check_synthetic_write(s, path);
        check_synthetic_destroy(s);
        pliant_error err = {""};
        check_ok(pliant_model_open(path, &models[k], &err), &err);
        unlink(path);
    }
    return 0;
}

static int close_models(void **state)
{
    (void)state;
    for (int k = 0; k < model_count; k++) pliant_model_close(models[k]);
    return 0;
}

// ---- Contacts ----

typedef struct contact {
    int32_t count;
    int32_t vertices[patch_limit];
    pliant_vec3 u[patch_limit];
} contact;

// A place on the unit sphere, `angle` away from the top along the meridian of x.
static void place_at(double angle, double place[3])
{
    place[0] = sin(angle);
    place[1] = 0;
    place[2] = cos(angle);
}

// All vertices nearer than `radius` to a place, pushed towards -z: by as much everywhere, or less
// towards the edge, or at random.
typedef enum shape { FLAT, ROUND, ROUGH } shape;

static contact press(double angle, double radius, shape kind, float depth)
{
    contact c = {.count = 0};
    double place[3];
    place_at(angle, place);
    check_random random = {.state = 1};
    for (int32_t v = 0; v < n; v++) {
        const double *x = pliant_model_positions(models[EXACT]) + 3 * (size_t)v;
        double square = 0;
        for (int k = 0; k < 3; k++) square += (x[k] - place[k]) * (x[k] - place[k]);
        const double noise = 0.5 + check_random_next(&random);
        if (square > radius * radius || pliant_model_is_free(models[EXACT], v) != 1) continue;
        assert_true(c.count < patch_limit);
        const double part = kind == FLAT    ? 1
                            : kind == ROUND ? 1 - 0.5 * square / (radius * radius)
                                            : noise;
        c.vertices[c.count] = v;
        c.u[c.count++] = (pliant_vec3){0, 0, -depth * (float)part};
    }
    return c;
}

static pliant_solver *make_solver(int k, int32_t constraints)
{
    const pliant_solver_def def = {
        .constraint_capacity = constraints, .load_capacity = 8, .cache_count = 4};
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    check_ok(pliant_solver_create(models[k], &def, &solver, &err), &err);
    return solver;
}

static pliant_patch *make_patch(pliant_solver *solver, double tolerance, int32_t blend_steps)
{
    const pliant_patch_def def = {.vertex_capacity = patch_limit,
                                  .tolerance = tolerance,
                                  .hysteresis = 2,
                                  .blend_steps = blend_steps};
    pliant_patch *patch = NULL;
    pliant_error err = {""};
    check_ok(pliant_patch_create(solver, &def, &patch, &err), &err);
    return patch;
}

static void set(pliant_patch *patch, const contact *c)
{
    assert_int_equal(pliant_patch_set(patch, c->vertices, c->u, c->count), PLIANT_OK);
}

static pliant_patch_report solve(pliant_patch *patch, pliant_status expected)
{
    assert_int_equal(pliant_patch_solve(patch, PLIANT_NEVER), expected);
    return pliant_patch_last(patch);
}

static void solve_fine(pliant_solver *solver, const contact *c)
{
    pliant_solver_release_all(solver);
    for (int32_t i = 0; i < c->count; i++)
        assert_int_equal(
            pliant_solver_displace(solver, (pliant_node){levels, c->vertices[i]}, c->u[i]),
            PLIANT_OK);
    assert_int_equal(pliant_solver_solve(solver, PLIANT_NEVER), PLIANT_OK);
}

static double distance(pliant_vec3 a, pliant_vec3 b)
{
    const double d[3] = {(double)a.x - (double)b.x, (double)a.y - (double)b.y,
                         (double)a.z - (double)b.z};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

static double length(pliant_vec3 a)
{
    return distance(a, (pliant_vec3){0, 0, 0});
}

static void read_surface(pliant_solver *solver, pliant_vec3 *u)
{
    assert_int_equal(pliant_solver_surface(solver, levels, u), PLIANT_OK);
}

// The largest error inside, from the whole surface.
static double error_of(pliant_solver *solver, const contact *c)
{
    static pliant_vec3 u[n];
    read_surface(solver, u);
    double error = 0;
    for (int32_t i = 0; i < c->count; i++)
        error = fmax(error, distance(u[c->vertices[i]], c->u[i]));
    return error;
}

static double largest_change(const pliant_vec3 *a, const pliant_vec3 *b)
{
    double most = 0;
    for (int32_t v = 0; v < n; v++) most = fmax(most, distance(a[v], b[v]));
    return most;
}

// ---- Inside ----

static void the_surface_is_within_the_tolerance_at_every_vertex(void **state)
{
    (void)state;
    for (int k = EXACT; k <= COMPRESSED; k++)
        for (int kind = FLAT; kind <= ROUGH; kind++)
            for (double tolerance = 0.3; tolerance > 0.005; tolerance /= 3) {
                const contact c = press(0.4, 0.7, (shape)kind, push);
                pliant_solver *solver = make_solver(k, patch_limit);
                pliant_patch *patch = make_patch(solver, tolerance * (double)push, 4);
                set(patch, &c);
                for (int frame = 0; frame < 30; frame++) {
                    const pliant_patch_report report = solve(patch, PLIANT_OK);
                    // Selective and whole transforms sum in other orders: float rounding apart.
                    check_near(report.error, error_of(solver, &c), 1e-6);
                    check_at_most(report.error, tolerance * (double)push);
                    assert_int_equal(report.vertex_count, c.count);
                    check_at_most(report.node_count, c.count);
                    int32_t sum = 0;
                    for (int l = 0; l <= levels; l++) sum += report.level_count[l];
                    assert_int_equal(sum, report.node_count);
                    assert_int_equal(pliant_patch_nodes(patch, NULL, 0), report.node_count);
                }
                pliant_patch_destroy(patch);
                pliant_solver_destroy(solver);
            }
}

static int32_t nodes_at_rest(shape kind, double radius, double tolerance, int32_t *coarsest)
{
    const contact c = press(0.4, radius, kind, push);
    pliant_solver *solver = make_solver(EXACT, patch_limit);
    pliant_patch *patch = make_patch(solver, tolerance * (double)push, 2);
    set(patch, &c);
    for (int frame = 0; frame < 600; frame++) (void)solve(patch, PLIANT_OK);
    const pliant_patch_report report = pliant_patch_last(patch);
    assert_int_equal(report.blending, 0);
    for (*coarsest = 0; report.level_count[*coarsest] == 0;) ++*coarsest;
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
    return report.node_count;
}

// A node for a bump: the rough targets' have nothing to do with each other, so of them only those
// go without a node that happen to lie where their neighbours carry them.
static void smooth_targets_need_fewer_nodes_than_rough_ones(void **state)
{
    (void)state;
    const contact c = press(0.4, 0.7, FLAT, push);
    int32_t coarsest;
    const int32_t flat = nodes_at_rest(FLAT, 0.7, 0.1, &coarsest);
    check_at_most(coarsest, levels - 1);
    const int32_t round = nodes_at_rest(ROUND, 0.7, 0.1, &coarsest);
    check_at_most(coarsest, levels - 1);
    const int32_t rough = nodes_at_rest(ROUGH, 0.7, 0.1, &coarsest);
    printf("%d vertices: %d nodes flat, %d round, %d rough\n", c.count, flat, round, rough);
    check_at_most(flat, c.count / 2);
    check_at_most(round, c.count / 2);
    check_at_least(rough, 0.7 * c.count);
}

static void more_tolerance_needs_fewer_nodes(void **state)
{
    (void)state;
    int32_t coarsest;
    for (int kind = FLAT; kind <= ROUGH; kind++) {
        int32_t before = INT32_MAX, first = 0;
        for (double tolerance = 0.02; tolerance < 0.5; tolerance *= 3) {
            const int32_t nodes = nodes_at_rest((shape)kind, 0.7, tolerance, &coarsest);
            if (before == INT32_MAX) first = nodes;
            check_at_most(nodes, before);
            before = nodes;
        }
        check_at_most(before, 0.7 * first);
    }
}

static void without_tolerance_it_is_the_contact_on_the_finest_level(void **state)
{
    (void)state;
    static pliant_vec3 expected[n], found[n];
    for (int k = EXACT; k <= COMPRESSED; k++) {
        const contact c = press(0.4, 0.7, ROUGH, push);
        pliant_solver *fine = make_solver(k, patch_limit);
        solve_fine(fine, &c);
        read_surface(fine, expected);
        pliant_solver *solver = make_solver(k, patch_limit);
        pliant_patch *patch = make_patch(solver, 0, 8);
        set(patch, &c);
        const pliant_patch_report report = solve(patch, PLIANT_OK);
        assert_int_equal(report.node_count, c.count);
        assert_int_equal(report.level_count[levels], c.count);
        assert_true(report.error == 0);
        read_surface(solver, found);
        // The same set of nodes, though come by in steps: C^-1 updated, not made, 1e-9 of drift and
        // float products.
        check_at_most(largest_change(expected, found), 1e-5 * (double)push);
        const pliant_vec3 force = pliant_solver_contact_force(fine);
        check_at_most(distance(pliant_patch_force(patch), force), 1e-4 * length(force));
        pliant_patch_destroy(patch);
        pliant_solver_destroy(solver);
        pliant_solver_destroy(fine);
    }
}

static void nothing_is_pressed_outside_the_patch(void **state)
{
    (void)state;
    const contact c = press(0.4, 0.7, ROUND, push);
    pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
    pliant_patch *patch = make_patch(solver, 0.1 * (double)push, 4);
    set(patch, &c);
    for (int frame = 0; frame < 30; frame++) {
        (void)solve(patch, PLIANT_OK);
        uint8_t is_inside[n] = {0};
        for (int32_t i = 0; i < c.count; i++) is_inside[c.vertices[i]] = 1;
        double inside = 0;
        for (int32_t v = 0; v < n; v++) {
            if (pliant_model_is_free(models[COMPRESSED], v) != 1) continue;
            pliant_vec3 p;
            assert_int_equal(pliant_solver_tractions(solver, &v, 1, &p), PLIANT_OK);
            if (is_inside[v]) inside = fmax(inside, length(p));
            else assert_true(length(p) == 0);
        }
        check_at_least(inside, 0.1);
    }
    // What acts inside adds up to the patch's force: sum of a_i p_i (GF-4).
    double sum[3] = {0};
    for (int32_t i = 0; i < c.count; i++) {
        pliant_vec3 p;
        assert_int_equal(pliant_solver_tractions(solver, &c.vertices[i], 1, &p), PLIANT_OK);
        const double area = pliant_model_area(models[COMPRESSED], c.vertices[i]);
        sum[0] += area * (double)p.x, sum[1] += area * (double)p.y, sum[2] += area * (double)p.z;
    }
    const pliant_vec3 force = pliant_patch_force(patch);
    check_near(force.x, sum[0], 1e-5 * length(force));
    check_near(force.y, sum[1], 1e-5 * length(force));
    check_near(force.z, sum[2], 1e-5 * length(force));
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
}

static void a_patch_at_rest_comes_to_rest(void **state)
{
    (void)state;
    static pliant_vec3 before[n], after[n];
    for (int kind = FLAT; kind <= ROUGH; kind++)
        for (double tolerance = 0.2; tolerance > 0.01; tolerance /= 2) {
            const contact c = press(0.4, 0.7, (shape)kind, push);
            pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
            pliant_patch *patch = make_patch(solver, tolerance * (double)push, 4);
            set(patch, &c);
            // Nodes that take turns wait twice as long each time, so a dozen turns are over by
            // then.
            for (int frame = 0; frame < 3000; frame++) (void)solve(patch, PLIANT_OK);
            read_surface(solver, before);
            const int32_t nodes = pliant_patch_last(patch).node_count;
            for (int frame = 0; frame < 100; frame++) {
                if (frame % 2) set(patch, &c);
                const pliant_patch_report report = solve(patch, PLIANT_OK);
                assert_int_equal(report.solve_count, 1);
                assert_int_equal(report.blending, 0);
                assert_int_equal(report.node_count, nodes);
                if (frame % 10) continue;
                read_surface(solver, after);
                assert_memory_equal(before, after, sizeof before);
            }
            pliant_patch_destroy(patch);
            pliant_solver_destroy(solver);
        }
}

// ---- Changes ----

// When tolerance is given, nodes turn dispensable, and go. In the solve in which one goes nothing
// moves; all of its way, at most the old and the new tolerance and the offsets of those that follow
// it, takes `blend` solves. At once, a node's way is one jump.
static double largest_step_when_nodes_go(int32_t blend, int32_t *gone, double *way)
{
    static pliant_vec3 first[n], before[n], after[n];
    const contact c = press(0.4, 0.7, ROUND, push);
    pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
    pliant_patch *patch = make_patch(solver, 0.01 * (double)push, blend);
    set(patch, &c);
    for (int frame = 0; frame < 100; frame++) (void)solve(patch, PLIANT_OK);
    const int32_t nodes = pliant_patch_last(patch).node_count;
    read_surface(solver, before);
    memcpy(first, before, sizeof first);
    assert_int_equal(pliant_patch_tolerate(patch, 0.2 * (double)push), PLIANT_OK);
    double most = 0;
    for (int frame = 0; frame < 400; frame++) {
        const pliant_patch_report report = solve(patch, PLIANT_OK);
        check_at_most(report.error, 0.2 * (double)push);
        read_surface(solver, after);
        most = fmax(most, largest_change(before, after));
        memcpy(before, after, sizeof before);
    }
    *gone = nodes - pliant_patch_last(patch).node_count;
    *way = largest_change(first, after);
    assert_int_equal(pliant_patch_last(patch).blending, 0);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
    return most;
}

static void nodes_that_go_move_the_surface_by_small_steps(void **state)
{
    (void)state;
    int32_t gone;
    double way;
    const double jump = largest_step_when_nodes_go(0, &gone, &way);
    check_at_least(gone, 20);
    check_at_least(way, 0.05 * (double)push);
    const double step = largest_step_when_nodes_go(16, &gone, &way);
    check_at_least(gone, 20);
    check_at_least(way, 0.05 * (double)push);
    printf("largest step %.3g of the push at once, %.3g blended, on a way of %.3g\n",
           jump / (double)push, step / (double)push, way / (double)push);
    // Each node's way in 16 steps, of which those of several nodes may coincide.
    check_at_most(step, 0.25 * jump);
    check_at_most(step, 0.02 * (double)push);
}

typedef struct jumps {
    double field, force;  // largest change from frame to frame that the finest contact has not
    double error;
    int32_t most_nodes, least_nodes;
} jumps;

typedef struct scene {
    contact (*frame)(int frame);
    int frame_count;
} scene;

static contact deepening(int frame)
{
    return press(0.3, 0.7, ROUND, push * (float)(frame + 1) / 150);
}

static contact sliding(int frame)
{
    return press(0.1 + 0.004 * frame, 0.6, ROUND, push);
}

// The same patch all the while, with a bump that goes through it.
static contact ripple(int frame)
{
    contact c = press(0.3, 0.8, FLAT, push);
    double place[3];
    place_at(0.3 + 0.01 * (frame - 75), place);
    for (int32_t i = 0; i < c.count; i++) {
        const double *x = pliant_model_positions(models[EXACT]) + 3 * (size_t)c.vertices[i];
        double square = 0;
        for (int k = 0; k < 3; k++) square += (x[k] - place[k]) * (x[k] - place[k]);
        c.u[i].z *= (float)(0.4 + 0.6 * exp(-square / 0.09));
    }
    return c;
}

// One level for all of the patch: the coarsest that keeps the tolerance.
static void solve_level_switch(pliant_solver *solver, const contact *c, double tolerance)
{
    for (int32_t l = 0; l <= levels; l++) {
        int32_t stated = 0;
        pliant_solver_release_all(solver);
        for (int32_t i = 0; i < c->count; i++) {
            if (c->vertices[i] >= pliant_model_level_vertex_count(models[EXACT], l)) continue;
            assert_int_equal(
                pliant_solver_displace(solver, (pliant_node){l, c->vertices[i]}, c->u[i]),
                PLIANT_OK);
            stated++;
        }
        if (stated == 0) continue;
        assert_int_equal(pliant_solver_solve(solver, PLIANT_NEVER), PLIANT_OK);
        if (error_of(solver, c) <= tolerance) return;
    }
}

static jumps measure_jumps(scene s, double tolerance, int32_t blend, int is_switch)
{
    static pliant_vec3 u[2][n], fine_u[2][n];
    pliant_vec3 force[2] = {{0, 0, 0}}, fine_force[2] = {{0, 0, 0}};
    pliant_solver *solver = make_solver(EXACT, patch_limit);
    pliant_solver *fine = make_solver(EXACT, patch_limit);
    pliant_patch *patch = make_patch(solver, tolerance * (double)push, blend);
    jumps found = {.least_nodes = INT32_MAX};
    double largest_force = 0;
    for (int frame = 0; frame < s.frame_count; frame++) {
        const int now = frame % 2, last = !now;
        const contact c = s.frame(frame);
        solve_fine(fine, &c);
        read_surface(fine, fine_u[now]);
        fine_force[now] = pliant_solver_contact_force(fine);
        if (is_switch) {
            solve_level_switch(solver, &c, tolerance * (double)push);
            force[now] = pliant_solver_contact_force(solver);
        } else {
            set(patch, &c);
            const pliant_patch_report report = solve(patch, PLIANT_OK);
            found.error = fmax(found.error, report.error / (double)push);
            if (report.node_count > found.most_nodes) found.most_nodes = report.node_count;
            if (report.node_count < found.least_nodes) found.least_nodes = report.node_count;
            force[now] = pliant_patch_force(patch);
        }
        read_surface(solver, u[now]);
        largest_force = fmax(largest_force, length(fine_force[now]));
        if (frame == 0) continue;
        for (int32_t v = 0; v < n; v++) {
            const pliant_vec3 step = {u[now][v].x - u[last][v].x, u[now][v].y - u[last][v].y,
                                      u[now][v].z - u[last][v].z};
            const pliant_vec3 fine_step = {fine_u[now][v].x - fine_u[last][v].x,
                                           fine_u[now][v].y - fine_u[last][v].y,
                                           fine_u[now][v].z - fine_u[last][v].z};
            found.field = fmax(found.field, distance(step, fine_step) / (double)push);
        }
        const pliant_vec3 step = {force[now].x - force[last].x, force[now].y - force[last].y,
                                  force[now].z - force[last].z};
        const pliant_vec3 fine_step = {fine_force[now].x - fine_force[last].x,
                                       fine_force[now].y - fine_force[last].y,
                                       fine_force[now].z - fine_force[last].z};
        found.force = fmax(found.force, distance(step, fine_step));
    }
    found.force /= largest_force;
    pliant_patch_destroy(patch);
    pliant_solver_destroy(fine);
    pliant_solver_destroy(solver);
    return found;
}

static void print_jumps(const char *name, jumps j)
{
    printf("%-22s field %.4f of the push, force %.4f of the largest, %d to %d nodes\n", name,
           j.field, j.force, j.least_nodes, j.most_nodes);
}

// Two surfaces that are both within the tolerance inside differ there by twice that at most, so a
// change of nodes cannot move it further; blended, it takes 16 solves, of which those of several
// changes may coincide.
static void a_patch_that_changes_its_nodes_does_not_pop(void **state)
{
    (void)state;
    const scene scenes[] = {{deepening, 150}, {ripple, 150}};
    for (int s = 0; s < 2; s++) {
        const double tolerance = 0.2;
        const jumps naive = measure_jumps(scenes[s], tolerance, 0, 1);
        const jumps at_once = measure_jumps(scenes[s], tolerance, 0, 0);
        const jumps blended = measure_jumps(scenes[s], tolerance, 16, 0);
        print_jumps(s ? "ripple, level switch" : "deeper, level switch", naive);
        print_jumps("hysteresis alone", at_once);
        print_jumps("blended", blended);
        check_at_most(at_once.field, 2 * tolerance);
        check_at_most(blended.error, tolerance);
        check_at_most(blended.field, 4 * tolerance / 16);
        check_at_most(blended.field, 0.5 * at_once.field);
        check_at_most(blended.field, 0.25 * naive.field);
        check_at_most(blended.force, 0.25 * at_once.force);
        check_at_most(blended.force, 0.5 * naive.force);
        check_at_least(blended.most_nodes, blended.least_nodes + 2);
    }
}

// Vertices that come under the tool meet their targets at once, and its edge needs nodes: the
// finest contact jumps likewise. What is added to that is within twice the tolerance.
static void a_patch_that_slides_adds_no_more_than_the_tolerance(void **state)
{
    (void)state;
    const scene slide = {sliding, 200};
    for (double tolerance = 0.2; tolerance > 0.04; tolerance /= 4) {
        const jumps blended = measure_jumps(slide, tolerance, 16, 0);
        print_jumps("sliding", blended);
        check_at_most(blended.error, tolerance);
        check_at_most(blended.field, 2 * tolerance);
        check_at_most(blended.force, tolerance);
    }
}

// ---- Beside others ----

static void patches_and_the_callers_statements_leave_each_other_alone(void **state)
{
    (void)state;
    pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
    pliant_patch *first = make_patch(solver, 0.1 * (double)push, 2);
    pliant_patch *second = make_patch(solver, 0.1 * (double)push, 2);
    const contact a = press(0.1, 0.4, FLAT, push), b = press(1.3, 0.4, FLAT, push);
    int32_t own = -1;
    for (int32_t v = 0; v < n && own < 0; v++) {
        const double *x = pliant_model_positions(models[COMPRESSED]) + 3 * (size_t)v;
        if (x[0] < -0.9 && pliant_model_is_free(models[COMPRESSED], v) == 1) own = v;
    }
    const pliant_vec3 own_u = {0.05f, 0, 0};
    assert_int_equal(pliant_solver_displace(solver, (pliant_node){levels, own}, own_u), PLIANT_OK);
    set(first, &a);
    set(second, &b);
    for (int frame = 0; frame < 60; frame++) {
        (void)solve(first, PLIANT_OK);
        (void)solve(second, PLIANT_OK);
    }
    const int32_t nodes[2] = {pliant_patch_last(first).node_count,
                              pliant_patch_last(second).node_count};
    assert_int_equal(pliant_solver_constraint_count(solver), nodes[0] + nodes[1] + 1);
    // Both contacts and the caller's hold after either's solve.
    check_at_most(error_of(solver, &a), 0.12 * (double)push);
    check_at_most(error_of(solver, &b), 0.1 * (double)push);
    pliant_vec3 u;
    assert_int_equal(pliant_solver_displacements(solver, &own, 1, &u), PLIANT_OK);
    assert_true(u.x == own_u.x && u.y == own_u.y && u.z == own_u.z);
    // The forces of both are told apart.
    const pliant_vec3 all = pliant_solver_contact_force(solver);
    const pliant_vec3 mine = pliant_solver_node_force(solver, (pliant_node){levels, own});
    const pliant_vec3 f = pliant_patch_force(first), g = pliant_patch_force(second);
    check_near(f.z + g.z + mine.z, all.z, 1e-5 * length(all));
    check_at_least(length(f), 0.1 * length(all));
    check_at_least(length(g), 0.1 * length(all));

    // An empty patch ends its contact; the other stays.
    assert_int_equal(pliant_patch_set(second, NULL, NULL, 0), PLIANT_OK);
    const pliant_patch_report report = solve(second, PLIANT_OK);
    assert_int_equal(report.node_count, 0);
    assert_int_equal(report.blending, 0);
    assert_true(length(pliant_patch_force(second)) == 0);
    assert_int_equal(pliant_solver_constraint_count(solver), nodes[0] + 1);
    (void)solve(first, PLIANT_OK);
    check_at_most(error_of(solver, &a), 0.1 * (double)push);
    pliant_patch_destroy(second);
    assert_int_equal(pliant_solver_constraint_count(solver),
                     pliant_patch_last(first).node_count + 1);
    pliant_patch_destroy(first);
    assert_int_equal(pliant_solver_constraint_count(solver), 1);
    pliant_solver_destroy(solver);
}

static void a_patch_that_overlaps_another_does_not_release_its_nodes(void **state)
{
    (void)state;
    pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
    pliant_patch *first = make_patch(solver, 0, 2), *second = make_patch(solver, 0, 2);
    const contact a = press(0.1, 0.4, FLAT, push), b = press(0.3, 0.4, FLAT, 0.9f * push);
    set(first, &a);
    set(second, &b);
    (void)solve(first, PLIANT_OK);
    (void)solve(second, PLIANT_OK);
    // The last statement holds: where both are, the second's.
    check_at_most(error_of(solver, &b), 0);
    const int32_t together = pliant_solver_constraint_count(solver);
    check_at_most(together, a.count + b.count - 1);
    assert_int_equal(pliant_patch_set(first, NULL, NULL, 0), PLIANT_OK);
    (void)solve(first, PLIANT_OK);
    assert_int_equal(pliant_solver_constraint_count(solver), b.count);
    check_at_most(error_of(solver, &b), 0);
    pliant_patch_destroy(first);
    assert_int_equal(pliant_solver_constraint_count(solver), b.count);
    pliant_patch_destroy(second);
    assert_int_equal(pliant_solver_constraint_count(solver), 0);
    pliant_solver_destroy(solver);
}

// Whatever was pressed, blended or faded: when all have gone the body is at rest, to the last bit.
static void what_ends_leaves_nothing_behind(void **state)
{
    (void)state;
    static pliant_vec3 u[n];
    pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
    pliant_patch *patch = make_patch(solver, 0.05 * (double)push, 16);
    int32_t blending = 0;
    for (int frame = 0; frame < 60; frame++) {
        const contact c = sliding(4 * frame);
        set(patch, &c);
        if (frame == 40) pliant_solver_release_all(solver);
        blending += solve(patch, PLIANT_OK).blending;
        check_at_most(error_of(solver, &c), 0.05 * (double)push + 1e-6);
    }
    check_at_least(blending, 60);
    pliant_patch_destroy(patch);
    assert_int_equal(pliant_solver_solve(solver, PLIANT_NEVER), PLIANT_OK);
    read_surface(solver, u);
    for (int32_t v = 0; v < n; v++) assert_true(length(u[v]) == 0);
    pliant_solver_destroy(solver);
}

// ---- Limits ----

static void a_deadline_that_has_passed_leaves_a_valid_state(void **state)
{
    (void)state;
    const contact c = press(0.4, 0.7, FLAT, push);
    pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
    pliant_patch *patch = make_patch(solver, 0.05 * (double)push, 4);
    set(patch, &c);
    assert_int_equal(pliant_patch_solve(patch, pliant_clock_ns()), PLIANT_LATE);
    const pliant_patch_report late = pliant_patch_last(patch);
    assert_int_equal(late.is_late, 1);
    assert_int_equal(late.solve_count, 1);
    check_at_least(late.error, 0.05 * (double)push);
    // Another order of sums.
    check_near(late.error, error_of(solver, &c), 1e-6);
    assert_true(isfinite(late.error));
    check_at_least(-(double)pliant_patch_force(patch).z, 0);
    // With time it goes on from there.
    const pliant_patch_report report = solve(patch, PLIANT_OK);
    assert_int_equal(report.is_late, 0);
    check_at_most(report.error, 0.05 * (double)push);
    assert_int_equal(pliant_patch_solve(patch, pliant_clock_ns() + INT64_C(60000000000)),
                     PLIANT_OK);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
}

// Frames of a twelfth of the time that it takes do not suffice for all nodes at once: they come a
// few a frame, and then by an inverse that is made over many frames.
static void frames_that_are_too_short_meet_the_tolerance_in_the_end(void **state)
{
    (void)state;
    const contact c = press(0.4, 0.7, FLAT, push);
    int64_t all = INT64_MAX;
    for (int trial = 0; trial < 3; trial++) {
        pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
        pliant_patch *patch = make_patch(solver, 0.02 * (double)push, 4);
        set(patch, &c);
        const int64_t begin = pliant_clock_ns();
        (void)solve(patch, PLIANT_OK);
        const int64_t end = pliant_clock_ns();
        if (end - begin < all) all = end - begin;
        pliant_patch_destroy(patch);
        pliant_solver_destroy(solver);
    }
    pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
    pliant_patch *patch = make_patch(solver, 0.02 * (double)push, 4);
    set(patch, &c);
    int frame = 0;
    while (pliant_patch_solve(patch, pliant_clock_ns() + all / 12) != PLIANT_OK && frame < 20000) {
        assert_true(isfinite(pliant_patch_last(patch).error));
        frame++;
    }
    printf("met after %d frames of %.0f us\n", frame, (double)all / 12e3);
    check_at_least(frame, 1);
    check_at_most(pliant_patch_last(patch).error, 0.02 * (double)push);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
}

static void a_solver_without_room_gets_as_close_as_it_can(void **state)
{
    (void)state;
    const contact c = press(0.4, 0.7, FLAT, push);
    double before = INFINITY;
    for (int32_t room = 2; room <= 32; room *= 4) {
        pliant_solver *solver = make_solver(COMPRESSED, room);
        pliant_patch *patch = make_patch(solver, 0.01 * (double)push, 4);
        set(patch, &c);
        for (int frame = 0; frame < 20; frame++) {
            const pliant_patch_report report = solve(patch, PLIANT_LATE);
            assert_int_equal(report.is_full, 1);
            assert_int_equal(report.is_late, 0);
            check_at_most(report.node_count, room);
            check_near(report.error, error_of(solver, &c), 1e-6);
        }
        check_at_most(pliant_patch_last(patch).error, before);
        before = pliant_patch_last(patch).error;
        pliant_patch_destroy(patch);
        pliant_solver_destroy(solver);
    }
}

static void files_without_the_finest_levels_press_with_what_they_have(void **state)
{
    (void)state;
    pliant_solver *solver = make_solver(COARSE, patch_limit);
    pliant_patch *patch = make_patch(solver, 0.05 * (double)push, 16);
    // A large patch, and one so small that no vertex of levels 0 and 1 is in it.
    int32_t without = 0;
    for (int frame = 0; frame < 120; frame++) {
        const double radius = frame < 60 ? 0.7 : 0.2;
        const contact c = press(0.3 + 0.01 * (frame % 60), radius, FLAT, push);
        int32_t coarse = 0;
        for (int32_t i = 0; i < c.count; i++) coarse += c.vertices[i] < 42;
        without += coarse == 0;
        set(patch, &c);
        const pliant_status status = pliant_patch_solve(patch, PLIANT_NEVER);
        const pliant_patch_report report = pliant_patch_last(patch);
        assert_true(status == PLIANT_OK || (status == PLIANT_LATE && report.is_full));
        assert_int_equal(report.vertex_count, c.count);
        assert_int_equal(report.level_count[2] + report.level_count[3], 0);
        check_at_least(report.node_count, 1);
        check_near(report.error, error_of(solver, &c), 1e-6);
        check_at_most(report.error, 0.8 * (double)push);
        check_at_least(-(double)pliant_patch_force(patch).z, 0.01);
    }
    check_at_least(without, 10);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
}

static void refusals_have_no_effect(void **state)
{
    (void)state;
    static pliant_vec3 before[n], after[n];
    const contact c = press(0.4, 0.7, FLAT, push);
    pliant_solver *solver = make_solver(COMPRESSED, patch_limit);
    pliant_patch *patch = make_patch(solver, 0.05 * (double)push, 0);
    set(patch, &c);
    for (int frame = 0; frame < 100; frame++) (void)solve(patch, PLIANT_OK);
    read_surface(solver, before);

    int32_t held = 0;
    while (pliant_model_is_free(models[COMPRESSED], held) != 0) held++;
    contact bad = c;
    bad.vertices[3] = bad.vertices[7];
    assert_int_equal(pliant_patch_set(patch, bad.vertices, bad.u, bad.count), PLIANT_ERR_ARGUMENT);
    const int32_t wrong[] = {-1, n, held, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        bad = c;
        bad.vertices[c.count - 1] = wrong[i];
        assert_int_equal(pliant_patch_set(patch, bad.vertices, bad.u, bad.count),
                         PLIANT_ERR_ARGUMENT);
    }
    const float odd[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        bad = c;
        bad.u[i].y = odd[i];
        assert_int_equal(pliant_patch_set(patch, bad.vertices, bad.u, bad.count),
                         PLIANT_ERR_ARGUMENT);
    }
    assert_int_equal(pliant_patch_set(patch, c.vertices, c.u, -1), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_patch_set(patch, NULL, c.u, 1), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_patch_set(patch, c.vertices, NULL, 1), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_patch_set(patch, c.vertices, c.u, patch_limit + 1),
                     PLIANT_ERR_CAPACITY);
    assert_int_equal(pliant_patch_tolerate(patch, -1), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_patch_tolerate(patch, NAN), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_patch_tolerate(patch, INFINITY), PLIANT_ERR_ARGUMENT);

    (void)solve(patch, PLIANT_OK);
    read_surface(solver, after);
    assert_memory_equal(before, after, sizeof before);
    // The order in which vertices are named does not matter.
    for (int32_t i = 0; i < c.count; i++) {
        bad.vertices[i] = c.vertices[c.count - 1 - i];
        bad.u[i] = c.u[c.count - 1 - i];
    }
    set(patch, &bad);
    (void)solve(patch, PLIANT_OK);
    read_surface(solver, after);
    assert_memory_equal(before, after, sizeof before);
    pliant_patch_destroy(patch);

    const struct {
        pliant_patch_def def;
        const char *name;
    } defs[] = {{{0, 1, 2, 8}, "vertex_capacity"}, {{10, -1, 2, 8}, "tolerance"},
                {{10, NAN, 2, 8}, "tolerance"},    {{10, 1, 0.5, 8}, "hysteresis"},
                {{10, 1, NAN, 8}, "hysteresis"},   {{10, 1, 2, -1}, "blend_steps"}};
    for (size_t i = 0; i < sizeof defs / sizeof *defs; i++) {
        pliant_patch *none = NULL;
        pliant_error err = {""};
        assert_int_equal(pliant_patch_create(solver, &defs[i].def, &none, &err),
                         PLIANT_ERR_ARGUMENT);
        assert_null(none);
        assert_non_null(strstr(err.text, defs[i].name));
    }
    assert_int_equal(pliant_patch_create(NULL, NULL, &patch, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_patch_create(solver, NULL, NULL, NULL), PLIANT_ERR_ARGUMENT);
    pliant_patch_destroy(NULL);
    pliant_solver_destroy(solver);
}

static void the_default_is_a_thousandth_of_the_body(void **state)
{
    (void)state;
    const pliant_patch_def def = pliant_patch_default(models[EXACT]);
    // The box of the unit sphere: 2 sqrt(3) across.
    check_near(def.tolerance, 2e-3 * sqrt(3), 1e-4);
    pliant_solver *solver = make_solver(EXACT, patch_limit);
    pliant_patch *patch = NULL;
    pliant_error err = {""};
    check_ok(pliant_patch_create(solver, NULL, &patch, &err), &err);
    const contact c = press(0.4, 0.7, FLAT, push);
    set(patch, &c);
    check_at_most(solve(patch, PLIANT_OK).error, def.tolerance);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_surface_is_within_the_tolerance_at_every_vertex),
        cmocka_unit_test(smooth_targets_need_fewer_nodes_than_rough_ones),
        cmocka_unit_test(more_tolerance_needs_fewer_nodes),
        cmocka_unit_test(without_tolerance_it_is_the_contact_on_the_finest_level),
        cmocka_unit_test(nothing_is_pressed_outside_the_patch),
        cmocka_unit_test(a_patch_at_rest_comes_to_rest),
        cmocka_unit_test(nodes_that_go_move_the_surface_by_small_steps),
        cmocka_unit_test(a_patch_that_changes_its_nodes_does_not_pop),
        cmocka_unit_test(a_patch_that_slides_adds_no_more_than_the_tolerance),
        cmocka_unit_test(patches_and_the_callers_statements_leave_each_other_alone),
        cmocka_unit_test(a_patch_that_overlaps_another_does_not_release_its_nodes),
        cmocka_unit_test(what_ends_leaves_nothing_behind),
        cmocka_unit_test(a_deadline_that_has_passed_leaves_a_valid_state),
        cmocka_unit_test(frames_that_are_too_short_meet_the_tolerance_in_the_end),
        cmocka_unit_test(a_solver_without_room_gets_as_close_as_it_can),
        cmocka_unit_test(files_without_the_finest_levels_press_with_what_they_have),
        cmocka_unit_test(refusals_have_no_effect),
        cmocka_unit_test(the_default_is_a_thousandth_of_the_body),
    };
    return cmocka_run_group_tests(tests, open_models, close_models);
}
