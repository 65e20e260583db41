// mesh_file_formats.h: the readers behind pliant_mesh_file_read, one per format.
//
// Each reads a file in memory into a builder. Positions are kept to the last bit, vertices in the
// file's order. The bytes may come from anybody: nothing is allocated from a count in them, nothing
// is read past their end.
#pragma once

#include "mesh_builder.h"

#include <stddef.h>

typedef struct pliant_mesh_source {
    const char *name;  // for messages
    const char *path;  // for the import library, which opens files itself; NULL where there is none
    const char *bytes; // shape [size]
    size_t size;
} pliant_mesh_source;

typedef pliant_status pliant_mesh_reader(const pliant_mesh_source *source,
                                         pliant_mesh_builder *builder, pliant_error *err);

// Wavefront OBJ: v and f; vertex numbers from 1 or relative, textures and normals ignored.
PLIANT_UNUSED_RESULT pliant_mesh_reader pliant_mesh_file_obj;
// PLY: ascii, binary of either endianness; any scalar types, any order of properties and elements.
PLIANT_UNUSED_RESULT pliant_mesh_reader pliant_mesh_file_ply;
// Object File Format: OFF, and COFF, NOFF, STOFF and their mixtures, ascii, three dimensions.
PLIANT_UNUSED_RESULT pliant_mesh_reader pliant_mesh_file_off;
// Stereolithography, binary or ascii by size and content; equal positions are welded.
PLIANT_UNUSED_RESULT pliant_mesh_reader pliant_mesh_file_stl;
// What the import library reads: all meshes of the scene, placed, merged and welded.
PLIANT_UNUSED_RESULT pliant_mesh_reader pliant_mesh_file_import;

// The reader that the name's extension, or else the content, asks for; NULL when neither is known.
pliant_mesh_reader *pliant_mesh_file_reader(const pliant_mesh_source *source);
// Read with that reader.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_file_parse(const pliant_mesh_source *source,
                                                          pliant_mesh_reader *reader,
                                                          pliant_mesh **mesh, pliant_error *err);

// Does the content look like the format, whatever the name says?
int pliant_mesh_file_is_ply(const pliant_mesh_source *source);
int pliant_mesh_file_is_off(const pliant_mesh_source *source);
int pliant_mesh_file_is_stl(const pliant_mesh_source *source);
int pliant_mesh_file_is_obj(const pliant_mesh_source *source);
// Does the import library know the name's extension?
int pliant_mesh_file_imports(const pliant_mesh_source *source);
