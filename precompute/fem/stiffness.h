// stiffness.h: the finite element equations of the reference problem, rows over the ranks.
//
// The displacement u is continuous and piecewise linear or quadratic. On the held part it follows
// the held vertices' displacements ubar linearly: u_F = C ubar. The traction is the boundary
// elements': hats phi of all surface vertices, given (pbar) at free ones, unknown (r) at held ones.
// With K the stiffness matrix in parts, M_Iv = integral of N_I phi_v over the surface for free
// vertices v, N_Iv for held ones, m_I = integral of density N_I, and an acceleration g, every test
// function has its equation:
//
//     K_ff u_f + K_fF C ubar        = M_f pbar + N_f r + m_f g
//     C^T (K_Ff u_f + K_FF C ubar)  = C^T (M_F pbar + N_F r + m_F g)
//
// N_f is the rim's alone: hats of held vertices reach into faces that have a free corner. Here are
// the parts; reaction.h puts r in.
#pragma once

#include "fem/block_columns.h"
#include "fem/tetrahedra.h"
#include "material.h"

#include <petscmat.h>

typedef struct pliant_stiffness {
    Mat K;                       // free nodes, block size 3
    Vec coordinates;             // of free nodes, for the rigid motions
    int32_t free_count;          // free nodes, of all ranks
    int32_t own_begin, own_end;  // this rank's, of their new order
    int32_t *row_of_node;        // [node_count] place in the new order, -1 at held nodes
    // Right-hand sides by surface vertex, this rank's rows from 0: M at free vertices, -K_fF C at
    // held ones, whose transpose is K_Ff's part of -R.
    pliant_block_columns *load;
    pliant_block_columns *rim_load;  // N_f by held vertex, this rank's rows from 0
    // What a column adds to the forces that hold, by surface vertex, rows are positions of held
    // vertices: -M_F at free vertices, C^T K_FF C at held ones. All of it on every rank.
    pliant_block_columns *direct;
    double *body;         // [own_end - own_begin] m
    double *direct_body;  // [held vertices] -C^T m_F, on every rank
} pliant_stiffness;

typedef struct pliant_stiffness_def {
    const pliant_tetrahedra *tetrahedra;
    const pliant_material *materials;  // by region
    const uint8_t *held;               // [surface_count]
} pliant_stiffness_def;

// Collective. Every rank has the whole mesh, and computes the elements of its own nodes; each row
// adds its elements in mesh order, whatever the ranks.
PetscErrorCode pliant_stiffness_create(MPI_Comm comm, const pliant_stiffness_def *def,
                                       pliant_stiffness **stiffness, pliant_error *err);
PetscErrorCode pliant_stiffness_destroy(pliant_stiffness **stiffness);
