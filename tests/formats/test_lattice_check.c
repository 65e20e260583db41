// test_lattice_check.c: lattices of all sorts of cells bind, and no damaged one does.
#include "tiny_write.h"

#include "image.h"
#include "pliant/model_view.h"
#include "pliant/pliant.h"
#include "surfaces.h"
#include "synthetic_lattice.h"
#include "synthetic_model.h"

#include <limits.h>

// Every edge of a closed mesh is walked once in each direction: no pair (a, b) twice, each (b, a).
static void check_closed(const pliant_mesh *mesh)
{
    pliant_hierarchy *h = NULL;
    pliant_error err = {""};
    const int32_t none = 0;
    check_ok(pliant_hierarchy_create(1, &mesh->vertex_count, mesh->face_count, mesh->faces, &none,
                                     &h, &err),
             &err);
    pliant_hierarchy_destroy(h);
}

static void check_positions(const check_lattice *l)
{
    const double a = l->frame[PLIANT_LATTICE_CELL_SIZE];
    for (int32_t v = 0; v < l->mesh->vertex_count; v++)
        for (size_t d = 0; d < 3; d++) {
            const size_t i = 3 * (size_t)v + d;
            const int32_t cell = l->cells[3 * (size_t)l->vertex_cell[v] + d];
            check_near(l->frame[d] + a * (cell + (double)l->vertex_offset[i]), l->mesh->vertices[i],
                       1e-6 * a * (cell + 1));
        }
}

// The surface of cells encloses them, less what the inset takes; without one, exactly.
static void lattices_of_any_cells_open_and_hold_a_closed_surface(void **state)
{
    (void)state;
    static const int32_t widths[] = {1, 2, 5, 15}, sizes[] = {5, 12, 6, 3};
    pliant_error err = {""};
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++)
        for (size_t i = 0; i < sizeof widths / sizeof *widths; i++) {
            check_lattice *l =
                check_lattice_create(&(check_lattice_def){.shape = shape,
                                                          .size = sizes[i],
                                                          .half_width = widths[i],
                                                          .cell_size = 0.5,
                                                          .origin = {1, -2, 3},
                                                          .inset = i == 0 ? 0x1p-40 : 0.25,
                                                          .is_shell = shape == CHECK_CELLS_SHELL});
            const char *path = scratch("cells.h5");
            check_lattice_write(l, path);
            pliant_model *model = NULL;
            check_ok(pliant_model_open(path, &model, &err), &err);
            check_ok(pliant_model_verify(model, &err), &err);
            const pliant_model_info info = pliant_model_describe(model);
            assert_int_equal(info.vertex_count, l->mesh->vertex_count);
            assert_int_equal(info.face_count, l->mesh->face_count);
            assert_int_equal(info.free_count, 0);
            pliant_model_close(model);
            check_closed(l->mesh);
            check_positions(l);
            const double volume = pliant_mesh_volume(l->mesh), whole = l->layout.cell_count * 0.125;
            if (i == 0) check_near(volume, whole, 1e-9 * whole);
            else check_at_most(volume, whole);
            check_at_least(volume, 0);
            check_lattice_destroy(l);
        }
}

static void a_file_with_a_lattice_alone_has_no_solvers(void **state)
{
    (void)state;
    pliant_error err = {""};
    const char *path = scratch("alone.h5");
    check_write_lattice(path, CHECK_CELLS_CUBE, 2, 1);
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    pliant_exchange *exchange = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    assert_int_equal(pliant_solver_create(model, NULL, &solver, &err), PLIANT_ERR_MISSING);
    check_contains(err.text,
                   "alone.h5: expected Green's functions, found a lattice only (made with "
                   "--no-greens)");
    assert_null(solver);
    assert_int_equal(pliant_exchange_create(model, NULL, &exchange, &err), PLIANT_ERR_MISSING);
    assert_null(exchange);
    const pliant_model_info info = pliant_model_describe(model);
    assert_int_equal(info.vertex_count, 26 + 24);
    assert_int_equal(info.face_count, 96);
    assert_int_equal(info.free_count + info.fixed_count + info.has_supports, 0);
    check_near(info.rms + info.max + info.factor, 0, 0);
    const pliant_level_info level = pliant_model_level(model, 0);
    assert_int_equal(level.vertex_count, 50);
    assert_int_equal(level.column_count, 0);
    assert_int_equal(pliant_model_is_free(model, 3), -1);
    assert_int_equal(pliant_model_nearest(model, (const double[3]){0}), -1);
    check_at_least(pliant_model_area(model, 0), 1e-3);
    check_at_least(pliant_model_node_area(model, (pliant_node){0, 0}), 1e-3);
    pliant_model_close(model);
}

// Green's functions and a lattice in one file: each as it is alone.
static void a_file_has_both(void **state)
{
    (void)state;
    pliant_error err = {""};
    const char *path = scratch("both.h5");
    check_synthetic *s = check_synthetic_create(
        &(check_synthetic_def){.levels = 2, .wavelet = pliant_wavelet_default()});
    check_lattice_def def = {.half_width = 2, .cell_size = 2.0 / 6, .mesh = s->surface.mesh};
    int32_t *cells = check_ball_cells(6, &def.cell_count, def.origin);
    def.cells = cells;
    check_lattice *l = check_lattice_create(&def);
    check_positions(l);
    s->lattice = l;
    check_synthetic_write(s, path);
    pliant_reader *reader = NULL;
    pliant_model_view v;
    check_ok(pliant_reader_open(path, &reader, &err), &err);
    check_ok(pliant_model_view_bind(reader, &v, &err), &err);
    assert_int_equal(v.has_greens, 1);
    assert_int_equal(v.lattice_particle_count, l->layout.particle_count);
    assert_memory_equal(v.lattice_particles, l->particles,
                        sizeof(int32_t) * 3 * (size_t)l->layout.particle_count);
    assert_memory_equal(v.lattice_vertex_tangents, l->vertex_tangents,
                        sizeof(float) * 6 * (size_t)v.vertex_count);
    pliant_reader_close(reader);
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    check_ok(pliant_model_open(path, &model, &err), &err);
    check_ok(pliant_solver_create(model, NULL, &solver, &err), &err);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
    check_lattice_destroy(l);
    free(cells);
    check_synthetic_destroy(s);
}

// ---- Damage ----

static pliant_status bind(const tiny_file *file, pliant_error *err)
{
    size_t size;
    unsigned char *bytes = image_make(file, &size);
    pliant_reader *reader;
    pliant_model_view view, before;
    memset(&view, 0x5a, sizeof view);
    before = view;
    check_ok(pliant_reader_open_memory(bytes, size, "file", &reader, err), err);
    const pliant_status status = pliant_model_view_bind(reader, &view, err);
    if (status < 0) assert_memory_equal(&view, &before, sizeof view);
    pliant_reader_close(reader);
    free(bytes);
    return status;
}

static void set_element(tiny_section *s, int64_t element, double value)
{
    const size_t size = pliant_section_type_size(s->def.type);
    const size_t i = element < 0 ? (size_t)((int64_t)(s->bytes / size) + element) : (size_t)element;
    assert_true(i < s->bytes / size);
    if (s->def.type == PLIANT_F4) ((float *)s->data)[i] = (float)value;
    if (s->def.type == PLIANT_F8) ((double *)s->data)[i] = value;
    if (s->def.type == PLIANT_I4) ((int32_t *)s->data)[i] = (int32_t)value;
}

// The tiny lattice: cells of a 2 x 2 x 2 block and (3, 0, 0); rows of 4 numbers for region nodes,
// 6 for plate nodes. Particles 0 .. 4 are (0 .. 4, 0, 0).
static void damaged_lattices_are_refused_by_section_and_element(void **state)
{
    (void)state;
    static const struct {
        const char *path;
        int64_t element;  // from the end when negative
        double value;
        const char *reason;
    } cases[] = {
        {"frame", 0, NAN, "frame: element 0: expected a finite number, found nan"},
        {"frame", 7, INFINITY, "frame: element 7: expected a finite number, found inf"},
        {"frame", 3, 0, "frame: element 3: expected a number above 0, found 0"},
        {"frame", 4, -1, "frame: element 4: expected a number above 0, found -1"},
        {"frame", 3, 1e38, "frame: element 3: expected 1e-9 to 1e9, found 1e+38"},
        {"frame", 3, 1e-10, "frame: element 3: expected 1e-9 to 1e9, found 1e-10"},
        {"frame", 1, -1e39, "frame: element 1: expected positions that a float holds"},
        {"summary", 0, 0, "summary: element 0 (half-width): expected 1 to 15, found 0"},
        {"summary", 0, 16, "summary: element 0 (half-width): expected 1 to 15, found 16"},
        {"summary", 0, 2, "region_nodes: expected length 6 along axis 1, found 4"},
        {"summary", 1, 2, "summary: element 1: expected 0 to 1, found 2"},
        {"summary", 2, 0, "summary: element 2: expected 1 to 9, found 0"},
        {"summary", 3, 36, "summary: element 3: expected 1 to 35, found 36"},
        {"summary", 3, 1, "summary: element 3: expected "},
        {"cells", 0, -1, "cells: element 0: expected 0 to 1022, found -1"},
        {"cells", -1, 1023, "cells: element 26: expected 0 to 1022, found 1023"},
        {"cells", -1, INT_MIN, "cells: element 26: expected 0 to 1022, found -2147483648"},
        {"cells", 3, 0, "cells: row 1: expected to come after row 0 by (z, y, x), found (0, 0, 0)"},
        {"cells", 2, 1, "cells: row 1: expected to come after row 0 by (z, y, x), found (1, 0, 0)"},
        {"cells", 6, 4, "particles: row 3: expected a corner of a cell, found (3, 0, 0)"},
        {"particles", 0, -1, "particles: element 0: expected 0 to 1023, found -1"},
        {"particles", -1, 1024, "particles: element 104: expected 0 to 1023, found 1024"},
        {"particles", 12, 5, "particles: row 4: expected corner 1 of cell 2 before it, found none"},
        {"particles", -3, 3,
         "particles: row 34: expected corner 7 of cell 8 before it, found none"},
        {"mass", 3, 0, "mass: element 3: expected a finite number above 0, found 0"},
        {"mass", -1, NAN, "mass: element 34: expected a finite number above 0, found nan"},
        {"mass", 0, INFINITY, "mass: element 0: expected a finite number above 0, found inf"},
        {"region_size", 0, 0, "region_size: element 0: expected 1 to 35, found 0"},
        {"region_size", -1, 36, "region_size: element 34: expected 1 to 35, found 36"},
        {"region_size", 4, 7, "region_size: element 4: expected 8 to 8, found 7"},
        {"region_share", 0, 1, "region_share: element 0: expected 0 to 0, found 1"},
        {"region_share", 2, -1, "region_share: element 2: expected 0 to 2, found -1"},
        {"region_share", -1, 4,
         "region_share: element 34: expected a particle that shares with itself"},
        {"region_nodes", 0, -1, "region_nodes: element 0: expected 0 to 34, found -1"},
        {"region_nodes", -4, 35, "region_nodes: element 48: expected "},
        {"region_nodes", 4, 2, "region_nodes: element 4: expected 3 to 34, found 2"},
        {"region_nodes", 1, -2, "region_nodes: element 1: expected -1 to -1, found -2"},
        {"region_nodes", 1, 0, "region_nodes: element 1: expected -1 to -1, found 0"},
        {"region_nodes", 2, -3, "region_nodes: element 2: expected -2 to "},
        {"region_nodes", 2, 1000, "region_nodes: element 2: expected -2 to "},
        {"region_nodes", 2, 2,
         "region_nodes: element 2: expected a plate node at (2, 0, 0), found node 2 at "},
        {"plate_nodes", 0, 5, "plate_nodes: element 0: expected 0 to 4, found 5"},
        {"plate_nodes", 1, -1, "plate_nodes: element 1: expected 0 to 2, found -1"},
        {"plate_nodes", 2, 3, "plate_nodes: element 2: expected 0 to 2, found 3"},
        {"plate_nodes", 2, 1,
         "region_nodes: element 2: expected a plate node at (2, 0, 0), found node 0 at (2, 0, 1)"},
        {"plate_nodes", 4, 8, "plate_nodes: element 4: expected bits 0 to 2 and 31, found 0x8"},
        {"plate_nodes", 3, 1, "plate_nodes: element 3: expected some of 0, found 0x1"},
        {"plate_nodes", 4, INT_MIN,
         "plate_nodes: element 4: expected all of 0x7, found 0x80000000"},
        {"plate_nodes", 4, INT_MIN + 3,
         "plate_nodes: element 4: expected all of 0x7, found 0x80000003"},
        {"vertex_cell", 5, 9, "vertex_cell: element 5: expected 0 to 8, found 9"},
        {"vertex_cell", 0, -1, "vertex_cell: element 0: expected 0 to 8, found -1"},
        {"vertex_offset", 7, 1.0001, "vertex_offset: element 7: expected 0 to 1, found 1.0001"},
        {"vertex_offset", -1, -1e-9, "vertex_offset: element 197: expected 0 to 1, found -1e-09"},
        {"vertex_offset", 0, NAN, "vertex_offset: element 0: expected 0 to 1, found nan"},
        {"vertex_tangents", 1, NAN, "vertex_tangents: vertex 0: expected two unit vectors"},
        {"vertex_tangents", -1, INFINITY, "vertex_tangents: vertex 65: expected two unit vectors"},
        {"vertex_tangents", 6, 0.5,
         "vertex_tangents: vertex 1: expected two unit vectors at a right angle"},
        {"batch_face_offset", 0, 1, "batch_face_offset: element 0: expected 0 to 0, found 1"},
        {"batch_face_offset", 1, -1, "batch_face_offset: element 1: expected 0 to 128, found -1"},
        {"batch_face_offset", 1, 129, "batch_face_offset: element 1: expected 0 to 128, found 129"},
        {"batch_face_offset", 2, 127,
         "batch_face_offset: element 2: expected 128 to 128, found 127"},
        {"batch_faces", 0, 128, "batch_faces: element 0: expected 0 to 127, found 128"},
        {"batch_faces", 1, 127,
         "batch_faces: element 1: expected a face that is not in a batch yet, found 127"},
        {"batch_faces", -1, -1, "batch_faces: element 127: expected 0 to 127, found -1"},
        {"batch_point_offset", 0, 1, "batch_point_offset: element 0: expected 0 to 0, found 1"},
        {"batch_point_offset", 1, 55, "batch_point_offset: element 1: expected 0 to 54, found 55"},
        {"batch_point_offset", 2, 53, "batch_point_offset: element 2: expected 54 to 54, found 53"},
        {"batch_points", 0, -1, "batch_points: element 0: expected 0 to 34, found -1"},
        {"batch_points", -1, 35, "batch_points: element 53: expected "},
        {"batch_points", 2, 1, "batch_points: element 2: expected 2 to 34, found 1"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int parts = TINY_LATTICE; parts <= (TINY_LATTICE | TINY_NO_GREENS);
             parts += TINY_NO_GREENS) {
            pliant_error err = {""};
            tiny_file file;
            char path[PLIANT_PATH_LIMIT];
            snprintf(path, sizeof path, "/lattice/%s", cases[i].path);
            tiny_model_make(3, parts, &file);
            set_element(tiny_find(&file, path), cases[i].element, cases[i].value);
            const pliant_status status = bind(&file, &err);
            if (status != PLIANT_ERR_FORMAT)
                fail_msg("%s[%d] = %g: status %d", path, (int)cases[i].element, cases[i].value,
                         status);
            check_contains(err.text, cases[i].reason);
            tiny_free(&file);
        }
}

static void drop(tiny_file *file, const char *path)
{
    tiny_section *s = tiny_find(file, path);
    free(s->data);
    memmove(s, s + 1, sizeof *s * (size_t)(file->sections + --file->section_count - s));
}

static void a_lattice_is_stored_whole_or_not_at_all(void **state)
{
    (void)state;
    pliant_error err = {""};
    tiny_file file;
    tiny_model_make(2, TINY_LATTICE | TINY_NO_GREENS, &file);
    const int32_t count = file.section_count;
    tiny_free(&file);
    for (int32_t i = 0; i < count; i++) {
        tiny_model_make(2, TINY_LATTICE | TINY_NO_GREENS, &file);
        char path[PLIANT_PATH_LIMIT];
        snprintf(path, sizeof path, "%s", file.sections[i].def.path);
        drop(&file, path);
        assert_int_equal(bind(&file, &err), PLIANT_ERR_MISSING);
        check_contains(err.text, path);
        tiny_free(&file);
    }
    // Neither: the mesh is no model.
    tiny_model_make(2, TINY_LATTICE | TINY_NO_GREENS, &file);
    for (int32_t i = file.section_count; i-- > 0;)
        if (strncmp(file.sections[i].def.path, "/lattice/", 9) == 0)
            drop(&file, file.sections[i].def.path);
    assert_int_equal(bind(&file, &err), PLIANT_ERR_MISSING);
    check_contains(err.text, "file: expected Green's functions or a lattice, found a mesh only");
    tiny_free(&file);
}

// A batch of more particles than a shader has room for.
static void batches_are_bounded(void **state)
{
    (void)state;
    pliant_error err = {""};
    check_lattice *l = check_lattice_create(
        &(check_lattice_def){.shape = CHECK_CELLS_CUBE, .size = 8, .half_width = 1});
    assert_in_range(l->layout.batch_count, 2, l->mesh->face_count);
    for (int32_t b = 0; b < l->layout.batch_count; b++)
        check_at_most(l->batch_point_offset[b + 1] - l->batch_point_offset[b], PLIANT_BATCH_LIMIT);
    // The same particles in fewer, larger batches.
    l->batch_point_offset[1] = PLIANT_BATCH_LIMIT + 1;
    const char *path = scratch("large.h5");
    pliant_reader *reader = NULL;
    pliant_model_view v;
    check_lattice_write(l, path);
    check_ok(pliant_reader_open(path, &reader, &err), &err);
    assert_int_equal(pliant_model_view_bind(reader, &v, &err), PLIANT_ERR_FORMAT);
    check_contains(err.text,
                   "/lattice/batch_point_offset: element 1: expected 0 to 128, found 129");
    pliant_reader_close(reader);
    check_lattice_destroy(l);
}

static void layouts_of_impossible_lattices_are_refused(void **state)
{
    (void)state;
    static const pliant_lattice_layout cases[] = {
        {-1, 8, 1, 0, 0, 1, 8}, {1, 7, 1, 0, 0, 1, 8},
        {1, 8, 0, 0, 0, 1, 8},  {1, 8, 16, 0, 0, 1, 8},
        {1, 8, 1, 9, 0, 1, 8},  {1, 8, 1, 0, -1, 1, 8},
        {1, 8, 1, 0, 0, 0, 8},  {1, 8, 1, 0, 0, 1, 7},
        {0, 0, 0, 0, 0, 0, 0},  {PLIANT_LATTICE_LIMIT + 1, 8, 1, 0, 0, 1, 8},
    };
    pliant_error err = {""};
    pliant_section_def sections[PLIANT_SECTION_LIMIT];
    int32_t count = -7;
    pliant_model_layout layout = {.vertex_count = 6,
                                  .face_count = 8,
                                  .level_count = 1,
                                  .base_count = 6,
                                  .lattice = {1, 8, 1, 0, 0, 1, 8}};
    check_ok(pliant_model_layout_sections(&layout, sections, &count, &err), &err);
    assert_int_equal(count, 7 + 16);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        layout.lattice = cases[i];
        assert_int_equal(pliant_model_layout_sections(&layout, sections, &count, &err),
                         PLIANT_ERR_ARGUMENT);
    }
    assert_int_equal(count, 7 + 16);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lattices_of_any_cells_open_and_hold_a_closed_surface),
        cmocka_unit_test(a_file_with_a_lattice_alone_has_no_solvers),
        cmocka_unit_test(a_file_has_both),
        cmocka_unit_test(damaged_lattices_are_refused_by_section_and_element),
        cmocka_unit_test(a_lattice_is_stored_whole_or_not_at_all),
        cmocka_unit_test(batches_are_bounded),
        cmocka_unit_test(layouts_of_impossible_lattices_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, scratch_clean);
}
