// components.h: the connected components of a surface, and which of them lie inside others.
//
// A component inside an odd number of others is a cavity: it belongs to the body around it.
#pragma once

#include "pliant/mesh.h"

typedef struct pliant_components {
    int32_t count;
    int32_t *of_vertex;    // shape [vertex_count]; -1 where no face uses the vertex
    int32_t *first_vertex; // shape [count], the smallest number; components ascend by it
    int32_t *face_start;   // shape [count + 1] into faces
    int32_t *faces;        // shape [face_count], grouped by component
    double *volume;        // shape [count], signed: positive where the faces look outwards
    double *area;          // shape [count]
    double (*box)[6];      // shape [count]: smallest x, y, z, largest x, y, z
    int32_t *outer;        // shape [count]: the component directly around, or -1
    int32_t *depth;        // shape [count]: how many components lie around
} pliant_components;

// Nested components are told apart up to this many; surfaces of more are no solids anybody meant.
enum { PLIANT_COMPONENT_LIMIT = 1024 };

// Find the components and their nesting. `mesh` has valid vertex numbers and closed components;
// `name` is for messages. Refuses more than PLIANT_COMPONENT_LIMIT, and components that are seen to
// cross: vertices of one inside another, others outside. That sees what overlaps deeply enough to
// have a vertex inside (of up to some thousand vertices looked at), not every self-intersection.
PLIANT_UNUSED_RESULT pliant_status pliant_components_create(const pliant_mesh *mesh,
                                                            const char *name,
                                                            pliant_components **components,
                                                            pliant_error *err);
void pliant_components_destroy(pliant_components *components); // NULL is fine
