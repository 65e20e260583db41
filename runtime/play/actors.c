// actors.c: what acts on the bodies of a scene: obstacles, grabs and bones, and where they go.
#include "actors.h"

#include "pliant/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ACTOR_LIMIT = PLIANT_OBSTACLE_LIMIT + PLIANT_HOLD_LIMIT };

struct pliant_actors {
    pliant_world *world;  // NULL: not yet
    pliant_actor *list;   // [ACTOR_LIMIT]
    int32_t count;        // used so far, those that went included
};

static const char *const kind_names[] = {
    [PLIANT_ACTOR_OBSTACLE] = "an obstacle",
    [PLIANT_ACTOR_GRAB] = "a grab",
    [PLIANT_ACTOR_BONE] = "a bone",
};

// ---- Life ----

pliant_status pliant_actors_create(pliant_actors **actors, pliant_error *err)
{
    pliant_actors *a = calloc(1, sizeof *a);
    if (a) a->list = calloc(ACTOR_LIMIT, sizeof *a->list);
    if (!a || !a->list) {
        pliant_actors_destroy(a);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a scene");
    }
    *actors = a;
    return PLIANT_OK;
}

void pliant_actors_destroy(pliant_actors *actors)
{
    if (!actors) return;
    free(actors->list);
    free(actors);
}

void pliant_actors_enter(pliant_actors *actors, pliant_world *world)
{
    actors->world = world;
    for (int32_t i = 0; i < actors->count; i++) {
        const pliant_actor *a = &actors->list[i];
        if (a->is_present && a->kind == PLIANT_ACTOR_OBSTACLE)
            (void)!pliant_world_set_obstacle(world, a->index, &a->obstacle);
    }
}

const pliant_actor *pliant_actors_list(const pliant_actors *actors, int32_t *count)
{
    *count = actors->count;
    return actors->list;
}

static pliant_actor *find(const pliant_actors *actors, const char *name)
{
    for (int32_t i = 0; *name && i < actors->count; i++)
        if (actors->list[i].is_present && strcmp(actors->list[i].name, name) == 0)
            return &actors->list[i];
    return NULL;
}

const pliant_actor *pliant_actors_find(const pliant_actors *actors, const char *name)
{
    return find(actors, name);
}

// A free place in the list for an actor of a kind, with a number of its own in the world.
static pliant_actor *make_room(pliant_actors *actors, const char *name, pliant_actor_kind kind)
{
    const int is_obstacle = kind == PLIANT_ACTOR_OBSTACLE;
    const int32_t limit = is_obstacle ? PLIANT_OBSTACLE_LIMIT : PLIANT_HOLD_LIMIT;
    uint8_t taken[PLIANT_OBSTACLE_LIMIT] = {0};
    int32_t place = actors->count, index = 0;
    for (int32_t i = actors->count - 1; i >= 0; i--) {
        const pliant_actor *a = &actors->list[i];
        if (!a->is_present) place = i;
        else if ((a->kind == PLIANT_ACTOR_OBSTACLE) == is_obstacle) taken[a->index] = 1;
    }
    while (index < limit && taken[index]) index++;
    if (index == limit || place == ACTOR_LIMIT) return NULL;
    if (place == actors->count) actors->count++;
    pliant_actor *actor = &actors->list[place];
    *actor =
        (pliant_actor){.kind = kind, .is_present = 1, .index = index, .rotation = {0, 0, 0, 1}};
    snprintf(actor->name, sizeof actor->name, "%s", name);
    return actor;
}

// ---- Coming and going ----

pliant_status pliant_actors_put_obstacle(pliant_actors *actors, const char *name,
                                         const pliant_obstacle *obstacle, pliant_error *reason)
{
    pliant_actor *actor = find(actors, name);
    if (actor && actor->kind != PLIANT_ACTOR_OBSTACLE)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "%s is %s: expected another name for an obstacle", name,
                                kind_names[actor->kind]);
    const int is_new = !actor;
    if (is_new) actor = make_room(actors, name, PLIANT_ACTOR_OBSTACLE);
    if (!actor)
        return pliant_error_set(reason, PLIANT_ERR_CAPACITY, "more than %d obstacles at once",
                                PLIANT_OBSTACLE_LIMIT);
    pliant_status status = PLIANT_OK;
    if (actors->world) status = pliant_world_set_obstacle(actors->world, actor->index, obstacle);
    if (status < 0) {
        if (is_new) actor->is_present = 0;
        return pliant_error_set(reason, status, "obstacle: %s", pliant_status_name(status));
    }
    actor->obstacle = *obstacle;
    actor->position[0] = (double)obstacle->a.x;
    actor->position[1] = (double)obstacle->a.y;
    actor->position[2] = (double)obstacle->a.z;
    for (int c = 0; c < 4; c++) actor->rotation[c] = (double)obstacle->rotation[c];
    actor->move_steps = actor->turn_steps = 0;
    return PLIANT_OK;
}

pliant_status pliant_actors_put_hold(pliant_actors *actors, const char *name,
                                     pliant_actor_kind kind, const double position[3],
                                     const pliant_actor **actor, pliant_error *reason)
{
    pliant_actor *found = find(actors, name);
    if (found && found->kind != kind)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "%s is %s: expected another name",
                                name, kind_names[found->kind]);
    *actor = found;
    if (found) return PLIANT_OK;
    found = make_room(actors, name, kind);
    if (!found)
        return pliant_error_set(reason, PLIANT_ERR_CAPACITY, "more than %d grabs and bones at once",
                                PLIANT_HOLD_LIMIT);
    memcpy(found->position, position, sizeof found->position);
    const pliant_status status = pliant_world_set_hold(
        actors->world, found->index,
        (pliant_vec3){(float)position[0], (float)position[1], (float)position[2]}, NULL);
    if (status < 0) {
        found->is_present = 0;
        return pliant_error_set(reason, status, "grab: %s", pliant_status_name(status));
    }
    *actor = found;
    return PLIANT_OK;
}

static void remove_actor(pliant_actors *actors, pliant_actor *actor)
{
    static const pliant_obstacle none = {.kind = PLIANT_OBSTACLE_NONE};
    actor->is_present = 0;
    if (!actors->world) return;
    if (actor->kind == PLIANT_ACTOR_OBSTACLE)
        (void)!pliant_world_set_obstacle(actors->world, actor->index, &none);
    else (void)!pliant_world_let(actors->world, actor->index);
}

pliant_status pliant_actors_drop(pliant_actors *actors, const char *name, int holds_only,
                                 pliant_error *reason)
{
    pliant_actor *actor = find(actors, name);
    if (!actor)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT, "no %s here: expected %s", name,
                                holds_only ? "a grab or a bone" : "an obstacle, a grab or a bone");
    if (holds_only && actor->kind == PLIANT_ACTOR_OBSTACLE)
        return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                                "%s is an obstacle: \"drop %s\" takes it away", name, name);
    remove_actor(actors, actor);
    return PLIANT_OK;
}

void pliant_actors_drop_all(pliant_actors *actors)
{
    for (int32_t i = 0; i < actors->count; i++) {
        pliant_actor *actor = &actors->list[i];
        if (actor->is_present && (actor->kind != PLIANT_ACTOR_OBSTACLE || actor->name[0]))
            remove_actor(actors, actor);
    }
}

// ---- Motion ----

static pliant_status find_mover(pliant_actors *actors, const char *name, pliant_actor **actor,
                                pliant_error *reason)
{
    *actor = find(actors, name);
    if (*actor) return PLIANT_OK;
    return pliant_error_set(reason, PLIANT_ERR_ARGUMENT,
                            "no %s here: expected an obstacle, a grab or a bone", name);
}

pliant_status pliant_actors_move(pliant_actors *actors, const char *name, const double position[3],
                                 int32_t steps, pliant_error *reason)
{
    pliant_actor *actor;
    const pliant_status status = find_mover(actors, name, &actor, reason);
    if (status < 0) return status;
    memcpy(actor->goal, position, sizeof actor->goal);
    actor->move_steps = steps > 0 ? steps : 1;
    return PLIANT_OK;
}

pliant_status pliant_actors_turn(pliant_actors *actors, const char *name, const double axis[3],
                                 double degrees, int32_t steps, pliant_error *reason)
{
    pliant_actor *actor;
    const pliant_status status = find_mover(actors, name, &actor, reason);
    if (status < 0) return status;
    // hypot, so that no length of the axis is too long or too short.
    const double length = hypot(hypot(axis[0], axis[1]), axis[2]);
    for (int c = 0; c < 3; c++) actor->axis[c] = axis[c] / length;
    actor->angle = degrees * acos(-1.0) / 180;
    actor->turn_steps = steps > 0 ? steps : 1;
    return PLIANT_OK;
}

// rotation = (turn by angle about axis) * rotation, kept unit.
static void turn_by(double rotation[4], const double axis[3], double angle)
{
    const double s = sin(angle / 2), w = cos(angle / 2);
    const double t[3] = {s * axis[0], s * axis[1], s * axis[2]};
    const double *r = rotation;
    double q[4] = {
        w * r[0] + t[0] * r[3] + t[1] * r[2] - t[2] * r[1],
        w * r[1] + t[1] * r[3] + t[2] * r[0] - t[0] * r[2],
        w * r[2] + t[2] * r[3] + t[0] * r[1] - t[1] * r[0],
        w * r[3] - t[0] * r[0] - t[1] * r[1] - t[2] * r[2],
    };
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int c = 0; c < 4; c++) rotation[c] = q[c] / length;
}

static pliant_status advance_one(pliant_actors *actors, pliant_actor *actor)
{
    if (actor->move_steps > 0) {
        for (int c = 0; c < 3; c++)
            actor->position[c] += (actor->goal[c] - actor->position[c]) / actor->move_steps;
        actor->move_steps--;
    }
    if (actor->turn_steps > 0) {
        const double part = actor->angle / actor->turn_steps;
        turn_by(actor->rotation, actor->axis, part);
        actor->angle -= part;
        actor->turn_steps--;
    }
    const pliant_vec3 position = {(float)actor->position[0], (float)actor->position[1],
                                  (float)actor->position[2]};
    const float rotation[4] = {(float)actor->rotation[0], (float)actor->rotation[1],
                               (float)actor->rotation[2], (float)actor->rotation[3]};
    if (actor->kind != PLIANT_ACTOR_OBSTACLE)
        return pliant_world_move_hold(actors->world, actor->index, position, rotation);
    return pliant_world_move_obstacle(actors->world, actor->index, position, rotation);
}

pliant_status pliant_actors_advance(pliant_actors *actors)
{
    pliant_status status = PLIANT_OK;
    for (int32_t i = 0; status >= 0 && i < actors->count; i++) {
        pliant_actor *actor = &actors->list[i];
        if (!actor->is_present || (actor->move_steps == 0 && actor->turn_steps == 0)) continue;
        status = advance_one(actors, actor);
    }
    return status;
}
