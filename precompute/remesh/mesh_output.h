// mesh_output.h: a triangle mesh written for other programs.
#pragma once

#include "pliant/mesh.h"

// Does the name end in .obj or .ply?
int pliant_mesh_output_is_known(const char *path);

// Write OBJ or binary PLY by the name's extension, whole or not at all: `path`.tmp, then renamed.
// Every bit of the positions is kept.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_output_write(const char *path,
                                                            const pliant_mesh *mesh,
                                                            pliant_error *err);
