// bench_tool.c: what a solve with a rigid tool takes, by the number of nodes that it pushes.
//
// usage: bench_tool MODEL.h5 ...   A ball as large as the model is pressed in beside the free
// vertex that is farthest from the held ones, until it pushes some 10, 30 and 100 nodes of the
// finest level, and then slides to and fro, a thousandth of the model's size a solve. Printed are
// medians in microseconds of the solves that had the compliance of their nodes and of those that
// needed another (a node came that was not watched), and the 99th percentile of all.
#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { frames = 600, target_count = 3 };
static const int32_t targets[target_count] = {10, 30, 100};

typedef struct place {
    double x[3], normal[3], along[3];
    double span;  // longest side of the model's box
} place;

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void scale_to_one(double *a)
{
    const double size = sqrt(dot(a, a));
    for (int c = 0; c < 3; c++) a[c] /= size > 0 ? size : 1;
}

static double square_distance(const double *a, const double *b)
{
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return dot(d, d);
}

// Where to press: the free vertex whose nearest held one is farthest, and its outward normal.
static place choose_place(const pliant_model *model)
{
    const pliant_model_info info = pliant_model_describe(model);
    const double *x = pliant_model_positions(model);
    place p = {.span = 0};
    int32_t best = 0;
    double most = -1;
    for (int32_t v = 0; v < info.vertex_count; v++) {
        if (pliant_model_is_free(model, v) != 1) continue;
        double nearest = INFINITY;
        for (int32_t w = 0; w < info.vertex_count; w++)
            if (pliant_model_is_free(model, w) == 0)
                nearest = fmin(nearest, square_distance(x + 3 * (size_t)v, x + 3 * (size_t)w));
        if (nearest > most) most = nearest, best = v;
    }
    memcpy(p.x, x + 3 * (size_t)best, sizeof p.x);
    const int32_t *faces = pliant_model_faces(model, info.level_count - 1);
    for (int32_t f = 0; f < info.face_count; f++) {
        const int32_t *face = faces + 3 * (size_t)f;
        if (face[0] != best && face[1] != best && face[2] != best) continue;
        double e[2][3];
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 3; c++)
                e[k][c] =
                    x[3 * (size_t)face[k + 1] + (size_t)c] - x[3 * (size_t)face[0] + (size_t)c];
        p.normal[0] += e[0][1] * e[1][2] - e[0][2] * e[1][1];
        p.normal[1] += e[0][2] * e[1][0] - e[0][0] * e[1][2];
        p.normal[2] += e[0][0] * e[1][1] - e[0][1] * e[1][0];
    }
    scale_to_one(p.normal);
    const int flat = fabs(p.normal[0]) < 0.6 ? 0 : 1;
    for (int c = 0; c < 3; c++) p.along[c] = (c == flat) - p.normal[flat] * p.normal[c];
    scale_to_one(p.along);
    for (int c = 0; c < 3; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int32_t v = 0; v < info.vertex_count; v++) {
            low = fmin(low, x[3 * (size_t)v + (size_t)c]);
            high = fmax(high, x[3 * (size_t)v + (size_t)c]);
        }
        p.span = fmax(p.span, high - low);
    }
    return p;
}

static pliant_tool ball_at(const place *p, double depth, double shift, double friction)
{
    const double radius = p->span;
    double a[3];
    for (int c = 0; c < 3; c++)
        a[c] = p->x[c] + (radius - depth) * p->normal[c] + shift * p->along[c];
    return (pliant_tool){.kind = PLIANT_TOOL_SPHERE,
                         .a = {(float)a[0], (float)a[1], (float)a[2]},
                         .radius = (float)radius,
                         .friction = (float)friction};
}

static double thread_us(void)
{
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (double)time.tv_sec * 1e6 + (double)time.tv_nsec * 1e-3;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double quantile(double *values, int32_t count, double part)
{
    if (count == 0) return 0;
    qsort(values, (size_t)count, sizeof *values, by_size);
    return values[(int32_t)(part * (count - 1))];
}

static pliant_status solve_at(pliant_contact *contact, const place *p, double depth, double shift,
                              double friction)
{
    const pliant_tool tool = ball_at(p, depth, shift, friction);
    const pliant_status status = pliant_contact_set_tool(contact, 0, &tool);
    return status < 0 ? status : pliant_contact_solve(contact, PLIANT_NEVER);
}

// The depth at which some `target` nodes are pushed, pressing on from `depth`.
static double press(pliant_contact *contact, const place *p, double depth, int32_t target)
{
    while (depth < 0.4 * p->span) {
        if (solve_at(contact, p, depth, 0, 0) < 0) break;
        if (pliant_contact_last(contact).node_count >= target) break;
        depth += 0.002 * p->span;
    }
    return depth;
}

static void slide(pliant_contact *contact, const place *p, double depth, double friction,
                  const char *levels)
{
    static double all[frames], same[frames], other[frames], law[frames], compliance[frames];
    int32_t same_count = 0, other_count = 0, changes = 0, coarsest = 99, finest = 0;
    double nodes = 0, watched = 0, passes = 0, trials = 0;
    for (int i = 0; i < frames; i++) {
        const double turn = fmod(i / 100.0, 2);
        const double shift = 0.1 * p->span * (turn < 1 ? turn : 2 - turn);
        const double begin = thread_us();
        if (solve_at(contact, p, depth, shift, friction) < 0) return;
        all[i] = thread_us() - begin;
        const pliant_contact_report r = pliant_contact_last(contact);
        law[i] = (double)r.law_ns / 1000;
        if (r.compliance_ns > 0) {
            compliance[other_count] = (double)r.compliance_ns / 1000;
            other[other_count++] = all[i];
        } else {
            same[same_count++] = all[i];
        }
        nodes += (double)r.node_count / frames;
        watched += (double)r.watched_count / frames;
        trials += (double)r.pivots / frames;
        passes += (double)r.iterations / frames;
        changes += r.refined + r.coarsened;
        if (r.coarsest_level >= 0 && r.coarsest_level < coarsest) coarsest = r.coarsest_level;
        if (r.finest_level > finest) finest = r.finest_level;
    }
    printf("  %-6s friction %.1f: %5.1f nodes, %5.1f watched, levels %d..%d, %2d changes, %.1f "
           "passes, %.0f sets or sweeps; %6.0f with the compliance known (law %.0f), %6.0f else in "
           "%3d (compliance "
           "%.0f); 99%% %.0f\n",
           levels, friction, nodes, watched, coarsest, finest, changes, passes, trials,
           quantile(same, same_count, 0.5), quantile(law, frames, 0.5),
           quantile(other, other_count, 0.5), other_count, quantile(compliance, other_count, 0.5),
           quantile(all, frames, 0.99));
}

static int bench(const char *path)
{
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    if (pliant_model_open(path, &model, &err) < 0)
        return fprintf(stderr, "bench_tool: %s\n", err.text), 1;
    pliant_solver_def solver_def = pliant_solver_default(model);
    solver_def.constraint_capacity = 160;
    solver_def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    if (pliant_solver_create(model, &solver_def, &solver, &err) < 0)
        return fprintf(stderr, "bench_tool: %s\n", err.text), 1;
    const place p = choose_place(model);
    printf("%s: %d vertices\n", path, pliant_model_describe(model).vertex_count);
    double depth = 0;
    for (int k = 0; k < target_count; k++) {
        pliant_contact_def def = pliant_contact_default(solver);
        def.node_capacity = 160;
        const int32_t coarsest = def.coarsest_level;
        for (int is_mixed = 0; is_mixed < 2; is_mixed++) {
            pliant_contact *contact = NULL;
            def.coarsest_level = is_mixed ? coarsest : def.finest_level;
            if (pliant_contact_create(solver, &def, &contact, &err) < 0)
                return fprintf(stderr, "bench_tool: %s\n", err.text), 1;
            depth = press(contact, &p, is_mixed ? depth : 0, is_mixed ? 1 : targets[k]);
            if (!is_mixed) printf(" depth %.3f of the model's size\n", depth / p.span);
            slide(contact, &p, depth, 0, is_mixed ? "mixed" : "finest");
            slide(contact, &p, depth, 0.3, is_mixed ? "mixed" : "finest");
            pliant_contact_destroy(contact);
        }
    }
    pliant_solver_destroy(solver);
    pliant_model_close(model);
    return 0;
}

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++)
        if (bench(argv[i]) != 0) return 1;
    if (argc < 2) printf("no models given\n");
    return 0;
}
