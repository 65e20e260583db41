// test_contact.c: rigid tools on models with known Green's functions.
//
// The body is the unit sphere, held where z < -0.6 (synthetic_model.h), 642 vertices some 0.14
// apart on four levels, of which nothing was thresholded unless a case says so.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { depth_levels = 3, vertex_count = 642 };

// ---- The model, solvers and contacts on it ----

typedef struct fixture {
    const check_synthetic *exact;
    pliant_model *model;
    pliant_solver *solver;
    pliant_contact *contact;
} fixture;

static check_synthetic *exact_model;

static check_synthetic *make_model(double eps)
{
    return check_synthetic_create(&(check_synthetic_def){.levels = depth_levels,
                                                         .eps = eps,
                                                         .wavelet = pliant_wavelet_default(),
                                                         .blocks = CHECK_ALL_BLOCKS,
                                                         .level_mask = 15});
}

static int make_exact_model(void **state)
{
    (void)state;
    exact_model = make_model(0);
    return 0;
}

static int destroy_exact_model(void **state)
{
    (void)state;
    check_synthetic_destroy(exact_model);
    return 0;
}

static fixture open_model(const check_synthetic *synthetic)
{
    fixture f = {.exact = synthetic};
    char path[64];
    pliant_error err = {""};
    snprintf(path, sizeof path, "/tmp/pliant_test_contact_%d.h5", (int)getpid());
    check_synthetic_write(synthetic, path);
    check_ok(pliant_model_open(path, &f.model, &err), &err);
    unlink(path);
    pliant_solver_def def = pliant_solver_default(f.model);
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    check_ok(pliant_solver_create(f.model, &def, &f.solver, &err), &err);
    return f;
}

// A contact on levels coarsest .. finest.
static void begin_contact(fixture *f, double tolerance, int32_t coarsest, int32_t fade_count)
{
    pliant_error err = {""};
    pliant_contact_def def = pliant_contact_default(f->solver);
    def.tolerance = tolerance;
    def.coarsest_level = coarsest;
    def.fade_count = fade_count;
    check_ok(pliant_contact_create(f->solver, &def, &f->contact, &err), &err);
}

static fixture set_up(double tolerance, int32_t coarsest, int32_t fade_count)
{
    fixture f = open_model(exact_model);
    begin_contact(&f, tolerance, coarsest, fade_count);
    return f;
}

static void tear_down(fixture *f)
{
    pliant_contact_destroy(f->contact);
    pliant_solver_destroy(f->solver);
    pliant_model_close(f->model);
}

static pliant_status solve_with(fixture *f, int32_t index, pliant_tool tool)
{
    assert_int_equal(pliant_contact_set_tool(f->contact, index, &tool), PLIANT_OK);
    return pliant_contact_solve(f->contact, PLIANT_NEVER);
}

// ---- Vectors, tools, surfaces ----

typedef struct vector {
    double x, y, z;
} vector;

static vector widen(pliant_vec3 v)
{
    return (vector){(double)v.x, (double)v.y, (double)v.z};
}

static vector minus(vector a, vector b)
{
    return (vector){a.x - b.x, a.y - b.y, a.z - b.z};
}

static double dot(vector a, vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static double length(vector a)
{
    return sqrt(dot(a, a));
}

// A ball that touches the body's top, pressed in by `depth`, `angle` down to the side.
static pliant_tool ball_at(double radius, double depth, double angle, double friction)
{
    const double distance = 1 + radius - depth;
    return (pliant_tool){.kind = PLIANT_TOOL_SPHERE,
                         .a = {(float)(distance * sin(angle)), 0, (float)(distance * cos(angle))},
                         .radius = (float)radius,
                         .friction = (float)friction};
}

static pliant_tool plane_above(double depth, double shift, double friction)
{
    return (pliant_tool){.kind = PLIANT_TOOL_PLANE,
                         .a = {(float)shift, 0, (float)(1 - depth)},
                         .b = {0, 0, -2},
                         .friction = (float)friction};
}

// Written anew here, on purpose.
static double distance_to(const pliant_tool *tool, vector x)
{
    const vector a = widen(tool->a), b = widen(tool->b);
    if (tool->kind == PLIANT_TOOL_PLANE) return dot(minus(x, a), b) / length(b);
    double part = 0;
    const vector along = minus(b, a);
    if (tool->kind == PLIANT_TOOL_CAPSULE && dot(along, along) > 0)
        part = fmin(fmax(dot(minus(x, a), along) / dot(along, along), 0), 1);
    const vector nearest = {a.x + part * along.x, a.y + part * along.y, a.z + part * along.z};
    return length(minus(x, nearest)) - (double)tool->radius;
}

static void get_surface(const fixture *f, pliant_vec3 *u)
{
    assert_int_equal(pliant_solver_surface(f->solver, depth_levels, u), PLIANT_OK);
}

static vector place(const fixture *f, const pliant_vec3 *u, int32_t v)
{
    const double *x = pliant_model_positions(f->model) + 3 * (size_t)v;
    return (vector){x[0] + (double)u[v].x, x[1] + (double)u[v].y, x[2] + (double)u[v].z};
}

// The deepest free vertex inside a tool, of the whole surface.
static double deepest(const fixture *f, const pliant_tool *tool)
{
    static pliant_vec3 u[vertex_count];
    double depth = 0;
    get_surface(f, u);
    for (int32_t v = 0; v < vertex_count; v++)
        if (pliant_model_is_free(f->model, v) == 1)
            depth = fmax(depth, -distance_to(tool, place(f, u, v)));
    return depth;
}

// No force pulls, all are in their cones, and sum up to the results.
static void check_forces(const fixture *f, const pliant_tool *tools, int32_t tool_count)
{
    const pliant_contact_report report = pliant_contact_last(f->contact);
    vector sum[4] = {{0}}, torque[4] = {{0}};
    int32_t count[4] = {0};
    static pliant_vec3 u[vertex_count];
    get_surface(f, u);
    for (int32_t i = 0; i < report.node_count; i++) {
        const pliant_contact_node node = pliant_contact_get(f->contact, i);
        assert_in_range(node.tool, 0, tool_count - 1);
        assert_int_equal(pliant_model_is_free(f->model, node.node.vertex), 1);
        const vector force = widen(node.force), normal = widen(node.normal);
        const double pushed = dot(force, normal);
        check_at_least(pushed, 0);
        check_near(length(normal), 1, 1e-6);
        const vector sideways = {force.x - pushed * normal.x, force.y - pushed * normal.y,
                                 force.z - pushed * normal.z};
        const double friction = (double)tools[node.tool].friction;
        check_at_most(length(sideways), friction * pushed + 1e-5 * pushed);
        if (node.is_sliding) check_near(length(sideways), friction * pushed, 2e-3 * pushed);
        const vector x = place(f, u, node.node.vertex), arm = minus(x, widen(tools[node.tool].a));
        check_near(distance_to(&tools[node.tool], x), (double)node.gap, 1e-5);
        sum[node.tool].x += force.x, sum[node.tool].y += force.y, sum[node.tool].z += force.z;
        torque[node.tool].x += arm.y * force.z - arm.z * force.y;
        torque[node.tool].y += arm.z * force.x - arm.x * force.z;
        torque[node.tool].z += arm.x * force.y - arm.y * force.x;
        count[node.tool]++;
    }
    for (int32_t t = 0; t < tool_count; t++) {
        const pliant_tool_result result = pliant_contact_tool(f->contact, t);
        assert_int_equal(result.node_count, count[t]);
        const double scale = length(sum[t]) + 1e-6;
        check_near(length(minus(widen(result.force), sum[t])) / scale, 0, 1e-5);
        check_near(length(minus(widen(result.torque), torque[t])) / scale, 0, 1e-4);
        check_near((double)result.penetration, deepest(f, &tools[t]), 1e-5);
    }
}

// ---- Without friction ----

static void a_tool_that_does_not_touch_does_nothing(void **state)
{
    (void)state;
    fixture f = set_up(0.004, 0, 16);
    static pliant_vec3 u[vertex_count];
    assert_int_equal(pliant_contact_solve(f.contact, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(solve_with(&f, 0, ball_at(0.5, -0.1, 0.3, 0)), PLIANT_OK);
    get_surface(&f, u);
    for (int32_t v = 0; v < vertex_count; v++) assert_true(length(widen(u[v])) == 0);
    const pliant_contact_report report = pliant_contact_last(f.contact);
    assert_int_equal(report.node_count, 0);
    assert_int_equal(report.coarsest_level, -1);
    assert_true(report.is_met);
    tear_down(&f);
}

// Projected Gauss-Seidel with the exact Green's functions, every free vertex a contact; normals by
// repetition. Forces to `force`, shape [m][3]; displacements to u, shape [n].
static void solve_reference(const check_synthetic *exact, const pliant_tool *tool, double *force,
                            vector *u)
{
    const int32_t m = exact->counts[0];
    const size_t width = 3 * (size_t)m;
    double *lambda = calloc((size_t)m, sizeof *lambda);
    vector *normal = calloc((size_t)m, sizeof *normal);
    assert_true(lambda && normal);
    memset(u, 0, vertex_count * sizeof *u);
    for (int outer = 0; outer < 12; outer++) {
        double gap0[vertex_count];
        for (int32_t i = 0; i < m; i++) {
            const int32_t v = exact->nodes[0][i];
            const double *rest = exact->surface.mesh->vertices + 3 * (size_t)v;
            const vector x = {rest[0] + u[v].x, rest[1] + u[v].y, rest[2] + u[v].z};
            const vector away = minus(x, widen(tool->a));
            const double r = length(away);
            normal[i] = tool->kind == PLIANT_TOOL_PLANE
                            ? (vector){0, 0, -1}
                            : (vector){away.x / r, away.y / r, away.z / r};
            // Linear about here; the displacement's own part comes back with lambda.
            gap0[i] = distance_to(tool, x) - dot(normal[i], u[v]);
        }
        for (int sweep = 0; sweep < 400; sweep++) {
            double change = 0;
            for (int32_t i = 0; i < m; i++) {
                if (gap0[i] > 0.2) continue;
                double gap = gap0[i], own = 0;
                for (int32_t j = 0; j < m; j++) {
                    if (lambda[j] == 0 && j != i) continue;
                    const double area = exact->surface.areas[exact->nodes[0][j]];
                    const double *block =
                        exact->xi[PLIANT_FREE_FREE] + 3 * (size_t)i * width + 3 * (size_t)j;
                    const double n[3] = {normal[i].x, normal[i].y, normal[i].z};
                    const double q[3] = {normal[j].x, normal[j].y, normal[j].z};
                    double w = 0;
                    for (size_t r = 0; r < 3; r++)
                        for (size_t c = 0; c < 3; c++)
                            w += n[r] * block[r * width + c] * q[c] / area;
                    gap += w * lambda[j];
                    if (j == i) own = w;
                }
                const double next = fmax(0, lambda[i] - gap / own);
                change = fmax(change, fabs(next - lambda[i]) * own);
                lambda[i] = next;
            }
            if (change < 1e-9) break;
        }
        memset(u, 0, vertex_count * sizeof *u);
        for (int32_t j = 0; j < m; j++) {
            if (lambda[j] == 0) continue;
            const double traction = lambda[j] / exact->surface.areas[exact->nodes[0][j]];
            const double p[3] = {traction * normal[j].x, traction * normal[j].y,
                                 traction * normal[j].z};
            for (int32_t i = 0; i < m; i++) {
                const double *block =
                    exact->xi[PLIANT_FREE_FREE] + 3 * (size_t)i * width + 3 * (size_t)j;
                double d[3];
                for (size_t r = 0; r < 3; r++)
                    d[r] = block[r * width] * p[0] + block[r * width + 1] * p[1] +
                           block[r * width + 2] * p[2];
                vector *to = &u[exact->nodes[0][i]];
                to->x += d[0], to->y += d[1], to->z += d[2];
            }
        }
    }
    for (int32_t i = 0; i < m; i++) {
        force[3 * i] = lambda[i] * normal[i].x;
        force[3 * i + 1] = lambda[i] * normal[i].y;
        force[3 * i + 2] = lambda[i] * normal[i].z;
    }
    free(lambda);
    free(normal);
}

static void forces_on_the_finest_level_are_those_of_the_dense_problem(void **state)
{
    (void)state;
    const pliant_tool tools[] = {ball_at(0.4, 0.06, 0.4, 0), ball_at(2, 0.1, -0.7, 0),
                                 plane_above(0.08, 0, 0)};
    for (size_t k = 0; k < sizeof tools / sizeof *tools; k++) {
        fixture f = set_up(1e-4, depth_levels, 0);
        const int32_t m = exact_model->counts[0];
        double *force = calloc(3 * (size_t)m, sizeof *force);
        vector *expected = calloc(vertex_count, sizeof *expected);
        assert_true(force && expected);
        solve_reference(exact_model, &tools[k], force, expected);
        assert_int_equal(solve_with(&f, 0, tools[k]), PLIANT_OK);
        static pliant_vec3 u[vertex_count];
        get_surface(&f, u);
        vector total = {0};
        double largest = 0;
        for (int32_t i = 0; i < m; i++) {
            total.x += force[3 * i], total.y += force[3 * i + 1], total.z += force[3 * i + 2];
            largest =
                fmax(largest, length((vector){force[3 * i], force[3 * i + 1], force[3 * i + 2]}));
        }
        const pliant_contact_report report = pliant_contact_last(f.contact);
        const vector found = widen(pliant_contact_tool(f.contact, 0).force);
        printf("    %d nodes, force %.6f %.6f %.6f, dense %.6f %.6f %.6f\n", report.node_count,
               found.x, found.y, found.z, total.x, total.y, total.z);
        // Normals are right to 5e-4, gaps to a hundredth of the tolerance, 1e-6 of a depth of 0.06,
        // floats to 1e-6 of 0.1.
        check_near(length(minus(found, total)) / length(total), 0, 5e-4);
        for (int32_t v = 0; v < vertex_count; v++)
            check_near(length(minus(widen(u[v]), expected[v])), 0, 5e-4 * 0.1);
        check_at_least(report.node_count, 4);
        for (int32_t i = 0; i < report.node_count; i++) {
            const pliant_contact_node node = pliant_contact_get(f.contact, i);
            int32_t at = 0;
            while (exact_model->nodes[0][at] != node.node.vertex) at++;
            check_near(length(minus(widen(node.force),
                                    (vector){force[3 * at], force[3 * at + 1], force[3 * at + 2]})),
                       0, 2e-3 * largest);
        }
        check_forces(&f, &tools[k], 1);
        free(force);
        free(expected);
        tear_down(&f);
    }
}

static void the_force_grows_faster_than_the_depth(void **state)
{
    (void)state;
    fixture f = set_up(0.004, 0, 0);
    double before = 0;
    for (double depth = 0.03; depth < 0.25; depth *= 2) {
        const pliant_tool tool = ball_at(1, depth, 0.5, 0);
        assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
        const double force = length(widen(pliant_contact_tool(f.contact, 0).force));
        printf("    depth %g: force %g with %d nodes\n", depth, force,
               pliant_contact_last(f.contact).node_count);
        // Hertz: twice the depth, 2.8 times the force; but the body as a whole gives way too.
        if (before > 0) check_at_least(force / before, 2.1);
        if (before > 0) check_at_most(force / before, 3.5);
        before = force;
        check_forces(&f, &tool, 1);
        // Forces along normals of a ball meet in its centre; normals are right to 5e-4, and the
        // radius is 1.
        check_near(length(widen(pliant_contact_tool(f.contact, 0).torque)) / force, 0, 5e-4);
    }
    tear_down(&f);
}

static pliant_tool random_tool(check_random *random)
{
    pliant_tool tool = {.kind = (pliant_tool_kind)(1 + check_random_index(random, 3))};
    vector out;
    do {
        out = (vector){2 * check_random_next(random) - 1, 2 * check_random_next(random) - 1,
                       2 * check_random_next(random) - 0.8};
    } while (length(out) < 0.1 || length(out) > 1);
    const double size = length(out), radius = 0.15 + 0.8 * check_random_next(random);
    const double depth = 0.2 * check_random_next(random) - 0.05;
    const double distance = (1 - depth + (tool.kind == PLIANT_TOOL_PLANE ? 0 : radius)) / size;
    tool.a = (pliant_vec3){(float)(out.x * distance), (float)(out.y * distance),
                           (float)(out.z * distance)};
    tool.b = tool.kind == PLIANT_TOOL_PLANE
                 ? (pliant_vec3){(float)-out.x, (float)-out.y, (float)-out.z}
                 : (pliant_vec3){tool.a.x - (float)out.y, tool.a.y + (float)out.x, tool.a.z};
    tool.radius = (float)radius;
    tool.friction = check_random_next(random) < 0.5 ? 0 : (float)(0.5 * check_random_next(random));
    return tool;
}

static void tools_push_and_never_pull(void **state)
{
    (void)state;
    check_random random = check_random_seed(8);
    fixture f = set_up(0.01, 0, 16);
    pliant_tool tools[3] = {{.kind = PLIANT_TOOL_NONE}};
    int32_t pushed = 0, met = 0, most = 0;
    enum { frames = 300 };
    for (int frame = 0; frame < frames; frame++) {
        const int32_t index = check_random_index(&random, 3);
        const double kind = check_random_next(&random);
        pliant_tool *tool = &tools[index];
        if (kind < 0.15) *tool = (pliant_tool){.kind = PLIANT_TOOL_NONE};
        else if (kind < 0.4 || tool->kind == PLIANT_TOOL_NONE) *tool = random_tool(&random);
        else {
            // A little on, in whatever direction.
            float *const numbers[] = {&tool->a.x, &tool->a.y, &tool->a.z,
                                      &tool->b.x, &tool->b.y, &tool->b.z};
            for (int i = 0; i < 6; i++)
                *numbers[i] += (float)(0.02 * (2 * check_random_next(&random) - 1));
        }
        const pliant_status status = solve_with(&f, index, *tool);
        assert_true(status == PLIANT_OK || status == PLIANT_ROUGH);
        check_forces(&f, tools, 3);
        const pliant_contact_report report = pliant_contact_last(f.contact);
        pushed += report.node_count > 0;
        met += report.is_met;
        if (report.node_count > most) most = report.node_count;
    }
    printf("    %d frames: %d with contact, at most %d nodes, tolerance kept in %d\n", frames,
           pushed, most, met);
    check_at_least(pushed, frames / 2);
    // Jumping tools of a size like the body's, some of which overlap.
    check_at_least(met, 0.8 * frames);
    tear_down(&f);
}

static void a_tool_that_goes_leaves_the_body_at_rest(void **state)
{
    (void)state;
    fixture f = set_up(0.004, 0, 16);
    static pliant_vec3 u[vertex_count];
    assert_int_equal(solve_with(&f, 0, ball_at(0.5, 0.1, 0.3, 0.2)), PLIANT_OK);
    check_at_least(pliant_contact_last(f.contact).node_count, 3);
    assert_int_equal(solve_with(&f, 0, (pliant_tool){.kind = PLIANT_TOOL_NONE}), PLIANT_OK);
    get_surface(&f, u);
    // Sums taken apart again, to rounding of the largest displacement there was.
    for (int32_t v = 0; v < vertex_count; v++) check_near(length(widen(u[v])), 0, 1e-6);
    assert_int_equal(pliant_contact_last(f.contact).node_count, 0);
    tear_down(&f);
}

static void a_loop_of_the_tool_takes_and_gives_no_energy(void **state)
{
    (void)state;
    // On one level, without friction: forces are the gradient of an energy of the tool's place, but
    // for normals that lag by up to 5e-4. The trapezoid rule errs by the square of the step.
    fixture f = set_up(1e-3, depth_levels, 0);
    enum { steps = 600 };
    double work = 0, most = 0;
    vector before = {0}, place_before = {0};
    for (int step = 0; step <= steps; step++) {
        const double turn = 2 * 3.14159265358979323846 * step / steps;
        const pliant_tool tool = ball_at(0.5, 0.05 + 0.05 * sin(turn), 0.4 + 0.3 * cos(turn), 0);
        assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
        const vector force = widen(pliant_contact_tool(f.contact, 0).force), at = widen(tool.a);
        if (step) {
            const vector mean = {(force.x + before.x) / 2, (force.y + before.y) / 2,
                                 (force.z + before.z) / 2};
            work += dot(mean, minus(at, place_before));
        }
        most = fmax(most, fabs(work));
        before = force;
        place_before = at;
    }
    printf("    work over the loop %.2e, most on the way %.2e\n", work, most);
    check_at_least(most, 1e-4);
    check_at_most(fabs(work) / most, 5e-3);
    tear_down(&f);
}

// ---- Friction ----

static void a_dragged_plane_sticks_first_and_then_slides(void **state)
{
    (void)state;
    const double friction = 0.3, depth = 0.05;
    fixture f = set_up(0.001, depth_levels, 0);
    assert_int_equal(solve_with(&f, 0, plane_above(depth, 0, friction)), PLIANT_OK);
    const pliant_tool_result pressed = pliant_contact_tool(f.contact, 0);
    const double normal = -(double)pressed.force.z;
    check_at_least(normal, 0.01);
    double shift = 0, last = 0, first_slope = 0;
    int32_t stuck_steps = 0, slid_steps = 0;
    for (int step = 1; step <= 60; step++) {
        shift += 0.001;
        assert_int_equal(solve_with(&f, 0, plane_above(depth, shift, friction)), PLIANT_OK);
        const pliant_tool tool = plane_above(depth, shift, friction);
        check_forces(&f, &tool, 1);
        const pliant_tool_result result = pliant_contact_tool(f.contact, 0);
        const double drag = (double)result.force.x, push = -(double)result.force.z;
        int32_t sliding = 0;
        for (int32_t i = 0; i < result.node_count; i++)
            sliding += pliant_contact_get(f.contact, i).is_sliding;
        check_at_most(hypot(drag, (double)result.force.y), friction * push * (1 + 1e-4));
        if (sliding == 0) {
            stuck_steps++;
            // What sticks is dragged along: the force grows with the way.
            if (first_slope == 0) first_slope = drag / shift;
            check_near(drag / shift, first_slope, 0.2 * first_slope);
        }
        if (sliding == result.node_count) {
            slid_steps++;
            // All against the same slip: Coulomb's limit, but for what poisson effects turn.
            check_near(drag, friction * push, 0.03 * friction * push);
        }
        last = drag;
    }
    printf("    normal %.4f, drag at the end %.4f; %d steps stuck, %d slid\n", normal, last,
           stuck_steps, slid_steps);
    check_at_least(stuck_steps, 2);
    check_at_least(slid_steps, 10);
    // Turning back, everything sticks again where it had slid to: the force falls as it rose.
    assert_int_equal(solve_with(&f, 0, plane_above(depth, shift - 0.002, friction)), PLIANT_OK);
    const double back = (double)pliant_contact_tool(f.contact, 0).force.x;
    check_near(last - back, 0.002 * first_slope, 0.2 * 0.002 * first_slope);
    tear_down(&f);
}

static void what_sticks_stays_where_it_is_on_the_tool(void **state)
{
    (void)state;
    // Far below the limit: every node keeps its place on the plane, over many steps, and comes back
    // to where it was.
    const double depth = 0.05, friction = 1.5;
    fixture f = set_up(0.001, depth_levels, 0);
    static pliant_vec3 u0[vertex_count], u[vertex_count];
    assert_int_equal(solve_with(&f, 0, plane_above(depth, 0, friction)), PLIANT_OK);
    get_surface(&f, u0);
    const double normal = -(double)pliant_contact_tool(f.contact, 0).force.z;
    for (int step = 1; step <= 200; step++) {
        const double shift = 0.01 * sin(2 * 3.14159265358979323846 * step / 100);
        assert_int_equal(solve_with(&f, 0, plane_above(depth, shift, friction)), PLIANT_OK);
        get_surface(&f, u);
        for (int32_t i = 0; i < pliant_contact_last(f.contact).node_count; i++) {
            const pliant_contact_node node = pliant_contact_get(f.contact, i);
            if (node.is_sliding) continue;
            // Each solve errs by a hundredth of the tolerance; the place is kept, not the steps.
            check_near((double)(u[node.node.vertex].x - u0[node.node.vertex].x), shift, 2e-4);
        }
    }
    const pliant_tool_result result = pliant_contact_tool(f.contact, 0);
    check_near((double)result.force.x / normal, 0, 2e-2);
    check_near(-(double)result.force.z / normal, 1, 1e-2);
    tear_down(&f);
}

static void a_loop_with_friction_only_costs_energy(void **state)
{
    (void)state;
    fixture f = set_up(1e-3, depth_levels, 0);
    enum { steps = 300 };
    double work = 0, most = 0;
    vector before = {0}, place_before = {0};
    for (int step = 0; step <= steps; step++) {
        const double turn = 2 * 3.14159265358979323846 * step / steps;
        const pliant_tool tool = ball_at(0.5, 0.1 * sin(turn / 2), 0.4 + 0.2 * sin(turn), 0.3);
        assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
        const vector force = widen(pliant_contact_tool(f.contact, 0).force), at = widen(tool.a);
        const vector mean = {(force.x + before.x) / 2, (force.y + before.y) / 2,
                             (force.z + before.z) / 2};
        if (step) work += dot(mean, minus(at, place_before));
        most = fmax(most, work);
        before = force;
        place_before = at;
    }
    printf("    the tool's work over the loop %.2e, most on the way %.2e\n", work, most);
    check_at_least(work, 0.1 * most);
    tear_down(&f);
}

// ---- Levels ----

// Press a ball in and slide it; at every step the tolerance is kept, everywhere.
static void the_tolerance_is_kept_with_no_more_nodes_than_it_takes(void **state)
{
    (void)state;
    const double tolerances[] = {0.002, 0.01, 0.05};
    double nodes_before = 1e9;
    for (size_t k = 0; k < sizeof tolerances / sizeof *tolerances; k++) {
        fixture f = set_up(tolerances[k], 0, 16);
        enum { steps = 250 };
        double nodes = 0, worst = 0;
        int32_t coarsest = depth_levels;
        for (int step = 0; step < steps; step++) {
            const double depth = 0.15 * fmin(1, step / 100.0);
            const double angle = 0.3 + (step < 100 ? 0 : 0.004 * (step - 100));
            const pliant_tool tool = ball_at(2, depth, angle, 0);
            assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
            const pliant_contact_report report = pliant_contact_last(f.contact);
            assert_true(report.is_met);
            check_at_most(report.penetration, tolerances[k]);
            check_at_most(report.residual, 0.02 * tolerances[k]);
            const double depth_found = deepest(&f, &tool);
            check_at_most(depth_found, tolerances[k]);
            check_near(depth_found, report.penetration, 1e-5);
            worst = fmax(worst, report.error);
            if (step >= 100) nodes += report.node_count / (steps - 100.0);
            if (report.coarsest_level >= 0 && report.coarsest_level < coarsest)
                coarsest = report.coarsest_level;
        }
        printf("    tolerance %g: %.1f nodes, coarsest level %d, worst error %.4f\n", tolerances[k],
               nodes, coarsest, worst);
        // Those that a change of level brings leave when it has taken effect.
        check_at_most(nodes, 1.05 * nodes_before);
        nodes_before = nodes;
        if (k == 0) assert_int_equal(coarsest, depth_levels);
        if (k == 2) check_at_most(coarsest, depth_levels - 1);
        tear_down(&f);
    }
}

// Paths on which levels change: pressed in within 60 solves, and then slid along.
typedef struct path {
    double tolerance, radius, depth;
} path;

enum { slide_steps = 500, press_steps = 60 };

static pliant_tool slide_along(const path *p, int step)
{
    const double depth = p->depth * fmin(1, (double)step / press_steps);
    return ball_at(p->radius, depth, 0.2 + (step < press_steps ? 0 : 0.002 * (step - press_steps)),
                   0);
}

typedef struct trace {
    double force_jump;    // largest change of (force less that on the finest level) in a step
    double surface_jump;  // largest move of a vertex in a step
    int32_t changes;      // of levels
} trace;

static trace slide(const path *p, int32_t coarsest, int32_t fade_count, vector *forces,
                   int32_t is_reference)
{
    fixture f = set_up(p->tolerance, coarsest, fade_count);
    static pliant_vec3 u[vertex_count], before[vertex_count];
    trace found = {0};
    vector difference_before = {0};
    for (int step = 0; step < slide_steps; step++) {
        assert_int_equal(solve_with(&f, 0, slide_along(p, step)), PLIANT_OK);
        const pliant_contact_report report = pliant_contact_last(f.contact);
        found.changes += report.refined + report.coarsened;
        assert_true(report.is_met);
        const vector force = widen(pliant_contact_tool(f.contact, 0).force);
        if (is_reference) forces[step] = force;
        const vector difference = minus(force, forces[step]);
        get_surface(&f, u);
        if (step >= press_steps) {  // onset is slower on coarser levels; that is no pop
            found.force_jump = fmax(found.force_jump, length(minus(difference, difference_before)));
            for (int32_t v = 0; v < vertex_count; v++)
                found.surface_jump =
                    fmax(found.surface_jump, length(minus(widen(u[v]), widen(before[v]))));
        }
        difference_before = difference;
        memcpy(before, u, sizeof before);
    }
    tear_down(&f);
    return found;
}

static void nothing_pops_when_levels_change(void **state)
{
    (void)state;
    // A change of level takes effect through offsets of at most 0.45 tolerances inwards that fade
    // by a 16th a solve, next to a residual of a hundredth; the stiffness of contact makes a force
    // of that. What moves at once is what going back may move, a quarter of the tolerance, while
    // the force is carried over.
    const path paths[] = {{0.04, 2, 0.12}, {0.08, 2, 0.2}, {0.06, 5, 0.25}};
    static vector forces[slide_steps];
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        const path *p = &paths[k];
        const trace fixed = slide(p, depth_levels, 16, forces, 1);
        const trace faded = slide(p, 0, 16, forces, 0);
        const trace sudden = slide(p, 0, 0, forces, 0);
        // How the force on the finest level grew with the last of the depth.
        const double stiffness = length(minus(forces[press_steps - 1], forces[press_steps - 11])) /
                                 (10 * p->depth / press_steps);
        const double unit = stiffness * p->tolerance;
        printf("    tolerance %g: force %.3f; extra jumps, by stiffness times tolerance: fading "
               "%.4f, sudden %.4f; surface moves %.4f, %.4f on the finest level, by tolerances; "
               "%d changes\n",
               p->tolerance, length(forces[slide_steps - 1]), faded.force_jump / unit,
               sudden.force_jump / unit, faded.surface_jump / p->tolerance,
               fixed.surface_jump / p->tolerance, faded.changes);
        check_at_least(faded.changes, 10);
        check_at_most(faded.force_jump / unit, 0.45 / 16 + 0.01);
        check_at_most(faded.surface_jump, fixed.surface_jump + 0.25 * p->tolerance);
        // That it can fail: without fading it does.
        check_at_least(sudden.force_jump, 4 * faded.force_jump);
    }
}

static void a_wide_hat_does_not_press_where_nothing_is(void **state)
{
    (void)state;
    // A small ball right on a vertex of the coarsest level, whose hat is as wide as the body: it
    // alone would keep the ball out of all vertices, but is several times too stiff.
    vector force[2], wide = {0};
    for (int k = 0; k < 3; k++) {
        const double tolerance = k == 2 ? 1 : 0.004;
        fixture f = set_up(tolerance, k == 0 ? depth_levels : 0, 16);
        const double *x = pliant_model_positions(f.model);
        int32_t vertex = 0;
        while (x[3 * vertex + 2] < 0.4) vertex++;
        assert_in_range(vertex, 0, pliant_model_level_vertex_count(f.model, 0) - 1);
        for (int step = 0; step < 40; step++) {
            const double distance = 1.1 - 0.05 * fmin(1, (step + 1) / 10.0);
            const pliant_tool tool = {.kind = PLIANT_TOOL_SPHERE,
                                      .a = {(float)(distance * x[3 * vertex]),
                                            (float)(distance * x[3 * vertex + 1]),
                                            (float)(distance * x[3 * vertex + 2])},
                                      .radius = 0.1f};
            assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
        }
        const vector found = widen(pliant_contact_tool(f.contact, 0).force);
        if (k < 2) force[k] = found;
        else wide = found;
        if (k == 1) assert_int_equal(pliant_contact_last(f.contact).coarsest_level, depth_levels);
        tear_down(&f);
    }
    printf("    force %.4f on the finest level, %.4f on all, %.4f with the wide hat\n",
           length(force[0]), length(force[1]), length(wide));
    check_near(length(force[1]) / length(force[0]), 1, 0.01);
    check_at_least(length(wide) / length(force[0]), 1.5);
}

static void a_tool_at_rest_comes_to_rest(void **state)
{
    (void)state;
    fixture f = set_up(0.02, 0, 8);
    const pliant_tool tool = ball_at(2, 0.15, 0.4, 0.2);
    vector before = {0};
    int32_t changes = 0;
    for (int step = 0; step < 400; step++) {
        assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
        const vector force = widen(pliant_contact_tool(f.contact, 0).force);
        if (step >= 200) {
            const pliant_contact_report report = pliant_contact_last(f.contact);
            changes += report.refined + report.coarsened;
            check_near(length(minus(force, before)), 0, 1e-5 * length(force));
        }
        before = force;
    }
    assert_int_equal(changes, 0);
    tear_down(&f);
}

static void few_levels_and_few_nodes_do_what_they_can(void **state)
{
    (void)state;
    fixture f = open_model(exact_model);
    pliant_error err = {""};
    pliant_contact_def def = pliant_contact_default(f.solver);
    def.tolerance = 0.002;
    def.finest_level = 1;
    check_ok(pliant_contact_create(f.solver, &def, &f.contact, &err), &err);
    pliant_tool tool = plane_above(0.3, 0, 0);
    assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
    pliant_contact_report report = pliant_contact_last(f.contact);
    check_at_least(report.node_count, 1);
    check_at_most(report.finest_level, 1);
    assert_false(report.is_met);
    check_at_least(report.penetration, 0.002);
    check_forces(&f, &tool, 1);
    pliant_contact_destroy(f.contact);

    def = pliant_contact_default(f.solver);
    def.tolerance = 0.002;
    def.node_capacity = 3;
    check_ok(pliant_contact_create(f.solver, &def, &f.contact, &err), &err);
    for (int step = 0; step < 50; step++) {
        tool = plane_above(0.006 * step, 0.01 * step, 0.2);
        assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
        report = pliant_contact_last(f.contact);
        check_at_most(report.watched_count, 3);
        check_forces(&f, &tool, 1);
    }
    check_at_least(report.node_count, 1);
    assert_false(report.is_met);
    tear_down(&f);
}

static void models_of_coarse_levels_alone_have_tools_too(void **state)
{
    (void)state;
    check_synthetic *coarse =
        check_synthetic_create(&(check_synthetic_def){.levels = depth_levels,
                                                      .wavelet = pliant_wavelet_default(),
                                                      .blocks = CHECK_FREE_BLOCK,
                                                      .level_mask = 3});
    fixture f = open_model(coarse);
    assert_int_equal(pliant_contact_default(f.solver).finest_level, 1);
    begin_contact(&f, 0.01, 0, 16);
    for (int step = 0; step < 60; step++) {
        const pliant_tool tool = plane_above(0.005 * step, 0, 0.1);
        assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
        check_forces(&f, &tool, 1);
    }
    const pliant_contact_report report = pliant_contact_last(f.contact);
    check_at_least(report.node_count, 1);
    check_at_most(report.finest_level, 1);
    tear_down(&f);
    check_synthetic_destroy(coarse);
}

static void compressed_models_meet_the_tolerance_too(void **state)
{
    (void)state;
    check_synthetic *compressed = make_model(0.2);
    fixture f = open_model(compressed);
    begin_contact(&f, 0.01, 0, 16);
    printf("    RMS %.3f, MAX %.3f\n", pliant_model_describe(f.model).rms,
           pliant_model_describe(f.model).max);
    int32_t met = 0;
    enum { steps = 200 };
    for (int step = 0; step < steps; step++) {
        const pliant_tool tool = ball_at(1, 0.1 * fmin(1, step / 50.0), 0.003 * step, 0.1);
        const pliant_status status = solve_with(&f, 0, tool);
        assert_int_equal(status, PLIANT_OK);
        check_forces(&f, &tool, 1);
        met += pliant_contact_last(f.contact).is_met;
    }
    check_at_least(met, 0.97 * steps);
    tear_down(&f);
    check_synthetic_destroy(compressed);
}

// ---- With the caller ----

static void the_callers_statements_hold(void **state)
{
    (void)state;
    fixture f = set_up(0.004, 0, 16);
    static pliant_vec3 u[vertex_count];
    const pliant_tool tool = ball_at(0.8, 0.1, 0.2, 0.1);
    // Vertices under the tool, one of them already its node.
    assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
    check_at_least(pliant_contact_last(f.contact).node_count, 3);
    const int32_t taken = pliant_contact_get(f.contact, 0).node.vertex;
    const double above[3] = {sin(0.35), 0.1, cos(0.35)}, beside[3] = {-0.9, 0, 0.4};
    const int32_t loaded = pliant_model_nearest(f.model, above);
    const int32_t far = pliant_model_nearest(f.model, beside);
    assert_true(taken != loaded);
    const pliant_vec3 where = {0.01f, 0.02f, -0.02f}, traction = {0, 0.5f, 0},
                      pull = {-0.05f, 0, 0.02f};
    assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){depth_levels, taken}, where),
                     PLIANT_OK);
    assert_int_equal(pliant_solver_press(f.solver, (pliant_node){depth_levels, loaded}, traction),
                     PLIANT_OK);
    assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){depth_levels, far}, pull),
                     PLIANT_OK);
    for (int step = 0; step < 40; step++) {
        assert_int_equal(pliant_contact_solve(f.contact, PLIANT_NEVER), PLIANT_OK);
        get_surface(&f, u);
        check_near(length(minus(widen(u[taken]), widen(where))), 0, 1e-6);
        check_near(length(minus(widen(u[far]), widen(pull))), 0, 1e-6);
        pliant_vec3 p;
        assert_int_equal(pliant_solver_tractions(f.solver, &loaded, 1, &p), PLIANT_OK);
        int32_t pushed = 0;
        for (int32_t i = 0; i < pliant_contact_last(f.contact).node_count; i++) {
            const pliant_contact_node node = pliant_contact_get(f.contact, i);
            assert_true(node.node.vertex != taken && node.node.vertex != loaded &&
                        node.node.vertex != far);
            pushed++;
        }
        check_at_least(pushed, 2);
        // The nodes that are left meet the conditions with what is held and loaded there.
        check_at_most(pliant_contact_last(f.contact).residual, 0.02 * 0.004);
    }
    // Moving what is held moves the surface against the tool.
    const double before = length(widen(pliant_contact_tool(f.contact, 0).force));
    assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){depth_levels, far},
                                            (pliant_vec3){0.3f, 0, 0.3f}),
                     PLIANT_OK);
    assert_int_equal(pliant_contact_solve(f.contact, PLIANT_NEVER), PLIANT_OK);
    check_at_least(fabs(length(widen(pliant_contact_tool(f.contact, 0).force)) - before),
                   0.02 * before);
    check_at_most(pliant_contact_last(f.contact).residual, 0.02 * 0.004);
    // The caller takes everything out, the tool's loads too: the next solve has these again.
    pliant_solver_release_all(f.solver);
    for (int step = 0; step < 100; step++)
        assert_int_equal(pliant_contact_solve(f.contact, PLIANT_NEVER), PLIANT_OK);
    pliant_vec3 total = pliant_contact_tool(f.contact, 0).force;
    fixture fresh = set_up(0.004, 0, 16);
    for (int step = 0; step < 100; step++) assert_int_equal(solve_with(&fresh, 0, tool), PLIANT_OK);
    const vector expected = widen(pliant_contact_tool(fresh.contact, 0).force);
    check_near(length(minus(widen(total), expected)), 0, 0.02 * length(expected));
    tear_down(&fresh);
    // Destroying the contact leaves the solver without its loads.
    pliant_contact_destroy(f.contact);
    f.contact = NULL;
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    get_surface(&f, u);
    for (int32_t v = 0; v < vertex_count; v++) check_near(length(widen(u[v])), 0, 1e-6);
    tear_down(&f);
}

static void held_vertices_are_never_nodes(void **state)
{
    (void)state;
    fixture f = set_up(0.004, 0, 16);
    // From the side over the border of what is held, at z = -0.6.
    for (int step = 0; step < 60; step++) {
        const pliant_tool tool = {.kind = PLIANT_TOOL_SPHERE,
                                  .a = {1.3f - 0.003f * (float)step, 0, -0.55f},
                                  .radius = 0.5f,
                                  .friction = 0.2f};
        assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
        check_forces(&f, &tool, 1);  // which looks at every node
    }
    check_at_least(pliant_contact_last(f.contact).node_count, 2);
    tear_down(&f);
}

static void the_surface_is_met_where_it_was_moved_to(void **state)
{
    (void)state;
    // The whole body 0.7 to the side, by what holds it: no vertex is near where it rests.
    const pliant_tool tool = ball_at(0.4, 0.08, 0, 0);
    fixture f = set_up(0.002, 0, 0);
    assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
    const vector expected = widen(pliant_contact_tool(f.contact, 0).force);
    check_at_least(length(expected), 0.01);
    for (int32_t v = 0; v < vertex_count; v++)
        if (pliant_model_is_free(f.model, v) == 0)
            assert_int_equal(pliant_solver_support(f.solver, (pliant_node){depth_levels, v},
                                                   (pliant_vec3){0.7f, 0, 0}),
                             PLIANT_OK);
    pliant_tool moved = tool;
    moved.a.x += 0.7f;
    assert_int_equal(solve_with(&f, 0, moved), PLIANT_OK);
    const vector found = widen(pliant_contact_tool(f.contact, 0).force);
    check_near(length(minus(found, expected)), 0, 0.01 * length(expected));
    tear_down(&f);
}

static void a_fast_ball_does_not_jump_through_the_surface(void **state)
{
    (void)state;
    // As deep as it is wide: its centre is under where the surface was.
    const double radius = 0.3, depth = 0.5;
    vector force[2];
    for (int k = 0; k < 2; k++) {
        fixture f = set_up(0.01, depth_levels, 0);
        const int steps = k ? 1 : 50;
        assert_int_equal(solve_with(&f, 0, ball_at(radius, 0.02, 0.1, 0)), PLIANT_OK);
        for (int step = 1; step <= steps; step++) {
            const pliant_tool tool = ball_at(radius, 0.02 + (depth - 0.02) * step / steps, 0.1, 0);
            assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
            check_forces(&f, &tool, 1);
        }
        force[k] = widen(pliant_contact_tool(f.contact, 0).force);
        check_at_least(pliant_contact_last(f.contact).node_count, 5);
        check_at_most(pliant_contact_last(f.contact).penetration, 0.01);
        tear_down(&f);
    }
    printf("    force in 50 steps %.4f, in one %.4f\n", length(force[0]), length(force[1]));
    check_near(length(minus(force[1], force[0])), 0, 0.02 * length(force[0]));
}

static void two_tools_at_one_place_do_what_one_does(void **state)
{
    (void)state;
    fixture f = set_up(0.004, 0, 0);
    const pliant_tool tool = plane_above(0.06, 0, 0);
    assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
    const vector one = widen(pliant_contact_tool(f.contact, 0).force);
    for (int step = 0; step < 3; step++) assert_int_equal(solve_with(&f, 1, tool), PLIANT_OK);
    const vector first = widen(pliant_contact_tool(f.contact, 0).force);
    const vector second = widen(pliant_contact_tool(f.contact, 1).force);
    check_near(first.z + second.z, one.z, 1e-3 * fabs(one.z));
    tear_down(&f);
}

static void two_tools_squeeze_the_body(void **state)
{
    (void)state;
    fixture f = set_up(0.004, 0, 16);
    pliant_tool tools[2] = {
        {.kind = PLIANT_TOOL_PLANE, .a = {1, 0, 0}, .b = {-1, 0, 0}, .friction = 0.2f},
        {.kind = PLIANT_TOOL_PLANE, .a = {-1, 0, 0}, .b = {1, 0, 0}, .friction = 0.2f}};
    for (int step = 0; step < 40; step++) {
        tools[0].a.x = 1 - 0.003f * (float)step;
        tools[1].a.x = -1 + 0.003f * (float)step;
        assert_int_equal(pliant_contact_set_tool(f.contact, 1, &tools[1]), PLIANT_OK);
        assert_int_equal(solve_with(&f, 0, tools[0]), PLIANT_OK);
        check_forces(&f, tools, 2);
    }
    const vector right = widen(pliant_contact_tool(f.contact, 0).force);
    const vector left = widen(pliant_contact_tool(f.contact, 1).force);
    check_at_most(right.x, -0.01);
    // The icosahedron is symmetric under the point reflection and so under x -> -x, but not the
    // order of solving.
    check_near(left.x / -right.x, 1, 1e-2);
    tear_down(&f);
}

// ---- Deadlines, arguments ----

static void a_late_solve_leaves_a_valid_state(void **state)
{
    (void)state;
    fixture f = set_up(0.002, 0, 16);
    int32_t late = 0;
    for (int step = 0; step < 150; step++) {
        const pliant_tool tool = ball_at(1, 0.15 * fmin(1, step / 20.0), 0.01 * step, 0.2);
        assert_int_equal(pliant_contact_set_tool(f.contact, 0, &tool), PLIANT_OK);
        // Past, at once, soon, far.
        const int64_t ahead[] = {-1000000, 0, 30000, 10000000000};
        const int64_t deadline = pliant_clock_ns() + ahead[step % 4];
        const pliant_status status = pliant_contact_solve(f.contact, deadline);
        const pliant_contact_report report = pliant_contact_last(f.contact);
        assert_true(status == PLIANT_OK || status == PLIANT_LATE);
        assert_int_equal(status == PLIANT_LATE, report.is_late);
        check_at_least(report.iterations, 1);
        if (step % 4 < 2) assert_int_equal(report.iterations, 1);
        if (status == PLIANT_LATE) {
            late++;
            assert_true(step % 4 != 3);
        }
        if (step % 4 == 3) {
            assert_int_equal(report.lateness_ns, 0);
            assert_true(report.is_met);
        }
        if (step % 4 == 0) check_at_least((double)report.lateness_ns, 1);
        check_forces(&f, &tool, 1);
    }
    check_at_least(late, 10);
    tear_down(&f);
}

static void wrong_definitions_are_refused_with_a_reason(void **state)
{
    (void)state;
    fixture f = open_model(exact_model);
    pliant_contact *contact = NULL;
    const pliant_contact_def good = pliant_contact_default(f.solver);
    assert_int_equal(good.node_capacity, 64);
    assert_int_equal(good.coarsest_level, 0);
    assert_int_equal(good.finest_level, depth_levels);
    check_near(good.tolerance, 2.0 / 500, 1e-6);  // of the sphere's diameter
    for (int i = 0; i < 14; i++) {
        pliant_contact_def def = good;
        switch (i) {
        case 0:
            def.node_capacity = 0;
            break;
        case 1:
            def.node_capacity = 65;
            break;
        case 2:
            def.tool_capacity = 0;
            break;
        case 3:
            def.tool_capacity = INT32_MAX;
            break;
        case 4:
            def.tolerance = 0;
            break;
        case 5:
            def.tolerance = -1;
            break;
        case 6:
            def.tolerance = NAN;
            break;
        case 7:
            def.tolerance = INFINITY;
            break;
        case 8:
            def.fade_count = -1;
            break;
        case 9:
            def.fade_count = INT32_MAX;
            break;
        case 10:
            def.coarsest_level = -1;
            break;
        case 11:
            def.finest_level = depth_levels + 1;
            break;
        case 12:
            def.coarsest_level = 2, def.finest_level = 1;
            break;
        default:
            def.node_capacity = INT32_MIN;
            break;
        }
        pliant_error err = {""};
        assert_int_equal(pliant_contact_create(f.solver, &def, &contact, &err),
                         PLIANT_ERR_ARGUMENT);
        assert_null(contact);
        assert_non_null(strstr(err.text, "expected"));
        assert_int_equal(pliant_contact_create(f.solver, &def, &contact, NULL),
                         PLIANT_ERR_ARGUMENT);
    }
    assert_int_equal(pliant_contact_create(NULL, &good, &contact, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_contact_create(f.solver, &good, NULL, NULL), PLIANT_ERR_ARGUMENT);
    // A solver whose compliance is as stored.
    pliant_solver *stored = NULL;
    pliant_error err = {""};
    check_ok(pliant_solver_create(f.model, NULL, &stored, &err), &err);
    assert_int_equal(pliant_contact_create(stored, NULL, &contact, &err), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "passive"));
    pliant_solver_destroy(stored);
    pliant_contact_destroy(NULL);
    tear_down(&f);
}

static void hostile_tools_leave_numbers_finite(void **state)
{
    (void)state;
    fixture f = set_up(0.004, 0, 16);
    pliant_tool tool = ball_at(0.5, 0.05, 0.1, 0.1);
    assert_int_equal(pliant_contact_set_tool(f.contact, -1, &tool), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_contact_set_tool(f.contact, 4, &tool), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_contact_set_tool(f.contact, 0, NULL), PLIANT_ERR_ARGUMENT);
    tool.radius = -1;
    assert_int_equal(pliant_contact_set_tool(f.contact, 0, &tool), PLIANT_ERR_ARGUMENT);
    const float sizes[] = {1e-30f, 1e-6f, 1, 1e6f, 1e15f, 3e38f};
    static pliant_vec3 u[vertex_count];
    check_random random = check_random_seed(4);
    for (int trial = 0; trial < 200; trial++) {
        float *const numbers[] = {&tool.a.x, &tool.a.y, &tool.a.z,   &tool.b.x,
                                  &tool.b.y, &tool.b.z, &tool.radius};
        tool.kind = (pliant_tool_kind)(1 + check_random_index(&random, 3));
        tool.friction = (float)(2 * check_random_next(&random));
        for (int i = 0; i < 7; i++)
            *numbers[i] =
                (float)(2 * check_random_next(&random) - 1) * sizes[check_random_index(&random, 6)];
        tool.radius = fabsf(tool.radius);
        const pliant_status set = pliant_contact_set_tool(f.contact, trial % 2, &tool);
        assert_true(set == PLIANT_OK || set == PLIANT_ERR_ARGUMENT);
        assert_true(pliant_contact_solve(f.contact, PLIANT_NEVER) >= 0);
        get_surface(&f, u);
        for (int32_t v = 0; v < vertex_count; v++) assert_true(isfinite(length(widen(u[v]))));
        for (int t = 0; t < 2; t++) {
            const pliant_tool_result result = pliant_contact_tool(f.contact, t);
            assert_true(isfinite(length(widen(result.force))));
        }
    }
    // And from there back to something sound.
    assert_int_equal(solve_with(&f, 1, (pliant_tool){.kind = PLIANT_TOOL_NONE}), PLIANT_OK);
    assert_int_equal(solve_with(&f, 0, (pliant_tool){.kind = PLIANT_TOOL_NONE}), PLIANT_OK);
    tool = ball_at(0.5, 0.05, 0.1, 0.1);
    assert_int_equal(solve_with(&f, 0, tool), PLIANT_OK);
    check_forces(&f, &tool, 1);
    check_at_least(pliant_contact_last(f.contact).node_count, 1);
    const pliant_contact_node none = pliant_contact_get(f.contact, 1000);
    assert_int_equal(none.node.vertex, -1);
    assert_int_equal(pliant_contact_get(f.contact, -1).tool, -1);
    assert_int_equal(pliant_contact_tool(f.contact, 99).node_count, 0);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_tool_that_does_not_touch_does_nothing),
        cmocka_unit_test(forces_on_the_finest_level_are_those_of_the_dense_problem),
        cmocka_unit_test(the_force_grows_faster_than_the_depth),
        cmocka_unit_test(tools_push_and_never_pull),
        cmocka_unit_test(a_tool_that_goes_leaves_the_body_at_rest),
        cmocka_unit_test(a_loop_of_the_tool_takes_and_gives_no_energy),
        cmocka_unit_test(a_dragged_plane_sticks_first_and_then_slides),
        cmocka_unit_test(what_sticks_stays_where_it_is_on_the_tool),
        cmocka_unit_test(a_loop_with_friction_only_costs_energy),
        cmocka_unit_test(the_tolerance_is_kept_with_no_more_nodes_than_it_takes),
        cmocka_unit_test(nothing_pops_when_levels_change),
        cmocka_unit_test(a_wide_hat_does_not_press_where_nothing_is),
        cmocka_unit_test(a_tool_at_rest_comes_to_rest),
        cmocka_unit_test(few_levels_and_few_nodes_do_what_they_can),
        cmocka_unit_test(models_of_coarse_levels_alone_have_tools_too),
        cmocka_unit_test(compressed_models_meet_the_tolerance_too),
        cmocka_unit_test(the_callers_statements_hold),
        cmocka_unit_test(held_vertices_are_never_nodes),
        cmocka_unit_test(the_surface_is_met_where_it_was_moved_to),
        cmocka_unit_test(a_fast_ball_does_not_jump_through_the_surface),
        cmocka_unit_test(two_tools_at_one_place_do_what_one_does),
        cmocka_unit_test(two_tools_squeeze_the_body),
        cmocka_unit_test(a_late_solve_leaves_a_valid_state),
        cmocka_unit_test(wrong_definitions_are_refused_with_a_reason),
        cmocka_unit_test(hostile_tools_leave_numbers_finite),
    };
    return cmocka_run_group_tests(tests, make_exact_model, destroy_exact_model);
}
