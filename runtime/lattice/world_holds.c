// world_holds.c: what holds particles of a world, as the caller states it.
#include "lattice/world.h"

#include <math.h>

static int32_t is_present(const pliant_world *world, int32_t hold)
{
    return hold >= 0 && hold < world->holds.hold_capacity && world->holds.holds[hold].is_present;
}

pliant_status pliant_world_set_hold(pliant_world *world, int32_t hold, pliant_vec3 position,
                                    const float *rotation)
{
    if (hold < 0 || hold >= world->holds.hold_capacity) return PLIANT_ERR_CAPACITY;
    if (!pliant_world_accepts(position) || !pose_accepts(rotation)) return PLIANT_ERR_ARGUMENT;
    const pliant_pose pose = pose_make(position, rotation);
    pliant_holds_set(&world->holds, &world->crowd, hold, &pose);
    return PLIANT_OK;
}

pliant_status pliant_world_move_hold(pliant_world *world, int32_t hold, pliant_vec3 position,
                                     const float *rotation)
{
    if (!is_present(world, hold)) return PLIANT_ERR_MISSING;
    if (!pliant_world_accepts(position) || !pose_accepts(rotation)) return PLIANT_ERR_ARGUMENT;
    pliant_hold *h = &world->holds.holds[hold];
    h->target = pose_make(position, rotation ? rotation : h->target.q);
    return PLIANT_OK;
}

pliant_status pliant_world_let(pliant_world *world, int32_t hold)
{
    if (hold < 0 || hold >= world->holds.hold_capacity) return PLIANT_ERR_CAPACITY;
    pliant_holds_let(&world->holds, &world->crowd, hold);
    return PLIANT_OK;
}

pliant_hold_info pliant_world_hold(const pliant_world *world, int32_t hold)
{
    if (!is_present(world, hold)) return (pliant_hold_info){.particle_count = -1};
    const pliant_hold *h = &world->holds.holds[hold];
    return (pliant_hold_info){
        .position = {h->pose.p[0], h->pose.p[1], h->pose.p[2]},
        .rotation = {h->pose.q[0], h->pose.q[1], h->pose.q[2], h->pose.q[3]},
        .particle_count = h->particle_count,
    };
}

// ---- Binding ----

static int32_t room(const pliant_world *world)
{
    return world->holds.held_capacity - world->holds.held_count;
}

pliant_status pliant_world_bind(pliant_world *world, int32_t hold, pliant_body *body,
                                const int32_t *particles, int32_t count)
{
    const int32_t member = pliant_crowd_find(&world->crowd, body);
    if (!is_present(world, hold) || member < 0) return PLIANT_ERR_MISSING;
    const pliant_member *m = &world->crowd.members[member];
    int32_t new_count = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t p = particles ? particles[i] : i;
        if (p < 0 || p >= m->particle_count) return PLIANT_ERR_ARGUMENT;
        new_count += world->crowd.held_by[m->first + p] < 0;
    }
    if (new_count > room(world)) return PLIANT_ERR_CAPACITY;
    for (int32_t i = 0; i < count; i++)
        pliant_holds_bind(&world->holds, &world->crowd, hold,
                          m->first + (particles ? particles[i] : i));
    return PLIANT_OK;
}

static float square_distance(pliant_vec3 x, const float *y)
{
    const float d[3] = {x.x - y[0], x.y - y[1], x.z - y[2]};
    return pose_dot(d, d);
}

// A segment a + t along, t in 0 .. 1, and a radius.
typedef struct reach {
    float a[3], along[3], square;
    float radius;
} reach;

static int32_t is_reached(const reach *r, pliant_vec3 x)
{
    const float d[3] = {x.x - r->a[0], x.y - r->a[1], x.z - r->a[2]};
    const float t = r->square > 0 ? fminf(fmaxf(pose_dot(d, r->along) / r->square, 0), 1) : 0;
    const float foot[3] = {r->a[0] + t * r->along[0], r->a[1] + t * r->along[1],
                           r->a[2] + t * r->along[2]};
    return square_distance(x, foot) <= r->radius * r->radius;
}

static int32_t is_free(const pliant_world *world, int32_t particle, int32_t hold)
{
    const int32_t at = world->crowd.held_by[particle];
    return at < 0 || world->holds.held[at].hold == hold;
}

// How many of a member are reached, and how many of these nobody but `hold` (or -1) has.
static int32_t count_reached(const pliant_world *world, const pliant_member *m, const reach *r,
                             int32_t hold, int32_t *new_count)
{
    int32_t count = 0;
    *new_count = 0;
    for (int32_t p = 0; p < m->particle_count; p++) {
        if (!is_reached(r, pliant_body_get(m->body->x, m->body->lattice->slot[p]))) continue;
        *new_count += is_free(world, m->first + p, hold);
        count++;
    }
    return count;
}

static void bind_reached(pliant_world *world, int32_t hold, const pliant_member *m, const reach *r)
{
    for (int32_t p = 0; p < m->particle_count; p++)
        if (is_reached(r, pliant_body_get(m->body->x, m->body->lattice->slot[p])))
            pliant_holds_bind(&world->holds, &world->crowd, hold, m->first + p);
}

pliant_status pliant_world_bind_near(pliant_world *world, int32_t hold, pliant_body *body,
                                     pliant_vec3 a, pliant_vec3 b, float radius, int32_t *bound)
{
    const int32_t member = pliant_crowd_find(&world->crowd, body);
    if (!is_present(world, hold) || member < 0) return PLIANT_ERR_MISSING;
    if (!pliant_world_accepts(a) || !pliant_world_accepts(b) || !(radius >= 0))
        return PLIANT_ERR_ARGUMENT;
    const pliant_member *m = &world->crowd.members[member];
    reach r = {.a = {a.x, a.y, a.z}, .along = {b.x - a.x, b.y - a.y, b.z - a.z}, .radius = radius};
    r.square = pose_dot(r.along, r.along);
    int32_t new_count;
    const int32_t count = count_reached(world, m, &r, -1, &new_count);
    if (new_count > room(world)) return PLIANT_ERR_CAPACITY;
    bind_reached(world, hold, m, &r);
    if (bound) *bound = count;
    return PLIANT_OK;
}

pliant_status pliant_world_grab(pliant_world *world, int32_t hold, pliant_body *body,
                                pliant_vec3 position, float radius, int32_t *bound)
{
    const int32_t member = pliant_crowd_find(&world->crowd, body);
    if (member < 0) return PLIANT_ERR_MISSING;
    if (hold < 0 || hold >= world->holds.hold_capacity) return PLIANT_ERR_CAPACITY;
    if (!pliant_world_accepts(position) || !(radius >= 0)) return PLIANT_ERR_ARGUMENT;
    const pliant_member *m = &world->crowd.members[member];
    reach r = {.a = {position.x, position.y, position.z}, .radius = radius};
    int32_t new_count, nearest = -1;
    const int32_t count = count_reached(world, m, &r, hold, &new_count);
    // What the hold has now is let go first, which makes room.
    const int32_t freed = is_present(world, hold) ? world->holds.holds[hold].particle_count : 0;
    if (count == 0) {
        float least = INFINITY;
        for (int32_t p = 0; p < m->particle_count; p++) {
            const pliant_vec3 x = pliant_body_get(m->body->x, m->body->lattice->slot[p]);
            const float square = square_distance(x, r.a);
            if (nearest < 0 || square < least) least = square, nearest = p, position = x;
        }
        new_count = is_free(world, m->first + nearest, hold);
    }
    if (new_count > room(world) + freed) return PLIANT_ERR_CAPACITY;
    const pliant_pose pose = pose_make(position, NULL);
    pliant_holds_set(&world->holds, &world->crowd, hold, &pose);
    if (nearest < 0) bind_reached(world, hold, m, &r);
    else pliant_holds_bind(&world->holds, &world->crowd, hold, m->first + nearest);
    if (bound) *bound = nearest < 0 ? count : 1;
    return PLIANT_OK;
}
