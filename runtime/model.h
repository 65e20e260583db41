// model.h: what an open model holds for the solver; const after open and shared by all threads.
#pragma once

#include "columns.h"
#include "pliant/arena.h"
#include "pliant/model_view.h"
#include "pliant/pliant.h"
#include "pliant/wavelet.h"

// The two domains of the reference problem. Values v are displacements on free nodes and tractions
// on fixed ones; specified values vbar the other way round (GF-6).
enum { PLIANT_DOMAIN_FREE, PLIANT_DOMAIN_FIXED, PLIANT_DOMAIN_COUNT };

typedef struct pliant_model_domain {
    int32_t count;
    const int32_t *nodes;     // shape [count], ascending vertices; borrowed from the file
    pliant_wavelet *wavelet;  // owned
    const float *gravity;     // shape [count][3][3], transformed; NULL: not stored
} pliant_model_domain;

struct pliant_model {
    pliant_reader *reader;
    pliant_hierarchy *hierarchy;
    pliant_model_view view;
    int32_t level_count, vertex_count, finest_level;
    pliant_model_domain domains[PLIANT_DOMAIN_COUNT];
    // Columns of the finest level, [row domain][column domain]; offset NULL: not stored.
    pliant_columns greens[PLIANT_DOMAIN_COUNT][PLIANT_DOMAIN_COUNT];

    pliant_arena arena;
    double *areas;         // shape [n]
    int32_t *position;     // shape [n]: of a vertex in its domain
    uint8_t *domain;       // shape [n]: of a vertex
    int32_t *from_source;  // shape [n]: model vertex of an input vertex, or -1
};
