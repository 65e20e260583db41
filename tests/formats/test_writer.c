// test_writer.c: files are written whole or not at all, and the bytes depend on the content alone.
#include "tiny_write.h"

#include "pliant/model_view.h"
#include "pliant/reader.h"

#include <errno.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

// ---- What is written ----

static void check_round_trip(const tiny_file *file, const char *path)
{
    pliant_error err;
    pliant_reader *reader;
    check_ok(tiny_write(file, path, &err), &err);
    check_ok(pliant_reader_open(path, &reader, &err), &err);
    assert_int_equal(pliant_reader_section_count(reader), file->section_count);
    for (int32_t i = 0; i < file->section_count; i++) {
        const tiny_section *expected = &file->sections[i];
        const pliant_section *found = pliant_reader_section(reader, i);
        assert_string_equal(found->path, expected->def.path);
        assert_int_equal(found->type, expected->def.type);
        assert_int_equal(found->rank, expected->def.rank);
        assert_memory_equal(found->shape, expected->def.shape, sizeof found->shape);
        assert_int_equal(found->bytes, expected->bytes);
        assert_int_equal(found->offset % PLIANT_SECTION_ALIGN, 0);
        if (found->bytes > 0) assert_memory_equal(found->data, expected->data, found->bytes);
    }
    check_ok(pliant_reader_verify(reader, &err), &err);
    pliant_reader_close(reader);
}

static void model_comes_back_byte_for_byte(void **state)
{
    (void)state;
    for (int32_t level_count = 1; level_count <= 3; level_count++) {
        for (int supports = 0; supports < 2; supports++) {
            tiny_file file;
            tiny_model_make(level_count, supports, &file);
            check_round_trip(&file, scratch("model.h5"));
            tiny_free(&file);
        }
    }
}

static void dense_file_comes_back_byte_for_byte(void **state)
{
    (void)state;
    for (int supports = 0; supports < 2; supports++) {
        tiny_file file;
        tiny_dense_make(supports, &file);
        check_round_trip(&file, scratch("dense.h5"));
        tiny_free(&file);
    }
}

static void sections_without_elements_have_no_place_and_come_back(void **state)
{
    (void)state;
    pliant_error err;
    pliant_writer *writer;
    pliant_reader *reader;
    const pliant_section_def sections[] = {
        {"/a/rows", PLIANT_I4, 2, {0, 2, 1}},
        {"/a/none", PLIANT_F4, 3, {0, 3, 3}},
        {"/a/one", PLIANT_U1, 1, {1, 1, 1}},
        {"/a/last", PLIANT_F8, 2, {4, 0, 1}},
    };
    const char *path = scratch("empty.h5");
    check_ok(pliant_writer_create(path, sections, 4, &writer, &err), &err);
    check_ok(pliant_writer_write_all(writer, "/a/rows", NULL, &err), &err);
    check_ok(pliant_writer_write_all(writer, "/a/one", "x", &err), &err);
    check_ok(pliant_writer_commit(writer, &err), &err);
    check_ok(pliant_reader_open(path, &reader, &err), &err);
    for (int32_t i = 0; i < 4; i++) {
        const pliant_section *s = pliant_reader_section(reader, i);
        assert_int_equal(s->count, i == 2);
        assert_int_equal(s->offset == 0, i != 2);
        assert_non_null(s->data);
        assert_memory_equal(s->shape, sections[i].shape, sizeof s->shape);
    }
    check_ok(pliant_reader_verify(reader, &err), &err);
    pliant_reader_close(reader);
}

static void boxes_written_in_any_order_make_the_whole(void **state)
{
    (void)state;
    pliant_error err;
    pliant_writer *writer;
    pliant_reader *reader;
    const pliant_section_def section = {"/a", PLIANT_F8, 2, {7, 5, 1}};
    const char *path = scratch("boxes.h5");
    check_ok(pliant_writer_create(path, &section, 1, &writer, &err), &err);
    for (int part = 3; part >= 0; part--) {
        const uint64_t start[3] = {part & 1 ? 3 : 0, part & 2 ? 2 : 0, 0};
        const uint64_t count[3] = {part & 1 ? 4 : 3, part & 2 ? 3 : 2, 1};
        double box[4 * 3];
        for (uint64_t r = 0; r < count[0]; r++)
            for (uint64_t c = 0; c < count[1]; c++)
                box[r * count[1] + c] = (double)(10 * (start[0] + r) + start[1] + c);
        check_ok(pliant_writer_write(writer, "/a", start, count, box, &err), &err);
    }
    check_ok(pliant_writer_commit(writer, &err), &err);
    check_ok(pliant_reader_open(path, &reader, &err), &err);
    const double *x = pliant_reader_section(reader, 0)->data;
    for (int r = 0; r < 7; r++)
        for (int c = 0; c < 5; c++) check_near(x[5 * r + c], 10 * r + c, 0);
    pliant_reader_close(reader);
}

// HDF5 gets large boxes in slices of 16 MiB; this one has two and a bit.
static void large_boxes_are_written_in_slices(void **state)
{
    (void)state;
    pliant_error err;
    pliant_writer *writer;
    pliant_reader *reader;
    const uint64_t rows = 35, columns = 1 << 18;
    const pliant_section_def section = {"/a", PLIANT_I4, 2, {rows, columns, 1}};
    const char *path = scratch("large.h5");
    int32_t *data = malloc(rows * columns * sizeof *data);
    assert_non_null(data);
    for (uint64_t i = 0; i < rows * columns; i++) data[i] = (int32_t)i;
    check_ok(pliant_writer_create(path, &section, 1, &writer, &err), &err);
    check_ok(pliant_writer_write_all(writer, "/a", data, &err), &err);
    check_ok(pliant_writer_commit(writer, &err), &err);
    check_ok(pliant_reader_open(path, &reader, &err), &err);
    assert_memory_equal(pliant_reader_section(reader, 0)->data, data, rows * columns * sizeof *data);
    pliant_reader_close(reader);
    free(data);
}

static void same_content_gives_the_same_bytes(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    tiny_model_make(3, 1, &file);
    const char *a = scratch("a.h5"), *b = scratch("b.h5");
    check_ok(tiny_write(&file, a, &err), &err);
    sleep(1);  // a stored time would now differ
    check_ok(tiny_write(&file, b, &err), &err);
    tiny_free(&file);
    size_t size_a, size_b;
    unsigned char *bytes_a = load(a, &size_a), *bytes_b = load(b, &size_b);
    assert_int_equal(size_a, size_b);
    assert_memory_equal(bytes_a, bytes_b, size_a);
    free(bytes_a);
    free(bytes_b);
}

static int have(const char *tool)
{
    char command[100];
    snprintf(command, sizeof command, "command -v %s >/dev/null 2>&1", tool);
    if (system(command) == 0) return 1;
    printf("skipped: %s is not installed (hdf5-tools)\n", tool);
    return 0;
}

// Everything that a command prints; to be freed.
static char *listen(const char *command)
{
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t length = 0, room = 1 << 16;
    char *text = malloc(room);
    assert_non_null(text);
    for (size_t n; (n = fread(text + length, 1, room - 1 - length, pipe)) > 0;) {
        length += n;
        if (length + 1 == room) text = realloc(text, room *= 2);
        assert_non_null(text);
    }
    text[length] = 0;
    assert_int_equal(pclose(pipe), 0);
    return text;
}

static void h5dump_shows_the_numbers_and_the_attributes(void **state)
{
    (void)state;
    if (!have("h5dump")) skip();
    pliant_error err;
    tiny_file file;
    tiny_model_make(2, 1, &file);
    const char *path = scratch("dump.h5");
    check_ok(tiny_write(&file, path, &err), &err);
    tiny_free(&file);
    char command[700];
    snprintf(command, sizeof command, "h5dump -w 200 '%s' 2>&1", path);
    char *text = listen(command);
    check_contains(text, "DATASET \"faces\"");
    check_contains(text, "ATTRIBUTE \"wavelet\"");
    check_contains(text, "(0): \"butterfly\"");
    check_contains(text, "ATTRIBUTE \"boundary\"");
    check_contains(text, "(0): \"zero\"");
    check_contains(text, "ATTRIBUTE \"eps\"");
    check_contains(text, "ATTRIBUTE \"lifted\"");
    check_contains(text, "ATTRIBUTE \"max\"");
    check_contains(text, "ATTRIBUTE \"factor\"");
    check_contains(text, "ATTRIBUTE \"smallest_eigenvalue\"");
    check_contains(text, "ATTRIBUTE \"rms\"");
    check_contains(text, "(0): 0.015");
    check_contains(text, "ATTRIBUTE \"program\"");
    check_contains(text, "(0): \"pliant-precompute 0.1.0\"");
    check_contains(text, "(0,0): 1, 0, 0,");
    free(text);
}

static void h5repack_makes_a_file_that_is_refused_with_the_reason(void **state)
{
    (void)state;
    if (!have("h5repack")) skip();
    pliant_error err;
    pliant_reader *reader;
    tiny_file file;
    tiny_model_make(2, 0, &file);
    const char *path = scratch("original.h5"), *repacked = scratch("repacked.h5");
    check_ok(tiny_write(&file, path, &err), &err);
    tiny_free(&file);
    char command[1200];
    snprintf(command, sizeof command, "h5repack '%s' '%s'", path, repacked);
    assert_int_equal(system(command), 0);
    assert_int_equal(pliant_reader_open(repacked, &reader, &err), PLIANT_ERR_FORMAT);
    check_contains(err.text, "repacked");
    check_contains(err.text, "pliant-precompute");
}

// ---- What is refused ----

static void incomplete_file_is_not_committed(void **state)
{
    (void)state;
    pliant_error err;
    pliant_writer *writer;
    tiny_file file;
    tiny_model_make(2, 0, &file);
    const char *path = scratch("half.h5"), *temporary = scratch("half.h5.tmp");
    save(path, "old", 3);
    check_ok(tiny_create(&file, path, &writer, &err), &err);
    assert_true(exists(temporary));
    for (int32_t i = 0; i < file.section_count - 1; i++)
        check_ok(pliant_writer_write_all(writer, file.sections[i].def.path, file.sections[i].data, &err), &err);
    assert_int_equal(pliant_writer_commit(writer, &err), PLIANT_ERR_ARGUMENT);
    check_contains(err.text, "/greens/free-free/level1/summary: expected 8 elements written, found 0");
    assert_false(exists(temporary));
    size_t size;
    unsigned char *bytes = load(path, &size);
    assert_int_equal(size, 3);
    free(bytes);

    check_ok(tiny_create(&file, path, &writer, &err), &err);
    pliant_writer_abandon(writer);
    assert_false(exists(temporary));
    assert_true(exists(path));
    tiny_free(&file);
}

static void writes_outside_a_section_are_refused(void **state)
{
    (void)state;
    pliant_error err;
    pliant_writer *writer;
    const pliant_section_def section = {"/a", PLIANT_I4, 2, {4, 3, 1}};
    check_ok(pliant_writer_create(scratch("bounds.h5"), &section, 1, &writer, &err), &err);
    const int32_t data[12] = {0};
    const uint64_t start[3] = {2, 0, 0}, count[3] = {3, 3, 1}, wrapped[3] = {UINT64_MAX, 1, 1};
    assert_int_equal(pliant_writer_write(writer, "/a", start, count, data, &err), PLIANT_ERR_ARGUMENT);
    check_contains(err.text, "/a: expected indices below 4 along axis 0, found 3 from 2");
    assert_int_equal(pliant_writer_write(writer, "/a", start, wrapped, data, &err), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_writer_write(writer, "/b", start, count, data, &err), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_writer_attribute_number(writer, "/missing", "x", 1, &err), PLIANT_ERR_IO);
    check_contains(err.text, "/missing: attribute x: ");
    pliant_writer_abandon(writer);
}

static void impossible_definitions_are_refused(void **state)
{
    (void)state;
    pliant_error err;
    pliant_writer *writer;
    const pliant_section_def bad[] = {
        {"a", PLIANT_I4, 1, {4, 1, 1}},
        {"/a", (pliant_section_type)9, 1, {4, 1, 1}},
        {"/a", PLIANT_I4, 4, {4, 1, 1}},
        {"/a", PLIANT_F8, 3, {1ull << 40, 1ull << 40, 1}},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(pliant_writer_create(scratch("bad.h5"), &bad[i], 1, &writer, &err), PLIANT_ERR_ARGUMENT);
        assert_false(exists(scratch("bad.h5.tmp")));
    }
    const pliant_section_def twice[] = {{"/a", PLIANT_I4, 1, {4, 1, 1}}, {"/a", PLIANT_I4, 1, {4, 1, 1}}};
    assert_int_equal(pliant_writer_create(scratch("bad.h5"), twice, 2, &writer, &err), PLIANT_ERR_IO);
    assert_false(exists(scratch("bad.h5.tmp")));
}

static void unwritable_places_are_refused_with_the_systems_reason(void **state)
{
    (void)state;
    pliant_error err;
    pliant_writer *writer;
    const pliant_section_def section = {"/a", PLIANT_I4, 1, {4, 1, 1}};
    const char *path = scratch("no/folder.h5");
    assert_int_equal(pliant_writer_create(path, &section, 1, &writer, &err), PLIANT_ERR_IO);
    check_contains(err.text, path);
    check_contains(err.text, strerror(ENOENT));
    path = scratch("folder.h5");
    mkdir(path, 0777);
    assert_int_equal(pliant_writer_create(path, &section, 1, &writer, &err), PLIANT_ERR_IO);
    check_contains(err.text, "folder.h5: expected a file to replace, found a directory");
    assert_int_equal(pliant_writer_create("/dev/full", &section, 1, &writer, &err), PLIANT_ERR_IO);
    assert_false(exists("/dev/full.tmp"));
}

static void second_writer_of_the_same_file_is_refused(void **state)
{
    (void)state;
    pliant_error err;
    pliant_writer *writer, *second;
    const pliant_section_def section = {"/a", PLIANT_U1, 1, {1, 1, 1}};
    const char *path = scratch("busy.h5");
    check_ok(pliant_writer_create(path, &section, 1, &writer, &err), &err);
    assert_int_equal(pliant_writer_create(path, &section, 1, &second, &err), PLIANT_ERR_IO);
    check_contains(err.text, "another process is writing it");
    check_ok(pliant_writer_write_all(writer, "/a", "x", &err), &err);
    check_ok(pliant_writer_commit(writer, &err), &err);
}

// In a child: write a model of some size into a place too small for it at every size of that place.
// Exit 0: always refused with one line, nothing left, the old file untouched; and it works in the end.
static int write_under_limits(void)
{
    pliant_error err;
    tiny_file file;
    tiny_model_make(2, 1, &file);
    const char *path = scratch("limit.h5"), *temporary = scratch("limit.h5.tmp");
    signal(SIGXFSZ, SIG_IGN);
    int refused = 0;
    for (rlim_t limit = 0; limit < 700000; limit += 5003) {
        const struct rlimit rule = {limit, RLIM_INFINITY};
        FILE *old = fopen(path, "wb");
        if (!old || fclose(old) != 0 || setrlimit(RLIMIT_FSIZE, &rule) != 0) return 1;
        const pliant_status status = tiny_write(&file, path, &err);
        if (exists(temporary)) return 2;
        if (status == PLIANT_OK) continue;
        struct stat info;
        if (status != PLIANT_ERR_IO || !strstr(err.text, strerror(EFBIG))) {
            fprintf(stderr, "limit %lu: %s\n", (unsigned long)limit, err.text);
            return 3;
        }
        if (stat(path, &info) != 0 || info.st_size != 0) return 4;
        refused++;
    }
    tiny_free(&file);
    return refused > 10 && refused < 139 ? 0 : 5;
}

// In a child: the disk fails when everything is under way. HDF5 cannot close its file then.
static int fail_halfway(void)
{
    pliant_error err;
    pliant_writer *writer;
    tiny_file file;
    tiny_model_make(2, 1, &file);
    const char *path = scratch("late.h5"), *temporary = scratch("late.h5.tmp");
    if (tiny_create(&file, path, &writer, &err) < 0) return 1;
    const struct rlimit rule = {20000, RLIM_INFINITY};
    signal(SIGXFSZ, SIG_IGN);
    if (setrlimit(RLIMIT_FSIZE, &rule) != 0) return 2;
    pliant_status status = PLIANT_OK;
    for (int32_t i = 0; i < file.section_count && status == PLIANT_OK; i++)
        status = pliant_writer_write_all(writer, file.sections[i].def.path, file.sections[i].data, &err);
    if (status == PLIANT_OK)
        status = pliant_writer_commit(writer, &err);
    else
        pliant_writer_abandon(writer);
    tiny_free(&file);
    if (status != PLIANT_ERR_IO || !strstr(err.text, strerror(EFBIG))) return 3;
    return exists(path) || exists(temporary) ? 4 : 0;
}

static void disk_error_halfway_leaves_a_process_that_can_exit(void **state)
{
    (void)state;
    scratch("");  // the child shares the folder
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) exit(fail_halfway());  // exit, not _exit: HDF5's handlers would run here
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

static void file_size_limit_is_refused_wherever_it_strikes(void **state)
{
    (void)state;
    scratch("");  // the child shares the folder
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) _exit(write_under_limits());
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

static void full_disk_is_refused_before_anything_is_lost(void **state)
{
    (void)state;
    const char *folder = scratch("disk");
    mkdir(folder, 0777);
    if (mount("pliant", folder, "tmpfs", 0, "size=128k") != 0) {
        printf("skipped: a small disk needs root\n");
        skip();
    }
    pliant_error err = {""};
    tiny_file file;
    tiny_model_make(3, 1, &file);
    const char *path = scratch("disk/model.h5"), *temporary = scratch("disk/model.h5.tmp");
    FILE *old = fopen(path, "wb");
    if (old) fclose(old);
    const pliant_status status = tiny_write(&file, path, &err);
    const int left = exists(temporary), kept = exists(path);
    tiny_free(&file);
    umount(folder);
    assert_int_equal(status, PLIANT_ERR_IO);
    check_contains(err.text, strerror(ENOSPC));
    assert_false(left);
    assert_true(kept);
}

static void layout_counts_are_checked(void **state)
{
    (void)state;
    pliant_error err;
    pliant_section_def sections[PLIANT_SECTION_LIMIT];
    int32_t count = -7;
    pliant_model_layout layout = {.vertex_count = 6, .face_count = 8, .level_count = 1, .base_count = 6,
                                  .has_greens = 1, .free_count = 5, .fixed_count = 1, .level_mask = 1};
    check_ok(pliant_model_layout_sections(&layout, sections, &count, &err), &err);
    assert_int_equal(count, 16);
    pliant_model_layout bad = layout;
    bad.fixed_count = 2;
    assert_int_equal(pliant_model_layout_sections(&bad, sections, &count, &err), PLIANT_ERR_ARGUMENT);
    bad = layout;
    bad.level_mask = 2;
    assert_int_equal(pliant_model_layout_sections(&bad, sections, &count, &err), PLIANT_ERR_ARGUMENT);
    bad = layout;
    bad.level_count = PLIANT_LEVEL_LIMIT + 1;
    bad.has_supports = 1;
    bad.level_mask = 0xffff;  // 16 levels of 4 blocks of 4 sections do not fit into the table
    assert_int_equal(pliant_model_layout_sections(&bad, sections, &count, &err), PLIANT_ERR_ARGUMENT);
    check_contains(err.text, "expected at most 170 in one file, found 269");
    assert_int_equal(count, 16);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(model_comes_back_byte_for_byte),
        cmocka_unit_test(dense_file_comes_back_byte_for_byte),
        cmocka_unit_test(sections_without_elements_have_no_place_and_come_back),
        cmocka_unit_test(boxes_written_in_any_order_make_the_whole),
        cmocka_unit_test(large_boxes_are_written_in_slices),
        cmocka_unit_test(same_content_gives_the_same_bytes),
        cmocka_unit_test(h5dump_shows_the_numbers_and_the_attributes),
        cmocka_unit_test(h5repack_makes_a_file_that_is_refused_with_the_reason),
        cmocka_unit_test(incomplete_file_is_not_committed),
        cmocka_unit_test(writes_outside_a_section_are_refused),
        cmocka_unit_test(impossible_definitions_are_refused),
        cmocka_unit_test(unwritable_places_are_refused_with_the_systems_reason),
        cmocka_unit_test(second_writer_of_the_same_file_is_refused),
        cmocka_unit_test(file_size_limit_is_refused_wherever_it_strikes),
        cmocka_unit_test(disk_error_halfway_leaves_a_process_that_can_exit),
        cmocka_unit_test(full_disk_is_refused_before_anything_is_lost),
        cmocka_unit_test(layout_counts_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, scratch_clean);
}
