// region.h: which vertices are held: expressions on rest coordinates, and lists of vertex numbers.
#pragma once

#include "pliant/mesh.h"

// Evaluate the expression of --fixed for every vertex; see region.c for the grammar. `held` has
// shape [mesh->vertex_count], 1 where the expression is true. Messages give the column.
PLIANT_UNUSED_RESULT pliant_status pliant_region_evaluate(const char *expression,
                                                          const pliant_mesh *mesh, uint8_t *held,
                                                          pliant_error *err);

// Read the list of --fixed-list: white-space separated 0-based vertex numbers, # comments. `held`
// has shape [vertex_count]. Messages give file, line and column.
PLIANT_UNUSED_RESULT pliant_status pliant_region_read(const char *path, int32_t vertex_count,
                                                      uint8_t *held, pliant_error *err);

// Do the held vertices stop every rigid motion of every body (a component and its cavities)? At
// least three that are not on one line. Refuses also when nothing or everything is held.
PLIANT_UNUSED_RESULT pliant_status pliant_region_check(const pliant_mesh *mesh, const uint8_t *held,
                                                       pliant_error *err);
