// test_passivity.c: haptic loops around a strongly compressed model, as stored and passive.
//
// Devices of some mass hold on to nodes of S by stiff virtual couplings (springs k): at every
// millisecond their places y give the nodes' displacements u, the solver the forces f there, and
// f the devices' motion. With f = K u at S, and k (y - u) = f,
//
//     u = (I + K / k)^-1 y,    f = (K^-1 + I / k)^-1 y
//
// whose last matrix is symmetric if and only if K is. Then it has an energy, from which no motion
// gains. GF-31..33 at eps 0.2 leaves K some percent unsymmetric, and that is a motor.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { node_count = 10, size = 3 * node_count };

static const double stiffness = 20;  // of the couplings, N/m; a node's own is some 0.7
static const double period = 1e-3;   // s
static const double mass = 1e-4;     // kg: 13 Hz at a node's own stiffness

typedef struct loop {
    pliant_model *model;
    pliant_solver *solver;
    pliant_node nodes[node_count];
    double follow[size][size];  // u of y
} loop;

extern void dgesv_(const int *n, const int *nrhs, double *a, const int *lda, int *pivots, double *b,
                   const int *ldb, int *info);

// Displace, solve, read: one step of the haptic thread.
static void solve_for(const loop *l, const double *u, double *f)
{
    for (int i = 0; i < node_count; i++)
        assert_int_equal(pliant_solver_displace(l->solver, l->nodes[i],
                                                (pliant_vec3){(float)u[3 * i], (float)u[3 * i + 1],
                                                              (float)u[3 * i + 2]}),
                         PLIANT_OK);
    // As stored it may be rough, which is the point.
    assert_true(pliant_solver_solve(l->solver, PLIANT_NEVER) >= 0);
    for (int i = 0; i < node_count; i++) {
        const pliant_vec3 force = pliant_solver_node_force(l->solver, l->nodes[i]);
        f[3 * i] = (double)force.x, f[3 * i + 1] = (double)force.y, f[3 * i + 2] = (double)force.z;
    }
}

// A patch: the vertices nearest to one, on the finest level, or every other as a coarser hat.
static loop set_up(pliant_compliance compliance, int is_mixed)
{
    loop l = {0};
    pliant_error err = {""};
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_passivity_%d.h5", (int)getpid());
    check_write_synthetic_levels(path, NULL, 3, 0.2, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    check_ok(pliant_model_open(path, &l.model, &err), &err);
    unlink(path);
    pliant_solver_def def = pliant_solver_default(l.model);
    def.compliance = compliance;
    check_ok(pliant_solver_create(l.model, &def, &l.solver, &err), &err);
    const double *x = pliant_model_positions(l.model);
    const int32_t n = pliant_model_describe(l.model).vertex_count;
    for (int i = 0; i < node_count; i++) {
        const int32_t level = is_mixed && i % 2 ? 2 : 3;
        int32_t nearest = -1;
        double least = INFINITY;
        for (int32_t v = 0; v < n; v++) {
            const double distance =
                pow(x[3 * v] - 0.8, 2) + pow(x[3 * v + 1], 2) + pow(x[3 * v + 2] - 0.6, 2);
            int is_taken = v >= pliant_model_level_vertex_count(l.model, level);
            for (int k = 0; k < i; k++) is_taken |= l.nodes[k].vertex == v;
            if (is_taken || distance >= least) continue;
            nearest = v;
            least = distance;
        }
        l.nodes[i] = (pliant_node){level, nearest};
    }
    // K by unit displacements, then (I + K / k)^-1.
    static double matrix[size][size];  // column-major
    for (int j = 0; j < size; j++) {
        double u[size] = {0};
        u[j] = 1;
        solve_for(&l, u, matrix[j]);
        for (int i = 0; i < size; i++) matrix[j][i] = matrix[j][i] / stiffness + (i == j);
    }
    static double inverse[size][size];
    memset(inverse, 0, sizeof inverse);
    for (int i = 0; i < size; i++) inverse[i][i] = 1;
    int pivots[size], info = 0;
    dgesv_(&(int){size}, &(int){size}, &matrix[0][0], &(int){size}, pivots, &inverse[0][0],
           &(int){size}, &info);
    assert_int_equal(info, 0);
    for (int j = 0; j < size; j++)
        for (int i = 0; i < size; i++) l.follow[i][j] = inverse[j][i];
    return l;
}

static void tear_down(loop *l)
{
    pliant_solver_destroy(l->solver);
    pliant_model_close(l->model);
}

// The forces on the body for devices at y.
static void force_at(const loop *l, const double *y, double *f)
{
    double u[size];
    for (int i = 0; i < size; i++) {
        u[i] = 0;
        for (int j = 0; j < size; j++) u[i] += l->follow[i][j] * y[j];
    }
    solve_for(l, u, f);
}

// ---- Dynamic ----

// Kinetic energy and what is stored, over its value at the start; the largest of 20 s, or until it
// is a thousandfold. Semi-implicit Euler, which keeps the energy of a symmetric linear system but
// for an oscillation by omega period / 2.
static double gain_of_swing(const loop *l)
{
    check_random random = check_random_seed(3);
    double y[size], v[size] = {0}, f[size], begin = 0, most = 0;
    for (int i = 0; i < size; i++) y[i] = 0.02 * (2 * check_random_next(&random) - 1);
    for (int step = 0; step < 20000 && most < 1000; step++) {
        force_at(l, y, f);
        double energy = 0;
        for (int i = 0; i < size; i++) energy += 0.5 * mass * v[i] * v[i] + 0.5 * f[i] * y[i];
        if (step == 0) begin = energy;
        most = fmax(most, energy / begin);
        for (int i = 0; i < size; i++) {
            v[i] -= period * f[i] / mass;
            y[i] += period * v[i];
        }
    }
    return most;
}

// omega is 85 to 440 / s (K^-1 of 1.4 m/N for one node down to 1 / k for all against each other),
// so omega period / 2 is at most 0.22.
static void a_haptic_loop_gains_energy_as_stored_and_does_not_when_passive(void **state)
{
    (void)state;
    for (int is_mixed = 0; is_mixed < 2; is_mixed++) {
        loop stored = set_up(PLIANT_COMPLIANCE_STORED, is_mixed);
        loop passive = set_up(PLIANT_COMPLIANCE_PASSIVE, is_mixed);
        const double with = gain_of_swing(&passive), without = gain_of_swing(&stored);
        printf("%s: energy at most %.3g times what it was, passive; %.3g times as stored\n",
               is_mixed ? "two levels" : "one level", with, without);
        check_at_most(with, 1.25);
        // Between levels K is unsymmetric mostly as a product of symmetric matrices is, whose
        // eigenvalues are real: the energy comes and goes, but does not grow for ever.
        check_at_least(without, is_mixed ? 1.8 : 100);
        tear_down(&stored);
        tear_down(&passive);
    }
}

// ---- Quasistatic ----

// Work put in around an ellipse in the space of all devices, through places that are pressed in.
static double work_around(const loop *l, uint64_t seed, double *stored)
{
    check_random random = {seed};
    double a[size], b[size], centre[size], before[size] = {0}, place[size] = {0}, work = 0;
    for (int i = 0; i < size; i++) {
        centre[i] = 0.02 * (2 * check_random_next(&random) - 1);
        a[i] = 0.02 * (2 * check_random_next(&random) - 1);
        b[i] = 0.02 * (2 * check_random_next(&random) - 1);
    }
    *stored = 0;
    enum { steps = 200 };
    for (int step = 0; step <= steps; step++) {
        const double t = 6.283185307179586 * step / steps;
        double y[size], f[size], energy = 0;
        for (int i = 0; i < size; i++) y[i] = centre[i] + a[i] * cos(t) + b[i] * sin(t);
        force_at(l, y, f);
        for (int i = 0; i < size; i++) {
            if (step > 0) work += 0.5 * (f[i] + before[i]) * (y[i] - place[i]);
            energy += 0.5 * f[i] * y[i];
        }
        *stored = fmax(*stored, fabs(energy));
        memcpy(before, f, sizeof f);
        memcpy(place, y, sizeof y);
    }
    return work;
}

// The trapezoidal rule is exact for linear forces up to what the polygon leaves of the ellipse,
// which is closed too: any work is the skew part of K's, or rounding of floats in u and f.
static void a_closed_path_of_devices_takes_no_work_when_passive_and_some_as_stored(void **state)
{
    (void)state;
    for (int is_mixed = 0; is_mixed < 2; is_mixed++) {
        loop stored = set_up(PLIANT_COMPLIANCE_STORED, is_mixed);
        loop passive = set_up(PLIANT_COMPLIANCE_PASSIVE, is_mixed);
        double with = 0, least = 0, most = 0;
        for (uint64_t seed = 1; seed <= 20; seed++) {
            double energy;
            const double work = work_around(&passive, seed, &energy);
            with = fmax(with, fabs(work) / energy);
            const double free_work = work_around(&stored, seed, &energy) / energy;
            least = fmin(least, free_work);
            most = fmax(most, free_work);
        }
        printf("%s: work of a path over what it stored: passive %.2g, as stored %.3g to %.3g\n",
               is_mixed ? "two levels" : "one level", with, least, most);
        check_at_most(with, 1e-5);
        check_at_most(least, -1e-2);
        check_at_least(most, 1e-2);
        tear_down(&stored);
        tear_down(&passive);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_haptic_loop_gains_energy_as_stored_and_does_not_when_passive),
        cmocka_unit_test(a_closed_path_of_devices_takes_no_work_when_passive_and_some_as_stored),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
