// address.h: which node of a model a script's words for a vertex mean.
#pragma once

#include "pliant/pliant.h"
#include "pliant/script.h"

typedef enum pliant_address_use {
    PLIANT_ADDRESS_NODE,  // for a constraint or load: without a level, on the finest that the file
                          // has columns of
    PLIANT_ADDRESS_VERTEX,  // to look at: without a level, any vertex of the model
} pliant_address_use;

// Refusals name the vertex, what was expected and what was found; not where in the script. Whether
// the file has columns of the node's level is the solver's to say.
PLIANT_UNUSED_RESULT pliant_status pliant_address_resolve(const pliant_model *model,
                                                          const pliant_vertex_name *name,
                                                          pliant_address_use use, pliant_node *node,
                                                          pliant_error *reason);
// 1: the file has columns of this level. When it has not, `reason`, which may be NULL, says which
// it has.
int pliant_address_is_stored(const pliant_model *model, int32_t level, pliant_error *reason);
