// probes.h: the vertices that a script watches, by name.
#pragma once

#include "pliant/pliant.h"
#include "pliant/script.h"

#define PLIANT_PROBE_LIMIT 1024  // probes of one script

typedef struct pliant_probe {
    char name[PLIANT_SCRIPT_NAME_LIMIT];
    int32_t vertex;    // of the model
    int32_t instance;  // of a lattice
    int32_t place;     // in the surface
    int64_t step;      // the step that `u` belongs to, 0 before any
    pliant_vec3 u;     // displacement, m
} pliant_probe;

typedef struct pliant_probes {
    pliant_probe *list;    // shape [count], in the order of declaration
    int32_t *places;       // shape [count]: those of the list
    pliant_vec3 *scratch;  // shape [count]
    int32_t count;
} pliant_probes;  // zeroed is empty

const pliant_probe *pliant_probes_find(const pliant_probes *probes, const char *name);  // or NULL
// Copied. Refused with PLIANT_ERR_MEMORY or, at the limit, PLIANT_ERR_CAPACITY.
PLIANT_UNUSED_RESULT pliant_status pliant_probes_add(pliant_probes *probes,
                                                     const pliant_probe *probe);
void pliant_probes_clear(pliant_probes *probes);
