// multires_hierarchy.h: the hierarchy of what subdivision or detection made, which must be accepted.
#pragma once

#include "check.h"
#include "mesh/multires.h"

static inline pliant_hierarchy *hierarchy_of(const pliant_multires *m)
{
    pliant_hierarchy *h = NULL;
    pliant_error err;
    check_ok(pliant_hierarchy_create(m->level_count, m->vertex_count, m->mesh->face_count,
                                     m->mesh->faces, m->parents, &h, &err),
             &err);
    return h;
}
