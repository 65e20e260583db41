// vtk_series.h: write a deforming surface as a series of VTK files that ParaView opens.
//
// FOLDER/pliant.pvd lists one FOLDER/pliant_00000001.vtp per step: PolyData with the deformed
// points, the triangles (without any: the points themselves), and the point data `displacement`
// and, where they are given, `traction`, `normal` and `instance`, as single precision and 32-bit
// integers in base64 (valid XML, any ParaView or VTK since 5.0). The files are made in
// FOLDER/pliant.tmp and moved to their place by commit, so a series that stood there before stays
// whole until then. A folder may hold several series of ours, told apart by what they show. After
// create only remesh allocates.
#pragma once

#include "pliant/base.h"

typedef enum pliant_vtk_overwrite {
    PLIANT_VTK_OWN,      // only what an earlier series of ours left
    PLIANT_VTK_FOREIGN,  // also into a folder with other VTK files, which stay
} pliant_vtk_overwrite;

typedef enum pliant_vtk_content {
    PLIANT_VTK_SURFACE,    // pliant.pvd, pliant_00000001.vtp, ...
    PLIANT_VTK_PARTICLES,  // pliant_particles.pvd, ...
    PLIANT_VTK_OBSTACLES,  // pliant_obstacles.pvd, ...
    PLIANT_VTK_CONTENT_COUNT
} pliant_vtk_content;

// What is drawn.
typedef struct pliant_vtk_mesh {
    int32_t vertex_count, face_count;
    const double *positions;  // rest positions, shape [vertex_count][3], m; borrowed until the end
    const int32_t *faces;     // shape [face_count][3]; read during the call only
    const int32_t *instance;  // shape [vertex_count], borrowed until the end; NULL: not written
} pliant_vtk_mesh;

typedef struct pliant_vtk_series_def {
    const char *folder;  // made when absent; its parent must be there
    pliant_vtk_overwrite overwrite;
    pliant_vtk_content content;
    pliant_vtk_mesh mesh;
} pliant_vtk_series_def;

typedef struct pliant_vtk_series pliant_vtk_series;

// Messages begin with the folder's or file's name.
PLIANT_UNUSED_RESULT pliant_status pliant_vtk_series_create(const pliant_vtk_series_def *def,
                                                            pliant_vtk_series **series,
                                                            pliant_error *err);
// Draw another mesh from the next step on. On refusal the series can only be abandoned.
PLIANT_UNUSED_RESULT pliant_status pliant_vtk_series_remesh(pliant_vtk_series *series,
                                                            const pliant_vtk_mesh *mesh,
                                                            pliant_error *err);
// Write the next step: displacement [vertex_count], m; traction [vertex_count], N/m^2, or NULL;
// unit normals [vertex_count], or NULL.
PLIANT_UNUSED_RESULT pliant_status pliant_vtk_series_add(pliant_vtk_series *series, double time,
                                                         const pliant_vec3 *displacement,
                                                         const pliant_vec3 *traction,
                                                         const pliant_vec3 *normals,
                                                         pliant_error *err);
// Replace our earlier series by this one. A surface replaces all that we left, so it goes first.
// Ends the series' life whatever it returns.
PLIANT_UNUSED_RESULT pliant_status pliant_vtk_series_commit(pliant_vtk_series *series,
                                                            pliant_error *err);
// End without a series: remove what was written. NULL is fine. Not after commit.
void pliant_vtk_series_abandon(pliant_vtk_series *series);
