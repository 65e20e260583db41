// surfaces.h: the small closed surfaces that tests share, and what they do to them.
//
// Every generator fails the test on lack of memory, so that nothing needs checking. Meshes are
// freed by pliant_mesh_destroy, surfaces by check_surface_destroy. Faces look outwards.
//
//     check_surface sphere = check_sphere(3);             // 642 vertices, levels 0..3
//     pliant_hierarchy *h = check_hierarchy(&sphere);
//     double area = sphere.areas[17];
//     pliant_hierarchy_destroy(h);
//     check_surface_destroy(&sphere);
#pragma once

#include "check.h"
#include "pliant/hierarchy.h"
#include "pliant/mesh.h"

// ---- Base meshes, in a box of about [-1, 1]^3 ----

pliant_mesh *check_tetrahedron(void);  // 4 vertices of valence 3
pliant_mesh *check_octahedron(void);   // 6 of valence 4
pliant_mesh *check_icosahedron(void);  // 12 of valence 5, on the unit sphere
pliant_mesh *check_cube(void);         // 8 vertices, 12 faces, valences 4 to 6; corners at +-1
// A torus of rows x columns quads (each at least 3) split alike: all valences 6, genus 1.
pliant_mesh *check_torus(int32_t rows, int32_t columns);
// A brick of unit cubes with `genus` (0, 1, 2, ...) holes through it.
pliant_mesh *check_block(int32_t genus);
// Two meshes side by side as one mesh of two components; both are given (freed here).
pliant_mesh *check_beside(pliant_mesh *first, pliant_mesh *second);

// The v and f lines of an OBJ file (triangles), or NULL when the file cannot be read so.
pliant_mesh *check_load_obj(const char *path);

// ---- Surfaces with levels ----

// A mesh in hierarchy.h's order (vertices coarse to fine, child order of faces) with its levels.
typedef struct check_surface {
    pliant_mesh *mesh;                             // the finest level, n vertices
    int32_t level_count;                           // L + 1
    int32_t vertex_count[PLIANT_LEVEL_LIMIT + 1];  // |K(l)|
    int32_t *parents;                              // shape [n - vertex_count[0]][2], ascending rows
    double *areas;                                 // shape [n], pliant_mesh_vertex_areas
} check_surface;

// The base mesh (given) split at its edges' midpoints `levels` times.
check_surface check_refine(pliant_mesh *base, int32_t levels);
// The icosahedron refined, every vertex on the unit sphere: 10 * 4^levels + 2 vertices.
check_surface check_sphere(int32_t levels);
// The sphere made unsymmetric: radius 1 + 0.25 x + 0.15 y z + 0.1 z^3, then stretched 1.2, 1, 0.8.
check_surface check_blob(int32_t levels);
void check_surface_destroy(check_surface *surface);

// pliant_hierarchy_create on a surface, which must succeed.
pliant_hierarchy *check_hierarchy(const check_surface *surface);

// ---- Changes ----

// Random order of the vertices, the faces, and the first corners of faces. `new_number`, shape
// [vertex_count] or NULL, takes where each old vertex went.
void check_shuffle(pliant_mesh *mesh, check_random *random, int32_t *new_number);
// Try that many edge flips at random, each of which keeps the mesh a closed manifold with all
// valences in [valence_min, valence_max]. Positions stay, so that the surface may fold.
void check_flip_edges(pliant_mesh *mesh, int32_t tries, int32_t valence_min, int32_t valence_max,
                      check_random *random);
// A random whole number of 0 .. count - 1.
int32_t check_random_index(check_random *random, int32_t count);
