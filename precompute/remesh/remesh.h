// remesh.h: a semi-regular mesh, with its levels, of an arbitrary closed one (GF 4.2.1).
#pragma once

#include "mesh/multires.h"
#include "remesh/fit.h"

// What is aimed at: both Hausdorff distances over the bounding box's diagonal, and degrees.
#define PLIANT_REMESH_DISTANCE 0.01
#define PLIANT_REMESH_ANGLE    10.0

enum { PLIANT_REMESH_AUTO = -1 };

typedef struct pliant_remesh_def {
    int32_t base_vertices;  // PLIANT_REMESH_AUTO: the smallest base that meets the aims
    int32_t levels;         // PLIANT_REMESH_AUTO: as many as give up to 12000 vertices
} pliant_remesh_def;

typedef struct pliant_remesh_report {
    int32_t base_vertices, levels;
    int32_t tried_count;  // bases that were tried
    int met;              // 1: the aims are met
    pliant_fit fit;
} pliant_remesh_report;

// `mesh` bounds a solid (pliant_mesh_check). The same mesh gives the same bits. source_index has
// the number of the vertex of `mesh` that is nearest, for the one that is nearest to it, else -1.
// Refuses, with figures, a base smaller than the shape allows, and sizes that int32_t does not
// hold.
PLIANT_UNUSED_RESULT pliant_status pliant_remesh(const pliant_mesh *mesh,
                                                 const pliant_remesh_def *def,
                                                 pliant_multires **multires,
                                                 pliant_remesh_report *report, pliant_error *err);
