// embedding.h: how a mesh's vertices hang in the cells of a lattice (LSM-15..17).
#pragma once

#include "lattice/voxels.h"

typedef struct pliant_embedding {
    int32_t vertex_count;
    int32_t *cell;    // shape [vertex_count]: the cell that holds the vertex
    float *offset;    // shape [vertex_count][3]: in that cell, 0 .. 1: X of the weights phi_i(X)
    float *tangents;  // shape [vertex_count][2][3]: unit U, V with U x V the vertex normal
} pliant_embedding;

// Embed the mesh that was voxelised. A vertex between cells is held by the one of higher
// coordinates. The vertex normal is the sum of the faces' normals, each weighted by its angle there
// (G. Thuermer, C. Wuethrich, Computing vertex normals from polygonal facets, Journal of Graphics
// Tools 3(1), 1998): it does not depend on how the surface is cut into triangles.
PLIANT_UNUSED_RESULT pliant_status pliant_embedding_create(const pliant_mesh *mesh,
                                                           const pliant_voxels *voxels,
                                                           pliant_embedding **embedding,
                                                           pliant_error *err);
void pliant_embedding_destroy(pliant_embedding *embedding);  // NULL is fine
