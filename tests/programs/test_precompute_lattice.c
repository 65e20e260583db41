// test_precompute_lattice.c: pliant-precompute --lattice from the outside: files, refusals,
// summaries.
#include "check.h"
#include "command.h"
#include "surfaces.h"

#include "pliant/model_view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char sample[] = "scripts/sample/whale.obj";
static const char name[] = "pliant-precompute: ";

static const char *in_folder(const char *file)
{
    static char paths[4][512];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", check_folder(), file);
    return path;
}

typedef struct opened {
    pliant_reader *reader;
    pliant_model_view view;
} opened;

// Bind trusts nothing: cells, corners, regions, embedding and batches are looked at on the way.
static opened open_model(const char *path)
{
    opened o = {0};
    pliant_error err = {""};
    check_ok(pliant_reader_open(path, &o.reader, &err), &err);
    check_ok(pliant_reader_verify(o.reader, &err), &err);
    check_ok(pliant_model_view_bind(o.reader, &o.view, &err), &err);
    return o;
}

static opened make(const char *arguments, const char *path)
{
    check_command c;
    check_run(&c, "%s/pliant-precompute -q --force %s -o %s", check_build(), arguments, path);
    if (c.status != 0) fail_msg("%s\n%s", arguments, c.errors);
    assert_string_equal(c.output, "");
    assert_string_equal(c.errors, "");
    return open_model(path);
}

static double mass_of(const opened *o)
{
    double mass = 0;
    for (int32_t i = 0; i < o->view.lattice_particle_count; i++)
        mass += (double)o->view.lattice_mass[i];
    return mass;
}

// The sections of two files that begin with `prefix` are the same, to the last byte.
static int count_equal_sections(const opened *a, const opened *b, const char *prefix)
{
    int count = 0;
    for (int32_t i = 0; i < pliant_reader_section_count(a->reader); i++) {
        const pliant_section *x = pliant_reader_section(a->reader, i);
        if (strncmp(x->path, prefix, strlen(prefix)) != 0) continue;
        const pliant_section *y = pliant_reader_find(b->reader, x->path);
        assert_non_null(y);
        assert_int_equal(x->bytes, y->bytes);
        assert_memory_equal(x->data, y->data, x->bytes);
        count++;
    }
    return count;
}

static void a_lattice_alone_needs_neither_support_nor_levels(void **state)
{
    (void)state;
    opened o =
        make("--lattice 12 --half-width 3 --no-greens --density 900 scripts/sample/whale.obj",
             in_folder("alone.h5"));
    const pliant_model_view *v = &o.view;
    pliant_mesh *mesh = check_load_obj(sample);
    assert_non_null(mesh);
    assert_int_equal(v->has_greens, 0);
    assert_int_equal(v->level_count, 1);
    assert_int_equal(v->vertex_count, mesh->vertex_count);
    assert_memory_equal(v->vertices, mesh->vertices,
                        3 * (size_t)mesh->vertex_count * sizeof(double));
    assert_memory_equal(v->faces, mesh->faces, 3 * (size_t)mesh->face_count * sizeof(int32_t));
    for (int32_t i = 0; i < v->vertex_count; i++) assert_int_equal(v->source_index[i], i);
    assert_int_equal(v->lattice_half_width, 3);
    assert_int_equal(v->lattice_summary[PLIANT_LATTICE_IS_SHELL], 0);
    assert_int_equal(v->lattice_summary[PLIANT_LATTICE_COMPONENT_COUNT], 1);
    int32_t longest = 0;
    for (int d = 0; d < 3; d++)
        if (v->lattice_dims[d] > longest) longest = v->lattice_dims[d];
    assert_int_equal(longest, 13);
    check_near(v->lattice_frame[PLIANT_LATTICE_MASS] / (900 * pliant_mesh_volume(mesh)), 1, 1e-6);
    check_near(mass_of(&o), v->lattice_frame[PLIANT_LATTICE_MASS], 0);
    // Vertices lie where their cells say.
    const double a = v->lattice_frame[PLIANT_LATTICE_CELL_SIZE];
    for (int32_t i = 0; i < v->vertex_count; i++)
        for (int d = 0; d < 3; d++) {
            const int32_t cell = v->lattice_cells[3 * v->lattice_vertex_cell[i] + d];
            const double x = v->lattice_frame[PLIANT_LATTICE_ORIGIN + d] +
                             a * (cell + (double)v->lattice_vertex_offset[3 * i + d]);
            check_near(x, mesh->vertices[3 * i + d], 1e-7 * a);
        }
    const pliant_section *text = pliant_reader_find(o.reader, "/provenance/text");
    assert_non_null(text);
    const char *lines[] = {"lattice_cells_along = 12\n", "lattice_half_width = 3\n",
                           "lattice_filling = solid\n",  "lattice_densities = uniform\n",
                           "seconds_lattice = ",         "mesh_hash = fnv1a64:"};
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++)
        assert_non_null(memmem(text->data, text->bytes, lines[i], strlen(lines[i])));
    assert_null(memmem(text->data, text->bytes, "solver", 6));
    pliant_mesh_destroy(mesh);
    pliant_reader_close(o.reader);
    check_command c;
    check_run(&c, "%s/pliant-info --verify %s", check_build(), in_folder("alone.h5"));
    assert_int_equal(c.status, 0);
    assert_non_null(strstr(c.output, "verified"));
}

// Beside Green's functions the lattice is the one that the same levels get alone, and they are what
// they are without it, on any number of ranks.
static void lattice_and_greens_functions_share_a_file_and_leave_each_other_alone(void **state)
{
    (void)state;
    static const char greens[] =
        "--subdivide 2 --fixed 'z<0.03' --density 1000 scripts/sample/whale.obj";
    static const char lattice[] = "--lattice 9 --half-width 1 --shell";
    char arguments[512];
    opened without = make(greens, in_folder("greens.h5"));
    snprintf(arguments, sizeof arguments, "%s %s", lattice, greens);
    opened both = make(arguments, in_folder("both.h5"));
    snprintf(arguments, sizeof arguments, "%s --no-greens --subdivide 2 --density 1000 %s", lattice,
             sample);
    opened alone = make(arguments, in_folder("lattice.h5"));
    assert_int_equal(both.view.has_greens, 1);
    assert_int_equal(without.view.lattice_cell_count, 0);
    assert_int_equal(both.view.lattice_summary[PLIANT_LATTICE_IS_SHELL], 1);
    assert_true(count_equal_sections(&without, &both, "/greens/") >= 12);
    assert_true(count_equal_sections(&without, &both, "/body/") >= 1);
    assert_int_equal(count_equal_sections(&both, &alone, "/lattice/"), 16);
    assert_int_equal(count_equal_sections(&both, &alone, "/mesh/"), 5);

    check_command c;
    for (int ranks = 2; ranks <= 3; ranks++) {
        check_run(&c,
                  "mpirun --quiet -n %d %s/pliant-precompute -q --force %s --no-greens --subdivide "
                  "2 --density 1000 %s -o %s",
                  ranks, check_build(), lattice, sample, in_folder("ranks.h5"));
        assert_int_equal(c.status, 0);
        assert_string_equal(c.errors, "");
        opened o = open_model(in_folder("ranks.h5"));
        assert_int_equal(count_equal_sections(&alone, &o, "/lattice/"), 16);
        pliant_reader_close(o.reader);
    }
    check_run(&c, "mpirun --quiet -n 3 %s/pliant-precompute -q --force %s %s -o %s", check_build(),
              lattice, greens, in_folder("ranks.h5"));
    assert_int_equal(c.status, 0);
    opened o = open_model(in_folder("ranks.h5"));
    assert_int_equal(count_equal_sections(&both, &o, "/lattice/"), 16);
    pliant_reader_close(o.reader);
    pliant_reader_close(alone.reader);
    pliant_reader_close(both.reader);
    pliant_reader_close(without.reader);
}

// With detail, the lattice is that of the mesh whose elasticity is solved.
static void a_lattice_beside_detail_carries_the_control_mesh(void **state)
{
    (void)state;
    opened o =
        make("--lattice 8 --subdivide 3 --detail 2 --fixed 'z<0.03' scripts/sample/whale.obj",
             in_folder("detail.h5"));
    assert_int_equal(o.view.detail_steps, 2);
    assert_true(o.view.lattice_particle_count > 8);
    assert_int_equal(o.view.lattice_half_width, 2);
    pliant_reader_close(o.reader);
}

static void densities_come_from_the_vertices_of_the_input(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_load_obj(sample);
    assert_non_null(mesh);
    const char *path = in_folder("densities.txt");
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        fprintf(file, "%d\n", mesh->vertices[3 * v] > 0 ? 3000 : 1000);
    fclose(file);
    for (int subdivided = 0; subdivided < 2; subdivided++) {
        char arguments[1024];
        const char *levels = subdivided ? "--subdivide 2 --scheme midpoint" : "";
        snprintf(arguments, sizeof arguments, "--lattice 20 --no-greens %s %s", levels, sample);
        opened one = make(arguments, in_folder("one.h5"));
        snprintf(arguments, sizeof arguments, "--lattice 20 --no-greens --lattice-mass %s %s %s",
                 path, levels, sample);
        opened two = make(arguments, in_folder("two.h5"));
        for (int32_t i = 0; i < one.view.lattice_particle_count; i++) {
            double x[3], best = INFINITY, expected = 0;
            for (int d = 0; d < 3; d++)
                x[d] =
                    one.view.lattice_frame[d] + one.view.lattice_frame[PLIANT_LATTICE_CELL_SIZE] *
                                                    one.view.lattice_particles[3 * i + d];
            for (int32_t v = 0; v < mesh->vertex_count; v++) {
                const double *y = mesh->vertices + 3 * v;
                const double square =
                    pow(x[0] - y[0], 2) + pow(x[1] - y[1], 2) + pow(x[2] - y[2], 2);
                if (square >= best) continue;
                best = square;
                expected = y[0] > 0 ? 3000 : 1000;
            }
            check_near((double)two.view.lattice_mass[i] / (double)one.view.lattice_mass[i],
                       expected, 1e-3);
        }
        pliant_reader_close(two.reader);
        pliant_reader_close(one.reader);
    }
    pliant_mesh_destroy(mesh);
}

static void misuse_is_told_in_one_line(void **state)
{
    (void)state;
    const struct {
        const char *arguments, *part;
        int status;
    } cases[] = {
        {"--lattice 0", "--lattice: expected a whole number from 1 to 1023, found '0'", 2},
        {"--lattice 1024", "--lattice: expected a whole number from 1 to 1023, found '1024'", 2},
        {"--lattice 4.5", "found '4.5'", 2},
        {"--lattice", "--lattice: expected", 2},
        {"--lattice 5 --half-width 0",
         "--half-width: expected a whole number from 1 to 15, found '0'", 2},
        {"--lattice 5 --half-width 16", "found '16'", 2},
        {"--half-width 2", "--half-width goes with --lattice CELLS", 2},
        {"--solid", "--solid goes with --lattice CELLS", 2},
        {"--shell", "--shell goes with --lattice CELLS", 2},
        {"--lattice-mass f", "--lattice-mass goes with --lattice CELLS", 2},
        {"--no-greens", "--no-greens goes with --lattice CELLS", 2},
        {"--lattice 5 --no-greens --solid --shell", "--solid and --shell: give one of them", 2},
        {"--lattice 5 --no-greens --dense d.h5",
         "--dense is for Green's functions, --no-greens makes none", 2},
        {"--lattice 5 --no-greens --eps 0.1", "--eps is for Green's functions", 2},
        {"--lattice 5 --no-greens --subdivide 3 --detail 1", "--detail is for Green's functions",
         2},
        {"--lattice 5", "or --no-greens for a lattice only", 2},
        {"--lattice 5 --no-greens --lattice-mass nowhere.txt", "nowhere.txt: cannot open", 1},
        {"--lattice 5 --no-greens --lattice-mass scripts/sample/whale.obj",
         "whale.obj:5: expected a density over 0 in column 1, found 'v'", 1},
        {"--lattice 5 --no-greens --subdivide 14", "--subdivide 14: makes", 1},
        {"--lattice 5 --no-greens --density 1e-300", "weighs", 1},
    };
    const char *output = in_folder("refused.h5");
    check_command c;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        check_run(&c, "%s/pliant-precompute -q %s -o %s %s", check_build(),
                  strcmp(cases[i].arguments, "--lattice") ? sample : "", output,
                  cases[i].arguments);
        if (c.status != cases[i].status) print_error("%s\n", cases[i].arguments);
        assert_int_equal(c.status, cases[i].status);
        check_one_line(&c, name, cases[i].part);
        assert_int_not_equal(access(output, F_OK), 0);
    }
    // On one rank or three, the file that is there stays unless forced.
    check_run(&c,
              "echo precious > %s; mpirun --quiet -n 3 %s/pliant-precompute -q --lattice 5 "
              "--no-greens %s -o %s",
              output, check_build(), sample, output);
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "--force");
    check_run(&c, "cat %s", output);
    assert_string_equal(c.output, "precious\n");
}

static void summaries_tell_of_the_lattice(void **state)
{
    (void)state;
    check_command c;
    check_run(&c, "%s/pliant-precompute --lattice 10 --no-greens --force %s -o %s", check_build(),
              sample, in_folder("text.h5"));
    assert_int_equal(c.status, 0);
    opened o = open_model(in_folder("text.h5"));
    char expected[128];
    snprintf(expected, sizeof expected, "%d particles, %d cells of ", o.view.lattice_particle_count,
             o.view.lattice_cell_count);
    assert_non_null(strstr(c.output, expected));
    snprintf(expected, sizeof expected,
             "%d regions of half-width 2, %d of them irregular; %d triangle batch",
             o.view.lattice_summary[PLIANT_LATTICE_REGION_COUNT], o.view.lattice_region_node_count,
             o.view.lattice_batch_count);
    assert_non_null(strstr(c.output, expected));
    assert_non_null(strstr(c.errors, "pliant-precompute: lattice of 10 x "));
    check_run(&c, "%s/pliant-precompute --json --lattice 10 --no-greens --force %s -o %s",
              check_build(), sample, in_folder("text.h5"));
    assert_int_equal(c.status, 0);
    assert_int_equal(c.output[0], '{');
    snprintf(expected, sizeof expected, "\"lattice\": {\"particles\": %d, \"cells\": %d, ",
             o.view.lattice_particle_count, o.view.lattice_cell_count);
    assert_non_null(strstr(c.output, expected));
    assert_null(strstr(c.output, "\"free\""));
    pliant_reader_close(o.reader);
    // What is of no use is said, not passed over.
    check_run(&c, "%s/pliant-precompute --fixed 'z<0' --lattice 10 --no-greens --force %s -o %s",
              check_build(), sample, in_folder("text.h5"));
    assert_int_equal(c.status, 0);
    assert_non_null(strstr(c.errors, "--no-greens: the held vertices are not used"));
}

// A solver has nothing to solve with: pliant-play says so instead of playing rest.
static void a_contact_script_on_a_lattice_alone_is_refused(void **state)
{
    (void)state;
    opened o = make("--lattice 6 --no-greens scripts/sample/whale.obj", in_folder("still.h5"));
    pliant_reader_close(o.reader);
    check_command c;
    check_run(
        &c, "printf 'pliant-script 1\\ndisplace 3 0 0 0.01\\nstep\\n' > %s; %s/pliant-play %s %s",
        in_folder("poke.script"), check_build(), in_folder("still.h5"), in_folder("poke.script"));
    assert_int_equal(c.status, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lattice_alone_needs_neither_support_nor_levels),
        cmocka_unit_test(lattice_and_greens_functions_share_a_file_and_leave_each_other_alone),
        cmocka_unit_test(a_lattice_beside_detail_carries_the_control_mesh),
        cmocka_unit_test(densities_come_from_the_vertices_of_the_input),
        cmocka_unit_test(misuse_is_told_in_one_line),
        cmocka_unit_test(summaries_tell_of_the_lattice),
        cmocka_unit_test(a_contact_script_on_a_lattice_alone_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
