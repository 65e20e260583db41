// fit.h: how well one mesh stands for another.
#pragma once

#include "remesh/face_tree.h"

typedef struct pliant_fit {
    double there, back;  // Hausdorff distance from the original to the mesh, from the mesh to it,
                         // over the diagonal of the original's bounding box
    double smallest_angle;               // degrees
    double normal_mean, normal_largest;  // between a face's normal and the original's, degrees
    double fold;            // largest angle between the normals of neighbouring faces, degrees
    int32_t flipped_count;  // faces that look against the original
} pliant_fit;

// Distances are sampled: in every face of either mesh a grid of points no farther apart than 1/200
// of the diagonal (at least the corners, the sides' middles and the centre), and the closest point
// on the other. Normals are compared at a face's centre, with the original's (its vertices' normals
// interpolated) at the closest point. `tree` is of the original.
PLIANT_UNUSED_RESULT pliant_status pliant_fit_measure(const pliant_surface *original,
                                                      const pliant_face_tree *tree,
                                                      const pliant_mesh *mesh, pliant_fit *fit,
                                                      pliant_error *err);
