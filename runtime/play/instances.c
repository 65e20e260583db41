// instances.c: the instances of a lattice that a scene plays with, and their embedded surfaces.
#include "instances.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double default_spacing = 1.1;  // bodies from one copy to the next, without `step`

typedef struct placement {
    pliant_vec3 position, velocity;  // of the model's origin, m; m/s
    float rotation[4];               // x, y, z, w
} placement;

struct pliant_instances {
    const pliant_model *model;
    pliant_lattice *lattice;
    pliant_lattice_info info;
    double centre[3], size[3];  // of the particles at rest: middle and extent, m
    int32_t vertex_count;

    placement *placements;  // [count]
    int32_t count;
    pliant_body **bodies;  // [count]; NULL: not made yet

    pliant_vec3 *displacements, *normals;  // [count][vertex_count]; before there are bodies [1]
    pliant_vec3 *positions;                // [vertex_count], scratch of one body
    pliant_vec3 *particles;                // [particle_count], scratch of one body
};

// ---- Life ----

static void measure(pliant_instances *instances)
{
    const float *rest = pliant_lattice_positions(instances->lattice);
    for (int c = 0; c < 3; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int32_t p = 0; p < instances->info.particle_count; p++) {
            low = fmin(low, (double)rest[3 * (size_t)p + (size_t)c]);
            high = fmax(high, (double)rest[3 * (size_t)p + (size_t)c]);
        }
        instances->centre[c] = (low + high) / 2;
        instances->size[c] = high - low;
    }
}

pliant_status pliant_instances_create(const pliant_model *model, pliant_instances **instances,
                                      pliant_error *err)
{
    pliant_instances *c = calloc(1, sizeof *c);
    if (!c) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a scene");
    c->model = model;
    pliant_status status = pliant_lattice_create(model, 0, &c->lattice, err);
    if (status < 0) goto refused;
    c->info = pliant_lattice_describe(c->lattice);
    measure(c);
    const int32_t finest = pliant_model_describe(model).level_count - 1;
    c->vertex_count = pliant_model_level_vertex_count(model, finest);
    const size_t n = (size_t)c->vertex_count;
    c->positions = malloc(n * sizeof *c->positions);
    c->particles = malloc((size_t)c->info.particle_count * sizeof *c->particles);
    c->displacements = calloc((size_t)c->vertex_count, sizeof *c->displacements);
    if (!c->positions || !c->particles || !c->displacements) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a scene of %d vertices",
                                  (int)n);
        goto refused;
    }
    *instances = c;
    return PLIANT_OK;
refused:
    pliant_instances_destroy(c);
    return status;
}

static void destroy_bodies(pliant_body **bodies, int32_t count)
{
    for (int32_t i = 0; bodies && i < count; i++) pliant_body_destroy(bodies[i]);
    free(bodies);
}

void pliant_instances_destroy(pliant_instances *instances)
{
    if (!instances) return;
    destroy_bodies(instances->bodies, instances->count);
    pliant_lattice_destroy(instances->lattice);
    free(instances->placements);
    free(instances->particles);
    free(instances->positions);
    free(instances->normals);
    free(instances->displacements);
    free(instances);
}

// ---- Placing ----

// SplitMix64 (Steele, Lea, Flood, 2014): the same seed, the same turns, on every machine.
static double next_random(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return (double)(z >> 11) * 0x1p-53;
}

// A uniform rotation (Shoemake, Uniform random rotations, Graphics Gems III, 1992).
static void turn_at_random(uint64_t *state, float rotation[4])
{
    const double turn = 2 * acos(-1.0), u = next_random(state);
    const double a = turn * next_random(state), b = turn * next_random(state);
    rotation[0] = (float)(sqrt(1 - u) * sin(a));
    rotation[1] = (float)(sqrt(1 - u) * cos(a));
    rotation[2] = (float)(sqrt(u) * sin(b));
    rotation[3] = (float)(sqrt(u) * cos(b));
}

// R x of a unit quaternion: x + 2 w (q x x) + 2 q x (q x x).
static void rotate(const float q[4], const double x[3], double turned[3])
{
    const double v[3] = {(double)q[0], (double)q[1], (double)q[2]}, w = (double)q[3];
    const double t[3] = {2 * (v[1] * x[2] - v[2] * x[1]), 2 * (v[2] * x[0] - v[0] * x[2]),
                         2 * (v[0] * x[1] - v[1] * x[0])};
    turned[0] = x[0] + w * t[0] + v[1] * t[2] - v[2] * t[1];
    turned[1] = x[1] + w * t[1] + v[2] * t[0] - v[0] * t[2];
    turned[2] = x[2] + w * t[2] + v[0] * t[1] - v[1] * t[0];
}

pliant_status pliant_instances_place(pliant_instances *instances, const pliant_statement *statement,
                                     pliant_error *reason)
{
    const pliant_copies *copies = &statement->copies;
    if (instances->bodies)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "instances after a step, grab, impulse or bind: expected before");
    if (statement->count > PLIANT_INSTANCE_LIMIT - instances->count)
        return pliant_error_set(reason, PLIANT_ERR_CAPACITY, "more than %d instances",
                                PLIANT_INSTANCE_LIMIT);
    const int64_t columns = copies->columns > 0 ? copies->columns : statement->count;
    const int64_t rows = copies->rows > 0 ? copies->rows : statement->count;
    const size_t total = (size_t)instances->count + (size_t)statement->count;
    placement *placements = realloc(instances->placements, total * sizeof *placements);
    if (!placements)
        return pliant_error_set(reason, PLIANT_ERR_MEMORY, "no memory for %zu instances", total);
    instances->placements = placements;
    uint64_t state = (uint64_t)copies->seed;
    for (int64_t k = 0; k < statement->count; k++) {
        placement *p = &placements[instances->count + k];
        const int64_t at[3] = {k % columns, k / columns % rows, k / columns / rows};
        *p = (placement){.rotation = {0, 0, 0, 1}};
        if (copies->seed >= 0) turn_at_random(&state, p->rotation);
        // Turned about the middle: R (x - c) + c.
        double turned[3], position[3];
        rotate(p->rotation, instances->centre, turned);
        for (int c = 0; c < 3; c++) {
            const double step =
                copies->has_step ? statement->end[c] : default_spacing * instances->size[c];
            position[c] =
                statement->value[c] + (double)at[c] * step + instances->centre[c] - turned[c];
            if (!(fabs(position[c]) <= 1e9))
                return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                        "instance %lld would stand at %g: expected up to 1e9",
                                        (long long)k, position[c]);
        }
        p->position = (pliant_vec3){(float)position[0], (float)position[1], (float)position[2]};
        p->velocity = (pliant_vec3){(float)copies->velocity[0], (float)copies->velocity[1],
                                    (float)copies->velocity[2]};
    }
    instances->count += (int32_t)statement->count;
    return PLIANT_OK;
}

pliant_status pliant_instances_populate(pliant_instances *instances, const pliant_body_def *def,
                                        pliant_error *reason)
{
    const size_t count = (size_t)pliant_instances_count(instances);
    pliant_body **bodies = calloc(count, sizeof *bodies);
    const size_t total = count * (size_t)instances->vertex_count;
    pliant_vec3 *displacements = calloc(total, sizeof *displacements);
    pliant_vec3 *normals = calloc(total, sizeof *normals);
    pliant_status status = PLIANT_OK;
    if (!bodies || !displacements || !normals || total > INT32_MAX)
        status = pliant_error_set(reason, PLIANT_ERR_MEMORY,
                                  "no memory for %zu instances of %d vertices", count,
                                  (int)instances->vertex_count);
    for (size_t i = 0; status >= 0 && i < count; i++) {
        pliant_body_def one = *def;
        if (instances->count > 0) {
            const placement *p = &instances->placements[i];
            one.position = p->position;
            one.velocity = p->velocity;
            memcpy(one.rotation, p->rotation, sizeof one.rotation);
        }
        status = pliant_body_create(instances->lattice, &one, &bodies[i], reason);
    }
    if (status < 0) {
        destroy_bodies(bodies, (int32_t)count);
        free(displacements);
        free(normals);
        return status;
    }
    free(instances->displacements);
    instances->displacements = displacements;
    instances->normals = normals;
    instances->bodies = bodies;
    instances->count = (int32_t)count;
    pliant_instances_follow(instances);
    return PLIANT_OK;
}

// ---- What can be read ----

int pliant_instances_is_populated(const pliant_instances *instances)
{
    return instances->bodies != NULL;
}

const pliant_lattice *pliant_instances_lattice(const pliant_instances *instances)
{
    return instances->lattice;
}

int32_t pliant_instances_count(const pliant_instances *instances)
{
    return instances->count > 0 ? instances->count : 1;
}

pliant_body *pliant_instances_body(const pliant_instances *instances, int32_t instance)
{
    return instances->bodies ? instances->bodies[instance] : NULL;
}

int32_t pliant_instances_surface_count(const pliant_instances *instances)
{
    return instances->bodies ? instances->count * instances->vertex_count : instances->vertex_count;
}

int32_t pliant_instances_vertex_count(const pliant_instances *instances)
{
    return instances->vertex_count;
}

int32_t pliant_instances_particle_count(const pliant_instances *instances)
{
    return instances->info.particle_count;
}

pliant_vec3 pliant_instances_position(const pliant_instances *instances, int32_t instance,
                                      int32_t particle)
{
    return pliant_body_position(instances->bodies[instance], particle);
}

pliant_instance_place pliant_instances_nearest(pliant_instances *instances, int32_t instance,
                                               const double position[3])
{
    pliant_instance_place found = {instance < 0 ? 0 : instance, 0};
    double least = INFINITY;
    const int32_t first = instance < 0 ? 0 : instance;
    const int32_t end = instance < 0 ? instances->count : instance + 1;
    for (int32_t i = first; i < end; i++) {
        pliant_body_positions(instances->bodies[i], instances->particles);
        for (int32_t p = 0; p < instances->info.particle_count; p++) {
            const double r[3] = {(double)instances->particles[p].x - position[0],
                                 (double)instances->particles[p].y - position[1],
                                 (double)instances->particles[p].z - position[2]};
            const double square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
            if (!(square < least)) continue;
            least = square;
            found = (pliant_instance_place){i, p};
        }
    }
    return found;
}

// Square of the distance of x from the segment from a to b.
static double square_from(const double x[3], const double a[3], const double b[3])
{
    double length = 0, along = 0, square = 0;
    for (int c = 0; c < 3; c++) {
        length += (b[c] - a[c]) * (b[c] - a[c]);
        along += (x[c] - a[c]) * (b[c] - a[c]);
    }
    const double t = length > 0 ? fmin(fmax(along / length, 0), 1) : 0;
    for (int c = 0; c < 3; c++) {
        const double r = x[c] - a[c] - t * (b[c] - a[c]);
        square += r * r;
    }
    return square;
}

int32_t pliant_instances_within(pliant_instances *instances, int32_t instance, const double a[3],
                                const double b[3], double radius, int32_t *particles)
{
    int32_t count = 0;
    pliant_body_positions(instances->bodies[instance], instances->particles);
    for (int32_t p = 0; p < instances->info.particle_count; p++) {
        const double x[3] = {(double)instances->particles[p].x, (double)instances->particles[p].y,
                             (double)instances->particles[p].z};
        if (square_from(x, a, b) <= radius * radius) particles[count++] = p;
    }
    return count;
}

void pliant_instances_follow(pliant_instances *instances)
{
    const double *rest = pliant_model_positions(instances->model);
    const size_t n = (size_t)instances->vertex_count;
    for (size_t i = 0; instances->bodies && i < (size_t)instances->count; i++) {
        pliant_vec3 *u = instances->displacements + i * n;
        // A file's lattice has a surface.
        (void)!pliant_body_surface(instances->bodies[i], instances->positions,
                                   instances->normals + i * n);
        for (size_t v = 0; v < n; v++) {
            const pliant_vec3 x = instances->positions[v];
            u[v] = (pliant_vec3){(float)((double)x.x - rest[3 * v]),
                                 (float)((double)x.y - rest[3 * v + 1]),
                                 (float)((double)x.z - rest[3 * v + 2])};
        }
    }
}

const pliant_vec3 *pliant_instances_displacements(const pliant_instances *instances)
{
    return instances->displacements;
}

const pliant_vec3 *pliant_instances_normals(const pliant_instances *instances)
{
    return instances->normals;
}

void pliant_instances_read_particles(pliant_instances *instances, pliant_vec3 *displacements)
{
    const float *rest = pliant_lattice_positions(instances->lattice);
    const size_t n = (size_t)instances->info.particle_count;
    for (size_t i = 0; instances->bodies && i < (size_t)instances->count; i++) {
        pliant_vec3 *u = displacements + i * n;
        pliant_body_positions(instances->bodies[i], u);
        for (size_t p = 0; p < n; p++)
            u[p] = (pliant_vec3){u[p].x - rest[3 * p], u[p].y - rest[3 * p + 1],
                                 u[p].z - rest[3 * p + 2]};
    }
}
