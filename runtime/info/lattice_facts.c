// lattice_facts.c: describe a lattice, and compute anew what its file says of it.
#include "lattice_facts.h"

#include "pliant/error.h"
#include "pliant/regions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Description ----

typedef struct facts {
    float least_mass, largest_mass;
    int32_t largest_batch;  // particles
} facts;

static facts find_facts(const pliant_model_view *v)
{
    facts f = {.least_mass = v->lattice_mass[0], .largest_mass = v->lattice_mass[0]};
    for (int32_t p = 0; p < v->lattice_particle_count; p++) {
        f.least_mass = fminf(f.least_mass, v->lattice_mass[p]);
        f.largest_mass = fmaxf(f.largest_mass, v->lattice_mass[p]);
    }
    for (int32_t b = 0; b < v->lattice_batch_count; b++) {
        const int32_t *offset = v->lattice_batch_point_offset + b;
        if (offset[1] - offset[0] > f.largest_batch) f.largest_batch = offset[1] - offset[0];
    }
    return f;
}

void pliant_lattice_facts_print(const pliant_model_view *v, FILE *stream)
{
    if (v->lattice_cell_count == 0) return;
    const facts f = find_facts(v);
    const int32_t *summary = v->lattice_summary, *dims = v->lattice_dims;
    const int32_t components = summary[PLIANT_LATTICE_COMPONENT_COUNT];
    fprintf(stream,
            "lattice     %d particles (%d x %d x %d), %d cells of size %g, %s, %d component%s\n",
            (int)v->lattice_particle_count, (int)dims[0], (int)dims[1], (int)dims[2],
            (int)v->lattice_cell_count, v->lattice_frame[PLIANT_LATTICE_CELL_SIZE],
            summary[PLIANT_LATTICE_IS_SHELL] ? "shell" : "solid", (int)components,
            components == 1 ? "" : "s");
    fprintf(stream, "            half-width %d, %d regions, %d irregular by %d plates\n",
            (int)v->lattice_half_width, (int)summary[PLIANT_LATTICE_REGION_COUNT],
            (int)v->lattice_region_node_count, (int)v->lattice_plate_node_count);
    fprintf(stream, "            mass %g, of a particle %g to %g\n",
            v->lattice_frame[PLIANT_LATTICE_MASS], (double)f.least_mass, (double)f.largest_mass);
    fprintf(stream, "            surface in %d batch%s of at most %d particles\n",
            (int)v->lattice_batch_count, v->lattice_batch_count == 1 ? "" : "es",
            (int)f.largest_batch);
}

void pliant_lattice_facts_print_json(const pliant_model_view *v, FILE *stream)
{
    if (v->lattice_cell_count == 0) return;
    const facts f = find_facts(v);
    const int32_t *summary = v->lattice_summary, *dims = v->lattice_dims;
    const double *frame = v->lattice_frame;
    fprintf(stream,
            ",\n  \"lattice\": {\"particles\": %d, \"cells\": %d, \"dims\": [%d, %d, %d], "
            "\"cell_size\": %.17g, \"origin\": [%.17g, %.17g, %.17g],\n    ",
            (int)v->lattice_particle_count, (int)v->lattice_cell_count, (int)dims[0], (int)dims[1],
            (int)dims[2], frame[PLIANT_LATTICE_CELL_SIZE], frame[0], frame[1], frame[2]);
    fprintf(
        stream,
        "\"shell\": %s, \"components\": %d, \"half_width\": %d, \"regions\": %d, \"irregular\": "
        "%d, \"plates\": %d,\n    ",
        summary[PLIANT_LATTICE_IS_SHELL] ? "true" : "false",
        (int)summary[PLIANT_LATTICE_COMPONENT_COUNT], (int)v->lattice_half_width,
        (int)summary[PLIANT_LATTICE_REGION_COUNT], (int)v->lattice_region_node_count,
        (int)v->lattice_plate_node_count);
    fprintf(stream,
            "\"mass\": %.17g, \"least_particle_mass\": %.9g, \"largest_particle_mass\": %.9g, "
            "\"batches\": %d, \"largest_batch\": %d}",
            frame[PLIANT_LATTICE_MASS], (double)f.least_mass, (double)f.largest_mass,
            (int)v->lattice_batch_count, (int)f.largest_batch);
}

// ---- Verification ----

// Stored masses are floats, and so are offsets: in masses and in cells.
static const double mass_tolerance = 1e-4, place_tolerance = 1e-4;

typedef struct verification {
    const char *name;  // of the file
    const pliant_model_view *view;
    int32_t *corners;  // shape [nc][8], particles
} verification;

static int order_points(const void *a, const void *b)
{
    const int32_t *x = a, *y = b;
    for (int d = 2; d >= 0; d--)
        if (x[d] != y[d]) return x[d] < y[d] ? -1 : 1;
    return 0;
}

// Binding has made sure that every corner is a particle.
static void find_corners(const verification *t)
{
    const pliant_model_view *v = t->view;
    for (int32_t c = 0; c < v->lattice_cell_count; c++)
        for (int k = 0; k < 8; k++) {
            const int32_t *cell = v->lattice_cells + 3 * (size_t)c;
            const int32_t x[3] = {cell[0] + (k & 1), cell[1] + (k >> 1 & 1), cell[2] + (k >> 2)};
            const int32_t *at = bsearch(x, v->lattice_particles, (size_t)v->lattice_particle_count,
                                        sizeof x, order_points);
            t->corners[8 * (size_t)c + (size_t)k] = (int32_t)((at - v->lattice_particles) / 3);
        }
}

static int32_t root_of(int32_t *parent, int32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

// `scratch` has shape [np].
static pliant_status verify_components(const verification *t, int32_t *scratch, pliant_error *err)
{
    const pliant_model_view *v = t->view;
    const int32_t np = v->lattice_particle_count;
    const int32_t stated = v->lattice_summary[PLIANT_LATTICE_COMPONENT_COUNT];
    int32_t count = 0;
    for (int32_t p = 0; p < np; p++) scratch[p] = p;
    for (size_t i = 0; i < 8 * (size_t)v->lattice_cell_count; i++)
        scratch[root_of(scratch, t->corners[i])] = root_of(scratch, t->corners[i - i % 8]);
    for (int32_t p = 0; p < np; p++) count += scratch[p] == p;
    if (count == stated) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%.250s: /lattice/summary: components: expected %d, found %d", t->name,
                            (int)count, (int)stated);
}

static pliant_status verify_mass(const verification *t, pliant_error *err)
{
    const pliant_model_view *v = t->view;
    const double stated = v->lattice_frame[PLIANT_LATTICE_MASS];
    double sum = 0;
    for (int32_t p = 0; p < v->lattice_particle_count; p++) sum += (double)v->lattice_mass[p];
    if (fabs(sum - stated) <= mass_tolerance * sum) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%.250s: /lattice/mass: expected a sum of %g, found %g", t->name,
                            stated, sum);
}

// Plate nodes may be in another order, so they are compared where regions refer to them.
static int same_region(const pliant_model_view *v, const pliant_regions *r, int32_t node)
{
    const size_t width = 2 * (size_t)r->half_width + 2, plate = width + 2;
    const int32_t *stored = v->lattice_region_nodes + width * (size_t)node;
    const int32_t *found = r->region_nodes + width * (size_t)node;
    if (stored[0] != found[0]) return 0;
    for (size_t i = 1; i < width; i++) {
        if (stored[i] < 0 || found[i] < 0) {
            if (stored[i] != found[i]) return 0;
        } else if (memcmp(v->lattice_plate_nodes + plate * (size_t)stored[i],
                          r->plate_nodes + plate * (size_t)found[i], plate * sizeof *stored) != 0) {
            return 0;
        }
    }
    return 1;
}

static pliant_status compare_regions(const verification *t, const pliant_regions *r,
                                     pliant_error *err)
{
    const pliant_model_view *v = t->view;
    for (int32_t p = 0; p < v->lattice_particle_count; p++) {
        if (v->lattice_region_size[p] != r->size[p])
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%.250s: /lattice/region_size: element %d: expected %d, found "
                                    "%d",
                                    t->name, (int)p, (int)r->size[p],
                                    (int)v->lattice_region_size[p]);
        if (v->lattice_region_share[p] != r->share[p])
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%.250s: /lattice/region_share: element %d: expected %d, found "
                                    "%d",
                                    t->name, (int)p, (int)r->share[p],
                                    (int)v->lattice_region_share[p]);
    }
    if (v->lattice_region_node_count != r->region_node_count)
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT,
            "%.250s: /lattice/region_nodes: expected %d irregular regions, found "
            "%d",
            t->name, (int)r->region_node_count, (int)v->lattice_region_node_count);
    for (int32_t i = 0; i < r->region_node_count; i++)
        if (!same_region(v, r, i))
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "%.250s: /lattice/region_nodes: row %d: expected what particle "
                "%d reaches, found another region",
                t->name, (int)i, (int)r->region_nodes[(size_t)i * (2 * (size_t)r->half_width + 2)]);
    return PLIANT_OK;
}

static pliant_status verify_regions(const verification *t, pliant_error *err)
{
    const pliant_model_view *v = t->view;
    const pliant_lattice_shape shape = {
        .dims = {v->lattice_dims[0], v->lattice_dims[1], v->lattice_dims[2]},
        .particle_count = v->lattice_particle_count,
        .cell_count = v->lattice_cell_count,
        .particles = v->lattice_particles,
        .cells = v->lattice_cells,
    };
    pliant_regions *regions = NULL;
    pliant_error reason = {""};
    pliant_status status = pliant_regions_create(&shape, v->lattice_half_width, &regions, &reason);
    if (status < 0)
        return pliant_error_set(err, status, "%.250s: /lattice: %.200s", t->name, reason.text);
    status = compare_regions(t, regions, err);
    pliant_regions_destroy(regions);
    return status;
}

// x = origin + a (cell + offset)
static pliant_status verify_places(const verification *t, pliant_error *err)
{
    const pliant_model_view *v = t->view;
    const double *frame = v->lattice_frame, a = frame[PLIANT_LATTICE_CELL_SIZE];
    for (int32_t i = 0; i < v->vertex_count; i++)
        for (int d = 0; d < 3; d++) {
            const size_t at = 3 * (size_t)i + (size_t)d;
            const int32_t cell =
                v->lattice_cells[3 * (size_t)v->lattice_vertex_cell[i] + (size_t)d];
            const double x = frame[d] + a * (cell + (double)v->lattice_vertex_offset[at]);
            if (fabs(x - v->vertices[at]) <= place_tolerance * a) continue;
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "%.250s: /lattice/vertex_offset: element %zu: expected a vertex "
                "at %g, found %g",
                t->name, at, v->vertices[at], x);
        }
    return PLIANT_OK;
}

// The corners of the cells of a batch's vertices are among its points. `scratch` has shape [np].
static pliant_status verify_batches(const verification *t, int32_t *scratch, pliant_error *err)
{
    const pliant_model_view *v = t->view;
    memset(scratch, 0xff, (size_t)v->lattice_particle_count * sizeof *scratch);
    for (int32_t b = 0; b < v->lattice_batch_count; b++) {
        const int32_t *points = v->lattice_batch_point_offset + b;
        const int32_t *faces = v->lattice_batch_face_offset + b;
        for (int32_t i = points[0]; i < points[1]; i++) scratch[v->lattice_batch_points[i]] = b;
        for (int32_t i = faces[0]; i < faces[1]; i++)
            for (int k = 0; k < 24; k++) {
                const int32_t face = v->lattice_batch_faces[i];
                const int32_t vertex = v->faces[3 * (size_t)face + (size_t)k / 8];
                const int32_t cell = v->lattice_vertex_cell[vertex];
                const int32_t particle = t->corners[8 * (size_t)cell + (size_t)k % 8];
                if (scratch[particle] == b) continue;
                return pliant_error_set(
                    err, PLIANT_ERR_FORMAT,
                    "%.250s: /lattice/batch_points: batch %d: expected particle "
                    "%d of face %d, found none",
                    t->name, (int)b, (int)particle, (int)face);
            }
    }
    return PLIANT_OK;
}

pliant_status pliant_lattice_facts_verify(const pliant_contents *contents, pliant_error *err)
{
    const pliant_model_view *v = &contents->model;
    if (v->lattice_cell_count == 0) return PLIANT_OK;
    verification t = {.name = pliant_reader_name(contents->reader), .view = v};
    t.corners = malloc(8 * (size_t)v->lattice_cell_count * sizeof *t.corners);
    int32_t *scratch = malloc((size_t)v->lattice_particle_count * sizeof *scratch);
    pliant_status status = PLIANT_OK;
    if (!t.corners || !scratch) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%.250s: no memory for %d cells", t.name,
                                  (int)v->lattice_cell_count);
        goto done;
    }
    find_corners(&t);
    status = verify_components(&t, scratch, err);
    if (status == PLIANT_OK) status = verify_mass(&t, err);
    if (status == PLIANT_OK) status = verify_regions(&t, err);
    if (status == PLIANT_OK) status = verify_places(&t, err);
    if (status == PLIANT_OK) status = verify_batches(&t, scratch, err);
done:
    free(scratch);
    free(t.corners);
    return status;
}
