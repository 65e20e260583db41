// members.c: who is in a region, and what they weigh.
#include "lattice/members.h"

void pliant_members_find(const pliant_lattice *lattice, const pliant_regions *regions,
                         int32_t particle, const int32_t *node, pliant_reach *reach)
{
    const int32_t w = lattice->half_width, *at = lattice->places + 3 * (size_t)particle;
    pliant_links_window(lattice->links, at[0], at[1], at[2], w, reach);
    reach->is_regular = node == NULL;
    for (int32_t plane = 0; node && plane <= 2 * w; plane++) {
        const int32_t code = node[1 + plane];
        if (code == PLIANT_PLANE_WHOLE) continue;
        for (int32_t y = 0; y <= 2 * w; y++) {
            const uint32_t mask =
                code < 0 ? 0 : (uint32_t)regions->plate_nodes[(size_t)code * (2 * w + 4) + 3 + y];
            reach->member[plane][y] =
                mask & PLIANT_ROW_WHOLE ? reach->window[plane][y] : mask & reach->window[plane][y];
        }
    }
    reach->size = regions->size[particle];
}

int32_t pliant_members_lacking(const pliant_reach *reach, int32_t w)
{
    int32_t count = 0;
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++)
            count += __builtin_popcount(reach->window[z][y] & ~reach->member[z][y]);
    return count;
}

pliant_region_moments pliant_members_weigh(const pliant_lattice *lattice, const pliant_reach *reach,
                                           int32_t particle, const pliant_prefix_sums *sums)
{
    const int32_t w = lattice->half_width, *at = lattice->places + 3 * (size_t)particle;
    double mass = 0, offset[3] = {0};
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++) {
            uint32_t rest = reach->member[z][y];
            double row = 0, moment = 0;
            while (rest) {
                const int32_t start = __builtin_ctz(rest);
                const int32_t length = __builtin_ctz(~(rest >> start));
                const int32_t first = pliant_links_particle(lattice->links, at[0] + start - w,
                                                            at[1] + y - w, at[2] + z - w);
                row += sums->share[first + length] - sums->share[first];
                moment += sums->moment[first + length] - sums->moment[first];
                rest &= ~((((uint32_t)1 << length) - 1) << start);
            }
            mass += row;
            offset[0] += moment - at[0] * row;
            offset[1] += (y - w) * row;
            offset[2] += (z - w) * row;
        }
    return (pliant_region_moments){mass, {offset[0] / mass, offset[1] / mass, offset[2] / mass}};
}
