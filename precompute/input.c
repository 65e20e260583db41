// input.c: the mesh that a run works on: read, checked, and with its levels.
#include "input.h"

#include "mesh/mesh_file.h"
#include "node_memory.h"
#include "remesh/remesh.h"
#include "remesh/repair.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>

// Weights of the limit surface while detail is measured, twelve a vertex on two levels, and faces.
static const double detail_bytes = 1200;
// Positions, faces, twins and parents of a vertex while it is made, embedded and written.
static const double plain_bytes = 400;
// Of one with finite elements, at the least: the matrix of linear ones. The plan of memory, which
// comes when the inside is there, knows better.
static const double element_bytes = 4000;

// A deep subdivision is refused before it is made: by the dense system of its vertices, or, where
// none is solved, by the vertices themselves.
static pliant_status check_size(const pliant_mesh *base, const pliant_options *options,
                                pliant_error *err)
{
    // Every level has four faces for one; a closed surface has about half as many vertices as
    // faces.
    const double detailed = ldexp(base->face_count, 2 * options->subdivide) / 2;
    const double vertices = ldexp(detailed, -2 * options->detail),
                 available = pliant_node_available();
    const double needed = 2 * 9 * vertices * vertices * sizeof(double);
    if (options->detail > 0 && available > 0 && detailed * detail_bytes > available)
        return pliant_error_set(
            err, PLIANT_ERR_MEMORY,
            "--subdivide %d --detail %d: makes %.3g vertices, which need %.3g GB of "
            "memory (%.1f GB are available here): use fewer levels",
            options->subdivide, options->detail, detailed, detailed * detail_bytes / 1e9,
            available / 1e9);
    if (options->greens == PLIANT_GREENS_NONE || options->method == PLIANT_METHOD_FEM) {
        const double bytes = options->greens == PLIANT_GREENS_NONE ? plain_bytes : element_bytes;
        if (available <= 0 || vertices * bytes <= available) return PLIANT_OK;
        return pliant_error_set(
            err, PLIANT_ERR_MEMORY,
            "--subdivide %d: makes %.3g vertices, which need %.3g GB of memory (%.1f GB "
            "are available here): use fewer levels",
            options->subdivide, vertices, vertices * bytes / 1e9, available / 1e9);
    }
    if (available <= 0 || needed <= 64 * available) return PLIANT_OK;
    return pliant_error_set(
        err, PLIANT_ERR_MEMORY,
        "--subdivide %d: makes %.3g vertices, whose dense system needs %.3g GB of "
        "memory (%.1f GB are available here): use fewer levels",
        options->subdivide, vertices, needed / 1e9, available / 1e9);
}

static pliant_status find_levels(const pliant_options *options, const pliant_mesh *mesh,
                                 pliant_multires **multires, pliant_error *err)
{
    if (options->subdivide >= 0)
        return pliant_multires_subdivide(mesh, options->subdivide, options->scheme, multires, err);
    if (options->greens == PLIANT_GREENS_NONE)
        return pliant_multires_subdivide(mesh, 0, PLIANT_SUBDIVIDE_MIDPOINT, multires, err);
    return pliant_multires_detect(mesh, multires, err);
}

// Numbers of the mesh that was repaired, in those of the file.
static void rename_sources(pliant_multires *multires, const int32_t *source)
{
    for (int32_t v = 0; v < multires->mesh->vertex_count; v++)
        if (multires->source_index[v] >= 0) multires->source_index[v] = source[multires->source_index[v]];
}

// --remesh: mend what is small, and make a mesh with levels.
static pliant_status read_arbitrary(const pliant_options *options, pliant_progress *progress,
                                    pliant_mesh **mesh, pliant_input *input, pliant_error *err)
{
    pliant_repair_report repaired;
    int32_t *source = NULL;
    pliant_status status = pliant_repair(mesh, &source, &repaired, err);
    if (status < 0) return status;
    if (repaired.text[0]) pliant_progress_note(progress, "%s: %s", options->mesh, repaired.text);
    status = pliant_mesh_check(*mesh, options->mesh, &input->report, err);
    if (status == PLIANT_OK) {
        pliant_remesh_report *r = &input->remesh;
        status = pliant_remesh(*mesh, &options->remesh, &input->multires, r, err);
        if (status < 0) {
            const pliant_error inner = *err;
            status = pliant_error_set(err, status, "%s: --remesh: %.400s", options->mesh, inner.text);
        } else {
            rename_sources(input->multires, source);
            pliant_progress_note(progress,
                                 "%s: remeshed: %d base vertices, %d level%s above, %d vertices; distance %.2f%% of "
                                 "the diagonal there, %.2f%% back; smallest angle %.1f degrees; normals off by %.1f "
                                 "degrees (mean), %.1f (largest); %d flipped%s",
                                 options->mesh, r->base_vertices, r->levels, r->levels == 1 ? "" : "s",
                                 input->multires->mesh->vertex_count, 100 * r->fit.there, 100 * r->fit.back,
                                 r->fit.smallest_angle, r->fit.normal_mean, r->fit.normal_largest,
                                 r->fit.flipped_count, r->met ? "" : ": more than what is aimed at");
        }
    }
    free(source);
    return status;
}

pliant_status pliant_input_read(const pliant_options *options, pliant_progress *progress,
                                pliant_input *input, pliant_error *err)
{
    pliant_mesh *mesh = NULL;
    pliant_mesh_report *report = &input->report;
    pliant_status status = pliant_mesh_file_read(options->mesh, &mesh, err);
    if (status < 0) return status;
    input->vertex_count = mesh->vertex_count;
    if (options->remeshing == PLIANT_REMESH_FIRST) {
        status = read_arbitrary(options, progress, &mesh, input, err);
        if (status < 0) goto done;
    } else {
        if ((status = pliant_mesh_check(mesh, options->mesh, report, err)) < 0) goto done;
        if (report->turned_count > 0)
            pliant_progress_note(progress, "%s: %d faces looked inwards and were turned", options->mesh,
                                 report->turned_count);
        if (options->subdivide >= 0 && (status = check_size(mesh, options, err)) < 0) goto done;
        status = find_levels(options, mesh, &input->multires, err);
    }
    if (status == PLIANT_OK && options->detail > 0)
        status = pliant_relief_split(&input->multires, options->detail, &input->relief, err);
    if (status < 0) {
        // The room of meshes does not know the file's name.
        const pliant_error inner = *err;
        status = pliant_error_set(err, status, "%s: %.400s", options->mesh, inner.text);
        goto done;
    }
    if (input->multires->note.text[0])
        pliant_progress_note(progress, "%s: %s", options->mesh, input->multires->note.text);
done:
    pliant_mesh_destroy(mesh);
    return status;
}

void pliant_input_release(pliant_input *input)
{
    pliant_relief_destroy(input->relief);
    pliant_multires_destroy(input->multires);
    *input = (pliant_input){0};
}
