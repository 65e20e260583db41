// tiny_model.h: a small valid model and dense file as arrays, for the tests of formats and the fuzzer.
//
// An octahedron of radius 1, subdivided without smoothing; vertices with z < -0.4 are fixed. The
// numbers of the blocks mean nothing, the indices are all in order.
#pragma once

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
};

// The sections of a model. Free it with tiny_free.
static inline void tiny_model_make(int32_t level_count, int parts, tiny_file *file)
{
    const int supports = parts & TINY_SUPPORTS, detail = (parts & TINY_DETAIL) != 0;
    const tiny_mesh mesh = tiny_mesh_make(level_count);
    int32_t nodes[2][TINY_VERTICES], offset[2][TINY_LEVELS + 1], count[2];
    for (int fixed = 0; fixed < 2; fixed++) count[fixed] = tiny_domain(&mesh, fixed, nodes[fixed], offset[fixed]);
    const int32_t finest = level_count - 1;
    pliant_model_layout layout = {
        .vertex_count = mesh.vertex_count,
        .face_count = mesh.face_count,
        .level_count = mesh.level_count,
        .base_count = mesh.level_vertex_count[0],
        .free_count = count[0],
        .fixed_count = count[1],
        .text_bytes = sizeof tiny_provenance - 1 + 5,
        .has_supports = supports,
        .level_mask = 1u << finest,
    };
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
    memcpy(tiny_find(file, "/domains/free/nodes")->data, nodes[0], sizeof(int32_t) * (size_t)count[0]);
    memcpy(tiny_find(file, "/domains/fixed/nodes")->data, nodes[1], sizeof(int32_t) * (size_t)count[1]);
    memcpy(tiny_find(file, "/domains/free/level_offset")->data, offset[0], sizeof(int32_t) * (size_t)(level_count + 1));
    memcpy(tiny_find(file, "/domains/fixed/level_offset")->data, offset[1], sizeof(int32_t) * (size_t)(level_count + 1));
    tiny_fill_floats(tiny_find(file, "/body/gravity/free"), 1);
    if (supports) tiny_fill_floats(tiny_find(file, "/body/gravity/fixed"), 2);
    if (detail) {
        memcpy(tiny_find(file, "/detail/level_count")->data, detail_levels, sizeof detail_levels);
        tiny_fill_floats(tiny_find(file, "/detail/offset"), 3);
        for (int32_t v = 0; v < detail_levels[1]; v++)
            ((int32_t *)tiny_find(file, "/detail/source_index")->data)[v] = v < 6 ? 5 - v : -1;
    }
    tiny_section *text = tiny_find(file, "/provenance/text");
    memset(text->data, '\n', text->bytes);
    memcpy(text->data, tiny_provenance, sizeof tiny_provenance - 1);

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
