// volume.h: the inside of a surface as tetrahedra, from gmsh or from a Gmsh file.
#pragma once

#include "fem/tetrahedra.h"

// Names of regions in the order of their materials: region k + 1 is names[k], region 0 all the
// rest.
typedef struct pliant_volume_def {
    const pliant_mesh *surface;
    const char *mesh_name;  // for messages
    const char *file;       // a Gmsh file with the tetrahedra; NULL: mesh the inside
    int32_t region_count;
    const char *const *region_names;
    double growth;  // of elements with their distance from the surface (size_field.h), 1: none
} pliant_volume_def;

// Linear tetrahedra that keep the surface. A file's surface nodes are matched by place, to 1e-6 of
// the surface's diagonal, and put exactly there. When meshing fails the refusal has gmsh's reason.
PLIANT_UNUSED_RESULT pliant_status pliant_volume_create(const pliant_volume_def *def,
                                                        pliant_tetrahedra **tetrahedra,
                                                        pliant_error *err);
