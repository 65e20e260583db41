// singular_integral.c: integrals over one element from one of its own vertices, in closed form.
//
// Duffy's map (M. G. Duffy, Quadrature over a pyramid or cube of integrands with a singularity at a
// vertex, SIAM J. Numer. Anal. 19, 1982) puts the vertex at s = 0 of y = x + s e(t), with e(t)
// running along the opposite edge for t in [0, 1] and dS = 2 area s ds dt. U is homogeneous of
// degree -1 in r, T of degree -2, so the integral over s is 1/2 or 1 and a line integral is left:
//
//     int U phi_0 = area int U(e) dt           phi_0 = 1 - s
//     int U phi_1 = area int (1 - t) U(e) dt   phi_1 = s (1 - t)
//     int U phi_2 = area int t U(e) dt         phi_2 = s t
//     int T phi_1 = 2 area int (1 - t) T(e) dt, and so on
//
// With tau the arc length along the edge from the foot of x's perpendicular, e = p + tau u with
// p . u = 0, h = |p| and |e|^2 = h^2 + tau^2, every integrand is tau^m / |e| or tau^m / |e|^3:
// elementary.
// In the element's plane d = 0, so that S vanishes.
#include "bem/singular_integral.h"

#include <math.h>
#include <string.h>

enum { POWERS = 4 };

// int tau^m / |e|^3 (m = 0..3) and int tau^m / |e| (m = 0, 1) from tau = a to b.
static void integrate_powers(double h, double a, double b, double cubic[POWERS], double linear[2])
{
    const double ra = hypot(h, a), rb = hypot(h, b), arc = asinh(b / h) - asinh(a / h);
    const double sine = b / rb - a / ra;
    linear[0] = arc;
    linear[1] = rb - ra;
    cubic[0] = sine / (h * h);
    cubic[1] = 1 / ra - 1 / rb;
    cubic[2] = arc - sine;
    cubic[3] = rb - ra + h * h * (1 / rb - 1 / ra);
}

void pliant_singular_integral_set(const pliant_kelvin_constants *constants,
                                  const pliant_element *element, int own,
                                  pliant_element_integrals *integrals)
{
    const int hat_a = (own + 1) % 3, hat_b = (own + 2) % 3;
    double a[3], u[3], p[3], edge = 0, tau_a = 0, tau_b = 0;
    for (int i = 0; i < 3; i++) {
        a[i] = element->spokes[hat_a][i] - element->spokes[own][i];
        u[i] = element->spokes[hat_b][i] - element->spokes[hat_a][i];
        edge += u[i] * u[i];
    }
    edge = sqrt(edge);
    for (int i = 0; i < 3; i++) {
        u[i] /= edge;
        tau_a += a[i] * u[i];
    }
    tau_b = tau_a + edge;
    for (int i = 0; i < 3; i++) p[i] = a[i] - tau_a * u[i];
    const double h = 2 * element->area / edge;
    double cubic[POWERS], linear[2];
    integrate_powers(h, tau_a, tau_b, cubic, linear);

    // With dt = dtau / edge, an integral against 1 - t or t is one against (tau_b - tau) / edge or
    // (tau - tau_a) / edge.
    const struct {
        int hat;
        double constant, slope;  // constant + slope tau
    } weights[3] = {
        {own, 1, 0}, {hat_a, tau_b / edge, -1 / edge}, {hat_b, -tau_a / edge, 1 / edge}};
    static const int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    const double *n = element->normal;
    const double pn[3] = {p[1] * n[2] - p[2] * n[1], p[2] * n[0] - p[0] * n[2],
                          p[0] * n[1] - p[1] * n[0]};
    const double un[3] = {u[1] * n[2] - u[2] * n[1], u[2] * n[0] - u[0] * n[2],
                          u[0] * n[1] - u[1] * n[0]};
    memset(integrals, 0, sizeof *integrals);
    for (int k = 0; k < 3; k++) {
        double *out = integrals->of_hat[weights[k].hat];
        const double c = weights[k].constant, s = weights[k].slope;
        double m[3];  // int (c + s tau) tau^m / |e|^3
        for (int power = 0; power < 3; power++) m[power] = c * cubic[power] + s * cubic[power + 1];
        const double factor = element->area / edge;
        const double trace = constants->diagonal * (c * linear[0] + s * linear[1]);
        for (int q = 0; q < 6; q++) {
            const int i = pairs[q][0], j = pairs[q][1];
            const double bracket =
                p[i] * p[j] * m[0] + (p[i] * u[j] + u[i] * p[j]) * m[1] + u[i] * u[j] * m[2];
            out[PLIANT_INTEGRAL_U + q] = factor * (bracket + (i == j ? trace : 0));
        }
        if (k == 0) continue;
        for (int i = 0; i < 3; i++)
            out[PLIANT_INTEGRAL_W + i] =
                2 * factor * constants->shear * (pn[i] * m[0] + un[i] * m[1]);
    }
}
