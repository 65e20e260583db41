// bench_patch.c: what patches of mixed levels save against all vertices on the finest level, and
// how smoothly their nodes come and go.
//
// usage: bench_patch [MODEL.h5 ...]      default: a synthetic sphere, 642 vertices
// One thread; microseconds are medians. "fine" constrains every vertex of the patch on the finest
// level. Displacements are relative to the push, forces to the fine solution's.
#include "bench.h"
#include "synthetic_model.h"

#include "model.h"
#include "solver.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { patch_limit = 512, repeat_count = 21, place_count = 3 };
static const double tolerances[] = {0.2, 0.05, 0.01};

static double quantile(double *values, int count, double q)
{
    qsort(values, (size_t)count, sizeof *values, bench_compare);
    return values[(int)(q * (count - 1) + 0.5)];
}

static double distance(pliant_vec3 a, pliant_vec3 b)
{
    const double d[3] = {(double)a.x - (double)b.x, (double)a.y - (double)b.y,
                         (double)a.z - (double)b.z};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

// ---- Bodies and tools ----

typedef struct body {
    pliant_model *model;
    int32_t n, finest;
    const double *x;
    double spacing;  // mean edge of the finest level
} body;

// Vertices with displacements.
typedef struct contact {
    int32_t count;
    int32_t vertices[patch_limit];
    pliant_vec3 u[patch_limit];
} contact;

typedef enum shape { SHAPE_FLAT, SHAPE_ROUND, SHAPE_ROUGH, SHAPE_COUNT } shape;
static const char *const shape_names[] = {"flat", "round", "rough"};

static void outward(const body *b, int32_t vertex, double normal[3])
{
    const int32_t *faces = pliant_model_faces(b->model, b->finest);
    const int32_t face_count = pliant_model_level_face_count(b->model, b->finest);
    double sum[3] = {0};
    for (int32_t f = 0; f < face_count; f++) {
        const int32_t *v = faces + 3 * (size_t)f;
        if (v[0] != vertex && v[1] != vertex && v[2] != vertex) continue;
        double e[2][3];
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 3; c++)
                e[k][c] = b->x[3 * (size_t)v[k + 1] + c] - b->x[3 * (size_t)v[0] + c];
        for (int c = 0; c < 3; c++)
            sum[c] += e[0][(c + 1) % 3] * e[1][(c + 2) % 3] - e[0][(c + 2) % 3] * e[1][(c + 1) % 3];
    }
    const double size = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int c = 0; c < 3; c++) normal[c] = sum[c] / size;
}

// The free vertices nearest to a place, pushed in by `push` times: 1 everywhere, 1 to 1/2 from the
// middle to the edge, 1 +- 0.5 at random.
static contact press_at(const body *b, int32_t centre, int32_t count, shape kind, double push)
{
    contact c = {.count = 0};
    double squares[patch_limit], normal[3];
    outward(b, centre, normal);
    for (int32_t v = 0; v < b->n; v++) {
        if (pliant_model_is_free(b->model, v) != 1) continue;
        double square = 0;
        for (int k = 0; k < 3; k++)
            square += pow(b->x[3 * (size_t)v + k] - b->x[3 * (size_t)centre + k], 2);
        int32_t at = c.count < count ? c.count : count;
        while (at > 0 && squares[at - 1] > square) {
            if (at < count) squares[at] = squares[at - 1], c.vertices[at] = c.vertices[at - 1];
            at--;
        }
        if (at < count) squares[at] = square, c.vertices[at] = v;
        if (c.count < count) c.count++;
    }
    check_random random = {.state = (uint64_t)centre + 1};
    for (int32_t i = 0; i < c.count; i++) {
        const double part = kind == SHAPE_FLAT    ? 1
                            : kind == SHAPE_ROUND ? 1 - 0.5 * squares[i] / squares[c.count - 1]
                                                  : 0.5 + check_random_next(&random);
        c.u[i] = (pliant_vec3){(float)(-push * part * normal[0]), (float)(-push * part * normal[1]),
                               (float)(-push * part * normal[2])};
    }
    return c;
}

static pliant_solver *make_solver(const body *b, int32_t capacity)
{
    const pliant_solver_def def = {
        .constraint_capacity = capacity, .load_capacity = capacity, .cache_count = 4};
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    require(pliant_solver_create(b->model, &def, &solver, &err), &err);
    return solver;
}

static void solve_fine(const body *b, pliant_solver *solver, const contact *c)
{
    pliant_solver_release_all(solver);
    for (int32_t i = 0; i < c->count; i++)
        require(pliant_solver_displace(solver, (pliant_node){b->finest, c->vertices[i]}, c->u[i]),
                NULL);
    require(pliant_solver_solve(solver, PLIANT_NEVER), NULL);
}

static pliant_vec3 *surface(const body *b, pliant_solver *solver)
{
    pliant_vec3 *u = calloc((size_t)b->n, sizeof *u);
    if (!u) exit(fprintf(stderr, "bench_patch: no memory\n"));
    require(pliant_solver_surface(solver, b->finest, u), NULL);
    return u;
}

static pliant_patch *make_patch(pliant_solver *solver, double tolerance, double hysteresis,
                                int32_t blend_steps)
{
    const pliant_patch_def def = {.vertex_capacity = patch_limit,
                                  .tolerance = tolerance,
                                  .hysteresis = hysteresis,
                                  .blend_steps = blend_steps};
    pliant_patch *patch = NULL;
    pliant_error err = {""};
    require(pliant_patch_create(solver, &def, &patch, &err), &err);
    return patch;
}

// ---- A contact that comes and stays ----

// Of one contact, or the sum over places.
typedef struct rest {
    double come, rest, solves, level_count[16];
    double first_us, again_us, fine_first_us, fine_again_us;
    double force, outside;  // off by, relative to the fine solution's and the push
    double error;           // the largest
    int rough;
} rest;

static const pliant_vec3 nothing = {0, 0, 0};

// All on the finest level; returns the displacements.
static pliant_vec3 *rest_fine(const body *b, const contact *c, rest *r, pliant_vec3 *force)
{
    pliant_solver *solver = make_solver(b, c->count);
    double times[repeat_count], begin = now_us();
    solve_fine(b, solver, c);
    r->fine_first_us += now_us() - begin;
    for (int k = 0; k < repeat_count; k++) {
        begin = now_us();
        solve_fine(b, solver, c);
        times[k] = now_us() - begin;
    }
    r->fine_again_us += quantile(times, repeat_count, 0.5);
    *force = pliant_solver_contact_force(solver);
    pliant_vec3 *u = surface(b, solver);
    pliant_solver_destroy(solver);
    return u;
}

static void rest_patch(const body *b, const contact *c, double tolerance, double push, rest *r)
{
    pliant_vec3 fine_force;
    pliant_vec3 *fine = rest_fine(b, c, r, &fine_force);
    pliant_solver *solver = make_solver(b, c->count);
    pliant_patch *patch = make_patch(solver, tolerance * push, 2, 16);
    double times[repeat_count], begin = now_us();
    require(pliant_patch_set(patch, c->vertices, c->u, c->count), NULL);
    require(pliant_patch_solve(patch, PLIANT_NEVER), NULL);
    r->first_us += now_us() - begin;
    r->come += pliant_patch_last(patch).node_count;
    r->solves += pliant_patch_last(patch).solve_count;
    for (int k = 0; k < 200; k++) require(pliant_patch_solve(patch, PLIANT_NEVER), NULL);
    for (int k = 0; k < repeat_count; k++) {
        begin = now_us();
        require(pliant_patch_set(patch, c->vertices, c->u, c->count), NULL);
        const pliant_status status = pliant_patch_solve(patch, PLIANT_NEVER);
        times[k] = now_us() - begin;
        r->rough += status == PLIANT_ROUGH && k == 0;
    }
    r->again_us += quantile(times, repeat_count, 0.5);
    const pliant_patch_report report = pliant_patch_last(patch);
    r->rest += report.node_count;
    for (int l = 0; l <= b->finest; l++) r->level_count[l] += report.level_count[l];
    r->error = fmax(r->error, report.error / push);
    r->force += distance(pliant_patch_force(patch), fine_force) / distance(fine_force, nothing);
    pliant_vec3 *u = surface(b, solver);
    for (int32_t i = 0; i < c->count; i++) u[c->vertices[i]] = fine[c->vertices[i]];
    double most = 0;
    for (int32_t v = 0; v < b->n; v++) most = fmax(most, distance(u[v], fine[v]));
    r->outside += most / push;
    free(u);
    free(fine);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
}

static void print_rest(const body *b, int32_t size, shape kind, double tolerance, const rest *r)
{
    const double places = place_count;
    char list[64] = "";
    for (int l = 0, at = 0; l <= b->finest; l++)
        at += snprintf(list + at, sizeof list - (size_t)at, "%s%.0f", l ? "," : "",
                       r->level_count[l] / places);
    printf("%6d %-6s %4.0f%% | %4.0f %4.0f  %-17s | %6.0f (%2.0f) %5.1f | %11.0f %5.1f | %5.3f  "
           "%7.3f  "
           "%5.3f | %d\n",
           size, shape_names[kind], 100 * tolerance, r->come / places, r->rest / places, list,
           r->first_us / places, r->solves / places, r->again_us / places,
           r->fine_first_us / places, r->fine_again_us / places, r->force / places,
           r->outside / places, r->error, r->rough);
    fflush(stdout);
}

static void bench_rest(const body *b)
{
    static const int32_t sizes[] = {10, 30, 100, 300};
    printf("\nA patch that comes and stays (means of %d places): nodes when it comes and when it "
           "rests, of which by level;\n"
           "us of the first call (and its solves) and of one at rest, and of all vertices on the "
           "finest level; force and displacement outside off by\n"
           "  size shape   tol | come rest  levels            |  first       rest | fine: first  "
           "rest | force  outside  error | rough\n",
           place_count);
    const pliant_model_domain *d = &b->model->domains[PLIANT_DOMAIN_FREE];
    const double push = 2 * b->spacing;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (int kind = 0; kind < SHAPE_COUNT; kind++)
            for (size_t t = 0; t < sizeof tolerances / sizeof *tolerances; t++) {
                rest sum = {0};
                for (int place = 0; place < place_count; place++) {
                    const int32_t centre =
                        d->nodes[(int64_t)(place + 1) * d->count * 7 / 61 % d->count];
                    const contact c = press_at(b, centre, sizes[i], (shape)kind, push);
                    rest_patch(b, &c, tolerances[t], push, &sum);
                }
                print_rest(b, sizes[i], (shape)kind, tolerances[t], &sum);
            }
}

// ---- A contact that moves ----

// A scene: contacts one after the other.
typedef enum scene { SCENE_DEEPEN, SCENE_RIPPLE, SCENE_SLIDE_FLAT, SCENE_SLIDE_ROUND } scene;
static const char *const scene_names[] = {"deepening", "ripple", "sliding flat", "sliding round"};
enum { scene_count = 4, frame_count = 240 };

// Where the tool is: on a straight way past the middle, a tenth of an edge a frame.
static void place_tool(const body *b, int32_t start, double way, double place[3], double normal[3])
{
    outward(b, start, normal);
    // A tangent, the least component of the normal replaced.
    int least = 0;
    for (int c = 1; c < 3; c++)
        if (fabs(normal[c]) < fabs(normal[least])) least = c;
    double tangent[3] = {0};
    tangent[(least + 1) % 3] = -normal[(least + 2) % 3];
    tangent[(least + 2) % 3] = normal[(least + 1) % 3];
    const double size =
        sqrt(tangent[0] * tangent[0] + tangent[1] * tangent[1] + tangent[2] * tangent[2]);
    for (int c = 0; c < 3; c++) place[c] = b->x[3 * (size_t)start + c] + way * tangent[c] / size;
}

// All vertices within `radius` of a place (seen along the normal, and not on the other side) are
// pushed in: a flat tool by the push, a ball to its surface.
static contact press_tool(const body *b, const double place[3], const double normal[3],
                          double radius, double push, int is_ball)
{
    contact c = {.count = 0};
    // The surface's height under the middle of the tool.
    double top = -INFINITY;
    for (int32_t v = 0; v < b->n; v++) {
        double along = 0, square = 0;
        for (int k = 0; k < 3; k++) along += (b->x[3 * (size_t)v + k] - place[k]) * normal[k];
        for (int k = 0; k < 3; k++)
            square += pow(b->x[3 * (size_t)v + k] - place[k] - along * normal[k], 2);
        if (fabs(along) < 2 * radius && square < b->spacing * b->spacing) top = fmax(top, along);
    }
    const double ball = 4 * radius;
    for (int32_t v = 0; v < b->n && c.count < patch_limit; v++) {
        if (pliant_model_is_free(b->model, v) != 1) continue;
        double along = 0, square = 0;
        for (int k = 0; k < 3; k++) along += (b->x[3 * (size_t)v + k] - place[k]) * normal[k];
        for (int k = 0; k < 3; k++)
            square += pow(b->x[3 * (size_t)v + k] - place[k] - along * normal[k], 2);
        if (fabs(along) > 2 * radius || square > ball * ball) continue;
        const double in = is_ball ? along - (top - push + ball - sqrt(ball * ball - square))
                                  : (square < radius * radius ? push : 0);
        if (in <= 0) continue;
        c.vertices[c.count] = v;
        c.u[c.count++] = (pliant_vec3){(float)(-in * normal[0]), (float)(-in * normal[1]),
                                       (float)(-in * normal[2])};
    }
    return c;
}

static contact frame_of(const body *b, scene kind, int32_t start, int frame, double push)
{
    const double radius = 4 * b->spacing, part = (double)(frame + 1) / frame_count;
    double place[3], normal[3];
    place_tool(b, start,
               kind >= SCENE_SLIDE_FLAT ? (frame - frame_count / 2) * 0.05 * b->spacing : 0, place,
               normal);
    if (kind >= SCENE_SLIDE_FLAT)
        return press_tool(b, place, normal, radius, push, kind == SCENE_SLIDE_ROUND);
    contact c = press_tool(b, place, normal, (kind == SCENE_RIPPLE ? 1.5 : 1) * radius, push,
                           kind == SCENE_DEEPEN);
    double bump[3], ignored[3];
    place_tool(b, start, (part - 0.5) * 2 * radius, bump, ignored);
    for (int32_t i = 0; i < c.count; i++) {
        double square = 0;
        for (int k = 0; k < 3; k++) square += pow(b->x[3 * (size_t)c.vertices[i] + k] - bump[k], 2);
        const double scale =
            kind == SCENE_DEEPEN ? part : 0.4 + 0.6 * exp(-4 * square / (radius * radius));
        c.u[i].x *= (float)scale, c.u[i].y *= (float)scale, c.u[i].z *= (float)scale;
    }
    return c;
}

// How to meet a frame's contact.
typedef struct method {
    const char *name;
    int is_switch;  // one level for all: the coarsest that keeps the tolerance, found anew each
                    // frame
    double hysteresis;
    int32_t blend_steps;
} method;

// The whole patch on level l: its vertices of that level with that level's hats.
static double solve_level(const body *b, pliant_solver *solver, const contact *c, int32_t level,
                          pliant_vec3 *u)
{
    pliant_solver_release_all(solver);
    int32_t stated = 0;
    for (int32_t i = 0; i < c->count; i++)
        if (c->vertices[i] < pliant_model_level_vertex_count(b->model, level)) {
            require(pliant_solver_displace(solver, (pliant_node){level, c->vertices[i]}, c->u[i]),
                    NULL);
            stated++;
        }
    if (stated == 0) return INFINITY;
    require(pliant_solver_solve(solver, PLIANT_NEVER), NULL);
    require(pliant_solver_displacements(solver, c->vertices, c->count, u), NULL);
    double error = 0;
    for (int32_t i = 0; i < c->count; i++) error = fmax(error, distance(u[i], c->u[i]));
    return error;
}

// All frames of a scene, and the fine solution of each.
typedef struct sequence {
    contact frames[frame_count];
    pliant_vec3 *u[frame_count], force[frame_count];
    double us[frame_count], largest_force;
    double field_jump, force_jump;  // its own largest
} sequence;

static void play_fine(const body *b, scene kind, double push, sequence *s)
{
    const pliant_model_domain *d = &b->model->domains[PLIANT_DOMAIN_FREE];
    const int32_t start = d->nodes[(int64_t)d->count * 7 / 61];
    pliant_solver *solver = make_solver(b, patch_limit);
    s->largest_force = 0;
    for (int f = 0; f < frame_count; f++) {
        s->frames[f] = frame_of(b, kind, start, f, push);
        const double begin = now_us();
        solve_fine(b, solver, &s->frames[f]);
        s->us[f] = now_us() - begin;
        s->u[f] = surface(b, solver);
        s->force[f] = pliant_solver_contact_force(solver);
        s->largest_force = fmax(s->largest_force, distance(s->force[f], nothing));
    }
    pliant_solver_destroy(solver);
}

typedef struct played {
    double us[frame_count], field[frame_count], force[frame_count];
    double nodes, solves, error;
} played;

static pliant_vec3 difference(pliant_vec3 a, pliant_vec3 b)
{
    return (pliant_vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

// What frame f adds to the fine solution's change from the frame before, outside both patches.
static void note_jumps(const body *b, sequence *s, int f, const pliant_vec3 *u,
                       const pliant_vec3 *last, pliant_vec3 force_step, double push, played *p)
{
    uint8_t *is_inside = calloc((size_t)b->n, 1);
    if (!is_inside) exit(fprintf(stderr, "bench_patch: no memory\n"));
    for (int g = f - 1; g <= f; g++)
        for (int32_t i = 0; i < s->frames[g].count; i++) is_inside[s->frames[g].vertices[i]] = 1;
    for (int32_t v = 0; v < b->n; v++) {
        if (is_inside[v]) continue;
        const pliant_vec3 step = difference(u[v], last[v]);
        const pliant_vec3 fine_step = difference(s->u[f][v], s->u[f - 1][v]);
        p->field[f] = fmax(p->field[f], distance(step, fine_step) / push);
        s->field_jump = fmax(s->field_jump, distance(fine_step, nothing) / push);
    }
    const pliant_vec3 fine_step = difference(s->force[f], s->force[f - 1]);
    p->force[f] = distance(force_step, fine_step) / s->largest_force;
    s->force_jump = fmax(s->force_jump, distance(fine_step, nothing) / s->largest_force);
    free(is_inside);
}

// One frame; returns the force.
static pliant_vec3 play_frame(const body *b, const method *how, pliant_solver *solver,
                              pliant_patch *patch, const contact *c, double tolerance, played *p)
{
    static pliant_vec3 inside[patch_limit];
    double error = INFINITY;
    if (how->is_switch) {
        for (int32_t l = 0; l <= b->finest && error > tolerance; l++) {
            error = solve_level(b, solver, c, l, inside);
            p->solves++;
        }
        p->nodes += pliant_solver_constraint_count(solver);
        p->error = fmax(p->error, error);
        return pliant_solver_contact_force(solver);
    }
    require(pliant_patch_set(patch, c->vertices, c->u, c->count), NULL);
    require(pliant_patch_solve(patch, PLIANT_NEVER), NULL);
    const pliant_patch_report report = pliant_patch_last(patch);
    p->error = fmax(p->error, report.error);
    p->solves += report.solve_count;
    p->nodes += report.node_count;
    return pliant_patch_force(patch);
}

static void play(const body *b, const method *how, double tolerance, double push, sequence *s,
                 played *p)
{
    *p = (played){.nodes = 0};
    pliant_solver *solver = make_solver(b, patch_limit);
    pliant_patch *patch = make_patch(solver, tolerance, fmax(1, how->hysteresis), how->blend_steps);
    pliant_vec3 *last = NULL, last_force = nothing;
    for (int f = 0; f < frame_count; f++) {
        const double begin = now_us();
        const pliant_vec3 force = play_frame(b, how, solver, patch, &s->frames[f], tolerance, p);
        p->us[f] = now_us() - begin;
        pliant_vec3 *u = surface(b, solver);
        if (last) note_jumps(b, s, f, u, last, difference(force, last_force), push, p);
        free(last);
        last = u;
        last_force = force;
    }
    free(last);
    pliant_patch_destroy(patch);
    pliant_solver_destroy(solver);
}

static double mean(const double *values)
{
    double sum = 0;
    for (int f = 1; f < frame_count; f++) sum += values[f];
    return sum / (frame_count - 1);
}

static void bench_motion(const body *b)
{
    static const method methods[] = {
        {"level switch", 1, 0, 0}, {"hysteresis 2", 0, 2, 0}, {"2, blend 8", 0, 2, 8},
        {"2, blend 16", 0, 2, 16}, {"2, blend 32", 0, 2, 32}, {"4, blend 16", 0, 4, 16},
    };
    printf("\nA contact that moves: what the change from frame to frame has beyond the fine "
           "solution's, outside the patch\n(relative to the push) and of the force (to the "
           "largest); fine: the fine solution's own\n"
           "scene          tol  method        | nodes solves    us (fine) | field: max    99%%   "
           "mean  (fine max) | force: max    99%%   mean  (fine max) | error\n");
    const double push = 1.5 * b->spacing;
    static sequence s;
    static played p;
    for (int kind = 0; kind < scene_count; kind++) {
        s = (sequence){.largest_force = 0};
        play_fine(b, (scene)kind, push, &s);
        const double fine_us = quantile(s.us, frame_count, 0.5);
        for (size_t t = 0; t < 2; t++)
            for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
                play(b, &methods[m], tolerances[t] * push, push, &s, &p);
                const double mean_field = mean(p.field), mean_force = mean(p.force);
                printf("%-13s %3.0f%%  %-13s | %5.1f %6.2f %5.0f (%4.0f) | %10.4f %6.4f %6.4f  "
                       "(%.4f)   | %10.4f %6.4f %6.4f  (%.4f)   | %.3f\n",
                       scene_names[kind], 100 * tolerances[t], methods[m].name,
                       p.nodes / frame_count, p.solves / frame_count,
                       quantile(p.us, frame_count, 0.5), fine_us, quantile(p.field, frame_count, 1),
                       quantile(p.field, frame_count, 0.99), mean_field, s.field_jump,
                       quantile(p.force, frame_count, 1), quantile(p.force, frame_count, 0.99),
                       mean_force, s.force_jump, p.error / push);
                fflush(stdout);
            }
        for (int f = 0; f < frame_count; f++) free(s.u[f]);
    }
}

static int bench(const char *path)
{
    char own_path[64] = "";
    if (!path) {
        snprintf(own_path, sizeof own_path, "/tmp/pliant_bench_patch_%d.h5", (int)getpid());
        check_write_synthetic_levels(own_path, NULL, 3, 0.05, pliant_wavelet_default(),
                                     CHECK_FREE_BLOCK);
        path = own_path;
    }
    body b = {0};
    pliant_error err = {""};
    require(pliant_model_open(path, &b.model, &err), &err);
    if (own_path[0]) unlink(own_path);
    const pliant_model_info info = pliant_model_describe(b.model);
    b.n = info.vertex_count;
    b.finest = info.level_count - 1;
    b.x = pliant_model_positions(b.model);
    double area = 0;
    for (int32_t v = 0; v < b.n; v++) area += pliant_model_area(b.model, v);
    b.spacing = sqrt(area / b.n * 2 / sqrt(3));
    printf("%s: %d vertices, %d free, levels %d..%d stored of %d\n",
           own_path[0] ? "synthetic sphere" : path, b.n, info.free_count,
           info.coarsest_constraint_level, info.finest_constraint_level, info.level_count);
    if (info.finest_constraint_level < b.finest)
        return fprintf(stderr, "bench_patch: %s: expected the columns of level %d, found none\n",
                       path, b.finest),
               1;
    bench_rest(&b);
    bench_motion(&b);
    pliant_model_close(b.model);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc < 2) return bench(NULL);
    for (int i = 1; i < argc; i++)
        if (bench(argv[i]) != 0) return 1;
    return 0;
}
