// model_view.h: the sections of a model file as typed arrays whose every index has been checked.
//
// Bind is the one place that distrusts a model file: afterwards shapes agree with each other, every
// index is in range and every number finite. The topology of the levels is checked by
// pliant_hierarchy_create, which the caller runs on faces and parents. Pointers are borrowed until
// the reader is closed.
#pragma once

#include "pliant/reader.h"

// The columns of one level of one block: wavelet coefficients of the row domain.
typedef struct pliant_greens_view {
    int32_t row_count;              // positions of the row domain: m or k
    int32_t column_count;           // column c belongs to position c of the column domain
    uint64_t nnz;                   // stored blocks
    const uint64_t *column_offset;  // shape [column_count + 1]; NULL: this level is not stored
    const int32_t *row;             // shape [nnz], ascending within a column
    const float *block;             // shape [nnz][3][3]: component r per unit component c
    const double *summary;          // shape [PLIANT_SUMMARY_COUNT]
} pliant_greens_view;

typedef struct pliant_model_view {
    int32_t vertex_count;  // n
    int32_t face_count;    // nf
    int32_t level_count;   // L + 1
    int32_t has_greens;    // 0: a lattice only; then what belongs to Green's functions is 0 or NULL
    int32_t free_count;    // m
    int32_t fixed_count;   // k
    int32_t has_supports;  // 1: the fixed blocks and gravity_fixed are stored
    uint64_t provenance_bytes;
    int32_t detail_steps;         // D subdivision steps from level L to the detail; 0: none stored
    int32_t detail_vertex_count;  // of the detailed surface
    // The lattice; counts are 0 without one:
    int32_t lattice_cell_count;         // nc
    int32_t lattice_particle_count;     // np
    int32_t lattice_dims[3];            // largest particle coordinate + 1; at most 1024
    int32_t lattice_half_width;         // w, 1 .. 15
    int32_t lattice_region_node_count;  // nr
    int32_t lattice_plate_node_count;   // nl
    int32_t lattice_batch_count;        // nb
    int32_t lattice_batch_point_count;  // of all batches

    // One pointer per row of PLIANT_MODEL_SECTIONS:
    const double *vertices;             // [n][3]
    const int32_t *faces;               // [nf][3], finest level, children order of hierarchy.h
    const int32_t *level_vertex_count;  // [L + 1], |K(l)|
    const int32_t *parents;             // [n - n0][2]
    const int32_t *source_index;        // [n], -1: made by subdivision
    const double *material;             // [3] young, poisson, density
    // NULL without Green's functions:
    const int32_t *free_nodes;          // [m], ascending
    const int32_t *free_level_offset;   // [L + 2]
    const int32_t *fixed_nodes;         // [k], ascending
    const int32_t *fixed_level_offset;  // [L + 2]
    const float *gravity_free;          // [m][3][3], transformed, per unit acceleration
    const float *gravity_fixed;         // [k][3][3]; NULL without supports
    const unsigned char *provenance;  // [provenance_bytes], "key = value" lines, no NUL at the end
    // NULL without detail:
    const int32_t *detail_level_count;   // [D + 1], vertices after each step; the first is n
    const float *detail_offset;          // [detail_vertex_count][3]: tangential two, normal
    const int32_t *detail_source_index;  // [detail_vertex_count], -1: made by subdivision
    // NULL without a lattice; see formats/README.md:
    const double *lattice_frame;                // [PLIANT_LATTICE_FRAME_COUNT]
    const int32_t *lattice_summary;             // [PLIANT_LATTICE_SUMMARY_COUNT]
    const int32_t *lattice_cells;               // [nc][3] least corner, ascending by (z, y, x)
    const int32_t *lattice_particles;           // [np][3], the cells' corners, likewise
    const float *lattice_mass;                  // [np], kg, > 0
    const int32_t *lattice_region_size;         // [np], 1 .. np
    const int32_t *lattice_region_share;        // [np], least particle with the same region
    const int32_t *lattice_region_nodes;        // [nr][2w + 2], ascending particles
    const int32_t *lattice_plate_nodes;         // [nl][2w + 4]
    const int32_t *lattice_vertex_cell;         // [n]
    const float *lattice_vertex_offset;         // [n][3], 0 .. 1
    const float *lattice_vertex_tangents;       // [n][2][3], orthonormal
    const int32_t *lattice_batch_face_offset;   // [nb + 1]
    const int32_t *lattice_batch_faces;         // [nf], a permutation
    const int32_t *lattice_batch_point_offset;  // [nb + 1]
    const int32_t *lattice_batch_points;        // [batch_point_offset[nb]], ascending in a batch

    pliant_greens_view greens[PLIANT_BLOCK_COUNT][PLIANT_LEVEL_LIMIT + 1];
} pliant_model_view;

// Fill `view`, or refuse with the section, the element, what was expected and what was found.
// PLIANT_ERR_MISSING: not a model file (a dense file, say), or a section is absent. On refusal
// `view` is unchanged.
PLIANT_UNUSED_RESULT pliant_status pliant_model_view_bind(const pliant_reader *reader,
                                                          pliant_model_view *view,
                                                          pliant_error *err);
