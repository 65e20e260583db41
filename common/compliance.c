// compliance.c: the contact compliance of one level as a symmetric operator, and how definite it
// is.
#include "pliant/compliance.h"

#include "pliant/arena.h"
#include "pliant/error.h"

#include <math.h>
#include <string.h>

enum {
    group = 8,  // columns that go through the inverse transform together
    entries = 9,
    width = group * entries,
};

// A diagonal that compression destroyed, under 2^-20 of the largest, says nothing about its vertex,
// which then counts as one of the largest: as the runtime's capacitance does.
static const double least_diagonal = 0x1p-20;

// What the eigenvalues are known to; the diagonal is 1. A tenth of it takes twice as many steps
// where the small ones are crowded (357 and 727 on a smooth body of 2562 vertices) and changes
// 1e-4.
static const double tolerance = 1e-3;
// Measured: 50 to 510 steps do for blocks of 2562 and 9920 vertices.
static const int32_t step_capacity = 6000;

typedef struct operator
{
    pliant_compliance_def def;
    int32_t rows, columns;  // positions of the row domain; hats of the level
    pliant_arena arena;
    double *scale;  // [columns][3]: D^-1/2
    double *
        gather;  // [rows + 1][3] coefficients, then [columns][3] of the transpose: added up at once
    double *spread;  // [rows + 1][3]
    double *group;   // [rows + 1][entries][group]
}
operator;

static void lay_out(operator* o)
{
    const size_t rows = (size_t)o->rows + 1;
    PLIANT_TAKE(&o->arena, o->scale, 3 * (size_t)o->columns);
    PLIANT_TAKE(&o->arena, o->gather, 3 * (rows + (size_t)o->columns));
    PLIANT_TAKE(&o->arena, o->spread, 3 * rows);
    PLIANT_TAKE(&o->arena, o->group, rows * width);
}

static int32_t column_of(const pliant_compliance_columns *c, int32_t i)
{
    return c->column ? c->column[i] : i;
}

static void add_up(const operator* o, double *values, int32_t count)
{
    if (o->def.sum) o->def.sum(o->def.context, values, count);
}

// The diagonal of A G, and from it the scale.
static void find_scale(operator* o)
{
    const pliant_compliance_columns *c = &o->def.columns;
    const double *area = o->def.hats->area[o->def.level];
    for (int32_t first = 0; first < c->count; first += group) {
        const int32_t size = c->count - first < group ? c->count - first : group;
        memset(o->group, 0, ((size_t)o->rows + 1) * width * sizeof *o->group);
        for (int32_t k = 0; k < size; k++)
            for (uint64_t q = c->offset[first + k]; q < c->offset[first + k + 1]; q++)
                for (int e = 0; e < entries; e++)
                    o->group[(size_t)c->row[q] * width + e * group + k] = c->block[entries * q + e];
        pliant_wavelet_inverse(o->def.wavelet, o->def.wavelet->level_count - 1, width, o->group);
        for (int32_t k = 0; k < size; k++) {
            const int32_t j = column_of(c, first + k);
            for (int d = 0; d < 3; d++)
                o->scale[3 * (size_t)j + d] =
                    fabs(area[j] * o->group[(size_t)j * width + 4 * d * group + k]);
        }
    }
    add_up(o, o->scale, 3 * o->columns);
    double most = 0;
    for (int32_t i = 0; i < 3 * o->columns; i++) most = fmax(most, o->scale[i]);
    for (int32_t i = 0; i < 3 * o->columns; i++) {
        const double diagonal = o->scale[i] >= least_diagonal * most ? o->scale[i] : most;
        o->scale[i] = diagonal > 0 && isfinite(1 / sqrt(diagonal)) ? 1 / sqrt(diagonal) : 1;
    }
}

// y = M x. A G s is the sum of columns, transformed back, at the level's own vertices; its
// transpose goes the other way round.
static void apply(void *context, double *x, double *y)
{
    operator* o = context;
    const pliant_compliance_columns *c = &o->def.columns;
    const pliant_wavelet *w = o->def.wavelet;
    const double *area = o->def.hats->area[o->def.level];
    const size_t values = 3 * (size_t)o->columns, coefficients = 3 * ((size_t)o->rows + 1);
    double *forward = o->gather, *backward = o->gather + coefficients;
    for (size_t i = 0; i < values; i++) x[i] *= o->scale[i];

    for (size_t i = 0; i < values; i++) o->spread[i] = area[i / 3] * x[i];
    memset(o->spread + values, 0, (coefficients - values) * sizeof *o->spread);
    pliant_wavelet_inverse_transpose(w, 3, o->spread);
    memset(o->gather, 0, (coefficients + values) * sizeof *o->gather);
    for (int32_t i = 0; i < c->count; i++) {
        const size_t j = 3 * (size_t)column_of(c, i);
        double sum[3] = {0};
        for (uint64_t q = c->offset[i]; q < c->offset[i + 1]; q++) {
            const float *block = c->block + entries * q;
            double *to = forward + 3 * (size_t)c->row[q];
            const double *from = o->spread + 3 * (size_t)c->row[q];
            for (int r = 0; r < 3; r++)
                for (int d = 0; d < 3; d++) {
                    to[r] += block[3 * r + d] * x[j + d];
                    sum[d] += block[3 * r + d] * from[r];
                }
        }
        for (int d = 0; d < 3; d++) backward[j + d] = sum[d];
    }
    add_up(o, o->gather, (int32_t)(coefficients + values));
    pliant_wavelet_inverse(w, w->level_count - 1, 3, forward);
    for (size_t i = 0; i < values; i++)
        y[i] = o->scale[i] * (area[i / 3] * forward[i] + backward[i]) / 2;
}

pliant_status pliant_compliance_eigenvalues(const pliant_compliance_def *def,
                                            pliant_lanczos_result *result, pliant_error *err)
{
    operator o = {.def = *def,
                  .rows = def->wavelet->count,
                  .columns = def->hats->level_offset[def->level + 1]};
    lay_out(&o);
    pliant_status status = pliant_arena_reserve(&o.arena, err);
    if (status < 0) return status;
    lay_out(&o);
    find_scale(&o);
    const pliant_lanczos_def lanczos = {.n = 3 * o.columns,
                                        .apply = apply,
                                        .context = &o,
                                        .tolerance = tolerance,
                                        .step_capacity = step_capacity};
    status = pliant_lanczos_extremes(&lanczos, result, err);
    pliant_arena_release(&o.arena);
    return status;
}
