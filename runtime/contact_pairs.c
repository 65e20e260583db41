// contact_pairs.c: the pairs of a node and a tool that may push it.
#include "contact.h"

#include <float.h>
#include <math.h>
#include <string.h>

// A node within this many tolerances of a tool is watched, and until it is twice as far.
static const double watch_tolerances = 2;
// Of two tools at one vertex the nearer has it, unless their normals differ: two would share what
// one can do. The cosine.
static const double parallel = 0.95;
// Pressures that differ by rounding are the same.
static const double same_pressure = 1e-5;

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static int32_t is_zero(const double *v)
{
    return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

int32_t pliant_contact_is_pushed(const pliant_contact_pair *pair)
{
    return !is_zero(pair->pressure);
}

static int32_t *pair_at(const pliant_contact *contact, int32_t vertex, int32_t tool)
{
    return contact->pair_of + (size_t)tool * (size_t)contact->model->vertex_count + vertex;
}

const pliant_contact_pair *pliant_contact_pair_at(const pliant_contact *contact, int32_t vertex,
                                                  int32_t tool)
{
    const int32_t at = *pair_at(contact, vertex, tool);
    return at < 0 ? NULL : &contact->pairs[at];
}

// ---- What pairs say about vertices ----

static int32_t start_level(const pliant_contact_levels *levels, int32_t vertex)
{
    const int32_t first = levels->first[vertex];
    return first > levels->coarsest ? first : levels->coarsest;
}

void pliant_contact_pressure_at(const pliant_contact *contact, int32_t vertex, int32_t tool,
                                double *pressure)
{
    const pliant_contact_levels *levels = &contact->levels;
    memset(pressure, 0, 3 * sizeof *pressure);
    pliant_hat_values hats = {.count = 1, .vertex = {vertex}, .value = {1}};
    for (int32_t level = start_level(levels, vertex); level >= levels->coarsest; level--) {
        hats = pliant_contact_levels_coarser(levels, level, &hats);
        for (int32_t i = 0; i < hats.count; i++) {
            const pliant_contact_pair *pair = pliant_contact_pair_at(contact, hats.vertex[i], tool);
            // Its own node counts on whatever level that is.
            if (!pair || (hats.vertex[i] != vertex && pair->node.level != level)) continue;
            for (int c = 0; c < 3; c++) pressure[c] += hats.value[i] * pair->pressure[c];
        }
    }
}

double pliant_contact_offset_at(const pliant_contact *contact, int32_t vertex, int32_t tool)
{
    const pliant_contact_levels *levels = &contact->levels;
    if (contact->fading_count == 0) return 0;
    pliant_hat_values hats = {.count = 1, .vertex = {vertex}, .value = {1}};
    for (int32_t level = start_level(levels, vertex); level >= levels->coarsest; level--) {
        hats = pliant_contact_levels_coarser(levels, level, &hats);
        double offset = 0;
        int32_t is_known = 0;
        for (int32_t i = 0; i < hats.count; i++) {
            const pliant_contact_pair *pair = pliant_contact_pair_at(contact, hats.vertex[i], tool);
            if (!pair) continue;
            offset += hats.value[i] * pair->offset;
            is_known = 1;
        }
        if (is_known) return offset;
    }
    return 0;
}

// ---- Choice ----

// Keeping: pairs go on as they are. Carrying: nodes have been replaced, and the new ones are to
// exert the same pressure.
typedef enum pliant_contact_choice { keeping, carrying } pliant_contact_choice;

static int32_t is_left_to_another_tool(const pliant_contact *contact,
                                       const pliant_contact_candidate *candidate)
{
    for (int32_t t = 0; t < contact->def.tool_capacity; t++) {
        if (t == candidate->tool) continue;
        const int32_t other =
            contact->candidate_of[(size_t)t * (size_t)contact->model->vertex_count +
                                  (size_t)candidate->vertex];
        if (other < 0) continue;
        const double gap = contact->candidates[other].gap;
        if (gap > candidate->gap || (gap == candidate->gap && t > candidate->tool)) continue;
        const double *rest = contact->model->view.vertices + 3 * (size_t)candidate->vertex;
        const pliant_vec3 u = contact->displacement[other];
        const double x[3] = {rest[0] + (double)u.x, rest[1] + (double)u.y, rest[2] + (double)u.z};
        double p[3] = {0, 0, 1}, q[3] = {0, 0, 1};
        (void)pliant_tool_shape_distance(&contact->reached[t], x, p);
        (void)pliant_tool_shape_distance(&contact->reached[candidate->tool], x, q);
        if (fabs(dot(p, q)) > parallel) return 1;
    }
    return 0;
}

// How much a candidate is wanted as a pair: the less the more; INFINITY: not at all.
static double get_key(pliant_contact *contact, const pliant_contact_candidate *candidate,
                      pliant_contact_choice choice)
{
    const int32_t vertex = candidate->vertex, at = *pair_at(contact, vertex, candidate->tool);
    if (!(candidate->gap < INFINITY) || !pliant_contact_levels_exists(&contact->levels, vertex) ||
        pliant_contact_is_taken(contact, vertex))
        return INFINITY;
    const double near = watch_tolerances * contact->def.tolerance;
    const double gap = candidate->gap + pliant_contact_offset_at(contact, vertex, candidate->tool);
    int32_t is_pushed = at >= 0 && pliant_contact_is_pushed(&contact->pairs[at]);
    if (choice == carrying) {
        double pressure[3];
        pliant_contact_pressure_at(contact, vertex, candidate->tool, pressure);
        is_pushed = !is_zero(pressure);
    }
    if (!is_pushed && gap > (at >= 0 ? 2 * near : near)) return INFINITY;
    if (is_left_to_another_tool(contact, candidate)) return INFINITY;
    return is_pushed ? -DBL_MAX : gap;
}

static void swap_chosen(pliant_contact *contact, int32_t i, int32_t j)
{
    const double key = contact->keys[i];
    const int32_t chosen = contact->chosen[i];
    contact->keys[i] = contact->keys[j];
    contact->chosen[i] = contact->chosen[j];
    contact->keys[j] = key;
    contact->chosen[j] = chosen;
}

// Keep the `room` least keys in a heap whose top is the largest.
static void choose(pliant_contact *contact, int32_t *count, int32_t room, double key,
                   int32_t candidate)
{
    int32_t i = *count;
    if (i < room) {
        (*count)++;
        contact->keys[i] = key;
        contact->chosen[i] = candidate;
        for (; i > 0 && contact->keys[(i - 1) / 2] < contact->keys[i]; i = (i - 1) / 2)
            swap_chosen(contact, i, (i - 1) / 2);
        return;
    }
    if (room == 0 || key >= contact->keys[0]) return;
    contact->keys[0] = key;
    contact->chosen[0] = candidate;
    for (i = 0;;) {
        int32_t most = i;
        for (int32_t k = 2 * i + 1; k <= 2 * i + 2 && k < room; k++)
            if (contact->keys[k] > contact->keys[most]) most = k;
        if (most == i) return;
        swap_chosen(contact, i, most);
        i = most;
    }
}

static pliant_contact_pair begin_pair(pliant_contact *contact,
                                      const pliant_contact_candidate *candidate)
{
    const int32_t vertex = candidate->vertex;
    pliant_contact_pair pair = {.node = {contact->levels.level[vertex], vertex},
                                .tool = candidate->tool,
                                .index = -1,
                                .normal = {0, 0, 1},
                                .offset =
                                    pliant_contact_offset_at(contact, vertex, candidate->tool)};
    pair.area = pliant_model_node_area(contact->model, pair.node);
    pair.fade = pair.offset != 0 ? contact->def.fade_count : 0;
    pliant_contact_place_pair(contact, &pair);
    memcpy(pair.anchor, pair.x, sizeof pair.anchor);
    memcpy(pair.pushed_along, pair.normal, sizeof pair.normal);
    return pair;
}

// Fill next_pairs.
static int32_t choose_all(pliant_contact *contact, pliant_contact_choice choice)
{
    int32_t count = 0;
    for (int32_t i = 0; i < contact->candidate_count; i++) {
        const double key = get_key(contact, &contact->candidates[i], choice);
        if (key < INFINITY) choose(contact, &count, contact->room, key, i);
    }
    for (int32_t i = 0; i < count; i++) {
        const pliant_contact_candidate *candidate = &contact->candidates[contact->chosen[i]];
        const pliant_contact_pair *pair =
            pliant_contact_pair_at(contact, candidate->vertex, candidate->tool);
        const int32_t is_same =
            pair && pair->node.level == contact->levels.level[candidate->vertex];
        contact->next_pairs[i] = is_same ? *pair : begin_pair(contact, candidate);
        // A node that goes to another level stays stuck where it is.
        if (pair && !is_same)
            memcpy(contact->next_pairs[i].anchor, pair->anchor, sizeof pair->anchor);
    }
    return count;
}

// A pair's vertex is looked at from all sides: the odd vertices around it have the largest errors.
static void list_children(pliant_contact *contact, const pliant_contact_pair *pair)
{
    if (pair->node.level >= contact->model->finest_level) return;
    const pliant_child_range range =
        pliant_contact_levels_children(&contact->levels, pair->node.vertex, pair->node.level + 1);
    for (int32_t i = range.begin; i < range.end; i++) {
        const int32_t child = contact->levels.children[i];
        if (contact->model->domain[child] == PLIANT_DOMAIN_FREE)
            (void)pliant_contact_find_candidate(contact, child, pair->tool);
    }
}

static void take_next_pairs(pliant_contact *contact, int32_t count)
{
    for (int32_t i = 0; i < contact->pair_count; i++)
        *pair_at(contact, contact->pairs[i].node.vertex, contact->pairs[i].tool) = -1;
    pliant_contact_pair *pairs = contact->next_pairs;
    contact->next_pairs = contact->pairs;
    contact->pairs = pairs;
    contact->pair_count = count;
    for (int32_t i = 0; i < count; i++) {
        *pair_at(contact, pairs[i].node.vertex, pairs[i].tool) = i;
        list_children(contact, &pairs[i]);
    }
}

void pliant_contact_choose_pairs(pliant_contact *contact)
{
    take_next_pairs(contact, choose_all(contact, keeping));
}

// ---- Carrying over ----

static void sort_by_level(pliant_contact_pair *pairs, int32_t count)
{
    for (int32_t i = 1; i < count; i++) {
        const pliant_contact_pair pair = pairs[i];
        int32_t k = i;
        for (; k > 0 && pairs[k - 1].node.level > pair.node.level; k--) pairs[k] = pairs[k - 1];
        pairs[k] = pair;
    }
}

// What hats of coarser nodes exert at the vertex of a pair.
static void subtract_coarser(const pliant_contact *contact, pliant_contact_pair *pair)
{
    const double own[3] = {pair->pressure[0], pair->pressure[1], pair->pressure[2]};
    double all[3];
    // The pair itself is in that sum once.
    pliant_contact_pressure_at(contact, pair->node.vertex, pair->tool, all);
    for (int c = 0; c < 3; c++) pair->pressure[c] -= all[c] - own[c];
    double largest = 0;
    for (int c = 0; c < 3; c++) largest = fmax(largest, fabs(own[c]));
    // Rounding is nothing, and what would pull is left to the next solution.
    if (dot(pair->pressure, pair->normal) <= same_pressure * largest)
        memset(pair->pressure, 0, sizeof pair->pressure);
}

// Before pairs change: what is exerted at the children of nodes that went back.
static void list_losses(pliant_contact *contact)
{
    const pliant_contact_levels *levels = &contact->levels;
    const int32_t capacity = PLIANT_CONTACT_LOSS_PART * contact->def.node_capacity;
    contact->loss_count = 0;
    for (int32_t i = 0; i < contact->coarsened_count; i++) {
        const int32_t vertex = contact->coarsened[i], level = levels->level[vertex] + 1;
        const pliant_child_range range = pliant_contact_levels_children(levels, vertex, level);
        for (int32_t k = range.begin; k < range.end; k++) {
            const pliant_node child = {level, levels->children[k]};
            if (contact->model->domain[child.vertex] != PLIANT_DOMAIN_FREE) continue;
            int32_t at = 0;  // a child of two that went back
            while (at < contact->loss_count && contact->losses[at].node.vertex != child.vertex)
                at++;
            if (at < contact->loss_count) continue;
            for (int32_t t = 0; t < contact->def.tool_capacity; t++) {
                if (contact->reached[t].kind == PLIANT_TOOL_NONE) continue;
                if (contact->loss_count == capacity) return;
                pliant_contact_loss *loss = &contact->losses[contact->loss_count++];
                *loss = (pliant_contact_loss){.node = child, .tool = t};
                pliant_contact_pressure_at(contact, child.vertex, t, loss->pressure);
            }
        }
    }
}

void pliant_contact_share(const pliant_contact *contact, const int32_t *parents, int32_t tool,
                          double *share)
{
    // Those that are not pushed have nothing to give, if less is wanted.
    double sum = 0;
    for (int k = 0; k < 2; k++) {
        const pliant_contact_pair *pair = pliant_contact_pair_at(contact, parents[k], tool);
        share[k] = pair ? fmax(dot(pair->pressure, pair->normal), 0) : 0;
        sum += share[k];
    }
    for (int k = 0; k < 2 && sum > 0; k++) share[k] /= sum;
}

// The nodes that went back exert at their vertices what they did. What that misses of the force at
// their children's, or exceeds it by where a child would have to pull, goes to these children's
// parents, so that the tool's force stays.
static void make_up_for_losses(pliant_contact *contact)
{
    const pliant_hierarchy *hierarchy = contact->model->hierarchy;
    for (int32_t i = 0; i < contact->loss_count; i++) {
        const pliant_contact_loss *loss = &contact->losses[i];
        const int32_t *parents =
            hierarchy->stencils[loss->node.vertex - hierarchy->vertex_count[0]].parents;
        double pressure[3], share[2];
        pliant_contact_pressure_at(contact, loss->node.vertex, loss->tool, pressure);
        pliant_contact_share(contact, parents, loss->tool, share);
        const double area = pliant_model_node_area(contact->model, loss->node);
        for (int k = 0; k < 2; k++) {
            if (share[k] == 0) continue;
            pliant_contact_pair *heir = &contact->pairs[*pair_at(contact, parents[k], loss->tool)];
            for (int c = 0; c < 3; c++)
                heir->carried[c] +=
                    share[k] * (loss->pressure[c] - pressure[c]) * area / heir->area;
        }
    }
    for (int32_t i = 0; i < contact->pair_count && contact->loss_count > 0; i++) {
        pliant_contact_pair *pair = &contact->pairs[i];
        for (int c = 0; c < 3; c++) pair->pressure[c] += pair->carried[c];
        if (dot(pair->pressure, pair->normal) <= 0)
            memset(pair->pressure, 0, sizeof pair->pressure);
    }
}

void pliant_contact_carry_over(pliant_contact *contact)
{
    list_losses(contact);
    contact->carried_count = contact->pair_count;
    const int32_t count = choose_all(contact, carrying);
    sort_by_level(contact->next_pairs, count);
    for (int32_t i = 0; i < count; i++) {
        pliant_contact_pair *pair = &contact->next_pairs[i];
        const pliant_contact_pair *old =
            pliant_contact_pair_at(contact, pair->node.vertex, pair->tool);
        double pressure[3];
        pliant_contact_pressure_at(contact, pair->node.vertex, pair->tool, pressure);
        // What a hat dragged along sticks where it is now.
        if (!old || !pliant_contact_is_pushed(old))
            memcpy(pair->anchor, pair->x, sizeof pair->anchor);
        memcpy(pair->pressure, pressure, sizeof pressure);
        memset(pair->carried, 0, sizeof pair->carried);
    }
    take_next_pairs(contact, count);
    // Coarse to fine, so that what is subtracted is final.
    for (int32_t i = 0; i < count; i++) subtract_coarser(contact, &contact->pairs[i]);
    make_up_for_losses(contact);
}

void pliant_contact_carry_back(pliant_contact *contact)
{
    take_next_pairs(contact, contact->carried_count);
}
