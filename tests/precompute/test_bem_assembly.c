// test_bem_assembly.c: the assembled rows.
#include "check.h"
#include "surfaces.h"

#include "bem/bem.h"
#include "bem/element.h"
#include "bem/near_integral.h"
#include "bem/singular_integral.h"
#include "bem_reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const pliant_material rubber = {2, 0.3, 1.5};

// All rows, no node fixed: A = H, B = G; column-major, 3n x 3n.
typedef struct matrices {
    int32_t vertex_count;
    size_t size;
    double *H, *G;
} matrices;

static matrices assemble(const pliant_mesh *mesh, const pliant_material *material)
{
    pliant_error err;
    pliant_bem *bem = NULL;
    check_ok(pliant_bem_create(mesh, material, &bem, &err), &err);
    matrices m = {.vertex_count = mesh->vertex_count, .size = 3 * (size_t)mesh->vertex_count};
    m.H = malloc(m.size * m.size * sizeof *m.H);
    m.G = malloc(m.size * m.size * sizeof *m.G);
    uint8_t *fixed = calloc((size_t)mesh->vertex_count, 1);
    assert_true(m.H && m.G && fixed);
    check_ok(pliant_bem_assemble(bem, 0, mesh->vertex_count, fixed, m.H, m.size, m.G, m.size, NULL,
                                 0, &err),
             &err);
    free(fixed);
    pliant_bem_destroy(bem);
    return m;
}

static void release(matrices *m)
{
    free(m->H);
    free(m->G);
}

// A sphere of 162 vertices, squashed, waved and shaken: triangles of all shapes, thin sheets.
static pliant_mesh *crumpled(int32_t levels)
{
    check_surface sphere = check_sphere(levels);
    pliant_mesh *mesh = NULL;
    pliant_error err;
    const int32_t n = sphere.mesh->vertex_count;
    check_ok(pliant_mesh_create(n, sphere.mesh->face_count, &mesh, &err), &err);
    memcpy(mesh->faces, sphere.mesh->faces, sizeof(int32_t) * 3 * (size_t)mesh->face_count);
    check_random random = check_random_seed(31);
    for (int32_t v = 0; v < n; v++) {
        const double *x = sphere.mesh->vertices + 3 * (size_t)v;
        const double wave = 1 + 0.2 * sin(5 * x[0]) * cos(4 * x[1]);
        const double stretch[3] = {1, 0.7, 0.3};
        for (int i = 0; i < 3; i++)
            mesh->vertices[3 * (size_t)v + i] =
                wave * stretch[i] * x[i] + 0.45 / sqrt(n) * (check_random_next(&random) - 0.5);
    }
    check_surface_destroy(&sphere);
    return mesh;
}

// Largest |sum_j M_ij x_j|, and the largest sum_j |M_ij|.
static double worst_product(const matrices *m, const double *M, const double *x, double *row_size)
{
    double worst = 0;
    *row_size = 0;
    for (size_t i = 0; i < m->size; i++) {
        double sum = 0, size = 0;
        for (size_t j = 0; j < m->size; j++) {
            sum += M[i + j * m->size] * x[j];
            size += fabs(M[i + j * m->size]);
        }
        worst = fmax(worst, fabs(sum));
        *row_size = fmax(*row_size, size);
    }
    return worst;
}

// Exact by construction but for the rounding of n sums: n eps of the row at the very worst.
static void translations_give_no_traction(void **state)
{
    (void)state;
    pliant_mesh *mesh = crumpled(2);
    matrices m = assemble(mesh, &rubber);
    double *u = calloc(m.size, sizeof *u);
    for (int c = 0; c < 3; c++) {
        for (size_t j = 0; j < m.size; j++) u[j] = (int)(j % 3) == c;
        double row;
        const double residual = worst_product(&m, m.H, u, &row);
        check_at_most(residual, 1e-14 * row);
    }
    free(u);
    release(&m);
    pliant_mesh_destroy(mesh);
}

// Exact but for quadrature: linear hats hold a rotation. An independent reference measures 1e-9.
static void rotations_give_no_traction(void **state)
{
    (void)state;
    for (int32_t levels = 1; levels <= 3; levels++) {
        check_surface sphere = check_sphere(levels);
        matrices m = assemble(sphere.mesh, &rubber);
        double *u = malloc(m.size * sizeof *u);
        for (int axis = 0; axis < 3; axis++) {
            for (int32_t v = 0; v < m.vertex_count; v++) {
                const double *x = sphere.mesh->vertices + 3 * (size_t)v;
                u[3 * (size_t)v + axis] = 0;
                u[3 * (size_t)v + (axis + 1) % 3] = -x[(axis + 2) % 3];
                u[3 * (size_t)v + (axis + 2) % 3] = x[(axis + 1) % 3];
            }
            double row;
            const double residual = worst_product(&m, m.H, u, &row);
            print_message("%d vertices, axis %d: %.1e\n", m.vertex_count, axis, residual);
            check_at_most(residual, 1e-9);
        }
        free(u);
        release(&m);
        check_surface_destroy(&sphere);
    }
}

// The patch test: a linear u has a constant stress, so H u = the integral of U sigma n, exactly but
// for quadrature. The right-hand side goes element by element, since n jumps at the edges.
static void uniform_strain_is_reproduced(void **state)
{
    (void)state;
    pliant_mesh *mesh = crumpled(2);
    static const pliant_material materials[] = {{2, 0.3, 1}, {1, 0.49, 1}, {1, -0.9, 1}};
    const double gradient[3][3] = {{0.3, -0.5, 0.2}, {0.7, 0.1, -0.4}, {-0.6, 0.8, 0.5}};
    for (int k = 0; k < 3; k++) {
        const double nu = materials[k].poisson, mu = materials[k].young / (2 * (1 + nu));
        const double lambda = 2 * mu * nu / (1 - 2 * nu), pi = 3.14159265358979323846;
        const double trace = gradient[0][0] + gradient[1][1] + gradient[2][2];
        matrices m = assemble(mesh, &materials[k]);
        const pliant_kelvin_constants constants = {.diagonal = 3 - 4 * nu, .shear = 1 - 2 * nu};
        double worst = 0, size = 0;
        for (int32_t v = 0; v < m.vertex_count; v++) {
            double residual[3] = {0};
            for (size_t j = 0; j < m.size; j++) {
                const double *x = mesh->vertices + j / 3 * 3, *row = gradient[j % 3];
                const double u = row[0] * x[0] + row[1] * x[1] + row[2] * x[2];
                for (int i = 0; i < 3; i++) residual[i] += m.H[3 * (size_t)v + i + j * m.size] * u;
            }
            for (int i = 0; i < 3; i++) size = fmax(size, fabs(residual[i]));
            const double *x = mesh->vertices + 3 * (size_t)v;
            for (int32_t f = 0; f < mesh->face_count; f++) {
                const int32_t *corner = mesh->faces + 3 * (size_t)f;
                pliant_element element;
                pliant_element_set(&element, corner, mesh->vertices + 3 * (size_t)corner[0],
                                   mesh->vertices + 3 * (size_t)corner[1],
                                   mesh->vertices + 3 * (size_t)corner[2]);
                pliant_element_integrals integrals;
                int own = 0;
                while (own < 3 && corner[own] != v) own++;
                if (own < 3) pliant_singular_integral_set(&constants, &element, own, &integrals);
                else pliant_near_integral_set(&constants, &element, x, &integrals);
                for (int i = 0; i < 3; i++)
                    for (int j = 0; j < 3; j++) {
                        double p = lambda * trace * element.normal[j], U = 0;
                        for (int d = 0; d < 3; d++)
                            p += mu * (gradient[j][d] + gradient[d][j]) * element.normal[d];
                        for (int h = 0; h < 3; h++)
                            U += integrals.of_hat[h][pliant_integral_place[i][j]];
                        residual[i] -= U * p / (16 * pi * mu * (1 - nu));
                    }
            }
            for (int i = 0; i < 3; i++) worst = fmax(worst, fabs(residual[i]));
        }
        print_message("nu %g: residual %.1e of %.1e\n", nu, worst, size);
        check_at_most(worst, 1e-7 * size);
        release(&m);
    }
    pliant_mesh_destroy(mesh);
}

// Largest difference from the slow rows, relative to the row's sum of absolute values.
static void check_rows(const pliant_mesh *mesh, const pliant_material *material, double tolerance)
{
    matrices m = assemble(mesh, material);
    double *H = malloc(3 * m.size * sizeof *H), *G = malloc(3 * m.size * sizeof *G);
    double worst_H = 0, worst_G = 0;
    for (int32_t v = 0; v < m.vertex_count; v += 1 + m.vertex_count / 12) {
        memset(H, 0, 3 * m.size * sizeof *H);
        memset(G, 0, 3 * m.size * sizeof *G);
        const double *x = mesh->vertices + 3 * (size_t)v;
        for (int32_t f = 0; f < mesh->face_count; f++) {
            const int32_t *corner = mesh->faces + 3 * (size_t)f;
            double corners[3][3];
            int own = -1;
            for (int k = 0; k < 3; k++) {
                if (corner[k] == v) own = k;
                for (int i = 0; i < 3; i++)
                    corners[k][i] = mesh->vertices[3 * (size_t)corner[k] + i] - x[i];
            }
            const reference_blocks blocks = reference_integrals(material, corners, own);
            for (int k = 0; k < 3; k++)
                for (int i = 0; i < 3; i++)
                    for (int j = 0; j < 3; j++) {
                        H[i + 3 * (3 * (size_t)corner[k] + j)] += blocks.T[k][i][j];
                        G[i + 3 * (3 * (size_t)corner[k] + j)] += blocks.U[k][i][j];
                    }
        }
        for (int i = 0; i < 3; i++) {
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (size_t j = 0; j < m.size / 3; j++) sum += H[i + 3 * (3 * j + c)];
                H[i + 3 * (3 * (size_t)v + c)] = -sum;
            }
            double off_H = 0, off_G = 0, size_H = 0, size_G = 0;
            for (size_t j = 0; j < m.size; j++) {
                const size_t at = 3 * (size_t)v + i + j * m.size;
                off_H += fabs(m.H[at] - H[i + 3 * j]);
                off_G += fabs(m.G[at] - G[i + 3 * j]);
                size_H += fabs(H[i + 3 * j]);
                size_G += fabs(G[i + 3 * j]);
            }
            worst_H = fmax(worst_H, off_H / size_H);
            worst_G = fmax(worst_G, off_G / size_G);
        }
    }
    print_message("%d vertices, nu %g: rows of H off by %.1e, of G by %.1e\n", m.vertex_count,
                  material->poisson, worst_H, worst_G);
    check_at_most(worst_H, tolerance);
    check_at_most(worst_G, tolerance);
    free(H);
    free(G);
    release(&m);
}

// far_field.c promises 1e-6 of the row and measures 1e-7.
static void rows_equal_slow_adaptive_rows(void **state)
{
    (void)state;
    static const pliant_material materials[] = {{2, 0.3, 1}, {7e5, 0.49, 1}, {1, -0.9, 1}};
    pliant_mesh *mesh = crumpled(1);
    for (int k = 0; k < 3; k++) check_rows(mesh, &materials[k], 1e-6);
    pliant_mesh_destroy(mesh);
}

static void rows_of_a_mesh_with_slivers_equal_slow_ones(void **state)
{
    (void)state;
    const char *path = check_model_path("liver_tiny.obj");
    pliant_mesh *mesh = path ? check_load_obj(path) : NULL;
    if (!mesh) skip();
    check_rows(mesh, &rubber, 1e-6);
    pliant_mesh_destroy(mesh);
}

// Bitwise, for random splits and each single row; with and without the body force columns.
static void rows_do_not_depend_on_the_split(void **state)
{
    (void)state;
    pliant_mesh *mesh = crumpled(2);
    const int32_t n = mesh->vertex_count;
    const size_t size = 3 * (size_t)n, bytes = size * size * sizeof(double);
    pliant_error err;
    pliant_bem *bem = NULL;
    check_ok(pliant_bem_create(mesh, &rubber, &bem, &err), &err);
    uint8_t *fixed = calloc((size_t)n, 1);
    for (int32_t v = 0; v < n; v++) fixed[v] = mesh->vertices[3 * (size_t)v] > 0.3;
    double *A = malloc(bytes), *B = malloc(bytes), *A2 = malloc(bytes), *B2 = malloc(bytes);
    double *g = malloc(3 * size * sizeof *g), *g2 = malloc(3 * size * sizeof *g2);
    assert_true(fixed && A && B && A2 && B2 && g && g2);
    check_ok(pliant_bem_assemble(bem, 0, n, fixed, A, size, B, size, g, size, &err), &err);
    check_random random = check_random_seed(33);
    for (int trial = 0; trial < 4; trial++) {
        memset(A2, 0xFF, bytes);
        memset(B2, 0xFF, bytes);
        for (int32_t row = 0, end; row < n; row = end) {
            end = row + 1 + (trial == 0 ? 0 : check_random_index(&random, 10 * trial));
            if (end > n) end = n;
            const size_t at = 3 * (size_t)row;
            check_ok(pliant_bem_assemble(bem, row, end, fixed, A2 + at, size, B2 + at, size,
                                         trial == 3 ? NULL : g2 + at, size, &err),
                     &err);
        }
        assert_memory_equal(A, A2, bytes);
        assert_memory_equal(B, B2, bytes);
        if (trial != 3) assert_memory_equal(g, g2, 3 * size * sizeof *g);
    }
    // An empty range is fine and writes nothing.
    check_ok(pliant_bem_assemble(bem, 5, 5, fixed, A2, 0, B2, 0, NULL, 0, &err), &err);
    free(g2);
    free(g);
    free(B2);
    free(A2);
    free(B);
    free(A);
    free(fixed);
    pliant_bem_destroy(bem);
    pliant_mesh_destroy(mesh);
}

// Free columns: A has H, B has G; fixed ones: A has -G, B has -H. Rows outside the range, and what
// lies between the columns, are not touched.
static void fixed_columns_change_sides_and_sign(void **state)
{
    (void)state;
    pliant_mesh *mesh = crumpled(1);
    const int32_t n = mesh->vertex_count;
    matrices m = assemble(mesh, &rubber);
    pliant_error err;
    pliant_bem *bem = NULL;
    check_ok(pliant_bem_create(mesh, &rubber, &bem, &err), &err);
    uint8_t *fixed = calloc((size_t)n, 1);
    for (int32_t v = 0; v < n; v += 3) fixed[v] = 1;
    const int32_t begin = 7, end = 20;
    const size_t height = 3 * (size_t)(end - begin), ld_a = height + 2, ld_b = height + 5;
    double *A = malloc(ld_a * m.size * sizeof *A), *B = malloc(ld_b * m.size * sizeof *B);
    for (size_t i = 0; i < ld_a * m.size; i++) A[i] = 123;
    for (size_t i = 0; i < ld_b * m.size; i++) B[i] = 123;
    check_ok(pliant_bem_assemble(bem, begin, end, fixed, A, ld_a, B, ld_b, NULL, 0, &err), &err);
    for (size_t j = 0; j < m.size; j++) {
        for (size_t i = 0; i < height; i++) {
            const double H = m.H[3 * begin + i + j * m.size], G = m.G[3 * begin + i + j * m.size];
            assert_true(A[i + j * ld_a] == (fixed[j / 3] ? -G : H));
            assert_true(B[i + j * ld_b] == (fixed[j / 3] ? -H : G));
        }
        for (size_t i = height; i < ld_a; i++) assert_true(A[i + j * ld_a] == 123);
        for (size_t i = height; i < ld_b; i++) assert_true(B[i + j * ld_b] == 123);
    }
    free(B);
    free(A);
    free(fixed);
    pliant_bem_destroy(bem);
    release(&m);
    pliant_mesh_destroy(mesh);
}

// H has no unit and G is a length over a stiffness, however large or small the mesh.
static void size_scales_through(void **state)
{
    (void)state;
    static const double scales[] = {0x1p-400, 0x1p-10, 0x1p300};
    pliant_mesh *mesh = crumpled(1);
    matrices m = assemble(mesh, &rubber);
    for (int k = 0; k < 3; k++) {
        pliant_mesh *scaled = NULL;
        pliant_error err;
        check_ok(pliant_mesh_create(mesh->vertex_count, mesh->face_count, &scaled, &err), &err);
        memcpy(scaled->faces, mesh->faces, sizeof(int32_t) * 3 * (size_t)mesh->face_count);
        for (size_t i = 0; i < m.size; i++) scaled->vertices[i] = scales[k] * mesh->vertices[i];
        matrices s = assemble(scaled, &rubber);
        for (size_t i = 0; i < m.size * m.size; i++) {
            assert_true(s.H[i] == m.H[i]);
            assert_true(s.G[i] == scales[k] * m.G[i]);
        }
        release(&s);
        pliant_mesh_destroy(scaled);
    }
    release(&m);
    pliant_mesh_destroy(mesh);
}

static void bad_material_mesh_and_rows_are_refused(void **state)
{
    (void)state;
    static const pliant_material bad[] = {
        {0, 0.3, 1}, {-1, 0.3, 1}, {NAN, 0.3, 1}, {INFINITY, 0.3, 1}, {1, 0.5, 1},
        {1, -1, 1},  {1, NAN, 1},  {1, 7, 1},     {1, 0.3, -1},       {1, 0.3, NAN},
    };
    pliant_mesh *mesh = check_octahedron();
    pliant_error err;
    pliant_bem *bem = NULL;
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        assert_int_equal(pliant_bem_create(mesh, &bad[k], &bem, &err), PLIANT_ERR_ARGUMENT);
        assert_null(bem);
        assert_non_null(strstr(err.text, "expected"));
    }
    const double x = mesh->vertices[4];
    mesh->vertices[4] = NAN;
    mesh->faces[7] += 6;
    assert_int_equal(pliant_bem_create(mesh, &rubber, &bem, &err), PLIANT_ERR_ARGUMENT);
    mesh->vertices[4] = x;
    assert_int_equal(pliant_bem_create(mesh, &rubber, &bem, &err), PLIANT_ERR_ARGUMENT);
    mesh->faces[7] -= 6;
    const int32_t face_count = mesh->face_count, corner = mesh->faces[1];
    mesh->face_count = 3;
    assert_int_equal(pliant_bem_create(mesh, &rubber, &bem, &err), PLIANT_ERR_ARGUMENT);
    mesh->face_count = face_count;
    mesh->faces[1] = mesh->faces[0];
    assert_int_equal(pliant_bem_create(mesh, &rubber, &bem, NULL), PLIANT_ERR_ARGUMENT);
    mesh->faces[1] = corner;
    assert_null(bem);

    check_ok(pliant_bem_create(mesh, &rubber, &bem, &err), &err);
    static const int32_t ranges[][2] = {{-1, 2}, {3, 2}, {0, 7}, {7, 7}};
    double A[18 * 18], B[18 * 18];
    const uint8_t fixed[6] = {0};
    A[0] = B[0] = 123;
    for (int k = 0; k < 4; k++)
        assert_int_equal(pliant_bem_assemble(bem, ranges[k][0], ranges[k][1], fixed, A, 18, B, 18,
                                             NULL, 0, &err),
                         PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_bem_assemble(bem, 0, 6, fixed, A, 17, B, 18, NULL, 0, &err),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_bem_assemble(bem, 0, 6, fixed, A, 18, B, 18, A, 17, NULL),
                     PLIANT_ERR_ARGUMENT);
    assert_true(A[0] == 123 && B[0] == 123);
    pliant_bem_destroy(bem);
    pliant_bem_destroy(NULL);
    pliant_mesh_destroy(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(translations_give_no_traction),
        cmocka_unit_test(rotations_give_no_traction),
        cmocka_unit_test(uniform_strain_is_reproduced),
        cmocka_unit_test(rows_equal_slow_adaptive_rows),
        cmocka_unit_test(rows_of_a_mesh_with_slivers_equal_slow_ones),
        cmocka_unit_test(rows_do_not_depend_on_the_split),
        cmocka_unit_test(fixed_columns_change_sides_and_sign),
        cmocka_unit_test(size_scales_through),
        cmocka_unit_test(bad_material_mesh_and_rows_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
