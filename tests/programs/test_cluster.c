// test_cluster.c: pliant-precompute over several hosts, and ranks and hosts that die.
//
// Hosts are network namespaces on a bridge, each with a host name of its own, so that Open MPI
// takes them for different machines; a script stands in for ssh. That needs root and iproute2:
// without them the tests are skipped.
#include "check.h"
#include "command.h"
#include "model_files.h"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char sample[] = "--fixed 'z<0.03' scripts/sample/whale.obj";
enum { HOSTS = 2, TIME_LIMIT = 60 };  // seconds, for what takes two

static int is_up;  // the hosts are there
static char agent[512], launcher[1024];

static const char *in_folder(const char *file)
{
    static char paths[16][512];
    static int turn;
    char *path = paths[turn++ % 16];
    snprintf(path, sizeof paths[0], "%s/%s", check_folder(), file);
    return path;
}

static int shell(const char *line)
{
    const int status = system(line);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

// Bridge and hosts have this process's number in their names, so that two runs of the test do not
// meet.
static void strike(void)
{
    char line[512];
    for (int k = 0; k < HOSTS; k++) {
        snprintf(line, sizeof line, "ip netns del pliant%d-%d 2>/dev/null", (int)getpid(), k);
        (void)shell(line);
    }
    snprintf(line, sizeof line, "ip link del plb%d 2>/dev/null", (int)getpid());
    (void)shell(line);
}

static int build_hosts(void)
{
    const int id = (int)getpid(), net = id % 250;
    char line[2048];
    if (geteuid() != 0 || shell("command -v ip unshare >/dev/null") != 0) return 0;
    snprintf(line, sizeof line,
             "(ip link add plb%d type bridge && ip addr add 10.77.%d.1/24 dev plb%d && ip link set "
             "plb%d up) 2>/dev/null",
             id, net, id, id);
    if (shell(line) != 0) return 0;
    for (int k = 0; k < HOSTS; k++) {
        snprintf(
            line, sizeof line,
            "(ip netns add pliant%d-%d && ip link add plv%d%d type veth peer name eth0 netns "
            "pliant%d-%d && ip link set plv%d%d master plb%d up && ip -n pliant%d-%d link set lo "
            "up && ip -n pliant%d-%d addr add 10.77.%d.%d/24 dev eth0 && ip -n pliant%d-%d link "
            "set eth0 up) 2>/dev/null",
            id, k, k, id, id, k, k, id, id, id, k, id, k, net, k + 2, id, k);
        if (shell(line) != 0) return 0;
    }
    // What mpirun takes for ssh. A folder named in PLIANT_PRIVATE is every host's own.
    snprintf(agent, sizeof agent, "%s", in_folder("agent"));
    FILE *out = fopen(agent, "w");
    assert_non_null(out);
    fprintf(
        out,
        "#!/bin/sh\nhost=$1; shift\nexec ip netns exec \"$host\" unshare --uts sh -c \"hostname "
        "$host; ${PLIANT_PRIVATE:+mount -t tmpfs none $PLIANT_PRIVATE;} $*\"\n");
    fclose(out);
    if (chmod(agent, 0700) != 0) return 0;
    snprintf(
        launcher, sizeof launcher,
        "mpirun --mca plm_rsh_agent %s --mca btl tcp,self --mca oob_tcp_if_include 10.77.%d.0/24 "
        "--mca btl_tcp_if_include 10.77.%d.0/24 --mca oob_tcp_keepalive_time 2 --mca "
        "oob_tcp_keepalive_intvl 1 --mca oob_tcp_keepalive_probes 3 --host "
        "pliant%d-0:2,pliant%d-1:2",
        agent, net, net, id, id);
    // Folders may be mounted where they are not to be executed from, name spaces may be forbidden.
    snprintf(line, sizeof line, "timeout 30 %s --quiet -n 4 true </dev/null >/dev/null 2>&1",
             launcher);
    return shell(line) == 0;
}

static int set_up(void **state)
{
    (void)state;
    is_up = build_hosts();
    if (!is_up) print_message("no hosts: they need root, iproute2 and network namespaces\n");
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    strike();
    return 0;
}

static void on_hosts(check_command *c, const char *options, const char *output)
{
    check_run(c, "timeout %d %s --quiet -n 4 %s/pliant-precompute --force %s %s -o %s </dev/null",
              TIME_LIMIT, launcher, check_build(), options, sample, output);
}

// ---- Hosts ----

static void hosts_are_solver_groups_and_the_model_is_the_same(void **state)
{
    (void)state;
    if (!is_up) skip();
    static const char *const cases[][3] = {
        {"--subdivide 2 --blocks all", "on 4 ranks (node, in 2 groups)", "bem.h5"},
        {"--subdivide 2 --blocks all --groups 1", "on 4 ranks (scalapack)", "bem.h5"},
        {"--subdivide 1 --method fem", "on 4 ranks (direct, in 4 groups)", "fem.h5"},
        {"--subdivide 1 --method fem --groups 2", "on 4 ranks (direct, in 2 groups)", "fem.h5"},
    };
    check_command c;
    for (int i = 0; i < 3; i += 2) {
        check_run(&c, "%s/pliant-precompute -q --force %s %s -o %s", check_build(), cases[i][0],
                  sample, in_folder(cases[i][2]));
        assert_int_equal(c.status, 0);
    }
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        on_hosts(&c, cases[i][0], in_folder("hosts.h5"));
        if (c.status != 0 || !strstr(c.errors, cases[i][1]))
            fail_msg("%s: status %d: %s", cases[i][0], c.status, c.errors);
        check_same_model(in_folder("hosts.h5"), in_folder(cases[i][2]), 1e-5);
    }
}

// Matrices for each of two machines do not fit, one over both does.
static void one_matrix_lies_over_hosts_that_cannot_hold_it(void **state)
{
    (void)state;
    if (!is_up) skip();
    check_command c;
    setenv("PETSC_OPTIONS", "-pliant_memory 0.12", 1);
    on_hosts(&c, "--subdivide 3 --constraint-levels 0", in_folder("large.h5"));
    unsetenv("PETSC_OPTIONS");
    if (!strstr(c.errors, "on 4 ranks (node, in 2 groups)")) fail_msg("%s", c.errors);
    setenv("PETSC_OPTIONS", "-pliant_memory 0.03", 1);
    on_hosts(&c, "--subdivide 3 --constraint-levels 0", in_folder("large.h5"));
    unsetenv("PETSC_OPTIONS");
    if (!strstr(c.errors, "on 4 ranks (scalapack)")) fail_msg("%s", c.errors);
}

static void a_folder_that_not_all_see_is_told(void **state)
{
    (void)state;
    if (!is_up) skip();
    check_command c;
    check_run(&c, "mkdir -p %s", in_folder("private"));
    setenv("PLIANT_PRIVATE", in_folder("private"), 1);
    // The hosts' own folder is gone with them: what is asked for is that it works and is told.
    on_hosts(&c, "--subdivide 1", in_folder("private/model.h5"));
    unsetenv("PLIANT_PRIVATE");
    if (c.status != 0) fail_msg("%s", c.errors);
    assert_non_null(strstr(c.errors, "an interrupted run begins anew"));
}

// ---- Death ----

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void nap(double seconds)
{
    nanosleep(&(struct timespec){(time_t)seconds, (long)(1e9 * (seconds - (time_t)seconds))}, NULL);
}

static pid_t start(const char *line)
{
    const pid_t child = fork();
    if (child == 0) {
        setpgid(0, 0);
        execl("/bin/sh", "sh", "-c", line, (char *)NULL);
        _exit(127);
    }
    assert_true(child > 0);
    return child;
}

static long size_of(const char *path)
{
    struct stat found;
    return stat(path, &found) == 0 ? (long)found.st_size : 0;
}

// A rank's process, by the output that it is to write; the last one that was started. mpirun's own
// command line has the same words, but does not begin with them.
static pid_t rank_of(const char *output)
{
    static check_command c;
    check_run(&c, "pgrep -f '^%s/pliant-precompute .*%s$' | tail -n 1", check_build(), output);
    return (pid_t)atoi(c.output);
}

typedef enum death { RANK_DIES, HOST_VANISHES } death;

// The run ends by itself, in time, with a message and no output; --resume brings the whole model.
static void die(const char *launch, double place, death how, const char *told)
{
    static const char settings[] = "PETSC_OPTIONS='-pliant_batch 4 -pliant_journal_seconds 0'";
    static check_command c;
    char line[4096], journal[600];
    const char *output = in_folder("mortal.h5"), *errors = in_folder("mortal.err");
    snprintf(journal, sizeof journal, "%s.partial/journal", output);
    check_run(&c, "rm -rf %s %s.partial", output, output);
    snprintf(
        line, sizeof line,
        "exec env %s %s %s/pliant-precompute --subdivide 3 %s -o %s >/dev/null 2>%s </dev/null",
        settings, launch, check_build(), sample, output, errors);
    const pid_t child = start(line);
    int status = 0;
    const double limit = now() + TIME_LIMIT;
    // The journal has about 800 bytes before columns, and then 40 for each of the 130 batches.
    const long bytes = place < 0 ? 0 : 800 + (long)(place * 4000);
    while (size_of(journal) < bytes && now() < limit && waitpid(child, &status, WNOHANG) == 0)
        nap(0.001);
    if (place < 0) nap(-place);
    if (how == RANK_DIES) {
        pid_t rank;
        while ((rank = rank_of(output)) == 0 && now() < limit) nap(0.01);
        if (rank > 0) kill(rank, SIGKILL);
    } else {
        snprintf(line, sizeof line, "ip -n pliant%d-1 link set eth0 down", (int)getpid());
        assert_int_equal(shell(line), 0);
    }
    while (waitpid(child, &status, WNOHANG) == 0) {
        if (now() > limit) {
            kill(-child, SIGKILL);
            fail_msg("hangs: %s", launch);
        }
        nap(0.01);
    }
    if (how == HOST_VANISHES) {
        snprintf(line, sizeof line,
                 "pkill -9 -f '^%s/pliant-precompute .*%s$'; ip -n pliant%d-1 link set eth0 up",
                 check_build(), output, (int)getpid());
        (void)shell(line);
    }
    check_run(&c, "cat %s >&2", errors);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) fail_msg("ended well: %s", c.errors);
    if (!strstr(c.errors, told)) fail_msg("\"%s\" is not in: %s", told, c.errors);
    assert_int_not_equal(access(output, F_OK), 0);
    check_run(&c, "%s/pliant-precompute -q --resume --subdivide 3 %s -o %s", check_build(), sample,
              output);
    if (c.status) fail_msg("%s", c.errors);
    check_same_model(output, in_folder("whole.h5"), 1e-5);
}

static void make_whole(void)
{
    check_command c;
    if (access(in_folder("whole.h5"), F_OK) == 0) return;
    check_run(&c, "%s/pliant-precompute -q --subdivide 3 %s -o %s", check_build(), sample,
              in_folder("whole.h5"));
    assert_int_equal(c.status, 0);
}

static void a_rank_that_dies_ends_the_job(void **state)
{
    (void)state;
    make_whole();
    // While it reads or assembles; while it solves.
    static const double places[] = {-0.15, -0.4, 0, 0.4, 0.8};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        die("mpirun -n 2", places[i], RANK_DIES, "exited on signal 9 (Killed)");
}

static void a_rank_that_dies_on_another_host_ends_the_job(void **state)
{
    (void)state;
    if (!is_up) skip();
    make_whole();
    char line[1100];
    snprintf(line, sizeof line, "%s -n 4", launcher);
    die(line, 0.1, RANK_DIES, "exited on signal 9 (Killed)");
    die(line, 0.5, RANK_DIES, "exited on signal 9 (Killed)");
}

static void a_host_that_vanishes_ends_the_job(void **state)
{
    (void)state;
    if (!is_up) skip();
    make_whole();
    char line[1100];
    snprintf(line, sizeof line, "%s -n 4", launcher);
    die(line, 0.1, HOST_VANISHES, "lost communication with a remote daemon");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hosts_are_solver_groups_and_the_model_is_the_same),
        cmocka_unit_test(one_matrix_lies_over_hosts_that_cannot_hold_it),
        cmocka_unit_test(a_folder_that_not_all_see_is_told),
        cmocka_unit_test(a_rank_that_dies_ends_the_job),
        cmocka_unit_test(a_rank_that_dies_on_another_host_ends_the_job),
        cmocka_unit_test(a_host_that_vanishes_ends_the_job),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down) != 0;
}
