// test_text_cursor.c: words, lines, columns, and numbers to the last bit.
#include "check.h"

#include "mesh/text_cursor.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int read_number(const char *content, double *value)
{
    return pliant_text_word_number((pliant_text_word){content, strlen(content)}, value);
}

static void numbers_become_the_nearest_double(void **state)
{
    (void)state;
    // The C library's strtod is exact; both the short way and the long way must equal it.
    static const char *const formats[] = {"%.17g", "%.9g",  "%.6f", "%.3e",
                                          "%.25g", "%+.1f", "%.0f"};
    check_random random = check_random_seed(11);
    for (int i = 0; i < 200000; i++) {
        char content[400];
        const double scale = pow(10, floor(60 * check_random_next(&random)) - 30);
        const double written = (2 * check_random_next(&random) - 1) * scale;
        snprintf(content, sizeof content, formats[i % 7], written);
        double found;
        assert_true(read_number(content, &found));
        const double expected = strtod(content, NULL);
        if (memcmp(&found, &expected, sizeof found) != 0)
            fail_msg("%s read as %.17g, expected %.17g", content, found, expected);
    }
    static const char *const special[] = {"0",
                                          "-0",
                                          "+.5",
                                          "5.",
                                          "1e22",
                                          "1e23",
                                          "1E-22",
                                          "9007199254740993",
                                          "9007199254740992",
                                          "4.9406564584124654e-324",
                                          "2.2250738585072011e-308",
                                          "1.7976931348623157e308",
                                          "0.00000000000000000000000000000000000001",
                                          "123456789012345678901234567890e-20",
                                          "9007199254740992e22",
                                          "900719925474099267e-1",
                                          "1e400",
                                          "1e-400",
                                          "1e99999999999999999999"};
    for (size_t i = 0; i < sizeof special / sizeof *special; i++) {
        double found;
        assert_true(read_number(special[i], &found));
        const double expected = strtod(special[i], NULL);
        assert_memory_equal(&found, &expected, sizeof found);
    }
}

static void what_is_no_number_is_not_read_as_one(void **state)
{
    (void)state;
    static const char *const words[] = {
        "",    "+",   "-",     ".", "e5",   "1e", "1e+", "1.2.3", "1,5",   "0x10", "1e5.0",
        "--1", "1d5", "12abc", "n", "nanx", "1 ", "+-1", "1e+-5", "infin", "1_0",  "1f"};
    double value;
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (read_number(words[i], &value)) fail_msg("'%s' read as %g", words[i], value);
    char *digits = malloc(5001);
    assert_non_null(digits);
    memset(digits, '1', 5000);
    digits[5000] = 0;
    assert_false(read_number(digits, &value));
    free(digits);
    assert_true(read_number("NaN", &value) && isnan(value));
    assert_true(read_number("-Infinity", &value) && value < 0 && isinf(value));
}

// ---- Words and lines ----

static void words_know_their_line_and_column(void **state)
{
    (void)state;
    static const char content[] = "\xEF\xBB\xBF"
                                  "one  two\r\n\r\n\tthree\rfour # five\nsix\\\n seven\\";
    static const struct {
        const char *text;
        int line, column;
    } words[] = {{"one", 1, 1},  {"two", 1, 6}, {"three", 3, 2},
                 {"four", 4, 1}, {"six", 5, 1}, {"seven\\", 6, 2}};
    // A copy of exactly the size, without a zero byte.
    char *copy = malloc(sizeof content - 1);
    assert_non_null(copy);
    memcpy(copy, content, sizeof content - 1);
    pliant_text_cursor cursor = pliant_text_cursor_begin("a", copy, sizeof content - 1);
    cursor.comment = '#';
    cursor.continuation = '\\';
    size_t found = 0;
    do {
        pliant_text_word word;
        while ((word = pliant_text_cursor_word(&cursor)).text) {
            assert_true(found < sizeof words / sizeof *words);
            assert_true(pliant_text_word_is(word, words[found].text));
            assert_int_equal(cursor.line, words[found].line);
            assert_int_equal(word.text - cursor.line_start + 1, words[found].column);
            found++;
        }
    } while (pliant_text_cursor_line(&cursor));
    assert_int_equal(found, sizeof words / sizeof *words);
    free(copy);
}

static void whole_numbers_stop_at_two_to_the_62(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int64_t value;
    } cases[] = {{"0", 0},
                 {"-0", 0},
                 {"+12", 12},
                 {"-2147483649", -2147483649},
                 {"4611686018427387903", 4611686018427387903},
                 {"4611686018427387904", 4611686018427387904},
                 {"4611686018427387905", 4611686018427387904},
                 {"-99999999999999999999999999999999", -4611686018427387904}};
    int64_t value;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const pliant_text_word word = {cases[i].text, strlen(cases[i].text)};
        assert_true(pliant_text_word_integer(word, &value));
        assert_true(value == cases[i].value);
    }
    static const char *const others[] = {"", "+", "-", "1.", "1e3", "--1", "0x1", " 1", "1,"};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        const pliant_text_word word = {others[i], strlen(others[i])};
        assert_false(pliant_text_word_integer(word, &value));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_become_the_nearest_double),
        cmocka_unit_test(what_is_no_number_is_not_read_as_one),
        cmocka_unit_test(words_know_their_line_and_column),
        cmocka_unit_test(whole_numbers_stop_at_two_to_the_62),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
