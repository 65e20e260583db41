// sections.h: what a model file and a dense file consist of: one table, read by everybody.
//
// The tables below are expanded by the layouts (for writers), the views (for readers), their
// checks, the tests and the fuzzer. A change of the format is a row here and a step of
// PLIANT_FORMAT_VERSION. The meaning of every section is in formats/README.md.
#pragma once

#include "pliant/hierarchy.h"
#include "pliant/links.h"

#include <stddef.h>

#define PLIANT_FORMAT_VERSION 1

#define PLIANT_USER_BLOCK    16384  // bytes before the HDF5 part: header and section table
#define PLIANT_SECTION_ALIGN 4096   // sections start on pages
#define PLIANT_SECTION_LIMIT 170    // entries that the table has room for
#define PLIANT_PATH_LIMIT    56     // bytes of a section's path, with its end

// Counts beyond these are refused, so that 3n, 4nf and the like stay inside int32_t.
#define PLIANT_VERTEX_LIMIT (1 << 28)
#define PLIANT_FACE_LIMIT   (1 << 29)

#define PLIANT_BATCH_LIMIT 128  // particles that a triangle batch of a lattice's surface may need

typedef enum pliant_section_type {  // on disk: these numbers; little-endian
    PLIANT_F4 = 1,                  // float
    PLIANT_F8 = 2,                  // double
    PLIANT_I4 = 3,                  // int32_t
    PLIANT_U8 = 4,                  // uint64_t
    PLIANT_U1 = 5,                  // unsigned char
} pliant_section_type;

// The C types of the above, for the tables' expansions.
typedef float PLIANT_C_F4;
typedef double PLIANT_C_F8;
typedef int32_t PLIANT_C_I4;
typedef uint64_t PLIANT_C_U8;
typedef unsigned char PLIANT_C_U1;

// The lengths that shapes are made of.
typedef enum pliant_extent {
    PLIANT_EXTENT_1,
    PLIANT_EXTENT_2,
    PLIANT_EXTENT_3,
    PLIANT_EXTENT_8,
    PLIANT_EXTENT_VERTICES,      // n
    PLIANT_EXTENT_FACES,         // nf
    PLIANT_EXTENT_LEVELS,        // L + 1
    PLIANT_EXTENT_OFFSETS,       // L + 2
    PLIANT_EXTENT_ODD,           // n - n0, vertices with parents
    PLIANT_EXTENT_FREE,          // m
    PLIANT_EXTENT_FIXED,         // k
    PLIANT_EXTENT_TEXT,          // bytes of provenance
    PLIANT_EXTENT_COLUMNS_1,     // columns of a level's set + 1
    PLIANT_EXTENT_NNZ,           // stored 3x3 blocks of a level's set
    PLIANT_EXTENT_FREE_3,        // 3m
    PLIANT_EXTENT_FIXED_3,       // 3k
    PLIANT_EXTENT_DETAIL,        // vertices of the detailed surface
    PLIANT_EXTENT_STEPS_1,       // D + 1, its subdivision steps + 1
    PLIANT_EXTENT_CELLS,         // nc, lattice cells
    PLIANT_EXTENT_PARTICLES,     // np
    PLIANT_EXTENT_REGION_NODES,  // nr
    PLIANT_EXTENT_PLATE_NODES,   // nl
    PLIANT_EXTENT_REGION_ROW,    // 2w + 2
    PLIANT_EXTENT_PLATE_ROW,     // 2w + 4
    PLIANT_EXTENT_BATCHES_1,     // nb + 1, triangle batches + 1
    PLIANT_EXTENT_BATCH_POINTS,  // particles of all batches
    PLIANT_EXTENT_COUNT
} pliant_extent;

typedef enum pliant_presence {
    PLIANT_ALWAYS,
    PLIANT_WITH_SUPPORTS,  // when the fixed blocks are stored: all of these or none
    PLIANT_WITH_DETAIL,    // when geometric detail is stored: all of these or none
    PLIANT_WITH_GREENS,    // when Green's functions are stored; a file has them, a lattice or both
    PLIANT_WITH_LATTICE,   // when a lattice is stored: all of these or none
    PLIANT_PRESENCE_COUNT
} pliant_presence;

// X(field of pliant_model_view, path, type, rank, extents (1 beyond the rank), presence, unit)
#define PLIANT_MODEL_SECTIONS(X)                                                                   \
    X(vertices, "/mesh/vertices", F8, 2, VERTICES, 3, 1, ALWAYS, "m")                              \
    X(faces, "/mesh/faces", I4, 2, FACES, 3, 1, ALWAYS, "vertex")                                  \
    X(level_vertex_count, "/mesh/level_count", I4, 1, LEVELS, 1, 1, ALWAYS, "")                    \
    X(parents, "/mesh/parents", I4, 2, ODD, 2, 1, ALWAYS, "vertex")                                \
    X(source_index, "/mesh/source_index", I4, 1, VERTICES, 1, 1, ALWAYS, "vertex of the input")    \
    X(material, "/material", F8, 1, 3, 1, 1, ALWAYS, "Pa, 1, kg/m^3")                              \
    X(free_nodes, "/domains/free/nodes", I4, 1, FREE, 1, 1, WITH_GREENS, "vertex")                 \
    X(free_level_offset, "/domains/free/level_offset", I4, 1, OFFSETS, 1, 1, WITH_GREENS,          \
      "position")                                                                                  \
    X(fixed_nodes, "/domains/fixed/nodes", I4, 1, FIXED, 1, 1, WITH_GREENS, "vertex")              \
    X(fixed_level_offset, "/domains/fixed/level_offset", I4, 1, OFFSETS, 1, 1, WITH_GREENS,        \
      "position")                                                                                  \
    X(gravity_free, "/body/gravity/free", F4, 3, FREE, 3, 3, WITH_GREENS, "m per m/s^2")           \
    X(gravity_fixed, "/body/gravity/fixed", F4, 3, FIXED, 3, 3, WITH_SUPPORTS, "Pa per m/s^2")     \
    X(provenance, "/provenance/text", U1, 1, TEXT, 1, 1, ALWAYS, "UTF-8")                          \
    X(detail_level_count, "/detail/level_count", I4, 1, STEPS_1, 1, 1, WITH_DETAIL, "")            \
    X(detail_offset, "/detail/offset", F4, 2, DETAIL, 3, 1, WITH_DETAIL, "m")                      \
    X(detail_source_index, "/detail/source_index", I4, 1, DETAIL, 1, 1, WITH_DETAIL,               \
      "vertex of the input")                                                                       \
    X(lattice_frame, "/lattice/frame", F8, 1, 8, 1, 1, WITH_LATTICE, "m, m, m, m, kg")             \
    X(lattice_summary, "/lattice/summary", I4, 1, 8, 1, 1, WITH_LATTICE, "")                       \
    X(lattice_cells, "/lattice/cells", I4, 2, CELLS, 3, 1, WITH_LATTICE, "cell size")              \
    X(lattice_particles, "/lattice/particles", I4, 2, PARTICLES, 3, 1, WITH_LATTICE, "cell size")  \
    X(lattice_mass, "/lattice/mass", F4, 1, PARTICLES, 1, 1, WITH_LATTICE, "kg")                   \
    X(lattice_region_size, "/lattice/region_size", I4, 1, PARTICLES, 1, 1, WITH_LATTICE, "")       \
    X(lattice_region_share, "/lattice/region_share", I4, 1, PARTICLES, 1, 1, WITH_LATTICE,         \
      "particle")                                                                                  \
    X(lattice_region_nodes, "/lattice/region_nodes", I4, 2, REGION_NODES, REGION_ROW, 1,           \
      WITH_LATTICE, "")                                                                            \
    X(lattice_plate_nodes, "/lattice/plate_nodes", I4, 2, PLATE_NODES, PLATE_ROW, 1, WITH_LATTICE, \
      "")                                                                                          \
    X(lattice_vertex_cell, "/lattice/vertex_cell", I4, 1, VERTICES, 1, 1, WITH_LATTICE, "cell")    \
    X(lattice_vertex_offset, "/lattice/vertex_offset", F4, 2, VERTICES, 3, 1, WITH_LATTICE,        \
      "cell size")                                                                                 \
    X(lattice_vertex_tangents, "/lattice/vertex_tangents", F4, 3, VERTICES, 2, 3, WITH_LATTICE,    \
      "1")                                                                                         \
    X(lattice_batch_face_offset, "/lattice/batch_face_offset", I4, 1, BATCHES_1, 1, 1,             \
      WITH_LATTICE, "")                                                                            \
    X(lattice_batch_faces, "/lattice/batch_faces", I4, 1, FACES, 1, 1, WITH_LATTICE, "face")       \
    X(lattice_batch_point_offset, "/lattice/batch_point_offset", I4, 1, BATCHES_1, 1, 1,           \
      WITH_LATTICE, "")                                                                            \
    X(lattice_batch_points, "/lattice/batch_points", I4, 1, BATCH_POINTS, 1, 1, WITH_LATTICE,      \
      "particle")

// X(field of pliant_greens_view, name below /greens/<block>/level<l>/, type, rank, extents)
#define PLIANT_LEVEL_SECTIONS(X)                                                                   \
    X(column_offset, "column_offset", U8, 1, COLUMNS_1, 1, 1)                                      \
    X(row, "row", I4, 1, NNZ, 1, 1)                                                                \
    X(block, "block", F4, 3, NNZ, 3, 3)                                                            \
    X(summary, "summary", F8, 1, 8, 1, 1)

// X(field of pliant_dense_view, path, type, rank, extents, presence, unit)
#define PLIANT_DENSE_SECTIONS(X)                                                                   \
    X(nodes, "/dense/nodes", I4, 1, FREE, 1, 1, ALWAYS, "vertex")                                  \
    X(free_free, "/dense/free-free", F8, 2, FREE_3, FREE_3, 1, ALWAYS, "m/Pa")                     \
    X(gravity_free, "/dense/gravity-free", F8, 2, FREE_3, 3, 1, ALWAYS, "m per m/s^2")             \
    X(fixed_nodes, "/dense/fixed-nodes", I4, 1, FIXED, 1, 1, WITH_SUPPORTS, "vertex")              \
    X(free_fixed, "/dense/free-fixed", F8, 2, FREE_3, FIXED_3, 1, WITH_SUPPORTS, "1")              \
    X(fixed_free, "/dense/fixed-free", F8, 2, FIXED_3, FREE_3, 1, WITH_SUPPORTS, "1")              \
    X(fixed_fixed, "/dense/fixed-fixed", F8, 2, FIXED_3, FIXED_3, 1, WITH_SUPPORTS, "Pa/m")        \
    X(gravity_fixed, "/dense/gravity-fixed", F8, 2, FIXED_3, 3, 1, WITH_SUPPORTS, "Pa per m/s^2")

// The blocks of Xi, "<row domain>-<column domain>" (GF-21..24).
typedef enum pliant_block_name {
    PLIANT_FREE_FREE,
    PLIANT_FREE_FIXED,
    PLIANT_FIXED_FREE,
    PLIANT_FIXED_FIXED,
    PLIANT_BLOCK_COUNT
} pliant_block_name;

const char *pliant_block_text(pliant_block_name block);  // "free-free"; static

// What the eight numbers of a level's summary mean.
typedef enum pliant_summary_item {
    PLIANT_SUMMARY_EPS,       // threshold of GF-31; 0 when chosen to meet targets
    PLIANT_SUMMARY_WAVELET,   // pliant_wavelet_scheme: 0 linear, 1 butterfly
    PLIANT_SUMMARY_LIFTED,    // pliant_wavelet_lifting: 0, 1
    PLIANT_SUMMARY_BOUNDARY,  // pliant_wavelet_boundary: 0 zero, 1 drop
    PLIANT_SUMMARY_RMS,       // GF-70
    PLIANT_SUMMARY_MAX,       // GF-71
    PLIANT_SUMMARY_FACTOR,    // dense blocks / kept blocks
    PLIANT_SUMMARY_DEFINITE,  // smallest eigenvalue of the contact compliance; 0: not known
    PLIANT_SUMMARY_COUNT
} pliant_summary_item;

// What the eight numbers of /lattice/frame mean; the rest is 0.
typedef enum pliant_lattice_frame_item {
    PLIANT_LATTICE_ORIGIN,         // three: rest position of lattice point (0, 0, 0), m
    PLIANT_LATTICE_CELL_SIZE = 3,  // a, m
    PLIANT_LATTICE_MASS,           // of all particles, kg
    PLIANT_LATTICE_FRAME_COUNT = 8
} pliant_lattice_frame_item;

// What the eight numbers of /lattice/summary mean; the rest is 0.
typedef enum pliant_lattice_summary_item {
    PLIANT_LATTICE_HALF_WIDTH,       // w
    PLIANT_LATTICE_IS_SHELL,         // 1: cells that the surface passes through; 0: the inside, too
    PLIANT_LATTICE_COMPONENT_COUNT,  // of cells connected by shared particles
    PLIANT_LATTICE_REGION_COUNT,     // different regions
    PLIANT_LATTICE_SUMMARY_COUNT = 8
} pliant_lattice_summary_item;

// One section to be written, or one row of a layout.
typedef struct pliant_section_def {
    char path[PLIANT_PATH_LIMIT];
    pliant_section_type type;
    int32_t rank;       // 1 .. 3
    uint64_t shape[3];  // 1 beyond the rank
} pliant_section_def;

size_t pliant_section_type_size(pliant_section_type type);       // 0 for an unknown one
const char *pliant_section_type_text(pliant_section_type type);  // "f4", ...; static

// Path of a level's section, such as "/greens/free-free/level4/row"; `name` may be NULL: the group.
void pliant_section_level_path(pliant_block_name block, int32_t level, const char *name,
                               char path[PLIANT_PATH_LIMIT]);

// What a writer knows of a lattice.
typedef struct pliant_lattice_layout {
    int32_t cell_count;         // nc; 0: no lattice, and the rest counts for nothing
    int32_t particle_count;     // np
    int32_t half_width;         // w
    int32_t region_node_count;  // nr, may be 0
    int32_t plate_node_count;   // nl, may be 0
    int32_t batch_count;        // nb
    int32_t batch_point_count;  // of all batches
} pliant_lattice_layout;

// What a writer knows before it creates a model file.
typedef struct pliant_model_layout {
    int32_t vertex_count;  // n
    int32_t face_count;    // nf
    int32_t level_count;   // L + 1
    int32_t base_count;    // n0, vertices of level 0
    int32_t has_greens;    // 1: Green's functions; 0: the following up to nnz count for nothing
    int32_t free_count;    // m
    int32_t fixed_count;   // k
    int32_t has_supports;  // 1: store the fixed blocks too (--blocks all)
    uint32_t level_mask;   // bit l set: store the columns of level l
    // Columns of a level's set: nodes of the domain with level <= l, level_offset[l + 1].
    int32_t free_columns[PLIANT_LEVEL_LIMIT + 1], fixed_columns[PLIANT_LEVEL_LIMIT + 1];
    uint64_t nnz[PLIANT_BLOCK_COUNT][PLIANT_LEVEL_LIMIT + 1];
    // Geometric detail: D subdivision steps above the finest level (0: none), vertices after them.
    int32_t detail_steps, detail_vertex_count;
    uint64_t text_bytes;  // provenance; a shorter text is filled up with line breaks
    pliant_lattice_layout lattice;
} pliant_model_layout;

// The sections of a model file in file order. `sections` has room for PLIANT_SECTION_LIMIT.
PLIANT_UNUSED_RESULT pliant_status pliant_model_layout_sections(const pliant_model_layout *layout,
                                                                pliant_section_def *sections,
                                                                int32_t *section_count,
                                                                pliant_error *err);

// The sections of a dense file; `fixed_count` < 0: without the fixed blocks.
PLIANT_UNUSED_RESULT pliant_status pliant_dense_layout_sections(int32_t free_count,
                                                                int32_t fixed_count,
                                                                pliant_section_def *sections,
                                                                int32_t *section_count,
                                                                pliant_error *err);
