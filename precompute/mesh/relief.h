// relief.h: the finest levels of a mesh as geometric detail over a coarser control mesh.
//
// This follows: A. Lee, H. Moreton, H. Hoppe, Displaced subdivision surfaces, SIGGRAPH 2000. Where
// they fit a control mesh and store one number a vertex along the normal, we take the mesh's own
// coarser level, whose vertices lie on the shape, and store the whole vector in the local frame:
// the shape comes back as it was.
#pragma once

#include "mesh/multires.h"

// How large offsets are: root mean square and largest, in the mesh's unit; likewise their
// tangential parts, which a scalar displacement map would lose.
typedef struct pliant_relief_size {
    double rms, largest, tangential_rms, tangential_largest;
    double
        least_sine;  // between the tangents, at the worst vertex: how well normals are determined
} pliant_relief_size;

typedef struct pliant_relief {
    int32_t step_count;  // D
    int32_t vertex_count[PLIANT_LEVEL_LIMIT +
                         1];  // after 0 .. D steps; the first is the control mesh's
    float *offset;            // shape [N][3], N = vertex_count[D]: along, across, normal
    int32_t *source_index;    // shape [N]: vertex of the input mesh, or -1
    pliant_relief_size size;
} pliant_relief;

// Take the `step_count` finest levels off a mesh, in place, and return them as relief over what is
// left. New vertices are renumbered as formats/README.md says. PLIANT_ERR_ARGUMENT: the mesh has
// not so many levels above the base. PLIANT_ERR_FORMAT: the subdivision surface has no normal at
// some vertex. On refusal the mesh is unchanged.
PLIANT_UNUSED_RESULT pliant_status pliant_relief_split(pliant_multires **multires,
                                                       int32_t step_count, pliant_relief **relief,
                                                       pliant_error *err);
void pliant_relief_destroy(pliant_relief *relief);  // NULL is fine
