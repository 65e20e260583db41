// scene.c: executes the statements of a script that are about lattices, on a world of instances.
#include "scene.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct pliant_scene {
    const pliant_model *model;
    int32_t thread_count;
    pliant_instances *instances;
    pliant_actors *actors;
    pliant_world *world;  // NULL: not made yet
    pliant_body_def body;
    int32_t collision;  // PLIANT_COLLISION_ bits
    float friction;     // of bodies with each other
    pliant_vec3 gravity;
    int32_t *particles;  // [particles of an instance], scratch
    double momentum[3];  // of all, after the last step; kg m/s
    int has_momentum;    // 0: an impulse has changed it since
};

// ---- Life ----

pliant_status pliant_scene_create(const pliant_model *model, int32_t thread_count,
                                  pliant_scene **scene, pliant_error *err)
{
    pliant_scene *s = calloc(1, sizeof *s);
    if (!s) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a scene");
    s->model = model;
    s->thread_count = thread_count;
    s->body = pliant_body_default();
    s->collision = PLIANT_COLLISION_BODIES;
    pliant_status status = pliant_instances_create(model, &s->instances, err);
    if (status >= 0) status = pliant_actors_create(&s->actors, err);
    if (status >= 0) {
        s->particles =
            malloc((size_t)pliant_instances_particle_count(s->instances) * sizeof *s->particles);
        if (!s->particles)
            status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a scene");
    }
    if (status < 0) {
        pliant_scene_destroy(s);
        return status;
    }
    *scene = s;
    return PLIANT_OK;
}

void pliant_scene_destroy(pliant_scene *scene)
{
    if (!scene) return;
    pliant_world_destroy(scene->world);
    pliant_actors_destroy(scene->actors);
    pliant_instances_destroy(scene->instances);
    free(scene->particles);
    free(scene);
}

static pliant_status make_world(pliant_scene *scene, pliant_world **world, pliant_error *reason)
{
    const int32_t count = pliant_instances_count(scene->instances);
    const int64_t particles = (int64_t)count * pliant_instances_particle_count(scene->instances);
    pliant_world_def def = pliant_world_default();
    if (particles > INT32_MAX / 4)
        return pliant_error_set(
            reason, PLIANT_ERR_CAPACITY, "%d instances of %d particles: expected up to %d in all",
            (int)count, (int)pliant_instances_particle_count(scene->instances), INT32_MAX / 4);
    def.body_capacity = count;
    def.particle_capacity = (int32_t)particles;
    def.obstacle_capacity = PLIANT_OBSTACLE_LIMIT;
    def.hold_capacity = PLIANT_HOLD_LIMIT;
    def.held_capacity = (int32_t)particles;
    def.thread_count = scene->thread_count;
    def.gravity = scene->gravity;
    def.collision = scene->collision;
    def.friction = scene->friction;
    pliant_status status = pliant_world_create(&def, world, reason);
    for (int32_t i = 0; status >= 0 && i < count; i++)
        status = pliant_world_add(*world, pliant_instances_body(scene->instances, i), reason);
    return status;
}

pliant_status pliant_scene_prepare(pliant_scene *scene, pliant_error *reason)
{
    if (scene->world) return PLIANT_OK;
    pliant_status status = PLIANT_OK;
    pliant_world *world = NULL;
    if (!pliant_instances_is_populated(scene->instances))
        status = pliant_instances_populate(scene->instances, &scene->body, reason);
    if (status >= 0) status = make_world(scene, &world, reason);
    if (status < 0) {
        pliant_world_destroy(world);
        return status;
    }
    scene->world = world;
    pliant_actors_enter(scene->actors, world);
    return PLIANT_OK;
}

// ---- Words ----

static pliant_vec3 narrow(const double value[3])
{
    return (pliant_vec3){(float)value[0], (float)value[1], (float)value[2]};
}

static pliant_status check_instance(const pliant_scene *scene, const pliant_statement *statement,
                                    pliant_error *reason)
{
    const int32_t count = pliant_instances_count(scene->instances);
    if (statement->instance < count) return PLIANT_OK;
    return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "instance %lld of %d",
                            (long long)statement->instance, (int)count);
}

// By rest position.
static int32_t nearest_vertex(const pliant_model *model, int32_t count, const double position[3])
{
    const double *rest = pliant_model_positions(model);
    double least = INFINITY;
    int32_t nearest = 0;
    for (int32_t v = 0; v < count; v++) {
        double square = 0;
        for (size_t c = 0; c < 3; c++) {
            const double r = rest[3 * (size_t)v + c] - position[c];
            square += r * r;
        }
        if (!(square < least)) continue;
        least = square;
        nearest = v;
    }
    return nearest;
}

pliant_status pliant_scene_find_vertex(const pliant_scene *scene, const pliant_statement *statement,
                                       int32_t *vertex, pliant_error *reason)
{
    pliant_status status = check_instance(scene, statement, reason);
    if (status < 0) return status;
    const pliant_vertex_name *name = &statement->vertex;
    if (name->has_level)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "level %d: expected a vertex without a level, on a lattice",
                                (int)name->level);
    const int32_t count = pliant_instances_vertex_count(scene->instances);
    int32_t found = name->number;
    if (name->kind == PLIANT_VERTEX_NEAR) {
        found = nearest_vertex(scene->model, count, name->position);
    } else if (name->kind == PLIANT_VERTEX_SOURCE) {
        found = pliant_model_from_source(scene->model, name->number);
        if (found < 0)
            return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                    "source vertex %d is not in the model", (int)name->number);
    }
    if (found >= count)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "vertex %d of %d", (int)found,
                                (int)count);
    *vertex = (int32_t)statement->instance * count + found;
    return PLIANT_OK;
}

// The particles that a statement names, to scene->particles: *instance's, *count of them. The first
// is the one named or nearest, unless there is a radius.
static pliant_status find_particles(pliant_scene *scene, const pliant_statement *statement,
                                    int32_t *instance, int32_t *count, pliant_error *reason)
{
    pliant_status status = check_instance(scene, statement, reason);
    if (status >= 0) status = pliant_scene_prepare(scene, reason);
    if (status < 0) return status;
    *instance = (int32_t)statement->instance;
    *count = 1;
    const int32_t most = pliant_instances_particle_count(scene->instances);
    if (statement->vertex.kind == PLIANT_VERTEX_MODEL) {
        if (statement->vertex.number >= most)
            return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "particle %d of %d",
                                    (int)statement->vertex.number, (int)most);
        scene->particles[0] = statement->vertex.number;
        return PLIANT_OK;
    }
    const double *a = statement->vertex.position;
    const pliant_instance_place place =
        pliant_instances_nearest(scene->instances, statement->has_instance ? *instance : -1, a);
    *instance = place.instance;
    if (statement->scalar > 0)
        *count = pliant_instances_within(scene->instances, place.instance, a, a, statement->scalar,
                                         scene->particles);
    if (statement->scalar > 0 && *count > 0) return PLIANT_OK;
    scene->particles[0] = place.particle;
    *count = 1;
    return PLIANT_OK;
}

// ---- Statements ----

static pliant_status execute_hold(pliant_scene *scene, const pliant_statement *statement,
                                  pliant_error *reason)
{
    const int is_grab = statement->kind == PLIANT_STATEMENT_GRAB;
    const pliant_actor *actor = pliant_actors_find(scene->actors, statement->name);
    if (is_grab && actor && actor->kind != PLIANT_ACTOR_GRAB)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "%s is an obstacle or a bone: expected another name",
                                statement->name);
    if (!is_grab && (!actor || actor->kind == PLIANT_ACTOR_OBSTACLE))
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "no bone %s here: expected \"bone %s X Y Z\" before",
                                statement->name, statement->name);
    int32_t instance, count;
    pliant_status status = find_particles(scene, statement, &instance, &count, reason);
    if (status < 0) return status;
    pliant_body *body = pliant_instances_body(scene->instances, instance);
    if (is_grab) {
        // A grab of several is held where it was stated, one particle by itself.
        double point[3];
        if (statement->scalar > 0) memcpy(point, statement->vertex.position, sizeof point);
        else {
            const pliant_vec3 x =
                pliant_instances_position(scene->instances, instance, scene->particles[0]);
            point[0] = (double)x.x;
            point[1] = (double)x.y;
            point[2] = (double)x.z;
        }
        status = pliant_actors_put_hold(scene->actors, statement->name, PLIANT_ACTOR_GRAB, point,
                                        &actor, reason);
        if (status < 0) return status;
    }
    status = pliant_world_bind(scene->world, actor->index, body, scene->particles, count);
    return status < 0 ? pliant_error_set(reason, status, "%s: %s",
                                         pliant_statement_keyword(statement->kind, 0),
                                         pliant_status_name(status))
                      : PLIANT_OK;
}

static pliant_status execute_bone(pliant_scene *scene, const pliant_statement *statement,
                                  pliant_error *reason)
{
    if (pliant_actors_find(scene->actors, statement->name))
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "%s is there already: expected another name", statement->name);
    const pliant_status status = pliant_scene_prepare(scene, reason);
    if (status < 0) return status;
    const pliant_actor *actor;
    return pliant_actors_put_hold(scene->actors, statement->name, PLIANT_ACTOR_BONE,
                                  statement->value, &actor, reason);
}

static pliant_status execute_impulse(pliant_scene *scene, const pliant_statement *statement,
                                     pliant_error *reason)
{
    int32_t instance, count;
    pliant_status status = find_particles(scene, statement, &instance, &count, reason);
    if (status < 0) return status;
    const pliant_lattice *lattice = pliant_instances_lattice(scene->instances);
    pliant_body *body = pliant_instances_body(scene->instances, instance);
    double sum = 0;
    for (int32_t i = 0; i < count; i++)
        sum += pliant_lattice_particle_mass(lattice, scene->particles[i]);
    for (int32_t i = 0; status >= 0 && i < count; i++) {
        const int32_t p = scene->particles[i];
        const double share = pliant_lattice_particle_mass(lattice, p) / sum;
        const double part[3] = {share * statement->value[0], share * statement->value[1],
                                share * statement->value[2]};
        status = pliant_body_impulse(body, p, narrow(part));
    }
    scene->has_momentum = 0;
    return status < 0 ? pliant_error_set(reason, status, "impulse: %s", pliant_status_name(status))
                      : PLIANT_OK;
}

static pliant_status execute_obstacle(pliant_scene *scene, const pliant_statement *statement,
                                      pliant_error *reason)
{
    static const pliant_obstacle_kind kinds[] = {
        [PLIANT_SHAPE_SPHERE] = PLIANT_OBSTACLE_SPHERE,
        [PLIANT_SHAPE_PLANE] = PLIANT_OBSTACLE_PLANE,
        [PLIANT_SHAPE_CAPSULE] = PLIANT_OBSTACLE_CAPSULE,
        [PLIANT_SHAPE_BOX] = PLIANT_OBSTACLE_BOX,
    };
    pliant_obstacle o = pliant_obstacle_default(kinds[statement->shape]);
    const double *v = statement->value, *end = statement->end;
    o.friction = (float)statement->friction;
    o.a = narrow(v);
    o.radius = o.radius_b = (float)statement->scalar;
    switch (statement->shape) {
    case PLIANT_SHAPE_PLANE: {
        // Points with n.x = D, of which n D / |n|^2 is the nearest to the origin; hypot, so that no
        // length of n is too long or too short.
        const double length = hypot(hypot(v[0], v[1]), v[2]);
        const double n[3] = {v[0] / length, v[1] / length, v[2] / length};
        const double d = statement->scalar / length;
        const double point[3] = {d * n[0], d * n[1], d * n[2]};
        o.a = narrow(point);
        o.b = narrow(n);
        o.radius = o.radius_b = 1;
        break;
    }
    case PLIANT_SHAPE_BOX: {
        double middle[3], half[3];
        for (int c = 0; c < 3; c++) {
            middle[c] = v[c] / 2 + end[c] / 2;
            half[c] = end[c] / 2 - v[c] / 2;
        }
        o.a = narrow(middle);
        o.b = narrow(half);
        o.radius = o.radius_b = 1;
        break;
    }
    case PLIANT_SHAPE_CAPSULE:
        o.b = narrow(end);
        if (statement->has_taper) o.radius_b = (float)statement->taper;
        break;
    default:
        break;
    }
    return pliant_actors_put_obstacle(scene->actors, statement->name, &o, reason);
}

static pliant_status execute_collide(pliant_scene *scene, const pliant_statement *statement,
                                     pliant_error *reason)
{
    int32_t collision = PLIANT_COLLISION_NONE;
    if (statement->count & PLIANT_COLLIDE_SELF) collision |= PLIANT_COLLISION_SELF;
    if (statement->count & PLIANT_COLLIDE_BODIES) collision |= PLIANT_COLLISION_BODIES;
    if (statement->count & PLIANT_COLLIDE_SURFACES) collision |= PLIANT_COLLISION_SURFACES;
    const float friction = (float)statement->friction;
    pliant_status status = PLIANT_OK;
    if (scene->world) status = pliant_world_set_collision(scene->world, collision, friction);
    if (status < 0)
        return pliant_error_set(reason, status, "collide: %s", pliant_status_name(status));
    scene->collision = collision;
    scene->friction = friction;
    return PLIANT_OK;
}

static pliant_status set_gravity(pliant_scene *scene, const double value[3], pliant_error *reason)
{
    const pliant_vec3 gravity = narrow(value);
    pliant_status status = PLIANT_OK;
    if (scene->world) status = pliant_world_set_gravity(scene->world, gravity);
    if (status < 0)
        return pliant_error_set(reason, status, "gravity: %s", pliant_status_name(status));
    scene->gravity = gravity;
    return PLIANT_OK;
}

static pliant_status execute_damping(pliant_scene *scene, const pliant_statement *statement,
                                     pliant_error *reason)
{
    const float k = (float)statement->scalar;
    const int32_t interval = (int32_t)statement->count;
    const int32_t count = pliant_instances_is_populated(scene->instances)
                              ? pliant_instances_count(scene->instances)
                              : 0;
    pliant_status status = PLIANT_OK;
    for (int32_t i = 0; status >= 0 && i < count; i++) {
        pliant_body *body = pliant_instances_body(scene->instances, i);
        if (statement->kind == PLIANT_STATEMENT_DAMPING)
            status = pliant_body_set_damping(body, k, interval);
        else if (statement->kind == PLIANT_STATEMENT_RIGID_DAMPING)
            status = pliant_body_set_rigid_damping(body, k);
        else status = pliant_body_set_strain_limit(body, k);
    }
    // Only a strain limit is refused: to bodies that were made unbreakable.
    if (status < 0)
        return pliant_error_set(
            reason, status,
            "strain-limit: expected one before the first grab, impulse, bone or "
            "step as well: these bodies were made unbreakable");
    if (statement->kind == PLIANT_STATEMENT_DAMPING) {
        scene->body.damping = k;
        scene->body.damping_interval = interval;
    } else if (statement->kind == PLIANT_STATEMENT_RIGID_DAMPING) {
        scene->body.rigid_damping = k;
    } else {
        scene->body.strain_limit = k;
    }
    return PLIANT_OK;
}

static pliant_status execute_release(pliant_scene *scene, const pliant_statement *statement,
                                     pliant_error *reason)
{
    static const double zero[3] = {0, 0, 0};
    if (statement->vertex.kind != PLIANT_VERTEX_ALL)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "vertices of a lattice have no conditions: expected release all");
    pliant_actors_drop_all(scene->actors);
    return set_gravity(scene, zero, reason);
}

pliant_status pliant_scene_execute(pliant_scene *scene, const pliant_statement *statement,
                                   pliant_error *reason)
{
    const int32_t steps = (int32_t)statement->count;
    switch (statement->kind) {
    case PLIANT_STATEMENT_INSTANCES:
        return pliant_instances_place(scene->instances, statement, reason);
    case PLIANT_STATEMENT_DAMPING:
    case PLIANT_STATEMENT_RIGID_DAMPING:
    case PLIANT_STATEMENT_STRAIN_LIMIT:
        return execute_damping(scene, statement, reason);
    case PLIANT_STATEMENT_GRAB:
    case PLIANT_STATEMENT_BIND:
        return execute_hold(scene, statement, reason);
    case PLIANT_STATEMENT_BONE:
        return execute_bone(scene, statement, reason);
    case PLIANT_STATEMENT_LET:
        return pliant_actors_drop(scene->actors, statement->name, 1, reason);
    case PLIANT_STATEMENT_DROP:
        return pliant_actors_drop(scene->actors, statement->name, 0, reason);
    case PLIANT_STATEMENT_MOVE:
        return pliant_actors_move(scene->actors, statement->name, statement->value, steps, reason);
    case PLIANT_STATEMENT_TURN:
        return pliant_actors_turn(scene->actors, statement->name, statement->value,
                                  statement->scalar, steps, reason);
    case PLIANT_STATEMENT_IMPULSE:
        return execute_impulse(scene, statement, reason);
    case PLIANT_STATEMENT_OBSTACLE:
        return execute_obstacle(scene, statement, reason);
    case PLIANT_STATEMENT_COLLIDE:
        return execute_collide(scene, statement, reason);
    case PLIANT_STATEMENT_GRAVITY:
        return set_gravity(scene, statement->value, reason);
    case PLIANT_STATEMENT_RELEASE:
        return execute_release(scene, statement, reason);
    default:
        return pliant_error_set(
            reason, PLIANT_ERR_ARGUMENT,
            "%s is about Green's functions: this play is of a lattice, which knows obstacles, "
            "grab, impulse, bone (see --help)",
            pliant_statement_keyword(statement->kind, statement->shape));
    }
}

// ---- Steps ----

// What the change of momentum leaves for obstacles and holds: dp / dt - m g.
static pliant_vec3 find_force(pliant_scene *scene, const pliant_world_sum *sum, double dt)
{
    const double g[3] = {(double)scene->gravity.x, (double)scene->gravity.y,
                         (double)scene->gravity.z};
    double force[3];
    for (int c = 0; c < 3; c++) {
        force[c] = (sum->momentum[c] - scene->momentum[c]) / dt - sum->mass * g[c];
        scene->momentum[c] = sum->momentum[c];
    }
    scene->has_momentum = 1;
    return narrow(force);
}

pliant_status pliant_scene_step(pliant_scene *scene, double dt, pliant_scene_step_report *report,
                                pliant_error *reason)
{
    pliant_status status = pliant_scene_prepare(scene, reason);
    if (status < 0) return status;
    if (!scene->has_momentum) {
        const pliant_world_sum before = pliant_world_add_up(scene->world);
        memcpy(scene->momentum, before.momentum, sizeof scene->momentum);
    }
    const int64_t start = pliant_clock_ns();
    status = pliant_actors_advance(scene->actors);
    if (status >= 0) status = pliant_world_step(scene->world, (float)dt);
    if (status < 0) return pliant_error_set(reason, status, "%s", pliant_status_name(status));
    const int64_t stepped = pliant_clock_ns();
    pliant_instances_follow(scene->instances);
    const int64_t end = pliant_clock_ns();
    const pliant_world_report last = pliant_world_last(scene->world);
    const pliant_world_sum sum = pliant_world_add_up(scene->world);
    *report = (pliant_scene_step_report){
        .phase_ns = {[PLIANT_SCENE_PHASE_MATCH] = last.match_ns,
                     [PLIANT_SCENE_PHASE_OBSTACLES] = last.obstacle_ns,
                     [PLIANT_SCENE_PHASE_SEARCH] = last.search_ns,
                     [PLIANT_SCENE_PHASE_CONTACTS] = last.contact_ns,
                     [PLIANT_SCENE_PHASE_MOTION] = last.move_ns,
                     [PLIANT_SCENE_PHASE_SURFACE] = end - stepped,
                     [PLIANT_SCENE_PHASE_TOTAL] = end - start},
        .held_count = last.held_count,
        .force = find_force(scene, &sum, dt),
    };
    return PLIANT_OK;
}

// ---- What can be read ----

pliant_instances *pliant_scene_instances(const pliant_scene *scene)
{
    return scene->instances;
}

int32_t pliant_scene_obstacles(const pliant_scene *scene, pliant_obstacle *obstacles,
                               int32_t capacity)
{
    int32_t count, found = 0;
    const pliant_actor *list = pliant_actors_list(scene->actors, &count);
    for (int32_t i = 0; i < count; i++) {
        if (!list[i].is_present || list[i].kind != PLIANT_ACTOR_OBSTACLE) continue;
        if (found < capacity)
            obstacles[found] = scene->world ? pliant_world_obstacle(scene->world, list[i].index)
                                            : list[i].obstacle;
        found++;
    }
    return found;
}
