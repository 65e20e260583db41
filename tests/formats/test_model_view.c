// test_model_view.c: no model file binds unless every shape, index and number in it is right.
#include "tiny_write.h"

#include "image.h"
#include "pliant/dense_view.h"
#include "pliant/model_view.h"

#include <limits.h>

// Bind the file's image; a refusal must leave the view as it was.
static pliant_status bind_model(const tiny_file *file, pliant_error *err)
{
    size_t size;
    unsigned char *bytes = image_make(file, &size);
    pliant_reader *reader;
    pliant_model_view view, before;
    memset(&view, 0x5a, sizeof view);
    before = view;
    strcpy(err->text, "");
    pliant_status status = pliant_reader_open_memory(bytes, size, "file", &reader, err);
    check_ok(status, err);
    status = pliant_model_view_bind(reader, &view, err);
    if (status < 0) assert_memory_equal(&view, &before, sizeof view);
    pliant_reader_close(reader);
    free(bytes);
    return status;
}

static pliant_status bind_dense(const tiny_file *file, pliant_error *err)
{
    size_t size;
    unsigned char *bytes = image_make(file, &size);
    pliant_reader *reader;
    pliant_dense_view view;
    pliant_status status = pliant_reader_open_memory(bytes, size, "file", &reader, err);
    check_ok(status, err);
    status = pliant_dense_view_bind(reader, &view, err);
    pliant_reader_close(reader);
    free(bytes);
    return status;
}

static void drop(tiny_file *file, const char *path)
{
    tiny_section *s = tiny_find(file, path);
    free(s->data);
    memmove(s, s + 1, sizeof *s * (size_t)(file->sections + --file->section_count - s));
}

// The tiny lattice: 27 particles of the block, 8 of the lone cell.
static void check_lattice(const pliant_model_view *v, int is_there)
{
    assert_int_equal(v->lattice_cell_count, is_there ? 9 : 0);
    assert_int_equal(v->lattice_particle_count, is_there ? 35 : 0);
    assert_int_equal(v->lattice_half_width, is_there ? 1 : 0);
    assert_int_equal(v->lattice_batch_count, is_there ? 2 : 0);
    assert_int_equal(v->lattice_batch_point_count, is_there ? 54 : 0);
    assert_int_equal(v->lattice_cells != NULL, is_there != 0);
    if (!is_there) return;
    assert_int_equal(v->lattice_dims[0], 5);
    assert_int_equal(v->lattice_dims[1], 3);
    assert_int_equal(v->lattice_dims[2], 3);
    check_near(v->lattice_frame[PLIANT_LATTICE_CELL_SIZE], 1, 0);
    assert_int_equal(v->lattice_summary[PLIANT_LATTICE_COMPONENT_COUNT], 2);
    // Each of the four particles of the lone cell's side, and of the block's facing side, has in
    // its window some that it is not linked to.
    assert_int_equal(v->lattice_region_node_count, 4 + 9);
    check_at_least(v->lattice_plate_node_count, 1);
    assert_int_equal(v->lattice_region_size[0], 8);
    assert_int_equal(v->lattice_region_share[0], 0);
    assert_int_equal(v->lattice_cells[3 * 2], 3);
    assert_int_equal(v->lattice_batch_faces[0], v->face_count - 1);
    assert_int_equal(v->lattice_batch_points[0], 0);
    check_near(v->lattice_vertex_offset[0], 1, 0);
}

static void bound_view_shows_what_was_written(void **state)
{
    (void)state;
    pliant_error err;
    for (int parts = 0; parts < 8; parts++) {
        const int supports = parts & TINY_SUPPORTS;
        tiny_file file;
        size_t size;
        tiny_model_make(3, parts, &file);
        unsigned char *bytes = image_make(&file, &size);
        pliant_reader *reader;
        pliant_model_view v;
        check_ok(pliant_reader_open_memory(bytes, size, "file", &reader, &err), &err);
        check_ok(pliant_model_view_bind(reader, &v, &err), &err);
        assert_int_equal(v.vertex_count, 66);
        assert_int_equal(v.face_count, 128);
        assert_int_equal(v.level_count, 3);
        assert_int_equal(v.free_count + v.fixed_count, 66);
        assert_int_equal(v.has_supports, supports);
        assert_int_equal(v.level_vertex_count[0], 6);
        assert_int_equal(v.level_vertex_count[1], 18);
        assert_int_equal(v.fixed_level_offset[3], v.fixed_count);
        check_near(v.material[1], 0.3, 0);
        assert_int_equal(v.gravity_fixed != NULL, supports);
        assert_int_equal(v.detail_steps, parts & TINY_DETAIL ? 1 : 0);
        assert_int_equal(v.detail_vertex_count, parts & TINY_DETAIL ? 258 : 0);
        assert_int_equal(v.detail_offset != NULL, (parts & TINY_DETAIL) != 0);
        if (v.detail_offset) {
            assert_int_equal(v.detail_level_count[0], 66);
            check_near(v.detail_offset[3 * 257 + 2], (float)sin(3 + 3 * 257 + 2), 0);
            assert_int_equal(v.detail_source_index[0], 5);
        }
        assert_int_equal(v.has_greens, 1);
        check_lattice(&v, parts & TINY_LATTICE);
        for (int block = 0; block < PLIANT_BLOCK_COUNT; block++) {
            const pliant_greens_view *g = &v.greens[block][2];
            assert_null(v.greens[block][0].column_offset);
            assert_int_equal(g->column_offset != NULL, block == 0 || supports);
            if (!g->column_offset) continue;
            assert_int_equal(g->column_count, block & 1 ? v.fixed_count : v.free_count);
            assert_int_equal(g->row_count, block & 2 ? v.fixed_count : v.free_count);
            assert_int_equal(g->column_offset[g->column_count], g->nnz);
            check_near(g->summary[PLIANT_SUMMARY_RMS], 0.015, 0);
            check_near(g->block[5], (float)sin(10 + block + 5), 0);
        }
        pliant_reader_close(reader);
        free(bytes);
        tiny_free(&file);
    }
}

// What is done to a section, and what the refusal must say.
typedef struct damage {
    const char *path;
    int64_t element;  // from the end when negative
    double value;
    const char *reason;
} damage;

static void set_element(tiny_section *s, int64_t element, double value)
{
    const size_t size = pliant_section_type_size(s->def.type);
    const size_t i = element < 0 ? (size_t)((int64_t)(s->bytes / size) + element) : (size_t)element;
    assert_true(i < s->bytes / size);
    switch (s->def.type) {
    case PLIANT_F4: ((float *)s->data)[i] = (float)value; break;
    case PLIANT_F8: ((double *)s->data)[i] = value; break;
    case PLIANT_I4: ((int32_t *)s->data)[i] = (int32_t)value; break;
    case PLIANT_U8: ((uint64_t *)s->data)[i] = (uint64_t)value; break;
    case PLIANT_U1: ((unsigned char *)s->data)[i] = (unsigned char)value; break;
    }
}

static void wrong_numbers_are_refused_by_section_and_element(void **state)
{
    (void)state;
    static const damage cases[] = {
        {"/mesh/vertices", 7, NAN, "/mesh/vertices: element 7: expected a finite number, found nan"},
        {"/mesh/vertices", -1, INFINITY, "/mesh/vertices: element 197: expected a finite number, found inf"},
        {"/mesh/faces", 5, 66, "/mesh/faces: element 5: expected 0 to 65, found 66"},
        {"/mesh/faces", -1, -1, "/mesh/faces: element 383: expected 0 to 65, found -1"},
        {"/mesh/faces", 0, INT_MIN, "/mesh/faces: element 0: expected 0 to 65, found -2147483648"},
        {"/mesh/level_count", 0, 0, "/mesh/level_count: element 0: expected 1 to 66, found 0"},
        {"/mesh/level_count", 1, 6, "/mesh/level_count: element 1: expected 7 to 66, found 6"},
        {"/mesh/level_count", 2, 67, "/mesh/level_count: element 2: expected 19 to 66, found 67"},
        {"/mesh/level_count", 2, 65, "/mesh/level_count: finest level: expected 66 vertices, found 65"},
        {"/mesh/level_count", 0, 5, "/mesh/parents: expected length 61 along axis 0, found 60"},
        {"/mesh/parents", 0, 6, "/mesh/parents: vertex 6 of level 1: expected two vertices below 6, found 6"},
        {"/mesh/parents", 1, 0, "/mesh/parents: vertex 6 of level 1: expected two vertices below 6, found 0 and 0"},
        {"/mesh/parents", 0, -1, "/mesh/parents: vertex 6 of level 1"},
        {"/mesh/parents", -1, 65, "/mesh/parents: vertex 65 of level 2: expected two vertices below 18"},
        {"/mesh/source_index", 3, -2, "/mesh/source_index: element 3: expected -1 to 2147483647, found -2"},
        {"/material", 0, 0, "/material: expected young > 0"},
        {"/material", 1, 0.5, "/material: "},
        {"/material", 1, -1, "/material: "},
        {"/material", 2, -1, "/material: "},
        {"/material", 2, INFINITY, "/material: element 2: expected a finite number"},
        {"/domains/free/nodes", 4, 3, "/domains/free/nodes: element 4: expected "},
        {"/domains/free/nodes", -1, 66, "/domains/free/nodes: element 52: expected "},
        {"/domains/fixed/nodes", 0, 4, "/domains: vertex 4: expected in one domain, found in 2"},
        {"/domains/fixed/nodes", 0, 6, "/domains: vertex 5: expected in one domain, found in 0"},
        {"/domains/free/level_offset", 0, 1, "/domains/free/level_offset: element 0: expected 0, found 1"},
        {"/domains/free/level_offset", 2, 3, "/domains/free/level_offset: element 2: expected "},
        {"/domains/fixed/level_offset", -1, 3, "/domains/fixed/level_offset: element 3: expected 13, found 3"},
        {"/body/gravity/free", 10, NAN, "/body/gravity/free: element 10: expected a finite number"},
        {"/body/gravity/fixed", -1, INFINITY, "/body/gravity/fixed: element 116: expected a finite number"},
        {"/provenance/text", 3, 0, "/provenance/text: byte 3: expected UTF-8 text, found 0x00"},
        {"/provenance/text", 3, 0x1b, "/provenance/text: byte 3: expected UTF-8 text, found 0x1b"},
        {"/provenance/text", 3, 0xff, "/provenance/text: byte 3: expected UTF-8 text, found 0xff"},
        {"/greens/free-free/level2/column_offset", 0, 1, "/greens/free-free/level2/column_offset: element 0: expected exactly 0, found 1"},
        {"/greens/free-free/level2/column_offset", -1, 5, "column_offset: element 53: expected exactly 937, found 5"},
        {"/greens/free-free/level2/column_offset", 3, 1e18, "column_offset: element 3: expected at most 937, found "},
        {"/greens/free-free/level2/column_offset", 3, 0, "column_offset: element 3: expected at least 36, found 0"},
        {"/greens/free-free/level2/row", 0, -1, "row: element 0 (column 0): expected 0 to 52, found -1"},
        {"/greens/free-free/level2/row", -1, 53, "row: element 936 (column 52): expected "},
        {"/greens/free-free/level2/row", 2, 3, "row: element 2 (column 0): expected 4 to 52, found 3"},
        {"/greens/fixed-free/level2/row", 1, 13, "/greens/fixed-free/level2/row: element 1 (column 0): expected 1 to 12, found 13"},
        {"/greens/free-fixed/level2/block", 17, NAN, "/greens/free-fixed/level2/block: element 17: expected a finite number"},
        {"/greens/fixed-fixed/level2/block", -1, -INFINITY, "/greens/fixed-fixed/level2/block: element 512: expected a finite"},
        {"/greens/free-free/level2/summary", 1, 2, "/greens/free-free/level2/summary: element 1: expected 0 or 1, found 2"},
        {"/greens/free-free/level2/summary", 2, 0.5, "summary: element 2: expected 0 or 1, found 0.5"},
        {"/greens/free-free/level2/summary", 3, -1, "summary: element 3: expected 0 or 1, found -1"},
        {"/greens/free-free/level2/summary", 4, NAN, "summary: element 4: expected a finite number"},
        {"/detail/level_count", 0, 65, "/detail/level_count: element 0: expected 66 vertices, found 65"},
        {"/detail/level_count", 1, 257, "/detail/level_count: element 1: expected 258 vertices, found 257"},
        {"/detail/level_count", 1, -1, "/detail/level_count: element 1: expected 258 vertices, found -1"},
        {"/detail/offset", 100, NAN, "/detail/offset: element 100: expected a finite number, found nan"},
        {"/detail/source_index", 3, 1, "/detail/source_index: element 3: expected 2 as in /mesh/source_index, found 1"},
        {"/detail/source_index", -1, -2, "/detail/source_index: element 257: expected -1 to 2147483647, found -2"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        pliant_error err;
        tiny_file file;
        tiny_model_make(3, TINY_SUPPORTS | TINY_DETAIL | TINY_LATTICE, &file);
        set_element(tiny_find(&file, cases[i].path), cases[i].element, cases[i].value);
        const pliant_status status = bind_model(&file, &err);
        if (status != PLIANT_ERR_FORMAT) fail_msg("%s[%d] = %g: status %d", cases[i].path, (int)cases[i].element, cases[i].value, status);
        check_contains(err.text, cases[i].reason);
        tiny_free(&file);
    }
}

// Every section in turn of another type, rank or shape, or absent.
static void wrong_shapes_and_absent_sections_are_refused_by_name(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    tiny_model_make(2, TINY_SUPPORTS | TINY_DETAIL | TINY_LATTICE, &file);
    const int32_t count = file.section_count;
    tiny_free(&file);
    for (int32_t i = 0; i < count; i++) {
        for (int change = 0; change < 5; change++) {
            tiny_model_make(2, TINY_SUPPORTS | TINY_DETAIL | TINY_LATTICE, &file);
            tiny_section *s = &file.sections[i];
            char path[PLIANT_PATH_LIMIT + 10];
            snprintf(path, sizeof path, "%s", s->def.path);
            const size_t size = pliant_section_type_size(s->def.type);
            pliant_status expected = PLIANT_ERR_FORMAT;
            if (change == 0) {
                s->def.type = s->def.type == PLIANT_F4 ? PLIANT_I4 : PLIANT_F4;
                free(s->data);
                tiny_array(s);
            } else if (change == 1 && s->def.rank < 3) {
                s->def.rank++;
            } else if (change == 2 && s->bytes > size) {
                s->bytes -= s->bytes / s->def.shape[0];
                s->def.shape[0]--;
                // Any length of text will do, and so may a region less. The number of faces is the hierarchy's to check, but
                // levels of detail are counted from it.
                if (strcmp(path, "/provenance/text") == 0 || strcmp(path, "/lattice/region_nodes") == 0)
                    expected = PLIANT_OK;
            } else if (change == 3 && s->def.rank > 1) {
                s->bytes -= s->bytes / s->def.shape[1];
                s->def.shape[1]--;
            } else if (change == 4) {
                drop(&file, path);
                expected = PLIANT_ERR_MISSING;
            } else {
                tiny_free(&file);
                continue;
            }
            const pliant_status status = bind_model(&file, &err);
            if (status != expected) fail_msg("%s, change %d: status %d, %s", path, change, status, err.text);
            // A shorter list of nodes, levels or faces may show in the sections that depend on it.
            if (status < 0 && change != 2) check_contains(err.text, path);
            tiny_free(&file);
        }
    }
}

static void fixed_blocks_come_all_or_none(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    tiny_model_make(1, 1, &file);
    drop(&file, "/greens/fixed-free/level0/column_offset");
    drop(&file, "/greens/fixed-free/level0/row");
    drop(&file, "/greens/fixed-free/level0/block");
    drop(&file, "/greens/fixed-free/level0/summary");
    assert_int_equal(bind_model(&file, &err), PLIANT_ERR_MISSING);
    check_contains(err.text, "/greens/fixed-free/level0/column_offset: expected this section, found none");
    tiny_free(&file);

    tiny_model_make(1, 0, &file);
    for (int i = 0; i < 4; i++) drop(&file, file.sections[file.section_count - 1].def.path);
    assert_int_equal(bind_model(&file, &err), PLIANT_ERR_MISSING);
    check_contains(err.text, "/greens/free-free: expected the columns of a level");
    tiny_free(&file);
}

// Rows of a layout with several levels, and a section that this version does not know.
static void several_levels_and_unknown_sections_are_accepted(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    tiny_model_make(2, 0, &file);
    const int32_t base_columns = ((int32_t *)tiny_find(&file, "/domains/free/level_offset")->data)[1];
    const pliant_section_def more[] = {
        {"/greens/free-free/level0/column_offset", PLIANT_U8, 1, {(uint64_t)base_columns + 1, 1, 1}},
        {"/greens/free-free/level0/row", PLIANT_I4, 1, {0, 1, 1}},
        {"/greens/free-free/level0/block", PLIANT_F4, 3, {0, 3, 3}},
        {"/greens/free-free/level0/summary", PLIANT_F8, 1, {8, 1, 1}},
        {"/later/cells", PLIANT_I4, 1, {2, 1, 1}},
    };
    for (size_t i = 0; i < sizeof more / sizeof *more; i++) {
        tiny_section *s = &file.sections[file.section_count++];
        s->def = more[i];
        tiny_array(s);
    }
    check_ok(bind_model(&file, &err), &err);
    set_element(tiny_find(&file, "/greens/free-free/level0/column_offset"), 1, 1);
    assert_int_equal(bind_model(&file, &err), PLIANT_ERR_FORMAT);
    check_contains(err.text, "level0/column_offset: element 1: expected at most 0, found 1");
    tiny_free(&file);
}

// Levels of detail that no int32_t numbers, and detail of the wrong depth.
static void impossible_detail_is_refused(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    tiny_model_make(3, TINY_DETAIL, &file);
    tiny_section *levels = tiny_find(&file, "/detail/level_count");
    free(levels->data);
    levels->def.shape[0] = 14;
    int32_t *count = tiny_array(levels);
    // 128 faces of level 2, four times as many each.
    int64_t vertices = 66, faces = 128;
    for (int i = 0; i < 14; i++, vertices += faces / 2 * 3, faces *= 4) count[i] = (int32_t)vertices;
    assert_int_equal(bind_model(&file, &err), PLIANT_ERR_FORMAT);
    check_contains(err.text, "/detail/level_count: element 12: expected at most 536870912 faces, found 2147483648");
    levels->def.shape[0] = 15;
    free(levels->data);
    tiny_array(levels);
    assert_int_equal(bind_model(&file, &err), PLIANT_ERR_FORMAT);
    check_contains(err.text, "/detail/level_count: expected length 2 to 14, found 15");
    tiny_free(&file);
}

static void dense_and_model_files_are_told_apart(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    tiny_dense_make(1, &file);
    assert_int_equal(bind_model(&file, &err), PLIANT_ERR_MISSING);
    check_contains(err.text, "not a model: expected /mesh/vertices, found a dense file");
    tiny_free(&file);
    tiny_model_make(1, 0, &file);
    assert_int_equal(bind_dense(&file, &err), PLIANT_ERR_MISSING);
    check_contains(err.text, "not a dense file: expected /dense/nodes, found none");
    tiny_free(&file);
}

static void dense_files_are_checked_alike(void **state)
{
    (void)state;
    static const damage cases[] = {
        {"/dense/nodes", 0, 1, "/dense/nodes: element 1: expected 2 to "},
        {"/dense/nodes", 0, -1, "/dense/nodes: element 0: expected 0 to "},
        {"/dense/fixed-nodes", 0, 4, "/dense/fixed-nodes: element 0: expected a vertex that is not free, found 4"},
        {"/dense/free-free", 100, NAN, "/dense/free-free: element 100: expected a finite number"},
        {"/dense/free-fixed", -1, INFINITY, "/dense/free-fixed: element 71"},
        {"/dense/gravity-free", -1, NAN, "/dense/gravity-free: element 35"},
    };
    pliant_error err;
    tiny_file file;
    for (int supports = 0; supports < 2; supports++) {
        tiny_dense_make(supports, &file);
        check_ok(bind_dense(&file, &err), &err);
        tiny_free(&file);
    }
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tiny_dense_make(1, &file);
        set_element(tiny_find(&file, cases[i].path), cases[i].element, cases[i].value);
        assert_int_equal(bind_dense(&file, &err), PLIANT_ERR_FORMAT);
        check_contains(err.text, cases[i].reason);
        tiny_free(&file);
    }
    tiny_dense_make(1, &file);
    drop(&file, "/dense/fixed-fixed");
    assert_int_equal(bind_dense(&file, &err), PLIANT_ERR_MISSING);
    check_contains(err.text, "/dense/fixed-fixed: expected this section");
    tiny_free(&file);
    tiny_dense_make(1, &file);
    tiny_find(&file, "/dense/free-free")->def.shape[1] = 11;
    tiny_find(&file, "/dense/free-free")->bytes = 12 * 11 * 8;
    assert_int_equal(bind_dense(&file, &err), PLIANT_ERR_FORMAT);
    check_contains(err.text, "/dense/free-free: expected length 12 along axis 1, found 11");
    tiny_free(&file);
}

// Bytes of format version 1, kept for ever, as writers of their time left them.
static void check_golden(const char *name, int32_t level_count, int parts)
{
    pliant_error err;
    pliant_reader *reader;
    pliant_model_view v;
    tiny_file file;
    const char *folder = getenv("PLIANT_TEST_DATA");
    char path[600];
    snprintf(path, sizeof path, "%s/%s", folder ? folder : "tests/data", name);
    check_ok(pliant_reader_open(path, &reader, &err), &err);
    check_ok(pliant_reader_verify(reader, &err), &err);
    check_ok(pliant_model_view_bind(reader, &v, &err), &err);
    assert_int_equal(v.vertex_count, 18);
    assert_int_equal(v.has_supports, (parts & TINY_SUPPORTS) != 0);
    assert_int_equal(v.has_greens, !(parts & TINY_NO_GREENS));
    check_lattice(&v, parts & TINY_LATTICE);
    tiny_model_make(level_count, parts, &file);
    for (int32_t i = 0; i < file.section_count; i++) {
        const pliant_section *s = pliant_reader_find(reader, file.sections[i].def.path);
        assert_non_null(s);
        assert_int_equal(s->bytes, file.sections[i].bytes);
        // The sines may differ in their last bit from one libm to the next.
        if (s->type == PLIANT_F4 || s->type == PLIANT_F8) continue;
        assert_memory_equal(s->data, file.sections[i].data, s->bytes);
    }
    tiny_free(&file);
    pliant_reader_close(reader);
}

// The first writer's.
static void file_of_version_1_still_opens(void **state)
{
    (void)state;
    check_golden("v1_tiny.h5", 2, TINY_SUPPORTS);
}

static void lattice_of_version_1_still_opens(void **state)
{
    (void)state;
    check_golden("v1_lattice.h5", 2, TINY_LATTICE | TINY_NO_GREENS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bound_view_shows_what_was_written),
        cmocka_unit_test(wrong_numbers_are_refused_by_section_and_element),
        cmocka_unit_test(wrong_shapes_and_absent_sections_are_refused_by_name),
        cmocka_unit_test(fixed_blocks_come_all_or_none),
        cmocka_unit_test(several_levels_and_unknown_sections_are_accepted),
        cmocka_unit_test(impossible_detail_is_refused),
        cmocka_unit_test(dense_and_model_files_are_told_apart),
        cmocka_unit_test(dense_files_are_checked_alike),
        cmocka_unit_test(file_of_version_1_still_opens),
        cmocka_unit_test(lattice_of_version_1_still_opens),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
