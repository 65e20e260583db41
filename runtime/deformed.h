// deformed.h: the deformed surface where somebody touches it: places and normals of chosen
// vertices.
//
// Vertices are asked for, evaluated together (pliant_solver_displacements, whose cost follows their
// number) and remembered until the next solution. The normal of a vertex is the mean of its faces',
// by area, so it takes the vertices around it. A normal map's normals are kept as tilts against
// that mean at rest, in a frame that turns with the surface: a vertex's normal and its first edge.
#pragma once

#include "pliant/arena.h"
#include "pliant/pliant.h"

typedef struct pliant_deformed {
    const pliant_model *model;  // borrowed
    int32_t vertex_count, face_count;
    const double *rest;    // shape [n][3], m; borrowed
    const int32_t *faces;  // of the finest level, shape [face_count][3]; borrowed
    int32_t *twin;         // shape [face_count][3]: the half-edge across (halfedge.h)
    int32_t *first;        // shape [n]: a half-edge that starts at the vertex
    double *tilt;          // shape [n][2]: along the frame's tangents, per unit along its normal
    int32_t is_tilted;     // 0: all tilts are zero

    uint32_t solution;          // counts; what has another number is of an older one
    uint32_t *place_solution;   // shape [n]: that `place` is of
    double *place;              // shape [n][3], m
    uint32_t *normal_solution;  // shape [n]
    double *normal;             // shape [n][3], unit
    int32_t wanted_count;
    int32_t *wanted;          // shape [n]: asked for and not evaluated yet
    pliant_vec3 *values;      // shape [n]
    int32_t evaluated_count;  // since the last begin
} pliant_deformed;

void pliant_deformed_lay_out(pliant_arena *arena, const pliant_model *model,
                             pliant_deformed *deformed);
// After carving. `normals`, shape [n][3], of any length, or NULL, is read now. Refuses with
// PLIANT_ERR_ARGUMENT a normal that is not finite or leans over by more than 84 degrees.
PLIANT_UNUSED_RESULT pliant_status pliant_deformed_fill(pliant_deformed *deformed,
                                                        const float *normals, pliant_error *err);

// Another solution: forget all places.
void pliant_deformed_begin(pliant_deformed *deformed);
// Ask for the corners of a face, or for those and all around them, which is what their normals
// take.
void pliant_deformed_want_face(pliant_deformed *deformed, int32_t face);
void pliant_deformed_want_ring(pliant_deformed *deformed, int32_t face);
// Evaluate what was asked for from the solver's last solution.
void pliant_deformed_evaluate(pliant_deformed *deformed, pliant_solver *solver);

// Places of a face's corners, which have been evaluated.
void pliant_deformed_corners(const pliant_deformed *deformed, int32_t face, double corners[3][3]);
// The (tilted) normal of a vertex, which has been evaluated with all around it; unit.
const double *pliant_deformed_normal(pliant_deformed *deformed, int32_t vertex);
