// condition_statement.c: executes the statements of a script about conditions of single vertices.
#include "condition_statement.h"

#include "address.h"

#include "pliant/error.h"

#include <math.h>

// Put a status that the solver gave into words.
static pliant_status explain(const pliant_model *model, const pliant_statement *statement,
                             pliant_node node, pliant_status status, pliant_error *reason)
{
    const char *verb = pliant_statement_keyword(statement->kind, PLIANT_SHAPE_NONE);
    switch (status) {
    case PLIANT_ERR_MISSING:
        if (statement->kind == PLIANT_STATEMENT_GRAVITY)
            return pliant_error_set(reason, status,
                                    "gravity needs /body/gravity, which the model does not have");
        if (!pliant_address_is_stored(model, node.level, reason)) return status;
        return pliant_error_set(reason, status,
                                "%s at the fixed vertex %d needs a model precomputed with --blocks "
                                "all",
                                verb, (int)node.vertex);
    case PLIANT_ERR_CAPACITY:
        return pliant_error_set(reason, status,
                                "%s: no more nodes can be changed than the model's %d", verb,
                                (int)pliant_model_describe(model).vertex_count);
    case PLIANT_ERR_MEMORY:
        return pliant_error_set(reason, status, "%s: no memory for one more changed node", verb);
    default:
        return pliant_error_set(reason, status, "%s refused for vertex %d: %s", verb,
                                (int)node.vertex, pliant_status_name(status));
    }
}

// The statement's vector times `scale`, in single precision.
static pliant_status value_of(const pliant_statement *statement, double scale, pliant_vec3 *value,
                              pliant_error *reason)
{
    float v[3];
    for (int c = 0; c < 3; c++) {
        v[c] = (float)(statement->value[c] * scale);
        if (!isfinite(v[c]))
            return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "%g is beyond single precision",
                                    statement->value[c] * scale);
    }
    *value = (pliant_vec3){v[0], v[1], v[2]};
    return PLIANT_OK;
}

static pliant_status execute_condition(pliant_conditions *conditions, const pliant_props *props,
                                       const pliant_model *model, const pliant_statement *statement,
                                       pliant_error *reason)
{
    pliant_condition condition = {.kind = PLIANT_CONDITION_PRESSED};
    pliant_status status = pliant_address_resolve(model, &statement->vertex, PLIANT_ADDRESS_NODE,
                                                  &condition.node, reason);
    if (status < 0) return status;
    const int32_t vertex = condition.node.vertex;
    const pliant_prop *owner = pliant_props_owner(props, vertex);
    if (owner)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "vertex %d belongs to patch %s: \"patch %s release %d\" first",
                                (int)vertex, owner->name, owner->name, (int)vertex);
    const int is_free = pliant_model_is_free(model, vertex) == 1;
    double scale = 1;
    switch (statement->kind) {
    case PLIANT_STATEMENT_DISPLACE:
        if (!is_free)
            return pliant_error_set(
                reason, PLIANT_ERR_ARGUMENT,
                "vertex %d is fixed: displace needs a free one (support moves it)", (int)vertex);
        condition.kind = PLIANT_CONDITION_DISPLACED;
        break;
    case PLIANT_STATEMENT_SUPPORT:
        if (is_free)
            return pliant_error_set(
                reason, PLIANT_ERR_ARGUMENT,
                "vertex %d is free: support needs a fixed one (displace moves it)", (int)vertex);
        condition.kind = PLIANT_CONDITION_SUPPORTED;
        break;
    case PLIANT_STATEMENT_FORCE: {
        // f = a p (GF-4), a the area of the hat. No columns, no area: the solver refuses.
        const double area = pliant_model_node_area(model, condition.node);
        if (area > 0) scale = 1 / area;
        break;
    }
    default:
        break;
    }
    status = value_of(statement, scale, &condition.value, reason);
    if (status < 0) return status;
    status = pliant_conditions_set(conditions, &condition);
    return status < 0 ? explain(model, statement, condition.node, status, reason) : PLIANT_OK;
}

static pliant_status execute_gravity(pliant_conditions *conditions, const pliant_model *model,
                                     const pliant_statement *statement, pliant_error *reason)
{
    pliant_vec3 g;
    pliant_status status = value_of(statement, 1, &g, reason);
    if (status < 0) return status;
    status = pliant_conditions_set_gravity(conditions, g);
    const pliant_node none = {pliant_model_describe(model).level_count - 1, 0};
    return status < 0 ? explain(model, statement, none, status, reason) : PLIANT_OK;
}

static pliant_status execute_release(pliant_conditions *conditions, pliant_props *props,
                                     const pliant_model *model, const pliant_statement *statement,
                                     pliant_error *reason)
{
    if (statement->vertex.kind == PLIANT_VERTEX_ALL) {
        pliant_props_drop_all(props);
        pliant_conditions_drop_all(conditions);
        return PLIANT_OK;
    }
    pliant_node node;
    pliant_status status =
        pliant_address_resolve(model, &statement->vertex, PLIANT_ADDRESS_NODE, &node, reason);
    if (status < 0) return status;
    status = pliant_conditions_drop(conditions, node.vertex);
    return status < 0 ? explain(model, statement, node, status, reason) : PLIANT_OK;
}

pliant_status pliant_condition_statement_execute(pliant_conditions *conditions, pliant_props *props,
                                                 const pliant_model *model,
                                                 const pliant_statement *statement,
                                                 pliant_error *reason)
{
    switch (statement->kind) {
    case PLIANT_STATEMENT_GRAVITY:
        return execute_gravity(conditions, model, statement, reason);
    case PLIANT_STATEMENT_RELEASE:
        return execute_release(conditions, props, model, statement, reason);
    default:
        return execute_condition(conditions, props, model, statement, reason);
    }
}
