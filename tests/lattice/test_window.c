// test_window.c: sums over windows are sums over windows: exact in integers, and deaf to the rest.
#include "check.h"

#include "lattice/window.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { most_rows = 64, most_blocks = 6, most_fields = PLIANT_WINDOW_FIELDS };

static int whole_number(check_random *random)
{
    return (int)(check_random_next(random) * 41) - 20;
}

// ---- Rows above each other ----

// Kinds of windows that are in use, and odd ones: fields with moments, fields without.
typedef struct kind {
    int32_t with, plain;
} kind;
static const kind kinds[] = {{3, 3}, {3, 6}, {3, 9}, {0, 15}, {0, 6}, {1, 0}, {0, 1}, {2, 5}};
enum { kind_count = sizeof kinds / sizeof *kinds };

typedef struct strip {
    int32_t w, count;  // windows
    float rows[most_rows][most_fields][PLIANT_LANES];
    const float *at[most_rows];
    float sums[most_rows][most_fields][PLIANT_LANES], moments[most_rows][3][PLIANT_LANES];
} strip;

// The counts are constants, as in the kernels.
static void sum_strip(strip *s, int32_t which)
{
    static float tails[PLIANT_WINDOW_LIMIT * 8 * (PLIANT_WINDOW_FIELDS + 3)];
    assert_true(pliant_window_tails(s->w) <= sizeof tails / sizeof *tails);
    for (int32_t k = 0; k < s->count + 2 * s->w; k++) s->at[k] = &s->rows[k][0][0];
    pliant_window window = {.w = s->w, .rows = s->at, .tails = tails};
    for (int32_t k = 0; k < s->count; k++) {
        pliant_f8 out[most_fields], moments[3];
        switch (which) {
        case 0:
            pliant_window_next(&window, k, 3, 3, out, moments);
            break;
        case 1:
            pliant_window_next(&window, k, 3, 6, out, moments);
            break;
        case 2:
            pliant_window_next(&window, k, 3, 9, out, moments);
            break;
        case 3:
            pliant_window_next(&window, k, 0, 15, out, moments);
            break;
        case 4:
            pliant_window_next(&window, k, 0, 6, out, moments);
            break;
        case 5:
            pliant_window_next(&window, k, 1, 0, out, moments);
            break;
        case 6:
            pliant_window_next(&window, k, 0, 1, out, moments);
            break;
        default:
            pliant_window_next(&window, k, 2, 5, out, moments);
            break;
        }
        for (int32_t f = 0; f < kinds[which].with + kinds[which].plain; f++)
            pliant_f8_store(s->sums[k][f], out[f]);
        for (int32_t f = 0; f < kinds[which].with; f++)
            pliant_f8_store(s->moments[k][f], moments[f]);
    }
}

static void sums_of_rows_are_exact_in_integers(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    static strip s;
    for (int32_t w = 1; w <= PLIANT_LATTICE_WIDTH_LIMIT; w++)
        for (int32_t which = 0; which < kind_count; which++)
            for (s.count = 1; s.count + 2 * w <= most_rows; s.count += 1 + s.count / 3) {
                s.w = w;
                float *values = &s.rows[0][0][0];
                for (size_t i = 0; i < sizeof s.rows / sizeof(float); i++)
                    values[i] = (float)whole_number(&random);
                sum_strip(&s, which);
                for (int32_t k = 0; k < s.count; k++)
                    for (int32_t f = 0; f < kinds[which].with + kinds[which].plain; f++)
                        for (int lane = 0; lane < PLIANT_LANES; lane++) {
                            double sum = 0, moment = 0;
                            for (int32_t t = 0; t <= 2 * w; t++) {
                                sum += (double)s.rows[k + t][f][lane];
                                moment += (t - w) * (double)s.rows[k + t][f][lane];
                            }
                            check_near((double)s.sums[k][f][lane], sum, 0);
                            if (f < kinds[which].with)
                                check_near((double)s.moments[k][f][lane], moment, 0);
                        }
            }
}

// Huge values, infinity and what is no number: windows that do not hold them have the same bits.
static void rows_are_deaf_to_what_is_outside(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    static strip s, disturbed;
    const float loud[] = {1e30f, 3e38f, INFINITY, NAN};
    for (int32_t w = 1; w <= PLIANT_LATTICE_WIDTH_LIMIT; w++)
        for (int32_t which = 0; which < kind_count; which++)
            for (int32_t row = 0; row < most_rows; row += 5) {
                s.w = w;
                s.count = most_rows - 2 * w;
                float *values = &s.rows[0][0][0];
                for (size_t i = 0; i < sizeof s.rows / sizeof(float); i++)
                    values[i] = (float)(check_random_next(&random) - 0.5);
                memcpy(&disturbed, &s, sizeof s);
                for (int f = 0; f < most_fields; f++)
                    for (int lane = 0; lane < PLIANT_LANES; lane++)
                        disturbed.rows[row][f][lane] = loud[(row / 5 + lane) % 4];
                sum_strip(&s, which);
                sum_strip(&disturbed, which);
                for (int32_t k = 0; k < s.count; k++) {
                    if (k <= row && row <= k + 2 * w) continue;
                    assert_memory_equal(s.sums[k], disturbed.sums[k],
                                        (size_t)(kinds[which].with + kinds[which].plain) *
                                            sizeof s.sums[k][0]);
                    assert_memory_equal(s.moments[k], disturbed.moments[k],
                                        (size_t)kinds[which].with * sizeof s.moments[k][0]);
                }
            }
}

// ---- Rows of lanes ----

enum { row_floats = most_blocks * PLIANT_LANES + 3 * PLIANT_ROW_PAD };

typedef struct lanes {
    int32_t blocks, w, apart;  // floats between blocks of the results
    float row[row_floats], more[row_floats];
    float sums[most_blocks * 48], moments[most_blocks * 48];
    int32_t has_moments, has_more;
} lanes;

static void sum_lanes(lanes *l)
{
    static float scratch[4 * row_floats];
    memset(scratch, 0xff, sizeof scratch);  // whatever is there must not matter
    assert_true(pliant_row_length(l->blocks) <= row_floats);
    pliant_window_along(l->row + PLIANT_ROW_PAD, l->has_more ? l->more + PLIANT_ROW_PAD : NULL,
                        l->blocks, l->w, scratch, l->sums, l->has_moments ? l->moments : NULL,
                        (size_t)l->apart);
}

static void sums_along_rows_are_exact_in_integers(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    static lanes l;
    for (l.w = 1; l.w <= PLIANT_LATTICE_WIDTH_LIMIT; l.w++)
        for (l.blocks = 1; l.blocks <= most_blocks; l.blocks++)
            for (int turn = 0; turn < 6; turn++) {
                l.apart = turn % 2 ? 48 : PLIANT_LANES;
                l.has_moments = turn < 4;
                l.has_more = turn < 2;
                memset(l.row, 0, sizeof l.row);
                memset(l.more, 0, sizeof l.more);
                for (int32_t i = 0; i < l.blocks * PLIANT_LANES; i++) {
                    l.row[PLIANT_ROW_PAD + i] = (float)whole_number(&random);
                    l.more[PLIANT_ROW_PAD + i] = (float)whole_number(&random);
                }
                sum_lanes(&l);
                for (int32_t i = 0; i < l.blocks * PLIANT_LANES; i++) {
                    double sum = 0, moment = 0;
                    for (int32_t t = -l.w; t <= l.w; t++) {
                        sum += (double)l.row[PLIANT_ROW_PAD + i + t];
                        moment += t * (double)l.row[PLIANT_ROW_PAD + i + t];
                        if (l.has_more) moment += (double)l.more[PLIANT_ROW_PAD + i + t];
                    }
                    const int32_t at = i / PLIANT_LANES * l.apart + i % PLIANT_LANES;
                    check_near((double)l.sums[at], sum, 0);
                    if (l.has_moments) check_near((double)l.moments[at], moment, 0);
                }
            }
}

static void lanes_are_deaf_to_what_is_outside(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    static lanes l, disturbed;
    const float loud[] = {1e30f, 3e38f, INFINITY, NAN};
    l.apart = PLIANT_LANES;
    l.has_moments = l.has_more = 1;
    for (l.w = 1; l.w <= PLIANT_LATTICE_WIDTH_LIMIT; l.w++)
        for (l.blocks = 1; l.blocks <= most_blocks; l.blocks++)
            for (int32_t place = 0; place < l.blocks * PLIANT_LANES; place++) {
                for (int32_t i = 0; i < l.blocks * PLIANT_LANES; i++) {
                    l.row[PLIANT_ROW_PAD + i] = (float)(check_random_next(&random) - 0.5);
                    l.more[PLIANT_ROW_PAD + i] = (float)(check_random_next(&random) - 0.5);
                }
                memcpy(&disturbed, &l, sizeof l);
                disturbed.row[PLIANT_ROW_PAD + place] = loud[place % 4];
                disturbed.more[PLIANT_ROW_PAD + place] = loud[place % 3];
                sum_lanes(&l);
                sum_lanes(&disturbed);
                for (int32_t i = 0; i < l.blocks * PLIANT_LANES; i++) {
                    if (abs(i - place) <= l.w) continue;
                    assert_memory_equal(&l.sums[i], &disturbed.sums[i], sizeof(float));
                    assert_memory_equal(&l.moments[i], &disturbed.moments[i], sizeof(float));
                }
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_of_rows_are_exact_in_integers),
        cmocka_unit_test(rows_are_deaf_to_what_is_outside),
        cmocka_unit_test(sums_along_rows_are_exact_in_integers),
        cmocka_unit_test(lanes_are_deaf_to_what_is_outside),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
