// test_groups.c: solver groups of pliant-precompute: whatever the groups, the same model.
#include "check.h"
#include "command.h"
#include "model_files.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char problem[] =
    "--subdivide 1 --blocks all --eps 1e-9 --fixed 'z<0.03' --young 50000 "
    "--poisson 0.4 --density 1000 scripts/sample/whale.obj";
static const char name[] = "pliant-precompute: ";

static const char *in_folder(const char *file)
{
    static char paths[8][512];
    static int turn;
    char *path = paths[turn++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", check_folder(), file);
    return path;
}

static void solve(check_command *c, int ranks, const char *options, const char *output)
{
    check_run(c, "mpirun --quiet -n %d %s/pliant-precompute --json --force %s %s -o %s", ranks,
              check_build(), options, problem, output);
}

static void any_groups_of_any_ranks_make_the_same_model(void **state)
{
    (void)state;
    static const int cases[][2] = {{2, 1}, {2, 2}, {3, 2}, {4, 2}, {4, 4}};
    static const char *const methods[] = {"bem", "fem"};
    check_command c;
    char options[64], told[64], expected[512];
    for (int m = 0; m < 2; m++) {
        snprintf(expected, sizeof expected, "%s/%s.h5", check_folder(), methods[m]);
        snprintf(options, sizeof options, "--method %s", methods[m]);
        solve(&c, 1, options, expected);
        if (c.status) fail_msg("%s", c.errors);
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            snprintf(options, sizeof options, "--method %s --groups %d", methods[m], cases[i][1]);
            solve(&c, cases[i][0], options, in_folder("dealt.h5"));
            if (c.status) fail_msg("%d ranks, %s: %s", cases[i][0], options, c.errors);
            snprintf(told, sizeof told, "\"groups\": %d", cases[i][1]);
            assert_non_null(strstr(c.output, told));
            snprintf(told, sizeof told, "in %d groups)", cases[i][1]);
            assert_int_equal(strstr(c.errors, told) != NULL, cases[i][1] > 1);
            check_same_model(in_folder("dealt.h5"), expected, 1e-5);
        }
    }
}

// 34 columns in batches of 3 over 4 groups: some have none.
static void groups_without_columns_wait_for_the_others(void **state)
{
    (void)state;
    check_command c;
    solve(&c, 1, "", in_folder("one.h5"));
    assert_int_equal(c.status, 0);
    setenv("PETSC_OPTIONS", "-pliant_batch 3", 1);
    static const char *const methods[] = {"--groups 4", "--groups 4 --method fem"};
    for (int m = 0; m < 2; m++) {
        solve(&c, 4, methods[m], in_folder("few.h5"));
        if (c.status) fail_msg("%s", c.errors);
        if (m == 0) check_same_model(in_folder("few.h5"), in_folder("one.h5"), 1e-5);
    }
    unsetenv("PETSC_OPTIONS");
}

// Of two ranks each has its own factors while there is room for both. What does not fit even once
// is refused, after the groups are told.
static void memory_limits_the_groups(void **state)
{
    (void)state;
    static const struct {
        const char *memory, *told;
        int status;
    } cases[] = {
        {"-pliant_memory 1", "(direct, in 2 groups)", 0},
        {"-pliant_memory 0.1", "on 2 ranks (direct)", 1},
        {"-pliant_memory 0.1", "of memory on this machine, 0.10 GB are available", 1},
    };
    check_command c;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        setenv("PETSC_OPTIONS", cases[i].memory, 1);
        check_run(
            &c,
            "mpirun --quiet -n 2 %s/pliant-precompute --force --method fem --solver direct "
            "--subdivide 3 --constraint-levels 0 --fixed 'z<0.1' scripts/sample/whale.obj -o %s",
            check_build(), in_folder("limited.h5"));
        unsetenv("PETSC_OPTIONS");
        if (c.status != cases[i].status || !strstr(c.errors, cases[i].told))
            fail_msg("%s: status %d: %s", cases[i].memory, c.status, c.errors);
    }
}

static void groups_that_cannot_be_are_misuse(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"--groups 3", "--groups: expected at most the 2 ranks, found 3"},
        {"--groups 0", "--groups: expected a whole number from 1"},
        {"--groups some", "--groups"},
    };
    check_command c;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        solve(&c, 2, cases[i][0], in_folder("none.h5"));
        assert_int_equal(c.status, 2);
        check_one_line(&c, name, cases[i][1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_groups_of_any_ranks_make_the_same_model),
        cmocka_unit_test(groups_without_columns_wait_for_the_others),
        cmocka_unit_test(memory_limits_the_groups),
        cmocka_unit_test(groups_that_cannot_be_are_misuse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL) != 0;
}
