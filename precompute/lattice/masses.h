// masses.h: what every particle of a lattice weighs.
//
// Every cell gets a share of the body: of a solid the volume of the mesh in it, of a shell the area
// of the mesh in it; at least an eighth of the mean share, because cells that the surface only
// grazes would leave particles so light that neither single precision nor contact works with them.
// A cell's corners get an eighth of its share each. Shares are scaled to add up to the mesh's
// volume V, so that the whole weighs density * V however coarse the lattice is. (LSM 2 leaves the
// choice open, but that masses may come from the mesh's vertices.)
#pragma once

#include "lattice/voxels.h"

// The mesh's volume in each particle's charge, m^3; `share` has shape [particle_count] and adds up
// to the mesh's volume. `corners` has shape [voxels->cell_count][8]: particle numbers.
PLIANT_UNUSED_RESULT pliant_status pliant_masses_share(const pliant_mesh *mesh,
                                                       const pliant_voxels *voxels,
                                                       const int32_t *corners,
                                                       int32_t particle_count, double *share,
                                                       pliant_error *err);

// mass = share * density, in kg; returns the sum in *total. With `densities` (shape
// [mesh->vertex_count]; NAN: not known there; NULL: `density` everywhere) a particle takes that of
// the nearest vertex that has one. `particles` has shape [particle_count][3], grid coordinates.
// PLIANT_ERR_ARGUMENT: a mass that is no normal float, with the number.
PLIANT_UNUSED_RESULT pliant_status
pliant_masses_weigh(const pliant_mesh *mesh, const pliant_voxel_grid *grid, int32_t particle_count,
                    const int32_t *particles, const double *share, double density,
                    const double *densities, float *mass, double *total, pliant_error *err);

// Read --lattice-mass: white-space separated densities over 0, one a vertex of the input in its
// order, # comments; `densities` has shape [vertex_count]. Messages give file, line and column.
PLIANT_UNUSED_RESULT pliant_status pliant_masses_read(const char *path, int32_t vertex_count,
                                                      double *densities, pliant_error *err);
