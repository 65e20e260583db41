// provenance.c: what a model file says of its making: "key = value" lines.
#include "provenance.h"

#include "discretisation.h"

#include <hdf5.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef PLIANT_REVISION
#define PLIANT_REVISION "unknown"
#endif

// Everything but the command line and the names of files.
enum { FIXED_TEXT = 4096 };

static uint64_t hash(uint64_t state, const void *bytes, size_t count)
{
    // FNV-1a (Fowler, Noll, Vo), 64 bits.
    for (size_t i = 0; i < count; i++)
        state = (state ^ ((const unsigned char *)bytes)[i]) * 0x100000001B3ull;
    return state;
}

static void print_run(FILE *out, const pliant_run_summary *s, const pliant_mesh *mesh,
                      const pliant_options *options, const char *command_line)
{
    const uint64_t mesh_hash = hash(hash(0xCBF29CE484222325ull, mesh->vertices,
                                         3 * (size_t)mesh->vertex_count * sizeof(double)),
                                    mesh->faces, 3 * (size_t)mesh->face_count * sizeof(int32_t));
    unsigned major, minor, release;
    char petsc[128] = "";
    H5get_libversion(&major, &minor, &release);
    (void)PetscGetVersion(petsc, sizeof petsc);
    const char *comma = strchr(petsc, ',');
    fprintf(out,
            "program = pliant-precompute %s\n"
            "revision = %s\n"
            "command_line = %s\n"
            "mesh = %s\n"
            "mesh_hash = fnv1a64:%016llx\n"
            "petsc = %.*s\n"
            "hdf5 = %u.%u.%u\n"
            "ranks = %d\n"
            "seconds_read = %.3f\n",
            PLIANT_VERSION_TEXT, PLIANT_REVISION, command_line, options->mesh,
            (unsigned long long)mesh_hash, comma ? (int)(comma - petsc) : (int)strlen(petsc), petsc,
            major, minor, release, s->ranks, s->times.read);
}

static void print_greens(FILE *out, const pliant_run_summary *s, const pliant_options *options)
{
    fprintf(out,
            "method = %s\n"
            "solver = %s\n"
            "groups = %d\n"
            "constraint_levels = %d..%d\n"
            "asked_eps = %.9g\n"
            "asked_rms = %.9g\n"
            "asked_max = %.9g\n"
            "detail_steps = %d\n"
            "detail_rms = %.6g\n"
            "detail_tangential_rms = %.6g\n"
            "residual = %.3g\n"
            "seconds_assemble = %.3f\n"
            "seconds_factor = %.3f\n"
            "seconds_solve = %.3f\n"
            "seconds_transform = %.3f\n"
            "seconds_compress = %.3f\n",
            pliant_discretisation_of(options->method)->name, s->solver, s->groups, s->levels.first, s->levels.last, options->compression.eps,
            options->compression.rms, options->compression.max, s->detail_steps, s->detail.rms,
            s->detail.tangential_rms, s->residual, s->times.assemble, s->times.factor,
            s->times.solve, s->times.transform, s->times.compress);
}

static void print_elements(FILE *out, const pliant_options *options)
{
    fprintf(out, "element_order = %d\n", options->order);
    if (options->volume) fprintf(out, "volume = %s\n", options->volume);
    else fprintf(out, "element_growth = %.9g\n", options->growth);
}

static void print_lattice(FILE *out, const pliant_run_summary *s, const pliant_options *options)
{
    fprintf(out,
            "lattice_cells_along = %d\n"
            "lattice_half_width = %d\n"
            "lattice_filling = %s\n"
            "lattice_densities = %s\n"
            "seconds_lattice = %.3f\n",
            options->lattice_cells, options->half_width,
            options->filling == PLIANT_VOXELS_SOLID ? "solid" : "shell",
            options->lattice_mass ? options->lattice_mass : "uniform", s->times.lattice);
}

char *pliant_provenance_text(const pliant_run_summary *summary, const pliant_mesh *mesh,
                             const pliant_options *options, const char *command_line)
{
    const size_t size = FIXED_TEXT + strlen(command_line) + strlen(options->mesh) +
                        (options->lattice_mass ? strlen(options->lattice_mass) : 0) +
                        (options->volume ? strlen(options->volume) : 0);
    char *text = calloc(size, 1);
    FILE *out = text ? fmemopen(text, size, "w") : NULL;
    if (!out) {
        free(text);
        return NULL;
    }
    print_run(out, summary, mesh, options, command_line);
    if (options->greens == PLIANT_GREENS_SOLVE) print_greens(out, summary, options);
    if (options->greens == PLIANT_GREENS_SOLVE && options->method == PLIANT_METHOD_FEM)
        print_elements(out, options);
    if (options->lattice_cells > 0) print_lattice(out, summary, options);
    fclose(out);
    return text;
}

const char *pliant_provenance_revision(void)
{
    return PLIANT_REVISION;
}
