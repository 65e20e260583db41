// types.c: step (2) of the algorithm: the set that the constraints are resolved on, and its type.
//
// A type comes from the cache, from the nearest kept type by bordering, or from scratch, whichever
// takes fewer operations. When that would be after the deadline, the constraints are resolved
// on a coarser level (GF 8.2): four times fewer nodes, 64 times less to factor.
#include "solver.h"

#include <math.h>
#include <string.h>

// A step must be predicted to end this much of its length before the deadline: predictions of an
// undisturbed machine are within a fifth (bench_haptic).
static const double margin = 1.25;
// Of the time that a late solve has left, this part stays unused.
enum { reserve = 4 };

// How one set's type would be had.
typedef struct plan {
    pliant_capacitance *found;  // kept already; or else
    pliant_capacitance *near;   // to be updated; NULL: to be built
    pliant_capacitance_difference difference;
    double make_ns, total_ns;
} plan;

// May a type be updated? A shift that only one set needed is not for others, nor what made one
// rough.
static int32_t is_sound(const pliant_solver *solver, const pliant_capacitance *type)
{
    return type->count >= 0 && type->status == PLIANT_OK &&
           type->shift == solver->scratch.held_shift;
}

// May a kept type be taken as it is? Softer than need be will do, stiffer will not (capacitance.h).
static int32_t is_soft(const pliant_solver *solver, const pliant_capacitance *type)
{
    return type->shift >= solver->scratch.held_shift;
}

// Is this the type of solver->key?
static int32_t is_kept(const pliant_solver *solver, const pliant_capacitance *type, int32_t count)
{
    return is_soft(solver, type) && pliant_capacitance_matches(type, solver->key, count);
}

static plan plan_set(pliant_solver *solver, const pliant_constraint *set, int32_t count)
{
    const pliant_model *model = solver->model;
    uint64_t blocks = 0;
    for (int32_t i = 0; i < count; i++) {
        const pliant_node node = set[i].node;
        const uint64_t *offset = pliant_model_columns(model, PLIANT_DOMAIN_FREE, node)->offset +
                                 model->position[node.vertex];
        blocks += offset[1] - offset[0];
        solver->key[i] = node;
    }
    const double contact = pliant_cost_of_contact(&solver->cost, count, blocks);
    pliant_pending *pending = &solver->pending;
    if (pending->stage == PLIANT_PENDING_WHOLE && is_kept(solver, &pending->type, count))
        return (plan){.found = &pending->type, .total_ns = contact};
    plan best = {.make_ns = pliant_cost_of_build(&solver->cost, count)};
    for (int32_t t = 0; t < solver->cache_count; t++) {
        pliant_capacitance *type = &solver->types[t];
        if (is_kept(solver, type, count)) return (plan){.found = type, .total_ns = contact};
        if (!is_sound(solver, type)) continue;
        const pliant_capacitance_difference difference =
            pliant_capacitance_compare(type, solver->key, count);
        if (!pliant_cost_prefers_update(count, difference)) continue;
        const int32_t changes = difference.dropped + difference.added;
        if (best.near && changes >= best.difference.dropped + best.difference.added) continue;
        best.near = type;
        best.difference = difference;
        best.make_ns = pliant_cost_of_update(&solver->cost, count, difference);
    }
    best.total_ns = best.make_ns + contact;
    return best;
}

// The type least recently used, other than `kept`; a place that holds none comes first.
static pliant_capacitance *oldest_type(const pliant_solver *solver, const pliant_capacitance *kept)
{
    pliant_capacitance *oldest = NULL;
    for (int32_t t = 0; t < solver->cache_count; t++) {
        pliant_capacitance *type = &solver->types[t];
        if (type == kept && solver->cache_count > 1) continue;
        if (!oldest || (type->count < 0 && oldest->count >= 0) ||
            (type->count >= 0 && oldest->count >= 0 && type->last_used < oldest->last_used))
            oldest = type;
    }
    return oldest;
}

// Have the type of `set` as planned; solver->key is its nodes again.
static pliant_capacitance *make(pliant_solver *solver, const plan *planned,
                                const pliant_constraint *set, int32_t count)
{
    if (planned->found) return planned->found;
    for (int32_t i = 0; i < count; i++) solver->key[i] = set[i].node;
    const int64_t begin = pliant_clock_ns();
    pliant_capacitance *type = oldest_type(solver, planned->near);
    int32_t is_updated = 0;
    if (planned->near) {
        if (type != planned->near) pliant_capacitance_copy(planned->near, type);
        is_updated =
            pliant_capacitance_update(solver->model, solver->key, count, &solver->scratch, type);
        solver->report.updated = planned->difference.dropped + planned->difference.added;
        solver->report.residual = type->residual;
    }
    if (!is_updated) {
        pliant_capacitance_build(solver->model, solver->key, count, &solver->scratch, type);
        solver->report.factored = 1;
    }
    // An update that failed and was followed by a build says nothing of either.
    const double measured = (double)(pliant_clock_ns() - begin);
    if (is_updated) pliant_cost_learn(&solver->cost.update_trust, planned->make_ns, measured);
    else if (!planned->near)
        pliant_cost_learn(&solver->cost.build_trust, planned->make_ns, measured);
    return type;
}

// ---- Coarser levels ----

static int32_t finest_of(const pliant_constraint *set, int32_t count)
{
    int32_t finest = 0;
    for (int32_t i = 0; i < count; i++)
        if (set[i].node.level > finest) finest = set[i].node.level;
    return finest;
}

// Does a hat of `level` at a vertex of the set, other than `vertex` itself, reach `vertex`?
static int32_t is_covered(const pliant_solver *solver, int32_t level, int32_t vertex)
{
    int32_t vertices[3];
    float weights[3];
    const int32_t count = pliant_model_hats_at(solver->model, level, vertex, vertices, weights);
    for (int32_t k = 0; k < count; k++)
        if (pliant_constraint_find(solver->constraints, solver->constraint_count, vertices[k]) >= 0)
            return 1;
    return 0;
}

// The constraints resolved on `level`; returns their number.
static int32_t coarsen(const pliant_solver *solver, int32_t level, pliant_constraint *set)
{
    const int32_t vertex_count = solver->model->hierarchy->vertex_count[level];
    int32_t count = 0;
    for (int32_t i = 0; i < solver->constraint_count; i++) {
        pliant_constraint constraint = solver->constraints[i];
        if (constraint.node.level > level) {
            if (constraint.node.vertex < vertex_count) constraint.node.level = level;
            else if (is_covered(solver, level, constraint.node.vertex)) continue;
        }
        set[count++] = constraint;
    }
    return count;
}

const pliant_capacitance *pliant_solver_resolve(pliant_solver *solver, int64_t deadline)
{
    pliant_constraint *set = solver->solved;
    int32_t count = solver->solved_count = solver->constraint_count;
    if (count == 0) {
        solver->scratch.held_shift = 0;  // no contact, no energy
        return NULL;
    }
    memcpy(set, solver->constraints, (size_t)count * sizeof *set);
    const int32_t asked = finest_of(set, count);
    int32_t level = asked;
    plan planned = plan_set(solver, set, count);
    if (deadline != PLIANT_NEVER) {
        const double left = (double)(deadline - pliant_clock_ns());
        int32_t tried = count;
        for (int32_t l = asked; l-- > 0 && margin * planned.total_ns > left;) {
            if (!(solver->model->stored_levels >> l & 1)) continue;
            const int32_t fewer = coarsen(solver, l, solver->candidate);
            if (fewer == tried) continue;
            tried = fewer;
            const plan coarser = plan_set(solver, solver->candidate, fewer);
            // Without a level that fits, what is done first.
            if (coarser.total_ns >= planned.total_ns) continue;
            planned = coarser;
            level = l;
            count = solver->solved_count = fewer;
            memcpy(set, solver->candidate, (size_t)fewer * sizeof *set);
        }
    }
    solver->report.level = level;
    solver->report.is_late = level < asked;
    solver->report.predicted_ns = (int64_t)fmin(planned.total_ns, 9e18);
    pliant_capacitance *type = make(solver, &planned, set, count);
    type->last_used = solver->solve_count;
    solver->report.shift = type->shift;
    if (solver->scratch.compliance == PLIANT_COMPLIANCE_PASSIVE && isfinite(type->shift))
        solver->scratch.held_shift = type->shift;
    return type;
}

void pliant_solver_prepare(pliant_solver *solver, int64_t deadline)
{
    const int32_t count = solver->constraint_count;
    for (int32_t i = 0; i < count; i++) solver->key[i] = solver->constraints[i].node;
    pliant_pending *pending = &solver->pending;
    // A part of what is left is kept for slices that take longer than expected.
    const int64_t now = pliant_clock_ns();
    const int64_t end = deadline > now ? deadline - (deadline - now) / reserve : deadline;
    pliant_pending_advance(solver->model, solver->key, count, end, &solver->scratch, pending);
    solver->report.prepared = (float)pliant_pending_part(pending);
    if (pending->stage != PLIANT_PENDING_WHOLE) return;
    // It takes a place among the types; where the only one is in use, it is found where it is.
    pliant_capacitance *place = oldest_type(solver, solver->solved_type);
    if (place == solver->solved_type) return;
    const pliant_capacitance replaced = *place;
    *place = pending->type;
    place->last_used = solver->solve_count;
    pending->type = replaced;
    pending->stage = PLIANT_PENDING_NONE;
}

double pliant_solver_predict(pliant_solver *solver)
{
    return plan_set(solver, solver->constraints, solver->constraint_count).total_ns;
}
