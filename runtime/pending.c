// pending.c: the type of a set that a deadline left no time for, built a slice at a time.
#include "pending.h"

#include <string.h>
#include <time.h>

// Members in a slice of extraction and of weighing.
enum { slice_members = 8 };
// Before a slice this many times its usual length must be left.
static const double margin = 2;
// What is not known yet is taken for this long. Slow slices are forgotten at this rate, also by
// waiting for time to run one: the first of a kind pays for memory that was never touched.
static const double first_slice_ns = 50e3, forget = 0.05;

void pliant_pending_lay_out(pliant_arena *arena, const pliant_model *model, int32_t capacity,
                            pliant_pending *pending)
{
    pliant_capacitance_lay_out(arena, model, capacity, &pending->type);
}

static void begin(const pliant_node *nodes, int32_t count, pliant_pending *pending)
{
    pliant_capacitance *type = &pending->type;
    type->count = count;
    memcpy(type->nodes, nodes, (size_t)count * sizeof *nodes);
    for (int32_t i = 0; i < count; i++) type->order[i] = i;
    pending->stage = PLIANT_PENDING_PLAN;
    pending->next = 0;
    pending->sweep = (pliant_dense_sweep){0};
}

static void enter(pliant_pending *pending, pliant_pending_stage stage)
{
    pending->stage = stage;
    pending->next = 0;
}

static void run_slice(const pliant_model *model, pliant_capacitance_scratch *scratch,
                      pliant_pending *pending)
{
    pliant_capacitance *type = &pending->type;
    const int32_t count = type->count;
    const int32_t end =
        count - pending->next < slice_members ? count : pending->next + slice_members;
    switch (pending->stage) {
    case PLIANT_PENDING_PLAN:
        pliant_capacitance_plan_members(model, scratch, type);
        enter(pending, PLIANT_PENDING_EXTRACT);
        return;
    case PLIANT_PENDING_EXTRACT:
        pliant_capacitance_extract_columns(model, pending->next, end, scratch, type);
        pending->next = end;
        if (end < count) return;
        pliant_capacitance_set_scales(model, type);
        enter(pending, PLIANT_PENDING_WEIGH);
        return;
    case PLIANT_PENDING_WEIGH:
        pliant_capacitance_weigh_columns(model, pending->next, end, scratch, type);
        pending->next = end;
        if (end == count) enter(pending, PLIANT_PENDING_INVERT);
        return;
    case PLIANT_PENDING_INVERT:
        switch (pliant_capacitance_sweep_step(model, scratch, &pending->sweep, type)) {
        case PLIANT_DENSE_MORE:
            return;
        case PLIANT_DENSE_DONE:
            enter(pending, PLIANT_PENDING_WHOLE);
            return;
        case PLIANT_DENSE_REFUSED:
            enter(pending, PLIANT_PENDING_REFUSED);
            return;
        }
        return;
    default:
        return;
    }
}

// What this thread worked, ns: a slice that was interrupted is no longer for it.
static int64_t worked_ns(void)
{
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return time.tv_sec * INT64_C(1000000000) + time.tv_nsec;
}

static int32_t is_busy(const pliant_pending *pending)
{
    return pending->stage >= PLIANT_PENDING_PLAN && pending->stage <= PLIANT_PENDING_INVERT;
}

void pliant_pending_advance(const pliant_model *model, const pliant_node *nodes, int32_t count,
                            int64_t deadline, pliant_capacitance_scratch *scratch,
                            pliant_pending *pending)
{
    const int32_t is_same = pending->stage != PLIANT_PENDING_NONE &&
                            pending->type.shift == scratch->held_shift &&
                            pliant_capacitance_matches(&pending->type, nodes, count);
    if (!is_same) {
        // A set that is gone with the next solve is not worth its time.
        begin(nodes, count, pending);
        pending->type.shift = scratch->held_shift;
        return;
    }
    int64_t worked = worked_ns();
    while (is_busy(pending)) {
        double *slice = &pending->slice_ns[pending->stage];
        if (*slice == 0) *slice = first_slice_ns;
        if ((double)(deadline - pliant_clock_ns()) < margin * *slice) {
            *slice *= 1 - forget;
            return;
        }
        run_slice(model, scratch, pending);
        const int64_t end = worked_ns();
        const double taken = (double)(end - worked);
        *slice += (taken > *slice ? 1 : forget) * (taken - *slice);
        worked = end;
    }
}

double pliant_pending_part(const pliant_pending *pending)
{
    const double n = 3.0 * pending->type.count;
    switch (pending->stage) {
    case PLIANT_PENDING_INVERT:
        return n > 0 ? 0.5 + 0.5 * (double)pending->sweep.panel / n : 1;
    case PLIANT_PENDING_EXTRACT:
        return n > 0 ? 0.5 * 3 * pending->next / n : 1;
    case PLIANT_PENDING_WEIGH:
        return 0.5;
    case PLIANT_PENDING_WHOLE:
        return 1;
    default:
        return 0;
    }
}
