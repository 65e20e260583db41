// irregular.c: regions that are not all particles of their window, ready for summing.
#include "lattice/irregular.h"

#include <string.h>

void pliant_irregular_lay_out(pliant_irregular *irregular, pliant_arena *arena)
{
    const int32_t width = 2 * irregular->half_width + 1;
    PLIANT_TAKE(arena, irregular->column_head, irregular->column_count);
    PLIANT_TAKE(arena, irregular->slab_head, irregular->slab_count);
    PLIANT_TAKE(arena, irregular->regions, irregular->region_capacity);
    PLIANT_TAKE(arena, irregular->parts, (size_t)irregular->region_capacity * width);
    PLIANT_TAKE(arena, irregular->plates, irregular->plate_capacity);
    PLIANT_TAKE(arena, irregular->rows, (size_t)irregular->plate_capacity * width);
}

void pliant_irregular_clear(pliant_irregular *irregular)
{
    for (int32_t c = 0; c < irregular->column_count; c++) irregular->column_head[c] = -1;
    for (int32_t z = 0; z < irregular->slab_count; z++) irregular->slab_head[z] = -1;
    for (int32_t n = 0; n < irregular->region_capacity; n++)
        irregular->regions[n].next = n + 1 < irregular->region_capacity ? n + 1 : -1;
    for (int32_t n = 0; n < irregular->plate_capacity; n++)
        irregular->plates[n].next = n + 1 < irregular->plate_capacity ? n + 1 : -1;
    irregular->free_region = irregular->region_capacity ? 0 : -1;
    irregular->free_plate = irregular->plate_capacity ? 0 : -1;
    irregular->region_count = irregular->plate_count = 0;
}

// A list in the order of `from`, so that sums round alike.
static void copy_regions(pliant_irregular *to, const pliant_irregular *from, int32_t column)
{
    const int32_t width = 2 * from->half_width + 1;
    int32_t *link = &to->column_head[column];
    for (int32_t n = from->column_head[column]; n >= 0; n = from->regions[n].next) {
        const int32_t m = to->free_region;
        to->free_region = to->regions[m].next;
        to->regions[m] = from->regions[n];
        memcpy(to->parts + (size_t)m * width, from->parts + (size_t)n * width,
               width * sizeof *to->parts);
        to->regions[m].next = -1;
        *link = m;
        link = &to->regions[m].next;
    }
}

void pliant_irregular_copy(pliant_irregular *to, const pliant_irregular *from)
{
    const int32_t width = 2 * from->half_width + 1;
    pliant_irregular_clear(to);
    // Plates keep their numbers, which parts refer to: those in use come first in `to`'s order.
    int32_t last = -1;
    for (int32_t z = 0; z < from->slab_count; z++)
        for (int32_t n = from->slab_head[z]; n >= 0; n = from->plates[n].next)
            last = n > last ? n : last;
    for (int32_t n = 0; n <= last; n++) {
        to->plates[n] = from->plates[n];
        memcpy(to->rows + (size_t)n * width, from->rows + (size_t)n * width,
               width * sizeof *to->rows);
    }
    memcpy(to->slab_head, from->slab_head, (size_t)from->slab_count * sizeof *to->slab_head);
    to->free_plate = last + 1 < to->plate_capacity ? last + 1 : -1;
    for (int32_t n = 0; n <= last; n++) {
        if (from->plates[n].use_count > 0) continue;
        to->plates[n].next = to->free_plate;
        to->free_plate = n;
    }
    for (int32_t c = 0; c < from->column_count; c++) copy_regions(to, from, c);
    to->region_count = from->region_count;
    to->plate_count = from->plate_count;
}

// ---- Add ----

// The part of plane `plane` that is in the region (or, with `missing`, that is not).
typedef struct plane_set {
    int32_t is_empty, is_whole;
    int32_t row_count;
    pliant_row rows[PLIANT_WINDOW_LIMIT];
} plane_set;

static void set_of(const pliant_reach *reach, int32_t w, int32_t plane, int32_t missing,
                   plane_set *set)
{
    set->is_empty = set->is_whole = 1;
    set->row_count = 0;
    for (int32_t y = 0; y <= 2 * w; y++) {
        const uint32_t window = reach->window[plane][y], member = reach->member[plane][y];
        const uint32_t mask = missing ? window & ~member : member;
        set->is_whole &= mask == window;
        if (!mask) continue;
        set->is_empty = 0;
        set->rows[set->row_count++] =
            (pliant_row){y, mask == window ? mask | PLIANT_ROW_WHOLE : mask};
    }
}

static int32_t part_count(const pliant_reach *reach, int32_t w, int32_t missing)
{
    int32_t count = 0;
    for (int32_t plane = 0; plane <= 2 * w; plane++) {
        int32_t is_empty = 1, is_whole = 1;
        for (int32_t y = 0; y <= 2 * w; y++) {
            const uint32_t window = reach->window[plane][y], member = reach->member[plane][y];
            const uint32_t mask = missing ? window & ~member : member;
            is_empty &= mask == 0;
            is_whole &= mask == window;
        }
        // A restricted plane costs its rows too.
        count += is_empty ? 0 : is_whole ? 1 : 3;
    }
    return count;
}

static void drop_plate(pliant_irregular *irregular, int32_t plate)
{
    pliant_plate_node *node = &irregular->plates[plate];
    if (--node->use_count > 0) return;
    int32_t *link = &irregular->slab_head[node->z];
    while (*link != plate) link = &irregular->plates[*link].next;
    *link = node->next;
    node->next = irregular->free_plate;
    irregular->free_plate = plate;
    irregular->plate_count--;
}

// Regions that may have a plate in common with one: those of the same lane of its column within 2w.
typedef struct kin {
    int32_t count;
    int32_t nodes[2 * PLIANT_WINDOW_LIMIT];
} kin;

static void find_kin(const pliant_irregular *irregular, const pliant_region_place *place, kin *k)
{
    const int32_t reach = 2 * irregular->half_width;
    k->count = 0;
    for (int32_t n = irregular->column_head[place->column]; n >= 0;
         n = irregular->regions[n].next) {
        const pliant_region_node *node = &irregular->regions[n];
        if (node->lane != place->lane || node->z > place->z + reach || node->z < place->z - reach)
            continue;
        k->nodes[k->count++] = n;
    }
}

// The plate of this place and these rows, made if there is none; -1: no node left.
static int32_t take_plate(pliant_irregular *irregular, const pliant_region_place *place,
                          const kin *k, int32_t z, const plane_set *set)
{
    const int32_t w = irregular->half_width, width = 2 * w + 1;
    const size_t bytes = (size_t)set->row_count * sizeof *set->rows;
    for (int32_t i = 0; i < k->count; i++) {
        const pliant_region_node *node = &irregular->regions[k->nodes[i]];
        const pliant_part *parts = irregular->parts + (size_t)k->nodes[i] * width;
        for (int32_t p = 0; p < node->part_count; p++) {
            if (node->z + parts[p].plane - w != z) continue;
            const int32_t n = parts[p].plate;
            if (n < 0 || irregular->plates[n].row_count != set->row_count) break;
            if (memcmp(irregular->rows + (size_t)n * width, set->rows, bytes) != 0) break;
            irregular->plates[n].use_count++;
            return n;
        }
    }
    const int32_t n = irregular->free_plate;
    if (n < 0) return -1;
    pliant_plate_node *node = &irregular->plates[n];
    irregular->free_plate = node->next;
    *node = (pliant_plate_node){.next = irregular->slab_head[z],
                                .use_count = 1,
                                .x = place->x,
                                .y = place->y,
                                .z = z,
                                .row_count = set->row_count};
    memcpy(irregular->rows + (size_t)n * width, set->rows, bytes);
    irregular->slab_head[z] = n;
    irregular->plate_count++;
    return n;
}

int32_t pliant_irregular_add(pliant_irregular *irregular, const pliant_region_place *place,
                             const pliant_reach *reach, pliant_region_rule rule)
{
    const int32_t w = irregular->half_width, n = irregular->free_region;
    if (n < 0) return -1;
    const int32_t missing =
        rule == PLIANT_REGION_CHEAPEST && part_count(reach, w, 1) < part_count(reach, w, 0);
    pliant_part *parts = irregular->parts + (size_t)n * (2 * w + 1);
    kin kin_of_place;
    find_kin(irregular, place, &kin_of_place);
    int32_t count = 0;
    for (int32_t plane = 0; plane <= 2 * w; plane++) {
        plane_set set;
        set_of(reach, w, plane, missing, &set);
        if (set.is_empty) continue;
        int32_t plate = -1;
        if (!set.is_whole) {
            plate = take_plate(irregular, place, &kin_of_place, place->z + plane - w, &set);
            if (plate < 0) {
                while (count-- > 0)
                    if (parts[count].plate >= 0) drop_plate(irregular, parts[count].plate);
                return -1;
            }
        }
        parts[count++] = (pliant_part){plane, plate};
    }
    pliant_region_node *node = &irregular->regions[n];
    irregular->free_region = node->next;
    *node = (pliant_region_node){.next = irregular->column_head[place->column],
                                 .particle = place->particle,
                                 .block = place->block,
                                 .lane = place->lane,
                                 .z = place->z,
                                 .sign = missing ? -1 : 1,
                                 .part_count = count};
    irregular->column_head[place->column] = n;
    irregular->region_count++;
    return 0;
}

void pliant_irregular_remove(pliant_irregular *irregular, const pliant_region_place *place)
{
    int32_t *link = &irregular->column_head[place->column];
    while (*link >= 0 && irregular->regions[*link].particle != place->particle)
        link = &irregular->regions[*link].next;
    const int32_t n = *link;
    if (n < 0) return;
    pliant_region_node *node = &irregular->regions[n];
    const pliant_part *parts = irregular->parts + (size_t)n * (2 * irregular->half_width + 1);
    for (int32_t k = 0; k < node->part_count; k++)
        if (parts[k].plate >= 0) drop_plate(irregular, parts[k].plate);
    *link = node->next;
    node->next = irregular->free_region;
    irregular->free_region = n;
    irregular->region_count--;
}
