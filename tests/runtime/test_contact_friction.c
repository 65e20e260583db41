// test_contact_friction.c: rigid tools with friction: stick, slip, and what a loop costs.
#include "contact_fixture.h"

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_dragged_plane_sticks_first_and_then_slides),
        cmocka_unit_test(what_sticks_stays_where_it_is_on_the_tool),
        cmocka_unit_test(a_loop_with_friction_only_costs_energy),
    };
    return cmocka_run_group_tests(tests, make_exact_model, destroy_exact_model);
}
