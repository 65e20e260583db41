// test_fem_elements.c: tetrahedra against fields that are known: energy, patch test, orders.
#include "check.h"
#include "surfaces.h"

#include "bem/kelvin.h"
#include "fem/element.h"
#include "fem/size_field.h"
#include "fem/stiffness.h"
#include "fem/volume.h"

#include <math.h>
#include <petscksp.h>
#include <stdlib.h>
#include <string.h>

static pliant_tetrahedra *fill_mesh(const pliant_mesh *mesh, int order)
{
    pliant_error err;
    pliant_tetrahedra *t = NULL;
    const pliant_volume_def def = {
        .surface = mesh, .mesh_name = "test", .growth = pliant_size_field_growth(order)};
    check_ok(pliant_volume_create(&def, &t, &err), &err);
    if (order == 2) check_ok(pliant_tetrahedra_raise(t, &err), &err);
    return t;
}

// ---- Elements ----

// A tetrahedron of no symmetry.
static double corner[4][3] = {{0.1, 0, 0.2}, {1.1, 0.2, 0}, {0.3, 0.9, -0.1}, {0.2, 0.1, 1.3}};

static void nodes_of(int count, double x[PLIANT_TET_NODES][3])
{
    static const int ends[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    for (int a = 0; a < count; a++)
        for (int i = 0; i < 3; i++)
            x[a][i] =
                a < 4 ? corner[a][i] : (corner[ends[a - 4][0]][i] + corner[ends[a - 4][1]][i]) / 2;
}

// K is symmetric, does nothing to rigid motions, and stores strain's energy; quadratic elements
// also that of bending, u = (xz, 0, -x^2/2), with its one strain e_xx = z.
static void elements_store_the_energy_of_strain(void **state)
{
    (void)state;
    const pliant_material material = {3, 0.3, 1};
    const double mu = material.young / (2 * (1 + material.poisson));
    const double lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
    for (int count = 4; count <= 10; count += 6) {
        static double K[PLIANT_TET_NODES][PLIANT_TET_NODES][3][3];
        double x[PLIANT_TET_NODES][3], u[4][PLIANT_TET_NODES][3];
        const double volume = pliant_element_stiffness(&material, corner, count, K);
        nodes_of(count, x);
        const double gradient[3][3] = {{0.2, 0.5, -0.3}, {0.1, -0.4, 0.7}, {0.6, 0.8, 0.15}};
        for (int a = 0; a < count; a++) {
            for (int i = 0; i < 3; i++) {
                u[0][a][i] = i == 1;                                    // translation
                u[1][a][i] = i == 0 ? x[a][1] : i == 1 ? -x[a][0] : 0;  // rotation
                u[2][a][i] =
                    gradient[i][0] * x[a][0] + gradient[i][1] * x[a][1] + gradient[i][2] * x[a][2];
                u[3][a][i] = i == 0 ? x[a][0] * x[a][2] : i == 2 ? -x[a][0] * x[a][0] / 2 : 0;
            }
            for (int b = 0; b < count; b++)
                for (int r = 0; r < 3; r++)
                    for (int c = 0; c < 3; c++) check_near(K[a][b][r][c], K[b][a][c][r], 1e-14);
        }
        double strain2 = 0, trace = 0, energy[4] = {0};
        for (int i = 0; i < 3; i++) {
            trace += gradient[i][i];
            for (int j = 0; j < 3; j++) strain2 += pow((gradient[i][j] + gradient[j][i]) / 2, 2);
        }
        for (int f = 0; f < 4; f++)
            for (int a = 0; a < count; a++)
                for (int r = 0; r < 3; r++) {
                    double force = 0;
                    for (int b = 0; b < count; b++)
                        for (int c = 0; c < 3; c++) force += K[a][b][r][c] * u[f][b][c];
                    energy[f] += force * u[f][a][r];
                    if (f < 2) check_near(force, 0, 1e-13);
                }
        check_near(energy[2], volume * (lambda * trace * trace + 2 * mu * strain2), 1e-12);
        if (count == 4) continue;
        // integral of z^2 = V (sum z_i^2 + (sum z_i)^2) / 20
        double sum = 0, squares = 0;
        for (int k = 0; k < 4; k++) sum += corner[k][2], squares += corner[k][2] * corner[k][2];
        check_near(energy[3], volume * (squares + sum * sum) / 20 * (lambda + 2 * mu), 1e-12);
    }
}

// ---- Boundary conditions on the whole boundary ----

typedef struct filled {
    pliant_mesh *mesh;  // given
    pliant_tetrahedra *t;
    pliant_stiffness *s;
    uint8_t *on_surface;  // [node_count]
} filled;

static filled fill_with(pliant_mesh *mesh, pliant_tetrahedra *t, const pliant_material *material)
{
    pliant_error err;
    filled f = {.mesh = mesh, .t = t};
    uint8_t *held = calloc((size_t)mesh->vertex_count, 1);
    const pliant_stiffness_def def = {f.t, material, held};
    assert_int_equal(pliant_stiffness_create(PETSC_COMM_SELF, &def, &f.s, &err), 0);
    free(held);
    f.on_surface = calloc((size_t)f.t->node_count, 1);
    for (int32_t k = 0; k < f.t->face_count * f.t->face_nodes; k++) f.on_surface[f.t->faces[k]] = 1;
    return f;
}

static filled fill_solid(pliant_mesh *mesh, int order, const pliant_material *material)
{
    return fill_with(mesh, fill_mesh(mesh, order), material);
}

// The cube from -1 to 1 in n^3 cubes of six tetrahedra about a diagonal (Kuhn, 1960), whose corners
// inside are shaken by up to a tenth of a cube: the same mesh at every run, and no symmetry that
// would raise the order.
static filled fill_cube(int32_t n, int order, const pliant_material *material)
{
    static const int paths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                    {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    const int32_t side = n + 1, count = side * side * side;
    const int32_t surface_count = count - (n - 1) * (n - 1) * (n - 1);
    int32_t *number = malloc((size_t)count * sizeof *number);
    double *nodes = malloc(3 * (size_t)count * sizeof *nodes);
    int32_t *tets = malloc(24 * (size_t)n * n * n * sizeof *tets);
    pliant_mesh *mesh = NULL;
    pliant_error err;
    check_ok(pliant_mesh_create(surface_count, 12 * n * n, &mesh, &err), &err);
    check_random random = check_random_seed(3);
    int32_t outer = 0, inner = surface_count, tet_count = 0, face_count = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t at[3] = {i % side, i / side % side, i / side / side};
        int on_surface = 0;
        for (int c = 0; c < 3; c++) on_surface |= at[c] == 0 || at[c] == n;
        number[i] = on_surface ? outer++ : inner++;
        for (int c = 0; c < 3; c++) {
            const double shake = on_surface ? 0 : 0.2 * check_random_next(&random) - 0.1;
            nodes[3 * number[i] + c] = 2 * (at[c] + shake) / n - 1;
        }
    }
    memcpy(mesh->vertices, nodes, 3 * (size_t)surface_count * sizeof *nodes);
    for (int32_t i = 0; i < count; i++) {
        const int32_t at[3] = {i % side, i / side % side, i / side / side};
        if (at[0] == n || at[1] == n || at[2] == n) continue;
        for (int k = 0; k < 6; k++, tet_count++) {
            int32_t place[4][3], *tet = tets + 4 * (size_t)tet_count;
            memcpy(place[0], at, sizeof at);
            for (int v = 0; v < 4; v++) {
                if (v > 0) {
                    memcpy(place[v], place[v - 1], sizeof place[v]);
                    place[v][paths[k][v - 1]]++;
                }
                tet[v] = number[(place[v][2] * side + place[v][1]) * side + place[v][0]];
            }
            // Faces of the cube: those of the tetrahedron in one of its planes, seen from outside.
            for (int v = 0; v < 4; v++)
                for (int c = 0; c < 3; c++) {
                    const int a = (v + 1) % 4, b = (v + 2) % 4, d = (v + 3) % 4;
                    const int32_t plane = place[a][c];
                    if ((plane != 0 && plane != n) || place[b][c] != plane || place[d][c] != plane)
                        continue;
                    int32_t *face = mesh->faces + 3 * (size_t)face_count++;
                    const int e = (c + 1) % 3, f = (c + 2) % 3;
                    const int32_t turn = (place[b][e] - place[a][e]) * (place[d][f] - place[a][f]) -
                                         (place[b][f] - place[a][f]) * (place[d][e] - place[a][e]);
                    const int outwards = (turn > 0) == (plane == n);
                    face[0] = tet[a], face[1] = tet[outwards ? b : d],
                    face[2] = tet[outwards ? d : b];
                }
        }
    }
    assert_int_equal(face_count, 12 * n * n);
    pliant_tetrahedra *t = NULL;
    const pliant_tetrahedra_def def = {
        .name = "cube", .node_count = count, .tet_count = tet_count, .nodes = nodes, .tets = tets};
    check_ok(pliant_tetrahedra_create(mesh, &def, &t, &err), &err);
    if (order == 2) check_ok(pliant_tetrahedra_raise(t, &err), &err);
    free(number), free(nodes), free(tets);
    return fill_with(mesh, t, material);
}

static void release(filled *f)
{
    free(f->on_surface);
    assert_int_equal(pliant_stiffness_destroy(&f->s), 0);
    pliant_tetrahedra_destroy(f->t);
    pliant_mesh_destroy(f->mesh);
}

// With u given at every node of the surface, RMS error inside relative to the RMS there. `exact` is
// [node_count][3], in mesh order.
static double solve_inside(const filled *f, const double *exact)
{
    const pliant_tetrahedra *t = f->t;
    Mat K;
    Vec x, b;
    KSP ksp;
    PC pc;
    PetscInt *rows, count = 0;
    assert_int_equal(PetscMalloc1(3 * t->node_count, &rows), 0);
    assert_int_equal(MatDuplicate(f->s->K, MAT_COPY_VALUES, &K), 0);
    assert_int_equal(MatCreateVecs(K, &x, &b), 0);
    for (int32_t i = 0; i < t->node_count; i++)
        for (int c = 0; c < 3 && f->on_surface[i]; c++) {
            rows[count] = 3 * f->s->row_of_node[i] + c;
            assert_int_equal(VecSetValue(x, rows[count++], exact[3 * (size_t)i + c], INSERT_VALUES),
                             0);
        }
    assert_int_equal(VecAssemblyBegin(x), 0);
    assert_int_equal(VecAssemblyEnd(x), 0);
    assert_int_equal(MatZeroRowsColumns(K, count, rows, 1, x, b), 0);
    assert_int_equal(KSPCreate(PETSC_COMM_SELF, &ksp), 0);
    assert_int_equal(KSPSetOperators(ksp, K, K), 0);
    assert_int_equal(KSPSetType(ksp, KSPPREONLY), 0);
    assert_int_equal(KSPGetPC(ksp, &pc), 0);
    assert_int_equal(PCSetType(pc, PCCHOLESKY), 0);
    assert_int_equal(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS), 0);
    assert_int_equal(KSPSolve(ksp, b, x), 0);
    const double *found;
    double off = 0, norm = 0;
    assert_int_equal(VecGetArrayRead(x, &found), 0);
    for (int32_t i = 0; i < t->node_count; i++)
        for (int c = 0; c < 3 && !f->on_surface[i]; c++) {
            const double u = exact[3 * (size_t)i + c];
            off += pow(found[3 * (size_t)f->s->row_of_node[i] + c] - u, 2);
            norm += u * u;
        }
    assert_int_equal(VecRestoreArrayRead(x, &found), 0);
    assert_int_equal(KSPDestroy(&ksp), 0);
    assert_int_equal(VecDestroy(&b), 0);
    assert_int_equal(VecDestroy(&x), 0);
    assert_int_equal(MatDestroy(&K), 0);
    assert_int_equal(PetscFree(rows), 0);
    return sqrt(off / norm);
}

static void linear_fields_are_exact(void **state)
{
    (void)state;
    const pliant_material material = {3, 0.3, 1};
    const double mu = material.young / (2 * (1 + material.poisson));
    const double lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
    const double g[3][3] = {{0.2, 0.5, -0.3}, {0.1, -0.4, 0.7}, {0.6, 0.8, 0.15}};
    for (int order = 1; order <= 2; order++) {
        check_surface blob = check_blob(2);
        pliant_mesh *mesh = blob.mesh;
        blob.mesh = NULL;
        check_surface_destroy(&blob);
        filled f = fill_solid(mesh, order, &material);
        const pliant_tetrahedra *t = f.t;
        double *u = calloc(3 * (size_t)t->node_count, sizeof *u),
               *force = calloc(3 * (size_t)t->node_count, sizeof *force);
        for (int32_t i = 0; i < t->node_count; i++)
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++) u[3 * i + r] += g[r][c] * t->nodes[3 * (size_t)i + c];
        check_at_most(solve_inside(&f, u), 1e-12);

        // K u is the nodal force of the tractions sigma n, face by face, and none inside.
        for (int32_t e = 0; e < t->face_count; e++) {
            const int32_t *v = t->faces + (size_t)e * t->face_nodes;
            double a[3], b[3], n[3];
            for (int i = 0; i < 3; i++) {
                a[i] = t->nodes[3 * v[1] + i] - t->nodes[3 * v[0] + i];
                b[i] = t->nodes[3 * v[2] + i] - t->nodes[3 * v[0] + i];
            }
            for (int i = 0; i < 3; i++)
                n[i] = (a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]) / 2;
            for (int q = 0; q < t->face_nodes; q++) {
                const double share = pliant_element_face_share(t->face_nodes, q, 0) +
                                     pliant_element_face_share(t->face_nodes, q, 1) +
                                     pliant_element_face_share(t->face_nodes, q, 2);
                for (int r = 0; r < 3; r++)
                    for (int c = 0; c < 3; c++) {
                        const double sigma = mu * (g[r][c] + g[c][r]) +
                                             (r == c ? lambda * (g[0][0] + g[1][1] + g[2][2]) : 0);
                        force[3 * (size_t)v[q] + r] += share * sigma * n[c];
                    }
            }
        }
        Vec x, y;
        double *values;
        assert_int_equal(MatCreateVecs(f.s->K, &x, &y), 0);
        assert_int_equal(VecGetArrayWrite(x, &values), 0);
        for (int32_t i = 0; i < t->node_count; i++)
            memcpy(values + 3 * f.s->row_of_node[i], u + 3 * i, 3 * sizeof *u);
        assert_int_equal(VecRestoreArrayWrite(x, &values), 0);
        assert_int_equal(MatMult(f.s->K, x, y), 0);
        assert_int_equal(VecGetArray(y, &values), 0);
        for (int32_t k = 0; k < 3 * t->node_count; k++)
            check_near(values[3 * f.s->row_of_node[k / 3] + k % 3], force[k], 1e-12);
        assert_int_equal(VecRestoreArray(y, &values), 0);
        assert_int_equal(VecDestroy(&x), 0);
        assert_int_equal(VecDestroy(&y), 0);
        free(force), free(u);
        release(&f);
    }
}

// Kelvin's solution of a point force outside a cube, given on the whole boundary. In the nodal RMS
// norm theory has orders 2 and 3.
static void orders_are_two_and_three(void **state)
{
    (void)state;
    const pliant_material material = {1, 0.3, 1};
    static const double source[3] = {0.7, 0.4, 2.5};
    for (int order = 1; order <= 2; order++) {
        double error[3];
        for (int32_t level = 0; level < 3; level++) {
            filled f = fill_cube(order == 1 ? 4 << level : 2 << level, order, &material);
            double *u = malloc(3 * (size_t)f.t->node_count * sizeof *u);
            for (int32_t i = 0; i < f.t->node_count; i++) {
                double U[3][3], r[3];
                for (int c = 0; c < 3; c++) r[c] = f.t->nodes[3 * (size_t)i + c] - source[c];
                pliant_kelvin_displacement(&material, r, U);
                memcpy(u + 3 * (size_t)i, U[0], sizeof U[0]);
            }
            error[level] = solve_inside(&f, u);
            print_message("order %d, %d tetrahedra: off by %.2e\n", order, f.t->tet_count,
                          error[level]);
            free(u);
            release(&f);
        }
        const double slope = log2(error[0] / error[2]) / 2;
        print_message("order %d: slope %.2f\n", order, slope);
        check_at_least(slope, order + 0.7);
        check_at_most(slope, order + 1.6);
    }
}

int main(void)
{
    if (PetscInitialize(NULL, NULL, NULL, NULL)) return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(elements_store_the_energy_of_strain),
        cmocka_unit_test(linear_fields_are_exact),
        cmocka_unit_test(orders_are_two_and_three),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    PetscFinalize();
    return failed;
}
