// test_lattice.c: a model's lattice is laid out as its file says, with any half-width.
#include "exhaustion.h"

#include "lattice/body.h"
#include "synthetic_lattice.h"
#include "synthetic_model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

typedef struct fixture {
    char path[64];
    check_lattice *cells;
    pliant_model *model;
} fixture;

static fixture open_lattice(const check_lattice_def *def)
{
    fixture f = {.path = "/tmp/pliant_test_lattice_XXXXXX"};
    const int file = mkstemp(f.path);
    assert_true(file >= 0);
    close(file);
    f.cells = check_lattice_create(def);
    check_lattice_write(f.cells, f.path);
    pliant_error err = {""};
    check_ok(pliant_model_open(f.path, &f.model, &err), &err);
    unlink(f.path);  // the mapping stays; nothing is left behind when a case fails
    return f;
}

static void close_lattice(fixture *f)
{
    pliant_model_close(f->model);
    check_lattice_destroy(f->cells);
}

static pliant_lattice *lattice_of(const fixture *f, int32_t half_width)
{
    pliant_lattice *lattice = NULL;
    pliant_error err = {""};
    check_ok(pliant_lattice_create(f->model, half_width, &lattice, &err), &err);
    return lattice;
}

// Goals of a body of each from the same places, bit for bit.
static void check_same_goals(const pliant_lattice *a, const pliant_lattice *b, check_random *random)
{
    const int32_t n = pliant_lattice_describe(a).particle_count;
    assert_int_equal(pliant_lattice_describe(b).particle_count, n);
    const pliant_lattice *lattices[2] = {a, b};
    pliant_vec3 *x = malloc((size_t)n * sizeof *x), *v[2];
    assert_non_null(x);
    const double cell = pliant_lattice_describe(a).cell_size;
    for (int32_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            (&x[i].x)[c] = pliant_lattice_positions(a)[3 * i + c] +
                           (float)(0.3 * cell * (check_random_next(random) - 0.5));
    for (int k = 0; k < 2; k++) {
        pliant_body *body = NULL;
        pliant_error err = {""};
        v[k] = malloc((size_t)n * sizeof *v[k]);
        assert_non_null(v[k]);
        check_ok(pliant_body_create(lattices[k], NULL, &body, &err), &err);
        assert_int_equal(pliant_body_set_positions(body, x), PLIANT_OK);
        assert_int_equal(pliant_body_step(body, 1), PLIANT_OK);
        pliant_body_velocities(body, v[k]);
        pliant_body_destroy(body);
    }
    assert_memory_equal(v[0], v[1], (size_t)n * sizeof *x);
    free(v[0]);
    free(v[1]);
    free(x);
}

static void the_files_half_width_is_that_half_width_laid_out_anew(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    static const int32_t widths[] = {1, 2, 3, 5};
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (int k = 0; k < 4; k++) {
            fixture f = open_lattice(&(check_lattice_def){
                .shape = shape, .size = 6, .half_width = widths[k], .cell_size = 0.1});
            fixture other = open_lattice(&(check_lattice_def){
                .shape = shape, .size = 6, .half_width = widths[(k + 1) % 4], .cell_size = 0.1});
            pliant_lattice *stored = lattice_of(&f, 0), *same = lattice_of(&f, widths[k]);
            pliant_lattice *anew = lattice_of(&other, widths[k]);
            const pliant_lattice_info a = pliant_lattice_describe(stored);
            const pliant_lattice_info b = pliant_lattice_describe(anew);
            assert_int_equal(a.half_width, widths[k]);
            assert_int_equal(a.region_count, b.region_count);
            assert_int_equal(a.irregular_count, b.irregular_count);
            assert_int_equal(a.component_count, b.component_count);
            assert_int_equal(a.particle_count, b.particle_count);
            check_same_goals(stored, anew, &random);
            check_same_goals(stored, same, &random);
            pliant_lattice_destroy(stored);
            pliant_lattice_destroy(same);
            pliant_lattice_destroy(anew);
            close_lattice(&f);
            close_lattice(&other);
        }
}

static void lattices_say_what_they_are(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        const int is_shell = shape == CHECK_CELLS_SHELL;
        fixture f = open_lattice(&(check_lattice_def){.shape = shape,
                                                      .size = 5,
                                                      .half_width = 2,
                                                      .cell_size = 0.25,
                                                      .origin = {1, -2, 3},
                                                      .mass = 7,
                                                      .is_shell = is_shell});
        pliant_lattice *lattice = lattice_of(&f, 0);
        const pliant_lattice_info info = pliant_lattice_describe(lattice);
        assert_int_equal(info.particle_count, f.cells->shape.particle_count);
        assert_int_equal(info.cell_count, f.cells->shape.cell_count);
        assert_int_equal(info.half_width, 2);
        assert_int_equal(info.region_count, f.cells->regions->region_count);
        assert_int_equal(info.irregular_count, f.cells->regions->region_node_count);
        assert_int_equal(info.is_shell, is_shell);
        assert_memory_equal(info.dims, f.cells->shape.dims, sizeof info.dims);
        // Two cubes; and the sponge's loose cells, of which the file has the count.
        assert_int_equal(info.component_count, f.cells->summary[PLIANT_LATTICE_COMPONENT_COUNT]);
        if (shape == CHECK_CELLS_TWO) assert_int_equal(info.component_count, 2);
        if (shape == CHECK_CELLS_CUBE) assert_int_equal(info.component_count, 1);
        check_near(info.cell_size, 0.25, 0);
        check_near(info.mass, 7, 1e-5);
        double mass = 0;
        for (int32_t i = 0; i < info.particle_count; i++) {
            check_near(pliant_lattice_particle_mass(lattice, i), (double)f.cells->mass[i], 0);
            mass += pliant_lattice_particle_mass(lattice, i);
            for (int c = 0; c < 3; c++)
                check_near((double)pliant_lattice_positions(lattice)[3 * i + c],
                           (c == 0   ? 1
                            : c == 1 ? -2
                                     : 3) +
                               0.25 * f.cells->particles[3 * i + c],
                           0);
        }
        check_near(mass, info.mass, 1e-9);
        check_near(pliant_lattice_particle_mass(lattice, -1), 0, 0);
        check_near(pliant_lattice_particle_mass(lattice, info.particle_count), 0, 0);
        pliant_lattice_destroy(lattice);
        close_lattice(&f);
    }
}

static void the_nearest_particle_is_found(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    fixture f = open_lattice(&(check_lattice_def){.shape = CHECK_CELLS_SPONGE,
                                                  .size = 6,
                                                  .half_width = 1,
                                                  .cell_size = 0.5,
                                                  .origin = {-1, 2, 5}});
    pliant_lattice *lattice = lattice_of(&f, 0);
    const float *rest = pliant_lattice_positions(lattice);
    const int32_t n = pliant_lattice_describe(lattice).particle_count;
    for (int k = 0; k < 300; k++) {
        double at[3], least = INFINITY;
        for (int c = 0; c < 3; c++) at[c] = 10 * check_random_next(&random) - 3;
        const int32_t found = pliant_lattice_nearest(lattice, at);
        assert_in_range(found, 0, n - 1);
        for (int32_t i = 0; i < n; i++) {
            double square = 0;
            for (int c = 0; c < 3; c++) square += pow((double)rest[3 * i + c] - at[c], 2);
            least = fmin(least, square);
        }
        double square = 0;
        for (int c = 0; c < 3; c++) square += pow((double)rest[3 * found + c] - at[c], 2);
        check_near(square, least, 0);
    }
    for (int32_t i = 0; i < n; i++) {
        const double at[3] = {(double)rest[3 * i], (double)rest[3 * i + 1],
                              (double)rest[3 * i + 2]};
        assert_int_equal(pliant_lattice_nearest(lattice, at), i);
    }
    pliant_lattice_destroy(lattice);
    close_lattice(&f);
}

// ---- Refusals ----

static void half_widths_out_of_range_are_refused(void **state)
{
    (void)state;
    fixture f =
        open_lattice(&(check_lattice_def){.shape = CHECK_CELLS_CUBE, .size = 3, .half_width = 2});
    const int32_t wrong[] = {16, -1, INT32_MAX, INT32_MIN};
    pliant_lattice *lattice = NULL;
    pliant_error err = {""};
    for (int k = 0; k < 4; k++) {
        assert_int_equal(pliant_lattice_create(f.model, wrong[k], &lattice, &err),
                         PLIANT_ERR_ARGUMENT);
        assert_null(lattice);
        assert_non_null(strstr(err.text, "half-width: expected 1 to 15"));
    }
    assert_int_equal(pliant_lattice_create(NULL, 0, &lattice, &err), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_lattice_create(f.model, 0, NULL, &err), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_lattice_create(f.model, 16, &lattice, NULL), PLIANT_ERR_ARGUMENT);
    lattice = lattice_of(&f, 15);
    assert_int_equal(pliant_lattice_describe(lattice).half_width, 15);
    pliant_lattice_destroy(lattice);
    pliant_lattice_destroy(NULL);
    pliant_body *body = NULL;
    assert_int_equal(pliant_body_create(NULL, NULL, &body, &err), PLIANT_ERR_ARGUMENT);
    close_lattice(&f);
}

static void files_without_a_lattice_are_refused(void **state)
{
    (void)state;
    char path[] = "/tmp/pliant_test_lattice_XXXXXX";
    const int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    check_write_synthetic_model(path, NULL, 1, 1e-3, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    pliant_model *opened = NULL;
    pliant_lattice *lattice = NULL;
    pliant_error err = {""};
    check_ok(pliant_model_open(path, &opened, &err), &err);
    assert_int_equal(pliant_lattice_create(opened, 0, &lattice, &err), PLIANT_ERR_MISSING);
    assert_null(lattice);
    assert_non_null(strstr(err.text, "--lattice"));
    pliant_model_close(opened);
    unlink(path);
}

// A region that lacks a particle whose own region has it: sums and goals would not fit each other.
static void regions_that_are_not_mutual_are_refused(void **state)
{
    (void)state;
    check_lattice *l = check_lattice_create(
        &(check_lattice_def){.shape = CHECK_CELLS_COMB, .size = 6, .half_width = 2});
    pliant_lattice_def def = {.shape = l->shape,
                              .mass = l->mass,
                              .regions = l->regions,
                              .cell_size = 1,
                              .component_count = 1};
    pliant_lattice *lattice = NULL;
    pliant_error err = {""};
    check_ok(pliant_lattice_build(&def, &lattice, &err), &err);
    pliant_lattice_destroy(lattice);
    // Forget the last irregular region: others still lack its particle.
    assert_true(l->regions->region_node_count > 1);
    l->regions->region_node_count--;
    lattice = NULL;
    assert_int_equal(pliant_lattice_build(&def, &lattice, &err), PLIANT_ERR_FORMAT);
    assert_null(lattice);
    assert_non_null(strstr(err.text, "lacks a particle alone"));
    l->regions->region_node_count++;
    // Or take one member away.
    int32_t *plate = NULL;
    const int32_t w = 2;
    for (int32_t k = 0; k < l->regions->plate_node_count && !plate; k++)
        for (int32_t y = 0; y <= 2 * w && !plate; y++) {
            int32_t *mask = l->regions->plate_nodes + k * (2 * w + 4) + 3 + y;
            if (*mask && !((uint32_t)*mask & PLIANT_ROW_WHOLE)) plate = mask;
        }
    assert_non_null(plate);
    *plate &= *plate - 1;
    lattice = NULL;
    const pliant_status status = pliant_lattice_build(&def, &lattice, &err);
    if (status >= 0) pliant_lattice_destroy(lattice);
    assert_int_equal(status, PLIANT_ERR_FORMAT);
    check_lattice_destroy(l);
}

static void memory_may_run_out_anywhere(void **state)
{
    (void)state;
    if (!EXHAUSTING) skip();
    fixture f =
        open_lattice(&(check_lattice_def){.shape = CHECK_CELLS_COMB, .size = 6, .half_width = 3});
    const long before = blocks_held();
    for (int32_t width = 0; width < 3; width += 2) {
        pliant_status status = PLIANT_ERR_MEMORY;
        for (long n = 0; status == PLIANT_ERR_MEMORY; n++) {
            pliant_lattice *lattice = NULL;
            pliant_error err = {""};
            exhaust_after(n);
            status = pliant_lattice_create(f.model, width, &lattice, &err);
            exhaust_never();
            if (status < 0) {
                assert_int_equal(status, PLIANT_ERR_MEMORY);
                assert_null(lattice);
                assert_true(strlen(err.text) > 0);
            }
            pliant_lattice_destroy(lattice);
            assert_int_equal(blocks_held(), before);
            assert_true(status >= 0 || n < 1000);
        }
        assert_int_equal(status, PLIANT_OK);
    }
    pliant_lattice *lattice = lattice_of(&f, 0);
    const long held = blocks_held();
    pliant_status status = PLIANT_ERR_MEMORY;
    pliant_body_def def = pliant_body_default();
    def.strain_limit = 1;
    long n = 0;
    for (; status == PLIANT_ERR_MEMORY; n++) {
        pliant_body *body = NULL;
        pliant_error err = {""};
        exhaust_after(n);
        status = pliant_body_create(lattice, &def, &body, &err);
        exhaust_never();
        if (status < 0) assert_null(body);
        pliant_body_destroy(body);
        assert_int_equal(blocks_held(), held);
    }
    assert_int_equal(status, PLIANT_OK);
    check_at_least((double)n, 5);
    pliant_lattice_destroy(lattice);
    close_lattice(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_files_half_width_is_that_half_width_laid_out_anew),
        cmocka_unit_test(lattices_say_what_they_are),
        cmocka_unit_test(the_nearest_particle_is_found),
        cmocka_unit_test(half_widths_out_of_range_are_refused),
        cmocka_unit_test(files_without_a_lattice_are_refused),
        cmocka_unit_test(regions_that_are_not_mutual_are_refused),
        cmocka_unit_test(memory_may_run_out_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
