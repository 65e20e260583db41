// test_reconstruction.c: selective reconstruction against the whole inverse transform.
#include "check.h"

#include "reconstruction.h"
#include "surfaces.h"

#include "pliant/wavelet.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct setting {
    check_surface surface;
    pliant_hierarchy *hierarchy;
    pliant_wavelet *wavelet;
    pliant_arena arena;
    pliant_reconstruction plan;
    pliant_reconstruction_scratch scratch;
    double *exact;        // values, shape [count + 1][3]
    float *coefficients;  // shape [count + 1][4]
    float *work;          // shape [count][16]
} setting;

// A domain with a hole: vertices with z > -0.4, so that stencils are cut.
static setting set_up(check_surface surface, pliant_wavelet_def def, check_random *random)
{
    setting s = {.surface = surface};
    pliant_error err = {""};
    const int32_t n = surface.mesh->vertex_count;
    s.hierarchy = check_hierarchy(&s.surface);
    int32_t *nodes = malloc((size_t)n * sizeof *nodes), count = 0;
    for (int32_t v = 0; v < n; v++)
        if (surface.mesh->vertices[3 * (size_t)v + 2] > -0.4) nodes[count++] = v;
    check_ok(
        pliant_wavelet_create(s.hierarchy, surface.areas, nodes, count, &def, &s.wavelet, &err),
        &err);
    free(nodes);
    for (int pass = 0; pass < 2; pass++) {
        if (pass) check_ok(pliant_arena_reserve(&s.arena, &err), &err);
        pliant_reconstruction_lay_out(&s.arena, s.wavelet, &s.plan);
        pliant_reconstruction_scratch_lay_out(&s.arena, s.wavelet, &s.scratch);
        PLIANT_TAKE(&s.arena, s.exact, 3 * ((size_t)count + 1));
        PLIANT_TAKE(&s.arena, s.coefficients, 4 * ((size_t)count + 1));
        PLIANT_TAKE(&s.arena, s.work, 16 * (size_t)count);
    }
    pliant_reconstruction_scratch_begin(s.wavelet, &s.scratch);
    for (int32_t i = 0; i < 3 * count; i++) s.exact[i] = 2 * check_random_next(random) - 1;
    for (int32_t p = 0; p < count; p++)
        for (int c = 0; c < 3; c++)
            s.coefficients[4 * (size_t)p + c] = (float)s.exact[3 * (size_t)p + c];
    for (int32_t p = 0; p < count; p++)
        for (int c = 0; c < 3; c++) s.exact[3 * (size_t)p + c] = s.coefficients[4 * (size_t)p + c];
    pliant_wavelet_inverse(s.wavelet, s.wavelet->level_count - 1, 3, s.exact);
    return s;
}

static void tear_down(setting *s)
{
    pliant_arena_release(&s->arena);
    pliant_wavelet_destroy(s->wavelet);
    pliant_hierarchy_destroy(s->hierarchy);
    check_surface_destroy(&s->surface);
}

static pliant_wavelet_def wavelet_number(int kind)
{
    return (pliant_wavelet_def){(pliant_wavelet_scheme)(kind & 1),
                                (pliant_wavelet_lifting)(kind >> 1 & 1),
                                (pliant_wavelet_boundary)(kind >> 2)};
}

// Coefficients and weights are of size one, and a value sums some hundred of them down the levels.
static const double tolerance = 100 * 0x1p-24;

static void check_values(setting *s, const int32_t *positions, int32_t count)
{
    int32_t *slots = malloc((size_t)count * sizeof *slots);
    pliant_reconstruction_build(&s->plan, &s->scratch, positions, count, slots);
    assert_in_range(s->plan.slot_count, 1, s->wavelet->count);
    for (int32_t p = 0; p <= s->wavelet->count; p++) assert_int_equal(s->scratch.slot_of[p], -1);
    pliant_reconstruction_run(&s->plan, s->coefficients, s->work);
    for (int32_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            check_near(s->work[4 * (size_t)slots[i] + c], s->exact[3 * (size_t)positions[i] + c],
                       tolerance);

    // The same on blocks: column k of a block is the field times k + 1.
    pliant_reconstruction_map(&s->plan, &s->scratch);
    for (int32_t p = 0; p < s->wavelet->count; p++) {
        const int32_t slot = s->scratch.slot_of[p];
        for (int e = 0; slot >= 0 && e < 9; e++)
            s->work[16 * (size_t)slot + e] =
                (float)(e % 3 + 1) * s->coefficients[4 * (size_t)p + e / 3];
    }
    pliant_reconstruction_unmap(&s->plan, &s->scratch);
    pliant_reconstruction_run_blocks(&s->plan, s->work);
    for (int32_t i = 0; i < count; i++)
        for (int e = 0; e < 9; e++)
            check_near(s->work[16 * (size_t)slots[i] + e],
                       (e % 3 + 1) * s->exact[3 * (size_t)positions[i] + e / 3], 3 * tolerance);
    free(slots);
}

static void any_set_equals_the_whole_transform_for_every_wavelet(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    for (int kind = 0; kind < 8; kind++)
        for (int shape = 0; shape < 3; shape++) {
            const check_surface surface = shape == 0   ? check_sphere(3)
                                          : shape == 1 ? check_refine(check_tetrahedron(), 3)
                                                       : check_refine(check_torus(3, 4), 2);
            setting s = set_up(surface, wavelet_number(kind), &random);
            const int32_t m = s.wavelet->count;
            int32_t *positions = malloc((size_t)m * sizeof *positions);
            for (int round = 0; round < 12; round++) {
                const int32_t count = round < 6 ? 1 : 1 + check_random_index(&random, 40);
                for (int32_t i = 0; i < count; i++) positions[i] = check_random_index(&random, m);
                check_values(&s, positions, count);
            }
            for (int32_t i = 0; i < m; i++) positions[i] = m - 1 - i;  // the largest plan there is
            check_values(&s, positions, m);
            free(positions);
            tear_down(&s);
        }
}

static void the_plan_of_one_node_does_not_grow_with_the_mesh(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    int32_t slots_before = 0;
    for (int32_t levels = 3; levels <= 5; levels++) {
        setting s = set_up(check_sphere(levels), pliant_wavelet_default(), &random);
        int32_t most = 0, slot;
        for (int round = 0; round < 200; round++) {
            const int32_t position = check_random_index(&random, s.wavelet->count);
            pliant_reconstruction_build(&s.plan, &s.scratch, &position, 1, &slot);
            if (s.plan.slot_count > most) most = s.plan.slot_count;
        }
        print_message("%d nodes: at most %d slots for one\n", s.wavelet->count, most);
        // A level adds at most what one stencil's closure adds (some ten nodes with six children
        // each, shared), while the mesh grows fourfold.
        if (levels > 3) check_at_most(most, slots_before + 120);
        slots_before = most;
        tear_down(&s);
    }
}

static void a_single_level_needs_no_sums(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    setting s = set_up(check_refine(check_icosahedron(), 0), pliant_wavelet_default(), &random);
    const int32_t positions[3] = {2, 0, 2};
    check_values(&s, positions, 3);
    assert_int_equal(s.plan.op_count, 0);
    assert_int_equal(s.plan.slot_count, 2);
    tear_down(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_set_equals_the_whole_transform_for_every_wavelet),
        cmocka_unit_test(the_plan_of_one_node_does_not_grow_with_the_mesh),
        cmocka_unit_test(a_single_level_needs_no_sums),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
