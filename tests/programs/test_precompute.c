// test_precompute.c: pliant-precompute from the outside: files, ranks, refusals, interruptions.
#include "check.h"
#include "command.h"

#include "pliant/dense_view.h"
#include "pliant/hats.h"
#include "pliant/mesh.h"
#include "pliant/model_view.h"
#include "pliant/wavelet.h"

#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static const char sample[] = "scripts/sample/whale.obj";
static const char name[] = "pliant-precompute: ";

// 162 vertices: a run takes a second.
static const char small_run[] = "--subdivide 2 --fixed 'z<0.03' --young 50000 --poisson 0.4 --density 1000";

static const char *in_folder(const char *file)
{
    static char paths[4][512];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", check_folder(), file);
    return path;
}

// ---- A model file as nodal columns ----

typedef struct opened {
    pliant_reader *reader;
    pliant_model_view view;
    pliant_hierarchy *hierarchy;
    pliant_wavelet *wavelets[2];  // rows of the free, of the fixed domain
    double *areas;
} opened;

static opened open_model(const char *path)
{
    opened o = {0};
    pliant_error err;
    check_ok(pliant_reader_open(path, &o.reader, &err), &err);
    check_ok(pliant_reader_verify(o.reader, &err), &err);
    check_ok(pliant_model_view_bind(o.reader, &o.view, &err), &err);
    const pliant_model_view *v = &o.view;
    check_ok(pliant_hierarchy_create(v->level_count, v->level_vertex_count, v->face_count, v->faces,
                                     v->parents, &o.hierarchy, &err), &err);
    o.areas = malloc((size_t)v->vertex_count * sizeof *o.areas);
    pliant_mesh_vertex_areas(v->vertex_count, v->vertices, v->face_count, v->faces, o.areas);
    for (int d = 0; d < 2; d++) {
        const double *s = NULL;
        for (int32_t l = 0; l < v->level_count && !s; l++)
            s = v->greens[d ? PLIANT_FIXED_FREE : PLIANT_FREE_FREE][l].summary;
        if (!s) continue;
        const pliant_wavelet_def def = {(pliant_wavelet_scheme)s[PLIANT_SUMMARY_WAVELET],
                                        (pliant_wavelet_lifting)s[PLIANT_SUMMARY_LIFTED],
                                        (pliant_wavelet_boundary)s[PLIANT_SUMMARY_BOUNDARY]};
        check_ok(pliant_wavelet_create(o.hierarchy, o.areas, d ? v->fixed_nodes : v->free_nodes,
                                       d ? v->fixed_count : v->free_count, &def, &o.wavelets[d], &err), &err);
    }
    return o;
}

static void close_model(opened *o)
{
    for (int d = 0; d < 2; d++) pliant_wavelet_destroy(o->wavelets[d]);
    free(o->areas);
    pliant_hierarchy_destroy(o->hierarchy);
    pliant_reader_close(o->reader);
}

static int32_t finest(const opened *o)
{
    return o->view.level_count - 1;
}

// Nodal values of one column of a level, [m + 1][9]; the caller frees.
static double *column_of(const opened *o, pliant_block_name block, int32_t level, int32_t column)
{
    const pliant_greens_view *g = &o->view.greens[block][level];
    const pliant_wavelet *w = o->wavelets[block == PLIANT_FIXED_FREE || block == PLIANT_FIXED_FIXED];
    double *x = calloc(((size_t)w->count + 1) * 9, sizeof *x);
    for (uint64_t q = g->column_offset[column]; q < g->column_offset[column + 1]; q++)
        for (int e = 0; e < 9; e++) x[9 * g->row[q] + e] = g->block[9 * q + e];
    pliant_wavelet_inverse(w, w->level_count - 1, 9, x);
    return x;
}

static int32_t columns_of(const opened *o, pliant_block_name block)
{
    return block == PLIANT_FREE_FREE || block == PLIANT_FIXED_FREE ? o->view.free_count : o->view.fixed_count;
}

static int32_t rows_of(const opened *o, pliant_block_name block)
{
    return block == PLIANT_FREE_FREE || block == PLIANT_FREE_FIXED ? o->view.free_count : o->view.fixed_count;
}

// Largest difference of two models' columns on one level, relative to each column's largest value.
static double difference_on(const opened *a, const opened *b, int32_t level)
{
    double worst = 0;
    for (int block = 0; block < PLIANT_BLOCK_COUNT; block++) {
        const pliant_greens_view *g = &a->view.greens[block][level], *h = &b->view.greens[block][level];
        assert_true(!g->column_offset == !h->column_offset);
        if (!g->column_offset) continue;
        assert_int_equal(g->column_count, h->column_count);
        for (int32_t j = 0; j < g->column_count; j++) {
            double *x = column_of(a, (pliant_block_name)block, level, j);
            double *y = column_of(b, (pliant_block_name)block, level, j);
            double peak = 0, off = 0;
            for (int32_t i = 0; i < 9 * rows_of(a, (pliant_block_name)block); i++)
                peak = fmax(peak, fabs(x[i])), off = fmax(off, fabs(x[i] - y[i]));
            worst = fmax(worst, off / peak);
            free(x), free(y);
        }
    }
    return worst;
}

// The same over all levels.
static double difference(const opened *a, const opened *b)
{
    double worst = 0;
    for (int32_t l = 0; l < a->view.level_count; l++) worst = fmax(worst, difference_on(a, b, l));
    return worst;
}

// ---- Cases ----

static void help_version_and_misuse_have_their_exit_status(void **state)
{
    (void)state;
    check_command c;
    check_run(&c, "%s/pliant-precompute --help", check_build());
    assert_int_equal(c.status, 0);
    assert_non_null(strstr(c.output, "usage: mpirun"));
    check_run(&c, "%s/pliant-precompute --version", check_build());
    assert_int_equal(c.status, 0);
    assert_non_null(strstr(c.output, "pliant-precompute 0."));
    const struct {
        const char *arguments, *part;
    } misuses[] = {
        {"--subdivde 2 a.obj -o b.h5", "--subdivde: unknown option; see --help"},
        {"-x a.obj -o b.h5", "-x: unknown option"},
        {"--young", "--young: expected a value"},
        {"--force=yes a.obj", "--force: expected no value"},
        {"--poisson 0.5 --fixed 'z<0' a.obj -o b.h5", "--poisson: expected a number over -1 and under 0.5, found 0.5"},
        {"--poisson -1 --fixed 'z<0' a.obj -o b.h5", "--poisson"},
        {"--young 0 a.obj", "--young: expected a number over 0"},
        {"--eps banana a.obj", "--eps: expected a number, found 'banana'"},
        {"--subdivide 1.5 a.obj", "--subdivide: expected a whole number"},
        {"--scheme lop a.obj", "--scheme: expected loop, butterfly or midpoint, found 'lop'"},
        {"--detail 0 a.obj", "--detail: expected a whole number from 1 to 15, found '0'"},
        {"--detail 3 --subdivide 2 --fixed 'z<0' a.obj -o b.h5", "--detail: expected at most the 2 levels of --subdivide, found 3"},
        {"--method fdm a.obj", "--method: expected bem or fem, found 'fdm'"},
        {"--eps 0.1 --rms 0.1 --fixed 'z<0' a.obj -o b.h5", "one kind"},
        {"a.obj -o b.h5", "nothing holds the solid"},
        {"--fixed 'z<' a.obj -o b.h5", "--fixed: column 3"},
        {"--fixed 'z<0' a.obj", "expected -o"},
        {"--fixed 'z<0' -o b.h5", "expected a MESH"},
        {"--fixed 'z<0' -o b.h5 a.obj c.obj", "found also 'c.obj'"},
        {"--fixed 'z<0' -o b.h5 --dense b.h5 a.obj", "same file"},
        {"--constraint-levels", "--constraint-levels: expected a value"},
        {"--constraint-levels 2..1 a.obj", "expected A..B, levels from 0 to 15 with A at most B, or A, found '2..1'"},
        {"--constraint-levels x a.obj", "found 'x'"},
        {"--constraint-levels 1.. a.obj", "found '1..'"},
        {"--constraint-levels ..1 a.obj", "found '..1'"},
        {"--constraint-levels 0..1..2 a.obj", "found '0..1..2'"},
        {"--constraint-levels -1 a.obj", "found '-1'"},
        {"--constraint-levels '0 ..1' a.obj", "found '0 ..1'"},
        {"--constraint-levels 99999999999 a.obj", "found '99999999999'"},
        {"--constraint-levels 16 a.obj", "found '16'"},
        // Seen beside the mesh.
        {"--constraint-levels 0..3 --subdivide 2 --fixed 'z<0.03' scripts/sample/whale.obj -o b.h5",
         "--constraint-levels: expected levels of scripts/sample/whale.obj, 0 to 2, found 3"},
        {"--constraint-levels 0..1 --dense c.h5 --subdivide 2 --fixed 'z<0.03' scripts/sample/whale.obj -o b.h5",
         "--dense stores columns of the finest level, 2: expected --constraint-levels up to it, found up to 1"},
    };
    for (size_t i = 0; i < sizeof misuses / sizeof *misuses; i++) {
        check_run(&c, "%s/pliant-precompute -q %s", check_build(), misuses[i].arguments);
        assert_int_equal(c.status, 2);
        check_one_line(&c, name, misuses[i].part);
    }
    // Several ranks say it once.
    check_run(&c, "mpirun --quiet -n 3 %s/pliant-precompute --nonsense", check_build());
    assert_int_equal(c.status, 2);
    check_one_line(&c, name, "--nonsense");
    check_run(&c, "mpirun --quiet -n 3 %s/pliant-precompute -q --constraint-levels 4 %s %s -o %s", check_build(), small_run,
              sample, in_folder("misused.h5"));
    assert_int_equal(c.status, 2);
    check_one_line(&c, name, "found 4");
    assert_int_not_equal(access(in_folder("misused.h5"), F_OK), 0);
}

static void refusals_name_what_and_why_and_leave_nothing(void **state)
{
    (void)state;
    check_command c;
    const char *output = in_folder("refused.h5");
    const struct {
        const char *arguments, *part;
    } refusals[] = {
        {"--fixed 'z<0' nowhere.obj", "nowhere.obj"},
        {"--fixed 'z<-100' scripts/sample/whale.obj --subdivide 1", ""},
        {"--fixed 'z<100' scripts/sample/whale.obj --subdivide 1", ""},
        {"--fixed-list nowhere.txt scripts/sample/whale.obj --subdivide 1", "nowhere.txt"},
        {"--fixed 'z<0.03' scripts/sample/whale.obj", "whale.obj: no subdivision connectivity"},
        {"--fixed 'z<0.03' scripts/sample/whale.obj --subdivide 9", "GB"},
        {"--fixed 'z<0.03' scripts/sample/whale.obj --subdivide 13 --detail 11", "--subdivide 13 --detail 11: makes"},
        {"--fixed 'z<0.03' scripts/sample/whale.obj --subdivide 14", "GB"},
    };
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        check_run(&c, "%s/pliant-precompute -q %s -o %s", check_build(), refusals[i].arguments, output);
        if (c.status != 1) print_error("%s\n", refusals[i].arguments);
        assert_int_equal(c.status, 1);
        check_one_line(&c, name, refusals[i].part);
        assert_int_not_equal(access(output, F_OK), 0);
    }
    check_run(&c, "%s/pliant-precompute -q %s %s -o /nowhere/at/all.h5", check_build(), small_run, sample);
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "/nowhere/at/all.h5");
}

// A held set that stops no rotation about one axis is not a support.
static void two_held_vertices_are_refused(void **state)
{
    (void)state;
    check_command c;
    check_run(&c, "printf '0\\n1\\n' > %s; %s/pliant-precompute -q --subdivide 0 --fixed-list %s %s -o %s",
              in_folder("two.txt"), check_build(), in_folder("two.txt"), sample, in_folder("two.h5"));
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "");
}

static void every_bad_mesh_is_refused_or_solved_never_worse(void **state)
{
    (void)state;
    const char *folder = check_model_path("bad");
    if (!folder) skip();
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    check_command c;
    int refused = 0, solved = 0;
    for (struct dirent *entry; (entry = readdir(directory));) {
        if (entry->d_name[0] == '.' || strcmp(entry->d_name, "README.md") == 0) continue;
        const char *output = in_folder("bad.h5");
        // Held where it must be, refined not at all: what is left to refuse is the mesh.
        check_run(&c, "%s/pliant-precompute -q --force --subdivide 0 --fixed 'any(x<0, y<0)' '%s/%s' -o %s",
                  check_build(), folder, entry->d_name, output);
        if (c.status == 0) {
            solved++;
            continue;
        }
        if (c.status != 1) print_error("%s: exit %d\n%s", entry->d_name, c.status, c.errors);
        assert_int_equal(c.status, 1);
        check_one_line(&c, name, "");
        refused++;
    }
    closedir(directory);
    print_message("%d refused, %d solved\n", refused, solved);
    assert_true(refused >= 35 && solved >= 8);
}

static void existing_outputs_are_kept_unless_forced(void **state)
{
    (void)state;
    check_command c;
    const char *output = in_folder("kept.h5");
    check_run(&c, "echo precious > %s; %s/pliant-precompute -q %s %s -o %s", output, check_build(), small_run, sample, output);
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "--force");
    check_run(&c, "cat %s", output);
    assert_string_equal(c.output, "precious\n");
    check_run(&c, "%s/pliant-precompute -q --force %s %s -o %s", check_build(), small_run, sample, output);
    assert_int_equal(c.status, 0);
    opened o = open_model(output);
    close_model(&o);
}

// Writes beyond the limit fail as on a full disk.
static void a_full_disk_leaves_no_file_and_says_so(void **state)
{
    (void)state;
    check_command c;
    const char *output = in_folder("full.h5");
    for (int blocks = 1; blocks < 600; blocks = 4 * blocks + 3) {
        // The limit is the program's alone: Open MPI's own daemon has files too.
        check_run(&c, "mpirun --quiet -n 1 sh -c \"trap '' XFSZ; ulimit -f %d; exec %s/pliant-precompute -q %s %s -o %s\"",
                  blocks, check_build(), small_run, sample, output);
        assert_int_equal(c.status, 1);
        check_one_line(&c, name, "");
        assert_int_not_equal(access(output, F_OK), 0);
    }
    check_run(&c, "ls -A %s | grep -v std", check_folder());
    assert_null(strstr(c.output, "full"));
    assert_null(strstr(c.output, "spool"));
}

static void a_killed_run_leaves_nothing_under_the_outputs_name(void **state)
{
    (void)state;
    check_command c;
    const char *output = in_folder("killed.h5");
    for (int milliseconds = 50; milliseconds < 1700; milliseconds = milliseconds * 3 / 2) {
        check_run(&c, "rm -f %s; timeout -s KILL %d.%03d %s/pliant-precompute -q --force --subdivide 3 --fixed 'z<0.03' %s -o %s",
                  output, milliseconds / 1000, milliseconds % 1000, check_build(), sample, output);
        if (access(output, F_OK) != 0) continue;
        // Whatever stands under the name is whole.
        opened o = open_model(output);
        close_model(&o);
    }
    check_run(&c, "%s/pliant-precompute -q --force %s %s -o %s", check_build(), small_run, sample, output);
    assert_int_equal(c.status, 0);
}

static void compare_ranks(const char *options)
{
    check_command c;
    opened models[4];
    // The last: the distributed solver in place of the shared-memory one.
    static const char *const launches[] = {"mpirun --quiet -n 1", "mpirun --quiet -n 2", "mpirun --quiet -n 3",
                                           "PETSC_OPTIONS='-pliant_dense scalapack' mpirun --quiet -n 2"};
    for (int i = 0; i < 4; i++) {
        char output[512];
        snprintf(output, sizeof output, "%s/ranks%d.h5", check_folder(), i);
        check_run(&c, "%s %s/pliant-precompute -q --force --blocks all %s %s %s -o %s", launches[i], check_build(),
                  options, small_run, sample, output);
        if (c.status != 0) print_error("%s\n%s", launches[i], c.errors);
        assert_int_equal(c.status, 0);
        models[i] = open_model(output);
        if (i == 0) continue;
        assert_int_equal(pliant_reader_section_count(models[i].reader), pliant_reader_section_count(models[0].reader));
        for (int32_t s = 0; s < pliant_reader_section_count(models[0].reader); s++)
            assert_string_equal(pliant_reader_section(models[i].reader, s)->path,
                                pliant_reader_section(models[0].reader, s)->path);
        // Solutions differ by round-off times the condition number (under 1e4 here); a coefficient on
        // the edge of its threshold would show as 1e-3 or more.
        check_at_most(difference(&models[0], &models[i]), 1e-6);
        for (int32_t l = 0; l < models[0].view.level_count; l++) {
            const double *s = models[0].view.greens[PLIANT_FREE_FREE][l].summary;
            const double *t = models[i].view.greens[PLIANT_FREE_FREE][l].summary;
            // Errors to the rounding of sums, the eigenvalue to its residual.
            for (int k = 0; s && k < PLIANT_SUMMARY_COUNT; k++)
                check_near(t[k], s[k], k == PLIANT_SUMMARY_DEFINITE ? 2e-3 : 1e-6);
        }
    }
    for (int i = 0; i < 4; i++) close_model(&models[i]);
}

static void one_two_and_three_ranks_write_the_same_model(void **state)
{
    (void)state;
    compare_ranks("");
    compare_ranks("--constraint-levels 0..1 --eps 0.1");
}

// GF-60..62: what is refined offline from the finest columns, and what is solved for at once.
static void direct_coarse_columns_are_the_refined_ones(void **state)
{
    (void)state;
    check_command c;
    const char *all = in_folder("all-levels.h5"), *coarse = in_folder("coarse-levels.h5");
    check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute --json --blocks all --eps 1e-9 %s %s -o %s", check_build(),
              small_run, sample, all);
    assert_int_equal(c.status, 0);
    const char *memory = strstr(c.output, "\"memory_bytes\": ");
    assert_non_null(memory);
    const double all_bytes = strtod(memory + 16, NULL);
    check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute --json --blocks all --eps 1e-9 --constraint-levels 0..1 %s %s -o %s",
              check_build(), small_run, sample, coarse);
    assert_int_equal(c.status, 0);
    memory = strstr(c.output, "\"memory_bytes\": ");
    assert_non_null(memory);
    // The matrix and a batch stay; of as many right-hand sides a quarter is left.
    // What two ranks have before they begin is no part of either.
    const double idle = 2 * 48e6;
    check_at_most(strtod(memory + 16, NULL) - idle, 0.75 * (all_bytes - idle));
    opened o = open_model(all), p = open_model(coarse);
    assert_int_equal(o.view.level_count, 3);
    for (int32_t l = 0; l < 2; l++) {
        assert_non_null(p.view.greens[PLIANT_FREE_FREE][l].column_offset);
        // Floats round both by 6e-8 of a column's scale, and the spool another 6e-8.
        check_at_most(difference_on(&o, &p, l), 1e-6);
    }
    assert_null(p.view.greens[PLIANT_FREE_FREE][2].column_offset);
    assert_non_null(o.view.greens[PLIANT_FREE_FREE][2].column_offset);
    // pliant-info has a line of each, and finds the eigenvalues that are stored.
    check_run(&c, "%s/pliant-info %s", check_build(), coarse);
    assert_int_equal(c.status, 0);
    assert_non_null(strstr(c.output, "constraint_levels = 0..1"));
    for (int block = 0; block < PLIANT_BLOCK_COUNT; block++)
        for (int32_t l = 0; l < 3; l++) {
            char line[64];
            snprintf(line, sizeof line, "%-11s  %5d  %8d  %7d  ", pliant_block_text((pliant_block_name)block), l,
                     o.view.level_vertex_count[l], o.view.greens[block][l].column_count);
            assert_true(!strstr(c.output, line) == (l == 2));
        }
    for (int i = 0; i < 2; i++) {
        check_run(&c, "%s/pliant-info --verify %s", check_build(), i ? coarse : all);
        assert_int_equal(c.status, 0);
        const char *line = c.output;
        for (int32_t l = 0; l < (i ? 2 : 3); l++) {
            line = strstr(line, "contact compliance, level ");
            assert_non_null(line);
            line += strlen("contact compliance, level ");
            assert_int_equal(strtol(line, NULL, 10), l);
            const char *stored = strstr(line, ", as stored)\n"), *end = strchr(line, '\n');
            assert_true(stored && stored < end);
        }
        assert_null(strstr(line, "contact compliance"));
    }
    close_model(&p);
    close_model(&o);
}

static void a_level_without_free_vertices_is_empty_or_refused(void **state)
{
    (void)state;
    check_command c;
    const char *model = in_folder("whole.h5"), *mesh = in_folder("whole.obj"), *list = in_folder("base.txt");
    check_run(&c, "%s/pliant-precompute -q --eps 0.2 %s %s -o %s && %s/pliant-info --export %s %s && seq 0 11 > %s",
              check_build(), small_run, sample, model, check_build(), mesh, model, list);
    assert_int_equal(c.status, 0);
    // All base vertices are held.
    static const char *const rules[] = {"", "--eps 0.1"};
    for (int i = 0; i < 2; i++) {
        check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute -q --force --blocks all %s --fixed-list %s %s -o %s",
                  check_build(), rules[i], list, mesh, model);
        if (c.status) print_error("%s", c.errors);
        assert_int_equal(c.status, 0);
        opened o = open_model(model);
        assert_int_equal(o.view.greens[PLIANT_FREE_FREE][0].column_count, 0);
        assert_int_equal(o.view.greens[PLIANT_FREE_FIXED][0].column_count, 12);
        assert_int_equal(o.view.greens[PLIANT_FREE_FREE][1].column_count, 30);
        close_model(&o);
        check_run(&c, "%s/pliant-info --verify %s", check_build(), model);
        assert_int_equal(c.status, 0);
    }
    check_run(&c, "%s/pliant-precompute -q --force --constraint-levels 0 --fixed-list %s %s -o %s", check_build(), list,
              mesh, model);
    assert_int_equal(c.status, 2);
    check_one_line(&c, name, "found none of them on level 0");
}

// The exact column k of a level: the dense file's, refined by hats. [rows + 1][9]; the caller frees.
static double *exact_column(const double *matrix, int32_t rows, int32_t columns, const pliant_hats *hats, int32_t level,
                            int32_t k)
{
    double *x = calloc(((size_t)rows + 1) * 9, sizeof *x);
    for (int32_t e = hats->offset[level][k]; e < hats->offset[level][k + 1]; e++)
        for (int32_t i = 0; i < rows; i++)
            for (int c = 0; c < 9; c++)
                x[9 * i + c] += hats->weight[level][e] * matrix[(3 * (size_t)i + c / 3) * 3 * columns +
                                                                3 * (size_t)hats->position[level][e] + c % 3];
    return x;
}

static void stored_columns_meet_their_errors_against_the_dense_file(void **state)
{
    (void)state;
    check_command c;
    const char *output = in_folder("exact.h5"), *dense = in_folder("dense.h5");
    check_run(&c, "%s/pliant-precompute -q --blocks all --rms 0.01 --max 0.03 %s %s -o %s --dense %s", check_build(),
              small_run, sample, output, dense);
    assert_int_equal(c.status, 0);
    opened o = open_model(output);
    pliant_reader *reader = NULL;
    pliant_dense_view d;
    pliant_error err;
    check_ok(pliant_reader_open(dense, &reader, &err), &err);
    check_ok(pliant_dense_view_bind(reader, &d, &err), &err);
    const double *const matrices[] = {d.free_free, d.free_fixed, d.fixed_free, d.fixed_fixed};
    pliant_hats *hats[2];
    check_ok(pliant_hats_create(o.wavelets[0], o.view.free_nodes, o.areas, &hats[0], &err), &err);
    check_ok(pliant_hats_create(o.wavelets[1], o.view.fixed_nodes, o.areas, &hats[1], &err), &err);
    for (int block = 0; block < PLIANT_BLOCK_COUNT; block++) {
        const int32_t rows = rows_of(&o, (pliant_block_name)block), columns = columns_of(&o, (pliant_block_name)block);
        const pliant_hats *h = hats[block == PLIANT_FREE_FIXED || block == PLIANT_FIXED_FIXED];
        for (int32_t l = 0; l <= finest(&o); l++) {
            const pliant_greens_view *g = &o.view.greens[block][l];
            double error = 0, energy = 0, max = 0;
            assert_non_null(g->summary);
            assert_int_equal(g->column_count, h->level_offset[l + 1]);
            for (int32_t j = 0; j < g->column_count; j++) {
                double *x = column_of(&o, (pliant_block_name)block, l, j), largest = 0, peak = 0;
                double *value = exact_column(matrices[block], rows, columns, h, l, j);
                for (int32_t i = 0; i < rows; i++) {
                    double off = 0, square = 0;
                    for (int e = 9 * i; e < 9 * (i + 1); e++)
                        off += (x[e] - value[e]) * (x[e] - value[e]), square += value[e] * value[e];
                    error += off, energy += square;
                    largest = fmax(largest, off), peak = fmax(peak, square);
                }
                max = fmax(max, sqrt(largest / peak));
                free(value), free(x);
            }
            if (g->column_count == 0) continue;
            // What the file says of itself, recomputed the slow way.
            check_near(sqrt(error / energy), g->summary[PLIANT_SUMMARY_RMS], 2e-6);
            check_near(max, g->summary[PLIANT_SUMMARY_MAX], 2e-6);
            check_near((double)rows * g->column_count / (double)g->nnz, g->summary[PLIANT_SUMMARY_FACTOR], 1e-9);
            check_at_most(sqrt(error / energy), 0.01);
            check_at_most(max, 0.03);
        }
    }
    pliant_hats_destroy(hats[1]);
    pliant_hats_destroy(hats[0]);
    pliant_reader_close(reader);
    close_model(&o);
}

// Contact, tractions, moved supports, a freed support and gravity, all at once and one by one.
static void a_model_without_loss_plays_as_its_dense_file(void **state)
{
    (void)state;
    check_command c;
    const char *output = in_folder("lossless.h5"), *dense = in_folder("lossless-dense.h5");
    check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute -q --blocks all --eps 1e-9 %s %s -o %s --dense %s",
              check_build(), small_run, sample, output, dense);
    assert_int_equal(c.status, 0);
    opened o = open_model(output);
    const int32_t *free_nodes = o.view.free_nodes, *fixed = o.view.fixed_nodes;
    const int32_t m = o.view.free_count;
    FILE *script = fopen(in_folder("all.script"), "w");
    assert_non_null(script);
    fprintf(script,
            "pliant-script 1\n"
            "gravity 0 0 -9.81\nstep\n"
            "displace %d 0 0.001 -0.003\ndisplace %d 0.002 0 0\nstep\n"
            "traction %d 10 20 -50\nforce %d 0.001 0 -0.002\nstep\n"
            "support %d 0 0 0.002\nstep\n"
            "traction %d 0 0 0\nstep\n"
            "release %d\nstep\nrelease all\nstep\n",
            free_nodes[0], free_nodes[m / 2], free_nodes[1], free_nodes[m - 1], fixed[0], fixed[1], free_nodes[0]);
    fclose(script);
    check_run(&c, "%s/pliant-play --json --compare %s %s %s", check_build(), dense, output, in_folder("all.script"));
    if (c.status != 0) print_error("%s", c.errors);
    assert_int_equal(c.status, 0);
    const char *rms = strstr(c.output, "\"rms\":"), *force = strstr(c.output, "\"force_worst\":");
    assert_non_null(rms);
    assert_non_null(force);
    // Floats hold 6e-8 of each column's scale; the contact matrix's condition is under a hundred here.
    check_at_most(strtod(rms + 6, NULL), 1e-5);
    check_at_most(strtod(force + 14, NULL), 1e-4);
    close_model(&o);
}

static void source_numbers_follow_a_shuffled_mesh(void **state)
{
    (void)state;
    const char *ordered = check_model_path("semireg/bob_L2.obj");
    const char *shuffled = check_model_path("semireg/bob_L2_shuffled.obj");
    if (!ordered || !shuffled) skip();
    check_command c;
    // Coarse targets: what is tested is numbering. 2480 vertices.
    check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute -q --fixed 'z<-0.3' --eps 0.2 %s -o %s", check_build(), shuffled,
              in_folder("shuffled.h5"));
    if (c.status) print_error("%s", c.errors);
    assert_int_equal(c.status, 0);
    opened o = open_model(in_folder("shuffled.h5"));
    assert_int_equal(o.view.level_count, 3);
    assert_int_equal(o.view.level_vertex_count[0], 155);
    // The model's vertex v is the file's vertex source_index[v].
    FILE *file = fopen(shuffled, "r");
    double (*positions)[3] = malloc(sizeof(double[3]) * (size_t)o.view.vertex_count);
    char line[256];
    for (int32_t v = 0; v < o.view.vertex_count && fgets(line, sizeof line, file);)
        if (sscanf(line, "v %lf %lf %lf", &positions[v][0], &positions[v][1], &positions[v][2]) == 3) v++;
    fclose(file);
    for (int32_t v = 0; v < o.view.vertex_count; v++)
        for (int e = 0; e < 3; e++) check_near(o.view.vertices[3 * v + e], positions[o.view.source_index[v]][e], 0);
    free(positions);
    close_model(&o);
}

// The v lines of an OBJ file, [*count][3]; the caller frees.
static double *vertices_of(const char *path, int32_t *count)
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    double *x = NULL, v[3];
    char line[256];
    for (*count = 0; fgets(line, sizeof line, file);) {
        if (sscanf(line, "v %lf %lf %lf", &v[0], &v[1], &v[2]) != 3) continue;
        x = realloc(x, 3 * ((size_t)*count + 1) * sizeof *x);
        assert_non_null(x);
        memcpy(x + 3 * (size_t)(*count)++, v, sizeof v);
    }
    fclose(file);
    return x;
}

// Elasticity on fewer levels, the shape of all: exported, it is the mesh of a model of all levels.
static void detail_keeps_the_shape_of_the_levels_it_takes_off(void **state)
{
    (void)state;
    check_command c;
    const char *whole = in_folder("undetailed.h5"), *fine = in_folder("fine.obj"), *shape = in_folder("shape.obj");
    char model[2][512];
    for (int k = 0; k < 2; k++) snprintf(model[k], sizeof model[k], "%s/detail%d.h5", check_folder(), k);
    check_run(&c, "%s/pliant-precompute -q %s %s -o %s && %s/pliant-info --export %s %s", check_build(), small_run,
              sample, whole, check_build(), fine, whole);
    assert_int_equal(c.status, 0);
    int32_t n = 0, count = 0;
    double *x = vertices_of(fine, &n);
    assert_int_equal(n, 162);
    // Subdivided here, on three ranks; and found in the exported mesh, on one.
    check_run(&c, "mpirun --quiet -n 3 %s/pliant-precompute --json %s --detail 1 %s -o %s", check_build(), small_run,
              sample, model[0]);
    assert_int_equal(c.status, 0);
    assert_non_null(strstr(c.output, "\"vertices\": 42"));
    assert_non_null(strstr(c.output, "\"detail\": {\"steps\": 1, \"vertices\": 162, \"rms\": "));
    check_run(&c, "%s/pliant-precompute -q --fixed 'z<0.03' --young 50000 --poisson 0.4 --density 1000 --detail 1 %s -o %s",
              check_build(), fine, model[1]);
    assert_int_equal(c.status, 0);
    for (int k = 0; k < 2; k++) {
        opened o = open_model(model[k]);
        assert_int_equal(o.view.vertex_count, 42);
        assert_int_equal(o.view.level_count, 2);
        assert_int_equal(o.view.detail_steps, 1);
        for (int32_t i = 0; i < 3 * 42; i++) check_near(o.view.vertices[i], x[i], 0);
        check_run(&c, "%s/pliant-info --detail --export %s %s", check_build(), shape, model[k]);
        assert_int_equal(c.status, 0);
        double *y = vertices_of(shape, &count);
        assert_int_equal(count, n);
        // Floats of a shape 0.3 long.
        for (int32_t i = 0; i < 3 * n; i++) check_near(y[i], x[i], 1e-7);
        for (int32_t v = 0; v < n; v++) assert_int_equal(o.view.detail_source_index[v], k == 1 ? v : v < 12 ? v : -1);
        free(y);
        close_model(&o);
    }
    free(x);
    // More than there is.
    check_run(&c, "%s/pliant-precompute -q --fixed 'z<0.03' --detail 3 %s -o %s", check_build(), fine, whole);
    assert_int_equal(c.status, 1);
}

static void json_summary_is_one_object(void **state)
{
    (void)state;
    check_command c;
    check_run(&c, "%s/pliant-precompute --json %s %s -o %s", check_build(), small_run, sample, in_folder("json.h5"));
    assert_int_equal(c.status, 0);
    assert_int_equal(c.output[0], '{');
    assert_non_null(strstr(c.output, "\"free-free\": {\"kept\": "));
    assert_non_null(strstr(c.output, "\"levels\": [{\"level\": 0, \"columns\": "));
    assert_non_null(strstr(c.output, "{\"level\": 2, \"columns\": "));
    assert_non_null(strstr(c.output, "\"smallest_eigenvalue\": "));
    // The summary cannot be printed; the file, here of one level and without spools, is there.
    check_run(&c, "%s/pliant-precompute --json --constraint-levels 1 --eps 0.1 %s %s -o %s > /dev/full", check_build(),
              small_run, sample, in_folder("json2.h5"));
    assert_int_equal(c.status, 1);
    opened o = open_model(in_folder("json2.h5"));
    for (int32_t l = 0; l < 3; l++) assert_true(!o.view.greens[PLIANT_FREE_FREE][l].column_offset == (l != 1));
    close_model(&o);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(help_version_and_misuse_have_their_exit_status),
        cmocka_unit_test(refusals_name_what_and_why_and_leave_nothing),
        cmocka_unit_test(two_held_vertices_are_refused),
        cmocka_unit_test(every_bad_mesh_is_refused_or_solved_never_worse),
        cmocka_unit_test(existing_outputs_are_kept_unless_forced),
        cmocka_unit_test(a_full_disk_leaves_no_file_and_says_so),
        cmocka_unit_test(a_killed_run_leaves_nothing_under_the_outputs_name),
        cmocka_unit_test(one_two_and_three_ranks_write_the_same_model),
        cmocka_unit_test(direct_coarse_columns_are_the_refined_ones),
        cmocka_unit_test(a_level_without_free_vertices_is_empty_or_refused),
        cmocka_unit_test(stored_columns_meet_their_errors_against_the_dense_file),
        cmocka_unit_test(a_model_without_loss_plays_as_its_dense_file),
        cmocka_unit_test(source_numbers_follow_a_shuffled_mesh),
        cmocka_unit_test(detail_keeps_the_shape_of_the_levels_it_takes_off),
        cmocka_unit_test(json_summary_is_one_object),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
