// bench_levels.c: compression of hierarchical Green's functions, level by level (GF Figures 18, 19).
//
// The sample at 2562 vertices, the paper's rabbit's size, is solved once with its exact columns; those
// of coarser levels are sums of them (GF-60), and every level is compressed for itself.
#include "command.h"

#include "compression.h"

#include "pliant/dense_view.h"
#include "pliant/hats.h"
#include "pliant/mesh.h"
#include "pliant/model_view.h"

#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char model_options[] =
    "scripts/sample/whale.obj --subdivide 4 --fixed 'z<0.027' --young 50000 --poisson 0.4 --density 1000";

enum { group = PLIANT_COLUMN_GROUP };

typedef struct solved {
    pliant_reader *model_reader, *dense_reader;
    pliant_model_view model;
    pliant_dense_view dense;
    pliant_hierarchy *hierarchy;
    double *areas;
} solved;

static void must(pliant_status status, const pliant_error *err)
{
    if (status >= 0) return;
    fprintf(stderr, "bench_levels: %s\n", err->text);
    exit(1);
}

static solved open_solved(const char *model, const char *dense)
{
    solved s = {0};
    pliant_error err = {""};
    must(pliant_reader_open(model, &s.model_reader, &err), &err);
    must(pliant_model_view_bind(s.model_reader, &s.model, &err), &err);
    must(pliant_reader_open(dense, &s.dense_reader, &err), &err);
    must(pliant_dense_view_bind(s.dense_reader, &s.dense, &err), &err);
    const pliant_model_view *v = &s.model;
    must(pliant_hierarchy_create(v->level_count, v->level_vertex_count, v->face_count, v->faces, v->parents,
                                 &s.hierarchy, &err), &err);
    s.areas = malloc((size_t)v->vertex_count * sizeof *s.areas);
    if (!s.areas) exit(1);
    pliant_mesh_vertex_areas(v->vertex_count, v->vertices, v->face_count, v->faces, s.areas);
    return s;
}

// Exact columns of a level, [m][3][3 columns]: the finest ones, a level coarser each time.
static double *refine(const double *fine, int32_t m, const pliant_hats *hats, int32_t level)
{
    const size_t from = 3 * (size_t)hats->level_offset[level + 2], to = 3 * (size_t)hats->level_offset[level + 1];
    double *coarse = calloc(3 * (size_t)m * to, sizeof *coarse);
    if (!coarse) exit(1);
    for (size_t row = 0; row < 3 * (size_t)m; row++)
        for (int32_t k = 0; k < hats->level_offset[level + 1]; k++)
            for (int32_t e = hats->offset[level][k]; e < hats->offset[level][k + 1]; e++) {
                const int32_t j = hats->position[level][e];
                if (j >= hats->level_offset[level + 2]) break;
                for (int c = 0; c < 3; c++)
                    coarse[row * to + 3 * (size_t)k + c] += hats->weight[level][e] * fine[row * from + 3 * (size_t)j + c];
            }
    return coarse;
}

static pliant_compression_result compress(const pliant_wavelet *w, const double *columns, int32_t count,
                                          pliant_compression_def def)
{
    pliant_error err = {""};
    pliant_compression *c = NULL;
    pliant_compression_result result;
    must(pliant_compression_create(w, &def, def.eps > 0 ? NULL : check_folder(), &c, &err), &err);
    double *x = pliant_compression_group(c);
    for (int32_t first = 0; first < count; first += group) {
        const int32_t size = count - first < group ? count - first : group;
        int32_t positions[group];
        memset(x, 0, ((size_t)w->count + 1) * 9 * group * sizeof *x);
        for (int32_t k = 0; k < size; k++) positions[k] = first + k;
        for (size_t row = 0; row < 3 * (size_t)w->count; row++) {
            const double *values = columns + row * 3 * (size_t)count + 3 * (size_t)first;
            for (int32_t k = 0; k < size; k++)
                for (int e = 0; e < 3; e++) x[(3 * row + (size_t)e) * group + (size_t)k] = values[3 * k + e];
        }
        must(pliant_compression_add(c, positions, size, &err), &err);
    }
    must(pliant_compression_decide(c, MPI_COMM_SELF, &result, &err), &err);
    pliant_compression_destroy(c);
    return result;
}

static void print_row(const char *name, const pliant_compression_result *levels, int32_t level_count)
{
    printf("  %-20s", name);
    for (int32_t l = 0; l < level_count; l++)
        printf("  %5.1f %.4f %.3f", (double)levels[l].dense / (double)levels[l].kept, levels[l].rms, levels[l].max);
    printf("\n");
}

static void print_scheme(const solved *s, pliant_wavelet_scheme scheme, double *const *columns)
{
    static const double eps[] = {0.01, 0.02, 0.05, 0.1, 0.15, 0.2};
    const pliant_wavelet_def def = {scheme, PLIANT_LIFTED, PLIANT_ZERO};
    const pliant_model_view *v = &s->model;
    pliant_wavelet *w = NULL;
    pliant_error err = {""};
    must(pliant_wavelet_create(s->hierarchy, s->areas, v->free_nodes, v->free_count, &def, &w, &err), &err);
    printf("%s, lifted: dense / kept blocks, RMS (GF-70), MAX (GF-71)\n  %-20s",
           scheme == PLIANT_LINEAR ? "linear" : "butterfly", "level (columns)");
    for (int32_t l = 0; l < v->level_count; l++) {
        char title[24];
        snprintf(title, sizeof title, "%d (%d)", l, w->level_offset[l + 1]);
        printf("  %18s", title);
    }
    printf("\n");
    pliant_compression_result results[PLIANT_LEVEL_LIMIT + 1];
    for (size_t i = 0; i <= sizeof eps / sizeof *eps; i++) {
        const int is_rule = i < sizeof eps / sizeof *eps;
        const pliant_compression_def rule = is_rule ? (pliant_compression_def){.eps = eps[i]}
                                                    : (pliant_compression_def){.rms = 0.02, .max = 0.05};
        char name[32];
        if (is_rule) snprintf(name, sizeof name, "eps %.2f", eps[i]);
        else snprintf(name, sizeof name, "rms .02, max .05");
        for (int32_t l = 0; l < v->level_count; l++) results[l] = compress(w, columns[l], w->level_offset[l + 1], rule);
        print_row(name, results, v->level_count);
    }
    pliant_wavelet_destroy(w);
}

int main(int argc, char **argv)
{
    // Before MPI starts in this process: mpirun does not run below a process that has joined MPI.
    static check_command c;
    char model[512], dense[512];
    snprintf(model, sizeof model, "%s/levels.h5", check_folder());
    snprintf(dense, sizeof dense, "%s/levels-dense.h5", check_folder());
    check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute -q --force --eps 0.2 %s -o %s --dense %s", check_build(),
              model_options, model, dense);
    if (c.status != 0) {
        fprintf(stderr, "%s", c.errors);
        return 1;
    }
    MPI_Init(&argc, &argv);
    solved s = open_solved(model, dense);
    const pliant_wavelet_def any = pliant_wavelet_default();
    pliant_wavelet *w = NULL;
    pliant_hats *hats = NULL;
    pliant_error err = {""};
    const int32_t finest = s.model.level_count - 1, m = s.model.free_count;
    must(pliant_wavelet_create(s.hierarchy, s.areas, s.model.free_nodes, m, &any, &w, &err), &err);
    must(pliant_hats_create(w, s.model.free_nodes, s.areas, &hats, &err), &err);
    double *columns[PLIANT_LEVEL_LIMIT + 1];
    columns[finest] = (double *)(uintptr_t)s.dense.free_free;  // only read
    for (int32_t l = finest - 1; l >= 0; l--) columns[l] = refine(columns[l + 1], m, hats, l);

    printf("%d vertices, %d free, %d levels: hierarchical Green's functions of the free-free block\n",
           s.model.vertex_count, m, s.model.level_count);
    print_scheme(&s, PLIANT_LINEAR, columns);
    print_scheme(&s, PLIANT_BUTTERFLY, columns);
    printf("the paper's rabbit, L = 4, linear, finest level: eps 0.01, 0.05, 0.20: 8.4, 25, 68; its coarser levels\n"
           "\"approximately the same\", at one RMS slightly better\n");

    for (int32_t l = 0; l < finest; l++) free(columns[l]);
    pliant_hats_destroy(hats);
    pliant_wavelet_destroy(w);
    free(s.areas);
    pliant_hierarchy_destroy(s.hierarchy);
    pliant_reader_close(s.dense_reader);
    pliant_reader_close(s.model_reader);
    unlink(dense);
    unlink(model);
    MPI_Finalize();
    return 0;
}
