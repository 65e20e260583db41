// compliance.c: compliance among chosen nodes while S is held, the new Green's functions of GF-15.
//
// With T the chosen nodes and M the scaled matrix of both (capacitance.h), holding S leaves
//
//     M_TT - M_TS M_SS^-1 M_ST
//
// among them, in which rows are displacements and columns are forces once scales and areas are out:
// a force f on a hat of area A is the traction f / A.
#include "solver.h"

#include "dense.h"

#include <math.h>
#include <string.h>

// The least eigenvalue that a passive answer is left with, scaled; as in capacitance.c, where the
// matrix as a whole has twice that.
static const double definite_floor = 0x1p-11, shift_factor = 1.25;

static pliant_status check_nodes(const pliant_solver *solver, const pliant_node *nodes,
                                 int32_t count, const double *matrix)
{
    if (count < 0 || count > solver->constraint_capacity || (count > 0 && (!nodes || !matrix)))
        return PLIANT_ERR_ARGUMENT;
    // A solution that was received came without its matrix.
    if (solver->solved_count > 0 && !solver->solved_type) return PLIANT_ERR_MISSING;
    for (int32_t i = 0; i < count; i++) {
        const pliant_status status = pliant_model_check_node(solver->model, nodes[i]);
        if (status < 0) return status;
        if (solver->model->domain[nodes[i].vertex] != PLIANT_DOMAIN_FREE ||
            pliant_constraint_find(solver->solved, solver->solved_count, nodes[i].vertex) >= 0)
            return PLIANT_ERR_ARGUMENT;
    }
    return PLIANT_OK;
}

// M of S and T, S first in the order of its type; of S alone what its type does not have is left
// out.
static void assemble(pliant_solver *solver, const pliant_node *nodes, int32_t count)
{
    pliant_capacitance *both = &solver->extended;
    const pliant_capacitance *type = solver->solved_type;
    const int32_t held = solver->solved_count;
    memset(both->largest, 0, sizeof both->largest);
    both->shift = type && isfinite(type->shift) ? type->shift : 0;
    if (held > 0) {
        memcpy(both->nodes, type->nodes, (size_t)held * sizeof *nodes);
        memcpy(both->scale, type->scale, 3 * (size_t)held * sizeof *both->scale);
        memcpy(both->largest, type->largest, sizeof both->largest);
    }
    if (count > 0) memcpy(both->nodes + held, nodes, (size_t)count * sizeof *nodes);
    both->count = held + count;
    pliant_capacitance_extend(solver->model, held, &solver->scratch, both);
}

// M_TT -= M_TS M_SS^-1 M_ST
static void hold(pliant_solver *solver, int32_t count)
{
    pliant_capacitance *both = &solver->extended;
    const pliant_capacitance *type = solver->solved_type;
    const size_t held = 3 * (size_t)solver->solved_count, n = 3 * (size_t)count;
    const size_t leading = both->leading;
    double *y = solver->scratch.vectors;
    // Where nothing helped S's matrix, S gives way without force: nothing is held.
    if (held == 0 || !isfinite(type->shift)) return;
    for (size_t c = held; c < held + n; c++) {
        double *column = both->matrix + c * leading;
        pliant_dense_multiply_double(held, type->leading, type->inverse, column, y);
        for (size_t k = 0; k < held; k++) {
            const double *rows = both->matrix + held + k * leading;
            for (size_t r = 0; r < n; r++) column[held + r] -= rows[r] * y[k];
        }
    }
}

// Is M_TT - floor + shift positive definite?
static int32_t is_definite(pliant_solver *solver, int32_t count, double shift)
{
    const pliant_capacitance *both = &solver->extended;
    const size_t held = 3 * (size_t)solver->solved_count, n = 3 * (size_t)count;
    const size_t leading = both->leading;
    double *copy = solver->scratch.work_matrix;
    for (size_t j = 0; j < n; j++) {
        const double *from = both->matrix + held + (held + j) * leading;
        double *to = copy + j * leading;
        memset(to, 0, pliant_dense_stride(n) * sizeof *to);
        for (size_t i = 0; i < n; i++) to[i] = from[i];
        to[j] += shift - definite_floor;
    }
    return pliant_dense_definite(n, leading, copy, solver->scratch.work);
}

pliant_status pliant_solver_compliance(pliant_solver *solver, const pliant_node *nodes,
                                       int32_t count, double *matrix)
{
    const pliant_status status = check_nodes(solver, nodes, count, matrix);
    if (status < 0) return status;
    assemble(solver, nodes, count);
    hold(solver, count);

    // Symmetric by construction, and made definite. As with S the shift does not fall while there
    // is contact.
    double *shift = &solver->compliance_shift;
    if (count == 0) *shift = 0;
    else if (solver->scratch.compliance == PLIANT_COMPLIANCE_PASSIVE)
        while (*shift < 0x1p40 && !is_definite(solver, count, *shift))
            *shift = fmax(2 * definite_floor, shift_factor * *shift);

    const pliant_capacitance *both = &solver->extended;
    const size_t held = 3 * (size_t)solver->solved_count, n = 3 * (size_t)count;
    // A row or column of forces and lengths is one of the scaled matrix times this.
    double *unscale = solver->scratch.vectors;
    for (size_t i = 0; i < n; i++)
        unscale[i] =
            1 / (both->scale[held + i] * pliant_model_node_area(solver->model, nodes[i / 3]));
    // From columns to rows, some columns at a time: 8 doubles are a cache line.
    enum { tile = 8 };
    for (size_t begin = 0; begin < n; begin += tile) {
        const size_t end = begin + tile < n ? begin + tile : n;
        const double *from = both->matrix + held + held * both->leading;
        for (size_t i = 0; i < n; i++)
            for (size_t j = begin; j < end; j++)
                matrix[i * n + j] = from[i + j * both->leading] * unscale[i] * unscale[j];
    }
    for (size_t i = 0; i < n; i++) matrix[i * n + i] += *shift * unscale[i] * unscale[i];
    return PLIANT_OK;
}
