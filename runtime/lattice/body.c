// body.c: one instance of a lattice: its state, and the step that the phases make up.
#include "lattice/body.h"

#include "lattice/columns.h"
#include "lattice/damping.h"
#include "lattice/float_mode.h"
#include "lattice/plates.h"
#include "lattice/window.h"
#include "pliant/error.h"
#include "pliant/vector_clones.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Life ----

static void lay_out_scratch(pliant_arena *arena, const pliant_lattice *lattice, int32_t regions,
                            pliant_scratch *scratch)
{
    const int32_t w = lattice->half_width;
    int32_t longest = 0, most_rows = 1;
    for (int32_t c = 0; c < lattice->column_count; c++)
        if (lattice->columns[c].length > longest) longest = lattice->columns[c].length;
    for (int32_t z = 0; z < lattice->dims[2]; z++) {
        const int32_t *rows = lattice->slab_rows + 2 * z;
        if (rows[1] - rows[0] > most_rows) most_rows = rows[1] - rows[0];
    }
    const size_t length = pliant_row_length(lattice->row_blocks);
    const int32_t strip = (longest > lattice->dims[1] ? longest : lattice->dims[1]) + 4 * w;
    PLIANT_TAKE(arena, scratch->rows, 6 * length * most_rows);
    PLIANT_TAKE(arena, scratch->bars,
                (size_t)lattice->row_blocks * lattice->dims[1] * 6 * PLIANT_LANES + 3 * length);
    PLIANT_TAKE(arena, scratch->goals, (size_t)most_rows * 3 * lattice->row_blocks * PLIANT_LANES);
    PLIANT_TAKE(arena, scratch->tails, pliant_window_tails(w));
    PLIANT_TAKE(arena, scratch->doubled, 4 * length);
    PLIANT_TAKE(arena, scratch->turns, (size_t)longest * 12 * PLIANT_LANES);
    PLIANT_TAKE(arena, scratch->apart, (size_t)regions * 12);
    PLIANT_TAKE(arena, scratch->strip, strip);
    PLIANT_TAKE(arena, scratch->repairs, (size_t)longest * 16 * PLIANT_LANES);
    PLIANT_TAKE(arena, scratch->repair_of, longest);
    PLIANT_TAKE(arena, scratch->fit_rows, 15 * length);
    PLIANT_TAKE(arena, scratch->fit_bars,
                (size_t)lattice->row_blocks * lattice->dims[1] * 15 * PLIANT_LANES);
}

static void lay_out(pliant_arena *arena, pliant_body *body)
{
    const pliant_lattice *lattice = body->lattice;
    const size_t lanes = (size_t)lattice->block_count * PLIANT_LANES;
    const size_t plates = (size_t)body->irregular->plate_capacity + 1;
    PLIANT_TAKE(arena, body->x, 3 * lanes);
    PLIANT_TAKE(arena, body->v, 3 * lanes);
    PLIANT_TAKE(arena, body->acceleration, 3 * lanes);
    PLIANT_TAKE(arena, body->quaternion, 4 * (size_t)lattice->turn_count * PLIANT_LANES);
    PLIANT_TAKE(arena, body->sites, (size_t)lattice->site_count * PLIANT_SITE_FLOATS);
    PLIANT_TAKE(arena, body->plate_sums, 9 * plates);
    PLIANT_TAKE(arena, body->weighed, 4 * ((size_t)lattice->exceptions.count + 1));
    PLIANT_TAKE(arena, body->listed_turns, 16 * ((size_t)lattice->exceptions.count + 1));
    PLIANT_TAKE(arena, body->fit_sites, (size_t)lattice->site_count * 15 * PLIANT_LANES);
    PLIANT_TAKE(arena, body->fit_plates, 15 * plates);
    PLIANT_TAKE(arena, body->listed_fits, 16 * ((size_t)lattice->exceptions.count + 1));
    PLIANT_TAKE(arena, body->slab_sums, 16 * (size_t)lattice->dims[2]);
    PLIANT_TAKE(arena, body->scratch, body->worker_count);
    // Of regions made of parts a column of a breakable body may have one for every particle.
    int32_t regions = lattice->column_regions;
    for (int32_t c = 0; body->fracture && c < lattice->column_count; c++)
        if (lattice->columns[c].length * PLIANT_LANES > regions)
            regions = lattice->columns[c].length * PLIANT_LANES;
    for (int32_t k = 0; k < body->worker_count; k++) {
        pliant_scratch none = {0};
        lay_out_scratch(arena, lattice, regions, arena->base ? &body->scratch[k] : &none);
    }
}

pliant_body_def pliant_body_default(void)
{
    return (pliant_body_def){.rotation = {0, 0, 0, 1}, .damping_interval = 1, .thread_count = 1};
}

static pliant_status check_def(const pliant_body_def *def, pliant_error *err)
{
    const float *q = def->rotation;
    const float length = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(length > 0.25f && length < 4))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "body: expected a rotation of length 1, found %g",
                                sqrt((double)length));
    if (!(fabsf(def->position.x) + fabsf(def->position.y) + fabsf(def->position.z) < 1e18f &&
          fabsf(def->velocity.x) + fabsf(def->velocity.y) + fabsf(def->velocity.z) < 1e18f))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "body: expected a finite position and velocity");
    if (!(def->damping >= 0 && def->damping <= 1 && def->rigid_damping >= 0 &&
          def->rigid_damping <= 1))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "body: expected dampings of 0 to 1, found %g and %g",
                                (double)def->damping, (double)def->rigid_damping);
    if (def->damping_interval < 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "body: expected a damping interval of 1 or more, found %d",
                                def->damping_interval);
    if (!(def->strain_limit >= 0))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "body: expected a strain limit of 0 or more, found %g",
                                (double)def->strain_limit);
    if (def->thread_count < 1 || def->thread_count > PLIANT_TEAM_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "body: expected 1 to %d threads, found %d", PLIANT_TEAM_LIMIT,
                                def->thread_count);
    return PLIANT_OK;
}

static float bounded(float value, float limit)
{
    return value > limit ? limit : value < -limit ? -limit : value;
}

static pliant_vec3 bounded_all(pliant_vec3 a, float limit)
{
    return (pliant_vec3){bounded(a.x, limit), bounded(a.y, limit), bounded(a.z, limit)};
}

static void place(pliant_body *body, const pliant_body_def *def)
{
    const pliant_lattice *lattice = body->lattice;
    const float *given = def->rotation;
    const float scale = 1 / sqrtf(given[0] * given[0] + given[1] * given[1] + given[2] * given[2] +
                                  given[3] * given[3]);
    const float x = given[0] * scale, y = given[1] * scale, z = given[2] * scale,
                w = given[3] * scale;
    const float r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                           {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                           {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    const float from[3] = {def->position.x, def->position.y, def->position.z};
    for (int32_t p = 0; p < lattice->particle_count; p++) {
        const float *rest = lattice->rest + 3 * (size_t)p;
        for (int c = 0; c < 3; c++)
            body->x[lattice->slot[p] + PLIANT_LANES * c] =
                bounded(from[c] + r[c][0] * rest[0] + r[c][1] * rest[1] + r[c][2] * rest[2],
                        PLIANT_BODY_EXTENT * lattice->cell_size);
        pliant_body_set(body->v, lattice->slot[p],
                        bounded_all(def->velocity, PLIANT_BODY_SPEED * lattice->cell_size));
    }
    const float q[4] = {x, y, z, w};
    for (int32_t t = 0; t < lattice->turn_count; t++)
        for (int c = 0; c < 4; c++)
            for (int k = 0; k < PLIANT_LANES; k++)
                body->quaternion[((size_t)t * 4 + c) * PLIANT_LANES + k] = q[c];
}

pliant_status pliant_body_create(const pliant_lattice *lattice, const pliant_body_def *def,
                                 pliant_body **result, pliant_error *err)
{
    if (!lattice || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_body_create: expected a lattice and a place, found NULL");
    const pliant_body_def usual = pliant_body_default();
    if (!def) def = &usual;
    pliant_status status = check_def(def, err);
    if (status < 0) return status;
    pliant_body *body = calloc(1, sizeof *body);
    if (!body) return pliant_error_set(err, PLIANT_ERR_MEMORY, "body: no memory");
    body->lattice = lattice;
    body->worker_count = def->thread_count;
    body->damping = def->damping;
    body->damping_interval = def->damping_interval;
    body->rigid_damping = def->rigid_damping;
    body->strain_limit = def->strain_limit;
    body->particle_constants_of = lattice->particle_constants_of;
    body->region_constants_of = lattice->region_constants_of;
    body->particle_constants = lattice->particle_constants;
    body->region_constants = lattice->region_constants;
    body->irregular = &lattice->irregular;
    body->is_listed = lattice->exceptions.is_listed;
    if (def->strain_limit > 0) {
        status = pliant_fracture_create(lattice, def->thread_count, &body->fracture, err);
        if (status < 0) goto done;
        body->particle_constants_of = body->fracture->particle_constants_of;
        body->region_constants_of = body->fracture->region_constants_of;
        body->particle_constants = body->fracture->particle_constants;
        body->region_constants = body->fracture->region_constants;
        body->irregular = &body->fracture->irregular;
        body->is_listed = body->fracture->is_listed;
    }
    lay_out(&body->arena, body);
    status = pliant_arena_reserve(&body->arena, err);
    if (status < 0) goto done;
    lay_out(&body->arena, body);
    place(body, def);
    if (def->thread_count > 1) status = pliant_team_create(def->thread_count, &body->team, err);
done:
    if (status < 0) {
        pliant_body_destroy(body);
        return status;
    }
    *result = body;
    return PLIANT_OK;
}

void pliant_body_destroy(pliant_body *body)
{
    if (!body) return;
    pliant_team_destroy(body->team);
    pliant_fracture_destroy(body->fracture);
    pliant_arena_release(&body->arena);
    free(body);
}

// ---- State ----

void pliant_body_positions(const pliant_body *body, pliant_vec3 *x)
{
    for (int32_t p = 0; p < body->lattice->particle_count; p++)
        x[p] = pliant_body_get(body->x, body->lattice->slot[p]);
}

void pliant_body_velocities(const pliant_body *body, pliant_vec3 *v)
{
    for (int32_t p = 0; p < body->lattice->particle_count; p++)
        v[p] = pliant_body_get(body->v, body->lattice->slot[p]);
}

static int is_finite(pliant_vec3 a)
{
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

// Beyond `limit` cells (per s), it is the limit.
static pliant_status set_all(const pliant_body *body, const pliant_vec3 *values, float limit,
                             float *array)
{
    for (int32_t p = 0; p < body->lattice->particle_count; p++)
        if (!is_finite(values[p])) return PLIANT_ERR_ARGUMENT;
    for (int32_t p = 0; p < body->lattice->particle_count; p++)
        pliant_body_set(array, body->lattice->slot[p],
                        bounded_all(values[p], limit * body->lattice->cell_size));
    return PLIANT_OK;
}

pliant_status pliant_body_set_positions(pliant_body *body, const pliant_vec3 *x)
{
    return set_all(body, x, PLIANT_BODY_EXTENT, body->x);
}

pliant_status pliant_body_set_velocities(pliant_body *body, const pliant_vec3 *v)
{
    return set_all(body, v, PLIANT_BODY_SPEED, body->v);
}

pliant_vec3 pliant_body_position(const pliant_body *body, int32_t particle)
{
    if (particle < 0 || particle >= body->lattice->particle_count) return (pliant_vec3){0, 0, 0};
    return pliant_body_get(body->x, body->lattice->slot[particle]);
}

pliant_status pliant_body_set_gravity(pliant_body *body, pliant_vec3 gravity)
{
    if (!is_finite(gravity)) return PLIANT_ERR_ARGUMENT;
    body->gravity = bounded_all(gravity, PLIANT_BODY_SPEED * body->lattice->cell_size);
    return PLIANT_OK;
}

pliant_status pliant_body_set_damping(pliant_body *body, float damping, int32_t interval)
{
    if (!(damping >= 0 && damping <= 1) || interval < 1) return PLIANT_ERR_ARGUMENT;
    body->damping = damping;
    body->damping_interval = interval;
    return PLIANT_OK;
}

pliant_status pliant_body_set_strain_limit(pliant_body *body, float limit)
{
    if (!(limit > 0)) return PLIANT_ERR_ARGUMENT;
    if (!body->fracture) return PLIANT_ERR_MISSING;
    body->strain_limit = limit;
    return PLIANT_OK;
}

int64_t pliant_body_broken_count(const pliant_body *body)
{
    return body->fracture ? body->fracture->cut_count : 0;
}

pliant_status pliant_body_set_rigid_damping(pliant_body *body, float damping)
{
    if (!(damping >= 0 && damping <= 1)) return PLIANT_ERR_ARGUMENT;
    body->rigid_damping = damping;
    return PLIANT_OK;
}

// array += value / mass of the particle.
static pliant_status add_by_mass(const pliant_body *body, int32_t particle, pliant_vec3 value,
                                 float *array)
{
    if (particle < 0 || particle >= body->lattice->particle_count || !is_finite(value))
        return PLIANT_ERR_ARGUMENT;
    const int32_t slot = body->lattice->slot[particle], block = slot / (3 * PLIANT_LANES);
    const float inverse = body->lattice->lane_inverse[block * PLIANT_LANES + slot % PLIANT_LANES];
    const pliant_vec3 old = pliant_body_get(array, slot);
    pliant_body_set(array, slot,
                    bounded_all((pliant_vec3){old.x + inverse * value.x, old.y + inverse * value.y,
                                              old.z + inverse * value.z},
                                PLIANT_BODY_SPEED * body->lattice->cell_size));
    return PLIANT_OK;
}

pliant_status pliant_body_force(pliant_body *body, int32_t particle, pliant_vec3 force)
{
    const pliant_status status = add_by_mass(body, particle, force, body->acceleration);
    if (status >= 0) body->has_forces = 1;
    return status;
}

pliant_status pliant_body_impulse(pliant_body *body, int32_t particle, pliant_vec3 impulse)
{
    return add_by_mass(body, particle, impulse, body->v);
}

pliant_status pliant_body_copy(pliant_body *to, const pliant_body *from)
{
    if (to->lattice != from->lattice || (from->fracture && !to->fracture))
        return PLIANT_ERR_ARGUMENT;
    const size_t lanes = (size_t)from->lattice->block_count * PLIANT_LANES;
    memcpy(to->x, from->x, 3 * lanes * sizeof *to->x);
    memcpy(to->v, from->v, 3 * lanes * sizeof *to->v);
    memcpy(to->acceleration, from->acceleration, 3 * lanes * sizeof *to->acceleration);
    memcpy(to->quaternion, from->quaternion,
           4 * (size_t)from->lattice->turn_count * PLIANT_LANES * sizeof *to->quaternion);
    to->has_forces = from->has_forces;
    to->gravity = from->gravity;
    to->step_count = from->step_count;
    if (from->fracture) pliant_fracture_copy(to->fracture, from->fracture, from->lattice);
    else if (to->fracture) pliant_fracture_mend(to->fracture, from->lattice);
    return PLIANT_OK;
}

// ---- Motion ----

pliant_body_motion pliant_body_measure(const pliant_body *body)
{
    const pliant_lattice *lattice = body->lattice;
    pliant_body_motion m = {0};
    for (int32_t p = 0; p < lattice->particle_count; p++) {
        const double mass = pliant_lattice_particle_mass(lattice, p);
        m.mass += mass;
        for (int c = 0; c < 3; c++) {
            const double v = body->v[lattice->slot[p] + PLIANT_LANES * c];
            m.centre[c] += mass * body->x[lattice->slot[p] + PLIANT_LANES * c];
            m.momentum[c] += mass * v;
            m.kinetic_energy += mass * v * v / 2;
        }
    }
    for (int c = 0; c < 3; c++) m.centre[c] /= m.mass;
    for (int32_t p = 0; p < lattice->particle_count; p++) {
        const double mass = pliant_lattice_particle_mass(lattice, p);
        double x[3], v[3];
        for (int c = 0; c < 3; c++) {
            x[c] = body->x[lattice->slot[p] + PLIANT_LANES * c] - m.centre[c];
            v[c] = body->v[lattice->slot[p] + PLIANT_LANES * c];
        }
        for (int c = 0; c < 3; c++)
            m.angular_momentum[c] +=
                mass * (x[(c + 1) % 3] * v[(c + 2) % 3] - x[(c + 2) % 3] * v[(c + 1) % 3]);
    }
    return m;
}

// ---- Step ----

typedef struct match_task {
    pliant_body *body;
    float h;
} match_task;

static void gather_slab(void *context, int32_t z, int32_t worker)
{
    const match_task *task = context;
    pliant_plates_gather(task->body, z, &task->body->scratch[worker]);
}

static void match_column(void *context, int32_t column, int32_t worker)
{
    const match_task *task = context;
    pliant_column_match(task->body, column, &task->body->scratch[worker]);
}

static void scatter_slab(void *context, int32_t z, int32_t worker)
{
    const match_task *task = context;
    pliant_plates_scatter(task->body, z, task->h, &task->body->scratch[worker]);
}

// The middle of some particles: the same whatever the number of threads. Their median, not their
// mean: pieces and particles that fly far away must not take it along, or the rest, seen from afar,
// would lose its digits.
static void find_origin(pliant_body *body)
{
    enum { most = 32 };
    const pliant_lattice *lattice = body->lattice;
    const int32_t step = lattice->particle_count / most + 1;
    float sorted[3][most];
    int32_t count = 0;
    for (int32_t p = 0; p < lattice->particle_count; p += step, count++)
        for (int c = 0; c < 3; c++) {
            const float x = body->x[lattice->slot[p] + PLIANT_LANES * c];
            int32_t at = count;
            for (; at > 0 && sorted[c][at - 1] > x; at--) sorted[c][at] = sorted[c][at - 1];
            sorted[c][at] = x;
        }
    for (int c = 0; c < 3; c++) body->origin[c] = sorted[c][count / 2];
}

void pliant_body_match(pliant_body *body, float h)
{
    match_task task = {body, h};
    find_origin(body);
    const int64_t start = pliant_clock_ns();
    pliant_team_run(body->team, body->lattice->dims[2], gather_slab, &task);
    const int64_t gathered = pliant_clock_ns();
    pliant_team_run(body->team, body->lattice->column_count, match_column, &task);
    const int64_t matched = pliant_clock_ns();
    pliant_team_run(body->team, body->lattice->dims[2], scatter_slab, &task);
    const int64_t scattered = pliant_clock_ns();
    body->times.plates = gathered - start;
    body->times.regions = matched - gathered;
    body->times.goals = scattered - matched;
    if (body->has_forces) {
        memset(body->acceleration, 0,
               (size_t)body->lattice->block_count * 3 * PLIANT_LANES * sizeof(float));
        body->has_forces = 0;
    }
    if (body->damping > 0 && body->step_count % body->damping_interval == 0)
        pliant_body_damp(body, body->damping);
    if (body->rigid_damping > 0) pliant_body_damp_rigid(body, body->rigid_damping);
    body->times.damping = pliant_clock_ns() - scattered;
}

PLIANT_VECTOR_CLONES
static void move_blocks(pliant_body *body, int32_t first, int32_t last, float h)
{
    const float extent = PLIANT_BODY_EXTENT * body->lattice->cell_size;
    const float *restrict v = body->v;
    float *restrict positions = body->x;
    const size_t end = (size_t)last * 3 * PLIANT_LANES;
    for (size_t i = (size_t)first * 3 * PLIANT_LANES; i < end; i++) {
        const float x = positions[i] + h * v[i];
        const float below = x < extent ? x : extent;
        positions[i] = below > -extent ? below : -extent;
    }
}

static void move_slab(void *context, int32_t z, int32_t worker)
{
    (void)worker;
    const match_task *task = context;
    const int32_t *first = task->body->lattice->slab_first + z;
    move_blocks(task->body, first[0], first[1], task->h);
}

void pliant_body_move(pliant_body *body, float h)
{
    const int64_t start = pliant_clock_ns();
    match_task task = {body, h};
    pliant_team_run(body->team, body->lattice->dims[2], move_slab, &task);
    if (body->fracture) (void)pliant_fracture_break(body);
    body->step_count++;
    body->times.move = pliant_clock_ns() - start;
}

pliant_status pliant_body_step(pliant_body *body, float h)
{
    if (!(h > 0) || !isfinite(h)) return PLIANT_ERR_ARGUMENT;
    const pliant_float_mode before = pliant_float_mode_flush();
    pliant_body_match(body, h);
    pliant_body_move(body, h);
    pliant_float_mode_set(before);
    return PLIANT_OK;
}
