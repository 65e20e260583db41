// lattice_output.c: write a lattice into a model file, or a file of its own.
#include "lattice_output.h"

#include <string.h>
#include <sys/stat.h>

typedef struct section {
    const char *path;
    const void *data;
} section;

static pliant_status write_sections(pliant_writer *writer, const section *sections, size_t count,
                                    pliant_error *err)
{
    for (size_t i = 0; i < count; i++) {
        const pliant_status status =
            pliant_writer_write_all(writer, sections[i].path, sections[i].data, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

pliant_status pliant_surface_output_write(pliant_writer *writer, const pliant_multires *multires,
                                          const pliant_material *material, pliant_error *err)
{
    const double constants[3] = {material->young, material->poisson, material->density};
    const section sections[] = {
        {"/mesh/vertices", multires->mesh->vertices},   {"/mesh/faces", multires->mesh->faces},
        {"/mesh/level_count", multires->vertex_count},  {"/mesh/parents", multires->parents},
        {"/mesh/source_index", multires->source_index}, {"/material", constants},
    };
    return write_sections(writer, sections, sizeof sections / sizeof *sections, err);
}

pliant_lattice_layout pliant_lattice_output_layout(const pliant_lattice_data *lattice)
{
    return (pliant_lattice_layout){
        .cell_count = lattice->voxels->cell_count,
        .particle_count = lattice->particle_count,
        .half_width = lattice->regions->half_width,
        .region_node_count = lattice->regions->region_node_count,
        .plate_node_count = lattice->regions->plate_node_count,
        .batch_count = lattice->batches->batch_count,
        .batch_point_count = lattice->batches->point_offset[lattice->batches->batch_count]};
}

pliant_status pliant_lattice_output_write(pliant_writer *writer, const pliant_lattice_data *lattice,
                                          pliant_error *err)
{
    const pliant_voxels *v = lattice->voxels;
    double frame[PLIANT_LATTICE_FRAME_COUNT] = {0};
    memcpy(frame + PLIANT_LATTICE_ORIGIN, v->grid.origin, sizeof v->grid.origin);
    frame[PLIANT_LATTICE_CELL_SIZE] = v->grid.size;
    frame[PLIANT_LATTICE_MASS] = lattice->total_mass;
    int32_t summary[PLIANT_LATTICE_SUMMARY_COUNT] = {0};
    summary[PLIANT_LATTICE_HALF_WIDTH] = lattice->regions->half_width;
    summary[PLIANT_LATTICE_IS_SHELL] = v->filling == PLIANT_VOXELS_SHELL;
    summary[PLIANT_LATTICE_COMPONENT_COUNT] = lattice->component_count;
    summary[PLIANT_LATTICE_REGION_COUNT] = lattice->regions->region_count;
    const section sections[] = {
        {"/lattice/frame", frame},
        {"/lattice/summary", summary},
        {"/lattice/cells", v->cells},
        {"/lattice/particles", lattice->particles},
        {"/lattice/mass", lattice->mass},
        {"/lattice/region_size", lattice->regions->size},
        {"/lattice/region_share", lattice->regions->share},
        {"/lattice/region_nodes", lattice->regions->region_nodes},
        {"/lattice/plate_nodes", lattice->regions->plate_nodes},
        {"/lattice/vertex_cell", lattice->embedding->cell},
        {"/lattice/vertex_offset", lattice->embedding->offset},
        {"/lattice/vertex_tangents", lattice->embedding->tangents},
        {"/lattice/batch_face_offset", lattice->batches->face_offset},
        {"/lattice/batch_faces", lattice->batches->faces},
        {"/lattice/batch_point_offset", lattice->batches->point_offset},
        {"/lattice/batch_points", lattice->batches->points},
    };
    return write_sections(writer, sections, sizeof sections / sizeof *sections, err);
}

pliant_status pliant_lattice_output_file(const char *path, const pliant_multires *multires,
                                         const pliant_material *material,
                                         const pliant_lattice_data *lattice, const char *provenance,
                                         double *bytes, pliant_error *err)
{
    const pliant_model_layout layout = {.vertex_count = multires->mesh->vertex_count,
                                        .face_count = multires->mesh->face_count,
                                        .level_count = multires->level_count,
                                        .base_count = multires->vertex_count[0],
                                        .text_bytes = strlen(provenance),
                                        .lattice = pliant_lattice_output_layout(lattice)};
    pliant_section_def sections[PLIANT_SECTION_LIMIT];
    pliant_writer *writer = NULL;
    int32_t section_count;
    pliant_status status = pliant_model_layout_sections(&layout, sections, &section_count, err);
    if (status == PLIANT_OK)
        status = pliant_writer_create(path, sections, section_count, &writer, err);
    if (status < 0) return status;

    status = pliant_surface_output_write(writer, multires, material, err);
    if (status == PLIANT_OK) status = pliant_lattice_output_write(writer, lattice, err);
    if (status == PLIANT_OK) status = pliant_writer_write_provenance(writer, provenance, err);
    if (status == PLIANT_OK) status = pliant_writer_commit(writer, err);
    else pliant_writer_abandon(writer);
    struct stat file;
    *bytes = status == PLIANT_OK && stat(path, &file) == 0 ? (double)file.st_size : 0;
    return status;
}
