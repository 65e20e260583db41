// threshold_search.c: the sparsest coefficients of spooled columns that stay under given errors.
//
// Errors are exact up to float rounding: what is dropped goes through the inverse transform, which
// gives the error itself. That transform is what the search costs, so columns are worked on in
// lanes, interleaved, and a lane that is done takes the next column.
#include "threshold_search.h"

#include "pliant/error.h"
#include "pliant/vector_clones.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    lanes = 8,
    entries = 9,              // of a 3x3 block
    width = lanes * entries,  // a row of the work arrays: [entry][lane]
    max_evaluations = 7,      // of one column's error while its t_j is sought
    max_trials = 12,          // of T; three or four do, the bracket is for the rest
    sample_stride = 8,        // every 8th column tells T to a percent or two
    least_sample = 256,       // columns below which there is no sampling
    refit_iterations = 3,     // conjugate gradients: a fourth gains under 0.2% of RMS
    bins_per_octave = 16,
    octaves = 96,
    bin_count = bins_per_octave * octaves,
};

// A target counts as met in the range [slack, 1] of it: the error of a column is a step function of
// its threshold, and finer steps than these change the set by less than a coefficient or two.
static const double max_slack = 0.94, rms_slack = 0.985;
// A column's bracket narrower than this holds no other set worth looking for.
static const double finest_bracket = 1.03;
// What the refit takes off RMS, before it has been measured.
static const double refit_guess = 0.96;
// Steps down after a search that ended on a miss, and where they end.
static const double retreat = 0.9, smallest_retreat = 0.3;
// No coefficient is this many times its column's peak: at this t nothing is kept for the column's sake.
static const double everything = 16;

typedef struct column_state {
    double t;       // keep what is above t * peak; 0: not looked at yet
    double sup;     // max_i |error_i|_F / peak
    double energy;  // sum_i |error_i|_F^2
} column_state;

typedef struct searcher {
    const pliant_wavelet *wavelet;
    const pliant_spool *spool;
    pliant_threshold_targets targets;
    MPI_Comm comm;
    int32_t column_count;
    column_state *states;  // [column_count]
    float *weight;         // [m] w_i
    float *inverse_square; // [m] 1 / w_i^2
    float *mask;           // [m][lanes] 1: kept
    float *error, *delta, *residual, *direction, *image;  // [m + 1][entries][lanes] each
    double transforms;  // made so far, of this rank's lanes
} searcher;

// ---- Progress ----

// Transforms of all columns that a search takes: 14 to 23 for more than 500 columns under the default
// targets (the sample, bunny_L4 and blob_L4 of the evaluation meshes); small levels take more.
static const double usual_transforms = 20;

// `count` more transforms of the lanes. What is past the usual number is shown as ever less of the rest.
static void work(searcher *s, int count)
{
    s->transforms += count;
    if (!s->targets.tell || s->column_count == 0) return;
    const double part = s->transforms * lanes / (usual_transforms * s->column_count);
    s->targets.tell(s->targets.context, part < 0.9 ? part : 1 - 0.1 * exp(10 * (0.9 - part)));
}

// ---- Sums over ranks ----

static double sum_over_ranks(double value, MPI_Comm comm)
{
    double sum;
    MPI_Allreduce(&value, &sum, 1, MPI_DOUBLE, MPI_SUM, comm);
    return sum;
}

// Collective: a rank that fails must not leave the others waiting in the next sum.
static pliant_status worst_status(pliant_status status, MPI_Comm comm)
{
    int mine = status, worst;
    MPI_Allreduce(&mine, &worst, 1, MPI_INT, MPI_MIN, comm);
    return (pliant_status)worst;
}

// ---- Work on a row of lanes ----

static size_t array_bytes(const searcher *s)
{
    return ((size_t)s->wavelet->count + 1) * width * sizeof(float);
}

// Squared Frobenius norm of a row's block, lane by lane.
static inline void block_squares(const float *row, float *square)
{
    for (int k = 0; k < lanes; k++) square[k] = 0;
    for (int e = 0; e < entries; e++)
        for (int k = 0; k < lanes; k++) square[k] += row[e * lanes + k] * row[e * lanes + k];
}

// Largest block norm squared and sum of them, lane by lane.
PLIANT_VECTOR_CLONES
static void measure(const float *x, int32_t rows, double *largest, double *sum)
{
    float top[lanes] = {0}, square[lanes];
    double total[lanes] = {0};
    for (int32_t i = 0; i < rows; i++) {
        block_squares(x + (size_t)i * width, square);
        for (int k = 0; k < lanes; k++) {
            top[k] = square[k] > top[k] ? square[k] : top[k];
            total[k] += square[k];
        }
    }
    for (int k = 0; k < lanes; k++) largest[k] = top[k], sum[k] = total[k];
}

// Sum of scale_i |x_i|^2, lane by lane.
PLIANT_VECTOR_CLONES
static void weighted_square(const float *x, const float *scale, int32_t rows, double *sum)
{
    float square[lanes];
    double total[lanes] = {0};
    for (int32_t i = 0; i < rows; i++) {
        block_squares(x + (size_t)i * width, square);
        for (int k = 0; k < lanes; k++) total[k] += scale[i] * square[k];
    }
    memcpy(sum, total, sizeof total);
}

// Zero what is not kept, and the zero row.
PLIANT_VECTOR_CLONES
static void restrict_to_kept(const float *mask, int32_t rows, float *x)
{
    for (int32_t i = 0; i < rows; i++)
        for (int e = 0; e < entries; e++)
            for (int k = 0; k < lanes; k++) x[(size_t)i * width + e * lanes + k] *= mask[(size_t)i * lanes + k];
    memset(x + (size_t)rows * width, 0, width * sizeof *x);
}

// p = scale_i r + beta p
PLIANT_VECTOR_CLONES
static void advance_direction(const float *r, const float *scale, const float *beta, int32_t rows, float *p)
{
    for (int32_t i = 0; i < rows; i++)
        for (int e = 0; e < entries; e++)
            for (int k = 0; k < lanes; k++) {
                const size_t at = (size_t)i * width + e * lanes + k;
                p[at] = scale[i] * r[at] + beta[k] * p[at];
            }
}

// y += alpha x
PLIANT_VECTOR_CLONES
static void add_scaled(const float *alpha, const float *x, int32_t rows, float *y)
{
    for (size_t row = 0; row < (size_t)rows * entries; row++)
        for (int k = 0; k < lanes; k++) y[row * lanes + k] += alpha[k] * x[row * lanes + k];
}

// ---- One evaluation ----

static inline int is_kept(const searcher *s, int32_t row, float norm, double T, double t_peak)
{
    return row < s->wavelet->level_offset[1] || norm * s->weight[row] >= T || norm >= t_peak;
}

// s->error = W^-1 of what the thresholds drop from the lanes' columns (-1: an empty lane).
static void evaluate(searcher *s, const int32_t *columns, double T, const double *t, double *sup, double *energy)
{
    float *x = s->error;
    memset(x, 0, array_bytes(s));
    for (int k = 0; k < lanes; k++) {
        if (columns[k] < 0) continue;
        const pliant_spooled c = pliant_spool_column(s->spool, columns[k]);
        for (int32_t q = 0; q < c.count; q++) {
            if (is_kept(s, c.rows[q], c.norms[q], T, t[k] * c.peak)) continue;
            float *target = x + (size_t)c.rows[q] * width + k;
            for (int e = 0; e < entries; e++) target[e * lanes] = c.blocks[entries * (size_t)q + e];
        }
    }
    pliant_wavelet_inverse_float(s->wavelet, s->wavelet->level_count - 1, width, x);
    work(s, 1);
    measure(x, s->wavelet->count, sup, energy);
    for (int k = 0; k < lanes; k++) {
        if (columns[k] < 0) continue;
        const double peak = pliant_spool_column(s->spool, columns[k]).peak;
        sup[k] = peak > 0 ? sqrt(sup[k]) / peak : 0;
    }
}

// ---- MAX: each column's own threshold ----

// One column's hunt for the largest t whose error stays under MAX.
typedef struct bracket {
    double good, good_sup, good_energy;  // largest t known to pass; 0: keep all, no error
    double bad, bad_sup;                 // smallest t known to fail; INFINITY: none yet
    int evaluations;
} bracket;

static double next_guess(const bracket *b, double bound)
{
    // The error of dropping what is under t of the peak is about t to 2t.
    if (isinf(b->bad)) return b->good == 0 ? 0.6 * bound : b->good > bound ? INFINITY : 1.6 * b->good;
    if (b->good == 0 && b->bad == everything) return 0.6 * bound;
    if (b->good == 0) return b->bad * fmin(0.8, fmax(0.1, 0.95 * bound / b->bad_sup));
    if (b->bad == everything) return fmin(1.6 * b->good, everything);
    // The error grows about linearly with the threshold; stay off the ends.
    const double part = (bound - b->good_sup) / (b->bad_sup - b->good_sup);
    return b->good + (b->bad - b->good) * fmin(0.85, fmax(0.15, part));
}

// Enter an evaluation. Returns 1 when the column is done.
static int narrow(bracket *b, double bound, double t, double sup, double energy)
{
    b->evaluations++;
    if (sup <= bound) {
        b->good = t, b->good_sup = sup, b->good_energy = energy;
        if (isinf(t) || sup >= max_slack * bound) return 1;
    } else {
        b->bad = isinf(t) ? everything : t, b->bad_sup = sup;
    }
    return (b->good > 0 && b->bad / b->good < finest_bracket) || b->evaluations == max_evaluations;
}

// The next of this rank's columns from `index` on whose position is a multiple of stride, or
// column_count. Positions, not indices: the sample must not depend on how columns were dealt out.
static int32_t next_column(const searcher *s, int32_t index, int32_t stride)
{
    while (index < s->column_count && pliant_spool_column(s->spool, index).column % stride != 0) index++;
    return index;
}

// For every stride-th column the largest t_j that meets MAX beside T; without a bound on MAX nothing
// is kept for the column's sake. Returns this rank's error energy in them.
static double meet_max(searcher *s, double T, int32_t stride)
{
    const double bound = s->targets.max > 0 ? s->targets.max : INFINITY;
    int32_t columns[lanes], next = next_column(s, 0, stride);
    bracket brackets[lanes];
    double t[lanes], sup[lanes], energy[lanes], total = 0;
    int busy = 0;
    for (int k = 0; k < lanes; k++) columns[k] = -1;
    do {
        for (int k = 0; k < lanes; k++) {
            if (columns[k] >= 0 || next >= s->column_count) continue;
            columns[k] = next;
            brackets[k] = (bracket){.bad = INFINITY};
            // Begin at the last t_j, or find out whether T alone is enough.
            t[k] = s->states[next].t > 0 && s->targets.max > 0 ? s->states[next].t : INFINITY;
            next = next_column(s, next + 1, stride);
            busy++;
        }
        if (busy == 0) break;
        evaluate(s, columns, T, t, sup, energy);
        for (int k = 0; k < lanes; k++) {
            if (columns[k] < 0) continue;
            if (!narrow(&brackets[k], bound, t[k], sup[k], energy[k])) {
                t[k] = next_guess(&brackets[k], bound);
                continue;
            }
            s->states[columns[k]] =
                (column_state){brackets[k].good, brackets[k].good_sup, brackets[k].good_energy};
            total += brackets[k].good_energy;
            columns[k] = -1;
            busy--;
        }
    } while (busy > 0 || next < s->column_count);
    return total;
}

// ---- Refit ----

// Least squares: with d what is dropped and P the choice of what is kept, the correction of the kept
// coefficients minimises |W^-1 (d - P delta)|^2. Conjugate gradients on the normal equations,
// preconditioned by their diagonal, which is w_i^2. s->error holds W^-1 d; leaves s->delta.
static void refit(searcher *s)
{
    const pliant_wavelet *w = s->wavelet;
    const int32_t m = w->count;
    const size_t bytes = array_bytes(s);
    double rho[lanes], next[lanes], curvature[lanes], largest[lanes];
    float beta[lanes] = {0}, alpha[lanes], minus_alpha[lanes];

    memcpy(s->residual, s->error, bytes);
    pliant_wavelet_inverse_transpose_float(w, width, s->residual);
    restrict_to_kept(s->mask, m, s->residual);
    memset(s->delta, 0, bytes);
    memset(s->direction, 0, bytes);
    weighted_square(s->residual, s->inverse_square, m, rho);
    for (int iteration = 0; iteration < refit_iterations; iteration++) {
        advance_direction(s->residual, s->inverse_square, beta, m, s->direction);
        memcpy(s->image, s->direction, bytes);
        pliant_wavelet_inverse_float(w, w->level_count - 1, width, s->image);
        measure(s->image, m, largest, curvature);
        for (int k = 0; k < lanes; k++) {
            alpha[k] = curvature[k] > 0 ? (float)(rho[k] / curvature[k]) : 0;
            minus_alpha[k] = -alpha[k];
        }
        add_scaled(alpha, s->direction, m, s->delta);
        if (iteration + 1 == refit_iterations) break;
        pliant_wavelet_inverse_transpose_float(w, width, s->image);
        restrict_to_kept(s->mask, m, s->image);
        add_scaled(minus_alpha, s->image, m, s->residual);
        weighted_square(s->residual, s->inverse_square, m, next);
        for (int k = 0; k < lanes; k++) beta[k] = rho[k] > 0 ? (float)(next[k] / rho[k]) : 0;
        memcpy(rho, next, sizeof rho);
    }
}

// What became of the lanes' columns.
typedef struct result {
    double sup[lanes], energy[lanes];  // of the error that is stored
    int refitted[lanes];               // 0: the refit broke MAX in this column and is left out
} result;

// Mark what (T, t_j) keep in the lanes' columns, refit it, measure the error.
static result refit_lanes(searcher *s, const int32_t *columns, double T)
{
    const pliant_wavelet *w = s->wavelet;
    const int32_t m = w->count;
    result r = {{0}, {0}, {0}};
    double t[lanes] = {0}, sup[lanes], energy[lanes];
    memset(s->mask, 0, (size_t)m * lanes * sizeof *s->mask);
    for (int k = 0; k < lanes; k++) {
        if (columns[k] < 0) continue;
        t[k] = s->states[columns[k]].t;
        const pliant_spooled c = pliant_spool_column(s->spool, columns[k]);
        for (int32_t q = 0; q < c.count; q++)
            s->mask[(size_t)c.rows[q] * lanes + k] =
                (float)is_kept(s, c.rows[q], c.norms[q], T, t[k] * c.peak);
    }
    evaluate(s, columns, T, t, sup, energy);
    refit(s);
    // The error that is left: what was dropped less what the correction adds.
    static const float minus[lanes] = {-1, -1, -1, -1, -1, -1, -1, -1};
    float *x = s->image;
    memcpy(x, s->delta, array_bytes(s));
    pliant_wavelet_inverse_float(w, w->level_count - 1, width, x);
    add_scaled(minus, x, m, s->error);
    work(s, 2 * refit_iterations + 1);
    measure(s->error, m, r.sup, r.energy);
    for (int k = 0; k < lanes; k++) {
        if (columns[k] < 0) continue;
        const double peak = pliant_spool_column(s->spool, columns[k]).peak;
        r.sup[k] = peak > 0 ? sqrt(r.sup[k]) / peak : 0;
        r.refitted[k] = r.energy[k] <= energy[k] && (s->targets.max == 0 || r.sup[k] <= s->targets.max);
        if (r.refitted[k]) continue;
        r.sup[k] = sup[k];
        r.energy[k] = energy[k];
    }
    return r;
}

static pliant_status keep_lanes(searcher *s, const int32_t *columns, double T, pliant_kept_set *kept,
                                pliant_threshold_outcome *outcome, pliant_error *err)
{
    const result r = refit_lanes(s, columns, T);
    for (int k = 0; k < lanes; k++) {
        if (columns[k] < 0) continue;
        const pliant_spooled c = pliant_spool_column(s->spool, columns[k]);
        pliant_status status = pliant_kept_set_begin(kept, c.column, err);
        for (int32_t q = 0; q < c.count && status == PLIANT_OK; q++) {
            if (s->mask[(size_t)c.rows[q] * lanes + k] == 0) continue;
            const float *delta = s->delta + (size_t)c.rows[q] * width + k;
            double block[entries];
            for (int e = 0; e < entries; e++)
                block[e] = (double)c.blocks[entries * (size_t)q + e] + (r.refitted[k] ? delta[e * lanes] : 0);
            status = pliant_kept_set_add(kept, c.rows[q], block, err);
        }
        if (status < 0) return status;
        outcome->error_energy += r.energy[k];
        outcome->worst = fmax(outcome->worst, r.sup[k]);
    }
    return PLIANT_OK;
}

// Every stride-th column from `next` on into the lanes. Returns where to go on.
static int32_t fill_lanes(const searcher *s, int32_t next, int32_t stride, int32_t *columns)
{
    for (int k = 0; k < lanes; k++) {
        next = next_column(s, next, stride);
        columns[k] = next < s->column_count ? next++ : -1;
    }
    return next;
}

static pliant_status keep_all(searcher *s, double T, pliant_kept_set *kept,
                              pliant_threshold_outcome *outcome, pliant_error *err)
{
    pliant_kept_set_clear(kept);
    *outcome = (pliant_threshold_outcome){.threshold = T};
    int32_t columns[lanes];
    for (int32_t next = 0; next < s->column_count;) {
        next = fill_lanes(s, next, 1, columns);
        const pliant_status status = keep_lanes(s, columns, T, kept, outcome, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

// ---- RMS: the threshold of the whole block ----

// The hunt for the largest T whose error energy stays under a target.
typedef struct hunt {
    double target;
    double good, good_energy;  // largest T known to pass; 0: none yet
    double bad, bad_energy;    // smallest T known to fail; INFINITY: none yet
    double slope;              // d log energy / d log T, as last seen
    double last, last_energy;
} hunt;

static hunt hunt_begin(double target)
{
    // Energies grow about as T^1.5 where T decides (measured at RMS 1 to 5%).
    return (hunt){.target = target, .bad = INFINITY, .slope = 1.5};
}

// Enter what T cost. Returns the next T to try, or T itself when it is good enough.
static double hunt_next(hunt *h, double T, double energy)
{
    if (h->last > 0 && !isinf(T) && T != h->last && energy != h->last_energy)
        h->slope = fmin(3, fmax(0.15, log(energy / h->last_energy) / log(T / h->last)));
    h->last = T, h->last_energy = energy;
    if (energy <= h->target) {
        h->good = T, h->good_energy = energy;
        if (isinf(T) || energy >= rms_slack * rms_slack * h->target) return T;
    } else {
        h->bad = T, h->bad_energy = energy;
    }
    // Aim at the middle of what counts as met.
    const double aim = h->target * 0.5 * (1 + rms_slack * rms_slack);
    if (h->good == 0) return h->bad * fmax(0.05, pow(aim / h->bad_energy, 1 / h->slope));
    if (isinf(h->bad)) return h->good * fmin(64, pow(aim / fmax(h->good_energy, 1e-3 * aim), 1 / h->slope));
    const double low = log(fmax(h->good_energy, 1e-9 * aim)), high = log(h->bad_energy);
    return h->good * pow(h->bad / h->good, fmin(0.9, fmax(0.1, (log(aim) - low) / (high - low))));
}

// Nothing to choose between two thresholds this close.
static int hunt_exhausted(const hunt *h)
{
    return h->good > 0 && h->bad / h->good < 1.004;
}

// Collective: the T under which, were the coefficients orthogonal, `energy` would be dropped.
static double guess_threshold(const searcher *s, double energy)
{
    double histogram[bin_count] = {0}, all[bin_count];
    for (int32_t j = 0; j < s->column_count; j++) {
        const pliant_spooled c = pliant_spool_column(s->spool, j);
        for (int32_t q = 0; q < c.count; q++) {
            const double size = c.norms[q] * s->weight[c.rows[q]];
            if (c.rows[q] < s->wavelet->level_offset[1] || size <= 0) continue;
            const double bin = bins_per_octave * (log2(size) + octaves / 2.0);
            histogram[bin < 0 ? 0 : bin >= bin_count ? bin_count - 1 : (int)bin] += size * size;
        }
    }
    MPI_Allreduce(histogram, all, bin_count, MPI_DOUBLE, MPI_SUM, s->comm);
    int bin = 0;
    for (double sum = 0; bin < bin_count && sum + all[bin] <= energy; bin++) sum += all[bin];
    return bin == bin_count ? INFINITY : exp2((double)bin / bins_per_octave - octaves / 2.0);
}

// Collective: T for RMS from every stride-th column, whose exact energy over all ranks is `energy`;
// *gain becomes what the refit makes of RMS there.
static double sample_threshold(searcher *s, int32_t stride, double energy, double start, double *gain)
{
    const double relative = s->targets.rms * s->targets.rms;
    hunt h = hunt_begin(relative * energy / (*gain * *gain));
    double T = start, reached = 0;
    for (int trial = 0; trial < max_trials; trial++) {
        reached = sum_over_ranks(meet_max(s, T, stride), s->comm);
        const double next = hunt_next(&h, T, reached);
        if (next == T || hunt_exhausted(&h)) break;
        T = next;
    }
    double refitted = 0;
    int32_t columns[lanes];
    for (int32_t next = 0; next < s->column_count;) {
        next = fill_lanes(s, next, stride, columns);
        const result r = refit_lanes(s, columns, T);
        for (int k = 0; k < lanes; k++) refitted += columns[k] < 0 ? 0 : r.energy[k];
    }
    refitted = sum_over_ranks(refitted, s->comm);
    *gain = reached > 0 ? fmin(1, sqrt(refitted / reached)) : 1;
    return T;
}

// Collective: RMS over all columns. A trial first looks at the error before the refit, which costs a
// third; only a T that promises to do is refitted and kept.
static pliant_status meet_rms(searcher *s, double exact_energy, pliant_kept_set *kept,
                              pliant_threshold_outcome *outcome, pliant_error *err)
{
    const double target = s->targets.rms * s->targets.rms * exact_energy;
    int32_t total;
    MPI_Allreduce(&s->column_count, &total, 1, MPI_INT32_T, MPI_SUM, s->comm);
    const int32_t stride = total >= least_sample ? sample_stride : 1;
    double sampled = 0, gain = refit_guess;
    for (int32_t j = next_column(s, 0, stride); j < s->column_count; j = next_column(s, j + 1, stride))
        sampled += pliant_spool_column(s->spool, j).energy;
    sampled = sum_over_ranks(sampled, s->comm);
    double T = guess_threshold(s, target);
    T = sample_threshold(s, stride, sampled, T, &gain);

    hunt h = hunt_begin(target);
    for (int trial = 0; trial < max_trials; trial++) {
        const double searched = sum_over_ranks(meet_max(s, T, 1), s->comm);
        double energy = searched * gain * gain;
        hunt ahead = h;
        double next = hunt_next(&ahead, T, energy);
        if (next == T || hunt_exhausted(&ahead) || trial + 1 == max_trials) {
            const pliant_status status = worst_status(keep_all(s, T, kept, outcome, err), s->comm);
            if (status < 0) return status;
            energy = sum_over_ranks(outcome->error_energy, s->comm);
            gain = searched > 0 ? fmin(1, sqrt(energy / searched)) : 1;
            next = hunt_next(&h, T, energy);
            if (energy <= target && (next == T || hunt_exhausted(&h))) return PLIANT_OK;
        } else {
            h = ahead;
        }
        T = next;
    }
    // The trials ended on a miss: come down until it is none. T = 0 keeps all, without error.
    const double start = h.good > 0 ? h.good : isinf(h.bad) ? 0 : retreat * h.bad;
    for (T = start;; T = T > smallest_retreat * start ? retreat * T : 0) {
        (void)meet_max(s, T, 1);
        const pliant_status status = worst_status(keep_all(s, T, kept, outcome, err), s->comm);
        if (status < 0 || T == 0 || sum_over_ranks(outcome->error_energy, s->comm) <= target) return status;
    }
}

// ---- Setting up ----

// w_i = |W^-1 e_i| over the nodes.
static void measure_synthesis(searcher *s)
{
    const int32_t m = s->wavelet->count;
    float *x = s->error;
    for (int32_t first = 0; first < m; first += width) {
        const int32_t count = m - first < width ? m - first : width;
        memset(x, 0, array_bytes(s));
        for (int32_t k = 0; k < count; k++) x[(size_t)(first + k) * width + k] = 1;
        pliant_wavelet_inverse_float(s->wavelet, s->wavelet->level_count - 1, width, x);
        double squares[width] = {0};
        for (int32_t i = 0; i < m; i++)
            for (int k = 0; k < width; k++) squares[k] += (double)x[(size_t)i * width + k] * x[(size_t)i * width + k];
        for (int32_t k = 0; k < count; k++) {
            s->weight[first + k] = (float)sqrt(squares[k]);
            s->inverse_square[first + k] = (float)(1 / squares[k]);
        }
    }
}

static pliant_status create(searcher *s, pliant_error *err)
{
    const size_t m = (size_t)s->wavelet->count, values = (m + 1) * width;
    s->states = calloc((size_t)s->column_count + 1, sizeof *s->states);
    s->weight = calloc(m + 1, sizeof *s->weight);
    s->inverse_square = calloc(m + 1, sizeof *s->inverse_square);
    s->mask = calloc(m * lanes + 1, sizeof *s->mask);
    // One block, cut in five.
    s->error = calloc(5 * values, sizeof *s->error);
    if (!s->states || !s->weight || !s->inverse_square || !s->mask || !s->error)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to search thresholds for %zu rows", m);
    s->delta = s->error + values;
    s->residual = s->delta + values;
    s->direction = s->residual + values;
    s->image = s->direction + values;
    measure_synthesis(s);
    return PLIANT_OK;
}

pliant_status pliant_threshold_search(const pliant_wavelet *wavelet, const pliant_spool *spool,
                                      const pliant_threshold_targets *targets, double exact_energy,
                                      MPI_Comm comm, pliant_kept_set *kept,
                                      pliant_threshold_outcome *outcome, pliant_error *err)
{
    searcher s = {.wavelet = wavelet, .spool = spool, .targets = *targets, .comm = comm,
                  .column_count = pliant_spool_column_count(spool)};
    pliant_status status = worst_status(create(&s, err), comm);
    if (status == PLIANT_OK) {
        if (targets->rms > 0) {
            status = meet_rms(&s, exact_energy, kept, outcome, err);
        } else {
            (void)meet_max(&s, INFINITY, 1);
            status = worst_status(keep_all(&s, INFINITY, kept, outcome, err), comm);
        }
    }
    free(s.error);
    free(s.mask);
    free(s.inverse_square);
    free(s.weight);
    free(s.states);
    return status;
}
