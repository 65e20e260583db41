// bench_detail.c: what a detailed surface costs, and how far its contacts are from where they
// should be (GF 9.2).
//
// usage: bench_detail [MODEL.h5 ...]      default: a synthetic sphere, 642 vertices, 10242 of
// detail
//
// One thread; medians. The bound is what one thread reads of the same amount of memory in the same
// run: weights, columns, shape at rest, once. Warm: nothing else ran in between; cold: 16 MB were
// read, more than a core's own caches.
#include "bench.h"
#include "synthetic_model.h"

#include "detail.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

enum { frame_count = 101, sweep_bytes = 16 << 20, patch_step = 11, size_count = 4 };
static const int32_t sizes[size_count] = {1, 7, 30, 100};

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

// Nanoseconds in which one thread reads this much, over and over.
static double read_time(size_t bytes)
{
    typedef float lanes __attribute__((vector_size(64), aligned(4)));
    const size_t count = bytes / sizeof(float) / 64 * 64;
    float *buffer = malloc(count * sizeof *buffer + 64);
    for (size_t i = 0; i < count; i++) buffer[i] = 1;
    double times[frame_count];
    volatile float sink = 0;
    for (int r = 0; r < frame_count; r++) {
        const double begin = now_ns();
        lanes a = {0}, b = {0}, c = {0}, d = {0};
        for (size_t i = 0; i < count; i += 64) {
            a += *(const lanes *)(buffer + i);
            b += *(const lanes *)(buffer + i + 16);
            c += *(const lanes *)(buffer + i + 32);
            d += *(const lanes *)(buffer + i + 48);
        }
        a += b + c + d;
        sink += a[0];
        times[r] = now_ns() - begin;
    }
    (void)sink;
    free(buffer);
    return median(times, frame_count);
}

typedef struct buffers {
    pliant_vec3 *u, *positions, *normals;
    char *sweep;
} buffers;

typedef enum work { POSITIONS, BOTH, POINTS, POINTS_BOTH } work;

// Nanoseconds a vertex. Points: 64 vertices scattered over the surface.
static double time_work(const pliant_detail *detail, work kind, int cold, const buffers *b)
{
    const pliant_detail_info info = pliant_detail_describe(detail);
    int32_t vertices[64];
    for (int i = 0; i < 64; i++) vertices[i] = (int32_t)((int64_t)info.vertex_count * i / 64);
    double times[frame_count];
    volatile char sink = 0;
    for (int frame = 0; frame < frame_count; frame++) {
        for (size_t i = 0; cold && i < sweep_bytes; i += 64) sink += b->sweep[i];
        pliant_vec3 *normals = kind == BOTH || kind == POINTS_BOTH ? b->normals : NULL;
        const double begin = now_ns();
        require(kind < POINTS
                    ? pliant_detail_evaluate(detail, b->u, b->positions, normals)
                    : pliant_detail_points(detail, b->u, vertices, 64, b->positions, normals),
                NULL);
        times[frame] = (now_ns() - begin) / (kind < POINTS ? info.vertex_count : 64);
    }
    (void)sink;
    return median(times, frame_count);
}

static void time_levels(const pliant_model *model, const buffers *b)
{
    const pliant_model_info info = pliant_model_describe(model);
    printf("                        bytes  rows    read    ns a vertex: positions  with normals  "
           "64 points  with normals  create\n"
           "  level  control  vertex  longest   bound      warm   cold    warm   cold\n");
    for (int32_t level = info.level_count - 1; level >= 0; level--) {
        pliant_detail *detail = NULL;
        pliant_error err = {""};
        const double begin = now_ns();
        require(pliant_detail_create(model, level, &detail, &err), &err);
        const double created = now_ns() - begin;
        const double n = info.detail_vertex_count;
        const size_t entries = detail->offset[info.detail_vertex_count];
        // Weights and columns, rest, offsets; u comes from the first-level cache.
        const double bytes = ((double)entries * 16 + n * (48 + 8)) / n;
        size_t longest = 0;
        for (int32_t v = 0; v < info.detail_vertex_count; v++)
            if (detail->offset[v + 1] - detail->offset[v] > longest)
                longest = detail->offset[v + 1] - detail->offset[v];
        printf("%7d %8d %7.0f %8zu %7.1f %9.1f %6.1f %7.1f %6.1f %10.1f %12.1f %6.0f ms\n", level,
               pliant_detail_describe(detail).control_count, bytes, longest,
               read_time((size_t)(bytes * n)) / n, time_work(detail, POSITIONS, 0, b),
               time_work(detail, POSITIONS, 1, b), time_work(detail, BOTH, 0, b),
               time_work(detail, BOTH, 1, b), time_work(detail, POINTS, 0, b),
               time_work(detail, POINTS_BOTH, 0, b), created * 1e-6);
        pliant_detail_destroy(detail);
    }
}

// ---- Exactness of contacts ----

typedef struct neighbour {
    double square_distance;
    int32_t vertex;
} neighbour;

static int by_distance(const void *a, const void *b)
{
    const neighbour *x = a, *y = b;
    if (x->square_distance != y->square_distance)
        return x->square_distance < y->square_distance ? -1 : 1;
    return (x->vertex > y->vertex) - (x->vertex < y->vertex);
}

// Patches of the s free vertices nearest to a free one are pushed in together by a tenth of an
// edge: how much of that does the detail do at these vertices?
static void measure_contacts(const pliant_model *model, const buffers *b)
{
    const pliant_model_info info = pliant_model_describe(model);
    const double *x = pliant_model_positions(model);
    pliant_solver_def def = pliant_solver_default(model);
    def.constraint_capacity = sizes[size_count - 1];
    pliant_solver *solver = NULL;
    pliant_detail *detail = NULL;
    pliant_error err = {""};
    require(pliant_solver_create(model, &def, &solver, &err), &err);
    require(pliant_detail_create(model, info.level_count - 1, &detail, &err), &err);
    neighbour *near = malloc((size_t)info.vertex_count * sizeof *near);
    int32_t *free_vertices = malloc((size_t)info.vertex_count * sizeof *free_vertices), count = 0;
    pliant_vec3 *rest = malloc((size_t)info.detail_vertex_count * sizeof *rest);
    for (int32_t v = 0; v < info.vertex_count; v++)
        if (pliant_model_is_free(model, v) == 1) free_vertices[count++] = v;
    require(pliant_detail_evaluate(detail, NULL, rest, b->normals), NULL);
    printf("  prescribed displacements, followed by the detail: mean, least; centre of the patch: "
           "mean, least\n");
    for (int k = 0; k < size_count && sizes[k] <= count; k++) {
        double sum = 0, least = 9, centre_sum = 0, centre_least = 9;
        int32_t patches = 0;
        for (int32_t p = 0; p < count; p += patch_step, patches++) {
            const double *c = x + 3 * (size_t)free_vertices[p];
            for (int32_t i = 0; i < count; i++) {
                const double *y = x + 3 * (size_t)free_vertices[i];
                near[i] =
                    (neighbour){pow(y[0] - c[0], 2) + pow(y[1] - c[1], 2) + pow(y[2] - c[2], 2),
                                free_vertices[i]};
            }
            qsort(near, (size_t)count, sizeof *near, by_distance);
            const pliant_vec3 n = b->normals[free_vertices[p]];
            const float depth = -0.1f * (float)sqrt(near[1].square_distance);
            const pliant_vec3 push = {n.x * depth, n.y * depth, n.z * depth};
            pliant_solver_release_all(solver);
            for (int32_t i = 0; i < sizes[k]; i++)
                require(pliant_solver_displace(
                            solver, (pliant_node){info.level_count - 1, near[i].vertex}, push),
                        NULL);
            require(pliant_solver_solve(solver, PLIANT_NEVER), NULL);
            require(pliant_solver_surface(solver, info.level_count - 1, b->u), NULL);
            require(pliant_detail_evaluate(detail, b->u, b->positions, NULL), NULL);
            double mean = 0;
            for (int32_t i = 0; i < sizes[k]; i++) {
                const int32_t v = near[i].vertex;
                const double done = ((double)(b->positions[v].x - rest[v].x) * (double)n.x +
                                     (double)(b->positions[v].y - rest[v].y) * (double)n.y +
                                     (double)(b->positions[v].z - rest[v].z) * (double)n.z) /
                                    (double)depth;
                mean += done / sizes[k];
                least = fmin(least, done);
                if (i > 0) continue;
                centre_sum += done;
                centre_least = fmin(centre_least, done);
            }
            sum += mean;
        }
        printf("    s = %3d: %3.0f%%, %3.0f%%; %3.0f%%, %3.0f%%   (%d patches)\n", sizes[k],
               100 * sum / patches, 100 * least, 100 * centre_sum / patches, 100 * centre_least,
               patches);
    }
    free(rest);
    free(free_vertices);
    free(near);
    pliant_detail_destroy(detail);
    pliant_solver_destroy(solver);
}

static void bench(const char *path)
{
    pliant_model *model = NULL;
    pliant_error err = {""};
    require(pliant_model_open(path, &model, &err), &err);
    const pliant_model_info info = pliant_model_describe(model);
    printf("%s: %d vertices, ", path, info.vertex_count);
    if (info.detail_steps == 0) {
        printf("no detail\n");
        pliant_model_close(model);
        return;
    }
    printf("%d of detail\n", info.detail_vertex_count);
    const size_t n = (size_t)info.detail_vertex_count;
    buffers b = {calloc(n, sizeof *b.u), calloc(n, sizeof *b.positions),
                 calloc(n, sizeof *b.normals), calloc(sweep_bytes, 1)};
    for (int32_t v = 0; v < info.vertex_count; v++)
        b.u[v] = (pliant_vec3){1e-4f * (float)(v % 7), 1e-4f * (float)(v % 5), 0};
    time_levels(model, &b);
    measure_contacts(model, &b);
    free(b.sweep);
    free(b.normals);
    free(b.positions);
    free(b.u);
    pliant_model_close(model);
}

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) bench(argv[i]);
    if (argc > 1) return 0;
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_bench_detail_%d.h5", (int)getpid());
    check_synthetic *body = check_synthetic_create(&(check_synthetic_def){
        .levels = 3, .wavelet = pliant_wavelet_default(), .blocks = CHECK_FREE_BLOCK});
    check_synthetic_roughen(body, 2);
    check_synthetic_write(body, path);
    check_synthetic_destroy(body);
    bench(path);
    unlink(path);
    return 0;
}
