// load_list.c: tractions beside what the caller states: what proxies press with, what fades after a
// patch's nodes, what a viewer took over.
#include "solver.h"

#include <math.h>

void pliant_load_list_enter(pliant_solver *solver, pliant_load_list *list)
{
    list->next = solver->lists;
    solver->lists = list;
}

void pliant_load_list_leave(pliant_solver *solver, pliant_load_list *list)
{
    pliant_load_list **at = &solver->lists;
    while (*at != list) at = &(*at)->next;
    *at = list->next;
    // Its numbers go with it, so what it added can only be left out of a fresh sum.
    for (int32_t d = 0; d < solver->domain_count; d++) solver->fields[d].drift = INFINITY;
    solver->loads_changed = 1;
}

void pliant_load_list_clear(pliant_solver *solver, pliant_load_list *list)
{
    for (int32_t i = 0; i < list->count; i++) list->loads[i].value = (pliant_vec3){0, 0, 0};
    if (list->count > 0) solver->loads_changed = 1;
}

static int32_t is_zero(pliant_vec3 v)
{
    return v.x == 0 && v.y == 0 && v.z == 0;
}

int32_t pliant_load_list_press(pliant_solver *solver, pliant_load_list *list, int32_t capacity,
                               pliant_node node, pliant_vec3 traction)
{
    // Best the place that this node had last, whose weight is known; else one that is in no sum.
    pliant_load *place = NULL;
    for (int32_t i = 0; i < list->count; i++) {
        pliant_load *load = &list->loads[i];
        const int32_t is_same =
            load->node.level == node.level && load->node.vertex == node.vertex;
        if (is_same || (!place && is_zero(load->value) && is_zero(load->summed))) place = load;
        if (is_same) break;
    }
    if (!place) {
        if (list->count == capacity) return 0;
        place = &list->loads[list->count++];
        *place = (pliant_load){.node = node, .weight = {-1, -1}};
    }
    if (place->node.level != node.level || place->node.vertex != node.vertex)
        *place = (pliant_load){.node = node, .weight = {-1, -1}};
    place->is_specified = 1;
    place->value = traction;
    solver->loads_changed = 1;
    return 1;
}

pliant_vec3 pliant_load_lists_summed(const pliant_solver *solver, pliant_node node)
{
    pliant_vec3 sum = {0, 0, 0};
    for (const pliant_load_list *list = solver->lists; list; list = list->next)
        for (int32_t i = 0; i < list->count; i++) {
            const pliant_load *load = &list->loads[i];
            if (load->node.vertex != node.vertex || load->node.level != node.level) continue;
            sum.x += load->summed.x, sum.y += load->summed.y, sum.z += load->summed.z;
        }
    return sum;
}
