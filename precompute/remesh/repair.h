// repair.h: small defects of a mesh file mended, so that it bounds a solid.
#pragma once

#include "pliant/mesh.h"

typedef struct pliant_repair_report {
    int32_t welded;   // vertices that stood on another's place
    int32_t dropped;  // degenerate and duplicate faces
    int32_t turned;   // faces that disagreed with most of their neighbours
    int32_t filled;   // holes closed
    int32_t unused;   // vertices of no face
    int32_t split;    // vertices where separate fans of faces met
    char text[256];   // all of that in words; empty: nothing was done
} pliant_repair_report;

// Holes of more sides, or as long around as this share of the bounding box's diagonal, are shapes.
enum { PLIANT_HOLE_SIDE_LIMIT = 12 };
#define PLIANT_HOLE_LENGTH_LIMIT 0.1

// Weld vertices of equal position; drop faces that use a place twice, have no area or are there
// already; turn faces so that neighbours agree; close holes that are tiny; part fans that share a
// vertex only; drop unused vertices. `mesh` is replaced. Edges with more than two faces, one-sided
// surfaces and larger holes are left as they are: pliant_mesh_check names them. Source of every
// vertex of the new mesh, -1 never: `*source`, shape [vertex_count], to be freed.
PLIANT_UNUSED_RESULT pliant_status pliant_repair(pliant_mesh **mesh, int32_t **source,
                                                 pliant_repair_report *report, pliant_error *err);
