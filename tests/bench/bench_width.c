// bench_width.c: cost of a step against the half-width w (LSM, Figure 4): lists, LSM-3, the
// library.
//
//     bench_width              # a table
//     bench_width FILE.csv     # and a file for scripts/plot-fastlsm
//
// Undamped steps of one thread, its own clock, medians; slow_lattice.h says what is compared with.
// With PLIANT_BENCH_SHORT set some widths are left out.
#include "slow_lattice.h"

enum { STEPS = 15, SLOW_STEPS = 3, WIDEST = 10 };

static double measure_slow(const bench_lattice *lattice, slow_way way, pliant_body *body,
                           double *difference)
{
    slow_lattice slow = slow_lattice_create(lattice, way);
    double times[SLOW_STEPS];
    for (int k = 0; k < SLOW_STEPS; k++) {
        times[k] = slow_step(&slow, body);
        bench_step(body);
        // The origin is the step's own choice; the first of these had none.
        if (k == SLOW_STEPS - 1) *difference = slow_difference(&slow, body);
    }
    if (slow.chosen_count < slow.count) *difference = NAN;
    slow_lattice_destroy(&slow);
    return median(times, SLOW_STEPS) / lattice->shape.particle_count;
}

static double measure(pliant_body *body)
{
    double times[STEPS];
    for (int k = 0; k < STEPS; k++) {
        const double start = bench_cpu_ns();
        bench_step(body);
        times[k] = bench_cpu_ns() - start;
    }
    return median(times, STEPS) / body->lattice->particle_count;
}

static void print_difference(double difference)
{
    if (isnan(difference)) printf(" %10s", "-");
    else printf(" %10.0e", difference);
}

int main(int argc, char **argv)
{
    static const bench_shape shapes[] = {
        {"box38", {37, 37, 37}, BENCH_BOX},
        {"ball45", {45, 45, 45}, BENCH_BALL},
    };
    FILE *csv = argc > 1 ? fopen(argv[1], "w") : NULL;
    if (argc > 1 && !csv) {
        fprintf(stderr, "bench_width: %s: %s\n", argv[1], strerror(errno));
        return 1;
    }
    if (csv) fprintf(csv, "lattice,particles,w,lists_ns,planes_ns,library_ns\n");
    const int is_short = getenv("PLIANT_BENCH_SHORT") != NULL;
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        double unit = 0;
        for (int32_t w = 1; w <= WIDEST; w++) {
            if (is_short && w != 1 && w != 4) continue;
            bench_lattice lattice = bench_lattice_create(&shapes[i], w);
            pliant_body *body = bench_body_create(lattice.lattice, 0, 1);
            bench_stir(body, 4);
            const int32_t count = lattice.shape.particle_count;
            double lists_off, planes_off;
            const double library = measure(body);
            const double lists = measure_slow(&lattice, SLOW_LISTS, body, &lists_off);
            const double planes = measure_slow(&lattice, SLOW_PLANES, body, &planes_off);
            if (w == 1) {
                unit = library;
                printf("%s, %d particles: ns per particle and step, and in units of w = 1\n",
                       shapes[i].name, count);
                printf("%4s %18s %18s %18s %10s %10s\n", "w", "lists", "bars, plates: 2w+1",
                       "library", "lists off", "planes off");
            }
            printf("%4d %10.0f %7.1f %10.0f %7.1f %10.1f %7.2f", w, lists, lists / unit, planes,
                   planes / unit, library, library / unit);
            print_difference(lists_off);
            print_difference(shapes[i].kind == BENCH_BOX ? planes_off : NAN);
            printf("\n");
            fflush(stdout);
            if (csv)
                fprintf(csv, "%s,%d,%d,%.1f,%.1f,%.2f\n", shapes[i].name, count, w, lists, planes,
                        library);
            pliant_body_destroy(body);
            bench_lattice_destroy(&lattice);
        }
    }
    if (csv && fclose(csv) != 0) {
        fprintf(stderr, "bench_width: %s: %s\n", argv[1], strerror(errno));
        return 1;
    }
    return 0;
}
