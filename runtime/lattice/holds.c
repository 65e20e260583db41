// holds.c: rigid frames that particles are bound to: hands and bones.
#include "lattice/holds.h"

void pliant_holds_lay_out(pliant_holds *holds, pliant_arena *arena, int32_t hold_capacity,
                          int32_t held_capacity)
{
    holds->hold_capacity = hold_capacity;
    holds->held_capacity = held_capacity;
    PLIANT_TAKE(arena, holds->holds, hold_capacity);
    PLIANT_TAKE(arena, holds->held, held_capacity);
}

// Take entry `at` out of the list: the last one gets its place.
static void release(pliant_holds *holds, pliant_crowd *crowd, int32_t at)
{
    const pliant_held gone = holds->held[at];
    holds->holds[gone.hold].particle_count--;
    crowd->held_by[gone.particle] = -1;
    holds->held_count--;
    if (at == holds->held_count) return;
    holds->held[at] = holds->held[holds->held_count];
    crowd->held_by[holds->held[at].particle] = at;
}

void pliant_holds_let(pliant_holds *holds, pliant_crowd *crowd, int32_t hold)
{
    for (int32_t at = holds->held_count - 1; at >= 0; at--)
        if (holds->held[at].hold == hold) release(holds, crowd, at);
    holds->holds[hold].is_present = 0;
}

void pliant_holds_set(pliant_holds *holds, pliant_crowd *crowd, int32_t hold,
                      const pliant_pose *pose)
{
    pliant_holds_let(holds, crowd, hold);
    holds->holds[hold] = (pliant_hold){.is_present = 1, .pose = *pose, .target = *pose};
}

void pliant_holds_bind(pliant_holds *holds, pliant_crowd *crowd, int32_t hold, int32_t particle)
{
    if (crowd->held_by[particle] >= 0) release(holds, crowd, crowd->held_by[particle]);
    const pliant_body *body = crowd->members[crowd->owner[particle]].body;
    const pliant_vec3 x = pliant_body_get(body->x, pliant_crowd_slot(crowd, particle));
    pliant_held *held = &holds->held[holds->held_count];
    held->particle = particle;
    held->hold = hold;
    pose_to_frame(&holds->holds[hold].pose, &x.x, held->offset);
    crowd->held_by[particle] = holds->held_count++;
    holds->holds[hold].particle_count++;
}

void pliant_holds_forget(pliant_holds *holds, pliant_crowd *crowd, int32_t member)
{
    const pliant_member *m = &crowd->members[member];
    const int32_t end = m->first + m->particle_count;
    for (int32_t at = holds->held_count - 1; at >= 0; at--) {
        const int32_t particle = holds->held[at].particle;
        if (particle >= m->first && particle < end) release(holds, crowd, at);
    }
    for (int32_t at = 0; at < holds->held_count; at++)
        if (holds->held[at].particle >= end) holds->held[at].particle -= m->particle_count;
}

static void find_target(const pliant_holds *holds, const pliant_held *held, float *x)
{
    pose_to_world(&holds->holds[held->hold].target, held->offset, x);
}

void pliant_holds_aim(pliant_holds *holds, const pliant_crowd *crowd, float dt)
{
    for (int32_t i = 0; i < holds->held_count; i++) {
        const pliant_held *held = &holds->held[i];
        const pliant_body *body = crowd->members[crowd->owner[held->particle]].body;
        const int32_t slot = pliant_crowd_slot(crowd, held->particle);
        float x[3];
        find_target(holds, held, x);
        for (int c = 0; c < 3; c++)
            body->v[slot + PLIANT_LANES * c] = (x[c] - body->x[slot + PLIANT_LANES * c]) / dt;
    }
}

void pliant_holds_arrive(pliant_holds *holds, const pliant_crowd *crowd)
{
    for (int32_t i = 0; i < holds->held_count; i++) {
        const pliant_held *held = &holds->held[i];
        const pliant_body *body = crowd->members[crowd->owner[held->particle]].body;
        pliant_vec3 x;
        find_target(holds, held, &x.x);
        pliant_body_set(body->x, pliant_crowd_slot(crowd, held->particle), x);
    }
    for (int32_t i = 0; i < holds->hold_capacity; i++)
        holds->holds[i].pose = holds->holds[i].target;
}
