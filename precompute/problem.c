// problem.c: the reference boundary value problem: surface, levels, support, domains (GF 3.2.1).
#include "problem.h"

#include "input.h"
#include "mesh/region.h"
#include "refusal.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

// Vertices held by --fixed-list: those listed and, since a list names vertices of the input, new
// vertices whose two parents are held.
static pliant_status hold_listed(const pliant_multires *multires, int32_t input_count,
                                 const char *list, uint8_t *held, pliant_error *err)
{
    uint8_t *listed = calloc((size_t)input_count + 1, 1);
    if (!listed) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the list of held vertices");
    const pliant_status status = pliant_region_read(list, input_count, listed, err);
    const int32_t base = multires->vertex_count[0];
    for (int32_t v = 0; status == PLIANT_OK && v < multires->mesh->vertex_count; v++) {
        const int32_t source = multires->source_index[v];
        if (source >= 0) {
            held[v] |= listed[source];
        } else {
            const int32_t *parents = multires->parents + 2 * (size_t)(v - base);
            held[v] |= held[parents[0]] && held[parents[1]];
        }
    }
    free(listed);
    return status;
}

// Everything that only one rank needs to do: read, find levels, hold.
static pliant_status pose(const pliant_options *options, pliant_progress *progress,
                          pliant_input *input, uint8_t **held, pliant_error *err)
{
    pliant_status status = pliant_input_read(options, progress, input, err);
    if (status < 0) return status;
    const pliant_mesh *mesh = input->multires->mesh;
    *held = calloc((size_t)mesh->vertex_count, 1);
    if (!*held)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d vertices", mesh->vertex_count);
    if (options->fixed_expression) {
        status = pliant_region_evaluate(options->fixed_expression, mesh, *held, err);
        if (status < 0) {
            const pliant_error inner = *err;
            return pliant_error_set(err, status, "--fixed: %.400s", inner.text);
        }
    }
    if (options->fixed_list) {
        status = hold_listed(input->multires, input->vertex_count, options->fixed_list, *held, err);
        if (status < 0) return status;
    }
    return pliant_region_check(mesh, *held, err);
}

// Collective: everybody gets the first rank's mesh, levels and held set.
static PetscErrorCode share(MPI_Comm comm, int rank, pliant_multires **multires, uint8_t **held,
                            pliant_mesh_report *report, pliant_error *err)
{
    PetscFunctionBegin;
    int32_t counts[PLIANT_LEVEL_LIMIT + 4] = {0};
    if (rank == 0) {
        counts[0] = (*multires)->mesh->vertex_count;
        counts[1] = (*multires)->mesh->face_count;
        counts[2] = (*multires)->level_count;
        memcpy(counts + 3, (*multires)->vertex_count, sizeof (*multires)->vertex_count);
    }
    PetscCallMPI(MPI_Bcast(counts, PLIANT_LEVEL_LIMIT + 4, MPI_INT32_T, 0, comm));
    PetscCallMPI(MPI_Bcast(report, (int)sizeof *report, MPI_BYTE, 0, comm));
    const int32_t n = counts[0], odd = n - counts[3];
    pliant_status status = PLIANT_OK;
    if (rank > 0) {
        const int32_t base_faces = counts[1] >> (2 * (counts[2] - 1));
        status = pliant_multires_create(counts[3], base_faces, counts[2], multires, err);
        *held = malloc((size_t)n);
        if (status == PLIANT_OK && !*held)
            status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d vertices", n);
    }
    PliantCall(comm, status, err);
    pliant_multires *m = *multires;
    PetscCallMPI(MPI_Bcast(m->mesh->vertices, 3 * n, MPI_DOUBLE, 0, comm));
    PetscCallMPI(MPI_Bcast(m->mesh->faces, 3 * counts[1], MPI_INT32_T, 0, comm));
    PetscCallMPI(MPI_Bcast(m->parents, 2 * odd, MPI_INT32_T, 0, comm));
    PetscCallMPI(MPI_Bcast(m->source_index, n, MPI_INT32_T, 0, comm));
    PetscCallMPI(MPI_Bcast(*held, n, MPI_BYTE, 0, comm));
    PetscFunctionReturn(0);
}

// Domains, areas and transforms, on every rank from the shared mesh.
static pliant_status derive(pliant_problem *p, const pliant_options *options, pliant_error *err)
{
    const pliant_multires *m = p->multires;
    const pliant_mesh *mesh = m->mesh;
    const int32_t n = p->vertex_count = mesh->vertex_count;
    p->free_nodes = malloc((size_t)n * sizeof *p->free_nodes);
    p->fixed_nodes = malloc((size_t)n * sizeof *p->fixed_nodes);
    p->areas = malloc((size_t)n * sizeof *p->areas);
    if (!p->free_nodes || !p->fixed_nodes || !p->areas)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d vertices", n);
    for (int32_t v = 0; v < n; v++) {
        if (p->held[v]) p->fixed_nodes[p->fixed_count++] = v;
        else p->free_nodes[p->free_count++] = v;
    }
    pliant_mesh_vertex_areas(n, mesh->vertices, mesh->face_count, mesh->faces, p->areas);

    pliant_status status = pliant_hierarchy_create(m->level_count, m->vertex_count, mesh->face_count,
                                                   mesh->faces, m->parents, &p->hierarchy, err);
    if (status < 0) return status;
    status = pliant_wavelet_create(p->hierarchy, p->areas, p->free_nodes, p->free_count,
                                   &options->wavelet, &p->free_wavelet, err);
    if (status < 0) return status;
    pliant_wavelet_def fixed = options->wavelet;
    fixed.boundary = PLIANT_DROP;
    status = pliant_wavelet_create(p->hierarchy, p->areas, p->fixed_nodes, p->fixed_count, &fixed,
                                   &p->fixed_wavelet, err);
    if (status < 0) return status;
    status = pliant_hats_create(p->free_wavelet, p->free_nodes, p->areas, &p->free_hats, err);
    if (status < 0) return status;
    return pliant_hats_create(p->fixed_wavelet, p->fixed_nodes, p->areas, &p->fixed_hats, err);
}

PetscErrorCode pliant_problem_create(MPI_Comm comm, const pliant_options *options,
                                     pliant_progress *progress, pliant_problem **problem,
                                     pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank;
    PetscCallMPI(MPI_Comm_rank(comm, &rank));
    pliant_problem *p;
    PetscCall(PetscNew(&p));
    *problem = p;  // from here on destroy frees whatever there is
    pliant_input input = {0};
    pliant_status status = PLIANT_OK;
    if (rank == 0) status = pose(options, progress, &input, &p->held, err);
    p->multires = input.multires;
    p->relief = input.relief;
    p->input_count = input.vertex_count;
    p->remesh = input.remesh;
    PliantCall(comm, status, err);
    PetscCall(share(comm, rank, &p->multires, &p->held, &input.report, err));
    p->component_count = input.report.component_count;
    p->levels = options->constraint_levels;
    if (p->levels.first < 0) p->levels = (pliant_level_range){0, p->multires->level_count - 1};
    PliantCall(comm, derive(p, options, err), err);
    p->volume = pliant_mesh_volume(p->multires->mesh);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_problem_destroy(pliant_problem **problem)
{
    PetscFunctionBegin;
    pliant_problem *p = *problem;
    if (!p) PetscFunctionReturn(0);
    pliant_hats_destroy(p->fixed_hats);
    pliant_hats_destroy(p->free_hats);
    pliant_wavelet_destroy(p->fixed_wavelet);
    pliant_wavelet_destroy(p->free_wavelet);
    pliant_hierarchy_destroy(p->hierarchy);
    free(p->areas);
    free(p->fixed_nodes);
    free(p->free_nodes);
    free(p->held);
    pliant_relief_destroy(p->relief);
    pliant_multires_destroy(p->multires);
    PetscCall(PetscFree(*problem));
    PetscFunctionReturn(0);
}
