// lattices.h: lattices of the size of the paper's and others, made in memory, and bodies that stay
// deformed while they are measured.
#pragma once

#include "bench.h"

#include "lattice/body.h"

#include <math.h>
#include <string.h>
#include <time.h>

#define BENCH_TIME_STEP 0.01f  // s
#define BENCH_STRAIN    0.3    // of neighbours, rms, that bodies are kept at

typedef struct bench_shape {
    const char *name;
    int32_t across[3];  // cells
    enum { BENCH_BOX, BENCH_BALL, BENCH_SHELL } kind;
} bench_shape;

typedef struct bench_lattice {
    pliant_lattice_shape shape;
    int32_t *cells, *particles;
    pliant_regions *regions;
    pliant_lattice *lattice;
} bench_lattice;

static inline void *bench_take(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (memory) return memory;
    fprintf(stderr, "%s: no memory\n", program_invocation_short_name);
    exit(1);
}

// Least and largest squared distance of a cell's points from the ellipsoid's middle, with its half
// axes for units.
static inline void bench_distances(const int32_t across[3], const int32_t cell[3], double *nearest,
                                   double *farthest)
{
    *nearest = *farthest = 0;
    for (int c = 0; c < 3; c++) {
        const double low = -1 + 2.0 * cell[c] / across[c], high = low + 2.0 / across[c];
        *nearest += low > 0 ? low * low : high < 0 ? high * high : 0;
        *farthest += fmax(low * low, high * high);
    }
}

// The cells of a box, those that an ellipsoid reaches into, or those that its surface does.
static inline bench_lattice bench_lattice_create(const bench_shape *how, int32_t half_width)
{
    const int32_t *n = how->across;
    bench_lattice l = {.cells = bench_take(3 * (size_t)n[0] * n[1] * n[2], sizeof *l.cells)};
    int32_t count = 0;
    for (int32_t z = 0; z < n[2]; z++)
        for (int32_t y = 0; y < n[1]; y++)
            for (int32_t x = 0; x < n[0]; x++) {
                const int32_t cell[3] = {x, y, z};
                double nearest, farthest;
                bench_distances(n, cell, &nearest, &farthest);
                if (how->kind != BENCH_BOX && nearest > 1) continue;
                if (how->kind == BENCH_SHELL && farthest < 1) continue;
                memcpy(l.cells + 3 * (size_t)count++, cell, sizeof cell);
            }
    l.particles = bench_take(24 * (size_t)count, sizeof *l.particles);
    l.shape = (pliant_lattice_shape){
        .dims = {n[0] + 1, n[1] + 1, n[2] + 1},
        .particle_count = pliant_lattice_particles(count, l.cells, l.particles),
        .cell_count = count,
        .particles = l.particles,
        .cells = l.cells,
    };
    float *mass = bench_take((size_t)l.shape.particle_count, sizeof *mass);
    for (int32_t p = 0; p < l.shape.particle_count; p++) mass[p] = 1;
    pliant_error err = {""};
    require(pliant_regions_create(&l.shape, half_width, &l.regions, &err), &err);
    const pliant_lattice_def def = {
        .shape = l.shape,
        .mass = mass,
        .regions = l.regions,
        .cell_size = 0.01,
        .component_count = 1,
        .is_shell = how->kind == BENCH_SHELL,
    };
    require(pliant_lattice_build(&def, &l.lattice, &err), &err);
    free(mass);
    return l;
}

static inline void bench_lattice_destroy(bench_lattice *l)
{
    pliant_lattice_destroy(l->lattice);
    pliant_regions_destroy(l->regions);
    free(l->particles);
    free(l->cells);
}

static inline pliant_body *bench_body_create(const pliant_lattice *lattice, float damping,
                                             int32_t threads)
{
    pliant_body_def def = pliant_body_default();
    def.damping = damping;
    def.thread_count = threads;
    pliant_body *body;
    pliant_error err = {""};
    require(pliant_body_create(lattice, &def, &body, &err), &err);
    return body;
}

static inline float bench_random(void)  // in (-1, 1)
{
    static uint64_t state = 12345;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (float)(int32_t)(state >> 32) * 0x1p-31f;
}

// Rms of |x_j - x_i| / cell size - 1 over neighbours along x.
static inline double bench_strain(const pliant_body *body)
{
    const pliant_lattice *lattice = body->lattice;
    double sum = 0;
    int32_t count = 0;
    for (int32_t p = 0; p + 1 < lattice->particle_count; p++) {
        const int32_t *at = lattice->places + 3 * (size_t)p;
        if (at[3] != at[0] + 1 || at[4] != at[1] || at[5] != at[2]) continue;
        const pliant_vec3 a = pliant_body_get(body->x, lattice->slot[p]),
                          b = pliant_body_get(body->x, lattice->slot[p + 1]);
        const double x = b.x - a.x, y = b.y - a.y, z = b.z - a.z;
        const double strain = sqrt(x * x + y * y + z * z) / (double)lattice->cell_size - 1;
        sum += strain * strain;
        count++;
    }
    return count ? sqrt(sum / count) : 0;
}

// Push every particle by so many cells a step, at random.
static inline void bench_push(pliant_body *body, double cells)
{
    const pliant_lattice *lattice = body->lattice;
    const float scale = (float)cells * lattice->cell_size / BENCH_TIME_STEP;
    for (int32_t p = 0; p < lattice->particle_count; p++)
        for (int c = 0; c < 3; c++)
            body->v[lattice->slot[p] + PLIANT_LANES * c] += scale * bench_random();
}

static inline void bench_step(pliant_body *body)
{
    require(pliant_body_step(body, BENCH_TIME_STEP), NULL);
}

// Deform a body and let it go some steps, so that rotations have something to start from.
static inline void bench_stir(pliant_body *body, int steps)
{
    const pliant_lattice *lattice = body->lattice;
    const float scale = 0.3f * lattice->cell_size;
    for (int32_t p = 0; p < lattice->particle_count; p++)
        for (int c = 0; c < 3; c++)
            body->x[lattice->slot[p] + PLIANT_LANES * c] += scale * bench_random();
    bench_push(body, 0.3);
    for (int k = 0; k < steps; k++) bench_step(body);
}

static inline double bench_cpu_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}
