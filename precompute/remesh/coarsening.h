// coarsening.h: a mesh coarsened step by step, with a map from every coarse mesh onto the fine
// one.
//
// A step removes a vertex: it slides along an edge into a neighbour (a half-edge collapse). The
// star of the vertex is flattened, and that flat polygon is a chart of both the faces before the
// step and those after it. A point of a coarse mesh is carried from chart to chart, last step
// first, onto the fine mesh: a homeomorphism, whatever the shape, so that no point can jump from a
// thin limb to another or through a sheet.
//
// This follows: A. Lee, W. Sweldens, P. Schroeder, L. Cowsar, D. Dobkin, MAPS: multiresolution
// adaptive parameterization of surfaces, SIGGRAPH 1998 (flattening), M. Garland, P. Heckbert,
// Surface simplification using quadric error metrics, SIGGRAPH 1997 (what goes first), H.-T. Liu et
// al., Neural subdivision, SIGGRAPH 2020 (successive charts, there by least squares).
#pragma once

#include "remesh/surface.h"

typedef struct pliant_coarsening pliant_coarsening;

// Simplify as far as it goes: a closed manifold mesh of any genus and number of components; `mesh`
// is borrowed until destroy.
PLIANT_UNUSED_RESULT pliant_status pliant_coarsening_create(const pliant_mesh *mesh,
                                                            pliant_coarsening **coarsening,
                                                            pliant_error *err);
void pliant_coarsening_destroy(pliant_coarsening *coarsening);  // NULL is fine

// Vertices of the coarsest mesh.
int32_t pliant_coarsening_least(const pliant_coarsening *coarsening);

// The mesh with `vertex_count` vertices (from the least to all), vertices and faces in the fine
// mesh's order.
PLIANT_UNUSED_RESULT pliant_status pliant_coarsening_base(const pliant_coarsening *coarsening,
                                                          int32_t vertex_count, pliant_mesh **base,
                                                          pliant_error *err);

// Carry `count` places on that base mesh onto the fine mesh, in place.
PLIANT_UNUSED_RESULT pliant_status pliant_coarsening_unfold(const pliant_coarsening *coarsening,
                                                            int32_t vertex_count,
                                                            pliant_place *places, int32_t count,
                                                            pliant_error *err);
