// tiny_model.h: a small valid model and dense file as arrays, for the tests of formats and the fuzzer.
//
// An octahedron of radius 1, subdivided without smoothing; vertices with z < -0.4 are fixed. The
// numbers of the blocks mean nothing, the indices are all in order.
#pragma once

#include "pliant/regions.h"
#include "pliant/sections.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TINY_LEVELS   3    // level counts up to this
#define TINY_VERTICES 66   // of three levels
#define TINY_FACES    128

typedef struct tiny_section {
    pliant_section_def def;
    void *data;  // owned
    size_t bytes;
} tiny_section;

typedef struct tiny_file {
    int32_t section_count;
    tiny_section sections[PLIANT_SECTION_LIMIT];
} tiny_file;

typedef struct tiny_mesh {
    int32_t level_count, vertex_count, face_count;
    int32_t level_vertex_count[TINY_LEVELS];
    double vertices[TINY_VERTICES][3];
    int32_t faces[TINY_FACES][3];
    int32_t parents[TINY_VERTICES][2];  // at vertex - level_vertex_count[0]
} tiny_mesh;

static const char tiny_provenance[] = "program = pliant-precompute 0.1.0\n"
                                      "command = pliant-precompute octahedron.obj -o tiny.h5\n"
                                      "mesh = octahedron.obj\n"
                                      "place = Z\xc3\xbcrich \"quoted\"\n";

static inline int32_t tiny_midpoint(tiny_mesh *mesh, int32_t first, int32_t a, int32_t b)
{
    const int32_t base = mesh->level_vertex_count[0];
    for (int32_t v = first; v < mesh->vertex_count; v++) {
        const int32_t *p = mesh->parents[v - base];
        if ((p[0] == a && p[1] == b) || (p[0] == b && p[1] == a)) return v;
    }
    const int32_t v = mesh->vertex_count++;
    mesh->parents[v - base][0] = a;
    mesh->parents[v - base][1] = b;
    for (int d = 0; d < 3; d++)
        mesh->vertices[v][d] = 0.5 * (mesh->vertices[a][d] + mesh->vertices[b][d]);
    return v;
}

static inline void tiny_subdivide(tiny_mesh *mesh)
{
    int32_t faces[TINY_FACES][3];
    const int32_t first = mesh->vertex_count;
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const int32_t a = mesh->faces[f][0], b = mesh->faces[f][1], c = mesh->faces[f][2];
        const int32_t ab = tiny_midpoint(mesh, first, a, b), bc = tiny_midpoint(mesh, first, b, c),
                      ca = tiny_midpoint(mesh, first, c, a);
        const int32_t children[4][3] = {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}};
        memcpy(faces[4 * f], children, sizeof children);
    }
    mesh->face_count *= 4;
    memcpy(mesh->faces, faces, sizeof *faces * (size_t)mesh->face_count);
    mesh->level_vertex_count[mesh->level_count++] = mesh->vertex_count;
}

static inline tiny_mesh tiny_mesh_make(int32_t level_count)
{
    tiny_mesh mesh = {
        .level_count = 1,
        .vertex_count = 6,
        .face_count = 8,
        .level_vertex_count = {6},
        .vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
        .faces = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}},
    };
    while (mesh.level_count < level_count) tiny_subdivide(&mesh);
    return mesh;
}

// A zeroed array for a section, from its definition.
static inline void *tiny_array(tiny_section *section)
{
    size_t count = pliant_section_type_size(section->def.type);
    for (int d = 0; d < section->def.rank; d++) count *= (size_t)section->def.shape[d];
    section->bytes = count;
    section->data = calloc(1, count + 1);
    if (!section->data) abort();
    return section->data;
}

static inline tiny_section *tiny_find(tiny_file *file, const char *path)
{
    for (int32_t i = 0; i < file->section_count; i++)
        if (strcmp(file->sections[i].def.path, path) == 0) return &file->sections[i];
    fprintf(stderr, "tiny model: no section %s\n", path);
    abort();
}

static inline void tiny_free(tiny_file *file)
{
    for (int32_t i = 0; i < file->section_count; i++) free(file->sections[i].data);
    file->section_count = 0;
}

static inline void tiny_fill_floats(tiny_section *section, double seed)
{
    if (section->def.type == PLIANT_F4)
        for (size_t i = 0; i < section->bytes / 4; i++) ((float *)section->data)[i] = (float)sin(seed + (double)i);
    else
        for (size_t i = 0; i < section->bytes / 8; i++) ((double *)section->data)[i] = sin(seed + (double)i);
}

// Is the block (row, column) of the pattern kept?
static inline int tiny_keeps(int32_t row, int32_t column)
{
    return (row + 2 * column) % 3 == 0;
}

static inline void tiny_take(tiny_file *file, const pliant_section_def *defs, int32_t count)
{
    memset(file, 0, sizeof *file);
    file->section_count = count;
    for (int32_t i = 0; i < count; i++) {
        file->sections[i].def = defs[i];
        tiny_array(&file->sections[i]);
    }
}

// Positions of the vertices of one kind; level_offset[l] as in the file.
static inline int32_t tiny_domain(const tiny_mesh *mesh, int fixed, int32_t *nodes, int32_t *level_offset)
{
    int32_t count = 0, level = 0;
    level_offset[0] = 0;
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        if ((mesh->vertices[v][2] < -0.4) == fixed) nodes[count++] = v;
        if (v + 1 == mesh->level_vertex_count[level]) level_offset[++level] = count;
    }
    return count;
}

// What a tiny model holds besides the free-free block.
enum {
    TINY_SUPPORTS = 1,  // as --blocks all
    TINY_DETAIL = 2,    // a displaced subdivision surface, one step finer
    TINY_LATTICE = 4,   // a lattice, some of whose regions are irregular
    TINY_NO_GREENS = 8, // no domains, blocks and gravity: with TINY_LATTICE alone
};

// ---- A lattice: 2 x 2 x 2 unit cells about the octahedron, and one cell beside them ----

#define TINY_CELLS 9

typedef struct tiny_lattice {
    int32_t cells[TINY_CELLS][3], particles[8 * TINY_CELLS][3];
    int32_t particle_count;
    pliant_regions *regions;  // w = 1: the lone cell's particles are in windows, but not in regions
} tiny_lattice;

static inline void tiny_lattice_make(tiny_lattice *t)
{
    int32_t cell = 0;
    for (int32_t i = 0; i < 8; i++) {
        if (i == 2) memcpy(t->cells[cell++], (int32_t[3]){3, 0, 0}, sizeof t->cells[0]);
        memcpy(t->cells[cell++], (int32_t[3]){i & 1, i >> 1 & 1, i >> 2}, sizeof t->cells[0]);
    }
    t->particle_count = pliant_lattice_particles(TINY_CELLS, t->cells[0], t->particles[0]);
    const pliant_lattice_shape shape = {{5, 3, 3}, t->particle_count, TINY_CELLS, t->particles[0], t->cells[0]};
    pliant_error err;
    if (pliant_regions_create(&shape, 1, &t->regions, &err) < 0) abort();
}

static inline pliant_lattice_layout tiny_lattice_layout(const tiny_lattice *t, int32_t face_count)
{
    return (pliant_lattice_layout){.cell_count = TINY_CELLS,
                                   .particle_count = t->particle_count,
                                   .half_width = 1,
                                   .region_node_count = t->regions->region_node_count,
                                   .plate_node_count = t->regions->plate_node_count,
                                   .batch_count = face_count < 4 ? 1 : 2,
                                   .batch_point_count = (face_count < 4 ? 1 : 2) * 27};
}

static inline void tiny_copy(tiny_file *file, const char *path, const void *data)
{
    tiny_section *s = tiny_find(file, path);
    if (s->bytes > 0) memcpy(s->data, data, s->bytes);
}

static inline void tiny_lattice_fill(const tiny_lattice *t, const tiny_mesh *mesh, tiny_file *file)
{
    const pliant_regions *r = t->regions;
    const double frame[8] = {-1, -1, -1, 1, 8};
    const int32_t summary[8] = {1, 0, 2, r->region_count};
    tiny_copy(file, "/lattice/frame", frame);
    tiny_copy(file, "/lattice/summary", summary);
    tiny_copy(file, "/lattice/cells", t->cells);
    tiny_copy(file, "/lattice/particles", t->particles);
    float *mass = tiny_find(file, "/lattice/mass")->data;
    for (int32_t p = 0; p < t->particle_count; p++) mass[p] = 8.f / (float)t->particle_count;
    tiny_copy(file, "/lattice/region_size", r->size);
    tiny_copy(file, "/lattice/region_share", r->share);
    tiny_copy(file, "/lattice/region_nodes", r->region_nodes);
    tiny_copy(file, "/lattice/plate_nodes", r->plate_nodes);
    int32_t *cell = tiny_find(file, "/lattice/vertex_cell")->data;
    float *offset = tiny_find(file, "/lattice/vertex_offset")->data;
    float *tangents = tiny_find(file, "/lattice/vertex_tangents")->data;
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const double *x = mesh->vertices[v];
        const int32_t corner = (x[0] > 0) + 2 * (x[1] > 0) + 4 * (x[2] > 0);
        cell[v] = corner < 2 ? corner : corner + 1;
        for (int d = 0; d < 3; d++) offset[3 * v + d] = (float)(x[d] > 0 ? x[d] : x[d] + 1);
        // Two directions across the one to the vertex.
        const double flat = hypot(x[0], x[1]), length = hypot(flat, x[2]);
        const double u[3] = {flat > 0 ? -x[1] / flat : 1, flat > 0 ? x[0] / flat : 0, 0};
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            tangents[6 * v + d] = (float)u[d];
            tangents[6 * v + 3 + d] = (float)((x[e] * u[f] - x[f] * u[e]) / length);
        }
    }
    // Half of the faces a batch, the last ones first; every batch has the block's particles.
    const int32_t batches = mesh->face_count < 4 ? 1 : 2;
    int32_t *face_offset = tiny_find(file, "/lattice/batch_face_offset")->data;
    int32_t *point_offset = tiny_find(file, "/lattice/batch_point_offset")->data;
    int32_t *points = tiny_find(file, "/lattice/batch_points")->data;
    for (int32_t f = 0; f < mesh->face_count; f++)
        ((int32_t *)tiny_find(file, "/lattice/batch_faces")->data)[f] = mesh->face_count - 1 - f;
    for (int32_t b = 0; b < batches; b++) {
        face_offset[b + 1] = mesh->face_count * (b + 1) / batches;
        point_offset[b + 1] = point_offset[b];
        for (int32_t p = 0; p < t->particle_count; p++)
            if (t->particles[p][0] < 3) points[point_offset[b + 1]++] = p;
    }
}

// The sections of a model. Free it with tiny_free.
static inline void tiny_model_make(int32_t level_count, int parts, tiny_file *file)
{
    const int supports = parts & TINY_SUPPORTS, detail = (parts & TINY_DETAIL) != 0;
    const int has_greens = !(parts & TINY_NO_GREENS);
    const tiny_mesh mesh = tiny_mesh_make(level_count);
    int32_t nodes[2][TINY_VERTICES], offset[2][TINY_LEVELS + 1], count[2];
    for (int fixed = 0; fixed < 2; fixed++) count[fixed] = tiny_domain(&mesh, fixed, nodes[fixed], offset[fixed]);
    const int32_t finest = level_count - 1;
    pliant_model_layout layout = {
        .vertex_count = mesh.vertex_count,
        .face_count = mesh.face_count,
        .level_count = mesh.level_count,
        .base_count = mesh.level_vertex_count[0],
        .has_greens = has_greens,
        .free_count = count[0],
        .fixed_count = count[1],
        .text_bytes = sizeof tiny_provenance - 1 + 5,
        .has_supports = supports,
        .level_mask = 1u << finest,
    };
    tiny_lattice lattice = {.regions = NULL};
    if (parts & TINY_LATTICE) {
        tiny_lattice_make(&lattice);
        layout.lattice = tiny_lattice_layout(&lattice, mesh.face_count);
    }
    const int32_t detail_levels[2] = {mesh.vertex_count, mesh.vertex_count + mesh.face_count / 2 * 3};
    if (detail) {
        layout.detail_steps = 1;
        layout.detail_vertex_count = detail_levels[1];
    }
    layout.free_columns[finest] = count[0];
    layout.fixed_columns[finest] = count[1];
    for (int block = 0; block < PLIANT_BLOCK_COUNT; block++)
        for (int32_t c = 0; c < count[block & 1]; c++)
            for (int32_t r = 0; r < count[block >> 1]; r++) layout.nnz[block][finest] += (uint64_t)tiny_keeps(r, c);

    pliant_section_def defs[PLIANT_SECTION_LIMIT];
    int32_t section_count;
    pliant_error err;
    if (pliant_model_layout_sections(&layout, defs, &section_count, &err) < 0) abort();
    tiny_take(file, defs, section_count);

    memcpy(tiny_find(file, "/mesh/vertices")->data, mesh.vertices, tiny_find(file, "/mesh/vertices")->bytes);
    memcpy(tiny_find(file, "/mesh/faces")->data, mesh.faces, tiny_find(file, "/mesh/faces")->bytes);
    memcpy(tiny_find(file, "/mesh/level_count")->data, mesh.level_vertex_count, tiny_find(file, "/mesh/level_count")->bytes);
    memcpy(tiny_find(file, "/mesh/parents")->data, mesh.parents, tiny_find(file, "/mesh/parents")->bytes);
    for (int32_t v = 0; v < mesh.vertex_count; v++)
        ((int32_t *)tiny_find(file, "/mesh/source_index")->data)[v] = v < 6 ? 5 - v : -1;
    const double material[3] = {1000, 0.3, 1};
    memcpy(tiny_find(file, "/material")->data, material, sizeof material);
    tiny_section *text = tiny_find(file, "/provenance/text");
    memset(text->data, '\n', text->bytes);
    memcpy(text->data, tiny_provenance, sizeof tiny_provenance - 1);
    if (detail) {
        memcpy(tiny_find(file, "/detail/level_count")->data, detail_levels, sizeof detail_levels);
        tiny_fill_floats(tiny_find(file, "/detail/offset"), 3);
        for (int32_t v = 0; v < detail_levels[1]; v++)
            ((int32_t *)tiny_find(file, "/detail/source_index")->data)[v] = v < 6 ? 5 - v : -1;
    }
    if (parts & TINY_LATTICE) tiny_lattice_fill(&lattice, &mesh, file);
    pliant_regions_destroy(lattice.regions);
    if (!has_greens) return;
    memcpy(tiny_find(file, "/domains/free/nodes")->data, nodes[0], sizeof(int32_t) * (size_t)count[0]);
    memcpy(tiny_find(file, "/domains/fixed/nodes")->data, nodes[1], sizeof(int32_t) * (size_t)count[1]);
    memcpy(tiny_find(file, "/domains/free/level_offset")->data, offset[0], sizeof(int32_t) * (size_t)(level_count + 1));
    memcpy(tiny_find(file, "/domains/fixed/level_offset")->data, offset[1], sizeof(int32_t) * (size_t)(level_count + 1));
    tiny_fill_floats(tiny_find(file, "/body/gravity/free"), 1);
    if (supports) tiny_fill_floats(tiny_find(file, "/body/gravity/fixed"), 2);

    for (int block = 0; block < (supports ? PLIANT_BLOCK_COUNT : 1); block++) {
        char path[PLIANT_PATH_LIMIT];
        const double summary[PLIANT_SUMMARY_COUNT] = {0.05, 1, 1, 0, 0.015, 0.04, 3.0, 0};
        pliant_section_level_path((pliant_block_name)block, finest, "column_offset", path);
        uint64_t *column_offset = tiny_find(file, path)->data, at = 0;
        pliant_section_level_path((pliant_block_name)block, finest, "row", path);
        int32_t *row = tiny_find(file, path)->data;
        for (int32_t c = 0; c < count[block & 1]; c++) {
            column_offset[c] = at;
            for (int32_t r = 0; r < count[block >> 1]; r++)
                if (tiny_keeps(r, c)) row[at++] = r;
        }
        column_offset[count[block & 1]] = at;
        pliant_section_level_path((pliant_block_name)block, finest, "block", path);
        tiny_fill_floats(tiny_find(file, path), 10 + block);
        pliant_section_level_path((pliant_block_name)block, finest, "summary", path);
        memcpy(tiny_find(file, path)->data, summary, sizeof summary);
    }
}

// The sections of a dense file with nodes 0..2 and 4 free, 3 and 5 fixed.
static inline void tiny_dense_make(int supports, tiny_file *file)
{
    const int32_t nodes[] = {0, 1, 2, 4}, fixed[] = {3, 5};
    pliant_section_def defs[PLIANT_SECTION_LIMIT];
    int32_t section_count;
    pliant_error err;
    if (pliant_dense_layout_sections(4, supports ? 2 : -1, defs, &section_count, &err) < 0) abort();
    tiny_take(file, defs, section_count);
    for (int32_t i = 0; i < section_count; i++)
        if (file->sections[i].def.type == PLIANT_F8) tiny_fill_floats(&file->sections[i], i);
    memcpy(tiny_find(file, "/dense/nodes")->data, nodes, sizeof nodes);
    if (supports) memcpy(tiny_find(file, "/dense/fixed-nodes")->data, fixed, sizeof fixed);
}
