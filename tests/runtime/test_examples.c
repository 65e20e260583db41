// test_examples.c: the example programs do what they show.
#include "command.h"
#include "synthetic_model.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void the_haptic_example_touches_a_model_in_two_threads(void **state)
{
    (void)state;
    static check_command command;
    char path[512];
    snprintf(path, sizeof path, "%s/model.h5", check_folder());
    check_write_synthetic_levels(path, NULL, 2, 0.05, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    check_run(&command, "%s/examples/haptic %s 0.5", check_build(), path);
    if (command.status != 0) print_error("%s%s", command.output, command.errors);
    assert_int_equal(command.status, 0);
    assert_string_equal(command.errors, "");
    const char *last = strstr(command.output, "largest force");
    assert_non_null(last);
    check_at_least(strtod(last + strlen("largest force"), NULL), 1e-3);

    check_run(&command, "%s/examples/haptic %s.none", check_build(), path);
    assert_int_equal(command.status, 1);
    check_one_line(&command, "haptic: ", "model.h5.none");
    check_run(&command, "%s/examples/haptic %s long", check_build(), path);
    assert_int_equal(command.status, 2);
    check_one_line(&command, "usage: haptic ", "MODEL.h5");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_haptic_example_touches_a_model_in_two_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
