// bench_hierarchy.c: what a contact costs per constraint level (GF 8), what updates save, and what
// an element of C costs to extract (GF Table III).
//
// usage: bench_hierarchy MODEL.h5 ...   Models with the columns of several levels; others are told
// and passed over. Patches are balls about free vertices that hold about `patch_size` nodes of the
// finest level; on coarser levels the same balls hold fewer.
#include "bench.h"
#include "solver.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { patch_size = 240, patch_count = 9, run_count = 25 };

static double square_distance(const pliant_model *model, int32_t a, int32_t b)
{
    const double *x = model->view.vertices + 3 * (size_t)a, *y = model->view.vertices + 3 * (size_t)b;
    return (x[0] - y[0]) * (x[0] - y[0]) + (x[1] - y[1]) * (x[1] - y[1]) +
           (x[2] - y[2]) * (x[2] - y[2]);
}

// Square of the radius that holds `count` free vertices.
static double radius_of(const pliant_model *model, int32_t centre, int32_t count)
{
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    double *distances = malloc((size_t)domain->count * sizeof *distances);
    if (!distances) exit(1);
    for (int32_t p = 0; p < domain->count; p++)
        distances[p] = square_distance(model, centre, domain->nodes[p]);
    qsort(distances, (size_t)domain->count, sizeof *distances, bench_compare);
    const double radius = distances[(count < domain->count ? count : domain->count) - 1];
    free(distances);
    return radius;
}

static int32_t nodes_within(const pliant_model *model, int32_t centre, double radius, int32_t level,
                            pliant_node *nodes)
{
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    int32_t count = 0;
    for (int32_t p = 0; p < domain->wavelet->level_offset[level + 1]; p++)
        if (square_distance(model, centre, domain->nodes[p]) <= radius)
            nodes[count++] = (pliant_node){level, domain->nodes[p]};
    return count;
}

typedef struct figures {
    double constraints, elements, extraction, inversion, update, solve, step;  // us
} figures;

// Medians over patches of medians over runs.
static figures measure(const pliant_model *model, int32_t level)
{
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    pliant_solver_def def = pliant_solver_default(model);
    def.constraint_capacity = 2 * patch_size;
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    require(pliant_solver_create(model, &def, &solver, &err), &err);
    pliant_vec3 *u = malloc((size_t)model->vertex_count * sizeof *u);
    pliant_node *nodes = malloc((size_t)model->vertex_count * sizeof *nodes);
    if (!u || !nodes) exit(1);
    double s[patch_count], extraction[patch_count], inversion[patch_count], update[patch_count];
    double solve[patch_count], step[patch_count];
    for (int p = 0; p < patch_count; p++) {
        const int32_t centre = domain->nodes[(p + 1) * (domain->count - 1) / (patch_count + 1)];
        const double radius = radius_of(model, centre, patch_size);
        int32_t count = nodes_within(model, centre, radius, level, nodes);
        // A small ball may hold no vertex of a coarse level: then the nearest one.
        if (count == 0) {
            const double *x = model->view.vertices + 3 * (size_t)centre;
            nodes[count++] = (pliant_node){level, pliant_model_nearest_on(model, level, x)};
        }
        double extracts[run_count], inverts[run_count], updates[run_count], solves[run_count];
        double steps[run_count];
        pliant_capacitance *type = solver->types;
        for (int run = 0; run < run_count; run++) {
            double begin = now_us();
            for (int32_t i = 0; i < count; i++) type->order[i] = i;
            pliant_capacitance_plan(model, nodes, count, &solver->scratch, type);
            pliant_capacitance_extract(model, type, &solver->scratch, type->matrix);
            extracts[run] = now_us() - begin;
            begin = now_us();
            pliant_capacitance_invert(model, &solver->scratch, type);
            inverts[run] = now_us() - begin;
            // One node leaves, and comes back.
            begin = now_us();
            (void)pliant_capacitance_update(model, nodes + 1, count - 1, &solver->scratch, type);
            (void)pliant_capacitance_update(model, nodes, count, &solver->scratch, type);
            updates[run] = (now_us() - begin) / 2;
        }
        for (int32_t t = 0; t < solver->cache_count; t++) solver->types[t].count = -1;
        for (int run = -2; run < run_count; run++) {
            const double begin = now_us();
            for (int32_t i = 0; i < count; i++)
                require(pliant_solver_displace(solver, nodes[i], (pliant_vec3){0, 0.01f, -0.1f}),
                        NULL);
            require(pliant_solver_solve(solver, PLIANT_NEVER), NULL);
            const double solved = now_us();
            require(pliant_solver_surface(solver, model->finest_level, u), NULL);
            if (run < 0) continue;
            solves[run] = solved - begin;
            steps[run] = now_us() - begin;
        }
        pliant_solver_release_all(solver);
        s[p] = count;
        extraction[p] = median(extracts, run_count), inversion[p] = median(inverts, run_count);
        update[p] = median(updates, run_count), solve[p] = median(solves, run_count);
        step[p] = median(steps, run_count);
    }
    free(nodes);
    free(u);
    pliant_solver_destroy(solver);
    const double middle = median(s, patch_count);
    return (figures){.constraints = middle,
                     .elements = middle * middle,
                     .extraction = median(extraction, patch_count),
                     .inversion = median(inversion, patch_count),
                     .update = median(update, patch_count),
                     .solve = median(solve, patch_count),
                     .step = median(step, patch_count)};
}

static void print_ladder(const pliant_model *model)
{
    printf("  the same patch on every level, medians of %d patches, us\n", patch_count);
    printf("  level  nodes  elements  extract C  factor C  update  solve  +surface     ratios to the "
           "coarser one:\n");
    printf("                                                                          nodes 4  "
           "elements 16  factor 64  all of the CMA 4-64\n");
    figures previous = {0};
    for (int32_t level = model->finest_stored; level >= model->coarsest_stored; level--) {
        if (!(model->stored_levels >> level & 1)) continue;
        const figures f = measure(model, level);
        // The whole CMA of a new type: extract, factor, solve and sum.
        const double whole = f.extraction + f.inversion + f.solve;
        printf("  %5d %6.0f %9.0f %10.1f %9.1f %7.1f %6.1f %9.1f", level, f.constraints, f.elements,
               f.extraction, f.inversion, f.update, f.solve, f.step);
        if (previous.constraints > 0)
            printf("   %9.1f %12.1f %10.1f %20.1f", previous.constraints / f.constraints,
                   previous.elements / f.elements, previous.inversion / f.inversion,
                   (previous.extraction + previous.inversion + previous.solve) / whole);
        printf("\n");
        previous = f;
    }
}

// One block by itself, plan included, of a row whose vertex first appears on each level: so many
// levels have to be reconstructed.
static void print_extraction(const pliant_model *model)
{
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    pliant_arena arena = {0};
    pliant_capacitance capacitance = {0};
    pliant_capacitance_scratch scratch = {0};
    enum { most = 30 };
    for (int pass = 0; pass < 2; pass++) {
        if (pass) require(pliant_arena_reserve(&arena, NULL), NULL);
        pliant_capacitance_lay_out(&arena, model, most, &capacitance);
        pliant_capacitance_scratch_lay_out(&arena, model, most, &scratch);
    }
    pliant_capacitance_scratch_begin(model, PLIANT_COMPLIANCE_STORED, &scratch);
    static const double paper[] = {0, 8, 20, 36};
    printf("  one element of C by itself, us (GF Table III beside it)\n");
    for (int32_t level = 0; level < model->level_count; level++) {
        const int32_t begin = domain->wavelet->level_offset[level];
        const int32_t count = domain->wavelet->level_offset[level + 1] - begin;
        if (count == 0) continue;
        enum { samples = 501 };
        double planned[samples], extracted[samples];
        for (int k = 0; k < samples; k++) {
            const pliant_node node = {model->finest_stored,
                                      domain->nodes[begin + (int32_t)((int64_t)k * 997 % count)]};
            const double start = now_us();
            pliant_capacitance_plan(model, &node, 1, &scratch, &capacitance);
            const double middle = now_us();
            pliant_capacitance_extract(model, &capacitance, &scratch, capacitance.matrix);
            extracted[k] = now_us() - middle;
            planned[k] = middle - start;
        }
        printf("  %d level%s above the base: plan %.2f, extract %.2f", level, level == 1 ? "" : "s",
               median(planned, samples), median(extracted, samples));
        if (level >= 1 && level <= 3) printf("     paper, %d levels: %.0f", level + 1, paper[level]);
        printf("\n");
    }
    for (int32_t size = 10; size <= most; size += 20) {
        pliant_node nodes[most];
        for (int32_t i = 0; i < size; i++)
            nodes[i] =
                (pliant_node){model->finest_stored, domain->nodes[domain->count / 2 + i]};
        double times[run_count];
        for (int run = 0; run < run_count; run++) {
            const double start = now_us();
            pliant_capacitance_plan(model, nodes, size, &scratch, &capacitance);
            pliant_capacitance_extract(model, &capacitance, &scratch, capacitance.matrix);
            times[run] = (now_us() - start) / (size * size);
        }
        printf("  in a cluster of %d nodes, plan included: %.3f\n", size, median(times, run_count));
    }
    pliant_arena_release(&arena);
}

static int bench(const char *path)
{
    pliant_model *model = NULL;
    pliant_error err = {""};
    require(pliant_model_open(path, &model, &err), &err);
    printf("%s: %d vertices, columns of levels %d..%d\n", path, model->vertex_count,
           model->coarsest_stored, model->finest_stored);
    if (model->coarsest_stored == model->finest_stored) printf("  has only one level\n");
    print_ladder(model);
    print_extraction(model);
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
