// cell_surface.h: the surface of a set of lattice cells as a closed triangle mesh.
//
// The cells' outer sides, each split into four triangles about its middle. Where cells touch along
// an edge or at a corner only, the surface passes between them: the same place then has several
// vertices, and the mesh is a manifold whatever the cells are. Vertices are drawn inwards a little,
// so that they lie in their cells rather than on particles.
//
//     check_cell_surface s = check_cell_surface_create(count, cells, 0.125);
//     ... s.mesh->vertices, s.cell[v], s.mesh->faces ...
//     check_cell_surface_destroy(&s);
#pragma once

#include "check.h"
#include "pliant/mesh.h"

typedef struct check_cell_surface {
    pliant_mesh *mesh;  // in units of the cell size; faces look outwards
    int32_t *cell;      // shape [vertex_count], the cell that holds the vertex
} check_cell_surface;

// `cells` has shape [cell_count][3], coordinates >= 0, in any order. Inset 0 .. 0.5, exact in
// binary if vertices shall lie in their cells to the last bit.
check_cell_surface check_cell_surface_create(int32_t cell_count, const int32_t *cells,
                                             double inset);
void check_cell_surface_destroy(check_cell_surface *surface);
