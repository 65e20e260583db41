// test_compliance.c: the contact compliance's eigenvalues against those of the matrix formed densely.
#include "check.h"
#include "surfaces.h"

#include "pliant/compliance.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Columns of a level, sparse in wavelet coefficients, of a field that decays like Kelvin's.
typedef struct block {
    check_surface surface;
    pliant_hierarchy *hierarchy;
    int32_t *nodes, m, level, columns;
    pliant_wavelet *wavelet;
    pliant_hats *hats;
    uint64_t *offset;
    int32_t *row;
    float *value;
} block;

static void exact(const block *b, int32_t i, int32_t j, double *value)
{
    const double *x = b->surface.mesh->vertices + 3 * b->nodes[i], *y = b->surface.mesh->vertices + 3 * b->nodes[j];
    double r[3], square = 0.05;
    for (int c = 0; c < 3; c++) r[c] = x[c] - y[c], square += r[c] * r[c];
    const double size = sqrt(square), lift = (x[2] + 0.6) * (y[2] + 0.6) * b->hats->area[b->level][j];
    for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++) value[3 * c + d] = lift * ((c == d) + r[c] * r[d] / square) / size;
}

// Coefficients under `eps` of their column's largest are dropped.
static block make(pliant_wavelet_def def, int32_t level, double eps)
{
    block b = {.surface = check_blob(2), .level = level};
    b.hierarchy = check_hierarchy(&b.surface);
    b.nodes = malloc((size_t)b.surface.mesh->vertex_count * sizeof *b.nodes);
    for (int32_t v = 0; v < b.surface.mesh->vertex_count; v++)
        if (b.surface.mesh->vertices[3 * v + 2] > -0.5) b.nodes[b.m++] = v;
    pliant_error err;
    check_ok(pliant_wavelet_create(b.hierarchy, b.surface.areas, b.nodes, b.m, &def, &b.wavelet, &err), &err);
    check_ok(pliant_hats_create(b.wavelet, b.nodes, b.surface.areas, &b.hats, &err), &err);
    b.columns = b.hats->level_offset[level + 1];
    b.offset = calloc((size_t)b.columns + 1, sizeof *b.offset);
    b.row = malloc((size_t)b.columns * (size_t)b.m * sizeof *b.row);
    b.value = malloc((size_t)b.columns * (size_t)b.m * 9 * sizeof *b.value);
    double *x = calloc(9 * ((size_t)b.m + 1), sizeof *x);
    uint64_t nnz = 0;
    for (int32_t j = 0; j < b.columns; j++) {
        double peak = 0;
        for (int32_t i = 0; i < b.m; i++) exact(&b, i, j, x + 9 * i);
        for (int32_t e = 0; e < 9 * b.m; e++) peak = fmax(peak, fabs(x[e]));
        memset(x + 9 * b.m, 0, 9 * sizeof *x);
        pliant_wavelet_forward(b.wavelet, 9, x);
        for (int32_t i = 0; i < b.m; i++) {
            double largest = 0;
            for (int e = 0; e < 9; e++) largest = fmax(largest, fabs(x[9 * i + e]));
            if (largest < eps * peak) continue;
            b.row[nnz] = i;
            for (int e = 0; e < 9; e++) b.value[9 * nnz + e] = (float)x[9 * i + e];
            nnz++;
        }
        b.offset[j + 1] = nnz;
    }
    free(x);
    return b;
}

static void destroy(block *b)
{
    free(b->value), free(b->row), free(b->offset);
    pliant_hats_destroy(b->hats);
    pliant_wavelet_destroy(b->wavelet);
    free(b->nodes);
    pliant_hierarchy_destroy(b->hierarchy);
    check_surface_destroy(&b->surface);
}

static pliant_compliance_def def_of(const block *b)
{
    return (pliant_compliance_def){.wavelet = b->wavelet, .hats = b->hats, .level = b->level,
                                   .columns = {b->columns, NULL, b->offset, b->row, b->value}};
}

// M by its definition, row-major; the caller frees.
static double *dense(const block *b)
{
    const int32_t n = 3 * b->columns;
    double *g = calloc((size_t)n * (size_t)n, sizeof *g), *x = calloc(9 * ((size_t)b->m + 1), sizeof *x);
    for (int32_t j = 0; j < b->columns; j++) {
        memset(x, 0, 9 * ((size_t)b->m + 1) * sizeof *x);
        for (uint64_t q = b->offset[j]; q < b->offset[j + 1]; q++)
            for (int e = 0; e < 9; e++) x[9 * b->row[q] + e] = b->value[9 * q + e];
        pliant_wavelet_inverse(b->wavelet, b->wavelet->level_count - 1, 9, x);
        for (int32_t i = 0; i < b->columns; i++)
            for (int e = 0; e < 9; e++)
                g[(3 * i + e / 3) * (size_t)n + 3 * j + e % 3] = b->hats->area[b->level][i] * x[9 * i + e];
    }
    double *m = calloc((size_t)n * (size_t)n, sizeof *m), *scale = calloc((size_t)n, sizeof *scale);
    for (int32_t i = 0; i < n; i++) scale[i] = 1 / sqrt(fabs(g[(size_t)i * n + i]));
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j < n; j++)
            m[(size_t)i * n + j] = (g[(size_t)i * n + j] + g[(size_t)j * n + i]) / 2 * scale[i] * scale[j];
    free(scale), free(g), free(x);
    return m;
}

extern void dsyev_(const char *job, const char *half, const int *n, double *a, const int *lda, double *w,
                   double *work, const int *lwork, int *info);

// LAPACK's extreme eigenvalues; overwrites m.
static void extremes(double *m, int32_t n, double *smallest, double *largest)
{
    const int order = n, room = 8 * n + 8;
    int info;
    double *w = malloc((size_t)n * sizeof *w), *work = malloc((size_t)room * sizeof *work);
    dsyev_("N", "U", &order, m, &order, w, work, &room, &info);
    assert_int_equal(info, 0);
    *smallest = w[0], *largest = w[n - 1];
    free(work), free(w);
}

// What the operator's eigenvalues are known to.
static const double tolerance = 1e-3;

static void eigenvalues_are_those_of_the_dense_matrix(void **state)
{
    (void)state;
    const double eps[] = {0, 0.05, 0.3};
    int negative = 0;
    for (int variant = 0; variant < 4; variant++)
        for (int32_t level = 0; level < 3; level++)
            for (int e = 0; e < (level == 2 ? 1 : 3); e++) {
                const pliant_wavelet_def wavelet = {(pliant_wavelet_scheme)(variant & 1),
                                                    (pliant_wavelet_lifting)(variant >> 1), PLIANT_ZERO};
                block b = make(wavelet, level, eps[e]);
                double smallest, largest, *m = dense(&b);
                extremes(m, 3 * b.columns, &smallest, &largest);
                const pliant_compliance_def def = def_of(&b);
                pliant_lanczos_result found;
                pliant_error err;
                check_ok(pliant_compliance_eigenvalues(&def, &found, &err), &err);
                check_near(found.smallest, smallest, tolerance);
                check_near(found.largest, largest, tolerance);
                negative += smallest < -0.01;
                free(m);
                destroy(&b);
            }
    // Both signs occur.
    assert_in_range(negative, 1, 27);
}

typedef struct counted {
    int calls, values;
} counted;

static void count_sum(void *context, double *values, int32_t count)
{
    counted *c = context;
    c->calls++;
    for (int32_t i = 0; i < count; i++) values[i] *= 1;
    c->values = count;
}

// As a rank holds them: some order of its own. One process holds all here.
static void columns_may_come_in_any_order_and_through_a_sum(void **state)
{
    (void)state;
    block b = make(pliant_wavelet_default(), 1, 0.1);
    pliant_compliance_def def = def_of(&b);
    pliant_lanczos_result plain, shuffled;
    pliant_error err;
    check_ok(pliant_compliance_eigenvalues(&def, &plain, &err), &err);

    int32_t *order = malloc((size_t)b.columns * sizeof *order);
    uint64_t *offset = calloc((size_t)b.columns + 1, sizeof *offset), nnz = b.offset[b.columns];
    int32_t *row = malloc(nnz * sizeof *row);
    float *value = malloc(nnz * 9 * sizeof *value);
    for (int32_t i = 0; i < b.columns; i++) {
        const int32_t j = order[i] = (int32_t)(((int64_t)i * 7 + 3) % b.columns);
        const uint64_t count = b.offset[j + 1] - b.offset[j];
        memcpy(row + offset[i], b.row + b.offset[j], count * sizeof *row);
        memcpy(value + 9 * offset[i], b.value + 9 * b.offset[j], 9 * count * sizeof *value);
        offset[i + 1] = offset[i] + count;
    }
    assert_true(offset[b.columns] == nnz);
    counted c = {0, 0};
    def.columns = (pliant_compliance_columns){b.columns, order, offset, row, value};
    def.sum = count_sum;
    def.context = &c;
    check_ok(pliant_compliance_eigenvalues(&def, &shuffled, &err), &err);
    check_near(shuffled.smallest, plain.smallest, 1e-9);
    check_near(shuffled.largest, plain.largest, 1e-9);
    // Once for the diagonal, once a step: coefficients and the transpose's values together.
    assert_int_equal(c.calls, 1 + shuffled.steps);
    assert_int_equal(c.values, 3 * (b.m + 1 + b.columns));
    free(value), free(row), free(offset), free(order);
    destroy(&b);
}

static void a_level_without_hats_is_refused(void **state)
{
    (void)state;
    block b = make(pliant_wavelet_default(), 0, 0);
    pliant_hats none = *b.hats;
    none.level_offset[1] = 0;
    pliant_compliance_def def = def_of(&b);
    def.hats = &none;
    def.columns.count = 0;
    pliant_lanczos_result found;
    pliant_error err;
    assert_int_equal(pliant_compliance_eigenvalues(&def, &found, &err), PLIANT_ERR_ARGUMENT);
    destroy(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(eigenvalues_are_those_of_the_dense_matrix),
        cmocka_unit_test(columns_may_come_in_any_order_and_through_a_sum),
        cmocka_unit_test(a_level_without_hats_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
