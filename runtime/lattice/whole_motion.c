// whole_motion.c: the rigid motion that fits a whole body's velocities best.
#include "lattice/whole_motion.h"

#include "pliant/vector_clones.h"

pliant_rigid_field pliant_whole_field(const pliant_whole_motion *m)
{
    pliant_rigid_field field;
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        field.a[c] =
            (float)(m->velocity[c] - (m->omega[d] * m->centre[e] - m->omega[e] * m->centre[d]));
        field.omega[c] = (float)m->omega[c];
    }
    return field;
}

PLIANT_VECTOR_CLONES
static void sum_slab(const pliant_body *body, int32_t z, double *sums)
{
    const pliant_lattice *lattice = body->lattice;
    pliant_f8 total[PLIANT_WHOLE_COUNT] = {{0}};
    for (int32_t b = lattice->slab_first[z]; b < lattice->slab_first[z + 1]; b++) {
        const pliant_f8 m = pliant_f8_load(lattice->lane_mass + (size_t)b * PLIANT_LANES);
        const float *xs = body->x + (size_t)b * 3 * PLIANT_LANES;
        const float *vs = body->v + (size_t)b * 3 * PLIANT_LANES;
        pliant_f8 x[3], v[3], mx[3];
        for (int c = 0; c < 3; c++) {
            x[c] = pliant_f8_load(xs + 8 * c) - pliant_f8_all(body->origin[c]);
            v[c] = pliant_f8_load(vs + 8 * c);
            mx[c] = m * x[c];
            total[PLIANT_WHOLE_X + c] += mx[c];
            total[PLIANT_WHOLE_V + c] += m * v[c];
            total[PLIANT_WHOLE_XX + c] += mx[c] * x[c];
        }
        total[PLIANT_WHOLE_MASS] += m;
        for (int c = 0; c < 3; c++) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            total[PLIANT_WHOLE_SPIN + c] += mx[d] * v[e] - mx[e] * v[d];
            total[PLIANT_WHOLE_XX + 3 + c] += mx[d] * x[e];
        }
    }
    for (int f = 0; f < PLIANT_WHOLE_COUNT; f++) {
        float lanes[PLIANT_LANES];
        pliant_f8_store(lanes, total[f]);
        sums[f] = 0;
        for (int k = 0; k < PLIANT_LANES; k++) sums[f] += (double)lanes[k];
    }
}

// omega of I omega = L; I, positive semidefinite, as xx' = yy + zz and so on. The directions that
// nothing resists turning about get nothing.
static void solve_spin(const double square[3], const double product[3], const double spin[3],
                       double omega[3])
{
    const double trace = square[0] + square[1] + square[2], least = 1e-12 * trace;
    const double a = square[0] + least, b = square[1] + least, c = square[2] + least;
    const double d = -product[0], e = -product[1], f = -product[2];  // yz, xz, xy
    const double xx = b * c - d * d, yy = a * c - e * e, zz = a * b - f * f;
    const double xy = d * e - c * f, xz = d * f - b * e, yz = e * f - a * d;
    const double determinant = a * xx + f * xy + e * xz;
    const double inverse = determinant > 0 ? 1 / determinant : 0;
    omega[0] = inverse * (xx * spin[0] + xy * spin[1] + xz * spin[2]);
    omega[1] = inverse * (xy * spin[0] + yy * spin[1] + yz * spin[2]);
    omega[2] = inverse * (xz * spin[0] + yz * spin[1] + zz * spin[2]);
}

pliant_whole_motion pliant_whole_fit(const pliant_body *body)
{
    double sums[PLIANT_WHOLE_COUNT] = {0};
    for (int32_t z = 0; z < body->lattice->dims[2]; z++)
        for (int f = 0; f < PLIANT_WHOLE_COUNT; f++)
            sums[f] += body->slab_sums[(size_t)z * PLIANT_WHOLE_COUNT + f];
    pliant_whole_motion m;
    const double mass = sums[PLIANT_WHOLE_MASS];
    double spin[3], square[3], product[3], second[3];
    for (int c = 0; c < 3; c++) {
        m.centre[c] = sums[PLIANT_WHOLE_X + c] / mass;
        m.velocity[c] = sums[PLIANT_WHOLE_V + c] / mass;
    }
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        spin[c] = sums[PLIANT_WHOLE_SPIN + c] -
                  mass * (m.centre[d] * m.velocity[e] - m.centre[e] * m.velocity[d]);
        second[c] = sums[PLIANT_WHOLE_XX + c] - mass * m.centre[c] * m.centre[c];
        product[c] = sums[PLIANT_WHOLE_XX + 3 + c] - mass * m.centre[d] * m.centre[e];
    }
    for (int c = 0; c < 3; c++) square[c] = second[(c + 1) % 3] + second[(c + 2) % 3];
    solve_spin(square, product, spin, m.omega);
    m.spread = (second[0] + second[1] + second[2]) / mass;
    return m;
}

static void sum_task(void *context, int32_t z, int32_t worker)
{
    (void)worker;
    pliant_body *body = context;
    sum_slab(body, z, body->slab_sums + (size_t)z * PLIANT_WHOLE_COUNT);
}

pliant_whole_motion pliant_whole_measure(pliant_body *body)
{
    pliant_team_run(body->team, body->lattice->dims[2], sum_task, body);
    return pliant_whole_fit(body);
}

// v = keep v + add (a + omega cross x) for a slab.
PLIANT_VECTOR_CLONES
static void blend_slab(pliant_body *body, int32_t z, const pliant_rigid_field *field, float keep,
                       float add)
{
    const pliant_lattice *lattice = body->lattice;
    for (int32_t b = lattice->slab_first[z]; b < lattice->slab_first[z + 1]; b++) {
        const pliant_f8 is_particle =
            pliant_f8_load(body->particle_constants[body->particle_constants_of[b]].is_particle);
        const float *xs = body->x + (size_t)b * 3 * PLIANT_LANES;
        float *vs = body->v + (size_t)b * 3 * PLIANT_LANES;
        pliant_f8 x[3], rigid[3];
        for (int c = 0; c < 3; c++)
            x[c] = pliant_f8_load(xs + 8 * c) - pliant_f8_all(body->origin[c]);
        pliant_rigid_field_at(field, x, rigid);
        for (int c = 0; c < 3; c++)
            pliant_f8_store(vs + 8 * c, pliant_f8_all(keep) * pliant_f8_load(vs + 8 * c) +
                                            pliant_f8_all(add) * is_particle * rigid[c]);
    }
}

typedef struct blend_task {
    pliant_body *body;
    const pliant_rigid_field *field;
    float keep, add;
} blend_task;

static void run_blend(void *context, int32_t z, int32_t worker)
{
    (void)worker;
    const blend_task *task = context;
    blend_slab(task->body, z, task->field, task->keep, task->add);
}

void pliant_whole_blend(pliant_body *body, const pliant_rigid_field *field, float keep, float add)
{
    blend_task task = {body, field, keep, add};
    pliant_team_run(body->team, body->lattice->dims[2], run_blend, &task);
}
