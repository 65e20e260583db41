// regions.c: the shape matching regions of a lattice, and how their sums are shared.
#include "pliant/regions.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

int32_t pliant_reach_plane(const pliant_reach *reach, int32_t w, int32_t plane, int32_t *masks)
{
    int32_t is_empty = 1, is_whole = 1;
    for (int32_t y = 0; y <= 2 * w; y++) {
        const uint32_t member = reach->member[plane][y], window = reach->window[plane][y];
        is_empty &= member == 0;
        is_whole &= member == window;
        masks[y] = (int32_t)(member && member == window ? member | PLIANT_ROW_WHOLE : member);
    }
    return is_empty ? PLIANT_PLANE_NONE : is_whole ? PLIANT_PLANE_WHOLE : 0;
}

// ---- Sets, told apart by the sum of a random number for each member ----

// Two numbers of 64 bits: among 2^26 regions two different ones agree with probability 2^-76.
typedef struct set_name {
    uint64_t a, b;
    int32_t particle;
} set_name;

static uint64_t mix(uint64_t x)  // splitmix64 (Steele, Lea, Flood 2014)
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

static int compare_names(const void *x, const void *y)
{
    const set_name *p = x, *q = y;
    if (p->a != q->a) return p->a < q->a ? -1 : 1;
    if (p->b != q->b) return p->b < q->b ? -1 : 1;
    return p->particle < q->particle ? -1 : p->particle > q->particle;
}

// Members that follow each other along x follow each other in number, so that a run of them is a
// difference of prefix sums.
static set_name name_of(const pliant_reach *reach, const pliant_links *links, const int32_t *at,
                        int32_t w, const uint64_t *prefix_a, const uint64_t *prefix_b)
{
    set_name name = {0, 0, 0};
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++) {
            uint32_t rest = reach->member[z][y];
            while (rest) {
                const int32_t start = __builtin_ctz(rest);
                const int32_t length = __builtin_ctz(~(rest >> start));
                const int32_t first =
                    pliant_links_particle(links, at[0] + start - w, at[1] + y - w, at[2] + z - w);
                name.a += prefix_a[first + length] - prefix_a[first];
                name.b += prefix_b[first + length] - prefix_b[first];
                rest &= ~((((uint32_t)1 << length) - 1) << start);
            }
        }
    return name;
}

static void share_regions(pliant_regions *regions, set_name *names)
{
    const int32_t count = regions->particle_count;
    qsort(names, (size_t)count, sizeof *names, compare_names);
    for (int32_t i = 0, least = 0; i < count; i++) {
        if (i == 0 || names[i].a != names[i - 1].a || names[i].b != names[i - 1].b) {
            least = names[i].particle;
            regions->region_count++;
        }
        regions->share[names[i].particle] = least;
    }
}

// ---- Nodes, in arrays that grow ----

typedef struct builder {
    pliant_regions *regions;
    int32_t region_capacity, plate_capacity;
    int32_t *table;  // open addressing over plate nodes; -1: empty
    uint32_t table_mask;
} builder;

static int32_t *grown(int32_t *array, int32_t count, int32_t *capacity, int32_t width)
{
    if (count < *capacity) return array;
    const int64_t wanted = *capacity ? 2 * (int64_t)*capacity : 256;
    if (wanted > INT32_MAX / 2) return NULL;
    int32_t *larger = realloc(array, (size_t)wanted * width * sizeof *array);
    if (larger) *capacity = (int32_t)wanted;
    return larger;
}

static uint32_t hash_node(const int32_t *node, int32_t width)
{
    uint64_t h = 0;
    for (int32_t k = 0; k < width; k++) h = mix(h ^ (uint32_t)node[k]);
    return (uint32_t)h;
}

static int rehash(builder *b, int32_t width)
{
    const uint32_t size = 2 * (b->table_mask + 1);
    int32_t *table = malloc(size * sizeof *table);
    if (!table) return -1;
    free(b->table);
    b->table = table;
    b->table_mask = size - 1;
    memset(table, -1, size * sizeof *table);
    for (int32_t n = 0; n < b->regions->plate_node_count; n++) {
        uint32_t at = hash_node(b->regions->plate_nodes + (size_t)n * width, width) & (size - 1);
        while (table[at] >= 0) at = (at + 1) & (size - 1);
        table[at] = n;
    }
    return 0;
}

// The number of this plate node, added if it is new; -1: no memory.
static int32_t find_plate(builder *b, const int32_t *node, int32_t width)
{
    pliant_regions *r = b->regions;
    if (!b->table || (uint32_t)r->plate_node_count > b->table_mask / 2)
        if (rehash(b, width)) return -1;
    uint32_t at = hash_node(node, width) & b->table_mask;
    for (; b->table[at] >= 0; at = (at + 1) & b->table_mask)
        if (!memcmp(r->plate_nodes + (size_t)b->table[at] * width, node, width * sizeof *node))
            return b->table[at];
    int32_t *nodes = grown(r->plate_nodes, r->plate_node_count, &b->plate_capacity, width);
    if (!nodes) return -1;
    r->plate_nodes = nodes;
    memcpy(nodes + (size_t)r->plate_node_count * width, node, width * sizeof *node);
    return b->table[at] = r->plate_node_count++;
}

static int add_region(builder *b, const pliant_reach *reach, int32_t particle, const int32_t *at)
{
    pliant_regions *r = b->regions;
    const int32_t w = r->half_width;
    int32_t *nodes = grown(r->region_nodes, r->region_node_count, &b->region_capacity, 2 * w + 2);
    if (!nodes) return -1;
    r->region_nodes = nodes;
    int32_t *region = nodes + (size_t)r->region_node_count++ * (2 * w + 2);
    region[0] = particle;
    for (int32_t plane = 0; plane <= 2 * w; plane++) {
        int32_t plate[PLIANT_WINDOW_LIMIT + 3] = {at[0], at[1], at[2] + plane - w};
        int32_t code = pliant_reach_plane(reach, w, plane, plate + 3);
        if (code == 0 && (code = find_plate(b, plate, 2 * w + 4)) < 0) return -1;
        region[1 + plane] = code;
    }
    return 0;
}

pliant_status pliant_regions_create(const pliant_lattice_shape *shape, int32_t half_width,
                                    pliant_regions **result, pliant_error *err)
{
    if (half_width < 1 || half_width > PLIANT_LATTICE_WIDTH_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "half-width: expected 1 to %d, found %d",
                                PLIANT_LATTICE_WIDTH_LIMIT, half_width);
    pliant_links *links = NULL;
    pliant_status status = pliant_links_create(shape, &links, err);
    if (status < 0) return status;

    const int32_t count = shape->particle_count;
    pliant_regions *regions = calloc(1, sizeof *regions);
    pliant_reach *reach = malloc(sizeof *reach);
    set_name *names = malloc((size_t)count * sizeof *names);
    uint64_t *prefix = malloc(2 * ((size_t)count + 1) * sizeof *prefix);
    builder b = {.regions = regions, .table_mask = 127};
    status = PLIANT_ERR_MEMORY;
    if (!regions || !reach || !names || !prefix) goto done;
    regions->half_width = half_width;
    regions->particle_count = count;
    regions->size = malloc((size_t)count * sizeof *regions->size);
    regions->share = malloc((size_t)count * sizeof *regions->share);
    if (!regions->size || !regions->share) goto done;

    uint64_t *prefix_a = prefix, *prefix_b = prefix + count + 1;
    prefix_a[0] = prefix_b[0] = 0;
    for (int32_t i = 0; i < count; i++) {
        prefix_a[i + 1] = prefix_a[i] + mix(2 * (uint64_t)i);
        prefix_b[i + 1] = prefix_b[i] + mix(2 * (uint64_t)i + 1);
    }
    for (int32_t i = 0; i < count; i++) {
        const int32_t *at = shape->particles + 3 * (size_t)i;
        pliant_links_reach(links, at[0], at[1], at[2], half_width, reach);
        regions->size[i] = reach->size;
        names[i] = name_of(reach, links, at, half_width, prefix_a, prefix_b);
        names[i].particle = i;
        if (!reach->is_regular && add_region(&b, reach, i, at)) goto done;
    }
    share_regions(regions, names);
    status = PLIANT_OK;
done:
    free(b.table);
    free(prefix);
    free(names);
    free(reach);
    pliant_links_destroy(links);
    if (status < 0) {
        pliant_regions_destroy(regions);
        return pliant_error_set(err, status, "lattice: no memory for the regions of %d particles",
                                count);
    }
    *result = regions;
    return PLIANT_OK;
}

void pliant_regions_destroy(pliant_regions *regions)
{
    if (!regions) return;
    free(regions->size);
    free(regions->share);
    free(regions->region_nodes);
    free(regions->plate_nodes);
    free(regions);
}
