// lattice.c: an example: drop two soft bodies on a plane.
//
// usage: lattice MODEL.h5 [SECONDS]
//
// The file has a lattice (pliant-precompute --lattice). Both bodies are instances of it, one above
// the other and turned; four times a second the height of their centres is printed.
#include <pliant/pliant.h>

#include <stdio.h>
#include <stdlib.h>

enum { body_count = 2, step_rate = 120, steps_per_line = 30 };

// Bodies above each other, twice their height apart, with a floor under the lowest.
static pliant_status set_up(const pliant_lattice *lattice, pliant_world *world,
                            pliant_body **bodies, pliant_error *err)
{
    const pliant_lattice_info info = pliant_lattice_describe(lattice);
    const float height = (float)(info.cell_size * (info.dims[2] - 1));
    pliant_obstacle ground = pliant_obstacle_default(PLIANT_OBSTACLE_PLANE);
    ground.a.z = pliant_lattice_positions(lattice)[2] - 0.5f * height;  // the first is the lowest
    pliant_status status = pliant_world_set_obstacle(world, 0, &ground);
    for (int i = 0; i < body_count && status >= 0; i++) {
        pliant_body_def def = pliant_body_default();
        def.position.z = 2 * height * (float)i;
        def.damping = 0.1f;
        if (i > 0) def.rotation[0] = 0.3f, def.rotation[3] = 0.954f;
        status = pliant_body_create(lattice, &def, &bodies[i], err);
        if (status >= 0) status = pliant_world_add(world, bodies[i], err);
    }
    return status;
}

int main(int argc, char **argv)
{
    if (argc < 2) return fprintf(stderr, "usage: lattice MODEL.h5 [SECONDS]\n"), 2;
    const double seconds = argc > 2 ? atof(argv[2]) : 3;
    pliant_error err = {""};
    pliant_model *model = NULL;
    pliant_lattice *lattice = NULL;
    pliant_world *world = NULL;
    pliant_body *bodies[body_count] = {NULL};
    pliant_status status = pliant_model_open(argv[1], &model, &err);
    if (status >= 0) status = pliant_lattice_create(model, 0, &lattice, &err);
    if (status >= 0) {
        pliant_world_def def = pliant_world_default();
        def.particle_capacity = body_count * pliant_lattice_describe(lattice).particle_count;
        status = pliant_world_create(&def, &world, &err);
    }
    if (status >= 0) status = set_up(lattice, world, bodies, &err);
    for (int step = 1; step <= seconds * step_rate && status >= 0; step++) {
        status = pliant_world_step(world, 1.0f / step_rate);
        if (status < 0 || step % steps_per_line != 0) continue;
        printf("%5.2f s", (double)step / step_rate);
        for (int i = 0; i < body_count; i++)
            printf("  %8.4f", pliant_body_measure(bodies[i]).centre[2]);
        const pliant_world_report report = pliant_world_last(world);
        printf("  %d contacts, %.0f us\n",
               (int)(report.obstacle_contact_count + report.body_contact_count +
                     report.surface_contact_count),
               1e-3 * (double)report.total_ns);
    }
    // What borrows goes first.
    pliant_world_destroy(world);
    for (int i = 0; i < body_count; i++) pliant_body_destroy(bodies[i]);
    pliant_lattice_destroy(lattice);
    pliant_model_close(model);
    if (status < 0) fprintf(stderr, "lattice: %s: %s\n", pliant_status_name(status), err.text);
    return status < 0;
}
