// test_contact_law.c: contact forces against enumeration, closed forms and the conditions
// themselves.
#include "check.h"

#include "contact_law.h"
#include "surfaces.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

// ---- Problems ----

static pliant_contact_law law_for(int32_t capacity, pliant_arena *arena)
{
    pliant_contact_law law;
    pliant_error err = {""};
    *arena = (pliant_arena){0};
    pliant_contact_law_lay_out(arena, capacity, &law);
    check_ok(pliant_arena_reserve(arena, &err), &err);
    pliant_contact_law_lay_out(arena, capacity, &law);
    return law;
}

static double between(check_random *random, double from, double to)
{
    return from + (to - from) * check_random_next(random);
}

// X X^T of a random matrix plus a multiple of the identity: the smaller that, the worse its
// condition.
static void make_definite(check_random *random, int32_t n, double shift, double *a)
{
    double *x = malloc((size_t)n * (size_t)n * sizeof *x);
    assert_non_null(x);
    for (int32_t i = 0; i < n * n; i++) x[i] = between(random, -1, 1);
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j < n; j++) {
            double sum = i == j ? shift : 0;
            for (int32_t k = 0; k < n; k++) sum += x[i * n + k] * x[j * n + k];
            a[i * n + j] = sum;
        }
    free(x);
}

static double dot(int32_t n, const double *a, const double *b)
{
    double sum = 0;
    for (int32_t i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

static double row_value(int32_t n, const double *a, const double *b, const double *x, int32_t i)
{
    return b[i] + dot(n, a + (size_t)i * (size_t)n, x);
}

// An elastic half-space, z > 0 outside, under a grid of square patches of side `side`, each with
// uniform traction: Boussinesq's and Cerruti's solutions integrated over patches,
//
//     u_n = (1 - nu) / (2 pi G r) f_n      u_t = ((1 - nu) I / r + nu r r^T / r^3) f_t / (2 pi G)
//
// and with nu = 1/2 no coupling between normal and tangent. G = 1. The integral of 1/r over a
// square of side 1 about its middle is 4 asinh(1), that of x^2/r^3 half of it.
typedef struct half_space {
    int32_t count;
    double side;
    double *x;   // shape [count][2]
    double *b3;  // shape [3 count][3 count]
    double *a;   // shape [count][count]
} half_space;

static half_space make_half_space(int32_t across, double side)
{
    enum { cells = 8 };
    half_space h = {.count = across * across, .side = side};
    const size_t n = (size_t)h.count;
    h.x = calloc(2 * n, sizeof *h.x);
    h.b3 = calloc(9 * n * n, sizeof *h.b3);
    h.a = calloc(n * n, sizeof *h.a);
    assert_true(h.x && h.b3 && h.a);
    for (int32_t i = 0; i < h.count; i++) {
        h.x[2 * i] = (i % across - (across - 1) / 2.0) * side;
        h.x[2 * i + 1] = (i / across - (across - 1) / 2.0) * side;
    }
    const double nu = 0.5;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double inverse = 0, xx = 0, xy = 0, yy = 0;  // means of 1/r, x x/r^3, ...
            if (i == j) {
                inverse = 4 * asinh(1) / side;
                xx = yy = inverse / 2;
            } else {
                for (int k = 0; k < cells * cells; k++) {
                    const double dx =
                        h.x[2 * i] - h.x[2 * j] + ((k % cells + 0.5) / cells - 0.5) * side;
                    const double dy = h.x[2 * i + 1] - h.x[2 * j + 1] +
                                      (((double)(k / cells) + 0.5) / cells - 0.5) * side;
                    const double r = hypot(dx, dy), part = 1.0 / (cells * cells);
                    inverse += part / r;
                    xx += part * dx * dx / (r * r * r);
                    xy += part * dx * dy / (r * r * r);
                    yy += part * dy * dy / (r * r * r);
                }
            }
            double *to = h.b3 + 9 * n * i + 3 * j;
            to[0] = (1 - nu) * inverse / (2 * pi);
            to[3 * n + 1] = ((1 - nu) * inverse + nu * xx) / (2 * pi);
            to[3 * n + 2] = to[6 * n + 1] = nu * xy / (2 * pi);
            to[6 * n + 2] = ((1 - nu) * inverse + nu * yy) / (2 * pi);
            h.a[n * i + j] = to[0];
        }
    return h;
}

static void free_half_space(half_space *h)
{
    free(h->x);
    free(h->b3);
    free(h->a);
}

// Gaps under a rigid ball of radius 1 whose lowest point is `depth` under the surface, its top seen
// as a paraboloid (what Hertz does).
static void gaps_under_ball(const half_space *h, double depth, double *b)
{
    for (int32_t i = 0; i < h->count; i++)
        b[i] = (h->x[2 * i] * h->x[2 * i] + h->x[2 * i + 1] * h->x[2 * i + 1]) / 2 - depth;
}

// ---- Without friction ----

// The solution by trying every active set: the one whose signs are right.
static int32_t solve_by_enumeration(int32_t n, const double *a, const double *b, double *lambda)
{
    for (int32_t set = 0; set < 1 << n; set++) {
        double m[10][11];
        int32_t index[10], k = 0;
        for (int32_t i = 0; i < n; i++)
            if (set >> i & 1) index[k++] = i;
        for (int32_t i = 0; i < k; i++) {
            for (int32_t j = 0; j < k; j++) m[i][j] = a[index[i] * n + index[j]];
            m[i][k] = -b[index[i]];
        }
        for (int32_t p = 0; p < k; p++)  // definite: no pivoting
            for (int32_t i = 0; i < k; i++) {
                if (i == p) continue;
                const double factor = m[i][p] / m[p][p];
                for (int32_t j = p; j <= k; j++) m[i][j] -= factor * m[p][j];
            }
        memset(lambda, 0, (size_t)n * sizeof *lambda);
        int32_t is_right = 1;
        for (int32_t i = 0; i < k; i++) {
            lambda[index[i]] = m[i][k] / m[i][i];
            is_right &= lambda[index[i]] >= 0;
        }
        for (int32_t i = 0; i < n; i++)
            if (!(set >> i & 1)) is_right &= row_value(n, a, b, lambda, i) >= 0;
        if (is_right) return 1;
    }
    return 0;
}

static void pushing_equals_trying_every_active_set(void **state)
{
    (void)state;
    check_random random = check_random_seed(11);
    pliant_arena arena;
    pliant_contact_law law = law_for(10, &arena);
    int32_t most_sets = 0;
    for (int32_t trial = 0; trial < 2000; trial++) {
        const int32_t n = 1 + check_random_index(&random, 10);
        double a[100], b[10], expected[10], lambda[10];
        make_definite(&random, n, pow(10, between(&random, -3, 1)), a);
        for (int32_t i = 0; i < n; i++) {
            b[i] = between(&random, -1, 0.5);
            lambda[i] = between(&random, -1, 1);  // an arbitrary start
        }
        assert_true(solve_by_enumeration(n, a, b, expected));
        const pliant_contact_law_report report = pliant_contact_law_push(&law, n, a, b, lambda);
        assert_true(report.is_done);
        if (report.count > most_sets) most_sets = report.count;
        double scale = 1;
        for (int32_t i = 0; i < n; i++) scale = fmax(scale, expected[i]);
        // Condition numbers to 1e5.
        for (int32_t i = 0; i < n; i++) check_near(lambda[i] / scale, expected[i] / scale, 1e-9);
        check_at_most(report.residual, 1e-9);
    }
    check_at_most(most_sets, 20);
    pliant_arena_release(&arena);
}

static void pushing_meets_hertz_under_a_ball(void **state)
{
    (void)state;
    half_space h = make_half_space(17, 0.025);
    pliant_arena arena;
    pliant_contact_law law = law_for(h.count, &arena);
    double *b = calloc((size_t)h.count, sizeof *b), *lambda = calloc((size_t)h.count, sizeof *b);
    assert_true(b && lambda);
    double before = 0;
    for (double depth = 0.005; depth < 0.031; depth *= 2) {
        gaps_under_ball(&h, depth, b);
        const pliant_contact_law_report report =
            pliant_contact_law_push(&law, h.count, h.a, b, lambda);
        assert_true(report.is_done);
        check_at_most(report.residual, 1e-12);
        check_at_most(report.count, 12);
        double force = 0;
        for (int32_t i = 0; i < h.count; i++) {
            check_at_least(lambda[i], 0);
            const double gap = row_value(h.count, h.a, b, lambda, i);
            check_at_least(gap, -1e-12);
            check_at_most(lambda[i] * gap, 1e-15);
            force += lambda[i];
        }
        // F = 4/3 E* sqrt(R) depth^3/2 with E* = 2 G / (1 - nu) = 4; contact radius sqrt(depth), 3
        // to 7 patches, whose boundary is resolved to half a patch: a relative error of some
        // (side / 2 / radius)^2 to 2.5% of the first.
        const double hertz = 4.0 / 3 * 4 * pow(depth, 1.5);
        printf("    depth %g: force %.5g, Hertz %.5g, %d sets\n", depth, force, hertz,
               report.count);
        check_near(force / hertz, 1, 0.02);
        check_at_least(force, 2 * before);  // grows faster than the depth
        before = force;
    }
    free(b);
    free(lambda);
    pliant_arena_release(&arena);
    free_half_space(&h);
}

static void a_warm_start_takes_one_set(void **state)
{
    (void)state;
    half_space h = make_half_space(10, 0.04);
    pliant_arena arena;
    pliant_contact_law law = law_for(h.count, &arena);
    double b[100], lambda[100] = {0};
    gaps_under_ball(&h, 0.02, b);
    assert_true(pliant_contact_law_push(&law, h.count, h.a, b, lambda).count > 1);
    gaps_under_ball(&h, 0.0201, b);
    assert_int_equal(pliant_contact_law_push(&law, h.count, h.a, b, lambda).count, 1);
    pliant_arena_release(&arena);
    free_half_space(&h);
}

static void contacts_that_share_a_place_are_finite(void **state)
{
    (void)state;
    pliant_arena arena;
    pliant_contact_law law = law_for(3, &arena);
    // The second is the first, and the third nearly.
    const double a[9] = {1, 1, 0.5, 1, 1, 0.5, 0.5, 0.5, 0.25 + 1e-13}, b[3] = {-1, -1, -0.5};
    double lambda[3] = {1, 1, 1};
    const pliant_contact_law_report report = pliant_contact_law_push(&law, 3, a, b, lambda);
    assert_true(report.is_done);
    for (int i = 0; i < 3; i++) {
        check_at_least(lambda[i], 0);
        check_at_least(row_value(3, a, b, lambda, i), -1e-9);
    }
    check_near(lambda[0] + lambda[1] + 0.5 * lambda[2], 1, 1e-9);
    pliant_arena_release(&arena);
}

static void the_force_is_the_gradient_of_an_energy(void **state)
{
    (void)state;
    // A tool that goes round a loop over random springs: with b = b0 - n . x the force is F = sum
    // of lambda n, and the work over the loop vanishes: the minimum of lambda A lambda / 2 + b
    // lambda is a function of x. The trapezoid rule's error falls with the square of the step, but
    // for kinks, where it is of that order too.
    enum { contacts = 12, steps = 4000 };
    check_random random = check_random_seed(5);
    pliant_arena arena;
    pliant_contact_law law = law_for(contacts, &arena);
    double a[contacts * contacts], b0[contacts], normal[contacts][2], b[contacts];
    double lambda[contacts] = {0}, work = 0, most = 0, before[2] = {0}, place[2] = {0};
    make_definite(&random, contacts, 0.1, a);
    for (int i = 0; i < contacts; i++) {
        const double angle = between(&random, 0, 2 * pi);
        normal[i][0] = cos(angle), normal[i][1] = sin(angle);
        b0[i] = between(&random, -0.5, 0.5);
    }
    for (int step = 0; step <= steps; step++) {
        const double angle = 2 * pi * step / steps, x[2] = {cos(angle) - 1, sin(angle)};
        double force[2] = {0};
        for (int i = 0; i < contacts; i++) b[i] = b0[i] - normal[i][0] * x[0] - normal[i][1] * x[1];
        assert_true(pliant_contact_law_push(&law, contacts, a, b, lambda).is_done);
        for (int i = 0; i < contacts; i++)
            for (int c = 0; c < 2; c++) force[c] += lambda[i] * normal[i][c];
        if (step)
            for (int c = 0; c < 2; c++) work += (force[c] + before[c]) / 2 * (x[c] - place[c]);
        most = fmax(most, fabs(work));
        memcpy(before, force, sizeof force);
        memcpy(place, x, sizeof place);
    }
    check_at_least(most, 0.1);
    check_at_most(fabs(work) / most, 1e-5);
    pliant_arena_release(&arena);
}

// ---- With friction ----

// The conditions, looked at one by one: with forces to `f_tolerance` and lengths to `r_tolerance`.
static void check_coulomb(int32_t count, const double *matrix, const double *b,
                          const double *friction, const double *force, double f_tolerance,
                          double r_tolerance)
{
    const int32_t n = 3 * count;
    for (int32_t i = 0; i < count; i++) {
        const double *f = force + 3 * i;
        double r[3];
        for (int c = 0; c < 3; c++) r[c] = row_value(n, matrix, b, force, 3 * i + c);
        check_at_least(f[0], 0);
        check_at_least(r[0], -r_tolerance);
        if (f[0] > f_tolerance) check_at_most(r[0], r_tolerance);
        const double tangential = hypot(f[1], f[2]), bound = friction[i] * f[0];
        check_at_most(tangential, bound + f_tolerance);
        const double slip = hypot(r[1], r[2]);
        if (friction[i] == 0 || f[0] <= f_tolerance || slip <= r_tolerance) continue;
        // Sliding: at the limit, and against the slip.
        check_near(tangential, bound, f_tolerance);
        check_near(f[1] * r[1] + f[2] * r[2], -tangential * slip, 1e-3 * tangential * slip);
    }
}

static void one_contact_sticks_until_the_limit_and_then_slides(void **state)
{
    (void)state;
    pliant_arena arena;
    pliant_contact_law law = law_for(1, &arena);
    const double normal_compliance = 0.02, tangent_compliance = 0.05, depth = 0.1, mu = 0.3;
    const double matrix[9] = {normal_compliance, 0, 0, 0, tangent_compliance, 0, 0, 0,
                              tangent_compliance};
    const double normal_force = depth / normal_compliance;
    const double threshold = mu * normal_force * tangent_compliance;
    for (double part = 0.05; part < 3; part += 0.1) {
        for (double angle = 0; angle < 6.2; angle += 0.7) {
            const double drag = part * threshold;
            // The tool dragged the surface: without force it would lag by the drag.
            const double b[3] = {-depth, -drag * cos(angle), -drag * sin(angle)};
            double force[3] = {0};
            const pliant_contact_law_report report =
                pliant_contact_law_rub(&law, 1, matrix, b, &mu, 1e-14, 50, force);
            assert_true(report.is_done);
            assert_int_equal(report.count, 1);
            const double expected = fmin(drag / tangent_compliance, mu * normal_force);
            check_near(force[0], normal_force, 1e-9);
            check_near(force[1], expected * cos(angle), 1e-9);
            check_near(force[2], expected * sin(angle), 1e-9);
        }
    }
    pliant_arena_release(&arena);
}

static void a_coupled_contact_meets_the_conditions(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    pliant_arena arena;
    pliant_contact_law law = law_for(1, &arena);
    int32_t regimes[3] = {0};
    for (int trial = 0; trial < 5000; trial++) {
        double matrix[9];
        make_definite(&random, 3, 0.5, matrix);
        // Small enough for the solution to exist whatever the load: B_nn > mu |B_nt|.
        const double coupling = hypot(matrix[1], matrix[2]) / matrix[0];
        const double mu = between(&random, 0, 1) * fmin(1, 0.99 / coupling);
        const double b[3] = {between(&random, -1, 0.3), between(&random, -1, 1),
                             between(&random, -1, 1)};
        double force[3] = {between(&random, 0, 1), between(&random, -1, 1),
                           between(&random, -1, 1)};
        const pliant_contact_law_report report =
            pliant_contact_law_rub(&law, 1, matrix, b, &mu, 1e-10, 5, force);
        assert_true(report.is_done);
        check_coulomb(1, matrix, b, &mu, force, 1e-8, 1e-8);
        const double slip =
            hypot(row_value(3, matrix, b, force, 1), row_value(3, matrix, b, force, 2));
        regimes[force[0] == 0 ? 0 : slip < 1e-9 ? 1 : 2]++;
    }
    for (int i = 0; i < 3; i++) check_at_least(regimes[i], 300);
    pliant_arena_release(&arena);
}

static void rubbing_without_friction_is_pushing(void **state)
{
    (void)state;
    half_space h = make_half_space(8, 0.05);
    pliant_arena arena;
    pliant_contact_law law = law_for(h.count, &arena);
    double b[64], b3[192], lambda[64] = {0}, force[192] = {0}, friction[64] = {0};
    gaps_under_ball(&h, 0.02, b);
    for (int i = 0; i < 64; i++) b3[3 * i] = b[i], b3[3 * i + 1] = 0.01, b3[3 * i + 2] = -0.02;
    assert_true(pliant_contact_law_push(&law, 64, h.a, b, lambda).is_done);
    assert_true(pliant_contact_law_rub(&law, 64, h.b3, b3, friction, 1e-12, 200, force).is_done);
    double scale = 0;
    for (int i = 0; i < 64; i++) scale = fmax(scale, lambda[i]);
    for (int i = 0; i < 64; i++) {
        check_near(force[3 * i] / scale, lambda[i] / scale, 1e-8);
        assert_true(force[3 * i + 1] == 0 && force[3 * i + 2] == 0);
    }
    pliant_arena_release(&arena);
    free_half_space(&h);
}

static void a_dragged_ball_slips_from_the_rim_inwards_as_cattaneo_and_mindlin_say(void **state)
{
    (void)state;
    half_space h = make_half_space(13, 0.025);
    const int32_t count = h.count;
    pliant_arena arena;
    pliant_contact_law law = law_for(count, &arena);
    double *b = calloc((size_t)count, sizeof *b), *b3 = calloc(3 * (size_t)count, sizeof *b3);
    double *force = calloc(3 * (size_t)count, sizeof *force);
    double *friction = calloc((size_t)count, sizeof *friction);
    assert_true(b && b3 && force && friction);
    const double depth = 0.015, mu = 0.4, radius = sqrt(depth), nu = 0.5;
    gaps_under_ball(&h, depth, b);
    for (int32_t i = 0; i < count; i++) friction[i] = mu;
    int32_t sweeps = 0;
    double stuck_before = 1e9;
    for (int k = 1; k <= 5; k++) {
        // Q = mu P (1 - (1 - 16 G a x / (3 (2 - nu) mu P))^3/2), to full sliding at k = 5; stick
        // where r < a (1 - Q / (mu P))^1/3.
        const double load = 4.0 / 3 * 4 * pow(depth, 1.5);
        const double full = 3 * (2 - nu) * mu * load / (16 * radius);
        const double drag = 0.25 * k * full;
        for (int32_t i = 0; i < count; i++) {
            b3[3 * i] = b[i];
            b3[3 * i + 1] = -drag;
            b3[3 * i + 2] = 0;
        }
        const pliant_contact_law_report report =
            pliant_contact_law_rub(&law, count, h.b3, b3, friction, 1e-8 * depth, 500, force);
        assert_true(report.is_done);
        sweeps += report.count;
        check_coulomb(count, h.b3, b3, friction, force, 1e-5 * load / 50, 1e-5 * depth);
        double normal = 0, tangential = 0, stuck_area = 0;
        for (int32_t i = 0; i < count; i++) {
            normal += force[3 * i];
            tangential += force[3 * i + 1];
            if (force[3 * i] > 0 &&
                hypot(force[3 * i + 1], force[3 * i + 2]) < (1 - 1e-6) * mu * force[3 * i])
                stuck_area += h.side * h.side;
        }
        const double rest = fmax(0, 1 - drag / full);
        const double expected = mu * load * (1 - pow(rest, 1.5));
        printf("    drag %.2f of full: tangential %.5f, Mindlin %.5f, stuck radius %.3f (%.3f), "
               "%d sweeps\n",
               drag / full, tangential, expected, sqrt(stuck_area / pi), radius * sqrt(rest),
               report.count);
        check_near(normal / load, 1, 0.02);
        // Forces to the resolution of the boundary, as for Hertz; and Mindlin lets surfaces slip
        // along the drag only, which is exact for nu = 0 and within 1% otherwise.
        check_near(tangential / expected, 1, 0.03);
        check_near(sqrt(stuck_area / pi), radius * sqrt(rest), h.side);
        check_at_most(stuck_area, stuck_before);
        stuck_before = stuck_area;
    }
    check_at_most(sweeps, 5 * 60);
    free(b);
    free(b3);
    free(force);
    free(friction);
    pliant_arena_release(&arena);
    free_half_space(&h);
}

static void rubbing_in_circles_only_dissipates(void **state)
{
    (void)state;
    // A ball pressed in, dragged round and lifted. What sticks keeps its place on the ball, what
    // slides is left where it slid to. Work against friction, the sum of -f_t . slip, never falls,
    // and the tool's work over the loop equals it to the trapezoid rule's error.
    half_space h = make_half_space(9, 0.05);
    const int32_t count = h.count;
    enum { steps = 400 };
    pliant_arena arena;
    pliant_contact_law law = law_for(count, &arena);
    double *b = calloc((size_t)count, sizeof *b), *b3 = calloc(3 * (size_t)count, sizeof *b3);
    double *force = calloc(3 * (size_t)count, sizeof *force);
    double *friction = calloc((size_t)count, sizeof *friction);
    double *slipped = calloc(2 * (size_t)count, sizeof *slipped);
    assert_true(b && b3 && force && friction && slipped);
    for (int32_t i = 0; i < count; i++) friction[i] = 0.3;
    double work = 0, heat = 0, most = 0, before[3] = {0}, place[3] = {0};
    for (int step = 0; step <= steps; step++) {
        const double turn = 2 * pi * step / steps;
        const double x[3] = {0.02 * sin(turn), 0.02 * (1 - cos(turn)), 0.03 * sin(turn / 2)};
        gaps_under_ball(&h, x[2], b);
        for (int32_t i = 0; i < count; i++) {
            b3[3 * i] = b[i];
            b3[3 * i + 1] = -x[0] - slipped[2 * i];
            b3[3 * i + 2] = -x[1] - slipped[2 * i + 1];
        }
        assert_true(
            pliant_contact_law_rub(&law, count, h.b3, b3, friction, 1e-9, 1000, force).is_done);
        double total[3] = {0};
        for (int32_t i = 0; i < count; i++) {
            const double slip[2] = {row_value(3 * count, h.b3, b3, force, 3 * i + 1),
                                    row_value(3 * count, h.b3, b3, force, 3 * i + 2)};
            const double loss = -force[3 * i + 1] * slip[0] - force[3 * i + 2] * slip[1];
            check_at_least(loss, -1e-9 * fabs(force[3 * i]));
            heat += loss;
            for (int c = 0; c < 2; c++) slipped[2 * i + c] += slip[c];
            total[0] += force[3 * i + 1];
            total[1] += force[3 * i + 2];
            total[2] += force[3 * i];
        }
        if (step)
            for (int c = 0; c < 3; c++) work += (total[c] + before[c]) / 2 * (x[c] - place[c]);
        most = fmax(most, work);
        memcpy(before, total, sizeof before);
        memcpy(place, x, sizeof place);
    }
    printf("    work over the loop %.4g, heat %.4g, most work %.4g\n", work, heat, most);
    check_at_least(heat, 0.1 * most);
    check_near(work, heat, 0.02 * most);
    free(b);
    free(b3);
    free(force);
    free(friction);
    free(slipped);
    pliant_arena_release(&arena);
    free_half_space(&h);
}

static void forces_stay_in_their_cones_when_sweeps_run_out(void **state)
{
    (void)state;
    check_random random = check_random_seed(9);
    pliant_arena arena;
    pliant_contact_law law = law_for(20, &arena);
    double matrix[3600], b[60], force[60], friction[20];
    for (int trial = 0; trial < 200; trial++) {
        make_definite(&random, 60, 0.01, matrix);
        for (int i = 0; i < 60; i++) {
            b[i] = between(&random, -1, 1);
            force[i] = between(&random, -10, 10);
        }
        for (int i = 0; i < 20; i++) friction[i] = between(&random, 0, 2);
        const pliant_contact_law_report report =
            pliant_contact_law_rub(&law, 20, matrix, b, friction, 0, trial % 10, force);
        assert_false(report.is_done);
        for (int i = 0; i < 20; i++) {
            check_at_least(force[3 * i], 0);
            check_at_most(hypot(force[3 * i + 1], force[3 * i + 2]),
                          friction[i] * force[3 * i] * (1 + 1e-12) + 1e-12);
        }
    }
    pliant_arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pushing_equals_trying_every_active_set),
        cmocka_unit_test(pushing_meets_hertz_under_a_ball),
        cmocka_unit_test(a_warm_start_takes_one_set),
        cmocka_unit_test(contacts_that_share_a_place_are_finite),
        cmocka_unit_test(the_force_is_the_gradient_of_an_energy),
        cmocka_unit_test(one_contact_sticks_until_the_limit_and_then_slides),
        cmocka_unit_test(a_coupled_contact_meets_the_conditions),
        cmocka_unit_test(rubbing_without_friction_is_pushing),
        cmocka_unit_test(a_dragged_ball_slips_from_the_rim_inwards_as_cattaneo_and_mindlin_say),
        cmocka_unit_test(rubbing_in_circles_only_dissipates),
        cmocka_unit_test(forces_stay_in_their_cones_when_sweeps_run_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
