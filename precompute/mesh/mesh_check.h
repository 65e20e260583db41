// mesh_check.h: is a mesh the boundary of a solid?
#pragma once

#include "pliant/mesh.h"

typedef struct pliant_mesh_report {
    int32_t component_count;
    int32_t turned_count;      // faces turned because their component looked inwards
    double volume;             // after turning
    double bounding_min[3], bounding_max[3];
} pliant_mesh_report;

// Refuse what does not bound a solid: fewer than 4 faces, non-finite or overflowing coordinates,
// unused vertices, degenerate or duplicate faces, open or non-manifold edges, non-manifold
// vertices, inconsistent orientation, zero volume, components that cross. Components that look
// inwards, and cavities that look outwards, are turned in place (the caller notes it). `name` is the
// file's, for messages, which name the element (0-based vertex and face numbers) and the reason.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_check(pliant_mesh *mesh, const char *name,
                                                     pliant_mesh_report *report, pliant_error *err);
