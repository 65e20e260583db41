// reconstruction.c: selective inverse wavelet transform (GF 5.3): values of chosen nodes only.
//
// Step l of the inverse (l = 0 .. L-1) first takes from every node of level <= l the updates that
// its odd children of level l+1 gave it, which needs those children's raw coefficients, and then
// predicts the odd nodes of level l+1 from nodes of level <= l. So, from fine to coarse: a needed
// odd node of level l+1 needs its stencil's values after step l's updates, and a value that is
// needed after step l's updates needs all children of steps up to l. Nodes are listed per level as
// they become needed; step l updates those that were listed by the time the closure reached it.
#include "reconstruction.h"

#include "pliant/vector_clones.h"

#include <string.h>

typedef float row4 __attribute__((vector_size(16)));
typedef float row16 __attribute__((vector_size(64)));

// The largest plan is the whole inverse transform.
static size_t op_capacity(const pliant_wavelet *w)
{
    size_t ops = (size_t)(w->count - w->level_offset[1]);
    if (w->def.lifting == PLIANT_LIFTED)
        for (int32_t l = 0; l + 1 < w->level_count; l++) ops += (size_t)w->level_offset[l + 1];
    return ops;
}

static size_t entry_capacity(const pliant_wavelet *w)
{
    const size_t odd = (size_t)(w->count - w->level_offset[1]);
    return odd * (size_t)w->stencil_size + (w->def.lifting == PLIANT_LIFTED ? 2 * odd : 0);
}

void pliant_reconstruction_lay_out(pliant_arena *arena, const pliant_wavelet *w,
                                   pliant_reconstruction *plan)
{
    plan->wavelet = w;
    PLIANT_TAKE(arena, plan->position, w->count);
    PLIANT_TAKE(arena, plan->target, op_capacity(w));
    PLIANT_TAKE(arena, plan->begin, op_capacity(w) + 1);
    PLIANT_TAKE(arena, plan->source, entry_capacity(w));
    PLIANT_TAKE(arena, plan->weight, entry_capacity(w));
}

void pliant_reconstruction_scratch_lay_out(pliant_arena *arena, const pliant_wavelet *w,
                                           pliant_reconstruction_scratch *scratch)
{
    PLIANT_TAKE(arena, scratch->slot_of, w->count + 1);
    PLIANT_TAKE(arena, scratch->needed, w->count);
    PLIANT_TAKE(arena, scratch->is_needed, w->count);
}

void pliant_reconstruction_scratch_begin(const pliant_wavelet *w,
                                         pliant_reconstruction_scratch *scratch)
{
    memset(scratch->slot_of, 0xff, ((size_t)w->count + 1) * sizeof *scratch->slot_of);
}

static int32_t slot_for(pliant_reconstruction *plan, pliant_reconstruction_scratch *scratch,
                        int32_t position)
{
    int32_t slot = scratch->slot_of[position];
    if (slot < 0) {
        slot = scratch->slot_of[position] = plan->slot_count++;
        plan->position[slot] = position;
    }
    return slot;
}

static int32_t level_of(const pliant_wavelet *w, int32_t position)
{
    int32_t level = 0;
    while (position >= w->level_offset[level + 1]) level++;
    return level;
}

// List a position as needed in value; `level` is its level.
static void need(const pliant_wavelet *w, pliant_reconstruction_scratch *scratch, int32_t position,
                 int32_t level, int32_t *needed_count)
{
    if (scratch->is_needed[position]) return;
    scratch->is_needed[position] = 1;
    scratch->needed[w->level_offset[level] + needed_count[level]++] = position;
}

static void emit_update(pliant_reconstruction *plan, pliant_reconstruction_scratch *scratch,
                        int32_t l, int32_t position, int32_t *entry)
{
    const pliant_wavelet *w = plan->wavelet;
    const int32_t begin = w->update_offset[l][position], end = w->update_offset[l][position + 1];
    if (begin == end) return;
    plan->target[plan->op_count] = slot_for(plan, scratch, position);
    plan->begin[plan->op_count++] = *entry;
    for (int32_t e = begin; e < end; e++, (*entry)++) {
        plan->source[*entry] = slot_for(plan, scratch, w->update_odd[e]);
        plan->weight[*entry] = -w->update_odd_weight[e];
    }
}

static void emit_prediction(pliant_reconstruction *plan, pliant_reconstruction_scratch *scratch,
                            int32_t position, int32_t *entry)
{
    const pliant_wavelet *w = plan->wavelet;
    const size_t size = (size_t)w->stencil_size;
    const size_t first = (size_t)(position - w->level_offset[1]) * size;
    plan->target[plan->op_count] = slot_for(plan, scratch, position);
    plan->begin[plan->op_count++] = *entry;
    for (size_t k = first; k < first + size; k++) {
        if (w->predict_node[k] == w->count) continue;
        plan->source[*entry] = slot_for(plan, scratch, w->predict_node[k]);
        plan->weight[(*entry)++] = w->predict_weight_f[k];
    }
}

void pliant_reconstruction_build(pliant_reconstruction *plan,
                                 pliant_reconstruction_scratch *scratch, const int32_t *positions,
                                 int32_t count, int32_t *slots)
{
    const pliant_wavelet *w = plan->wavelet;
    const int32_t finest = w->level_count - 1;
    int32_t needed_count[PLIANT_LEVEL_LIMIT + 1] = {0};
    // updated[l][k]: how many of level k's needed nodes step l updates.
    int32_t updated[PLIANT_LEVEL_LIMIT + 1][PLIANT_LEVEL_LIMIT + 1];

    for (int32_t i = 0; i < count; i++)
        need(w, scratch, positions[i], level_of(w, positions[i]), needed_count);
    for (int32_t l = finest - 1; l >= 0; l--) {
        const int32_t begin = w->level_offset[l + 1];
        for (int32_t i = begin; i < begin + needed_count[l + 1]; i++) {
            const size_t size = (size_t)w->stencil_size;
            const size_t first = (size_t)(scratch->needed[i] - w->level_offset[1]) * size;
            for (size_t k = first; k < first + size; k++)
                if (w->predict_node[k] < w->count)
                    need(w, scratch, w->predict_node[k], level_of(w, w->predict_node[k]),
                         needed_count);
        }
        for (int32_t k = 0; k <= l; k++) updated[l][k] = needed_count[k];
    }

    plan->slot_count = plan->op_count = 0;
    int32_t entry = 0;
    for (int32_t l = 0; l < finest; l++) {
        if (w->def.lifting == PLIANT_LIFTED)
            for (int32_t k = 0; k <= l; k++)
                for (int32_t i = 0; i < updated[l][k]; i++)
                    emit_update(plan, scratch, l, scratch->needed[w->level_offset[k] + i], &entry);
        for (int32_t i = 0; i < needed_count[l + 1]; i++)
            emit_prediction(plan, scratch, scratch->needed[w->level_offset[l + 1] + i], &entry);
    }
    plan->begin[plan->op_count] = entry;
    for (int32_t i = 0; i < count; i++) slots[i] = slot_for(plan, scratch, positions[i]);

    pliant_reconstruction_unmap(plan, scratch);
    for (int32_t k = 0; k <= finest; k++)
        for (int32_t i = 0; i < needed_count[k]; i++)
            scratch->is_needed[scratch->needed[w->level_offset[k] + i]] = 0;
}

void pliant_reconstruction_map(const pliant_reconstruction *plan,
                               pliant_reconstruction_scratch *scratch)
{
    for (int32_t i = 0; i < plan->slot_count; i++) scratch->slot_of[plan->position[i]] = i;
}

void pliant_reconstruction_unmap(const pliant_reconstruction *plan,
                                 pliant_reconstruction_scratch *scratch)
{
    for (int32_t i = 0; i < plan->slot_count; i++) scratch->slot_of[plan->position[i]] = -1;
}

PLIANT_VECTOR_CLONES
void pliant_reconstruction_run(const pliant_reconstruction *plan, const float *g, float *work)
{
    const row4 *from = (const row4 *)g;
    row4 *slot = (row4 *)work;
    for (int32_t i = 0; i < plan->slot_count; i++) slot[i] = from[plan->position[i]];
    for (int32_t op = 0; op < plan->op_count; op++) {
        // Two sums, since one would wait for itself: an op has 2 to 12 terms.
        const int32_t end = plan->begin[op + 1];
        int32_t e = plan->begin[op];
        row4 sum = slot[plan->target[op]], other = {0};
        for (; e + 2 <= end; e += 2) {
            sum += plan->weight[e] * slot[plan->source[e]];
            other += plan->weight[e + 1] * slot[plan->source[e + 1]];
        }
        if (e < end) sum += plan->weight[e] * slot[plan->source[e]];
        slot[plan->target[op]] = sum + other;
    }
}

PLIANT_VECTOR_CLONES
void pliant_reconstruction_run_blocks(const pliant_reconstruction *plan, float *work)
{
    row16 *slot = (row16 *)work;
    for (int32_t op = 0; op < plan->op_count; op++) {
        // Two sums, since one would wait for itself: an op has 2 to 12 terms.
        const int32_t end = plan->begin[op + 1];
        int32_t e = plan->begin[op];
        row16 sum = slot[plan->target[op]], other = {0};
        for (; e + 2 <= end; e += 2) {
            sum += plan->weight[e] * slot[plan->source[e]];
            other += plan->weight[e + 1] * slot[plan->source[e + 1]];
        }
        if (e < end) sum += plan->weight[e] * slot[plan->source[e]];
        slot[plan->target[op]] = sum + other;
    }
}
