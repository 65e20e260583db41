// frames.h: the surface of every step in one HDF5 file.
//
//     /displacement f4[steps,vertices,3]   model vertex order, m; of several instances one after
//                                          the other, each from the model's own rest positions
//     /normal       f4[steps,vertices,3]   unit; of lattices
//     /step         u8[steps]              1 is the first
//     /time         f8[steps]              s
//     /solve_us     f8[steps]              microseconds from the state to the surface
//
// The file's datasets have sizes that are known only at the end, so steps go to a nameless spool
// beside it first; that serves scripts from pipes as it does files. The spool needs as much room on
// the disk as the file. PATH appears whole or not at all.
//
// Without HDF5 (PLIANT_WITHOUT_HDF5) open refuses with PLIANT_ERR_MISSING.
#pragma once

#include "player.h"

typedef struct pliant_frames pliant_frames;

PLIANT_UNUSED_RESULT pliant_status pliant_frames_open(const char *path, int32_t vertex_count,
                                                      pliant_frames **frames, pliant_error *err);
// Before the first step: how many vertices there are after all, and that normals are written.
PLIANT_UNUSED_RESULT pliant_status pliant_frames_widen(pliant_frames *frames, int32_t vertex_count,
                                                       pliant_error *err);
// displacement[vertex_count], m; normals[vertex_count], unit, where widened, else not looked at.
PLIANT_UNUSED_RESULT pliant_status pliant_frames_add(pliant_frames *frames,
                                                     const pliant_vec3 *displacement,
                                                     const pliant_vec3 *normals,
                                                     const pliant_step *step, pliant_error *err);
// Ends the frames' life whatever it returns.
PLIANT_UNUSED_RESULT pliant_status pliant_frames_commit(pliant_frames *frames, pliant_error *err);
void pliant_frames_abandon(pliant_frames *frames);  // NULL is fine; not after commit
