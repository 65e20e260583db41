// lanczos.c: the smallest and the largest eigenvalue of a symmetric operator known by what it does.
//
// This follows: C. Lanczos, J. Res. Nat. Bur. Standards 45, 1950; C. C. Paige, Accuracy and
// effectiveness of the Lanczos algorithm, Linear Algebra Appl. 34, 1980; J. Cullum and R.
// Willoughby, Lanczos Algorithms, Birkhaeuser, 1985.
#include "pliant/lanczos.h"

#include "pliant/arena.h"
#include "pliant/error.h"

#include <float.h>
#include <math.h>
#include <string.h>

// Looks at the eigenvalues are a few hundred operations a step: worth one after every eighth more
// steps, and the first when there is something to see.
static const int32_t first_look = 16, looks_per_doubling = 8;
// A rest under this part of the operator's size is rounding.
static const double rounding = 8 * DBL_EPSILON;

typedef struct work {
    pliant_arena arena;
    double *previous, *current, *image, *spare;  // [n]
    double *diagonal, *side;                     // [step_capacity]: T; side[i] couples i and i + 1
} work;

static void lay_out(const pliant_lanczos_def *def, work *w)
{
    PLIANT_TAKE(&w->arena, w->previous, def->n);
    PLIANT_TAKE(&w->arena, w->current, def->n);
    PLIANT_TAKE(&w->arena, w->image, def->n);
    PLIANT_TAKE(&w->arena, w->spare, def->n);
    PLIANT_TAKE(&w->arena, w->diagonal, def->step_capacity);
    PLIANT_TAKE(&w->arena, w->side, def->step_capacity);
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

// How many eigenvalues of sign T are under `bound`: negative pivots of sign T - bound I
// (Sylvester).
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
        const double radius =
            (i > 0 ? fabs(w->side[i - 1]) : 0) + (i + 1 < k ? fabs(w->side[i]) : 0);
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

// The smallest residual that T knows for `value`. With x_i = 1 and the others backwards from
// x_{h-1} = - side_{h-1} / pivot_{h-1} x_h, the pivots being those of T - value I, the first i
// basis vectors make a vector whose residual is (pivot_i^2 + side_i^2)^1/2 over the norm of x. Any
// i will do; the best one counts, since behind it there may be unfinished copies.
static double residual_of(const work *w, int32_t k, double value)
{
    double square = 1, pivot = 1, best = INFINITY;  // of x's norm
    for (int32_t i = 0; i < k; i++) {
        const double before = i > 0 ? w->side[i - 1] : 0, ratio = before / pivot;
        square = i > 0 ? 1 + ratio * ratio * square : 1;
        pivot = w->diagonal[i] - value - before * ratio;
        if (fabs(pivot) < DBL_MIN) pivot = DBL_MIN;
        best = fmin(best, hypot(pivot, w->side[i]) / sqrt(square));
    }
    return best;
}

static void look(const work *w, int32_t k, pliant_lanczos_result *result)
{
    result->steps = k;
    result->smallest = smallest_of(w, k, 1);
    result->largest = -smallest_of(w, k, -1);
    result->smallest_residual = residual_of(w, k, result->smallest);
    result->largest_residual = residual_of(w, k, result->largest);
}

pliant_status pliant_lanczos_extremes(const pliant_lanczos_def *def, pliant_lanczos_result *result,
                                      pliant_error *err)
{
    if (def->n < 1 || def->step_capacity < 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "eigenvalues: expected an operator of at least one row, found %d",
                                (int)def->n);
    work w = {.arena = {0}};
    lay_out(def, &w);
    pliant_status status = pliant_arena_reserve(&w.arena, err);
    if (status < 0) return status;
    lay_out(def, &w);

    const int32_t n = def->n;
    start(n, w.current);
    double side = 0, size = 0;  // of T, to rounding
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
            status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                      "eigenvalues: expected finite numbers, found others");
            break;
        }
        // A vanishing rest: the vectors so far span all that the start leans on.
        size = fmax(size, fabs(diagonal) + side);
        const int is_done = side <= rounding * size || k + 1 == def->step_capacity;
        if (is_done || k + 1 >= next_look) {
            look(&w, k + 1, result);
            if (is_done ||
                fmax(result->smallest_residual, result->largest_residual) <= def->tolerance)
                break;
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
