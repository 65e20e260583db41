// synthetic_model.h: models with exactly known answers, for tests that need a model file.
//
// The body is the unit sphere (check_sphere: 42, 162, 642, 2562 vertices for 1 .. 4 levels above
// the base), held where z < -0.6. Its stiffness is given, not computed: between any two nodes a
// spring
//
//     K_ij = - a_i a_j / (|r|^3) (I / 2 + r r^T / (2 |r|^2)),   K_ii = - sum of K_ij,   r = x_i -
//     x_j
//
// which is the H^1/2 seminorm that an elastic body's surface has, so that the Green's functions
// decay like 1/r and compress like real ones. With f = a p, block elimination of K u = f + b g
// gives all four blocks of Xi and both gravity columns exactly, and K itself solves any other
// boundary value problem directly. Units: K in N/m, a in m^2; b_i = density a_i.
//
//     check_write_synthetic_model(path, dense_path, 2, 0, pliant_wavelet_default(),
//     CHECK_ALL_BLOCKS);
//
// writes a model file with nothing thresholded (eps 0), and its dense file if dense_path is not
// NULL. Every function fails the running test when something refuses. 2 levels take 10 ms, 3 levels
// 0.3 s, 4 levels (free block only) some 10 s.
#pragma once

#include "check.h"
#include "surfaces.h"

#include "pliant/sections.h"
#include "pliant/wavelet.h"

typedef enum check_blocks {
    CHECK_FREE_BLOCK,  // --blocks free: no supports
    CHECK_ALL_BLOCKS,  // --blocks all
} check_blocks;

typedef struct check_synthetic_def {
    int32_t levels;  // L, subdivisions of the icosahedron
    double eps;      // GF-31..33; 0 keeps every block
    pliant_wavelet_def wavelet;
    check_blocks blocks;
    uint32_t level_mask;  // bit l: store the hierarchical columns of level l; 0: those of L alone
} check_synthetic_def;

// The compressed columns of one block and level; what the file holds.
typedef struct check_compressed {
    uint64_t *column_offset;
    int32_t *row;
    float *block;
    double summary[PLIANT_SUMMARY_COUNT];
} check_compressed;

typedef struct check_synthetic {
    check_synthetic_def def;
    check_surface surface;
    pliant_hierarchy *hierarchy;
    pliant_wavelet *wavelets[2];  // of the free and the fixed domain
    int32_t counts[2];            // m, k
    int32_t *nodes[2];            // free and fixed vertices, ascending
    double density;
    double *stiffness;  // K, shape [3n][3n], vertex order; NULL with the free block only
    // Blocks of Xi by pliant_block_name, row-major, 3x3 block (i, j) at rows 3i.., columns 3j..;
    // only the first with the free block only.
    double *xi[PLIANT_BLOCK_COUNT];
    double *gravity[2];  // shape [3m][3] and [3k][3]
    check_compressed compressed[PLIANT_BLOCK_COUNT];
    // The levels below L, refined (GF-60): the columns of hats of level l, those of the domain's
    // nodes of level <= l; as xi, of as many columns as the level has. NULL: not stored.
    double *coarse_xi[PLIANT_LEVEL_LIMIT + 1][PLIANT_BLOCK_COUNT];
    check_compressed coarse[PLIANT_LEVEL_LIMIT + 1][PLIANT_BLOCK_COUNT];
    float *gravity_coefficients[2];  // shape [m][3][3], [k][3][3]
    // A lattice of the finest mesh to write, too; borrowed. NULL: none.
    const struct check_lattice *lattice;
    // After check_synthetic_roughen: steps to the finer shape, and that; else 0, mesh NULL.
    int32_t detail_steps;
    check_surface shape;
} check_synthetic;

check_synthetic *check_synthetic_create(const check_synthetic_def *def);
void check_synthetic_destroy(check_synthetic *synthetic);
// Give the body geometric detail, which its file then holds: a shape of `steps` levels more, with
// waves that leave the model's own vertices where they are.
void check_synthetic_roughen(check_synthetic *synthetic, int32_t steps);

void check_synthetic_write(const check_synthetic *synthetic, const char *path);
void check_synthetic_write_dense(const check_synthetic *synthetic, const char *path);
// Create, write, destroy: the finest level's columns alone, or those of all levels. `dense_path` may
// be NULL.
void check_write_synthetic_model(const char *path, const char *dense_path, int32_t levels,
                                 double eps, pliant_wavelet_def wavelet, check_blocks blocks);
void check_write_synthetic_levels(const char *path, const char *dense_path, int32_t levels,
                                  double eps, pliant_wavelet_def wavelet, check_blocks blocks);

// Replace xi and gravity by what the file's coefficients say after the inverse transform (in
// double), so that the error of compression is out of a comparison.
void check_synthetic_round(check_synthetic *synthetic);

// Component (r, c) of the block at vertex `row` of the column of the hat of `column` on `level`.
double check_synthetic_element(const check_synthetic *synthetic, int32_t row, int r, int32_t level,
                               int32_t column, int c);

// ---- Reference answers; need CHECK_ALL_BLOCKS ----

// A boundary value problem: for every vertex which of displacement and traction is specified.
typedef struct check_problem {
    uint8_t *is_displaced;  // shape [n]: 1 displacement specified, 0 traction
    double *value;          // shape [n][3]: the specified one
    double gravity[3];
} check_problem;

check_problem
check_problem_create(const check_synthetic *synthetic);  // the reference problem, all zero
void check_problem_destroy(check_problem *problem);

// Displacements u and tractions p of all vertices, shape [n][3] each.
// Directly: one solve with the stiffness matrix, nothing to do with Green's functions.
void check_synthetic_solve(const check_synthetic *synthetic, const check_problem *problem,
                           double *u, double *p);
// From xi and gravity as they are, exact or rounded: the values w of reference type at the nodes S
// whose type is changed are such that (Xi w + B g) is there what was specified; then v = Xi w + B
// g.
void check_synthetic_solve_dense(const check_synthetic *synthetic, const check_problem *problem,
                                 double *u, double *p);
