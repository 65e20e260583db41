// address.c: which node of a model a script's words for a vertex mean.
#include "address.h"

#include "pliant/error.h"

#include <stdio.h>

static pliant_status check_range(const pliant_model *model, const pliant_vertex_name *name,
                                 pliant_node node, pliant_error *reason)
{
    const pliant_model_info info = pliant_model_describe(model);
    const int32_t count = pliant_model_level_vertex_count(model, node.level);
    if (node.vertex >= 0 && node.vertex < count) return PLIANT_OK;
    char what[64], where[64] = "";
    if (name->kind == PLIANT_VERTEX_SOURCE)
        snprintf(what, sizeof what, "source vertex %d is vertex %d", (int)name->number,
                 (int)node.vertex);
    else snprintf(what, sizeof what, "vertex %d", (int)node.vertex);
    if (name->has_level) snprintf(where, sizeof where, " on level %d", (int)node.level);
    else if (node.level < info.level_count - 1)
        snprintf(where, sizeof where, " on level %d, the finest in the file", (int)node.level);
    return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "%s of %d%s", what, (int)count, where);
}

pliant_status pliant_address_resolve(const pliant_model *model, const pliant_vertex_name *name,
                                     pliant_address_use use, pliant_node *node,
                                     pliant_error *reason)
{
    const pliant_model_info info = pliant_model_describe(model);
    const int32_t finest = info.level_count - 1;
    pliant_node found = {use == PLIANT_ADDRESS_NODE ? info.finest_constraint_level : finest,
                         name->number};
    if (name->has_level) {
        if (name->level < 0 || name->level > finest)
            return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "level %d: expected 0 to %d",
                                    (int)name->level, (int)finest);
        found.level = name->level;
    }
    switch (name->kind) {
    case PLIANT_VERTEX_MODEL:
        break;
    case PLIANT_VERTEX_SOURCE:
        found.vertex = pliant_model_from_source(model, name->number);
        if (found.vertex < 0)
            return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                    "source vertex %d is not in the model", (int)name->number);
        break;
    case PLIANT_VERTEX_NEAR:
        found.vertex = pliant_model_nearest_on(model, found.level, name->position);
        if (found.vertex < 0 && found.level == finest)
            return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "the model has no free vertex");
        if (found.vertex < 0)
            return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "level %d has no free vertex",
                                    (int)found.level);
        break;
    default:
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "expected a vertex");
    }
    const pliant_status status = check_range(model, name, found, reason);
    if (status >= 0) *node = found;
    return status;
}

int pliant_address_is_stored(const pliant_model *model, int32_t level, pliant_error *reason)
{
    const pliant_model_info info = pliant_model_describe(model);
    const int32_t first = info.coarsest_constraint_level, last = info.finest_constraint_level;
    int missing = 0;  // levels between first and last
    for (int32_t l = first; l <= last; l++)
        missing += pliant_model_level(model, l).column_count == 0;
    if (level >= first && level <= last && pliant_model_level(model, level).column_count > 0)
        return 1;
    char has[128];
    int used = 0;
    if (first == last) snprintf(has, sizeof has, "level %d", (int)last);
    else if (missing == 0) snprintf(has, sizeof has, "levels %d to %d", (int)first, (int)last);
    else {
        used = snprintf(has, sizeof has, "levels %d", (int)first);
        for (int32_t l = first + 1; l <= last; l++)
            if (pliant_model_level(model, l).column_count > 0)
                used += snprintf(has + used, sizeof has - (size_t)used, ", %d", (int)l);
    }
    (void)pliant_error_set(reason, PLIANT_ERR_MISSING, "level %d is not in the file: it has %s",
                           (int)level, has);
    return 0;
}
