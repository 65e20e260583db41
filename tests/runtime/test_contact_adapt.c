// test_contact_adapt.c: which levels tools act on: tolerance, level changes, models of few levels.
#include "contact_fixture.h"

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_tolerance_is_kept_with_no_more_nodes_than_it_takes),
        cmocka_unit_test(nothing_pops_when_levels_change),
        cmocka_unit_test(a_wide_hat_does_not_press_where_nothing_is),
        cmocka_unit_test(a_tool_at_rest_comes_to_rest),
        cmocka_unit_test(few_levels_and_few_nodes_do_what_they_can),
        cmocka_unit_test(models_of_coarse_levels_alone_have_tools_too),
        cmocka_unit_test(compressed_models_meet_the_tolerance_too),
    };
    return cmocka_run_group_tests(tests, make_exact_model, destroy_exact_model);
}
