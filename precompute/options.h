// options.h: what the command line of pliant-precompute asks for.
#pragma once

#include "compression.h"
#include "lattice/voxels.h"
#include "material.h"
#include "mesh/multires.h"
#include "remesh/remesh.h"

typedef enum pliant_method {
    PLIANT_METHOD_BEM,  // boundary elements
    PLIANT_METHOD_FEM,  // finite elements
} pliant_method;

typedef enum pliant_solver_choice {  // of finite elements
    PLIANT_SOLVER_AUTO,              // direct while it fits in memory
    PLIANT_SOLVER_DIRECT,
    PLIANT_SOLVER_MULTIGRID,
} pliant_solver_choice;

enum { PLIANT_REGION_LIMIT = 64, PLIANT_REGION_NAME = 64 };

// --material NAME:E:NU:RHO: the physical volume NAME of --volume has this material.
typedef struct pliant_region_option {
    char name[PLIANT_REGION_NAME];
    pliant_material material;
} pliant_region_option;

typedef enum pliant_blocks {
    PLIANT_BLOCKS_FREE,  // the free-free block only
    PLIANT_BLOCKS_ALL,   // fixed rows and columns too
} pliant_blocks;

// The summary on standard output.
typedef enum pliant_reporting {
    PLIANT_REPORT_TEXT,
    PLIANT_REPORT_JSON,  // one object
} pliant_reporting;

typedef enum pliant_talk {
    PLIANT_TALK_PROGRESS,
    PLIANT_TALK_ERRORS,  // --quiet: neither progress nor a text summary
} pliant_talk;

typedef enum pliant_existing {
    PLIANT_KEEP_EXISTING,
    PLIANT_REPLACE_EXISTING,  // --force
} pliant_existing;

typedef enum pliant_resuming {
    PLIANT_BEGIN_ANEW,
    PLIANT_RESUME,  // --resume
} pliant_resuming;

// Levels of hierarchical Green's functions to solve for and store.
typedef struct pliant_level_range {
    int32_t first, last;  // -1: from level 0, to the finest
} pliant_level_range;

typedef enum pliant_greens_wish {
    PLIANT_GREENS_SOLVE,
    PLIANT_GREENS_NONE,  // --no-greens: a lattice only
} pliant_greens_wish;

typedef enum pliant_remesh_wish {
    PLIANT_REMESH_NEVER,
    PLIANT_REMESH_FIRST,  // --remesh: MESH is arbitrary
} pliant_remesh_wish;

typedef enum pliant_product {
    PLIANT_PRODUCT_MODEL,
    PLIANT_PRODUCT_MESH,  // --mesh-only: nothing is solved
} pliant_product;

typedef struct pliant_options {
    const char *mesh, *output, *dense;  // dense NULL: none
    int32_t subdivide;                  // -1: detect the levels of the mesh
    pliant_subdivision_scheme scheme;
    pliant_remesh_wish remeshing;
    pliant_remesh_def remesh;
    pliant_product product;
    int32_t detail;                     // finest levels that are geometry only
    const char *fixed_expression, *fixed_list;  // either may be NULL
    pliant_method method;
    const char *volume;            // a Gmsh file; NULL: the inside is meshed
    double growth;                 // of tetrahedra inwards, 1 to 2
    int32_t order;                 // of tetrahedra, 1 or 2
    pliant_solver_choice solver;
    int32_t groups;                // of ranks that solve together; 0: chosen
    int32_t region_count;
    pliant_region_option regions[PLIANT_REGION_LIMIT];
    pliant_material material;
    pliant_wavelet_def wavelet;
    pliant_compression_def compression;
    pliant_level_range constraint_levels;
    pliant_blocks blocks;
    int32_t lattice_cells;            // along the longest side; 0: no lattice
    int32_t half_width;               // of its regions
    pliant_voxel_filling filling;
    const char *lattice_mass;         // NULL: the density everywhere
    pliant_greens_wish greens;
    pliant_reporting reporting;
    pliant_talk talk;
    pliant_existing existing;
    pliant_resuming resuming;
} pliant_options;

typedef enum pliant_options_action {
    PLIANT_OPTIONS_RUN,
    PLIANT_OPTIONS_HELP,
    PLIANT_OPTIONS_VERSION,
} pliant_options_action;

// Parse; strings are borrowed from argv. PLIANT_ERR_ARGUMENT names the option, what it takes and
// what it got.
PLIANT_UNUSED_RESULT pliant_status pliant_options_parse(int argc, char **argv,
                                                        pliant_options *options,
                                                        pliant_options_action *action,
                                                        pliant_error *err);

// The text of --help in parts, then NULL; static.
extern const char *const pliant_options_help[];
