// mesh_file.c: triangle meshes from files that other programs wrote: which reader, and its result.
//
// OBJ, PLY, OFF and STL have readers of our own: the import library renumbers the vertices of OBJ
// files, rounds positions to float, and takes sizes from file headers before it looks at the file.
#include "mesh_file.h"

#include "file_bytes.h"
#include "mesh_file_formats.h"
#include "pliant/error.h"

#include <string.h>
#include <strings.h>

typedef struct format {
    const char *extension;
    pliant_mesh_reader *read;
    int (*is)(const pliant_mesh_source *source);
} format;

// In the order in which an unknown file's content is tried: the surest marks first.
static const format formats[] = {
    {".ply", pliant_mesh_file_ply, pliant_mesh_file_is_ply},
    {".off", pliant_mesh_file_off, pliant_mesh_file_is_off},
    {".stl", pliant_mesh_file_stl, pliant_mesh_file_is_stl},
    {".obj", pliant_mesh_file_obj, pliant_mesh_file_is_obj},
};
enum { FORMATS = sizeof formats / sizeof *formats };

pliant_mesh_reader *pliant_mesh_file_reader(const pliant_mesh_source *source)
{
    const char *dot = strrchr(source->name, '.');
    for (int i = 0; dot && i < FORMATS; i++)
        if (strcasecmp(dot, formats[i].extension) == 0) return formats[i].read;
    if (pliant_mesh_file_imports(source)) return pliant_mesh_file_import;
    for (int i = 0; i < FORMATS; i++)
        if (formats[i].is(source)) return formats[i].read;
    return NULL;
}

pliant_status pliant_mesh_file_parse(const pliant_mesh_source *source, pliant_mesh_reader *reader,
                                     pliant_mesh **mesh, pliant_error *err)
{
    pliant_mesh_builder builder = pliant_mesh_builder_begin(source->name);
    pliant_status status = reader(source, &builder, err);
    if (status == PLIANT_OK) status = pliant_mesh_builder_finish(&builder, mesh, err);
    pliant_mesh_builder_end(&builder);
    return status;
}

pliant_status pliant_mesh_file_read(const char *path, pliant_mesh **mesh, pliant_error *err)
{
    char text[PLIANT_FILE_NAME_SIZE];
    const char *name = pliant_file_bytes_name(path, text);
    pliant_file_bytes bytes = {0};
    pliant_status status = pliant_file_bytes_open(path, name, &bytes, err);
    if (status < 0) return status;
    const pliant_mesh_source source = {
        .name = name, .path = path, .bytes = bytes.data, .size = bytes.size};
    pliant_mesh_reader *reader = pliant_mesh_file_reader(&source);
    if (reader) status = pliant_mesh_file_parse(&source, reader, mesh, err);
    else
        status =
            pliant_error_set(err, PLIANT_ERR_FORMAT,
                             "%s: unknown kind of mesh: expected .obj, .ply, .off, .stl, or what "
                             "the import library reads (.glb, .gltf, .3ds, .dae, .fbx, ...)",
                             name);
    pliant_file_bytes_close(&bytes);
    return status;
}
