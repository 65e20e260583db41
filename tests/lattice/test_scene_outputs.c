// test_scene_outputs.c: what pliant-play writes of a lattice, from outside, read by other readers.
//
// PLIANT_BUILD names the folder of the program; default build.
#include "check.h"

#include "command.h"
#include "pliant/model_view.h"
#include "pliant/reader.h"
#include "synthetic_lattice.h"
#include "synthetic_model.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { STEPS = 20, INSTANCES = 3 };

static check_command c;
static int32_t vertex_count, particle_count;

static char *in_folder(const char *name)
{
    static char paths[4][256];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", check_folder(), name);
    return path;
}

static void write_text(const char *name, const char *text)
{
    FILE *file = fopen(in_folder(name), "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static char *read_text(const char *name)
{
    FILE *file = fopen(in_folder(name), "rb");
    if (!file) fail_msg("%s is not there", name);
    char *text = calloc(1, 1 << 22);
    assert_non_null(text);
    assert_true(fread(text, 1, (1 << 22) - 1, file) > 0);
    fclose(file);
    return text;
}

static int exists(const char *name)
{
    return access(in_folder(name), F_OK) == 0;
}

// Run pliant-play in the folder; the exit status must be `status`.
__attribute__((format(printf, 2, 3))) static void play(int status, const char *format, ...)
{
    char arguments[1024], program[1024];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    snprintf(program, sizeof program, "%s/pliant-play", check_build());
    char *path = realpath(program, NULL);
    if (!path) fail_msg("%s: build it first, or set PLIANT_BUILD", program);
    check_run(&c, "cd '%s' && P='%s'; $P %s", check_folder(), path, arguments);
    free(path);
    if (c.status != status)
        fail_msg("%s: exit status %d\n%s%s", arguments, c.status, c.output, c.errors);
}

static void check_contains(const char *text, const char *part)
{
    if (!strstr(text, part)) fail_msg("expected \"%s\" in:\n%.2000s", part, text);
}

static int count_parts(const char *text, const char *part)
{
    int count = 0;
    for (const char *at = strstr(text, part); at; at = strstr(at + 1, part)) count++;
    return count;
}

// Three boxes fall beside each other; the last is held by a corner; there is a plane far below.
static const char fall[] = "pliant-script 1\n"
                           "dt 0.01\n"
                           "gravity 0 0 -10\n"
                           "instances 3 at 0 0 1 step 9 0 0\n"
                           "plane 0 0 1 -50 as floor\n"
                           "probe first near 0 0 0\n"
                           "probe last instance 2 near 0 0 0\n"
                           "grab instance 2 0 hand\n"
                           "step 20\n";

static int set_up(void **state)
{
    (void)state;
    check_lattice *lattice = check_lattice_create(&(check_lattice_def){
        .shape = CHECK_CELLS_CUBE, .size = 3, .half_width = 1, .cell_size = 0.5, .mass = 2});
    vertex_count = lattice->mesh->vertex_count;
    particle_count = lattice->shape.particle_count;
    check_lattice_write(lattice, in_folder("cube.h5"));
    check_lattice_destroy(lattice);
    check_write_synthetic_model(in_folder("greens.h5"), NULL, 1, 0, pliant_wavelet_default(),
                                CHECK_FREE_BLOCK);
    write_text("fall.script", fall);
    return 0;
}

// ---- Tables ----

// Column `name` of row `row` (1 is the first step) of a CSV text.
static double cell(const char *csv, const char *name, int row)
{
    int column = 0;
    const char *at = csv;
    while (strncmp(at, name, strlen(name)) != 0 || !strchr(",\n", at[strlen(name)])) {
        at += strcspn(at, ",\n");
        if (*at != ',') fail_msg("no column %s in %.200s", name, csv);
        at++;
        column++;
    }
    at = csv;
    for (int i = 0; i < row; i++) at = strchr(at, '\n') + 1;
    for (int i = 0; i < column; i++) at = strchr(at, ',') + 1;
    return atof(at);
}

static void rows_hold_probes_held_particles_and_force(void **state)
{
    (void)state;
    play(0, "-o fall.csv cube.h5 fall.script");
    check_contains(c.output, "20 steps, 3 instances of 64 particles");
    check_contains(c.output, "match");
    check_contains(c.output, "2/");  // the probe's instance and vertex
    char *csv = read_text("fall.csv");
    assert_int_equal(count_parts(csv, "\n"), 1 + STEPS);
    check_contains(csv, "step,time,solve_us,constraints,level,first.x,first.y,first.z,last.x,");
    for (int row = 1; row <= STEPS; row++) {
        check_near(cell(csv, "step", row), row, 0);
        check_near(cell(csv, "time", row), 0.01 * row, 1e-9);
        assert_true(cell(csv, "solve_us", row) > 0);
        check_near(cell(csv, "constraints", row), 1, 0);
        // x_n = g h^2 n (n + 1) / 2 from where the instance was placed.
        check_near(cell(csv, "first.x", row), 0, 1e-5);
        check_near(cell(csv, "first.z", row), 1 - 10 * 1e-4 * row * (row + 1) / 2, 1e-4);
        check_near(cell(csv, "last.x", row), 18, 0.5);
        // What holds the third exerts, nobody else does: at the first step its particle's weight.
        if (row == 1) check_near(cell(csv, "force.z", row), 10 * 2.0 / 27 / 8, 1e-3);
    }
    free(csv);
}

static void fewer_rows_are_written_on_request(void **state)
{
    (void)state;
    play(0, "-q --every 6 -o some.csv --frames some.h5 --vtk some cube.h5 fall.script");
    char *csv = read_text("some.csv"), *index = read_text("some/pliant.pvd");
    assert_int_equal(count_parts(csv, "\n"), 1 + 3);
    check_near(cell(csv, "step", 3), 18, 0);
    assert_int_equal(count_parts(index, "<DataSet"), 3);
    free(csv);
    free(index);
}

// Everything but the times must be the same.
static void threads_write_the_same_rows(void **state)
{
    (void)state;
    write_text("heap.script",
               "pliant-script 1\ndt 0.01\ngravity 0 0 -10\ndamping 0.2\ncollide all\n"
               "instances 4 at 0 0 0.2 step 1.8 1.8 1.8 columns 2 rows 1 random 5\n"
               "plane 0 0 1 0 friction 0.5\nprobe p instance 3 vertex 0\nstep 80\n");
    play(0, "-q -o one.csv cube.h5 heap.script");
    play(0, "-q -o two.csv --threads 2 cube.h5 heap.script");
    char *one = read_text("one.csv"), *two = read_text("two.csv");
    static const char *const columns[] = {"p.x", "p.y", "p.z", "force.x", "force.y", "force.z"};
    for (int row = 1; row <= 80; row++)
        for (size_t k = 0; k < sizeof columns / sizeof *columns; k++)
            check_near(cell(two, columns[k], row), cell(one, columns[k], row), 0);
    assert_true(fabs(cell(one, "force.z", 80)) > 1);  // they did meet the floor
    free(one);
    free(two);
}

// ---- Recordings ----

static void frames_hold_displacements_and_normals_of_all_instances(void **state)
{
    (void)state;
    pliant_error err;
    pliant_reader *model, *frames;
    play(0, "-q -o fall.csv --frames fall.h5 cube.h5 fall.script");
    check_ok(pliant_reader_open(in_folder("fall.h5"), &frames, &err), &err);
    check_ok(pliant_reader_verify(frames, &err), &err);
    check_ok(pliant_reader_open(in_folder("cube.h5"), &model, &err), &err);
    const pliant_section *u = pliant_reader_find(frames, "/displacement");
    const pliant_section *n = pliant_reader_find(frames, "/normal");
    assert_non_null(u);
    assert_non_null(n);
    const uint64_t points = (uint64_t)INSTANCES * (uint64_t)vertex_count;
    assert_int_equal(u->shape[0], STEPS);
    assert_int_equal(u->shape[1], points);
    assert_int_equal(n->shape[1], points);
    const float *first = u->data, *normals = n->data;
    for (uint64_t i = 0; i < STEPS * points; i++) {
        const float *x = normals + 3 * i;
        check_near((double)(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), 1, 1e-5);
    }
    // A falling body falls as one; the second is nine to the right of the first.
    char *csv = read_text("fall.csv");
    for (uint64_t v = 0; v < (uint64_t)vertex_count; v++)
        for (int row = 1; row <= STEPS; row++) {
            const float *a = first + 3 * ((uint64_t)(row - 1) * points + v);
            const float *b = a + 3 * vertex_count;
            check_near((double)a[2], cell(csv, "first.z", row), 1e-4);
            check_near((double)(b[0] - a[0]), 9, 1e-4);
        }
    free(csv);
    pliant_reader_close(frames);
    pliant_reader_close(model);
}

// Every tag is closed by its like.
static void check_xml(const char *text)
{
    char open[16][32];
    int depth = 0;
    assert_memory_equal(text, "<?xml", 5);
    for (const char *at = strchr(text + 1, '<'); at; at = strchr(at + 1, '<')) {
        const char *end = strchr(at, '>');
        assert_non_null(end);
        char name[32];
        if (at[1] == '/') {
            assert_true(depth > 0 && sscanf(at + 2, "%31[^>]", name) == 1);
            assert_string_equal(name, open[--depth]);
        } else if (end[-1] != '/') {
            assert_true(depth < 16 && sscanf(at + 1, "%31[A-Za-z]", open[depth++]) == 1);
        }
    }
    assert_int_equal(depth, 0);
}

// Entry `i` of the 32-bit integers of an inline DataArray: base64 of a 64-bit size and the numbers.
static int32_t integer_of(const char *step, const char *name, size_t i)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char opening[64];
    snprintf(opening, sizeof opening, "Name=\"%s\" format=\"binary\">", name);
    const char *text = strstr(step, opening);
    if (!text) fail_msg("no %s", name);
    text += strlen(opening);
    uint32_t value = 0;
    for (size_t byte = 0; byte < 4; byte++) {
        const size_t bit = 8 * (8 + 4 * i + byte);
        unsigned found = 0;
        for (size_t k = 0; k < 8; k++) {
            const char *digit = strchr(digits, text[(bit + k) / 6]);
            assert_non_null(digit);
            found = 2 * found + ((unsigned)(digit - digits) >> (5 - (bit + k) % 6) & 1);
        }
        value |= (uint32_t)found << 8 * byte;
    }
    return (int32_t)value;
}

static void a_series_shows_surfaces_particles_and_obstacles(void **state)
{
    (void)state;
    char part[64];
    play(0, "-q --vtk show --particles cube.h5 fall.script");
    static const char *const names[] = {"show/pliant", "show/pliant_particles",
                                        "show/pliant_obstacles"};
    for (int k = 0; k < 3; k++) {
        char name[64];
        snprintf(name, sizeof name, "%s.pvd", names[k]);
        char *index = read_text(name);
        check_xml(index);
        assert_int_equal(count_parts(index, "<DataSet"), STEPS);
        check_contains(index, "timestep=\"0.2\"");
        free(index);
        snprintf(name, sizeof name, "%s_00000020.vtp", names[k]);
        char *step = read_text(name);
        check_xml(step);
        if (k == 0) {
            snprintf(part, sizeof part, "NumberOfPoints=\"%d\"", INSTANCES * vertex_count);
            check_contains(step, part);
            check_contains(step, "Normals=\"normal\"");
            for (int32_t i = 0; i < INSTANCES; i++) {
                const size_t first = (size_t)i * (size_t)vertex_count;
                assert_int_equal(integer_of(step, "instance", first), i);
                assert_int_equal(integer_of(step, "instance", first + (size_t)vertex_count - 1), i);
            }
            assert_null(strstr(step, "traction"));
        } else if (k == 1) {
            snprintf(part, sizeof part, "NumberOfVerts=\"%d\"", INSTANCES * particle_count);
            check_contains(step, part);
        }
        free(step);
    }
    // Without obstacles and particles there is neither series, and nothing left of these.
    play(0, "-q --vtk show cube.h5 - <<'EOF'\npliant-script 1\nstep 2\nEOF");
    assert_true(exists("show/pliant_00000002.vtp"));
    assert_false(exists("show/pliant_particles.pvd"));
    assert_false(exists("show/pliant_obstacles_00000001.vtp"));
    assert_false(exists("show/pliant_00000003.vtp"));
}

// ---- Lines and objects ----

static void standard_input_is_answered_line_by_line(void **state)
{
    (void)state;
    play(0, "cube.h5 <<'EOF'\npliant-script 1\nprobe p near 0 0 0\ngrab 0 hand\n"
            "move hand 0 0 0.5\nstep\nexpect p 0 0 0.5 0.2\nEOF");
    check_contains(c.output, "step 1 time 0.001 us ");
    check_contains(c.output, "constraints 1 level 0 p ");
    check_contains(c.output, "\nok\n");
    play(1, "cube.h5 <<'EOF'\npliant-script 1\nprobe p near 0 0 0\nstep\nexpect p 1 0 0 0.1\nEOF");
    check_contains(c.output, "failed: p: found ");
    play(0, "--json --threads 2 cube.h5 <<'EOF'\npliant-script 1\nprobe p near 0 0 0\nstep\nEOF");
    check_contains(c.output, "{\"step\":1,");
    check_contains(c.output, "\"us\":{\"match\":");
    check_contains(c.output,
                   "\"kind\":\"lattice\",\"instances\":1,\"particles\":64,\"half_width\":1");
    check_contains(c.output, "\"threads\":2");
    check_contains(c.output, "\"p\":{\"vertex\":");
    assert_int_equal(count_parts(c.output, "\n"), 2);
}

static void passes_are_repeated(void **state)
{
    (void)state;
    play(0, "--repeat 3 -o again.csv cube.h5 fall.script");
    check_contains(c.output, "3 passes: 60 steps in");
    check_contains(c.output, "first passes");
    char *csv = read_text("again.csv");
    assert_int_equal(count_parts(csv, "\n"), 1 + STEPS);
    free(csv);
}

// ---- Refusals ----

static void what_cannot_be_played_is_told_in_a_line(void **state)
{
    (void)state;
    static const struct {
        int status;
        const char *arguments, *part;
    } cases[] = {
        {1, "--lod 0 cube.h5 fall.script", "--lod is about Green's functions"},
        {1, "--passive cube.h5 fall.script", "--passive is about Green's functions"},
        {1, "--deadline-us 9 cube.h5 fall.script", "--deadline-us is about Green's functions"},
        {2, "--lattice --passive cube.h5 fall.script", "--lattice: expected no --passive with it"},
        {2, "--particles cube.h5 fall.script", "--particles: expected --vtk with it, found none"},
        {2, "--every 0 cube.h5 fall.script", "--every: expected a whole number from 1"},
        {2, "--threads 65 cube.h5 fall.script", "--threads: expected at most 64 for a lattice"},
        {1, "--lattice greens.h5 fall.script", "expected a lattice, found Green's functions alone"},
        {1, "greens.h5 fall.script", "fall.script:4:11: instances is about a lattice"},
        {1, "-o no.csv --frames no.h5 --vtk no cube.h5 wrong.script",
         "wrong.script:3:10: displace is about Green's functions"},
    };
    write_text("wrong.script", "pliant-script 1\nstep 2\ndisplace 3 0 0 1\n");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        play(cases[i].status, "%s", cases[i].arguments);
        check_one_line(&c, "pliant-play: ", cases[i].part);
        assert_string_equal(c.output, "");
    }
    assert_false(exists("no.csv"));
    assert_false(exists("no.h5"));
    assert_false(exists("no"));
}

static void help_tells_of_lattices(void **state)
{
    (void)state;
    play(0, "--help");
    static const char *const words[] = {"--lattice",       "--particles",    "--every N",
                                        "instances N",     "damping K",      "rigid-damping K",
                                        "strain-limit S",  "grab PARTICLES", "let NAME",
                                        "move NAME X Y Z", "turn NAME",      "impulse PARTICLES",
                                        "collide none",    "bone NAME",      "bind NAME",
                                        "box X Y Z",       "taper R",        "SHAPE [friction MU]"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) check_contains(c.output, words[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_hold_probes_held_particles_and_force),
        cmocka_unit_test(fewer_rows_are_written_on_request),
        cmocka_unit_test(threads_write_the_same_rows),
        cmocka_unit_test(frames_hold_displacements_and_normals_of_all_instances),
        cmocka_unit_test(a_series_shows_surfaces_particles_and_obstacles),
        cmocka_unit_test(standard_input_is_answered_line_by_line),
        cmocka_unit_test(passes_are_repeated),
        cmocka_unit_test(what_cannot_be_played_is_told_in_a_line),
        cmocka_unit_test(help_tells_of_lattices),
    };
    return cmocka_run_group_tests(tests, set_up, NULL);
}
