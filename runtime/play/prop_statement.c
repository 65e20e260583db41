// prop_statement.c: executes the statements of a script about patches, tools and proxies.
#include "prop_statement.h"

#include "address.h"

#include "pliant/error.h"

#include <math.h>

// In single precision, in which the library takes what it is told.
static pliant_status narrow(double value, float *narrowed, pliant_error *reason)
{
    *narrowed = (float)value;
    if (isfinite(*narrowed)) return PLIANT_OK;
    return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "%g is beyond single precision", value);
}

static pliant_status narrow_vector(const double *value, pliant_vec3 *narrowed, pliant_error *reason)
{
    pliant_status status = narrow(value[0], &narrowed->x, reason);
    if (status >= 0) status = narrow(value[1], &narrowed->y, reason);
    if (status >= 0) status = narrow(value[2], &narrowed->z, reason);
    return status;
}

// ---- Patches ----

static pliant_status execute_patch_displace(pliant_props *props, const pliant_model *model,
                                            const pliant_statement *statement, pliant_error *reason)
{
    pliant_node node;
    pliant_vec3 u;
    pliant_status status =
        pliant_address_resolve(model, &statement->vertex, PLIANT_ADDRESS_VERTEX, &node, reason);
    if (status >= 0) status = narrow_vector(statement->value, &u, reason);
    if (status < 0) return status;
    return pliant_props_displace(props, statement->name, node.vertex, u, reason);
}

static pliant_status execute_patch_release(pliant_props *props, const pliant_model *model,
                                           const pliant_statement *statement, pliant_error *reason)
{
    pliant_node node = {0, -1};
    pliant_status status = PLIANT_OK;
    if (statement->vertex.kind != PLIANT_VERTEX_ALL)
        status =
            pliant_address_resolve(model, &statement->vertex, PLIANT_ADDRESS_VERTEX, &node, reason);
    return status < 0 ? status : pliant_props_release(props, statement->name, node.vertex, reason);
}

// ---- Tools ----

// A script gives a plane by its normal n and distance D: the points with n.x = D, of which n D /
// |n|^2 is the nearest to the origin. hypot, so that no length of n is too long or too short.
static void place_plane(const pliant_statement *statement, double *point, double *normal)
{
    const double *n = statement->value;
    const double length = hypot(hypot(n[0], n[1]), n[2]);
    for (int c = 0; c < 3; c++) {
        normal[c] = n[c] / length;
        point[c] = normal[c] * (statement->scalar / length);
    }
}

static pliant_status execute_tool(pliant_props *props, const pliant_statement *statement,
                                  pliant_error *reason)
{
    pliant_tool tool = {.kind = PLIANT_TOOL_NONE};
    const double *a = statement->value, *b = statement->end;
    double point[3], normal[3], radius = statement->scalar;
    switch (statement->shape) {
    case PLIANT_SHAPE_SPHERE:
        tool.kind = PLIANT_TOOL_SPHERE;
        break;
    case PLIANT_SHAPE_PLANE:
        tool.kind = PLIANT_TOOL_PLANE;
        place_plane(statement, point, normal);
        a = point;
        b = normal;
        radius = 0;
        break;
    case PLIANT_SHAPE_CAPSULE:
        tool.kind = PLIANT_TOOL_CAPSULE;
        break;
    case PLIANT_SHAPE_BOX:  // no tool, says the parser
    case PLIANT_SHAPE_NONE:
        break;
    }
    pliant_status status = narrow_vector(a, &tool.a, reason);
    if (status >= 0) status = narrow_vector(b, &tool.b, reason);
    if (status >= 0) status = narrow(radius, &tool.radius, reason);
    if (status >= 0) status = narrow(statement->friction, &tool.friction, reason);
    if (status < 0) return status;
    return pliant_props_set_tool(props, statement->name, &tool, reason);
}

// ---- All ----

pliant_status pliant_prop_statement_execute(pliant_props *props, const pliant_model *model,
                                            const pliant_statement *statement, pliant_error *reason)
{
    switch (statement->kind) {
    case PLIANT_STATEMENT_PATCH:
        return pliant_props_set_patch(props, statement->name, statement->scalar, reason);
    case PLIANT_STATEMENT_PATCH_DISPLACE:
        return execute_patch_displace(props, model, statement, reason);
    case PLIANT_STATEMENT_PATCH_RELEASE:
        return execute_patch_release(props, model, statement, reason);
    case PLIANT_STATEMENT_CONTACT:
        return pliant_props_set_tolerance(props, statement->scalar, reason);
    case PLIANT_STATEMENT_TOOL:
        return execute_tool(props, statement, reason);
    case PLIANT_STATEMENT_PROXY:
        return pliant_props_set_proxy(props, statement->name, statement->value,
                                      statement->stiffness, statement->friction, reason);
    case PLIANT_STATEMENT_MOVE:
        if (statement->count > 0)
            return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                    "move %s over %lld steps: only what acts on a lattice moves "
                                    "over steps",
                                    statement->name, (long long)statement->count);
        return pliant_props_move(props, statement->name, statement->value, reason);
    case PLIANT_STATEMENT_DROP:
        return pliant_props_drop(props, statement->name, reason);
    default:
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "unknown statement");
    }
}
