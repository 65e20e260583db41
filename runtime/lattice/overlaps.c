// overlaps.c: which bodies' boxes meet.
//
// This follows: D. Baraff, Dynamic Simulation of Non-penetrating Rigid Bodies, thesis, Cornell 1992
// (sort and sweep along one axis); from step to step the order hardly changes, so that insertion
// sorts it in linear time.
#include "lattice/overlaps.h"

#include <string.h>

void pliant_overlaps_lay_out(pliant_overlaps *overlaps, pliant_arena *arena,
                             int32_t member_capacity)
{
    PLIANT_TAKE(arena, overlaps->order, member_capacity);
    PLIANT_TAKE(arena, overlaps->count, member_capacity);
    PLIANT_TAKE(arena, overlaps->others, (size_t)member_capacity * PLIANT_OVERLAP_LIMIT);
}

static int comes_before(const pliant_crowd *crowd, int32_t a, int32_t b)
{
    const float x = crowd->members[a].low[0], y = crowd->members[b].low[0];
    return x < y || (x == y && a < b);
}

static void sort(pliant_overlaps *overlaps, const pliant_crowd *crowd)
{
    // The last step's order, without those that are gone, and with the new ones at the end.
    int32_t *order = overlaps->order, *seen = overlaps->count, kept = 0;
    memset(seen, 0, (size_t)crowd->member_count * sizeof *seen);
    for (int32_t i = 0; i < crowd->member_capacity && kept < crowd->member_count; i++) {
        const int32_t member = order[i];
        if (member >= crowd->member_count || seen[member]) continue;
        seen[member] = 1;
        order[kept++] = member;
    }
    for (int32_t member = 0; member < crowd->member_count; member++)
        if (!seen[member]) order[kept++] = member;
    for (int32_t i = 1; i < kept; i++) {
        const int32_t member = order[i];
        int32_t at = i;
        for (; at > 0 && comes_before(crowd, member, order[at - 1]); at--)
            order[at] = order[at - 1];
        order[at] = member;
    }
}

static void note(pliant_overlaps *overlaps, int32_t member, int32_t other)
{
    const int32_t count = overlaps->count[member]++;
    overlaps->any += count == 0;
    if (count < PLIANT_OVERLAP_LIMIT)
        overlaps->others[(size_t)member * PLIANT_OVERLAP_LIMIT + (size_t)count] = other;
}

void pliant_overlaps_find(pliant_overlaps *overlaps, const pliant_crowd *crowd, float margin)
{
    sort(overlaps, crowd);
    memset(overlaps->count, 0, (size_t)crowd->member_count * sizeof *overlaps->count);
    overlaps->any = 0;
    for (int32_t i = 0; i < crowd->member_count; i++) {
        const int32_t a = overlaps->order[i];
        const pliant_member *m = &crowd->members[a];
        for (int32_t k = i + 1; k < crowd->member_count; k++) {
            const int32_t b = overlaps->order[k];
            const pliant_member *n = &crowd->members[b];
            if (n->low[0] - m->high[0] > 2 * margin) break;
            if (n->low[1] - m->high[1] > 2 * margin || m->low[1] - n->high[1] > 2 * margin ||
                n->low[2] - m->high[2] > 2 * margin || m->low[2] - n->high[2] > 2 * margin)
                continue;
            note(overlaps, a, b);
            note(overlaps, b, a);
        }
    }
}

int32_t pliant_overlaps_has(const pliant_overlaps *overlaps, const pliant_crowd *crowd,
                            int32_t member, const float *x, float margin)
{
    const int32_t count = overlaps->count[member];
    if (count > PLIANT_OVERLAP_LIMIT) return 1;
    for (int32_t i = 0; i < count; i++) {
        const int32_t other = overlaps->others[(size_t)member * PLIANT_OVERLAP_LIMIT + (size_t)i];
        const pliant_member *m = &crowd->members[other];
        int is_inside = 1;
        for (int c = 0; c < 3; c++)
            is_inside &= x[c] >= m->low[c] - 2 * margin && x[c] <= m->high[c] + 2 * margin;
        if (is_inside) return 1;
    }
    return 0;
}
