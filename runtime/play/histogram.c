// histogram.c: a distribution of durations in fixed memory, whatever their number.
//
// This follows: G. Tene, HdrHistogram, 2012 (the log-linear layout).
#include "histogram.h"

#include <math.h>

enum { PART_BITS = 7 };  // 2^7 = PLIANT_HISTOGRAM_PARTS
_Static_assert(1 << PART_BITS == PLIANT_HISTOGRAM_PARTS, "parts are a power of two");

// A value of b + PART_BITS + 1 bits, b >= 0, keeps its top PART_BITS + 1 bits: bucket
// (b + 1) * parts + the PART_BITS bits below the leading one. Smaller values are their own bucket.
static int32_t bucket_of(int64_t ns)
{
    const uint64_t value = (uint64_t)ns;
    if (value < PLIANT_HISTOGRAM_PARTS) return (int32_t)value;
    const int shift = 63 - PART_BITS - __builtin_clzll(value);
    return (shift + 1) * PLIANT_HISTOGRAM_PARTS +
           (int32_t)((value >> shift) - PLIANT_HISTOGRAM_PARTS);
}

static double middle_of(int32_t bucket)
{
    if (bucket < PLIANT_HISTOGRAM_PARTS) return bucket;
    const int shift = bucket / PLIANT_HISTOGRAM_PARTS - 1;
    const double low = PLIANT_HISTOGRAM_PARTS + bucket % PLIANT_HISTOGRAM_PARTS;
    // The bucket holds the integers low * 2^shift .. (low + 1) * 2^shift - 1.
    return ldexp(low, shift) + (ldexp(1, shift) - 1) / 2;
}

void pliant_histogram_add(pliant_histogram *histogram, int64_t ns)
{
    if (ns < 0) ns = 0;
    histogram->count++;
    histogram->sum += (double)ns;
    if (ns > histogram->worst) histogram->worst = ns;
    histogram->buckets[bucket_of(ns)]++;
}

void pliant_histogram_merge(pliant_histogram *histogram, const pliant_histogram *other)
{
    histogram->count += other->count;
    histogram->sum += other->sum;
    if (other->worst > histogram->worst) histogram->worst = other->worst;
    for (int32_t b = 0; b < PLIANT_HISTOGRAM_BUCKET_COUNT; b++)
        histogram->buckets[b] += other->buckets[b];
}

double pliant_histogram_percentile(const pliant_histogram *histogram, double rank)
{
    if (histogram->count == 0) return 0;
    const double wanted = ceil(rank * (double)histogram->count);
    if (wanted >= (double)histogram->count) return (double)histogram->worst;
    double below = 0;
    for (int32_t b = 0; b < PLIANT_HISTOGRAM_BUCKET_COUNT; b++) {
        below += (double)histogram->buckets[b];
        if (below >= wanted) return fmin(middle_of(b), (double)histogram->worst);
    }
    return (double)histogram->worst;
}
