// partition.h: which rank has which nodes.
#pragma once

#include "fem/tetrahedra.h"

// Deal the nodes with free_nodes[i] != 0 to `parts` parts of about equal size, so that few
// tetrahedra have nodes of two. part[i], shape [node_count], is -1 where that is 0. The same on
// every rank.
PLIANT_UNUSED_RESULT pliant_status pliant_partition_nodes(const pliant_tetrahedra *tetrahedra,
                                                          const uint8_t *free_nodes, int parts,
                                                          int32_t *part, pliant_error *err);
