// test_lattice_masses.c: how much of a solid lies in each cell, and what its particles weigh.
#include "check.h"
#include "command.h"

#include "lattice/cell_measure.h"
#include "lattice/lattice_data.h"
#include "lattice/masses.h"
#include "mesh/nearest.h"
#include "surfaces.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static pliant_voxels *voxelise(const pliant_mesh *mesh, int32_t cells, pliant_voxel_filling filling)
{
    pliant_voxels *v = NULL;
    pliant_error err = {""};
    check_ok(pliant_voxels_create(mesh, "mesh", cells, filling, 0, &v, &err), &err);
    return v;
}

static double mesh_area(const pliant_mesh *mesh)
{
    double *areas = malloc((size_t)mesh->vertex_count * sizeof *areas), sum = 0;
    assert_non_null(areas);
    pliant_mesh_vertex_areas(mesh->vertex_count, mesh->vertices, mesh->face_count, mesh->faces,
                             areas);
    for (int32_t v = 0; v < mesh->vertex_count; v++) sum += areas[v];
    free(areas);
    return sum;
}

// What is known of any closed mesh: sums, bounds, and 1 in cells that it does not touch.
static void check_measure(const pliant_mesh *mesh, const pliant_voxels *v, double *volume,
                          double *area)
{
    int32_t longest = 1;
    for (int d = 0; d < 3; d++)
        if (v->grid.dims[d] > longest) longest = v->grid.dims[d];
    pliant_voxels *shell = voxelise(mesh, longest, PLIANT_VOXELS_SHELL);
    pliant_error err = {""};
    check_ok(pliant_cell_measure(mesh, v, volume, area, &err), &err);
    double volumes = 0, areas = 0;
    for (int32_t i = 0; i < v->cell_count; i++) {
        const int32_t *c = v->cells + 3 * (size_t)i;
        volumes += volume[i];
        areas += area[i];
        check_at_least(volume[i], -1e-11);
        check_at_most(volume[i], 1 + 1e-11);
        if (pliant_cell_set_find(shell->set, c[0], c[1], c[2]) >= 0) continue;
        check_near(volume[i], 1, 1e-11);
        check_near(area[i], 0, 0);
    }
    const double a = v->grid.size;
    check_near(volumes * a * a * a / pliant_mesh_volume(mesh), 1, 1e-12);
    check_near(areas * a * a / mesh_area(mesh), 1, 1e-12);
    pliant_voxels_destroy(shell);
}

static void the_cells_volumes_and_areas_add_up(void **state)
{
    (void)state;
    pliant_mesh *meshes[] = {check_octahedron(), check_torus(12, 20), check_block(2), check_cube()};
    for (size_t m = 0; m < sizeof meshes / sizeof *meshes; m++) {
        // 10 and 20: faces of the block (5 x 3 x 1) lie in planes between cells.
        for (int32_t cells = 1; cells <= 50;
             cells = cells == 5 ? 10 : 2 * cells + 3 * (cells < 5)) {
            pliant_voxels *v = voxelise(meshes[m], cells, PLIANT_VOXELS_SOLID);
            double *volume = malloc((size_t)v->cell_count * sizeof *volume);
            double *area = malloc((size_t)v->cell_count * sizeof *area);
            assert_true(volume && area);
            check_measure(meshes[m], v, volume, area);
            free(area);
            free(volume);
            pliant_voxels_destroy(v);
        }
        pliant_mesh_destroy(meshes[m]);
    }
}

// |x| + |y| + |z| <= 1, cell by cell, against 40^3 samples: they err by some 1 / 40^2.
static void an_octahedrons_cells_hold_what_samples_say(void **state)
{
    (void)state;
    enum { SAMPLES = 40 };
    pliant_mesh *mesh = check_octahedron();
    pliant_voxels *v = voxelise(mesh, 5, PLIANT_VOXELS_SOLID);
    double *volume = malloc((size_t)v->cell_count * sizeof *volume);
    double *area = malloc((size_t)v->cell_count * sizeof *area);
    pliant_error err = {""};
    assert_true(volume && area);
    check_ok(pliant_cell_measure(mesh, v, volume, area, &err), &err);
    double radius = 0;
    for (int32_t i = 0; i < 3 * mesh->vertex_count; i++) radius = fmax(radius, mesh->vertices[i]);
    for (int32_t i = 0; i < v->cell_count; i++) {
        int32_t inside = 0;
        for (int32_t s = 0; s < SAMPLES * SAMPLES * SAMPLES; s++) {
            const int32_t steps[3] = {s % SAMPLES, s / SAMPLES % SAMPLES, s / SAMPLES / SAMPLES};
            double sum = 0;
            for (int d = 0; d < 3; d++)
                sum +=
                    fabs(v->grid.origin[d] + v->grid.size * (v->cells[3 * (size_t)i + (size_t)d] +
                                                             (steps[d] + 0.5) / SAMPLES));
            inside += sum <= radius;
        }
        check_near(volume[i], (double)inside / (SAMPLES * SAMPLES * SAMPLES), 3e-3);
    }
    free(area);
    free(volume);
    pliant_voxels_destroy(v);
    pliant_mesh_destroy(mesh);
}

static pliant_lattice_data *lattice_of(const pliant_mesh *mesh, const pliant_lattice_data_def *def)
{
    pliant_lattice_data *l = NULL;
    pliant_error err = {""};
    check_ok(pliant_lattice_data_create(def, mesh, &l, &err), &err);
    return l;
}

static double sum_of(const float *mass, int32_t count)
{
    double sum = 0;
    for (int32_t i = 0; i < count; i++) sum += (double)mass[i];
    return sum;
}

// However coarse the lattice, and solid or shell: density times the mesh's volume; rounding to
// floats is all that is lost.
static void a_lattice_weighs_what_the_solid_weighs(void **state)
{
    (void)state;
    check_surface blob = check_blob(3);
    for (int filling = 0; filling < 2; filling++)
        for (int32_t cells = 1; cells <= 40; cells = 3 * cells + 1) {
            const pliant_lattice_data_def def = {.name = "blob",
                                                 .cells = cells,
                                                 .half_width = 1,
                                                 .filling = (pliant_voxel_filling)filling,
                                                 .density = 1250};
            pliant_lattice_data *l = lattice_of(blob.mesh, &def);
            const double expected = 1250 * pliant_mesh_volume(blob.mesh);
            check_near(l->total_mass / expected, 1, 0x1p-24);
            check_near(sum_of(l->mass, l->particle_count), l->total_mass, 0);
            // An eighth of the mean share in one cell of eight, at the least.
            double least = INFINITY;
            for (int32_t i = 0; i < l->particle_count; i++) least = fmin(least, (double)l->mass[i]);
            check_at_least(least * l->voxels->cell_count / expected, 0.125 / 8 * 0.5);
            pliant_lattice_data_destroy(l);
        }
    check_surface_destroy(&blob);
}

// A box that fills its cells: inner particles weigh a cell's mass, those of faces a half, of edges
// a quarter, corners an eighth.
static void particles_of_a_box_weigh_what_is_around_them(void **state)
{
    (void)state;
    pliant_mesh *box = check_cube();
    const pliant_lattice_data_def def = {.name = "box", .cells = 4, .half_width = 1, .density = 64};
    pliant_lattice_data *l = lattice_of(box, &def);
    assert_int_equal(l->particle_count, 125);
    for (int32_t i = 0; i < l->particle_count; i++) {
        double expected = 8;
        for (int d = 0; d < 3; d++)
            if (l->particles[3 * i + d] % 4 == 0) expected /= 2;
        check_near((double)l->mass[i], expected, 1e-6 * expected);
    }
    pliant_lattice_data_destroy(l);
    pliant_mesh_destroy(box);
}

static void the_nearest_point_is_that_of_looking_at_all(void **state)
{
    (void)state;
    check_random random = check_random_seed(4);
    for (int32_t count = 1; count <= 3000; count = 3 * count + 2) {
        double *points = malloc(3 * (size_t)count * sizeof *points);
        assert_non_null(points);
        // On a coarse grid, so that many are at the same distance, and many at the same place.
        for (int32_t i = 0; i < 3 * count; i++) points[i] = check_random_index(&random, 9);
        pliant_nearest *nearest = NULL;
        pliant_error err = {""};
        check_ok(pliant_nearest_create(points, count, &nearest, &err), &err);
        for (int i = 0; i < 300; i++) {
            double at[3], best = INFINITY;
            int32_t expected = -1;
            for (int d = 0; d < 3; d++)
                at[d] =
                    i % 2 ? check_random_index(&random, 9) : 12 * check_random_next(&random) - 2;
            for (int32_t p = 0; p < count; p++) {
                double square = 0;
                for (int d = 0; d < 3; d++) square += pow(points[3 * p + d] - at[d], 2);
                if (square < best) {
                    best = square;
                    expected = p;
                }
            }
            assert_int_equal(pliant_nearest_find(nearest, at), expected);
        }
        pliant_nearest_destroy(nearest);
        free(points);
    }
}

// Heavy above, light below, nothing known at the equator: every particle takes the nearest known.
static void particles_take_the_nearest_vertexs_density(void **state)
{
    (void)state;
    check_surface sphere = check_sphere(3);
    const pliant_mesh *mesh = sphere.mesh;
    double *densities = malloc((size_t)mesh->vertex_count * sizeof *densities);
    assert_non_null(densities);
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const double z = mesh->vertices[3 * v + 2];
        densities[v] = fabs(z) < 0.05 ? NAN : z > 0 ? 3000 : 1000;
    }
    const pliant_lattice_data_def plain = {
        .name = "ball", .cells = 12, .half_width = 1, .density = 1};
    pliant_lattice_data_def dense = plain;
    dense.densities = densities;
    pliant_lattice_data *one = lattice_of(mesh, &plain), *two = lattice_of(mesh, &dense);
    for (int32_t i = 0; i < one->particle_count; i++) {
        double x[3], best = INFINITY, expected = 0;
        for (int d = 0; d < 3; d++)
            x[d] = one->voxels->grid.origin[d] + one->voxels->grid.size * one->particles[3 * i + d];
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            double square = 0;
            for (int d = 0; d < 3; d++) square += pow(mesh->vertices[3 * v + d] - x[d], 2);
            if (isnan(densities[v]) || square >= best) continue;
            best = square;
            expected = densities[v];
        }
        check_near((double)two->mass[i] / (double)one->mass[i], expected, 1e-3);
    }
    check_near(two->total_mass / one->total_mass, 2000, 100);
    pliant_lattice_data_destroy(two);
    pliant_lattice_data_destroy(one);
    free(densities);
    check_surface_destroy(&sphere);
}

static void masses_that_no_float_holds_are_refused(void **state)
{
    (void)state;
    pliant_mesh *cube = check_cube();
    const double densities[2] = {1e-44, 1e44};
    for (int i = 0; i < 2; i++) {
        const pliant_lattice_data_def def = {
            .name = "cube", .cells = 2, .half_width = 1, .density = densities[i]};
        pliant_lattice_data *l = NULL;
        pliant_error err = {""};
        assert_int_equal(pliant_lattice_data_create(&def, cube, &l, &err), PLIANT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "particle 0 of 27 weighs"));
        assert_null(l);
    }
    pliant_mesh_destroy(cube);
}

static void density_files_are_read_or_refused_with_the_place(void **state)
{
    (void)state;
    static const struct {
        const char *text, *refusal;
    } cases[] = {
        {"1 2.5 # of the rest\n 3e2\n\n4\n", NULL},
        {"1 2 3\n", "expected 4 densities, one a vertex, found 3"},
        {"1 2 3 4 5\n", "expected 4 densities, one a vertex, found 5"},
        {"1 2\n3 heavy\n", ":2: expected a density over 0 in column 3, found 'heavy'"},
        {"1 2\n0 4\n", ":2: expected a density over 0 in column 1, found '0'"},
        {"1 -2 3 4\n", "expected a density over 0 in column 3, found '-2'"},
        {"1 inf 3 4\n", "expected a density over 0 in column 3, found 'inf'"},
        {"1 nan 3 4\n", "expected a density over 0 in column 3, found 'nan'"},
        {"# nothing\n", "expected 4 densities, one a vertex, found 0"},
    };
    char path[512];
    snprintf(path, sizeof path, "%s/densities", check_folder());
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        fputs(cases[i].text, file);
        fclose(file);
        double densities[4] = {0};
        pliant_error err = {""};
        const pliant_status status = pliant_masses_read(path, 4, densities, &err);
        if (cases[i].refusal) {
            assert_int_equal(status, PLIANT_ERR_FORMAT);
            if (!strstr(err.text, cases[i].refusal)) fail_msg("%s", err.text);
            continue;
        }
        check_ok(status, &err);
        const double expected[4] = {1, 2.5, 300, 4};
        for (int k = 0; k < 4; k++) check_near(densities[k], expected[k], 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_cells_volumes_and_areas_add_up),
        cmocka_unit_test(an_octahedrons_cells_hold_what_samples_say),
        cmocka_unit_test(a_lattice_weighs_what_the_solid_weighs),
        cmocka_unit_test(particles_of_a_box_weigh_what_is_around_them),
        cmocka_unit_test(the_nearest_point_is_that_of_looking_at_all),
        cmocka_unit_test(particles_take_the_nearest_vertexs_density),
        cmocka_unit_test(masses_that_no_float_holds_are_refused),
        cmocka_unit_test(density_files_are_read_or_refused_with_the_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
