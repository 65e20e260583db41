// synthetic_lattice.h: lattices of any cells with an embedded surface, for tests that need a file.
//
//     check_write_lattice(path, CHECK_CELLS_COMB, 5, 2);  // a file with that lattice alone, w = 2
//
// or, in steps,
//
//     check_lattice *l = check_lattice_create(&(check_lattice_def){
//         .shape = CHECK_CELLS_BALL, .size = 8, .half_width = 1, .cell_size = 0.1});
//     check_lattice_write(l, path);
//     check_lattice_destroy(l);
//
// Every function fails the running test when something refuses. 57,000 particles take half a
// second.
#pragma once

#include "cell_shapes.h"
#include "check.h"
#include "pliant/mesh.h"
#include "pliant/regions.h"
#include "pliant/sections.h"
#include "pliant/writer.h"

typedef struct check_lattice_def {
    // The cells: a shape of cell_shapes.h, or, if `cells` is not NULL, these, shape
    // [cell_count][3], ascending by (z, y, x).
    check_cells shape;
    int32_t size;
    int32_t cell_count;
    const int32_t *cells;
    int32_t half_width;  // 1 .. 15
    double cell_size;    // m; 0: 1
    double origin[3];    // m
    double mass;         // kg, of all; a particle has an eighth of each of its cells. 0: 1 per cell
    int32_t is_shell;    // only noted in the file
    // What is embedded: the cells' own surface (cell_surface.h), or this mesh (borrowed), positions
    // in m, each in a cell.
    const pliant_mesh *mesh;
    double inset;  // of the cells' own surface, in cells; 0: 1/8
} check_lattice_def;

typedef struct check_lattice {
    pliant_lattice_layout layout;
    double frame[PLIANT_LATTICE_FRAME_COUNT];
    int32_t summary[PLIANT_LATTICE_SUMMARY_COUNT];
    pliant_lattice_shape shape;  // its arrays are the next two
    int32_t *cells, *particles;
    float *mass;
    pliant_regions *regions;
    pliant_mesh *mesh;  // n vertices, m
    int32_t *vertex_cell;
    float *vertex_offset, *vertex_tangents;  // [n][3], [n][2][3]
    int32_t *batch_face_offset, *batch_faces, *batch_point_offset, *batch_points;
} check_lattice;

check_lattice *check_lattice_create(const check_lattice_def *def);
void check_lattice_destroy(check_lattice *lattice);  // NULL is fine

// A whole file with the lattice and its mesh (one level), without Green's functions.
void check_lattice_write(const check_lattice *lattice, const char *path);
// The /lattice sections alone, into a file whose layout has `lattice->layout` and whose finest mesh
// is the lattice's.
void check_lattice_write_sections(const check_lattice *lattice, pliant_writer *writer);

// Create, write, destroy.
void check_write_lattice(const char *path, check_cells shape, int32_t size, int32_t half_width);

// The cells that a ball about the origin reaches into, `across` of them along its diameter 2;
// `origin` and the cell size 2 / across go with them. To be freed.
int32_t *check_ball_cells(int32_t across, int32_t *cell_count, double origin[3]);
