// histogram.h: a distribution of durations in fixed memory, whatever their number.
//
// Buckets are log-linear: every power of two is cut into 128 equal parts, so a percentile is off by
// at most half a bucket, 1/256 = 0.4% of its value; durations below 128 ns are kept exactly, and so
// are the count, the sum and the worst.
#pragma once

#include <stdint.h>

#define PLIANT_HISTOGRAM_PARTS        128                            // per power of two
#define PLIANT_HISTOGRAM_BUCKET_COUNT (57 * PLIANT_HISTOGRAM_PARTS)  // up to INT64_MAX

typedef struct pliant_histogram {
    int64_t count;  // durations added
    int64_t worst;  // ns
    double sum;     // ns
    uint64_t buckets[PLIANT_HISTOGRAM_BUCKET_COUNT];
} pliant_histogram;  // zeroed is empty

void pliant_histogram_add(pliant_histogram *histogram, int64_t ns);  // negative counts as 0
void pliant_histogram_merge(pliant_histogram *histogram, const pliant_histogram *other);
// The smallest duration that a share `rank` in (0, 1] of all durations does not exceed, ns; 0 when
// empty. Rank 1 is the worst, exactly.
double pliant_histogram_percentile(const pliant_histogram *histogram, double rank);
