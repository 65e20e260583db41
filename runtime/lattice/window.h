// window.h: sums over windows of 2w + 1 rows at a cost that does not depend on w (LSM-4..7).
//
// LSM-5..7 slide a sum along: add what enters, subtract what leaves. In floats that keeps the
// rounding of everything that ever passed: one particle thrown far away spoils all sums after it.
// Here nothing is subtracted. The rows are cut into runs of 2w + 1; a window lies in two
// neighbouring runs, so that it is a tail of one and a head of the next (van Herk, Pattern
// Recognition Letters 13, 1992; Gil and Werman, PAMI 15, 1993): three additions a row, whatever w
// is. Along x, where the rows are lanes, windows are doubled: sums of 2, 4, 8, ... neighbours, of
// which a window is made.
//
// First moments about the window's middle come along: M = sum of (t - middle) v_t. For tails and
// heads they too are kept by additions alone.
#pragma once

#include "lattice/lattice.h"

#include <string.h>

// Eight lanes; loads and stores anywhere. The compiler lowers it to what the machine has.
typedef float pliant_f8 __attribute__((vector_size(32), may_alias));
typedef float pliant_f8_anywhere __attribute__((vector_size(32), aligned(4), may_alias));
typedef int32_t pliant_bits8 __attribute__((vector_size(32)));
typedef float pliant_f4 __attribute__((vector_size(16), aligned(4), may_alias));
typedef int16_t pliant_shorts8 __attribute__((vector_size(16), aligned(2), may_alias));
#define PLIANT_INLINE static inline __attribute__((always_inline))

// (Macros: vectors as arguments and results would pass differently from clone to clone.)
#define pliant_f8_load(p)     ((pliant_f8)(*(const pliant_f8_anywhere *)(const void *)(p)))
#define pliant_f8_store(p, v) (*(pliant_f8_anywhere *)(void *)(p) = (v))
#define pliant_f4_load(p)     (*(const pliant_f4 *)(const void *)(p))
#define pliant_f4_store(p, v) (*(pliant_f4 *)(void *)(p) = (v))
#define pliant_f8_of(p0, p1, p2, p3, p4, p5, p6, p7, v)                                            \
    __builtin_shufflevector((v), (v), p0, p1, p2, p3, p4, p5, p6, p7)
#define pliant_f8_all(x) ((pliant_f8){0} + (x))

// Eight small whole numbers, as floats.
#define pliant_f8_steps(p)                                                                         \
    __builtin_convertvector(                                                                       \
        __builtin_convertvector(*(const pliant_shorts8 *)(const void *)(p), pliant_bits8),         \
        pliant_f8)

// ---- Rows above each other ----

// What a window adds up of a row of `with + plain` fields: sums of all, moments of the first
// `with`.
typedef struct pliant_window {
    int32_t w;
    const float *const *rows;  // rows[s .. s + 2w] make window s; fields of 8 floats each
    float *tails;  // shape [2w + 1][2 with + plain][8]: moments, sums of the first, the plain
    pliant_f8 head[18], head_moment[3];
} pliant_window;

#define PLIANT_WINDOW_FIELDS 18  // with moments and without, of one kind of row

// Up to here windows are added up directly, which is as quick, and may be left out.
#define PLIANT_WINDOW_DIRECT 2

// The sums of window s, for s = 0, 1, 2, ... in turn: out[with + plain] sums, then moments[with].
PLIANT_INLINE void pliant_window_next(pliant_window *window, int32_t s, const int32_t with,
                                      const int32_t plain, pliant_f8 *out, pliant_f8 *moments)
{
    const int32_t w = window->w, b = 2 * w + 1, fields = with + plain;
    const float *const *rows = window->rows;
    if (w == 1) {
        const float *below = rows[s], *here = rows[s + 1], *above = rows[s + 2];
        for (int32_t f = 0; f < fields; f++) {
            const pliant_f8 low = pliant_f8_load(below + 8 * f),
                            high = pliant_f8_load(above + 8 * f);
            out[f] = low + high + pliant_f8_load(here + 8 * f);
            if (f < with) moments[f] = high - low;
        }
        return;
    }
    if (w == 2) {
        const float *const *r = rows + s;
        for (int32_t f = 0; f < fields; f++) {
            const pliant_f8 v0 = pliant_f8_load(r[0] + 8 * f), v1 = pliant_f8_load(r[1] + 8 * f);
            const pliant_f8 v3 = pliant_f8_load(r[3] + 8 * f), v4 = pliant_f8_load(r[4] + 8 * f);
            out[f] = (v0 + v4) + (v1 + v3) + pliant_f8_load(r[2] + 8 * f);
            if (f < with) moments[f] = 2 * (v4 - v0) + (v3 - v1);
        }
        return;
    }
    const int32_t r = s % b, stride = 8 * (2 * with + plain);
    const pliant_f8 half = pliant_f8_all((float)w), zero = {0};
    if (r == 0) {
        // Tails, from the end of the run: with the middle at the tail's first row the moment grows
        // by the sum so far for every row that is put in front.
        pliant_f8 sum[PLIANT_WINDOW_FIELDS], moment[3];
        for (int32_t f = 0; f < fields; f++) sum[f] = zero;
        for (int32_t f = 0; f < with; f++) moment[f] = zero;
        for (int32_t t = b - 1; t >= 0; t--) {
            float *tail = window->tails + (size_t)t * stride;
            for (int32_t f = 0; f < with; f++) {
                moment[f] += sum[f];
                pliant_f8_store(tail + 8 * f, moment[f]);
            }
            for (int32_t f = 0; f < fields; f++) {
                sum[f] += pliant_f8_load(rows[s + t] + 8 * f);
                pliant_f8_store(tail + 8 * (with + f), sum[f]);
            }
        }
        for (int32_t f = 0; f < fields; f++) window->head[f] = zero, out[f] = sum[f];
        for (int32_t f = 0; f < with; f++) {
            window->head_moment[f] = zero;
            moments[f] = moment[f] - half * sum[f];
        }
        return;
    }
    const float *tail = window->tails + (size_t)r * stride, *row = rows[s + b - 1];
    for (int32_t f = 0; f < with; f++) {
        window->head_moment[f] -= window->head[f];
        const pliant_f8 head = window->head[f] + pliant_f8_load(row + 8 * f);
        const pliant_f8 sum = pliant_f8_load(tail + 8 * (with + f));
        moments[f] = (pliant_f8_load(tail + 8 * f) + window->head_moment[f]) + half * (head - sum);
        window->head[f] = head;
        out[f] = sum + head;
    }
    for (int32_t f = with; f < fields; f++) {
        window->head[f] += pliant_f8_load(row + 8 * f);
        out[f] = pliant_f8_load(tail + 8 * (with + f)) + window->head[f];
    }
}

// Floats of `tails` for any kind of row.
static inline size_t pliant_window_tails(int32_t w)
{
    return (size_t)(2 * w + 1) * 8 * (PLIANT_WINDOW_FIELDS + 3);
}

// ---- Rows of lanes ----

// Zeros before and after a row, as far as a window or a step of doubling looks.
#define PLIANT_ROW_PAD 16

// Floats of a row of `blocks` blocks with its zeros.
static inline size_t pliant_row_length(int32_t blocks)
{
    return (size_t)blocks * PLIANT_LANES + 3 * PLIANT_ROW_PAD;
}

// Sums and moments over the window of every place of a row: `v` is its place 0 within a padded row,
// out and moment hold `blocks` blocks, `apart` floats apart; moment may be NULL. With `more`, a row
// like v, its sums are added to the moments. `scratch` has room for 4 padded rows.
PLIANT_INLINE void pliant_window_along(const float *v, const float *more, int32_t blocks, int32_t w,
                                       float *scratch, float *out, float *moment, size_t apart)
{
    if (w == 1) {
        for (int32_t k = 0; k < blocks; k++) {
            const float *at = v + 8 * k;
            const pliant_f8 low = pliant_f8_load(at - 1), high = pliant_f8_load(at + 1);
            pliant_f8_store(out + apart * k, low + high + pliant_f8_load(at));
            if (!moment) continue;
            pliant_f8 difference = high - low;
            if (more) {
                const float *there = more + 8 * k;
                difference +=
                    pliant_f8_load(there - 1) + pliant_f8_load(there + 1) + pliant_f8_load(there);
            }
            pliant_f8_store(moment + apart * k, difference);
        }
        return;
    }
    if (w == 2) {
        for (int32_t k = 0; k < blocks; k++) {
            const float *at = v + 8 * k;
            const pliant_f8 v0 = pliant_f8_load(at - 2), v1 = pliant_f8_load(at - 1);
            const pliant_f8 v3 = pliant_f8_load(at + 1), v4 = pliant_f8_load(at + 2);
            pliant_f8_store(out + apart * k, (v0 + v4) + (v1 + v3) + pliant_f8_load(at));
            if (!moment) continue;
            pliant_f8 difference = 2 * (v4 - v0) + (v3 - v1);
            if (more) {
                const float *there = more + 8 * k;
                difference += (pliant_f8_load(there - 2) + pliant_f8_load(there + 2)) +
                              (pliant_f8_load(there - 1) + pliant_f8_load(there + 1)) +
                              pliant_f8_load(there);
            }
            pliant_f8_store(moment + apart * k, difference);
        }
        return;
    }
    // s and m: sums and moments about the first place of `width` places from each place on, width 1
    // being the rows themselves. A window of 2w + 1 = 1 + 2 + 4 + ... (its binary digits) is picked
    // up as the widths come by: first 1, then `covered` grows by each.
    const int32_t count = blocks * PLIANT_LANES + (2 * w + 7) / 8 * 8;  // places from -w on
    const size_t length = pliant_row_length(blocks);
    float *s2 = scratch, *m2 = s2 + length, *s3 = m2 + length, *m3 = s3 + length;
    const float *s = v - w, *m = more ? more - w : NULL;
    for (int32_t k = 0; k < blocks; k++) {
        pliant_f8 first = {0};
        if (m) first += pliant_f8_load(m + 8 * k);
        pliant_f8_store(out + apart * k, pliant_f8_load(s + 8 * k));
        if (moment) pliant_f8_store(moment + apart * k, first);
    }
    const pliant_f8 half = pliant_f8_all((float)w);
    int32_t covered = 1;
    for (int32_t width = 1, digits = (2 * w + 1) >> 1; digits; digits >>= 1, width *= 2) {
        const pliant_f8 step = pliant_f8_all((float)width);
        for (int32_t i = 0; i + width < count; i += 8) {
            const pliant_f8 next = pliant_f8_load(s + i + width);
            pliant_f8_store(s2 + i, pliant_f8_load(s + i) + next);
            if (!moment) continue;
            pliant_f8 both = step * next;
            if (m) both += pliant_f8_load(m + i) + pliant_f8_load(m + i + width);
            pliant_f8_store(m2 + i, both);
        }
        s = s2, m = moment ? m2 : NULL;
        s2 = s3, s3 = (float *)s;
        m2 = m3, m3 = (float *)m;
        if (!(digits & 1)) continue;
        const pliant_f8 offset = pliant_f8_all((float)covered);
        for (int32_t k = 0; k < blocks; k++) {
            const pliant_f8 sum = pliant_f8_load(s + 8 * k + covered);
            const pliant_f8 total = pliant_f8_load(out + apart * k) + sum;
            pliant_f8_store(out + apart * k, total);
            if (!moment) continue;
            pliant_f8 about = pliant_f8_load(moment + apart * k) +
                              pliant_f8_load(m + 8 * k + covered) + offset * sum;
            if (digits == 1) about -= half * total;  // about the middle, at last
            pliant_f8_store(moment + apart * k, about);
        }
        covered += 2 * width;
    }
}
