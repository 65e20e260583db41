// test_fem_beams.c: cantilevers by finite elements and by boundary elements against beam theory.
#include "solved_columns.h"

#include <math.h>

// A bar of nx x 1 x 1 cells along x, quads split alternately.
static pliant_mesh *bar_mesh(int32_t nx, int32_t across)
{
    const int32_t d[3] = {nx, across, across};
    const double h[3] = {8.0 / nx, 1.0 / across, 1.0 / across};
    int32_t *number = malloc((size_t)(nx + 1) * (across + 1) * (across + 1) * sizeof *number),
            count = 0;
    const int32_t faces = 4 * (2 * nx * across) + 4 * across * across;
    pliant_mesh *mesh = NULL;
    pliant_error err;
    const int32_t vertices = faces / 2 + 2;
    check_ok(pliant_mesh_create(vertices, faces, &mesh, &err), &err);
    for (int32_t x = 0; x <= nx; x++)
        for (int32_t y = 0; y <= across; y++)
            for (int32_t z = 0; z <= across; z++) {
                const int on = x == 0 || x == nx || y == 0 || y == across || z == 0 || z == across;
                number[(x * (across + 1) + y) * (across + 1) + z] = on ? count : -1;
                if (!on) continue;
                mesh->vertices[3 * count] = x * h[0], mesh->vertices[3 * count + 1] = y * h[1],
                                   mesh->vertices[3 * count + 2] = z * h[2];
                count++;
            }
    assert_int_equal(count, vertices);
    int32_t face = 0;
    for (int axis = 0; axis < 3; axis++)
        for (int side = 0; side < 2; side++) {
            const int a = (axis + 1) % 3, b = (axis + 2) % 3;
            for (int32_t i = 0; i < d[a]; i++)
                for (int32_t j = 0; j < d[b]; j++) {
                    int32_t q[4];
                    for (int k = 0; k < 4; k++) {
                        int32_t at[3];
                        at[axis] = side ? d[axis] : 0;
                        at[a] = i + (k == 1 || k == 2), at[b] = j + (k >= 2);
                        q[k] = number[(at[0] * (across + 1) + at[1]) * (across + 1) + at[2]];
                    }
                    if (!side) {
                        const int32_t swap = q[1];
                        q[1] = q[3], q[3] = swap;
                    }
                    const int turn = (i + j) % 2;
                    const int32_t tri[2][3] = {{q[turn], q[turn + 1], q[turn + 2]},
                                               {q[turn], q[turn + 2], q[(turn + 3) % 4]}};
                    memcpy(mesh->faces + 3 * (size_t)face, tri, sizeof tri);
                    face += 2;
                }
        }
    assert_int_equal(face, faces);
    free(number);
    return mesh;
}

// A cantilever of length 8 and section 1 x 1 under its own weight, over Timoshenko's tip deflection
//     rho L^4 / (8 E I) + rho L^2 / (2 k G A),   I = 1/12, k = 10 (1 + nu) / (12 + 11 nu)
// Tractions are hats of the held end's vertices, which reach one edge h along the sides: the bar is
// clamped that much earlier, and its deflection is that of (L - h/2)^4 or so, for both methods.
static double tip_over_theory(int order, const char *poisson, int32_t across)
{
    pliant_mesh *mesh = bar_mesh(8 * across, across);
    solved s = solve_mesh(mesh, "x<1e-6", "100", poisson, order);
    const double nu = atof(poisson), L = 8, rho = 2, E = 100, G = E / (2 * (1 + nu));
    const double k = 10 * (1 + nu) / (12 + 11 * nu);
    const double theory = rho * L * L * L * L / (8 * E / 12) + rho * L * L / (2 * k * G);
    double sum = 0;
    int count = 0;
    for (int32_t i = 0; i < s.n; i++)
        if (s.p->multires->mesh->vertices[3 * i] > L - 1e-6)
            sum += s.gravity[2 * 3 * (size_t)s.n + 3 * (size_t)i + 2], count++;
    print_message("order %d, nu %s, %d across: tip %.4f of beam theory\n", order, poisson, across,
                  sum / count / theory);
    forget(&s);
    pliant_mesh_destroy(mesh);
    return sum / count / theory;
}

static void a_cantilever_bends_as_beam_theory_says(void **state)
{
    (void)state;
    double tip[3];
    for (int k = 0; k < 3; k++) tip[k] = tip_over_theory(2, "0.3", k + 1);
    check_near(tip[2], 1, 0.06);
    // First order in h: from h = 1/2 and 1/3 to h = 0.
    check_near(3 * tip[2] - 2 * tip[1], 1, 0.02);
    const double coarse = tip_over_theory(0, "0.3", 2), fine = tip_over_theory(0, "0.3", 3);
    check_at_most(fabs(fine - tip[2]), 0.8 * fabs(coarse - tip[1]));
    check_near(fine, tip[2], 0.12);
}

static void quadratic_tetrahedra_do_not_lock_and_linear_ones_do(void **state)
{
    (void)state;
    const double coarse = tip_over_theory(2, "0.49", 2), fine = tip_over_theory(2, "0.49", 3);
    check_at_least(fine, 0.9);
    check_near(3 * fine - 2 * coarse, 1, 0.03);
    check_at_most(tip_over_theory(1, "0.3", 2), 0.6);
    check_at_most(tip_over_theory(1, "0.49", 2), 0.35);
}

int main(void)
{
    if (PetscInitialize(NULL, NULL, NULL, NULL)) return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cantilever_bends_as_beam_theory_says),
        cmocka_unit_test(quadratic_tetrahedra_do_not_lock_and_linear_ones_do),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    PetscFinalize();
    return failed;
}
