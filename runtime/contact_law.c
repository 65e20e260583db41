// contact_law.c: the forces between rigid tools and compliant contacts: unilateral, with friction.
//
// This follows: J. J. Judice and F. M. Pires, A block principal pivoting algorithm for large-scale
// strictly monotone linear complementarity problems, Computers Ops Res. 21(5), 1994; K. G. Murty,
// Note on a Bard-type scheme for solving the complementarity problem, Opsearch 11, 1974 (the
// safeguard); M. Jean, The non-smooth contact dynamics method, CMAME 177, 1999 (sweeps over
// contacts); G. De Saxce and Z.-Q. Feng, The bipotential method, Math. Comput. Modelling 28, 1998
// (the residual). The exact solution of one sliding contact by its angle, and the solution of all
// in the regimes that the sweeps found, are ours.
#include "contact_law.h"

#include "pliant/vector_clones.h"

#include <math.h>
#include <string.h>

// Rounding of sums over hundreds of numbers, relative to the largest of them.
static const double rounding = 0x1p-40;
// A pivot under this part of its diagonal is rounding: contacts that share a place and a direction.
static const double least_pivot = 0x1p-40;
// Whole blocks are exchanged as long as the number of violations falls within so many trials.
enum { block_trials = 4 };
// Sets tried at most, for each contact. Murty's rule is finite; random and nearly singular problems
// of 4 to 100 contacts took at most 12 sets in all (test_contact_law.c).
enum { set_limit_part = 20, set_limit_floor = 100 };
// Sweeps between solutions in fixed regimes: so many, and one more for every so many contacts. At
// 60 that stick such a solution costs as much as 35 sweeps, at 20 as much as 5; it spares half of
// the sweeps or more (a ball of friction 0.3 to 0.8 on the blob, bench_tool).
enum { sweeps_at_once = 6, contacts_a_sweep = 4 };

void pliant_contact_law_lay_out(pliant_arena *arena, int32_t capacity, pliant_contact_law *law)
{
    const size_t n = 3 * (size_t)capacity;
    law->capacity = capacity;
    PLIANT_TAKE(arena, law->active, n);
    PLIANT_TAKE(arena, law->is_active, capacity);
    PLIANT_TAKE(arena, law->factor, n * n);
    PLIANT_TAKE(arena, law->solution, n);
    PLIANT_TAKE(arena, law->residual, n);
    PLIANT_TAKE(arena, law->trial, n);
    PLIANT_TAKE(arena, law->trial_residual, n);
    PLIANT_TAKE(arena, law->direction, 2 * (size_t)capacity);
}

// ---- Without friction ----

// Cholesky's factorisation of the upper triangle, row by row so that inner loops run along rows:
// A = U^T U. A pivot that rounding took is made large, which leaves its unknown at zero.
PLIANT_VECTOR_CLONES
static void factor_definite(int32_t n, const double *diagonal, double *restrict a)
{
    for (int32_t k = 0; k < n; k++) {
        double *restrict pivot_row = a + (size_t)k * (size_t)n;
        const int32_t is_lost = !(pivot_row[k] > least_pivot * diagonal[k]);
        const double pivot = is_lost ? sqrt(diagonal[k]) / least_pivot : sqrt(pivot_row[k]);
        pivot_row[k] = pivot;
        for (int32_t j = k + 1; j < n; j++) pivot_row[j] /= pivot;
        for (int32_t i = k + 1; i < n; i++) {
            const double factor = pivot_row[i];
            double *restrict row = a + (size_t)i * (size_t)n;
            for (int32_t j = i; j < n; j++) row[j] -= factor * pivot_row[j];
        }
    }
}

// x = (U^T U)^-1 x.
static void substitute(int32_t n, const double *a, double *x)
{
    for (int32_t k = 0; k < n; k++) {
        const double *row = a + (size_t)k * (size_t)n;
        x[k] /= row[k];
        for (int32_t j = k + 1; j < n; j++) x[j] -= row[j] * x[k];
    }
    for (int32_t k = n; k-- > 0;) {
        const double *row = a + (size_t)k * (size_t)n;
        double sum = x[k];
        for (int32_t j = k + 1; j < n; j++) sum -= row[j] * x[j];
        x[k] = sum / row[k];
    }
}

static double largest(int32_t count, const double *x)
{
    double most = 0;
    for (int32_t i = 0; i < count; i++) most = fmax(most, fabs(x[i]));
    return most;
}

// y = b + A x, of a symmetric A whose rows are its columns.
PLIANT_VECTOR_CLONES
static void respond(int32_t n, const double *restrict a, const double *restrict b,
                    const double *restrict x, double *restrict y)
{
    memcpy(y, b, (size_t)n * sizeof *y);
    for (int32_t j = 0; j < n; j++) {
        const double *restrict column = a + (size_t)j * (size_t)n;
        if (x[j] == 0) continue;
        for (int32_t i = 0; i < n; i++) y[i] += column[i] * x[j];
    }
}

// lambda on the active set such that r = 0 there, 0 elsewhere, and r everywhere.
static void solve_active(pliant_contact_law *law, int32_t count, const double *matrix,
                         const double *b)
{
    int32_t n = 0;
    for (int32_t i = 0; i < count; i++) {
        law->solution[i] = 0;
        if (law->is_active[i]) law->active[n++] = i;
    }
    for (int32_t i = 0; i < n; i++) {
        const double *row = matrix + (size_t)law->active[i] * (size_t)count;
        for (int32_t j = i; j < n; j++)
            law->factor[(size_t)i * (size_t)n + (size_t)j] = row[law->active[j]];
        law->trial[i] = row[law->active[i]];
        law->trial_residual[i] = -b[law->active[i]];
    }
    factor_definite(n, law->trial, law->factor);
    substitute(n, law->factor, law->trial_residual);
    for (int32_t i = 0; i < n; i++) law->solution[law->active[i]] = law->trial_residual[i];
    respond(count, matrix, b, law->solution, law->residual);
}

// Contacts whose sign is wrong: active ones that pull, others that overlap. `last` takes the last.
static int32_t count_violations(const pliant_contact_law *law, int32_t count, double least_force,
                                double least_gap, int32_t *last)
{
    int32_t violations = 0;
    for (int32_t i = 0; i < count; i++) {
        if (law->is_active[i] ? law->solution[i] >= -least_force : law->residual[i] >= -least_gap)
            continue;
        *last = i;
        violations++;
    }
    return violations;
}

static void exchange_all(pliant_contact_law *law, int32_t count, double least_force,
                         double least_gap)
{
    for (int32_t i = 0; i < count; i++)
        if (law->is_active[i] ? law->solution[i] < -least_force : law->residual[i] < -least_gap)
            law->is_active[i] = !law->is_active[i];
}

pliant_contact_law_report pliant_contact_law_push(pliant_contact_law *law, int32_t count,
                                                  const double *matrix, const double *b,
                                                  double *lambda)
{
    pliant_contact_law_report report = {0};
    for (int32_t i = 0; i < count; i++) law->is_active[i] = lambda[i] > 0;
    const double least_gap = rounding * largest(count, b);
    const int32_t limit = set_limit_floor + set_limit_part * count;
    int32_t fewest = count + 1, trials = block_trials;
    while (report.count < limit) {
        solve_active(law, count, matrix, b);
        report.count++;
        const double least_force = rounding * largest(count, law->solution);
        int32_t last = -1;
        const int32_t violations = count_violations(law, count, least_force, least_gap, &last);
        if (violations == 0) {
            report.is_done = 1;
            break;
        }
        if (violations < fewest) {
            fewest = violations;
            trials = block_trials;
        }
        if (trials-- > 0) exchange_all(law, count, least_force, least_gap);
        else law->is_active[last] = !law->is_active[last];
    }
    // What is left below zero is rounding, or the limit's: never pull.
    for (int32_t i = 0; i < count; i++) lambda[i] = fmax(law->solution[i], 0);
    respond(count, matrix, b, lambda, law->residual);
    for (int32_t i = 0; i < count; i++) {
        const double as_length = matrix[(size_t)i * (size_t)count + (size_t)i] * lambda[i];
        report.residual = fmax(report.residual, fabs(fmin(law->residual[i], as_length)));
    }
    return report;
}

// ---- With friction: one contact ----

typedef struct block3 {
    double m[3][3];
} block3;

// x = m^-1 x by Cramer's rule; m is positive definite.
static void solve3(const block3 *a, const double *b, double *x)
{
    const double(*m)[3] = a->m;
    const double c00 = m[1][1] * m[2][2] - m[1][2] * m[2][1];
    const double c01 = m[1][2] * m[2][0] - m[1][0] * m[2][2];
    const double c02 = m[1][0] * m[2][1] - m[1][1] * m[2][0];
    const double c10 = m[0][2] * m[2][1] - m[0][1] * m[2][2];
    const double c11 = m[0][0] * m[2][2] - m[0][2] * m[2][0];
    const double c12 = m[0][1] * m[2][0] - m[0][0] * m[2][1];
    const double c20 = m[0][1] * m[1][2] - m[0][2] * m[1][1];
    const double c21 = m[0][2] * m[1][0] - m[0][0] * m[1][2];
    const double c22 = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    const double determinant = m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02;
    x[0] = (c00 * b[0] + c10 * b[1] + c20 * b[2]) / determinant;
    x[1] = (c01 * b[0] + c11 * b[1] + c21 * b[2]) / determinant;
    x[2] = (c02 * b[0] + c12 * b[1] + c22 * b[2]) / determinant;
}

// A contact that slides towards the angle `angle`: f = f_n (1, - mu cos, - mu sin) with r_n = 0.
// Returns how far r_t turns away from that direction (a cross product: positive when it lies to
// the left); `along` takes its part along it, which sliding wants above 0. NAN where no force along
// this edge of the cone closes the gap.
static double slide(const block3 *a, const double *b, double mu, double angle, double *along,
                    double *force)
{
    const double c = cos(angle), s = sin(angle);
    const double edge[3] = {1, -mu * c, -mu * s};
    double response[3];
    for (int i = 0; i < 3; i++)
        response[i] = a->m[i][0] * edge[0] + a->m[i][1] * edge[1] + a->m[i][2] * edge[2];
    if (!(response[0] > 0)) return NAN;
    const double normal = -b[0] / response[0];
    for (int i = 0; i < 3; i++) force[i] = normal * edge[i];
    const double x = b[1] + normal * response[1], y = b[2] + normal * response[2];
    *along = c * x + s * y;
    return c * y - s * x;
}

// Where the turn changes sign between two angles, by the Illinois rule.
static void find_slide(const block3 *a, const double *b, double mu, double from, double to,
                       double at_from, double at_to, double *along, double *force)
{
    enum { rounds = 60 };
    for (int i = 0, side = 0; i < rounds; i++) {
        const double middle = (from * at_to - to * at_from) / (at_to - at_from);
        const double at_middle = slide(a, b, mu, middle, along, force);
        if (at_middle == 0 || fabs(to - from) < 1e-14) return;
        if ((at_middle > 0) == (at_to > 0)) {
            to = middle, at_to = at_middle;
            if (side == 1) at_from /= 2;
            side = 1;
        } else {
            from = middle, at_from = at_middle;
            if (side == -1) at_to /= 2;
            side = -1;
        }
    }
}

// The exact solution of one contact. With little friction there is one; where there are more, the
// first of: open, sticking, sliding in the direction nearest to the one before. Where there is
// none (mu large against the coupling of normal and tangent): sliding that comes nearest.
static void solve_contact(const block3 *a, const double *b, double mu, double *force)
{
    if (b[0] >= 0) {
        force[0] = force[1] = force[2] = 0;
        return;
    }
    if (mu == 0) {
        force[0] = -b[0] / a->m[0][0];
        force[1] = force[2] = 0;
        return;
    }
    const double minus_b[3] = {-b[0], -b[1], -b[2]};
    double stuck[3];
    solve3(a, minus_b, stuck);
    if (stuck[0] >= 0 &&
        stuck[1] * stuck[1] + stuck[2] * stuck[2] <= mu * mu * stuck[0] * stuck[0]) {
        memcpy(force, stuck, sizeof stuck);
        return;
    }
    // The turn is a trigonometric polynomial of degree 2 over a positive one: four roots at most,
    // and usually two, one of which slides the wrong way. Look in both directions from the slip
    // there was, or the way that the stuck force was too short for.
    enum { sectors = 24 };
    const double step = 2 * 3.14159265358979323846 / sectors;
    const int32_t had_slip = force[1] != 0 || force[2] != 0;
    const double first = had_slip ? atan2(-force[2], -force[1]) : atan2(-stuck[2], -stuck[1]);
    double turn[2], along, best[3] = {-b[0] / a->m[0][0], 0, 0}, least = INFINITY, found[3];
    turn[0] = turn[1] = slide(a, b, mu, first, &along, found);
    for (int k = 1; k <= sectors; k++) {
        // Sectors 1, -1, 2, -2, ... of the first angle.
        const int side = k % 2, number = (k + 1) / 2;
        const double sign = side ? 1 : -1;
        const double from = first + sign * (number - 1) * step, to = first + sign * number * step;
        const double at_to = slide(a, b, mu, to, &along, found);
        const double at_from = turn[side];
        turn[side] = at_to;
        if (along > 0 && fabs(at_to) < least) {
            least = fabs(at_to);
            memcpy(best, found, sizeof best);
        }
        if (!(at_from * at_to <= 0)) continue;
        if (at_from == 0) slide(a, b, mu, from, &along, found);
        else find_slide(a, b, mu, from, to, at_from, at_to, &along, found);
        if (along < 0 || !(found[0] >= 0)) continue;
        memcpy(force, found, sizeof found);
        return;
    }
    memcpy(force, best, sizeof best);
}

// ---- With friction: all contacts ----

// The nearest point of Coulomb's cone |f_t| <= mu f_n.
static void project(double mu, double *f)
{
    const double tangential = hypot(f[1], f[2]);
    if (tangential <= mu * f[0]) return;
    if (mu * tangential <= -f[0]) {
        f[0] = f[1] = f[2] = 0;
        return;
    }
    const double normal = (f[0] + mu * tangential) / (1 + mu * mu);
    const double scale = mu * normal / tangential;
    f[0] = normal;
    f[1] *= scale;
    f[2] *= scale;
}

static double rub_residual(int32_t count, const double *matrix, const double *friction,
                           const double *force, const double *residual)
{
    const size_t n = 3 * (size_t)count;
    double most = 0;
    for (int32_t i = 0; i < count; i++) {
        const double weight = matrix[3 * (size_t)i * n + 3 * (size_t)i];
        const double *f = force + 3 * i, *r = residual + 3 * i;
        const double slip = friction[i] > 0 ? hypot(r[1], r[2]) : 0;
        double target[3] = {f[0] - (r[0] + friction[i] * slip) / weight, f[1] - r[1] / weight,
                            f[2] - r[2] / weight};
        project(friction[i], target);
        for (int c = 0; c < 3; c++) most = fmax(most, weight * fabs(f[c] - target[c]));
    }
    return most;
}

// r += columns 3 i .. 3 i + 2 times x.
PLIANT_VECTOR_CLONES
static void add_columns(size_t n, const double *restrict columns, const double *restrict x,
                        double *restrict r)
{
    const double *restrict second = columns + n, *restrict third = columns + 2 * n;
    for (size_t k = 0; k < n; k++) r[k] += columns[k] * x[0] + second[k] * x[1] + third[k] * x[2];
}

static void sweep(int32_t count, const double *matrix, const double *friction, double *force,
                  double *residual)
{
    const size_t n = 3 * (size_t)count;
    for (int32_t i = 0; i < count; i++) {
        const double *rows = matrix + 3 * (size_t)i * n;
        double *f = force + 3 * i;
        block3 block;
        double alone[3], change[3] = {f[0], f[1], f[2]};
        for (int r = 0; r < 3; r++) {
            memcpy(block.m[r], rows + (size_t)r * n + 3 * (size_t)i, sizeof block.m[r]);
            alone[r] = residual[3 * i + r];
            for (int c = 0; c < 3; c++) alone[r] -= block.m[r][c] * f[c];
        }
        solve_contact(&block, alone, friction[i], f);
        for (int c = 0; c < 3; c++) change[c] = f[c] - change[c];
        if (change[0] != 0 || change[1] != 0 || change[2] != 0)
            add_columns(n, rows, change, residual);
    }
}

// Rows eliminated together, so that the rest of the matrix is read once for all of them.
enum { panel = 8 };

static void swap_rows(int32_t n, int32_t from, double *a, double *x, int32_t i, int32_t k)
{
    double *p = a + (size_t)i * (size_t)n, *q = a + (size_t)k * (size_t)n;
    for (int32_t j = from; j < n; j++) {
        const double kept = p[j];
        p[j] = q[j];
        q[j] = kept;
    }
    const double kept = x[i];
    x[i] = x[k];
    x[k] = kept;
}

// Columns begin .. end - 1: pivots, and factors below them. 0 when a pivot vanished.
static int32_t eliminate_panel(int32_t n, int32_t begin, int32_t end, double *a, double *x)
{
    for (int32_t k = begin; k < end; k++) {
        int32_t best = k;
        for (int32_t i = k + 1; i < n; i++)
            if (fabs(a[(size_t)i * (size_t)n + (size_t)k]) >
                fabs(a[(size_t)best * (size_t)n + (size_t)k]))
                best = i;
        if (best != k) swap_rows(n, begin, a, x, best, k);
        const double *pivot_row = a + (size_t)k * (size_t)n;
        if (pivot_row[k] == 0) return 0;
        for (int32_t i = k + 1; i < n; i++) {
            double *row = a + (size_t)i * (size_t)n;
            row[k] /= pivot_row[k];
            for (int32_t j = k + 1; j < end; j++) row[j] -= row[k] * pivot_row[j];
        }
    }
    return 1;
}

// row -= sum of factors times the panel's rows u, from column `end` on.
PLIANT_VECTOR_CLONES
static void update_row(int32_t n, int32_t end, int32_t count, const double *restrict factor,
                       const double *restrict u, double *restrict row)
{
    const size_t width = (size_t)n;
    if (count == panel) {
        const double f[panel] = {factor[0], factor[1], factor[2], factor[3],
                                 factor[4], factor[5], factor[6], factor[7]};
        for (size_t j = (size_t)end; j < width; j++)
            row[j] -= (f[0] * u[j] + f[1] * u[j + width]) +
                      (f[2] * u[j + 2 * width] + f[3] * u[j + 3 * width]) +
                      (f[4] * u[j + 4 * width] + f[5] * u[j + 5 * width]) +
                      (f[6] * u[j + 6 * width] + f[7] * u[j + 7 * width]);
        return;
    }
    for (int32_t p = 0; p < count; p++)
        for (size_t j = (size_t)end; j < width; j++) row[j] -= factor[p] * u[(size_t)p * width + j];
}

// x = a^-1 x by Gauss's elimination with row pivoting; `a` is row-major [n][n]. 0 when a pivot
// vanished.
static int32_t eliminate(int32_t n, double *a, double *x)
{
    for (int32_t begin = 0; begin < n; begin += panel) {
        const int32_t end = begin + panel < n ? begin + panel : n;
        if (!eliminate_panel(n, begin, end, a, x)) return 0;
        const double *u = a + (size_t)begin * (size_t)n;
        for (int32_t i = begin + 1; i < n; i++) {
            double *row = a + (size_t)i * (size_t)n;
            const int32_t count = i < end ? i - begin : end - begin;
            for (int32_t p = 0; p < count; p++) x[i] -= row[begin + p] * x[begin + p];
            update_row(n, end, count, row + begin, u, row);
        }
    }
    for (int32_t k = n; k-- > 0;) {
        const double *row = a + (size_t)k * (size_t)n;
        double sum = x[k];
        for (int32_t j = k + 1; j < n; j++) sum -= row[j] * x[j];
        x[k] = sum / row[k];
    }
    return 1;
}

// The regimes of `force`: which unknowns there are (3 i: the force of a sliding contact along its
// edge of the cone or of a sticking one's normal, 3 i + 1 and 3 i + 2: a sticking one's tangents),
// and the direction -f_t / f_n of sliding ones.
static int32_t list_unknowns(pliant_contact_law *law, int32_t count, const double *friction,
                             const double *force)
{
    // Sticking contacts are well inside the cone; one that is on it to rounding slides.
    static const double inside = 1 - 1e-9;
    int32_t unknowns = 0;
    for (int32_t i = 0; i < count; i++) {
        const double *f = force + 3 * i;
        double *direction = law->direction + 2 * i;
        direction[0] = direction[1] = 0;
        if (!(f[0] > 0)) continue;
        law->active[unknowns++] = 3 * i;
        if (friction[i] == 0) continue;
        if (hypot(f[1], f[2]) < inside * friction[i] * f[0]) {
            law->active[unknowns++] = 3 * i + 1;
            law->active[unknowns++] = 3 * i + 2;
        } else {
            direction[0] = f[1] / f[0];
            direction[1] = f[2] / f[0];
        }
    }
    return unknowns;
}

// Solve for all contacts in the regimes of `force`; into trial and trial_residual.
static int32_t solve_regimes(pliant_contact_law *law, int32_t count, const double *matrix,
                             const double *b, const double *friction, const double *force)
{
    const size_t n = 3 * (size_t)count;
    const int32_t unknowns = list_unknowns(law, count, friction, force);
    for (int32_t k = 0; k < unknowns; k++) {
        const double *row = matrix + (size_t)law->active[k] * n;
        double *to = law->factor + (size_t)k * (size_t)unknowns;
        for (int32_t j = 0; j < unknowns; j++) {
            const int32_t unknown = law->active[j];
            to[j] = row[unknown];
            if (unknown % 3) continue;
            const double *direction = law->direction + 2 * (unknown / 3);
            to[j] += direction[0] * row[unknown + 1] + direction[1] * row[unknown + 2];
        }
        law->solution[k] = -b[law->active[k]];
    }
    if (!eliminate(unknowns, law->factor, law->solution)) return 0;
    memset(law->trial, 0, n * sizeof *law->trial);
    for (int32_t k = 0; k < unknowns; k++) {
        const int32_t unknown = law->active[k];
        law->trial[unknown] += law->solution[k];
        if (unknown % 3) continue;
        law->trial[unknown + 1] += law->direction[2 * (unknown / 3)] * law->solution[k];
        law->trial[unknown + 2] += law->direction[2 * (unknown / 3) + 1] * law->solution[k];
    }
    for (int32_t i = 0; i < count; i++) project(friction[i], law->trial + 3 * i);
    respond((int32_t)n, matrix, b, law->trial, law->trial_residual);
    return 1;
}

pliant_contact_law_report pliant_contact_law_rub(pliant_contact_law *law, int32_t count,
                                                 const double *matrix, const double *b,
                                                 const double *friction, double tolerance,
                                                 int32_t limit, double *force)
{
    const size_t n = 3 * (size_t)count;
    pliant_contact_law_report report = {0};
    for (int32_t i = 0; i < count; i++) project(friction[i], force + 3 * i);
    respond((int32_t)n, matrix, b, force, law->residual);
    report.residual = rub_residual(count, matrix, friction, force, law->residual);
    // At least one sweep, which leaves no force, however small, where a gap is open.
    const int32_t at_once = sweeps_at_once + count / contacts_a_sweep;
    while ((report.count == 0 || report.residual > tolerance) && report.count < limit) {
        sweep(count, matrix, friction, force, law->residual);
        report.count++;
        report.residual = rub_residual(count, matrix, friction, force, law->residual);
        if (report.residual <= tolerance || report.count % at_once) continue;
        if (!solve_regimes(law, count, matrix, b, friction, force)) continue;
        const double residual =
            rub_residual(count, matrix, friction, law->trial, law->trial_residual);
        if (!(residual < report.residual)) continue;
        report.residual = residual;
        memcpy(force, law->trial, n * sizeof *force);
        memcpy(law->residual, law->trial_residual, n * sizeof *force);
    }
    report.is_done = report.residual <= tolerance;
    return report;
}
