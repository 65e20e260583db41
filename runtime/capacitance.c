// capacitance.c: the capacitance matrix of one boundary-value-problem type and its inverse.
#include "capacitance.h"

#include "bordering.h"
#include "dense.h"
#include "pliant/vector_clones.h"

#include <math.h>
#include <string.h>

enum { block_floats = 16 };  // a slot of pliant_reconstruction_run_blocks

// Least eigenvalue of a passive M, whose diagonal is one: far above float rounding, far below what
// sound patches have (0.04 to 0.12 for the whole of the evaluation mesh blob_L4).
static const double definite_floor = 0x1p-10;
// Passive shifts are tried in these steps: at most that much softer than need be.
static const double shift_factor = 1.25;
// Updates go on until the inverse misses by this; a fresh one of a sound patch misses by some
// 1e-14, and the product kept for solves is in floats.
static const double drift_limit = 1e-9;

int32_t pliant_capacitance_domain_count(const pliant_model *model)
{
    return model->view.has_supports ? 2 : 1;
}

// ---- Life ----

void pliant_capacitance_lay_out(pliant_arena *arena, const pliant_model *model, int32_t capacity,
                                pliant_capacitance *capacitance)
{
    const size_t n = 3 * (size_t)capacity;
    capacitance->leading = pliant_dense_leading(n);
    PLIANT_TAKE(arena, capacitance->nodes, capacity);
    PLIANT_TAKE(arena, capacitance->order, capacity);
    PLIANT_TAKE(arena, capacitance->slot, capacity);
    PLIANT_TAKE(arena, capacitance->scale, n);
    PLIANT_TAKE(arena, capacitance->matrix, n * capacitance->leading);
    PLIANT_TAKE(arena, capacitance->inverse, n * capacitance->leading);
    PLIANT_TAKE(arena, capacitance->product, n * pliant_dense_stride(n));
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++)
        pliant_reconstruction_lay_out(arena, model->domains[d].wavelet, &capacitance->plan[d]);
}

void pliant_capacitance_scratch_lay_out(pliant_arena *arena, const pliant_model *model,
                                        int32_t capacity, pliant_capacitance_scratch *scratch)
{
    const size_t n = 3 * (size_t)capacity, leading = pliant_dense_leading(n);
    const size_t dense = pliant_dense_work_count(n), bordering = 12 * leading;
    int32_t slots = 0;
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++) {
        pliant_reconstruction_scratch_lay_out(arena, model->domains[d].wavelet,
                                              &scratch->domain[d]);
        pliant_reconstruction_lay_out(arena, model->domains[d].wavelet, &scratch->border[d]);
        if (model->domains[d].count > slots) slots = model->domains[d].count;
    }
    PLIANT_TAKE(arena, scratch->positions, capacity);
    PLIANT_TAKE(arena, scratch->index, capacity);
    PLIANT_TAKE(arena, scratch->slots, capacity);
    PLIANT_TAKE(arena, scratch->added, capacity);
    PLIANT_TAKE(arena, scratch->border_slot, capacity);
    PLIANT_TAKE(arena, scratch->pivots, n);
    PLIANT_TAKE(arena, scratch->work_matrix, n * leading);
    PLIANT_TAKE(arena, scratch->work, dense > bordering ? dense : bordering);
    PLIANT_TAKE(arena, scratch->vectors, 6 * leading);
    PLIANT_TAKE(arena, scratch->blocks, (size_t)slots * block_floats);
}

void pliant_capacitance_scratch_begin(const pliant_model *model, pliant_compliance compliance,
                                      pliant_capacitance_scratch *scratch)
{
    scratch->compliance = compliance;
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++)
        pliant_reconstruction_scratch_begin(model->domains[d].wavelet, &scratch->domain[d]);
}

// ---- Extraction ----

// The members of S in domain d, of all (members NULL) or of some: their numbers go to
// scratch->index.
static int32_t list_domain(const pliant_model *model, const pliant_node *nodes,
                           const int32_t *members, int32_t count, int32_t d, int32_t *index)
{
    int32_t listed = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t member = members ? members[i] : i;
        if (model->domain[nodes[member].vertex] == d) index[listed++] = member;
    }
    return listed;
}

// Plan the values of these members; slot[member] tells where they will be.
static void plan_members(const pliant_model *model, const pliant_node *nodes,
                         const int32_t *members, int32_t count, pliant_capacitance_scratch *scratch,
                         pliant_reconstruction *plan, int32_t *slot)
{
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++) {
        const int32_t listed = list_domain(model, nodes, members, count, d, scratch->index);
        for (int32_t i = 0; i < listed; i++)
            scratch->positions[i] = model->position[nodes[scratch->index[i]].vertex];
        pliant_reconstruction_build(&plan[d], &scratch->domain[d], scratch->positions, listed,
                                    scratch->slots);
        for (int32_t i = 0; i < listed; i++) slot[scratch->index[i]] = scratch->slots[i];
    }
}

// Put a column's blocks into their slots; the others are zero.
static void load_column(const pliant_columns *columns, int32_t column, const int32_t *slot_of,
                        int32_t slot_count, float *blocks)
{
    memset(blocks, 0, (size_t)slot_count * block_floats * sizeof *blocks);
    for (uint64_t e = columns->offset[column]; e < columns->offset[column + 1]; e++) {
        const int32_t slot = slot_of[columns->row[e]];
        if (slot >= 0)
            memcpy(blocks + (size_t)slot * block_floats, columns->block + 9 * e,
                   9 * sizeof *blocks);
    }
}

// Values at the planned members (of all or some, as planned) of the columns of members column_begin
// .. column_end - 1.
static void extract(const pliant_model *model, const pliant_capacitance *type,
                    const pliant_reconstruction *plan, const int32_t *slot, const int32_t *members,
                    int32_t count, int32_t column_begin, int32_t column_end,
                    pliant_capacitance_scratch *scratch, double *matrix)
{
    const size_t leading = type->leading;
    for (int32_t d = 0; d < pliant_capacitance_domain_count(model); d++) {
        const int32_t rows = list_domain(model, type->nodes, members, count, d, scratch->index);
        if (rows == 0) continue;
        const int32_t *slot_of = scratch->domain[d].slot_of;
        pliant_reconstruction_map(&plan[d], &scratch->domain[d]);
        for (int32_t j = column_begin; j < column_end; j++) {
            const pliant_node node = type->nodes[j];
            load_column(pliant_model_columns(model, d, node), model->position[node.vertex], slot_of,
                        plan[d].slot_count, scratch->blocks);
            pliant_reconstruction_run_blocks(&plan[d], scratch->blocks);
            for (int32_t i = 0; i < rows; i++) {
                const int32_t member = scratch->index[i];
                const float *from = scratch->blocks + (size_t)slot[member] * block_floats;
                double *to = matrix + 3 * (size_t)member + 3 * (size_t)j * leading;
                for (int r = 0; r < 3; r++)
                    for (int c = 0; c < 3; c++) to[r + (size_t)c * leading] = from[3 * r + c];
            }
        }
        pliant_reconstruction_unmap(&plan[d], &scratch->domain[d]);
    }
}

// Clear the rows behind the last one, up to where kernels read.
static void clear_tail(size_t n, size_t columns, size_t leading, double *matrix)
{
    for (size_t j = 0; j < columns; j++)
        memset(matrix + n + j * leading, 0, (pliant_dense_stride(n) - n) * sizeof *matrix);
}

void pliant_capacitance_plan_members(const pliant_model *model, pliant_capacitance_scratch *scratch,
                                     pliant_capacitance *type)
{
    plan_members(model, type->nodes, NULL, type->count, scratch, type->plan, type->slot);
}

void pliant_capacitance_extract_columns(const pliant_model *model, int32_t begin, int32_t end,
                                        pliant_capacitance_scratch *scratch,
                                        pliant_capacitance *type)
{
    extract(model, type, type->plan, type->slot, NULL, type->count, begin, end, scratch,
            type->matrix);
    const size_t first = 3 * (size_t)begin * type->leading;
    clear_tail(3 * (size_t)type->count, 3 * (size_t)(end - begin), type->leading,
               type->matrix + first);
}

void pliant_capacitance_plan(const pliant_model *model, const pliant_node *nodes, int32_t count,
                             pliant_capacitance_scratch *scratch, pliant_capacitance *type)
{
    type->count = count;
    memcpy(type->nodes, nodes, (size_t)count * sizeof *nodes);
    pliant_capacitance_plan_members(model, scratch, type);
}

void pliant_capacitance_extract(const pliant_model *model, const pliant_capacitance *type,
                                pliant_capacitance_scratch *scratch, double *matrix)
{
    const size_t n = 3 * (size_t)type->count;
    extract(model, type, type->plan, type->slot, NULL, type->count, 0, type->count, scratch,
            matrix);
    clear_tail(n, n, type->leading, matrix);
}

// ---- From values to M ----

static double area_of(const pliant_model *model, pliant_node node)
{
    return model->node_areas[node.level][node.vertex];
}

// D of a member, from its own block as extracted: free and fixed nodes differ in units, and large
// and small hats in size. A diagonal that compression destroyed, under 2^-20 of its domain's
// largest, says nothing about its node, which then counts as one of the largest.
static void note_diagonal(const pliant_model *model, pliant_capacitance *type, int32_t member)
{
    double *largest = &type->largest[model->domain[type->nodes[member].vertex]];
    for (size_t k = 3 * (size_t)member; k < 3 * (size_t)member + 3; k++) {
        type->scale[k] =
            fabs(type->matrix[k + k * type->leading]) * area_of(model, type->nodes[member]);
        *largest = fmax(*largest, type->scale[k]);
    }
}

static void set_scale(const pliant_model *model, pliant_capacitance *type, int32_t member)
{
    const double limit = type->largest[model->domain[type->nodes[member].vertex]];
    for (size_t k = 3 * (size_t)member; k < 3 * (size_t)member + 3; k++) {
        const double diagonal = type->scale[k] >= 0x1p-20 * limit ? type->scale[k] : limit;
        type->scale[k] = diagonal > 0 && isfinite(1 / sqrt(diagonal)) ? 1 / sqrt(diagonal) : 1;
    }
}

// How far to believe the element (i, j) of the passive M, and (j, i) for the rest. Compression
// leaves a column with an error in proportion to its peak, which is near its own node: weighted by
// areas that is A_i G_jj for (i, j), and the weights are those of least variance. A stiff part's
// column tells how a thin part follows it; the thin part's, whose errors are as large as the stiff
// part's displacements, does not. Of nodes on two levels the finer one's row is taken.
static double trust(const pliant_capacitance *type, int32_t i, int32_t j, double area,
                    double other_area)
{
    const int32_t level = type->nodes[i].level, other_level = type->nodes[j].level;
    if (level != other_level) return level > other_level ? 1 : 0;
    double mine = 0, other = 0;
    for (size_t c = 0; c < 3; c++) {
        mine += type->scale[3 * (size_t)i + c];
        other += type->scale[3 * (size_t)j + c];
    }
    // D_ii^2 = 1 / (A_i G_ii), so this is (A_i G_jj) / (A_j G_ii).
    const double ratio = area * mine / (other_area * other), square = ratio * ratio;
    return 1 / (1 + square * square);
}

// Turn the values at two members of each other's columns (i == j: of its own) into elements of M.
static void weigh_pair(const pliant_model *model, const pliant_capacitance_scratch *scratch,
                       pliant_capacitance *type, int32_t i, int32_t j)
{
    const size_t leading = type->leading;
    const pliant_node node = type->nodes[i], other = type->nodes[j];
    double *at = type->matrix + 3 * (size_t)i + 3 * (size_t)j * leading;
    double *opposite = type->matrix + 3 * (size_t)j + 3 * (size_t)i * leading;
    const double area = area_of(model, node), other_area = area_of(model, other);
    const double *scale = type->scale + 3 * (size_t)i, *other_scale = type->scale + 3 * (size_t)j;
    const double sign = model->domain[node.vertex] == model->domain[other.vertex] ? 1 : -1;
    const int is_passive = scratch->compliance == PLIANT_COMPLIANCE_PASSIVE;
    const double raise = i != j ? 0 : type->shift;
    const double mine = trust(type, i, j, area, other_area);
    for (size_t r = 0; r < 3; r++)
        for (size_t c = i == j ? r : 0; c < 3; c++) {
            double *to = at + r + c * leading, *back = opposite + c + r * leading;
            double x = area * *to, y = other_area * *back;
            if (is_passive) {
                x = mine * x + (1 - mine) * sign * y;
                y = sign * x;
            }
            const double scales = scale[r] * other_scale[c];
            *to = x * scales + (r == c ? raise : 0);
            *back = y * scales + (r == c ? raise : 0);
        }
}

// ---- Inversion ----

// Is the symmetric part of M + shift I positive definite? Of a stored M only the parts within
// levels are looked at: between levels not even exact elements are reciprocal, since the value at a
// coarse vertex is not the mean under its hat, and a third of random mixed sets of an exact matrix
// would look indefinite. Uses work_matrix.
static int32_t is_definite(const pliant_capacitance *type, double shift,
                           pliant_capacitance_scratch *scratch)
{
    const size_t count = (size_t)type->count, leading = type->leading;
    const int32_t is_passive = scratch->compliance == PLIANT_COMPLIANCE_PASSIVE;
    double *half = scratch->work_matrix;
    for (size_t j = 0; j < count; j++)
        for (size_t i = j; i < count; i++) {
            const int32_t counts = is_passive || type->nodes[i].level == type->nodes[j].level;
            for (size_t c = 3 * j; c < 3 * j + 3; c++)
                for (size_t r = 3 * i; r < 3 * i + 3; r++)
                    half[r + c * leading] =
                        counts ? (type->matrix[r + c * leading] + type->matrix[c + r * leading]) / 2
                               : 0;
        }
    for (size_t k = 0; k < 3 * count; k++) half[k + k * leading] += shift;
    clear_tail(3 * count, 3 * count, leading, half);
    return pliant_dense_definite(3 * count, leading, half, scratch->work);
}

static void add_to_diagonal(pliant_capacitance *type, double shift)
{
    for (size_t k = 0; k < 3 * (size_t)type->count; k++)
        type->matrix[k + k * type->leading] += shift;
    type->shift += shift;
}

// to = from * scale * factor in floats; is any of them not finite?
PLIANT_VECTOR_CLONES
static int32_t store_column(size_t n, const double *from, const double *scale, double factor,
                            float *to)
{
    uint32_t has_overflow = 0;
    for (size_t i = 0; i < n; i++) {
        to[i] = (float)(from[i] * scale[i] * factor);
        uint32_t bits;
        memcpy(&bits, &to[i], sizeof bits);
        has_overflow |= (bits & 0x7f800000) == 0x7f800000;
    }
    return (int32_t)has_overflow;
}

// C^-1 = - (E^T Xi E)^-1, with the scaling undone. 0 when it does not fit into floats.
static int32_t store_product(const pliant_model *model, pliant_capacitance *type)
{
    const size_t n = 3 * (size_t)type->count, stride = type->stride = pliant_dense_stride(n);
    int32_t has_overflow = 0;
    for (size_t j = 0; j < n; j++) {
        float *to = type->product + j * stride;
        has_overflow |= store_column(n, type->inverse + j * type->leading, type->scale,
                                     -type->scale[j] * area_of(model, type->nodes[j / 3]), to);
        for (size_t i = n; i < stride; i++) to[i] = 0;
    }
    return !has_overflow;
}

static void copy_matrix(pliant_capacitance *type)
{
    const size_t n = 3 * (size_t)type->count;
    for (size_t j = 0; j < n; j++)
        memcpy(type->inverse + j * type->leading, type->matrix + j * type->leading,
               pliant_dense_stride(n) * sizeof(double));
}

// M^-1 and the product from M. 0 when M is singular to float precision.
static int32_t invert(const pliant_model *model, pliant_capacitance_scratch *scratch,
                      pliant_capacitance *type)
{
    const size_t n = 3 * (size_t)type->count;
    copy_matrix(type);
    // Entries carry float rounding, n of them a row: pivots below n 2^-24 of the largest are noise.
    const double least_pivot = (double)n * 0x1p-24;
    return pliant_dense_invert(n, type->leading, type->inverse, scratch->pivots, scratch->work) >
               least_pivot &&
           store_product(model, type);
}

// The first shift of M's diagonal, of first, first * factor, ..., that makes it definite and
// invertible; elements are at most about one, so that no eigenvalue is below -n and the largest
// shifts are far beyond. `floor`: what the least eigenvalue is to be.
static int32_t invert_shifted(const pliant_model *model, pliant_capacitance_scratch *scratch,
                              pliant_capacitance *type, double first, double factor, double floor)
{
    for (double shift = first; shift <= 0x1p40; shift *= factor) {
        if (!is_definite(type, shift - floor, scratch)) continue;
        add_to_diagonal(type, shift);
        if (invert(model, scratch, type)) return 1;
        add_to_diagonal(type, -shift);
    }
    return 0;
}

pliant_dense_progress pliant_capacitance_sweep_step(const pliant_model *model,
                                                    pliant_capacitance_scratch *scratch,
                                                    pliant_dense_sweep *sweep,
                                                    pliant_capacitance *type)
{
    if (sweep->panel == 0 && !sweep->has_panel) copy_matrix(type);
    const pliant_dense_progress progress =
        pliant_dense_sweep_step(3 * (size_t)type->count, type->leading, type->inverse,
                                definite_floor / 2, scratch->work, sweep);
    if (progress != PLIANT_DENSE_DONE) return progress;
    type->status = PLIANT_OK;
    return store_product(model, type) ? PLIANT_DENSE_DONE : PLIANT_DENSE_REFUSED;
}

static int32_t sweep_all(const pliant_model *model, pliant_capacitance_scratch *scratch,
                         pliant_capacitance *type)
{
    pliant_dense_sweep state = {0};
    pliant_dense_progress progress;
    do progress = pliant_capacitance_sweep_step(model, scratch, &state, type);
    while (progress == PLIANT_DENSE_MORE);
    return progress == PLIANT_DENSE_DONE;
}

// A definite matrix needs no pivoting, and its pivots tell that it is one.
static int32_t settle_passive(const pliant_model *model, pliant_capacitance_scratch *scratch,
                              pliant_capacitance *type)
{
    type->status = PLIANT_OK;
    return sweep_all(model, scratch, type) ||
           invert_shifted(model, scratch, type, definite_floor, shift_factor, definite_floor);
}

static int32_t settle_stored(const pliant_model *model, pliant_capacitance_scratch *scratch,
                             pliant_capacitance *type)
{
    type->status = is_definite(type, 0, scratch) ? PLIANT_OK : PLIANT_ROUGH;
    if (invert(model, scratch, type)) return 1;
    type->status = PLIANT_ROUGH;
    return invert_shifted(model, scratch, type, 0x1p-20, 16, 0);
}

static void settle(const pliant_model *model, pliant_capacitance_scratch *scratch,
                   pliant_capacitance *type)
{
    if (scratch->compliance == PLIANT_COMPLIANCE_PASSIVE ? settle_passive(model, scratch, type)
                                                         : settle_stored(model, scratch, type))
        return;
    // Nothing to be had from this matrix: contact gives way without force.
    const size_t n = 3 * (size_t)type->count;
    type->status = PLIANT_ROUGH;
    type->shift = INFINITY;
    type->stride = pliant_dense_stride(n);
    memset(type->product, 0, n * type->stride * sizeof *type->product);
}

void pliant_capacitance_set_scales(const pliant_model *model, pliant_capacitance *type)
{
    type->residual = 0;
    type->update_count = 0;
    memset(type->largest, 0, sizeof type->largest);
    for (int32_t i = 0; i < type->count; i++) note_diagonal(model, type, i);
    for (int32_t i = 0; i < type->count; i++) set_scale(model, type, i);
}

void pliant_capacitance_weigh_columns(const pliant_model *model, int32_t begin, int32_t end,
                                      pliant_capacitance_scratch *scratch, pliant_capacitance *type)
{
    for (int32_t j = begin; j < end; j++)
        for (int32_t i = 0; i <= j; i++) weigh_pair(model, scratch, type, i, j);
}

void pliant_capacitance_invert(const pliant_model *model, pliant_capacitance_scratch *scratch,
                               pliant_capacitance *type)
{
    type->shift = scratch->held_shift;
    pliant_capacitance_set_scales(model, type);
    pliant_capacitance_weigh_columns(model, 0, type->count, scratch, type);
    settle(model, scratch, type);
}

void pliant_capacitance_build(const pliant_model *model, const pliant_node *nodes, int32_t count,
                              pliant_capacitance_scratch *scratch, pliant_capacitance *type)
{
    for (int32_t i = 0; i < count; i++) type->order[i] = i;
    pliant_capacitance_plan(model, nodes, count, scratch, type);
    pliant_capacitance_extract(model, type, scratch, type->matrix);
    pliant_capacitance_invert(model, scratch, type);
}

// ---- Updates ----

static int32_t same_node(pliant_node a, pliant_node b)
{
    return a.vertex == b.vertex && a.level == b.level;
}

int32_t pliant_capacitance_matches(const pliant_capacitance *type, const pliant_node *nodes,
                                   int32_t count)
{
    if (type->count != count) return 0;
    for (int32_t i = 0; i < count; i++)
        if (!same_node(type->nodes[type->order[i]], nodes[i])) return 0;
    return 1;
}

pliant_capacitance_difference pliant_capacitance_compare(const pliant_capacitance *type,
                                                         const pliant_node *nodes, int32_t count)
{
    int32_t i = 0, j = 0, common = 0;
    while (i < type->count && j < count) {
        const pliant_node mine = type->nodes[type->order[i]];
        if (same_node(mine, nodes[j])) common++;
        const int32_t vertex = nodes[j].vertex;
        j += mine.vertex >= vertex;
        i += mine.vertex <= vertex;
    }
    return (pliant_capacitance_difference){type->count - common, count - common};
}

void pliant_capacitance_copy(const pliant_capacitance *from, pliant_capacitance *to)
{
    const size_t count = (size_t)from->count, n = 3 * count;
    memcpy(to->nodes, from->nodes, count * sizeof *to->nodes);
    memcpy(to->order, from->order, count * sizeof *to->order);
    memcpy(to->scale, from->scale, n * sizeof *to->scale);
    memcpy(to->largest, from->largest, sizeof to->largest);
    for (size_t j = 0; j < n; j++) {
        const size_t at = j * from->leading, bytes = pliant_dense_stride(n) * sizeof(double);
        memcpy(to->matrix + at, from->matrix + at, bytes);
        memcpy(to->inverse + at, from->inverse + at, bytes);
    }
    to->count = from->count;
    to->shift = from->shift;
    to->status = from->status;
    to->update_count = from->update_count;
}

// The last member takes the place of one that goes. 0: it cannot be taken out of the inverse.
static int32_t drop(pliant_capacitance *type, int32_t member, double *work)
{
    const size_t n = 3 * (size_t)type->count, at = 3 * (size_t)member;
    if (!pliant_bordering_remove(n, type->leading, type->inverse, at, work)) return 0;
    pliant_bordering_move_last(n, type->leading, type->matrix, at);
    memmove(type->scale + at, type->scale + n - 3, 3 * sizeof *type->scale);
    type->nodes[member] = type->nodes[--type->count];
    type->update_count++;
    return 1;
}

// Position of a vertex in ascending nodes, or -1.
static int32_t find_vertex(const pliant_node *nodes, int32_t count, int32_t vertex)
{
    int32_t begin = 0, end = count;
    while (begin < end) {
        const int32_t middle = begin + (end - begin) / 2;
        if (nodes[middle].vertex == vertex) return middle;
        if (nodes[middle].vertex < vertex) begin = middle + 1;
        else end = middle;
    }
    return -1;
}

void pliant_capacitance_extend(const pliant_model *model, int32_t kept,
                               pliant_capacitance_scratch *scratch, pliant_capacitance *type)
{
    const int32_t count = type->count;
    plan_members(model, type->nodes, NULL, count, scratch, type->plan, type->slot);
    if (count == kept) return;
    for (int32_t i = kept; i < count; i++) scratch->added[i - kept] = i;
    plan_members(model, type->nodes, scratch->added, count - kept, scratch, scratch->border,
                 scratch->border_slot);
    extract(model, type, type->plan, type->slot, NULL, count, kept, count, scratch, type->matrix);
    extract(model, type, scratch->border, scratch->border_slot, scratch->added, count - kept, 0,
            kept, scratch, type->matrix);
    for (int32_t i = kept; i < count; i++) note_diagonal(model, type, i);
    for (int32_t i = kept; i < count; i++) set_scale(model, type, i);
    for (int32_t j = kept; j < count; j++)
        for (int32_t i = 0; i <= j; i++) weigh_pair(model, scratch, type, i, j);
    clear_tail(3 * (size_t)count, 3 * (size_t)count, type->leading, type->matrix);
}

// Append the members first .. type->count - 1, whose M is there, to the inverse one by one.
static int32_t append(pliant_capacitance *type, int32_t first,
                      const pliant_capacitance_scratch *scratch)
{
    const size_t leading = type->leading;
    const double least = scratch->compliance == PLIANT_COMPLIANCE_PASSIVE ? definite_floor / 2 : 0;
    for (size_t n = 3 * (size_t)first; n < 3 * (size_t)type->count; n += 3) {
        double *rows = scratch->vectors, corner[9];
        for (size_t r = 0; r < 3; r++) {
            double *row = rows + r * leading;
            memset(row, 0, pliant_dense_stride(n + 3) * sizeof *row);
            for (size_t j = 0; j < n; j++) row[j] = type->matrix[n + r + j * leading];
            for (size_t c = 0; c < 3; c++)
                corner[3 * r + c] = type->matrix[n + r + (n + c) * leading];
        }
        if (!pliant_bordering_append(n, leading, type->inverse, type->matrix + n * leading, rows,
                                     corner, least, scratch->work))
            return 0;
        type->update_count++;
    }
    return 1;
}

// |M M^-1 x - x| / |x|, largest magnitudes, for an x of random signs: sees every column.
static double residual_of(const pliant_capacitance *type, const pliant_capacitance_scratch *scratch)
{
    const size_t n = 3 * (size_t)type->count, leading = type->leading;
    double *x = scratch->vectors, *y = x + leading, *z = y + leading;
    uint64_t state = (uint64_t)type->update_count;
    for (size_t k = 0; k < n; k++) {
        state = state * 6364136223846793005u + 1442695040888963407u;  // Knuth's MMIX generator
        x[k] = state >> 63 ? 1 : -1;
    }
    pliant_dense_multiply_double(n, leading, type->inverse, x, y);
    pliant_dense_multiply_double(n, leading, type->matrix, y, z);
    double worst = 0;
    for (size_t k = 0; k < n; k++) worst = fmax(worst, isnan(z[k]) ? INFINITY : fabs(z[k] - x[k]));
    return worst;
}

int32_t pliant_capacitance_update(const pliant_model *model, const pliant_node *nodes,
                                  int32_t count, pliant_capacitance_scratch *scratch,
                                  pliant_capacitance *type)
{
    for (int32_t i = type->count; i-- > 0;) {
        const int32_t at = find_vertex(nodes, count, type->nodes[i].vertex);
        if (at >= 0 && same_node(nodes[at], type->nodes[i])) continue;
        if (!drop(type, i, scratch->work)) return 0;
    }
    const int32_t kept = type->count;
    // A member's number, or -1, by the position of its node.
    for (int32_t i = 0; i < count; i++) type->order[i] = -1;
    for (int32_t i = 0; i < kept; i++)
        type->order[find_vertex(nodes, count, type->nodes[i].vertex)] = i;
    for (int32_t i = 0; i < count; i++)
        if (type->order[i] < 0) {
            type->order[i] = type->count;
            type->nodes[type->count++] = nodes[i];
        }
    pliant_capacitance_extend(model, kept, scratch, type);
    if (!append(type, kept, scratch)) return 0;
    clear_tail(3 * (size_t)count, 3 * (size_t)count, type->leading, type->inverse);
    type->residual = residual_of(type, scratch);
    if (!(type->residual <= drift_limit)) return 0;
    return store_product(model, type);
}
