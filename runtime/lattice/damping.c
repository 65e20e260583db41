// damping.c: what of the particles' velocities is no rigid motion of their regions dies out.
//
// The squares of LSM-14 cancel in floats when a body is many regions wide. So the rigid motion of
// the whole is taken out first, which the fits would reproduce anyway, and what the rest loses in
// momentum to rounding is given back: rigid motions and both momenta are kept as exactly as floats
// can.
#include "lattice/damping.h"

#include "lattice/fits.h"

typedef struct damp_task {
    pliant_body *body;
    float k;
    pliant_rigid_field whole;
} damp_task;

static void gather(void *context, int32_t z, int32_t worker)
{
    const damp_task *task = context;
    pliant_fits_gather(task->body, &task->whole, z, &task->body->scratch[worker]);
}

static void match(void *context, int32_t column, int32_t worker)
{
    const damp_task *task = context;
    pliant_fits_match(task->body, column, &task->body->scratch[worker]);
}

static void spread(void *context, int32_t z, int32_t worker)
{
    const damp_task *task = context;
    pliant_fits_spread(task->body, &task->whole, z, task->k, &task->body->scratch[worker]);
}

// Squares of the sums lose what regions are made of when a body is torn over many times its size:
// damping would add energy then, and end in what is no number. All that is slowed down then is
// motion against the mean, which costs angular momentum. Pieces of what may break are summed apart
// and may go further, and beyond that fly on undamped. Returns 1 if that was it.
static int32_t damp_torn(pliant_body *body, pliant_whole_motion motion, float k)
{
    const double whole_sizes = 100, cells = 1e5;
    const int32_t *dims = body->lattice->dims;
    const double a = (double)body->lattice->cell_size;
    const double limit = a * (body->fracture ? cells : whole_sizes * (dims[0] + dims[1] + dims[2]));
    if (motion.spread < limit * limit) return 0;
    if (body->fracture) return 1;
    for (int c = 0; c < 3; c++) motion.omega[c] = 0;
    const pliant_rigid_field field = pliant_whole_field(&motion);
    pliant_whole_blend(body, &field, 1 - k, k);
    return 1;
}

void pliant_body_damp(pliant_body *body, float k)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_whole_motion motion = pliant_whole_measure(body);
    if (damp_torn(body, motion, k)) return;
    damp_task task = {body, k, pliant_whole_field(&motion)};
    pliant_team_run(body->team, lattice->dims[2], gather, &task);
    pliant_team_run(body->team, lattice->column_count, match, &task);
    pliant_team_run(body->team, lattice->dims[2], spread, &task);
    // Beyond the motion of the whole there were no momenta: what there is now is rounding, and
    // goes.
    const pliant_whole_motion rest = pliant_whole_fit(body);
    const pliant_rigid_field dust = pliant_whole_field(&rest);
    pliant_whole_blend(body, &dust, 1, -1);
}

void pliant_body_damp_rigid(pliant_body *body, float k)
{
    const pliant_whole_motion motion = pliant_whole_measure(body);
    if (damp_torn(body, motion, k)) return;
    const pliant_rigid_field field = pliant_whole_field(&motion);
    pliant_whole_blend(body, &field, 1 - k, k);
}
