// identity.c: what makes two runs the same run: program, inputs and every option that shapes the
// file.
#include "identity.h"

#include "checksum.h"
#include "provenance.h"

#include "pliant/error.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT_SIZE = 16384 };

static pliant_status hash_file(const char *path, uint64_t *hash, pliant_error *err)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return pliant_error_set(err, PLIANT_ERR_IO, "%.400s: cannot be opened: %s", path,
                                strerror(errno));
    char block[1 << 14];
    *hash = 0;
    for (size_t count; (count = fread(block, 1, sizeof block, file)) > 0;)
        *hash = pliant_checksum(*hash, block, count);
    const int failed = ferror(file);
    fclose(file);
    return failed ? pliant_error_set(err, PLIANT_ERR_IO, "%.400s: cannot be read", path)
                  : PLIANT_OK;
}

// One a line, in the order in which a difference is worth telling.
static void print(FILE *out, const pliant_options *o, const pliant_problem *p, uint64_t mesh,
                  uint64_t densities, uint64_t volume)
{
    fprintf(out, "version = %s (%s)\n", PLIANT_VERSION_TEXT, pliant_provenance_revision());
    fprintf(out, "mesh contents = %016llx\n", (unsigned long long)mesh);
    fprintf(out, "--subdivide = %d\n--scheme = %d\n--detail = %d\n", o->subdivide, (int)o->scheme,
            o->detail);
    fprintf(out, "--remesh = %d (%d, %d levels)\n", (int)o->remeshing, o->remesh.base_vertices,
            o->remesh.levels);
    fprintf(out, "vertices = %d\n", p->vertex_count);
    fprintf(out, "held vertices = %d (%016llx)\n", p->fixed_count,
            (unsigned long long)pliant_checksum(0, p->held, (size_t)p->vertex_count));
    fprintf(out, "--young = %.17g\n--poisson = %.17g\n--density = %.17g\n", o->material.young,
            o->material.poisson, o->material.density);
    fprintf(out, "--method = %d\n--order = %d\n--solver = %d\n", (int)o->method, o->order, (int)o->solver);
    fprintf(out, "--growth = %.17g\n--volume contents = %016llx\n", o->growth,
            (unsigned long long)volume);
    for (int32_t k = 0; k < o->region_count; k++)
        fprintf(out, "--material %s = %.17g:%.17g:%.17g\n", o->regions[k].name,
                o->regions[k].material.young, o->regions[k].material.poisson,
                o->regions[k].material.density);
    fprintf(out, "--rms = %.17g\n--max = %.17g\n--eps = %.17g\n", o->compression.rms,
            o->compression.max, o->compression.eps);
    fprintf(out, "--wavelet = %d\n--no-lift = %d\n--boundary = %d\n", (int)o->wavelet.scheme,
            (int)o->wavelet.lifting, (int)o->wavelet.boundary);
    fprintf(out, "--constraint-levels = %d..%d\n--blocks = %d\n", p->levels.first, p->levels.last,
            (int)o->blocks);
    fprintf(out,
            "--lattice = %d\n--half-width = %d\n--shell = %d\n--lattice-mass contents = %016llx\n",
            o->lattice_cells, o->half_width, (int)o->filling, (unsigned long long)densities);
}

pliant_status pliant_identity_create(const pliant_options *options, const pliant_problem *problem,
                                     char **text, pliant_error *err)
{
    uint64_t mesh, densities = 0, volume = 0;
    pliant_status status = hash_file(options->mesh, &mesh, err);
    if (status == PLIANT_OK && options->lattice_mass)
        status = hash_file(options->lattice_mass, &densities, err);
    if (status == PLIANT_OK && options->volume) status = hash_file(options->volume, &volume, err);
    if (status < 0) return status;
    char *lines = calloc(TEXT_SIZE, 1);
    FILE *out = lines ? fmemopen(lines, TEXT_SIZE, "w") : NULL;
    if (!out) {
        free(lines);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory to tell runs apart");
    }
    print(out, options, problem, mesh, densities, volume);
    fclose(out);
    *text = lines;
    return PLIANT_OK;
}

// Length of the line's key and of the line.
static size_t key_length(const char *line)
{
    const char *end = strstr(line, " = ");
    return end ? (size_t)(end - line) : strcspn(line, "\n");
}

static const char *value_of(const char *text, const char *key, size_t length)
{
    for (const char *line = text; *line; line += strcspn(line, "\n"), line += *line == '\n')
        if (key_length(line) == length && strncmp(line, key, length) == 0 && line[length] == ' ')
            return line + length + 3;
    return NULL;
}

pliant_status pliant_identity_compare(const char *then, const char *now, pliant_error *err)
{
    if (strcmp(then, now) == 0) return PLIANT_OK;
    char first[300] = "";
    int more = -1;
    for (const char *line = now; *line; line += strcspn(line, "\n"), line += *line == '\n') {
        const size_t length = key_length(line);
        const char *before = value_of(then, line, length), *after = value_of(now, line, length);
        const int before_size = before ? (int)strcspn(before, "\n") : 0,
                  after_size = after ? (int)strcspn(after, "\n") : 0;
        if (before && after && before_size == after_size &&
            strncmp(before, after, (size_t)after_size) == 0)
            continue;
        if (more++ < 0)
            snprintf(first, sizeof first, "%.*s was %.*s then, is %.*s now", (int)length, line,
                     before ? before_size : 7, before ? before : "nothing", after_size,
                     after ? after : "");
    }
    if (more > 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s, and %d more differ", first, more);
    return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s",
                            more == 0 ? first : "the run is another one");
}
