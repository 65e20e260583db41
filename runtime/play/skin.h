// skin.h: the detailed surface that goes with a player's surface, as displacements from rest.
#pragma once

#include "pliant/pliant.h"

// Arrays are owned; rest, displacement, normals have shape [vertex_count].
typedef struct pliant_skin {
    pliant_detail *detail;
    int32_t vertex_count, face_count;
    const int32_t *faces;  // shape [face_count][3]
    double *rest;          // shape [vertex_count][3], m
    // As pliant_skin_move left them; at rest before.
    pliant_vec3 *displacement, *normals;  // m, unit
} pliant_skin;

// Over control level `level` of the model, which must outlive it.
PLIANT_UNUSED_RESULT pliant_status pliant_skin_create(const pliant_model *model, int32_t level,
                                                      pliant_skin **skin, pliant_error *err);
void pliant_skin_destroy(pliant_skin *skin);  // NULL is fine
// Follow the displacements u of the level's vertices. Allocates nothing.
void pliant_skin_move(pliant_skin *skin, const pliant_vec3 *u);
