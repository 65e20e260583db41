// test_play.c: the program pliant-play: what it prints, writes, refuses and leaves behind.
//
// PLIANT_BUILD names the folder of the program; default build.
#include "check.h"

#include "pliant/pliant.h"
#include "pliant/reader.h"
#include "synthetic_model.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { TEXT_SIZE = 1 << 16 };

static char program[1024], folder[64];
static char out[TEXT_SIZE], err[TEXT_SIZE];  // of the last run

// ---- Files ----

static const char *in_folder(const char *name)
{
    static char paths[4][256];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static void write_text(const char *name, const char *text)
{
    FILE *file = fopen(in_folder(name), "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static void read_text(const char *name, char text[TEXT_SIZE])
{
    FILE *file = fopen(in_folder(name), "r");
    if (!file) fail_msg("%s: %s", name, strerror(errno));
    text[fread(text, 1, TEXT_SIZE - 1, file)] = 0;
    fclose(file);
}

static int exists(const char *name)
{
    return access(in_folder(name), F_OK) == 0;
}

// Run a shell line in the folder, $P being the program with two minutes to end; its exit status,
// with `out` and `err` filled.
__attribute__((format(printf, 1, 2))) static int run(const char *format, ...)
{
    char line[4096];
    va_list arguments;
    int used = snprintf(line, sizeof line, "cd '%s' && P='timeout 120 %s' && { ", folder, program);
    va_start(arguments, format);
    used += vsnprintf(line + used, sizeof line - (size_t)used, format, arguments);
    va_end(arguments);
    snprintf(line + used, sizeof line - (size_t)used, " ; } 2>err.txt");
    FILE *pipe = popen(line, "r");
    assert_non_null(pipe);
    out[fread(out, 1, sizeof out - 1, pipe)] = 0;
    const int status = pclose(pipe);
    read_text("err.txt", err);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static void check_status(int found, int expected, const char *file, int line)
{
    if (found == expected) return;
    print_error("exit status %d, expected %d\nstandard output: %s\nstandard error: %s\n", found,
                expected, out, err);
    _fail(file, line);
}

#define check_run(expected, ...) check_status(run(__VA_ARGS__), (expected), __FILE__, __LINE__)

static void check_contains(const char *text, const char *part)
{
    if (!strstr(text, part)) fail_msg("expected \"%s\" in:\n%s", part, text);
}

static int count_lines(const char *text)
{
    int count = 0;
    for (; *text; text++) count += *text == '\n';
    return count;
}

// A script whose steps do something: 7 steps, two probes.
static const char poke[] = "pliant-script 1\n"
                           "probe nose near 0 0 1\n"
                           "probe side near 1 0 0\n"
                           "displace near 0 0 1 0 0 -0.02\n"
                           "step\n"
                           "traction near 1 0 0 0.5 0 0\n"
                           "step 3\n"
                           "gravity 0 0 -0.25\n"
                           "dt 0.01\n"
                           "step 2\n"
                           "force near 0 1 0 0.1 0 0\n"
                           "step\n"
                           "expect nose 0 0 -0.02 1e-8\n";

static int set_up(void **state)
{
    (void)state;
    const char *build = getenv("PLIANT_BUILD");
    char path[512];
    snprintf(path, sizeof path, "%s/pliant-play", build ? build : "build");
    if (!realpath(path, program)) {
        print_error("%s: %s: build it first, or set PLIANT_BUILD\n", path, strerror(errno));
        return -1;
    }
    strcpy(folder, "/tmp/pliant-play-XXXXXX");
    if (!mkdtemp(folder)) return -1;
    const pliant_wavelet_def wavelet = pliant_wavelet_default();
    // All levels; 162 vertices, nothing thresholded; and 42 for what takes many steps.
    check_write_synthetic_levels(in_folder("model.h5"), in_folder("dense.h5"), 2, 0, wavelet,
                                 CHECK_ALL_BLOCKS);
    check_write_synthetic_levels(in_folder("free.h5"), in_folder("free-dense.h5"), 2, 0.2, wavelet,
                                 CHECK_FREE_BLOCK);
    check_write_synthetic_levels(in_folder("tiny.h5"), NULL, 1, 0, wavelet, CHECK_FREE_BLOCK);
    // Compressed beyond what contact bears.
    check_write_synthetic_levels(in_folder("rough.h5"), NULL, 2, 1, wavelet, CHECK_FREE_BLOCK);
    // The first again, with 2562 vertices of detail.
    check_synthetic *detailed = check_synthetic_create(&(check_synthetic_def){
        .levels = 2, .wavelet = wavelet, .blocks = CHECK_FREE_BLOCK});
    check_synthetic_roughen(detailed, 2);
    check_synthetic_write(detailed, in_folder("detail.h5"));
    check_synthetic_destroy(detailed);
    write_text("poke.script", poke);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    char line[128];
    snprintf(line, sizeof line, "rm -rf '%s'", folder);
    return system(line);
}

// ---- The command line ----

static void help_and_version_go_to_standard_output(void **state)
{
    (void)state;
    check_run(0, "$P --version");
    assert_string_equal(out, "pliant-play " PLIANT_VERSION_TEXT "\n");
    check_run(0, "$P -h");
    const char *const options[] = {"-o, --output", "--frames",    "--vtk",       "--force",
                                   "--lod",        "--repeat",    "--threads",   "--compare",
                                   "--deadline-us", "--passive",     "--detail",
                                   "--json",       "--no-verify", "-q, --quiet", "--help",
                                   "--version",    "example:"};
    for (size_t i = 0; i < sizeof options / sizeof *options; i++) check_contains(out, options[i]);
    const char *const statements[] = {"pliant-script 1", "probe NAME",   "displace VERTEX",
                                      "traction VERTEX", "force VERTEX", "support VERTEX",
                                      "gravity X Y Z",   "release all",  "dt SECONDS",
                                      "step [COUNT]",    "expect NAME", "deadline US"};
    for (size_t i = 0; i < sizeof statements / sizeof *statements; i++)
        check_contains(out, statements[i]);
    check_run(0, "$P --help --unknown");
    check_run(1, "$P --help >/dev/full");
    check_contains(err, "pliant-play: standard output: No space left on device");
}

static void misuse_is_told_and_ends_with_status_2(void **state)
{
    (void)state;
    const struct {
        const char *arguments, *message;
    } cases[] = {
        {"", "expected MODEL.h5 [SCRIPT], found nothing; see --help"},
        {"a b c", "expected MODEL.h5 [SCRIPT], found 'c' too; see --help"},
        {"--lode 1 model.h5", "--lode: unknown option; see --help"},
        {"--deadline-us x model.h5",
         "--deadline-us: expected a whole number from 0 to 1000000000, found 'x'"},
        {"--deadline-us -1 model.h5",
         "--deadline-us: expected a whole number from 0 to 1000000000, found '-1'"},
        {"--deadline-us 1000000001 model.h5",
         "--deadline-us: expected a whole number from 0 to 1000000000, found '1000000001'"},
        {"--passive=no model.h5", "--passive: expected no value, found --passive=no"},
        {"-z model.h5", "-z: unknown option; see --help"},
        {"--lod", "--lod: expected a value, found nothing"},
        {"-o", "-o: expected a value, found nothing"},
        {"-o '' model.h5", "-o: expected a name, found nothing"},
        {"--quiet=1 model.h5", "--quiet: expected no value, found --quiet=1"},
        {"--lod fine model.h5", "--lod: expected a whole number from 0 to 2147483647, found 'fine'"},
        {"--lod -1 model.h5", "--lod: expected a whole number from 0 to 2147483647, found '-1'"},
        {"--lod 3 model.h5 poke.script",
         "--lod: expected a number from 0 to 2, the levels of model.h5, found 3"},
        {"--repeat 0 model.h5 poke.script",
         "--repeat: expected a whole number from 1 to 1000000000, found '0'"},
        {"--repeat 99999999999999999999 model.h5 poke.script",
         "--repeat: expected a whole number from 1 to 1000000000, found '99999999999999999999'"},
        {"--threads 1x model.h5 poke.script",
         "--threads: expected a whole number from 1 to 256, found '1x'"},
        {"--threads 257 model.h5 poke.script",
         "--threads: expected a whole number from 1 to 256, found '257'"},
        {"--repeat 2 model.h5", "--repeat: expected a script file, found standard input"},
        {"--threads 2 model.h5 -", "--threads: expected a script file, found standard input"},
        {"--threads 2 model.h5 /dev/null",
         "--threads: expected a regular file as script, found /dev/null"},
        {"-o model.h5 model.h5 poke.script",
         "-o: expected a file of its own, found the input model.h5"},
        {"--frames ./poke.script model.h5 poke.script",
         "--frames: expected a file of its own, found the input poke.script"},
        {"-o x --frames x model.h5", "-o and --frames: expected two files, found x twice"},
        {"--detail -o x model.h5 poke.script",
         "--detail: expected --frames or --vtk with it, found neither"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char expected[256];
        check_run(2, "$P %s </dev/null", cases[i].arguments);
        snprintf(expected, sizeof expected, "pliant-play: %s\n", cases[i].message);
        assert_string_equal(err, expected);
        assert_string_equal(out, "");
    }
}

static void a_model_that_is_none_is_refused(void **state)
{
    (void)state;
    check_run(1, "$P nowhere.h5 poke.script");
    assert_string_equal(err, "pliant-play: nowhere.h5: No such file or directory\n");
    check_run(1, "$P dense.h5 poke.script");
    assert_int_equal(count_lines(err), 1);
    check_contains(err, "pliant-play: dense.h5: ");
    check_run(1, "$P model.h5 nowhere.script");
    assert_string_equal(err, "pliant-play: nowhere.script: No such file or directory\n");
}

static void checksums_are_verified_unless_told_not_to(void **state)
{
    (void)state;
    // The last byte of a vertex coordinate's mantissa's middle: harmless, but not what was written.
    pliant_reader *reader;
    check_ok(pliant_reader_open(in_folder("model.h5"), &reader, NULL), NULL);
    const unsigned long offset =
        (unsigned long)pliant_reader_find(reader, "/mesh/vertices")->offset + 8 * 30;
    pliant_reader_close(reader);
    check_run(0,
              "cp model.h5 flipped.h5 && printf '\\001' | "
              "dd of=flipped.h5 bs=1 seek=%lu conv=notrunc",
              offset);
    check_run(1, "$P flipped.h5 poke.script");
    check_contains(err, "pliant-play: flipped.h5: ");
    check_contains(err, "/mesh/vertices");
    assert_int_equal(count_lines(err), 1);
    check_run(0, "$P --no-verify flipped.h5 poke.script");
    check_run(0, "rm flipped.h5");
}

// ---- What is printed ----

static void a_script_ends_with_a_table(void **state)
{
    (void)state;
    check_run(0, "$P model.h5 poke.script");
    assert_string_equal(err, "");
    check_contains(out, "poke.script on model.h5: 7 steps, up to 1 constraint, surface of 162 of "
                        "162 vertices (level 2 of 0..2)\n");
    const char *const phases[] = {"capacitance", "contact", "summation", "surface", "total"};
    for (size_t i = 0; i < sizeof phases / sizeof *phases; i++) {
        char mark[32];
        double median, high, worst;
        snprintf(mark, sizeof mark, "\n%s ", phases[i]);
        const char *row = strstr(out, mark);
        assert_non_null(row);
        assert_int_equal(sscanf(row + strlen(mark), "%lf %lf %lf", &median, &high, &worst), 3);
        assert_true(0 <= median && median <= high && high <= worst);
    }
    int vertex;
    double x, y, z;
    assert_int_equal(sscanf(strstr(out, "\nnose "), " nose %d %lf %lf %lf", &vertex, &x, &y, &z),
                     4);
    check_near(z, -0.02, 1e-7);
    assert_int_equal(
        sscanf(strstr(out, "\ncontact force "), " contact force %lf %lf %lf", &x, &y, &z), 3);
    check_run(0, "$P -q model.h5 poke.script");
    assert_string_equal(out, "");
    write_text("still.script", "pliant-script 1\nprobe p vertex 1\n");
    check_run(0, "$P model.h5 still.script");
    assert_string_equal(out, "still.script on model.h5: 0 steps: nothing was solved\n");
}

static void json_is_one_object_with_what_the_table_says(void **state)
{
    (void)state;
    check_run(0, "$P --json --compare dense.h5 model.h5 poke.script");
    assert_int_equal(count_lines(out), 1);
    const char *const parts[] = {
        "{\"model\":\"model.h5\",\"script\":\"poke.script\",\"steps\":7,",
        "\"constraints_most\":1,\"rough_steps\":0,\"solvers\":1,\"passes\":1,",
        "\"us\":{\"capacitance\":{\"median\":",
        "\"total\":{\"median\":",
        "\"probes\":{\"nose\":{\"vertex\":",
        "\"side\":{",
        "\"force\":[",
        "\"compare\":{\"steps\":7,\"rms\":",
        "\"force_worst_step\":"};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) check_contains(out, parts[i]);
    // Brackets match outside strings, and nothing follows the object.
    char open[64];
    int depth = 0, in_string = 0;
    for (const char *c = out; *c; c++) {
        if (*c == '"') in_string = !in_string;
        if (in_string) continue;
        assert_true(depth < 64);
        if (*c == '{' || *c == '[') open[depth++] = *c;
        if (*c == '}' || *c == ']') {
            assert_true(depth > 0 && open[--depth] == (*c == '}' ? '{' : '['));
            if (depth == 0) assert_string_equal(c + 1, "\n");
        }
    }
    assert_int_equal(depth, 0);
}

// ---- Streaming ----

typedef struct conversation {
    pid_t pid;
    int to, from;
} conversation;

static conversation start(const char *const *arguments, int is_terminal)
{
    int to[2], from[2];
    assert_int_equal(pipe(from), 0);
    if (is_terminal) {
        to[1] = posix_openpt(O_RDWR | O_NOCTTY);
        assert_true(to[1] >= 0 && grantpt(to[1]) == 0 && unlockpt(to[1]) == 0);
        to[0] = open(ptsname(to[1]), O_RDWR | O_NOCTTY);
        assert_true(to[0] >= 0);
    } else {
        assert_int_equal(pipe(to), 0);
    }
    const pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        const int messages = open(in_folder("err.txt"), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        if (dup2(to[0], 0) < 0 || dup2(from[1], 1) < 0 || dup2(messages, 2) < 0 ||
            chdir(folder) != 0)
            _exit(99);
        close(to[0]), close(to[1]), close(from[0]), close(from[1]), close(messages);
        execv(program, (char *const *)arguments);
        _exit(99);
    }
    close(to[0]);
    close(from[1]);
    return (conversation){pid, to[1], from[0]};
}

static void say(const conversation *c, const char *text)
{
    assert_int_equal(write(c->to, text, strlen(text)), (ssize_t)strlen(text));
}

// The next line, which must come while the program's input stays open; "" at the end of its output.
static const char *hear(const conversation *c)
{
    static char line[1024];
    size_t length = 0;
    for (;;) {
        struct pollfd wait = {.fd = c->from, .events = POLLIN};
        // No answer in 20 s is no answer, on the busiest machine.
        if (poll(&wait, 1, 20000) != 1) fail_msg("no answer after \"%.*s\"", (int)length, line);
        if (length + 1 == sizeof line || read(c->from, line + length, 1) != 1) break;
        if (line[length++] == '\n') break;
    }
    line[length] = 0;
    return line;
}

static int finish(conversation *c)
{
    int status;
    close(c->to);
    close(c->from);
    assert_int_equal(waitpid(c->pid, &status, 0), c->pid);
    read_text("err.txt", err);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static void standard_input_is_answered_line_by_line(void **state)
{
    (void)state;
    const char *const arguments[] = {"pliant-play", "model.h5", NULL};
    conversation c = start(arguments, 0);
    int step, constraints, level;
    double time, us, x, y, z, f[3];
    say(&c, "pliant-script 1\nprobe nose near 0 0 1\n# nothing to say\n");
    say(&c, "displace near 0 0 1 0 0 -0.5\nstep\n");
    assert_int_equal(sscanf(hear(&c),
                            "step %d time %lf us %lf constraints %d level %d nose %lf %lf %lf "
                            "force %lf %lf %lf",
                            &step, &time, &us, &constraints, &level, &x, &y, &z, &f[0], &f[1],
                            &f[2]),
                     11);
    assert_int_equal(step, 1);
    check_near(time, 0.001, 1e-12);
    assert_int_equal(constraints, 1);
    assert_int_equal(level, 2);
    check_near(z, -0.5, 0);
    assert_true(f[2] < 0);  // it is pushed inwards
    say(&c, "expect nose 0 0 -0.5 1e-6\n");
    assert_string_equal(hear(&c), "ok\n");
    say(&c, "step 2\n");
    assert_int_equal(sscanf(hear(&c), "step %d", &step), 1);
    assert_int_equal(step, 2);
    assert_int_equal(sscanf(hear(&c), "step %d", &step), 1);
    assert_int_equal(step, 3);
    say(&c, "expect nose 0 0 0 0.25\n");
    assert_string_equal(hear(&c), "failed: nose: found 0 0 -0.5, expected 0 0 0: distance 0.5, "
                                  "tolerance 0.25\n");
    assert_string_equal(hear(&c), "");  // it has ended
    check_status(finish(&c), 1, __FILE__, __LINE__);
    assert_string_equal(err,
                        "pliant-play: standard input:8:8: expect nose: found 0 0 -0.5, expected "
                        "0 0 0: distance 0.5, tolerance 0.25\n");
}

static void json_answers_are_lines_too(void **state)
{
    (void)state;
    const char *const arguments[] = {"pliant-play", "--json", "model.h5", "-", NULL};
    conversation c = start(arguments, 0);
    say(&c, "pliant-script 1\nprobe nose near 0 0 1\ndisplace near 0 0 1 0 0 -0.5\nstep\n");
    const char *line = hear(&c);
    check_contains(line, "{\"step\":1,\"time\":0.001,\"solve_us\":");
    check_contains(line, "\"constraints\":1,\"level\":2,\"rough\":false,");
    check_contains(line, "\"probes\":{\"nose\":[0,0,-0.5]},\"force\":[");
    say(&c, "expect nose 0 0 -0.5 0\n");
    assert_string_equal(hear(&c),
                        "{\"expect\":\"nose\",\"line\":5,\"met\":true,\"found\":[0,0,-0.5],"
                        "\"expected\":[0,0,-0.5],\"distance\":0,\"tolerance\":0}\n");
    say(&c, "probe late vertex 1\n");
    assert_string_equal(hear(&c), "");
    check_status(finish(&c), 1, __FILE__, __LINE__);
    check_contains(err, "standard input:6:7: probe late after a step: ");
}

static void a_person_is_told_and_goes_on(void **state)
{
    (void)state;
    const char *const arguments[] = {"pliant-play", "-o", "typed.csv", "model.h5", NULL};
    conversation c = start(arguments, 1);
    say(&c, "pliant-script 1\nprobe nose near 0 0 1\nstpe\nexpect nose 0 0 0 1\nstep\n");
    check_contains(hear(&c), "step 1 ");
    say(&c, "expect nose 1 0 0 0.5\nstep\n");
    check_contains(hear(&c), "failed: nose: ");
    check_contains(hear(&c), "step 2 ");
    say(&c, "\004");  // end of file at a terminal
    assert_string_equal(hear(&c), "");
    check_status(finish(&c), 1, __FILE__, __LINE__);
    assert_int_equal(count_lines(err), 3);
    check_contains(err, "pliant-play: standard input:3:1: ");
    check_contains(err, "pliant-play: standard input:4:8: probe nose has no displacement yet");
    check_contains(err, "pliant-play: standard input:6:8: expect nose: ");
    // What was played stands.
    read_text("typed.csv", out);
    assert_int_equal(count_lines(out), 3);
    unlink(in_folder("typed.csv"));
}

static void a_closed_pipe_ends_it_quietly(void **state)
{
    (void)state;
    const char *const arguments[] = {"pliant-play", "-o", "pipe.csv", "model.h5", NULL};
    conversation c = start(arguments, 0);
    say(&c, "pliant-script 1\nstep 1000000000\n");
    check_contains(hear(&c), "step 1 ");
    check_status(finish(&c), 128 + SIGPIPE, __FILE__, __LINE__);
    assert_string_equal(err, "");
    assert_false(exists("pipe.csv"));
    assert_false(exists("pipe.csv.tmp"));
}

// ---- Mistakes in scripts ----

static void mistakes_name_file_line_and_column(void **state)
{
    (void)state;
    char expected[256];
    const struct {
        const char *text, *message;
    } cases[] = {
        {"step\n", "1:1: expected \"pliant-script 1\" as first statement, found \"step\""},
        {"pliant-script 1\ndisplace 99999 0 0 -0.02\n", "2:10: vertex 99999 of 162"},
        {"pliant-script 1\n\n  displace 1 0 0\n",
         "3:17: expected z, a number, found the end of the line"},
        {"pliant-script 1\nstep 0\n", "2:6: expected a number of steps, 1 or more, found \"0\""},
        {"pliant-script 1\njump\n", "2:1: expected "},
        {"pliant-script 1\nprobe p vertex 1\nexpect p 0 0 0 1\n",
         "3:8: probe p has no displacement yet: expected a step before"},
        {"pliant-script 1\nstep\nexpect q 0 0 0 1\n",
         "3:8: no probe q: expected one declared before"},
        {"pliant-script 1\nprobe p vertex 1\nprobe p vertex 2\n",
         "3:7: probe p is already there: expected another name"},
        {"pliant-script 1\nrelease source 70000\n", "2:9: source vertex 70000 is not in the model"},
        {"pliant-script 1\nforce 5:1 0 0 1\n", "2:7: level 5: expected 0 to 2"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_text("bad.script", cases[i].text);
        check_run(1, "$P -o bad.csv model.h5 bad.script");
        snprintf(expected, sizeof expected, "pliant-play: bad.script:%s", cases[i].message);
        assert_memory_equal(err, expected, strlen(expected));
        assert_int_equal(count_lines(err), 1);
        assert_string_equal(out, "");
        assert_false(exists("bad.csv"));
        assert_false(exists("bad.csv.tmp"));
    }
}

// Play a script of the folder; the most memory that was resident, kB, by the kernel's account.
static double resident_of(const char *script, int expected)
{
    const pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        const int nothing = open("/dev/null", O_WRONLY);
        const int messages = open(in_folder("err.txt"), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        if (chdir(folder) != 0 || dup2(nothing, 1) < 0 || dup2(messages, 2) < 0) _exit(99);
        execl(program, "pliant-play", "-o", "many.csv", "tiny.h5", script, (char *)NULL);
        _exit(99);
    }
    int status;
    struct rusage usage;
    assert_int_equal(wait4(pid, &status, 0, &usage), pid);
    read_text("err.txt", err);
    check_status(WIFEXITED(status) ? WEXITSTATUS(status) : 128, expected, __FILE__, __LINE__);
    return (double)usage.ru_maxrss;
}

static void long_scripts_and_lines_play_in_the_memory_of_short_ones(void **state)
{
    (void)state;
    write_text("few.script",
               "pliant-script 1\nprobe p near 0 0 1\ndisplace near 0 0 1 0 0 1\nstep\n");
    const double few = resident_of("few.script", 0);
    // A page of code or a buffer more may be touched, kB; the scripts are 20 MB, the rows 50.
    const double slack = 2048;

    FILE *script = fopen(in_folder("many.script"), "w");
    assert_non_null(script);
    fputs("pliant-script 1\nprobe p near 0 0 1\n", script);
    for (int i = 0; i < 500000; i++)
        fprintf(script, "displace near 0 0 1 0 0 -0.%03d\nstep\n", i % 1000);
    assert_int_equal(fclose(script), 0);
    check_at_most(resident_of("many.script", 0), few + slack);
    check_run(0, "wc -l <many.csv; rm many.csv many.script");
    assert_int_equal(atoi(out), 500001);

    check_run(0,
              "{ echo 'pliant-script 1'; head -c 20000000 /dev/zero | tr '\\0' 7; } >wide.script");
    check_at_most(resident_of("wide.script", 1), few + slack);
    check_contains(err, "pliant-play: wide.script:2:");
    assert_int_equal(count_lines(err), 1);
    check_run(0, "rm wide.script few.script");
}

static void a_failed_expectation_ends_the_play_with_status_1(void **state)
{
    (void)state;
    write_text("fail.script",
               "pliant-script 1\nprobe nose near 0 0 1\ndisplace near 0 0 1 0 0 -0.5\n"
               "step\nexpect nose 0 0 -0.5 0\nexpect nose 0 0 -0.25 0.125\nstep\n");
    write_text("kept.csv", "mine\n");
    check_run(1, "$P -o kept.csv --frames fail.h5 --vtk fail model.h5 fail.script");
    assert_string_equal(err,
                        "pliant-play: fail.script:6:8: expect nose: found 0 0 -0.5, expected 0 "
                        "0 -0.25: distance 0.25, tolerance 0.125\n");
    assert_string_equal(out, "");
    // No output of a failed play, and what stood there stays.
    read_text("kept.csv", out);
    assert_string_equal(out, "mine\n");
    assert_false(exists("kept.csv.tmp") || exists("fail.h5") || exists("fail.h5.tmp") ||
                 exists("fail"));
    check_run(0, "ls");
    assert_null(strstr(out, "fail.h5"));
}

// ---- Outputs ----

static void csv_has_the_promised_columns(void **state)
{
    (void)state;
    check_run(0, "$P -o poke.csv model.h5 poke.script");
    read_text("poke.csv", out);
    assert_false(exists("poke.csv.tmp"));
    assert_int_equal(count_lines(out), 8);
    const char *row = strchr(out, '\n') + 1;
    assert_memory_equal(out,
                        "step,time,solve_us,constraints,level,nose.x,nose.y,nose.z,side.x,side.y,"
                        "side.z,force.x,force.y,force.z\n",
                        (size_t)(row - out));
    const double times[] = {0.001, 0.002, 0.003, 0.004, 0.014, 0.024, 0.034};
    for (int i = 0; i < 7; i++, row = strchr(row, '\n') + 1) {
        double v[14];
        int length;
        for (int k = 0; k < 14; k++) {
            assert_int_equal(sscanf(row, "%lf%n", &v[k], &length), 1);
            row += length;
            assert_int_equal(*row, k < 13 ? ',' : '\n');
            row += k < 13;
        }
        check_near(v[0], i + 1, 0);
        check_near(v[1], times[i], 1e-12);
        assert_true(v[2] > 0);
        check_near(v[3], 1, 0);
        check_near(v[4], 2, 0);
        assert_true((float)v[7] == -0.02f);  // nine digits bring back the float
    }
    write_text("still.script", "pliant-script 1\nprobe p vertex 1\n");
    check_run(0, "$P -q -o poke.csv model.h5 still.script");
    read_text("poke.csv", out);
    assert_string_equal(out, "step,time,solve_us,constraints,level,p.x,p.y,p.z,force.x,force.y,"
                             "force.z\n");
    check_run(0, "rm poke.csv; $P -q -o /dev/stdout model.h5 poke.script");
    assert_int_equal(count_lines(out), 8);
    write_text("late.script", "pliant-script 1\nstep\nprobe p vertex 1\n");
    check_run(1, "$P -o late.csv model.h5 late.script");
    check_contains(err, "late.script:3:7: probe p after a step: ");
    check_run(0, "$P model.h5 late.script");
}

#ifndef PLIANT_WITHOUT_HDF5
static void frames_hold_every_surface(void **state)
{
    (void)state;
    const struct {
        const char *how;
        uint64_t vertex_count;
    } cases[] = {{"model.h5 poke.script", 162},
                 {"model.h5 - <poke.script", 162},
                 {"--lod 1 model.h5 poke.script", 42}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        check_run(0, "$P -q -o frames.csv --frames frames.h5 %s", cases[i].how);
        pliant_error reason;
        pliant_reader *reader;
        check_ok(pliant_reader_open(in_folder("frames.h5"), &reader, &reason), &reason);
        check_ok(pliant_reader_verify(reader, &reason), &reason);
        const pliant_section *u = pliant_reader_find(reader, "/displacement");
        const pliant_section *step = pliant_reader_find(reader, "/step");
        const pliant_section *us = pliant_reader_find(reader, "/solve_us");
        const pliant_section *time = pliant_reader_find(reader, "/time");
        assert_true(u && step && us && time);
        assert_true(u->type == PLIANT_F4 && u->rank == 3);
        assert_true(u->shape[0] == 7 && u->shape[1] == cases[i].vertex_count && u->shape[2] == 3);
        assert_true(step->type == PLIANT_U8 && us->type == PLIANT_F8 && time->type == PLIANT_F8);
        // The displaced vertex, and the solve times that the table has too.
        read_text("frames.csv", out);
        const char *row = out;
        double deepest = 0;
        for (int s = 0; s < 7; s++) {
            double number, seconds, solve_us;
            row = strchr(row, '\n') + 1;
            assert_int_equal(sscanf(row, "%lf,%lf,%lf", &number, &seconds, &solve_us), 3);
            assert_int_equal(((const uint64_t *)step->data)[s], s + 1);
            check_near(((const double *)time->data)[s], seconds, 1e-12);
            check_near(((const double *)us->data)[s], solve_us, 0.001);
        }
        const float *z = (const float *)u->data + 6 * 3 * u->shape[1] + 2;
        for (uint64_t v = 0; v < u->shape[1]; v++, z += 3)
            if ((double)*z < deepest) deepest = (double)*z;
        check_at_most(deepest, -0.02 + 1e-8);
        pliant_reader_close(reader);
    }
    check_run(0, "command -v h5dump >/dev/null || { echo '( 7, 42, 3 )'; exit 0; }; "
                 "h5dump -H -d /displacement frames.h5");
    check_contains(out, "( 7, 42, 3 )");
    // Without a step: datasets of no elements.
    write_text("still.script", "pliant-script 1\n");
    check_run(0, "$P -q --frames frames.h5 model.h5 still.script");
    check_run(0, "ls -a; rm frames.h5 frames.csv");
    assert_null(strstr(out, "frames.h5."));
}
#endif

static void vtk_series_opens(void **state)
{
    (void)state;
    check_run(0, "$P -q --vtk series model.h5 poke.script && $P -q --vtk series --lod 1 model.h5 "
                 "poke.script");
    check_run(0, "cat series/pliant.pvd");
    int count = 0;
    for (const char *at = out; (at = strstr(at, "<DataSet ")); at++) count++;
    assert_int_equal(count, 7);
    check_contains(out, "<DataSet timestep=\"0.034\" part=\"0\" file=\"pliant_00000007.vtp\"/>");
    check_run(0, "cat series/pliant_00000007.vtp");
    check_contains(out, "NumberOfPoints=\"42\"");
    check_run(0,
              "command -v xmllint >/dev/null || exit 0; xmllint --noout series/*.vtp series/*.pvd");
    assert_string_equal(err, "");
    check_run(0, "touch series/theirs.vtu");
    check_run(1, "$P -q --vtk series model.h5 poke.script");
    check_contains(err, "pliant-play: series: holds another series (theirs.vtu)");
    check_run(0, "$P -q --force --vtk series free.h5 poke.script && ls series");
    check_contains(out, "theirs.vtu");
    check_run(0, "rm -r series");
}

// What a program that knows the library makes of the same surface.
static void detailed_surfaces_are_those_of_the_library(void **state)
{
    (void)state;
    for (int lod = 1; lod <= 2; lod++) {
        check_run(0,
                  "$P -q --lod %d --frames coarse.h5 detail.h5 poke.script && $P -q --lod %d "
                  "--detail --frames fine.h5 --vtk skin detail.h5 poke.script",
                  lod, lod);
        pliant_error reason;
        pliant_reader *coarse, *fine;
        pliant_model *model;
        pliant_detail *detail;
        check_ok(pliant_reader_open(in_folder("coarse.h5"), &coarse, &reason), &reason);
        check_ok(pliant_reader_open(in_folder("fine.h5"), &fine, &reason), &reason);
        check_ok(pliant_model_open(in_folder("detail.h5"), &model, &reason), &reason);
        check_ok(pliant_detail_create(model, lod, &detail, &reason), &reason);
        const size_t n = (size_t)pliant_detail_describe(detail).vertex_count;
        const size_t controls = (size_t)pliant_detail_describe(detail).control_count;
        const pliant_section *u = pliant_reader_find(coarse, "/displacement");
        const pliant_section *v = pliant_reader_find(fine, "/displacement");
        assert_true(u && v && u->shape[1] == controls && v->shape[1] == n && v->shape[0] == 7);
        pliant_vec3 *rest = malloc(n * sizeof *rest), *moved = malloc(n * sizeof *moved);
        assert_true(rest && moved);
        assert_int_equal(pliant_detail_evaluate(detail, NULL, rest, NULL), PLIANT_OK);
        for (size_t step = 0; step < 7; step++) {
            const pliant_vec3 *from = (const pliant_vec3 *)u->data + step * controls;
            const pliant_vec3 *found = (const pliant_vec3 *)v->data + step * n;
            assert_int_equal(pliant_detail_evaluate(detail, from, moved, NULL), PLIANT_OK);
            float most = 0;
            for (size_t i = 0; i < n; i++) {
                check_near((double)found[i].x, (double)(moved[i].x - rest[i].x), 0);
                check_near((double)found[i].y, (double)(moved[i].y - rest[i].y), 0);
                check_near((double)found[i].z, (double)(moved[i].z - rest[i].z), 0);
                if (found[i].z < most) most = found[i].z;
            }
            check_at_most((double)most, -0.005);
        }
        free(moved);
        free(rest);
        pliant_detail_destroy(detail);
        pliant_model_close(model);
        pliant_reader_close(fine);
        pliant_reader_close(coarse);
        check_run(0, "grep -o 'NumberOfPoints=.2562' skin/pliant_00000007.vtp");
        check_run(0, "grep -c 'Name=\"normal\"' skin/pliant_00000007.vtp");
    }
    check_run(0, "rm -r coarse.h5 fine.h5 skin");
    check_run(1, "$P -q --detail --vtk skin model.h5 poke.script");
    assert_string_equal(err, "pliant-play: model.h5: /detail: expected geometric detail "
                             "(pliant-precompute --detail), found none\n");
    assert_false(exists("skin"));
}

static void comparison_with_the_dense_file_is_float_accurate(void **state)
{
    (void)state;
    double rms, worst, max, force;
    int step;
    check_run(0, "$P --compare dense.h5 model.h5 poke.script");
    const char *text = strstr(out, "against the dense solution, 7 steps:\n");
    assert_non_null(text);
    assert_int_equal(sscanf(strstr(text, "RMS difference"),
                            "RMS difference %lf over all steps, worst %lf at step %d", &rms, &worst,
                            &step),
                     3);
    assert_int_equal(sscanf(strstr(text, "MAX difference"), "MAX difference worst %lf", &max), 1);
    assert_int_equal(sscanf(strstr(text, "force difference"), "force difference worst %lf", &force),
                     1);
    // Nothing is thresholded: float coefficients and sums, some ten roundings of 2^-24 = 6e-8.
    check_at_most(rms, 2e-6);
    check_at_most(worst, 5e-6);
    check_at_most(max, 5e-6);
    check_at_most(force, 5e-6);
    assert_true(step >= 1 && step <= 7);

    // Of a compressed model it says the compression's error, here from standard input.
    check_run(0, "$P -q --compare free-dense.h5 free.h5 <poke.script");
    assert_int_equal(sscanf(strstr(out, "RMS difference"), "RMS difference %lf", &rms), 1);
    check_at_least(rms, 1e-4);
    check_at_most(rms, 0.5);

    check_run(1, "$P --compare model.h5 model.h5 poke.script");
    check_contains(err, "pliant-play: model.h5: not a dense file");
    check_run(1, "$P --compare free-dense.h5 tiny.h5 poke.script");
    check_contains(err, "free-dense.h5:/dense/nodes: expected the model's");
}

// A script with one of each: the ball 0.05 deep in the top of the unit sphere.
static const char touch[] = "pliant-script 1\n"
                            "probe side near 1 0 0\n"
                            "patch thumb tolerance 1e-3\n"
                            "patch thumb near 1 0 0 -0.02 0 0\n"
                            "tool ball sphere 0 0 1.25 0.3\n"
                            "proxy pen 0 -0.9 0\n"
                            "step 3\n"
                            "expect side -0.02 0 0 1e-3\n";

static void patches_tools_and_proxies_are_reported(void **state)
{
    (void)state;
    double ball[3], thumb[3], pen[3], total[3], penetration, error, depth;
    int nodes, step, touching;
    write_text("touch.script", touch);
    check_run(0, "$P -o touch.csv model.h5 touch.script");
    const char *row = strstr(out, "\nball ");
    assert_non_null(row);
    assert_int_equal(sscanf(row, " ball tool %lf %lf %lf nodes %d penetration %lf", &ball[0],
                            &ball[1], &ball[2], &nodes, &penetration),
                     5);
    check_at_least(nodes, 1);
    check_at_most(ball[2], -1e-3);
    assert_int_equal(sscanf(strstr(out, "\nthumb "), " thumb patch %lf %lf %lf nodes %d error %lf",
                            &thumb[0], &thumb[1], &thumb[2], &nodes, &error),
                     5);
    assert_int_equal(nodes, 1);
    check_at_most(error, 1e-3);
    assert_int_equal(sscanf(strstr(out, "\npen "), " pen proxy %lf %lf %lf contact %d depth %lf",
                            &pen[0], &pen[1], &pen[2], &touching, &depth),
                     5);
    assert_int_equal(touching, 1);
    // The device is 0.1 under the surface at rest, which has given way.
    check_at_least(depth, 1e-3);
    check_at_most(depth, 0.1 + 1e-3);
    assert_int_equal(sscanf(strstr(out, "\ncontact force"), " contact force %lf %lf %lf", &total[0],
                            &total[1], &total[2]),
                     3);
    // Printed to six digits.
    for (int c = 0; c < 3; c++) check_near(total[c], ball[c] + thumb[c] + pen[c], 1e-4);
    // The file of rows has its promised columns, the last three of which are that sum.
    read_text("touch.csv", out);
    assert_int_equal(strncmp(out,
                             "step,time,solve_us,constraints,level,side.x,side.y,side.z,"
                             "force.x,force.y,force.z\n1,",
                             78),
                     0);
    double found[3];
    const char *last = strstr(out, "\n3,");
    assert_non_null(last);
    for (int c = 0; c < 8; c++) last = strchr(last + 1, ',');
    assert_int_equal(sscanf(last, ",%lf,%lf,%lf", &found[0], &found[1], &found[2]), 3);
    for (int c = 0; c < 3; c++) check_near(found[c], total[c], 1e-5);

    check_run(0, "$P model.h5 - <touch.script");
    row = strstr(out, "step 3 ");
    assert_non_null(row);
    assert_int_equal(sscanf(strstr(row, " patch thumb"),
                            " patch thumb %lf %lf %lf nodes 1 error %lf tool ball %lf %lf %lf nodes "
                            "%d penetration %lf proxy pen %lf %lf %lf contact %d",
                            &found[0], &found[0], &found[0], &error, &found[0], &found[1],
                            &found[2], &nodes, &penetration, &pen[0], &pen[1], &pen[2], &touching),
                     13);
    for (int c = 0; c < 3; c++) check_near(found[c], ball[c], 1e-5);

    for (int k = 0; k < 2; k++) {
        check_run(0, k ? "$P --json model.h5 - <touch.script" : "$P --json model.h5 touch.script");
        check_contains(out, "],\"patches\":{\"thumb\":{\"force\":[");
        check_contains(out, "],\"nodes\":1,\"error\":");
        row = strstr(out, "}},\"tools\":{\"ball\":{\"force\":[");
        assert_non_null(row);
        assert_int_equal(sscanf(strchr(row, '['), "[%lf,%lf,%lf],\"nodes\":%d,\"penetration\":%lf",
                                &found[0], &found[1], &found[2], &step, &penetration),
                         5);
        if (k == 0)
            for (int c = 0; c < 3; c++) check_near(found[c], ball[c], 1e-5);
        check_contains(out, "}},\"proxies\":{\"pen\":{\"force\":[");
        check_contains(out, "],\"contact\":true,\"depth\":");
    }
    // Without any, nothing is said of them.
    check_run(0, "$P --json model.h5 poke.script");
    assert_null(strstr(out, "\"tools\""));
}

static void contact_without_a_dense_solution_is_not_compared(void **state)
{
    (void)state;
    write_text("touch.script", touch);
    check_run(1, "$P --compare dense.h5 model.h5 touch.script");
    assert_string_equal(err, "pliant-play: touch.script:3:7: --compare knows conditions and gravity "
                             "only: expected no patches, tools or proxies\n");
    assert_string_equal(out, "");
}

static void repeats_and_threads_play_the_same_and_count_all(void **state)
{
    (void)state;
    check_run(0, "$P --repeat 5 --threads 3 -o many.csv model.h5 poke.script");
    check_contains(out, "poke.script on model.h5: 7 steps, ");
    check_contains(out, "3 solvers at once x 5 passes: 105 steps in ");
    check_contains(out, "\nfirst passes ");
    check_run(0, "cut -d, -f1,2,4- many.csv >many.txt; $P -q -o one.csv model.h5 poke.script; "
                 "cut -d, -f1,2,4- one.csv | cmp - many.txt");
    check_run(0, "$P --json --repeat 2 --threads 2 model.h5 poke.script");
    check_contains(out, "\"solvers\":2,\"passes\":2,\"steps_played\":28,");
    check_contains(out, "\"first_passes_us\":{");
    // A failure of any ends all, with one message.
    write_text("fail.script", "pliant-script 1\nprobe p vertex 1\nstep 100\nexpect p 1 1 1 0\n");
    check_run(1, "$P --repeat 1000 --threads 4 model.h5 fail.script");
    assert_int_equal(count_lines(err), 1);
    check_contains(err, "fail.script:4:8: expect p: ");
    check_run(0, "rm many.csv one.csv many.txt");
}

static void missed_deadlines_are_told_and_are_no_failure(void **state)
{
    (void)state;
    FILE *script = fopen(in_folder("many.script"), "w");
    assert_non_null(script);
    fputs("pliant-script 1\nprobe p near 0 0 1\nstep\n", script);
    // A patch on top of the body; an icosahedron's vertex is its middle, held on every level.
    for (int i = 0; i < 20; i++)
        fprintf(script, "displace near %g %g 1 0 0 -0.1\n", 0.2 * (i % 5 - 2), 0.2 * (i / 5 - 2));
    fputs("step 3\nrelease all\nstep 2\n", script);
    assert_int_equal(fclose(script), 0);
    // Zero microseconds: no step can be in time.
    check_run(0, "$P --deadline-us 0 -o late.csv model.h5 many.script");
    assert_string_equal(err, "");
    const char *line = strstr(out, "\ndeadline 0 us: ");
    assert_non_null(line);
    int missed, of, coarser, overrun, on[3];
    double worst;
    assert_int_equal(sscanf(line, " deadline 0 us: %d of %d steps missed it: %d solved on a coarser "
                                  "level, %d solved too late, worst lateness %lf us",
                            &missed, &of, &coarser, &overrun, &worst),
                     5);
    assert_int_equal(of, 6);
    assert_int_equal(missed, 6);
    assert_int_equal(coarser, 3);
    assert_int_equal(overrun, 6);
    check_at_least(worst, 0.01);
    assert_int_equal(sscanf(strstr(line, "\nsteps by"),
                            " steps by constraint level: %d on 0, %d on 1, %d on 2", &on[0], &on[1],
                            &on[2]),
                     3);
    assert_int_equal(on[0] + on[1] + on[2], 6);
    assert_int_equal(on[2], 3);  // without constraints: the finest level
    // The levels of the steps stand in the table.
    check_run(0, "cut -d, -f1,5 late.csv; rm late.csv");
    int levels[6];
    assert_int_equal(sscanf(out, "step,level 1,%d 2,%d 3,%d 4,%d 5,%d 6,%d", &levels[0], &levels[1],
                            &levels[2], &levels[3], &levels[4], &levels[5]),
                     6);
    for (int i = 0; i < 6; i++) assert_int_equal(levels[i] < 2, i >= 1 && i <= 3);

    check_run(0, "$P --json --deadline-us 0 model.h5 many.script");
    check_contains(out, "\"deadline\":{\"us\":0,\"us_least\":0,\"steps\":6,\"misses\":6,\"coarser\":3,\"overruns\":6,"
                        "\"worst_lateness_us\":");
    check_contains(out, ",\"level_steps\":[");
    check_run(0, "$P --json --deadline-us 0 model.h5 <many.script");
    check_contains(out, "\"late\":true,\"lateness_us\":");
    check_run(0, "$P --deadline-us 0 model.h5 <many.script");
    check_contains(out, " late ");
    // An hour is enough for anybody, and without a deadline none is missed.
    check_run(0, "$P --deadline-us 1000000000 model.h5 many.script");
    check_contains(out, "\ndeadline 1e+09 us: 0 of 6 steps missed it: 0 solved on a coarser level, 0 "
                        "solved too late, worst lateness 0.0 us\n"
                        "steps by constraint level: 0 on 0, 0 on 1, 6 on 2\n");
    check_run(0, "$P model.h5 many.script");
    assert_null(strstr(out, "deadline"));
    // The script's own word holds from where it stands.
    write_text("some.script", "pliant-script 1\nstep 2\ndeadline 900000000\nstep\ndeadline "
                              "1000000\nstep 2\ndeadline none\nstep 5\n");
    check_run(0, "$P --deadline-us 500000 model.h5 some.script");
    check_contains(out, "\ndeadline 500000 to 900000000 us: 0 of 5 steps missed it: ");
    check_run(0, "$P --json model.h5 some.script; rm some.script");
    check_contains(out, "\"deadline\":{\"us\":900000000,\"us_least\":1000000,\"steps\":3,\"misses\":0,");
    // Every pass counts, the first ones too.
    check_run(0, "$P --repeat 3 --threads 2 --deadline-us 0 model.h5 many.script");
    check_contains(out, "\ndeadline 0 us: 36 of 36 steps missed it: 18 solved on a coarser level, ");
    check_run(0, "rm many.script");
}

static void passive_contact_is_never_rough(void **state)
{
    (void)state;
    // Compressed until the stored compliance of a large patch is not definite any more.
    FILE *script = fopen(in_folder("dense.script"), "w");
    assert_non_null(script);
    fputs("pliant-script 1\n", script);
    for (int i = 0; i < 60; i++) fprintf(script, "displace near %g %g %g 0 0 -0.1\n",
                                         0.15 * (i % 8 - 4), 0.15 * (i / 8 - 4), 0.8);
    fputs("step\n", script);
    assert_int_equal(fclose(script), 0);
    check_run(0, "$P --json rough.h5 dense.script");
    check_contains(out, "\"rough_steps\":1,");
    check_run(0, "$P --passive --json rough.h5 dense.script");
    check_contains(out, "\"rough_steps\":0,");
    check_run(0, "rm dense.script");
}

static void outputs_that_cannot_be_written_are_told(void **state)
{
    (void)state;
    check_run(1, "$P -o no/where.csv model.h5 poke.script");
    assert_string_equal(err, "pliant-play: no/where.csv: No such file or directory\n");
    check_run(1, "$P -o . model.h5 poke.script");
    assert_string_equal(err, "pliant-play: .: Is a directory\n");
    check_run(1, "$P --vtk no/where model.h5 poke.script");
    assert_string_equal(err, "pliant-play: no/where: No such file or directory\n");
    check_run(1, "$P -o /dev/full model.h5 poke.script");
    assert_string_equal(err, "pliant-play: /dev/full: No space left on device\n");
    check_run(1, "$P model.h5 poke.script >/dev/full");
    assert_string_equal(err, "pliant-play: standard output: No space left on device\n");
    check_run(1, "$P model.h5 <poke.script >/dev/full");
    assert_string_equal(err, "pliant-play: standard output: No space left on device\n");
#ifndef PLIANT_WITHOUT_HDF5
    check_run(1, "$P --frames no/where.h5 model.h5 poke.script");
    assert_string_equal(err, "pliant-play: no/where.h5: No such file or directory\n");
    check_run(1, "$P --frames /dev/full model.h5 poke.script");
    assert_string_equal(err, "pliant-play: /dev/full: not a regular file\n");
#endif
}

// A limit on a file's size stands for a disk that fills up while playing.
static void a_full_disk_leaves_nothing_under_the_names(void **state)
{
    (void)state;
    write_text("long.script", "pliant-script 1\nprobe p near 0 0 1\nstep 2000\n");
    check_run(1, "ulimit -f 40; $P -o full.csv model.h5 long.script");
    assert_string_equal(err, "pliant-play: full.csv: File too large\n");
    check_run(1, "ulimit -f 1; $P --vtk full model.h5 long.script");
    check_contains(err, "pliant-play: full/pliant.tmp/pliant_00000001.vtp: File too large\n");
#ifndef PLIANT_WITHOUT_HDF5
    check_run(1, "ulimit -f 40; $P --frames full.h5 model.h5 long.script");
    check_contains(err, "pliant-play: full.h5: spooling step ");
    // The spool of one step fits, the file with its user block does not.
    write_text("short.script", "pliant-script 1\nstep\n");
    check_run(1, "ulimit -f 20; $P --frames full.h5 model.h5 short.script");
    check_contains(err, "pliant-play: full.h5");
    assert_int_equal(count_lines(err), 1);
#endif
    check_run(0, "ls -a");
    assert_null(strstr(out, "full"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(help_and_version_go_to_standard_output),
        cmocka_unit_test(misuse_is_told_and_ends_with_status_2),
        cmocka_unit_test(a_model_that_is_none_is_refused),
        cmocka_unit_test(checksums_are_verified_unless_told_not_to),
        cmocka_unit_test(a_script_ends_with_a_table),
        cmocka_unit_test(json_is_one_object_with_what_the_table_says),
        cmocka_unit_test(standard_input_is_answered_line_by_line),
        cmocka_unit_test(json_answers_are_lines_too),
        cmocka_unit_test(a_person_is_told_and_goes_on),
        cmocka_unit_test(a_closed_pipe_ends_it_quietly),
        cmocka_unit_test(mistakes_name_file_line_and_column),
        cmocka_unit_test(long_scripts_and_lines_play_in_the_memory_of_short_ones),
        cmocka_unit_test(a_failed_expectation_ends_the_play_with_status_1),
        cmocka_unit_test(csv_has_the_promised_columns),
#ifndef PLIANT_WITHOUT_HDF5
        cmocka_unit_test(frames_hold_every_surface),
#endif
        cmocka_unit_test(vtk_series_opens),
        cmocka_unit_test(detailed_surfaces_are_those_of_the_library),
        cmocka_unit_test(comparison_with_the_dense_file_is_float_accurate),
        cmocka_unit_test(patches_tools_and_proxies_are_reported),
        cmocka_unit_test(contact_without_a_dense_solution_is_not_compared),
        cmocka_unit_test(repeats_and_threads_play_the_same_and_count_all),
        cmocka_unit_test(missed_deadlines_are_told_and_are_no_failure),
        cmocka_unit_test(passive_contact_is_never_rough),
        cmocka_unit_test(outputs_that_cannot_be_written_are_told),
        cmocka_unit_test(a_full_disk_leaves_nothing_under_the_names),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
