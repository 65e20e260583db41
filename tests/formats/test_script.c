// test_script.c: scripts as streams: line ends, long lines, pipes, a million lines in one buffer.
#include "tiny_write.h"

#include "pliant/script.h"

#include <errno.h>
#include <sys/resource.h>
#include <sys/wait.h>

static pliant_script *open_bytes(const void *bytes, size_t size)
{
    pliant_error err;
    pliant_script *script;
    const char *path = scratch("s");
    save(path, bytes, size);
    check_ok(pliant_script_open(path, &script, &err), &err);
    return script;
}

static pliant_script *open_text(const char *text)
{
    return open_bytes(text, strlen(text));
}

static void check_next(pliant_script *script, pliant_statement_kind kind, int64_t line)
{
    pliant_error err;
    pliant_statement s;
    int more;
    check_ok(pliant_script_next(script, &s, &more, &err), &err);
    assert_int_equal(more, 1);
    assert_int_equal(s.kind, kind);
    assert_int_equal(s.line, line);
}

static void check_end(pliant_script *script)
{
    pliant_error err;
    pliant_statement s;
    int more;
    for (int again = 0; again < 2; again++) {
        check_ok(pliant_script_next(script, &s, &more, &err), &err);
        assert_int_equal(more, 0);
    }
    pliant_script_close(script);
}

static void check_refused(pliant_script *script, const char *part)
{
    pliant_error err;
    pliant_statement s;
    int more;
    assert_int_equal(pliant_script_next(script, &s, &more, &err), PLIANT_ERR_FORMAT);
    assert_int_equal(more, 1);
    check_contains(err.text, part);
    check_contains(err.text, scratch("s"));
}

static void blank_lines_and_comments_are_passed_over(void **state)
{
    (void)state;
    pliant_script *script = open_text("# poke\n\n  \npliant-script 1\n#\nstep # now\n\nstep 2");
    check_next(script, PLIANT_STATEMENT_VERSION, 4);
    check_next(script, PLIANT_STATEMENT_STEP, 6);
    check_next(script, PLIANT_STATEMENT_STEP, 8);
    check_end(script);
    check_end(open_text(""));
    check_end(open_text("\n\n"));
    pliant_script_close(NULL);
}

static void carriage_returns_at_line_ends_and_a_byte_order_mark_are_accepted(void **state)
{
    (void)state;
    pliant_script *script = open_text("\xef\xbb\xbfpliant-script 1\r\n\r\nstep\r\n");
    check_next(script, PLIANT_STATEMENT_VERSION, 1);
    check_next(script, PLIANT_STATEMENT_STEP, 3);
    check_end(script);
    script = open_text("pliant-script 1\nstep\rstep\n");
    check_next(script, PLIANT_STATEMENT_VERSION, 1);
    check_refused(script, ":2:5: expected UTF-8 text, found byte 0x0d");
    check_end(script);
}

static void reading_goes_on_after_a_refused_line(void **state)
{
    (void)state;
    static const char text[] = "step\npliant-script 1\nstep x\nstep\0\nstep 4\n";
    pliant_script *script = open_bytes(text, sizeof text - 1);
    check_refused(script, ":1:1: expected \"pliant-script 1\" as first statement, found \"step\"");
    check_next(script, PLIANT_STATEMENT_VERSION, 2);
    check_refused(script, ":3:6: expected a number of steps, 1 or more, found \"x\"");
    check_refused(script, ":4:5: expected UTF-8 text, found byte 0x00");
    check_next(script, PLIANT_STATEMENT_STEP, 5);
    check_end(script);
}

static void line_limit_holds_to_the_byte_and_the_rest_is_dropped(void **state)
{
    (void)state;
    for (int extra = 0; extra < 3; extra++) {
        for (int crlf = 0; crlf < 2; crlf++) {
            const size_t length = PLIANT_SCRIPT_LINE_LIMIT + (extra == 2 ? 100000 : (size_t)extra);
            char *text = malloc(length + 100);
            assert_non_null(text);
            int at = sprintf(text, "pliant-script 1\n");
            memset(text + at, ' ', length);
            memcpy(text + at, "step", 4);
            sprintf(text + at + length, "%sstep 2\n", crlf ? "\r\n" : "\n");
            pliant_script *script = open_text(text);
            check_next(script, PLIANT_STATEMENT_VERSION, 1);
            if (extra == 0)
                check_next(script, PLIANT_STATEMENT_STEP, 2);
            else
                check_refused(script, ":2:4097: expected a line of at most 4096 bytes, found more");
            check_next(script, PLIANT_STATEMENT_STEP, 3);
            check_end(script);
            free(text);
        }
    }
}

static void what_cannot_be_opened_is_refused_by_name(void **state)
{
    (void)state;
    pliant_error err;
    pliant_script *script;
    assert_int_equal(pliant_script_open("/tmp", &script, &err), PLIANT_ERR_IO);
    assert_string_equal(err.text, "/tmp: expected a script, found a directory");
    assert_int_equal(pliant_script_open(scratch("absent"), &script, &err), PLIANT_ERR_IO);
    check_contains(err.text, strerror(ENOENT));
}

static void standard_input_answers_line_by_line(void **state)
{
    (void)state;
    int to[2], from[2];
    assert_int_equal(pipe(to), 0);
    assert_int_equal(pipe(from), 0);
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        pliant_script *script;
        pliant_statement s;
        int more = 1;
        dup2(to[0], 0);
        close(to[1]);
        if (pliant_script_open("-", &script, NULL) < 0) _exit(1);
        while (pliant_script_next(script, &s, &more, NULL) == PLIANT_OK && more) {
            const char answer = (char)('0' + s.line);
            if (write(from[1], &answer, 1) != 1) _exit(2);
        }
        _exit(3 + more);
    }
    close(to[0]);
    close(from[1]);
    // The answer must come before the next line is sent.
    static const char *const lines[] = {"pliant-script 1\n", "step\n", "dt 1\n"};
    for (int i = 0; i < 3; i++) {
        char answer = 0;
        assert_int_equal(write(to[1], lines[i], strlen(lines[i])), strlen(lines[i]));
        assert_int_equal(read(from[0], &answer, 1), 1);
        assert_int_equal(answer, '1' + i);
    }
    close(to[1]);
    close(from[0]);
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 3);
}

static void million_lines_are_read_in_constant_memory(void **state)
{
    (void)state;
    const char *path = scratch("long");
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs("pliant-script 1\n", file);
    for (int i = 0; i < 1000000; i++) fprintf(file, "displace %d 0 0 -0.0%d\n", i, i % 10);
    assert_int_equal(fclose(file), 0);
    pliant_error err;
    pliant_script *script;
    pliant_statement s;
    struct rusage before, after;
    int more = 1;
    int64_t count = -1;
    check_ok(pliant_script_open(path, &script, &err), &err);
    getrusage(RUSAGE_SELF, &before);
    for (; more; count++) check_ok(pliant_script_next(script, &s, &more, &err), &err);
    getrusage(RUSAGE_SELF, &after);
    assert_int_equal(count, 1000001);
    assert_int_equal(s.vertex.number, 999999);
    check_at_most((double)(after.ru_maxrss - before.ru_maxrss), 1024);  // KiB; the file has 25 MB
    pliant_script_close(script);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blank_lines_and_comments_are_passed_over),
        cmocka_unit_test(carriage_returns_at_line_ends_and_a_byte_order_mark_are_accepted),
        cmocka_unit_test(reading_goes_on_after_a_refused_line),
        cmocka_unit_test(line_limit_holds_to_the_byte_and_the_rest_is_dropped),
        cmocka_unit_test(what_cannot_be_opened_is_refused_by_name),
        cmocka_unit_test(standard_input_answers_line_by_line),
        cmocka_unit_test(million_lines_are_read_in_constant_memory),
    };
    return cmocka_run_group_tests(tests, NULL, scratch_clean);
}
