// contact_fixture.h: rigid tools on a model with known Green's functions: model, solver, contact; tools
// and what is checked of their forces.
//
// The body is the unit sphere, held where z < -0.6 (synthetic_model.h), 642 vertices some 0.14
// apart on four levels, of which nothing was thresholded unless a case says so.
#pragma once

#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { depth_levels = 3, vertex_count = 642 };

// ---- The model, solvers and contacts on it ----

typedef struct fixture {
    const check_synthetic *exact;
    pliant_model *model;
    pliant_solver *solver;
    pliant_contact *contact;
} fixture;

static check_synthetic *exact_model;

static inline check_synthetic *make_model(double eps)
{
    return check_synthetic_create(&(check_synthetic_def){.levels = depth_levels,
                                                         .eps = eps,
                                                         .wavelet = pliant_wavelet_default(),
                                                         .blocks = CHECK_ALL_BLOCKS,
                                                         .level_mask = 15});
}

static inline int make_exact_model(void **state)
{
    (void)state;
    exact_model = make_model(0);
    return 0;
}

static inline int destroy_exact_model(void **state)
{
    (void)state;
    check_synthetic_destroy(exact_model);
    return 0;
}

static inline fixture open_model(const check_synthetic *synthetic)
{
    fixture f = {.exact = synthetic};
    char path[64];
    pliant_error err = {""};
    snprintf(path, sizeof path, "/tmp/pliant_test_contact_%d.h5", (int)getpid());
    check_synthetic_write(synthetic, path);
    check_ok(pliant_model_open(path, &f.model, &err), &err);
    unlink(path);
    pliant_solver_def def = pliant_solver_default(f.model);
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    check_ok(pliant_solver_create(f.model, &def, &f.solver, &err), &err);
    return f;
}

// A contact on levels coarsest .. finest.
static inline void begin_contact(fixture *f, double tolerance, int32_t coarsest, int32_t fade_count)
{
    pliant_error err = {""};
    pliant_contact_def def = pliant_contact_default(f->solver);
    def.tolerance = tolerance;
    def.coarsest_level = coarsest;
    def.fade_count = fade_count;
    check_ok(pliant_contact_create(f->solver, &def, &f->contact, &err), &err);
}

static inline fixture set_up(double tolerance, int32_t coarsest, int32_t fade_count)
{
    fixture f = open_model(exact_model);
    begin_contact(&f, tolerance, coarsest, fade_count);
    return f;
}

static inline void tear_down(fixture *f)
{
    pliant_contact_destroy(f->contact);
    pliant_solver_destroy(f->solver);
    pliant_model_close(f->model);
}

static inline pliant_status solve_with(fixture *f, int32_t index, pliant_tool tool)
{
    assert_int_equal(pliant_contact_set_tool(f->contact, index, &tool), PLIANT_OK);
    return pliant_contact_solve(f->contact, PLIANT_NEVER);
}

// ---- Vectors, tools, surfaces ----

typedef struct vector {
    double x, y, z;
} vector;

static inline vector widen(pliant_vec3 v)
{
    return (vector){(double)v.x, (double)v.y, (double)v.z};
}

static inline vector minus(vector a, vector b)
{
    return (vector){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline double dot(vector a, vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline double length(vector a)
{
    return sqrt(dot(a, a));
}

// A ball that touches the body's top, pressed in by `depth`, `angle` down to the side.
static inline pliant_tool ball_at(double radius, double depth, double angle, double friction)
{
    const double distance = 1 + radius - depth;
    return (pliant_tool){.kind = PLIANT_TOOL_SPHERE,
                         .a = {(float)(distance * sin(angle)), 0, (float)(distance * cos(angle))},
                         .radius = (float)radius,
                         .friction = (float)friction};
}

static inline pliant_tool plane_above(double depth, double shift, double friction)
{
    return (pliant_tool){.kind = PLIANT_TOOL_PLANE,
                         .a = {(float)shift, 0, (float)(1 - depth)},
                         .b = {0, 0, -2},
                         .friction = (float)friction};
}

// Written anew here, on purpose.
static inline double distance_to(const pliant_tool *tool, vector x)
{
    const vector a = widen(tool->a), b = widen(tool->b);
    if (tool->kind == PLIANT_TOOL_PLANE) return dot(minus(x, a), b) / length(b);
    double part = 0;
    const vector along = minus(b, a);
    if (tool->kind == PLIANT_TOOL_CAPSULE && dot(along, along) > 0)
        part = fmin(fmax(dot(minus(x, a), along) / dot(along, along), 0), 1);
    const vector nearest = {a.x + part * along.x, a.y + part * along.y, a.z + part * along.z};
    return length(minus(x, nearest)) - (double)tool->radius;
}

static inline void get_surface(const fixture *f, pliant_vec3 *u)
{
    assert_int_equal(pliant_solver_surface(f->solver, depth_levels, u), PLIANT_OK);
}

static inline vector place(const fixture *f, const pliant_vec3 *u, int32_t v)
{
    const double *x = pliant_model_positions(f->model) + 3 * (size_t)v;
    return (vector){x[0] + (double)u[v].x, x[1] + (double)u[v].y, x[2] + (double)u[v].z};
}

// The deepest free vertex inside a tool, of the whole surface.
static inline double deepest(const fixture *f, const pliant_tool *tool)
{
    static pliant_vec3 u[vertex_count];
    double depth = 0;
    get_surface(f, u);
    for (int32_t v = 0; v < vertex_count; v++)
        if (pliant_model_is_free(f->model, v) == 1)
            depth = fmax(depth, -distance_to(tool, place(f, u, v)));
    return depth;
}

// No force pulls, all are in their cones, and sum up to the results.
static inline void check_forces(const fixture *f, const pliant_tool *tools, int32_t tool_count)
{
    const pliant_contact_report report = pliant_contact_last(f->contact);
    vector sum[4] = {{0}}, torque[4] = {{0}};
    int32_t count[4] = {0};
    static pliant_vec3 u[vertex_count];
    get_surface(f, u);
    for (int32_t i = 0; i < report.node_count; i++) {
        const pliant_contact_node node = pliant_contact_get(f->contact, i);
        assert_in_range(node.tool, 0, tool_count - 1);
        assert_int_equal(pliant_model_is_free(f->model, node.node.vertex), 1);
        const vector force = widen(node.force), normal = widen(node.normal);
        const double pushed = dot(force, normal);
        check_at_least(pushed, 0);
        check_near(length(normal), 1, 1e-6);
        const vector sideways = {force.x - pushed * normal.x, force.y - pushed * normal.y,
                                 force.z - pushed * normal.z};
        const double friction = (double)tools[node.tool].friction;
        check_at_most(length(sideways), friction * pushed + 1e-5 * pushed);
        if (node.is_sliding) check_near(length(sideways), friction * pushed, 2e-3 * pushed);
        const vector x = place(f, u, node.node.vertex), arm = minus(x, widen(tools[node.tool].a));
        check_near(distance_to(&tools[node.tool], x), (double)node.gap, 1e-5);
        sum[node.tool].x += force.x, sum[node.tool].y += force.y, sum[node.tool].z += force.z;
        torque[node.tool].x += arm.y * force.z - arm.z * force.y;
        torque[node.tool].y += arm.z * force.x - arm.x * force.z;
        torque[node.tool].z += arm.x * force.y - arm.y * force.x;
        count[node.tool]++;
    }
    for (int32_t t = 0; t < tool_count; t++) {
        const pliant_tool_result result = pliant_contact_tool(f->contact, t);
        assert_int_equal(result.node_count, count[t]);
        const double scale = length(sum[t]) + 1e-6;
        check_near(length(minus(widen(result.force), sum[t])) / scale, 0, 1e-5);
        check_near(length(minus(widen(result.torque), torque[t])) / scale, 0, 1e-4);
        check_near((double)result.penetration, deepest(f, &tools[t]), 1e-5);
    }
}
