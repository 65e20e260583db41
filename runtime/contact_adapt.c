// contact_adapt.c: as coarse a mix of levels as keeps the tolerance, changed so that nothing pops.
//
// Errors are looked for where a node is not: a vertex may be inside a tool, or the surface stand
// off where a hat presses it. Then the coarsest nodes there are replaced by their children, which
// can exert the same pressure. They start with offsets that make the present forces their
// solution; errors are those against tools so offset, and the offsets fade. One part of the
// tolerance is for the offsets and one for the errors that are left to a level.
#include "contact.h"

#include <math.h>
#include <string.h>

// Each of these parts; what is left is for the residual.
static const double level_part = 0.45;
// A replaced node goes back when that would change the gaps about it by less than this part of the
// tolerance. On the blob of 2562 vertices 0.15 to 0.45 make no difference in nodes or jumps.
static const double calm_part = 0.25;
// What going back may move at once.
static const double move_part = 0.25;
// For how many solves in a row it must have been so, and at most after coming back again and
// again.
enum { least_patience = 16, most_patience = 1024 };

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The error that a level may leave.
static double get_threshold(const pliant_contact *contact)
{
    const double part = contact->def.fade_count > 0 ? level_part : 2 * level_part;
    return part * contact->def.tolerance;
}

// The pressure along the normal at a pair's vertex, or 0 where there is none.
static double get_pressure(const pliant_contact *contact, int32_t vertex, int32_t tool)
{
    const pliant_contact_pair *pair = pliant_contact_pair_at(contact, vertex, tool);
    if (!pair) return 0;
    double pressure[3];
    pliant_contact_pressure_at(contact, vertex, tool, pressure);
    return fmax(dot(pressure, pair->normal), 0);
}

static double get_gap(const pliant_contact *contact, int32_t vertex, int32_t tool)
{
    const int32_t candidate =
        contact->candidate_of[(size_t)tool * (size_t)contact->model->vertex_count + (size_t)vertex];
    return candidate < 0 ? INFINITY : contact->candidates[candidate].gap;
}

static const int32_t *parents_of(const pliant_contact *contact, int32_t odd)
{
    const pliant_hierarchy *hierarchy = contact->model->hierarchy;
    return hierarchy->stencils[odd - hierarchy->vertex_count[0]].parents;
}

// The parent of `odd` that is not `vertex`.
static int32_t other_parent(const pliant_contact *contact, int32_t odd, int32_t vertex)
{
    const int32_t *parents = parents_of(contact, odd);
    return parents[0] == vertex ? parents[1] : parents[0];
}

// ---- Errors ----

// How far the surface stands off where the hat of a pair presses it: half of its pressure acts at
// the odd vertices about it. In proportion to the pressure in the neighbourhood.
static double get_standoff(const pliant_contact *contact, const pliant_contact_pair *pair,
                           double with_offsets)
{
    if (pair->node.level >= contact->model->finest_level || !pliant_contact_is_pushed(pair))
        return 0;
    const double own = dot(pair->pressure, pair->normal);
    const pliant_child_range range =
        pliant_contact_levels_children(&contact->levels, pair->node.vertex, pair->node.level + 1);
    double most = 0;
    for (int32_t i = range.begin; i < range.end; i++) {
        const int32_t child = contact->levels.children[i];
        double gap = get_gap(contact, child, pair->tool);
        if (!(gap < INFINITY)) continue;  // fixed, or not looked at yet
        if (with_offsets > 0) gap += pliant_contact_offset_at(contact, child, pair->tool);
        const double other =
            get_pressure(contact, other_parent(contact, child, pair->node.vertex), pair->tool);
        most = fmax(most, gap * 0.5 * own / fmax(own, other));
    }
    return most;
}

void pliant_contact_judge(pliant_contact *contact)
{
    pliant_contact_report *report = &contact->report;
    report->penetration = report->error = 0;
    for (int32_t t = 0; t < contact->def.tool_capacity; t++) contact->results[t].penetration = 0;
    for (int32_t i = 0; i < contact->candidate_count; i++) {
        const pliant_contact_candidate *candidate = &contact->candidates[i];
        pliant_tool_result *result = &contact->results[candidate->tool];
        if (!(candidate->gap < INFINITY)) continue;
        report->penetration = fmax(report->penetration, -candidate->gap);
        result->penetration = fmaxf(result->penetration, (float)-candidate->gap);
    }
    report->error = report->penetration;
    for (int32_t i = 0; i < contact->pair_count; i++)
        report->error = fmax(report->error, get_standoff(contact, &contact->pairs[i], 0));
    report->residual = pliant_contact_residual(contact);
    report->is_met = report->error <= contact->def.tolerance;
}

// ---- To finer levels ----

// Is a candidate inside its tool by more than a level may leave it?
static int32_t is_inside(const pliant_contact *contact, const pliant_contact_candidate *candidate)
{
    const double threshold = get_threshold(contact);
    return candidate->gap < -threshold &&
           candidate->gap + pliant_contact_offset_at(contact, candidate->vertex, candidate->tool) <
               -threshold &&
           !pliant_contact_is_taken(contact, candidate->vertex);
}

int32_t pliant_contact_is_fine(const pliant_contact *contact)
{
    if (contact->levels.coarsest == contact->levels.finest) return 1;
    const double threshold = get_threshold(contact);
    for (int32_t i = 0; i < contact->pair_count; i++)
        if (contact->pairs[i].node.level < contact->levels.finest &&
            get_standoff(contact, &contact->pairs[i], 1) > threshold)
            return 0;
    for (int32_t i = 0; i < contact->candidate_count; i++)
        if (is_inside(contact, &contact->candidates[i])) return 0;
    return 1;
}

static void be_patient(pliant_contact *contact, int32_t vertex)
{
    const int32_t patience = 2 * contact->patience[vertex];
    contact->patience[vertex] = (uint16_t)(patience < most_patience ? patience : most_patience);
    contact->calm[vertex] = 0;
}

// How many more pairs there may be when a node's children come in.
static int32_t count_children(const pliant_contact *contact, int32_t vertex, int32_t level)
{
    const pliant_child_range range =
        pliant_contact_levels_children(&contact->levels, vertex, level + 1);
    int32_t count = 0;
    for (int32_t i = range.begin; i < range.end; i++)
        count += !pliant_contact_levels_exists(&contact->levels, contact->levels.children[i]);
    return count;
}

static int32_t replace_about(pliant_contact *contact, int32_t vertex)
{
    int32_t replaced[3];
    const int32_t count = pliant_contact_levels_refine(&contact->levels, vertex, replaced);
    for (int32_t i = 0; i < count; i++) be_patient(contact, replaced[i]);
    contact->report.refined += count;
    return count;
}

int32_t pliant_contact_refine(pliant_contact *contact)
{
    if (contact->levels.coarsest == contact->levels.finest) return 0;
    const double threshold = get_threshold(contact);
    // Pairs that are only watched give way.
    int32_t count = 0, pairs = 0;
    for (int32_t i = 0; i < contact->pair_count; i++)
        pairs += pliant_contact_is_pushed(&contact->pairs[i]);
    // Pairs first: what presses where nothing is should go, and is what capacity is spent on.
    for (int32_t i = 0; i < contact->pair_count; i++) {
        const pliant_contact_pair *pair = &contact->pairs[i];
        if (pair->node.level >= contact->levels.finest ||
            !(get_standoff(contact, pair, 1) > threshold))
            continue;
        pairs += count_children(contact, pair->node.vertex, pair->node.level);
        if (pairs > contact->room) break;
        // The level may be another already, when two tools touch the vertex.
        if (contact->levels.level[pair->node.vertex] != pair->node.level ||
            !pliant_contact_levels_replace(&contact->levels, pair->node.vertex))
            continue;
        be_patient(contact, pair->node.vertex);
        contact->report.refined++;
        count++;
    }
    for (int32_t i = 0; i < contact->candidate_count && pairs < contact->room; i++) {
        const pliant_contact_candidate *candidate = &contact->candidates[i];
        if (!is_inside(contact, candidate)) continue;
        const int32_t replaced = replace_about(contact, candidate->vertex);
        count += replaced;
        // A vertex that is inside becomes a pair; what comes with it is near or goes again.
        pairs += replaced > 0;
    }
    if (count > 0) pliant_contact_carry_over(contact);
    return count;
}

// ---- Offsets ----

void pliant_contact_set_offsets(pliant_contact *contact)
{
    const double threshold = get_threshold(contact);
    contact->fading_count = 0;
    for (int32_t i = 0; i < contact->pair_count && contact->def.fade_count > 0; i++) {
        pliant_contact_pair *pair = &contact->pairs[i];
        // Pairs whose node is the same feel the difference that compression makes between the hats
        // that went and those that came.
        if (pliant_contact_is_pushed(pair) || pair->gap + pair->offset < 0) {
            pair->offset = fmax(fmin(-pair->gap, threshold), -2 * threshold);
            pair->fade = contact->def.fade_count;
        }
        contact->fading_count += pair->fade > 0;
    }
}

void pliant_contact_fade(pliant_contact *contact)
{
    contact->fading_count = 0;
    for (int32_t i = 0; i < contact->pair_count; i++) {
        pliant_contact_pair *pair = &contact->pairs[i];
        if (pair->fade == 0) continue;
        pair->offset *= (double)(pair->fade - 1) / pair->fade;
        pair->fade--;
        contact->fading_count += pair->fade > 0;
    }
}

// ---- To coarser levels ----

// What pressure the child exerts beyond the mean of its parents': going back takes that away.
static double get_detail(const pliant_contact *contact, const pliant_contact_pair *child)
{
    const int32_t *parents = parents_of(contact, child->node.vertex);
    double mean = 0;
    for (int k = 0; k < 2; k++) mean += get_pressure(contact, parents[k], child->tool) / 2;
    return get_pressure(contact, child->node.vertex, child->tool) - mean;
}

static void touch(pliant_contact *contact, const pliant_contact_pair *pair, double force,
                  const double *normal)
{
    double *to = contact->node_force + 3 * (size_t)pair->index;
    if (to[0] == 0 && to[1] == 0 && to[2] == 0)
        contact->touched[contact->touched_count++] = pair->index;
    for (int c = 0; c < 3; c++) to[c] += force * normal[c];
}

// Take what a child exerts beyond its parents' mean, and give it to these, as carrying over does.
static void move_detail(pliant_contact *contact, const pliant_contact_pair *child)
{
    const double force = child->area * get_detail(contact, child);
    const int32_t *parents = parents_of(contact, child->node.vertex);
    double share[2];
    pliant_contact_share(contact, parents, child->tool, share);
    touch(contact, child, -force, child->normal);
    for (int k = 0; k < 2; k++) {
        const pliant_contact_pair *heir = pliant_contact_pair_at(contact, parents[k], child->tool);
        if (share[k] > 0 && heir->index >= 0) touch(contact, heir, share[k] * force, child->normal);
    }
}

// How far that moves a pair along its normal.
static double get_move(const pliant_contact *contact, const pliant_contact_pair *pair)
{
    const size_t n = 3 * (size_t)contact->node_count;
    const double *rows = contact->compliance + 3 * (size_t)pair->index * n;
    double moved = 0;
    for (int32_t i = 0; i < contact->touched_count; i++) {
        const size_t at = 3 * (size_t)contact->touched[i];
        for (size_t r = 0; r < 3; r++)
            moved += pair->normal[r] * dot(rows + r * n + at, contact->node_force + at);
    }
    return fabs(moved);
}

static void forget_touched(pliant_contact *contact)
{
    for (int32_t i = 0; i < contact->touched_count; i++)
        memset(contact->node_force + 3 * (size_t)contact->touched[i], 0, 3 * sizeof(double));
    contact->touched_count = 0;
}

// How far the gaps about a replaced node would move if it went back, as far as a tool is concerned.
static double get_unrest_of(pliant_contact *contact, int32_t vertex, int32_t tool)
{
    const pliant_child_range range =
        pliant_contact_levels_children(&contact->levels, vertex, contact->levels.level[vertex]);
    const double own = get_pressure(contact, vertex, tool);
    double most = 0;
    for (int32_t i = range.begin; i < range.end && most < INFINITY; i++) {
        const int32_t child = contact->levels.children[i];
        if (contact->model->domain[child] != PLIANT_DOMAIN_FREE) continue;
        // The hat would press there: it must not stand off.
        if (own > 0) {
            const double other = get_pressure(contact, other_parent(contact, child, vertex), tool);
            most = fmax(most, 0.5 * get_gap(contact, child, tool) * own / fmax(own, other));
        }
        const pliant_contact_pair *pair = pliant_contact_pair_at(contact, child, tool);
        if (!pair) continue;
        if (pair->fade > 0 || pair->index < 0) most = INFINITY;
        else move_detail(contact, pair);
    }
    for (int32_t i = range.begin - 1; i < range.end; i++) {
        const pliant_contact_pair *pair = pliant_contact_pair_at(
            contact, i < range.begin ? vertex : contact->levels.children[i], tool);
        if (pair && pair->index >= 0) most = fmax(most, get_move(contact, pair));
    }
    forget_touched(contact);
    return most;
}

static double get_unrest(pliant_contact *contact, int32_t vertex)
{
    double most = 0;
    for (int32_t t = 0; t < contact->def.tool_capacity; t++)
        if (contact->reached[t].kind != PLIANT_TOOL_NONE)
            most = fmax(most, get_unrest_of(contact, vertex, t));
    return most;
}

void pliant_contact_coarsen(pliant_contact *contact)
{
    const pliant_contact_levels *levels = &contact->levels;
    if (contact->pair_count > 0 && !contact->is_compliance_known) return;
    memset(contact->node_force, 0, 3 * (size_t)contact->node_count * sizeof(double));
    for (int32_t i = levels->refined_count; i-- > 0;) {
        const int32_t vertex = levels->refined[i];
        if (!pliant_contact_levels_may_coarsen(levels, vertex)) {
            contact->calm[vertex] = 0;
            continue;
        }
        const double unrest = get_unrest(contact, vertex);
        if (unrest > calm_part * contact->def.tolerance) {
            contact->calm[vertex] = 0;
            continue;
        }
        // Where no tool is any more there is nothing to be patient about.
        const int32_t is_left = unrest == 0;
        const int32_t patience = is_left ? least_patience : contact->patience[vertex];
        if (++contact->calm[vertex] < patience) continue;
        contact->calm[vertex] = 0;
        if (is_left) contact->patience[vertex] = least_patience / 2;
        contact->coarsened[contact->coarsened_count++] = vertex;
    }
}

// How far gaps have moved since carrying over.
static double get_gap_moves(const pliant_contact *contact)
{
    double most = 0;
    for (int32_t i = 0; i < contact->pair_count; i++)
        most = fmax(most, fabs(contact->pairs[i].gap - contact->pairs[i].gap_before));
    return most;
}

void pliant_contact_go_back(pliant_contact *contact, int64_t deadline)
{
    for (int32_t i = 0; i < contact->coarsened_count; i++)
        pliant_contact_levels_coarsen(&contact->levels, contact->coarsened[i]);
    pliant_contact_carry_over(contact);
    for (int32_t i = 0; i < contact->pair_count; i++)
        contact->pairs[i].gap_before = contact->pairs[i].gap;
    pliant_contact_press(contact, deadline);
    pliant_contact_evaluate(contact);
    if (get_gap_moves(contact) <= move_part * contact->def.tolerance) {
        pliant_contact_set_offsets(contact);
        contact->report.coarsened += contact->coarsened_count;
    } else {
        pliant_contact_carry_back(contact);
        for (int32_t i = 0; i < contact->coarsened_count; i++) {
            (void)pliant_contact_levels_replace(&contact->levels, contact->coarsened[i]);
            be_patient(contact, contact->coarsened[i]);
        }
        pliant_contact_press(contact, deadline);
        pliant_contact_evaluate(contact);
    }
    contact->coarsened_count = 0;
}

void pliant_contact_begin_patience(pliant_contact *contact)
{
    for (int32_t v = 0; v < contact->model->vertex_count; v++)
        contact->patience[v] = least_patience / 2;
}
