// bench_world.c: what a step of a crowd takes, by phase.
//
// The paper's Figure 1: 150 bodies of 150 particles (4 x 4 x 5 cells), w = 2, fall on a plane among
// icicles (30 standing cones), without and with collisions of bodies, on one thread and on two.
// Printed are medians over steps, ns per particle, while they fall and when they lie in a heap: by
// phase on the clock, all together in processor time (of all threads), which a busy machine leaves
// as it is; and the contacts of the last step. The paper's P4 took 0.28 ms a penguin, 1867 ns per
// particle, without collisions of bodies.
#include "bench.h"

#include "lattice/lattice.h"
#include "pliant/regions.h"

#include <time.h>

enum { body_count = 150, particles = 150, cone_count = 30, steps = 60, phase_count = 7 };

static int64_t processor_ns(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static const char *phase_names[phase_count] = {"match",    "search", "contact",  "move",
                                               "obstacle", "all",    "processor"};

static pliant_lattice *lattice_of_150(void)
{
    int32_t cells[80][3], corners[80 * 8][3];
    for (int i = 0; i < 80; i++) cells[i][0] = i % 4, cells[i][1] = i / 4 % 4, cells[i][2] = i / 16;
    pliant_lattice_shape shape = {.dims = {5, 5, 6}, .cell_count = 80, .cells = cells[0]};
    shape.particle_count = pliant_lattice_particles(80, cells[0], corners[0]);
    shape.particles = corners[0];
    float mass[80 * 8];
    for (int i = 0; i < shape.particle_count; i++) mass[i] = 0.01f;
    pliant_error err = {""};
    pliant_regions *regions = NULL;
    require(pliant_regions_create(&shape, 2, &regions, &err), &err);
    const pliant_lattice_def def = {.shape = shape,
                                    .mass = mass,
                                    .regions = regions,
                                    .origin = {-0.2, -0.2, -0.25},
                                    .cell_size = 0.1,
                                    .component_count = 1};
    pliant_lattice *lattice = NULL;
    require(pliant_lattice_build(&def, &lattice, &err), &err);
    pliant_regions_destroy(regions);
    return lattice;
}

static void put_obstacles(pliant_world *world)
{
    pliant_obstacle ground = pliant_obstacle_default(PLIANT_OBSTACLE_PLANE);
    require(pliant_world_set_obstacle(world, 0, &ground), NULL);
    for (int i = 0; i < cone_count; i++) {
        pliant_obstacle cone = pliant_obstacle_default(PLIANT_OBSTACLE_CAPSULE);
        cone.a = (pliant_vec3){0.9f * (float)(i % 6) - 2.2f, 0.9f * (float)(i / 6) - 1.8f, 0};
        cone.b = (pliant_vec3){cone.a.x, cone.a.y, 0.8f};
        cone.radius = 0.15f;
        cone.radius_b = 0.02f;
        require(pliant_world_set_obstacle(world, 1 + i, &cone), NULL);
    }
}

static void measure(pliant_world *world, const char *when)
{
    static double phases[phase_count][steps];
    for (int i = 0; i < steps; i++) {
        const int64_t start = processor_ns();
        require(pliant_world_step(world, 1.0f / 60), NULL);
        const int64_t processor = processor_ns() - start;
        const pliant_world_report r = pliant_world_last(world);
        const int64_t ns[phase_count] = {r.match_ns,    r.search_ns, r.contact_ns, r.move_ns,
                                         r.obstacle_ns, r.total_ns,  processor};
        for (int k = 0; k < phase_count; k++)
            phases[k][i] = (double)ns[k] / (body_count * particles);
    }
    const pliant_world_report r = pliant_world_last(world);
    printf("    %-8s", when);
    for (int k = 0; k < phase_count; k++)
        printf("  %s %6.1f", phase_names[k], median(phases[k], steps));
    printf("   %d obstacle, %d ball, %d self, %d surface contacts\n", (int)r.obstacle_contact_count,
           (int)r.body_contact_count, (int)r.self_contact_count, (int)r.surface_contact_count);
}

static void run(const pliant_lattice *lattice, int32_t collision, const char *name,
                int32_t thread_count)
{
    pliant_error err = {""};
    pliant_world_def def = pliant_world_default();
    def.thread_count = thread_count;
    def.collision = collision;
    pliant_world *world = NULL;
    static pliant_body *bodies[body_count];
    require(pliant_world_create(&def, &world, &err), &err);
    put_obstacles(world);
    for (int i = 0; i < body_count; i++) {
        pliant_body_def body = pliant_body_default();
        body.position =
            (pliant_vec3){0.6f * (float)(i % 5) - 1.3f, 0.6f * (float)(i / 5 % 5) - 1.2f,
                          1.5f + 0.8f * (float)(i / 25)};
        body.damping = 0.1f;
        require(pliant_body_create(lattice, &body, &bodies[i], &err), &err);
        require(pliant_world_add(world, bodies[i], &err), &err);
    }
    printf("  %s, threads %d; ns per particle\n", name, (int)thread_count);
    measure(world, "falling");
    for (int i = 0; i < 4 * steps; i++) require(pliant_world_step(world, 1.0f / 60), NULL);
    measure(world, "lying");
    pliant_world_destroy(world);
    for (int i = 0; i < body_count; i++) pliant_body_destroy(bodies[i]);
}

int main(void)
{
    setvbuf(stdout, NULL, _IOLBF, 0);
    pliant_lattice *lattice = lattice_of_150();
    printf("%d bodies of %d particles, w = 2, damped every step, %d cones on a plane\n", body_count,
           (int)pliant_lattice_describe(lattice).particle_count, cone_count);
    for (int32_t threads = 1; threads <= 2; threads++) {
        run(lattice, PLIANT_COLLISION_NONE, "obstacles alone", threads);
        run(lattice, PLIANT_COLLISION_BODIES, "and balls", threads);
        run(lattice, PLIANT_COLLISION_SURFACES, "and surfaces", threads);
        run(lattice, PLIANT_COLLISION_BODIES | PLIANT_COLLISION_SURFACES, "and both", threads);
        run(lattice, PLIANT_COLLISION_BODIES | PLIANT_COLLISION_SURFACES | PLIANT_COLLISION_SELF,
            "and themselves", threads);
    }
    pliant_lattice_destroy(lattice);
    return 0;
}
