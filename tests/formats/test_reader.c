// test_reader.c: broken files are refused with the reason, whatever byte is wrong or missing.
#include "tiny_write.h"

#include "image.h"
#include "pliant/dense_view.h"
#include "pliant/model_view.h"
#include "pliant/reader.h"

#include <errno.h>

// Open an exact copy, so that the sanitizer sees a read one byte too far; then bind what it is.
static pliant_status try_open(const void *bytes, size_t size, pliant_error *err)
{
    unsigned char *copy = malloc(size > 0 ? size : 1);
    assert_non_null(copy);
    memcpy(copy, bytes, size);
    pliant_reader *reader;
    strcpy(err->text, "");
    pliant_status status = pliant_reader_open_memory(copy, size, "file", &reader, err);
    if (status == PLIANT_OK) {
        pliant_model_view model;
        pliant_dense_view dense;
        status = pliant_model_view_bind(reader, &model, err);
        if (status == PLIANT_ERR_MISSING) status = pliant_dense_view_bind(reader, &dense, err);
        pliant_reader_close(reader);
    }
    // A refusal is one line that begins with the file's name.
    if (status < 0) assert_true(strncmp(err->text, "file: ", 6) == 0 && !strchr(err->text, '\n'));
    free(copy);
    return status;
}

static void check_refused(const void *bytes, size_t size, const char *reason)
{
    pliant_error err;
    assert_true(try_open(bytes, size, &err) < 0);
    check_contains(err.text, reason);
}

static void what_is_no_model_is_named(void **state)
{
    (void)state;
    unsigned char bytes[20000] = {0};
    const unsigned char hdf5[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    check_refused(bytes, 0, "empty");
    check_refused("o 1\n", 4, "not a Pliant model: expected it to begin with \"PLIANT\", found \"o 1\\x0a\"");
    memcpy(bytes, hdf5, sizeof hdf5);
    check_refused(bytes, sizeof bytes, "HDF5, but without Pliant's section table");
    memset(bytes, 0, sizeof bytes);
    memcpy(bytes + 512, hdf5, sizeof hdf5);
    check_refused(bytes, sizeof bytes, "HDF5, but without Pliant's section table");
    memset(bytes, 0, sizeof bytes);
    memcpy(bytes + PLIANT_USER_BLOCK, hdf5, sizeof hdf5);
    check_refused(bytes, sizeof bytes, "its writer did not finish");
}

static void what_is_no_file_is_named(void **state)
{
    (void)state;
    pliant_error err;
    pliant_reader *reader;
    assert_int_equal(pliant_reader_open(scratch("absent.h5"), &reader, &err), PLIANT_ERR_IO);
    check_contains(err.text, "absent.h5: ");
    check_contains(err.text, strerror(ENOENT));
    assert_int_equal(pliant_reader_open("/tmp", &reader, &err), PLIANT_ERR_IO);
    assert_string_equal(err.text, "/tmp: expected a file, found a directory");
    const char *pipe = scratch("pipe");
    assert_int_equal(mkfifo(pipe, 0666), 0);
    assert_int_equal(pliant_reader_open(pipe, &reader, &err), PLIANT_ERR_IO);  // and does not wait
    check_contains(err.text, "expected a file, found a pipe");
    assert_int_equal(pliant_reader_open("/dev/null", &reader, &err), PLIANT_ERR_IO);
    check_contains(err.text, "found a device");
    const char *empty = scratch("empty");
    save(empty, "", 0);
    assert_int_equal(pliant_reader_open(empty, &reader, &err), PLIANT_ERR_FORMAT);
    check_contains(err.text, "empty: empty: expected a model file, found 0 bytes");
    char path[2000];
    memset(path, 'x', sizeof path);
    path[sizeof path - 1] = 0;
    assert_int_equal(pliant_reader_open(path, &reader, &err), PLIANT_ERR_IO);
    check_contains(err.text, strerror(ENAMETOOLONG));
}

static void newer_versions_and_other_byte_orders_are_refused(void **state)
{
    (void)state;
    size_t size;
    pliant_error err;
    unsigned char *bytes = image_of_model(1, 0, &size);
    pliant_header *header = (pliant_header *)bytes;
    header->version = PLIANT_FORMAT_VERSION + 1;  // its checksum may be another one: not stamped
    assert_int_equal(try_open(bytes, size, &err), PLIANT_ERR_VERSION);
    check_contains(err.text, "newer than this library: expected format version 1 or older, found 2");
    header->version = PLIANT_FORMAT_VERSION;
    header->endian = 0x04030201;
    check_refused(bytes, size, "byte order mark 0x1020304, found 0x4030201");
    free(bytes);
}

static void every_truncation_is_refused(void **state)
{
    (void)state;
    size_t size;
    unsigned char *bytes = image_of_model(2, 1, &size);
    pliant_error err;
    check_ok(try_open(bytes, size, &err), &err);
    for (size_t cut = 0; cut < sizeof(pliant_header) + 200; cut++) check_refused(bytes, cut, "");
    for (size_t cut = 8; cut < PLIANT_USER_BLOCK + 10; cut += 41) check_refused(bytes, cut, "truncated");
    const pliant_header *header = (const pliant_header *)bytes;
    const pliant_entry *entries = (const pliant_entry *)(bytes + sizeof *header);
    for (uint32_t i = 0; i < header->section_count; i++) {
        const size_t element = pliant_section_type_size((pliant_section_type)entries[i].type);
        const size_t count = entries[i].shape[0] * entries[i].shape[1] * entries[i].shape[2];
        const size_t edges[] = {entries[i].offset, entries[i].offset + element * count};
        for (size_t e = 0; e < 2 && count > 0; e++)
            for (size_t cut = edges[e] - 1; cut <= edges[e] + 1 && cut < size; cut++) {
                char expected[100];
                snprintf(expected, sizeof expected, "truncated: expected %zu bytes, found %zu", size, cut);
                check_refused(bytes, cut, expected);
            }
    }
    unsigned char *longer = calloc(1, size + 1);
    assert_non_null(longer);
    memcpy(longer, bytes, size);
    check_refused(longer, size + 1, "bytes added at the end");
    free(longer);
    free(bytes);
}

// With the size and checksum corrected after the cut, the table itself must notice.
static void truncation_is_noticed_by_the_table_alone(void **state)
{
    (void)state;
    size_t size;
    unsigned char *bytes = image_of_model(2, 1, &size);
    const pliant_header *header = (const pliant_header *)bytes;
    const pliant_entry *entries = (const pliant_entry *)(bytes + sizeof *header);
    for (uint32_t i = 0; i < header->section_count; i++) {
        if (entries[i].offset == 0) continue;
        for (size_t cut = entries[i].offset - 1; cut <= entries[i].offset + 1; cut++) {
            if (cut < PLIANT_USER_BLOCK) continue;
            unsigned char *copy = malloc(cut);
            assert_non_null(copy);
            memcpy(copy, bytes, cut);
            image_stamp(copy, cut);
            check_refused(copy, cut, "expected to end within");
            free(copy);
        }
    }
    image_stamp(bytes, size - 1);
    check_refused(bytes, size - 1, "expected to end within");
    free(bytes);
}

static void every_flipped_byte_of_header_and_table_is_refused(void **state)
{
    (void)state;
    size_t size;
    pliant_error err;
    unsigned char *bytes = image_of_model(2, 0, &size);
    // Once as it is: the checksum notices, or the header before it.
    for (size_t i = 0; i < PLIANT_USER_BLOCK; i += i < 3000 ? 1 : 101) {
        bytes[i] ^= 0x10;
        assert_true(try_open(bytes, size, &err) < 0);
        bytes[i] ^= 0x10;
    }
    check_ok(try_open(bytes, size, &err), &err);
    free(bytes);
}

static void flipped_bytes_behind_a_right_checksum_do_no_harm(void **state)
{
    (void)state;
    size_t size;
    pliant_error err;
    unsigned char *bytes = image_of_model(1, 0, &size);
    const uint32_t used = ((const pliant_header *)bytes)->section_count * (uint32_t)sizeof(pliant_entry) +
                          (uint32_t)sizeof(pliant_header);
    int refused = 0;
    for (size_t i = 0; i < used; i++) {
        for (int bit = 0; bit < 8; bit++) {
            const unsigned char old = bytes[i];
            bytes[i] ^= (unsigned char)(1 << bit);
            image_stamp(bytes, size);
            refused += try_open(bytes, size, &err) < 0;
            bytes[i] = old;
        }
    }
    // Path, type, rank, shape and offset are 92 of an entry's 96 bytes; unused ends of paths, the
    // payload's checksums (verify's business) and the header's spare fields are the harmless rest.
    check_at_least(refused, 8 * used / 3);
    free(bytes);
}

// One field of one entry wrong, everything else right: the reason names the section.
static void wrong_entries_are_named(void **state)
{
    (void)state;
    size_t size;
    unsigned char *bytes = image_of_model(2, 0, &size);
    pliant_entry *e = (pliant_entry *)(bytes + sizeof(pliant_header)) + 1;  // /mesh/faces
    const pliant_entry right = *e;
#define CASE(change, reason)                                                                       \
    change;                                                                                        \
    image_stamp(bytes, size);                                                                      \
    check_refused(bytes, size, reason);                                                            \
    *e = right;
    CASE(e->path[3] = '\t', "section 1: expected a printable path")
    CASE(e->path[0] = 'm', "section 1: expected a printable path")
    CASE(memset(e->path, 'x', sizeof e->path), "section 1: expected a printable path")
    CASE(memcpy(e->path, "/mesh/vertices", 15), "/mesh/vertices: expected one section of this path, found two")
    CASE(e->type = 6, "/mesh/faces: expected type 1..5, found 6")
    CASE(e->type = 0, "/mesh/faces: expected type 1..5, found 0")
    CASE(e->rank = 0, "/mesh/faces: expected rank 1..3, found 0")
    CASE(e->rank = 4, "/mesh/faces: expected rank 1..3, found 4")
    CASE(e->shape[2] = 2, "/mesh/faces: expected length 1 beyond rank 2, found 2")
    CASE(e->shape[0] = UINT64_MAX, "/mesh/faces: expected a size that a file can have")
    CASE((e->shape[0] = 1ull << 62, e->shape[1] = 4), "/mesh/faces: expected a size that a file can have")
    CASE((e->shape[0] = 0, e->shape[1] = UINT64_MAX), "/mesh/faces: expected a size that a file can have")
    CASE((e->shape[0] = 0, e->shape[1] = 1ull << 62), "/mesh/faces: expected a size that a file can have")
    CASE(e->shape[0] = 0, "/mesh/faces: expected offset 0 of an empty section")
    CASE(e->shape[0] = 1 << 20, "/mesh/faces: expected to end within")
    CASE(e->offset = 0, "/mesh/faces: expected an offset of 16384 or more on a page, found 0")
    CASE(e->offset += 8, "/mesh/faces: expected an offset of 16384 or more on a page")
    CASE(e->offset = 1ull << 63, "/mesh/faces: expected to end within")
    CASE(e->offset = PLIANT_USER_BLOCK, "/mesh/faces overlaps /mesh/vertices at 16384")
#undef CASE
    ((pliant_header *)bytes)->section_count = PLIANT_SECTION_LIMIT + 1;
    image_stamp(bytes, size);
    check_refused(bytes, size, "expected at most 170 sections, found 171");
    free(bytes);
}

static void damage_to_any_section_is_found_and_named_by_verify(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    tiny_model_make(2, 1, &file);
    const char *path = scratch("verify.h5");
    check_ok(tiny_write(&file, path, &err), &err);
    tiny_free(&file);
    size_t size;
    unsigned char *bytes = load(path, &size);
    pliant_reader *reader;
    check_ok(pliant_reader_open_memory(bytes, size, "file", &reader, &err), &err);
    check_ok(pliant_reader_verify(reader, &err), &err);
    for (int32_t i = 0; i < pliant_reader_section_count(reader); i++) {
        const pliant_section *s = pliant_reader_section(reader, i);
        const uint64_t places[] = {0, s->bytes / 2, s->bytes - 1};
        for (size_t k = 0; k < 3 && s->bytes > 0; k++) {
            char expected[100];
            bytes[s->offset + places[k]] ^= 1;
            assert_int_equal(pliant_reader_verify(reader, &err), PLIANT_ERR_FORMAT);
            snprintf(expected, sizeof expected, "file: %s: damaged: expected checksum ", s->path);
            check_contains(err.text, expected);
            bytes[s->offset + places[k]] ^= 1;
        }
    }
    const size_t others[] = {PLIANT_USER_BLOCK, PLIANT_USER_BLOCK + 100};
    for (size_t k = 0; k < 2; k++) {
        bytes[others[k]] ^= 1;
        assert_int_equal(pliant_reader_verify(reader, &err), PLIANT_ERR_FORMAT);
        check_contains(err.text, "HDF5's own part");
        bytes[others[k]] ^= 1;
    }
    check_ok(pliant_reader_verify(reader, &err), &err);
    pliant_reader_close(reader);
    free(bytes);
}

static void sections_are_found_by_path_or_number(void **state)
{
    (void)state;
    size_t size;
    pliant_error err;
    pliant_reader *reader;
    unsigned char *bytes = image_of_model(1, 0, &size);
    check_ok(pliant_reader_open_memory(bytes, size, "file", &reader, &err), &err);
    assert_ptr_equal(pliant_reader_find(reader, "/mesh/vertices"), pliant_reader_section(reader, 0));
    assert_null(pliant_reader_find(reader, "/mesh"));
    assert_null(pliant_reader_section(reader, -1));
    assert_null(pliant_reader_section(reader, pliant_reader_section_count(reader)));
    assert_int_equal(pliant_reader_size(reader), size);
    assert_int_equal(pliant_reader_version(reader), PLIANT_FORMAT_VERSION);
    pliant_reader_close(reader);
    pliant_reader_close(NULL);
    assert_int_equal(pliant_reader_open_memory(bytes + 8, size - 8, "file", &reader, &err), PLIANT_ERR_ARGUMENT);
    free(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_no_model_is_named),
        cmocka_unit_test(what_is_no_file_is_named),
        cmocka_unit_test(newer_versions_and_other_byte_orders_are_refused),
        cmocka_unit_test(every_truncation_is_refused),
        cmocka_unit_test(truncation_is_noticed_by_the_table_alone),
        cmocka_unit_test(every_flipped_byte_of_header_and_table_is_refused),
        cmocka_unit_test(flipped_bytes_behind_a_right_checksum_do_no_harm),
        cmocka_unit_test(wrong_entries_are_named),
        cmocka_unit_test(damage_to_any_section_is_found_and_named_by_verify),
        cmocka_unit_test(sections_are_found_by_path_or_number),
    };
    return cmocka_run_group_tests(tests, NULL, scratch_clean);
}
