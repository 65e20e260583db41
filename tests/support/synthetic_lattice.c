// synthetic_lattice.c: lattices of any cells with an embedded surface.
#include "synthetic_lattice.h"

#include "cell_surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void *take(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    assert_non_null(memory);
    return memory;
}

static void *copy(const void *from, size_t size)
{
    void *memory = take(size, 1);
    if (size > 0) memcpy(memory, from, size);
    return memory;
}

// ---- Cells and particles ----

static int order_points(const void *a, const void *b)
{
    const int32_t *x = a, *y = b;
    for (int d = 2; d >= 0; d--)
        if (x[d] != y[d]) return x[d] < y[d] ? -1 : 1;
    return 0;
}

static int32_t find_point(const int32_t *points, int32_t count, const int32_t x[3])
{
    const int32_t *at = bsearch(x, points, (size_t)count, 3 * sizeof *points, order_points);
    return at ? (int32_t)((at - points) / 3) : -1;
}

static void corners_of(const check_lattice *l, int32_t cell, int32_t corners[8])
{
    const int32_t *c = l->cells + 3 * (size_t)cell;
    for (int k = 0; k < 8; k++) {
        const int32_t x[3] = {c[0] + (k & 1), c[1] + (k >> 1 & 1), c[2] + (k >> 2)};
        corners[k] = find_point(l->particles, l->layout.particle_count, x);
        assert_true(corners[k] >= 0);
    }
}

static void make_cells(check_lattice *l, const check_lattice_def *def)
{
    const int32_t count =
        def->cells ? def->cell_count : check_cell_shape(def->shape, def->size, NULL);
    l->layout.cell_count = count;
    l->cells = take(3 * (size_t)count, sizeof *l->cells);
    if (def->cells) memcpy(l->cells, def->cells, 3 * (size_t)count * sizeof *l->cells);
    else check_cell_shape(def->shape, def->size, l->cells);
    int32_t *particles = take(24 * (size_t)count, sizeof *particles);
    l->layout.particle_count = pliant_lattice_particles(count, l->cells, particles);
    l->particles = copy(particles, 3 * (size_t)l->layout.particle_count * sizeof *particles);
    free(particles);
    l->shape = (pliant_lattice_shape){.particle_count = l->layout.particle_count,
                                      .cell_count = count,
                                      .particles = l->particles,
                                      .cells = l->cells};
    for (int32_t p = 0; p < l->layout.particle_count; p++)
        for (int d = 0; d < 3; d++)
            if (l->particles[3 * (size_t)p + (size_t)d] >= l->shape.dims[d])
                l->shape.dims[d] = l->particles[3 * (size_t)p + (size_t)d] + 1;
}

static int32_t root_of(int32_t *parent, int32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

// Masses, and how many components the cells make through shared particles.
static void weigh(check_lattice *l)
{
    const int32_t np = l->layout.particle_count;
    int32_t *parent = take((size_t)np, sizeof *parent);
    l->mass = take((size_t)np, sizeof *l->mass);
    const double share = l->frame[PLIANT_LATTICE_MASS] / (8.0 * l->layout.cell_count);
    for (int32_t p = 0; p < np; p++) parent[p] = p;
    for (int32_t c = 0; c < l->layout.cell_count; c++) {
        int32_t corners[8];
        corners_of(l, c, corners);
        for (int k = 0; k < 8; k++) {
            l->mass[corners[k]] += (float)share;
            parent[root_of(parent, corners[k])] = root_of(parent, corners[0]);
        }
    }
    for (int32_t p = 0; p < np; p++) l->summary[PLIANT_LATTICE_COMPONENT_COUNT] += parent[p] == p;
    free(parent);
}

static void make_regions(check_lattice *l)
{
    pliant_error err = {""};
    check_ok(pliant_regions_create(&l->shape, l->layout.half_width, &l->regions, &err), &err);
    l->layout.region_node_count = l->regions->region_node_count;
    l->layout.plate_node_count = l->regions->plate_node_count;
    l->summary[PLIANT_LATTICE_REGION_COUNT] = l->regions->region_count;
}

// ---- The embedded surface ----

// The cell that holds a position in cells, and where in it. On a side between two, any of them.
static int32_t find_cell(const check_lattice *l, const double x[3], float offset[3])
{
    for (int k = 0; k < 8; k++) {
        int32_t at[3];
        for (int d = 0; d < 3; d++) {
            const double low = floor(x[d]), nudge = k >> d & 1;
            // The neighbour only where the position is on the side, to round-off.
            at[d] = (int32_t)low;
            if (nudge > 0 && x[d] - low < 1e-9) at[d]--;
            else if (nudge > 0 && x[d] - low > 1 - 1e-9) at[d]++;
        }
        const int32_t cell = find_point(l->cells, l->layout.cell_count, at);
        if (cell < 0) continue;
        for (int d = 0; d < 3; d++) offset[d] = (float)fmin(fmax(x[d] - at[d], 0), 1);
        return cell;
    }
    fail_msg("vertex at (%g, %g, %g): expected a cell there, found none", x[0], x[1], x[2]);
    return -1;
}

static void embed_mesh(check_lattice *l, const pliant_mesh *mesh)
{
    pliant_error err = {""};
    check_ok(pliant_mesh_create(mesh->vertex_count, mesh->face_count, &l->mesh, &err), &err);
    const size_t n = (size_t)mesh->vertex_count;
    memcpy(l->mesh->vertices, mesh->vertices, 3 * n * sizeof *mesh->vertices);
    memcpy(l->mesh->faces, mesh->faces, 3 * (size_t)mesh->face_count * sizeof *mesh->faces);
    l->vertex_cell = take(n, sizeof *l->vertex_cell);
    for (size_t v = 0; v < n; v++) {
        double x[3];
        for (size_t d = 0; d < 3; d++)
            x[d] = (mesh->vertices[3 * v + d] - l->frame[d]) / l->frame[PLIANT_LATTICE_CELL_SIZE];
        l->vertex_cell[v] = find_cell(l, x, l->vertex_offset + 3 * v);
    }
}

static void embed_cells(check_lattice *l, double inset)
{
    check_cell_surface s = check_cell_surface_create(l->layout.cell_count, l->cells, inset);
    const size_t n = (size_t)s.mesh->vertex_count;
    l->vertex_offset = take(3 * n, sizeof *l->vertex_offset);
    l->mesh = s.mesh;
    l->vertex_cell = s.cell;
    for (size_t i = 0; i < 3 * n; i++) {
        const size_t d = i % 3;
        l->vertex_offset[i] =
            (float)(s.mesh->vertices[i] - l->cells[3 * (size_t)s.cell[i / 3] + d]);
        s.mesh->vertices[i] =
            l->frame[d] + l->frame[PLIANT_LATTICE_CELL_SIZE] * s.mesh->vertices[i];
    }
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int d = 0; d < 3; d++)
        out[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

static void normalise(double x[3])
{
    const double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    for (int d = 0; d < 3; d++) x[d] /= length;
}

// Tangents U, V with U x V = N, the normal of the faces around the vertex by area (LSM-17).
static void make_tangents(check_lattice *l)
{
    const pliant_mesh *mesh = l->mesh;
    double *normals = take(3 * (size_t)mesh->vertex_count, sizeof *normals);
    l->vertex_tangents = take(6 * (size_t)mesh->vertex_count, sizeof *l->vertex_tangents);
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const int32_t *face = mesh->faces + 3 * (size_t)f;
        const double *a = mesh->vertices + 3 * (size_t)face[0];
        double u[3], v[3], normal[3];
        for (int d = 0; d < 3; d++) {
            u[d] = mesh->vertices[3 * (size_t)face[1] + (size_t)d] - a[d];
            v[d] = mesh->vertices[3 * (size_t)face[2] + (size_t)d] - a[d];
        }
        cross(u, v, normal);
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < 3; d++) normals[3 * (size_t)face[k] + (size_t)d] += normal[d];
    }
    for (int32_t i = 0; i < mesh->vertex_count; i++) {
        double *n = normals + 3 * (size_t)i, u[3], v[3];
        normalise(n);
        if (!isfinite(n[0])) n[0] = 1, n[1] = n[2] = 0;  // a vertex whose faces cancel out
        const double ax = fabs(n[0]), ay = fabs(n[1]), az = fabs(n[2]);
        const double least[3] = {ax <= ay && ax <= az, ay < ax && ay <= az, az < ax && az < ay};
        cross(n, least, u);
        normalise(u);
        cross(n, u, v);
        for (int d = 0; d < 3; d++) {
            l->vertex_tangents[6 * (size_t)i + (size_t)d] = (float)u[d];
            l->vertex_tangents[6 * (size_t)i + 3 + (size_t)d] = (float)v[d];
        }
    }
    free(normals);
}

// ---- Batches ----

static int order_numbers(const void *a, const void *b)
{
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

// Faces in their order; a batch ends where the next face's particles would be too many.
static void make_batches(check_lattice *l)
{
    const size_t nf = (size_t)l->mesh->face_count;
    int32_t *last_batch = take((size_t)l->layout.particle_count, sizeof *last_batch);
    int32_t *points = l->batch_points = take(24 * nf, sizeof *points);
    l->batch_faces = take(nf, sizeof *l->batch_faces);
    l->batch_face_offset = take(nf + 1, sizeof *l->batch_face_offset);
    l->batch_point_offset = take(nf + 1, sizeof *l->batch_point_offset);
    int32_t batch = 0, count = 0;
    for (size_t f = 0; f < nf; f++) {
        int32_t needed[24], fresh = 0;
        for (int k = 0; k < 3; k++)
            corners_of(l, l->vertex_cell[l->mesh->faces[3 * f + (size_t)k]], needed + 8 * k);
        for (int k = 0; k < 24; k++) fresh += last_batch[needed[k]] != batch + 1;
        if (count - l->batch_point_offset[batch] + fresh > PLIANT_BATCH_LIMIT) {
            batch++;
            l->batch_face_offset[batch] = (int32_t)f;
            l->batch_point_offset[batch] = count;
        }
        for (int k = 0; k < 24; k++)
            if (last_batch[needed[k]] != batch + 1) {
                last_batch[needed[k]] = batch + 1;
                points[count++] = needed[k];
            }
        l->batch_faces[f] = (int32_t)f;
    }
    l->layout.batch_count = batch + 1;
    l->layout.batch_point_count = count;
    l->batch_face_offset[batch + 1] = (int32_t)nf;
    l->batch_point_offset[batch + 1] = count;
    for (int32_t b = 0; b <= batch; b++)
        qsort(points + l->batch_point_offset[b],
              (size_t)(l->batch_point_offset[b + 1] - l->batch_point_offset[b]), sizeof *points,
              order_numbers);
    free(last_batch);
}

// ---- Whole lattices ----

check_lattice *check_lattice_create(const check_lattice_def *def)
{
    check_lattice *l = take(1, sizeof *l);
    make_cells(l, def);
    for (int d = 0; d < 3; d++) l->frame[PLIANT_LATTICE_ORIGIN + d] = def->origin[d];
    l->frame[PLIANT_LATTICE_CELL_SIZE] = def->cell_size > 0 ? def->cell_size : 1;
    l->frame[PLIANT_LATTICE_MASS] = def->mass > 0 ? def->mass : l->layout.cell_count;
    l->layout.half_width = l->summary[PLIANT_LATTICE_HALF_WIDTH] = def->half_width;
    l->summary[PLIANT_LATTICE_IS_SHELL] = def->is_shell;
    weigh(l);
    make_regions(l);
    if (def->mesh) {
        l->vertex_offset = take(3 * (size_t)def->mesh->vertex_count, sizeof *l->vertex_offset);
        embed_mesh(l, def->mesh);
    } else {
        embed_cells(l, def->inset > 0 ? def->inset : 0.125);
    }
    make_tangents(l);
    make_batches(l);
    return l;
}

void check_lattice_destroy(check_lattice *l)
{
    if (!l) return;
    void *const blocks[] = {l->cells,
                            l->particles,
                            l->mass,
                            l->vertex_cell,
                            l->vertex_offset,
                            l->vertex_tangents,
                            l->batch_face_offset,
                            l->batch_faces,
                            l->batch_point_offset,
                            l->batch_points};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) free(blocks[i]);
    pliant_regions_destroy(l->regions);
    pliant_mesh_destroy(l->mesh);
    free(l);
}

static void put(pliant_writer *writer, const char *path, const void *data)
{
    pliant_error err = {""};
    check_ok(pliant_writer_write_all(writer, path, data, &err), &err);
}

void check_lattice_write_sections(const check_lattice *l, pliant_writer *writer)
{
    const struct {
        const char *path;
        const void *data;
    } sections[] = {
        {"/lattice/frame", l->frame},
        {"/lattice/summary", l->summary},
        {"/lattice/cells", l->cells},
        {"/lattice/particles", l->particles},
        {"/lattice/mass", l->mass},
        {"/lattice/region_size", l->regions->size},
        {"/lattice/region_share", l->regions->share},
        {"/lattice/region_nodes", l->regions->region_nodes},
        {"/lattice/plate_nodes", l->regions->plate_nodes},
        {"/lattice/vertex_cell", l->vertex_cell},
        {"/lattice/vertex_offset", l->vertex_offset},
        {"/lattice/vertex_tangents", l->vertex_tangents},
        {"/lattice/batch_face_offset", l->batch_face_offset},
        {"/lattice/batch_faces", l->batch_faces},
        {"/lattice/batch_point_offset", l->batch_point_offset},
        {"/lattice/batch_points", l->batch_points},
    };
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++)
        put(writer, sections[i].path, sections[i].data);
}

void check_lattice_write(const check_lattice *l, const char *path)
{
    static const char provenance[] = "generator = tests/support/synthetic_lattice\n";
    const int32_t n = l->mesh->vertex_count;
    const pliant_model_layout layout = {
        .vertex_count = n,
        .face_count = l->mesh->face_count,
        .level_count = 1,
        .base_count = n,
        .text_bytes = sizeof provenance - 1,
        .lattice = l->layout,
    };
    pliant_section_def *sections = take(PLIANT_SECTION_LIMIT, sizeof *sections);
    int32_t section_count = 0;
    pliant_error err = {""};
    pliant_writer *writer = NULL;
    check_ok(pliant_model_layout_sections(&layout, sections, &section_count, &err), &err);
    check_ok(pliant_writer_create(path, sections, section_count, &writer, &err), &err);
    free(sections);
    int32_t *source = take((size_t)n, sizeof *source);
    for (int32_t v = 0; v < n; v++) source[v] = v;
    put(writer, "/mesh/vertices", l->mesh->vertices);
    put(writer, "/mesh/faces", l->mesh->faces);
    put(writer, "/mesh/level_count", &n);
    put(writer, "/mesh/parents", source);  // of no rows
    put(writer, "/mesh/source_index", source);
    free(source);
    put(writer, "/material", (const double[3]){1e5, 0.3, 1000});
    check_lattice_write_sections(l, writer);
    check_ok(pliant_writer_write_provenance(writer, provenance, &err), &err);
    check_ok(pliant_writer_commit(writer, &err), &err);
}

void check_write_lattice(const char *path, check_cells shape, int32_t size, int32_t half_width)
{
    check_lattice *l = check_lattice_create(
        &(check_lattice_def){.shape = shape, .size = size, .half_width = half_width});
    check_lattice_write(l, path);
    check_lattice_destroy(l);
}

int32_t *check_ball_cells(int32_t across, int32_t *cell_count, double origin[3])
{
    const double size = 2.0 / across;
    int32_t *cells = take(3 * (size_t)across * (size_t)across * (size_t)across, sizeof *cells);
    int32_t count = 0;
    for (int32_t i = 0; i < across * across * across; i++) {
        const int32_t at[3] = {i % across, i / across % across, i / across / across};
        double nearest = 0;
        for (int d = 0; d < 3; d++) {
            const double low = -1 + size * at[d], high = low + size;
            nearest += low > 0 ? low * low : high < 0 ? high * high : 0;
        }
        if (nearest > 1) continue;
        memcpy(cells + 3 * (size_t)count++, at, sizeof at);
    }
    *cell_count = count;
    for (int d = 0; d < 3; d++) origin[d] = -1;
    return cells;
}
