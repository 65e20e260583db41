// lattice_pair.c: a lattice body beside the slow reference of the same, and what may lie between.
#include "lattice_pair.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void dsyev_(const char *jobz, const char *uplo, const int *n, double *a, const int *lda, double *w,
            double *work, const int *lwork, int *info);

static void *reserve(size_t count, size_t size)
{
    void *block = calloc(count ? count : 1, size);
    if (!block) fail_msg("no memory for %zu times %zu bytes", count, size);
    return block;
}

// ---- Life ----

lattice_pair *lattice_pair_create_cells(int32_t cell_count, const int32_t *cells,
                                        int32_t half_width, const pliant_body_def *def)
{
    lattice_pair *p = reserve(1, sizeof *p);
    pliant_error err = {""};
    p->cell_size = (double)0.1f;
    p->half_width = half_width;
    p->cell_count = cell_count;
    p->cells = reserve(3 * (size_t)cell_count, sizeof *p->cells);
    memcpy(p->cells, cells, 3 * (size_t)cell_count * sizeof *cells);
    p->slow = reference_lattice_create(cell_count, cells, half_width, p->cell_size, NULL);
    const int32_t n = p->particle_count = p->slow->particle_count;
    p->mass = reserve((size_t)n, sizeof *p->mass);
    for (int32_t i = 0; i < n; i++) {
        p->mass[i] = 0.5f + (float)(i * 37 % 101) / 64;  // 0.5 to 2.1
        p->slow->mass[i] = (double)p->mass[i];
    }
    p->goals = reserve(3 * (size_t)n, sizeof(double));
    p->slow_goals = reserve(3 * (size_t)n, sizeof(double));
    p->tolerance = reserve((size_t)n, sizeof(double));

    pliant_lattice_def lattice_def = {.shape = {.particle_count = n,
                                                .particles = p->slow->particles,
                                                .cell_count = cell_count,
                                                .cells = cells},
                                      .mass = p->mass,
                                      .cell_size = p->cell_size,
                                      .component_count = 1};
    for (int32_t i = 0; i < 3 * n; i++)
        if (p->slow->particles[i] >= lattice_def.shape.dims[i % 3])
            lattice_def.shape.dims[i % 3] = p->slow->particles[i] + 1;
    pliant_regions *regions = NULL;
    check_ok(pliant_regions_create(&lattice_def.shape, half_width, &regions, &err), &err);
    lattice_def.regions = regions;
    check_ok(pliant_lattice_build(&lattice_def, &p->lattice, &err), &err);
    pliant_regions_destroy(regions);
    p->body = lattice_pair_body(p, def);
    return p;
}

lattice_pair *lattice_pair_create(check_cells shape, int32_t size, int32_t half_width,
                                  const pliant_body_def *def)
{
    const int32_t count = check_cell_shape(shape, size, NULL);
    int32_t *cells = reserve(3 * (size_t)count, sizeof *cells);
    check_cell_shape(shape, size, cells);
    lattice_pair *p = lattice_pair_create_cells(count, cells, half_width, def);
    free(cells);
    return p;
}

pliant_body *lattice_pair_body(const lattice_pair *p, const pliant_body_def *def)
{
    pliant_body *body = NULL;
    pliant_error err = {""};
    check_ok(pliant_body_create(p->lattice, def, &body, &err), &err);
    return body;
}

void lattice_pair_destroy(lattice_pair *p)
{
    if (!p) return;
    pliant_body_destroy(p->body);
    pliant_lattice_destroy(p->lattice);
    reference_lattice_destroy(p->slow);
    void *blocks[] = {p->cells, p->mass, p->goals, p->slow_goals, p->tolerance, p};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) free(blocks[i]);
}

// ---- State ----

static void give(const double *from, pliant_vec3 *to, int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        to[i] = (pliant_vec3){(float)from[3 * i], (float)from[3 * i + 1], (float)from[3 * i + 2]};
}

void lattice_pair_set(lattice_pair *p)
{
    pliant_vec3 *values = reserve((size_t)p->particle_count, sizeof *values);
    give(p->slow->x, values, p->particle_count);
    assert_int_equal(pliant_body_set_positions(p->body, values), PLIANT_OK);
    give(p->slow->v, values, p->particle_count);
    assert_int_equal(pliant_body_set_velocities(p->body, values), PLIANT_OK);
    free(values);
    lattice_pair_read(p);
}

void lattice_pair_read(lattice_pair *p)
{
    for (int32_t i = 0; i < p->particle_count; i++) {
        const int32_t slot = p->lattice->slot[i];
        for (int c = 0; c < 3; c++) {
            p->slow->x[3 * i + c] = (double)p->body->x[slot + PLIANT_LANES * c];
            p->slow->v[3 * i + c] = (double)p->body->v[slot + PLIANT_LANES * c];
        }
    }
}

void lattice_pair_rest(lattice_pair *p)
{
    memcpy(p->slow->x, p->slow->x0, 3 * (size_t)p->particle_count * sizeof(double));
    memset(p->slow->v, 0, 3 * (size_t)p->particle_count * sizeof(double));
    lattice_pair_set(p);
}

static double uniform(check_random *random)
{
    return 2 * check_random_next(random) - 1;
}

void lattice_pair_deform(lattice_pair *p, check_random *random, double noise)
{
    // A turn about (1, 2, 2) / 3 by 0.7, and a shear; a bend over 20 cells.
    const double c = cos(0.7), s = sin(0.7), u[3] = {1.0 / 3, 2.0 / 3, 2.0 / 3}, a = p->cell_size;
    memset(p->slow->v, 0, 3 * (size_t)p->particle_count * sizeof(double));
    for (int32_t i = 0; i < p->particle_count; i++) {
        const double *rest = p->slow->x0 + 3 * i;
        double x[3] = {rest[0] + 0.2 * rest[1], rest[1] - 0.1 * rest[2], 1.1 * rest[2]};
        x[2] += a * sin(x[0] / (20 * a)) * 3;
        const double along = u[0] * x[0] + u[1] * x[1] + u[2] * x[2];
        const double turned[3] = {u[1] * x[2] - u[2] * x[1], u[2] * x[0] - u[0] * x[2],
                                  u[0] * x[1] - u[1] * x[0]};
        for (int k = 0; k < 3; k++)
            p->slow->x[3 * i + k] =
                c * x[k] + s * turned[k] + (1 - c) * along * u[k] + noise * a * uniform(random);
    }
    lattice_pair_set(p);
}

void lattice_pair_scatter(lattice_pair *p, check_random *random, double extent)
{
    memset(p->slow->v, 0, 3 * (size_t)p->particle_count * sizeof(double));
    for (int32_t i = 0; i < 3 * p->particle_count; i++)
        p->slow->x[i] = 0.5 * extent * p->cell_size * uniform(random);
    lattice_pair_set(p);
}

void lattice_pair_velocities(lattice_pair *p, check_random *random, double speed)
{
    for (int32_t i = 0; i < 3 * p->particle_count; i++) p->slow->v[i] = speed * uniform(random);
    lattice_pair_set(p);
}

// ---- Goals ----

void lattice_pair_goals(lattice_pair *p)
{
    memset(p->slow->v, 0, 3 * (size_t)p->particle_count * sizeof(double));
    lattice_pair_set(p);
    pliant_body_match(p->body, 1);
    for (int32_t i = 0; i < p->particle_count; i++)
        for (int c = 0; c < 3; c++)
            p->goals[3 * i + c] =
                p->slow->x[3 * i + c] + (double)p->body->v[p->lattice->slot[i] + PLIANT_LANES * c];
    reference_lattice_goals(p->slow, p->slow_goals);
}

double lattice_pair_extent(const lattice_pair *p)
{
    double extent = 0;
    for (int32_t i = 0; i < p->particle_count; i++) {
        double square = 0;
        for (int c = 0; c < 3; c++) {
            const double d = p->slow->x[3 * i + c] - (double)p->body->origin[c];
            square += d * d;
        }
        extent = fmax(extent, sqrt(square));
    }
    return extent;
}

// A sum over a window is at most 3 (2w + 2) additions deep (a run along each axis), each of which
// rounds by half an ulp of what is there; the products before and after add a few. Roundings are
// independent, so that their root counts (Higham and Mary, SIAM J. Sci. Comput. 41, 2019).
double lattice_pair_rounding(const lattice_pair *p)
{
    return sqrt(3 * (2 * p->half_width + 2) + 6) * 0.5 * (double)FLT_EPSILON;
}

// sigma_2 + sign(det) sigma_3 of the region's A, which its rotation resists errors with.
static double stiffness(const double a[9])
{
    double square[9], values[3], work[64];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            square[3 * i + j] = a[i] * a[j] + a[3 + i] * a[3 + j] + a[6 + i] * a[6 + j];
    const int n = 3, work_size = 64;
    int info;
    dsyev_("N", "U", &n, square, &n, values, work, &work_size, &info);
    assert_int_equal(info, 0);
    const double determinant = a[0] * (a[4] * a[8] - a[5] * a[7]) -
                               a[1] * (a[3] * a[8] - a[5] * a[6]) +
                               a[2] * (a[3] * a[7] - a[4] * a[6]);
    return sqrt(fmax(values[1], 0)) + copysign(sqrt(fmax(values[0], 0)), determinant);
}

// The sum of m~ over the particles of r's window, be they members or not: some sums are taken of
// all and mended. Also the greatest number of particles in it.
static double window_mass(const lattice_pair *p, int32_t r, int32_t *count)
{
    const int32_t *at = p->slow->particles + 3 * r, w = p->half_width;
    double mass = 0;
    *count = 0;
    for (int32_t i = 0; i < p->particle_count; i++) {
        const int32_t *other = p->slow->particles + 3 * i;
        if (abs(other[0] - at[0]) > w || abs(other[1] - at[1]) > w || abs(other[2] - at[2]) > w)
            continue;
        mass += p->slow->mass[i] / (p->slow->region_offset[i + 1] - p->slow->region_offset[i]);
        ++*count;
    }
    return mass;
}

// With E the extent, u the rounding and W/M the window's mass over the region's:
//     |dc| <= u E W/M,   |dA| <= 2 u E sqrt(3) w a W (moment, and what LSM-11 subtracts)
//     |dR| <= (2 |dA| + 2e-6 |A|) / (sigma_2 +- sigma_3), at most 2 (polar.h promises the 1e-6)
// A goal is the mean over regions of R (x0 - c0) + c, again summed over the window.
void lattice_pair_tolerances(lattice_pair *p)
{
    const reference_lattice *l = p->slow;
    const double extent = lattice_pair_extent(p), u = lattice_pair_rounding(p);
    const double reach = sqrt(3) * p->half_width * p->cell_size;
    memset(p->tolerance, 0, (size_t)p->particle_count * sizeof(double));
    for (int32_t r = 0; r < p->particle_count; r++) {
        reference_match match;
        int32_t count;
        reference_lattice_match(p->slow, r, &match);
        const double window = window_mass(p, r, &count);
        double size = 0;
        for (int k = 0; k < 9; k++) size += match.moment[k] * match.moment[k];
        const double hold = stiffness(match.moment);
        const double turn =
            (4 * u * extent * reach * window + 2e-6 * sqrt(size)) / fmax(hold, 1e-30);
        const double centre = u * extent * window / match.mass;
        for (int32_t k = l->region_offset[r]; k < l->region_offset[r + 1]; k++) {
            const int32_t i = l->region[k];
            double offset = 0;
            for (int c = 0; c < 3; c++) offset += pow(l->x0[3 * i + c] - match.centre0[c], 2);
            p->tolerance[i] += (centre + fmin(turn, 2) * sqrt(offset)) /
                               (l->region_offset[i + 1] - l->region_offset[i]);
        }
        // Of the sum back to particle r, and of the float that it is.
        p->tolerance[r] +=
            u * (extent + 4 * reach) * count / (l->region_offset[r + 1] - l->region_offset[r]);
    }
}

void lattice_pair_check_goals(lattice_pair *p)
{
    lattice_pair_goals(p);
    lattice_pair_tolerances(p);
    for (int32_t i = 0; i < p->particle_count; i++)
        for (int c = 0; c < 3; c++) {
            const double off = fabs(p->goals[3 * i + c] - p->slow_goals[3 * i + c]);
            p->worst = fmax(p->worst, off / p->tolerance[i]);
            if (off <= p->tolerance[i]) continue;
            print_error("particle %d at (%d %d %d), w = %d\n", i, p->slow->particles[3 * i],
                        p->slow->particles[3 * i + 1], p->slow->particles[3 * i + 2],
                        p->half_width);
            check_near(p->goals[3 * i + c], p->slow_goals[3 * i + c], p->tolerance[i]);
        }
}

void lattice_pair_check_constants(const lattice_pair *p)
{
    const reference_lattice *l = p->slow;
    const double ulp = (double)FLT_EPSILON;
    for (int32_t i = 0; i < p->particle_count; i++) {
        const pliant_region_place place = pliant_lattice_place(p->lattice, i);
        const pliant_particle_constants *of_particle =
            &p->body->particle_constants[p->body->particle_constants_of[place.block]];
        const pliant_region_constants *of_region =
            &p->body->region_constants[p->body->region_constants_of[place.turn]];
        const int32_t size = l->region_offset[i + 1] - l->region_offset[i];
        double total = 0, offset[3] = {0};
        for (int32_t k = l->region_offset[i]; k < l->region_offset[i + 1]; k++) {
            const int32_t j = l->region[k];
            const double share = l->mass[j] / (l->region_offset[j + 1] - l->region_offset[j]);
            total += share;
            for (int c = 0; c < 3; c++)
                offset[c] += share * (l->particles[3 * j + c] - l->particles[3 * i + c]);
        }
        const double share = l->mass[i] / size;
        check_near((double)of_particle->share[place.lane], share, 2 * ulp * share);
        check_near((double)of_particle->inverse_size[place.lane], 1.0 / size, 2 * ulp / size);
        check_near((double)of_region->inverse_mass[place.lane], 1 / total, 3 * ulp / total);
        for (int c = 0; c < 3; c++)
            check_near((double)of_region->offset[c][place.lane], offset[c] / total,
                       3 * ulp * p->half_width);
    }
}

// ---- Questions ----

double lattice_pair_potential(lattice_pair *p)
{
    const reference_lattice *l = p->slow;
    double energy = 0;
    for (int32_t r = 0; r < p->particle_count; r++) {
        reference_match match;
        reference_lattice_match(p->slow, r, &match);
        for (int32_t k = l->region_offset[r]; k < l->region_offset[r + 1]; k++) {
            const int32_t i = l->region[k];
            const double share = l->mass[i] / (l->region_offset[i + 1] - l->region_offset[i]);
            for (int row = 0; row < 3; row++) {
                double off = l->x[3 * i + row] - match.centre[row];
                for (int c = 0; c < 3; c++)
                    off -= match.rotation[3 * row + c] * (l->x0[3 * i + c] - match.centre0[c]);
                energy += 0.5 * share * off * off;
            }
        }
    }
    return energy;
}

int32_t lattice_pair_follow_breaks(lattice_pair *p)
{
    int32_t broken = 0;
    for (int32_t i = 0; i < p->particle_count; i++)
        for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
            const int32_t *at = p->slow->particles + 3 * i;
            int32_t step[3];
            pliant_link_direction(d, step);
            if (!pliant_links_has(p->lattice->links, at[0], at[1], at[2], d)) continue;
            if (pliant_links_has(p->body->fracture->links, at[0], at[1], at[2], d)) continue;
            const int32_t other = pliant_links_particle(p->lattice->links, at[0] + step[0],
                                                        at[1] + step[1], at[2] + step[2]);
            broken++;
            if (reference_lattice_linked(p->slow, i, other))
                reference_lattice_break(p->slow, i, other);
        }
    reference_lattice_regions(p->slow);
    return broken;
}

double lattice_pair_strain(const lattice_pair *p)
{
    const reference_lattice *l = p->slow;
    double worst = 0;
    for (int32_t i = 0; i < p->particle_count; i++)
        for (int32_t k = l->ring_offset[i]; k < l->ring_offset[i + 1]; k++) {
            if (l->ring[k] < 0) continue;
            double rest = 0, now = 0;
            for (int c = 0; c < 3; c++) {
                const int32_t s = p->lattice->slot[i], t = p->lattice->slot[l->ring[k]];
                rest += pow(l->x0[3 * i + c] - l->x0[3 * l->ring[k] + c], 2);
                now += pow((double)p->body->x[s + 8 * c] - (double)p->body->x[t + 8 * c], 2);
            }
            worst = fmax(worst, fabs(sqrt(now / rest) - 1));
        }
    return worst;
}

int lattice_pair_is_finite(const lattice_pair *p)
{
    for (int32_t i = 0; i < p->particle_count; i++)
        for (int c = 0; c < 3; c++)
            if (!isfinite(p->body->x[p->lattice->slot[i] + PLIANT_LANES * c]) ||
                !isfinite(p->body->v[p->lattice->slot[i] + PLIANT_LANES * c]))
                return 0;
    return 1;
}

int32_t lattice_pair_size(check_cells shape, int32_t w)
{
    if (shape == CHECK_CELLS_COMB || shape == CHECK_CELLS_FOLDED) return w < 5 ? 6 : 8;
    if (shape == CHECK_CELLS_SHELL) return w < 3 ? 7 : 10;
    if (shape == CHECK_CELLS_TORUS) return 10;
    if (shape == CHECK_CELLS_TWO) return 4;
    return 6;
}
