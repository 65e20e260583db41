// mesh_export.h: write a model's mesh, of any of its levels or detailed, for other programs.
#pragma once

#include "contents.h"

typedef enum pliant_mesh_format {
    PLIANT_MESH_UNKNOWN,
    PLIANT_MESH_OBJ,
    PLIANT_MESH_PLY,  // binary, little-endian, double coordinates
} pliant_mesh_format;

// By the name's end, whatever its case.
pliant_mesh_format pliant_mesh_export_format(const char *path);

// Write PATH.tmp, then rename. `level` -1: the finest. PLIANT_ERR_MISSING: the file has no mesh;
// PLIANT_ERR_ARGUMENT: no such level.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_export(const pliant_contents *contents,
                                                      const char *path, int32_t level,
                                                      pliant_error *err);
// The detailed shape at rest, likewise. PLIANT_ERR_MISSING: the file has none.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_export_detail(const pliant_contents *contents,
                                                             const char *path, pliant_error *err);
