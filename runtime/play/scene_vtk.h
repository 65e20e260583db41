// scene_vtk.h: what --vtk writes of a lattice: the surfaces, and beside them obstacles and
// particles.
#pragma once

#include "player.h"

#include "pliant/vtk_series.h"

typedef enum pliant_scene_vtk_particles {
    PLIANT_SCENE_VTK_SURFACES,   // surfaces and obstacles
    PLIANT_SCENE_VTK_PARTICLES,  // the lattices' particles as well
} pliant_scene_vtk_particles;

typedef struct pliant_scene_vtk pliant_scene_vtk;

// Take over `surface`, an open series without steps, whatever this returns. The player must have a
// scene that is prepared, and outlive this.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_vtk_create(
    const pliant_model *model, const pliant_player *player, pliant_vtk_series *surface,
    const char *folder, pliant_vtk_overwrite overwrite, pliant_scene_vtk_particles particles,
    pliant_scene_vtk **vtk, pliant_error *err);
PLIANT_UNUSED_RESULT pliant_status pliant_scene_vtk_add(pliant_scene_vtk *vtk, double time,
                                                        pliant_error *err);
// Ends its life whatever it returns.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_vtk_commit(pliant_scene_vtk *vtk,
                                                           pliant_error *err);
void pliant_scene_vtk_abandon(pliant_scene_vtk *vtk);  // NULL is fine; not after commit
