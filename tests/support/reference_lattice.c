// reference_lattice.c: FastLSM's slow obvious path, in double, straight from the formulas.
#include "reference_lattice.h"

#include "check.h"

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

static void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

// Ascending eigenvalues w of the symmetric a, shape [n][n]; its rows become the eigenvectors.
static void eigenvectors(int n, double *a, double *w)
{
    double work[64];
    const int work_size = 64;
    int info;
    dsyev_("V", "U", &n, a, &n, w, work, &work_size, &info);
    assert_int_equal(info, 0);
}

// ---- Particles, one-rings, regions ----

static int32_t *dense_grid(int32_t count, const int32_t *places, int32_t dims[3])
{
    for (int axis = 0; axis < 3; axis++) dims[axis] = 0;
    for (int32_t i = 0; i < 3 * count; i++)
        if (places[i] >= dims[i % 3]) dims[i % 3] = places[i] + 1;
    return reserve((size_t)dims[0] * dims[1] * dims[2], sizeof(int32_t));
}

static size_t at(const int32_t dims[3], int32_t x, int32_t y, int32_t z)
{
    return ((size_t)z * dims[1] + y) * dims[0] + x;
}

static int is_inside(const int32_t dims[3], int32_t x, int32_t y, int32_t z)
{
    return x >= 0 && y >= 0 && z >= 0 && x < dims[0] && y < dims[1] && z < dims[2];
}

static void find_particles(reference_lattice *l, int32_t cell_count, const int32_t *cells)
{
    int32_t *corners = reserve((size_t)cell_count * 24, sizeof *corners), dims[3];
    for (int32_t i = 0; i < cell_count * 24; i++)
        corners[i] = cells[i / 24 * 3 + i % 3] + (i % 24 / 3 >> i % 3 & 1);
    int32_t *grid = dense_grid(cell_count * 8, corners, dims);
    for (int32_t i = 0; i < cell_count * 8; i++)
        grid[at(dims, corners[3 * i], corners[3 * i + 1], corners[3 * i + 2])] = 1;
    l->particles = corners;  // at most as many particles as corners
    for (int32_t z = 0; z < dims[2]; z++)
        for (int32_t y = 0; y < dims[1]; y++)
            for (int32_t x = 0; x < dims[0]; x++) {
                if (!grid[at(dims, x, y, z)]) continue;
                int32_t *place = l->particles + 3 * l->particle_count++;
                place[0] = x, place[1] = y, place[2] = z;
            }
    free(grid);
}

// i and j != i share a cell when one of the cells that both can be corners of is there.
static int share_cell(const int32_t *cell_grid, const int32_t dims[3], const int32_t *i,
                      const int32_t *j)
{
    for (int corner = 0; corner < 8; corner++) {
        int32_t cell[3];
        int holds_j = 1;
        for (int axis = 0; axis < 3; axis++) {
            cell[axis] = i[axis] - (corner >> axis & 1);
            holds_j &= j[axis] - cell[axis] == 0 || j[axis] - cell[axis] == 1;
        }
        if (holds_j && is_inside(dims, cell[0], cell[1], cell[2]) &&
            cell_grid[at(dims, cell[0], cell[1], cell[2])])
            return 1;
    }
    return 0;
}

static void find_rings(reference_lattice *l, int32_t cell_count, const int32_t *cells)
{
    int32_t cell_dims[3], dims[3];
    int32_t *cell_grid = dense_grid(cell_count, cells, cell_dims);
    for (int32_t c = 0; c < cell_count; c++)
        cell_grid[at(cell_dims, cells[3 * c], cells[3 * c + 1], cells[3 * c + 2])] = 1;
    int32_t *grid = dense_grid(l->particle_count, l->particles, dims);
    for (int32_t i = 0; i < l->particle_count; i++)
        grid[at(dims, l->particles[3 * i], l->particles[3 * i + 1], l->particles[3 * i + 2])] =
            i + 1;
    l->ring_offset = reserve((size_t)l->particle_count + 1, sizeof *l->ring_offset);
    l->ring = reserve((size_t)l->particle_count * 26, sizeof *l->ring);
    int32_t count = 0;
    for (int32_t i = 0; i < l->particle_count; i++) {
        const int32_t *place = l->particles + 3 * i;
        for (int32_t d = 0; d < 27; d++) {
            const int32_t x = place[0] + d % 3 - 1, y = place[1] + d / 3 % 3 - 1,
                          z = place[2] + d / 9 - 1;
            const int32_t j = is_inside(dims, x, y, z) ? grid[at(dims, x, y, z)] - 1 : -1;
            if (j < 0 || j == i) continue;
            if (share_cell(cell_grid, cell_dims, place, l->particles + 3 * j)) l->ring[count++] = j;
        }
        l->ring_offset[i + 1] = count;
    }
    free(grid);
    free(cell_grid);
}

static int ascending(const void *a, const void *b)
{
    return *(const int32_t *)a - *(const int32_t *)b;
}

void reference_lattice_regions(reference_lattice *l)
{
    const int32_t n = l->particle_count;
    int32_t *steps = reserve((size_t)n, sizeof *steps);  // to reach it, plus 1; 0: not reached
    int32_t *queue = reserve((size_t)n, sizeof *queue);
    size_t capacity = 0;
    free(l->region);
    l->region = NULL;
    for (int32_t r = 0; r < n; r++) {
        int32_t count = 0;
        queue[count++] = r;
        steps[r] = 1;
        for (int32_t head = 0; head < count; head++) {
            const int32_t i = queue[head];
            if (steps[i] > l->half_width) continue;
            for (int32_t k = l->ring_offset[i]; k < l->ring_offset[i + 1]; k++) {
                const int32_t j = l->ring[k];
                if (j < 0 || steps[j]) continue;
                steps[j] = steps[i] + 1;
                queue[count++] = j;
            }
        }
        for (int32_t k = 0; k < count; k++) steps[queue[k]] = 0;
        qsort(queue, (size_t)count, sizeof *queue, ascending);
        const size_t start = (size_t)l->region_offset[r];
        if (start + count > capacity) {
            capacity = 2 * capacity + (size_t)count + 64;
            l->region = realloc(l->region, capacity * sizeof *l->region);
            if (!l->region) fail_msg("no memory for %zu members", capacity);
        }
        memcpy(l->region + start, queue, (size_t)count * sizeof *queue);
        l->region_offset[r + 1] = (int32_t)start + count;
    }
    free(queue);
    free(steps);
}

reference_lattice *reference_lattice_create(int32_t cell_count, const int32_t *cells,
                                            int32_t half_width, double cell_size,
                                            const double *mass)
{
    reference_lattice *l = reserve(1, sizeof *l);
    l->half_width = half_width;
    find_particles(l, cell_count, cells);
    find_rings(l, cell_count, cells);
    const size_t n = (size_t)l->particle_count;
    l->x0 = reserve(n, 3 * sizeof(double));
    l->x = reserve(n, 3 * sizeof(double));
    l->v = reserve(n, 3 * sizeof(double));
    l->f = reserve(n, 3 * sizeof(double));
    l->mass = reserve(n, sizeof(double));
    l->turn = reserve(n, 4 * sizeof(double));
    l->region_offset = reserve(n + 1, sizeof *l->region_offset);
    for (size_t i = 0; i < n; i++) {
        for (int axis = 0; axis < 3; axis++)
            l->x[3 * i + axis] = l->x0[3 * i + axis] = cell_size * l->particles[3 * i + axis];
        l->mass[i] = mass ? mass[i] : 1;
        l->turn[4 * i + 3] = 1;
    }
    reference_lattice_regions(l);
    return l;
}

void reference_lattice_destroy(reference_lattice *l)
{
    if (!l) return;
    void *blocks[] = {l->particles,   l->x0,   l->mass,          l->x,      l->v, l->f, l->turn,
                      l->ring_offset, l->ring, l->region_offset, l->region, l};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) free(blocks[i]);
}

// The order of particles: by (z, y, x).
static int compare_places(const void *a, const void *b)
{
    const int32_t *p = a, *q = b;
    for (int c = 2; c >= 0; c--)
        if (p[c] != q[c]) return p[c] < q[c] ? -1 : 1;
    return 0;
}

int32_t reference_lattice_find(const reference_lattice *l, const int32_t place[3])
{
    const int32_t *found = bsearch(place, l->particles, (size_t)l->particle_count,
                                   3 * sizeof *l->particles, compare_places);
    return found ? (int32_t)((found - l->particles) / 3) : -1;
}

static int32_t link_of(const reference_lattice *l, int32_t i, int32_t j)
{
    for (int32_t k = l->ring_offset[i]; k < l->ring_offset[i + 1]; k++)
        if (l->ring[k] == j) return k;
    return -1;
}

int reference_lattice_linked(const reference_lattice *l, int32_t i, int32_t j)
{
    return link_of(l, i, j) >= 0;
}

void reference_lattice_break(reference_lattice *l, int32_t i, int32_t j)
{
    const int32_t there = link_of(l, i, j), back = link_of(l, j, i);
    assert_true(there >= 0 && back >= 0);
    l->ring[there] = l->ring[back] = -1;
}

// ---- Shape matching ----

static int32_t region_size(const reference_lattice *l, int32_t r)
{
    return l->region_offset[r + 1] - l->region_offset[r];
}

// m~_i = m_i / |R_i|
static double shared_mass(const reference_lattice *l, int32_t i)
{
    return l->mass[i] / region_size(l, i);
}

// rotation maximises tr(R^T A) over rotations. R's quaternion is the eigenvector of the largest
// eigenvalue of
//   K = [A + A^T - tr A I, z; z^T, tr A],   z = (A_21 - A_12, A_02 - A_20, A_10 - A_01)
// and of several such, their mixture nearest to `turn`, shape [4], which takes it.
static void nearest_rotation(const double a[9], double *turn, double rotation[9])
{
    const double trace = a[0] + a[4] + a[8];
    double k[16], values[4], size = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            k[4 * i + j] = a[3 * i + j] + a[3 * j + i] - (i == j ? trace : 0);
    k[3] = k[12] = a[7] - a[5];
    k[7] = k[13] = a[2] - a[6];
    k[11] = k[14] = a[3] - a[1];
    k[15] = trace;
    for (int i = 0; i < 9; i++) size += a[i] * a[i];
    eigenvectors(4, k, values);
    double q[4] = {0}, length = 0;
    for (int i = 0; i < 4; i++) {
        if (values[i] < values[3] - 1e-10 * sqrt(size)) continue;
        double along = 0;
        for (int axis = 0; axis < 4; axis++) along += k[4 * i + axis] * turn[axis];
        for (int axis = 0; axis < 4; axis++) q[axis] += along * k[4 * i + axis];
    }
    for (int axis = 0; axis < 4; axis++) length += q[axis] * q[axis];
    for (int axis = 0; axis < 4; axis++)
        turn[axis] = length < 1e-20 ? k[12 + axis] : q[axis] / sqrt(length);
    const double x = turn[0], y = turn[1], z = turn[2], w = turn[3];
    const double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(rotation, r, sizeof r);
}

void reference_lattice_match(reference_lattice *l, int32_t r, reference_match *match)
{
    const int32_t *begin = l->region + l->region_offset[r];
    const int32_t *end = l->region + l->region_offset[r + 1];
    memset(match, 0, sizeof *match);
    for (const int32_t *i = begin; i < end; i++) {
        match->mass += shared_mass(l, *i);
        for (int axis = 0; axis < 3; axis++) {
            match->centre0[axis] += shared_mass(l, *i) * l->x0[3 * *i + axis];
            match->centre[axis] += shared_mass(l, *i) * l->x[3 * *i + axis];
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        match->centre0[axis] /= match->mass;
        match->centre[axis] /= match->mass;
    }
    // A_r = sum m~_i (x_i - c_r)(x0_i - c0_r)^T (LSM-10)
    for (const int32_t *i = begin; i < end; i++)
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++)
                match->moment[3 * row + column] +=
                    shared_mass(l, *i) * (l->x[3 * *i + row] - match->centre[row]) *
                    (l->x0[3 * *i + column] - match->centre0[column]);
    nearest_rotation(match->moment, l->turn + 4 * r, match->rotation);
}

// g_i = 1 / |R_i| sum over r in R_i of R_r (x0_i - c0_r) + c_r (LSM-12)
void reference_lattice_goals(reference_lattice *l, double *g)
{
    memset(g, 0, (size_t)l->particle_count * 3 * sizeof *g);
    for (int32_t r = 0; r < l->particle_count; r++) {
        reference_match match;
        reference_lattice_match(l, r, &match);
        for (int32_t k = l->region_offset[r]; k < l->region_offset[r + 1]; k++) {
            const int32_t i = l->region[k];
            for (int row = 0; row < 3; row++) {
                double goal = match.centre[row];
                for (int column = 0; column < 3; column++)
                    goal += match.rotation[3 * row + column] *
                            (l->x0[3 * i + column] - match.centre0[column]);
                g[3 * i + row] += goal / region_size(l, i);
            }
        }
    }
}

// ---- Damping ----

// Velocity, spin and centre of some particles with those masses, as if they were rigid:
//   v_r = sum m v / M, L_r = sum m (x - c) cross v, I_r = sum m [x - c]^T [x - c], spin = I^-1 L
// (LSM-13, 14). About an axis without inertia (a line, a point) nothing spins.
static void rigid_motion(const reference_lattice *l, int32_t count, const int32_t *members,
                         const double *mass, double centre[3], double velocity[3], double spin[3])
{
    double total = 0, momentum[3] = {0}, inertia[9] = {0}, values[3];
    for (int axis = 0; axis < 3; axis++) centre[axis] = velocity[axis] = spin[axis] = 0;
    for (int32_t k = 0; k < count; k++) {
        total += mass[k];
        for (int axis = 0; axis < 3; axis++) {
            centre[axis] += mass[k] * l->x[3 * members[k] + axis];
            velocity[axis] += mass[k] * l->v[3 * members[k] + axis];
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        centre[axis] /= total;
        velocity[axis] /= total;
    }
    for (int32_t k = 0; k < count; k++) {
        double offset[3], moment[3], square = 0;
        for (int axis = 0; axis < 3; axis++) {
            offset[axis] = l->x[3 * members[k] + axis] - centre[axis];
            square += offset[axis] * offset[axis];
        }
        cross(offset, l->v + 3 * members[k], moment);
        for (int row = 0; row < 3; row++) {
            momentum[row] += mass[k] * moment[row];
            for (int column = 0; column < 3; column++)
                inertia[3 * row + column] +=
                    mass[k] * ((row == column ? square : 0) - offset[row] * offset[column]);
        }
    }
    eigenvectors(3, inertia, values);
    for (int i = 0; i < 3; i++) {
        if (values[i] <= 1e-12 * values[2]) continue;
        double along = 0;
        for (int axis = 0; axis < 3; axis++) along += inertia[3 * i + axis] * momentum[axis];
        for (int axis = 0; axis < 3; axis++)
            spin[axis] += along / values[i] * inertia[3 * i + axis];
    }
}

void reference_lattice_damp(reference_lattice *l, double k)
{
    const int32_t n = l->particle_count;
    double *mean = reserve((size_t)n * 3, sizeof *mean), *mass = reserve((size_t)n, sizeof *mass);
    for (int32_t r = 0; r < n; r++) {
        const int32_t *members = l->region + l->region_offset[r], count = region_size(l, r);
        double centre[3], velocity[3], spin[3];
        for (int32_t m = 0; m < count; m++) mass[m] = shared_mass(l, members[m]);
        rigid_motion(l, count, members, mass, centre, velocity, spin);
        for (int32_t m = 0; m < count; m++) {
            double offset[3], turning[3];
            for (int axis = 0; axis < 3; axis++)
                offset[axis] = l->x[3 * members[m] + axis] - centre[axis];
            cross(spin, offset, turning);
            for (int axis = 0; axis < 3; axis++)
                mean[3 * members[m] + axis] +=
                    (velocity[axis] + turning[axis]) / region_size(l, members[m]);
        }
    }
    for (int32_t i = 0; i < 3 * n; i++) l->v[i] += k * (mean[i] - l->v[i]);
    free(mass);
    free(mean);
}

void reference_lattice_damp_rigid(reference_lattice *l, double k)
{
    int32_t *all = reserve((size_t)l->particle_count, sizeof *all);
    double centre[3], velocity[3], spin[3];
    for (int32_t i = 0; i < l->particle_count; i++) all[i] = i;
    rigid_motion(l, l->particle_count, all, l->mass, centre, velocity, spin);
    for (int32_t i = 0; i < l->particle_count; i++) {
        double offset[3], turning[3];
        for (int axis = 0; axis < 3; axis++) offset[axis] = l->x[3 * i + axis] - centre[axis];
        cross(spin, offset, turning);
        for (int axis = 0; axis < 3; axis++)
            l->v[3 * i + axis] += k * (velocity[axis] + turning[axis] - l->v[3 * i + axis]);
    }
    free(all);
}

// ---- The step ----

void reference_lattice_step(reference_lattice *l, const reference_step *step)
{
    const double h = step->dt;
    double *g = reserve((size_t)l->particle_count * 3, sizeof *g);
    reference_lattice_goals(l, g);
    // v(t + h) = v + (g - x) / h + h f / m (LSM-1)
    for (int32_t i = 0; i < 3 * l->particle_count; i++)
        l->v[i] += (g[i] - l->x[i]) / h + h * l->f[i] / l->mass[i / 3];
    if (step->damping > 0) reference_lattice_damp(l, step->damping);
    if (step->rigid_damping > 0) reference_lattice_damp_rigid(l, step->rigid_damping);
    // x(t + h) = x + h v(t + h) (LSM-2)
    for (int32_t i = 0; i < 3 * l->particle_count; i++) l->x[i] += h * l->v[i];
    free(g);
}

reference_motion reference_lattice_motion(const reference_lattice *l)
{
    reference_motion motion = {0};
    for (int32_t i = 0; i < l->particle_count; i++) {
        double moment[3];
        cross(l->x + 3 * i, l->v + 3 * i, moment);
        motion.mass += l->mass[i];
        for (int axis = 0; axis < 3; axis++) {
            const double v = l->v[3 * i + axis];
            motion.centre[axis] += l->mass[i] * l->x[3 * i + axis];
            motion.momentum[axis] += l->mass[i] * v;
            motion.angular_momentum[axis] += l->mass[i] * moment[axis];
            motion.kinetic_energy += 0.5 * l->mass[i] * v * v;
        }
    }
    for (int axis = 0; axis < 3; axis++) motion.centre[axis] /= motion.mass;
    return motion;
}
