// test_pieces.c: what of a body holds together, and which of its surface does.
#include "check.h"
#include "lattice/body.h"
#include "pliant/pliant.h"
#include "synthetic_lattice.h"

#include <stdlib.h>
#include <unistd.h>

typedef struct opened {
    char path[64];
    pliant_model *model;
    pliant_lattice *lattice;
    pliant_body *body;
    pliant_lattice_info info;
    int32_t *piece;
} opened;

static opened open_body(check_cells shape, int32_t size, float strain_limit)
{
    opened o = {.path = "/tmp/pliant-pieces-XXXXXX"};
    const int fd = mkstemp(o.path);
    assert_true(fd >= 0);
    close(fd);
    check_write_lattice(o.path, shape, size, 1);
    pliant_error err;
    check_ok(pliant_model_open(o.path, &o.model, &err), &err);
    check_ok(pliant_lattice_create(o.model, 0, &o.lattice, &err), &err);
    pliant_body_def def = pliant_body_default();
    def.strain_limit = strain_limit;
    check_ok(pliant_body_create(o.lattice, &def, &o.body, &err), &err);
    o.info = pliant_lattice_describe(o.lattice);
    o.piece = malloc((size_t)o.info.particle_count * sizeof *o.piece);
    assert_non_null(o.piece);
    return o;
}

static void close_body(opened *o)
{
    free(o->piece);
    pliant_body_destroy(o->body);
    pliant_lattice_destroy(o->lattice);
    pliant_model_close(o->model);
    unlink(o->path);
}

static void one_body_is_one_piece_and_two_cubes_are_two(void **state)
{
    (void)state;
    opened one = open_body(CHECK_CELLS_COMB, 4, 0);
    assert_int_equal(pliant_body_pieces(one.body, one.piece), 1);
    for (int32_t p = 0; p < one.info.particle_count; p++) assert_int_equal(one.piece[p], 0);
    for (int32_t v = 0; v < one.info.vertex_count; v++)
        assert_int_equal(pliant_body_is_torn(one.body, v), 0);
    assert_int_equal(pliant_body_is_torn(one.body, -1), -1);
    assert_int_equal(pliant_body_is_torn(one.body, one.info.vertex_count), -1);
    close_body(&one);

    opened two = open_body(CHECK_CELLS_TWO, 3, 0);
    assert_int_equal(pliant_body_pieces(two.body, two.piece), 2);
    const float *rest = pliant_lattice_positions(two.lattice);
    for (int32_t p = 0; p < two.info.particle_count; p++)
        assert_int_equal(two.piece[p], rest[3 * p] > 3.5f * (float)two.info.cell_size);
    close_body(&two);
}

// A cube whose upper layers are carried away comes apart between them, and only there.
static void a_cube_pulled_in_two_is_two_pieces_torn_in_between(void **state)
{
    (void)state;
    opened o = open_body(CHECK_CELLS_CUBE, 4, 0.5f);
    const float a = (float)o.info.cell_size, *rest = pliant_lattice_positions(o.lattice);
    pliant_vec3 *x = malloc((size_t)o.info.particle_count * sizeof *x);
    assert_non_null(x);
    pliant_body_positions(o.body, x);
    for (int32_t p = 0; p < o.info.particle_count; p++)
        if (rest[3 * p + 2] > 2.5f * a) x[p].z += 10 * a;
    check_ok(pliant_body_set_positions(o.body, x), NULL);
    // Without the step's matching, which would draw neighbours of the gap into it.
    assert_true(pliant_fracture_break(o.body) > 0);
    assert_true(pliant_body_broken_count(o.body) > 0);
    assert_int_equal(pliant_body_pieces(o.body, o.piece), 2);
    for (int32_t p = 0; p < o.info.particle_count; p++)
        assert_int_equal(o.piece[p], rest[3 * p + 2] > 2.5f * a);
    int32_t torn = 0;
    const double *vertices = pliant_model_positions(o.model);
    for (int32_t v = 0; v < o.info.vertex_count; v++) {
        const double z = vertices[3 * v + 2] / o.info.cell_size;
        torn += pliant_body_is_torn(o.body, v);
        if (z < 1.99 || z > 3.01) assert_int_equal(pliant_body_is_torn(o.body, v), 0);
        if (z > 2.01 && z < 2.99) assert_int_equal(pliant_body_is_torn(o.body, v), 1);
    }
    assert_true(torn > 0);
    free(x);
    close_body(&o);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_body_is_one_piece_and_two_cubes_are_two),
        cmocka_unit_test(a_cube_pulled_in_two_is_two_pieces_torn_in_between),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
