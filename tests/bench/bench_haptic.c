// bench_haptic.c: is a haptic step done within its millisecond, and how large a contact fits in
// one?
//
// usage: bench_haptic [--seconds T] MODEL.h5 ...      T: of every run, default 20
//
// For every model: (1) a proxy that presses, slides and lifts off all over the surface while a
// tool holds 30 vertices and moves; step after step, and paced at 1 kHz with a real-time priority
// where the system grants one; a graphics thread takes the newest solution and reconstructs the
// whole surface at 60 Hz. (2) The largest patch of s displaced vertices, moving on so that every
// step has another set, whose solve stays under a millisecond at the 99.99th percentile, with a
// deadline and without. Times in microseconds: of the clock, with whatever else the machine did
// meanwhile, and of the thread alone.
#include "bench.h"
#include "pliant/pliant.h"

#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

enum { held_count = 30, size_count = 12, sample_limit = 1 << 22 };
static const int32_t sizes[size_count] = {10, 20, 30, 40, 60, 80, 100, 130, 160, 200, 300, 400};
static const int64_t period_ns = 1000000, frame_ns = 16666667;
// A patch's steps at least, for a 99.99th percentile that is not the worst one.
enum { least_steps = 20000 };

// ---- Samples ----

typedef struct samples {
    int32_t count;
    float *us;  // shape [sample_limit]
} samples;

static samples samples_begin(void)
{
    samples s = {0, malloc(sample_limit * sizeof(float))};
    if (!s.us) require(PLIANT_ERR_MEMORY, NULL);
    memset(s.us, 0, sample_limit * sizeof(float));  // no page faults later
    return s;
}

static void samples_add(samples *s, int64_t ns)
{
    if (s->count < sample_limit) s->us[s->count++] = (float)ns * 1e-3f;
}

static int by_size(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double quantile(const samples *s, double q)
{
    const int32_t i = (int32_t)ceil(q * s->count) - 1;
    return s->count == 0 ? 0 : (double)s->us[i < 0 ? 0 : i];
}

static int64_t thread_ns(void)
{
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return time.tv_sec * INT64_C(1000000000) + time.tv_nsec;
}

static void samples_print(samples *s, const char *what)
{
    qsort(s->us, (size_t)s->count, sizeof *s->us, by_size);
    printf("  %-34s %8d %9.1f %9.1f %9.1f %9.1f\n", what, s->count, quantile(s, 0.5),
           quantile(s, 0.99), quantile(s, 0.9999), quantile(s, 1));
    s->count = 0;
}

// ---- Patches ----

typedef struct vertex_distance {
    double square;
    int32_t vertex;
} vertex_distance;

static int by_distance(const void *a, const void *b)
{
    const double x = ((const vertex_distance *)a)->square, y = ((const vertex_distance *)b)->square;
    return (x > y) - (x < y);
}

typedef struct bench {
    pliant_model *model;
    pliant_model_info info;
    double centre[3], radius[3], edge;  // of the free vertices' box; edge: root of the mean area
    vertex_distance *vertices;          // shape [free_count]
    double seconds;
    samples steps, own, late, frames;  // own: thread's times of the steps
} bench;

static void look_at_model(bench *b)
{
    const double *x = pliant_model_positions(b->model);
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double area = 0;
    int32_t count = 0;
    for (int32_t v = 0; v < b->info.vertex_count; v++) {
        area += pliant_model_area(b->model, v);
        if (pliant_model_is_free(b->model, v) != 1) continue;
        b->vertices[count++].vertex = v;
        for (int c = 0; c < 3; c++) {
            low[c] = fmin(low[c], x[3 * v + c]);
            high[c] = fmax(high[c], x[3 * v + c]);
        }
    }
    b->edge = sqrt(area / b->info.vertex_count);
    for (int c = 0; c < 3; c++) {
        b->centre[c] = 0.5 * (low[c] + high[c]);
        b->radius[c] = 0.5 * (high[c] - low[c]);
    }
}

// The free vertices by distance from a point.
static void sort_around(bench *b, const double *point)
{
    const double *x = pliant_model_positions(b->model);
    for (int32_t i = 0; i < b->info.free_count; i++) {
        const double *y = x + 3 * (size_t)b->vertices[i].vertex;
        b->vertices[i].square =
            pow(y[0] - point[0], 2) + pow(y[1] - point[1], 2) + pow(y[2] - point[2], 2);
    }
    qsort(b->vertices, (size_t)b->info.free_count, sizeof *b->vertices, by_distance);
}

// A point that goes around the body on a closed curve, `t` turns in.
static void point_at(const bench *b, double turns, double out, double *point)
{
    const double a = 6.283185307179586 * turns, s = 0.5 * sin(0.618 * a), r = out * sqrt(1 - s * s);
    const double direction[3] = {r * cos(a), r * sin(a), out * s};
    for (int c = 0; c < 3; c++) point[c] = b->centre[c] + b->radius[c] * direction[c];
}

// ---- (1) A proxy and a held tool ----

typedef struct graphics {
    pliant_solver *viewer;
    pliant_exchange *exchange;
    pliant_vec3 *u;
    int32_t finest;
    samples *frames;
    atomic_int is_done;
} graphics;

static void sleep_until(int64_t ns)
{
    const struct timespec to = {ns / 1000000000, ns % 1000000000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &to, NULL) != 0) continue;
}

static void *draw(void *argument)
{
    graphics *g = argument;
    for (int64_t next = pliant_clock_ns(); !atomic_load(&g->is_done); next += frame_ns) {
        sleep_until(next);
        const int64_t begin = pliant_clock_ns();
        if (pliant_solver_receive(g->viewer, g->exchange) != 1) continue;
        if (pliant_solver_surface(g->viewer, g->finest, g->u) < 0) continue;
        samples_add(g->frames, pliant_clock_ns() - begin);
    }
    return NULL;
}

typedef struct haptics {
    bench *b;
    pliant_solver *solver;
    pliant_proxy *proxy;
    pliant_exchange *exchange;
    int32_t held[held_count];
    int32_t touching, late, evaluated;
} haptics;

static void step(haptics *h, int64_t i)
{
    const double t = 1e-3 * (double)i;
    const pliant_vec3 u = {0, (float)(0.2 * h->b->edge * sin(9 * t)),
                           (float)(-0.5 * h->b->edge * (1 + sin(5 * t)))};
    for (int k = 0; k < held_count; k++)
        require(pliant_solver_displace(
                    h->solver, (pliant_node){h->b->info.finest_constraint_level, h->held[k]}, u),
                NULL);
    double device[3];
    // A turn in 10 s, in and out twice a second.
    point_at(h->b, 0.1 * t, 0.9 + 0.2 * sin(12.6 * t), device);
    pliant_proxy_result result;
    const int64_t own = thread_ns(), begin = pliant_clock_ns();
    const pliant_status status = pliant_proxy_step(h->proxy, device, begin + period_ns, &result);
    require(status, NULL);
    require(pliant_solver_publish(h->solver, h->exchange), NULL);
    samples_add(&h->b->steps, pliant_clock_ns() - begin);
    samples_add(&h->b->own, thread_ns() - own);
    h->touching += result.face >= 0;
    h->late += status == PLIANT_LATE;
    h->evaluated += result.vertex_count;
}

static void run_proxy(bench *b, int is_paced)
{
    pliant_error err = {""};
    pliant_solver_def def = pliant_solver_default(b->model);
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    haptics h = {.b = b};
    graphics g = {.frames = &b->frames, .finest = b->info.level_count - 1};
    require(pliant_solver_create(b->model, &def, &h.solver, &err), &err);
    require(pliant_solver_create(b->model, &def, &g.viewer, &err), &err);
    require(pliant_exchange_create(b->model, &def, &h.exchange, &err), &err);
    require(pliant_proxy_create(h.solver, NULL, &h.proxy, &err), &err);
    g.exchange = h.exchange;
    g.u = calloc((size_t)b->info.vertex_count, sizeof *g.u);
    if (!g.u) require(PLIANT_ERR_MEMORY, NULL);
    double point[3];
    point_at(b, 0.3, 1, point);
    sort_around(b, point);
    for (int k = 0, i = 0; k < held_count; i++)
        if (b->vertices[i].vertex <
            pliant_model_level_vertex_count(b->model, b->info.finest_constraint_level))
            h.held[k++] = b->vertices[i].vertex;
    for (int64_t i = 0; i < 200; i++) step(&h, i);  // caches, types
    pthread_t thread;
    if (pthread_create(&thread, NULL, draw, &g) != 0) require(PLIANT_ERR_MEMORY, NULL);
    b->steps.count = b->own.count = b->late.count = b->frames.count = 0;
    h.touching = h.late = h.evaluated = 0;
    // Back to back such a priority would be throttled: the kernel keeps 50 ms of every second.
    const struct sched_param priority = {.sched_priority = 20}, none = {0};
    const int is_real_time =
        is_paced && pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) == 0;

    const int64_t begin = pliant_clock_ns(), end = begin + (int64_t)(b->seconds * 1e9);
    int64_t i = 200;
    for (int64_t next = begin; pliant_clock_ns() < end && b->steps.count < sample_limit; i++) {
        if (is_paced) {
            next += period_ns;
            sleep_until(next);
        }
        step(&h, i);
        if (is_paced) samples_add(&b->late, pliant_clock_ns() - next);
    }
    if (is_real_time) (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &none);
    atomic_store(&g.is_done, 1);
    pthread_join(thread, NULL);
    const double count = b->steps.count;
    printf("  %s: in contact %.0f%%, %.1f vertices a step, %d steps late\n",
           is_real_time ? "paced at 1 kHz, real-time priority"
           : is_paced   ? "paced at 1 kHz, no real-time priority"
                        : "back to back",
           100 * h.touching / count, h.evaluated / count, h.late);
    samples_print(&b->steps, "step and publish");
    samples_print(&b->own, "of the thread alone");
    if (is_paced) samples_print(&b->late, "tick to published, with waking up");
    samples_print(&b->frames, "frame: receive, whole surface");
    free(g.u);
    pliant_proxy_destroy(h.proxy);
    pliant_exchange_destroy(h.exchange);
    pliant_solver_destroy(g.viewer);
    pliant_solver_destroy(h.solver);
}

// ---- (2) The largest patch ----

static void run_patch(bench *b, int32_t size, int has_deadline, double *largest)
{
    pliant_error err = {""};
    pliant_solver_def def = pliant_solver_default(b->model);
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    def.constraint_capacity = size;
    pliant_solver *solver = NULL;
    require(pliant_solver_create(b->model, &def, &solver, &err), &err);
    const int32_t level = b->info.finest_constraint_level;
    const int32_t limit = pliant_model_level_vertex_count(b->model, level);
    int32_t late = 0, changes = 0, factored = 0, before[400] = {0};
    double levels = 0;
    const int64_t end = pliant_clock_ns() + (int64_t)(b->seconds * 1e9 / 4);
    for (int64_t i = 0; pliant_clock_ns() < end && b->steps.count < least_steps; i++) {
        double point[3];
        point_at(b, 0.125 * b->edge / b->radius[0] / 6.28 * (double)i, 1, point);
        sort_around(b, point);
        int32_t patch[400], count = 0, changed = 0;
        for (int32_t k = 0; count < size && k < b->info.free_count; k++)
            if (b->vertices[k].vertex < limit) patch[count++] = b->vertices[k].vertex;
        for (int32_t k = 0, found; k < count; k++) {
            found = 0;
            for (int32_t j = 0; j < count && !found; j++) found = before[j] == patch[k];
            changed += !found;
        }
        memcpy(before, patch, sizeof before);
        if (changed == 0) continue;
        const int64_t own = thread_ns(), begin = pliant_clock_ns();
        pliant_solver_release_all(solver);
        for (int32_t k = 0; k < count; k++)
            require(pliant_solver_displace(solver, (pliant_node){level, patch[k]},
                                           (pliant_vec3){0, 0, (float)(-0.1 * b->edge)}),
                    NULL);
        const pliant_status status =
            pliant_solver_solve(solver, has_deadline ? begin + period_ns : PLIANT_NEVER);
        require(status, NULL);
        (void)pliant_solver_contact_force(solver);
        const int64_t ns = pliant_clock_ns() - begin, own_ns = thread_ns() - own;
        if (i < 50) continue;
        const pliant_solver_report report = pliant_solver_last(solver);
        samples_add(&b->steps, ns);
        samples_add(&b->own, own_ns);
        late += report.is_late;
        levels += report.level;
        factored += report.factored;
        changes += changed;
    }
    const double steps = b->steps.count;
    char what[80];
    snprintf(what, sizeof what, "s %3d%s: %.0f new, %.0f%% coarser", size,
             has_deadline ? " by deadline" : "", changes / steps, 100 * late / steps);
    samples_print(&b->steps, what);
    qsort(b->own.us, (size_t)b->own.count, sizeof *b->own.us, by_size);
    if (quantile(&b->own, 0.9999) < 1e-3 * (double)period_ns) *largest = fmax(*largest, size);
    samples_print(&b->own, "of the thread alone");
    if (late > 0) printf("  %-34s level %.2f of %d on average\n", "", levels / steps, level);
    pliant_solver_destroy(solver);
}

static void run(const char *path, double seconds)
{
    pliant_error err = {""};
    bench b = {.seconds = seconds};
    require(pliant_model_open(path, &b.model, &err), &err);
    b.info = pliant_model_describe(b.model);
    b.vertices = malloc((size_t)b.info.free_count * sizeof *b.vertices);
    if (!b.vertices) require(PLIANT_ERR_MEMORY, NULL);
    b.steps = samples_begin();
    b.own = samples_begin();
    b.late = samples_begin();
    b.frames = samples_begin();
    look_at_model(&b);
    printf("%s: %d vertices, %d constraints and a proxy\n", path, b.info.vertex_count, held_count);
    printf("  %-34s %8s %9s %9s %9s %9s\n", "", "samples", "median", "99%", "99.99%", "worst");
    run_proxy(&b, 0);
    run_proxy(&b, 1);
    double largest[2] = {0, 0};
    for (int has_deadline = 0; has_deadline < 2; has_deadline++)
        for (int i = 0; i < size_count && sizes[i] <= b.info.free_count; i++) {
            run_patch(&b, sizes[i], has_deadline, &largest[has_deadline]);
            // Hopeless, and slow to find out.
            if (!has_deadline && largest[0] < sizes[i] / 2) break;
        }
    printf("  largest s that holds 1 kHz (thread alone), another set every step: %.0f, with "
           "degradation "
           "%.0f\n",
           largest[0], largest[1]);
    free(b.steps.us);
    free(b.own.us);
    free(b.late.us);
    free(b.frames.us);
    free(b.vertices);
    pliant_model_close(b.model);
}

int main(int argc, char **argv)
{
    double seconds = 20;
    int first = 1;
    if (argc > 2 && strcmp(argv[1], "--seconds") == 0) {
        seconds = strtod(argv[2], NULL);
        first = 3;
    }
    if (first >= argc) return printf("no models given\n"), 0;
    // Pages stay in memory, if the system lets them.
    (void)!mlockall(MCL_CURRENT | MCL_FUTURE);
    for (int i = first; i < argc; i++) run(argv[i], seconds);
    return 0;
}
