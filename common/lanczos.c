// lanczos.c: the smallest and the largest eigenvalue of a symmetric operator known by what it does.
//
// This follows: C. Lanczos, J. Res. Nat. Bur. Standards 45, 1950; C. C. Paige, Accuracy and
// effectiveness of the Lanczos algorithm, Linear Algebra Appl. 34, 1980; J. Cullum and R. Willoughby,
// Lanczos Algorithms, Birkhaeuser, 1985.
#include "pliant/lanczos.h"

#include "pliant/arena.h"
#include "pliant/error.h"

#include <float.h>
#include <math.h>
#include <string.h>

// Looks at the eigenvalues are a few hundred operations a step: worth one after every eighth more
// steps, and the first when there is something to see.
static const int32_t first_look = 16, looks_per_doubling = 8;

typedef struct work {
    pliant_arena arena;
    double *previous, *current, *image, *spare;  // [n]
    double *diagonal, *side;  // [step_capacity]: T; side[i] couples i and i + 1
    double *pivot;            // [step_capacity]
} work;

static void lay_out(const pliant_lanczos_def *def, work *w)
{
    PLIANT_TAKE(&w->arena, w->previous, def->n);
    PLIANT_TAKE(&w->arena, w->current, def->n);
    PLIANT_TAKE(&w->arena, w->image, def->n);
    PLIANT_TAKE(&w->arena, w->spare, def->n);
    PLIANT_TAKE(&w->arena, w->diagonal, def->step_capacity);
    PLIANT_TAKE(&w->arena, w->side, def->step_capacity);
    PLIANT_TAKE(&w->arena, w->pivot, def->step_capacity);
}

static double dot(const double *x, const double *y, int32_t n)
{
    double sum = 0;
    for (int32_t i = 0; i < n; i++) sum += x[i] * y[i];
    return sum;
}

static void scale(double factor, int32_t n, double *x)
{
    for (int32_t i = 0; i < n; i++) x[i] *= factor;
}

// A unit vector that leans on no eigenvector: uniform numbers in [-1, 1) (splitmix64; Steele, Lea,
// Flood 2014).
static void start(int32_t n, double *x)
{
    uint64_t state = 0x9E3779B97F4A7C15ull;
    for (int32_t i = 0; i < n; i++) {
        uint64_t z = state += 0x9E3779B97F4A7C15ull;
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9ull;
        z = (z ^ z >> 27) * 0x94D049BB133111EBull;
        x[i] = (double)((z ^ z >> 31) >> 11) * 0x1p-52 - 1;
    }
    scale(1 / sqrt(dot(x, x, n)), n, x);
}

// ---- The tridiagonal matrix ----
//
// Largest eigenvalues are the smallest of -T, so all that follows looks at sign T.

// How many eigenvalues of sign T are under `bound`: negative pivots of sign T - bound I (Sylvester).
static int32_t count_below(const work *w, int32_t k, double sign, double bound)
{
    int32_t count = 0;
    double pivot = 1;
    for (int32_t i = 0; i < k; i++) {
        const double side = i > 0 ? w->side[i - 1] : 0;
        pivot = sign * w->diagonal[i] - bound - side * side / pivot;
        if (fabs(pivot) < DBL_MIN) pivot = -DBL_MIN;
        count += pivot < 0;
    }
    return count;
}

// The smallest eigenvalue of sign T by bisection between Gershgorin's bounds, from below.
static double smallest_of(const work *w, int32_t k, double sign)
{
    double low = INFINITY, high = INFINITY;
    for (int32_t i = 0; i < k; i++) {
        const double radius = (i > 0 ? fabs(w->side[i - 1]) : 0) + (i + 1 < k ? fabs(w->side[i]) : 0);
        low = fmin(low, sign * w->diagonal[i] - radius);
        high = fmin(high, sign * w->diagonal[i]);  // Rayleigh's quotient of a unit vector
    }
    low -= DBL_EPSILON * fabs(low) + DBL_MIN;
    high += DBL_EPSILON * fabs(high) + DBL_MIN;
    while (1) {
        const double middle = low + (high - low) / 2;
        if (middle <= low || middle >= high) return low;
        if (count_below(w, k, sign, middle) > 0) high = middle;
        else low = middle;
    }
}

// |last component| of the unit eigenvector of sign T that belongs to its smallest eigenvalue: times
// the next side entry it is the residual. All pivots in front of the last are positive there, so the
// eigenvector follows backwards from x_i = - side_i / pivot_i x_{i+1} without cancellation.
static double last_component(const work *w, int32_t k, double sign, double value)
{
    double *pivot = w->pivot;
    for (int32_t i = 0; i < k; i++) {
        const double side = i > 0 ? w->side[i - 1] : 0;
        pivot[i] = sign * w->diagonal[i] - value - (i > 0 ? side * side / pivot[i - 1] : 0);
        if (fabs(pivot[i]) < DBL_MIN) pivot[i] = DBL_MIN;
    }
    // Components relative to the last grow: keep their square sum relative to the largest so far.
    double component = 1, sum = 1;
    for (int32_t i = k - 1; i-- > 0;) {
        component *= -w->side[i] / pivot[i];
        sum += component * component;
        if (sum > 0x1p500) return 0;
    }
    return 1 / sqrt(sum);
}

static void look(const work *w, int32_t k, pliant_lanczos_result *result)
{
    const double next = w->side[k - 1];
    result->steps = k;
    result->smallest = smallest_of(w, k, 1);
    result->largest = -smallest_of(w, k, -1);
    result->smallest_residual = next * last_component(w, k, 1, result->smallest);
    result->largest_residual = next * last_component(w, k, -1, -result->largest);
}

pliant_status pliant_lanczos_extremes(const pliant_lanczos_def *def, pliant_lanczos_result *result,
                                      pliant_error *err)
{
    if (def->n < 1 || def->step_capacity < 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "eigenvalues: expected an operator of at least one row, found %d", (int)def->n);
    work w = {.arena = {0}};
    lay_out(def, &w);
    pliant_status status = pliant_arena_reserve(&w.arena, err);
    if (status < 0) return status;
    lay_out(def, &w);

    const int32_t n = def->n;
    start(n, w.current);
    double side = 0;
    int32_t next_look = first_look;
    for (int32_t k = 0; k < def->step_capacity; k++) {
        memcpy(w.spare, w.current, (size_t)n * sizeof *w.spare);
        def->apply(def->context, w.spare, w.image);
        for (int32_t i = 0; i < n; i++) w.image[i] -= side * w.previous[i];
        const double diagonal = dot(w.image, w.current, n);
        for (int32_t i = 0; i < n; i++) w.image[i] -= diagonal * w.current[i];
        side = sqrt(dot(w.image, w.image, n));
        w.diagonal[k] = diagonal;
        w.side[k] = side;
        if (!isfinite(diagonal) || !isfinite(side)) {
            status = pliant_error_set(err, PLIANT_ERR_ARGUMENT, "eigenvalues: expected finite numbers, found others");
            break;
        }
        // A vanishing rest: the vectors so far span all that the start leans on.
        const int is_done = side <= DBL_EPSILON * fabs(diagonal) || k + 1 == def->step_capacity;
        if (is_done || k + 1 >= next_look) {
            look(&w, k + 1, result);
            if (is_done || fmax(result->smallest_residual, result->largest_residual) <= def->tolerance) break;
            next_look += 1 + next_look / looks_per_doubling;
        }
        double *oldest = w.previous;
        w.previous = w.current;
        w.current = w.image;
        w.image = oldest;
        scale(1 / side, n, w.current);
    }
    pliant_arena_release(&w.arena);
    return status;
}
