// bench_contact.c: on how many patches compression costs the contact problem its definiteness.
//
// usage: bench_contact MODEL.h5 ...   Around every eleventh free vertex the s nearest free vertices
// are displaced together; printed is how many of these patches are PLIANT_ROUGH, per model and s.
#include "pliant/pliant.h"

#include <stdio.h>
#include <stdlib.h>

enum { patch_step = 11, size_count = 4 };
static const int32_t sizes[size_count] = {1, 10, 30, 100};

typedef struct neighbour {
    double square_distance;
    int32_t vertex;
} neighbour;

static int by_distance(const void *a, const void *b)
{
    const double x = ((const neighbour *)a)->square_distance, y = ((const neighbour *)b)->square_distance;
    return (x > y) - (x < y);
}

static void sort_around(const double *positions, int32_t centre, neighbour *free_vertices, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        free_vertices[i].square_distance = 0;
        for (int c = 0; c < 3; c++) {
            const double d = positions[3 * free_vertices[i].vertex + c] - positions[3 * centre + c];
            free_vertices[i].square_distance += d * d;
        }
    }
    qsort(free_vertices, (size_t)count, sizeof *free_vertices, by_distance);
}

static int bench(const char *path)
{
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    if (pliant_model_open(path, &model, &err) < 0) return fprintf(stderr, "bench_contact: %s\n", err.text), 1;
    const pliant_model_info info = pliant_model_describe(model);
    pliant_solver_def def = pliant_solver_default(model);
    def.constraint_capacity = sizes[size_count - 1];
    neighbour *free_vertices = malloc((size_t)info.free_count * sizeof *free_vertices);
    int32_t *centres = malloc((size_t)info.free_count * sizeof *centres);
    if (!free_vertices || !centres || pliant_solver_create(model, &def, &solver, &err) < 0)
        return fprintf(stderr, "bench_contact: %s: %s\n", path, err.text), 1;
    int32_t count = 0, patches = 0, rough[size_count] = {0};
    for (int32_t v = 0; v < info.vertex_count; v++)
        if (pliant_model_is_free(model, v) == 1) centres[count] = free_vertices[count].vertex = v, count++;
    for (int32_t i = 0; i < count; i += patch_step, patches++) {
        sort_around(pliant_model_positions(model), centres[i], free_vertices, count);
        for (int k = 0; k < size_count && sizes[k] <= count; k++) {
            pliant_solver_release_all(solver);
            pliant_status status = PLIANT_OK;
            for (int32_t j = 0; j < sizes[k] && status == PLIANT_OK; j++)
                status = pliant_solver_displace(solver, (pliant_node){info.level_count - 1, free_vertices[j].vertex},
                                                (pliant_vec3){0, 0, -0.01f});
            if (status == PLIANT_OK) status = pliant_solver_solve(solver, PLIANT_NEVER);
            if (status < 0) return fprintf(stderr, "bench_contact: %s: %s\n", path, pliant_status_name(status)), 1;
            rough[k] += status == PLIANT_ROUGH;
        }
    }
    printf("%s: factor %.1f, RMS %.3g, MAX %.3g: of %d patches rough at s =", path, info.factor, info.rms, info.max, patches);
    for (int k = 0; k < size_count; k++) printf(" %d: %d%s", sizes[k], rough[k], k + 1 < size_count ? "," : "\n");
    free(centres);
    free(free_vertices);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
    return 0;
}

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++)
        if (bench(argv[i]) != 0) return 1;
    if (argc < 2) printf("no models given\n");
    return 0;
}
