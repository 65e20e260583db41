// test_proxy.c: a proxy against deforming surfaces: never below them, smooth, and giving no energy.
#include "check.h"

#include "synthetic_model.h"
#include "triangle.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// ---- A model on disk, a solver, a proxy ----

typedef struct fixture {
    pliant_model *model;
    pliant_solver *solver;
    pliant_proxy *proxy;
    int32_t n, finest, face_count;
    pliant_vec3 *u;  // shape [n]
} fixture;

// Models that cases have in common; a model is const, and writing one takes a third of a second.
enum { model_limit = 16 };
static struct {
    int32_t levels;
    double eps;
    uint32_t level_mask;
    pliant_model *model;
} models[model_limit];

static pliant_model *open_model(int32_t levels, double eps, uint32_t level_mask)
{
    int32_t i = 0;
    for (; models[i].model; i++)
        if (models[i].levels == levels && models[i].eps == eps &&
            models[i].level_mask == level_mask)
            return models[i].model;
    assert_in_range(i, 0, model_limit - 2);
    pliant_error err = {""};
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_proxy_%d.h5", (int)getpid());
    check_synthetic *exact = check_synthetic_create(&(check_synthetic_def){
        levels, eps, pliant_wavelet_default(), CHECK_ALL_BLOCKS, level_mask});
    check_synthetic_write(exact, path);
    check_synthetic_destroy(exact);
    check_ok(pliant_model_open(path, &models[i].model, &err), &err);
    unlink(path);
    models[i].levels = levels;
    models[i].eps = eps;
    models[i].level_mask = level_mask;
    return models[i].model;
}

static int close_models(void **state)
{
    (void)state;
    for (int32_t i = 0; i < model_limit; i++) pliant_model_close(models[i].model);
    return 0;
}

static fixture set_up_levels(int32_t levels, double eps, uint32_t level_mask,
                             const pliant_proxy_def *def)
{
    fixture f = {.finest = levels, .model = open_model(levels, eps, level_mask)};
    pliant_error err = {""};
    pliant_solver_def solver = pliant_solver_default(f.model);
    solver.compliance = PLIANT_COMPLIANCE_PASSIVE;
    check_ok(pliant_solver_create(f.model, &solver, &f.solver, &err), &err);
    check_ok(pliant_proxy_create(f.solver, def, &f.proxy, &err), &err);
    f.n = pliant_model_describe(f.model).vertex_count;
    f.face_count = pliant_model_describe(f.model).face_count;
    f.u = calloc((size_t)f.n, sizeof *f.u);
    assert_non_null(f.u);
    return f;
}

static fixture set_up(int32_t levels, double eps, const pliant_proxy_def *def)
{
    return set_up_levels(levels, eps, 0, def);
}

static void tear_down(fixture *f)
{
    free(f->u);
    pliant_proxy_destroy(f->proxy);
    pliant_solver_destroy(f->solver);
}

static pliant_proxy_result step_to(fixture *f, double x, double y, double z)
{
    pliant_proxy_result result;
    const double device[3] = {x, y, z};
    const pliant_status status = pliant_proxy_step(f->proxy, device, PLIANT_NEVER, &result);
    assert_int_equal(status, PLIANT_OK);
    return result;
}

// From far outside straight to a place.
static pliant_proxy_result come_to(fixture *f, double x, double y, double z)
{
    const double far = 3 / sqrt(x * x + y * y + z * z), away[3] = {far * x, far * y, far * z};
    assert_int_equal(pliant_proxy_place(f->proxy, away), PLIANT_OK);
    return step_to(f, x, y, z);
}

// ---- The whole surface, by brute force ----

static void corners_of(const fixture *f, int32_t face, double corners[9])
{
    const double *rest = pliant_model_positions(f->model);
    const int32_t *vertices = pliant_model_faces(f->model, f->finest) + 3 * (size_t)face;
    for (int k = 0; k < 3; k++) {
        const pliant_vec3 u = f->u[vertices[k]];
        corners[3 * k] = rest[3 * vertices[k]] + (double)u.x;
        corners[3 * k + 1] = rest[3 * vertices[k] + 1] + (double)u.y;
        corners[3 * k + 2] = rest[3 * vertices[k] + 2] + (double)u.z;
    }
}

// Height over the deformed surface, of all faces: below 0 inside. The solver is asked first.
static double height_over(fixture *f, const double *point)
{
    double best = INFINITY, side = 0;
    assert_int_equal(pliant_solver_surface(f->solver, f->finest, f->u), PLIANT_OK);
    for (int32_t face = 0; face < f->face_count; face++) {
        double corners[9];
        corners_of(f, face, corners);
        const pliant_nearest nearest = pliant_triangle_nearest(corners, point);
        if (nearest.distance > best + 1e-12) continue;
        if (nearest.distance > best - 1e-12 && fabs(nearest.side) <= fabs(side)) continue;
        best = nearest.distance;
        side = nearest.side;
    }
    return side < 0 ? -best : best;
}

// Positions are doubles on displacements that are floats, up to 1.
static const double rounding = 4e-7;

static double norm(pliant_vec3 v)
{
    return sqrt((double)v.x * (double)v.x + (double)v.y * (double)v.y + (double)v.z * (double)v.z);
}

static double dot(pliant_vec3 a, pliant_vec3 b)
{
    return (double)a.x * (double)b.x + (double)a.y * (double)b.y + (double)a.z * (double)b.z;
}

// ---- Free space and contact ----

// 0.4 away: nothing need be looked at for 0.4 of way, and then the near parts of the surface.
static void in_free_space_the_proxy_is_the_device_and_next_to_nothing_is_evaluated(void **state)
{
    (void)state;
    fixture f = set_up(3, 0.05, NULL);
    (void)step_to(&f, 1.4, 0, 0.3);
    double evaluated = 0;
    for (int i = 0; i < 2000; i++) {
        const double t = 0.005 * i;
        const pliant_proxy_result r = step_to(&f, 1.4 * cos(t), 1.4 * sin(t), 0.3);
        assert_int_equal(r.face, -1);
        check_near(r.position[0], 1.4 * cos(t), 0);
        check_near(norm(r.force) + norm(r.normal) + r.depth + r.energy, 0, 0);
        if (i < 50) assert_int_equal(r.vertex_count, 0);
        evaluated += r.vertex_count;
    }
    printf("%.1f of %d vertices a step\n", evaluated / 2000, f.n);
    check_at_most(evaluated / 2000, 0.02 * f.n);
    tear_down(&f);
}

// The statics of the contact, against displacements that the solver is asked for otherwise: the
// proxy is on the surface that its force has dented, the force stands along the normal, and the
// coupling between proxy and device is k at a corner and softer by C - c in between.
static void the_force_is_what_dents_the_surface_under_the_proxy(void **state)
{
    (void)state;
    pliant_proxy_def def = {.stiffness = 2};
    fixture f = set_up(3, 0, &def);
    check_random random = check_random_seed(2);
    double softest = 0;
    for (int trial = 0; trial < 40; trial++) {
        const double a = 6.28 * check_random_next(&random), z = 0.9 * check_random_next(&random);
        const double r = 0.8 + 0.1 * check_random_next(&random), s = sqrt(1 - z * z);
        const pliant_proxy_result p = come_to(&f, r * s * cos(a), r * s * sin(a), r * z);
        assert_true(p.face >= 0);
        check_near(dot(p.force, p.normal), -norm(p.force), 1e-6 * norm(p.force));
        check_near(norm(p.normal), 1, 1e-6);

        const int32_t *corners = pliant_model_faces(f.model, f.finest) + 3 * (size_t)p.face;
        const double *rest = pliant_model_positions(f.model);
        pliant_vec3 u[3], traction[3];
        assert_int_equal(pliant_solver_displacements(f.solver, corners, 3, u), PLIANT_OK);
        assert_int_equal(pliant_solver_tractions(f.solver, corners, 3, traction), PLIANT_OK);
        double place[3] = {0}, force[3] = {0};
        for (int k = 0; k < 3; k++) {
            const double w = (double)p.weights[k];
            const float *uk = &u[k].x, *pk = &traction[k].x;
            for (int c = 0; c < 3; c++) {
                place[c] += w * (rest[3 * corners[k] + c] + (double)uk[c]);
                force[c] += pliant_model_area(f.model, corners[k]) * (double)pk[c];
                // Each corner takes its weight's part.
                check_near(pliant_model_area(f.model, corners[k]) * (double)pk[c],
                           w * (double)(&p.force.x)[c], 1e-6);
            }
        }
        const double device[3] = {r * s * cos(a), r * s * sin(a), r * z};
        double along = 0, across = 0, pull = 0;
        for (int c = 0; c < 3; c++) {
            check_near(place[c], p.position[c], rounding);
            check_near(force[c], (double)(&p.force.x)[c], 1e-6);
            along += (device[c] - p.position[c]) * (double)(&p.force.x)[c] / norm(p.force);
        }
        for (int c = 0; c < 3; c++) {
            pull = device[c] - p.position[c] - along * (double)(&p.force.x)[c] / norm(p.force);
            across += pull * pull;
        }
        // Between k and k in series with half of a hat's compliance, 1.4 to 1.7 m/N.
        const double give = along / norm(p.force);
        check_at_least(give, 0.5 * (1 - 1e-4));
        check_at_most(give, 0.5 + 1.1);
        softest = fmax(softest, give);
        // C - c differs a little by direction.
        check_at_most(sqrt(across), 0.1 * along);
    }
    check_at_least(softest, 0.5 + 0.3);

    // Right at a vertex it is k; this near to one C - c is at most 0.05.
    const double *x = pliant_model_positions(f.model) + 3 * 200;
    const pliant_proxy_result p = come_to(&f, 0.9 * x[0], 0.9 * x[1], 0.9 * x[2]);
    check_at_least(fmax((double)p.weights[0], fmax((double)p.weights[1], (double)p.weights[2])),
                   0.98);
    double stretch = 0;
    for (int c = 0; c < 3; c++) stretch += pow(p.position[c] - 0.9 * x[c], 2);
    check_near(sqrt(stretch), 0.525 * norm(p.force), 0.026 * norm(p.force));
    tear_down(&f);
}

// What a force on the body is, whatever level its hats are of: the tractions' integral.
static void the_body_gets_the_whole_force_on_coarse_hats_too(void **state)
{
    (void)state;
    for (int coarse = 0; coarse < 2; coarse++) {
        fixture f = set_up_levels(3, 0.05, coarse ? 2 : 0, NULL);
        pliant_vec3 *p = calloc((size_t)f.n, sizeof *p);
        assert_non_null(p);
        for (int i = 0; i < 20; i++) {
            const double a = 0.3 * i;
            const pliant_proxy_result r = come_to(&f, 0.7 * cos(a), 0.7 * sin(a), 0.5);
            assert_true(r.face >= 0);
            double sum[3] = {0};
            int32_t loaded = 0;
            assert_int_equal(pliant_solver_tractions(f.solver, NULL, f.n, p), PLIANT_OK);
            for (int32_t v = 0; v < f.n; v++) {
                if (pliant_model_is_free(f.model, v) != 1) continue;
                loaded += norm(p[v]) > 0;
                for (int c = 0; c < 3; c++)
                    sum[c] += pliant_model_area(f.model, v) * (double)(&p[v].x)[c];
            }
            for (int c = 0; c < 3; c++) check_near(sum[c], (double)(&r.force.x)[c], 1e-6);
            if (coarse) check_at_least(loaded, 10);
            else check_at_most(loaded, 3);
            check_near(height_over(&f, r.position), 0, rounding);
        }
        free(p);
        tear_down(&f);
    }
}

// ---- Never below ----

// A patch of vertices that goes in and out while the device darts about. In free space the proxy
// is the device, and then that is outside; in contact it is on the surface.
static void the_proxy_never_ends_below_the_surface(void **state)
{
    (void)state;
    fixture f = set_up(3, 0.05, NULL);
    check_random random = check_random_seed(4);
    const double *rest = pliant_model_positions(f.model);
    int32_t touching = 0, freed = 0, was_touching = 0, swallowed = 0;
    double device[3] = {1.3, 0, 0.3}, target[3] = {0};
    for (int step = 0; step < 1000; step++) {
        if (step % 40 == 0)
            for (int c = 0; c < 3; c++) target[c] = 2.6 * check_random_next(&random) - 1.3;
        // Mostly at a hand's pace, now and then in one leap.
        const double pace = step % 97 == 0 ? 1 : 0.06;
        double before[3];
        memcpy(before, device, sizeof before);
        for (int c = 0; c < 3; c++) device[c] += pace * (target[c] - device[c]);
        if (step % 200 == 0) pliant_solver_release_all(f.solver);
        const double push = 0.2 * sin(0.05 * step);
        for (int32_t v = 0; v < f.n; v++) {
            const double *x = rest + 3 * (size_t)v;
            if (pow(x[0] - 0.8, 2) + x[1] * x[1] + pow(x[2] - 0.6, 2) > 0.06) continue;
            assert_int_equal(
                pliant_solver_displace(f.solver, (pliant_node){3, v},
                                       (pliant_vec3){(float)(0.8 * push), 0, (float)(0.6 * push)}),
                PLIANT_OK);
        }
        const pliant_proxy_result r = step_to(&f, device[0], device[1], device[2]);
        const double height = height_over(&f, r.position);
        if (r.face < 0) {
            check_at_least(height, -rounding);
            for (int c = 0; c < 3; c++) check_near(r.position[c], device[c], 0);
            freed += was_touching;
        } else {
            check_near(height, 0, rounding);
            // Not held without need: the device is under the surface, even where its force dents
            // it.
            check_at_most(height_over(&f, device), rounding);
            touching++;
            swallowed += !was_touching && memcmp(before, device, sizeof before) == 0;
        }
        was_touching = r.face >= 0;
    }
    printf("in contact in %d of 1000 steps, lifted off %d times\n", touching, freed);
    check_at_least(touching, 200);
    check_at_least(freed, 10);
    tear_down(&f);
}

// The whole surface jumps about under its weight while the device hovers near: much of it goes over
// the device and back in a step, and which side that is on only the nearest face of all tells.
static void a_surface_that_jumps_holds_the_proxy_only_where_it_is_over_the_device(void **state)
{
    (void)state;
    fixture f = set_up(2, 0.05, NULL);
    check_random random = check_random_seed(10);
    pliant_vec3 u;
    const int32_t tip = pliant_model_nearest(f.model, (const double[3]){0, 0, 1});
    assert_int_equal(pliant_solver_gravity(f.solver, (pliant_vec3){1, 0, 0}), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_displacements(f.solver, &tip, 1, &u), PLIANT_OK);
    const double weight = 0.15 / (double)u.x;
    int32_t touching = 0;
    for (int step = 0; step < 1500; step++) {
        pliant_vec3 g;
        for (int c = 0; c < 3; c++)
            (&g.x)[c] = (float)(weight * (2 * check_random_next(&random) - 1));
        if (step % 3 == 0) assert_int_equal(pliant_solver_gravity(f.solver, g), PLIANT_OK);
        const double a = 0.002 * step, r = 1.02 + 0.1 * sin(0.05 * step),
                     z = 0.5 * sin(0.01 * step);
        const double s = sqrt(1 - z * z), device[3] = {r * s * cos(a), r * s * sin(a), r * z};
        const pliant_proxy_result result = step_to(&f, device[0], device[1], device[2]);
        const double height = height_over(&f, result.position);
        if (result.face < 0) {
            check_at_least(height, -rounding);
        } else {
            check_near(height, 0, rounding);
            check_at_most(height_over(&f, device), rounding);
            touching++;
        }
    }
    check_at_least(touching, 250);
    check_at_most(touching, 1250);
    tear_down(&f);
}

static void a_leap_through_the_body_ends_where_it_met_the_surface(void **state)
{
    (void)state;
    // Rough, so that the proxy does not slide around to where it would have come out.
    pliant_proxy_def def = {.stiffness = 0.2, .friction = 10};
    fixture f = set_up(3, 0.05, &def);
    for (int i = 0; i < 12; i++) {
        const double a = 0.5 * i, x = cos(a), y = sin(a);
        const double from[3] = {2 * x, 2 * y, 0.1};
        assert_int_equal(pliant_proxy_place(f.proxy, from), PLIANT_OK);
        const pliant_proxy_result out = step_to(&f, 1.5 * x, 1.5 * y, 0.1);
        assert_int_equal(out.face, -1);
        // In one step to the other side of the body, and beyond: it is held on this side.
        const pliant_proxy_result r = step_to(&f, -1.2 * x, -1.2 * y, 0.1);
        assert_true(r.face >= 0);
        check_near(height_over(&f, r.position), 0, rounding);
        check_at_least(r.position[0] * x + r.position[1] * y, 0.2);
    }
    tear_down(&f);
}

// Out by 0.2 and back, twice past the device: a vertex that is displaced, or the whole surface
// under its own weight.
static void a_surface_that_comes_over_a_resting_device_takes_the_proxy_along(void **state)
{
    (void)state;
    for (int heavy = 0; heavy < 2; heavy++) {
        fixture f = set_up(3, 0.05, NULL);
        const double *rest = pliant_model_positions(f.model);
        const int32_t tip = pliant_model_nearest(f.model, (const double[3]){1, 0, 0.2});
        const double *x = rest + 3 * (size_t)tip;
        const double device[3] = {1.05 * x[0], 1.05 * x[1], 1.05 * x[2]};
        pliant_vec3 u;
        assert_int_equal(pliant_solver_gravity(f.solver, (pliant_vec3){1, 0, 0}), PLIANT_OK);
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        assert_int_equal(pliant_solver_displacements(f.solver, &tip, 1, &u), PLIANT_OK);
        const float weight = 0.2f / u.x;
        pliant_solver_release_all(f.solver);
        int32_t touching = 0;
        for (int step = 0; step <= 40; step++) {
            const float out = (float)(0.2 * sin(3.14159265 * step / 40));
            const pliant_vec3 to = {out * (float)x[0], out * (float)x[1], out * (float)x[2]};
            if (heavy)
                assert_int_equal(
                    pliant_solver_gravity(f.solver, (pliant_vec3){weight * out / 0.2f, 0, 0}),
                    PLIANT_OK);
            else
                assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){3, tip}, to),
                                 PLIANT_OK);
            const pliant_proxy_result r = step_to(&f, device[0], device[1], device[2]);
            check_at_least(height_over(&f, r.position), -rounding);
            touching += r.face >= 0;
            if (out > 0.06f) assert_true(r.face >= 0);
        }
        assert_in_range(touching, 20, 38);
        tear_down(&f);
    }
}

// The held vertices moved by 0.7 all together carry the whole body along, far from its boxes at
// rest.
static void a_body_that_was_carried_off_is_found_where_it_is(void **state)
{
    (void)state;
    fixture f = set_up(3, 0, NULL);
    const pliant_proxy_result here = come_to(&f, 0.1, 0.85, 0.2);
    for (int32_t v = 0; v < f.n; v++)
        if (pliant_model_is_free(f.model, v) == 0)
            assert_int_equal(
                pliant_solver_support(f.solver, (pliant_node){3, v}, (pliant_vec3){0, 0.7f, 0}),
                PLIANT_OK);
    const double away[3] = {0.1, 3, 0.2};
    assert_int_equal(pliant_proxy_place(f.proxy, away), PLIANT_OK);
    pliant_proxy_result there = step_to(&f, 0.1, 2.5, 0.2);
    for (int i = 1; i <= 10; i++) {
        if (i < 8) assert_int_equal(there.face, -1);
        there = step_to(&f, 0.1, 2.5 - 0.095 * i, 0.2);
        check_at_least(height_over(&f, there.position), -rounding);
    }
    assert_true(there.face >= 0);
    // As on the body at rest, but that pressing step by step costs a percent.
    for (int c = 0; c < 3; c++)
        check_near((double)(&there.force.x)[c], (double)(&here.force.x)[c],
                   1e-2 * norm(here.force));
    tear_down(&f);
}

static void a_proxy_that_begins_inside_is_put_on_the_nearest_surface(void **state)
{
    (void)state;
    fixture f = set_up(3, 0.05, NULL);
    const pliant_proxy_result r = step_to(&f, 0.1, 0.2, 0.8);
    assert_true(r.face >= 0);
    check_near(height_over(&f, r.position), 0, rounding);
    check_at_least(r.position[2], 0.7);
    tear_down(&f);
}

// ---- Smoothness and energy ----

typedef struct path {
    double height, tilt, deep, wave, phase;
    int32_t laps, steps;  // steps a lap
    int backwards;
} path;

typedef struct ride {
    double work;    // that the device put in, J
    double least;   // of that, at the end of any lap, from its beginning
    double stored;  // largest energy
    double jump;    // largest change of the force in a step
    double force;   // largest
    double brake;   // largest
    int32_t faces;  // that were entered
} ride;

// Round the z axis under the surface, closed, in contact all the while.
static ride ride_along(fixture *f, const path *p)
{
    ride r = {0};
    double before[3] = {0}, device[3], lap_work = 0;
    pliant_vec3 force = {0, 0, 0};
    int32_t last = -1;
    r.least = INFINITY;
    for (int32_t i = -200; i <= p->laps * p->steps; i++) {
        // Down to the path first.
        const double t = 6.283185307179586 * fmax(i, 0) / p->steps * (p->backwards ? -1 : 1);
        const double depth =
            p->deep * (1 + p->wave * sin(p->phase * t)) * fmin(1, (i + 200) / 200.0);
        const double z = p->height + p->tilt * sin(t), s = sqrt(1 - z * z), radius = 1.01 - depth;
        device[0] = radius * s * cos(t), device[1] = radius * s * sin(t), device[2] = radius * z;
        const pliant_proxy_result now = step_to(f, device[0], device[1], device[2]);
        double work = 0, change = 0;
        for (int c = 0; c < 3; c++) {
            const double f0 = (double)(&force.x)[c], f1 = (double)(&now.force.x)[c];
            work += 0.5 * (f0 + f1) * (device[c] - before[c]);
            change += (f1 - f0) * (f1 - f0);
        }
        if (i > 0) {
            assert_true(now.face >= 0);
            lap_work += work;
            r.work += work;
            r.jump = fmax(r.jump, sqrt(change));
            r.stored = fmax(r.stored, now.energy);
            r.force = fmax(r.force, norm(now.force));
            r.brake = fmax(r.brake, now.brake);
            r.faces += now.face != last;
            last = now.face;
            if (i % p->steps == 0) r.least = fmin(r.least, lap_work), lap_work = 0;
        }
        memcpy(before, device, sizeof before);
        force = now.force;
    }
    return r;
}

// Small steps over many faces: the force follows at the rate of the springs, whatever edges the
// proxy crosses. At rest it is K |dh| along the normal and what the normal turns by, f |dh| / R,
// together within twice K |dh|; the dihedral angle of 8 degrees would turn f = 0.06 by 0.008.
static void the_force_is_continuous_while_the_proxy_slides_over_edges(void **state)
{
    (void)state;
    fixture f = set_up(3, 0.05, NULL);
    double jump[2];
    for (int finer = 0; finer < 2; finer++) {
        const path p = {.height = 0.3,
                        .tilt = 0.2,
                        .deep = 0.15,
                        .wave = 0.3,
                        .phase = 3,
                        .laps = 1,
                        .steps = finer ? 16000 : 4000};
        const ride r = ride_along(&f, &p);
        printf("largest change of the force in a step: %.3g of %.3g, %d faces\n", r.jump, r.force,
               r.faces);
        check_at_least(r.faces, 40);
        jump[finer] = r.jump;
    }
    const double stiffness = 1 / (1.4 + 1 / pliant_proxy_default(f.model).stiffness);
    check_at_most(jump[0], 2 * stiffness * 6.3 / 4000);
    // In proportion to the step: quarter steps, quarter jumps.
    check_at_most(jump[1], 0.3 * jump[0]);
    tear_down(&f);
}

// A strongly compressed model, pressed on every which way: no lap takes energy out of it. The
// trapezoidal sums of test and proxy agree but for the brake, which acts a step late.
static void no_closed_path_gains_energy(void **state)
{
    (void)state;
    pliant_proxy_def def = {.stiffness = 50};
    fixture f = set_up(3, 0.2, &def);
    // Something held, too.
    for (int32_t v = 0; v < 12; v++)
        if (pliant_model_is_free(f.model, v) == 1)
            assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){3, v},
                                                    (pliant_vec3){0.02f, 0, -0.03f}),
                             PLIANT_OK);
    check_random random = check_random_seed(6);
    double worst = 0;
    for (int trial = 0; trial < 8; trial++) {
        const path p = {.height = 0.1 + 0.5 * check_random_next(&random),
                        .tilt = 0.3 * check_random_next(&random),
                        .deep = 0.12,
                        .wave = 0.6 * check_random_next(&random),
                        .phase = floor(1 + 30 * check_random_next(&random)),
                        .laps = 3,
                        .steps = 800,
                        .backwards = trial % 2};
        const ride r = ride_along(&f, &p);
        worst = fmin(worst, r.least / r.stored);
        check_at_least(r.least, -2e-3 * r.stored);
    }
    printf("the least that a lap took: %.2g of what was stored\n", worst);
    tear_down(&f);
}

// A normal map that leans the same way all around would drive the device round for ever.
static void a_normal_map_turns_the_force_but_drives_nothing(void **state)
{
    (void)state;
    fixture plain = set_up(3, 0.05, NULL);
    const double *x = pliant_model_positions(plain.model);
    float *normals = calloc(3 * (size_t)plain.n, sizeof *normals);
    assert_non_null(normals);
    const double lean = 0.2;
    for (int32_t v = 0; v < plain.n; v++) {
        normals[3 * v] = (float)(3 * (x[3 * v] - lean * x[3 * v + 1]));
        normals[3 * v + 1] = (float)(3 * (x[3 * v + 1] + lean * x[3 * v]));
        normals[3 * v + 2] = (float)(3 * x[3 * v + 2]);
    }
    pliant_proxy_def def = pliant_proxy_default(plain.model);
    def.normals = normals;
    fixture f = set_up(3, 0.05, &def);
    free(normals);
    const pliant_proxy_result straight = come_to(&plain, 0.85, 0, 0.1);
    const pliant_proxy_result leaning = come_to(&f, 0.85, 0, 0.1);
    check_near((double)straight.force.y / norm(straight.force), 0, 0.02);
    // There and, since that drags the proxy along, a little further on.
    check_near((double)leaning.force.y / norm(leaning.force), -lean - 0.02, 0.02);

    path p = {.height = 0.1, .deep = 0.12, .laps = 4, .steps = 1000};
    for (p.backwards = 0; p.backwards < 2; p.backwards++) {
        const ride r = ride_along(&f, &p);
        printf("%s the lean: least work in a lap %.3g, stored %.3g, brake up to %.3g of %.3g\n",
               p.backwards ? "against" : "with", r.least, r.stored, r.brake, r.force);
        // Unbraked a lap gives or takes lean f 2 pi 0.9.
        const double drive = lean * r.force * 5.6;
        check_at_least(r.least, -5e-3 * drive);
        if (p.backwards) check_at_least(r.work, 3 * drive);
        else check_near(r.work, 0, 5e-3 * 4 * drive);
    }
    tear_down(&f);
    tear_down(&plain);
}

static void friction_holds_the_proxy_and_takes_energy(void **state)
{
    (void)state;
    pliant_proxy_def def = {.stiffness = 2, .friction = 0.4};
    fixture f = set_up(3, 0.05, &def);
    pliant_proxy_result r = come_to(&f, 0.9, 0, 0.1);
    const double begin = r.position[1];
    for (int i = 1; i <= 60; i++) {
        r = step_to(&f, 0.9, 0.005 * i, 0.1);
        pliant_vec3 across = r.force;
        const double press = -dot(r.force, r.normal);
        for (int c = 0; c < 3; c++) (&across.x)[c] += (float)press * (&r.normal.x)[c];
        // While the surplus is not there yet the brake adds some percent.
        check_at_most(norm(across), 0.41 * press);
        if (r.is_sliding) check_at_least(norm(across), 0.4 * press * (1 - 1e-2));
        assert_int_equal(r.is_sliding, i > 6);
    }
    check_at_least(r.position[1], begin + 0.1);
    const path p = {.height = 0.1, .deep = 0.12, .laps = 1, .steps = 1000};
    const ride around = ride_along(&f, &p);
    // mu f times the way.
    check_near(around.work, 0.4 * around.force * 5.6, 0.4 * around.work);
    tear_down(&f);
}

// ---- Company ----

static void statements_about_touched_vertices_hold_beside_the_proxy(void **state)
{
    (void)state;
    fixture f = set_up_levels(3, 0.05, 8 | 2, NULL);
    const pliant_proxy_result first = come_to(&f, 0.9, 0, 0.1);
    const int32_t *faces = pliant_model_faces(f.model, 3);
    int32_t corners[3], coarse = -1;
    memcpy(corners, faces + 3 * (size_t)first.face, sizeof corners);
    for (int k = 0; k < 3; k++)
        if (corners[k] < pliant_model_level_vertex_count(f.model, 1)) coarse = corners[k];
    const pliant_vec3 p = {-0.02f, 0.01f, 0};
    for (int k = 0; k < 3; k++)
        assert_int_equal(pliant_solver_press(
                             f.solver, (pliant_node){corners[k] == coarse ? 1 : 3, corners[k]}, p),
                         PLIANT_OK);
    const pliant_proxy_result pressed = step_to(&f, 0.9, 0, 0.1);
    assert_true(pressed.face >= 0);
    pliant_vec3 with[3], without[3];
    assert_int_equal(pliant_solver_tractions(f.solver, corners, 3, with), PLIANT_OK);
    (void)step_to(&f, 1.5, 0, 0.1);
    assert_int_equal(pliant_solver_tractions(f.solver, corners, 3, without), PLIANT_OK);
    double force = 0;
    for (int k = 0; k < 3; k++) {
        check_at_least(norm(without[k]), norm(p) * 0.99);
        force += pliant_model_area(f.model, corners[k]) * (double)(with[k].x - without[k].x);
    }
    if (pressed.face == first.face) check_near(force, (double)pressed.force.x, 1e-6);

    // A held corner does not give way: right over it the coupling alone does, and stays in S.
    pliant_solver_release_all(f.solver);
    assert_int_equal(
        pliant_solver_displace(f.solver, (pliant_node){3, corners[0]}, (pliant_vec3){0, 0, 0}),
        PLIANT_OK);
    const double *x = pliant_model_positions(f.model) + 3 * (size_t)corners[0];
    const pliant_proxy_result held = come_to(&f, 0.9 * x[0], 0.9 * x[1], 0.9 * x[2]);
    check_near(norm(held.force), 0.1 * pliant_proxy_default(f.model).stiffness,
               2e-2 * norm(held.force));
    assert_int_equal(pliant_solver_last(f.solver).constraint_count, 1);
    tear_down(&f);
}

// A deadline that nothing meets: constraints on coarser levels, and a contact that holds all the
// same.
static void a_late_step_is_told_and_stays_on_the_surface(void **state)
{
    (void)state;
    fixture f = set_up_levels(3, 0.05, 8 | 4 | 2 | 1, NULL);
    for (int32_t v = 0, count = 0; count < 60; v++) {
        if (pliant_model_is_free(f.model, v) != 1) continue;
        assert_int_equal(
            pliant_solver_displace(f.solver, (pliant_node){3, v}, (pliant_vec3){0, 0, 0.01f}),
            PLIANT_OK);
        count++;
    }
    const double far[3] = {2, 0, 0.1};
    pliant_proxy_result r;
    assert_int_equal(pliant_proxy_place(f.proxy, far), PLIANT_OK);
    assert_int_equal(pliant_proxy_step(f.proxy, far, pliant_clock_ns(), &r), PLIANT_LATE);
    for (int i = 0; i < 20; i++) {
        const double device[3] = {0.9, 0.01 * i, 0.1};
        assert_int_equal(pliant_proxy_step(f.proxy, device, pliant_clock_ns(), &r), PLIANT_LATE);
        assert_true(r.face >= 0);
        check_near(height_over(&f, r.position), 0, rounding);
        check_at_least(norm(r.force), 0.01);
    }
    check_at_most(pliant_solver_last(f.solver).constraint_count, 59);
    // In time again.
    assert_int_equal(pliant_proxy_step(f.proxy, far, PLIANT_NEVER, &r), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).constraint_count, 60);
    tear_down(&f);
}

static void several_proxies_press_side_by_side(void **state)
{
    (void)state;
    fixture f = set_up(3, 0.05, NULL);
    pliant_proxy *others[8] = {NULL};
    pliant_error err = {""};
    for (int i = 0; i < 7; i++)
        check_ok(pliant_proxy_create(f.solver, NULL, &others[i], &err), &err);
    pliant_proxy_result alone = come_to(&f, 0.9, 0, 0.1), r;
    double last = 0;
    for (int round = 0; round < 30; round++)
        for (int i = 0; i < 7; i++) {
            const double a = 0.7 * (i + 1), far[3] = {2 * cos(a), 2 * sin(a), 0.2};
            const double near[3] = {0.88 * cos(a), 0.88 * sin(a), 0.2};
            assert_int_equal(
                pliant_proxy_step(others[i], round == 0 ? far : near, PLIANT_NEVER, &r), PLIANT_OK);
            assert_int_equal(r.face >= 0, round > 0);
        }
    // They move the surface for each other, so that the first now presses otherwise.
    pliant_proxy_result crowded = {0};
    for (int i = 0; i < 5; i++) {
        crowded = step_to(&f, 0.9, 0, 0.1);
        last = norm(crowded.force);
    }
    check_at_least(fabs(last - norm(alone.force)), 0.01 * norm(alone.force));
    for (int i = 0; i < 7; i++) pliant_proxy_destroy(others[i]);
    // They are gone with the next solve.
    crowded = step_to(&f, 0.9, 0, 0.1);
    crowded = step_to(&f, 0.9, 0, 0.1);
    check_near(norm(crowded.force), norm(alone.force), 1e-5 * norm(alone.force));
    tear_down(&f);
}

static void what_makes_no_sense_is_refused(void **state)
{
    (void)state;
    fixture f = set_up(2, 0.05, NULL);
    pliant_proxy *proxy = NULL;
    pliant_error err = {""};
    pliant_proxy_def def = pliant_proxy_default(f.model);
    const double bad[] = {0, -1, NAN, INFINITY};
    for (int i = 0; i < 4; i++) {
        def.stiffness = bad[i];
        assert_int_equal(pliant_proxy_create(f.solver, &def, &proxy, &err), PLIANT_ERR_ARGUMENT);
    }
    def = pliant_proxy_default(f.model);
    def.friction = -0.1;
    assert_int_equal(pliant_proxy_create(f.solver, &def, &proxy, &err), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "friction"));
    def.friction = 0;
    float *normals = calloc(3 * (size_t)f.n, sizeof *normals);
    assert_non_null(normals);
    for (int32_t v = 0; v < 3 * f.n; v++) normals[v] = (float)pliant_model_positions(f.model)[v];
    normals[3 * 17] = -normals[3 * 17], normals[3 * 17 + 1] = -normals[3 * 17 + 1];
    normals[3 * 17 + 2] = -normals[3 * 17 + 2];
    def.normals = normals;
    assert_int_equal(pliant_proxy_create(f.solver, &def, &proxy, &err), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "vertex 17"));
    free(normals);
    assert_null(proxy);

    pliant_proxy_result before = come_to(&f, 0.9, 0, 0.1), after;
    const double nowhere[3] = {0, NAN, 0};
    assert_int_equal(pliant_proxy_step(f.proxy, nowhere, PLIANT_NEVER, &after),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_proxy_place(f.proxy, nowhere), PLIANT_ERR_ARGUMENT);
    after = step_to(&f, 0.9, 0, 0.1);
    check_near((double)after.force.x, (double)before.force.x, 1e-7);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(in_free_space_the_proxy_is_the_device_and_next_to_nothing_is_evaluated),
        cmocka_unit_test(the_force_is_what_dents_the_surface_under_the_proxy),
        cmocka_unit_test(the_body_gets_the_whole_force_on_coarse_hats_too),
        cmocka_unit_test(the_proxy_never_ends_below_the_surface),
        cmocka_unit_test(a_surface_that_jumps_holds_the_proxy_only_where_it_is_over_the_device),
        cmocka_unit_test(a_leap_through_the_body_ends_where_it_met_the_surface),
        cmocka_unit_test(a_surface_that_comes_over_a_resting_device_takes_the_proxy_along),
        cmocka_unit_test(a_body_that_was_carried_off_is_found_where_it_is),
        cmocka_unit_test(a_proxy_that_begins_inside_is_put_on_the_nearest_surface),
        cmocka_unit_test(the_force_is_continuous_while_the_proxy_slides_over_edges),
        cmocka_unit_test(no_closed_path_gains_energy),
        cmocka_unit_test(a_normal_map_turns_the_force_but_drives_nothing),
        cmocka_unit_test(friction_holds_the_proxy_and_takes_energy),
        cmocka_unit_test(statements_about_touched_vertices_hold_beside_the_proxy),
        cmocka_unit_test(a_late_step_is_told_and_stays_on_the_surface),
        cmocka_unit_test(several_proxies_press_side_by_side),
        cmocka_unit_test(what_makes_no_sense_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, close_models);
}
