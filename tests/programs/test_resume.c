// test_resume.c: interrupted runs of pliant-precompute: kills, signals, full disks, and what
// resumes.
//
// PLIANT_KILLS=50 kills fifty runs at random moments in place of six.
#include "check.h"
#include "command.h"
#include "model_files.h"

#include <dirent.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

// Every batch is in the journal, and batches are small: many moments to be killed at.
static const char often[] = "PETSC_OPTIONS='-pliant_journal_seconds 0 -pliant_batch 4'";
static const char sample[] = "scripts/sample/whale.obj";
static const char name[] = "pliant-precompute: ";
static const char material[] = "--fixed 'z<0.03' --young 50000 --poisson 0.4 --density 1000";

// ---- Files ----

static const char *in_folder(const char *file)
{
    static char paths[64][512];  // good until the 64th next call
    static int turn;
    char *path = paths[turn++ % 64];
    snprintf(path, sizeof paths[0], "%s/%s", check_folder(), file);
    return path;
}

static int exists(const char *path, const char *ending)
{
    char whole[600];
    snprintf(whole, sizeof whole, "%s%s", path, ending);
    return access(whole, F_OK) == 0;
}

static long size_of(const char *path, const char *ending)
{
    char whole[600];
    struct stat found;
    snprintf(whole, sizeof whole, "%s%s", path, ending);
    return stat(whole, &found) == 0 ? (long)found.st_size : 0;
}

// ---- Runs that end early ----

typedef struct launch {
    int ranks;            // 0: without mpirun
    const char *options;  // of pliant-precompute, mesh included
    const char *output;
} launch;

static void command_of(const char *settings, const launch *l, const char *more, char *line,
                       size_t size)
{
    char launcher[64] = "";
    if (l->ranks > 0) snprintf(launcher, sizeof launcher, "mpirun --quiet -n %d ", l->ranks);
    snprintf(line, size, "%s %s%s/pliant-precompute -q %s %s %s %s -o %s", settings, launcher,
             check_build(), l->options, material, more, sample, l->output);
}

static pid_t start_with(const char *settings, const launch *l, const char *more)
{
    char line[4096], whole[8192];
    command_of(settings, l, more, line, sizeof line);
    // env, so that the shell gives way to the program.
    snprintf(whole, sizeof whole, "exec env %s >%s 2>%s </dev/null", line, in_folder("run.out"),
             in_folder("run.err"));
    const pid_t child = fork();
    if (child == 0) {
        setpgid(0, 0);
        execl("/bin/sh", "sh", "-c", whole, (char *)NULL);
        _exit(127);
    }
    assert_true(child > 0);
    return child;
}

static pid_t start(const launch *l, const char *more)
{
    return start_with(often, l, more);
}

static int has_ended(pid_t child, int *status)
{
    return waitpid(child, status, WNOHANG) == child;
}

static void nap(long microseconds)
{
    nanosleep(&(struct timespec){microseconds / 1000000, microseconds % 1000000 * 1000}, NULL);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int exit_status(int status)
{
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static int wait_for(pid_t child)
{
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    return exit_status(status);
}

// SIGKILL for a process and the ranks that it has started, which mpirun puts into groups of their
// own.
static void kill_all(pid_t child)
{
    char path[64];
    pid_t ranks[16];
    int count = 0;
    snprintf(path, sizeof path, "/proc/%d/task/%d/children", (int)child, (int)child);
    FILE *file = fopen(path, "r");
    for (int rank; file && count < 16 && fscanf(file, "%d", &rank) == 1;) ranks[count++] = rank;
    if (file) fclose(file);
    // Ranks first, the last one first: mpirun must not have the time to end them its own way.
    for (int i = count - 1; i >= 0; i--) kill(ranks[i], SIGKILL);
    kill(child, SIGKILL);
}

// Sleep until the journal has so many bytes, or the run has ended (then 1).
static int await_journal(pid_t child, const char *output, long bytes, int *status)
{
    for (double end = now() + 60; now() < end; nap(300)) {
        if (has_ended(child, status)) return 1;
        if (size_of(output, ".partial/journal") >= bytes) return 0;
    }
    fail_msg("no journal of %ld bytes within a minute", bytes);
    return 1;
}

// The journal's bytes: when columns begin to be solved; at most, before the first batch is in it; a
// batch.
enum { JOURNAL_BEGUN = 300, JOURNAL_HEAD = 800, BATCH_RECORD = 40 };

// Begin a run and leave it after some batches.
static void leave_after(const launch *l, int batches)
{
    int status;
    check_command c;
    check_run(&c, "rm -rf %s %s.partial", l->output, l->output);
    const pid_t child = start(l, "");
    if (!await_journal(child, l->output, JOURNAL_HEAD + batches * BATCH_RECORD, &status)) {
        kill_all(child);
        (void)wait_for(child);
    }
    assert_true(exists(l->output, ".partial/journal"));
    assert_false(exists(l->output, ""));
}

static void resume(check_command *c, const launch *l, const char *more)
{
    char line[4096];
    command_of(often, l, more, line, sizeof line);
    check_run(c, "%s", line);
}

static void must_resume(const launch *l)
{
    check_command c;
    resume(&c, l, "--resume");
    if (c.status) print_error("%s", c.errors);
    assert_int_equal(c.status, 0);
    assert_false(exists(l->output, ".partial"));
    assert_false(exists(l->output, ".tmp"));
}

// An uninterrupted run's file.
static double make_expected(const launch *l)
{
    const double begin = now();
    check_command c;
    char line[4096];
    command_of(often, l, "--force", line, sizeof line);
    check_run(&c, "%s", line);
    if (c.status) print_error("%s", c.errors);
    assert_int_equal(c.status, 0);
    return now() - begin;
}

// ---- Cases ----

static void runs_killed_at_any_moment_resume_to_the_uninterrupted_file(void **state)
{
    (void)state;
    static const char *const variants[] = {"--subdivide 2", "--subdivide 2 --blocks all --eps 0.05",
                                           "--subdivide 2 --constraint-levels 1 --eps 0.1"};
    const char *wish = getenv("PLIANT_KILLS");
    const int wanted = wish ? atoi(wish) : 6;
    check_random random = check_random_seed(20260);
    int kills = 0, in_solve = 0, late = 0, ends = 0;
    for (int round = 0; kills < wanted; round++) {
        const launch whole = {.ranks = round % 2 ? 2 : 0,
                              .options = variants[round % 3],
                              .output = in_folder("whole.h5")};
        const launch l = {
            .ranks = whole.ranks, .options = whole.options, .output = in_folder("killed.h5")};
        check_command c;
        check_run(&c, "rm -rf %s %s.partial", l.output, l.output);
        const double seconds = make_expected(&whole);
        // Killed again and again, some times, then left alone.
        int ended = 0;
        for (int k = 0; k < 4 && kills < wanted && !ended; k++) {
            int status = 0;
            const pid_t child = start(&l, k > 0 ? "--resume" : "");
            const double choice = check_random_next(&random), place = check_random_next(&random);
            if (choice < 0.3) {
                const double end = now() + 1.1 * place * seconds;
                while (!(ended = has_ended(child, &status)) && now() < end) nap(300);
            } else if (choice < 0.9) {
                // Somewhere in the batches, and a bit: batches take a millisecond or some.
                const long bytes = size_of(l.output, ".partial/journal");
                const double end = now() + 30;
                while (!(ended = has_ended(child, &status)) && now() < end &&
                       size_of(l.output, ".partial/journal") < bytes + (long)(place * 3000))
                    nap(300);
                if (!ended) nap((long)(20000 * check_random_next(&random)));
            } else {
                while (!(ended = has_ended(child, &status)) &&
                       !exists(l.output, place < 0.5 ? "" : ".tmp"))
                    nap(100);
            }
            if (ended) {
                ends++;
                assert_int_equal(exit_status(status), 0);
                break;
            }
            kill_all(child);
            (void)wait_for(child);
            kills++;
            in_solve += size_of(l.output, ".partial/journal") > JOURNAL_HEAD;
            if (exists(l.output, "")) {
                late++;
                break;
            }
        }
        // Whatever has its name is whole.
        if (exists(l.output, "")) check_same_model(l.output, whole.output, 0);
        resume(&c, &l, "--resume");
        // Killed at its very last steps: there is nothing left to do.
        if (c.status == 1) check_one_line(&c, name, "exists already");
        else assert_int_equal(c.status, 0);
        assert_false(exists(l.output, ".partial"));
        check_same_model(l.output, whole.output, 0);
    }
    print_message("%d kills: %d with columns in the journal, %d after the output had its name; %d "
                  "runs came to their "
                  "end before\n",
                  kills, in_solve, late, ends);
}

// Of the same number of ranks the bytes, of another one the values.
static void another_number_of_ranks_goes_on(void **state)
{
    (void)state;
    const launch whole = {.options = "--subdivide 2 --blocks all", .output = in_folder("ranks.h5")};
    (void)make_expected(&whole);
    for (int ranks = 1; ranks <= 2; ranks++) {
        launch l = {.ranks = ranks, .options = whole.options, .output = in_folder("other.h5")};
        leave_after(&l, 12);
        l.ranks = 3 - ranks;
        must_resume(&l);
        check_same_model(l.output, whole.output, 1e-5);
    }
}

static void signals_finish_the_batch_and_say_how_to_go_on(void **state)
{
    (void)state;
    const launch whole = {.options = "--subdivide 2", .output = in_folder("unsignalled.h5")};
    (void)make_expected(&whole);
    const int signals[] = {SIGINT, SIGTERM, SIGUSR1};
    check_command c;
    for (int i = 0; i < 3; i++) {
        // mpirun passes SIGUSR1 on and waits for the ranks.
        const launch l = {.ranks = signals[i] == SIGUSR1 ? 2 : 0,
                          .options = whole.options,
                          .output = in_folder("signalled.h5")};
        int status = 0;
        check_run(&c, "rm -rf %s %s.partial", l.output, l.output);
        const pid_t child = start(&l, "");
        const int ended = await_journal(child, l.output, JOURNAL_BEGUN, &status);
        if (!ended) kill(child, signals[i]);
        const int code = ended ? exit_status(status) : wait_for(child);
        check_run(&c, "cat %s >&2", in_folder("run.err"));
        if (code != 128 + signals[i]) print_error("%s", c.errors);
        assert_int_equal(code, 128 + signals[i]);
        assert_non_null(
            strstr(c.errors, "pliant-precompute: interrupted: finishing what is in hand"));
        assert_non_null(strstr(c.errors, "columns are kept: --resume goes on from there"));
        assert_non_null(strstr(c.errors, "--resume goes on from there"));
        assert_false(exists(l.output, "") || exists(l.output, ".tmp"));
        assert_true(exists(l.output, ".partial/journal"));
        must_resume(&l);
        if (l.ranks == 0) check_same_model(l.output, whole.output, 0);
        else check_same_model(l.output, whole.output, 1e-5);
    }
    // mpirun's own way with a Ctrl-C: SIGTERM for the ranks, SIGKILL a second later, status 1.
    const launch l = {.ranks = 2, .options = whole.options, .output = in_folder("signalled.h5")};
    int status = 0;
    check_run(&c, "rm -rf %s %s.partial", l.output, l.output);
    const pid_t child = start(&l, "");
    assert_false(await_journal(child, l.output, JOURNAL_BEGUN, &status));
    kill(child, SIGINT);
    assert_int_not_equal(wait_for(child), 0);
    // It may have been so near its end that it could reach it.
    if (!exists(l.output, "")) must_resume(&l);
    check_same_model(l.output, whole.output, 1e-5);
}

static void a_second_signal_ends_at_once(void **state)
{
    (void)state;
    // One batch for all: long enough for two signals, or so on a quiet machine.
    const launch l = {.options = "--subdivide 3", .output = in_folder("impatient.h5")};
    static const char whole_batch[] = "PETSC_OPTIONS='-pliant_batch 1000'";
    check_command c;
    int code = 0, status = 0;
    for (int turn = 0; turn < 20 && code != 128 + SIGTERM; turn++) {
        check_run(&c, "rm -rf %s %s.partial", l.output, l.output);
        const pid_t child = start_with(whole_batch, &l, "");
        assert_false(await_journal(child, l.output, JOURNAL_BEGUN, &status));
        kill(child, SIGINT);
        while (size_of(in_folder("run.err"), "") == 0) nap(100);
        kill(child, SIGTERM);
        code = wait_for(child);
        // The batch had ended before the second one came.
        if (code != 128 + SIGTERM) assert_int_equal(code, 128 + SIGINT);
    }
    assert_int_equal(code, 128 + SIGTERM);
    check_run(&c, "cat %s >&2", in_folder("run.err"));
    check_one_line(&c, name,
                   "interrupted: finishing what is in hand (a second signal ends at once)");
    assert_false(exists(l.output, "") || exists(l.output, ".tmp"));
    must_resume(&l);
}

static void a_remeshed_model_resumes(void **state)
{
    (void)state;
    const launch whole = {.options = "--remesh 30 --levels 2", .output = in_folder("smooth.h5")};
    const launch l = {.options = whole.options, .output = in_folder("rough.h5")};
    (void)make_expected(&whole);
    leave_after(&l, 5);
    check_command c;
    const launch other = {.options = "--remesh 32 --levels 2", .output = l.output};
    resume(&c, &other, "--resume");
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "--remesh");
    must_resume(&l);
    check_same_model(l.output, whole.output, 0);
}

static void what_was_changed_is_refused_by_name(void **state)
{
    (void)state;
    char mesh[512];
    snprintf(mesh, sizeof mesh, "%s", in_folder("mesh.obj"));
    check_command c;
    check_run(&c, "cp %s %s", sample, mesh);
    const launch whole = {.options = "--subdivide 2", .output = in_folder("unchanged.h5")};
    const launch l = {.options = "--subdivide 2", .output = in_folder("changed.h5")};
    (void)make_expected(&whole);
    leave_after(&l, 5);
    static const char *const changes[][2] = {
        {"--young 60000", "--young was 50000 then, is 60000 now"},
        {"--fixed 'z<0.05'", "held vertices was "},
        {"--max 0.1 --rms 0.1", "--rms was 0.02"},
        {"--lattice 5", "--lattice was 0 then, is 5 now"}};
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++) {
        char more[100];
        snprintf(more, sizeof more, "--resume %s", changes[i][0]);
        resume(&c, &l, more);
        assert_int_equal(c.status, 1);
        check_one_line(&c, name, changes[i][1]);
        assert_non_null(strstr(c.errors, "--force"));
    }
    check_run(&c, "%s %s/pliant-precompute -q --resume --subdivide 2 %s %s -o %s", often,
              check_build(), material, mesh, in_folder("changed2.h5"));
    assert_int_equal(c.status, 0);
    // The same mesh but for the last digit of one coordinate.
    check_run(&c,
              "mv %s.partial %s.partial; sed '0,/^v /s/\\(^v .*\\)$/\\11/' %s > %s; ! cmp -s %s %s",
              l.output, in_folder("changed3.h5"), sample, mesh, mesh, sample);
    assert_int_equal(c.status, 0);
    check_run(&c, "%s %s/pliant-precompute -q --resume --subdivide 2 %s %s -o %s", often,
              check_build(), material, mesh, in_folder("changed3.h5"));
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "mesh contents was ");
    // None of that did any harm.
    const launch same = {.options = l.options, .output = in_folder("changed3.h5")};
    must_resume(&same);
    check_same_model(same.output, whole.output, 0);
}

static void a_second_run_is_refused(void **state)
{
    (void)state;
    const launch l = {.options = "--subdivide 2", .output = in_folder("second.h5")};
    check_command c;
    int status = 0;
    // Beside the first: stopped, so that it is at work for sure.
    const pid_t child = start(&l, "");
    assert_false(await_journal(child, l.output, JOURNAL_HEAD, &status));
    kill(child, SIGSTOP);
    static const char *const wishes[] = {"--resume", "--force"};
    for (int i = 0; i < 2; i++) {
        resume(&c, &l, wishes[i]);
        assert_int_equal(c.status, 1);
        check_one_line(&c, name, "another run is at work on it");
    }
    kill(child, SIGKILL);
    (void)wait_for(child);
    // After it: columns would be lost.
    resume(&c, &l, "");
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "an interrupted run left ");
    assert_non_null(strstr(c.errors, "--resume goes on from there, --force begins anew"));
    assert_true(exists(l.output, ".partial/journal"));
    resume(&c, &l, "--dense x.h5 --resume");
    assert_int_equal(c.status, 2);
    check_one_line(&c, name, "--resume: a run with --dense");
    resume(&c, &l, "--force");
    assert_int_equal(c.status, 0);
    assert_false(exists(l.output, ".partial"));
    // Done is done.
    resume(&c, &l, "--resume");
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "exists already");
    // Nothing to lose, nothing to refuse: --resume of nothing begins, and an empty folder is no
    // partial data.
    check_run(&c, "rm %s; mkdir %s.partial", l.output, l.output);
    resume(&c, &l, "");
    assert_int_equal(c.status, 0);
    assert_false(exists(l.output, ".partial"));
}

static void a_full_disk_keeps_what_is_done(void **state)
{
    (void)state;
    const launch whole = {.options = "--subdivide 2", .output = in_folder("roomy.h5")};
    const launch l = {.options = "--subdivide 2", .output = in_folder("crowded.h5")};
    (void)make_expected(&whole);
    char line[4096];
    snprintf(line, sizeof line, "%s/pliant-precompute -q --resume %s %s %s -o %s", check_build(),
             l.options, material, sample, l.output);
    check_command c;
    // All columns take 0.8 MB. Room for some of them, in units of 512 bytes; then for all the
    // others and not for the output.
    long last = 0;
    for (int units = 500; units <= 1100; units += 600) {
        // The limit is the program's alone: Open MPI's own daemon has files too.
        check_run(&c, "%s mpirun --quiet -n 1 sh -c \"ulimit -f %d; exec %s\"", often, units, line);
        if (c.status != 1) print_error("%d: %s", units, c.errors);
        assert_int_equal(c.status, 1);
        check_one_line(&c, name, "File too large");
        assert_non_null(strstr(c.errors, "columns are kept: --resume goes on from there"));
        assert_false(exists(l.output, "") || exists(l.output, ".tmp"));
        const char *kept = strstr(c.errors, " columns are kept");
        while (kept > c.errors && strchr("0123456789 of", kept[-1])) kept--;
        const long count = strtol(kept, NULL, 10);
        assert_true(count > last);
        assert_true(exists(l.output, ".partial/journal"));
        last = count;
    }
    must_resume(&l);
    // The limit is one of shared memory, too, so that these runs have factored by ScaLAPACK.
    check_same_model(l.output, whole.output, 1e-5);
    // No room for anything: nothing is left behind.
    check_run(&c, "mpirun --quiet -n 1 sh -c \"ulimit -f 0; exec %s --force\"", line);
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "File too large");
    assert_false(exists(l.output, ".partial") || exists(l.output, ".tmp"));
    // A folder that cannot be made.
    check_run(&c, "rm -f %s; echo precious > %s.partial", l.output, l.output);
    resume(&c, &l, "--force");
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "crowded.h5.partial");
    check_run(&c, "cat %s.partial", l.output);
    assert_string_equal(c.output, "precious\n");
    check_run(&c, "rm %s.partial; %s/pliant-precompute -q --subdivide 2 %s %s -o /proc/model.h5",
              l.output, check_build(), material, sample);
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "/proc/model.h5");
}

// A byte of a finished column that the disk did not keep costs that column and what follows it.
static void damaged_columns_are_solved_again(void **state)
{
    (void)state;
    const launch whole = {.options = "--subdivide 2", .output = in_folder("sound.h5")};
    const launch l = {.options = "--subdivide 2", .output = in_folder("damaged.h5")};
    (void)make_expected(&whole);
    leave_after(&l, 8);
    char path[600];
    snprintf(path, sizeof path, "%s.partial/columns.0.0", l.output);
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    fseek(file, 30000, SEEK_SET);
    const int byte = fgetc(file);
    fseek(file, 30000, SEEK_SET);
    fputc(byte ^ 16, file);
    fclose(file);
    check_command c;
    check_run(&c, "%s %s/pliant-precompute --resume %s %s %s -o %s", often, check_build(),
              l.options, material, sample, l.output);
    assert_int_equal(c.status, 0);
    assert_non_null(strstr(c.errors, "columns are damaged and will be solved again"));
    assert_non_null(strstr(c.errors, "goes on with "));
    check_same_model(l.output, whole.output, 0);
    // A journal that is none.
    check_run(&c, "mkdir %s.partial; rm %s; echo 'my notes' > %s.partial/journal", l.output,
              l.output, l.output);
    resume(&c, &l, "--resume");
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "--force begins anew");
    resume(&c, &l, "--force");
    assert_int_equal(c.status, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(runs_killed_at_any_moment_resume_to_the_uninterrupted_file),
        cmocka_unit_test(another_number_of_ranks_goes_on),
        cmocka_unit_test(signals_finish_the_batch_and_say_how_to_go_on),
        cmocka_unit_test(a_second_signal_ends_at_once),
        cmocka_unit_test(a_remeshed_model_resumes),
        cmocka_unit_test(what_was_changed_is_refused_by_name),
        cmocka_unit_test(a_second_run_is_refused),
        cmocka_unit_test(a_full_disk_keeps_what_is_done),
        cmocka_unit_test(damaged_columns_are_solved_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
