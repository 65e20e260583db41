// face_tree.h: the closest point of a triangle mesh, by a tree of bounding boxes.
#pragma once

#include "remesh/surface.h"

typedef struct pliant_face_tree pliant_face_tree;

// `mesh` is borrowed until destroy; any triangles will do.
PLIANT_UNUSED_RESULT pliant_status pliant_face_tree_create(const pliant_mesh *mesh,
                                                           pliant_face_tree **tree,
                                                           pliant_error *err);
void pliant_face_tree_destroy(pliant_face_tree *tree);  // NULL is fine

// The place on the mesh closest to x; *squared is its squared distance. Of equally close ones, the
// first that the tree meets: always the same.
pliant_place pliant_face_tree_closest(const pliant_face_tree *tree, const double x[3],
                                      double *squared);

// Weights of the point of triangle a, b, c closest to x.
void pliant_triangle_closest(const double *a, const double *b, const double *c, const double *x,
                             double weight[3]);
