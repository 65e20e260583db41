// exchange.c: a solver's solution on its way from one thread to another, wait-free.
//
// Three messages: one that is being written, one that is being read and one between. Publishing
// and receiving exchange theirs for the one between by a single atomic operation, so that neither
// waits and the reader gets the newest. What a message holds is what its receiver cannot sum
// for itself: the values that the contact solve found at S, and everything specified outside.
#include "pliant/error.h"
#include "solver.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

typedef struct message {
    int32_t solved_count, load_count, listed_count;
    pliant_constraint *solved;  // shape [constraint_capacity]
    pliant_vec3 *reference;     // shape [constraint_capacity]
    pliant_constraint *loads;   // shape [load_capacity]: nodes and their summed values
    pliant_constraint *listed;  // shape [room]: likewise, of proxies and patches
    pliant_vec3 gravity;
    pliant_solver_report report;
} message;

enum { message_count = 3, is_fresh = 4 };  // is_fresh: a bit beside the number of the one between

struct pliant_exchange {
    const pliant_model *model;  // borrowed
    int32_t constraint_capacity, load_capacity;
    pliant_arena arena;
    message messages[message_count];
    int32_t written;  // the publisher's
    // Apart, so that the threads do not share a line.
    _Alignas(PLIANT_ARENA_ALIGN) atomic_int between;
    _Alignas(PLIANT_ARENA_ALIGN) int32_t read;  // the receiver's
};

static void lay_out(pliant_arena *arena, pliant_exchange *exchange)
{
    for (int i = 0; i < message_count; i++) {
        message *m = &exchange->messages[i];
        PLIANT_TAKE(arena, m->solved, exchange->constraint_capacity);
        PLIANT_TAKE(arena, m->reference, exchange->constraint_capacity);
        PLIANT_TAKE(arena, m->loads, exchange->load_capacity);
        PLIANT_TAKE(arena, m->listed, pliant_exchange_room(exchange->load_capacity));
    }
}

pliant_status pliant_exchange_create(const pliant_model *model, const pliant_solver_def *def,
                                     pliant_exchange **result, pliant_error *err)
{
    if (!model || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_exchange_create: expected a model and a place, found NULL");
    pliant_status status = pliant_model_check_greens(model, err);
    if (status < 0) return status;
    const pliant_solver_def used = def ? *def : pliant_solver_default(model);
    if (used.constraint_capacity < 1 || used.load_capacity < 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_exchange_create: expected a solver's capacities, found %d "
                                "constraints and %d loads",
                                used.constraint_capacity, used.load_capacity);
    pliant_exchange *exchange = aligned_alloc(PLIANT_ARENA_ALIGN, sizeof *exchange);
    if (!exchange) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for an exchange");
    memset(exchange, 0, sizeof *exchange);
    const int32_t n = model->vertex_count;
    exchange->model = model;
    exchange->constraint_capacity = used.constraint_capacity < n ? used.constraint_capacity : n;
    exchange->load_capacity = used.load_capacity < n ? used.load_capacity : n;
    lay_out(&exchange->arena, exchange);
    status = pliant_arena_reserve(&exchange->arena, err);
    if (status < 0) {
        free(exchange);
        return status;
    }
    lay_out(&exchange->arena, exchange);
    exchange->written = 0;
    atomic_init(&exchange->between, 1);
    exchange->read = 2;
    *result = exchange;
    return PLIANT_OK;
}

void pliant_exchange_destroy(pliant_exchange *exchange)
{
    if (!exchange) return;
    pliant_arena_release(&exchange->arena);
    free(exchange);
}

// As many again as there may be statements, and some for proxies.
int32_t pliant_exchange_room(int32_t load_capacity)
{
    return load_capacity + 64;
}

static pliant_vec3 add(pliant_vec3 a, pliant_vec3 b)
{
    return (pliant_vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static int32_t is_zero(pliant_vec3 v)
{
    return v.x == 0 && v.y == 0 && v.z == 0;
}

pliant_status pliant_solver_publish(const pliant_solver *solver, pliant_exchange *exchange)
{
    if (solver->model != exchange->model) return PLIANT_ERR_ARGUMENT;
    if (solver->solved_count > exchange->constraint_capacity) return PLIANT_ERR_CAPACITY;
    message *to = &exchange->messages[exchange->written];
    to->load_count = 0;
    for (int32_t i = 0; i < solver->load_count; i++) {
        const pliant_load *load = &solver->loads[i];
        // As summed: statements made after the solve are not in its solution.
        if (is_zero(load->summed)) continue;
        if (to->load_count == exchange->load_capacity) return PLIANT_ERR_CAPACITY;
        to->loads[to->load_count++] = (pliant_constraint){load->node, load->summed};
    }
    to->listed_count = 0;
    for (const pliant_load_list *list = solver->lists; list; list = list->next)
        for (int32_t i = 0; i < list->count; i++) {
            const pliant_load *load = &list->loads[i];
            if (is_zero(load->summed)) continue;
            if (to->listed_count == pliant_exchange_room(exchange->load_capacity))
                return PLIANT_ERR_CAPACITY;
            to->listed[to->listed_count++] = (pliant_constraint){load->node, load->summed};
        }
    to->solved_count = solver->solved_count;
    memcpy(to->solved, solver->solved, (size_t)solver->solved_count * sizeof *to->solved);
    memcpy(to->reference, solver->reference, (size_t)solver->solved_count * sizeof *to->reference);
    to->gravity = solver->summed_gravity;
    to->report = solver->report;
    exchange->written = atomic_exchange_explicit(&exchange->between, exchange->written | is_fresh,
                                                 memory_order_acq_rel) &
                        ~is_fresh;
    return PLIANT_OK;
}

// The viewer's statements become what the message says.
static void state(pliant_solver *viewer, const message *from)
{
    pliant_solver_release_all(viewer);
    for (int32_t i = 0; i < from->load_count; i++)
        pliant_loads_set(viewer, from->loads[i].node, from->loads[i].value);
    const int32_t room = 2 * pliant_exchange_room(viewer->load_capacity);
    if (!viewer->received.is_entered) pliant_load_list_enter(viewer, &viewer->received);
    viewer->received.is_entered = 1;
    // What lists have on one node, in several lists or twice, adds up.
    for (int32_t i = 0; i < from->listed_count; i++) {
        pliant_vec3 sum = from->listed[i].value;
        const pliant_node node = from->listed[i].node;
        for (int32_t k = 0; k < i; k++)
            if (from->listed[k].node.vertex == node.vertex &&
                from->listed[k].node.level == node.level)
                sum = add(sum, from->listed[k].value);
        (void)pliant_load_list_press(viewer, &viewer->received, room, node, sum);
    }
    viewer->gravity = from->gravity;
    viewer->loads_changed = 1;
    memcpy(viewer->constraints, from->solved, (size_t)from->solved_count * sizeof *from->solved);
    viewer->constraint_count = from->solved_count;
}

int32_t pliant_solver_receive(pliant_solver *viewer, pliant_exchange *exchange)
{
    if (viewer->model != exchange->model) return PLIANT_ERR_ARGUMENT;
    if (viewer->constraint_capacity < exchange->constraint_capacity ||
        viewer->load_capacity < exchange->load_capacity)
        return PLIANT_ERR_CAPACITY;
    // Only this thread takes a fresh one away, so that it is still there in the exchange.
    if (!(atomic_load_explicit(&exchange->between, memory_order_relaxed) & is_fresh)) return 0;
    exchange->read =
        atomic_exchange_explicit(&exchange->between, exchange->read, memory_order_acq_rel) &
        ~is_fresh;
    const message *from = &exchange->messages[exchange->read];
    state(viewer, from);
    pliant_solver_adopt(viewer, from->solved, from->reference, from->solved_count);
    const int64_t surface_ns = viewer->report.surface_ns;
    viewer->report = from->report;
    viewer->report.surface_ns = surface_ns;
    return 1;
}
