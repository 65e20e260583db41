// probes.c: the vertices that a script watches, by name.
#include "probes.h"

#include <stdlib.h>
#include <string.h>

const pliant_probe *pliant_probes_find(const pliant_probes *probes, const char *name)
{
    for (int32_t i = 0; i < probes->count; i++)
        if (strcmp(probes->list[i].name, name) == 0) return &probes->list[i];
    return NULL;
}

pliant_status pliant_probes_add(pliant_probes *probes, const pliant_probe *probe)
{
    if (probes->count == PLIANT_PROBE_LIMIT) return PLIANT_ERR_CAPACITY;
    const size_t count = (size_t)probes->count + 1;
    pliant_probe *list = realloc(probes->list, count * sizeof *list);
    if (!list) return PLIANT_ERR_MEMORY;
    probes->list = list;
    int32_t *places = realloc(probes->places, count * sizeof *places);
    if (!places) return PLIANT_ERR_MEMORY;
    probes->places = places;
    pliant_vec3 *scratch = realloc(probes->scratch, count * sizeof *scratch);
    if (!scratch) return PLIANT_ERR_MEMORY;
    probes->scratch = scratch;
    list[probes->count] = *probe;
    places[probes->count] = probe->place;
    probes->count++;
    return PLIANT_OK;
}

void pliant_probes_clear(pliant_probes *probes)
{
    free(probes->list);
    free(probes->places);
    free(probes->scratch);
    *probes = (pliant_probes){0};
}
