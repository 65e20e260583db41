// world.c: bodies in a world: who is in it, and the step.
//
// A step: gravity, forces, shape matching and damping body by body (v += (g - x) / h + h a), the
// velocities of what is held, impulses among bodies, impulses of obstacles (last, so that nothing
// is pushed into them), motion x += h v and fracture, what is held put exactly where it belongs,
// what is inside obstacles moved out. Velocities before the motion are the only place where
// momentum changes hands; what is done to positions afterwards is bounded and leaves them alone.
#include "lattice/world.h"

#include "lattice/float_mode.h"
#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_STEP 1e-9f  // s; speeds of a cell per step must be floats
#define MOST_STEP  1e3f

// Impacts on obstacles slower than what gravity gives in so many steps are rest, not impacts.
#define BOUNCE_STEPS 4.0f

pliant_world_def pliant_world_default(void)
{
    return (pliant_world_def){.body_capacity = 256,
                              .particle_capacity = 65536,
                              .obstacle_capacity = 64,
                              .hold_capacity = 64,
                              .held_capacity = 4096,
                              .thread_count = 1,
                              .gravity = {0, 0, -9.81f},
                              .collision = PLIANT_COLLISION_BODIES | PLIANT_COLLISION_SURFACES,
                              .friction = 0.3f};
}

int32_t pliant_world_accepts(pliant_vec3 place)
{
    return fabsf(place.x) <= PLIANT_WORLD_EXTENT && fabsf(place.y) <= PLIANT_WORLD_EXTENT &&
           fabsf(place.z) <= PLIANT_WORLD_EXTENT;
}

static int32_t accepts_collision(int32_t collision, float friction)
{
    const int32_t all = PLIANT_COLLISION_BODIES | PLIANT_COLLISION_SELF | PLIANT_COLLISION_SURFACES;
    return (collision & ~all) == 0 && friction >= 0 && friction <= 10;
}

// ---- Life ----

static void lay_out(pliant_arena *arena, pliant_world *world, const pliant_world_def *def)
{
    pliant_crowd_lay_out(&world->crowd, arena, def->body_capacity, def->particle_capacity);
    pliant_obstacles_lay_out(&world->obstacles, arena, def->obstacle_capacity,
                             world->crowd.chunk_capacity);
    pliant_holds_lay_out(&world->holds, arena, def->hold_capacity, def->held_capacity);
    pliant_touches_lay_out(&world->touches, arena, def->body_capacity, def->particle_capacity);
    pliant_impulses_lay_out(&world->impulses, arena, &world->touches);
    PLIANT_TAKE(arena, world->alone, def->body_capacity);
}

static pliant_status check_def(const pliant_world_def *def, pliant_error *err)
{
    const struct {
        const char *name;
        int32_t value, least, most;
    } counts[] = {{"body_capacity", def->body_capacity, 1, 1 << 20},
                  {"particle_capacity", def->particle_capacity, 1, 1 << 26},
                  {"obstacle_capacity", def->obstacle_capacity, 0, 1 << 16},
                  {"hold_capacity", def->hold_capacity, 0, 1 << 20},
                  {"held_capacity", def->held_capacity, 0, 1 << 26},
                  {"thread_count", def->thread_count, 1, PLIANT_TEAM_LIMIT}};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
        if (counts[i].value < counts[i].least || counts[i].value > counts[i].most)
            return pliant_error_set(
                err, PLIANT_ERR_ARGUMENT, "world: %s: expected %d to %d, found %d", counts[i].name,
                (int)counts[i].least, (int)counts[i].most, (int)counts[i].value);
    if (!pliant_world_accepts(def->gravity))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "world: expected a finite gravity");
    if (!accepts_collision(def->collision, def->friction))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "world: expected collision bits of %d and friction 0 to 10, found "
                                "%d and %g",
                                7, (int)def->collision, (double)def->friction);
    return PLIANT_OK;
}

pliant_status pliant_world_create(const pliant_world_def *def, pliant_world **result,
                                  pliant_error *err)
{
    if (!result) return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "world: nowhere to put it");
    *result = NULL;
    const pliant_world_def usual = pliant_world_default();
    if (!def) def = &usual;
    pliant_status status = check_def(def, err);
    if (status < 0) return status;
    pliant_world *world = calloc(1, sizeof *world);
    if (!world) return pliant_error_set(err, PLIANT_ERR_MEMORY, "world: no memory");
    world->gravity = def->gravity;
    world->collision = def->collision;
    world->friction = def->friction;
    lay_out(&world->arena, world, def);
    status = pliant_arena_reserve(&world->arena, err);
    if (status < 0) goto done;
    lay_out(&world->arena, world, def);
    status = pliant_team_create(def->thread_count, &world->team, err);
done:
    if (status < 0) pliant_world_destroy(world);
    else *result = world;
    return status;
}

void pliant_world_destroy(pliant_world *world)
{
    if (!world) return;
    pliant_team_destroy(world->team);
    pliant_arena_release(&world->arena);
    free(world);
}

pliant_status pliant_world_add(pliant_world *world, pliant_body *body, pliant_error *err)
{
    if (!body) return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "world: expected a body");
    return pliant_crowd_add(&world->crowd, body, err);
}

pliant_status pliant_world_remove(pliant_world *world, pliant_body *body)
{
    const int32_t member = pliant_crowd_find(&world->crowd, body);
    if (member < 0) return PLIANT_ERR_MISSING;
    pliant_holds_forget(&world->holds, &world->crowd, member);
    pliant_crowd_remove(&world->crowd, member);
    return PLIANT_OK;
}

pliant_status pliant_world_set_gravity(pliant_world *world, pliant_vec3 acceleration)
{
    if (!pliant_world_accepts(acceleration)) return PLIANT_ERR_ARGUMENT;
    world->gravity = acceleration;
    return PLIANT_OK;
}

pliant_status pliant_world_set_collision(pliant_world *world, int32_t collision, float friction)
{
    if (!accepts_collision(collision, friction)) return PLIANT_ERR_ARGUMENT;
    world->collision = collision;
    world->friction = friction;
    return PLIANT_OK;
}

// ---- Obstacles ----

pliant_status pliant_world_set_obstacle(pliant_world *world, int32_t index,
                                        const pliant_obstacle *obstacle)
{
    if (index < 0 || index >= world->obstacles.capacity) return PLIANT_ERR_CAPACITY;
    if (!obstacle || !pliant_solid_accepts(obstacle)) return PLIANT_ERR_ARGUMENT;
    if (obstacle->kind != PLIANT_OBSTACLE_NONE &&
        !(pliant_world_accepts(obstacle->a) && pliant_world_accepts(obstacle->velocity)))
        return PLIANT_ERR_ARGUMENT;
    const pliant_solid solid = pliant_solid_make(obstacle);
    pliant_obstacles_set(&world->obstacles, index, &solid);
    return PLIANT_OK;
}

pliant_status pliant_world_move_obstacle(pliant_world *world, int32_t index, pliant_vec3 a,
                                         const float *rotation)
{
    if (index < 0 || index >= world->obstacles.capacity) return PLIANT_ERR_MISSING;
    pliant_solid *solid = &world->obstacles.solids[index];
    if (solid->kind == PLIANT_OBSTACLE_NONE) return PLIANT_ERR_MISSING;
    if (!pliant_world_accepts(a) || !pose_accepts(rotation)) return PLIANT_ERR_ARGUMENT;
    solid->target = pose_make(a, rotation ? rotation : solid->begin.q);
    solid->has_target = 1;
    return PLIANT_OK;
}

pliant_obstacle pliant_world_obstacle(const pliant_world *world, int32_t index)
{
    if (index < 0 || index >= world->obstacles.capacity)
        return (pliant_obstacle){.kind = PLIANT_OBSTACLE_NONE};
    return pliant_solid_tell(&world->obstacles.solids[index]);
}

// ---- Step ----

static void match(pliant_world *world, pliant_body *body)
{
    // The world's gravity on top of the body's own.
    const pliant_vec3 own = body->gravity, more = world->gravity;
    body->gravity = (pliant_vec3){own.x + more.x, own.y + more.y, own.z + more.z};
    pliant_body_match(body, world->dt);
    body->gravity = own;
}

static void match_alone(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_world *world = context;
    match(world, world->crowd.members[world->alone[task]].body);
}

static void move_alone(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    pliant_world *world = context;
    pliant_body_move(world->crowd.members[world->alone[task]].body, world->dt);
}

// Bodies with threads of their own one after another, the others side by side.
static void match_all(pliant_world *world)
{
    world->alone_count = 0;
    for (int32_t i = 0; i < world->crowd.member_count; i++) {
        pliant_body *body = world->crowd.members[i].body;
        if (body->team) match(world, body);
        else world->alone[world->alone_count++] = i;
    }
    pliant_team_run(world->team, world->alone_count, match_alone, world);
}

static void move_all(pliant_world *world)
{
    for (int32_t i = 0; i < world->crowd.member_count; i++)
        if (world->crowd.members[i].body->team)
            pliant_body_move(world->crowd.members[i].body, world->dt);
    pliant_team_run(world->team, world->alone_count, move_alone, world);
}

static int64_t lap(int64_t *last)
{
    const int64_t now = pliant_clock_ns(), taken = now - *last;
    *last = now;
    return taken;
}

static void step(pliant_world *world)
{
    pliant_world_report *report = &world->report;
    pliant_crowd *crowd = &world->crowd;
    const float dt = world->dt;
    const int64_t start = pliant_clock_ns();
    int64_t last = start;
    match_all(world);
    pliant_holds_aim(&world->holds, crowd, dt);
    report->match_ns = lap(&last);
    pliant_crowd_measure(crowd, world->team);
    pliant_touches_find(&world->touches, world->team, crowd, world->collision, dt);
    report->search_ns = lap(&last);
    pliant_impulses_apply(&world->impulses, world->team, &world->touches, world->friction);
    pliant_touches_put_back(&world->touches, world->team);
    report->contact_ns = lap(&last);
    const pliant_vec3 g = world->gravity;
    const float bounce = BOUNCE_STEPS * dt * sqrtf(g.x * g.x + g.y * g.y + g.z * g.z);
    report->obstacle_contact_count =
        pliant_obstacles_hold_off(&world->obstacles, world->team, crowd, dt, bounce);
    report->obstacle_ns = lap(&last);
    move_all(world);
    pliant_holds_arrive(&world->holds, crowd);
    pliant_obstacles_expel(&world->obstacles, world->team);
    report->move_ns = lap(&last);
    report->total_ns = last - start;
    report->body_count = crowd->member_count;
    report->particle_count = crowd->particle_count;
    report->held_count = world->holds.held_count;
    report->body_contact_count = world->touches.counts.bodies;
    report->self_contact_count = world->touches.counts.self;
    report->surface_contact_count = world->touches.counts.surfaces;
    report->narrowing = world->touches.narrowing;
}

pliant_status pliant_world_step(pliant_world *world, float dt)
{
    if (!(dt >= LEAST_STEP && dt <= MOST_STEP)) return PLIANT_ERR_ARGUMENT;
    world->dt = dt;
    const pliant_float_mode before = pliant_float_mode_flush();
    step(world);
    pliant_float_mode_set(before);
    return PLIANT_OK;
}

// ---- What a world tells ----

pliant_world_report pliant_world_last(const pliant_world *world)
{
    return world->report;
}

pliant_world_sum pliant_world_add_up(const pliant_world *world)
{
    pliant_world_sum sum = {0};
    double moment[3] = {0};
    for (int32_t i = 0; i < world->crowd.member_count; i++) {
        const pliant_body *body = world->crowd.members[i].body;
        for (int32_t p = 0; p < world->crowd.members[i].particle_count; p++) {
            const int32_t slot = body->lattice->slot[p];
            const int32_t lane = slot / (3 * PLIANT_LANES) * PLIANT_LANES + slot % PLIANT_LANES;
            const double mass = body->lattice->lane_mass[lane];
            double x[3], v[3];
            for (int c = 0; c < 3; c++) {
                x[c] = body->x[slot + PLIANT_LANES * c];
                v[c] = body->v[slot + PLIANT_LANES * c];
                moment[c] += mass * x[c];
                sum.momentum[c] += mass * v[c];
                sum.kinetic_energy += 0.5 * mass * v[c] * v[c];
            }
            sum.mass += mass;
            for (int c = 0; c < 3; c++) {
                const int d = (c + 1) % 3, e = (c + 2) % 3;
                sum.angular_momentum[c] += mass * (x[d] * v[e] - x[e] * v[d]);
            }
        }
    }
    const double g[3] = {world->gravity.x, world->gravity.y, world->gravity.z};
    for (int c = 0; c < 3; c++) {
        sum.potential_energy -= g[c] * moment[c];
        sum.centre[c] = sum.mass > 0 ? moment[c] / sum.mass : 0;
    }
    return sum;
}
