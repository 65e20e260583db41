// bench_solver.c: what a played step costs, by part, against dense products on the same sizes.
//
// usage: bench_solver [MODEL.h5 ...]      default: a synthetic sphere, 2562
// vertices. One thread, another patch (of the four whose inverses a solver caches by default) every
// frame, warm caches or a second-level cache swept before every frame; medians in microseconds. The
// baseline is OpenBLAS on a random dense matrix of the model's size.
#include "bench.h"
#include "synthetic_model.h"

#include "capacitance.h"
#include "model.h"
#include "solver.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

extern void sgemv_(const char *trans, const int *m, const int *n, const float *alpha,
                   const float *a, const int *lda, const float *x, const int *incx,
                   const float *beta, float *y, const int *incy);
extern void dgetrf_(const int *m, const int *n, double *a, const int *lda, int *pivots, int *info);
extern void dgetri_(const int *n, double *a, const int *lda, const int *pivots, double *work,
                    const int *lwork, int *info);

enum { patch_count = 4, frame_count = 301, size_count = 5 };
static const int32_t sizes[size_count] = {1, 10, 30, 100, 300};
// What we want for sum and surface, in microseconds.
static const double float_goal[size_count] = {5, 6, 8, 13, 25};
static const double half_goal[size_count] = {2.5, 3, 3.5, 5, 10};
static const double cold_goal[size_count] = {15, 15, 18, 25, 0};
// More than a core's own caches hold; the last level is shared and often too large to sweep.
enum { sweep_bytes = 16 << 20, cold_frame_count = 41 };

// ---- Patches ----

typedef struct near {
    double distance;
    int32_t vertex;
} near;

static int compare_near(const void *a, const void *b)
{
    const near *x = a, *y = b;
    if (x->distance != y->distance) return x->distance < y->distance ? -1 : 1;
    return (x->vertex > y->vertex) - (x->vertex < y->vertex);
}

static int compare_vertices(const void *a, const void *b)
{
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

// The `size` free vertices nearest to a free vertex, ascending.
static void choose_patch(const pliant_model *model, int32_t patch, int32_t size, int32_t *vertices)
{
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    const int32_t centre =
        domain->nodes[(int64_t)(patch + 1) * domain->count * 7 / 61 % domain->count];
    const double *x = pliant_model_positions(model);
    near *list = malloc((size_t)domain->count * sizeof *list);
    for (int32_t p = 0; p < domain->count; p++) {
        double sum = 0;
        for (int c = 0; c < 3; c++)
            sum += pow(x[3 * (size_t)domain->nodes[p] + c] - x[3 * (size_t)centre + c], 2);
        list[p] = (near){sum, domain->nodes[p]};
    }
    qsort(list, (size_t)domain->count, sizeof *list, compare_near);
    for (int32_t i = 0; i < size; i++) vertices[i] = list[i].vertex;
    qsort(vertices, (size_t)size, sizeof *vertices, compare_vertices);
    free(list);
}

// ---- Baseline ----

// u += 3m x 3 column blocks of the dense matrix, s of them.
static double time_dense(int32_t m, const float *matrix, const int32_t *columns, int32_t s,
                         float *u)
{
    const int rows = 3 * m, three = 3, one = 1;
    const float alpha = 1, value[3] = {1, 0.5f, -0.25f};
    const double begin = now_us();
    for (int32_t j = 0; j < s; j++) {
        const float beta = j > 0;
        sgemv_("N", &rows, &three, &alpha, matrix + (size_t)columns[j] * 3 * (size_t)rows, &rows,
               value, &one, &beta, u, &one);
    }
    return now_us() - begin;
}

static float *random_matrix(int32_t m)
{
    const size_t count = 9 * (size_t)m * (size_t)m;
    float *matrix = malloc(count * sizeof *matrix);
    uint32_t seed = 1;
    for (size_t i = 0; matrix && i < count; i++) {
        seed = seed * 1664525u + 1013904223u;
        matrix[i] = (float)(seed >> 8) * 0x1p-24f - 0.5f;
    }
    return matrix;
}

static void time_lapack(int32_t s, double *factor, double *inverse)
{
    const int n = 3 * s, work_count = 64 * n;
    double *a = malloc((size_t)n * (size_t)n * sizeof *a),
           *work = malloc((size_t)work_count * sizeof *work);
    int *pivots = malloc((size_t)n * sizeof *pivots), info = 0;
    double factors[11], inverses[11];
    for (int r = 0; r < 11; r++) {
        uint32_t seed = 1;
        for (size_t i = 0; i < (size_t)n * (size_t)n; i++) {
            seed = seed * 1664525u + 1013904223u;
            a[i] = (seed >> 8) * 0x1p-24 + (i % ((size_t)n + 1) == 0 ? n : 0);
        }
        const double begin = now_us();
        dgetrf_(&n, &n, a, &n, pivots, &info);
        factors[r] = now_us() - begin;
        dgetri_(&n, a, &n, pivots, work, &work_count, &info);
        inverses[r] = now_us() - begin;
    }
    *factor = median(factors, 11);
    *inverse = median(inverses, 11);
    free(a);
    free(work);
    free(pivots);
}

// Bytes a second that one thread reads, over a buffer of this size, repeatedly.
static double read_bandwidth(size_t bytes)
{
    const size_t count = bytes / sizeof(float) / 64 * 64;
    float *buffer = malloc(count * sizeof *buffer + 64);
    for (size_t i = 0; i < count; i++) buffer[i] = 1;
    typedef float lanes __attribute__((vector_size(64), aligned(4)));
    double times[21];
    volatile float sink = 0;
    for (int r = 0; r < 21; r++) {
        const double begin = now_us();
        lanes a = {0}, b = {0}, c = {0}, d = {0};
        for (size_t i = 0; i < count; i += 64) {
            a += *(const lanes *)(buffer + i);
            b += *(const lanes *)(buffer + i + 16);
            c += *(const lanes *)(buffer + i + 32);
            d += *(const lanes *)(buffer + i + 48);
        }
        a += b + c + d;
        sink += a[0];
        times[r] = now_us() - begin;
    }
    free(buffer);
    return (double)count * sizeof(float) / median(times, 21) * 1e6;
}

// ---- Ours ----

typedef struct step_times {
    double contact, sum, surface, step, build;
    double blocks;  // stored blocks summed per step, mean over patches
} step_times;

// `sweep`: NULL, or memory to read before every frame.
static step_times time_steps(const pliant_model *model, int32_t s, pliant_storage storage,
                             const volatile char *sweep, pliant_vec3 *u)
{
    const pliant_solver_def def = {.constraint_capacity = s,
                                   .load_capacity = 16,
                                   .cache_count = patch_count,
                                   .storage = storage};
    const int frames = sweep ? cold_frame_count : frame_count;
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    require(pliant_solver_create(model, &def, &solver, &err), &err);
    int32_t *patches[patch_count];
    const int32_t finest = pliant_model_describe(model).level_count - 1;
    const pliant_columns *columns = &model->greens[0][0][model->finest_level];
    step_times result = {0};
    for (int k = 0; k < patch_count; k++) {
        patches[k] = malloc((size_t)s * sizeof **patches);
        choose_patch(model, k, s, patches[k]);
        for (int32_t i = 0; i < s; i++) {
            const int32_t j = model->position[patches[k][i]];
            result.blocks += (double)(columns->offset[j + 1] - columns->offset[j]) / patch_count;
        }
    }
    static double contact[frame_count], sum[frame_count], surface[frame_count], step[frame_count];
    double build[patch_count];
    int rough = 0;
    for (int frame = -2 * patch_count; frame < frames; frame++) {
        const int k = (frame + 2 * patch_count) % patch_count;
        for (size_t i = 0; sweep && i < sweep_bytes; i += 64) (void)sweep[i];
        const double begin = now_us();
        pliant_solver_release_all(solver);
        for (int32_t i = 0; i < s; i++)
            require(pliant_solver_displace(solver, (pliant_node){finest, patches[k][i]},
                                           (pliant_vec3){0, 0.01f, -0.1f}),
                    NULL);
        const pliant_status status = pliant_solver_solve(solver, PLIANT_NEVER);
        require(status, NULL);
        require(pliant_solver_surface(solver, finest, u), NULL);
        const double end = now_us();
        const pliant_solver_report report = pliant_solver_last(solver);
        if (report.factored) {
            build[k] = (double)report.capacitance_ns * 1e-3;
            rough += status == PLIANT_ROUGH;
        }
        if (frame < 0) continue;
        contact[frame] = (double)report.contact_ns * 1e-3;
        sum[frame] = (double)report.summation_ns * 1e-3;
        surface[frame] = (double)report.surface_ns * 1e-3;
        step[frame] = end - begin;
    }
    if (rough && !sweep && storage == PLIANT_STORAGE_FLOAT)
        printf("  s = %d: %d of %d patches are rough\n", s, rough, patch_count);
    result.contact = median(contact, frames);
    result.sum = median(sum, frames);
    result.surface = median(surface, frames);
    result.step = median(step, frames);
    result.build = median(build, patch_count);
    for (int k = 0; k < patch_count; k++) free(patches[k]);
    pliant_solver_destroy(solver);
    return result;
}

// Microseconds of extracting all blocks for a patch, plan excluded and included.
// `again` is the second extraction in a row, with branches and caches warm.
static void time_extraction(const pliant_model *model, int32_t s, double *plan, double *extract,
                            double *again)
{
    pliant_arena arena = {0};
    pliant_capacitance capacitance = {0};
    pliant_capacitance_scratch scratch = {0};
    for (int pass = 0; pass < 2; pass++) {
        if (pass) require(pliant_arena_reserve(&arena, NULL), NULL);
        pliant_capacitance_lay_out(&arena, model, s, &capacitance);
        pliant_capacitance_scratch_lay_out(&arena, model, s, &scratch);
    }
    pliant_capacitance_scratch_begin(model, PLIANT_COMPLIANCE_STORED, &scratch);
    int32_t *vertices = malloc((size_t)s * sizeof *vertices);
    pliant_node *nodes = malloc((size_t)s * sizeof *nodes);
    double plans[101], extracts[101], agains[101];
    for (int r = 0; r < 101; r++) {
        choose_patch(model, r, s, vertices);
        for (int32_t i = 0; i < s; i++) nodes[i] = (pliant_node){model->finest_level, vertices[i]};
        const double begin = now_us();
        pliant_capacitance_plan(model, nodes, s, &scratch, &capacitance);
        const double planned = now_us();
        pliant_capacitance_extract(model, &capacitance, &scratch, capacitance.matrix);
        const double extracted = now_us();
        pliant_capacitance_extract(model, &capacitance, &scratch, capacitance.matrix);
        agains[r] = now_us() - extracted;
        extracts[r] = extracted - planned;
        plans[r] = planned - begin;
    }
    *plan = median(plans, 101);
    *extract = median(extracts, 101);
    *again = median(agains, 101);
    free(nodes);
    free(vertices);
    pliant_arena_release(&arena);
}

static double time_transform(const pliant_model *model)
{
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    const size_t bytes = 4 * ((size_t)domain->count + 1) * sizeof(float);
    float *g = aligned_alloc(64, (bytes + 63) / 64 * 64);
    double times[frame_count];
    for (int frame = 0; frame < frame_count; frame++) {
        memset(g, 0, bytes);
        const double begin = now_us();
        pliant_wavelet_inverse_online(domain->wavelet, model->finest_level, g);
        times[frame] = now_us() - begin;
    }
    free(g);
    return median(times, frame_count);
}

// Probes: chosen vertices, the same ones every frame and new ones every frame, against the surface.
static void time_queries(const pliant_model *model)
{
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    require(pliant_solver_create(model, NULL, &solver, &err), &err);
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    const pliant_node node = {model->finest_level, domain->nodes[domain->count / 2]};
    require(pliant_solver_displace(solver, node, (pliant_vec3){0, 0, -0.1f}), NULL);
    printf("\nchosen vertices, us      same ones   other ones every frame (scattered)\n");
    for (int32_t count = 1; count <= 128; count *= 2) {
        if (count > solver->query_capacity) break;
        double same[frame_count], other[frame_count];
        int32_t vertices[128];
        pliant_vec3 u[128];
        for (int kind = 0; kind < 2; kind++)
            for (int frame = 0; frame < frame_count; frame++) {
                for (int32_t i = 0; i < count; i++)
                    vertices[i] =
                        domain
                            ->nodes[((int64_t)i * 977 + (kind ? frame * 131 : 0)) % domain->count];
                require(pliant_solver_solve(solver, PLIANT_NEVER), NULL);
                const double begin = now_us();
                require(pliant_solver_displacements(solver, vertices, count, u), NULL);
                (kind ? other : same)[frame] = now_us() - begin;
            }
        printf("%6d %26.2f %12.2f\n", count, median(same, frame_count), median(other, frame_count));
    }
    pliant_solver_destroy(solver);
}

static int bench(const char *path);

int main(int argc, char **argv)
{
    // One thread for the baseline too, before OpenBLAS looks (it has as a rule looked by now: run
    // with OPENBLAS_NUM_THREADS=1 to be sure; we start ourselves again with it).
    if (!getenv("OPENBLAS_NUM_THREADS")) {
        setenv("OPENBLAS_NUM_THREADS", "1", 1);
        unsetenv("OPENBLAS_CORETYPE");
        execv("/proc/self/exe", argv);
    }
    if (argc < 2) return bench(NULL);
    for (int i = 1; i < argc; i++)
        if (bench(argv[i]) != 0) return 1;
    return 0;
}

// One model; NULL: the synthetic one.
static int bench(const char *path)
{
    char own_path[64] = "";
    if (!path) {
        snprintf(own_path, sizeof own_path, "/tmp/pliant_bench_solver_%d.h5", (int)getpid());
        printf("building a synthetic sphere of 2562 vertices\n");
        fflush(stdout);
        const char *eps = getenv("PLIANT_BENCH_EPS");
        check_write_synthetic_model(own_path, NULL, 4, eps ? atof(eps) : 0.05,
                                    pliant_wavelet_default(), CHECK_FREE_BLOCK);
        path = own_path;
    }
    pliant_model *model = NULL;
    pliant_error err = {""};
    require(pliant_model_open(path, &model, &err), &err);
    if (own_path[0]) unlink(own_path);
    const pliant_model_info info = pliant_model_describe(model);
    const int32_t m = info.free_count;
    const uint64_t nnz = model->greens[0][0][model->finest_level].offset[m];
    printf("%s: %d vertices, %d free, %d levels, factor %.1f, RMS %.3g, MAX %.3g, %.1f blocks a "
           "column\n",
           path == own_path ? "synthetic sphere" : path, info.vertex_count, m, info.level_count,
           info.factor, info.rms, info.max, (double)nnz / m);

    float *matrix = random_matrix(m);
    float *dense_u = malloc(3 * (size_t)m * sizeof *dense_u);
    pliant_vec3 *u = malloc((size_t)info.vertex_count * sizeof *u);
    if (!matrix || !dense_u || !u) return fprintf(stderr, "bench_solver: no memory\n"), 1;
    char *sweep = calloc(sweep_bytes, 1);
    if (!sweep) return fprintf(stderr, "bench_solver: no memory\n"), 1;
    const double bandwidth = read_bandwidth(40 * nnz), transform = time_transform(model);
    const double dense_bytes = 36.0 * m * m, float_bytes = 40.0 * (double)nnz;
    double half_bytes = 0;
    for (int32_t j = 0; j < m; j++) {
        const uint64_t *offset = model->greens[0][0][model->finest_level].offset + j;
        half_bytes += sizeof(pliant_compact_group) * (double)((offset[1] - offset[0] + 3) / 4);
    }
    printf(
        "stored blocks: %.2f MB of floats, %.2f MB of halves: %.0f and %.0f times fewer bytes than "
        "dense\n",
        1e-6 * float_bytes, 1e-6 * half_bytes, dense_bytes / float_bytes, dense_bytes / half_bytes);
    printf("transform %.2f us, packing and step (8) %.2f us; read bandwidth over the floats %.1f "
           "GB/s\n\n",
           transform, time_steps(model, 100, PLIANT_STORAGE_FLOAT, NULL, u).surface - transform,
           bandwidth * 1e-9);
    printf("       dense  |      sum of floats       | sum of halves | sum, transform, pack: "
           "found/goal, "
           "x dense | contact from |\n"
           "    s  sgemv  |   us  ns/block read-bound |   us ns/block |    float      |     half   "
           "   | "
           "cold    | caches  cold | step\n");
    step_times steps[size_count];
    for (int i = 0; i < size_count && sizes[i] <= m; i++) {
        const int32_t s = sizes[i];
        double dense[101];
        int32_t *columns = malloc((size_t)s * sizeof *columns);
        for (int frame = 0; frame < 101; frame++) {
            choose_patch(model, frame % patch_count, s, columns);
            for (int32_t j = 0; j < s; j++) columns[j] = model->position[columns[j]];
            dense[frame] = time_dense(m, matrix, columns, s, dense_u);
        }
        free(columns);
        const step_times t = steps[i] = time_steps(model, s, PLIANT_STORAGE_FLOAT, NULL, u);
        const step_times half = time_steps(model, s, PLIANT_STORAGE_HALF, NULL, u);
        const step_times cold = time_steps(model, s, PLIANT_STORAGE_FLOAT, sweep, u);
        const double full = t.sum + t.surface, half_full = half.sum + half.surface;
        const double baseline = median(dense, 101);
        printf("%5d %7.1f | %5.2f %8.2f %9.2f | %5.2f %7.2f | %4.1f/%-4.0f %4.1f | %4.1f/%-4.1f "
               "%4.1f | "
               "%4.0f/%-3.0f | %6.2f %6.1f | %5.1f\n",
               s, baseline, t.sum, 1e3 * t.sum / t.blocks, 40 * t.blocks / bandwidth * 1e6,
               half.sum, 1e3 * half.sum / half.blocks, full, float_goal[i], baseline / full,
               half_full, half_goal[i], baseline / half_full, cold.sum + cold.surface, cold_goal[i],
               t.contact, cold.contact, t.step);
    }
    free(sweep);
    free(matrix);
    printf("\nnew type, us: extraction (ns a block, first and again), all of it, against LAPACK\n"
           "    s     plan  extract  ns/block  again |  build | dgetrf  dgetrf+dgetri\n");
    for (int i = 0; i < size_count && sizes[i] <= m; i++) {
        const int32_t s = sizes[i];
        double plan, extract, again, factor, inverse;
        time_extraction(model, s, &plan, &extract, &again);
        time_lapack(s, &factor, &inverse);
        const double blocks = (double)s * s;
        printf("%5d %8.2f %8.1f %9.0f %6.0f | %6.0f | %6.0f %14.0f\n", s, plan, extract,
               1e3 * extract / blocks, 1e3 * again / blocks, steps[i].build, factor, inverse);
    }
    time_queries(model);
    free(dense_u);
    free(u);
    pliant_model_close(model);
    return 0;
}
