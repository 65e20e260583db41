// bench.h: what the benchmarks of the runtime share: a clock, a median, and an end with a reason.
#pragma once

#include "pliant/pliant.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

static inline double now_us(void)
{
    return 1e-3 * (double)pliant_clock_ns();
}

static inline int bench_compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Sorts them.
static inline double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, bench_compare);
    return values[count / 2];
}

static inline void require(pliant_status status, const pliant_error *err)
{
    if (status >= 0) return;
    fprintf(stderr, "%s: %s: %s\n", program_invocation_short_name, pliant_status_name(status),
            err ? err->text : "");
    exit(1);
}
