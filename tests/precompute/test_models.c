// test_models.c: the figures of the paper's rabbit-sized models: compression, and contact through it.
//
// blob_L4 and bunny_L4 of the evaluation meshes are solved once each, with their exact columns kept;
// every rule then compresses the same columns.
#include "check.h"
#include "command.h"

#include "compression.h"

#include "pliant/dense_view.h"
#include "pliant/mesh.h"
#include "pliant/model_view.h"

#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { group = PLIANT_COLUMN_GROUP };

typedef struct solved {
    pliant_reader *model_reader, *dense_reader;
    pliant_model_view model;
    pliant_dense_view dense;
    pliant_hierarchy *hierarchy;
    double *areas;
    char model_path[300], dense_path[300];
} solved;

static solved blob, bunny;
static int blob_here, bunny_here;

// Before MPI starts in this process: mpirun does not run below a process that has joined MPI.
static int solve(const char *name)
{
    char mesh[64], list[64];
    snprintf(mesh, sizeof mesh, "semireg/%s_L4.obj", name);
    snprintf(list, sizeof list, "semireg/%s_L4.fixed", name);
    const char *mesh_path = check_model_path(mesh), *list_path = check_model_path(list);
    if (!mesh_path || !list_path) return 0;
    check_command c;
    check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute -q --wavelet linear --eps 0.05 --fixed-list %s %s "
              "-o %s/%s.h5 --dense %s/%s-dense.h5", check_build(), list_path, mesh_path, check_folder(), name,
              check_folder(), name);
    if (c.status != 0) printf("cannot solve %s: %s\n", name, c.errors);
    return c.status == 0 ? 1 : -1;
}

static void open_solved(const char *name, solved *s)
{
    pliant_error err;
    snprintf(s->model_path, sizeof s->model_path, "%s/%s.h5", check_folder(), name);
    snprintf(s->dense_path, sizeof s->dense_path, "%s/%s-dense.h5", check_folder(), name);
    check_ok(pliant_reader_open(s->model_path, &s->model_reader, &err), &err);
    check_ok(pliant_model_view_bind(s->model_reader, &s->model, &err), &err);
    check_ok(pliant_reader_open(s->dense_path, &s->dense_reader, &err), &err);
    check_ok(pliant_dense_view_bind(s->dense_reader, &s->dense, &err), &err);
    const pliant_model_view *v = &s->model;
    check_ok(pliant_hierarchy_create(v->level_count, v->level_vertex_count, v->face_count, v->faces, v->parents,
                                     &s->hierarchy, &err), &err);
    s->areas = malloc((size_t)v->vertex_count * sizeof *s->areas);
    pliant_mesh_vertex_areas(v->vertex_count, v->vertices, v->face_count, v->faces, s->areas);
}

static void close_solved(solved *s)
{
    free(s->areas);
    pliant_hierarchy_destroy(s->hierarchy);
    pliant_reader_close(s->dense_reader);
    pliant_reader_close(s->model_reader);
}

typedef struct figures {
    double factor, rms, max;
} figures;

static figures compress(const solved *s, pliant_wavelet_scheme scheme, pliant_compression_def def)
{
    pliant_error err;
    pliant_wavelet *w = NULL;
    const pliant_wavelet_def wavelet = {scheme, PLIANT_LIFTED, PLIANT_ZERO};
    const int32_t m = s->dense.free_count;
    check_ok(pliant_wavelet_create(s->hierarchy, s->areas, s->model.free_nodes, m, &wavelet, &w, &err), &err);
    pliant_compression *c = NULL;
    check_ok(pliant_compression_create(w, &def, check_folder(), &c, &err), &err);
    for (int32_t first = 0; first < m; first += group) {
        const int32_t count = m - first < group ? m - first : group;
        double *x = pliant_compression_group(c);
        int32_t columns[group];
        for (int32_t k = 0; k < count; k++) columns[k] = first + k;
        for (size_t row = 0; row < 3 * (size_t)m; row++) {
            const double *values = s->dense.free_free + row * 3 * (size_t)m + 3 * (size_t)first;
            for (int32_t k = 0; k < count; k++)
                for (int e = 0; e < 3; e++) x[(3 * row + (size_t)e) * group + (size_t)k] = values[3 * k + e];
        }
        memset(x + (size_t)m * 9 * group, 0, 9 * group * sizeof *x);
        check_ok(pliant_compression_add(c, columns, count, &err), &err);
    }
    pliant_compression_result r;
    check_ok(pliant_compression_decide(c, MPI_COMM_SELF, &r, &err), &err);
    pliant_compression_destroy(c);
    pliant_wavelet_destroy(w);
    const figures f = {(double)r.dense / (double)r.kept, r.rms, r.max};
    print_message("%s eps %.2f rms %.2f max %.2f: factor %.1f, RMS %.4f, MAX %.4f\n",
                  scheme == PLIANT_LINEAR ? "linear" : "butterfly", def.eps, def.rms, def.max, f.factor, f.rms, f.max);
    return f;
}

static void the_papers_threshold_reaches_the_measured_table_on_the_blob(void **state)
{
    (void)state;
    if (!blob_here) skip();
    // The reference implementation's figures on this mesh, rounded outwards in their last digit.
    const struct {
        pliant_wavelet_scheme scheme;
        double eps, factor, rms;
    } table[] = {
        {PLIANT_LINEAR, 0.01, 10, 0.006},
        {PLIANT_LINEAR, 0.05, 28, 0.016},
        {PLIANT_LINEAR, 0.20, 67, 0.037},
        {PLIANT_BUTTERFLY, 0.20, 90, 0.043},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const figures f = compress(&blob, table[i].scheme, (pliant_compression_def){.eps = table[i].eps});
        check_at_least(f.factor, table[i].factor);
        check_at_most(f.rms, table[i].rms);
    }
}

static void both_criteria_reach_the_measured_table(void **state)
{
    (void)state;
    if (!blob_here || !bunny_here) skip();
    // Fixed column thresholds of 0.03, 0.06 and 0.12 with a global one reach these factors at these
    // errors; a search that adapts t_j and refits must not do worse.
    const struct {
        const solved *model;
        pliant_wavelet_scheme scheme;
        double rms, max, factor;
    } table[] = {
        {&blob, PLIANT_LINEAR, 0.02, 0.04, 38},  {&blob, PLIANT_LINEAR, 0.05, 0.05, 49},
        {&bunny, PLIANT_LINEAR, 0.02, 0.05, 29}, {&bunny, PLIANT_LINEAR, 0.05, 0.05, 30},
        {&blob, PLIANT_LINEAR, 0.02, 0.09, 40},  {&blob, PLIANT_LINEAR, 0.05, 0.11, 83},
        {&bunny, PLIANT_LINEAR, 0.02, 0.11, 55}, {&bunny, PLIANT_LINEAR, 0.05, 0.11, 56},
        {&blob, PLIANT_LINEAR, 0.02, 0.13, 40},  {&blob, PLIANT_LINEAR, 0.05, 0.21, 97},
        {&bunny, PLIANT_LINEAR, 0.02, 0.28, 99}, {&bunny, PLIANT_LINEAR, 0.05, 0.28, 104},
        {&blob, PLIANT_BUTTERFLY, 0.02, 0.09, 46},  {&blob, PLIANT_BUTTERFLY, 0.05, 0.12, 99},
        {&bunny, PLIANT_BUTTERFLY, 0.02, 0.14, 57}, {&bunny, PLIANT_BUTTERFLY, 0.05, 0.14, 59},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const figures f = compress(table[i].model, table[i].scheme,
                                   (pliant_compression_def){.rms = table[i].rms, .max = table[i].max});
        check_at_least(f.factor, table[i].factor);
        check_at_most(f.rms, table[i].rms);
        check_at_most(f.max, table[i].max);
    }
}

// ---- Contact ----

static const double *at(const solved *s, int32_t vertex)
{
    return s->model.vertices + 3 * (size_t)vertex;
}

// The `count` free vertices nearest to the highest one, pushed in towards the middle of the blob.
static void write_patch(const solved *s, int32_t count, const char *path)
{
    int32_t top = s->model.free_nodes[0];
    for (int32_t i = 0; i < s->model.free_count; i++)
        if (at(s, s->model.free_nodes[i])[2] > at(s, top)[2]) top = s->model.free_nodes[i];
    const double *out = at(s, top), size = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    unsigned char *taken = calloc((size_t)s->model.vertex_count, 1);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "pliant-script 1\n");
    for (int32_t k = 0; k < count; k++) {
        int32_t best = -1;
        double nearest = INFINITY;
        for (int32_t i = 0; i < s->model.free_count; i++) {
            const int32_t v = s->model.free_nodes[i];
            double distance = 0;
            for (int e = 0; e < 3; e++) distance += (at(s, v)[e] - at(s, top)[e]) * (at(s, v)[e] - at(s, top)[e]);
            if (!taken[v] && distance < nearest) nearest = distance, best = v;
        }
        taken[best] = 1;
        fprintf(file, "displace %d %.9g %.9g %.9g\n", best, -0.05 * out[0] / size, -0.05 * out[1] / size,
                -0.05 * out[2] / size);
    }
    fprintf(file, "step\n");
    fclose(file);
    free(taken);
}

// The number after "key": in a JSON text.
static double json_number(const char *text, const char *key)
{
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\":", key);
    const char *found = strstr(text, quoted);
    if (!found) print_error("no %s in %s\n", quoted, text);
    assert_non_null(found);
    return strtod(found + strlen(quoted), NULL);
}

static void contact_through_compressed_functions_keeps_its_figures(void **state)
{
    (void)state;
    if (!blob_here) skip();
    // Linear lifted wavelets at eps 0.05, against the exact columns: relative displacement error (the
    // reference's 5.0, 3.7, 2.4, 1.8%) and total force (2.5%). The reference does not tell where its
    // patch was pushed; towards the middle all eight of its figures at eps 0.05 and 0.2 come out within
    // 5% of themselves, so that is the room given.
    const struct {
        int32_t count;
        double error;
    } table[] = {{1, 0.050}, {7, 0.037}, {30, 0.024}, {100, 0.018}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char script[300];
        snprintf(script, sizeof script, "%s/patch.script", check_folder());
        write_patch(&blob, table[i].count, script);
        check_command c;
        check_run(&c, "%s/pliant-play --json --compare %s %s %s", check_build(), blob.dense_path, blob.model_path, script);
        if (c.status != 0) print_error("%s", c.errors);
        assert_int_equal(c.status, 0);
        const double error = json_number(c.output, "rms"), force = json_number(c.output, "force_worst");
        print_message("%d vertices: displacement %.4f, force %.4f\n", table[i].count, error, force);
        check_at_most(error, 1.05 * table[i].error);
        check_at_most(force, 1.05 * 0.025);
    }
}

int main(int argc, char **argv)
{
    blob_here = solve("blob");
    bunny_here = solve("bunny");
    if (blob_here < 0 || bunny_here < 0) return 1;
    MPI_Init(&argc, &argv);
    if (blob_here) open_solved("blob", &blob);
    if (bunny_here) open_solved("bunny", &bunny);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_papers_threshold_reaches_the_measured_table_on_the_blob),
        cmocka_unit_test(both_criteria_reach_the_measured_table),
        cmocka_unit_test(contact_through_compressed_functions_keeps_its_figures),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    if (blob_here) close_solved(&blob);
    if (bunny_here) close_solved(&bunny);
    MPI_Finalize();
    return failed;
}
