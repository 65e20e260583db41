// test_scenes.c: the sample scenes from outside, and models that hold both kinds of play.
#include "check.h"

#include "command.h"

#include <stdio.h>
#include <string.h>

static const char penguin[] = "scripts/sample/penguin.obj", fox[] = "scripts/sample/fox.obj";

static check_command c;

static void run_ok(const check_command *command)
{
    if (command->status != 0)
        fail_msg("exit status %d\n%s%s", command->status, command->output, command->errors);
}

static void check_contains(const char *text, const char *part)
{
    if (!strstr(text, part)) fail_msg("expected \"%s\" in:\n%.2000s", part, text);
}

// Play lines with options, JSON at the end; from a file or from standard input.
static void play(const char *model, const char *options, const char *lines, int is_file)
{
    if (is_file)
        check_run(&c,
                  "cd %s && printf 'pliant-script 1\\n%s' >a.script && P=$OLDPWD/%s/pliant-play && "
                  "$P --json %s %s a.script",
                  check_folder(), lines, check_build(), options, model);
    else
        check_run(&c,
                  "cd %s && printf 'pliant-script 1\\n%s' | $OLDPWD/%s/pliant-play --json %s %s",
                  check_folder(), lines, check_build(), options, model);
}

static int is_lattice(void)
{
    return strstr(c.output, "\"kind\":\"lattice\"") != NULL;
}

static void of_a_model_with_both_the_script_decides(void **state)
{
    (void)state;
    check_run(&c,
              "%s/pliant-precompute -q %s --subdivide 1 --fixed 'z<0.05' --lattice 5 -o %s/both.h5",
              check_build(), penguin, check_folder());
    run_ok(&c);
    static const char lattice[] = "dt 0.01\\ngravity 0 0 -10\\nplane 0 0 1 -1\\nstep 3\\n";
    static const char greens[] = "dt 0.01\\nforce near 0 0 0.3 0 0 -1\\nstep 3\\n";
    static const char either[] = "probe p near 0 0 0.3\\ngravity 0 0 -10\\nstep 3\\n";
    const struct {
        const char *lines, *options;
        int expected;
    } cases[] = {
        {lattice, "", 1}, {lattice, "--lattice", 1}, {greens, "", 0},
        {either, "", 0},  {either, "--lattice", 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int is_file = 0; is_file < 2; is_file++) {
            play("both.h5", cases[i].options, cases[i].lines, is_file);
            run_ok(&c);
            if (is_lattice() != cases[i].expected)
                fail_msg("case %zu, from a file %d: %s", i, is_file, c.output);
        }
    // Gravity that was stated before is the lattice's, too.
    play("both.h5", "",
         "dt 0.125\\ngravity 0 0 -8\\nprobe p near 0 0 0.3\\ncollide none\\nstep\\nexpect p 0 0 "
         "-0.125 1e-5\\n",
         0);
    run_ok(&c);
    // --threads: of one world, or players side by side.
    play("both.h5", "--threads 2", lattice, 1);
    run_ok(&c);
    check_contains(c.output, "\"solvers\":1,");
    check_contains(c.output, "\"threads\":2");
    play("both.h5", "--threads 2", greens, 1);
    run_ok(&c);
    check_contains(c.output, "\"solvers\":2,");
    // Once decided, the other kind is refused.
    play("both.h5", "", "displace near 0 0 0.3 0 0 0.01\\nsphere 0 0 0 1\\n", 1);
    assert_int_equal(c.status, 1);
    check_one_line(&c, "pliant-play: ", "a.script:3:8: sphere is about a lattice");
    play("both.h5", "", "sphere 0 0 0 1\\ndisplace near 0 0 0.3 0 0 0.01\\n", 1);
    assert_int_equal(c.status, 1);
    check_one_line(&c, "pliant-play: ", "displace is about Green's functions");
    // The detail of statements that say which option makes no sense.
    play("both.h5", "--passive", lattice, 1);
    assert_int_equal(c.status, 1);
    check_one_line(&c, "pliant-play: ", "--passive is about Green's functions");
}

static void the_sample_scenes_are_what_their_manual_says(void **state)
{
    (void)state;
    check_run(&c,
              "%s/pliant-precompute -q %s --subdivide 2 --lattice 6 --half-width 2 --no-greens -o "
              "%s/penguins.h5",
              check_build(), penguin, check_folder());
    run_ok(&c);
    check_run(&c,
              "sed 's/^step .*/step 20/' scripts/sample/penguins.script >%s/p.script && "
              "%s/pliant-play %s/penguins.h5 %s/p.script",
              check_folder(), check_build(), check_folder(), check_folder());
    run_ok(&c);
    check_contains(c.output, "20 steps, 150 instances of 150 particles and 1474 vertices");
    check_run(&c,
              "%s/pliant-precompute -q %s --subdivide 3 --lattice 87 --half-width 1 --no-greens -o "
              "%s/statue.h5",
              check_build(), fox, check_folder());
    run_ok(&c);
    check_run(&c,
              "sed 's/^step .*/step/' scripts/sample/statue.script >%s/s.script && %s/pliant-play "
              "%s/statue.h5 %s/s.script",
              check_folder(), check_build(), check_folder(), check_folder());
    run_ok(&c);
    check_contains(c.output, "4 steps, 1 instance of 57154 particles");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(of_a_model_with_both_the_script_decides),
        cmocka_unit_test(the_sample_scenes_are_what_their_manual_says),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
