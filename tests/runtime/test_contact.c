// test_contact.c: rigid tools without friction: forces, what the caller states, deadlines, arguments.
#include "contact_fixture.h"

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
