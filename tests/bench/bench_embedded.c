// bench_embedded.c: what a lattice's surface costs to carry, a vertex: places alone, with normals.
//
// One thread; medians of its own processor time. The bound is what the thread takes to read and
// write the bytes that must move, once, in order, over and over: per vertex its cell's place, a
// number, the normal at rest and the results, per cell its corners. Coordinates of corners are
// counted once a cell, though cells share them.
#include "bench.h"
#include "surfaces.h"
#include "synthetic_lattice.h"

#include "lattice/body.h"
#include "lattice/embedded.h"

#include <math.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { frame_count = 101 };

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

// Nanoseconds in which one thread reads and writes this much.
static double move_time(size_t read_bytes, size_t write_bytes)
{
    typedef float lanes __attribute__((vector_size(64)));
    const size_t reads = read_bytes / sizeof(lanes) + 1, writes = write_bytes / sizeof(lanes) + 1;
    lanes *from = aligned_alloc(64, reads * sizeof *from),
          *to = aligned_alloc(64, writes * sizeof *to);
    if (!from || !to) exit(1);
    memset(from, 0, reads * sizeof *from);
    memset(to, 0, writes * sizeof *to);
    double times[frame_count];
    volatile float sink = 0;
    for (int r = 0; r < frame_count; r++) {
        const double begin = now_ns();
        lanes sum[4] = {{0}};
        size_t w = 0;
        for (size_t i = 0; i < reads; i++) {
            sum[i % 4] += from[i];
            if (i * writes / reads >= w && w < writes) to[w++] = sum[0];
        }
        for (int k = 0; k < 4; k++) sink += sum[k][0];
        times[r] = now_ns() - begin;
    }
    (void)sink;
    free(to);
    free(from);
    return median(times, frame_count);
}

typedef enum work { POSITIONS, BOTH } work;

static double time_work(const pliant_body *body, work kind, pliant_vec3 *x, pliant_vec3 *normals)
{
    double times[frame_count];
    for (int frame = 0; frame < frame_count; frame++) {
        const double begin = now_ns();
        require(pliant_body_surface(body, x, kind == BOTH ? normals : NULL), NULL);
        times[frame] = now_ns() - begin;
    }
    return median(times, frame_count);
}

static void measure(const char *name, const check_lattice_def *def)
{
    char path[64];
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_lattice *lattice = NULL;
    pliant_body *body = NULL;
    check_lattice *source = check_lattice_create(def);
    snprintf(path, sizeof path, "/tmp/pliant_bench_embedded_%d.h5", (int)getpid());
    check_lattice_write(source, path);
    check_lattice_destroy(source);
    require(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    require(pliant_lattice_create(model, 0, &lattice, &err), &err);
    require(pliant_body_create(lattice, NULL, &body, &err), &err);
    const pliant_lattice_info info = pliant_lattice_describe(lattice);
    const size_t n = (size_t)info.vertex_count, cells = (size_t)lattice->embedded->cell_count;
    pliant_vec3 *x = calloc(n, sizeof *x), *normals = calloc(n, sizeof *normals);
    if (!x || !normals) exit(1);
    printf("%-8s %9d %9zu %9.1f", name, (int)info.particle_count, n, (double)n / (double)cells);
    for (work kind = POSITIONS; kind <= BOTH; kind++) {
        const size_t reads = n * (kind == BOTH ? 36 : 20) + cells * (8 * 4 + 4 + 8 * 12);
        const size_t writes = n * (kind == BOTH ? 24 : 12);
        const double taken = time_work(body, kind, x, normals) / (double)n;
        const double bound = move_time(reads, writes) / (double)n;
        printf("   %8.2f %8.2f %6.1fx", taken, bound, taken / bound);
    }
    printf("\n");
    free(normals);
    free(x);
    pliant_body_destroy(body);
    pliant_lattice_destroy(lattice);
    pliant_model_close(model);
}

// A sphere of 10 4^levels + 2 vertices in so many cells across.
static void measure_sphere(const char *name, int32_t levels, int32_t across)
{
    check_surface sphere = check_sphere(levels);
    check_lattice_def def = {.half_width = 1, .cell_size = 2.0 / across, .mesh = sphere.mesh};
    int32_t *cells = check_ball_cells(across, &def.cell_count, def.origin);
    def.cells = cells;
    measure(name, &def);
    free(cells);
    check_surface_destroy(&sphere);
}

int main(void)
{
    printf("carried surface, ns a vertex     vertices    places                       places and "
           "normals\n");
    printf("%-8s %9s %9s %9s   %8s %8s %7s   %8s %8s %7s\n", "", "particles", "vertices", "a cell",
           "taken", "bound", "", "taken", "bound", "");
    measure("cube", &(check_lattice_def){.shape = CHECK_CELLS_CUBE, .size = 1, .half_width = 1});
    measure("ball", &(check_lattice_def){.shape = CHECK_CELLS_BALL, .size = 48, .half_width = 1});
    measure("sponge",
            &(check_lattice_def){.shape = CHECK_CELLS_SPONGE, .size = 30, .half_width = 1});
    measure_sphere("penguin", 4, 5);
    measure_sphere("sphere", 6, 20);
    measure_sphere("statue", 6, 45);
    measure_sphere("fine", 5, 45);
    measure_sphere("huge", 8, 100);
    return 0;
}
