// haptic.c: an example: touch a model with a simulated haptic device, in two threads.
//
// usage: haptic MODEL.h5 [SECONDS]
//
// The haptic thread runs at 1 kHz: it moves the device, lets the proxy follow it and feels the
// force. A hand, a damped spring on a planned path, leads the device down onto the body, around
// and off again; with hardware, read the device's position there instead and send it the force. The
// graphics thread runs at 60 Hz: it takes the newest solution over and reconstructs the whole
// surface, which it would draw; here it prints four lines a second. Neither thread waits for
// the other, and nothing in their loops allocates.
#include <pliant/pliant.h>

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { haptic_rate = 1000, frame_rate = 60, frames_per_line = 15 };

typedef struct scene {
    pliant_model *model;
    pliant_solver *solver, *viewer;  // one for each thread
    pliant_proxy *proxy;
    pliant_exchange *exchange;
    pliant_vec3 *surface;  // displacements of all vertices, for the graphics thread
    double centre[3], radius[3], seconds;
    double stiffness;  // of hand and coupling
    atomic_int is_done;
    int32_t late_count;
    double largest_force, longest_us;
} scene;

static void sleep_until(int64_t ns)
{
    const struct timespec to = {ns / 1000000000, ns % 1000000000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &to, NULL) != 0) continue;
}

// Where the hand wants to be, `part` (0 .. 1) of the way: from outside in, once around, and out.
static void plan(const scene *s, double part, double *hand)
{
    const double angle = 6.283185307179586 * part;
    const double depth = 1.4 - 0.6 * fmin(1, 6 * fmin(part, 1 - part));
    hand[0] = s->centre[0] + depth * s->radius[0] * cos(angle);
    hand[1] = s->centre[1] + depth * s->radius[1] * sin(angle);
    hand[2] = s->centre[2] + 0.3 * s->radius[2];
}

static void *run_haptics(void *argument)
{
    scene *s = argument;
    // A device of a tenth of a second's period on the hand's spring, damped to 0.7 of critical.
    const double dt = 1.0 / haptic_rate, omega = 6.283185307179586 / 0.1;
    const double mass = s->stiffness / (omega * omega), damping = 1.4 * s->stiffness / omega;
    double position[3], velocity[3] = {0, 0, 0};
    plan(s, 0, position);
    const int64_t period = 1000000000 / haptic_rate;
    int64_t tick = pliant_clock_ns();
    const int32_t step_count = (int32_t)(s->seconds * haptic_rate);
    for (int32_t i = 0; i < step_count; i++, tick += period) {
        sleep_until(tick);
        pliant_proxy_result contact;
        const pliant_status status = pliant_proxy_step(s->proxy, position, tick + period, &contact);
        if (status < 0) break;
        if (pliant_solver_publish(s->solver, s->exchange) < 0) break;
        s->late_count += status == PLIANT_LATE;
        s->longest_us = fmax(s->longest_us, 1e-3 * (double)contact.step_ns);

        // The body gets the force, the device its opposite.
        const double force[3] = {(double)contact.force.x, (double)contact.force.y,
                                 (double)contact.force.z};
        double hand[3], square = 0;
        plan(s, (double)i / step_count, hand);
        for (int c = 0; c < 3; c++) {
            const double pull = s->stiffness * (hand[c] - position[c]);
            velocity[c] += dt / mass * (pull - damping * velocity[c] - force[c]);
            position[c] += dt * velocity[c];
            square += force[c] * force[c];
        }
        s->largest_force = fmax(s->largest_force, sqrt(square));
    }
    atomic_store(&s->is_done, 1);
    return NULL;
}

static void run_graphics(scene *s)
{
    const int32_t finest = pliant_model_describe(s->model).level_count - 1;
    const int32_t count = pliant_model_level_vertex_count(s->model, finest);
    const int64_t begin = pliant_clock_ns(), period = 1000000000 / frame_rate;
    printf("%8s %16s %12s\n", "time", "largest |u|", "frame");
    for (int64_t frame = 0; !atomic_load(&s->is_done); frame++) {
        sleep_until(begin + frame * period);
        const int64_t start = pliant_clock_ns();
        if (pliant_solver_receive(s->viewer, s->exchange) != 1) continue;
        if (pliant_solver_surface(s->viewer, finest, s->surface) < 0) continue;
        const int64_t end = pliant_clock_ns();
        if (frame % frames_per_line) continue;
        double largest = 0;
        for (int32_t v = 0; v < count; v++) {
            const pliant_vec3 u = s->surface[v];
            largest = fmax(largest, (double)u.x * (double)u.x + (double)u.y * (double)u.y +
                                        (double)u.z * (double)u.z);
        }
        printf("%7.2fs %16.4g %9.0f us\n", 1e-9 * (double)(end - begin), sqrt(largest),
               1e-3 * (double)(end - start));
    }
}

// The box of the free vertices.
static void measure(scene *s)
{
    const double *x = pliant_model_positions(s->model);
    for (int c = 0; c < 3; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int32_t v = 0; v < pliant_model_describe(s->model).vertex_count; v++) {
            if (pliant_model_is_free(s->model, v) != 1) continue;
            low = fmin(low, x[3 * v + c]);
            high = fmax(high, x[3 * v + c]);
        }
        s->centre[c] = 0.5 * (low + high);
        s->radius[c] = 0.5 * (high - low);
    }
}

// A model with geometric detail is felt with it: the detailed surface's normals are the normal map.
static pliant_status make_proxy(scene *s, pliant_error *err)
{
    pliant_proxy_def def = pliant_proxy_default(s->model);
    const pliant_model_info info = pliant_model_describe(s->model);
    s->stiffness = def.stiffness;
    pliant_vec3 *positions = NULL, *normals = NULL;
    pliant_detail *detail = NULL;
    if (pliant_detail_create(s->model, info.level_count - 1, &detail, NULL) >= 0) {
        const size_t count = (size_t)pliant_detail_describe(detail).vertex_count;
        positions = malloc(count * sizeof *positions);
        normals = malloc(count * sizeof *normals);
        // Its first vertices are the model's own.
        if (positions && normals &&
            pliant_detail_evaluate(detail, NULL, positions, normals) == PLIANT_OK)
            def.normals = &normals[0].x;
    }
    pliant_status status = pliant_proxy_create(s->solver, &def, &s->proxy, err);
    // A detail as steep as a wall is none for the fingertip.
    if (status == PLIANT_ERR_ARGUMENT && def.normals) {
        def.normals = NULL;
        status = pliant_proxy_create(s->solver, &def, &s->proxy, err);
    }
    free(positions);
    free(normals);
    pliant_detail_destroy(detail);
    return status;
}

static pliant_status open_scene(scene *s, const char *path, pliant_error *err)
{
    pliant_status status = pliant_model_open(path, &s->model, err);
    if (status < 0) return status;
    pliant_solver_def def = pliant_solver_default(s->model);
    // What is felt must not gain energy.
    def.compliance = PLIANT_COMPLIANCE_PASSIVE;
    status = pliant_solver_create(s->model, &def, &s->solver, err);
    if (status >= 0) status = pliant_solver_create(s->model, &def, &s->viewer, err);
    if (status >= 0) status = pliant_exchange_create(s->model, &def, &s->exchange, err);
    if (status >= 0) status = make_proxy(s, err);
    s->surface = malloc((size_t)pliant_model_describe(s->model).vertex_count * sizeof *s->surface);
    measure(s);
    return status < 0 || s->surface ? status : PLIANT_ERR_MEMORY;
}

static void close_scene(scene *s)
{
    pliant_proxy_destroy(s->proxy);
    pliant_exchange_destroy(s->exchange);
    pliant_solver_destroy(s->viewer);
    pliant_solver_destroy(s->solver);
    pliant_model_close(s->model);
    free(s->surface);
}

int main(int argc, char **argv)
{
    static scene s;
    pliant_error err = {"no memory"};
    char *end = NULL;
    s.seconds = argc == 3 ? strtod(argv[2], &end) : 5;
    if (argc < 2 || argc > 3 || (end && (end == argv[2] || *end)) ||
        !(s.seconds > 0 && s.seconds < 1e5)) {
        fprintf(stderr, "usage: haptic MODEL.h5 [SECONDS]\n");
        return 2;
    }
    if (open_scene(&s, argv[1], &err) < 0) {
        fprintf(stderr, "haptic: %s\n", err.text);
        close_scene(&s);
        return 1;
    }
    pthread_t thread;
    if (pthread_create(&thread, NULL, run_haptics, &s) != 0) {
        fprintf(stderr, "haptic: the system has no thread to give\n");
        close_scene(&s);
        return 1;
    }
    run_graphics(&s);
    pthread_join(thread, NULL);
    printf("largest force %.4g, longest step %.0f us, %d steps late\n", s.largest_force,
           s.longest_us, s.late_count);
    close_scene(&s);
    return 0;
}
