// bench_precompute.c: a full L4 model on two ranks against LAPACK's own time for the same solves.
//
// Baseline: dgetrf and dgetrs of a random matrix of the same size with as many right-hand sides, in
// plain LAPACK on two threads, measured in the same run before and after the program.
#include "command.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

extern void dgetrf_(const int *m, const int *n, double *a, const int *lda, int *pivots, int *info);
extern void dgetrs_(const char *trans, const int *n, const int *nrhs, const double *a, const int *lda,
                    const int *pivots, double *b, const int *ldb, int *info);

static const char model_options[] = "--subdivide 4 --fixed 'z<0.027' --young 50000 --poisson 0.4 --density 1000";
enum { threads = 2 };

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

typedef struct baseline {
    double factor, solve;
} baseline;

static baseline lapack(int n, int right_count)
{
    double *a = malloc((size_t)n * (size_t)n * sizeof *a);
    double *b = malloc((size_t)n * (size_t)right_count * sizeof *b);
    int *pivots = malloc((size_t)n * sizeof *pivots), info;
    if (!a || !b || !pivots) {
        fprintf(stderr, "no memory for a matrix of %d\n", n);
        exit(1);
    }
    check_random random = {12345};
    for (size_t i = 0; i < (size_t)n * (size_t)n; i++) a[i] = check_random_next(&random) - 0.5;
    for (int i = 0; i < n; i++) a[(size_t)i * (size_t)n + (size_t)i] += 100;
    for (size_t i = 0; i < (size_t)n * (size_t)right_count; i++) b[i] = (double)(i % 17);
    baseline t;
    t.factor = seconds();
    dgetrf_(&n, &n, a, &n, pivots, &info);
    t.factor = seconds() - t.factor;
    t.solve = seconds();
    dgetrs_("N", &n, &right_count, a, &n, pivots, b, &n, &info);
    t.solve = seconds() - t.solve;
    free(pivots);
    free(b);
    free(a);
    return t;
}

static double number(const char *text, const char *key)
{
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *found = strstr(text, quoted);
    return found ? strtod(found + strlen(quoted), NULL) : 0;
}

int main(void)
{
    void (*set_threads)(int) = (void (*)(int))(uintptr_t)dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
    if (set_threads) set_threads(threads);
    else printf("not OpenBLAS: the baseline runs on however many threads its LAPACK takes\n");

    static check_command c;
    const double begin = seconds();
    check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute --json --force %s scripts/sample/whale.obj -o %s/bench.h5",
              check_build(), model_options, check_folder());
    const double wall = seconds() - begin;
    if (c.status != 0) {
        fprintf(stderr, "%s", c.errors);
        return 1;
    }
    const int n = 3 * (int)number(c.output, "vertices"), right_count = 3 * (int)number(c.output, "free") + 3;
    const baseline t = lapack(n, right_count);
    const double base = t.factor + t.solve, flops_factor = 2.0 / 3 * n * (double)n * n,
                 flops_solve = 2.0 * n * (double)n * right_count;
    printf("pliant-precompute, %d unknowns, %d right-hand sides, 2 ranks (factor %.1f, RMS %.4f, MAX %.4f)\n", n,
           right_count, number(c.output, "factor"), number(c.output, "rms"), number(c.output, "max"));
    printf("  LAPACK, %d threads    LU %.2f s (%.0f GFLOP/s), solves %.2f s (%.0f GFLOP/s): baseline %.2f s\n", threads,
           t.factor, flops_factor / t.factor / 1e9, t.solve, flops_solve / t.solve / 1e9, base);
    // The last "factor" of the summary is the phase's; print the phases as they come.
    const char *phases = strstr(c.output, "\"seconds\"");
    static const char *const names[] = {"read", "assemble", "factor", "solve", "transform", "compress", "write"};
    for (size_t i = 0; phases && i < sizeof names / sizeof *names; i++)
        printf("  %-10s %6.2f s   %5.1f%% of the baseline\n", names[i], number(phases, names[i]),
               100 * number(phases, names[i]) / base);
    printf("  whole program, start to end: %.2f s, %.2f times the baseline (goal 1.6)\n", wall, wall / base);
    return 0;
}
