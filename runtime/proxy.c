// proxy.c: point haptics: a proxy in free space or on the deformed surface, and the force there.
//
// A step solves twice. Without the proxy's own force first: that is the surface x0 on which the
// proxy slides (sliding.c), giving way by a compliance C(w) = sum of w_a C_a which its corners
// have, each the compliance of its own hat while S is held (GF-15). Then with the force F spread
// over the corners' hats by the weights w, for everybody who reads the solution.
//
// Under that force the surface itself gives way by c = sum of w_a w_b C_ab, which dips between the
// corners of a face, by up to 40% at its middle: felt as it is, the mesh would be rough to the
// touch, and would pull the point into its corners. Since C - c = sum over a < b of
// w_a w_b (C_aa + C_bb - C_ab - C_ba) is never negative, the virtual coupling can take up the
// difference: its compliance is I / k + C - c, that is I / k at corners and a little more between,
// and the device feels C + I / k.
//
// The C_a are symmetric and positive, so that pressing in and out gives nothing. On the way over
// the surface E changes a little without work: where C does, and since smoothed normals are not
// those of any surface. So the step keeps account of what the device put in, by the trapezoidal
// rule, less what is stored. When that surplus runs out, a force against the device's motion brakes
// until it is there again (a time-domain passivity controller): what costs energy must be paid
// for, what would give some does not, and no closed path gains any, whatever the normals.
//
// This follows: C. B. Zilles and J. K. Salisbury, IROS 1995; H. B. Morgenbesser and M. A.
// Srinivasan, ASME DSC 58, 1996; D. L. James and D. K. Pai, Haptics-e 2(1), 2001; B. Hannaford and
// J.-H. Ryu, Time-domain passivity control of haptic interfaces, IEEE Trans. Robotics and
// Automation 18(1), 2002.
#include "approach.h"
#include "motion.h"
#include "pliant/error.h"
#include "vector.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Of the largest coordinate: lengths within it are rounding.
static const double slack_part = 1e-12;
// The surplus that is kept ready, as a part of what is stored: the brake is in proportion to what
// it lacks, and filling it costs as much once, when the device presses. Over a face of a smooth
// mesh some percent go and come.
static const double ready_part = 0.005;
// Over this part of an edge the brake makes up for what the surplus lacks, and over a quarter of it
// the brake follows (critically damped): short against a face, long against a step, so that the
// force stays continuous and does not buzz when the device trembles.
static const double brake_part = 0.125;
// Compliances kept: a point on one face needs three, a fast one in a step some ten times as many.
enum { entry_limit = 64 };
// A step lifts off and meets the surface again at most so often.
enum { turn_limit = 3 };
// A face lies in one triangle of the level that takes the force, under the hats of its corners.
enum { spread_limit = 3 };

typedef struct entry {
    int32_t vertex;
    double compliance[9];
} entry;

// The corners of one triangle, and those of another on their way out of the sum.
enum { pressed_room = 6 };

struct pliant_proxy {
    pliant_solver *solver;  // borrowed
    pliant_arena arena;
    pliant_load_list pressed;  // the proxy's force, on top of the solver's statements
    pliant_load corners[pressed_room];
    int32_t level;          // of the hats that take it
    double slack, spacing;  // m; spacing: about an edge
    pliant_deformed deformed;
    pliant_motion motion;
    pliant_approach approach;
    pliant_sliding_surface surface;

    // Where it is.
    int32_t is_new;       // 1: it begins at `position`, inside or outside
    int32_t is_placed;    // 1: that is where the caller said, 0: where the device is first
    int32_t is_touching;  // 1: at `point`; 0: at `position`
    int32_t is_pressed;   // 1: and with a force
    pliant_sliding_point point;
    double position[3];
    int64_t rest_ns;  // what a step takes after its first solve
    // The account of the present contact.
    double device[3];  // in the last step
    double surplus;    // put in and not stored, J
    double brake[3];   // that acts, N

    // Compliances of hats while `held` is S.
    int32_t held_count;
    pliant_node *held;  // shape [constraint_capacity]
    int32_t entry_count;
    entry *entries;  // shape [entry_limit]
};

// ---- Life ----

pliant_proxy_def pliant_proxy_default(const pliant_model *model)
{
    // A hat of area a on a half space gives way to a force on it by about 1 / (1.2 E sqrt(a)).
    double area = 0;
    for (int32_t v = 0; v < model->vertex_count; v++) area += model->areas[v];
    return (pliant_proxy_def){.stiffness =
                                  4 * model->view.material[0] * sqrt(area / model->vertex_count)};
}

static void lay_out(pliant_arena *arena, pliant_proxy *proxy)
{
    const pliant_model *model = proxy->solver->model;
    pliant_approach_lay_out(arena, model, &proxy->approach);
    pliant_deformed_lay_out(arena, model, &proxy->deformed);
    pliant_motion_lay_out(arena, proxy->solver, &proxy->motion);
    PLIANT_TAKE(arena, proxy->held, proxy->solver->constraint_capacity);
    PLIANT_TAKE(arena, proxy->entries, entry_limit);
}

static void fetch(void *context, int32_t face, pliant_sliding_face *to);

static pliant_status check_def(const pliant_proxy_def *def, pliant_error *err)
{
    if (!(def->stiffness > 0) || !isfinite(def->stiffness))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_proxy_def: stiffness: expected a number above 0, found %g",
                                def->stiffness);
    if (!(def->friction >= 0) || !isfinite(def->friction))
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "pliant_proxy_def: friction: expected a number of 0 or more, found %g", def->friction);
    return PLIANT_OK;
}

static void measure(pliant_proxy *proxy)
{
    const pliant_model *model = proxy->solver->model;
    double largest = 0, area = 0;
    for (size_t c = 0; c < 3 * (size_t)model->vertex_count; c++)
        largest = fmax(largest, fabs(model->view.vertices[c]));
    for (int32_t v = 0; v < model->vertex_count; v++) area += model->areas[v];
    proxy->slack = slack_part * largest;
    proxy->spacing = sqrt(area / model->vertex_count);
}

pliant_status pliant_proxy_create(pliant_solver *solver, const pliant_proxy_def *def,
                                  pliant_proxy **result, pliant_error *err)
{
    if (!solver || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_proxy_create: expected a solver and a place, found NULL");
    const pliant_proxy_def used = def ? *def : pliant_proxy_default(solver->model);
    pliant_status status = check_def(&used, err);
    if (status < 0) return status;
    pliant_proxy *proxy = calloc(1, sizeof *proxy);
    if (!proxy) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a proxy");
    proxy->solver = solver;
    proxy->pressed.loads = proxy->corners;
    pliant_load_list_enter(solver, &proxy->pressed);
    lay_out(&proxy->arena, proxy);
    status = pliant_arena_reserve(&proxy->arena, err);
    if (status < 0) goto done;
    lay_out(&proxy->arena, proxy);
    pliant_motion_fill(solver->model, &proxy->motion);
    status = pliant_deformed_fill(&proxy->deformed, used.normals, err);
    if (status < 0) goto done;
    measure(proxy);
    proxy->level = solver->model->finest_stored;
    proxy->surface = (pliant_sliding_surface){.twin = proxy->deformed.twin,
                                              .fetch = fetch,
                                              .context = proxy,
                                              .give = 1 / used.stiffness,
                                              .friction = used.friction};
    proxy->is_new = 1;
    proxy->held_count = -1;
done:
    if (status < 0) {
        pliant_proxy_destroy(proxy);
        return status;
    }
    *result = proxy;
    return PLIANT_OK;
}

void pliant_proxy_destroy(pliant_proxy *proxy)
{
    if (!proxy) return;
    pliant_load_list_leave(proxy->solver, &proxy->pressed);
    pliant_arena_release(&proxy->arena);
    free(proxy);
}

// ---- Compliances ----

// The eigenvalues of a symmetric matrix that are below zero, to zero: by Jacobi rotations.
static void make_positive(double *a)
{
    double v[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (int sweep = 0; sweep < 12; sweep++)
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++) {
                const double off = a[3 * p + q];
                if (off == 0) continue;
                const double theta = (a[4 * q] - a[4 * p]) / (2 * off);
                const double t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
                const double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; k++) {
                    const double x = a[3 * k + p], y = a[3 * k + q];
                    a[3 * k + p] = c * x - s * y;
                    a[3 * k + q] = s * x + c * y;
                }
                for (int k = 0; k < 3; k++) {
                    const double x = a[3 * p + k], y = a[3 * q + k];
                    a[3 * p + k] = c * x - s * y;
                    a[3 * q + k] = s * x + c * y;
                }
                for (int k = 0; k < 3; k++) {
                    const double x = v[3 * k + p], y = v[3 * k + q];
                    v[3 * k + p] = c * x - s * y;
                    v[3 * k + q] = s * x + c * y;
                }
            }
    const double values[3] = {fmax(a[0], 0), fmax(a[4], 0), fmax(a[8], 0)};
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            a[3 * r + c] = 0;
            for (int k = 0; k < 3; k++) a[3 * r + c] += v[3 * r + k] * values[k] * v[3 * c + k];
        }
}

// Another S makes other compliances.
static void note_held(pliant_proxy *proxy)
{
    const pliant_solver *solver = proxy->solver;
    int32_t is_same = proxy->held_count == solver->solved_count;
    for (int32_t i = 0; is_same && i < solver->solved_count; i++)
        is_same = proxy->held[i].vertex == solver->solved[i].node.vertex &&
                  proxy->held[i].level == solver->solved[i].node.level;
    if (is_same) return;
    for (int32_t i = 0; i < solver->solved_count; i++) proxy->held[i] = solver->solved[i].node;
    proxy->held_count = solver->solved_count;
    proxy->entry_count = 0;
}

// May a hat take force? What is held does not give way, and its holder takes the force.
static int32_t gives_way(const pliant_solver *solver, int32_t vertex)
{
    return solver->model->domain[vertex] == PLIANT_DOMAIN_FREE &&
           pliant_constraint_find(solver->solved, solver->solved_count, vertex) < 0;
}

static const entry *find_entry(const pliant_proxy *proxy, int32_t vertex)
{
    for (int32_t i = 0; i < proxy->entry_count; i++)
        if (proxy->entries[i].vertex == vertex) return &proxy->entries[i];
    return NULL;
}

// Have the compliance of a vertex's hat. Each is asked for on its own, so that it does not depend
// on which face came first, and a raise that one needs is not for others.
static void look_up(pliant_proxy *proxy, int32_t vertex)
{
    pliant_solver *solver = proxy->solver;
    if (!gives_way(solver, vertex) || find_entry(proxy, vertex)) return;
    if (proxy->entry_count == entry_limit) proxy->entry_count = 0;
    const pliant_node node = {proxy->level, vertex};
    double matrix[9];
    const double shift = solver->compliance_shift;
    solver->compliance_shift = 0;
    const pliant_status status = pliant_solver_compliance(solver, &node, 1, matrix);
    solver->compliance_shift = shift;
    assert(status >= 0);
    (void)status;
    entry *to = &proxy->entries[proxy->entry_count++];
    to->vertex = vertex;
    // Symmetric and positive already when the solver is passive.
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            to->compliance[3 * r + c] = 0.5 * (matrix[3 * r + c] + matrix[3 * c + r]);
    make_positive(to->compliance);
}

// The hats that reach the corners of a face, and each corner's weights of them.
typedef struct spread {
    int32_t count;
    int32_t vertices[spread_limit];
    double weights[3][spread_limit];
} spread;

static spread find_spread(const pliant_proxy *proxy, int32_t face)
{
    spread s = {0};
    for (int k = 0; k < 3; k++) {
        int32_t vertices[3];
        float weights[3];
        const int32_t corner = proxy->deformed.faces[3 * (size_t)face + k];
        const int32_t count =
            pliant_model_hats_at(proxy->solver->model, proxy->level, corner, vertices, weights);
        for (int32_t i = 0; i < count; i++) {
            int32_t j = 0;
            while (j < s.count && s.vertices[j] != vertices[i]) j++;
            if (j == s.count) s.vertices[s.count++] = vertices[i];
            s.weights[k][j] = (double)weights[i];
        }
    }
    return s;
}

static void fetch(void *context, int32_t face, pliant_sliding_face *to)
{
    pliant_proxy *proxy = context;
    pliant_deformed *deformed = &proxy->deformed;
    pliant_deformed_want_ring(deformed, face);
    pliant_deformed_evaluate(deformed, proxy->solver);
    pliant_deformed_corners(deformed, face, to->place);
    for (int k = 0; k < 3; k++)
        memcpy(to->normal[k],
               pliant_deformed_normal(deformed, deformed->faces[3 * (size_t)face + k]),
               sizeof to->normal[k]);
    const spread s = find_spread(proxy, face);
    memset(to->compliance, 0, sizeof to->compliance);
    for (int32_t i = 0; i < s.count; i++) {
        look_up(proxy, s.vertices[i]);
        const entry *hat = find_entry(proxy, s.vertices[i]);
        for (int k = 0; hat && k < 3; k++)
            for (int c = 0; c < 9; c++)
                to->compliance[k][c] += s.weights[k][i] * hat->compliance[c];
    }
}

// ---- A step ----

// The proxy's force on the solver, from the next solve on.
static void press(pliant_proxy *proxy, const double *force)
{
    const spread s = find_spread(proxy, proxy->point.face);
    for (int32_t i = 0; i < s.count; i++) {
        double weight = 0;
        for (int k = 0; k < 3; k++) weight += proxy->point.weights[k] * s.weights[k][i];
        if (weight == 0 || !gives_way(proxy->solver, s.vertices[i])) continue;
        const pliant_node node = {proxy->level, s.vertices[i]};
        const double density = weight / pliant_model_node_area(proxy->solver->model, node);
        (void)pliant_load_list_press(proxy->solver, &proxy->pressed, pressed_room, node,
                                     (pliant_vec3){(float)(density * force[0]),
                                                   (float)(density * force[1]),
                                                   (float)(density * force[2])});
    }
}

// How far the surface may have come since the last search.
static double find_swept(pliant_proxy *proxy)
{
    pliant_motion_update(&proxy->motion, proxy->solver);
    if (proxy->is_new) return INFINITY;
    // Vertices that enter or leave S jump a little.
    return proxy->motion.moved + (proxy->motion.is_same_set ? 0 : proxy->spacing);
}

// Along from `position` towards the device, until the surface is in the way; or the surface has
// come over `position`.
static void approach(pliant_proxy *proxy, const double *device, double swept)
{
    const pliant_approach_query query = {
        .from = proxy->position, .to = device, .swept = swept, .slack = proxy->slack};
    const pliant_approach_result found =
        pliant_approach_search(&proxy->approach, &proxy->deformed, proxy->solver, &query);
    proxy->is_new = 0;
    proxy->is_touching = found.is_touching;
    proxy->point = found.point;
    if (!found.is_touching) memcpy(proxy->position, device, sizeof proxy->position);
}

// The account of a step from `before`, the device's last place on the surface as it is now (what
// others did to the surface since is their energy), to `now`; and the brake that follows from it.
static void settle(pliant_proxy *proxy, const double *device, const pliant_sliding_state *before,
                   const pliant_sliding_state *now)
{
    double way[3];
    vector_subtract(device, proxy->device, way);
    for (int c = 0; c < 3; c++)
        proxy->surplus += (0.5 * (before->force[c] + now->force[c]) + proxy->brake[c]) * way[c];
    proxy->surplus -= now->energy - before->energy;
    // What friction has taken is not to be had back: no more is kept than is stored.
    proxy->surplus = fmin(proxy->surplus, now->energy);

    const double length = vector_length(way);
    if (!(length > proxy->slack)) return;
    const double over = fmax(brake_part * proxy->spacing, length);
    const double lack = fmax(ready_part * now->energy - proxy->surplus, 0);
    const double wanted = fmin(lack / over, vector_length(now->force));
    const double follow = fmin(length / (0.25 * brake_part * proxy->spacing), 1);
    for (int c = 0; c < 3; c++)
        proxy->brake[c] += follow * (wanted * way[c] / length - proxy->brake[c]);
}

static int32_t touch(pliant_proxy *proxy, const double *device, pliant_sliding_state *now)
{
    pliant_sliding_state before;
    if (proxy->is_pressed)
        pliant_sliding_look(&proxy->surface, &proxy->point, proxy->device, &before);
    const int32_t moved = pliant_sliding_move(&proxy->surface, &proxy->point, device, now);
    if (proxy->is_pressed) {
        settle(proxy, device, &before, now);
    } else {
        // As if pressed down to here from where it met the surface.
        proxy->surplus = 0;
        memset(proxy->brake, 0, sizeof proxy->brake);
    }
    proxy->is_pressed = now->press > 0;
    return moved;
}

// Through free space to the surface and over it, off it again and on, until the proxy is at the
// device or held back by a force. 1: it slid over the surface.
static int32_t move(pliant_proxy *proxy, const double *device, pliant_sliding_state *now)
{
    int32_t is_searched = !proxy->is_touching, moved = 0;
    double swept = is_searched ? find_swept(proxy) : 0;
    for (int32_t turn = 0;; turn++) {
        if (!proxy->is_touching) {
            if (!is_searched) swept = find_swept(proxy);
            is_searched = 1;
            approach(proxy, device, swept);
            swept = 0;
            if (!proxy->is_touching) return 0;
        }
        moved |= touch(proxy, device, now);
        if (proxy->is_pressed || turn == turn_limit) return moved;
        // Lifted off: on from where it was, on the surface as it is now.
        proxy->is_touching = 0;
        memcpy(proxy->position, now->place, sizeof proxy->position);
    }
}

static pliant_vec3 narrow(const double *v)
{
    return (pliant_vec3){(float)v[0], (float)v[1], (float)v[2]};
}

// A solve may take what the rest of the step leaves: what that took of late, and half more, but no
// more than half of all.
static int64_t leave_time(const pliant_proxy *proxy, int64_t deadline, int64_t begin)
{
    if (deadline == PLIANT_NEVER || deadline <= begin) return deadline;
    const int64_t rest = proxy->rest_ns * 3 / 2, half = (deadline - begin) / 2;
    return deadline - (rest < half ? rest : half);
}

// Up at once but not by more than twice, since a step may have been interrupted; down slowly.
static void note_rest(pliant_proxy *proxy, int64_t ns)
{
    const int64_t most = 2 * proxy->rest_ns + 1000;
    proxy->rest_ns = ns > most ? most : ns > proxy->rest_ns ? ns : (9 * proxy->rest_ns + ns) / 10;
}

pliant_status pliant_proxy_step(pliant_proxy *proxy, const double *position, int64_t deadline,
                                pliant_proxy_result *result)
{
    if (!position || !result || !isfinite(position[0]) || !isfinite(position[1]) ||
        !isfinite(position[2]))
        return PLIANT_ERR_ARGUMENT;
    const int64_t begin = pliant_clock_ns();
    pliant_solver *solver = proxy->solver;
    pliant_deformed *deformed = &proxy->deformed;
    pliant_load_list_clear(solver, &proxy->pressed);
    const pliant_status status = pliant_solver_solve(solver, leave_time(proxy, deadline, begin));
    if (status < 0) return status;
    const int64_t solved = pliant_clock_ns();
    pliant_deformed_begin(deformed);
    note_held(proxy);
    if (proxy->is_new && !proxy->is_placed)
        memcpy(proxy->position, position, sizeof proxy->position);
    pliant_sliding_state now = {0};
    const int32_t is_sliding = move(proxy, position, &now);
    memcpy(proxy->device, position, sizeof proxy->device);
    *result = (pliant_proxy_result){.face = -1};
    if (proxy->is_touching) {
        double force[3] = {0, 0, 0};
        for (int c = 0; c < 3 && proxy->is_pressed; c++) force[c] = now.force[c] + proxy->brake[c];
        press(proxy, force);
        pliant_solver_repeat(solver);
        const int32_t evaluated = deformed->evaluated_count;
        pliant_deformed_begin(deformed);
        // The ring once more rather than the face alone: the same vertices are the fast case.
        pliant_deformed_want_ring(deformed, proxy->point.face);
        pliant_deformed_evaluate(deformed, solver);
        deformed->evaluated_count += evaluated;
        double corners[3][3];
        pliant_deformed_corners(deformed, proxy->point.face, corners);
        vector_mix(proxy->point.weights, corners[0], proxy->position);
        result->face = proxy->point.face;
        for (int k = 0; k < 3; k++) result->weights[k] = (float)proxy->point.weights[k];
        result->normal = narrow(now.normal);
        result->force = narrow(force);
        result->depth = now.depth;
        result->energy = now.energy;
        result->brake = vector_length(proxy->brake);
        result->is_sliding = is_sliding;
    }
    memcpy(result->position, proxy->position, sizeof result->position);
    result->vertex_count = deformed->evaluated_count;
    const int64_t end = pliant_clock_ns();
    result->step_ns = end - begin;
    note_rest(proxy, end - solved);
    return status == PLIANT_OK && end > deadline ? PLIANT_LATE : status;
}

pliant_status pliant_proxy_place(pliant_proxy *proxy, const double *position)
{
    if (!position || !isfinite(position[0]) || !isfinite(position[1]) || !isfinite(position[2]))
        return PLIANT_ERR_ARGUMENT;
    pliant_load_list_clear(proxy->solver, &proxy->pressed);
    memcpy(proxy->position, position, sizeof proxy->position);
    proxy->is_touching = proxy->is_pressed = 0;
    proxy->is_new = proxy->is_placed = 1;
    return PLIANT_OK;
}
