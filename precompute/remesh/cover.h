// cover.h: a semi-regular mesh whose vertices live on an arbitrary one.
//
// Its vertices start where the map of a coarsening carries the subdivided base mesh, and are then
// moved along the surface, until triangles are even and none is thin or turned over.
//
// This follows: M. Botsch, L. Kobbelt, A remeshing approach to multiresolution modeling, SGP 2004
// (smoothing that evens out areas), L. Freitag, C. Ollivier-Gooch, Tetrahedral mesh improvement
// using swapping and smoothing, 1997 (the worst triangle around a vertex decides).
#pragma once

#include "mesh/multires.h"
#include "remesh/coarsening.h"
#include "remesh/face_tree.h"
#include "remesh/share.h"

typedef struct pliant_cover {
    const pliant_surface *surface;  // borrowed until destroy
    pliant_multires *multires;      // positions are those of the places; source_index is -1
    pliant_place *places;           // shape [n]
    double *normals;                // shape [n][3], the surface's there
    double *area, *centre;          // shapes [n] and [n][3], of share.h
    double diagonal;                // of the surface's bounding box
    const pliant_surface
        *original;  // against whose normals faces are turned, and its tree: while that
    const pliant_face_tree *tree;  // is done, else NULL
    uint8_t *kept;                 // shape [n], 1: on a corner or a tip
    int32_t *fan_start, *fans;     // faces around each vertex: shape [n + 1] and [3 faces]
} pliant_cover;

// Base mesh of `base_count` vertices, `levels` times split into four. Vertices lie where the map
// has them. `coarsening` is of the surface's mesh.
PLIANT_UNUSED_RESULT pliant_status pliant_cover_create(const pliant_coarsening *coarsening,
                                                       const pliant_surface *surface,
                                                       int32_t base_count, int32_t levels,
                                                       pliant_cover **cover, pliant_error *err);
void pliant_cover_destroy(pliant_cover *cover);  // NULL is fine

// Even out, `sweeps` times: a vertex moves to the centre of the part of the surface that is nearest
// to it, where what the mesh still misses weighs more, and towards its neighbours' middle. `share`
// is of the same surface. Returns how far, in diagonals, the mesh was from the surface's vertices
// before the last sweep, about.
double pliant_cover_smooth(pliant_cover *cover, pliant_share *share, int32_t sweeps);

// Put a vertex on what its share has farthest off the mesh, a corner or a tip, where that spoils no
// face: after smoothing, since that would round it off again. `share` as before.
void pliant_cover_reach(pliant_cover *cover, pliant_share *share, int32_t sweeps);

// Improve the worst triangles, one vertex after the other, until that helps no more or `sweeps` are
// done. Returns how many faces are still poor.
int32_t pliant_cover_improve(pliant_cover *cover, int32_t sweeps);

// Turn faces that look against the surface beside them, by moving vertices around. `tree` is of
// `original`, the cover's surface or one of the same shape. Returns how many are left.
int32_t pliant_cover_turn(pliant_cover *cover, const pliant_surface *original,
                          const pliant_face_tree *tree, int32_t sweeps);
