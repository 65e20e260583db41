// props.c: the patches, tools and proxies that a script has put on the body.
#include "props.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Room in the solver for what props add to a script's own conditions: a patch's nodes, at most its
// vertices, and at least these, which are more than a tool's 64 nodes (pliant_contact_default).
enum { least_constraints = 64, least_loads = 256 };

// What a prop is besides what can be read of it.
typedef struct detail {
    // Patch: vertices and displacements, to be handed over when they have changed.
    pliant_patch *patch;
    pliant_patch_def patch_def;
    int32_t *vertices;
    pliant_vec3 *u;
    int32_t count, is_changed;
    // Tool: its number in the contact.
    int32_t index;
    pliant_tool tool;
    // Proxy.
    pliant_proxy *proxy;
    pliant_proxy_def proxy_def;
    double position[3];
    pliant_proxy_result result;  // of the last step
} detail;

struct pliant_props {
    const pliant_model *model;
    pliant_conditions *conditions;
    int32_t vertex_count;
    pliant_prop *list;  // [PLIANT_PROP_LIMIT]
    detail *details;    // [PLIANT_PROP_LIMIT]
    int32_t count;

    pliant_contact *contact;             // NULL: no tool yet
    double tolerance;                    // of the contact, 0: its default
    int32_t tool_of[PLIANT_TOOL_LIMIT];  // prop of a tool's number, -1: none
    int32_t present[3];                  // props by kind that are not dropped

    int32_t *owner;      // [n] patch that a vertex belongs to, -1: none
    int32_t *place;      // [n] where in that patch
    pliant_node *nodes;  // [n] scratch
};

// ---- Life ----

static pliant_status move_over(void *context, pliant_solver *solver);

pliant_status pliant_props_create(const pliant_model *model, pliant_conditions *conditions,
                                  pliant_props **props, pliant_error *err)
{
    pliant_props *p = calloc(1, sizeof *p);
    if (!p) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a script's props");
    const int32_t n = pliant_model_describe(model).vertex_count;
    p->model = model;
    p->conditions = conditions;
    p->vertex_count = n;
    p->list = calloc(PLIANT_PROP_LIMIT, sizeof *p->list);
    p->details = calloc(PLIANT_PROP_LIMIT, sizeof *p->details);
    p->owner = malloc((size_t)n * sizeof *p->owner);
    p->place = malloc((size_t)n * sizeof *p->place);
    p->nodes = malloc((size_t)n * sizeof *p->nodes);
    if (!p->list || !p->details || !p->owner || !p->place || !p->nodes) {
        pliant_props_destroy(p);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the props of %d vertices",
                                (int)n);
    }
    for (int32_t v = 0; v < n; v++) p->owner[v] = -1;
    for (int32_t i = 0; i < PLIANT_TOOL_LIMIT; i++) p->tool_of[i] = -1;
    pliant_conditions_follow(conditions, move_over, p);
    *props = p;
    return PLIANT_OK;
}

static void end_detail(detail *d)
{
    pliant_patch_destroy(d->patch);
    pliant_proxy_destroy(d->proxy);
    d->patch = NULL;
    d->proxy = NULL;
}

void pliant_props_destroy(pliant_props *props)
{
    if (!props) return;
    for (int32_t i = 0; props->details && i < props->count; i++) {
        end_detail(&props->details[i]);
        free(props->details[i].vertices);
        free(props->details[i].u);
    }
    pliant_contact_destroy(props->contact);
    pliant_conditions_follow(props->conditions, NULL, NULL);
    free(props->nodes);
    free(props->place);
    free(props->owner);
    free(props->details);
    free(props->list);
    free(props);
}

// ---- A solver's replacement ----

static pliant_status create_contact(const pliant_props *props, pliant_solver *solver,
                                    pliant_contact **contact, pliant_error *reason)
{
    pliant_contact_def def = pliant_contact_default(solver);
    def.tool_capacity = PLIANT_TOOL_LIMIT;
    if (props->tolerance > 0) def.tolerance = props->tolerance;
    pliant_status status = pliant_contact_create(solver, &def, contact, reason);
    for (int32_t i = 0; status >= 0 && i < PLIANT_TOOL_LIMIT; i++)
        if (props->tool_of[i] >= 0)
            status = pliant_contact_set_tool(*contact, i, &props->details[props->tool_of[i]].tool);
    return status;
}

// Make everything anew on the solver that takes over; what there was stays when that fails.
static pliant_status move_over(void *context, pliant_solver *solver)
{
    pliant_props *props = context;
    pliant_contact *contact = NULL;
    pliant_patch *patches[PLIANT_PROP_LIMIT] = {NULL};
    pliant_proxy *proxies[PLIANT_PROP_LIMIT] = {NULL};
    pliant_status status = PLIANT_OK;
    for (int32_t i = 0; status >= 0 && i < props->count; i++) {
        const detail *d = &props->details[i];
        if (d->patch) status = pliant_patch_create(solver, &d->patch_def, &patches[i], NULL);
        else if (d->proxy) status = pliant_proxy_create(solver, &d->proxy_def, &proxies[i], NULL);
    }
    if (status >= 0 && props->contact) status = create_contact(props, solver, &contact, NULL);
    if (status < 0) {
        pliant_contact_destroy(contact);
        for (int32_t i = 0; i < props->count; i++) {
            pliant_patch_destroy(patches[i]);
            pliant_proxy_destroy(proxies[i]);
        }
        return status;
    }
    pliant_contact_destroy(props->contact);
    props->contact = contact;
    for (int32_t i = 0; i < props->count; i++) {
        detail *d = &props->details[i];
        end_detail(d);
        d->patch = patches[i];
        d->proxy = proxies[i];
        d->is_changed = d->patch != NULL;
    }
    return status;
}

// ---- Names ----

const pliant_prop *pliant_props_list(const pliant_props *props, int32_t *count)
{
    *count = 0;
    if (!props) return NULL;
    *count = props->count;
    return props->list;
}

static int32_t find(const pliant_props *props, const char *name)
{
    for (int32_t i = 0; i < props->count; i++)
        if (strcmp(props->list[i].name, name) == 0) return i;
    return -1;
}

int pliant_props_is_empty(const pliant_props *props)
{
    const int32_t *present = props->present;
    return present[PLIANT_PROP_PATCH] + present[PLIANT_PROP_TOOL] + present[PLIANT_PROP_PROXY] == 0;
}

const pliant_prop *pliant_props_owner(const pliant_props *props, int32_t vertex)
{
    return props->owner[vertex] < 0 ? NULL : &props->list[props->owner[vertex]];
}

const char *pliant_prop_kind_name(pliant_prop_kind kind)
{
    static const char *const names[] = {"patch", "tool", "proxy"};
    return names[kind];
}

// The place of a name: that of a prop of this kind, present or dropped, or the next free one, which
// is then cleared but does not count yet.
static pliant_status reserve(pliant_props *props, const char *name, pliant_prop_kind kind,
                             int32_t *place, pliant_error *reason)
{
    int32_t i = find(props, name);
    if (i >= 0 && props->list[i].kind != kind)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "%s is a %s: expected another name",
                                name, pliant_prop_kind_name(props->list[i].kind));
    if (i < 0) {
        if (props->count == PLIANT_PROP_LIMIT)
            return pliant_error_set(reason, PLIANT_ERR_CAPACITY,
                                    "more than %d patches, tools and proxies", PLIANT_PROP_LIMIT);
        i = props->count;
        props->list[i] = (pliant_prop){.kind = kind};
        props->details[i] = (detail){.index = -1};
        memcpy(props->list[i].name, name, strlen(name) + 1);
    }
    *place = i;
    return PLIANT_OK;
}

static void appear(pliant_props *props, int32_t i)
{
    if (i == props->count) props->count++;
    if (props->list[i].is_present) return;
    props->list[i].is_present = 1;
    props->present[props->list[i].kind]++;
}

static void vanish(pliant_props *props, int32_t i)
{
    const pliant_prop_kind kind = props->list[i].kind;
    props->list[i].is_present = 0;
    props->list[i].force = (pliant_vec3){0, 0, 0};
    props->list[i].node_count = 0;
    props->list[i].error = 0;
    props->present[kind]--;
}

static pliant_status find_present(const pliant_props *props, const char *name, int32_t *place,
                                  pliant_error *reason)
{
    const int32_t i = find(props, name);
    if (i < 0 || !props->list[i].is_present)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "no patch, tool or proxy %s: expected one declared before", name);
    *place = i;
    return PLIANT_OK;
}

// ---- Patches ----

static pliant_status reserve_vertices(detail *d, int32_t capacity, pliant_error *reason)
{
    int32_t *vertices = realloc(d->vertices, (size_t)capacity * sizeof *vertices);
    if (vertices) d->vertices = vertices;
    pliant_vec3 *u = realloc(d->u, (size_t)capacity * sizeof *u);
    if (u) d->u = u;
    if (vertices && u) return PLIANT_OK;
    return pliant_error_set(reason, PLIANT_ERR_MEMORY, "no memory for a patch of %d vertices",
                            (int)capacity);
}

// Room for one more of what there is: patch vertices may all be nodes, as with tolerance 0.
static pliant_status require(pliant_props *props, pliant_compliance compliance,
                             int32_t more_vertices, pliant_error *reason)
{
    int32_t vertices = more_vertices;
    for (int32_t i = 0; i < props->count; i++) vertices += props->details[i].count;
    return pliant_conditions_require(props->conditions, compliance,
                                     vertices > least_constraints ? vertices : least_constraints,
                                     vertices > least_loads ? vertices : least_loads, reason);
}

pliant_status pliant_props_set_patch(pliant_props *props, const char *name, double tolerance,
                                     pliant_error *reason)
{
    int32_t i = 0;
    pliant_status status = reserve(props, name, PLIANT_PROP_PATCH, &i, reason);
    if (status < 0) return status;
    detail *d = &props->details[i];
    if (d->patch) {
        status = pliant_patch_tolerate(d->patch, tolerance);
        if (status < 0)
            return pliant_error_set(reason, status, "tolerance %g: %s", tolerance,
                                    pliant_status_name(status));
        d->patch_def.tolerance = tolerance;
        return status;
    }
    pliant_patch_def def = pliant_patch_default(props->model);
    def.tolerance = tolerance;
    if (def.vertex_capacity > props->vertex_count) def.vertex_capacity = props->vertex_count;
    status = require(props, PLIANT_COMPLIANCE_STORED, 0, reason);
    if (status >= 0) status = reserve_vertices(d, def.vertex_capacity, reason);
    if (status >= 0)
        status = pliant_patch_create(pliant_conditions_solver(props->conditions), &def, &d->patch,
                                     reason);
    if (status < 0) {
        if (i == props->count) {
            free(d->vertices);
            free(d->u);
        }
        return status;
    }
    d->patch_def = def;
    d->count = 0;
    d->is_changed = 1;
    appear(props, i);
    return PLIANT_OK;
}

static pliant_status find_patch(const pliant_props *props, const char *name, int32_t *place,
                                pliant_error *reason)
{
    const int32_t i = find(props, name);
    if (i < 0 || !props->list[i].is_present || props->list[i].kind != PLIANT_PROP_PATCH)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "no patch %s: expected \"patch %s tolerance T\" before", name,
                                name);
    *place = i;
    return PLIANT_OK;
}

// Twice the room; the patch forgets the nodes that it had.
static pliant_status enlarge(pliant_props *props, detail *d, pliant_error *reason)
{
    pliant_patch *patch = NULL;
    pliant_patch_def def = d->patch_def;
    def.vertex_capacity = def.vertex_capacity > props->vertex_count / 2 ? props->vertex_count
                                                                        : 2 * def.vertex_capacity;
    pliant_status status = reserve_vertices(d, def.vertex_capacity, reason);
    if (status >= 0)
        status =
            pliant_patch_create(pliant_conditions_solver(props->conditions), &def, &patch, reason);
    if (status < 0) return status;
    pliant_patch_destroy(d->patch);
    d->patch = patch;
    d->patch_def = def;
    return status;
}

pliant_status pliant_props_displace(pliant_props *props, const char *name, int32_t vertex,
                                    pliant_vec3 u, pliant_error *reason)
{
    int32_t i = 0;
    pliant_status status = find_patch(props, name, &i, reason);
    if (status < 0) return status;
    detail *d = &props->details[i];
    if (pliant_model_is_free(props->model, vertex) != 1)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "vertex %d is fixed: a patch needs free ones", (int)vertex);
    if (props->owner[vertex] >= 0 && props->owner[vertex] != i)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "vertex %d belongs to patch %s",
                                (int)vertex, props->list[props->owner[vertex]].name);
    if (pliant_conditions_has(props->conditions, vertex))
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "vertex %d has a condition of its own: release it first",
                                (int)vertex);
    if (props->owner[vertex] < 0) {
        status = require(props, PLIANT_COMPLIANCE_STORED, 1, reason);
        if (status >= 0 && d->count == d->patch_def.vertex_capacity)
            status = enlarge(props, d, reason);
        if (status < 0) return status;
        props->owner[vertex] = i;
        props->place[vertex] = d->count;
        d->vertices[d->count++] = vertex;
    }
    d->u[props->place[vertex]] = u;
    d->is_changed = 1;
    return PLIANT_OK;
}

static void release_all(pliant_props *props, detail *d)
{
    for (int32_t k = 0; k < d->count; k++) props->owner[d->vertices[k]] = -1;
    d->count = 0;
    d->is_changed = 1;
}

pliant_status pliant_props_release(pliant_props *props, const char *name, int32_t vertex,
                                   pliant_error *reason)
{
    int32_t i = 0;
    const pliant_status status = find_patch(props, name, &i, reason);
    if (status < 0) return status;
    detail *d = &props->details[i];
    if (vertex < 0) {
        release_all(props, d);
        return PLIANT_OK;
    }
    // As with release: a vertex that is not in the patch is where it should be.
    if (props->owner[vertex] != i) return PLIANT_OK;
    const int32_t place = props->place[vertex], last = --d->count;
    d->vertices[place] = d->vertices[last];
    d->u[place] = d->u[last];
    props->place[d->vertices[place]] = place;
    props->owner[vertex] = -1;
    d->is_changed = 1;
    return PLIANT_OK;
}

// ---- Tools ----

pliant_status pliant_props_set_tolerance(pliant_props *props, double tolerance,
                                         pliant_error *reason)
{
    if (props->contact)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "contact tolerance: expected before the first tool");
    props->tolerance = tolerance;
    return PLIANT_OK;
}

static void end_contact(pliant_props *props)
{
    pliant_contact_destroy(props->contact);
    props->contact = NULL;
}

static pliant_status begin_contact(pliant_props *props, pliant_error *reason)
{
    if (props->contact) return PLIANT_OK;
    const pliant_status status = require(props, PLIANT_COMPLIANCE_PASSIVE, 0, reason);
    if (status < 0) return status;
    return create_contact(props, pliant_conditions_solver(props->conditions), &props->contact,
                          reason);
}

pliant_status pliant_props_set_tool(pliant_props *props, const char *name, const pliant_tool *tool,
                                    pliant_error *reason)
{
    int32_t i = 0, index = 0;
    pliant_status status = reserve(props, name, PLIANT_PROP_TOOL, &i, reason);
    if (status < 0) return status;
    detail *d = &props->details[i];
    if (d->index >= 0) index = d->index;
    else
        while (index < PLIANT_TOOL_LIMIT && props->tool_of[index] >= 0) index++;
    if (index == PLIANT_TOOL_LIMIT)
        return pliant_error_set(reason, PLIANT_ERR_CAPACITY, "more than %d tools at once",
                                PLIANT_TOOL_LIMIT);
    if (!(tool->friction <= 2))
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "friction %g: expected 0 to 2 for a tool", (double)tool->friction);
    status = begin_contact(props, reason);
    if (status < 0) return status;
    status = pliant_contact_set_tool(props->contact, index, tool);
    if (status < 0 && props->present[PLIANT_PROP_TOOL] == 0) end_contact(props);
    if (status < 0)
        return pliant_error_set(reason, status, "tool %s refused: %s", name,
                                pliant_status_name(status));
    d->tool = *tool;
    d->index = index;
    props->tool_of[index] = i;
    appear(props, i);
    return PLIANT_OK;
}

// With the last one goes the contact and its forces, which only its own solve would take away.
static void drop_tool(pliant_props *props, detail *d)
{
    const pliant_tool none = {.kind = PLIANT_TOOL_NONE};
    (void)!pliant_contact_set_tool(props->contact, d->index, &none);
    props->tool_of[d->index] = -1;
    d->index = -1;
    if (props->present[PLIANT_PROP_TOOL] == 1) end_contact(props);
}

// ---- Proxies ----

pliant_status pliant_props_set_proxy(pliant_props *props, const char *name,
                                     const double position[3], double stiffness, double friction,
                                     pliant_error *reason)
{
    int32_t i = 0;
    pliant_status status = reserve(props, name, PLIANT_PROP_PROXY, &i, reason);
    if (status < 0) return status;
    if (props->list[i].is_present)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "proxy %s is already there: expected move or drop", name);
    detail *d = &props->details[i];
    pliant_proxy_def def = pliant_proxy_default(props->model);
    if (stiffness > 0) def.stiffness = stiffness;
    def.friction = friction;
    status = require(props, PLIANT_COMPLIANCE_PASSIVE, 0, reason);
    if (status >= 0)
        status = pliant_proxy_create(pliant_conditions_solver(props->conditions), &def, &d->proxy,
                                     reason);
    if (status < 0) return status;
    d->proxy_def = def;
    d->result = (pliant_proxy_result){.face = -1};
    memcpy(d->position, position, sizeof d->position);
    appear(props, i);
    return PLIANT_OK;
}

// ---- All kinds ----

pliant_status pliant_props_move(pliant_props *props, const char *name, const double position[3],
                                pliant_error *reason)
{
    int32_t i = 0;
    const pliant_status status = find_present(props, name, &i, reason);
    if (status < 0) return status;
    detail *d = &props->details[i];
    if (props->list[i].kind == PLIANT_PROP_PATCH)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "%s is a patch: expected a tool or a proxy", name);
    if (props->list[i].kind == PLIANT_PROP_PROXY) {
        memcpy(d->position, position, sizeof d->position);
        return PLIANT_OK;
    }
    pliant_tool tool = d->tool;
    tool.a = (pliant_vec3){(float)position[0], (float)position[1], (float)position[2]};
    if (tool.kind == PLIANT_TOOL_CAPSULE) {
        tool.b.x += tool.a.x - d->tool.a.x;
        tool.b.y += tool.a.y - d->tool.a.y;
        tool.b.z += tool.a.z - d->tool.a.z;
    }
    return pliant_props_set_tool(props, name, &tool, reason);
}

static void drop(pliant_props *props, int32_t i)
{
    detail *d = &props->details[i];
    switch (props->list[i].kind) {
    case PLIANT_PROP_PATCH:
        release_all(props, d);
        break;
    case PLIANT_PROP_TOOL:
        drop_tool(props, d);
        break;
    case PLIANT_PROP_PROXY:
        break;
    }
    end_detail(d);
    vanish(props, i);
}

pliant_status pliant_props_drop(pliant_props *props, const char *name, pliant_error *reason)
{
    int32_t i = 0;
    const pliant_status status = find_present(props, name, &i, reason);
    if (status >= 0) drop(props, i);
    return status;
}

void pliant_props_drop_all(pliant_props *props)
{
    for (int32_t i = 0; i < props->count; i++)
        if (props->list[i].is_present) drop(props, i);
}

// ---- Solving ----

static void add(pliant_vec3 *sum, pliant_vec3 v)
{
    sum->x += v.x, sum->y += v.y, sum->z += v.z;
}

// The worse of two statuses: a refusal, then rough, then late.
static pliant_status worse(pliant_status a, pliant_status b)
{
    if (a < 0 || b < 0) return a < b ? a : b;
    return a > b ? a : b;
}

static pliant_status solve_patch(detail *d, int64_t deadline, pliant_props_report *report)
{
    if (d->is_changed) {
        const pliant_status status = pliant_patch_set(d->patch, d->vertices, d->u, d->count);
        if (status < 0) return status;
        d->is_changed = 0;
    }
    const pliant_status status = pliant_patch_solve(d->patch, deadline);
    if (status >= 0) report->is_late |= pliant_patch_last(d->patch).is_late;
    return status;
}

// The patch's force, and to the report's what of it the solver does not count: of nodes fading out.
// A node that was solved for late may be on a coarser level than it was stated on.
static void read_patch(const pliant_props *props, pliant_prop *prop, const detail *d,
                       pliant_props_report *report)
{
    const pliant_solver *solver = pliant_conditions_solver(props->conditions);
    const pliant_patch_report last = pliant_patch_last(d->patch);
    const int32_t level_count = pliant_model_describe(props->model).level_count;
    prop->force = pliant_patch_force(d->patch);
    prop->node_count = last.node_count;
    prop->error = last.error;
    add(&report->force, prop->force);
    const int32_t count = pliant_patch_nodes(d->patch, props->nodes, props->vertex_count);
    for (int32_t k = 0; k < count && k < props->vertex_count; k++)
        for (int32_t l = 0; l < level_count; l++) {
            const pliant_node node = {l, props->nodes[k].vertex};
            const pliant_vec3 f = pliant_solver_node_force(solver, node);
            add(&report->force, (pliant_vec3){-f.x, -f.y, -f.z});
        }
}

static void read_tool(const pliant_props *props, pliant_prop *prop, const detail *d)
{
    const pliant_tool_result result = pliant_contact_tool(props->contact, d->index);
    prop->force = result.force;
    prop->node_count = result.node_count;
    prop->error = (double)result.penetration;
}

static pliant_status step_proxy(pliant_prop *prop, detail *d, int64_t deadline)
{
    pliant_proxy_result *result = &d->result;
    const pliant_status status = pliant_proxy_step(d->proxy, d->position, deadline, result);
    if (status < 0) return status;
    prop->force = result->force;
    prop->node_count = result->face >= 0;
    prop->error = result->depth;
    return status;
}

static pliant_status solve_tools(pliant_props *props, int64_t deadline, pliant_props_report *report)
{
    const pliant_status status = pliant_contact_solve(props->contact, deadline);
    if (status < 0) return status;
    const pliant_contact_report last = pliant_contact_last(props->contact);
    report->is_late |= last.is_late;
    if (last.node_count > 0) report->finest_level = last.finest_level;
    return status;
}

// In the order patches, tools, proxies: what comes later acts on what is left of the room that
// earlier ones leave, and a proxy is felt against the surface that everything else has shaped.
static pliant_status solve_all(pliant_props *props, int64_t deadline, pliant_props_report *report)
{
    if (pliant_props_is_empty(props))
        return pliant_solver_solve(pliant_conditions_solver(props->conditions), deadline);
    pliant_status status = PLIANT_OK;
    for (int32_t i = 0; status >= 0 && i < props->count; i++)
        if (props->details[i].patch)
            status = worse(status, solve_patch(&props->details[i], deadline, report));
    if (status >= 0 && props->contact) status = worse(status, solve_tools(props, deadline, report));
    for (int32_t i = 0; status >= 0 && i < props->count; i++)
        if (props->details[i].proxy)
            status = worse(status, step_proxy(&props->list[i], &props->details[i], deadline));
    return status;
}

pliant_status pliant_props_solve(pliant_props *props, int64_t deadline, pliant_props_report *report)
{
    *report = (pliant_props_report){.finest_level = -1};
    const pliant_status status = solve_all(props, deadline, report);
    if (status < 0) return status;
    for (int32_t i = 0; i < props->count; i++) {
        pliant_prop *prop = &props->list[i];
        const detail *d = &props->details[i];
        if (d->patch) read_patch(props, prop, d, report);
        if (d->index >= 0) read_tool(props, prop, d);
        if (d->index >= 0 || d->proxy) add(&report->force, prop->force);
    }
    return status;
}

// ---- Marks ----

typedef struct mark_list {
    pliant_prop_mark *marks;
    int32_t count, capacity;
} mark_list;

static void put_mark(mark_list *list, int32_t vertex, pliant_vec3 direction)
{
    if (list->count < list->capacity)
        list->marks[list->count] = (pliant_prop_mark){vertex, direction};
    list->count++;
}

static void mark_proxy(const pliant_props *props, const detail *d, mark_list *list)
{
    const pliant_proxy_result *result = &d->result;
    if (result->face < 0) return;
    const int32_t finest = pliant_model_describe(props->model).level_count - 1;
    const int32_t *corners = pliant_model_faces(props->model, finest) + 3 * (size_t)result->face;
    int heaviest = 0;
    for (int k = 1; k < 3; k++)
        if (result->weights[k] > result->weights[heaviest]) heaviest = k;
    put_mark(list, corners[heaviest], result->force);
}

int32_t pliant_props_marks(const pliant_props *props, pliant_prop_mark *marks, int32_t capacity)
{
    mark_list list = {.marks = marks, .capacity = capacity};
    for (int32_t i = 0; i < props->count; i++) {
        const detail *d = &props->details[i];
        for (int32_t k = 0; d->patch && k < d->count; k++) put_mark(&list, d->vertices[k], d->u[k]);
        if (d->proxy) mark_proxy(props, d, &list);
    }
    const int32_t pushed = props->contact ? pliant_contact_last(props->contact).node_count : 0;
    for (int32_t k = 0; k < pushed; k++) {
        const pliant_contact_node node = pliant_contact_get(props->contact, k);
        put_mark(&list, node.node.vertex, node.force);
    }
    return list.count;
}
