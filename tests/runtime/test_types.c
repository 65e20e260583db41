// test_types.c: which set a solve takes and how its inverse is had: updates, deadlines, slices.
#include "levels_fixture.h"

// ---- Updates ----

static void ten_thousand_updates_equal_factorisations(void **state)
{
    (void)state;
    const pliant_compliance rules[] = {PLIANT_COMPLIANCE_STORED, PLIANT_COMPLIANCE_PASSIVE};
    for (int r = 0; r < 2; r++) {
        fixture f = set_up(0.02, CHECK_ALL_BLOCKS, roomy);
        check_random random = check_random_seed(31);
        pliant_arena arena = {0};
        pliant_capacitance kept = {0}, fresh = {0};
        pliant_capacitance_scratch scratch = {0};
        pliant_error err = {""};
        enum { capacity = 40 };
        for (int pass = 0; pass < 2; pass++) {
            if (pass) check_ok(pliant_arena_reserve(&arena, &err), &err);
            pliant_capacitance_lay_out(&arena, f.model, capacity, &kept);
            pliant_capacitance_lay_out(&arena, f.model, capacity, &fresh);
            pliant_capacitance_scratch_lay_out(&arena, f.model, capacity, &scratch);
        }
        pliant_capacitance_scratch_begin(f.model, rules[r], &scratch);
        pliant_node set[capacity];
        int32_t count = 0, rebuilt = 0;
        double worst = 0, worst_residual = 0;
        pliant_capacitance_build(f.model, set, 0, &scratch, &kept);
        for (int step = 0; step < 10000; step++) {
            // Add, drop, or move to another level; ascending vertices.
            const pliant_node node = random_node(&random);
            int32_t at = 0;
            while (at < count && set[at].vertex < node.vertex) at++;
            if (at < count && set[at].vertex == node.vertex) {
                if (check_random_next(&random) < 0.5) set[at] = node;
                else memmove(set + at, set + at + 1, (size_t)(--count - at) * sizeof *set);
            } else if (count < capacity - 5 * check_random_next(&random)) {
                memmove(set + at + 1, set + at, (size_t)(count++ - at) * sizeof *set);
                set[at] = node;
            } else {
                const int32_t gone = check_random_index(&random, count);
                memmove(set + gone, set + gone + 1, (size_t)(--count - gone) * sizeof *set);
            }
            if (kept.status == PLIANT_OK && kept.shift == scratch.held_shift &&
                pliant_capacitance_update(f.model, set, count, &scratch, &kept)) {
                worst_residual = fmax(worst_residual, kept.residual);
            } else {
                pliant_capacitance_build(f.model, set, count, &scratch, &kept);
                rebuilt++;
            }
            assert_true(pliant_capacitance_matches(&kept, set, count));
            if (step % 20 != 0) continue;
            pliant_capacitance_build(f.model, set, count, &scratch, &fresh);
            if (kept.shift != fresh.shift) continue;
            double largest = 0, off = 0;
            for (int32_t i = 0; i < count; i++)
                for (int32_t j = 0; j < count; j++)
                    for (size_t c = 0; c < 9; c++) {
                        const int32_t ki = kept.order[i], kj = kept.order[j];
                        const double a = kept.product[3 * (size_t)ki + c % 3 +
                                                      (3 * (size_t)kj + c / 3) * kept.stride];
                        const double b = fresh.product[3 * (size_t)i + c % 3 +
                                                       (3 * (size_t)j + c / 3) * fresh.stride];
                        largest = fmax(largest, fabs(b));
                        off = fmax(off, fabs(a - b));
                    }
            if (largest > 0) worst = fmax(worst, off / largest);
        }
        print_message("%s: worst difference %.2g, worst residual %.2g, %d rebuilt\n",
                      r ? "passive" : "stored", worst, worst_residual, rebuilt);
        // The products are floats of doubles that agree to some 1e-12.
        check_at_most(worst, 2 * 0x1p-24);
        check_at_most(worst_residual, 1e-9);
        check_at_most(rebuilt, 2500);
        pliant_arena_release(&arena);
        tear_down(&f);
    }
}

static void an_inverse_that_drifted_is_made_again(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    const pliant_vec3 u = {0, 0, -0.1f};
    for (int32_t v = 60; v < 80; v++)
        if (pliant_model_is_free(f.model, v))
            assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){2, v}, u), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).factored, 1);
    // Sound: one node more is an update.
    pliant_node more[2] = {{2, 100}, {2, 0}};
    while (!pliant_model_is_free(f.model, more[0].vertex)) more[0].vertex++;
    more[1].vertex = more[0].vertex + 1;
    while (!pliant_model_is_free(f.model, more[1].vertex)) more[1].vertex++;
    assert_int_equal(pliant_solver_displace(f.solver, more[0], u), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).factored, 0);
    assert_int_equal(pliant_solver_last(f.solver).updated, 1);
    check_at_most(pliant_solver_last(f.solver).residual, 1e-12);
    // One element of every kept inverse off by a millionth: seen, and factored.
    for (int32_t t = 0; t < f.solver->cache_count; t++) f.solver->types[t].inverse[7] += 1e-6;
    assert_int_equal(pliant_solver_displace(f.solver, more[1], u), PLIANT_OK);
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).factored, 1);
    assert_true(pliant_solver_last(f.solver).residual > 1e-9);
    tear_down(&f);
}

// ---- Deadlines ----

static void without_time_the_constraints_are_resolved_on_coarser_levels(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    // A dense patch and one node far from it.
    int32_t stated = 0;
    const double *x = f.model->view.vertices;
    for (int32_t v = 0; v < vertex_count; v++)
        if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.4)
            assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){finest, v},
                                                    (pliant_vec3){-0.05f, 0, 0}),
                             PLIANT_OK),
                stated++;
    int32_t lone = 161;
    while (!pliant_model_is_free(f.model, lone) || x[3 * lone] > -0.5) lone--;
    const pliant_vec3 pulled = {-0.1f, 0, 0.02f};
    assert_int_equal(pliant_solver_displace(f.solver, (pliant_node){finest, lone}, pulled),
                     PLIANT_OK);
    stated++;
    assert_int_equal(pliant_solver_solve(f.solver, pliant_clock_ns() - 1), PLIANT_LATE);
    pliant_solver_report report = pliant_solver_last(f.solver);
    assert_int_equal(report.is_late, 1);
    assert_int_equal(report.level, 0);
    assert_int_equal(report.asked_count, stated);
    check_at_most(report.constraint_count, stated / 4);
    assert_true(report.lateness_ns > 0);
    // A valid state: what is resolved is met; the lone node is not lost.
    pliant_vec3 u[vertex_count];
    assert_int_equal(pliant_solver_surface(f.solver, finest, u), PLIANT_OK);
    assert_memory_equal(&u[lone], &pulled, sizeof pulled);
    int32_t met = 0;
    for (int32_t v = 0; v < 12; v++)
        if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.4) met++, check_near(u[v].x, -0.05f, 0);
    check_at_least(met, 1);
    const double coarse_force = pliant_solver_contact_force(f.solver).x;
    // With time it is all there, and of like force.
    assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
    report = pliant_solver_last(f.solver);
    assert_int_equal(report.is_late, 0);
    assert_int_equal(report.level, finest);
    assert_int_equal(report.constraint_count, stated);
    check_near(coarse_force / pliant_solver_contact_force(f.solver).x, 1, 0.3);
    // And the set that is kept now is in time at once.
    assert_int_equal(pliant_solver_solve(f.solver, pliant_clock_ns() + 50000000), PLIANT_OK);
    assert_int_equal(pliant_solver_last(f.solver).factored, 0);
    tear_down(&f);
}

static void a_contact_that_rests_is_resolved_as_stated_after_some_solves(void **state)
{
    (void)state;
    for (int32_t cache = 1; cache <= 2; cache++)
        for (int rule = 0; rule < 2; rule++) {
            pliant_solver_def def = roomy;
            def.cache_count = cache;
            def.compliance = rule ? PLIANT_COMPLIANCE_PASSIVE : PLIANT_COMPLIANCE_STORED;
            fixture f = set_up(0, CHECK_FREE_BLOCK, def);
            const double *x = f.model->view.vertices;
            for (int32_t v = 0; v < vertex_count; v++)
                if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.1)
                    assert_true(pliant_solver_displace(f.solver, (pliant_node){finest, v},
                                                       (pliant_vec3){-0.05f, 0, 0}) <= 0);
            const double all =
                pliant_cost_of_build(&f.solver->cost, pliant_solver_constraint_count(f.solver));
            int late = 0;
            float prepared = 0;
            while (late < 1000) {
                const pliant_status status =
                    pliant_solver_solve(f.solver, pliant_clock_ns() + (int64_t)(0.5 * all));
                const pliant_solver_report report = pliant_solver_last(f.solver);
                if (!report.is_late) break;
                assert_int_equal(status, PLIANT_LATE);
                check_at_least(report.prepared, prepared);
                prepared = report.prepared;
                late++;
            }
            assert_in_range(late, 1, 999);
            assert_int_equal(pliant_solver_last(f.solver).level, finest);
            assert_int_equal(pliant_solver_last(f.solver).factored, 0);
            // As good as made in one piece.
            pliant_solver *other = NULL;
            check_ok(pliant_solver_create(f.model, &def, &other, NULL), NULL);
            for (int32_t v = 0; v < vertex_count; v++)
                if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.1)
                    assert_true(pliant_solver_displace(other, (pliant_node){finest, v},
                                                       (pliant_vec3){-0.05f, 0, 0}) <= 0);
            assert_int_equal(pliant_solver_solve(other, PLIANT_NEVER), PLIANT_OK);
            assert_int_equal(pliant_solver_last(other).factored, 1);
            const pliant_vec3 a = pliant_solver_contact_force(f.solver);
            const pliant_vec3 b = pliant_solver_contact_force(other);
            check_near(a.x / b.x, 1, 1e-5);
            pliant_solver_destroy(other);
            tear_down(&f);
        }
}

static void the_finest_level_that_fits_is_taken(void **state)
{
    (void)state;
    fixture f = set_up(0, CHECK_FREE_BLOCK, roomy);
    const double *x = f.model->view.vertices;
    int32_t seen[finest + 1] = {0};
    for (int round = 0; round < 60; round++) {
        pliant_solver_release_all(f.solver);
        assert_int_equal(pliant_solver_solve(f.solver, PLIANT_NEVER), PLIANT_OK);
        for (int32_t t = 0; t < f.solver->cache_count; t++) f.solver->types[t].count = -1;
        for (int32_t v = 0; v < vertex_count; v++)
            if (pliant_model_is_free(f.model, v) && x[3 * v] > 0.1)
                assert_true(pliant_solver_displace(f.solver, (pliant_node){finest, v},
                                                   (pliant_vec3){-0.05f, 0, 0}) <= 0);
        // Predicted for level 2: some hundreds of microseconds; 1: tens; 0: a few.
        const int32_t s = pliant_solver_constraint_count(f.solver);
        const double all = pliant_cost_of_build(&f.solver->cost, s);
        const int64_t given = (int64_t)(all * (round % 3 == 0 ? 4 : round % 3 == 1 ? 0.4 : 0.02));
        const pliant_status status = pliant_solver_solve(f.solver, pliant_clock_ns() + given);
        const pliant_solver_report report = pliant_solver_last(f.solver);
        assert_int_equal(status != PLIANT_OK, report.is_late || report.lateness_ns > 0);
        if (report.level > 0 && report.is_late) check_at_most((double)report.predicted_ns, (double)given);
        seen[report.level]++;
    }
    print_message("levels 0, 1, 2 taken %d, %d, %d times\n", seen[0], seen[1], seen[2]);
    for (int l = 0; l <= finest; l++) check_at_least(seen[l], 5);
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_thousand_updates_equal_factorisations),
        cmocka_unit_test(an_inverse_that_drifted_is_made_again),
        cmocka_unit_test(without_time_the_constraints_are_resolved_on_coarser_levels),
        cmocka_unit_test(a_contact_that_rests_is_resolved_as_stated_after_some_solves),
        cmocka_unit_test(the_finest_level_that_fits_is_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
