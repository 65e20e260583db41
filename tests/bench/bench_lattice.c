// bench_lattice.c: ns per particle and step of lattice bodies, by phase, beside floor and baseline.
//
// Bodies are kept deformed: stirred once, neighbours change their distance by 0.2 to 0.35, rms, for
// ever if nothing damps them. A damped body is made a copy of an undamped one before each step,
// outside the measured time. Phases and sums are those of the fastest steps by the wall clock;
// "own" is the median of the thread's own time, which other processes disturb less: ratios and the
// paper's table are of these. Beside them, in the same run:
//     floor   what must move, once: x, v and rotations in and out, 24 bytes of constants, at the
//             speed of a copy of as many bytes; and the rotations alone
//     lists   sums over lists of particles instead (slow_lattice.h)
//     goal    what was aimed at before any of it was written
// With PLIANT_BENCH_SHORT set: small bodies and few steps.
#include "slow_lattice.h"

enum { PHASES = 5, STEPS_MOST = 101, CROWD = 150 };
#define DAMPING 0.1f

// What a particle's state and constants take, half of it to be copied: x, v and the quaternion are
// read and written, share, 1 / |R|, 1 / M and the offset are read.
#define FLOOR_BYTES (2 * 4 * (3 + 3 + 4) + 4 * 6)

typedef struct timing {
    double wall, cpu, phases[PHASES];  // ns per particle: plates, regions, goals, damping, move
} timing;

typedef struct subject {
    bench_shape shape;
    const char *what;
    int body_count;
    int32_t widths[6];  // up to a 0
    const char *goal, *wide_goal;
} subject;

// ---- Measuring ----

static void add_phases(const pliant_body *body, double *phases)
{
    const pliant_body_times *t = &body->times;
    const int64_t ns[PHASES] = {t->plates, t->regions, t->goals, t->damping, t->move};
    for (int i = 0; i < PHASES; i++) phases[i] += (double)ns[i];
}

static void step_all(pliant_body **bodies, int count, double *phases)
{
    for (int b = 0; b < count; b++) {
        bench_step(bodies[b]);
        add_phases(bodies[b], phases);
    }
}

static timing measure(const bench_lattice *lattice, int count, float damping, int32_t threads,
                      int is_short)
{
    static double cpus[STEPS_MOST];
    timing t = {.wall = INFINITY};
    for (int i = 0; i < PHASES; i++) t.phases[i] = INFINITY;
    pliant_body **bodies = bench_take((size_t)count, sizeof *bodies);
    pliant_body **sources = bench_take((size_t)count, sizeof *sources);
    for (int b = 0; b < count; b++) {
        bodies[b] = bench_body_create(lattice->lattice, damping, threads);
        if (damping > 0) sources[b] = bench_body_create(lattice->lattice, 0, threads);
        bench_stir(damping > 0 ? sources[b] : bodies[b], 4);
    }
    const double particles = (double)count * lattice->shape.particle_count;
    int steps = (int)(is_short ? 1e6 / particles : 3e6 / particles);
    steps = steps < 7 ? 7 : steps > STEPS_MOST ? STEPS_MOST : steps;
    for (int k = -1; k < steps; k++) {  // the first warms up
        for (int b = 0; sources[0] && b < count; b++) {
            bench_step(sources[b]);
            require(pliant_body_copy(bodies[b], sources[b]), NULL);
        }
        double phases[PHASES] = {0};
        const double wall = now_us(), cpu = bench_cpu_ns();
        step_all(bodies, count, phases);
        if (k < 0) continue;
        cpus[k] = (bench_cpu_ns() - cpu) / particles;
        t.wall = fmin(t.wall, 1e3 * (now_us() - wall) / particles);
        for (int i = 0; i < PHASES; i++) t.phases[i] = fmin(t.phases[i], phases[i] / particles);
    }
    t.cpu = median(cpus, steps);
    for (int b = 0; b < count; b++) {
        pliant_body_destroy(bodies[b]);
        pliant_body_destroy(sources[b]);
    }
    free(bodies);
    free(sources);
    return t;
}

// ---- Floors and baseline ----

// ns to copy half the floor's bytes of a particle, so many particles at a time.
static double measure_copy(double particles)
{
    const size_t size = (size_t)(particles * (FLOOR_BYTES / 2));
    const int repeats = 1 + (int)(2e6 / particles);
    char *from = bench_take(size, 1), *to = bench_take(size, 1);
    double runs[9];
    for (int run = 0; run < 9; run++) {
        const double start = bench_cpu_ns();
        for (int k = 0; k < repeats; k++) {
            memcpy(to, from, size);
            from[(size_t)k % size] = to[size / 2];  // so that no copy is for nothing
        }
        runs[run] = (bench_cpu_ns() - start) / (repeats * particles);
    }
    free(from);
    free(to);
    return median(runs, 9);
}

// ns per region to find its rotation at the strain that bodies have, from one 0.05 rad off or so.
static double measure_polar(void)
{
    enum { BLOCKS = 512, RUNS = 25 };
    float *a = bench_take(BLOCKS * 72, sizeof *a), *r = bench_take(BLOCKS * 72, sizeof *r);
    float *q = bench_take(BLOCKS * 32, sizeof *q);
    for (int k = 0; k < BLOCKS * 72; k++)
        a[k] = (k / 8 % 9 % 4 == 0 ? 1 : 0) + 0.15f * bench_random();
    double runs[RUNS];
    for (int run = 0; run < RUNS; run++) {
        for (int k = 0; k < BLOCKS * 32; k++) q[k] = k % 32 >= 24;
        const double start = bench_cpu_ns();
        pliant_polar_blocks(BLOCKS, a, q, r);
        runs[run] = (bench_cpu_ns() - start) / (8 * BLOCKS);
    }
    free(a);
    free(q);
    free(r);
    return median(runs, RUNS);
}

static double measure_lists(const bench_lattice *lattice)
{
    slow_lattice slow = slow_lattice_create(lattice, SLOW_LISTS);
    pliant_body *body = bench_body_create(lattice->lattice, 0, 1);
    bench_stir(body, 2);
    double runs[3];
    for (int k = 0; k < 3; k++) runs[k] = slow_step(&slow, body);
    pliant_body_destroy(body);
    slow_lattice_destroy(&slow);
    return median(runs, 3) / lattice->shape.particle_count;
}

// ---- The paper's table ----

// LSM, Table 1: ms per step on a 3.4 GHz Pentium IV.
static const struct {
    const char *name;
    int32_t particles, w;
    double ms;
    const char *ours;
    int is_damped;
} paper[] = {
    {"penguin", 150, 2, 0.28, "crowd", 0},
    {"buddha, solid", 57626, 1, 167.83, "ball45", 1},
    {"buddha, shell", 19959, 1, 48.47, "shell46", 1},
    {"infant", 2570, 2, 4.99, "infant", 1},
};
enum { PAPER_COUNT = sizeof paper / sizeof *paper };

typedef struct paper_row {
    int32_t particles;
    timing undamped, damped;
} paper_row;

static void print_paper(const paper_row *rows)
{
    printf(
        "\nThe paper's Table 1 (Pentium IV, 3.4 GHz) and bodies of the same size, one thread:\n");
    printf("%-14s %9s %9s %2s %9s %9s %6s %12s  %s\n", "", "particles", "ours", "w", "ms", "ours",
           "x", "ns/particle", "% plates, regions, goals, damping, move");
    for (int i = 0; i < PAPER_COUNT; i++) {
        if (rows[i].particles == 0) continue;
        const timing *t = paper[i].is_damped ? &rows[i].damped : &rows[i].undamped;
        double sum = 0;
        for (int p = 0; p < PHASES; p++) sum += t->phases[p];
        const double ms = 1e-6 * t->cpu * rows[i].particles;
        printf("%-14s %9d %9d %2d %9.2f %9.4f %6.0f %12.1f  ", paper[i].name, paper[i].particles,
               rows[i].particles, paper[i].w, paper[i].ms, ms, paper[i].ms / ms, t->cpu);
        for (int p = 0; p < PHASES; p++) printf(" %4.0f", 100 * t->phases[p] / sum);
        printf("%s\n", paper[i].is_damped ? "" : "  (undamped)");
    }
}

static void keep_for_paper(const subject *s, int32_t particles, int32_t w, const timing *undamped,
                           const timing *damped, paper_row *rows)
{
    for (int i = 0; i < PAPER_COUNT; i++)
        if (w == paper[i].w && strcmp(s->shape.name, paper[i].ours) == 0)
            rows[i] = (paper_row){particles, *undamped, *damped};
}

// ---- The table ----

static void print_row(int32_t w, int32_t threads, const timing *undamped, const timing *damped)
{
    printf("%3d %2d %7.1f %7.1f %7.1f %6.1f %8.1f", w, threads, undamped->phases[0],
           undamped->phases[1], undamped->phases[2], undamped->phases[4], undamped->wall);
    if (threads == 1) printf(" %7.1f", undamped->cpu);
    else printf(" %7s", "");
    printf(" %8.1f %8.1f", damped->phases[3], damped->wall);
    if (threads == 1) printf(" %7.1f", damped->cpu);
    else printf(" %7s", "");
}

static void report(const subject *s, double polar, int is_short, paper_row *rows)
{
    timing first = {0}, first_damped = {0};
    for (int i = 0; s->widths[i]; i++) {
        const int32_t w = s->widths[i];
        bench_lattice lattice = bench_lattice_create(&s->shape, w);
        const int32_t count = lattice.shape.particle_count;
        const double floor = measure_copy((double)count * s->body_count) + polar;
        if (i == 0)
            printf("\n%s: %d particles%s, %s; floor %.1f + %.1f ns\n"
                   "%3s %2s %7s %7s %7s %6s %8s %7s %8s %8s %7s %9s %9s %9s %8s %6s  %s\n",
                   s->shape.name, count, s->body_count > 1 ? " each" : "", s->what, floor - polar,
                   polar, "w", "t", "plates", "regions", "goals", "move", "undamped", "own",
                   "damping", "damped", "own", "/ floor", "/ w = 1", "/ one t", "lists", "x",
                   "goal");
        const timing undamped = measure(&lattice, s->body_count, 0, 1, is_short);
        const timing damped = measure(&lattice, s->body_count, DAMPING, 1, is_short);
        if (i == 0) first = undamped, first_damped = damped;
        keep_for_paper(s, count, w, &undamped, &damped, rows);
        const double lists = measure_lists(&lattice);
        print_row(w, 1, &undamped, &damped);
        printf(" %4.1f %4.1f %4.2f %4.2f %9s %8.0f %6.0f  %s\n", undamped.cpu / floor,
               damped.cpu / floor, undamped.cpu / first.cpu, damped.cpu / first_damped.cpu, "",
               lists, lists / undamped.cpu,
               w == 1   ? s->goal
               : w == 8 ? s->wide_goal
                        : "");
        fflush(stdout);
        if (s->body_count == 1 && count > 10000) {
            const timing two = measure(&lattice, 1, 0, 2, is_short);
            const timing two_damped = measure(&lattice, 1, DAMPING, 2, is_short);
            print_row(w, 2, &two, &two_damped);
            printf(" %9s %9s %4.2f %4.2f %15s  / one t 1.7\n", "", "", undamped.wall / two.wall,
                   damped.wall / two_damped.wall, "");
        }
        fflush(stdout);
        bench_lattice_destroy(&lattice);
    }
}

int main(void)
{
    static const char wide[] = "/ w = 1: 2";
    static const subject subjects[] = {
        {{"crowd", {4, 4, 5}, BENCH_BALL}, "150 solids in turn", CROWD, {1, 2, 3, 5, 8}, "", wide},
        {{"infant", {13, 14, 16}, BENCH_BALL}, "a solid", 1, {2}, "", ""},
        {{"shell46", {46, 46, 46}, BENCH_SHELL}, "a shell", 1, {1}, "", ""},
        {{"box38", {37, 37, 37}, BENCH_BOX}, "a box", 1, {1, 2, 3, 5, 8}, "15, damped 28", wide},
        {{"ball45", {45, 45, 45}, BENCH_BALL},
         "a solid ball",
         1,
         {1, 2, 3, 5, 8},
         "25, damped 45; dream 13, 24",
         wide},
        {{"box100", {99, 99, 99}, BENCH_BOX}, "a box", 1, {1, 3, 8}, "", wide},
    };
    const int is_short = getenv("PLIANT_BENCH_SHORT") != NULL;
    const double polar = measure_polar();
    paper_row rows[PAPER_COUNT] = {{0}};
    printf("ns per particle and step; t: threads; own: the thread's own time; ratios undamped, "
           "damped\n");
    for (size_t i = 0; i < sizeof subjects / sizeof *subjects; i++) {
        subject s = subjects[i];
        if (is_short && s.shape.across[0] > 90) continue;
        if (is_short && s.widths[0] == 1) s.widths[1] = 0;
        report(&s, polar, is_short, rows);
    }
    print_paper(rows);
    return 0;
}
