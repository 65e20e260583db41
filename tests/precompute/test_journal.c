// test_journal.c: a journal is true to its last whole record, wherever it is cut or damaged.
#include "check.h"
#include "command.h"

#include "journal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { RECORDS = 4, MAGIC = 8, HEAD = 16 };
static const size_t sizes[RECORDS] = {5, 0, 64, 21};
static char path[512];

static void fill(int index, char *bytes)
{
    for (size_t i = 0; i < sizes[index]; i++) bytes[i] = (char)(17 * index + (int)i);
}

static pliant_journal *open_journal(void)
{
    pliant_journal *journal = NULL;
    pliant_error err;
    check_ok(pliant_journal_open(path, &journal, &err), &err);
    return journal;
}

static void add(pliant_journal *journal, int index)
{
    char bytes[64];
    pliant_error err;
    fill(index, bytes);
    check_ok(pliant_journal_append(journal, 10 + index, bytes, sizes[index], &err), &err);
}

// The first `count` records and no more.
static void has(const pliant_journal *journal, int count)
{
    size_t position = 0;
    pliant_journal_record record;
    for (int i = 0; i < count; i++) {
        char bytes[64];
        fill(i, bytes);
        assert_int_equal(pliant_journal_next(journal, &position, &record), 1);
        assert_int_equal(record.type, 10 + i);
        assert_int_equal(record.size, sizes[i]);
        assert_int_equal((uintptr_t)record.bytes % 8, 0);
        assert_memory_equal(record.bytes, bytes, sizes[i]);
    }
    assert_int_equal(pliant_journal_next(journal, &position, &record), 0);
}

// Where the journal ends after `count` records.
static size_t end_after(int count)
{
    size_t end = MAGIC;
    for (int i = 0; i < count; i++) end += HEAD + (sizes[i] + 7) / 8 * 8;
    return end;
}

static int whole_records(size_t bytes)
{
    int count = 0;
    while (count < RECORDS && end_after(count + 1) <= bytes) count++;
    return count;
}

static size_t read_file(char *bytes, size_t size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    const size_t count = fread(bytes, 1, size, file);
    fclose(file);
    return count;
}

static void write_file(const char *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

// A journal of all records, in `bytes`.
static size_t make_whole(char *bytes, size_t size)
{
    pliant_error err;
    unlink(path);
    pliant_journal *journal = open_journal();
    has(journal, 0);
    for (int i = 0; i < RECORDS; i++) add(journal, i);
    check_ok(pliant_journal_sync(journal, &err), &err);
    pliant_journal_close(journal);
    journal = open_journal();
    has(journal, RECORDS);
    pliant_journal_close(journal);
    const size_t count = read_file(bytes, size);
    assert_int_equal(count, end_after(RECORDS));
    return count;
}

static void a_cut_journal_keeps_its_whole_records_and_goes_on(void **state)
{
    (void)state;
    char bytes[512];
    const size_t size = make_whole(bytes, sizeof bytes);
    for (size_t cut = 0; cut < size; cut++) {
        write_file(bytes, cut);
        const int whole = whole_records(cut);
        pliant_journal *journal = open_journal();
        has(journal, whole);
        // The torn tail must not come between.
        for (int i = whole; i < RECORDS; i++) add(journal, i);
        pliant_journal_close(journal);
        char again[512];
        assert_int_equal(read_file(again, sizeof again), size);
        assert_memory_equal(again, bytes, size);
    }
}

static void a_tail_of_other_bytes_is_ignored(void **state)
{
    (void)state;
    char bytes[1024] = {0};
    const size_t size = make_whole(bytes, sizeof bytes);
    // Zeros, as after a power cut; 0xff; and the last record once more, which is right but for its
    // place.
    for (int kind = 0; kind < 3; kind++) {
        char longer[1024];
        memcpy(longer, bytes, size);
        memset(longer + size, kind == 1 ? 0xff : 0, 200);
        if (kind == 2)
            memcpy(longer + size, bytes + end_after(RECORDS - 1), size - end_after(RECORDS - 1));
        write_file(longer, size + 100);
        pliant_journal *journal = open_journal();
        has(journal, RECORDS);
        pliant_journal_close(journal);
        assert_int_equal(read_file(longer, sizeof longer), size);
    }
}

static void every_flipped_bit_ends_it_before_that_record(void **state)
{
    (void)state;
    char bytes[512];
    const size_t size = make_whole(bytes, sizeof bytes);
    for (size_t at = MAGIC; at < size; at++)
        for (int bit = 0; bit < 8; bit++) {
            const int record = whole_records(at);
            // What fills a record up to eight bytes means nothing.
            if (at >= end_after(record) + HEAD + sizes[record]) continue;
            char damaged[512];
            memcpy(damaged, bytes, size);
            damaged[at] = (char)(damaged[at] ^ 1 << bit);
            write_file(damaged, size);
            pliant_journal *journal = open_journal();
            has(journal, record);
            pliant_journal_close(journal);
        }
}

static void other_files_and_other_users_are_refused(void **state)
{
    (void)state;
    pliant_journal *journal = NULL, *first;
    pliant_error err;
    write_file("PLIANTJ2 of a later version", 27);
    assert_int_equal(pliant_journal_open(path, &journal, &err), PLIANT_ERR_FORMAT);
    assert_non_null(strstr(err.text, path));
    char same[64] = "";
    assert_int_equal(read_file(same, sizeof same), 27);  // as it was
    unlink(path);
    first = open_journal();
    assert_int_equal(pliant_journal_open(path, &journal, &err), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "another run is at work"));
    pliant_journal_close(first);
    assert_int_equal(pliant_journal_open("/nowhere/at/all", &journal, &err), PLIANT_ERR_IO);
    assert_int_equal(pliant_journal_open("/tmp", &journal, &err), PLIANT_ERR_IO);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cut_journal_keeps_its_whole_records_and_goes_on),
        cmocka_unit_test(a_tail_of_other_bytes_is_ignored),
        cmocka_unit_test(every_flipped_bit_ends_it_before_that_record),
        cmocka_unit_test(other_files_and_other_users_are_refused),
    };
    snprintf(path, sizeof path, "%s/journal", check_folder());
    return cmocka_run_group_tests(tests, NULL, NULL);
}
