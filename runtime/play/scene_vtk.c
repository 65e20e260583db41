// scene_vtk.c: what --vtk writes of a lattice: the surfaces, and beside them obstacles and
// particles.
#include "scene_vtk.h"

#include "obstacle_mesh.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Points of several copies of one thing, and who they belong to.
typedef struct copies {
    int32_t point_count;  // of all
    double *rest;         // [point_count][3]
    int32_t *instance;    // [point_count]
} copies;

struct pliant_scene_vtk {
    const pliant_scene *scene;
    const char *folder;  // borrowed
    pliant_vtk_overwrite overwrite;
    pliant_vtk_series *surface, *particles, *obstacles;  // NULL: not written
    copies vertices, points;
    pliant_vec3 *moved;  // [points.point_count]
    pliant_obstacle *list;
    pliant_obstacle_mesh mesh;
    pliant_vec3 *still;  // [still_capacity]: obstacles are where they are
    int32_t still_capacity;
};

// ---- Life ----

static void destroy(pliant_scene_vtk *vtk)
{
    pliant_obstacle_mesh_clear(&vtk->mesh);
    free(vtk->still);
    free(vtk->list);
    free(vtk->moved);
    free(vtk->points.rest);
    free(vtk->points.instance);
    free(vtk->vertices.rest);
    free(vtk->vertices.instance);
    free(vtk);
}

void pliant_scene_vtk_abandon(pliant_scene_vtk *vtk)
{
    if (!vtk) return;
    pliant_vtk_series_abandon(vtk->obstacles);
    pliant_vtk_series_abandon(vtk->particles);
    pliant_vtk_series_abandon(vtk->surface);
    destroy(vtk);
}

static int allocate_copies(copies *c, int32_t count, int32_t copy_count)
{
    const size_t total = (size_t)count * (size_t)copy_count;
    c->point_count = (int32_t)total;
    c->rest = malloc(3 * total * sizeof *c->rest + 1);
    c->instance = malloc(total * sizeof *c->instance + 1);
    for (size_t i = 0; c->instance && i < total; i++) c->instance[i] = (int32_t)(i / (size_t)count);
    return c->rest && c->instance;
}

static pliant_status show_surfaces(pliant_scene_vtk *vtk, const pliant_model *model,
                                   pliant_error *err)
{
    const pliant_instances *instances = pliant_scene_instances(vtk->scene);
    const int32_t copy_count = pliant_instances_count(instances),
                  n = pliant_instances_vertex_count(instances);
    const int32_t finest = pliant_model_describe(model).level_count - 1;
    const int32_t face_count = pliant_model_level_face_count(model, finest);
    const int32_t *faces = pliant_model_faces(model, finest);
    const double *rest = pliant_model_positions(model);
    const size_t total = (size_t)face_count * (size_t)copy_count;
    int32_t *all = total <= INT32_MAX / 3 ? malloc(3 * total * sizeof *all + 1) : NULL;
    if (!all || !allocate_copies(&vtk->vertices, n, copy_count)) {
        free(all);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for %d instances",
                                vtk->folder, (int)copy_count);
    }
    for (int32_t i = 0; i < copy_count; i++) {
        memcpy(vtk->vertices.rest + 3 * (size_t)i * (size_t)n, rest, 3 * (size_t)n * sizeof *rest);
        for (size_t k = 0; k < 3 * (size_t)face_count; k++)
            all[3 * (size_t)i * (size_t)face_count + k] = faces[k] + i * n;
    }
    const pliant_vtk_mesh mesh = {.vertex_count = vtk->vertices.point_count,
                                  .face_count = (int32_t)total,
                                  .positions = vtk->vertices.rest,
                                  .faces = all,
                                  .instance = vtk->vertices.instance};
    const pliant_status status = pliant_vtk_series_remesh(vtk->surface, &mesh, err);
    free(all);
    return status;
}

static pliant_status show_particles(pliant_scene_vtk *vtk, pliant_error *err)
{
    const pliant_instances *instances = pliant_scene_instances(vtk->scene);
    const int32_t copy_count = pliant_instances_count(instances),
                  n = pliant_instances_particle_count(instances);
    const float *rest = pliant_lattice_positions(pliant_instances_lattice(instances));
    if (allocate_copies(&vtk->points, n, copy_count))
        vtk->moved = malloc((size_t)vtk->points.point_count * sizeof *vtk->moved);
    if (!vtk->moved)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for the particles",
                                vtk->folder);
    for (size_t i = 0; i < 3 * (size_t)vtk->points.point_count; i++)
        vtk->points.rest[i] = (double)rest[i % (3 * (size_t)n)];
    const pliant_vtk_series_def def = {.folder = vtk->folder,
                                       .overwrite = vtk->overwrite,
                                       .content = PLIANT_VTK_PARTICLES,
                                       .mesh = {.vertex_count = vtk->points.point_count,
                                                .positions = vtk->points.rest,
                                                .instance = vtk->points.instance}};
    return pliant_vtk_series_create(&def, &vtk->particles, err);
}

pliant_status pliant_scene_vtk_create(const pliant_model *model, const pliant_player *player,
                                      pliant_vtk_series *surface, const char *folder,
                                      pliant_vtk_overwrite overwrite,
                                      pliant_scene_vtk_particles particles, pliant_scene_vtk **vtk,
                                      pliant_error *err)
{
    pliant_scene_vtk *v = calloc(1, sizeof *v);
    if (v) v->list = malloc(PLIANT_OBSTACLE_LIMIT * sizeof *v->list);
    if (!v || !v->list) {
        pliant_vtk_series_abandon(surface);
        free(v);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", folder);
    }
    v->scene = pliant_player_scene(player);
    v->folder = folder;
    v->overwrite = overwrite;
    v->surface = surface;
    pliant_status status = show_surfaces(v, model, err);
    if (status >= 0 && particles == PLIANT_SCENE_VTK_PARTICLES) status = show_particles(v, err);
    if (status < 0) {
        pliant_scene_vtk_abandon(v);
        return status;
    }
    *vtk = v;
    return PLIANT_OK;
}

// ---- Steps ----

// What the surfaces take up now.
static void bound(const pliant_scene_vtk *vtk, const pliant_vec3 *u, double *low, double *high)
{
    for (int c = 0; c < 3; c++) {
        low[c] = INFINITY;
        high[c] = -INFINITY;
    }
    for (size_t v = 0; v < (size_t)vtk->vertices.point_count; v++) {
        const double *rest = vtk->vertices.rest + 3 * v;
        const double x[3] = {rest[0] + (double)u[v].x, rest[1] + (double)u[v].y,
                             rest[2] + (double)u[v].z};
        for (int c = 0; c < 3; c++) {
            low[c] = fmin(low[c], x[c]);
            high[c] = fmax(high[c], x[c]);
        }
    }
}

static pliant_status add_obstacles(pliant_scene_vtk *vtk, double time, const pliant_vec3 *u,
                                   pliant_error *err)
{
    double low[3], high[3];
    const int32_t count = pliant_scene_obstacles(vtk->scene, vtk->list, PLIANT_OBSTACLE_LIMIT);
    if (count == 0 && !vtk->obstacles) return PLIANT_OK;
    bound(vtk, u, low, high);
    pliant_status status = pliant_obstacle_mesh_make(&vtk->mesh, vtk->list, count, low, high, err);
    if (status < 0) return status;
    if (vtk->mesh.vertex_count > vtk->still_capacity) {
        free(vtk->still);
        vtk->still_capacity = vtk->mesh.vertex_count;
        vtk->still = calloc((size_t)vtk->still_capacity, sizeof *vtk->still);
        if (!vtk->still) {
            vtk->still_capacity = 0;
            return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", vtk->folder);
        }
    }
    const pliant_vtk_mesh mesh = {.vertex_count = vtk->mesh.vertex_count,
                                  .face_count = vtk->mesh.face_count,
                                  .positions = vtk->mesh.positions,
                                  .faces = vtk->mesh.faces};
    if (vtk->obstacles) {
        status = pliant_vtk_series_remesh(vtk->obstacles, &mesh, err);
    } else {
        const pliant_vtk_series_def def = {.folder = vtk->folder,
                                           .overwrite = vtk->overwrite,
                                           .content = PLIANT_VTK_OBSTACLES,
                                           .mesh = mesh};
        status = pliant_vtk_series_create(&def, &vtk->obstacles, err);
    }
    if (status < 0) return status;
    return pliant_vtk_series_add(vtk->obstacles, time, vtk->still, NULL, NULL, err);
}

pliant_status pliant_scene_vtk_add(pliant_scene_vtk *vtk, double time, pliant_error *err)
{
    pliant_instances *instances = pliant_scene_instances(vtk->scene);
    const pliant_vec3 *u = pliant_instances_displacements(instances);
    pliant_status status = pliant_vtk_series_add(vtk->surface, time, u, NULL,
                                                 pliant_instances_normals(instances), err);
    if (status >= 0 && vtk->particles) {
        pliant_instances_read_particles(instances, vtk->moved);
        status = pliant_vtk_series_add(vtk->particles, time, vtk->moved, NULL, NULL, err);
    }
    return status < 0 ? status : add_obstacles(vtk, time, u, err);
}

pliant_status pliant_scene_vtk_commit(pliant_scene_vtk *vtk, pliant_error *err)
{
    // Commit ends a series' life whatever it returns; those after a refusal are abandoned.
    pliant_vtk_series **const series[] = {&vtk->surface, &vtk->particles, &vtk->obstacles};
    pliant_status status = PLIANT_OK;
    for (int i = 0; i < 3; i++) {
        pliant_vtk_series *one = *series[i];
        *series[i] = NULL;
        if (!one) continue;
        if (status >= 0) status = pliant_vtk_series_commit(one, err);
        else pliant_vtk_series_abandon(one);
    }
    destroy(vtk);
    return status;
}
