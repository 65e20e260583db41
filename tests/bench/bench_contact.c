// bench_contact.c: on how many patches compression costs the contact problem its definiteness.
//
// usage: bench_contact MODEL.h5 ...   Around every eleventh free vertex the s nearest free vertices
// are displaced together; printed is how many of these patches are PLIANT_ROUGH, per model and s, and
// how many a passive compliance raises the diagonal of, and by how much at most.
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

// One patch afresh: the status and the raise.
static pliant_status push(pliant_solver *solver, int32_t level, const neighbour *patch,
                          int32_t count, double *shift)
{
    pliant_solver_release_all(solver);
    pliant_status status = PLIANT_OK;
    for (int32_t j = 0; j < count && status == PLIANT_OK; j++)
        status = pliant_solver_displace(solver, (pliant_node){level, patch[j].vertex},
                                        (pliant_vec3){0, 0, -0.01f});
    if (status == PLIANT_OK) status = pliant_solver_solve(solver, PLIANT_NEVER);
    *shift = pliant_solver_last(solver).shift;
    return status;
}

static int bench(const char *path)
{
    pliant_model *model = NULL;
    pliant_solver *solvers[2] = {NULL, NULL};
    pliant_error err = {""};
    if (pliant_model_open(path, &model, &err) < 0) return fprintf(stderr, "bench_contact: %s\n", err.text), 1;
    const pliant_model_info info = pliant_model_describe(model);
    pliant_solver_def def = pliant_solver_default(model);
    def.constraint_capacity = sizes[size_count - 1];
    // Every patch from scratch: an update would carry the raise of the last one on.
    def.cache_count = 1;
    neighbour *free_vertices = malloc((size_t)info.free_count * sizeof *free_vertices);
    int32_t *centres = malloc((size_t)info.free_count * sizeof *centres);
    pliant_status created = free_vertices && centres ? PLIANT_OK : PLIANT_ERR_MEMORY;
    for (int k = 0; k < 2 && created == PLIANT_OK; k++) {
        def.compliance = k ? PLIANT_COMPLIANCE_PASSIVE : PLIANT_COMPLIANCE_STORED;
        created = pliant_solver_create(model, &def, &solvers[k], &err);
    }
    if (created < 0) return fprintf(stderr, "bench_contact: %s: %s\n", path, err.text), 1;
    int32_t count = 0, patches = 0, rough[size_count] = {0}, raised[size_count] = {0};
    double most[size_count] = {0};
    for (int32_t v = 0; v < info.vertex_count; v++)
        if (pliant_model_is_free(model, v) == 1) centres[count] = free_vertices[count].vertex = v, count++;
    for (int32_t i = 0; i < count; i += patch_step, patches++) {
        sort_around(pliant_model_positions(model), centres[i], free_vertices, count);
        for (int k = 0; k < size_count && sizes[k] <= count; k++) {
            double shift;
            pliant_status status =
                push(solvers[0], info.finest_constraint_level, free_vertices, sizes[k], &shift);
            rough[k] += status == PLIANT_ROUGH;
            if (status >= 0)
                status = push(solvers[1], info.finest_constraint_level, free_vertices, sizes[k], &shift);
            if (status < 0) return fprintf(stderr, "bench_contact: %s: %s\n", path, pliant_status_name(status)), 1;
            raised[k] += shift > 0;
            most[k] = shift > most[k] ? shift : most[k];
        }
    }
    printf("%s: factor %.1f, RMS %.3g, MAX %.3g: of %d patches rough as stored, raised when passive "
           "(at most by) at s =",
           path, info.factor, info.rms, info.max, patches);
    for (int k = 0; k < size_count; k++)
        printf(" %d: %d, %d (%.2g)%s", sizes[k], rough[k], raised[k], most[k], k + 1 < size_count ? ";" : "\n");
    free(centres);
    free(free_vertices);
    for (int k = 0; k < 2; k++) pliant_solver_destroy(solvers[k]);
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
