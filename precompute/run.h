// run.h: one precomputation from its options to its file.
#pragma once

#include "greens.h"
#include "lattice_stage.h"
#include "remesh/remesh.h"

// Seconds of each phase; the order is the program's.
typedef struct pliant_run_times {
    double read, lattice, inside, assemble, factor, solve, transform, compress, write, total;
} pliant_run_times;

typedef struct pliant_run_summary {
    int32_t vertex_count, face_count, level_count, free_count, fixed_count, component_count, ranks;
    int32_t detail_steps, detail_vertex_count;  // 0 without --detail; on the first rank
    pliant_relief_size detail;
    pliant_lattice_summary lattice;  // 0 cells without --lattice; on the first rank
    pliant_remesh_report remesh;   // 0 base vertices without --remesh; on the first rank
    const char *solver;            // "node", "scalapack", "direct" or "multigrid"
    int32_t groups;                // of ranks, that solve together
    double volume, residual, file_bytes;
    double memory_bytes, peak_memory_bytes;  // planned and met, all ranks together
    double factor_flops, solve_flops;        // as PETSc and its libraries count them, all ranks

    pliant_level_range levels;  // stored
    int32_t column_counts[PLIANT_BLOCK_COUNT][PLIANT_LEVEL_LIMIT + 1];
    pliant_greens_result results[PLIANT_BLOCK_COUNT][PLIANT_LEVEL_LIMIT + 1];
    int signal;        // the run was interrupted by it; else 0
    int was_finished;  // 1: the output was there already, of the run that was to be resumed
    int misused;       // 1: what was refused is the command line, seen beside its mesh
    pliant_run_times times;
} pliant_run_summary;

// Collective. `command_line` goes into the file's provenance.
PetscErrorCode pliant_run(MPI_Comm comm, const pliant_options *options, const char *command_line,
                          pliant_progress *progress, pliant_run_summary *summary, pliant_error *err);
