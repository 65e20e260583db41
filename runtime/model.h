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
    pliant_wavelet *wavelet;  // owned; NULL without Green's functions
    const float *gravity;     // shape [count][3][3], transformed; NULL: not stored
} pliant_model_domain;

struct pliant_model {
    pliant_reader *reader;
    pliant_hierarchy *hierarchy;
    pliant_model_view view;
    int32_t level_count, vertex_count, finest_level;
    // Levels that have columns: bit l of the mask, and the ends of what is set.
    uint32_t stored_levels;
    int32_t coarsest_stored, finest_stored;
    pliant_model_domain domains[PLIANT_DOMAIN_COUNT];
    // Columns of every level, [row domain][column domain][level]; offset NULL: not stored.
    pliant_columns greens[PLIANT_DOMAIN_COUNT][PLIANT_DOMAIN_COUNT][PLIANT_LEVEL_LIMIT + 1];

    pliant_arena arena;
    double *areas;         // shape [n], a_i of the finest level
    // Integrals of the hats of each level within their domains, shape [|K(l)|] (GF-53):
    //     A_k(l) = A_k(l+1) + 1/2 sum of A_m(l+1) over the odd children m of k in k's domain
    double *node_areas[PLIANT_LEVEL_LIMIT + 1];
    int32_t *position;     // shape [n]: of a vertex in its domain
    uint8_t *domain;       // shape [n]: of a vertex
    int32_t *from_source;  // shape [n]: model vertex of an input vertex, or -1
};

// The columns that a node's hat is a column of, on the rows of a domain; its column there.
static inline const pliant_columns *pliant_model_columns(const pliant_model *model,
                                                         int32_t row_domain, pliant_node node)
{
    return &model->greens[row_domain][model->domain[node.vertex]][node.level];
}

// PLIANT_ERR_MISSING, by name: the file has a lattice only. Then no vertex is of either domain.
PLIANT_UNUSED_RESULT pliant_status pliant_model_check_greens(const pliant_model *model,
                                                             pliant_error *err);

// Is it a node with columns? PLIANT_ERR_ARGUMENT: no such node; PLIANT_ERR_MISSING: not stored.
pliant_status pliant_model_check_node(const pliant_model *model, pliant_node node);

// The hats of `level` that are not zero at a vertex, within its domain: at most three (it lies in
// one triangle of the level). Returns their number; `vertices` and `weights` have shape [3].
int32_t pliant_model_hats_at(const pliant_model *model, int32_t level, int32_t vertex,
                             int32_t *vertices, float *weights);
