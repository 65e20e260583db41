// test_alloc_solver.c: frames allocate nothing, not even those that factor a new type.
#include "allocations.h"
#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <unistd.h>

static void frames_of_all_kinds_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_alloc_%d.h5", (int)getpid());
    check_write_synthetic_levels(path, NULL, 3, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS);
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    const pliant_solver_def def = {.constraint_capacity = 100,
                                   .load_capacity = 50,
                                   .cache_count = 2,
                                   .storage = PLIANT_STORAGE_HALF};
    check_ok(pliant_solver_create(model, &def, &solver, &err), &err);

    const int32_t n = pliant_model_describe(model).vertex_count;
    static pliant_vec3 u[1000];
    assert_in_range(n, 1, 1000);
    check_random random = check_random_seed(1);
    int32_t factored = 0, updated = 0, late = 0, refused = 0, largest = 0;
    const long before = atomic_load(&calls);
    for (int frame = 0; frame < 300; frame++) {
        const int32_t centre = check_random_index(&random, n);
        const int32_t changes = frame % 50 == 0 ? 120 : 12;
        for (int i = 0; i < changes; i++) {
            const int32_t v = frame % 2 ? check_random_index(&random, n) : (centre + i) % n;
            // One in three on the coarsest level that has the vertex.
            const pliant_node node = {i % 3 || v >= 162 ? 3 : v >= 42 ? 2 : v >= 12 ? 1 : 0, v};
            const pliant_vec3 value = {0, (float)check_random_next(&random), 0.1f};
            const double kind = check_random_next(&random);
            const int32_t is_free = pliant_model_is_free(model, node.vertex);
            pliant_status status;
            if (kind < 0.3) status = pliant_solver_release(solver, node);
            else if (kind < 0.5) status = pliant_solver_press(solver, node, value);
            else if (is_free) status = pliant_solver_displace(solver, node, value);
            else status = pliant_solver_support(solver, node, value);
            if (status < 0) {
                assert_int_equal(status, PLIANT_ERR_CAPACITY);
                refused++;
            }
        }
        if (frame % 7 == 0)
            assert_int_equal(pliant_solver_gravity(solver, (pliant_vec3){0, 0, (float)frame}),
                             PLIANT_OK);
        if (pliant_solver_constraint_count(solver) > largest)
            largest = pliant_solver_constraint_count(solver);
        // Every third without time for anything.
        assert_true(pliant_solver_solve(solver, frame % 3 ? PLIANT_NEVER : pliant_clock_ns()) >= 0);
        factored += pliant_solver_last(solver).factored;
        updated += pliant_solver_last(solver).updated > 0;
        late += pliant_solver_last(solver).is_late;
        static double compliance[9 * 4];
        const pliant_node pair[] = {{3, 640}, {1, 0}};
        (void)!pliant_solver_compliance(solver, pair, 2, compliance);
        int32_t probes[20];
        for (int i = 0; i < 20; i++) probes[i] = check_random_index(&random, n);
        assert_int_equal(pliant_solver_displacements(solver, probes, 1 + frame % 20, u), PLIANT_OK);
        assert_int_equal(
            pliant_solver_displacements(solver, (const int32_t[]){5, 9, 17, 600}, 4, u), PLIANT_OK);
        assert_int_equal(pliant_solver_surface(solver, frame % 4, u), PLIANT_OK);
        assert_int_equal(pliant_solver_tractions(solver, frame % 3 ? probes : NULL, 20, u),
                         PLIANT_OK);
        (void)pliant_solver_contact_force(solver);
        if (frame % 60 == 59) pliant_solver_release_all(solver);
    }
    assert_int_equal(atomic_load(&calls) - before, 0);
    // The frames were what they claim.
    check_at_least(factored, 15);
    check_at_least(updated, 30);
    check_at_least(late, 1);
    check_at_least(largest, 90);
    check_at_least(refused, 1);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
}

static void detailed_surfaces_and_points_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_alloc_%d.h5", (int)getpid());
    check_synthetic *body =
        check_synthetic_create(&(check_synthetic_def){.levels = 1,
                                                      .wavelet = pliant_wavelet_default(),
                                                      .blocks = CHECK_FREE_BLOCK});
    check_synthetic_roughen(body, 2);
    check_synthetic_write(body, path);
    check_synthetic_destroy(body);
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_detail *detail = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    check_ok(pliant_detail_create(model, 1, &detail, &err), &err);
    const pliant_detail_info info = pliant_detail_describe(detail);
    static pliant_vec3 u[42], positions[642], normals[642], carried[642];
    assert_int_equal(info.control_count, 42);
    assert_int_equal(info.vertex_count, 642);
    check_random random = check_random_seed(2);
    const long before = atomic_load(&calls);
    for (int frame = 0; frame < 50; frame++) {
        for (int32_t v = 0; v < 42; v++)
            u[v].x = (frame % 10 == 9 ? 10 : 0.1f) * (float)check_random_next(&random);
        int32_t vertices[40], support[42], support_count;
        for (int i = 0; i < 40; i++) vertices[i] = check_random_index(&random, 642);
        assert_true(pliant_detail_evaluate(detail, u, positions, normals) >= 0);
        assert_true(pliant_detail_points(detail, u, vertices, 40, positions, normals) >= 0);
        assert_int_equal(pliant_detail_support(detail, vertices, 40, support, 42, &support_count),
                         PLIANT_OK);
        assert_int_equal(pliant_detail_interpolate(detail, 3, &u[0].x, &carried[0].x), PLIANT_OK);
    }
    assert_int_equal(atomic_load(&calls) - before, 0);
    pliant_detail_destroy(detail);
    pliant_model_close(model);
}

// Patches that move, grow, shrink and end, with time and without.
static void patches_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_alloc_%d.h5", (int)getpid());
    check_write_synthetic_levels(path, NULL, 3, 0.05, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    pliant_patch *patch = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    const pliant_solver_def def = {
        .constraint_capacity = 60, .load_capacity = 4, .cache_count = 3};
    check_ok(pliant_solver_create(model, &def, &solver, &err), &err);
    const pliant_patch_def patch_def = {
        .vertex_capacity = 150, .tolerance = 0.01, .hysteresis = 1.5, .blend_steps = 4};
    check_ok(pliant_patch_create(solver, &patch_def, &patch, &err), &err);

    const int32_t n = pliant_model_describe(model).vertex_count;
    const double *x = pliant_model_positions(model);
    static int32_t vertices[150];
    static pliant_vec3 u[150];
    int32_t late = 0, full = 0, blending = 0, most = 0;
    const long before = atomic_load(&calls);
    for (int frame = 0; frame < 300; frame++) {
        const double top = 1 - 0.004 * (frame % 100);
        int32_t count = 0;
        for (int32_t v = 0; v < n && count < 150; v++) {
            const double along = 0.8 * x[3 * (size_t)v] + 0.6 * x[3 * (size_t)v + 2];
            if (along < 0.75 * top || pliant_model_is_free(model, v) != 1) continue;
            vertices[count] = v;
            u[count++] = (pliant_vec3){0, 0, (float)(0.9 * top - along)};
        }
        if (frame % 100 == 99) count = 0;
        assert_int_equal(pliant_patch_set(patch, vertices, u, count), PLIANT_OK);
        if (frame % 50 == 0)
            assert_int_equal(pliant_patch_tolerate(patch, frame % 100 ? 0.001 : 0.02), PLIANT_OK);
        const int64_t deadline = frame % 3 ? PLIANT_NEVER : pliant_clock_ns() + 100000;
        assert_true(pliant_patch_solve(patch, deadline) >= 0);
        const pliant_patch_report report = pliant_patch_last(patch);
        late += report.is_late;
        full += report.is_full;
        blending += report.blending;
        if (report.node_count > most) most = report.node_count;
        (void)pliant_patch_force(patch);
        if (frame == 150) pliant_solver_release_all(solver);
    }
    assert_int_equal(atomic_load(&calls) - before, 0);
    check_at_least(late, 1);
    check_at_least(full, 1);
    check_at_least(blending, 100);
    check_at_least(most, 50);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
}

static void frames_of_tools_allocate_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_alloc_%d.h5", (int)getpid());
    check_write_synthetic_levels(path, NULL, 3, 0.05, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    pliant_contact *contact = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    pliant_solver_def def = pliant_solver_default(model);
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    check_ok(pliant_solver_create(model, &def, &solver, &err), &err);
    pliant_contact_def contact_def = pliant_contact_default(solver);
    contact_def.tolerance = 0.02;
    check_ok(pliant_contact_create(solver, &contact_def, &contact, &err), &err);

    int32_t most = 0, refined = 0, coarsened = 0, late = 0;
    const long before = atomic_load(&calls);
    for (int frame = 0; frame < 400; frame++) {
        const double angle = 0.005 * frame, distance = 2.85 + (frame % 100 < 30 ? 0.3 : 0);
        const pliant_tool ball = {
            .kind = PLIANT_TOOL_SPHERE,
            .a = {(float)(distance * sin(angle)), 0, (float)(distance * cos(angle))},
            .radius = 2,
            .friction = frame % 200 < 100 ? 0 : 0.3f};
        const pliant_tool plane = {.kind = PLIANT_TOOL_PLANE,
                                   .a = {0, 1 - 0.0005f * (float)frame, 0},
                                   .b = {0, -1, 0}};
        assert_int_equal(pliant_contact_set_tool(contact, 0, &ball), PLIANT_OK);
        assert_int_equal(pliant_contact_set_tool(contact, 1, &plane), PLIANT_OK);
        if (frame % 50 == 0)
            assert_int_equal(pliant_solver_displace(solver, (pliant_node){3, 40 + frame / 50},
                                                    (pliant_vec3){0, 0.02f, 0}),
                             PLIANT_OK);
        const pliant_status status = pliant_contact_solve(
            contact, frame % 10 == 9 ? pliant_clock_ns() : PLIANT_NEVER);
        assert_true(status >= 0);
        const pliant_contact_report report = pliant_contact_last(contact);
        if (report.node_count > most) most = report.node_count;
        refined += report.refined;
        coarsened += report.coarsened;
        late += status == PLIANT_LATE;
        for (int32_t i = 0; i < report.node_count; i++) (void)pliant_contact_get(contact, i);
    }
    assert_int_equal(atomic_load(&calls) - before, 0);
    // The frames were what they claim.
    check_at_least(most, 10);
    check_at_least(refined, 10);
    check_at_least(coarsened, 5);
    check_at_least(late, 10);
    pliant_contact_destroy(contact);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(frames_of_all_kinds_allocate_nothing),
        cmocka_unit_test(patches_allocate_nothing),
        cmocka_unit_test(frames_of_tools_allocate_nothing),
        cmocka_unit_test(detailed_surfaces_and_points_allocate_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
