// cost.c: what the steps of a contact solve take on this machine, from their operation counts.
#include "cost.h"

#include "dense.h"

#include <math.h>

// Sizes that are timed: the larger fits a 2 MB cache as two double matrices.
enum { small_count = 6, large_count = 48, repeats = 3 };
// A prediction moves by a tenth of what it was off by, and by no more than this factor at once: a
// step that the system interrupted says nothing about the next.
static const double learning_rate = 0.1, largest_surprise = 2;

// As calibrated on a 2.0 GHz Sapphire Rapids at 18 blocks a column (2562 vertices).
static const pliant_cost typical = {.node = 1200,
                                    .block = 18,
                                    .square = 17,
                                    .cube = 0.03,
                                    .update_node = 510,
                                    .update_square = 0.1,
                                    .build_trust = 1,
                                    .update_trust = 1};

static double smaller(double a, double b)
{
    return a < b ? a : b;
}

// Neighbours on the finest stored level, as contacts are; at most half of what there is.
static int32_t list_nodes(const pliant_model *model, int32_t count, int32_t first,
                          pliant_node *nodes)
{
    const pliant_model_domain *domain = &model->domains[PLIANT_DOMAIN_FREE];
    const int32_t level = model->finest_stored;
    const int32_t available = domain->wavelet->level_offset[level + 1];
    if (count > available / 2) count = available / 2;
    if (first + count > available) first = available - count;
    for (int32_t i = 0; i < count; i++) nodes[i] = (pliant_node){level, domain->nodes[first + i]};
    return count;
}

typedef struct timing {
    double extract, invert, update, contact;  // ns
} timing;

static double since(int64_t begin)
{
    return (double)(pliant_clock_ns() - begin);
}

// The best of a few runs: what interrupts is not counted. `count` nodes, and one more that takes
// the place of one of them in the update.
static timing time_count(const pliant_model *model, const pliant_node *nodes, int32_t count,
                         pliant_capacitance_scratch *scratch, pliant_capacitance *type)
{
    timing best = {INFINITY, INFINITY, INFINITY, INFINITY};
    for (int run = 0; run < repeats; run++) {
        int64_t begin = pliant_clock_ns();
        for (int32_t i = 0; i < count; i++) type->order[i] = i;
        pliant_capacitance_plan(model, nodes, count, scratch, type);
        pliant_capacitance_extract(model, type, scratch, type->matrix);
        best.extract = smaller(best.extract, since(begin));
        begin = pliant_clock_ns();
        pliant_capacitance_invert(model, scratch, type);
        best.invert = smaller(best.invert, since(begin));
        // Vectors of zeros: the values do not matter, the bytes do.
        begin = pliant_clock_ns();
        pliant_dense_multiply(3 * (size_t)count, type->stride, type->product, scratch->blocks,
                              (float *)scratch->work);
        best.contact = smaller(best.contact, since(begin));
        begin = pliant_clock_ns();
        (void)pliant_capacitance_update(model, nodes + 1, count, scratch, type);
        best.update = smaller(best.update, since(begin));
    }
    return best;
}

// a x + b x^2 through (x0, y0), (x1, y1) with both factors at least 0.
static void fit(double x0, double y0, double x1, double y1, double *a, double *b)
{
    *b = x1 > x0 ? fmax(0, (y1 / x1 - y0 / x0) / (x1 - x0)) : 0;
    *a = fmax(0, y1 / x1 - *b * x1);
}

void pliant_cost_calibrate(pliant_cost *cost, const pliant_model *model, int32_t capacity,
                           pliant_columns_kernel *add_column, float *rows,
                           pliant_capacitance_scratch *scratch, pliant_capacitance *type)
{
    *cost = (pliant_cost){.build_trust = 1, .update_trust = 1};
    pliant_node nodes[large_count + 1];
    const int32_t wanted = capacity < large_count ? capacity : large_count;
    const int32_t count =
        list_nodes(model, wanted + 1, model->domains[PLIANT_DOMAIN_FREE].count / 2, nodes) - 1;
    if (count < 1) return;
    const int32_t few = count < small_count ? count : small_count;
    const timing small = time_count(model, nodes, few, scratch, type);
    const timing large = time_count(model, nodes, count, scratch, type);
    const double s0 = few, s1 = count, n0 = 3 * s0, n1 = 3 * s1;
    fit(s0, small.extract, s1, large.extract, &cost->node, &cost->block);
    // c n^2 + d n^3, and e s + f n^2 four times.
    fit(n0, small.invert / n0, n1, large.invert / n1, &cost->square, &cost->cube);
    fit(s0, small.update / 4, s1, large.update / 4, &cost->update_node, &cost->update_square);
    cost->update_square /= 9;
    cost->contact_square = large.contact / (n1 * n1);

    const float none[3] = {0, 0, 0};
    uint64_t blocks = 0;
    const int64_t begin = pliant_clock_ns();
    for (int32_t i = 0; i < count; i++) {
        const pliant_columns *columns = pliant_model_columns(model, PLIANT_DOMAIN_FREE, nodes[i]);
        const uint64_t *offset = columns->offset + model->position[nodes[i].vertex];
        add_column(columns->row + offset[0], columns->block + 9 * offset[0],
                   (size_t)(offset[1] - offset[0]), none, rows);
        blocks += offset[1] - offset[0];
    }
    cost->sum_block = blocks > 0 ? since(begin) / (double)blocks : 0;
}

double pliant_cost_of_build(const pliant_cost *cost, int32_t count)
{
    const double s = count, n = 3 * s;
    return cost->build_trust *
           (cost->node * s + cost->block * s * s + cost->square * n * n + cost->cube * n * n * n);
}

double pliant_cost_of_update(const pliant_cost *cost, int32_t count,
                             pliant_capacitance_difference difference)
{
    const double s = count + difference.dropped, n = 3 * s;
    return cost->update_trust * (difference.dropped + difference.added + 2) *
           (cost->update_node * s + cost->update_square * n * n);
}

double pliant_cost_of_contact(const pliant_cost *cost, int32_t count, uint64_t blocks)
{
    const double n = 3.0 * count;
    return cost->contact_square * n * n + cost->sum_block * (double)blocks;
}

int32_t pliant_cost_prefers_update(int32_t count, pliant_capacitance_difference difference)
{
    return pliant_cost_of_update(&typical, count, difference) <
           pliant_cost_of_build(&typical, count);
}

void pliant_cost_learn(double *trust, double predicted, double measured)
{
    if (!(predicted > 0)) return;
    const double ratio = fmin(largest_surprise, fmax(1 / largest_surprise, measured / predicted));
    *trust = fmin(1e3, fmax(1e-3, *trust * (1 + learning_rate * (ratio - 1))));
}
