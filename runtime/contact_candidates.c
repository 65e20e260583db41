// contact_candidates.c: which vertices may touch a tool, where they are and how far from it.
#include "contact.h"

#include <math.h>

// Vertices whose displacements bound everybody's: the model's first, which are spread evenly, and
// those that the caller has loaded, where the peaks are. In between it may be larger by a margin.
enum { spread_samples = 64 };
static const double displacement_margin = 1.25;
// Candidates lie within this many tolerances and depths of the deepest vertex: forces that push
// that vertex out move others by less.
static const double band_tolerances = 4, band_depths = 2;

int32_t pliant_contact_sample_capacity(const pliant_solver *solver)
{
    return spread_samples + solver->load_capacity;
}

int32_t pliant_contact_is_taken(const pliant_contact *contact, int32_t vertex)
{
    const pliant_solver *solver = contact->solver;
    if (pliant_constraint_find(solver->constraints, solver->constraint_count, vertex) >= 0)
        return 1;
    if (solver->load_of[vertex] < 0) return 0;
    for (int32_t i = 0; i < contact->load_count; i++)
        if (contact->loads[i].node.vertex == vertex) return 0;
    return 1;
}

// No displacement is likely to be larger, m.
static double bound_displacement(pliant_contact *contact)
{
    const pliant_solver *solver = contact->solver;
    const pliant_model_domain *domain = &contact->model->domains[PLIANT_DOMAIN_FREE];
    int32_t count = 0;
    while (count < spread_samples && count < domain->count) {
        contact->query[count] = domain->nodes[count];
        count++;
    }
    for (int32_t i = 0; i < solver->load_count && count < contact->sample_capacity; i++)
        if (contact->model->domain[solver->loads[i].node.vertex] == PLIANT_DOMAIN_FREE)
            contact->query[count++] = solver->loads[i].node.vertex;
    double square = 0;
    if (pliant_solver_displacements(contact->solver, contact->query, count, contact->displacement) <
        0)
        count = 0;
    for (int32_t i = 0; i < count; i++) {
        const pliant_vec3 u = contact->displacement[i];
        square = fmax(square, (double)u.x * u.x + (double)u.y * u.y + (double)u.z * u.z);
    }
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const pliant_vec3 u = solver->solved[i].value;
        if (contact->model->domain[solver->solved[i].node.vertex] != PLIANT_DOMAIN_FREE) continue;
        square = fmax(square, (double)u.x * u.x + (double)u.y * u.y + (double)u.z * u.z);
    }
    return displacement_margin * sqrt(square);
}

static int32_t *candidate_at(pliant_contact *contact, int32_t vertex, int32_t tool)
{
    return contact->candidate_of + (size_t)tool * (size_t)contact->model->vertex_count + vertex;
}

int32_t pliant_contact_find_candidate(pliant_contact *contact, int32_t vertex, int32_t tool)
{
    int32_t *at = candidate_at(contact, vertex, tool);
    if (*at >= 0) return *at;
    if (contact->candidate_count == contact->candidate_capacity) return -1;
    // Its gap is known after the next evaluation.
    contact->candidates[contact->candidate_count] =
        (pliant_contact_candidate){.vertex = vertex, .tool = tool, .gap = INFINITY};
    contact->query[contact->candidate_count] = vertex;
    *at = contact->candidate_count++;
    return *at;
}

static void place(const pliant_contact *contact, int32_t candidate, double *x)
{
    const int32_t vertex = contact->candidates[candidate].vertex;
    const double *rest = contact->model->view.vertices + 3 * (size_t)vertex;
    const pliant_vec3 u = contact->displacement[candidate];
    x[0] = rest[0] + (double)u.x;
    x[1] = rest[1] + (double)u.y;
    x[2] = rest[2] + (double)u.z;
}

void pliant_contact_place_pair(pliant_contact *contact, pliant_contact_pair *pair)
{
    const int32_t candidate = *candidate_at(contact, pair->node.vertex, pair->tool);
    place(contact, candidate, pair->x);
    pair->gap = pliant_tool_shape_distance(&contact->reached[pair->tool], pair->x, pair->normal);
}

void pliant_contact_evaluate(pliant_contact *contact)
{
    if (pliant_solver_displacements(contact->solver, contact->query, contact->candidate_count,
                                    contact->displacement) < 0)
        return;
    for (int32_t i = 0; i < contact->candidate_count; i++) {
        pliant_contact_candidate *candidate = &contact->candidates[i];
        double x[3], ignored[3];
        place(contact, i, x);
        candidate->gap = pliant_tool_shape_distance(&contact->reached[candidate->tool], x, ignored);
    }
    for (int32_t i = 0; i < contact->pair_count; i++)
        pliant_contact_place_pair(contact, &contact->pairs[i]);
}

static void forget_candidates(pliant_contact *contact)
{
    for (int32_t i = 0; i < contact->candidate_count; i++)
        *candidate_at(contact, contact->candidates[i].vertex, contact->candidates[i].tool) = -1;
    contact->candidate_count = 0;
}

// Keep those within the band, and the vertices of pairs.
static void narrow(pliant_contact *contact)
{
    double deepest = 0;
    for (int32_t i = 0; i < contact->candidate_count; i++)
        deepest = fmin(deepest, contact->candidates[i].gap);
    const double band = band_tolerances * contact->def.tolerance - band_depths * deepest;
    const size_t n = (size_t)contact->model->vertex_count;
    int32_t kept = 0;
    for (int32_t i = 0; i < contact->candidate_count; i++) {
        const pliant_contact_candidate candidate = contact->candidates[i];
        int32_t *at = candidate_at(contact, candidate.vertex, candidate.tool);
        *at = -1;
        if (candidate.gap > band &&
            contact->pair_of[(size_t)candidate.tool * n + (size_t)candidate.vertex] < 0)
            continue;
        contact->candidates[kept] = candidate;
        contact->query[kept] = candidate.vertex;
        contact->displacement[kept] = contact->displacement[i];
        *at = kept++;
    }
    contact->candidate_count = kept;
}

void pliant_contact_list_candidates(pliant_contact *contact)
{
    forget_candidates(contact);
    const double reach = bound_displacement(contact) + band_tolerances * contact->def.tolerance;
    for (int32_t i = 0; i < contact->pair_count; i++)
        pliant_contact_find_candidate(contact, contact->pairs[i].node.vertex,
                                      contact->pairs[i].tool);
    for (int32_t t = 0; t < contact->def.tool_capacity; t++) {
        if (contact->reached[t].kind == PLIANT_TOOL_NONE) continue;
        const int32_t count =
            pliant_vertex_tree_near(&contact->tree, &contact->reached[t], reach, contact->found);
        for (int32_t i = 0; i < count; i++)
            pliant_contact_find_candidate(contact, contact->found[i], t);
    }
    pliant_contact_evaluate(contact);
    narrow(contact);
}
