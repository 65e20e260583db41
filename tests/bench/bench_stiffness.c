// bench_stiffness.c: how much stiffer a body is the wider its regions (LSM Figure 2), and how fast
// it then swings.
//
// A bar is sheared in its middle, or a particle pulled out of a box; two steps of smoothing, x =
// g(x), follow, as in the figure. What is left of the deviation from the nearest rigid placement
// falls with w. Beside it, the period of a clamped bar's swing under its own weight: the square of
// its inverse is a stiffness.
//
//     bench_stiffness
#include "bench.h"

#include "lattice/body.h"

#include <math.h>
#include <string.h>

enum { length = 24, thick = 3 };

typedef struct bar {
    pliant_lattice *lattice;
    pliant_body *body;
    int32_t n;
    pliant_vec3 *x, *v;
} bar;

static bar make_bar(int32_t nx, int32_t ny, int32_t half_width, float damping)
{
    bar b = {0};
    pliant_error err = {""};
    const int32_t count = nx * ny * ny;
    int32_t *cells = malloc(3 * (size_t)count * sizeof *cells);
    int32_t *particles = malloc(24 * (size_t)count * sizeof *particles);
    if (!cells || !particles) exit(1);
    for (int32_t i = 0; i < count; i++) {
        cells[3 * i] = i % nx;
        cells[3 * i + 1] = i / nx % ny;
        cells[3 * i + 2] = i / nx / ny;
    }
    b.n = pliant_lattice_particles(count, cells, particles);
    float *mass = malloc((size_t)b.n * sizeof *mass);
    b.x = malloc((size_t)b.n * sizeof *b.x);
    b.v = malloc((size_t)b.n * sizeof *b.v);
    if (!mass || !b.x || !b.v) exit(1);
    for (int32_t i = 0; i < b.n; i++) mass[i] = 1;
    pliant_lattice_def def = {.shape = {.dims = {nx + 1, ny + 1, ny + 1},
                                        .particle_count = b.n,
                                        .particles = particles,
                                        .cell_count = count,
                                        .cells = cells},
                              .mass = mass,
                              .cell_size = 1,
                              .component_count = 1};
    pliant_regions *regions = NULL;
    require(pliant_regions_create(&def.shape, half_width, &regions, &err), &err);
    def.regions = regions;
    require(pliant_lattice_build(&def, &b.lattice, &err), &err);
    pliant_body_def body_def = pliant_body_default();
    body_def.damping = damping;
    require(pliant_body_create(b.lattice, &body_def, &b.body, &err), &err);
    pliant_regions_destroy(regions);
    free(mass);
    free(cells);
    free(particles);
    return b;
}

static void free_bar(bar *b)
{
    pliant_body_destroy(b->body);
    pliant_lattice_destroy(b->lattice);
    free(b->x);
    free(b->v);
}

// x = g(x), so many times.
static void smooth(bar *b, int steps)
{
    memset(b->v, 0, (size_t)b->n * sizeof *b->v);
    for (int k = 0; k < steps; k++) {
        require(pliant_body_set_velocities(b->body, b->v), NULL);
        require(pliant_body_step(b->body, 1), NULL);
    }
    pliant_body_positions(b->body, b->x);
}

// Root of the mean square relative stretch of neighbours along the axes: no rigid motion has any.
static double strain(const bar *b)
{
    const float *rest = pliant_lattice_positions(b->lattice);
    double sum = 0;
    int32_t count = 0;
    for (int32_t i = 0; i < b->n; i++)
        for (int c = 0; c < 3; c++) {
            double at[3];
            for (int d = 0; d < 3; d++) at[d] = (double)rest[3 * i + d] + (d == c);
            const int32_t j = pliant_lattice_nearest(b->lattice, at);
            if (fabs((double)rest[3 * j + c] - at[c]) > 0.5 || j == i) continue;
            const double x = (double)b->x[j].x - (double)b->x[i].x;
            const double y = (double)b->x[j].y - (double)b->x[i].y;
            const double z = (double)b->x[j].z - (double)b->x[i].z;
            sum += pow(sqrt(x * x + y * y + z * z) - 1, 2);
            count++;
        }
    return sqrt(sum / count);
}

// What two steps leave of: a particle pulled out of a box of 16; a bar sheared in its middle.
static double left_of_pull(int32_t w)
{
    bar b = make_bar(16, 16, w, 0);
    pliant_body_positions(b.body, b.x);
    const double middle[3] = {8, 8, 8};
    const int32_t pulled = pliant_lattice_nearest(b.lattice, middle);
    b.x[pulled].x += 3;
    require(pliant_body_set_positions(b.body, b.x), NULL);
    const double before = strain(&b);
    smooth(&b, 2);
    const double after = strain(&b);
    free_bar(&b);
    return after / before;
}

static double left_of_shear(int32_t w)
{
    bar b = make_bar(length, thick, w, 0);
    pliant_body_positions(b.body, b.x);
    for (int32_t i = 0; i < b.n; i++)
        if (b.x[i].x > length / 2) b.x[i].z += 2;
    require(pliant_body_set_positions(b.body, b.x), NULL);
    const double before = strain(&b);
    smooth(&b, 2);
    const double after = strain(&b);
    free_bar(&b);
    return after / before;
}

// Steps that a free bar's first bending takes to swing back: given a parabola's velocity, when the
// middle's speed against the ends' changes its sign the second time, a period has passed.
static double period(int32_t w)
{
    bar b = make_bar(length, thick, w, 0);
    pliant_body_positions(b.body, b.x);
    for (int32_t i = 0; i < b.n; i++) {
        const float s = (b.x[i].x - length / 2.0f) / (length / 2.0f);
        b.v[i] = (pliant_vec3){0, 0, 0.02f * (s * s - 1.0f / 3)};
    }
    require(pliant_body_set_velocities(b.body, b.v), NULL);
    double last = 1, crossings[2] = {0, 0};
    int found = 0;
    for (int step = 1; step < 100000 && found < 2; step++) {
        require(pliant_body_step(b.body, 1), NULL);
        pliant_body_velocities(b.body, b.v);
        double now = 0;
        for (int32_t i = 0; i < b.n; i++) {
            const double s = ((double)pliant_lattice_positions(b.lattice)[3 * i] - length / 2.0) /
                             (length / 2.0);
            now += (double)b.v[i].z * (s * s - 1.0 / 3);
        }
        if ((now < 0) != (last < 0)) crossings[found++] = step - now / (now - last);
        last = now;
    }
    free_bar(&b);
    return found == 2 ? 2 * (crossings[1] - crossings[0]) : NAN;
}

int main(void)
{
    printf("LSM Figure 2: stiffness by half-width. Left after two smoothing steps: of the strain "
           "(root\n"
           "mean square) about one particle pulled 3 cells out of a box of 16^3 cells, and of a "
           "bar of\n"
           "%d x %d x %d sheared by 2 cells in its middle. Period of that bar's first bending, in "
           "steps.\n\n"
           "    w     pull    shear    period    stiffness (period^-2, w = 1 is 1)\n",
           length, thick, thick);
    double first = 0;
    for (int32_t w = 1; w <= 10; w++) {
        const double steps = period(w);
        if (w == 1) first = steps;
        printf("%5d  %7.4f  %7.4f  %8.2f  %10.1f\n", w, left_of_pull(w), left_of_shear(w), steps,
               first * first / steps / steps);
    }
    return 0;
}
