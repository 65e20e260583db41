// props.h: the patches, tools and proxies that a script has put on the body.
//
// All have names of one space and stay until they are dropped. A patch is vertices with prescribed
// displacements that are met to a tolerance; tools are rigid and push; a proxy is a point that a
// device drags. They act on the conditions' solver, which is enlarged for what is declared, and
// made passive for the first tool or proxy; when it is replaced they move over and forget what they
// remembered of earlier steps (levels fading, friction). Declaring allocates; solving does not.
#pragma once

#include "conditions.h"

#include "pliant/script.h"

#define PLIANT_PROP_LIMIT 64  // names of one script
#define PLIANT_TOOL_LIMIT 8   // tools at once

typedef enum pliant_prop_kind {
    PLIANT_PROP_PATCH,
    PLIANT_PROP_TOOL,
    PLIANT_PROP_PROXY,
} pliant_prop_kind;

const char *pliant_prop_kind_name(pliant_prop_kind kind);  // static

typedef struct pliant_prop {
    char name[PLIANT_SCRIPT_NAME_LIMIT];
    pliant_prop_kind kind;
    int is_present;  // 0: dropped; its name and its place in rows stay
    // In the last solve:
    pliant_vec3 force;   // on the body, N
    int32_t node_count;  // nodes that carry it
    double error;  // m; patch: largest |u - target| in its own solve; tool: its deepest vertex;
                   // proxy: its device's depth
} pliant_prop;

typedef struct pliant_props pliant_props;

// The conditions are borrowed until destroy, which comes before theirs.
PLIANT_UNUSED_RESULT pliant_status pliant_props_create(const pliant_model *model,
                                                       pliant_conditions *conditions,
                                                       pliant_props **props, pliant_error *err);
void pliant_props_destroy(pliant_props *props);  // NULL is fine

// In the order of first declaration; borrowed until the next declaration. NULL has none.
const pliant_prop *pliant_props_list(const pliant_props *props, int32_t *count);
int pliant_props_is_empty(const pliant_props *props);  // 1: nothing is present
// The patch that a vertex belongs to; NULL: none.
const pliant_prop *pliant_props_owner(const pliant_props *props, int32_t vertex);

// Refusals say what was expected and found, not where in the script; they have no effect.

// Declare a patch, or give it another tolerance.
PLIANT_UNUSED_RESULT pliant_status pliant_props_set_patch(pliant_props *props, const char *name,
                                                          double tolerance, pliant_error *reason);
PLIANT_UNUSED_RESULT pliant_status pliant_props_displace(pliant_props *props, const char *name,
                                                         int32_t vertex, pliant_vec3 u,
                                                         pliant_error *reason);
// Take a vertex out of a patch; -1: all.
PLIANT_UNUSED_RESULT pliant_status pliant_props_release(pliant_props *props, const char *name,
                                                        int32_t vertex, pliant_error *reason);
// Of all tools; before the first one.
PLIANT_UNUSED_RESULT pliant_status pliant_props_set_tolerance(pliant_props *props, double tolerance,
                                                              pliant_error *reason);
// Declare a tool, or move one to where this is.
PLIANT_UNUSED_RESULT pliant_status pliant_props_set_tool(pliant_props *props, const char *name,
                                                         const pliant_tool *tool,
                                                         pliant_error *reason);
// Stiffness and friction 0: the library's defaults.
PLIANT_UNUSED_RESULT pliant_status pliant_props_set_proxy(pliant_props *props, const char *name,
                                                          const double position[3],
                                                          double stiffness, double friction,
                                                          pliant_error *reason);
// A tool so that its point (centre, point of the plane, first end) is there, or a proxy's device.
PLIANT_UNUSED_RESULT pliant_status pliant_props_move(pliant_props *props, const char *name,
                                                     const double position[3],
                                                     pliant_error *reason);
PLIANT_UNUSED_RESULT pliant_status pliant_props_drop(pliant_props *props, const char *name,
                                                     pliant_error *reason);
void pliant_props_drop_all(pliant_props *props);

// What a solve of everything did beyond the solver's own report of its last solve.
typedef struct pliant_props_report {
    int is_late;           // 1: something was resolved coarser than stated
    int32_t finest_level;  // of nodes that tools push; -1: none
    pliant_vec3 force;  // of all props on the body, but for patches' nodes, which the solver counts
} pliant_props_report;

// A vertex where a prop acts, for drawing: a patch's with its prescribed displacement, a tool's
// node or the nearest vertex to a proxy's contact with the force there.
typedef struct pliant_prop_mark {
    int32_t vertex;
    pliant_vec3 direction;  // m or N
} pliant_prop_mark;
// The first `capacity` to marks[capacity]; returns how many there are. marks may be NULL when
// capacity is 0.
int32_t pliant_props_marks(const pliant_props *props, pliant_prop_mark *marks, int32_t capacity);

// In place of pliant_solver_solve: solve for the conditions and for everything present, once in the
// order patches, tools, proxies.
PLIANT_UNUSED_RESULT pliant_status pliant_props_solve(pliant_props *props, int64_t deadline,
                                                      pliant_props_report *report);
