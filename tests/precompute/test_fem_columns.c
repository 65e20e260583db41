// test_fem_columns.c: columns by finite elements, as they go into files: spheres that deform as is
// known, reciprocity, balance, boundary elements.
#include "solved_columns.h"
#include "surfaces.h"

#include "bem/kelvin.h"

#include <math.h>

// v = Xi vbar + gravity's, from u at held and p at free vertices, [n][3].
static double *respond(const solved *s, const double *u, const double *p, int axis)
{
    const size_t rows = 3 * (size_t)s->n;
    double *v = calloc(rows, sizeof *v);
    if (axis >= 0) memcpy(v, s->gravity + (size_t)axis * rows, rows * sizeof *v);
    for (int32_t k = 0; k < s->columns; k++) {
        const int held = k >= s->p->free_count;
        const int32_t vertex = held ? s->p->fixed_nodes[k - s->p->free_count] : s->p->free_nodes[k];
        for (int c = 0; c < 3; c++) {
            const double value = (held ? u : p)[3 * vertex + c];
            for (size_t i = 0; i < rows; i++)
                v[i] += value * s->xi[(3 * (size_t)k + (size_t)c) * rows + i];
        }
    }
    return v;
}

static double error_of(const solved *s, const double *v, const double *u)
{
    double off = 0, norm = 0;
    for (int32_t i = 0; i < s->p->free_count; i++)
        for (int c = 0; c < 3; c++) {
            const int32_t at = s->p->free_nodes[i];
            off += s->p->areas[at] * pow(v[3 * at + c] - u[3 * at + c], 2);
            norm += s->p->areas[at] * u[3 * at + c] * u[3 * at + c];
        }
    return sqrt(off / norm);
}

static pliant_mesh *sphere_mesh(int32_t level)
{
    check_surface sphere = check_sphere(level);
    pliant_mesh *mesh = sphere.mesh;
    sphere.mesh = NULL;
    check_surface_destroy(&sphere);
    return mesh;
}

// The closed forms of test_bem_solutions: a force outside the sphere (Kelvin), pressure (Lame), a
// body force. Flat faces inside the sphere limit both orders of elements to the boundary elements'
// two.
static void spheres_deform_as_known(void **state)
{
    (void)state;
    const pliant_material m = {2, 0.3, 2};
    enum { KELVIN, LAME, BODY, FIELDS };
    static const char *const names[] = {"Kelvin", "Lame", "body force"};
    for (int order = 1; order <= 2; order++) {
        // Meshes of one surface differ from time to time, and coarse errors with them: of small
        // ones the mean (of logarithms) over some is taken.
        static const int meshes[3] = {8, 3, 1};
        double error[FIELDS][3] = {{0}};
        for (int32_t turn = 0; turn < 8 + 3 + 1; turn++) {
            const int32_t level = turn < 8 ? 0 : turn < 8 + 3 ? 1 : 2;
            if (order == 2 && level == 2) continue;  // the longest
            pliant_mesh *mesh = sphere_mesh(level + 1);
            solved s = solve_mesh(mesh, "any(z<-0.68, z>0.68)", "2", "0.3", order);
            const size_t rows = 3 * (size_t)s.n;
            for (int field = 0; field < FIELDS; field++) {
                double *u = calloc(rows, sizeof *u), *p = calloc(rows, sizeof *p);
                for (int32_t i = 0; i < s.n; i++) {
                    const double *x = s.p->multires->mesh->vertices + 3 * (size_t)i;
                    const double r[3] = {x[0] - 0.3, x[1] - 0.2, x[2] - 3.0};
                    const double k = m.density * (1 - 2 * m.poisson) / m.young;
                    double U[3][3], T[3][3];
                    pliant_kelvin_displacement(&m, r, U);
                    pliant_kelvin_traction(&m, r, x, T);
                    for (int c = 0; c < 3; c++) {
                        if (field == KELVIN) u[3 * i + c] = U[0][c], p[3 * i + c] = T[0][c];
                        if (field == LAME)
                            p[3 * i + c] = -0.7 * x[c],
                                      u[3 * i + c] = p[3 * i + c] * (1 - 2 * m.poisson) / m.young;
                        if (field == BODY) {
                            u[3 * i + c] = -k * (x[0] * x[c] - (c == 0 ? 0.5 : 0));
                            p[3 * i + c] = -m.density * x[0] * x[c];
                        }
                    }
                }
                double *v = respond(&s, u, p, field == BODY ? 0 : -1);
                const double off = error_of(&s, v, u);
                error[field][level] += log(off) / meshes[level];
                print_message("order %d, %s, %d vertices: off by %.2e\n", order, names[field], s.n,
                              off);
                free(v), free(p), free(u);
            }
            forget(&s);
            pliant_mesh_destroy(mesh);
        }
        static const double bound[2][FIELDS] = {{4e-3, 5e-3, 5e-2}, {2e-3, 1.5e-2, 0.12}};
        for (int field = 0; field < FIELDS; field++) {
            for (int level = 0; level < 3; level++) error[field][level] = exp(error[field][level]);
            check_at_most(error[field][order == 2 ? 1 : 2], bound[order - 1][field]);
            if (order == 2) continue;
            const double slope = log2(error[field][0] / error[field][2]) / 2;
            print_message("order %d, %s: slope %.2f\n", order, names[field], slope);
            check_at_least(slope, 1.5);
            check_at_most(slope, 2.4);
        }
    }
}

// Maxwell-Betti: with M_ij = integral of phi_i phi_j over free vertices, M Xi is symmetric as far
// as elements resolve it: tractions of the rim's held vertices work on free ones, and quadratic
// elements on midpoints. Every column and the weight are carried by the reactions to rounding.
static void columns_are_reciprocal_and_in_balance(void **state)
{
    (void)state;
    double reciprocity[3] = {0};
    for (int order = 0; order <= 2; order++) {
        check_surface blob = check_blob(1);
        solved s = solve_mesh(blob.mesh, "z<-0.3", "1", "0.3", order);
        const pliant_mesh *mesh = s.p->multires->mesh;
        const size_t rows = 3 * (size_t)s.n;
        double *M = calloc((size_t)s.n * (size_t)s.n, sizeof *M);
        for (int32_t f = 0; f < mesh->face_count; f++) {
            const int32_t *v = mesh->faces + 3 * (size_t)f;
            double a[3], b[3], n2 = 0;
            for (int i = 0; i < 3; i++) {
                a[i] = mesh->vertices[3 * v[1] + i] - mesh->vertices[3 * v[0] + i];
                b[i] = mesh->vertices[3 * v[2] + i] - mesh->vertices[3 * v[0] + i];
            }
            for (int i = 0; i < 3; i++)
                n2 += pow(a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3], 2);
            for (int k = 0; k < 3; k++)
                for (int l = 0; l < 3; l++)
                    M[(size_t)v[k] * s.n + v[l]] += sqrt(n2) / 2 / 12 * (1 + (k == l));
        }
        double largest = 0, off = 0;
        double *W = calloc(3 * (size_t)s.p->free_count * 3 * (size_t)s.p->free_count, sizeof *W);
        const int32_t m = 3 * s.p->free_count;
        for (int32_t j = 0; j < m; j++)
            for (int32_t i = 0; i < m; i++)
                for (int32_t k = 0; k < s.p->free_count; k++)
                    W[(size_t)i * m + j] +=
                        M[(size_t)s.p->free_nodes[i / 3] * s.n + s.p->free_nodes[k]] *
                        s.xi[(size_t)j * rows + 3 * (size_t)s.p->free_nodes[k] + (size_t)(i % 3)];
        for (int32_t i = 0; i < m; i++)
            for (int32_t j = 0; j < m; j++) {
                largest = fmax(largest, fabs(W[(size_t)i * m + j]));
                off = fmax(off, fabs(W[(size_t)i * m + j] - W[(size_t)j * m + i]));
            }
        print_message("order %d: reciprocity off by %.1e\n", order, off / largest);
        reciprocity[order] = off / largest;
        if (order == 0) {
            free(W), free(M);
            forget(&s);
            check_surface_destroy(&blob);
            continue;
        }
        check_at_most(reciprocity[order], 1.2 * reciprocity[0]);
        for (int32_t k = 0; k < s.p->free_count + 1; k++)
            for (int c = 0; c < 3; c++) {
                const double *column = k < s.p->free_count
                                           ? s.xi + (3 * (size_t)k + (size_t)c) * rows
                                           : s.gravity + (size_t)c * rows;
                double total[3] = {0};
                total[c] = k < s.p->free_count ? s.p->areas[s.p->free_nodes[k]] : 2 * s.p->volume;
                for (int32_t i = 0; i < s.p->fixed_count; i++)
                    for (int r = 0; r < 3; r++)
                        total[r] +=
                            s.p->areas[s.p->fixed_nodes[i]] * column[3 * s.p->fixed_nodes[i] + r];
                for (int r = 0; r < 3; r++) check_near(total[r], 0, 1e-11);
            }
        // Translating the support translates the solid, without reactions.
        double *u = calloc(rows, sizeof *u), *p = calloc(rows, sizeof *p);
        for (int32_t i = 0; i < s.n; i++) u[3 * i + 1] = 1;
        double *v = respond(&s, u, p, -1);
        for (size_t i = 0; i < rows; i++)
            check_near(v[i], s.p->held[i / 3] ? 0 : i % 3 == 1, 1e-11);
        free(v), free(p), free(u), free(W), free(M);
        forget(&s);
        check_surface_destroy(&blob);
    }
}

static double difference(const solved *a, const solved *b)
{
    // Displacements of free vertices under tractions of free vertices.
    const size_t rows = 3 * (size_t)a->n;
    double off = 0, norm = 0;
    for (size_t j = 0; j < 3 * (size_t)a->p->free_count; j++)
        for (size_t i = 0; i < rows; i++) {
            if (a->p->held[i / 3]) continue;
            off += pow(a->xi[j * rows + i] - b->xi[j * rows + i], 2);
            norm += pow(b->xi[j * rows + i], 2);
        }
    return sqrt(off / norm);
}

// The whole free-free block of a sphere: half the hats' width is where the methods differ most, the
// vertex under its own traction.
static void both_methods_agree_on_a_sphere(void **state)
{
    (void)state;
    double off[2];
    for (int32_t level = 1; level <= 2; level++) {
        pliant_mesh *mesh = sphere_mesh(level);
        solved bem = solve_mesh(mesh, "z<-0.6", "5", "0.3", 0),
               fem = solve_mesh(mesh, "z<-0.6", "5", "0.3", 2);
        off[level - 1] = difference(&fem, &bem);
        print_message("sphere of %d vertices: free-free blocks differ by %.3f\n", bem.n,
                      off[level - 1]);
        forget(&fem);
        forget(&bem);
        pliant_mesh_destroy(mesh);
    }
    // Inner nodes of small spheres fall differently from run to run: 0.028 to 0.049 and 0.026 to
    // 0.028. That the difference shrinks is shown where there is more to refine:
    // test_precompute_fem.
    check_at_most(off[0], 0.08);
    check_at_most(off[1], 0.04);
}

int main(void)
{
    if (PetscInitialize(NULL, NULL, NULL, NULL)) return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spheres_deform_as_known),
        cmocka_unit_test(columns_are_reciprocal_and_in_balance),
        cmocka_unit_test(both_methods_agree_on_a_sphere),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    PetscFinalize();
    return failed;
}
